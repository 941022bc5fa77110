//! Scattering at a surface: what each kind of material does with light, in local coordinates.
//!
//! Directions point away from the surface; `wo` is towards the camera, `wi` towards the light; `z` is
//! the shading normal on the side of the winding. Returned values include the cosine at `wi`.

mod conductor;
mod dielectric;
mod evals;
pub mod fresnel;
pub mod ggx;
pub mod half_vector;
pub mod lambert;
pub mod packed;
pub mod plastic;
mod thin;

pub use evals::{Evals, Samples};

use crate::lanes::Vector;
use dielectric::Glass;
use glam::Vec3;
use plastic::{Coat, Plastic};
use serde::Serialize;
use thin::Pane;

/// How a material scatters light.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub enum Bsdf {
    /// Lambert, two-sided.
    Lambert {
        /// Reflectance in [0, 1].
        albedo: Vec3,
    },
    /// A perfectly smooth conductor, two-sided.
    Mirror {
        /// Reflectance at normal incidence.
        f0: Vec3,
    },
    /// A GGX conductor, two-sided.
    Conductor {
        /// Reflectance at normal incidence.
        f0: Vec3,
        /// GGX roughness, > 0.
        alpha: f32,
    },
    /// A perfectly smooth dielectric.
    Glass {
        /// Refractive index, inside over outside.
        ior: f32,
        /// Factor on transmitted light, at each boundary.
        tint: Vec3,
    },
    /// A GGX dielectric.
    RoughGlass {
        /// Refractive index, inside over outside; not 1.
        ior: f32,
        /// GGX roughness, > 0.
        alpha: f32,
        /// Factor on transmitted light, at each boundary.
        tint: Vec3,
    },
    /// A perfectly smooth pane: both boundaries of a thin dielectric in one.
    Thin {
        /// Refractive index, pane over air.
        ior: f32,
        /// What one way through the pane leaves of light.
        tint: Vec3,
    },
    /// The same with GGX microfacets.
    RoughThin {
        /// Refractive index, pane over air.
        ior: f32,
        /// GGX roughness, > 0.
        alpha: f32,
        /// What one way through the pane leaves of light.
        tint: Vec3,
    },
    /// A Lambert surface under a coat, two-sided; it may let light pass straight through.
    Plastic {
        /// Reflectance of the Lambert part, in [0, 1].
        albedo: Vec3,
        /// What lies over it.
        coat: Coat,
    },
}

/// The values of a material that textures may give, point by point.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct Parameters {
    /// What [`Bsdf::colour`] is.
    pub colour: Vec3,
    /// GGX roughness where there is one.
    pub alpha: f32,
    /// Factor on the reflectance of plastic's coat.
    pub specular: f32,
    /// Share of plastic that is metal.
    pub metallic: f32,
}

/// The side to which light is scattered.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Lobe {
    /// To the side it came from.
    Reflection,
    /// Through the surface.
    Transmission,
}

/// A BSDF for one pair of directions.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Eval {
    /// The BSDF times the cosine at `wi`.
    pub value: Vec3,
    /// Density per solid angle with which [`Bsdf::sample`] draws `wi`. For a single direction: the
    /// probability of its lobe, and `value` is the coefficient of the Dirac delta.
    pub pdf: f32,
}

/// A sampled direction.
#[derive(Clone, Copy, Debug)]
pub struct Sampled {
    /// The direction, unit.
    pub wi: Vec3,
    /// As in [`Eval`].
    pub value: Vec3,
    /// As in [`Eval`], never 0.
    pub pdf: f32,
    /// The side it goes to.
    pub lobe: Lobe,
    /// Whether it is a single direction (a Dirac delta).
    pub delta: bool,
}

impl Bsdf {
    /// Value and density for `wo` → `wi`, single directions left out. `None` where sampling cannot produce
    /// `wi` at all (wrong side, no such lobe): a path through such a pair is outside the sampled path space.
    #[inline]
    pub fn eval(&self, wo: Vec3, wi: Vec3) -> Option<Eval> {
        let (wo, wi) = (Vector::<f32>::from(wo), Vector::from(wi));
        let eval = match *self {
            Bsdf::Lambert { albedo } => lambert::eval(albedo.into(), wo.z, wi.z),
            Bsdf::Conductor { f0, alpha } => conductor::eval(f0.into(), alpha, wo, wi),
            Bsdf::RoughGlass { ior, alpha, tint } => Glass::one(ior, tint).eval(alpha, wo, wi),
            Bsdf::RoughThin { ior, alpha, tint } => Pane::one(ior, tint).eval(alpha, wo, wi),
            Bsdf::Plastic { albedo, ref coat } => Plastic::one(albedo, coat).eval(wo, wi),
            Bsdf::Mirror { .. } | Bsdf::Glass { .. } | Bsdf::Thin { .. } => return None,
        };
        eval.held()
    }

