//! What a scene holds, for people.

use super::Info;
use crate::film::BYTES_PER_PIXEL;

/// The lines of one scene.
pub(super) fn of(info: &Info) -> String {
    let [low, high] = info.bounds;
    let extent = std::array::from_fn(|axis| high[axis] - low[axis]);
    let flat = info.triangles - info.smooth;
    let mut text = format!(
        "{}: {} triangles, {} vertices, area {:.4}\n\
         size {}, from {} to {}\n\
         normals: {}\n\
         picture {}x{}, {}\n\
         environment {}\n",
        info.scene,
        info.triangles,
        info.vertices,
        info.area,
        list(extent, " x "),
        list(low, ","),
        list(high, ","),
        match (info.smooth, flat) {
            (0, _) => "all triangles flat".to_owned(),
            (_, 0) => "all triangles smooth".to_owned(),
            (smooth, flat) => format!("{smooth} triangles smooth, {flat} flat"),
        },
        info.width,
        info.height,
        info.view,
        info.environment
    );
    for m in &info.materials {
        text += &format!(
            "  {}: {}, {} triangles, area {:.4}",
            m.name, m.is, m.triangles, m.area
        );
        match m.power {
            Some(power) => text += &format!(", power {power:.4}\n"),
            None => text += &format!(", {}\n", m.class),
        }
    }
    for light in &info.punctual {
        text += &format!("  light: {light}\n");
    }
    match info.unused_materials.len() {
        0 => (),
        1 => text += "  1 material that no triangle has\n",
        count => text += &format!("  {count} materials that no triangle has\n"),
    }
    for t in &info.textures {
        text += &format!(
            "  texture of {}: {}, {}x{}\n",
            t.material, t.role, t.width, t.height
        );
    }
    if info.cutouts > 0 {
        text += &format!("  {} triangles with holes\n", info.cutouts);
    }
    let mut kinds: Vec<(String, usize, usize)> = Vec::new();
    for r in &info.reflectors {
        let mut kind = format!("{} of {}", r.form, r.material);
        if r.alpha > 0.0 {
            kind += &format!(" (alpha {:.4})", r.alpha);
        }
        match kinds.iter_mut().find(|(k, ..)| *k == kind) {
            Some((_, count, patches)) => {
                *count += 1;
                *patches += r.patches;
            }
            None => kinds.push((kind, 1, r.patches)),
        }
    }
    if !kinds.is_empty() {
        let kinds = kinds
            .iter()
            .map(|(kind, count, patches)| match patches > count {
                true => format!("{count} {kind} in {patches} patches"),
                false => format!("{count} {kind}"),
            });
        let kinds: Vec<String> = kinds.collect();
        text += &format!(
            "reflectors, by which walks lead to lights: {}\n",
            kinds.join(", ")
        );
    }
    if let Some(why) = &info.no_walks {
        text += &format!("no walks lead to lights by mirrors and glass: {why}\n");
    }
    let film = BYTES_PER_PIXEL * info.width as usize * info.height as usize;
    text += &format!(
        "kernels: {}\n\
         memory: {} for the picture, {} of them its film, and about {} for the scene\n",
        info.kernels.join(", "),
        bytes(info.memory_picture),
        bytes(film),
        bytes(info.memory_scene)
    );
    for warning in &info.warnings {
        text += &format!("warning: {warning}\n");
    }
    text
}

/// Numbers of four digits, with what stands between them.
fn list(values: [f32; 3], between: &str) -> String {
    let short = |value: f32| {
        // Through text, which has the digits that are to be shown.
        let rounded = format!("{value:.3e}").parse().unwrap_or(value);
        // No sign before zero.
        (rounded + 0.0).to_string()
    };
    values.map(short).join(between)
}

/// In a unit in which it can be seen.
fn bytes(count: usize) -> String {
    match count as f64 {
        count if count < 1e6 => format!("{:.1} kB", count / 1e3),
        count if count < 1e9 => format!("{:.1} MB", count / 1e6),
        count => format!("{:.1} GB", count / 1e9),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn numbers_are_short_and_true() {
        let values = [0.1 + 0.2, -0.0, 123_456.78];
        assert_eq!(list(values, " x "), "0.3 x 0 x 123500");
        assert_eq!(list([-1.0, 1e-7, 2.0626], ","), "-1,0.0000001,2.063");
    }

    #[test]
    fn memory_is_in_a_unit_that_shows_it() {
        let shown = [576, 3_320_000, 12_345_678_901].map(bytes);
        assert_eq!(shown, ["0.6 kB", "3.3 MB", "12.3 GB"]);
    }
}
