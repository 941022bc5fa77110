//! Which material each name of an OBJ file means.

use super::library::Named;
use super::mtl::MtlMaterial;
use crate::error::{Result, Warnings, listed};
use std::collections::{BTreeSet, HashMap, HashSet};
use std::path::Path;

/// Which of `materials` each of the names in `used` means. Of a name that is not defined it is one of about the
/// same spelling, or the only one that nothing else uses if there are one and one; else an empty one, which is
/// added to them.
pub fn meant(
    path: &Path,
    materials: &mut Vec<MtlMaterial>,
    used: &Named,
    warnings: &mut Warnings,
) -> Result<Vec<usize>> {
    let mut by_name: HashMap<&str, usize> = HashMap::new();
    for (index, material) in materials.iter().enumerate() {
        by_name.entry(&material.name).or_insert(index);
    }
    let mut meant: Vec<Option<usize>> = used
        .iter()
        .map(|(name, _)| by_name.get(name.as_str()).copied())
        .collect();
    let undefined: Vec<usize> = (0..used.len()).filter(|&i| meant[i].is_none()).collect();
    if undefined.is_empty() {
        return Ok(meant.into_iter().flatten().collect());
    }

    // Names that differ in letter case or between blanks and underscores alone; then the last of each.
    let defined: Vec<String> = materials.iter().map(|m| m.name.clone()).collect();
    let taken: HashSet<usize> = meant.iter().flatten().copied().collect();
    let mut unused: BTreeSet<usize> = (0..defined.len()).filter(|m| !taken.contains(m)).collect();
    let mut by_spelling: HashMap<String, Vec<usize>> = HashMap::new();
    for &index in &unused {
        let alike = by_spelling.entry(spelling(&defined[index])).or_default();
        alike.push(index);
    }
    let mut replaced = Vec::new();
    let mut left = Vec::new();
    for i in undefined {
        let spelling = spelling(&used[i].0);
        match by_spelling.get(&spelling).map(Vec::as_slice) {
            Some(&[only]) => {
                by_spelling.remove(&spelling);
                unused.remove(&only);
                replaced.push((i, only));
            }
            _ => left.push(i),
        }
    }
    if left.len() == 1
        && unused.len() == 1
        && let (Some(i), Some(only)) = (left.pop(), unused.pop_first())
    {
        replaced.push((i, only));
    }
    for (i, index) in replaced {
        meant[i] = Some(index);
        let ((name, line), path) = (&used[i], path.display());
        let other = &defined[index];
        warnings.push(format!(
            "{path}:{line}: material '{name}' is not defined; '{other}', which nothing else uses, is used instead"
        ))?;
    }

    // The rest are grey.
    if let Some(&first) = left.first() {
        let names: Vec<&str> = left.iter().map(|&i| used[i].0.as_str()).collect();
        let (noun, verb) = match left.len() {
            1 => ("material", "is"),
            _ => ("materials", "are"),
        };
        let mut message = format!(
            "{}:{}: {noun} {} {verb} not defined; grey is used instead",
            path.display(),
            used[first].1,
            listed(&names)
        );
        if !defined.is_empty() {
            message += &format!(" (defined: {})", listed(&defined));
        }
        warnings.push(message)?;
    }
    for i in left {
        meant[i] = Some(materials.len());
        materials.push(MtlMaterial {
            name: used[i].0.clone(),
            ..Default::default()
        });
    }
    Ok(meant.into_iter().flatten().collect())
}

fn spelling(name: &str) -> String {
    name.to_lowercase().replace(['_', '-', '.'], " ")
}

#[cfg(test)]
mod tests {
    use super::*;

    /// What `used` mean among `defined`, by name ("" for grey), and the warnings.
    fn read(defined: &[&str], used: &[&str]) -> (Vec<String>, Vec<String>) {
        let with_name = |name: &&str| MtlMaterial {
            name: (*name).to_owned(),
            ..Default::default()
        };
        let mut materials: Vec<MtlMaterial> = defined.iter().map(with_name).collect();
        let used: Vec<(String, usize)> = used.iter().map(|n| ((*n).to_owned(), 7)).collect();
        let mut warnings = Warnings::new(false);
        let meant = meant(Path::new("a.obj"), &mut materials, &used, &mut warnings).unwrap();
        let name = |&index: &usize| match defined.get(index) {
            Some(name) => (*name).to_owned(),
            None => String::new(),
        };
        (meant.iter().map(name).collect(), warnings.list().to_vec())
    }

    #[test]
    fn names_that_are_not_defined() {
        let (meant, warnings) = read(&["a", "b"], &["b", "a"]);
        assert_eq!((meant, warnings.len()), (vec!["b".into(), "a".into()], 0));
        // One and one.
        for (defined, used) in [
            (vec!["room"], vec!["Texture1"]),
            (vec!["a", "b"], vec!["a", "x"]),
        ] {
            let (meant, warnings) = read(&defined, &used);
            assert_eq!(meant.last().map(String::as_str), defined.last().copied());
            assert!(
                warnings.len() == 1 && warnings[0].contains("used instead"),
                "{warnings:?}"
            );
        }
        // Another spelling, though there are more.
        let (meant, _) = read(
            &["Red_Wall", "roof", "floor"],
            &["roof", "red wall", "x", "y"],
        );
        assert_eq!(meant, ["roof", "Red_Wall", "", ""]);
        // Nobody can say which.
        for (defined, used) in [
            (vec!["a", "b"], vec!["x"]),
            (vec!["a"], vec!["x", "y"]),
            (vec!["Wall", "WALL"], vec!["wall"]),
            (vec![], vec!["x"]),
        ] {
            let (meant, warnings) = read(&defined, &used);
            assert!(meant.iter().all(String::is_empty), "{meant:?}");
            let [warning] = &warnings[..] else {
                panic!("{warnings:?}")
            };
            assert!(warning.starts_with("a.obj:7: material"), "{warning}");
            for name in used.iter().chain(&defined) {
                assert!(warning.contains(&format!("'{name}'")), "{warning}");
            }
        }
        let many: Vec<String> = (0..40).map(|i| format!("m{i}")).collect();
        let many: Vec<&str> = many.iter().map(String::as_str).collect();
        let (_, warnings) = read(&many, &["x"]);
        assert!(warnings[0].ends_with("'m11' and 28 more)"), "{warnings:?}");
    }
}
