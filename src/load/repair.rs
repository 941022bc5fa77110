//! `[materials.NAME]` of the TOML: what wins over an MTL's material, key by key.

use super::library::Named;
use super::mtl::{self, LAST_ILLUM, MtlMaterial, Values};
use crate::error::{Error, Result, Warnings, listed};
use std::collections::BTreeMap;
use std::path::{Path, PathBuf};

/// A table as it is written: MTL keys with TOML values.
pub type Table = BTreeMap<String, toml::Value>;

/// Keys that say the same in two ways.
const RELIEF: [&str; 4] = ["norm", "map_Bump", "map_bump", "bump"];

/// What the TOML says of one material.
#[derive(Clone, Debug, PartialEq)]
pub struct Repair {
    /// The TOML file.
    path: PathBuf,
    /// The statements of the table; its name is that of the material.
    material: MtlMaterial,
    /// Textures of the MTL that give way, by their keys in lower case.
    without: Vec<String>,
}

impl Repair {
    /// Reads the table of the material `name`. `path` is the TOML's, from whose folder on textures are found.
    pub fn read(path: &Path, name: &str, table: &Table) -> Result<Self> {
        let fail = |what: String| Error::input(path, None, format!("[materials.{name}]: {what}"));
        let mut text = "newmtl repaired\n".to_owned();
        let mut without = Vec::new();
        for (word, value) in table {
            let (key, kind) = mtl::known(word)
                .filter(|(_, kind)| matches!(kind, Values::Colour | Values::Number | Values::Map))
                .ok_or_else(|| {
                    let keys = mtl::keys().collect::<Vec<_>>().join(", ");
                    fail(format!("there is no key '{word}'; there are: {keys}"))
                })?;
            // The MTL's texture gives way to another one, and to a plain value, of which it would take the place.
            let plain = key.to_ascii_lowercase();
            match kind {
                Values::Map if RELIEF.contains(&key) => {
                    without.extend(["norm", "map_bump"].map(str::to_owned));
                }
                Values::Map => without.push(plain),
                _ if key == "Tr" => without.push("map_d".to_owned()),
                _ => without.push(format!("map_{plain}")),
            }
            let statement = match (kind, value) {
                (Values::Map, toml::Value::String(file)) if file.trim().is_empty() => continue,
                (Values::Map, toml::Value::String(file)) if !file.contains('\n') => file.clone(),
                (Values::Map, _) => {
                    return Err(fail(format!(
                        "{key} needs a file in quotes, or \"\" for no texture"
                    )));
                }
                (Values::Number, value) => {
                    let illums = 0.0..=f64::from(LAST_ILLUM);
                    let whole =
                        |x: &f64| key != "illum" || (x.fract() == 0.0 && illums.contains(x));
                    let number = number(value).filter(whole).ok_or_else(|| {
                        let what = match key {
                            "illum" => format!("a whole number from 0 to {LAST_ILLUM}"),
                            _ => "a number".to_owned(),
                        };
                        fail(format!("{key} needs {what}, not {value}"))
                    })?;
                    number.to_string()
                }
                (_, value) => colour(value).ok_or_else(|| {
                    fail(format!(
                        "{key} needs a number or three, such as [0.8, 0.2, 0.2], not {value}"
                    ))
                })?,
            };
            text += &format!("{key} {statement}\n");
        }
        let mut warnings = Warnings::new(false);
        let parsed = mtl::parse(path, &text, &mut warnings)?.pop();
        if let Some(warning) = warnings.list().first() {
            return Err(fail(warning.clone()));
        }
        let mut material = parsed.unwrap_or_default();
        material.name = name.to_owned();
        for map in &mut material.maps {
            map.at = format!("{}: [materials.{name}]", path.display());
        }
        Ok(Self {
            path: path.to_owned(),
            material,
            without,
        })
    }

    /// Has the material of its name say what this says; one that the file uses and no library defines is
    /// defined by it. An error lists the names where there is no such material.
    pub fn mend(&self, materials: &mut Vec<MtlMaterial>, used: &Named) -> Result<()> {
        let name = &self.material.name;
        if let Some(material) = materials.iter_mut().find(|m| m.name == *name) {
            self.apply(material);
        } else if used.iter().any(|(used, _)| used == name) {
            materials.push(self.material.clone());
        } else {
            let mut names: Vec<&str> = materials.iter().map(|m| m.name.as_str()).collect();
            names.extend(used.iter().map(|(name, _)| name.as_str()));
            names.sort_unstable();
            names.dedup();
            let there = match names[..] {
                [] => "the scene names none".to_owned(),
                _ => format!("there are: {}", listed(&names)),
            };
            let what = format!("[materials.{name}]: no material has this name; {there}");
            return Err(Error::input(&self.path, None, what));
        }
        Ok(())
    }

    /// Has `other` say what this says.
    fn apply(&self, other: &mut MtlMaterial) {
        let MtlMaterial {
            name: _,
            kd,
            ks,
            ke,
            tf,
            ns,
            ni,
            opacity,
            illum,
            pr,
            pm,
            maps,
        } = self.material.clone();
        other.kd = kd.or(other.kd);
        other.ks = ks.or(other.ks);
        other.ke = ke.or(other.ke);
        other.tf = tf.or(other.tf);
        other.ns = ns.or(other.ns);
        other.ni = ni.or(other.ni);
        other.opacity = opacity.or(other.opacity);
        other.illum = illum.or(other.illum);
        other.pr = pr.or(other.pr);
        other.pm = pm.or(other.pm);
        other.maps.retain(|map| !self.without.contains(&map.key));
        other.maps.extend(maps);
    }
}

fn number(value: &toml::Value) -> Option<f64> {
    let number = match value {
        toml::Value::Integer(x) => *x as f64,
        toml::Value::Float(x) => *x,
        _ => return None,
    };
    (number as f32).is_finite().then_some(number)
}

/// One number or three, as MTL has them.
fn colour(value: &toml::Value) -> Option<String> {
    match value {
        toml::Value::Array(channels) if channels.len() == 3 => {
            let channels: Option<Vec<String>> = channels
                .iter()
                .map(|channel| Some(number(channel)?.to_string()))
                .collect();
            Some(channels?.join(" "))
        }
        other => Some(number(other)?.to_string()),
    }
}
