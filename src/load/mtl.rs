//! MTL files: materials as written.

use super::map::MapStatement;
use super::{guarded, text};
use crate::error::{Error, Result, Warnings};
use std::path::Path;

/// One material with the parameters that were given.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct MtlMaterial {
    /// Its name in `newmtl`.
    pub name: String,
    /// Diffuse reflectance `Kd`.
    pub kd: Option<[f32; 3]>,
    /// Specular reflectance `Ks`.
    pub ks: Option<[f32; 3]>,
    /// Emitted radiance `Ke`.
    pub ke: Option<[f32; 3]>,
    /// Transmission filter `Tf`.
    pub tf: Option<[f32; 3]>,
    /// Phong exponent `Ns`.
    pub ns: Option<f32>,
    /// Refractive index `Ni`.
    pub ni: Option<f32>,
    /// Opacity `d`, or 1 - `Tr`.
    pub opacity: Option<f32>,
    /// Illumination model `illum`.
    pub illum: Option<u8>,
    /// Roughness `Pr`.
    pub pr: Option<f32>,
    /// Metallic `Pm`.
    pub pm: Option<f32>,
    /// Textures, in the order of the file.
    pub maps: Vec<MapStatement>,
}

impl MtlMaterial {
    /// The last texture with this key in lower case.
    pub fn map(&self, key: &str) -> Option<&MapStatement> {
        self.maps.iter().rev().find(|m| m.key == key)
    }
}

/// Reads the materials of an MTL file.
pub fn load(path: &Path, warnings: &mut Warnings) -> Result<Vec<MtlMaterial>> {
    let text = text::read(path)?;
    let mut maps = Vec::new();
    let text = canonical(path, &text, &mut maps, warnings)?;
    let parsed = guarded(|| tobj::load_mtl_buf(&mut text.as_bytes()));
    match parsed {
        Ok(Ok((materials, _))) => Ok(materials
            .into_iter()
            .map(|m| MtlMaterial::new(m, &maps))
            .collect()),
        Ok(Err(e)) => Err(Error::input(
            path,
            None,
            format!("not a material file: {e}"),
        )),
        Err(()) => Err(Error::input(
            path,
            None,
            "not a material file that can be parsed",
        )),
    }
}

const COLOURS: [&str; 5] = ["Ka", "Kd", "Ks", "Ke", "Tf"];
const NUMBERS: [&str; 7] = ["Ns", "Ni", "d", "Tr", "illum", "Pr", "Pm"];
/// Textures that are read, in lower case.
const MAPS: [&str; 8] = [
    "map_kd", "map_ks", "map_ke", "map_pr", "map_d", "norm", "map_bump", "bump",
];
/// In what tobj reads, before the numbers of textures: their lines are not for it.
const MAP: &str = "gdpt_map_";

/// Checks every number, with its line in the message, and writes colours with three components: tobj
/// panics on fewer. Textures go to `maps`, and their numbers stand for them.
fn canonical(
    path: &Path,
    text: &str,
    maps: &mut Vec<MapStatement>,
    warnings: &mut Warnings,
) -> Result<String> {
    let folder = path.parent().unwrap_or(Path::new(""));
    let mut out = String::with_capacity(text.len());
    for (index, line) in text.trim_start_matches('\u{feff}').lines().enumerate() {
        let fail = |what: &str| Err(Error::input(path, Some(index + 1), what));
        let line = line.trim();
        let mut words = line.split_whitespace();
        match words.next() {
            Some("newmtl") if words.next().is_none() => return fail("newmtl needs a name"),
            Some(key) if COLOURS.contains(&key) => {
                let values: Vec<&str> = words.take_while(|w| !w.starts_with('#')).collect();
                if matches!(values.first(), Some(&("spectral" | "xyz"))) {
                    let at = format!("{}:{}", path.display(), index + 1);
                    warnings.push(format!(
                        "{at}: {key} {} is not supported and ignored",
                        values[0]
                    ))?;
                    continue;
                }
                let numbers: Vec<f32> = values.iter().map_while(|v| finite(v)).collect();
                match numbers[..] {
                    [x] if values.len() == 1 => out.push_str(&format!("{key} {x} {x} {x}\n")),
                    [r, g, b, ..] => out.push_str(&format!("{key} {r} {g} {b}\n")),
                    _ => return fail(&format!("{key} needs one or three numbers, got '{line}'")),
                }
            }
            Some(key) if NUMBERS.contains(&key) => {
                // `d -halo 0.5` puts an option first.
                let value = words.take_while(|w| !w.starts_with('#')).last();
                let Some(number) = value.and_then(finite) else {
                    return fail(&format!("{key} needs a number, got '{line}'"));
                };
                if key == "illum" && !(number.fract() == 0.0 && (0.0..=255.0).contains(&number)) {
                    return fail(&format!(
                        "illum needs a whole number from 0 to 10, got '{line}'"
                    ));
                }
                out.push_str(&format!("{key} {number}\n"));
            }
            Some(key) if is_map(key) => {
                let at = format!("{}:{}", path.display(), index + 1);
                let lower = key.to_ascii_lowercase();
                if !MAPS.contains(&lower.as_str()) {
                    // Ambient light is not of this kind of renderer, with texture or without.
                    if lower != "map_ka" {
                        warnings.push(format!("{at}: {key} is not supported and ignored"))?;
                    }
                    continue;
                }
                let parsed = MapStatement::parse(key, &line[key.len()..], at.clone(), folder);
                let Some((mut map, ignored)) = parsed else {
                    return fail(&format!("{key} needs a file name"));
                };
                if map.key == "bump" {
                    map.key = "map_bump".to_owned();
                }
                for option in ignored {
                    warnings.push(format!(
                        "{at}: the option {option} of {key} is not supported and ignored"
                    ))?;
                }
                out.push_str(&format!("{MAP}{} x\n", maps.len()));
                maps.push(map);
            }
            // Only what stands above may say this.
            Some(key) if key.starts_with(MAP) => {}
            _ => {
                out.push_str(line);
                out.push('\n');
            }
        }
    }
    Ok(out)
}

