//! Plastic: a Lambert surface under a dielectric coat, smooth or rough (GGX), and partly metallic surfaces,
//! whose coat is in part a conductor's. Two-sided. Schlick's reflectance throughout.
//!
//! What the coat does not reflect, seen from either direction, goes to the Lambert part (Kelemen and
//! Szirmay-Kalos 2001): (1 - E(ω_o)) albedo (1 - E(ω_i)) / (π (1 - E_mean)), where E is the coat's share of
//! the light from a direction. So no energy is gained, and with a white Lambert part none is lost.
//!
//! A surface that is not opaque lets a part of what the coat does not reflect pass straight through, and the
//! Lambert part has the rest.

use super::fresnel::{fifth_power, reflect, schlick};
use super::packed::PackedParameters;
use super::{Evals, Samples, ggx};
use crate::lanes::{Float, LANES, Mask, Vector, positive};
use crate::warp;
use glam::Vec3;
use serde::Serialize;
use std::f32::consts::FRAC_1_PI;
use std::sync::LazyLock;

/// What lies over the Lambert part.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct Coat {
    /// The dielectric's reflectance at normal incidence.
    pub f0: f32,
    /// Factor on the dielectric's reflectance.
    pub tint: Vec3,
    /// Share of the surface that is metal, in [0, 1].
    pub metallic: f32,
    /// The metal's reflectance at normal incidence.
    pub metal: Vec3,
    /// Whether that is the colour of the Lambert part, also where a texture gives it.
    pub metal_is_albedo: bool,
    /// GGX roughness; 0 for a smooth coat, else at least [`SMOOTHEST`].
    pub alpha: f32,
    /// Share of what the coat does not reflect that the Lambert part has, in [0, 1].
    pub opacity: f32,
    /// Share of it that passes straight through; 0 where `opacity` is 1.
    pub through: Vec3,
}

/// Coats smoother than this are perfectly smooth: then their reflection is a single direction, which the
/// shift copies, while the Lambert part is reconnected. In between they would be in each other's way.
pub const SMOOTHEST: f32 = 0.01;

impl Coat {
    /// No coat: the Lambert part is bare, and as dense as `opacity` says.
    pub const NONE: Self = Self {
        f0: 0.0,
        tint: Vec3::ZERO,
        metallic: 0.0,
        metal: Vec3::ZERO,
        metal_is_albedo: false,
        alpha: 0.0,
        opacity: 1.0,
        through: Vec3::ZERO,
    };

    /// Whether it reflects into a single direction.
    #[inline]
    pub fn is_smooth(&self) -> bool {
        self.alpha == 0.0
    }

    /// What is left in all of light from everywhere: about the coat's and the Lambert part's shares, and what
    /// passes through.
    pub fn total(&self, albedo: Vec3) -> Vec3 {
        let mean = Vec3::from(Coats::<f32>::of(&[self; LANES]).mean_share());
        let rest = 1.0 - self.metallic;
        let below = albedo * self.opacity + self.through;
        (mean + (Vec3::ONE - mean) * below) * rest + self.metal * self.metallic
    }
}

/// Plastic in lanes.
#[derive(Clone, Copy, Debug)]
pub(super) struct Plastic<F> {
    pub(super) albedo: Vector<F>,
    pub(super) coat: Coats<F>,
}

/// [`Coat`] in lanes.
#[derive(Clone, Copy, Debug)]
pub(super) struct Coats<F> {
    f0: F,
    tint: Vector<F>,
    metallic: F,
    metal: Vector<F>,
    alpha: F,
    opacity: F,
    through: Vector<F>,
}

impl<F: Float> Coats<F> {
    #[inline(always)]
    pub(super) fn of(coats: &[&Coat; LANES]) -> Self {
        Self {
            f0: F::from_lanes(|lane| coats[lane].f0),
            tint: Vector::from_lanes(|lane| coats[lane].tint),
            metallic: F::from_lanes(|lane| coats[lane].metallic),
            metal: Vector::from_lanes(|lane| coats[lane].metal),
            alpha: F::from_lanes(|lane| coats[lane].alpha),
            opacity: F::from_lanes(|lane| coats[lane].opacity),
            through: Vector::from_lanes(|lane| coats[lane].through),
        }
    }

