//! `[environment]` of the TOML: light from where there is nothing, and what the camera sees there, as written.

use super::bitmap::{self, Bitmap};
use crate::error::Result;
use serde::Deserialize;
use std::path::{Path, PathBuf};
use std::str::FromStr;
use std::sync::Arc;

/// `[environment]`
#[derive(Clone, Debug, Default, PartialEq, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct EnvironmentTable {
    /// Radiance from all directions.
    pub radiance: Option<[f32; 3]>,
    /// A picture of the light from all directions; from the TOML's folder on.
    pub map: Option<PathBuf>,
    /// Light that is made by a model.
    pub model: Option<Model>,
    /// Where the sun of the sky is: azimuth and elevation in degrees.
    pub sun: Option<[f32; 2]>,
    /// Degrees by which all of it is turned about the vertical axis, counter-clockwise seen from above.
    pub rotation: Option<f32>,
    /// Factor on its radiance.
    pub scale: Option<f32>,
    /// What the camera sees where there is nothing.
    pub background: Option<Background>,
    /// The map's picture.
    #[serde(skip)]
    pub bitmap: Option<Arc<Bitmap>>,
}

/// Light that is made by a model.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum Model {
    /// A clear sky with the sun.
    Sky,
    /// The lamps of a photographer, about the camera.
    Studio,
}

/// What camera rays see where there is nothing. Rays that have scattered meet the environment there.
#[derive(Clone, Copy, Debug, PartialEq, Deserialize)]
#[serde(try_from = "toml::Value")]
pub enum Background {
    /// The environment.
    Environment,
    /// A colour, linear, from 0 to 1: exposure and tone curves leave it as it is.
    Colour([f32; 3]),
    /// Nothing: pictures have an alpha channel.
    Transparent,
}

impl EnvironmentTable {
    /// Reads the picture of the map, if there is one.
    pub fn read_map(&mut self) -> Result<()> {
        if let Some(path) = &self.map {
            self.bitmap = Some(Arc::new(bitmap::load(path)?));
        }
        Ok(())
    }

    /// Which of the keys that exclude one another are there, if it is more than one.
    pub(super) fn contradiction(&self) -> Option<String> {
        if self.model == Some(Model::Studio) && self.sun.is_some() {
            return Some("has a sun, but its model is no sky".to_owned());
        }
        let keys = [
            ("radiance", self.radiance.is_some()),
            ("map", self.map.is_some()),
            ("model", self.model.is_some()),
            ("sun", self.model.is_none() && self.sun.is_some()),
        ];
        let there: Vec<&str> = keys.iter().filter(|k| k.1).map(|k| k.0).collect();
        match there[..] {
            [] | [_] => None,
            [first, second, ..] => Some(format!("has both {first} and {second}: give one of them")),
        }
    }

    /// Takes the map's path from `folder` on.
    pub(super) fn settle(&mut self, folder: &Path) {
        if let Some(map) = &mut self.map {
            *map = folder.join(&map);
        }
    }
}

/// A colour of one number, of three with commas between, or by the name of white or black.
pub fn colour(text: &str) -> Option<[f32; 3]> {
    let numbers: Option<Vec<f32>> = match text {
        "white" => Some(vec![1.0]),
        "black" => Some(vec![0.0]),
        _ => text.split(',').map(|x| x.trim().parse().ok()).collect(),
    };
    let numbers = numbers.filter(|all| all.iter().all(|x| x.is_finite()))?;
    match numbers[..] {
        [grey] => Some([grey; 3]),
        [r, g, b] => Some([r, g, b]),
        _ => None,
    }
}

impl FromStr for Background {
    type Err = String;

    fn from_str(text: &str) -> std::result::Result<Self, String> {
        let colour = || colour(text).filter(|c| c.iter().all(|x| *x >= 0.0));
        match text {
            "environment" => Ok(Background::Environment),
            "transparent" => Ok(Background::Transparent),
            _ => colour().map(Background::Colour).ok_or_else(|| {
                "needs environment, transparent, or a colour such as 0.5,0.5,0.5 or white".into()
            }),
        }
    }
}

impl TryFrom<toml::Value> for Background {
    type Error = String;

    fn try_from(value: toml::Value) -> std::result::Result<Self, String> {
        // An array as it would stand on the command line.
        let text = match &value {
            toml::Value::String(text) => text.clone(),
            toml::Value::Array(values) => {
                let values: Vec<String> = values.iter().map(toml::Value::to_string).collect();
                values.join(",")
            }
            other => other.to_string(),
        };
        text.parse().map_err(|e| format!("background {e}"))
    }
}

impl std::fmt::Display for Background {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        match self {
            Background::Environment => write!(f, "environment"),
            Background::Transparent => write!(f, "transparent"),
            Background::Colour([r, g, b]) => write!(f, "{r},{g},{b}"),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn backgrounds_are_read_as_they_are_written() {
        for background in [
            Background::Environment,
            Background::Transparent,
            Background::Colour([0.25, 0.0, 2.0]),
        ] {
            assert_eq!(background.to_string().parse(), Ok(background));
        }
        assert_eq!("white".parse(), Ok(Background::Colour([1.0; 3])));
        assert_eq!("0.5".parse(), Ok(Background::Colour([0.5; 3])));
        for bad in ["", "-1,0,0", "1,2", "nan", "inf,0,0", "grey", "1,2,3,4"] {
            assert!(bad.parse::<Background>().is_err(), "{bad}");
        }
        let table = |text: &str| toml::from_str::<EnvironmentTable>(text);
        let background = |text: &str| table(text).unwrap().background.unwrap();
        assert_eq!(
            background("background = [1, 0.5, 0.0]"),
            Background::Colour([1.0, 0.5, 0.0])
        );
        assert_eq!(
            background("background = 'transparent'"),
            Background::Transparent
        );
        let error = table("background = ['a']").unwrap_err().to_string();
        assert!(error.contains("transparent"), "{error}");
    }

    #[test]
    fn light_is_of_one_kind() {
        let table = |text: &str| toml::from_str::<EnvironmentTable>(text).unwrap();
        for good in [
            "",
            "map = 'a'\nscale = 2.0",
            "model = 'sky'",
            "sun = [1, 2]",
            "model = 'sky'\nsun = [1, 2]",
            "model = 'studio'\nrotation = 20.0",
        ] {
            assert_eq!(table(good).contradiction(), None, "{good}");
        }
        for bad in [
            "map = 'a'\nradiance = [1, 1, 1]",
            "map = 'a'\nsun = [1, 2]",
            "radiance = [1, 1, 1]\nmodel = 'studio'",
            "model = 'studio'\nsun = [1, 2]",
        ] {
            assert!(table(bad).contradiction().is_some(), "{bad}");
        }
    }
}
