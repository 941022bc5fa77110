//! What surrounds a scene: the environment and the background that are asked for, or what suits a scene of
//! which nothing is said.

use super::camera::Camera;
use super::environment::{Axes, Environment, EnvironmentMap, MapKind};
use super::{sky, studio};
use crate::error::{Error, Result, Warnings};
use crate::load::bitmap::Bitmap;
use crate::load::environment::{Background, EnvironmentTable, Model};
use glam::Vec3;
use std::sync::Arc;

/// What the user asked for as the environment and the background.
#[derive(Clone, Debug)]
pub struct EnvironmentSetting {
    /// Where the light is from.
    pub source: EnvironmentSource,
    /// Factor on its radiance.
    pub scale: f32,
    /// Degrees by which it is turned about the vertical axis, counter-clockwise seen from above.
    pub rotation: f32,
    /// What the camera sees where there is nothing; chosen by the light if absent.
    pub background: Option<Background>,
}

/// Where light comes from in which there is nothing.
#[derive(Clone, Debug, Default)]
pub enum EnvironmentSource {
    /// Nowhere; from a studio where the scene has no lamps.
    #[default]
    Automatic,
    /// Everywhere, with this radiance.
    Constant(Vec3),
    /// A picture: longitude across, latitude down.
    Map(Arc<Bitmap>),
    /// A clear sky.
    Sky {
        /// Degrees from the front to the sun, counter-clockwise seen from above.
        azimuth: f32,
        /// Degrees from the horizon to the sun, 0 to 90.
        elevation: f32,
    },
    /// A studio.
    Studio,
}

/// Azimuth and elevation of the sun where they are not given: from the left of who sees the scene from the
/// front, before noon.
const SUN: [f32; 2] = [-30.0, 40.0];

/// What the camera sees in a studio: a light grey.
const STUDIO_BACKGROUND: Background = Background::Colour([0.62; 3]);

impl Default for EnvironmentSetting {
    fn default() -> Self {
        EnvironmentSource::default().into()
    }
}

impl From<EnvironmentSource> for EnvironmentSetting {
    fn from(source: EnvironmentSource) -> Self {
        Self {
            source,
            scale: 1.0,
            rotation: 0.0,
            background: None,
        }
    }
}

impl From<Vec3> for EnvironmentSetting {
    fn from(radiance: Vec3) -> Self {
        EnvironmentSource::Constant(radiance).into()
    }
}

impl EnvironmentSetting {
    /// What a table asks for.
    pub fn of_table(table: &EnvironmentTable) -> Self {
        let source = match (table.radiance, &table.bitmap, table.model, table.sun) {
            (Some(radiance), ..) => EnvironmentSource::Constant(radiance.into()),
            (_, Some(bitmap), ..) => EnvironmentSource::Map(bitmap.clone()),
            (_, _, Some(Model::Studio), _) => EnvironmentSource::Studio,
            (.., None, None) => EnvironmentSource::Automatic,
            (.., sun) => {
                let [azimuth, elevation] = sun.unwrap_or(SUN);
                EnvironmentSource::Sky { azimuth, elevation }
            }
        };
        Self {
            source,
            scale: table.scale.unwrap_or(1.0),
            rotation: table.rotation.unwrap_or(0.0),
            background: table.background,
        }
    }
}

/// The environment and the background of a scene that is seen by `camera`.
pub(super) fn build(
    setting: &EnvironmentSetting,
    camera: &Camera,
    has_lamps: bool,
    warnings: &mut Warnings,
) -> Result<(Environment, Background)> {
    let EnvironmentSetting {
        scale, rotation, ..
    } = *setting;
    if !(scale.is_finite() && scale > 0.0 && rotation.is_finite()) {
        return Err(Error::Setting(format!(
            "the environment's scale {scale} must be above 0, and its rotation {rotation} finite"
        )));
    }
    let axes = Axes::of_up(camera.up());
    let map = |bitmap: Arc<Bitmap>, rotation: f32, kind| {
        let mut map = EnvironmentMap::new(bitmap, scale, rotation, axes)?;
        map.kind = kind;
        Some(Environment::Map(Box::new(map)))
    };
    let black = || Error::Setting("the environment's map is black".into());
    let environment = match &setting.source {
        EnvironmentSource::Constant(radiance) => {
            let radiance = *radiance * scale;
            if !(radiance.is_finite() && radiance.min_element() >= 0.0) {
                return Err(Error::Setting(format!(
                    "the environment's radiance must be finite and not negative, got {radiance}"
                )));
            }
            Environment::Constant(radiance)
        }
        EnvironmentSource::Map(bitmap) => {
            map(bitmap.clone(), rotation, MapKind::Picture).ok_or_else(black)?
        }
        EnvironmentSource::Sky { azimuth, elevation } => {
            let bitmap = sky::bitmap(*elevation)?;
            if !azimuth.is_finite() {
                let message = format!("the sun's azimuth must be a number, got {azimuth}");
                return Err(Error::Setting(message));
            }
            map(Arc::new(bitmap), rotation + azimuth, MapKind::Sky).ok_or_else(black)?
        }
        EnvironmentSource::Automatic if has_lamps => Environment::Constant(Vec3::ZERO),
        EnvironmentSource::Automatic | EnvironmentSource::Studio => {
            let rotation = studio_rotation(camera, rotation);
            map(Arc::new(studio::bitmap()), rotation, MapKind::Studio).ok_or_else(black)?
        }
    };
    let is_studio = environment
        .map()
        .is_some_and(|map| map.kind == MapKind::Studio);
    if is_studio && matches!(setting.source, EnvironmentSource::Automatic) {
        warnings.note("the scene has no light: a studio is used (--environment 1 for white)");
    }
    let background = setting.background.unwrap_or(if is_studio {
        STUDIO_BACKGROUND
    } else {
        Background::Environment
    });
    Ok((environment, background))
}

/// The rotation of a studio in degrees: with the camera, and by `rotation` against it. By the camera's right,
/// which is horizontal where it looks straight down too.
pub(super) fn studio_rotation(camera: &Camera, rotation: f32) -> f32 {
    Axes::of_up(camera.up()).azimuth(camera.right()) - 90.0 + rotation
}
