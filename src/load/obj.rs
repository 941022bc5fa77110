//! OBJ files: triangles and materials as written.

use super::ahead;
use super::library;
use super::mtl::MtlMaterial;
use super::regroup::{Group, Regroup};
use super::scan::{self, Defect};
use super::textures;
use super::{check_readable, guarded};
use crate::error::{Error, Result, Warnings};
use glam::{Vec2, Vec3};
use std::fs::File;
use std::io::BufReader;
use std::path::{Path, PathBuf};

/// In [`ObjFile::normal_triangles`] and [`ObjFile::texcoord_triangles`]: this corner has none.
pub const NONE: u32 = u32::MAX;

/// The triangles and materials of an OBJ file. Every triangle has area, every position is finite.
#[derive(Debug, Default)]
pub struct ObjFile {
    /// Vertex positions.
    pub positions: Vec<Vec3>,
    /// Corners of each triangle, into `positions`.
    pub triangles: Vec<[u32; 3]>,
    /// Vertex normals, as given: any length, perhaps zero or not finite.
    pub normals: Vec<Vec3>,
    /// Normals of each triangle's corners, into `normals`, or [`NONE`]; empty where no triangle has any.
    pub normal_triangles: Vec<[u32; 3]>,
    /// Texture coordinates, (0, 0) at the lower left corner of a texture.
    pub texcoords: Vec<Vec2>,
    /// Texture coordinates of each triangle's corners, into `texcoords`, or [`NONE`]; empty where no
    /// material has a texture.
    pub texcoord_triangles: Vec<[u32; 3]>,
    /// Material of each triangle, into `materials`.
    pub material_of: Vec<u32>,
    /// Materials used or not; a missing one is there with its name alone.
    pub materials: Vec<MtlMaterial>,
}

/// What the user asks for beside the file.
#[derive(Clone, Debug, Default)]
pub struct Options {
    /// One more folder in which textures are looked for.
    pub textures: Option<PathBuf>,
}

/// Reads an OBJ file, the material files that it names, and the textures that those name.
pub fn load(path: &Path, warnings: &mut Warnings) -> Result<ObjFile> {
    load_with(path, &Options::default(), warnings)
}

/// As [`load`], with `options`.
pub fn load_with(path: &Path, options: &Options, warnings: &mut Warnings) -> Result<ObjFile> {
    check_readable(path)?;
    let open = || File::open(path).map_err(Error::io(path, "cannot be read"));
    let reader = Regroup::new(BufReader::with_capacity(1 << 20, open()?));
    let tobj_options = tobj::LoadOptions {
        triangulate: true,
        ignore_points: true,
        ignore_lines: true,
        single_index: false,
    };
    let no_library = |_: &Path| Ok(Default::default());
    let (parsed, reader) = ahead::parse(reader, |lines| {
        guarded(|| tobj::load_obj_buf(lines, &tobj_options, no_library))
    });
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

    let (mut materials, material_of_name) =
        library::load(path, &reader.libraries, &reader.materials, warnings)?;
    let folder = path.parent().unwrap_or(Path::new(""));
    let more = options.textures.as_deref();
    textures::load(&mut materials, &material_of_name, folder, more, warnings)?;
    let textured = materials.iter().any(|m| !m.maps.is_empty());

    // One mesh of all models.
    let mut obj = ObjFile {
        materials,
        ..Default::default()
    };
    let mut unnamed = None;
    let mut no_area = 0usize;
    let mut smooth_faces = false;
    for model in models {
        let mesh = model.mesh;
        let group = Group::from_name(&model.name);
        let smooth = group.normals && !mesh.normal_indices.is_empty();
        let mapped = group.texcoords && textured && !mesh.texcoord_indices.is_empty();
        let first_position = obj.positions.len() as u64;
        let (first_normal, first_texcoord) = (obj.normals.len() as u64, obj.texcoords.len() as u64);
        if first_position + mesh.positions.len() as u64 / 3 >= u64::from(u32::MAX) {
            return Err(Error::input(path, None, "has more than 2^32 vertices"));
        }
        obj.positions
            .extend(mesh.positions.chunks_exact(3).map(Vec3::from_slice));
        if smooth {
            obj.normals
                .extend(mesh.normals.chunks_exact(3).map(Vec3::from_slice));
            // Faces before were flat.
            if !smooth_faces {
                obj.normal_triangles = vec![[NONE; 3]; obj.triangles.len()];
                smooth_faces = true;
            }
        }
        if mapped {
            obj.texcoords
                .extend(mesh.texcoords.chunks_exact(2).map(Vec2::from_slice));
        }
        let material = match group.material {
            Some(name) => material_of_name[name as usize],
            None => *unnamed.get_or_insert_with(|| {
                obj.materials.push(MtlMaterial::default());
                obj.materials.len() - 1
            }),
        } as u32;
        let corners_of = |indices: &[u32], face: usize, first: u64| {
            [0, 1, 2].map(|c| (first + u64::from(indices[3 * face + c])) as u32)
        };
        for face in 0..mesh.indices.len() / 3 {
            let triangle = corners_of(&mesh.indices, face, first_position);
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
            if smooth_faces {
                obj.normal_triangles.push(if smooth {
                    corners_of(&mesh.normal_indices, face, first_normal)
                } else {
                    [NONE; 3]
                });
            }
            if textured {
                obj.texcoord_triangles.push(if mapped {
                    corners_of(&mesh.texcoord_indices, face, first_texcoord)
                } else {
                    [NONE; 3]
                });
            }
        }
    }
    if reader.normals && obj.normals.is_empty() {
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
