//! Models as other programs write them, made for this project: each comes out with its triangles,
//! materials, area and bounds, with the warnings that it deserves and no others, and renders.

use crate::common::{Render, tracer};
use gdpt::bsdf::Bsdf;
use gdpt::error::Warnings;
use gdpt::load::obj::{self, NONE, ObjFile};
use gdpt::scene::{Scene, SceneSettings};
use glam::{DVec3, Vec3};
use std::collections::HashSet;
use std::path::Path;

/// What a model must come out as.
struct Expected<'a> {
    /// All materials in order, each with the number of its triangles.
    materials: &'a [(&'a str, usize)],
    /// Vertices of different position.
    vertices: usize,
    /// Area of all triangles.
    area: f64,
    /// Smallest and largest coordinates.
    bounds: [[f32; 3]; 2],
    /// Warnings of the loader and then of the scene, less those on textures.
    warnings: &'a [&'a str],
}

const FOLDER: &str = "tests/models/";
const NO_LIGHT: &str = "the scene has no light: a studio is used (--environment 1 for white)";

/// Loads and renders a model, and checks it.
fn check(name: &str, expected: &Expected) -> (ObjFile, Scene) {
    let path = format!("{FOLDER}{name}");
    let path = Path::new(&path);
    let mut warnings = Warnings::new(false);
    let file = obj::load(path, &mut warnings).unwrap();

    assert_eq!(file.material_of.len(), file.triangles.len());
    let triangles_of = |m: usize| {
        file.material_of
            .iter()
            .filter(|&&o| o as usize == m)
            .count()
    };
    let materials: Vec<(&str, usize)> = file
        .materials
        .iter()
        .enumerate()
        .map(|(i, m)| (m.name.as_str(), triangles_of(i)))
        .collect();
    assert_eq!(materials, expected.materials, "{name}: materials");

    let used = file.triangles.iter().flatten();
    let vertices: HashSet<[u32; 3]> = used
        .map(|&i| file.positions[i as usize].to_array().map(f32::to_bits))
        .collect();
    assert_eq!(vertices.len(), expected.vertices, "{name}: vertices");

    let corners = |t: &[u32; 3]| t.map(|i| file.positions[i as usize].as_dvec3());
    let area_vectors: Vec<DVec3> = file
        .triangles
        .iter()
        .map(|t| {
            let [a, b, c] = corners(t);
            0.5 * (b - a).cross(c - a)
        })
        .collect();
    let area: f64 = area_vectors.iter().map(|n| n.length()).sum();
    assert!(
        (area / expected.area - 1.0).abs() < 1e-5,
        "{name}: area {area}, should be {}",
        expected.area
    );

    // A normal that went to another corner, or corners in another order, would show here.
    for (n, of_corners) in area_vectors.iter().zip(&file.normal_triangles) {
        for &c in of_corners.iter().filter(|&&c| c != NONE) {
            let given = file.normals[c as usize];
            assert!(
                given == Vec3::ZERO || given.as_dvec3().dot(*n) > 0.0,
                "{name}: normal {given} on a triangle with {n}"
            );
        }
    }

    // Of all vertices, not only those of triangles: nothing else is kept.
    let [low, high] = expected.bounds.map(Vec3::from);
    let all = file.positions.iter();
    let bounds = all.fold((Vec3::INFINITY, Vec3::NEG_INFINITY), |(l, h), p| {
        (l.min(*p), h.max(*p))
    });
    assert_eq!(bounds, (low, high), "{name}: bounds");

    let settings = SceneSettings {
        size: (16, 16),
        roughness_threshold: 0.01,
        ..Default::default()
    };
    let again = obj::load(path, &mut Warnings::new(false)).unwrap();
    let scene = Scene::build(path, again, &settings, &mut warnings).unwrap();
    assert_eq!(scene.mesh.bounds, (low, high), "{name}: bounds");
    let warnings: Vec<&str> = warnings
        .list()
        .iter()
        .map(|w| w.strip_prefix(FOLDER).unwrap_or(w))
        .filter(|w| !w.contains("map_"))
        .collect();
    assert_eq!(warnings, expected.warnings, "{name}: warnings");

    let render = Render {
        spp: 2,
        depth: 6,
        ..Default::default()
    };
    // Without light seen directly, so without the environment behind the model: what is not black is lit.
    let primal = render.estimate(&scene, tracer(&scene).as_ref()).primal;
    let pixels: Vec<Vec3> = (0..16 * 16).map(|i| primal.get(i)).collect();
    assert!(pixels.iter().all(|p| p.is_finite()), "{name}: not finite");
    let lit = pixels.iter().filter(|p| p.max_element() > 0.0).count();
    assert!(lit >= 16, "{name}: {lit} pixels are lit");
    (file, scene)
}

