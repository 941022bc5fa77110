//! The materials of an OBJ file: its libraries, and which material each of its names means.

use super::find::{beside, find, in_any_case};
use super::mtl::{self, MtlMaterial};
use super::names::meant;
use super::repair::Repair;
use crate::error::{Result, Warnings};
use std::collections::HashSet;
use std::path::{Path, PathBuf};

/// Names with the lines on which they stand.
pub type Named = [(String, usize)];

/// The materials of all libraries, as the TOML's `repairs` have them, with an empty one for each name that no
/// library has, and which of them each of the names in `used` means.
pub fn load(
    path: &Path,
    libraries: &Named,
    used: &Named,
    repairs: &[Repair],
    warnings: &mut Warnings,
) -> Result<(Vec<MtlMaterial>, Vec<usize>)> {
    let mut materials: Vec<MtlMaterial> = Vec::new();
    let mut names = HashSet::new();
    for library in files(path, libraries, !used.is_empty(), warnings)? {
        // The first definition of a name holds.
        for material in mtl::load(&library, warnings)? {
            if names.insert(material.name.clone()) {
                materials.push(material);
            }
        }
    }
    for repair in repairs {
        repair.mend(&mut materials, used)?;
    }
    let meant = meant(path, &mut materials, used, warnings)?;
    Ok((materials, meant))
}

/// The library files, each once. In the place of one that is missing, or if `wanted` of none that is named,
/// the one that has the OBJ file's name.
fn files(
    path: &Path,
    libraries: &Named,
    wanted: bool,
    warnings: &mut Warnings,
) -> Result<Vec<PathBuf>> {
    let folder = path.parent().unwrap_or(Path::new(""));
    let folders = [folder.to_owned()];
    // `X.mtl`, or `X.obj.mtl`.
    let own = [beside(path, "mtl"), beside(path, "obj.mtl")]
        .iter()
        .find_map(|own| in_any_case(folder, Path::new(own.file_name()?)));
    let mut files = Vec::new();
    for (names, line) in libraries {
        for name in library_names(&folders, names) {
            let file = match find(name, &folders) {
                Ok(file) => file,
                Err(expected) => {
                    let mut message = format!(
                        "{}:{line}: no material file {}",
                        path.display(),
                        expected.display()
                    );
                    if let Some(own) = &own {
                        message += &format!("; {} is used instead", own.display());
                    }
                    warnings.push(message)?;
                    match &own {
                        Some(own) => own.clone(),
                        None => continue,
                    }
                }
            };
            if !files.contains(&file) {
                files.push(file);
            }
        }
    }
    if let Some(own) = own.filter(|_| wanted && libraries.is_empty()) {
        let (path, own_name) = (path.display(), own.display());
        warnings.note(format!(
            "{path}: names no material file; {own_name} is used"
        ));
        files.push(own);
    }
    Ok(files)
}

/// The files that `mtllib` names: one, perhaps with blanks in its name, as programs write it, or else
/// several, as the format has it.
fn library_names<'a>(folders: &[PathBuf], names: &'a str) -> Vec<&'a str> {
    let is_there = |name: &str| find(name, folders).is_ok();
    let words: Vec<&str> = names
        .split_whitespace()
        .take_while(|word| !word.starts_with('#'))
        .collect();
    if is_there(names) || !words.iter().any(|word| is_there(word)) {
        vec![names]
    } else {
        words
    }
}