    /// These `coats` with what textures give.
    #[inline(always)]
    pub(super) fn with(self, coats: &[&Coat; LANES], parameters: &PackedParameters<F>) -> Self {
        let is_albedo = F::from_lanes(|lane| f32::from(u8::from(coats[lane].metal_is_albedo)));
        Self {
            tint: self.tint * parameters.specular,
            metal: Vector::select(positive(is_albedo), parameters.colour, self.metal),
            alpha: parameters.alpha,
            metallic: parameters.metallic,
            ..self
        }
    }

    /// Where it reflects into a single direction.
    #[inline(always)]
    fn is_smooth(&self) -> F::Mask {
        self.alpha.equals(F::ZERO)
    }

    /// Reflectance of a facet of the coat, dielectric and metal.
    #[inline(always)]
    fn reflectance(&self, cos: F) -> Vector<F> {
        let dielectric = self.tint * schlick(Vector::grey(self.f0), cos).x;
        dielectric * (F::ONE - self.metallic) + schlick(self.metal, cos) * self.metallic
    }

    /// The share of light from directions with these cosines that the dielectric part reflects in all.
    #[inline(always)]
    fn share(&self, cos: F) -> Vector<F> {
        let m5 = fifth_power(F::ONE - cos);
        let smooth = self.is_smooth();
        let (mut a, mut b) = (F::ONE - m5, m5);
        if !smooth.all() {
            let rough = pairs(|lane| SHARES.at(cos.lane(lane), self.alpha.lane(lane)));
            (a, b) = (F::select(smooth, a, rough.0), F::select(smooth, b, rough.1));
        }
        self.tint * (self.f0 * a + b)
    }

    /// The mean of [`Coats::share`] over the hemisphere, by projected solid angle.
    #[inline(always)]
    fn mean_share(&self) -> Vector<F> {
        let smooth = self.is_smooth();
        let (mut a, mut b) = (F::splat(20.0 / 21.0), F::splat(1.0 / 21.0));
        if !smooth.all() {
            let rough = pairs(|lane| SHARES.mean(self.alpha.lane(lane)));
            (a, b) = (F::select(smooth, a, rough.0), F::select(smooth, b, rough.1));
        }
        self.tint * (self.f0 * a + b)
    }
}

/// The pairs of numbers that `pair` gives for each lane.
#[inline(always)]
fn pairs<F: Float>(pair: impl Fn(usize) -> (f32, f32)) -> (F, F) {
    let pairs = Vector::<F>::from_lanes(|lane| {
        let (a, b) = pair(lane);
        Vec3::new(a, b, 0.0)
    });
    (pairs.x, pairs.y)
}

impl Plastic<f32> {
    #[inline(always)]
    pub(super) fn one(albedo: Vec3, coat: &Coat) -> Self {
        Self {
            albedo: albedo.into(),
            coat: Coats::of(&[coat; LANES]),
        }
    }
}

impl<F: Float> Plastic<F> {
    /// Probabilities of sampling the coat, and of going straight through, seen from directions with these cosines,
    /// where the coat has these shares: about their shares of what the surface leaves of light.
    #[inline(always)]
    fn probabilities(&self, share: Vector<F>, cos: F) -> (F, F) {
        let Self { albedo, coat } = self;
        let rest = F::ONE - coat.metallic;
        let of_coat = share * rest + schlick(coat.metal, cos) * coat.metallic;
        let of_coat = of_coat.element_sum();
        let below = |part: Vector<F>| ((Vector::ONE - share) * part * rest).element_sum();
        let (diffuse, through) = (below(*albedo * coat.opacity), below(coat.through));
        let sum = of_coat + diffuse + through;
        let there = positive(sum);
        ((of_coat / sum).only(there), (through / sum).only(there))
    }

    /// The Lambert part alone, with its cosine; no probability of choice inside. `share_o` is the coat's share
    /// seen from the other direction.
    #[inline(always)]
    fn diffuse(&self, share_o: Vector<F>, cos_i: F) -> Vector<F> {
        let coat = &self.coat;
        let through = (Vector::ONE - share_o) * (Vector::ONE - coat.share(cos_i));
        // Where the coat is white at all angles nothing arrives below it.
        let rest = (Vector::ONE - coat.mean_share()).max(Vector::grey(F::splat(1e-6)));
        let rest = Vector::new(
            self.albedo.x * through.x / rest.x,
            self.albedo.y * through.y / rest.y,
            self.albedo.z * through.z / rest.z,
        );
        rest * ((F::ONE - coat.metallic) * coat.opacity * cos_i * F::splat(FRAC_1_PI))
    }