/// Blender 4.2: objects (`o`), `s 0` and `s 1`, corners v/vt/vn, n-gons, loose edges (`l`), a lamp, PBR
/// keys in the MTL (`Pr` to `anisor`) and a texture with options.
#[test]
fn blender() {
    let octagon = std::f64::consts::FRAC_PI_8;
    let (file, scene) = check(
        "blender.obj",
        &Expected {
            materials: &[
                ("Lamp", 2),                    // 4 − 2
                ("Material.001", 5 * 2),        // five sides of a cube: 5 (4 − 2)
                ("Material.002", 2),            // the sixth
                ("Metal", 8 * 2 + 2 * (8 - 2)), // a prism: eight sides, and two octagons
            ],
            vertices: 8 + 16 + 4,
            // A cube of side 2; a prism of radius 1 and height 2: eight sides, and two octagons of
            // 2√2; a square of side 2.
            area: 24.0 + 8.0 * 2.0 * 2.0 * octagon.sin() + 2.0 * 8f64.sqrt() + 4.0,
            bounds: [[-1.0, -1.0, -1.0], [4.0, 4.0, 1.0]],
            warnings: &[
                "blender.obj:125: 2 lines and points (l, p) are left out: only faces are rendered",
            ],
        },
    );
    let metal = &file.materials[3];
    assert_eq!(
        (metal.pr, metal.pm, metal.illum),
        (Some(0.3), Some(1.0), Some(3))
    );
    assert_eq!(scene.materials[0].emission, Some(Vec3::splat(4.0)));
    assert!(matches!(scene.materials[3].bsdf, Bsdf::Conductor { .. }));
}

/// MeshLab: each `vn` before its `v`, vertices with colours, v//vn, a library by a path (`./`), no line end
/// after `# End of File`. `Tr` is MeshLab's word for opacity: 1 is opaque there, and transparent for
/// everybody else. What would be invisible is taken as opaque, so the model looks as it should.
#[test]
fn meshlab() {
    let golden = 1.618034;
    let (file, scene) = check(
        "meshlab.obj",
        &Expected {
            // An icosahedron.
            materials: &[("material_0", 12), ("material_1", 8)],
            vertices: 12,
            area: 5.0 * 3f64.sqrt() * 2.0 * 2.0, // edges of length 2
            bounds: [[-golden; 3], [golden; 3]],
            warnings: &[
                "meshlab.obj: materials 'material_0', 'material_1': d 0 (or Tr 1, as some programs write it) \
                 would be invisible: taken as opaque",
                NO_LIGHT,
            ],
        },
    );
    let orange = Vec3::new(0.8, 0.4, 0.2);
    assert_eq!(scene.materials[0].bsdf, Bsdf::Lambert { albedo: orange });
    // One normal for each vertex, outwards.
    assert_eq!(file.normal_triangles.len(), 20);
    for (triangle, normals) in file.triangles.iter().zip(&file.normal_triangles) {
        for (v, n) in triangle.iter().zip(normals) {
            let out = file.positions[*v as usize].normalize();
            assert!(file.normals[*n as usize].distance(out) < 1e-5);
        }
    }
}

/// A drawing from CAD or GIS: CRLF, Latin-1, groups, negative indices, coordinates of millions of metres
/// (which 32-bit floats keep to half a metre), z upwards, vertices that no face uses, far from the others,
/// faces of 5 and 6 corners. Libraries come last, two on one line, and define one name twice (the first
/// definition holds) and another not at all.
///
/// The ground is concave. A face becomes a fan around its first corner, which is right where that
/// corner sees the whole face, as here.
#[test]
fn cad() {
    let (file, scene) = check(
        "cad.obj",
        &Expected {
            materials: &[
                ("Wall", 2 * (5 - 2) + 2 * 2), // two gables and two walls
                ("Dach_gr\u{fffd}n", 2 * 2),
                ("Ground", 2 + (6 - 2)), // the house's floor, and the ground
                ("Well", 6 - 2),
            ],
            vertices: 10 + 6 + 6,
            // House: gables of 8 · 4 + 8 · 3 / 2, walls of 4 · 10, roofs of 5 · 10, a floor of 8 · 10;
            // ground: a square of side 20 less one of side 10; well: two trapezoids of (4 + 2) / 2 · 2.
            area: 2.0 * 44.0 + 2.0 * 40.0 + 2.0 * 50.0 + 80.0 + 300.0 + 12.0,
            bounds: [
                [3_499_970.0, 5_599_990.0, 104.5],
                [3_500_008.0, 5_600_010.0, 111.5],
            ],
            warnings: &[
                "cad.obj:40: material 'Well' is not defined; grey is used instead (defined: 'Wall', \
                 'Dach_gr\u{fffd}n', 'Ground')",
                NO_LIGHT,
            ],
        },
    );
    assert_eq!(file.materials[0].kd, Some([0.9, 0.9, 0.85]));
    assert!(file.normal_triangles.is_empty());
    let grey = Vec3::splat(0.5);
    assert_eq!(scene.materials[3].bsdf, Bsdf::Lambert { albedo: grey });
}

