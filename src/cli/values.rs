//! Values on the command line: from text, or why not.

use crate::load::environment::{Model, colour};
use crate::load::sidecar::Up;
use crate::reconstruct::Alpha;
use std::path::PathBuf;
use std::time::Duration;

pub(super) fn alpha(text: &str) -> Result<Alpha, String> {
    match text.parse() {
        _ if text == "auto" => Ok(Alpha::Auto),
        Ok(alpha) if alpha >= 0.0 && f32::is_finite(alpha) => Ok(Alpha::Fixed(alpha)),
        _ => Err("needs auto or a number, not negative".into()),
    }
}

pub(super) fn positive(text: &str) -> Result<f64, String> {
    match text.trim().parse() {
        Ok(value) if value > 0.0 && f64::is_finite(value) => Ok(value),
        _ => Err("needs a number above 0".into()),
    }
}

/// Degrees between 0 and 180.
pub(super) fn angle(text: &str) -> Result<f32, String> {
    match text.trim().parse() {
        Ok(degrees) if (0.0..=180.0).contains(&degrees) => Ok(degrees),
        _ => Err("needs degrees, from 0 to 180".into()),
    }
}

pub(super) fn vector(text: &str) -> Result<[f32; 3], String> {
    let numbers: Vec<f32> = text
        .split(',')
        .filter_map(|x| x.trim().parse().ok())
        .filter(|x: &f32| x.is_finite())
        .collect();
    match numbers.try_into() {
        Ok(v) if text.split(',').count() == 3 => Ok(v),
        _ => Err("needs three numbers with commas between, such as 0,1,4.2".into()),
    }
}

/// A vector, the name of an axis, or auto.
pub(super) fn up(text: &str) -> Result<Up, String> {
    text.to_ascii_lowercase()
        .parse()
        .or_else(|e| match vector(text) {
            Ok(vector) => Ok(Up::Along(vector)),
            Err(_) => Err(e),
        })
}

/// Light from all directions.
#[derive(Clone, Debug, PartialEq)]
pub enum EnvironmentFlag {
    /// The same from everywhere.
    Radiance([f32; 3]),
    /// A picture.
    Map(PathBuf),
    /// By a model.
    Model(Model),
}

/// A radiance, the name of a model, or else a file.
pub(super) fn environment(text: &str) -> Result<EnvironmentFlag, String> {
    match (text, colour(text)) {
        ("sky", _) => Ok(EnvironmentFlag::Model(Model::Sky)),
        ("studio", _) => Ok(EnvironmentFlag::Model(Model::Studio)),
        (_, Some(radiance)) => Ok(EnvironmentFlag::Radiance(radiance)),
        (_, None) if text.contains(',') => {
            Err("needs three numbers with commas between, such as 1,1,1".into())
        }
        (_, None) => Ok(EnvironmentFlag::Map(text.into())),
    }
}

/// Azimuth and elevation of the sun in degrees.
pub(super) fn sun(text: &str) -> Result<[f32; 2], String> {
    let numbers: Option<Vec<f32>> = text.split(',').map(|x| x.trim().parse().ok()).collect();
    match numbers.as_deref() {
        Some(&[azimuth, elevation]) if azimuth.is_finite() && (0.0..=90.0).contains(&elevation) => {
            Ok([azimuth, elevation])
        }
        _ => Err("needs azimuth and elevation (0 to 90) in degrees, such as -30,40".into()),
    }
}

/// How large a picture is to be.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum SizeFlag {
    /// Pixels across and down.
    Exactly(u32, u32),
    /// Pixels across, in the shape that it has without.
    Width(u32),
}

impl SizeFlag {
    /// Pixels across and down of what without is of the size `film`.
    pub fn of_film(self, film: (u32, u32)) -> (u32, u32) {
        match self {
            Self::Exactly(width, height) => (width, height),
            Self::Width(width) => {
                let height = f64::from(width) * f64::from(film.1) / f64::from(film.0.max(1));
                (width, height.round().max(1.0) as u32)
            }
        }
    }
}

pub(super) fn size(text: &str) -> Result<SizeFlag, String> {
    let size = match text.split_once(['x', 'X']) {
        Some((w, h)) => w
            .parse()
            .ok()
            .zip(h.parse().ok())
            .map(|(w, h)| SizeFlag::Exactly(w, h)),
        None => text.parse().ok().map(SizeFlag::Width),
    };
    size.ok_or_else(|| {
        "needs width and height with x between, such as 640x480, or a width, such as 640".into()
    })
}

/// Some pixels of a picture.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct CropFlag {
    /// Their first column and row.
    pub first: (u32, u32),
    /// One past their last column and row.
    pub end: (u32, u32),
}

pub(super) fn crop(text: &str) -> Result<CropFlag, String> {
    let numbers: Option<Vec<u32>> = text.split(',').map(|x| x.trim().parse().ok()).collect();
    match numbers.as_deref() {
        Some(&[x0, y0, x1, y1]) if x0 < x1 && y0 < y1 => Ok(CropFlag {
            first: (x0, y0),
            end: (x1, y1),
        }),
        _ => Err(
            "needs the first column and row and one past the last ones, such as 0,0,640,480".into(),
        ),
    }
}

