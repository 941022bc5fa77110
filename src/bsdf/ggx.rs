//! The isotropic GGX distribution of microfacets, sampled by visible normals (Heitz 2018).
//! All directions are local, on the upper side (`z` > 0).

use crate::lanes::{Float, Vector};
use crate::warp;
use std::f32::consts::PI;

/// Density of microfacet normals `h` per solid angle, projected area not included.
#[inline(always)]
pub fn density<F: Float>(h: Vector<F>, alpha: F) -> F {
    // 1 - z² from x and y: exact near the pole, where a small alpha has all its weight.
    let a2 = alpha * alpha;
    let t = h.z * h.z * a2 + (h.x * h.x + h.y * h.y);
    a2 / (F::splat(PI) * t * t)
}

/// Smith's Λ of the direction `w`.
#[inline(always)]
fn lambda<F: Float>(w: Vector<F>, alpha: F) -> F {
    let tan2 = (w.x * w.x + w.y * w.y) / (w.z * w.z);
    F::splat(0.5) * ((F::ONE + alpha * alpha * tan2).root() - F::ONE)
}

/// Share of the microfacets facing `w` that are not masked.
#[inline(always)]
pub fn masking<F: Float>(w: Vector<F>, alpha: F) -> F {
    F::ONE / (F::ONE + lambda(w, alpha))
}

/// Share of the microfacets seen by both directions, correlated in height. For refraction pass the
/// mirror image of the direction below.
#[inline(always)]
pub fn masking_shadowing<F: Float>(wo: Vector<F>, wi: Vector<F>, alpha: F) -> F {
    F::ONE / (F::ONE + lambda(wo, alpha) + lambda(wi, alpha))
}

/// Density of the normals `h` visible from `wo` per solid angle of `h`; what [`sample`] draws from.
#[inline(always)]
pub fn visible_density<F: Float>(wo: Vector<F>, h: Vector<F>, alpha: F) -> F {
    masking(wo, alpha) * density(h, alpha) * wo.dot(h).larger(F::ZERO) / wo.z
}

/// A normal of any microfacet, unit, `z` > 0, by projected area: its density is [`density`] times `z`.
#[inline(always)]
pub fn sample_any<F: Float>(alpha: F, u: [F; 2]) -> Vector<F> {
    let [x, y] = warp::disk(u);
    // The squared sine on the disk is that of a GGX of alpha 1; its slopes scale with alpha.
    let z = (F::ONE - (x * x + y * y)).larger(F::splat(1e-6)).root();
    Vector::new(alpha * x, alpha * y, z).normalize()
}

/// A normal visible from `wo`, unit, `z` > 0.
#[inline(always)]
pub fn sample<F: Float>(wo: Vector<F>, alpha: F, u: [F; 2]) -> Vector<F> {
    let stretched = Vector::new(alpha * wo.x, alpha * wo.y, wo.z).normalize();
    let len2 = stretched.x * stretched.x + stretched.y * stretched.y;
    let x_axis = Vector::new(F::ONE, F::ZERO, F::ZERO);
    let tangent = Vector::new(-stretched.y, stretched.x, F::ZERO) / len2.root();
    let t1 = Vector::select(len2.above(F::splat(1e-12)), tangent, x_axis);
    let t2 = stretched.cross(t1);
    let [x, y] = warp::disk(u);
    let s = F::splat(0.5) * (F::ONE + stretched.z);
    let y = (F::ONE - s) * (F::ONE - x * x).larger(F::ZERO).root() + s * y;
    let z2 = F::ONE - (x * x + y * y);
    let n = t1 * x + t2 * y + stretched * z2.larger(F::ZERO).root();
    Vector::new(alpha * n.x, alpha * n.y, n.z.larger(F::splat(1e-6))).normalize()
}
