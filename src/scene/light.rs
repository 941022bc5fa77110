//! Light sources: triangles that emit and points, chosen in proportion to their power or by place, and what shines from
//! afar: the environment's map and directional lights.

use super::alias::Alias;
use super::light_grid::{Emitter, LightGrid};
use super::material::Material;
use super::mesh::Mesh;
use super::punctual::Punctual;
use crate::warp;
use glam::Vec3;

/// What is sampled as a light.
#[derive(Debug, Default)]
pub struct Lights {
    /// Those that have a place: triangles in their order, then points.
    pub(super) near: Vec<NearLight>,
    pub(super) choice: Choice,
    pub(super) far: Far,
    pub(super) punctual: Punctual,
    /// Whether there are but a few triangles with one radiance each.
    plain: bool,
}

/// What shines from afar: directional lights and the environment's map.
#[derive(Debug, Default)]
pub(super) struct Far {
    /// How many there are, the map included.
    count: usize,
    has_map: bool,
    /// Probability of sampling one of them in place of what is near.
    pub(super) share: f32,
}

/// How one of those that have a place is chosen.
#[derive(Debug)]
pub(super) enum Choice {
    /// By power.
    Power(Alias),
    /// By what it may give to the point that is lit.
    Place(LightGrid),
}

impl Default for Choice {
    fn default() -> Self {
        Choice::Power(Alias::default())
    }
}

/// From this many emitting triangles on the choice is by place.
const MANY: usize = 64;

/// A triangle that emits, or a point: one whose corners are in one place.
#[derive(Clone, Copy, Debug)]
pub(super) struct NearLight {
    pub(super) corners: [Vec3; 3],
    pub(super) ng: Vec3,
    /// Where it is not textured; of a point its intensity.
    pub(super) radiance: Vec3,
    /// Density of sampled points per area, of a point its probability, over all lights; with a choice by place, once
    /// the light is chosen.
    pub(super) density: f32,
    pub(super) offset: f32,
    /// [`NOT_A_TRIANGLE`] of a point.
    pub(super) triangle: u32,
    pub(super) kind: Kind,
}

/// What a light that has a place is.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) enum Kind {
    /// A triangle with one radiance.
    Plain,
    /// A triangle with a texture or with holes.
    Textured,
    /// A point; its number among the points.
    Point(u32),
}

/// After all triangles.
const NOT_A_TRIANGLE: u32 = u32::MAX;

/// Which light it is.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Source {
    /// One that has a place, by its number among them.
    Near(u32),
    /// A directional light, by its number.
    Directional(u32),
    /// The environment's map.
    Sky,
}

/// Probability of what is far where something is near too. Which of them gives more light differs from point to point.
const FAR_AMONG_ALL: f32 = 0.5;

impl Lights {
    /// The lights among the triangles of `mesh`, and those without extent, beside the environment's map if `has_map`.
    pub fn new(mesh: &Mesh, materials: &[Material], punctual: Punctual, has_map: bool) -> Self {
        let mut near = Vec::new();
        let mut powers = Vec::new();
        for (index, &material) in mesh.material_of.iter().enumerate() {
            let material = &materials[material as usize];
            let Some(radiance) = material.emission else {
                continue;
            };
            let index = index as u32;
            let textured = material.emission_map().is_some() || mesh.has_holes(index);
            let mean = if textured {
                mean_radiance(mesh, material, index)
            } else {
                radiance
            };
            let point = mesh.point(index, 1.0 / 3.0, 1.0 / 3.0);
            // Power, over π, is area times weight.
            powers.push(f64::from(mesh.area(index)) * f64::from(weight(mean)));
            near.push(NearLight {
                corners: mesh.corners(index),
                ng: point.ng,
                radiance,
                density: weight(mean),
                offset: point.offset,
                triangle: index,
                kind: if textured {
                    Kind::Textured
                } else {
                    Kind::Plain
                },
            });
        }
        let triangles = near.len();
        for (number, point) in (0..).zip(&punctual.points) {
            let mean = point.intensity.as_dvec3().element_sum() / 3.0;
            powers.push(mean * f64::from(point.solid_angle()) / std::f64::consts::PI);
            near.push(NearLight {
                corners: [point.position; 3],
                radiance: point.intensity,
                triangle: NOT_A_TRIANGLE,
                kind: Kind::Point(number),
                ..NearLight::NONE
            });
        }
        let total: f64 = powers.iter().sum();
        let count = punctual.directional.len() + usize::from(has_map);
        let any_far = count > 0;
        let mut lights = Self {
            far: Far {
                count,
                has_map,
                share: if !any_far {
                    0.0
                } else if total > 0.0 {
                    FAR_AMONG_ALL
                } else {
                    1.0
                },
            },
            punctual,
            ..Self::default()
        };
        if total <= 0.0 {
            lights.plain = !any_far;
            return lights;
        }
        let near_share = 1.0 - lights.far.share;
        if near.len() < MANY {
            for (light, power) in near.iter_mut().zip(&powers) {
                let density = match light.kind {
                    Kind::Point(_) => *power,
                    Kind::Plain | Kind::Textured => f64::from(light.density),
                };
                light.density = (density / total * f64::from(near_share)) as f32;
            }
            lights.choice = Choice::Power(Alias::new(&powers));
        } else {
            for light in &mut near[..triangles] {
                let per_area = near_share / mesh.area(light.triangle);
                // What is too small for its area to be a number is not sampled.
                light.density = if per_area.is_finite() { per_area } else { 0.0 };
            }
            for light in &mut near[triangles..] {
                light.density = near_share;
            }
            let emitter = |(light, &power): (&NearLight, &f64)| Emitter {
                bounds: light.bounds(),
                normal: match light.kind {
                    Kind::Point(number) => lights.punctual.points[number as usize].shines_forward(),
                    _ => Some(light.ng),
                },
                power,
            };
            let emitters: Vec<Emitter> = std::iter::zip(&near, &powers).map(emitter).collect();
            lights.choice = Choice::Place(LightGrid::new(&emitters, mesh.bounds));
        }
        lights.plain = matches!(lights.choice, Choice::Power(_))
            && !any_far
            && near.iter().all(|light| light.kind == Kind::Plain);
        lights.near = near;
        lights
    }

