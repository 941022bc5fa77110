//! Files that other files name: materials and textures, wherever they were when the name was written.

use std::path::{Component, Path, PathBuf};

/// The file that `name` means, in the first of `folders` that has it: as written, with backslashes as slashes
/// and in any letter case; else by the end of its path, down to the bare name, since many files carry the
/// paths of another machine. `Err` is the path at which it was expected.
pub fn find(name: &str, folders: &[PathBuf]) -> Result<PathBuf, PathBuf> {
    let name = name.trim().trim_matches('"').replace('\\', "/");
    let ends = std::iter::once(0).chain(name.match_indices('/').map(|(slash, _)| slash + 1));
    for end in ends.map(|start| &name[start..]).filter(|e| !e.is_empty()) {
        let found = folders.iter().find_map(|f| in_any_case(f, Path::new(end)));
        if let Some(path) = found {
            return Ok(path);
        }
    }
    let bare = name.rsplit('/').next().unwrap_or(&name);
    let folder = folders.first().map_or(Path::new(""), PathBuf::as_path);
    let expected = folder.join(if name.contains(':') { bare } else { &name });
    Err(std::path::absolute(&expected).unwrap_or(expected))
}

/// The file of the name of an OBJ with another extension: `X.toml` for `X.obj` and for `X.obj.gz`.
pub fn beside(obj: &Path, extension: &str) -> PathBuf {
    let compressed = obj
        .extension()
        .is_some_and(|e| e.eq_ignore_ascii_case("gz"));
    let plain = if compressed {
        obj.with_extension("")
    } else {
        obj.to_owned()
    };
    plain.with_extension(extension)
}

/// The file `path` from `folder` on, each part of the path in any letter case where there is none in the
/// right one.
pub fn in_any_case(folder: &Path, path: &Path) -> Option<PathBuf> {
    let direct = folder.join(path);
    if direct.is_file() {
        return Some(direct);
    }
    let mut found = if path.is_absolute() {
        PathBuf::from("/")
    } else if folder.as_os_str().is_empty() {
        PathBuf::from(".")
    } else {
        folder.to_owned()
    };
    for part in path.components() {
        use Component::{CurDir, Normal, ParentDir};
        match part {
            Normal(part) if found.join(part).exists() => found.push(part),
            Normal(part) => {
                let wanted = part.to_str()?.to_lowercase();
                let alike = |e: &std::fs::DirEntry| {
                    e.file_name()
                        .to_str()
                        .is_some_and(|name| name.to_lowercase() == wanted)
                };
                let entries = std::fs::read_dir(&found).ok()?.filter_map(Result::ok);
                // The least name, so that the order of the folder does not matter.
                found = entries.filter(alike).map(|e| e.path()).min()?;
            }
            ParentDir => found.push(".."),
            CurDir => {}
            _ => continue,
        }
    }
    found.is_file().then_some(found)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn files_are_found_as_people_name_them() {
        let folder = tempfile::tempdir().unwrap();
        let sub = folder.path().join("Maps");
        std::fs::create_dir(&sub).unwrap();
        let file = sub.join("Red Wood.PNG");
        std::fs::write(&file, "x").unwrap();
        let plain = folder.path().join("plain.png");
        std::fs::write(&plain, "x").unwrap();
        let folders = [folder.path().to_owned()];
        for name in [
            "Maps/Red Wood.PNG",
            r"maps\red wood.png",
            r".\MAPS\Red Wood.png",
            r"D:\job 7\maps\Red Wood.png",
            "/home/me/job/Maps/Red Wood.PNG",
        ] {
            assert_eq!(find(name, &folders), Ok(file.clone()), "{name}");
        }
        for name in [
            "PLAIN.png",
            r"C:\Users\me\plain.png",
            "/elsewhere/plain.png",
            "\"plain.png\"",
        ] {
            assert_eq!(find(name, &folders), Ok(plain.clone()), "{name}");
        }
        let missing = find(r"maps\none.png", &folders).unwrap_err();
        assert!(missing.is_absolute() && missing.ends_with("maps/none.png"));
        // What stands in an earlier folder comes first; then, what has more of the path.
        let folders = [folder.path().to_owned(), sub.clone()];
        assert_eq!(find("red wood.png", &folders), Ok(file));
        assert_eq!(find("", &folders), Err(folder.path().to_owned()));
    }

    #[test]
    fn files_beside_an_obj_have_its_name() {
        for (obj, want) in [
            ("a/b.obj", "a/b.toml"),
            ("a/b.OBJ.GZ", "a/b.toml"),
            ("b.1.obj.gz", "b.1.toml"),
            ("b", "b.toml"),
        ] {
            assert_eq!(beside(Path::new(obj), "toml"), Path::new(want));
        }
    }
}
