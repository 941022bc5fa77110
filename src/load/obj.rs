//! OBJ files: triangles and materials as written.

use super::ahead;
use super::guarded;
use super::kind;
use super::library;
use super::mtl::MtlMaterial;
use super::polygon::Triangulator;
use super::regroup::{Colours, Group, Regroup};
use super::repair::Repair;
use super::scan;
use super::text::{Lines, STANDARD_INPUT, Text};
use super::textures;
use crate::error::{Error, Result, Warnings};
use glam::{Vec2, Vec3};
use std::io::BufRead;
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
    /// Colours of vertices as written, sRGB of 0 to 1 or of 0 to 255, NaN where one has none; empty where no vertex
    /// has any.
    pub colours: Vec<Vec3>,
    /// Smoothing group of each triangle without normals, 0 for none; empty where all are 0.
    pub smoothing_of: Vec<u32>,
    /// Material of each triangle, into `materials`.
    pub material_of: Vec<u32>,
    /// Names of objects; empty unless they are asked for.
    pub objects: Vec<String>,
    /// Object of each triangle, into `objects`.
    pub object_of: Vec<u32>,
    /// Materials used or not; a missing one is there with its name alone.
    pub materials: Vec<MtlMaterial>,
}

/// What the user asks for beside the file.
#[derive(Clone, Debug, Default)]
pub struct Options {
    /// One more folder in which textures are looked for.
    pub textures: Option<PathBuf>,
    /// What wins over the materials of the libraries.
    pub repairs: Vec<Repair>,
    /// Whether it shall be known to which objects triangles belong.
    pub objects: bool,
}

/// Reads an OBJ file, the material files that it names, and the textures that those name. `-` is standard
/// input.
pub fn load(path: &Path, warnings: &mut Warnings) -> Result<ObjFile> {
    load_with(path, &Options::default(), warnings)
}

/// As [`load`], with `options`.
pub fn load_with(path: &Path, options: &Options, warnings: &mut Warnings) -> Result<ObjFile> {
    let text = Text::new(path)?;
    let name = if path == Path::new(STANDARD_INPUT) {
        Path::new("standard input")
    } else {
        path
    };
    if let Some(other) = other_kind(name, &text)? {
        return Err(Error::input(name, None, other));
    }
    let (models, mut reader) = parse(name, &text)?;
    let (mut materials, material_of_name) = library::load(
        path,
        &reader.libraries,
        &reader.materials,
        &options.repairs,
        warnings,
    )?;
    let folder = path.parent().unwrap_or(Path::new(""));
    let more = options.textures.as_deref();
    textures::load(&mut materials, &material_of_name, folder, more, warnings)?;
    let mut mesh = Assembly {
        textured: materials.iter().any(|m| !m.maps.is_empty()),
        obj: ObjFile {
            materials,
            ..Default::default()
        },
        triangulator: Triangulator::new(),
        no_area: 0,
        hollow: 0,
    };
    let (names, mut of_faces) = std::mem::take(&mut reader.objects).into_names();
    if options.objects {
        mesh.obj.objects = names;
    }
    let mut unnamed = None;
    for model in models {
        let group = Group::from_name(&model.name);
        let material = match group.material {
            Some(index) => material_of_name[index as usize],
            None => *unnamed.get_or_insert_with(|| {
                mesh.obj.materials.push(MtlMaterial::default());
                mesh.obj.materials.len() - 1
            }),
        } as u32;
        if mesh.obj.positions.len() as u64 + model.mesh.positions.len() as u64 / 3
            >= u64::from(u32::MAX)
        {
            return Err(Error::input(name, None, "has more than 2^32 vertices"));
        }
        mesh.add(&model.mesh, group, material, &mut of_faces);
    }
    if mesh.no_area > 0 {
        let line = scan::first_without_area(text.open()?);
        let line = line.map_or(String::new(), |line| format!(":{line}"));
        warnings.push(format!(
            "{}{line}: {} faces without area are left out",
            name.display(),
            mesh.no_area
        ))?;
    }
    if mesh.obj.triangles.is_empty() {
        let why = reader.passed_over.why_no_faces(reader.counts[0]);
        let message = format!("has no faces (with area): nothing to render{why}");
        return Err(Error::input(name, None, message));
    }
    reader.passed_over.tell(name, mesh.hollow, warnings)?;
    Ok(mesh.obj)
}

/// What the file is, if it is not OBJ.
fn other_kind(name: &Path, text: &Text) -> Result<Option<String>> {
    let mut reader = text.open()?;
    let head = reader
        .fill_buf()
        .map_err(Error::io(name, "cannot be read"))?;
    Ok(kind::other_than_obj(head, text.length()))
}