/// 3ds Max: blanks in the library's name, blanks and `#` in those of materials, two blanks after `v`, three
/// numbers in `vt`, blanks at the ends of lines, smoothing groups by number, an MTL indented with tabs
/// with both `d` and `Tr`, and a material that nothing uses.
#[test]
fn max() {
    let (file, scene) = check(
        "max.obj",
        &Expected {
            materials: &[
                ("02 - Default", 0),
                ("Material #25", 6 * 2), // a box
                ("Material #26", 4 + 2), // a pyramid on a square
            ],
            vertices: 8 + 5,
            // 20 by 30 by 10; a square of side 6 and four triangles of height 5.
            area: 2.0 * (600.0 + 300.0 + 200.0) + 36.0 + 4.0 * 6.0 * 5.0 / 2.0,
            bounds: [[-10.0, 0.0, -5.0], [23.0, 30.0, 5.0]],
            warnings: &[NO_LIGHT],
        },
    );
    assert_eq!(file.materials[1].kd, Some([0.6, 0.4, 0.2]));
    // Its closed body takes the colour once.
    let glass = Bsdf::Glass {
        ior: 1.5,
        tint: Vec3::new(0.9f32, 0.95, 0.9).map(f32::sqrt),
    };
    assert_eq!(scene.materials[2].bsdf, glass);
}

/// Maya: `g default` between objects, several groups on one line, colons in names, `s off`, `illum 4`, and
/// in one file faces with v/vt/vn, v/vt and v alone, an octagon among them; the material changes from
/// face to face and back.
#[test]
fn maya() {
    let (file, scene) = check(
        "maya.obj",
        &Expected {
            materials: &[
                ("blinn1SG", 2 * 2), // two of four squares
                ("initialShadingGroup", 6 * 2),
                ("lightSG", 8 - 2),
                ("room:lambert2SG", 2 * 2),
            ],
            vertices: 8 + 9 + 8,
            // A cube of side 1, a square of side 4, and one with corners of 1 · 1 / 2 cut off.
            area: 6.0 + 16.0 + 14.0,
            bounds: [[-2.0, -0.5, -2.0], [2.0, 3.0, 2.0]],
            warnings: &[],
        },
    );
    // Only the cube has normals.
    for (material, normals) in file.material_of.iter().zip(&file.normal_triangles) {
        assert_eq!(*material == 1, *normals != [NONE; 3]);
    }
    assert!(!scene.lights.is_empty());
}

/// What the format's manual allows and programs of its time wrote: a byte order mark before `mtllib`, lines
/// that go on after a backslash, comments behind numbers, tabs and indents, weights and colours of some
/// vertices, lines through four points (no triangles), points, a curve, faces with and without
/// normals, `d -halo`, spectral colours; and a face without area, a normal of length 0.
#[test]
fn wavefront() {
    let (file, _) = check(
        "wavefront.obj",
        &Expected {
            materials: &[
                ("red wax", 8 - 2),         // an octagon
                ("brass", 4 + (4 - 2) + 1), // a tetrahedron, the floor, and half of it again
            ],
            vertices: 4 + 8 + 4,
            // The corner of a cube of side 2 with its cut, an equilateral triangle of side √8; the
            // octagon of Maya's model; a square of side 4, and half of it.
            area: 3.0 * 2.0 + 3f64.sqrt() / 4.0 * 8.0 + 14.0 + 16.0 + 8.0,
            bounds: [[-2.0, -1.0, -2.0], [2.0, 5.0, 2.0]],
            warnings: &[
                "wavefront.mtl:12: statements that are unknown are left out: Ks xyz",
                "wavefront.obj:44: 1 faces without area are left out",
                "wavefront.obj:53: 1 normals are zero or not finite; their triangles use the geometric \
                 normal",
                "wavefront.obj:25: 1 free-form curves are left out: only faces are rendered",
                "wavefront.obj:56: 1 lines of 'call' are not understood and left out",
                "wavefront.obj:20: 2 lines and points (l, p) are left out: only faces are rendered",
                NO_LIGHT,
            ],
        },
    );
    let [wax, brass] = &file.materials[..] else {
        panic!("two materials")
    };
    assert_eq!((wax.kd, wax.ns), (Some([0.7, 0.1, 0.1]), Some(20.0)));
    assert_eq!(wax.opacity, Some(0.6));
    assert_eq!(brass.kd, Some([0.5; 3]));
    // Only the floor has normals.
    let flat = file.normal_triangles.iter().filter(|n| **n == [NONE; 3]);
    assert_eq!(flat.count(), 4 + 6);
}
