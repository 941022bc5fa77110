//! The optional TOML beside an OBJ: camera, film and environment, as written.

use crate::error::{Error, Result};
use serde::Deserialize;
use std::path::{Path, PathBuf};

/// What `<stem>.toml` may say. What is absent is chosen automatically.
#[derive(Clone, Debug, Default, PartialEq, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Sidecar {
    /// `[camera]`
    #[serde(default)]
    pub camera: CameraTable,
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
}

/// The path of the TOML that belongs to an OBJ.
pub fn path_for(obj: &Path) -> PathBuf {
    obj.with_extension("toml")
}

/// Reads the TOML beside `obj`; all absent where there is none.
pub fn load(obj: &Path) -> Result<Sidecar> {
    let path = path_for(obj);
    if !path.exists() {
        return Ok(Sidecar::default());
    }
    let text = std::fs::read_to_string(&path).map_err(Error::io(&path, "cannot be read"))?;
    toml::from_str(&text).map_err(|e| {
        let line = e
            .span()
            .map(|s| text[..s.start.min(text.len())].matches('\n').count() + 1);
        Error::input(&path, line, e.message().replace('\n', " "))
    })
}
