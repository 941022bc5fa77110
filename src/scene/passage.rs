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

/// A `Kd` up to here is not worth a word.
pub const FAINT: f32 = 0.05;

/// A passage, and a remark where the file says something else than it means.
type Remarked = (Passage, Option<&'static str>);

/// How light passes a material whose values are in their ranges.
pub fn passage(m: &MtlMaterial) -> Remarked {
    let (tint, remark) = filter(m);
    let glass = Passage::Glass {
        ior: m.ni.unwrap_or(GLASS_INDEX),
        tint,
    };
    // Programs that know no index write 1.
    let bends = m.ni.is_some_and(|ni| (ni - 1.0).abs() >= SAME_INDEX);
    let opacity = m.opacity.filter(|&d| d < 1.0 - ROUNDING);
    match m.illum {
        Some(6 | 7 | 9) if opacity.is_some() || bends || tint != Vec3::ONE || !is_shaded(m) => {
            (glass, remark)
        }
        Some(6 | 7 | 9) => {
            let remark = "a colour and a highlight, and beside illum 6, 7 or 9 no transparent d, Tf or Ni: taken \
                 as opaque";
            (Passage::Opaque, Some(remark))
        }
        Some(4) if opacity.is_some() && m.ni.is_none() => (glass, remark),
        Some(4) if opacity.is_none() => by_filter(m, bends, (glass, remark)),
        _ => match opacity {
            None => (Passage::Opaque, None),
            Some(_) if bends => (glass, remark),
            Some(d) if d <= ROUNDING => {
                let remark =
                    "d 0 (or Tr 1, as some programs write it) would be invisible: taken as opaque";
                (Passage::Opaque, Some(remark))
            }
            Some(opacity) => (Passage::Straight { opacity, tint }, remark),
        },
    }
}

/// Of illum 4 without a transparent `d`, which is `glass` where `Tf` says so. Maya writes it for all materials,
/// with a `Tf` of 1 where they are opaque.
fn by_filter(m: &MtlMaterial, bends: bool, glass: Remarked) -> Remarked {
    let Some(tf) = m.tf.map(Vec3::from) else {
        return (Passage::Opaque, None);
    };
    let is_white = is_grey(tf) && tf.x >= 1.0 - ROUNDING;
    if is_white && !(bends && m.opacity.is_none()) {
        (Passage::Opaque, None)
    } else if is_grey(tf) && !bends && m.ni.is_some() {
        let passage = Passage::Straight {
            opacity: tf.x.max(ROUNDING),
            tint: Vec3::ONE,
        };
        let remark = "a grey Tf beside illum 4 and Ni 1 is taken as the opacity, as Maya writes it";
        (passage, Some(remark))
    } else {
        glass
    }
}

/// Whether there is something to see of a surface that is opaque, as programs write it with illum 7 for all
/// materials.
fn is_shaded(m: &MtlMaterial) -> bool {
    let bright = m.kd.is_some_and(|kd| Vec3::from(kd).max_element() > FAINT);
    (bright || m.map("map_kd").is_some()) && m.ks.is_some() && m.ns.is_some()
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
                "a dark grey Tf is taken as an opacity, not as a colour: the glass is clear";
            (Vec3::ONE, Some(remark))
        }
        _ if tf == Vec3::ZERO => {
            let remark = "a black Tf, which would let no light pass, is left out";
            (Vec3::ONE, Some(remark))
        }
        _ => (tf, None),
    }
}

fn is_grey(c: Vec3) -> bool {
    c.max_element() - c.min_element() <= ROUNDING
}
