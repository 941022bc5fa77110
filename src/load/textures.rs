//! The pictures of textures: where their files are, each read once.

use super::bitmap::{self, Bitmap};
use super::find::find;
use super::map::MapStatement;
use super::mtl::MtlMaterial;
use crate::error::{Result, Warnings};
use rayon::prelude::*;
use std::collections::{BTreeMap, BTreeSet};
use std::path::{Path, PathBuf};
use std::sync::Arc;

/// Folders of textures beside an MTL or OBJ file, and beside its folder, in any letter case.
const FOLDERS: [&str; 5] = ["textures", "texture", "maps", "tex", "images"];

/// Reads the pictures of those of `materials` that are `used`, in parallel. `beside` is the folder of the OBJ file,
/// `more` one that the user names. All that are missing are one warning.
pub fn load(
    materials: &mut [MtlMaterial],
    used: &[usize],
    beside: &Path,
    more: Option<&Path>,
    warnings: &mut Warnings,
) -> Result<()> {
    let used: BTreeSet<usize> = used.iter().copied().collect();
    let mut places = Places {
        beside: beside.to_owned(),
        more: more.map(Path::to_owned),
        folders: BTreeMap::new(),
    };
    let mut missing = Vec::new();
    let mut found: Vec<(&mut MapStatement, PathBuf)> = Vec::new();
    let used = materials
        .iter_mut()
        .enumerate()
        .filter(|(index, _)| used.contains(index));
    for map in used.flat_map(|(_, material)| &mut material.maps) {
        let folders = places.of(&map.folder);
        match find(&map.file, folders) {
            Ok(path) => found.push((map, path.canonicalize().unwrap_or(path))),
            Err(_) => missing.push(map),
        }
    }

    let paths: BTreeSet<&Path> = found.iter().map(|(_, path)| path.as_path()).collect();
    let read: Vec<_> = paths
        .into_par_iter()
        .map(|path| (path.to_owned(), bitmap::load(path)))
        .collect();
    let mut pictures: BTreeMap<PathBuf, Arc<Bitmap>> = BTreeMap::new();
    let mut broken = BTreeMap::new();
    for (path, bitmap) in read {
        match bitmap {
            Ok(bitmap) => drop(pictures.insert(path, Arc::new(bitmap))),
            Err(e) => drop(broken.insert(path, e)),
        }
    }
    for (map, path) in found {
        map.bitmap = pictures.get(&path).cloned();
        // Each once, where it is named first.
        if let Some(e) = broken.remove(&path) {
            warnings.push(format!("{}: {e}; {}", map.at, instead(map)))?;
        }
    }
    if let Some(first) = missing.first() {
        warnings.push(places.message(first, &missing))?;
    }
    Ok(())
}

/// What takes the place of a picture that cannot be used.
fn instead(map: &MapStatement) -> &'static str {
    match map.key.as_str() {
        "map_kd" | "map_ks" | "map_pr" => "grey is used instead",
        _ => "it is left out",
    }
}

/// Where files are looked for.
struct Places {
    beside: PathBuf,
    more: Option<PathBuf>,
    /// By the folder of the MTL file.
    folders: BTreeMap<PathBuf, Vec<PathBuf>>,
}

impl Places {
    /// The folders for textures that a file in `folder` names, best first.
    fn of(&mut self, folder: &Path) -> &[PathBuf] {
        let (beside, more) = (&self.beside, &self.more);
        self.folders.entry(folder.to_owned()).or_insert_with(|| {
            let mut all = vec![folder.to_owned()];
            if beside != folder {
                all.push(beside.clone());
            }
            let bases = all.clone();
            all.extend(bases.iter().flat_map(|base| texture_folders(base)));
            all.extend(
                bases
                    .iter()
                    .flat_map(|base| texture_folders(&base.join(".."))),
            );
            all.extend(more.clone());
            all
        })
    }

    fn message(&self, first: &MapStatement, missing: &[&mut MapStatement]) -> String {
        let mut names: Vec<&str> = Vec::new();
        for map in missing {
            if !names.contains(&map.file.as_str()) {
                names.push(&map.file);
            }
        }
        let mut searched: Vec<String> = Vec::new();
        for folder in missing
            .iter()
            .filter_map(|map| self.folders.get(&map.folder))
            .flatten()
        {
            let full = folder
                .canonicalize()
                .or_else(|_| std::path::absolute(folder));
            let name = full.as_deref().unwrap_or(folder).display().to_string();
            if !searched.contains(&name) {
                searched.push(name);
            }
        }
        let count = match names.len() {
            1 => "a texture is".to_owned(),
            n => format!("{n} textures are"),
        };
        format!(
            "{}: {count} missing ({}), and grey or nothing takes the place; looked for in {} \
             (--textures DIR names one more)",
            first.at,
            names.join(", "),
            searched.join(", ")
        )
    }
}

