//! What there is to say about materials: each remark once, with all the materials that it is about.

use crate::error::{Result, Warnings, listed};
use std::path::Path;

/// Remarks about materials.
#[derive(Debug, Default)]
pub struct Remarks(Vec<Remark>);

#[derive(Debug)]
struct Remark {
    what: String,
    kind: Kind,
    materials: Vec<String>,
}

/// How grave a remark is.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Kind {
    /// Something is done otherwise than the file says.
    Warning,
    /// What the file says is understood as its program means it.
    Note,
}

impl Remarks {
    /// Adds one about a material.
    pub fn add(&mut self, kind: Kind, material: &str, what: impl Into<String>) {
        let what = what.into();
        let same = |r: &&mut Remark| r.what == what && r.kind == kind;
        match self.0.iter_mut().find(same) {
            Some(remark) => remark.materials.push(material.to_owned()),
            None => self.0.push(Remark {
                what,
                kind,
                materials: vec![material.to_owned()],
            }),
        }
    }

    /// Passes all on. `path` is that of the scene.
    pub fn report(self, path: &Path, warnings: &mut Warnings) -> Result<()> {
        for Remark {
            what,
            kind,
            materials,
        } in self.0
        {
            let noun = if materials.len() == 1 {
                "material"
            } else {
                "materials"
            };
            let message = format!("{}: {noun} {}: {what}", path.display(), listed(&materials));
            match kind {
                Kind::Warning => warnings.push(message)?,
                Kind::Note => warnings.note(message),
            }
        }
        Ok(())
    }
}
