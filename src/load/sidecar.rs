//! The optional TOML beside an OBJ: camera, film and environment, as written.

use super::bitmap::{self, Bitmap};
use super::find::beside;
use crate::error::{Error, Result};
use serde::Deserialize;
use std::collections::BTreeMap;
use std::path::{Path, PathBuf};
use std::sync::Arc;

/// What `<stem>.toml` may say. What is absent is chosen automatically.
#[derive(Clone, Debug, Default, PartialEq, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Sidecar {
    /// `[camera]`
    #[serde(default)]
    pub camera: CameraTable,
    /// `[cameras.NAME]`: others, which take from `[camera]` what they leave out.
    #[serde(default)]
    pub cameras: BTreeMap<String, CameraTable>,
    /// `[film]`
    #[serde(default)]
    pub film: FilmTable,
    /// `[environment]`
    #[serde(default)]
    pub environment: EnvironmentTable,
}

/// `[camera]`
#[derive(Clone, Debug, Default, PartialEq, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct CameraTable {
    /// Position of the pinhole.
    pub origin: Option<[f32; 3]>,
    /// A point in the middle of the picture.
    pub target: Option<[f32; 3]>,
    /// The direction that is upwards in the picture.
    pub up: Option<[f32; 3]>,
    /// Vertical field of view in degrees.
    pub fov: Option<f32>,
    /// Diameter of the lens; without it everything is in focus.
    pub aperture: Option<f32>,
    /// Distance along the view at which things are in focus; the target's if absent.
    pub focus: Option<f32>,
}

impl CameraTable {
    /// This, and what it leaves out from `other`.
    pub fn or(&self, other: &Self) -> Self {
        Self {
            origin: self.origin.or(other.origin),
            target: self.target.or(other.target),
            up: self.up.or(other.up),
            fov: self.fov.or(other.fov),
            aperture: self.aperture.or(other.aperture),
            focus: self.focus.or(other.focus),
        }
    }
}

/// `[film]`
#[derive(Clone, Debug, Default, PartialEq, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct FilmTable {
    /// Pixels across.
    pub width: Option<u32>,
    /// Pixels down.
    pub height: Option<u32>,
}

/// `[environment]`
#[derive(Clone, Debug, Default, PartialEq, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct EnvironmentTable {
    /// Radiance from all directions.
    pub radiance: Option<[f32; 3]>,
    /// A picture of the light from all directions; from the TOML's folder on.
    pub map: Option<PathBuf>,
    /// Degrees by which the map is turned about the vertical axis, counter-clockwise seen from above.
    pub rotation: Option<f32>,
    /// Factor on the map's values.
    pub scale: Option<f32>,
    /// The map's picture.
    #[serde(skip)]
    pub bitmap: Option<Arc<Bitmap>>,
}

impl EnvironmentTable {
    /// Reads the picture of the map, if there is one.
    pub fn read_map(&mut self) -> Result<()> {
        if let Some(path) = &self.map {
            self.bitmap = Some(Arc::new(bitmap::load(path)?));
        }
        Ok(())
    }
}

impl Sidecar {
    /// The camera of this name, or the unnamed one; an error says which names there are.
    pub fn camera_named(&self, name: Option<&str>) -> Result<CameraTable> {
        let Some(name) = name else {
            return Ok(self.camera.clone());
        };
        match self.cameras.get(name) {
            Some(camera) => Ok(camera.or(&self.camera)),
            None => {
                let names: Vec<&str> = self.cameras.keys().map(String::as_str).collect();
                let names = if names.is_empty() {
                    "there are no [cameras.NAME] in the TOML".to_owned()
                } else {
                    format!("there are: {}", names.join(", "))
                };
                Err(Error::Setting(format!("no camera '{name}'; {names}")))
            }
        }
    }
}

/// The path of the TOML that belongs to an OBJ.
pub fn path_for(obj: &Path) -> PathBuf {
    beside(obj, "toml")
}

/// Reads the TOML beside `obj`; all absent where there is none.
pub fn load(obj: &Path) -> Result<Sidecar> {
    let path = path_for(obj);
    if !path.exists() {
        return Ok(Sidecar::default());
    }
    let text = std::fs::read_to_string(&path).map_err(Error::io(&path, "cannot be read"))?;
    let fail = |line, message: String| Error::input(&path, line, message);
    let mut sidecar: Sidecar = toml::from_str(&text).map_err(|e| {
        let line = e
            .span()
            .map(|s| text[..s.start.min(text.len())].matches('\n').count() + 1);
        fail(line, e.message().replace('\n', " "))
    })?;
    let environment = &mut sidecar.environment;
    if environment.radiance.is_some() && environment.map.is_some() {
        let message = "[environment] has both radiance and map: give one of them";
        return Err(fail(None, message.to_owned()));
    }
    if environment.map.is_none() && (environment.rotation.is_some() || environment.scale.is_some())
    {
        let message = "[environment] has rotation or scale, but no map for it";
        return Err(fail(None, message.to_owned()));
    }
    if let Some(map) = &mut environment.map {
        *map = path.parent().unwrap_or(Path::new("")).join(&map);
    }
    environment.read_map()?;
    Ok(sidecar)
}