pub(super) fn pixel(text: &str) -> Result<(u32, u32), String> {
    let parts = text
        .split_once(',')
        .and_then(|(x, y)| Some((x.trim().parse().ok()?, y.trim().parse().ok()?)));
    parts.ok_or_else(|| "needs column and row with a comma between, such as 12,40".into())
}

/// A host and a port.
pub(super) fn address(text: &str) -> Result<String, String> {
    let is_address = text
        .rsplit_once(':')
        .is_some_and(|(host, port)| !host.is_empty() && port.parse::<u16>().is_ok());
    if is_address {
        Ok(text.to_owned())
    } else {
        Err("needs host and port, such as localhost:14158; name scenes before --watch".into())
    }
}

/// `90`, `90s`, `5m`, `1h30m`, `1.5m`.
pub(super) fn duration(text: &str) -> Result<Duration, String> {
    let wrong = || "needs a time such as 30s, 5m or 1h30m".to_owned();
    let mut seconds = 0.0;
    let mut rest = text;
    while !rest.is_empty() {
        let digits = rest
            .find(|c: char| !(c.is_ascii_digit() || c == '.'))
            .unwrap_or(rest.len());
        let value: f64 = rest[..digits].parse().map_err(|_| wrong())?;
        let (unit, length) = match rest[digits..].chars().next() {
            None | Some('s') => (1.0, 1),
            Some('m') => (60.0, 1),
            Some('h') => (3600.0, 1),
            Some(_) => return Err(wrong()),
        };
        seconds += value * unit;
        rest = rest.get(digits + length..).unwrap_or("");
    }
    if seconds > 0.0 && seconds < 1e9 {
        Ok(Duration::from_secs_f64(seconds))
    } else {
        Err(wrong())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_width_takes_the_shape_of_the_film() {
        assert_eq!(SizeFlag::Width(640).of_film((512, 512)), (640, 640));
        assert_eq!(SizeFlag::Width(640).of_film((1920, 1080)), (640, 360));
        assert_eq!(SizeFlag::Width(3).of_film((1000, 1)), (3, 1));
        assert_eq!(SizeFlag::Exactly(3, 4).of_film((1000, 1)), (3, 4));
    }

    #[test]
    fn values_are_parsed() {
        assert_eq!(vector("0, -1,4.5"), Ok([0.0, -1.0, 4.5]));
        for bad in ["1,2", "1,2,3,4", "1,2,x", "1,2,nan", ""] {
            assert!(vector(bad).is_err(), "{bad}");
        }
        assert_eq!(up("-z"), Ok(Up::Along([0.0, 0.0, -1.0])));
        assert_eq!(up("Z"), Ok(Up::Along([0.0, 0.0, 1.0])));
        assert_eq!(up("0,1,1"), Ok(Up::Along([0.0, 1.0, 1.0])));
        assert_eq!(up("auto"), Ok(Up::Auto));
        assert!(up("w").is_err());
        let map = EnvironmentFlag::Map("a/sky.hdr".into());
        assert_eq!(environment("a/sky.hdr"), Ok(map));
        let white = EnvironmentFlag::Radiance([1.0; 3]);
        for text in ["1,1,1", "1", "white", "1.0, 1,1"] {
            assert_eq!(environment(text).as_ref(), Ok(&white), "{text}");
        }
        for bad in ["1,1,x", "1,2", "1,2,3,4", "nan,1,1"] {
            assert!(environment(bad).is_err(), "{bad}");
        }
        let sky = EnvironmentFlag::Model(Model::Sky);
        assert_eq!(environment("sky"), Ok(sky));
        assert_eq!(sun("-30, 40.5"), Ok([-30.0, 40.5]));
        for bad in ["40", "1,2,3", "0,91", "0,-1", "nan,3", ""] {
            assert!(sun(bad).is_err(), "{bad}");
        }
        assert_eq!(address("[::1]:99"), Ok("[::1]:99".into()));
        for bad in ["scene.obj", "localhost", "localhost:", ":7", "a:70000"] {
            assert!(address(bad).is_err(), "{bad}");
        }
        assert_eq!(alpha("auto"), Ok(Alpha::Auto));
        assert_eq!(alpha("0.3"), Ok(Alpha::Fixed(0.3)));
        for bad in ["-1", "nan", "inf", "x", ""] {
            assert!(alpha(bad).is_err(), "{bad}");
        }
        assert_eq!(size("640x480"), Ok(SizeFlag::Exactly(640, 480)));
        assert_eq!(size("640"), Ok(SizeFlag::Width(640)));
        for bad in ["640x", "x480", "640.5", "-1", "-1x3", "1e9x2", ""] {
            assert!(size(bad).is_err(), "{bad}");
        }
        for (text, want) in [
            ("30s", 30.0),
            ("5m", 300.0),
            ("1h30m", 5400.0),
            ("2", 2.0),
            ("0.5s", 0.5),
        ] {
            assert_eq!(duration(text).unwrap().as_secs_f64(), want);
        }
        for bad in ["", "0s", "s", "3d", "1.2.3s", "-1s"] {
            assert!(duration(bad).is_err(), "{bad}");
        }
    }
}
