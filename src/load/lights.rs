//! `[[lights]]` of the TOML: lights without extent, as written.

use serde::Deserialize;

/// A light without extent. Lengths are those of the scene.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum PunctualLight {
    /// Shines from a point.
    Point {
        /// Where it is.
        position: [f32; 3],
        /// Radiant intensity: power per solid angle; that along the axis of a cone.
        intensity: [f32; 3],
        /// To where it shines; everywhere if absent.
        cone: Option<Cone>,
    },
    /// Shines from so far away that its rays are parallel.
    Directional {
        /// To where it shines, of any length.
        direction: [f32; 3],
        /// Power per area across its rays.
        irradiance: [f32; 3],
    },
}

/// To where a spot shines.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Cone {
    /// Its axis, of any length.
    pub direction: [f32; 3],
    /// Degrees from the axis from which on it is dark, above 0, at most 180.
    pub cutoff_angle: f32,
    /// Degrees from the axis up to which it is as bright as there, at most `cutoff_angle`.
    pub beam_width: f32,
}

/// Degrees from the axis at which a spot ends of which nothing is said.
const CUTOFF_ANGLE: f32 = 20.0;
/// The share of them up to which it is bright.
const BEAM: f32 = 0.75;

/// A table of `[[lights]]`; keys and their meanings are those of Mitsuba.
#[derive(Clone, Debug, PartialEq, Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct LightTable {
    kind: Kind,
    position: Option<[f32; 3]>,
    target: Option<[f32; 3]>,
    direction: Option<[f32; 3]>,
    intensity: Option<Colour>,
    irradiance: Option<Colour>,
    cutoff_angle: Option<f32>,
    beam_width: Option<f32>,
}

#[derive(Clone, Copy, Debug, PartialEq, Eq, Deserialize)]
#[serde(rename_all = "lowercase")]
enum Kind {
    Point,
    Spot,
    Directional,
}

/// One number is a grey.
#[derive(Clone, Copy, Debug, PartialEq, Deserialize)]
#[serde(untagged, expecting = "needs a number or [red, green, blue]")]
enum Colour {
    Grey(f32),
    Rgb([f32; 3]),
}

impl LightTable {
    /// What it says, or what is wrong with it.
    pub(super) fn read(&self) -> Result<PunctualLight, String> {
        let kind = match self.kind {
            Kind::Point => "a point",
            Kind::Spot => "a spot",
            Kind::Directional => "a directional light",
        };
        let is_spot = self.kind == Kind::Spot;
        let is_near = self.kind != Kind::Directional;
        for (key, there, belongs) in [
            ("position", self.position.is_some(), is_near),
            ("intensity", self.intensity.is_some(), is_near),
            ("irradiance", self.irradiance.is_some(), !is_near),
            ("target", self.target.is_some(), is_spot),
            (
                "direction",
                self.direction.is_some(),
                self.kind != Kind::Point,
            ),
            ("cutoff_angle", self.cutoff_angle.is_some(), is_spot),
            ("beam_width", self.beam_width.is_some(), is_spot),
        ] {
            if there && !belongs {
                return Err(format!("{kind} has no {key}"));
            }
        }
        let lacks = |key: &str| format!("{kind} needs {key}");
        let colour = |key: &str, colour: Option<Colour>| {
            let colour = match colour.ok_or_else(|| lacks(key))? {
                Colour::Grey(grey) => [grey; 3],
                Colour::Rgb(rgb) => rgb,
            };
            let valid = colour.iter().all(|c| c.is_finite() && *c >= 0.0);
            let fault = || format!("{key} must be finite and not negative");
            valid.then_some(colour).ok_or_else(fault)
        };
        if !is_near {
            let direction = self.direction.ok_or_else(|| lacks("direction"))?;
            return Ok(PunctualLight::Directional {
                direction: checked_direction(direction)?,
                irradiance: colour("irradiance", self.irradiance)?,
            });
        }
        let position = self.position.ok_or_else(|| lacks("position"))?;
        if !position.iter().all(|x| x.is_finite()) {
            return Err("position must be finite".to_owned());
        }
        Ok(PunctualLight::Point {
            position,
            intensity: colour("intensity", self.intensity)?,
            cone: if is_spot {
                Some(self.cone(position)?)
            } else {
                None
            },
        })
    }

    fn cone(&self, position: [f32; 3]) -> Result<Cone, String> {
        let direction = match (self.direction, self.target) {
            (Some(direction), None) => direction,
            (None, Some(target)) => std::array::from_fn(|axis| target[axis] - position[axis]),
            (Some(_), Some(_)) => return Err("has both direction and target: give one".to_owned()),
            (None, None) => return Err("a spot needs direction or target".to_owned()),
        };
        let cutoff_angle = self.cutoff_angle.unwrap_or(CUTOFF_ANGLE);
        if !(cutoff_angle > 0.0 && cutoff_angle <= 180.0) {
            return Err(format!(
                "cutoff_angle must be above 0 and at most 180 degrees, got {cutoff_angle}"
            ));
        }
        let beam_width = self.beam_width.unwrap_or(BEAM * cutoff_angle);
        if !(beam_width >= 0.0 && beam_width <= cutoff_angle) {
            return Err(format!(
                "beam_width must be from 0 to cutoff_angle, {cutoff_angle}, got {beam_width}"
            ));
        }
        Ok(Cone {
            direction: checked_direction(direction)?,
            cutoff_angle,
            beam_width,
        })
    }
}

fn checked_direction(direction: [f32; 3]) -> Result<[f32; 3], String> {
    let vector = glam::Vec3::from(direction);
    match vector.try_normalize() {
        Some(_) if vector.is_finite() => Ok(direction),
        _ => Err(format!("{direction:?} is no direction")),
    }
}
