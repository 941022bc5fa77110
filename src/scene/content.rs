//! What a picture holds, judged by its values where the name of the statement does not say or says it wrongly.

use crate::load::bitmap::{Bitmap, Texels};
use crate::load::map::MapStatement;
use crate::load::mtl::MtlMaterial;
use crate::load::tally::Tally;
use glam::Vec3;
use std::ops::Range;
use std::sync::Arc;

/// Texels that are looked at, about.
const LOOKS: usize = 1 << 18;

/// Some texels all over the picture, all of a small one.
fn some(bitmap: &Bitmap) -> impl Iterator<Item = usize> {
    let (width, height) = (bitmap.width as usize, bitmap.height as usize);
    let count = width * height;
    // Steps that do not stay in a few columns.
    let mut step = (count / LOOKS).max(1) | 1;
    while step > 1 && width.is_multiple_of(step) {
        step += 2;
    }
    (0..count).step_by(step)
}

/// The values of a texel as they stand in the file.
fn values(bitmap: &Bitmap, index: usize) -> Vec3 {
    match &bitmap.texels {
        Texels::Bytes(bytes) => {
            let [r, g, b, _] = bytes[index].map(f32::from);
            Vec3::new(r, g, b) / 255.0
        }
        Texels::Floats { values, .. } => values[index].into(),
    }
}

/// Whether the picture of a statement of relief holds normals, each (1 + n)/2, not heights. Of `norm` it does
/// unless it is grey, of bumps if it looks so.
pub fn holds_normals(map: &MapStatement) -> bool {
    map.bitmap
        .as_deref()
        .is_some_and(|bitmap| match map.key.as_str() {
            "norm" => !is_grey(bitmap),
            _ => looks_like_normals(bitmap),
        })
}

/// Vectors of about unit length that point outwards, in the mean near to (½, ½, 1); black is nothing.
fn looks_like_normals(bitmap: &Bitmap) -> bool {
    /// Programs blur or compress them, or never made them unit.
    const LENGTHS: Range<f32> = 0.4..1.25;
    const SHARE: f32 = 0.9;
    const BLACK: f32 = 0.05;
    let (mut all, mut unit, mut sum) = (0, 0, Vec3::ZERO);
    for index in some(bitmap) {
        let value = values(bitmap, index);
        if value.max_element() > BLACK {
            let normal = 2.0 * value - Vec3::ONE;
            all += 1;
            unit += usize::from(LENGTHS.contains(&normal.length()) && normal.z > 0.0);
            sum += value;
        }
    }
    let mean = sum / all.max(1) as f32;
    let sideways = (mean - 0.5).abs();
    unit as f32 > SHARE * all as f32 && sideways.x.max(sideways.y) < 0.12 && mean.z > 0.7
}

fn is_grey(bitmap: &Bitmap) -> bool {
    /// Compression makes channels differ by so much.
    const DIFFERENCE: f32 = 0.04;
    const SHARE: f32 = 0.98;
    let (mut all, mut grey) = (0, 0);
    for index in some(bitmap) {
        let value = values(bitmap, index);
        all += 1;
        grey += usize::from(value.max_element() - value.min_element() <= DIFFERENCE);
    }
    grey as f32 > SHARE * all as f32
}

/// What the alpha channel of a colour picture is for.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Alpha {
    /// There is none, or it is the same everywhere.
    None,
    /// It cuts out: nearly all values are next to 0 or to 1, and there are enough of both.
    Cutout,
    /// Something else, such as gloss.
    Other,
}

/// Judges the alpha channel of a statement's picture.
pub fn alpha(map: &MapStatement) -> Alpha {
    /// Least share of values next to 0 or 1, and of each of the two. At the rims of leaves there are others.
    const DECIDED: f32 = 0.75;
    const EACH: f32 = 0.002;
    let Some(bitmap) = map.bitmap.as_deref().filter(|b| b.has_alpha) else {
        return Alpha::None;
    };
    let (mut all, mut open, mut full) = (0, 0, 0);
    let (mut least, mut most) = (f32::INFINITY, f32::NEG_INFINITY);
    for index in some(bitmap) {
        let alpha = bitmap.alpha(index);
        all += 1;
        open += usize::from(alpha < 0.1);
        full += usize::from(alpha > 0.9);
        (least, most) = (least.min(alpha), most.max(alpha));
    }
    let share = |count: usize| count as f32 / all as f32;
    if least == most {
        Alpha::None
    } else if share(open + full) > DECIDED && share(open).min(share(full)) > EACH {
        Alpha::Cutout
    } else {
        Alpha::Other
    }
}

/// What was decided by the pictures, for the user: one line for each kind.
pub fn notes(materials: &[MtlMaterial]) -> Vec<String> {
    let (mut normals, mut heights, mut gloss) =
        (Tally::default(), Tally::default(), Tally::default());
    let mut judged: Vec<(&str, *const Bitmap)> = Vec::new();
    let maps = materials.iter().flat_map(|m| {
        let is_cut = m.map("map_d").is_some_and(|map| map.bitmap.is_some());
        m.maps
            .iter()
            .filter(move |map| !is_cut || map.key != "map_kd")
    });
    for map in maps {
        let Some(bitmap) = &map.bitmap else { continue };
        let this = (map.key.as_str(), Arc::as_ptr(bitmap));
        if judged.contains(&this) {
            continue;
        }
        judged.push(this);
        match map.key.as_str() {
            "map_bump" if holds_normals(map) => normals.add(&map.at, &map.file),
            "norm" if !holds_normals(map) => heights.add(&map.at, &map.file),
            "map_kd" if alpha(map) == Alpha::Other => gloss.add(&map.at, &map.file),
            _ => {}
        }
    }
    [
        normals.message("bumps that are normal maps are used as such, with -bm as their strength"),
        heights.message("normal maps that are grey are used as heights, as bumps are"),
        gloss.message("alpha of map_Kd that is neither 0 nor full cuts nothing out (map_d would)"),
    ]
    .into_iter()
    .flatten()
    .collect()
}