    /// All that is not a single direction: the Lambert part, and the coat where it is rough.
    #[inline(always)]
    pub(super) fn eval(&self, wo: Vector<F>, wi: Vector<F>) -> Evals<F> {
        let share = self.coat.share(wo.z.magnitude());
        self.eval_by(share, wo, wi)
    }

    /// With the coat's share seen from `wo`.
    #[inline(always)]
    fn eval_by(&self, share: Vector<F>, wo: Vector<F>, wi: Vector<F>) -> Evals<F> {
        let coat = &self.coat;
        let one_side = positive(wo.z * wi.z);
        let (wo, wi) = (wo.upwards(), wi.upwards());
        let (p, through) = self.probabilities(share, wo.z);
        let mut value = self.diffuse(share, wi.z);
        let diffuse = (F::ONE - p - through).larger(F::ZERO);
        let mut pdf = diffuse * wi.z * F::splat(FRAC_1_PI);
        let smooth = coat.is_smooth();
        if !smooth.all() {
            let h = (wo + wi).normalize();
            let d = ggx::density(h, coat.alpha) / (F::splat(4.0) * wo.z);
            let g = ggx::masking_shadowing(wo, wi, coat.alpha);
            let reflected = value + coat.reflectance(wo.dot(h)) * (d * g);
            value = Vector::select(smooth, value, reflected);
            let both = pdf + p * d * ggx::masking(wo, coat.alpha);
            pdf = F::select(smooth, pdf, both);
        }
        Evals {
            value,
            pdf,
            valid: one_side & positive(pdf),
        }
    }

    /// The single directions: straight through where `transmits`, which does not hold where the surface is opaque;
    /// mirrored elsewhere, which does not hold where the coat is rough.
    #[inline(always)]
    pub(super) fn eval_single(&self, wo: Vector<F>, transmits: F::Mask) -> Evals<F> {
        let cos = wo.z.magnitude();
        let share = self.coat.share(cos);
        let probabilities = self.probabilities(share, cos);
        self.single(share, probabilities, cos, transmits)
    }

    /// With the coat's share and the probabilities seen from the direction whose cosine is `cos`.
    #[inline(always)]
    fn single(
        &self,
        share: Vector<F>,
        (of_coat, through): (F, F),
        cos: F,
        transmits: F::Mask,
    ) -> Evals<F> {
        let coat = &self.coat;
        let passing = (Vector::ONE - share) * coat.through * (F::ONE - coat.metallic);
        let pdf = F::select(transmits, through, of_coat);
        Evals {
            value: Vector::select(transmits, passing, coat.reflectance(cos)),
            pdf,
            valid: (transmits | coat.is_smooth()) & positive(pdf),
        }
    }

    #[inline(always)]
    pub(super) fn sample(&self, wo: Vector<F>, u: [F; 2], u_lobe: F) -> Samples<F> {
        let coat = &self.coat;
        let up = wo.upwards();
        let share = coat.share(up.z);
        let probabilities = self.probabilities(share, up.z);
        let of_coat = u_lobe.below(probabilities.0);
        let smooth = coat.is_smooth();
        let mut wi = warp::cosine_hemisphere(u);
        if (of_coat & !smooth).any() {
            let reflected = reflect(up, ggx::sample(up, coat.alpha, u));
            wi = Vector::select(of_coat, reflected, wi);
        }
        wi.z = wi.z * F::ONE.signed_as(wo.z);
        let lobes = self.eval_by(share, wo, wi);

        let transmits = !of_coat & u_lobe.below(probabilities.0 + probabilities.1);
        let delta = (of_coat & smooth) | transmits;
        if !delta.any() {
            return Samples {
                wi,
                eval: lobes,
                transmits,
                delta,
            };
        }
        let mirrored = Vector::new(-wo.x, -wo.y, wo.z);
        let single = self.single(share, probabilities, up.z, transmits);
        Samples {
            wi: Vector::select(delta, Vector::select(transmits, -wo, mirrored), wi),
            eval: Evals::select(delta, single, lobes),
            transmits,
            delta,
        }
    }
}

