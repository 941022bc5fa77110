//! Light sources: triangles that emit, chosen in proportion to their power.

use super::material::Material;
use super::mesh::Mesh;
use crate::warp;
use glam::Vec3;

/// The emitting triangles of a scene. A constant environment is no light to be sampled: the directions
/// that BSDF sampling draws fit it as well as any could.
#[derive(Debug, Default)]
pub struct Lights {
    triangles: Vec<LightTriangle>,
    /// Sum of the powers up to and including each triangle, over the total.
    cumulative: Vec<f32>,
    /// By material: density of a sampled point per area, 0 for what does not emit.
    density: Vec<f32>,
}

#[derive(Clone, Copy, Debug)]
struct LightTriangle {
    corners: [Vec3; 3],
    ng: Vec3,
    radiance: Vec3,
    density: f32,
    offset: f32,
}

/// A point on a light.
#[derive(Clone, Copy, Debug)]
pub struct LightSample {
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

impl Lights {
    /// The lights among the triangles of `mesh`.
    pub fn new(mesh: &Mesh, materials: &[Material]) -> Self {
        let mut triangles = Vec::new();
        let mut powers = Vec::new();
        for (index, &material) in mesh.material_of.iter().enumerate() {
            let Some(radiance) = materials[material as usize].emission else {
                continue;
            };
            let corners = mesh.corners(index as u32);
            let point = mesh.point(index as u32, 1.0 / 3.0, 1.0 / 3.0);
            powers.push(f64::from(mesh.area(index as u32)) * f64::from(weight(radiance)));
            triangles.push(LightTriangle {
                corners,
                ng: point.ng,
                radiance,
                density: 0.0,
                offset: point.offset,
            });
        }
        let total: f64 = powers.iter().sum();
        if triangles.is_empty() || total <= 0.0 {
            return Self {
                density: vec![0.0; materials.len()],
                ..Self::default()
            };
        }
        // Power is area times weight, so the density per area depends on the material alone.
        let density = |radiance: Vec3| (f64::from(weight(radiance)) / total) as f32;
        let mut sum = 0.0;
        let cumulative = powers
            .iter()
            .map(|p| {
                sum += p / total;
                sum as f32
            })
            .collect();
        for t in &mut triangles {
            t.density = density(t.radiance);
        }
        let by_material = materials
            .iter()
            .map(|m| m.emission.map_or(0.0, density))
            .collect();
        Self {
            triangles,
            cumulative,
            density: by_material,
        }
    }

    /// Whether nothing emits.
    #[inline]
    pub fn is_empty(&self) -> bool {
        self.triangles.is_empty()
    }

    /// Density per area with which [`Lights::sample`] draws a point on a triangle of this material.
    #[inline]
    pub fn density(&self, material: u32) -> f32 {
        self.density[material as usize]
    }

    /// Draws a point on a light with `u` in [0, 1)³: the light (0) and the point on it (1, 2). There
    /// must be a light.
    #[inline]
    pub fn sample(&self, u: [f32; 3]) -> LightSample {
        let chosen = self
            .cumulative
            .partition_point(|&c| c <= u[0])
            .min(self.triangles.len() - 1);
        let light = &self.triangles[chosen];
        let (b, c) = warp::triangle([u[1], u[2]]);
        let [p0, p1, p2] = light.corners;
        LightSample {
            position: p0 * (1.0 - b - c) + p1 * b + p2 * c,
            ng: light.ng,
            radiance: light.radiance,
            density: light.density,
            offset: light.offset,
        }
    }
}

/// What a light is chosen by: the mean of its channels, so that light of any colour is sampled.
fn weight(radiance: Vec3) -> f32 {
    (radiance.x + radiance.y + radiance.z) / 3.0
}
