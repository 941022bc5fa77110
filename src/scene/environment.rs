//! Light from all directions in which there is nothing: a constant, or a picture of the sky.

use super::texture::Texture;
use crate::load::bitmap::Bitmap;
use glam::{Vec2, Vec3};
use serde::Serialize;
use std::f32::consts::{PI, TAU};
use std::sync::Arc;

/// Radiance that arrives from every direction in which there is nothing.
#[derive(Clone, Debug, Serialize)]
pub enum Environment {
    /// The same from everywhere; black for none. It is not sampled as a light: the directions that BSDF
    /// sampling draws fit it as well as any could.
    Constant(Vec3),
    /// By a map; sampled as a light.
    Map(Box<EnvironmentMap>),
}

/// A picture around the scene: longitude across, latitude down. At rotation 0 its middle is towards the front
/// and a quarter of it towards the right, which are +z and +x with y upwards.
#[derive(Clone)]
pub struct EnvironmentMap {
    /// Where the picture is from.
    pub kind: MapKind,
    texture: Texture,
    /// Factor on the picture's values.
    scale: f32,
    /// Turns about the vertical axis, counter-clockwise seen from above.
    rotation: f32,
    axes: Axes,
    /// Cumulative weights of the rows, and of the pixels of each row; the last of each is 1.
    rows: Vec<f32>,
    columns: Vec<f32>,
    /// Probability of each row over its solid angle.
    row_densities: Vec<f32>,
}

/// Where the picture of an environment is from.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum MapKind {
    /// A file.
    Picture,
    /// The model of a clear sky.
    Sky,
    /// The model of a studio.
    Studio,
}

/// Which way is up, and where the front is: unit vectors along the coordinate axes.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct Axes {
    /// To the right for who looks at the front.
    pub right: Vec3,
    /// Upwards.
    pub up: Vec3,
    /// Out of the front. With z upwards it is towards -y, as in modelling programs, else towards +z.
    pub front: Vec3,
}

impl Axes {
    /// The axes with the coordinate axis upwards to which `up` is nearest: a camera that is held askew does
    /// not turn the sky.
    pub fn of_up(up: Vec3) -> Self {
        let [x, y, z] = up.abs().to_array();
        let (up, front) = if z > x.max(y) {
            (Vec3::Z * up.z.signum(), Vec3::NEG_Y)
        } else if x > y {
            (Vec3::X * up.x.signum(), Vec3::Z)
        } else {
            (Vec3::Y * up.y.signum(), Vec3::Z)
        };
        Self {
            right: up.cross(front),
            up,
            front,
        }
    }

    /// Degrees from the front to the horizontal part of `direction`, counter-clockwise seen from above; 0
    /// where it is vertical.
    pub fn azimuth(&self, direction: Vec3) -> f32 {
        let (right, front) = (direction.dot(self.right), direction.dot(self.front));
        right.atan2(front).to_degrees()
    }
}

/// A sampled direction to the environment.
#[derive(Clone, Copy, Debug)]
pub struct SkySample {
    /// Unit direction.
    pub direction: Vec3,
    /// Radiance from there.
    pub radiance: Vec3,
    /// Density per solid angle.
    pub density: f32,
}

impl Environment {
    /// The radiance from the unit direction `direction`.
    #[inline]
    pub fn radiance(&self, direction: Vec3) -> Vec3 {
        match self {
            Environment::Constant(radiance) => *radiance,
            Environment::Map(map) => map.radiance(direction),
        }
    }

    /// Whether no light comes from it.
    #[inline]
    pub fn is_black(&self) -> bool {
        matches!(self, Environment::Constant(Vec3::ZERO))
    }

    /// The map, if it is one.
    #[inline]
    pub fn map(&self) -> Option<&EnvironmentMap> {
        match self {
            Environment::Constant(_) => None,
            Environment::Map(map) => Some(map),
        }
    }
}

impl EnvironmentMap {
    /// The map of a picture from a file; `rotation` in degrees turns it counter-clockwise seen from above.
    /// `None` where all of it is black.
    pub fn new(bitmap: Arc<Bitmap>, scale: f32, rotation: f32, axes: Axes) -> Option<Self> {
        let texture = Texture::of_bitmap(bitmap);
        let (width, height) = texture.size();
        let (width, height) = (width as usize, height as usize);
        let luminance = |x: usize, y: usize| {
            let c = texture.texel(y * width + x).max(Vec3::ZERO);
            f64::from(c.x + c.y + c.z)
        };
        // What bilinear lookups have over a pixel in the mean, so that no light is without samples: of each
        // line 1/8 of the neighbours and 6/8 of the pixel itself; times its solid angle.
        let line = |y: usize| -> Vec<f64> {
            let across = |x: usize| {
                let (left, right) = ((x + width - 1) % width, (x + 1) % width);
                0.75 * luminance(x, y) + 0.125 * (luminance(left, y) + luminance(right, y))
            };
            (0..width).map(across).collect()
        };
        // The line above, the row's own and the one below; the first and the last count as their neighbours.
        let mut lines = [line(0), line(0), line(1.min(height - 1))];
        let (mut rows, mut columns) = (Vec::with_capacity(height), Vec::new());
        columns.reserve_exact(width * height);
        let mut total = 0.0;
        for y in 0..height {
            let [above, own, below] = &lines;
            let mut sum = 0.0;
            let mut cumulative = Vec::with_capacity(width);
            for x in 0..width {
                sum += 0.75 * own[x] + 0.125 * (above[x] + below[x]);
                cumulative.push(sum);
            }
            // A black row is never chosen.
            let scale = if sum > 0.0 { 1.0 / sum } else { 0.0 };
            columns.extend(cumulative.iter().map(|c| (c * scale) as f32));
            total += sum * (edge(y, height) - edge(y + 1, height));
            rows.push(total);
            lines.rotate_left(1);
            lines[2] = line((y + 2).min(height - 1));
        }
        let rows: Vec<f32> = rows.iter().map(|r| (r / total) as f32).collect();
        // From the table as it is, so that they are those of what is drawn from it.
        let density = |y: usize| {
            let before = if y == 0 { 0.0 } else { rows[y - 1] };
            let solid_angle = std::f64::consts::TAU * (edge(y, height) - edge(y + 1, height));
            (f64::from(rows[y] - before) / solid_angle) as f32
        };
        let row_densities = (0..height).map(density).collect();
        (total > 0.0 && total.is_finite()).then_some(Self {
            kind: MapKind::Picture,
            scale,
            rotation: rotation / 360.0,
            axes,
            row_densities,
            rows,
            columns,
            texture,
        })
    }