    /// The single direction of a smooth material, of plastic's smooth coat, or straight through plastic, seen from
    /// `wo`: coefficient and probability. `None` for a lobe that the material does not have.
    #[inline]
    pub fn eval_delta(&self, wo: Vec3, lobe: Lobe) -> Option<Eval> {
        let (wo, transmits) = (Vector::<f32>::from(wo), lobe == Lobe::Transmission);
        let eval = match *self {
            Bsdf::Mirror { f0 } if !transmits => conductor::eval_mirror(f0.into(), wo),
            Bsdf::Glass { ior, tint } => Glass::one(ior, tint).eval_smooth(wo, transmits),
            Bsdf::Thin { ior, tint } => Pane::one(ior, tint).eval_smooth(wo, transmits),
            Bsdf::Plastic { albedo, ref coat } => {
                Plastic::one(albedo, coat).eval_single(wo, transmits)
            }
            Bsdf::Mirror { .. }
            | Bsdf::Lambert { .. }
            | Bsdf::Conductor { .. }
            | Bsdf::RoughGlass { .. }
            | Bsdf::RoughThin { .. } => return None,
        };
        eval.held()
    }

    /// Draws `wi` with `u` in [0, 1)³: direction (0, 1) and lobe (2). `None`: the path ends here.
    #[inline]
    pub fn sample(&self, wo: Vec3, u: [f32; 3]) -> Option<Sampled> {
        let [u0, u1, u_lobe] = u;
        let (wo, direction) = (Vector::<f32>::from(wo), [u0, u1]);
        let samples = match *self {
            Bsdf::Lambert { albedo } => lambert::sample(albedo.into(), wo.z, direction),
            Bsdf::Mirror { f0 } => conductor::sample_mirror(f0.into(), wo),
            Bsdf::Conductor { f0, alpha } => conductor::sample(f0.into(), alpha, wo, direction),
            Bsdf::Glass { ior, tint } => Glass::one(ior, tint).sample_smooth(wo, u_lobe),
            Bsdf::RoughGlass { ior, alpha, tint } => {
                Glass::one(ior, tint).sample(alpha, wo, direction, u_lobe)
            }
            Bsdf::Thin { ior, tint } => Pane::one(ior, tint).sample_smooth(wo, u_lobe),
            Bsdf::RoughThin { ior, alpha, tint } => {
                Pane::one(ior, tint).sample(alpha, wo, direction, u_lobe)
            }
            Bsdf::Plastic { albedo, ref coat } => {
                Plastic::one(albedo, coat).sample(wo, direction, u_lobe)
            }
        };
        samples.leaves(wo).held()
    }

    /// The refractive index inside over outside; 1 for what has no inside.
    #[inline]
    pub fn ior(&self) -> f32 {
        match *self {
            Bsdf::Glass { ior, .. } | Bsdf::RoughGlass { ior, .. } => ior,
            Bsdf::Lambert { .. } | Bsdf::Plastic { .. } => 1.0,
            Bsdf::Mirror { .. } | Bsdf::Conductor { .. } => 1.0,
            Bsdf::Thin { .. } | Bsdf::RoughThin { .. } => 1.0,
        }
    }

    /// Whether the material has this lobe.
    #[inline]
    pub fn has(&self, lobe: Lobe) -> bool {
        lobe == Lobe::Reflection
            || match self {
                Bsdf::Glass { .. } | Bsdf::RoughGlass { .. } => true,
                Bsdf::Thin { .. } | Bsdf::RoughThin { .. } => true,
                Bsdf::Plastic { coat, .. } => coat.opacity < 1.0,
                Bsdf::Lambert { .. } | Bsdf::Mirror { .. } | Bsdf::Conductor { .. } => false,
            }
    }

    /// The colour that textures may replace: of Lambert parts and metals the reflectance, of glass the
    /// tint.
    #[inline]
    pub fn colour(&self) -> Vec3 {
        match *self {
            Bsdf::Lambert { albedo } | Bsdf::Plastic { albedo, .. } => albedo,
            Bsdf::Mirror { f0 } | Bsdf::Conductor { f0, .. } => f0,
            Bsdf::Glass { tint, .. } | Bsdf::RoughGlass { tint, .. } => tint,
            Bsdf::Thin { tint, .. } | Bsdf::RoughThin { tint, .. } => tint,
        }
    }