/// The groups of the file, and what the reader kept.
fn parse<'a>(name: &Path, text: &'a Text) -> Result<(Vec<tobj::Model>, Regroup<Lines<'a>>)> {
    let options = tobj::LoadOptions {
        ignore_points: true,
        ignore_lines: true,
        ..Default::default()
    };
    let mut colours = Colours::AsWritten;
    loop {
        let reader = Regroup::new(text.open()?, colours);
        let no_library = |_: &Path| Ok(Default::default());
        let (parsed, mut reader) = ahead::parse(reader, |lines| {
            guarded(|| tobj::load_obj_buf(lines, &options, no_library))
        });
        if let Some(again) = reader.again.take() {
            colours = again;
            continue;
        }
        if let Some(failure) = reader.failure.take() {
            let message = format!("cannot be read: {failure}");
            return Err(Error::input(name, None, message));
        }
        return match parsed {
            Ok(Ok((models, _))) => Ok((models, reader)),
            Ok(Err(e)) => Err(Error::input(name, None, e.to_string())),
            Err(()) => Err(Error::input(name, None, "the parser gave up")),
        };
    }
}

/// One mesh of all groups.
struct Assembly {
    obj: ObjFile,
    /// Whether any material has a texture.
    textured: bool,
    triangulator: Triangulator,
    /// Faces without area.
    no_area: usize,
    /// Faces with a corner that is not finite.
    hollow: usize,
}

impl Assembly {
    /// Adds the faces of a group; `objects` are those of its faces and of the faces after them.
    fn add(
        &mut self,
        mesh: &tobj::Mesh,
        group: Group,
        material: u32,
        objects: &mut impl Iterator<Item = u32>,
    ) {
        let obj = &mut self.obj;
        let smooth = group.shape.normals && !mesh.normal_indices.is_empty();
        let mapped = group.shape.texcoords && self.textured && !mesh.texcoord_indices.is_empty();
        let first_position = obj.positions.len() as u32;
        let (first_normal, first_texcoord) = (obj.normals.len() as u32, obj.texcoords.len() as u32);
        let vectors = |list: &[f32]| -> Vec<Vec3> {
            list.as_chunks::<3>().0.iter().map(|&v| v.into()).collect()
        };
        obj.positions.extend(vectors(&mesh.positions));
        obj.colours.extend(vectors(&mesh.vertex_color));
        if smooth {
            obj.normals.extend(vectors(&mesh.normals));
            // Faces before were flat.
            if obj.normal_triangles.is_empty() {
                obj.normal_triangles = vec![[NONE; 3]; obj.triangles.len()];
            }
        }
        let has_normals = !obj.normals.is_empty();
        if group.smoothing != 0 && obj.smoothing_of.is_empty() {
            obj.smoothing_of = vec![0; obj.triangles.len()];
        }
        let has_smoothing = group.smoothing != 0 || !obj.smoothing_of.is_empty();
        if mapped {
            let pairs = mesh.texcoords.as_chunks::<2>().0;
            obj.texcoords.extend(pairs.iter().map(|&uv| Vec2::from(uv)));
        }

        let (mut face, mut at) = (0, 0);
        while at < mesh.indices.len() {
            // tobj tells numbers of corners where not all are 3.
            let corners = mesh.face_arities.get(face).map_or(3, |&n| n as usize);
            let object = objects.next().unwrap_or(0);
            let indices = &mesh.indices[at..at + corners];
            let points = indices
                .iter()
                .map(|&i| obj.positions[(first_position + i) as usize]);
            let Some(triangles) = self.triangulator.cut(points) else {
                self.hollow += 1;
                (face, at) = (face + 1, at + corners);
                continue;
            };
            self.no_area += usize::from(triangles.is_empty());
            for triangle in triangles {
                let corners_of =
                    |list: &[u32], first: u32| triangle.map(|c| first + list[at + c as usize]);
                obj.triangles
                    .push(corners_of(&mesh.indices, first_position));
                obj.material_of.push(material);
                if !obj.objects.is_empty() {
                    obj.object_of.push(object);
                }
                if has_normals {
                    obj.normal_triangles.push(if smooth {
                        corners_of(&mesh.normal_indices, first_normal)
                    } else {
                        [NONE; 3]
                    });
                }
                if has_smoothing {
                    obj.smoothing_of.push(group.smoothing);
                }
                if self.textured {
                    let mut texcoords = [NONE; 3];
                    if mapped {
                        texcoords = corners_of(&mesh.texcoord_indices, first_texcoord);
                        let finite = |&c: &u32| obj.texcoords[c as usize].is_finite();
                        if !texcoords.iter().all(finite) {
                            texcoords = [NONE; 3];
                        }
                    }
                    obj.texcoord_triangles.push(texcoords);
                }
            }
            (face, at) = (face + 1, at + corners);
        }
    }
}
