//! Colours of vertices, as files have them.

use super::texture::linear;
use crate::load::obj::ObjFile;
use glam::Vec3;

/// Larger numbers than this are of 0 to 255, not of 0 to 1 with errors of rounding.
const ONE: f32 = 1.5;

/// Makes the file's colours, which are sRGB of 0 to 1 or of 0 to 255, linear and of 0 to 1. Returns their mean, or
/// `None` where there are none; colours that are all white, as programs write for what nobody painted, are
/// taken away.
pub fn make_linear(obj: &mut ObjFile) -> Option<Vec3> {
    let is_there = |c: &&mut Vec3| c.is_finite();
    let there = || obj.colours.iter().filter(|c| c.is_finite());
    let largest = there().fold(0.0f32, |m, c| m.max(c.max_element()));
    let scale = if largest > ONE { 255.0 } else { 1.0 };
    if there().all(|&c| c == Vec3::splat(scale)) {
        obj.colours = Vec::new();
        return None;
    }
    let (mut sum, mut count) = (glam::DVec3::ZERO, 0);
    for colour in obj.colours.iter_mut().filter(is_there) {
        *colour = (*colour / scale).clamp(Vec3::ZERO, Vec3::ONE).map(linear);
        sum += colour.as_dvec3();
        count += 1;
    }
    Some((sum / f64::from(count)).as_vec3())
}

#[cfg(test)]
mod tests {
    use super::*;

    fn made(colours: &[[f32; 3]]) -> (Option<Vec3>, Vec<Vec3>) {
        let mut obj = ObjFile {
            colours: colours.iter().map(|&c| c.into()).collect(),
            ..Default::default()
        };
        (make_linear(&mut obj), obj.colours)
    }

    #[test]
    fn numbers_of_both_ranges_are_srgb() {
        let (mean, colours) = made(&[[0.0, 1.0, 188.0 / 255.0], [f32::NAN; 3]]);
        assert!((colours[0] - Vec3::new(0.0, 1.0, 0.5029)).length() < 1e-3);
        assert!(colours[1].is_nan() && mean == Some(colours[0]));
        let (_, of_bytes) = made(&[[0.0, 255.0, 188.0], [f32::NAN; 3]]);
        assert!((of_bytes[0] - colours[0]).length() < 1e-6);
        // A little above 1 is no byte.
        assert_eq!(made(&[[1.004, 0.0, -0.1]]).1, [Vec3::X]);
    }

    #[test]
    fn what_nobody_painted_has_no_colours() {
        for colours in [&[][..], &[[1.0; 3]; 2], &[[255.0; 3], [f32::NAN; 3]]] {
            assert_eq!(made(colours), (None, Vec::new()));
        }
        assert_eq!(made(&[[0.5; 3]; 3]).1.len(), 3);
    }
}
