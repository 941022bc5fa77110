//! Directions by their half vector: the coordinates in which the shift copies a scattering event
//! (Kettunen et al. 2015, section 5.2; refraction by Walter et al. 2007, equation 16).
//!
//! An index of 1 is that of thin panes, which refract nothing: there the half vector is that of the direction
//! mirrored to `wo`'s side.

use super::Lobe;
use super::fresnel::{reflect, refract, relative_index};
use super::thin::mirrored;
use glam::Vec3;

/// The unit half vector of the pair, on `wo`'s side of the surface: the normal of the microfacet that
/// carries `wo` to `wi`. `None` for a pair that no facet seen from its front carries.
/// `ior` is inside over outside and matters for transmission alone.
#[inline]
pub fn from_directions(ior: f32, wo: Vec3, wi: Vec3) -> Option<Vec3> {
    let wi = if wo.z * wi.z < 0.0 && ior == 1.0 {
        mirrored(wi)
    } else {
        wi
    };
    let h = if wo.z * wi.z > 0.0 {
        wo + wi
    } else {
        wo + wi * relative_index(ior, wo)
    };
    let h = h.try_normalize()?;
    let h = if h.z * wo.z < 0.0 { -h } else { h };
    (wo.dot(h) > 0.0 && wi.dot(h) * wi.z * h.z > 0.0).then_some(h)
}

/// The direction to which a facet with normal `h` on `wo`'s side carries `wo` by `lobe`; `None` at
/// total internal reflection, or where the result lies on the wrong side of the surface.
#[inline]
pub fn to_direction(lobe: Lobe, ior: f32, wo: Vec3, h: Vec3) -> Option<Vec3> {
    if wo.dot(h) <= 0.0 {
        return None;
    }
    let wi = match lobe {
        Lobe::Reflection => reflect(wo, h),
        Lobe::Transmission if ior == 1.0 => mirrored(reflect(wo, h)),
        Lobe::Transmission => refract(wo, h, relative_index(ior, wo))?,
    };
    ((wo.z * wi.z > 0.0) == (lobe == Lobe::Reflection) && wi.z != 0.0).then_some(wi)
}

/// |dω_i/dω_h|: how much the solid angle around `wi` grows with that around `h`, `wo` held fixed.
#[inline]
pub fn jacobian(lobe: Lobe, ior: f32, wo: Vec3, wi: Vec3, h: Vec3) -> f32 {
    match lobe {
        Lobe::Reflection => 4.0 * wi.dot(h).abs(),
        Lobe::Transmission if ior == 1.0 => 4.0 * mirrored(wi).dot(h).abs(),
        Lobe::Transmission => {
            let eta = relative_index(ior, wo);
            let sum = wo.dot(h) + eta * wi.dot(h);
            sum * sum / (eta * eta * wi.dot(h).abs())
        }
    }
}