    /// Whether nothing is sampled as a light.
    #[inline]
    pub fn is_empty(&self) -> bool {
        self.near.is_empty() && self.far.share == 0.0
    }

    /// Number of emitting triangles.
    pub fn triangles(&self) -> usize {
        self.near.len() - self.punctual.points.len()
    }

    /// Those without extent.
    pub fn punctual(&self) -> &Punctual {
        &self.punctual
    }

    /// The light that this triangle is, if it emits and is sampled.
    #[inline]
    pub fn of_triangle(&self, triangle: u32) -> Option<Source> {
        let found = self.near.binary_search_by_key(&triangle, |t| t.triangle);
        found.ok().map(|light| Source::Near(light as u32))
    }

    /// Density per area with which a point on this triangle is sampled for the point `from`; 0 where it
    /// does not emit.
    #[inline]
    pub fn density(&self, triangle: u32, from: Vec3) -> f32 {
        match self.of_triangle(triangle) {
            Some(Source::Near(light)) => self.density_of_near(light, from),
            _ => 0.0,
        }
    }

    /// Density with which a light that has a place is sampled for the point `from`: per area, of a point its probability.
    #[inline]
    pub(super) fn density_of_near(&self, light: u32, from: Vec3) -> f32 {
        let light = light as usize;
        match &self.choice {
            Choice::Power(_) => self.near[light].density,
            Choice::Place(grid) => self.near[light].density * grid.probability(light, from),
        }
    }

    /// Of a light that has a place, for the point `from`: its number, and its probability, which may be inside its
    /// density; with `u` from the share of what is far to 1.
    #[inline]
    pub(super) fn choose_near(&self, from: Vec3, u: f32) -> (usize, f32) {
        let u = (u - self.far.share) / (1.0 - self.far.share);
        match &self.choice {
            Choice::Power(table) => (table.choose(u), 1.0),
            Choice::Place(grid) => grid.choose(from, u),
        }
    }

    /// Whether there are but a few triangles with one radiance each.
    pub fn are_plain(&self) -> bool {
        self.plain
    }

    /// Whether the density depends on the point that is lit.
    #[inline]
    pub fn depend_on_place(&self) -> bool {
        matches!(self.choice, Choice::Place(_))
    }

    /// Probability of sampling the environment's map.
    #[inline]
    pub fn sky(&self) -> f32 {
        if self.far.has_map {
            self.far.each()
        } else {
            0.0
        }
    }
}

impl Far {
    /// Probability of each.
    #[inline]
    pub(super) fn each(&self) -> f32 {
        self.share / self.count as f32
    }

    /// One of them, with `u` in [0, 1).
    pub(super) fn choose(&self, u: f32) -> Source {
        let last = self.count - 1;
        let number = ((u * self.count as f32) as usize).min(last);
        if self.has_map && number == last {
            Source::Sky
        } else {
            Source::Directional(number as u32)
        }
    }
}

impl NearLight {
    /// None, in the place of one.
    pub(super) const NONE: Self = Self {
        corners: [Vec3::ZERO; 3],
        ng: Vec3::ZERO,
        radiance: Vec3::ZERO,
        density: 0.0,
        offset: 0.0,
        triangle: 0,
        kind: Kind::Plain,
    };

    fn bounds(&self) -> (Vec3, Vec3) {
        let [a, b, c] = self.corners;
        (a.min(b).min(c), a.max(b).max(c))
    }
}

/// What a light is chosen by: the mean of its channels, so that light of any colour is sampled.
fn weight(radiance: Vec3) -> f32 {
    (radiance.x + radiance.y + radiance.z) / 3.0
}

/// The mean radiance of a textured triangle, of points spread over it. Where they all miss the light,
/// sampling by BSDF alone finds it.
fn mean_radiance(mesh: &Mesh, material: &Material, triangle: u32) -> Vec3 {
    const SIDE: usize = 8;
    let mut sum = Vec3::ZERO;
    for i in 0..SIDE * SIDE {
        let u = [i % SIDE, i / SIDE].map(|k| (k as f32 + 0.5) / SIDE as f32);
        let (b, c) = warp::triangle(u);
        if !mesh.is_open(triangle, b, c) {
            sum += material.radiance(mesh, triangle, b, c);
        }
    }
    sum / (SIDE * SIDE) as f32
}