/// Whether a statement names a texture.
fn is_map(key: &str) -> bool {
    let key = key.to_ascii_lowercase();
    key.starts_with("map_") || matches!(key.as_str(), "bump" | "norm" | "disp" | "decal" | "refl")
}

fn finite(word: &str) -> Option<f32> {
    word.parse::<f32>().ok().filter(|x| x.is_finite())
}

impl MtlMaterial {
    fn new(m: tobj::Material, maps: &[MapStatement]) -> Self {
        let other = |key: &str| m.unknown_param.get(key);
        let number = |key: &str| other(key).and_then(|v| finite(v));
        let colour = |key: &str| {
            let values: Vec<f32> = other(key)?.split_whitespace().filter_map(finite).collect();
            values.try_into().ok()
        };
        let numbers = m
            .unknown_param
            .keys()
            .filter_map(|key| key.strip_prefix(MAP));
        let mut own: Vec<usize> = numbers.filter_map(|n| n.parse().ok()).collect();
        own.sort_unstable();
        Self {
            kd: m.diffuse,
            ks: m.specular,
            ke: m.emissive.or_else(|| colour("Ke")),
            tf: colour("Tf"),
            ns: m.shininess,
            ni: m.optical_density,
            opacity: m.dissolve.or_else(|| number("Tr").map(|t| 1.0 - t)),
            illum: m.illumination_model,
            pr: number("Pr"),
            pm: number("Pm"),
            maps: own.into_iter().map(|n| maps[n].clone()).collect(),
            name: m.name,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn read(text: &str) -> Result<Vec<MtlMaterial>> {
        let file = tempfile::NamedTempFile::new().unwrap();
        std::fs::write(file.path(), text).unwrap();
        load(file.path(), &mut Warnings::new(false))
    }

    #[test]
    fn reads_every_parameter() {
        let m = read(
            "newmtl a b\r\nKd 0.1 0.2 0.3\r\nKs 0.5\r\nKe 1 2 3\nTf .9 .8 .7\nNs 10\nNi 1.5\nTr 0.25\n\
             illum 7\nPr 0.3\nPm 1\nmap_Kd x.png\nnewmtl c",
        )
        .unwrap();
        assert_eq!(m.len(), 2);
        let mut m = m;
        let map = m[0].maps.pop().unwrap();
        assert_eq!((map.key.as_str(), map.file.as_str()), ("map_kd", "x.png"));
        assert!(m[1].maps.is_empty());
        assert_eq!(
            m[0],
            MtlMaterial {
                name: "a b".into(),
                kd: Some([0.1, 0.2, 0.3]),
                ks: Some([0.5; 3]),
                ke: Some([1.0, 2.0, 3.0]),
                tf: Some([0.9, 0.8, 0.7]),
                ns: Some(10.0),
                ni: Some(1.5),
                opacity: Some(0.75),
                illum: Some(7),
                pr: Some(0.3),
                pm: Some(1.0),
                maps: Vec::new(),
            }
        );
    }

    #[test]
    fn our_own_words_mean_nothing_in_files() {
        let m =
            read("newmtl a\nmap_Kd a.png\nnewmtl b\ngdpt_map_0 x\n\tgdpt_map_75 0.5\n").unwrap();
        assert_eq!((m[0].maps.len(), m[1].maps.len()), (1, 0));
    }

    #[test]
    fn names_the_line_of_a_bad_number() {
        for (text, line) in [
            ("newmtl a\nKd 1 1\n", 2),
            ("newmtl a\n\nNs x\n", 3),
            ("newmtl a\nKd nan 0 0\n", 2),
            ("newmtl\n", 1),
            ("newmtl a\nillum 2.5\n", 2),
        ] {
            let message = read(text).unwrap_err().to_string();
            assert!(
                message.contains(&format!(":{line}: ")),
                "{text:?}: {message}"
            );
        }
    }
}