/// Shares of light that rough coats reflect in all: of a facet reflectance f0 + (1 - f0)(1 - cos)⁵ they
/// are linear in f0, so two tables over cosine and roughness serve all coats. Made when first needed.
struct Shares {
    /// By roughness, then cosine: the factor of f0 and the rest.
    table: Vec<[(f32, f32); COSINES]>,
    /// Means over the hemisphere by roughness.
    means: Vec<(f32, f32)>,
}

const COSINES: usize = 32;
const ALPHAS: usize = 24;
/// Sample points along each side of the square that a share is averaged over.
const SAMPLES: usize = 32;

static SHARES: LazyLock<Shares> = LazyLock::new(Shares::new);

impl Shares {
    fn new() -> Self {
        let table: Vec<[(f32, f32); COSINES]> = (0..ALPHAS)
            .map(|a| {
                let alpha = (a as f32 / (ALPHAS - 1) as f32).powi(2).max(1e-3);
                std::array::from_fn(|c| share(c as f32 / (COSINES - 1) as f32, alpha))
            })
            .collect();
        let means = table.iter().map(mean_of).collect();
        Self { table, means }
    }

    /// Between which entries a coordinate in [0, 1] lies, and where.
    #[inline]
    fn place(x: f32, count: usize) -> (usize, f32) {
        let x = x.clamp(0.0, 1.0) * (count - 1) as f32;
        let index = (x as usize).min(count - 2);
        (index, x - index as f32)
    }

    #[inline]
    fn at(&self, cos: f32, alpha: f32) -> (f32, f32) {
        let (c, fc) = Self::place(cos, COSINES);
        let (a, fa) = Self::place(alpha.sqrt(), ALPHAS);
        let along = |row: &[(f32, f32); COSINES]| mix(row[c], row[c + 1], fc);
        mix(along(&self.table[a]), along(&self.table[a + 1]), fa)
    }

    #[inline]
    fn mean(&self, alpha: f32) -> (f32, f32) {
        let (a, fa) = Self::place(alpha.sqrt(), ALPHAS);
        mix(self.means[a], self.means[a + 1], fa)
    }
}

#[inline]
fn mix(a: (f32, f32), b: (f32, f32), t: f32) -> (f32, f32) {
    (a.0 + (b.0 - a.0) * t, a.1 + (b.1 - a.1) * t)
}

/// The share of one cosine and roughness, averaged over visible normals.
fn share(cos: f32, alpha: f32) -> (f32, f32) {
    let cos = cos.max(1e-3);
    let wo = Vector::new((1.0 - cos * cos).max(0.0).sqrt(), 0.0, cos);
    let (mut all, mut grazing) = (0.0f64, 0.0f64);
    for i in 0..SAMPLES * SAMPLES {
        let u = [i % SAMPLES, i / SAMPLES].map(|k| (k as f32 + 0.5) / SAMPLES as f32);
        let h = ggx::sample(wo, alpha, u);
        let wi = reflect(wo, h);
        if wi.z > 0.0 {
            let weight = ggx::masking_shadowing(wo, wi, alpha) / ggx::masking(wo, alpha);
            all += f64::from(weight);
            grazing += f64::from(weight * (1.0 - wo.dot(h)).clamp(0.0, 1.0).powi(5));
        }
    }
    let n = (SAMPLES * SAMPLES) as f64;
    (((all - grazing) / n) as f32, (grazing / n) as f32)
}

/// The mean over the hemisphere, 2 ∫ share(c) c dc, of what is linear between the entries.
fn mean_of(row: &[(f32, f32); COSINES]) -> (f32, f32) {
    let step = 1.0 / (COSINES - 1) as f32;
    let mut sum = (0.0, 0.0);
    for (c, pair) in row.windows(2).enumerate() {
        // ∫ of a linear function times c over an interval, by Simpson's rule: exact.
        let (low, high) = (c as f32 * step, (c + 1) as f32 * step);
        let middle = mix(pair[0], pair[1], 0.5);
        let simpson = |a: f32, m: f32, b: f32| {
            2.0 * step / 6.0 * (a * low + 2.0 * m * (low + high) + b * high)
        };
        sum.0 += simpson(pair[0].0, middle.0, pair[1].0);
        sum.1 += simpson(pair[0].1, middle.1, pair[1].1);
    }
    sum
}