/// Those of [`FOLDERS`] that are in a folder, in that order.
fn texture_folders(base: &Path) -> Vec<PathBuf> {
    let listed = if base.as_os_str().is_empty() {
        Path::new(".")
    } else {
        base
    };
    let entries = std::fs::read_dir(listed)
        .into_iter()
        .flatten()
        .filter_map(|entry| entry.ok());
    let mut found: Vec<(usize, PathBuf)> = entries
        .filter_map(|entry| {
            let name = entry.file_name().to_str()?.to_lowercase();
            let rank = FOLDERS.iter().position(|folder| *folder == name)?;
            let path = base.join(entry.file_name());
            path.is_dir().then_some((rank, path))
        })
        .collect();
    found.sort();
    found.into_iter().map(|(_, path)| path).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Statements with these files in the MTL of `folder`, as far as their pictures are there, and the warnings.
    fn load_files(folder: &Path, files: &[&str], more: Option<&Path>) -> (Vec<bool>, Vec<String>) {
        let map = |(line, file): (usize, &&str)| {
            let at = format!("a.mtl:{}", line + 2);
            MapStatement::parse("map_Kd", file, at, folder).unwrap().0
        };
        let mut materials = [MtlMaterial {
            maps: files.iter().enumerate().map(map).collect(),
            ..Default::default()
        }];
        let mut warnings = Warnings::new(false);
        load(&mut materials, &[0], folder, more, &mut warnings).unwrap();
        let there = materials[0].maps.iter().map(|map| map.bitmap.is_some());
        (there.collect(), warnings.list().to_vec())
    }

    #[test]
    fn textures_are_found_where_people_keep_them() {
        let root = tempfile::tempdir().unwrap();
        let folder = root.path().join("scenes");
        let more = root.path().join("far");
        for (place, file) in [
            ("scenes", "a.png"),
            ("scenes/Textures", "b.png"),
            ("scenes/tex", "C.PNG"),
            ("MAPS", "d.png"),
            ("images", "e.png"),
            ("far/wood", "f.png"),
        ] {
            let place = root.path().join(place);
            std::fs::create_dir_all(&place).unwrap();
            image::RgbImage::new(1, 1).save(place.join(file)).unwrap();
        }
        let files = [
            "a.png",
            "b.png",
            r"C:\job\c.png",
            "D.png",
            "sub/e.png",
            r"D:\x\wood\F.png",
        ];
        let (there, warnings) = load_files(&folder, &files, Some(&more));
        assert_eq!((there, warnings.len()), (vec![true; 6], 0));

        // Without the folder that is named, and with two more that are nowhere.
        let files = [&files[..], &["none.png", "nil.png", "none.png"]].concat();
        let (there, warnings) = load_files(&folder, &files, None);
        assert_eq!(
            there,
            [true, true, true, true, true, false, false, false, false]
        );
        let [warning] = &warnings[..] else {
            panic!("{warnings:?}");
        };
        assert!(
            warning.starts_with(
                r"a.mtl:7: 3 textures are missing (D:\x\wood\F.png, none.png, nil.png)"
            )
        );
        for place in ["scenes", "scenes/Textures", "scenes/tex", "MAPS", "images"] {
            let place = root.path().join(place).canonicalize().unwrap();
            assert!(warning.contains(place.to_str().unwrap()), "{warning}");
        }
        assert!(!warning.contains("far"));
    }

    #[test]
    fn a_broken_picture_is_one_warning() {
        let folder = tempfile::tempdir().unwrap();
        std::fs::write(folder.path().join("a.png"), "no picture").unwrap();
        let pointer = "version https://git-lfs.github.com/spec/v1\noid sha256:0\nsize 9\n";
        std::fs::write(folder.path().join("b.png"), pointer).unwrap();
        let (there, warnings) = load_files(folder.path(), &["a.png", "b.png", "./a.png"], None);
        assert_eq!((there, warnings.len()), (vec![false; 3], 2));
        assert!(
            warnings[0].starts_with("a.mtl:2: ")
                && warnings[0].contains("no picture that can be read")
        );
        assert!(warnings[1].starts_with("a.mtl:3: ") && warnings[1].contains("git lfs pull"));
    }
}