    /// Where a direction lies in the picture: across and down, from 0 to 1.
    #[inline]
    fn place(&self, d: Vec3) -> Vec2 {
        let Axes { right, up, front } = self.axes;
        let (x, up, z) = (d.dot(right), d.dot(up), d.dot(front));
        let across = x.atan2(-z) / TAU + self.rotation;
        // Exact at the poles too, where the cosine is not.
        let down = x.hypot(z).atan2(up) / PI;
        Vec2::new(across - across.floor(), down)
    }

    #[inline]
    fn radiance(&self, direction: Vec3) -> Vec3 {
        let place = self.place(direction);
        self.lookup(place)
    }

    #[inline]
    fn lookup(&self, place: Vec2) -> Vec3 {
        // The first row does not go over into the last.
        let half = 0.5 / self.texture.size().1 as f32;
        let uv = Vec2::new(place.x, 1.0 - place.y.clamp(half, 1.0 - half));
        self.texture.colour(uv).max(Vec3::ZERO) * self.scale
    }

    /// Density per solid angle with which [`EnvironmentMap::sample`] draws the direction.
    #[inline]
    pub fn density(&self, direction: Vec3) -> f32 {
        let (width, height) = self.texture.size();
        let place = self.place(direction);
        let x = ((place.x * width as f32) as usize).min(width as usize - 1);
        let y = ((place.y * height as f32) as usize).min(height as usize - 1);
        self.density_of(x, y)
    }

    /// The density inside a pixel: its probability over its solid angle.
    #[inline]
    fn density_of(&self, x: usize, y: usize) -> f32 {
        let width = self.texture.size().0 as usize;
        let row = &self.columns[y * width..][..width];
        let before = if x == 0 { 0.0 } else { row[x - 1] };
        self.row_densities[y] * (row[x] - before) * width as f32
    }

    /// Draws a direction with `u` in [0, 1)². `None` where the density comes out as 0.
    #[inline]
    pub fn sample(&self, u: [f32; 2]) -> Option<SkySample> {
        let (width, height) = self.texture.size();
        let (y, v) = invert(&self.rows, u[1]);
        let row = &self.columns[y * width as usize..][..width as usize];
        let (x, u) = invert(row, u[0]);
        // Inside of the row evenly by solid angle, which is by the height on the sphere.
        let (top, bottom) = (edge(y, height as usize), edge(y + 1, height as usize));
        let up = top + (bottom - top) * f64::from(v);
        let across = (x as f32 + u) / width as f32;
        let radius = (1.0 - up * up).max(0.0).sqrt() as f32;
        let down = up.clamp(-1.0, 1.0).acos() / std::f64::consts::PI;
        let up = up as f32;
        let (sin, cos) = (TAU * (across - self.rotation)).sin_cos();
        let axes = &self.axes;
        let direction = axes.right * (radius * sin) + axes.up * up - axes.front * (radius * cos);
        let density = self.density_of(x, y);
        (density > 0.0).then(|| SkySample {
            direction,
            radiance: self.lookup(Vec2::new(across, down as f32)),
            density,
        })
    }

    /// Sets its rotation, in degrees.
    pub(super) fn turn_to(&mut self, rotation: f32) {
        self.rotation = rotation / 360.0;
    }

    /// Pixels across and down.
    pub fn size(&self) -> (u32, u32) {
        self.texture.size()
    }
}

/// The height on the unit sphere at the upper edge of a row.
fn edge(row: usize, rows: usize) -> f64 {
    (std::f64::consts::PI * row as f64 / rows as f64).cos()
}

/// The interval of a cumulative table in which `u` falls, and where inside from 0 to 1.
#[inline]
fn invert(cumulative: &[f32], u: f32) -> (usize, f32) {
    let index = cumulative
        .partition_point(|&c| c <= u)
        .min(cumulative.len() - 1);
    let low = if index == 0 {
        0.0
    } else {
        cumulative[index - 1]
    };
    let width = cumulative[index] - low;
    let inside = if width > 0.0 { (u - low) / width } else { 0.5 };
    (index, inside.clamp(0.0, 1.0 - f32::EPSILON))
}

/// For the scene's hash: what all else is made of.
impl Serialize for EnvironmentMap {
    fn serialize<S: serde::Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        (&self.texture, self.scale, self.rotation, self.axes).serialize(serializer)
    }
}

impl std::fmt::Debug for EnvironmentMap {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        write!(f, "EnvironmentMap of a {:?}", self.texture)
    }
}
