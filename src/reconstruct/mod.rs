//! Reconstruction: the picture whose values fit the primal and whose differences fit dx and dy, by a
//! screened Poisson equation (Kettunen et al. 2015, section 4).
//!
#![doc = include_str!("solve.md")]

mod blur;
mod conjugate_gradient;
mod dct;
pub mod error_estimate;
mod guided;
pub mod l1;
pub mod l2;
mod mix;
mod multigrid;
mod weighted;
mod witness;

use crate::denoise::{Denoiser, Features};
use crate::error::Result;
use crate::estimate::Planes;
use crate::image::Image;
use clap::ValueEnum;
use error_estimate::HalfPictures;
use std::time::Instant;

/// The ways to make a picture, by name.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, ValueEnum)]
pub enum Kind {
    /// Least squares, each value weighted by its own variance; dots of one half of the samples go by the other half.
    Weighted,
    /// Least squares with one weight, exactly; unbiased.
    L2,
    /// Least absolute residuals; robust, slightly biased.
    L1,
    /// Weighted, with Open Image Denoise as a witness of differences, as far as the samples believe it.
    Guided,
    /// The mean of weighted and denoised pictures, pixel by pixel by their errors; nearly unbiased.
    Mix,
    /// The primal, denoised by Open Image Denoise; biased.
    Oidn,
    /// The primal as it is.
    None,
}

/// How the picture is made, with all that needs.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Method {
    /// Least squares, each value weighted by its own variance.
    Weighted,
    /// Least squares with one weight.
    L2(Alpha),
    /// Least absolute residuals with one weight.
    L1(Alpha),
    /// Weighted, with a denoiser as a witness of the differences.
    Guided(&'static Denoiser),
    /// The mean of weighted and denoised pictures, by their errors.
    Mix(&'static Denoiser),
    /// The primal, denoised.
    Denoised(&'static Denoiser),
    /// The primal as it is.
    Primal,
}

/// What is to be known of a reconstruction.
struct Facts {
    /// On the command line and in files.
    name: &'static str,
    /// Its name in charts where paths have no differences; `None` if it needs them.
    after_pt: Option<&'static str>,
    needs_halves: bool,
    has_alpha: bool,
    denoises: bool,
    /// Whether the picture is linear in primal and differences.
    is_linear: bool,
    /// Whether its bias is more than a fraction of its error, so that the estimate of the error has to see it.
    is_biased: bool,
}

impl Kind {
    const fn facts(self) -> Facts {
        let weighted = Facts {
            name: "weighted",
            after_pt: None,
            needs_halves: true,
            has_alpha: false,
            denoises: false,
            is_linear: false,
            is_biased: false,
        };
        match self {
            Kind::Weighted => weighted,
            Kind::L2 => Facts {
                name: "l2",
                is_linear: true,
                needs_halves: false,
                has_alpha: true,
                ..weighted
            },
            Kind::L1 => Facts {
                name: "l1",
                needs_halves: false,
                has_alpha: true,
                ..weighted
            },
            Kind::Guided => Facts {
                name: "guided",
                denoises: true,
                is_biased: true,
                ..weighted
            },
            Kind::Mix => Facts {
                name: "mix",
                denoises: true,
                is_biased: true,
                ..weighted
            },
            Kind::Oidn => Facts {
                name: "oidn",
                after_pt: Some("pt+oidn"),
                needs_halves: false,
                denoises: true,
                is_biased: true,
                ..weighted
            },
            Kind::None => Facts {
                name: "none",
                after_pt: Some("pt"),
                is_linear: true,
                needs_halves: false,
                ..weighted
            },
        }
    }

    /// Its name on the command line and in files.
    pub fn name(self) -> &'static str {
        self.facts().name
    }

    /// Its name in charts after path tracing; `None` if it needs differences.
    pub fn after_pt(self) -> Option<&'static str> {
        self.facts().after_pt
    }

    /// Whether α matters.
    pub fn has_alpha(self) -> bool {
        self.facts().has_alpha
    }

    /// Whether it needs differences.
    pub fn needs_gradients(self) -> bool {
        self.facts().after_pt.is_none()
    }

    /// Whether it needs two halves of the samples.
    pub fn needs_halves(self) -> bool {
        self.facts().needs_halves
    }

    /// The names of those of which `is_one` says so, as a sentence has them.
    pub fn names(mut is_one: impl FnMut(Kind) -> bool) -> String {
        let all = Kind::value_variants().iter();
        let names: Vec<&str> = all.filter(|k| is_one(**k)).map(|k| k.name()).collect();
        names.join(" and ")
    }

    /// It with all that it needs: `alpha`, the paper's if absent, and a denoiser of so many threads; an error where that
    /// is not there.
    pub fn method(self, alpha: Option<Alpha>, threads: usize) -> Result<Method> {
        let alpha = alpha.unwrap_or(Alpha::Fixed(PAPER_ALPHA));
        Ok(match self {
            Kind::Weighted => Method::Weighted,
            Kind::L2 => Method::L2(alpha),
            Kind::L1 => Method::L1(alpha),
            Kind::Guided => Method::Guided(Denoiser::get(threads)?),
            Kind::Mix => Method::Mix(Denoiser::get(threads)?),
            Kind::Oidn => Method::Denoised(Denoiser::get(threads)?),
            Kind::None => Method::Primal,
        })
    }
}

