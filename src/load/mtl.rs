//! MTL files: materials as written.

use super::map::MapStatement;
use super::tally::Tally;
use super::{guarded, text};
use crate::error::{Error, Result, Warnings};
use std::path::Path;

/// The last `illum` of the format.
pub const LAST_ILLUM: u8 = 10;

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

/// Reads the materials of an MTL file. An empty one has none.
pub fn load(path: &Path, warnings: &mut Warnings) -> Result<Vec<MtlMaterial>> {
    if std::fs::metadata(path).is_ok_and(|meta| meta.is_file() && meta.len() == 0) {
        return Ok(Vec::new());
    }
    parse(path, &text::read(path)?, warnings)
}

/// The materials of the text of an MTL file; `path` is for messages and the folder of textures.
pub fn parse(path: &Path, text: &str, warnings: &mut Warnings) -> Result<Vec<MtlMaterial>> {
    let mut canonical = Canonical::default();
    for (index, line) in text.trim_start_matches('\u{feff}').lines().enumerate() {
        canonical.add(path, index + 1, line.trim());
    }
    canonical.warn(warnings)?;
    match guarded(|| tobj::load_mtl_buf(&mut canonical.text.as_bytes())) {
        Ok(Ok((materials, _))) => Ok(materials
            .into_iter()
            .map(|m| MtlMaterial::new(m, &canonical.maps))
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

/// What follows a key.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Values {
    /// A name.
    Name,
    /// One number or three.
    Colour,
    /// A number.
    Number,
    /// A texture.
    Map,
    /// Whatever it is, it means nothing to this kind of renderer.
    Unused,
    /// As above where the numbers are 0, as some programs write them for all materials.
    UnusedIfZero,
}

/// The keys as the format and the programs that extended it write them.
const KEYS: [(&str, Values); 31] = [
    ("newmtl", Values::Name),
    ("Kd", Values::Colour),
    ("Ks", Values::Colour),
    ("Ke", Values::Colour),
    ("Tf", Values::Colour),
    ("Ns", Values::Number),
    ("Ni", Values::Number),
    ("d", Values::Number),
    ("Tr", Values::Number),
    ("illum", Values::Number),
    ("Pr", Values::Number),
    ("Pm", Values::Number),
    ("map_Kd", Values::Map),
    ("map_Ks", Values::Map),
    ("map_Ke", Values::Map),
    ("map_Ns", Values::Map),
    ("map_Pr", Values::Map),
    ("map_Pm", Values::Map),
    ("map_d", Values::Map),
    ("map_Bump", Values::Map),
    ("map_bump", Values::Map),
    ("bump", Values::Map),
    ("norm", Values::Map),
    // Ambient light is not of this kind of renderer; sharpness is that of mirrored pictures.
    ("Ka", Values::Unused),
    ("map_Ka", Values::Unused),
    ("sharpness", Values::Unused),
    // Roughness of a clear coat, which Blender writes where there is none.
    ("Pcr", Values::Unused),
    // Sheen, clear coat and anisotropy.
    ("Ps", Values::UnusedIfZero),
    ("Pc", Values::UnusedIfZero),
    ("aniso", Values::UnusedIfZero),
    ("anisor", Values::UnusedIfZero),
];
/// In what tobj reads, before the numbers of textures: their lines are not for it.
const MAP: &str = "gdpt_map_";

/// The keys that mean something, but for `newmtl`.
pub(super) fn keys() -> impl Iterator<Item = &'static str> {
    let meant = |kind: &Values| matches!(kind, Values::Colour | Values::Number | Values::Map);
    let keys = KEYS.iter().filter(move |(_, kind)| meant(kind));
    keys.map(|&(key, _)| key)
}

/// A key as it stands in [`KEYS`], in any letter case.
pub(super) fn known(word: &str) -> Option<(&'static str, Values)> {
    let alike = |same: fn(&str, &str) -> bool| KEYS.iter().find(|(key, _)| same(key, word));
    alike(|a, b| a == b)
        .or_else(|| alike(str::eq_ignore_ascii_case))
        .copied()
}

/// An MTL file as tobj reads it without stumbling, and what it does not read.
#[derive(Default)]
struct Canonical {
    /// Statements whose numbers are all right, colours with three of them. Numbers stand for textures.
    text: String,
    maps: Vec<MapStatement>,
    /// Whether statements are those of a material with a name.
    is_named: bool,
    nameless: Tally,
    numbers: Tally,
    unknown: Tally,
    cases: Tally,
    options: Tally,
}

impl Canonical {
    /// Adds a line; what cannot be used is counted. A key without anything behind it means nothing.
    fn add(&mut self, path: &Path, number: usize, line: &str) {
        let word = line.split_whitespace().next().unwrap_or("");
        let rest = line[word.len()..].trim();
        if word.is_empty() || word.starts_with('#') {
            return;
        }
        let at = &format!("{}:{number}", path.display());
        let Some((key, kind)) = known(word) else {
            self.unknown.add(at, word);
            return;
        };
        let has_value = !rest.is_empty() && !rest.starts_with('#');
        if word != key && has_value {
            self.cases.add(at, &format!("{word} for {key}"));
        }
        if kind == Values::Name {
            // What follows an empty name is not the material's before.
            self.is_named = !rest.is_empty();
            if self.is_named {
                self.text += &format!("newmtl {rest}\n");
            }
            return;
        }
        let is_used = !matches!(kind, Values::Unused | Values::UnusedIfZero);
        if is_used && has_value && !self.is_named {
            self.nameless.add(at, key);
            return;
        }
        let values = || rest.split_whitespace().take_while(|w| !w.starts_with('#'));
        match kind {
            _ if !has_value => {}
            Values::Map => self.add_map(path, at, key, rest),
            Values::Colour => {
                let all: Vec<&str> = values().collect();
                let numbers: Vec<f32> = all.iter().map_while(|v| finite(v)).collect();
                match (numbers.as_slice(), all.as_slice()) {
                    (&[x], [_]) => self.text += &format!("{key} {x} {x} {x}\n"),
                    (&[r, g, b, ..], _) => self.text += &format!("{key} {r} {g} {b}\n"),
                    (_, &[form @ ("spectral" | "xyz"), ..]) => {
                        self.unknown.add(at, &format!("{key} {form}"));
                    }
                    _ => self.numbers.add(at, &format!("'{line}'")),
                }
            }
            Values::Number => {
                // `d -halo 0.5` puts an option first.
                match values().last().and_then(finite) {
                    Some(x) if key != "illum" => self.text += &format!("{key} {x}\n"),
                    Some(x) if x.fract() == 0.0 && (0.0..=255.0).contains(&x) => {
                        self.text += &format!("{key} {x}\n");
                    }
                    _ => self.numbers.add(at, &format!("'{line}'")),
                }
            }
            Values::UnusedIfZero if values().any(|v| finite(v) != Some(0.0)) => {
                self.unknown.add(at, key);
            }
            Values::UnusedIfZero | Values::Unused | Values::Name => {}
        }
    }

    fn add_map(&mut self, path: &Path, at: &str, key: &str, rest: &str) {
        let folder = path.parent().unwrap_or(Path::new(""));
        let Some((mut map, ignored)) = MapStatement::parse(key, rest, at.to_owned(), folder) else {
            return;
        };
        if map.key == "bump" {
            map.key = "map_bump".to_owned();
        }
        for option in ignored {
            self.options.add(at, &format!("{option} of {key}"));
        }
        self.text += &format!("{MAP}{} x\n", self.maps.len());
        self.maps.push(map);
    }

    /// One warning for each kind of what was not read as it stands.
    fn warn(&self, warnings: &mut Warnings) -> Result<()> {
        for (tally, what) in [
            (
                &self.nameless,
                "statements before any newmtl, or after one without a name, are left out",
            ),
            (
                &self.numbers,
                "statements without the numbers that they need are left out",
            ),
            (&self.unknown, "statements that are unknown are left out"),
            (
                &self.cases,
                "keys are in another letter case, and read all the same",
            ),
            (
                &self.options,
                "options of textures that are unknown are left out",
            ),
        ] {
            if let Some(message) = tally.message(what) {
                warnings.push(message)?;
            }
        }
        Ok(())
    }
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

    /// The warnings of a text, and its materials.
    fn warned(text: &str) -> (Vec<String>, Vec<MtlMaterial>) {
        let mut warnings = Warnings::new(false);
        let materials = parse(Path::new("a.mtl"), text, &mut warnings).unwrap();
        (warnings.list().to_vec(), materials)
    }

    #[test]
    fn what_is_blank_means_nothing() {
        let (warnings, m) =
            warned("newmtl a\nKd .1 .2 .3\nKd\nmap_Kd \nmap_Bump\nnorm # none\nNs\n\n");
        assert_eq!((warnings.len(), m.len()), (0, 1), "{warnings:?}");
        assert_eq!((m[0].kd, m[0].maps.len()), (Some([0.1, 0.2, 0.3]), 0));
        for empty in ["", "\n", "# nothing", "\u{feff}"] {
            assert_eq!(warned(empty), (Vec::new(), Vec::new()));
        }
        assert_eq!(read("").unwrap(), []);
        // What follows a newmtl without a name is nobody's.
        let (warnings, m) = warned("newmtl a\nKd 1 0 0\nnewmtl\nKd 0 1 0\nnewmtl b\nKd 0 0 1\n");
        assert_eq!(
            (m[0].kd, m[1].kd),
            (Some([1.0, 0.0, 0.0]), Some([0.0, 0.0, 1.0]))
        );
        assert!(
            warnings.len() == 1 && warnings[0].starts_with("a.mtl:4: "),
            "{warnings:?}"
        );
    }

    #[test]
    fn what_cannot_be_read_is_left_out_and_counted() {
        let good = "newmtl a\nKd .1 .2 .3\nNs 4\nd .5\nillum 2\n";
        let (_, wanted) = warned(good);
        for bad in [
            "Kd nan 0 0",
            "Kd 1 1",
            "Kd red",
            "Kd 1.#QNAN 1 1",
            "Kd -nan(ind) 0 0",
            "Kd 3.1+e2 0 0",
            "Ns nan",
            "Ns 1.#INF",
            "Ns 1e99",
            "Ns very",
            "d nan(ind)",
            "Tr -1.#IND",
            "illum 2.5",
            "illum two",
            "illum -1",
            "illum 300",
            "Ni glass",
            "Pr 0x1",
            "Ke inf inf inf",
        ] {
            let (warnings, m) = warned(&format!("{good}\n{bad}\n{bad}\nPm 1\n"));
            let [warning] = &warnings[..] else {
                panic!("{bad}: {warnings:?}");
            };
            assert!(
                warning.starts_with("a.mtl:7: ") && warning.ends_with("(2 times)"),
                "{warning}"
            );
            assert!(warning.contains(bad), "{warning}");
            let pm = MtlMaterial {
                pm: Some(1.0),
                ..wanted[0].clone()
            };
            assert_eq!(m, [pm], "{bad}");
        }
    }

    #[test]
    fn keys_of_any_letter_case_are_read_and_named() {
        let (warnings, m) = warned(
            "NewMtl a\nkd 1 0 0\nNS 7\nMAP_KD x.png\nmap_bump y.png\nBump z.png\nKD 0 1 0\nD .5\n",
        );
        assert_eq!(
            warnings,
            [
                "a.mtl:1: keys are in another letter case, and read all the same: NewMtl for newmtl, \
              kd for Kd, NS for Ns, MAP_KD for map_Kd, Bump for bump, KD for Kd, D for d"
            ]
        );
        assert_eq!(
            (m[0].kd, m[0].ns, m[0].opacity),
            (Some([0.0, 1.0, 0.0]), Some(7.0), Some(0.5))
        );
        let keys: Vec<&str> = m[0].maps.iter().map(|m| m.key.as_str()).collect();
        assert_eq!(keys, ["map_kd", "map_bump", "map_bump"]);
    }

    #[test]
    fn unknown_words_are_one_warning() {
        let (warnings, m) = warned(
            "newmtl a\nKd .1 .2 .3\nKx 1\nrefl -type sphere r.png\nKx 2\naniso 0.0\nPs 0 0 0\nPc 0.5\n\
             Ks xyz .3 .3 .3\nKa spectral a.rfl\nmap_Kd -mm 0 1 -q x x.png\n",
        );
        assert_eq!(
            warnings,
            [
                "a.mtl:3: statements that are unknown are left out: Kx (2 times), refl, Pc, Ks xyz",
                "a.mtl:11: options of textures that are unknown are left out: -mm of map_Kd, -q of map_Kd",
            ]
        );
        assert_eq!(
            (m[0].kd, m[0].maps[0].file.as_str()),
            (Some([0.1, 0.2, 0.3]), "x x.png")
        );
    }
}
