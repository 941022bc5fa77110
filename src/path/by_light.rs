//! What light sampling would have had where BSDF sampling found a light, for the balance heuristic.

use crate::geometry::solid_angle_per_area;
use crate::scene::Scene;
use crate::vertex::Interaction;
use glam::Vec3;

/// How light sampling would have made a path that BSDF sampling made.
#[derive(Clone, Copy, Debug)]
pub(super) enum ByLight {
    /// Not at all.
    Never,
    /// By a point on this triangle; `scale` makes its density per area one over that of BSDF sampling.
    Triangle { triangle: u32, scale: f32 },
    /// By a direction to the environment: the density over that of BSDF sampling.
    Sky(f32),
}

impl ByLight {
    /// For a path that left the rough vertex at `from` in the direction `wi`, with the density `pdf`, and
    /// ended at `end`.
    #[inline]
    pub(super) fn of(scene: &Scene, from: Vec3, end: &Interaction, wi: Vec3, pdf: f32) -> Self {
        match (end, scene.environment.map()) {
            // Such samples are thrown away.
            (Interaction::Light(light), _) if light.radiance == Vec3::ZERO => ByLight::Never,
            (Interaction::Light(light), _) => solid_angle_per_area(from, light.position, light.ng)
                .map_or(ByLight::Never, |(_, g)| ByLight::Triangle {
                    triangle: light.triangle,
                    scale: 1.0 / (g * pdf),
                }),
            (_, Some(map)) => ByLight::Sky(scene.lights.sky() * map.density(wi) / pdf),
            // A constant environment is not sampled as a light.
            (_, None) => ByLight::Never,
        }
    }

    /// Density of light sampling at a vertex, over that of BSDF sampling at the base path's.
    #[inline]
    pub(super) fn density(&self, scene: &Scene, from: Vec3) -> f32 {
        match *self {
            ByLight::Never => 0.0,
            ByLight::Triangle { triangle, scale } => scene.lights.density(triangle, from) * scale,
            ByLight::Sky(density) => density,
        }
    }
}
