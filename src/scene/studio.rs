//! The light of a photographer's studio, for scenes that have none: a large soft lamp from the upper left of
//! the camera (key), a weak one from the right (fill), one from behind that draws the edges (rim), and walls
//! that are brighter above than below.

use crate::load::bitmap::{Bitmap, Texels};
use glam::{Vec2, Vec3};
use std::f32::consts::{PI, TAU};

/// Pixels across and down: the lamps' edges are soft over several of them.
const WIDTH: u32 = 256;
const HEIGHT: u32 = 128;

/// A lamp with rounded corners and soft edges, as seen from the scene.
struct SoftBox {
    /// Degrees from the camera to its middle, counter-clockwise seen from above.
    azimuth: f32,
    /// Degrees from the horizon to its middle.
    elevation: f32,
    /// From its middle to its sides and to its upper and lower edge, at unit distance.
    half: Vec2,
    /// In its middle.
    radiance: f32,
}

const KEY: SoftBox = SoftBox {
    azimuth: -50.0,
    elevation: 48.0,
    half: Vec2::new(0.6, 0.6),
    radiance: 4.4,
};
const FILL: SoftBox = SoftBox {
    azimuth: 65.0,
    elevation: 12.0,
    half: Vec2::new(0.8, 0.9),
    radiance: 0.35,
};
const RIM: SoftBox = SoftBox {
    azimuth: 155.0,
    elevation: 35.0,
    half: Vec2::new(0.35, 0.7),
    radiance: 3.0,
};

/// Over which distance the edges of a lamp fade, at unit distance.
const FADE: f32 = 0.2;

/// Radiance of the walls overhead, at the horizon and below.
const WALLS: [f32; 3] = [0.55, 0.28, 0.12];

/// The studio around a scene with y upwards, seen by a camera in front (+z), as a picture of longitude and
/// latitude.
pub(super) fn bitmap() -> Bitmap {
    let pixel = |index: u32| {
        let (x, y) = (index % WIDTH, index / WIDTH);
        let across = TAU * (x as f32 + 0.5) / WIDTH as f32;
        let down = PI * (y as f32 + 0.5) / HEIGHT as f32;
        // The middle is towards the camera, a quarter to its right.
        let (sin, cos) = down.sin_cos();
        [radiance(Vec3::new(across.sin() * sin, cos, -across.cos() * sin)); 3]
    };
    Bitmap {
        width: WIDTH,
        height: HEIGHT,
        texels: Texels::Floats {
            values: (0..WIDTH * HEIGHT).map(pixel).collect(),
            alpha: None,
            encoded: false,
        },
        has_alpha: false,
    }
}

/// The radiance from a unit direction.
fn radiance(d: Vec3) -> f32 {
    let [above, level, below] = WALLS;
    let towards = if d.y > 0.0 { above } else { below };
    let walls = level + (towards - level) * smooth(d.y.abs());
    walls
        + [KEY, FILL, RIM]
            .iter()
            .map(|lamp| lamp.radiance(d))
            .sum::<f32>()
}

impl SoftBox {
    fn radiance(&self, d: Vec3) -> f32 {
        let (sin, cos) = self.azimuth.to_radians().sin_cos();
        let (up, out) = self.elevation.to_radians().sin_cos();
        let middle = Vec3::new(out * sin, up, out * cos);
        let across = Vec3::new(cos, 0.0, -sin);
        let along = d.dot(middle);
        if along <= 0.0 {
            return 0.0;
        }
        let at = Vec2::new(d.dot(across), d.dot(middle.cross(across))) / along;
        // Distance to a rectangle with rounded corners, negative inside.
        let rounding = 0.5 * self.half.min_element();
        let beyond = at.abs() - self.half + rounding;
        let distance = beyond.max(Vec2::ZERO).length() + beyond.max_element().min(0.0) - rounding;
        self.radiance * smooth(0.5 - distance / FADE)
    }
}

/// From 0 to 1 over the unit interval, level at both ends.
fn smooth(x: f32) -> f32 {
    let x = x.clamp(0.0, 1.0);
    x * x * (3.0 - 2.0 * x)
}
