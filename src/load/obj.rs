//! OBJ files: triangles and materials as written.

use super::mtl::{self, MtlMaterial};
use super::scan::{self, Defect, Outline};
use super::{check_readable, guarded};
use crate::error::{Error, Result, Warnings};
use glam::Vec3;
use std::borrow::Cow;
use std::cell::Cell;
use std::fs::File;
use std::io::{BufRead, BufReader, Read};
use std::path::Path;

/// In [`ObjFile::normal_triangles`]: this corner has no normal.
pub const NO_NORMAL: u32 = u32::MAX;

/// The triangles and materials of an OBJ file. Every triangle has area, every position is finite.
#[derive(Debug, Default)]
pub struct ObjFile {
    /// Vertex positions.
    pub positions: Vec<Vec3>,
    /// Corners of each triangle, into `positions`.
    pub triangles: Vec<[u32; 3]>,
    /// Vertex normals, as given: any length, perhaps zero or not finite.
    pub normals: Vec<Vec3>,
    /// Normals of each triangle's corners, into `normals`, or [`NO_NORMAL`]; empty where no triangle
    /// has any.
    pub normal_triangles: Vec<[u32; 3]>,
    /// Material of each triangle, into `materials`.
    pub material_of: Vec<u32>,
    /// Materials used or not; a missing one is there with its name alone.
    pub materials: Vec<MtlMaterial>,
}

/// Names of the objects into which [`Regroup`] splits faces.
const FLAT: &str = "flat";
const SMOOTH: &str = "smooth";

/// Reads an OBJ file and the material files that it names.
pub fn load(path: &Path, warnings: &mut Warnings) -> Result<ObjFile> {
    check_readable(path)?;
    let open = || File::open(path).map_err(Error::io(path, "cannot be read"));
    let outline = scan::outline(path, BufReader::with_capacity(1 << 20, open()?))?;

    // Materials first, so that it does not matter where in the file a library is named.
    let materials = load_materials(path, &outline, warnings)?;
    let index = materials
        .iter()
        .enumerate()
        .map(|(i, m)| (m.name.clone(), i))
        .collect();
    let all: Vec<tobj::Material> = materials
        .iter()
        .map(|m| tobj::Material {
            name: m.name.clone(),
            ..Default::default()
        })
        .collect();

    // tobj asks for materials at each mtllib: it gets them all at the first, which we put in front.
    let first = Cell::new(Some((all, index)));
    let libraries = |_: &Path| Ok(first.take().unwrap_or_default());
    let mixed = outline.smooth_faces && outline.flat_faces;
    let lines = BufReader::with_capacity(1 << 20, open()?);
    let lines = BufReader::with_capacity(1 << 16, Regroup::new(lines, mixed));
    let mut reader = "mtllib all\n".as_bytes().chain(lines);
    let options = tobj::LoadOptions {
        triangulate: true,
        ignore_points: true,
        ignore_lines: true,
        single_index: false,
    };
    let parsed = guarded(|| tobj::load_obj_buf(&mut reader, &options, libraries));
    let models = match parsed {
        Ok(Ok((models, _))) => models,
        failed => {
            let reason = match failed {
                Ok(Err(e)) => e.to_string(),
                _ => "the parser gave up".into(),
            };
            return Err(broken(path, reason));
        }
    };

    // One mesh of all models.
    let mut obj = ObjFile {
        materials,
        ..Default::default()
    };
    let mut unnamed = None;
    let mut no_area = 0usize;
    for model in models {
        let mesh = model.mesh;
        let smooth = outline.smooth_faces
            && !mesh.normal_indices.is_empty()
            && !(mixed && model.name == FLAT);
        let (first_position, first_normal) = (obj.positions.len() as u64, obj.normals.len() as u64);
        if first_position + mesh.positions.len() as u64 / 3 >= u64::from(u32::MAX) {
            return Err(Error::input(path, None, "has more than 2^32 vertices"));
        }
        obj.positions
            .extend(mesh.positions.chunks_exact(3).map(Vec3::from_slice));
        if smooth {
            obj.normals
                .extend(mesh.normals.chunks_exact(3).map(Vec3::from_slice));
        }
        let material = match mesh.material_id {
            Some(id) => id,
            None => *unnamed.get_or_insert_with(|| {
                obj.materials.push(MtlMaterial::default());
                obj.materials.len() - 1
            }),
        } as u32;
        for (face, corners) in mesh.indices.chunks_exact(3).enumerate() {
            let triangle = [0, 1, 2].map(|c| (first_position + u64::from(corners[c])) as u32);
            if !area_vector(&obj.positions, triangle).length().is_normal() {
                let finite = triangle
                    .iter()
                    .all(|&c| obj.positions[c as usize].is_finite());
                if !finite {
                    return Err(broken(
                        path,
                        "a vertex coordinate is not a finite number".into(),
                    ));
                }
                no_area += 1;
                continue;
            }
            obj.triangles.push(triangle);
            obj.material_of.push(material);
            if outline.smooth_faces {
                obj.normal_triangles.push(if smooth {
                    let n = &mesh.normal_indices[3 * face..3 * face + 3];
                    [0, 1, 2].map(|c| (first_normal + u64::from(n[c])) as u32)
                } else {
                    [NO_NORMAL; 3]
                });
            }
        }
    }
    if outline.smooth_faces && obj.normals.is_empty() {
        return Err(broken(
            path,
            "faces name normals, of which there are none".into(),
        ));
    }
    if no_area > 0 {
        let at = place(path, scan::locate(BufReader::new(open()?), Defect::NoArea));
        warnings.push(format!(
            "{at}: {no_area} triangles without area are left out"
        ))?;
    }
    if obj.triangles.is_empty() {
        return Err(Error::input(
            path,
            None,
            "has no faces (with area): nothing to render",
        ));
    }
    let bad = |n: &Vec3| !n.is_finite() || *n == Vec3::ZERO;
    let bad_normals = obj.normals.iter().filter(|n| bad(n)).count();
    if bad_normals > 0 {
        let at = place(
            path,
            scan::locate(BufReader::new(open()?), Defect::BadNormal),
        );
        warnings.push(format!(
            "{at}: {bad_normals} normals are zero or not finite; their triangles use the geometric normal"
        ))?;
    }
    Ok(obj)
}

