//! Light from all directions in which there is nothing: a constant, or a picture of the sky.

use super::cumulative::Cumulative;
use super::texture::Texture;
use crate::lanes::{Float, Vector, lanes_of};
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
    /// The choice of a row, and of a pixel of each row.
    choice_of_row: Cumulative,
    choice_of_pixel: Cumulative,
    rows: Vec<Row>,
}

/// A row of a map, on the unit sphere.
#[derive(Clone, Copy)]
struct Row {
    /// The height of the pole that is nearer, 1 or -1; and how far the row's edges are from its height, the upper and
    /// the lower. Heights themselves would be too coarse there.
    pole: f32,
    edges: [f32; 2],
    /// Its probability over its solid angle.
    density: f32,
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

/// Sampled directions to the environment.
#[derive(Clone, Copy, Debug)]
pub struct SkySamples<F> {
    /// Unit directions.
    pub direction: Vector<F>,
    /// Radiance from there.
    pub radiance: Vector<F>,
    /// Densities per solid angle; 0 where there is no sample.
    pub density: F,
}

impl Environment {
    /// The radiance from the unit direction `direction`.
    #[inline]
    pub fn radiance(&self, direction: Vec3) -> Vec3 {
        self.radiance_in::<f32>(direction.into(), 1).into()
    }

    /// The radiance from the unit directions `direction`, in `lanes`.
    #[inline]
    pub fn radiance_in<F: Float>(&self, direction: Vector<F>, lanes: u32) -> Vector<F> {
        match self {
            Environment::Constant(radiance) => Vector::splat(*radiance),
            Environment::Map(map) => map.seen(direction, lanes).radiance(),
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
        let mut choice_of_pixel = Cumulative::new(width, height);
        let mut weights = Vec::with_capacity(height);
        for y in 0..height {
            let [above, own, below] = &lines;
            let weight = |x: usize| 0.75 * own[x] + 0.125 * (above[x] + below[x]);
            let sum = choice_of_pixel.push((0..width).map(weight));
            weights.push(sum * (edge(y, height) - edge(y + 1, height)));
            lines.rotate_left(1);
            lines[2] = line((y + 2).min(height - 1));
        }
        let mut choice_of_row = Cumulative::new(height, 1);
        let total = choice_of_row.push(weights.into_iter());
        let row = |y: usize| {
            let (top, bottom) = (edge(y, height), edge(y + 1, height));
            let pole = if top + bottom > 0.0 { 1.0 } else { -1.0 };
            // From the table as it is, so that it is that of what is drawn from it.
            let probability = f64::from(choice_of_row.probability(0, y));
            Row {
                pole: pole as f32,
                edges: [top, bottom].map(|height| (1.0 - pole * height) as f32),
                density: (probability / (std::f64::consts::TAU * (top - bottom))) as f32,
            }
        };
        let rows = (0..height).map(row).collect();
        (total > 0.0 && total.is_finite()).then_some(Self {
            kind: MapKind::Picture,
            scale,
            rotation: rotation / 360.0,
            axes,
            choice_of_row,
            choice_of_pixel,
            rows,
            texture,
        })
    }

    /// What is seen in the unit directions `direction`, in `lanes`.
    #[inline]
    pub fn seen<F: Float>(&self, direction: Vector<F>, lanes: u32) -> Seen<'_, F> {
        let Axes { right, up, front } = self.axes;
        let along = |axis: Vec3| direction.dot(Vector::splat(axis));
        let (x, up, z) = (along(right), along(up), along(front));
        let across = x.angle_at(-z) * F::splat(1.0 / TAU) + F::splat(self.rotation);
        Seen {
            map: self,
            across: across - across.whole(),
            down: down(x * x + z * z, up),
            lanes,
        }
    }

    /// Density per solid angle with which [`EnvironmentMap::sample`] draws the unit direction `direction`.
    #[inline]
    pub fn density(&self, direction: Vec3) -> f32 {
        self.seen::<f32>(direction.into(), 1).density()
    }

    /// The density inside a pixel: its probability over its solid angle.
    #[inline]
    fn density_of(&self, x: usize, y: usize) -> f32 {
        let width = self.texture.size().0 as f32;
        self.rows[y].density * self.choice_of_pixel.probability(y, x) * width
    }

