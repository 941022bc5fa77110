//! Reflectances at a boundary, and refraction.

use glam::Vec3;

/// At an index this near to 1 light passes unbent, however rough the surface is; and half vectors, of
/// length |index − 1|, would be made of rounding errors.
pub const SAME_INDEX: f32 = 1e-3;

/// Schlick's reflectance of a conductor with reflectance `f0` at normal incidence; `cos` in [0, 1].
#[inline]
pub fn schlick(f0: Vec3, cos: f32) -> Vec3 {
    let m = (1.0 - cos).clamp(0.0, 1.0);
    f0 + (Vec3::ONE - f0) * (m * m * m * m * m)
}

/// The unpolarised reflectance of a dielectric boundary. `cos` > 0 is the incident cosine, `eta` the
/// index behind the boundary over the index before it. 1 where there is total internal reflection.
#[inline]
pub fn dielectric(cos: f32, eta: f32) -> f32 {
    let sin2_t = (1.0 - cos * cos).max(0.0) / (eta * eta);
    if sin2_t >= 1.0 {
        return 1.0;
    }
    let cos_t = (1.0 - sin2_t).sqrt();
    let parallel = (eta * cos - cos_t) / (eta * cos + cos_t);
    let perpendicular = (cos - eta * cos_t) / (cos + eta * cos_t);
    0.5 * (parallel * parallel + perpendicular * perpendicular)
}

/// `wo` mirrored about the unit vector `h`.
#[inline]
pub fn reflect(wo: Vec3, h: Vec3) -> Vec3 {
    2.0 * wo.dot(h) * h - wo
}

/// `wo` refracted through the microfacet with unit normal `h` on `wo`'s side; `eta` as for
/// [`dielectric`]. `None` where there is total internal reflection.
#[inline]
pub fn refract(wo: Vec3, h: Vec3, eta: f32) -> Option<Vec3> {
    let cos = wo.dot(h);
    let sin2_t = (1.0 - cos * cos).max(0.0) / (eta * eta);
    if sin2_t >= 1.0 {
        return None;
    }
    let cos_t = (1.0 - sin2_t).sqrt();
    Some(h * (cos / eta - cos_t) - wo / eta)
}

/// The index behind the boundary over the index before it, seen from the local direction `wo`; `ior` is
/// inside over outside, the normal points outside.
#[inline]
pub fn relative_index(ior: f32, wo: Vec3) -> f32 {
    if wo.z > 0.0 { ior } else { 1.0 / ior }
}
