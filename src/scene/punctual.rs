//! Lights without extent: points, spots and directional lights. No ray meets one, so light sampling alone finds them.

use super::mesh::hash_bytes;
use crate::load::lights::PunctualLight;
use glam::Vec3;
use serde::Serialize;
use xxhash_rust::xxh3::Xxh3;

/// A light at a point.
#[derive(Clone, Copy, Debug, Serialize)]
pub struct PointLight {
    /// Where it is.
    pub position: Vec3,
    /// Radiant intensity, along the axis.
    pub intensity: Vec3,
    cone: Option<Cone>,
}

/// To where a spot shines; angles in radians.
#[derive(Clone, Copy, Debug, Serialize)]
struct Cone {
    axis: Vec3,
    cutoff: f32,
    beam: f32,
}

/// A light whose rays are parallel.
#[derive(Clone, Copy, Debug, Serialize)]
pub struct DirectionalLight {
    /// Unit direction to it.
    pub direction: Vec3,
    /// Power per area across its rays.
    pub irradiance: Vec3,
}

/// The lights without extent of a scene.
#[derive(Clone, Debug, Default, Serialize)]
pub struct Punctual {
    /// Points and spots.
    pub points: Vec<PointLight>,
    /// Directional lights.
    pub directional: Vec<DirectionalLight>,
}

impl Punctual {
    /// Of what the TOML says. Those that give no light are left out.
    pub fn new(lights: &[PunctualLight]) -> Self {
        let mut punctual = Self::default();
        for light in lights {
            match *light {
                PunctualLight::Point {
                    position,
                    intensity,
                    cone,
                } => punctual.points.push(PointLight {
                    position: position.into(),
                    intensity: intensity.into(),
                    cone: cone.map(|cone| Cone {
                        axis: Vec3::from(cone.direction).normalize_or_zero(),
                        cutoff: cone.cutoff_angle.to_radians(),
                        beam: cone.beam_width.to_radians(),
                    }),
                }),
                PunctualLight::Directional {
                    direction,
                    irradiance,
                } => punctual.directional.push(DirectionalLight {
                    direction: -Vec3::from(direction).normalize_or_zero(),
                    irradiance: irradiance.into(),
                }),
            }
        }
        punctual
            .points
            .retain(|light| light.intensity != Vec3::ZERO);
        let gives_light = |light: &DirectionalLight| light.irradiance != Vec3::ZERO;
        punctual.directional.retain(gives_light);
        punctual
    }

    /// Each in words: what it is, where, and what it gives.
    pub fn describe(&self) -> Vec<String> {
        let short = |value: f32| (value * 1e3).round() / 1e3;
        let list = |v: Vec3| format!("{},{},{}", short(v.x), short(v.y), short(v.z));
        let points = self.points.iter().map(|light| {
            let (position, intensity) = (list(light.position), list(light.intensity));
            match light.cone {
                None => format!("point at {position}, intensity {intensity}"),
                Some(Cone { axis, cutoff, beam }) => format!(
                    "spot at {position} towards {}, to {}° from there and fading from {}°, \
                     intensity {intensity}",
                    list(axis),
                    short(cutoff.to_degrees()),
                    short(beam.to_degrees())
                ),
            }
        });
        let directional = self.directional.iter().map(|light| {
            let (direction, irradiance) = (list(-light.direction), list(light.irradiance));
            format!("directional towards {direction}, irradiance {irradiance}")
        });
        points.chain(directional).collect()
    }

    /// Whether there are none.
    pub fn is_empty(&self) -> bool {
        self.points.is_empty() && self.directional.is_empty()
    }

    /// Adds them to a fingerprint of the scene, which they leave as it is where there are none.
    pub fn hash_into(&self, hasher: &mut Xxh3) {
        if !self.is_empty() {
            hash_bytes(hasher, self);
        }
    }
}

impl PointLight {
    /// The share of its intensity with which it shines in the unit direction `direction`, in [0, 1]: between the beam
    /// and the cutoff it falls linearly with the angle, as in Mitsuba.
    #[inline]
    pub fn falloff(&self, direction: Vec3) -> f32 {
        let Some(Cone { axis, cutoff, beam }) = self.cone else {
            return 1.0;
        };
        let angle = axis.dot(direction).clamp(-1.0, 1.0).acos();
        if angle <= beam {
            1.0
        } else {
            ((cutoff - angle) / (cutoff - beam)).clamp(0.0, 1.0)
        }
    }

    /// The unit axis, if it shines to no more than the half of space about it.
    pub fn shines_forward(&self) -> Option<Vec3> {
        let forward = |cone: &Cone| cone.cutoff <= std::f32::consts::FRAC_PI_2;
        self.cone.filter(forward).map(|cone| cone.axis)
    }

    /// Its power over its intensity: the solid angle to which it shines, weighted by the falloff.
    pub fn solid_angle(&self) -> f32 {
        // Of ∫ sin θ falloff(θ) dθ.
        let integral = match self.cone {
            None => 2.0,
            Some(Cone { cutoff, beam, .. }) if cutoff - beam > 1e-3 => {
                1.0 - (cutoff.sin() - beam.sin()) / (cutoff - beam)
            }
            Some(Cone { cutoff, .. }) => 1.0 - cutoff.cos(),
        };
        std::f32::consts::TAU * integral
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::load::lights;

    #[test]
    fn solid_angle_is_the_integral_of_the_falloff() {
        for (cutoff_angle, beam_width) in [(20.0, 15.0), (90.0, 0.0), (180.0, 30.0), (45.0, 45.0)] {
            let light = PunctualLight::Point {
                position: [0.0; 3],
                intensity: [1.0; 3],
                cone: Some(lights::Cone {
                    direction: [0.0, -2.0, 0.0],
                    cutoff_angle,
                    beam_width,
                }),
            };
            let light = Punctual::new(&[light]).points[0];
            const STEPS: u32 = 20_000;
            let step = std::f64::consts::PI / f64::from(STEPS);
            let integral: f64 = (0..STEPS)
                .map(|i| {
                    let angle = (f64::from(i) + 0.5) * step;
                    let direction = Vec3::new(angle.sin() as f32, -angle.cos() as f32, 0.0);
                    angle.sin() * f64::from(light.falloff(direction))
                })
                .sum();
            let integral = std::f64::consts::TAU * step * integral;
            let found = f64::from(light.solid_angle());
            assert!((found / integral - 1.0).abs() < 1e-3, "{found} {integral}");
        }
    }
}