    /// Draws directions with `u` in [0, 1)², in `lanes`.
    #[inline]
    pub fn sample<F: Float>(&self, u: [F; 2], lanes: u32) -> SkySamples<F> {
        let width = self.texture.size().0 as f32;
        let (mut across, mut density) = (F::ZERO, F::ZERO);
        let (mut pole, mut from_pole) = (F::ONE, F::ZERO);
        for lane in lanes_of(lanes) {
            let (y, v) = self.choice_of_row.invert(0, u[1].lane(lane));
            let (x, u) = self.choice_of_pixel.invert(y, u[0].lane(lane));
            across.set_lane(lane, (x as f32 + u) / width);
            density.set_lane(lane, self.density_of(x, y));
            // Inside of the row evenly by solid angle, which is by the height on the sphere.
            let Row { edges, .. } = self.rows[y];
            pole.set_lane(lane, self.rows[y].pole);
            from_pole.set_lane(lane, edges[0] + (edges[1] - edges[0]) * v);
        }
        let up = pole * (F::ONE - from_pole);
        let squared_radius = from_pole * (F::splat(2.0) - from_pole);
        let radius = squared_radius.root();
        let turn = (across - F::splat(self.rotation)) * F::splat(TAU);
        let (sin, cos) = turn.sine_and_cosine();
        let axis = |axis: Vec3, by: F| Vector::splat(axis) * by;
        let axes = &self.axes;
        let seen = Seen {
            map: self,
            across,
            down: down(squared_radius, up),
            lanes,
        };
        SkySamples {
            direction: axis(axes.right, radius * sin) + axis(axes.up, up)
                - axis(axes.front, radius * cos),
            radiance: seen.radiance(),
            density,
        }
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

/// Places in the picture of a map, in the directions in which it is seen.
pub struct Seen<'a, F> {
    map: &'a EnvironmentMap,
    /// Across and down, from 0 to 1.
    across: F,
    down: F,
    lanes: u32,
}

impl<F: Float> Seen<'_, F> {
    /// The radiance from there.
    #[inline]
    pub fn radiance(&self) -> Vector<F> {
        let texture = &self.map.texture;
        // The first row does not go over into the last.
        let half = 0.5 / texture.size().1 as f32;
        let mut radiance = Vector::ZERO;
        for lane in lanes_of(self.lanes) {
            let down = self.down.lane(lane).clamp(half, 1.0 - half);
            let uv = Vec2::new(self.across.lane(lane), 1.0 - down);
            radiance.set(lane, texture.colour(uv).max(Vec3::ZERO));
        }
        radiance * F::splat(self.map.scale)
    }

    /// Densities per solid angle with which [`EnvironmentMap::sample`] draws these directions.
    #[inline]
    pub fn density(&self) -> F {
        let (width, height) = self.map.texture.size();
        let mut density = F::ZERO;
        for lane in lanes_of(self.lanes) {
            let x = (self.across.lane(lane) * width as f32) as usize;
            let y = (self.down.lane(lane) * height as f32) as usize;
            let (x, y) = (x.min(width as usize - 1), y.min(height as usize - 1));
            density.set_lane(lane, self.map.density_of(x, y));
        }
        density
    }
}

/// How far down in the picture directions lie, from 0 to 1, by the squares of their distances from the axis and their
/// heights: exact at the poles too, where the cosine is not.
#[inline]
fn down<F: Float>(squared_radius: F, height: F) -> F {
    squared_radius.root().angle_at(height) * F::splat(1.0 / PI)
}

/// The height on the unit sphere at the upper edge of a row.
fn edge(row: usize, rows: usize) -> f64 {
    (std::f64::consts::PI * row as f64 / rows as f64).cos()
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

#[cfg(test)]
mod tests {
    use super::*;
    use crate::lanes::{LANES, Vec3x8};
    use crate::load::bitmap::Texels;
    use proptest::prelude::*;
    use proptest::test_runner::RngSeed;
    use wide::f32x8;

    fn map(size: (u32, u32), bright: u32) -> EnvironmentMap {
        let value = |i: u32| {
            if i == bright {
                1e4
            } else {
                0.1 + (i % 7) as f32
            }
        };
        let values = (0..size.0 * size.1).map(|i| [value(i), 0.5, 2.0]).collect();
        let (width, height) = size;
        let texels = Texels::Floats {
            values,
            alpha: None,
            encoded: false,
        };
        let bitmap = Bitmap {
            width,
            height,
            texels,
            has_alpha: false,
        };
        EnvironmentMap::new(Arc::new(bitmap), 1.5, 35.0, Axes::of_up(Vec3::Z)).unwrap()
    }

    proptest! {
        #![proptest_config(ProptestConfig { rng_seed: RngSeed::Fixed(4), failure_persistence: None, ..Default::default() })]
        /// Eight lanes are what one is, but for the rounding of angles; samples are where they are seen.
        #[test]
        fn samples_are_the_same_in_lanes(
            size in (1u32..40, 1u32..40),
            bright in 0u32..1600,
            u in prop::collection::vec((0f32..1.0, 0f32..1.0), LANES),
            lanes in 0u32..256,
        ) {
            let map = map(size, bright);
            let of_eight = [f32x8::from_lanes(|l| u[l].0), f32x8::from_lanes(|l| u[l].1)];
            let eight = map.sample(of_eight, lanes);
            let seen = map.seen(Vec3x8::from_lanes(|l| eight.direction.lane(l)), lanes).radiance();
            for lane in lanes_of(lanes) {
                let one = map.sample::<f32>([u[lane].0, u[lane].1], 1);
                let direction = eight.direction.lane(lane);
                prop_assert!(direction.distance(one.direction.into()) < 1e-5);
                prop_assert!((direction.length() - 1.0).abs() < 1e-5);
                prop_assert_eq!(one.density, eight.density.lane(lane));
                // A pixel is 1/40 of the picture wide, and next to one that is 1e5 times as bright.
                let radiance = eight.radiance.lane(lane);
                for other in [one.radiance.into(), seen.lane(lane)] {
                    prop_assert!(radiance.distance(other) < 1e-4 * radiance.length() + 1.0);
                }
            }
        }
    }
}
