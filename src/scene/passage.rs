//! How light passes a material, by what programs mean with `d`, `Tr`, `Tf`, `Ni` and `illum`.

use crate::bsdf::fresnel::SAME_INDEX;
use crate::load::mtl::MtlMaterial;
use glam::Vec3;

/// How light passes a material.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Passage {
    /// Not at all.
    Opaque,
    /// Straight, in part; the rest meets the surface.
    Straight {
        /// The share that meets the surface, in (0, 1).
        opacity: f32,
        /// Factor on the light that passes.
        tint: Vec3,
    },
    /// Refracted.
    Glass {
        /// Refractive index, inside over outside.
        ior: f32,
        /// What the whole way through a body leaves of light.
        tint: Vec3,
    },
}

/// Refractive index of glass of which none is given.
const GLASS_INDEX: f32 = 1.5;
/// A grey `Tf` this dark, without `d`, is an opacity: as a colour it would hide what the glass is there to show.
const DARK_FILTER: f32 = 0.2;
/// Programs round what they write.
const ROUNDING: f32 = 1e-3;

/// How light passes a material whose values are in their ranges, and a remark where the file says something else
/// than it means.
pub fn passage(m: &MtlMaterial) -> (Passage, Option<&'static str>) {
    let (filter, remark) = filter(m);
    let glass = Passage::Glass {
        ior: m.ni.unwrap_or(GLASS_INDEX),
        tint: filter,
    };
    let straight = |opacity: f32| Passage::Straight {
        opacity,
        tint: filter,
    };
    // Programs that know no index write 1.
    let bends = m.ni.is_some_and(|ni| (ni - 1.0).abs() >= SAME_INDEX);
    let see_through = m.opacity.is_some_and(|d| d < 1.0);
    match (m.illum, m.opacity) {
        (Some(6 | 7 | 9), _) => (glass, remark),
        // Maya writes illum 4 for all materials, with a Tf of 1 where they are opaque.
        (Some(4), _) if see_through && (bends || m.ni.is_none()) => (glass, remark),
        (Some(4), None | Some(1.0)) => match m.tf.map(Vec3::from) {
            Some(tf) if is_grey(tf) && tf.x < 1.0 - ROUNDING => {
                if bends || m.ni.is_none() {
                    (glass, remark)
                } else {
                    // There Tf is what is not transparent.
                    let remark = "its grey Tf beside illum 4 and Ni 1 is taken as its opacity";
                    let passage = Passage::Straight {
                        opacity: tf.x.max(ROUNDING),
                        tint: Vec3::ONE,
                    };
                    (passage, Some(remark))
                }
            }
            Some(tf) if !is_grey(tf) || (bends && m.opacity.is_none()) => (glass, remark),
            _ => (Passage::Opaque, None),
        },
        (_, Some(d)) if d < 1.0 && bends => (glass, remark),
        (_, Some(d)) if d <= 0.0 => {
            let remark = "would be invisible (d 0, or Tr 1, which some programs write for 1); it is taken as opaque";
            (Passage::Opaque, Some(remark))
        }
        (_, Some(d)) if d < 1.0 => (straight(d), remark),
        _ => (Passage::Opaque, None),
    }
}

/// What `Tf` leaves of light on its way through a body, and a remark where it is left out.
fn filter(m: &MtlMaterial) -> (Vec3, Option<&'static str>) {
    let Some(tf) = m.tf.map(Vec3::from) else {
        return (Vec3::ONE, None);
    };
    match m.opacity {
        // 3ds Max writes d again.
        Some(d) if is_grey(tf) && (tf.x - d).abs() <= ROUNDING => (Vec3::ONE, None),
        None if is_grey(tf) && tf.x <= DARK_FILTER => {
            let remark =
                "its dark grey Tf is taken as an opacity, not as a colour: its glass is clear";
            (Vec3::ONE, Some(remark))
        }
        _ if tf == Vec3::ZERO => {
            let remark = "its Tf is black, which would let no light pass, and left out";
            (Vec3::ONE, Some(remark))
        }
        _ => (tf, None),
    }
}

fn is_grey(c: Vec3) -> bool {
    c.max_element() - c.min_element() <= ROUNDING
}