    /// What textures would have to say to leave it as it is.
    pub fn parameters(&self) -> Parameters {
        let (alpha, metallic) = match *self {
            Bsdf::Lambert { .. } | Bsdf::Mirror { .. } => (0.0, 0.0),
            Bsdf::Glass { .. } | Bsdf::Thin { .. } => (0.0, 0.0),
            Bsdf::Conductor { alpha, .. } | Bsdf::RoughGlass { alpha, .. } => (alpha, 0.0),
            Bsdf::RoughThin { alpha, .. } => (alpha, 0.0),
            Bsdf::Plastic { coat, .. } => (coat.alpha, coat.metallic),
        };
        Parameters {
            colour: self.colour(),
            alpha,
            specular: 1.0,
            metallic,
        }
    }

    /// The same with these values.
    #[inline]
    pub fn with(&self, parameters: &Parameters) -> Self {
        let Parameters {
            colour,
            alpha,
            specular,
            metallic,
        } = *parameters;
        match *self {
            Bsdf::Lambert { .. } => Bsdf::Lambert { albedo: colour },
            Bsdf::Mirror { .. } => Bsdf::Mirror { f0: colour },
            Bsdf::Conductor { .. } => Bsdf::Conductor { f0: colour, alpha },
            Bsdf::Glass { ior, .. } => Bsdf::Glass { ior, tint: colour },
            Bsdf::RoughGlass { ior, .. } => Bsdf::RoughGlass {
                ior,
                alpha,
                tint: colour,
            },
            Bsdf::Thin { ior, .. } => Bsdf::Thin { ior, tint: colour },
            Bsdf::RoughThin { ior, .. } => Bsdf::RoughThin {
                ior,
                alpha,
                tint: colour,
            },
            Bsdf::Plastic { mut coat, .. } => {
                coat.alpha = alpha;
                coat.tint *= specular;
                coat.metallic = metallic;
                if coat.metal_is_albedo {
                    coat.metal = colour;
                }
                Bsdf::Plastic {
                    albedo: colour,
                    coat,
                }
            }
        }
    }

    /// Of glass, the same as a thin pane: what each of its two boundaries leaves of light, the pane leaves at
    /// once.
    pub fn thin(&self) -> Option<Self> {
        match *self {
            Bsdf::Glass { ior, tint } => Some(Bsdf::Thin {
                ior,
                tint: tint * tint,
            }),
            Bsdf::RoughGlass { ior, alpha, tint } => Some(Bsdf::RoughThin {
                ior,
                alpha,
                tint: tint * tint,
            }),
            Bsdf::Lambert { .. } | Bsdf::Plastic { .. } => None,
            Bsdf::Mirror { .. } | Bsdf::Conductor { .. } => None,
            Bsdf::Thin { .. } | Bsdf::RoughThin { .. } => None,
        }
    }

    /// Share of the light that is scattered on, by colour channel; exact for Lambert, about so for plastic,
    /// an upper bound (1, or the reflectance at normal incidence) otherwise. For the albedo buffer and for
    /// roulette.
    pub fn albedo(&self) -> Vec3 {
        match *self {
            Bsdf::Plastic { albedo, coat } => coat.total(albedo),
            Bsdf::Lambert { .. } | Bsdf::Mirror { .. } | Bsdf::Conductor { .. } => self.colour(),
            Bsdf::Glass { .. } | Bsdf::RoughGlass { .. } => self.colour(),
            Bsdf::Thin { .. } | Bsdf::RoughThin { .. } => self.colour(),
        }
    }

    /// Roughness that decides the class rough or specular: 1 for what has a Lambert part, 0 for deltas, else the GGX
    /// alpha; for rough glass scaled by how strongly it bends, since at an index near 1 what passes
    /// keeps its direction however rough the surface is. What lets light pass counts twice: no walk finds light by
    /// it, as by metal, so the class specular pays up to a smaller alpha.
    pub fn roughness(&self) -> f32 {
        match *self {
            Bsdf::Lambert { .. } | Bsdf::Plastic { .. } => 1.0,
            Bsdf::Mirror { .. } | Bsdf::Glass { .. } | Bsdf::Thin { .. } => 0.0,
            Bsdf::Conductor { alpha, .. } => alpha,
            Bsdf::RoughThin { alpha, .. } => 2.0 * alpha,
            Bsdf::RoughGlass { ior, alpha, .. } => 2.0 * alpha * ((ior - 1.0).abs() * 4.0).min(1.0),
        }
    }
}
