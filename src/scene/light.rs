//! Light sources: triangles that emit, chosen in proportion to their power, and the environment's map.

use super::Scene;
use super::alias::Alias;
use super::environment::SkySample;
use super::material::Material;
use super::mesh::Mesh;
use crate::warp;
use glam::Vec3;

/// What is sampled as a light.
#[derive(Debug, Default)]
pub struct Lights {
    /// In the order of their triangles.
    triangles: Vec<LightTriangle>,
    choice: Alias,
    /// Probability of sampling the environment's map in place of a triangle; 0 where there is none.
    sky: f32,
}

#[derive(Clone, Copy, Debug)]
struct LightTriangle {
    corners: [Vec3; 3],
    ng: Vec3,
    /// Where it is not textured.
    radiance: Vec3,
    /// Density of sampled points per area, over all lights.
    density: f32,
    offset: f32,
    triangle: u32,
    textured: bool,
}

/// A sampled point on a light, or a direction to the environment.
#[derive(Clone, Copy, Debug)]
pub enum LightSample {
    /// A point on a triangle.
    Surface(SurfaceSample),
    /// A direction to the environment's map; its density is over all lights.
    Sky(SkySample),
}

/// A point on a light.
#[derive(Clone, Copy, Debug)]
pub struct SurfaceSample {
    /// Where it is.
    pub position: Vec3,
    /// The side that emits.
    pub ng: Vec3,
    /// Radiance emitted to that side.
    pub radiance: Vec3,
    /// Density per area, over all lights.
    pub density: f32,
    /// Distance by which rays end before the surface.
    pub offset: f32,
}

/// Probability of the environment where there are emitting triangles too. Which of them gives more light
/// differs from point to point.
const SKY_AMONG_LIGHTS: f32 = 0.5;

impl Lights {
    /// The lights among the triangles of `mesh`, beside the environment's map if `has_map`.
    pub fn new(mesh: &Mesh, materials: &[Material], has_map: bool) -> Self {
        let mut triangles = Vec::new();
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
            // Power is area times weight.
            powers.push(f64::from(mesh.area(index)) * f64::from(weight(mean)));
            triangles.push(LightTriangle {
                corners: mesh.corners(index),
                ng: point.ng,
                radiance,
                density: weight(mean),
                offset: point.offset,
                triangle: index,
                textured,
            });
        }
        let total: f64 = powers.iter().sum();
        if total <= 0.0 {
            return Self {
                sky: if has_map { 1.0 } else { 0.0 },
                ..Self::default()
            };
        }
        let sky = if has_map { SKY_AMONG_LIGHTS } else { 0.0 };
        for light in &mut triangles {
            light.density = (f64::from(light.density) / total * f64::from(1.0 - sky)) as f32;
        }
        Self {
            triangles,
            choice: Alias::new(&powers),
            sky,
        }
    }

    /// Whether nothing is sampled as a light.
    #[inline]
    pub fn is_empty(&self) -> bool {
        self.triangles.is_empty() && self.sky == 0.0
    }

    /// Number of emitting triangles.
    pub fn len(&self) -> usize {
        self.triangles.len()
    }

    /// Density per area with which a point on this triangle is sampled; 0 where it does not emit.
    #[inline]
    pub fn density(&self, triangle: u32) -> f32 {
        match self
            .triangles
            .binary_search_by_key(&triangle, |t| t.triangle)
        {
            Ok(light) => self.triangles[light].density,
            Err(_) => 0.0,
        }
    }

    /// Probability of sampling the environment's map.
    #[inline]
    pub fn sky(&self) -> f32 {
        self.sky
    }
}

impl Scene {
    /// Draws a point on a light, or a direction to the environment, with `u` in [0, 1)³: the light (0) and
    /// the point on it (1, 2). There must be a light. `None` where no light comes from there.
    #[inline]
    pub fn sample_light(&self, u: [f32; 3]) -> Option<LightSample> {
        let lights = &self.lights;
        if lights.sky > 0.0 {
            return self.sample_with_sky(u);
        }
        self.sample_triangle(u)
    }

    #[inline(always)]
    fn sample_triangle(&self, u: [f32; 3]) -> Option<LightSample> {
        let light = &self.lights.triangles[self.lights.choice.choose(u[0])];
        let (b, c) = warp::triangle([u[1], u[2]]);
        let radiance = if light.textured {
            self.textured_radiance(light, b, c)?
        } else {
            light.radiance
        };
        let [p0, p1, p2] = light.corners;
        Some(LightSample::Surface(SurfaceSample {
            position: p0 * (1.0 - b - c) + p1 * b + p2 * c,
            ng: light.ng,
            radiance,
            density: light.density,
            offset: light.offset,
        }))
    }

    // Not inlined, as below: scenes without maps shall not have it in their loops.
    #[cold]
    #[inline(never)]
    fn sample_with_sky(&self, mut u: [f32; 3]) -> Option<LightSample> {
        let sky = self.lights.sky;
        if u[0] < sky {
            let mut sample = self.environment.map()?.sample([u[1], u[2]])?;
            sample.density *= sky;
            return Some(LightSample::Sky(sample));
        }
        u[0] = (u[0] - sky) / (1.0 - sky);
        self.sample_triangle(u)
    }

    #[cold]
    #[inline(never)]
    fn textured_radiance(&self, light: &LightTriangle, b: f32, c: f32) -> Option<Vec3> {
        let material = self.mesh.material_of[light.triangle as usize];
        let material = &self.materials[material as usize];
        let radiance = material.radiance(&self.mesh, light.triangle, b, c);
        (radiance != Vec3::ZERO && !self.mesh.is_open(light.triangle, b, c)).then_some(radiance)
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
