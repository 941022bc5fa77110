//! The ranges of MTL parameters.

use crate::load::mtl::{LAST_ILLUM, MtlMaterial};

/// Refractive indices that are plausible, inside over outside.
const INDICES: (f32, f32) = (0.1, 10.0);

/// A material with all values inside their ranges, and what of it is changed, in words.
pub fn clamped(material: &MtlMaterial) -> (MtlMaterial, Vec<String>) {
    let mut m = material.clone();
    let mut changes: Vec<String> = Vec::new();
    if let Some(illum) = m.illum.filter(|&illum| illum > LAST_ILLUM) {
        changes.push(format!("illum {illum} is left out"));
        m.illum = None;
    }
    // 0 says that nobody gave an index.
    if let Some(ni) = m.ni.filter(|&ni| ni <= 0.0) {
        changes.push(format!("Ni {ni} is left out"));
        m.ni = None;
    }
    let mut number = |key: &str, value: &mut Option<f32>, (low, high): (f32, f32)| {
        let Some(value) = value else { return };
        let clamped = value.clamp(low, high);
        if clamped != *value {
            changes.push(format!("{key} {value} is taken as {clamped}"));
            *value = clamped;
        }
    };
    number("Ns", &mut m.ns, (0.0, f32::MAX));
    number("Ni", &mut m.ni, INDICES);
    number("d (1 - Tr)", &mut m.opacity, (0.0, 1.0));
    number("Pr", &mut m.pr, (0.0, 1.0));
    number("Pm", &mut m.pm, (0.0, 1.0));
    let mut colour = |key: &str, value: &mut Option<[f32; 3]>, high: f32| {
        let Some(value) = value else { return };
        let clamped = value.map(|c| c.clamp(0.0, high));
        if clamped != *value {
            changes.push(format!("{key} {value:?} is taken as {clamped:?}"));
            *value = clamped;
        }
    };
    colour("Kd", &mut m.kd, 1.0);
    colour("Ks", &mut m.ks, 1.0);
    colour("Tf", &mut m.tf, 1.0);
    colour("Ke", &mut m.ke, f32::MAX);
    (m, changes)
}
