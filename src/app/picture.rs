//! The picture from primal and gradients, with its error; what `gdpt render` and `gdpt reconstruct` share.

use crate::cli::Reconstruct;
use crate::error::{Result, Warnings};
use crate::image::Image;
use crate::reconstruct::error_estimate::{self, Estimated, Halved};
use crate::reconstruct::{self, Alpha, Method, PAPER_ALPHA, Solution, Source};
use std::time::Instant;

/// A picture with light seen directly.
pub(super) struct Picture {
    pub(super) image: Image,
    /// `None` where there are no two halves to compare.
    pub(super) error: Option<Estimated>,
    pub(super) solution: Solution,
    pub(super) seconds: f64,
}

/// Light seen directly: of both halves, and of all samples.
pub(super) struct Direct {
    pub(super) halves: [Image; 2],
    pub(super) all: Image,
}

/// Makes the picture and estimates its error. Works on the current pool.
pub(super) fn make(method: Method, source: &Source, direct: &Direct) -> Picture {
    let start = Instant::now();
    let made = reconstruct::run(method, source);
    let error = made.halves.map(|halves| {
        let solved = Halved {
            all: &made.picture,
            halves: &halves,
        };
        let direct = Halved {
            all: &direct.all,
            halves: &direct.halves,
        };
        error_estimate::estimate(solved, direct, source.samples)
    });
    let image = made.picture.plus(&direct.all);
    Picture {
        image,
        error,
        solution: made.solution,
        seconds: start.elapsed().as_secs_f64(),
    }
}

/// The method that the flags name.
pub(super) fn method(
    reconstruct: Reconstruct,
    alpha: Option<Alpha>,
    warnings: &mut Warnings,
) -> Result<Method> {
    if alpha.is_some() && !matches!(reconstruct, Reconstruct::L2 | Reconstruct::L1) {
        warnings.push("--alpha matters for --reconstruct l2 and l1 alone")?;
    }
    let alpha = alpha.unwrap_or(Alpha::Fixed(PAPER_ALPHA));
    Ok(match reconstruct {
        Reconstruct::Weighted => Method::Weighted,
        Reconstruct::L2 => Method::L2(alpha),
        Reconstruct::L1 => Method::L1(alpha),
        Reconstruct::None => Method::Primal,
    })
}

/// As the flags have it, for the header and the summary.
pub(super) fn describe(method: Method) -> (&'static str, String) {
    let text = |alpha| match alpha {
        Alpha::Fixed(alpha) => alpha.to_string(),
        Alpha::Auto => "auto".into(),
    };
    match method {
        Method::Weighted => ("weighted", String::new()),
        Method::L2(alpha) => ("l2", text(alpha)),
        Method::L1(alpha) => ("l1", text(alpha)),
        Method::Primal => ("none", String::new()),
    }
}