impl Method {
    /// Which way it is.
    pub fn kind(&self) -> Kind {
        match self {
            Method::Weighted => Kind::Weighted,
            Method::L2(_) => Kind::L2,
            Method::L1(_) => Kind::L1,
            Method::Guided(_) => Kind::Guided,
            Method::Mix(_) => Kind::Mix,
            Method::Denoised(_) => Kind::Oidn,
            Method::Primal => Kind::None,
        }
    }

    /// Whether a denoiser has a part in it.
    pub fn denoises(&self) -> bool {
        self.kind().facts().denoises
    }
}

/// The weight α of the primal against the differences.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Alpha {
    /// This value, ≥ 0.
    Fixed(f32),
    /// By the variances: α² = ‖G‖²/‖F‖².
    Auto,
}

/// The paper's α.
pub const PAPER_ALPHA: f32 = 0.2;

/// What a render or a file has to reconstruct from.
pub struct Source<'a> {
    /// Pixels across and down.
    pub size: (usize, usize),
    /// Samples of a pixel in each of the two independent halves. A source without halves has all in the
    /// first.
    pub samples: [u64; 2],
    /// Estimates of a half (0 or 1), by channel (0 is red).
    pub planes: &'a (dyn Fn(usize, usize) -> Planes + Sync),
    /// What a denoiser may know beside the primal.
    pub features: Option<&'a Features>,
}

/// A picture, with what is known of its error.
#[derive(Clone, Debug)]
pub struct Reconstruction {
    /// The picture, without light seen directly.
    pub picture: Image,
    /// Of either half alone; `None` where one half has no samples.
    pub halves: Option<HalfPictures>,
    /// How the solver ended.
    pub solution: Solution,
    /// Seconds that went into `halves` alone.
    pub seconds_halves: f64,
}

/// What is to be fitted: primal and differences, each without light seen directly.
#[derive(Clone, Copy, Debug)]
pub struct Problem<'a> {
    /// The path-traced image.
    pub primal: &'a Image,
    /// Differences to the right neighbour; the last column does not count.
    pub dx: &'a Image,
    /// Differences to the lower neighbour; the last row does not count.
    pub dy: &'a Image,
}

/// How a solver ended.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Solution {
    /// Iterations of conjugate gradients, over all channels and outer rounds; 0 for a direct solve.
    pub iterations: usize,
    /// What is left of the error of the primal as the solution, as ‖M⁻¹r‖ measures it: the largest over
    /// the channels; 0 for a direct solve.
    pub residual: f64,
}

impl std::ops::AddAssign for Solution {
    /// Both, one after the other.
    fn add_assign(&mut self, other: Self) {
        self.iterations += other.iterations;
        self.residual = self.residual.max(other.residual);
    }
}

/// The images of a half, or of all samples.
struct Images {
    primal: Image,
    dx: Image,
    dy: Image,
}

impl Images {
    fn problem(&self) -> Problem<'_> {
        Problem {
            primal: &self.primal,
            dx: &self.dx,
            dy: &self.dy,
        }
    }
}

