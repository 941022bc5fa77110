//! The optional TOML beside an OBJ: camera, film, environment and repairs of materials, as written.

use super::environment::EnvironmentTable;
use super::find::beside;
use super::lights::{LightTable, PunctualLight};
use super::repair::{self, Repair};
use crate::error::{Error, Result};
use serde::Deserialize;
use std::collections::BTreeMap;
use std::path::{Path, PathBuf};

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
    /// `[[lights]]`
    #[serde(default, rename = "lights")]
    light_tables: Vec<toml::Spanned<LightTable>>,
    /// What they say.
    #[serde(skip)]
    pub lights: Vec<PunctualLight>,
    /// `[materials.NAME]`
    #[serde(default)]
    materials: BTreeMap<String, repair::Table>,
    /// What they say.
    #[serde(skip)]
    pub repairs: Vec<Repair>,
}

/// `[camera]`
#[derive(Clone, Debug, Default, PartialEq, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct CameraTable {
    /// Position of the pinhole.
    pub origin: Option<[f32; 3]>,
    /// A point in the middle of the picture.
    pub target: Option<[f32; 3]>,
    /// The side from which the whole scene is seen, in place of an origin.
    pub view: Option<View>,
    /// Degrees from the front, counter-clockwise seen from above; the view's if absent.
    pub azimuth: Option<f32>,
    /// Degrees above the horizon, from -90 to 90; the view's if absent.
    pub elevation: Option<f32>,
    /// How many times larger things are in the picture.
    pub zoom: Option<f32>,
    /// The direction that is upwards in the picture. If absent it is y where there is an origin, and decided by
    /// the geometry where there is none.
    pub up: Option<Up>,
    /// Vertical field of view in degrees.
    pub fov: Option<f32>,
    /// Diameter of the lens; without it everything is in focus.
    pub aperture: Option<f32>,
    /// Distance along the view at which things are in focus; the target's if absent.
    pub focus: Option<f32>,
    /// Whether the camera will be turned about its target: then all of the scene is in the picture all the way
    /// round.
    #[serde(skip)]
    pub all_around: bool,
}

/// A side from which a scene is seen.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Deserialize, clap::ValueEnum)]
#[serde(rename_all = "kebab-case")]
pub enum View {
    /// From the front and the right, and from above.
    ThreeQuarter,
    /// From the front.
    Front,
    /// From behind.
    Back,
    /// From the left.
    Left,
    /// From the right.
    Right,
    /// From above.
    Top,
    /// From below.
    Bottom,
    /// From within, as in a room.
    Inside,
}

/// Which direction is upwards.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Up {
    /// As the geometry has it.
    Auto,
    /// Along this vector.
    Along([f32; 3]),
}

impl From<[f32; 3]> for Up {
    fn from(direction: [f32; 3]) -> Self {
        Up::Along(direction)
    }
}

impl std::str::FromStr for Up {
    type Err = String;

    /// `auto`, or the name of an axis.
    fn from_str(text: &str) -> std::result::Result<Self, String> {
        Ok(match text {
            "auto" => Up::Auto,
            "x" => Up::Along([1.0, 0.0, 0.0]),
            "y" => Up::Along([0.0, 1.0, 0.0]),
            "z" => Up::Along([0.0, 0.0, 1.0]),
            "-x" => Up::Along([-1.0, 0.0, 0.0]),
            "-y" => Up::Along([0.0, -1.0, 0.0]),
            "-z" => Up::Along([0.0, 0.0, -1.0]),
            _ => return Err("needs auto, x, y, z, -x, -y or -z, or a vector".to_owned()),
        })
    }
}

impl<'de> Deserialize<'de> for Up {
    fn deserialize<D: serde::Deserializer<'de>>(from: D) -> std::result::Result<Self, D::Error> {
        #[derive(Deserialize)]
        #[serde(untagged)]
        enum Written {
            Name(String),
            Vector([f32; 3]),
        }
        match Written::deserialize(from)? {
            Written::Name(name) => name.parse().map_err(serde::de::Error::custom),
            Written::Vector(vector) => Ok(Up::Along(vector)),
        }
    }
}

impl CameraTable {
    /// This, and what it leaves out from `other`. Where this says from where the scene is seen, the other's
    /// place does not matter.
    pub fn or(&self, other: &Self) -> Self {
        let mut other = other.clone();
        if self.has_side() {
            (other.origin, other.target) = (None, None);
        }
        if self.origin.is_some() {
            (other.view, other.azimuth, other.elevation) = (None, None, None);
        }
        if self.view.is_some() {
            (other.azimuth, other.elevation) = (None, None);
        }
        Self {
            origin: self.origin.or(other.origin),
            target: self.target.or(other.target),
            view: self.view.or(other.view),
            azimuth: self.azimuth.or(other.azimuth),
            elevation: self.elevation.or(other.elevation),
            zoom: self.zoom.or(other.zoom),
            up: self.up.or(other.up),
            fov: self.fov.or(other.fov),
            aperture: self.aperture.or(other.aperture),
            focus: self.focus.or(other.focus),
            all_around: self.all_around || other.all_around,
        }
    }

    /// Whether it says from which side the scene is seen.
    pub fn has_side(&self) -> bool {
        self.view.is_some() || self.azimuth.is_some() || self.elevation.is_some()
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
    let line = |at: usize| text[..at.min(text.len())].matches('\n').count() + 1;
    let mut sidecar: Sidecar = toml::from_str(&text).map_err(|e| {
        let at = e.span().map(|s| line(s.start));
        fail(at, e.message().replace('\n', " "))
    })?;
    let environment = &mut sidecar.environment;
    if let Some(contradiction) = environment.contradiction() {
        return Err(fail(None, format!("[environment] {contradiction}")));
    }
    environment.settle(path.parent().unwrap_or(Path::new("")));
    environment.read_map()?;
    let lights = sidecar.light_tables.iter().map(|table| {
        let fault = |message| fail(Some(line(table.span().start)), message);
        table.get_ref().read().map_err(fault)
    });
    sidecar.lights = lights.collect::<Result<_>>()?;
    let repairs = sidecar.materials.iter();
    let repairs = repairs.map(|(name, table)| Repair::read(&path, name, table));
    sidecar.repairs = repairs.collect::<Result<_>>()?;
    Ok(sidecar)
}