/// The error for a file that cannot be used: the first broken line, or `reason` if all look well.
fn broken(path: &Path, reason: String) -> Error {
    let found = File::open(path)
        .ok()
        .and_then(|f| scan::locate(BufReader::new(f), Defect::Broken));
    let (line, message) = found.map_or((None, reason), |(line, message)| (Some(line), message));
    Error::input(path, line, message)
}

fn place(path: &Path, found: Option<(usize, String)>) -> String {
    match found {
        Some((line, _)) => format!("{}:{line}", path.display()),
        None => path.display().to_string(),
    }
}

/// Twice the area of a triangle times its normal, without underflow for small triangles.
fn area_vector(positions: &[Vec3], t: [u32; 3]) -> glam::DVec3 {
    let [a, b, c] = t.map(|i| positions[i as usize].as_dvec3());
    (b - a).cross(c - a)
}

/// The materials of all libraries, and an empty one for each name that no library has.
fn load_materials(
    path: &Path,
    outline: &Outline,
    warnings: &mut Warnings,
) -> Result<Vec<MtlMaterial>> {
    let folder = path.parent().unwrap_or(Path::new(""));
    let mut materials: Vec<MtlMaterial> = Vec::new();
    let mut read: Vec<&str> = Vec::new();
    for (name, line) in &outline.libraries {
        if read.contains(&name.as_str()) {
            continue;
        }
        read.push(name);
        let library = folder.join(name);
        if !library.exists() {
            let at = format!("{}:{line}", path.display());
            let full = std::path::absolute(&library).unwrap_or(library);
            warnings.push(format!("{at}: no material file {}", full.display()))?;
            continue;
        }
        // The first definition of a name holds.
        for material in mtl::load(&library, warnings)? {
            if !materials.iter().any(|m| m.name == material.name) {
                materials.push(material);
            }
        }
    }
    for (name, line) in &outline.materials {
        if !materials.iter().any(|m| m.name == *name) {
            warnings.push(format!(
                "{}:{line}: material '{name}' is not defined; grey is used instead",
                path.display()
            ))?;
            materials.push(MtlMaterial {
                name: name.clone(),
                ..Default::default()
            });
        }
    }
    Ok(materials)
}

/// Most faces of one group.
const GROUP: usize = 1 << 16;

/// What tobj shall read instead of the file:
/// - Groups of at most [`GROUP`] faces. tobj keeps the faces of a group in a bulky form until it ends;
///   one of ten million would take gigabytes.
/// - Faces with and without normals in groups of their own, if `mixed`: tobj makes up normals for faces
///   without any, where others of the same group have some.
/// - UTF-8. tobj refuses names in an old code page, so they are replaced, here as in the outline.
struct Regroup<R> {
    inner: R,
    mixed: bool,
    smooth: bool,
    faces: usize,
    line: Vec<u8>,
    at: usize,
}

impl<R: BufRead> Regroup<R> {
    fn new(inner: R, mixed: bool) -> Self {
        Self {
            inner,
            mixed,
            smooth: false,
            faces: GROUP,
            line: Vec::new(),
            at: 0,
        }
    }

    /// Puts the next line, with a new group before it where one is due, into `line`.
    fn next_line(&mut self) -> std::io::Result<()> {
        self.line.clear();
        self.at = 0;
        self.inner.read_until(b'\n', &mut self.line)?;
        let plain =
            |byte: &u8| byte.is_ascii() && !matches!(byte, b'f' | b'g' | b'o' | b' ' | b'\t');
        if self.line.first().is_none_or(plain) && std::str::from_utf8(&self.line).is_ok() {
            return Ok(());
        }
        let text = String::from_utf8_lossy(&self.line);
        match text.split_whitespace().next() {
            Some("f") => {
                let smooth = self.mixed && scan::has_normals(text.trim());
                if self.faces == GROUP || smooth != self.smooth {
                    self.smooth = smooth;
                    self.faces = 0;
                    let name = if self.mixed && !smooth { FLAT } else { SMOOTH };
                    self.line = format!("g {name}\n{text}").into_bytes();
                } else if let Cow::Owned(text) = text {
                    self.line = text.into_bytes();
                }
                self.faces += 1;
            }
            // The file's own groups say nothing of materials.
            Some("g" | "o") => self.line = vec![b'\n'],
            _ => self.line = text.into_owned().into_bytes(),
        }
        Ok(())
    }
}

impl<R: BufRead> Read for Regroup<R> {
    fn read(&mut self, out: &mut [u8]) -> std::io::Result<usize> {
        if self.at == self.line.len() {
            self.next_line()?;
        }
        let n = out.len().min(self.line.len() - self.at);
        out[..n].copy_from_slice(&self.line[self.at..self.at + n]);
        self.at += n;
        Ok(n)
    }
}
