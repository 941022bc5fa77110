//! Plastic: a Lambert surface under a dielectric coat, smooth or rough (GGX), and partly metallic surfaces,
//! whose coat is in part a conductor's. Two-sided. Schlick's reflectance throughout.
//!
//! What the coat does not reflect, seen from either direction, goes to the Lambert part (Kelemen and
//! Szirmay-Kalos 2001): (1 - E(ω_o)) albedo (1 - E(ω_i)) / (π (1 - E_mean)), where E is the coat's share of
//! the light from a direction. So no energy is gained, and with a white Lambert part none is lost.
//!
//! A surface that is not opaque lets a part of what the coat does not reflect pass straight through, and the
//! Lambert part has the rest.

use super::fresnel::{reflect, schlick};
use super::{Eval, Lobe, Sampled, ggx};
use crate::warp;
use glam::Vec3;
use std::f32::consts::FRAC_1_PI;
use std::sync::LazyLock;

/// What lies over the Lambert part.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Coat {
    /// The dielectric's reflectance at normal incidence.
    pub f0: f32,
    /// Factor on the dielectric's reflectance.
    pub tint: Vec3,
    /// Share of the surface that is metal, in [0, 1).
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

    /// Reflectance of a facet of the coat, dielectric and metal.
    #[inline]
    fn reflectance(&self, cos: f32) -> Vec3 {
        let dielectric = self.tint * schlick(Vec3::splat(self.f0), cos).x;
        dielectric * (1.0 - self.metallic) + schlick(self.metal, cos) * self.metallic
    }

    /// The share of light from a direction with this cosine that the dielectric part reflects in all.
    #[inline]
    fn share(&self, cos: f32) -> Vec3 {
        let (a, b) = if self.is_smooth() {
            let m = (1.0 - cos).clamp(0.0, 1.0);
            let m5 = m * m * m * m * m;
            (1.0 - m5, m5)
        } else {
            SHARES.at(cos, self.alpha)
        };
        self.tint * (self.f0 * a + b)
    }

    /// The mean of [`Coat::share`] over the hemisphere, by projected solid angle.
    #[inline]
    fn mean_share(&self) -> Vec3 {
        let (a, b) = if self.is_smooth() {
            (20.0 / 21.0, 1.0 / 21.0)
        } else {
            SHARES.mean(self.alpha)
        };
        self.tint * (self.f0 * a + b)
    }

    /// Probabilities of sampling the coat, and of going straight through, seen from a direction with this
    /// cosine: about their shares of what the surface leaves of light.
    #[inline]
    fn probabilities(&self, albedo: Vec3, cos: f32) -> (f32, f32) {
        let share = self.share(cos);
        let rest = 1.0 - self.metallic;
        let coat = share * rest + schlick(self.metal, cos) * self.metallic;
        let coat = coat.element_sum();
        let below = |part: Vec3| ((Vec3::ONE - share) * part * rest).element_sum();
        let (diffuse, through) = (below(albedo * self.opacity), below(self.through));
        let sum = coat + diffuse + through;
        if sum > 0.0 {
            (coat / sum, through / sum)
        } else {
            (0.0, 0.0)
        }
    }

    /// What is left in all of light from everywhere: about the coat's and the Lambert part's shares, and what
    /// passes through.
    pub fn total(&self, albedo: Vec3) -> Vec3 {
        let mean = self.mean_share();
        let rest = 1.0 - self.metallic;
        let below = albedo * self.opacity + self.through;
        (mean + (Vec3::ONE - mean) * below) * rest + self.metal * self.metallic
    }
}

/// The Lambert part alone, with its cosine; no probability of choice inside.
#[inline]
fn diffuse(albedo: Vec3, coat: &Coat, cos_o: f32, cos_i: f32) -> Vec3 {
    let through = (Vec3::ONE - coat.share(cos_o)) * (Vec3::ONE - coat.share(cos_i));
    // Where the coat is white at all angles nothing arrives below it.
    let rest = (Vec3::ONE - coat.mean_share()).max(Vec3::splat(1e-6));
    albedo * through / rest * ((1.0 - coat.metallic) * coat.opacity * cos_i * FRAC_1_PI)
}

/// All that is not a single direction: the Lambert part, and the coat where it is rough.
#[inline]
pub(super) fn eval(albedo: Vec3, coat: &Coat, mut wo: Vec3, mut wi: Vec3) -> Option<Eval> {
    if wo.z * wi.z <= 0.0 {
        return None;
    }
    (wo.z, wi.z) = (wo.z.abs(), wi.z.abs());
    let (p, through) = coat.probabilities(albedo, wo.z);
    let mut value = diffuse(albedo, coat, wo.z, wi.z);
    let mut pdf = (1.0 - p - through).max(0.0) * wi.z * FRAC_1_PI;
    if !coat.is_smooth() {
        let h = (wo + wi).normalize();
        let d = ggx::density(h, coat.alpha) / (4.0 * wo.z);
        value += coat.reflectance(wo.dot(h)) * (d * ggx::masking_shadowing(wo, wi, coat.alpha));
        pdf += p * d * ggx::masking(wo, coat.alpha);
    }
    (pdf > 0.0).then_some(Eval { value, pdf })
}

/// The single direction of a smooth coat; `None` for a rough one.
#[inline]
pub(super) fn eval_smooth(albedo: Vec3, coat: &Coat, wo: Vec3) -> Option<Eval> {
    let (pdf, _) = coat.probabilities(albedo, wo.z.abs());
    (coat.is_smooth() && pdf > 0.0).then(|| Eval {
        value: coat.reflectance(wo.z.abs()),
        pdf,
    })
}

/// The single direction straight through; `None` for an opaque surface.
#[inline]
pub(super) fn eval_through(albedo: Vec3, coat: &Coat, wo: Vec3) -> Option<Eval> {
    let cos = wo.z.abs();
    let (_, pdf) = coat.probabilities(albedo, cos);
    (pdf > 0.0).then(|| Eval {
        value: (Vec3::ONE - coat.share(cos)) * coat.through * (1.0 - coat.metallic),
        pdf,
    })
}

#[inline]
pub(super) fn sample(
    albedo: Vec3,
    coat: &Coat,
    wo: Vec3,
    u: [f32; 2],
    u_lobe: f32,
) -> Option<Sampled> {
    let side = wo.z.signum();
    let up = Vec3::new(wo.x, wo.y, wo.z.abs());
    let (p, through) = coat.probabilities(albedo, up.z);
    let of_coat = u_lobe < p;
    if of_coat && coat.is_smooth() {
        let mirrored = Vec3::new(-wo.x, -wo.y, wo.z);
        return Some(eval_smooth(albedo, coat, wo)?.sampled_delta(mirrored, Lobe::Reflection));
    }
    if !of_coat && u_lobe < p + through {
        return Some(eval_through(albedo, coat, wo)?.sampled_delta(-wo, Lobe::Transmission));
    }
    let mut wi = if of_coat {
        reflect(up, ggx::sample(up, coat.alpha, u))
    } else {
        warp::cosine_hemisphere(u)
    };
    wi.z *= side;
    Some(eval(albedo, coat, wo, wi)?.sampled(wi, Lobe::Reflection))
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
    let wo = Vec3::new((1.0 - cos * cos).max(0.0).sqrt(), 0.0, cos);
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
