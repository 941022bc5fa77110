//! The picture: what is reconstructed from primal and gradients, with light seen directly and with its
//! error.

use crate::denoise::Features;
use crate::film::{Film, Halves};
use crate::image::Image;
use crate::reconstruct::error_estimate::{self, HalfPictures, Halved};
use crate::reconstruct::{self, Alpha, Method, Solution, Source};
use std::time::Instant;

/// A picture with light seen directly.
pub struct Picture {
    /// The picture itself.
    pub image: Image,
    /// Standard error of each pixel; `None` where there are no two halves to compare.
    pub error: Option<Image>,
    /// relMSE without a reference; `None` too where there is nothing in the picture, of which two halves agree
    /// however little they know.
    pub rel_mse: Option<f64>,
    /// How the solver ended.
    pub solution: Solution,
    /// Time to make it, error and all.
    pub seconds: f64,
    /// Of that, what the error took.
    pub seconds_error: f64,
}

/// Light seen directly: of both halves, and of all samples.
pub struct Direct {
    /// Means of half A and of half B.
    pub halves: HalfPictures,
    /// Mean of all samples.
    pub all: Image,
}

/// Makes the picture and estimates its error, which nobody knows of a black picture. Works on the current pool.
pub fn make(method: Method, source: &Source, direct: &Direct) -> Picture {
    let start = Instant::now();
    let made = reconstruct::run(method, source);
    let made_at = Instant::now();
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
    let black = image.channels.iter().flatten().all(|&v| v == 0.0);
    Picture {
        rel_mse: error.as_ref().map(|e| e.rel_mse).filter(|_| !black),
        image,
        error: error.map(|e| e.standard),
        solution: made.solution,
        seconds: start.elapsed().as_secs_f64(),
        seconds_error: made.seconds_halves + made_at.elapsed().as_secs_f64(),
    }
}

/// The picture that the film holds. Works on the current pool.
pub fn of_film(film: &Film, method: Method) -> Picture {
    let features = method.denoises().then(|| {
        let hits = film.first_hits();
        Features {
            albedo: hits.albedo,
            normal: hits.normal,
        }
    });
    let source = Source {
        size: (film.window.width as usize, film.window.height as usize),
        samples: film.samples,
        planes: &|half, channel| film.planes([Halves::A, Halves::B][half], channel),
        features: features.as_ref(),
    };
    let direct = Direct {
        halves: HalfPictures::Alike([Halves::A, Halves::B].map(|half| film.direct(half))),
        all: film.direct(Halves::Both),
    };
    let mut picture = make(method, &source, &direct);
    if !film.shows_something() {
        picture.rel_mse = None;
    }
    picture
}

/// As the flags have it, for the header and the summary: the name, and α where there is one.
pub fn describe(method: Method) -> (&'static str, String) {
    let alpha = match method {
        Method::L2(Alpha::Fixed(alpha)) | Method::L1(Alpha::Fixed(alpha)) => alpha.to_string(),
        Method::L2(Alpha::Auto) | Method::L1(Alpha::Auto) => "auto".into(),
        _ => String::new(),
    };
    (method.kind().name(), alpha)
}