impl Source<'_> {
    /// Whether there are two halves.
    fn has_halves(&self) -> bool {
        self.samples.iter().all(|&n| n > 0)
    }

    fn images(&self, half: usize) -> Images {
        let [r, g, b] = [0, 1, 2].map(|channel| (self.planes)(half, channel));
        let (width, height) = self.size;
        let image = |channels| Image {
            width,
            height,
            channels,
        };
        Images {
            primal: image([r.primal, g.primal, b.primal]),
            dx: image([r.dx, g.dx, b.dx]),
            dy: image([r.dy, g.dy, b.dy]),
        }
    }

    /// The mean of two images by the halves' samples.
    fn merge(&self, [a, b]: &[Image; 2]) -> Image {
        let [na, nb] = self.samples.map(|n| n as f32);
        let share = nb / (na + nb).max(1.0);
        Image {
            width: a.width,
            height: a.height,
            channels: std::array::from_fn(|c| {
                let pairs = a.channels[c].iter().zip(&b.channels[c]);
                pairs.map(|(a, b)| a + (b - a) * share).collect()
            }),
        }
    }

    /// ‖G‖²/‖F‖² from the variances, as a root: what α should be: then both count by their variance.
    fn alpha(&self, alpha: Alpha) -> f32 {
        match alpha {
            Alpha::Fixed(alpha) => alpha,
            Alpha::Auto => {
                let sum = |v: &[f32]| v.iter().map(|&v| f64::from(v)).sum::<f64>();
                let (mut primal, mut differences) = (0.0, 0.0);
                for half in (0..2).filter(|&half| self.samples[half] > 0) {
                    for channel in 0..3 {
                        let p = (self.planes)(half, channel);
                        primal += sum(&p.primal_variance);
                        differences += 0.5 * (sum(&p.dx_variance) + sum(&p.dy_variance));
                    }
                }
                let alpha = (differences / primal).sqrt() as f32;
                if alpha.is_finite() && alpha > 0.0 {
                    alpha
                } else {
                    PAPER_ALPHA
                }
            }
        }
    }
}

/// Makes the picture. [`Method::Weighted`] needs two samples in each half; with fewer it is L2, and what builds on it
/// is the denoised primal.
pub fn run(method: Method, source: &Source) -> Reconstruction {
    let few = source.samples.iter().any(|&n| n < weighted::LEAST_SAMPLES);
    let method = match method {
        Method::Weighted if few => Method::L2(Alpha::Fixed(PAPER_ALPHA)),
        Method::Guided(denoiser) | Method::Mix(denoiser) if few => Method::Denoised(denoiser),
        Method::Weighted => return weighted::solve(source),
        Method::Guided(denoiser) => return guided::solve(source, denoiser),
        Method::Mix(denoiser) => return mix::solve(source, denoiser),
        method => method,
    };
    let solve = |images: Images| match method {
        Method::L2(alpha) => {
            let picture = l2::solve(&images.problem(), source.alpha(alpha));
            (picture, Solution::default())
        }
        Method::L1(alpha) => l1::solve(&images.problem(), source.alpha(alpha)),
        Method::Denoised(denoiser) => {
            let picture = denoiser.denoise(&images.primal, source.features);
            (picture, Solution::default())
        }
        // The others have been made by now, or need both halves.
        Method::Primal | Method::Weighted | Method::Guided(_) | Method::Mix(_) => {
            (images.primal, Solution::default())
        }
    };
    if !source.has_halves() {
        let half = usize::from(source.samples[0] == 0);
        let (picture, solution) = solve(source.images(half));
        return Reconstruction {
            picture,
            halves: None,
            solution,
            seconds_halves: 0.0,
        };
    }
    let start = Instant::now();
    let halves = [0, 1].map(|half| solve(source.images(half)).0);
    // Of what is linear in the values the halves are no detour.
    let Facts {
        is_linear,
        is_biased,
        ..
    } = method.kind().facts();
    let seconds_halves = if is_linear {
        0.0
    } else {
        start.elapsed().as_secs_f64()
    };
    let (picture, solution) = if is_linear {
        (source.merge(&halves), Solution::default())
    } else {
        let [a, b] = [0, 1].map(|half| source.images(half));
        solve(Images {
            primal: source.merge(&[a.primal, b.primal]),
            dx: source.merge(&[a.dx, b.dx]),
            dy: source.merge(&[a.dy, b.dy]),
        })
    };
    let halves = if is_biased {
        HalfPictures::Biased {
            halves,
            unbiased: [0, 1].map(|half| source.images(half).primal),
        }
    } else {
        HalfPictures::Alike(halves)
    };
    Reconstruction {
        picture,
        halves: Some(halves),
        solution,
        seconds_halves,
    }
}
