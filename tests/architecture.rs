//! The map in `src/lib.rs` is true: it names every module, and each uses what the map says, all of it
//! further up.

use std::collections::{BTreeMap, BTreeSet};
use std::fs;
use std::path::{Path, PathBuf};

/// Modules in the order of the map, each with what it may use.
fn map() -> Vec<(String, BTreeSet<String>)> {
    fs::read_to_string("src/lib.rs")
        .unwrap()
        .lines()
        .filter_map(|line| line.strip_prefix("//! | [`"))
        .map(|row| {
            let cells: Vec<&str> = row.split('|').collect();
            let name = cells[0].split('`').next().unwrap_or_default().to_owned();
            let uses = cells[2]
                .split(',')
                .map(|u| u.trim().to_owned())
                .filter(|u| !u.is_empty());
            (name, uses.collect())
        })
        .collect()
}

fn sources(path: &Path) -> Vec<PathBuf> {
    if path.is_file() {
        let is_code = path.extension().is_some_and(|e| e == "rs");
        return if is_code {
            vec![path.to_owned()]
        } else {
            vec![]
        };
    }
    let entries = fs::read_dir(path).unwrap().map(|e| e.unwrap().path());
    entries.flat_map(|p| sources(&p)).collect()
}

/// What the files of a module name as `crate::…`.
fn uses(module: &str) -> BTreeSet<String> {
    let file = PathBuf::from(format!("src/{module}.rs"));
    let files = if file.exists() {
        vec![file]
    } else {
        sources(Path::new(&format!("src/{module}")))
    };
    let mut found = BTreeSet::new();
    for file in files {
        let text = fs::read_to_string(file).unwrap();
        for part in text.split("crate::").skip(1) {
            let name: String = part
                .chars()
                .take_while(|c| c.is_alphanumeric() || *c == '_')
                .collect();
            found.insert(name);
        }
    }
    found.remove(module);
    found
}

#[test]
fn the_map_names_every_module() {
    let mapped: BTreeSet<String> = map().into_iter().map(|(name, _)| name).collect();
    let declared: BTreeSet<String> = fs::read_to_string("src/lib.rs")
        .unwrap()
        .lines()
        .filter_map(|l| {
            l.strip_prefix("pub mod ")?
                .strip_suffix(';')
                .map(str::to_owned)
        })
        .collect();
    assert_eq!(mapped, declared);
    assert!(mapped.len() > 10);
}

#[test]
fn modules_use_what_the_map_says_and_only_what_stands_above_them() {
    let map = map();
    let place: BTreeMap<&str, usize> = map
        .iter()
        .enumerate()
        .map(|(i, (n, _))| (n.as_str(), i))
        .collect();
    for (index, (name, allowed)) in map.iter().enumerate() {
        assert_eq!(uses(name), *allowed, "what {name} uses, against the map");
        for used in allowed {
            assert!(
                place[used.as_str()] < index,
                "{name} uses {used}, which stands below it"
            );
        }
    }
}
