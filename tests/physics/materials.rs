//! What materials mean as programs write them: MTL keys to BSDFs, and which glass is thin.

use crate::common::{Render, lambert, tracer};
use gdpt::bsdf::Bsdf;
use gdpt::bsdf::plastic::Coat;
use gdpt::error::Warnings;
use gdpt::load::mtl::MtlMaterial;
use gdpt::load::obj::ObjFile;
use gdpt::load::sidecar::CameraTable;
use gdpt::render::Method;
use gdpt::scene::material::{Class, Material};
use gdpt::scene::remarks::Remarks;
use gdpt::scene::{Scene, SceneSettings};
use glam::Vec3;
use std::path::Path;

fn parse(statements: &str) -> MtlMaterial {
    let file = tempfile::NamedTempFile::new().unwrap();
    let text = format!("newmtl m\n{}\n", statements.replace(';', "\n"));
    std::fs::write(file.path(), text).unwrap();
    let mut warnings = Warnings::new(true);
    gdpt::load::mtl::load(file.path(), &mut warnings)
        .unwrap()
        .remove(0)
}

/// The material that MTL statements, separated by semicolons, make, and what is said about it.
fn read(statements: &str) -> (Material, Vec<String>) {
    let (mut remarks, mut warnings) = (Remarks::default(), Warnings::new(false));
    let material = Material::from_mtl(&parse(statements), None, 0.1, &mut remarks);
    remarks.report(Path::new("x.obj"), &mut warnings).unwrap();
    (material, warnings.list().to_vec())
}

/// The BSDF of statements about which there is nothing to say.
fn bsdf(statements: &str) -> Bsdf {
    let (material, warnings) = read(statements);
    assert!(warnings.is_empty(), "{statements}: {warnings:?}");
    material.bsdf
}

/// The BSDF of statements about which there is something to say, with these words.
fn remarked(statements: &str, words: &[&str]) -> Bsdf {
    let (material, warnings) = read(statements);
    let [message] = &warnings[..] else {
        panic!("{statements}: {warnings:?}");
    };
    for word in words {
        assert!(message.contains(word), "{statements}: {message}");
    }
    material.bsdf
}

fn coat(statements: &str) -> Coat {
    match bsdf(statements) {
        Bsdf::Plastic { coat, .. } => coat,
        other => panic!("{statements}: {other:?}"),
    }
}

/// Glass whose whole way through a body takes `tint`.
fn glass(ior: f32, tint: [f32; 3]) -> Bsdf {
    let tint = Vec3::from(tint).map(f32::sqrt);
    Bsdf::Glass { ior, tint }
}

fn mirror(f0: f32) -> Bsdf {
    Bsdf::Mirror {
        f0: Vec3::splat(f0),
    }
}

const GREEN: Bsdf = Bsdf::Lambert {
    albedo: Vec3::new(0.2, 0.5, 0.2),
};

#[test]
fn metals_and_lambert() {
    assert_eq!(bsdf("Kd .2 .5 .2"), GREEN);
    let grey = Vec3::splat(0.5);
    assert_eq!(bsdf(""), Bsdf::Lambert { albedo: grey });
    let f0 = Vec3::splat(0.9);
    let metal = Bsdf::Conductor { f0, alpha: 0.25 };
    assert_eq!(bsdf("Pm 1;Pr .5;Ks .9"), metal);
    assert_eq!(bsdf("Pm 1;Pr 0;Ks .9"), mirror(0.9));
    assert_eq!(read("Pm 1;Pr .5;Ks .9").0.class, Class::Rough);
    let light = read("Ke 1 0 0").0;
    assert_eq!((light.emission, light.class), (Some(Vec3::X), Class::Rough));
}

#[test]
fn diffuse_and_specular_parts_make_plastic() {
    let ordinary = coat("Kd .5;Ks .5;Ns 198;illum 2");
    assert!((ordinary.f0 - 0.04).abs() < 1e-6 && (ordinary.alpha - 0.1).abs() < 1e-6);
    assert_eq!((ordinary.tint, ordinary.metallic), (Vec3::ONE, 0.0));
    // No highlight by illum 1, none with a black Ks, none with Ns 0.
    let grey = Bsdf::Lambert {
        albedo: Vec3::splat(0.5),
    };
    for dull in ["Ks .5;Ns 0;illum 2", "Ks .5;Ns 9;illum 1", "Ks 0;Ns 9"] {
        assert_eq!(bsdf(&format!("Kd .5;{dull}")), grey, "{dull}");
    }
    assert_eq!(coat("Kd .5;Ks .25;Ns 9").tint, Vec3::splat(0.5));
    assert!(coat("Kd .5;Ks .5;Ns 1000").is_smooth());
    let rough = coat("Kd .5;Pr .5");
    assert_eq!((rough.alpha, rough.tint), (0.25, Vec3::ONE));
    let mixed = coat("Kd .5;Ks .5;Pm .25");
    assert_eq!((mixed.metallic, mixed.metal), (0.25, Vec3::splat(0.5)));
}

/// Illumination models 3, 5 and 8 reflect by `Ks`; with a black one they are what the other keys say.
#[test]
fn models_that_reflect() {
    for illum in [3, 5, 8] {
        let at = |statements: &str| format!("illum {illum};{statements}");
        // McGuire's mirrors.
        let box_mirror = at("Ka .01 .01 .01;Kd .01 .01 .01;Ks .95 .95 .95;Ns 1000");
        assert_eq!(bsdf(&box_mirror), mirror(0.95));
        assert_eq!(bsdf(&at("Ks .8 .8 .8;Kd 0 0 0")), mirror(0.8));
        let brushed = Bsdf::Conductor {
            f0: Vec3::splat(0.9),
            alpha: 0.2,
        };
        assert_eq!(bsdf(&at("Ks .9;Ns 48;Kd 0")), brushed);
        // Ni and Tf do not make glass of it.
        assert_eq!(bsdf(&at("Ks .8;Kd 0;Ni 1.5;d 1;Tf 1 1 1")), mirror(0.8));
        assert_eq!(bsdf(&at("Kd .2 .5 .2;Ks 0 0 0;Ni 1.5")), GREEN);
        assert_eq!(bsdf(&at("Kd .2 .5 .2")), GREEN);
        assert_eq!(bsdf(&at("Ks 0;d .2;Ni 1.4")), glass(1.4, [1.0; 3]));
        assert_eq!(
            remarked(&at("Ks .9;Kd .5"), &["Kd", &format!("illum {illum}")]),
            mirror(0.9)
        );
        // A reflection that does not hide the colour below is a coat over it.
        assert_eq!(coat(&at("Kd .8 .1 .1;Ks .5 .4 .4;Ns 8;Ni 1.5;d 1")).f0, 0.5);
        let varnish = coat(&at("Kd .8 .2 .2;Ks .1 .1 .05;Ns 2000"));
        assert_eq!(varnish.f0, 0.1);
        assert!(varnish.is_smooth() && varnish.tint.abs_diff_eq(Vec3::new(1.0, 1.0, 0.5), 1e-6));
    }
    // Blender's metals have the colour Kd.
    let gold = remarked(
        "Ns 360;Ka 1 1 1;Kd .8 .6 .2;Ks .5 .5 .5;Ni 1.45;d 1;illum 3",
        &["Blender"],
    );
    assert!(matches!(gold, Bsdf::Conductor { f0, .. } if f0 == Vec3::new(0.8, 0.6, 0.2)));
}

#[test]
fn models_of_glass() {
    for illum in [6, 7, 9] {
        assert_eq!(
            bsdf(&format!("illum {illum};Ni 1.33")),
            glass(1.33, [1.0; 3])
        );
        assert_eq!(
            bsdf(&format!("illum {illum};Kd .1;Ks .9")),
            glass(1.5, [1.0; 3])
        );
    }
    // A textured surface of a program that writes illum 7 for all of them.
    for opaque in [
        "illum 7;Ka 1;Kd .2 .5 .2;Ks 1;Ns 0",
        "illum 6;Kd .2 .5 .2;Ks 0;Ns 9;Ni 1;d 1",
    ] {
        assert_eq!(remarked(opaque, &["opaque", "illum"]), GREEN);
    }
    for clear in ["Ni 1.5", "d .5", "Tf .9 1 .9"] {
        let statements = format!("illum 7;Kd .2 .5 .2;Ks 1;Ns 50;{clear}");
        assert!(
            matches!(bsdf(&statements), Bsdf::Glass { ior: 1.5, .. }),
            "{clear}"
        );
    }
    // 4 is glass where d or Tf says so.
    assert_eq!(bsdf("illum 4;d .3;Ni 1.4;Kd .5"), glass(1.4, [1.0; 3]));
    assert_eq!(bsdf("illum 4;d .3"), glass(1.5, [1.0; 3]));
    let tinted = glass(1.5, [0.5, 0.9, 0.9]);
    assert_eq!(bsdf("illum 4;Tf .5 .9 .9;Ni 1.5"), tinted);
    assert_eq!(bsdf("illum 4;Tf .5 .9 .9;d 1;Ni 1.5"), tinted);
    assert_eq!(bsdf("illum 4;Tf 1 1 1;Ni 1.5"), glass(1.5, [1.0; 3]));
    // Maya writes it for everything.
    assert_eq!(bsdf("illum 4;Kd .2 .5 .2;Ka 0;Tf 1 1 1;Ni 1"), GREEN);
    assert_eq!(bsdf("illum 4;Kd .2 .5 .2;Tf 1 1 1;d 1;Ni 1.5"), GREEN);
    assert_eq!(bsdf("illum 4;Kd .2 .5 .2"), GREEN);
    let maya = remarked(
        "illum 4;Kd .2 .5 .2;Tf .25 .25 .25;Ni 1.00",
        &["Tf", "opacity"],
    );
    assert!(matches!(maya, Bsdf::Plastic { coat, .. } if coat.opacity == 0.25));
    // By d and an index, whatever the model.
    for model in ["", "illum 1;", "illum 2;Ks .5;", "illum 10;"] {
        assert_eq!(bsdf(&format!("{model}d .5;Ni 1.6")), glass(1.6, [1.0; 3]));
        assert_eq!(bsdf(&format!("{model}Tr .5;Ni 1.6")), glass(1.6, [1.0; 3]));
    }
    let rough = Bsdf::RoughGlass {
        ior: 1.3,
        alpha: 0.25,
        tint: Vec3::new(1.0, 0.5, 0.5),
    };
    assert_eq!(bsdf("d .1;Ni 1.3;Pr .5;Tf 1 .25 .25"), rough);
}

/// `Tf` is of the whole way through a body: half of it, by its exponent, at each boundary.
#[test]
fn filters() {
    assert_eq!(
        bsdf("illum 7;Tf .25 .64 1"),
        Bsdf::Glass {
            ior: 1.5,
            tint: Vec3::new(0.5, 0.8, 1.0)
        }
    );
    assert_eq!(bsdf("illum 7;Tf .5"), glass(1.5, [0.5; 3]));
    // 3ds Max writes d again.
    for clear in [
        "illum 2;d .3;Tr .7;Tf .3 .3 .3;Ni 1.5",
        "illum 7;d .0500;Tf .0500 .0500 .0500;Ni 1.5",
        "illum 7;d 1;Tf 1 1 1",
    ] {
        assert_eq!(bsdf(clear), glass(1.5, [1.0; 3]), "{clear}");
    }
    let not_grey = "d .3;Tf .3 .3 .4;Ni 1.5";
    assert_eq!(bsdf(not_grey), glass(1.5, [0.3, 0.3, 0.4]));
    // McGuire's ball, which is clear in the picture it is made after.
    let ball = "Kd .01;Ks .3;Tf .1 .1 .1;Ns 200;Ni 2.5;illum 7";
    assert_eq!(remarked(ball, &["Tf", "clear"]), glass(2.5, [1.0; 3]));
    assert_eq!(
        remarked("illum 7;d .5;Tf 0 0 0", &["Tf"]),
        glass(1.5, [1.0; 3])
    );
}

/// Without an index, `d` is the opacity of a surface that bends nothing.
#[test]
fn opacities() {
    let opacity = |statements: &str| {
        let coat = coat(statements);
        (coat.opacity, coat.through.x)
    };
    assert_eq!(opacity("Kd .5;d .25"), (0.25, 0.75));
    assert_eq!(opacity("Kd .5;Tr .25"), (0.75, 0.25));
    assert_eq!(opacity("Kd .5;d .25;Ni 1;illum 2"), (0.25, 0.75));
    assert_eq!(opacity("Kd .5;Ks .5;Ns 50;d .25"), (0.25, 0.75));
    assert_eq!(opacity("Kd .5;Ks .3;illum 5;d .5"), (0.5, 0.5));
    assert_eq!(coat("Kd .5;d .25").tint, Vec3::ZERO);
    assert_eq!(coat("Kd .5;Ks .5;Ns 50;d .25").tint, Vec3::ONE);
    assert_eq!(coat("d .5;Tf 1 .5 0").through, Vec3::new(0.5, 0.25, 0.0));
    // What nobody could see is not what its writer meant: MeshLab writes Tr 1 for opaque materials.
    for opaque in ["Tr 1;illum 2;Ns 0;Ks 1", "d 0", "d 0;Tr 1;Ni 1"] {
        let statements = format!("Kd .2 .5 .2;{opaque}");
        assert_eq!(remarked(&statements, &["invisible"]), GREEN, "{opaque}");
    }
    assert_eq!(bsdf("Kd .2 .5 .2;d .9999"), GREEN);
    assert_eq!(bsdf("Kd .2 .5 .2;d 1;Tr 1"), GREEN);
    assert_eq!(bsdf("Kd .2 .5 .2;d 1;Tr 0"), GREEN);
}

#[test]
fn values_outside_of_their_ranges_are_brought_inside() {
    for (statements, words, wanted) in [
        ("Kd .2 .5 .2;Ns -4", "Ns -4 is taken as 0", GREEN),
        ("Kd .2 .5 .2;d 255", "d (1 - Tr) 255 is taken as 1", GREEN),
        ("Kd .2 .5 .2;Tr -3", "d (1 - Tr) 4 is taken as 1", GREEN),
        ("Kd .2 .5 .2;Ke -1 0 0", "Ke", GREEN),
        ("Kd .2 .5 .2;illum 42", "illum 42", GREEN),
        ("illum 7;Ni 0", "Ni 0", glass(1.5, [1.0; 3])),
        ("illum 7;Ni -2", "Ni -2", glass(1.5, [1.0; 3])),
        (
            "illum 7;Ni 150",
            "Ni 150 is taken as 10",
            glass(10.0, [1.0; 3]),
        ),
        ("illum 7;Tf 2 1 -1", "Tf", glass(1.5, [1.0, 1.0, 0.0])),
        (
            "Pm 4;Pr -1;Ks 2",
            "Pr -1 is taken as 0, Pm 4 is taken as 1, Ks",
            mirror(1.0),
        ),
        (
            "Kd 2 .5 -1",
            "Kd",
            Bsdf::Lambert {
                albedo: Vec3::new(1.0, 0.5, 0.0),
            },
        ),
    ] {
        assert_eq!(remarked(statements, &[words]), wanted, "{statements}");
    }
}

/// One message for all that it is about; nothing about what no triangle has.
#[test]
fn remarks_are_made_once() {
    let named = |name: &str, statements: &str| MtlMaterial {
        name: name.to_owned(),
        ..parse(statements)
    };
    let materials = vec![
        named("a", "Kd .5;Tr 1"),
        named("b", "Kd .7;Tr 1"),
        named("c", "Kd .2;Tr 1;Ns -7"),
        named("unused", "Kd .2;Tr 1;Ns -7"),
    ];
    let file = ObjFile {
        positions: vec![Vec3::ZERO, Vec3::X, Vec3::Y],
        triangles: vec![[0, 1, 2]; 3],
        material_of: vec![0, 1, 2],
        materials,
        ..Default::default()
    };
    let settings = SceneSettings {
        size: (4, 4),
        environment: Vec3::ONE.into(),
        roughness_threshold: 0.01,
        ..Default::default()
    };
    let mut warnings = Warnings::new(false);
    Scene::build(Path::new("x.obj"), file, &settings, &mut warnings).unwrap();
    let [invisible, range] = warnings.list() else {
        panic!("{:?}", warnings.list());
    };
    assert!(
        invisible.starts_with("x.obj: materials 'a', 'b', 'c': d 0 "),
        "{invisible}"
    );
    assert!(
        range.starts_with("x.obj: material 'c': outside of its range, Ns -7 "),
        "{range}"
    );
}

/// Polygons of a shape, each with a material.
type Polygons = Vec<(Vec<Vec3>, u32)>;

fn quad(z: f32, material: u32) -> Polygons {
    let corners = [(-1.0, -1.0), (1.0, -1.0), (1.0, 1.0), (-1.0, 1.0)];
    let corners = corners.map(|(x, y)| Vec3::new(x, y, z)).to_vec();
    vec![(corners, material)]
}

/// The faces of a cube of side 2 around `centre`.
fn cube(centre: Vec3, material: u32) -> Polygons {
    let mut faces = Polygons::new();
    for axis in 0..3 {
        for side in [-1.0, 1.0] {
            let corners = [(-side, -1.0), (side, -1.0), (side, 1.0), (-side, 1.0)];
            let corners = corners.map(|(a, b)| {
                let mut p = [side; 3];
                (p[(axis + 1) % 3], p[(axis + 2) % 3]) = (a, b);
                centre + Vec3::from(p)
            });
            faces.push((corners.to_vec(), material));
        }
    }
    faces
}

/// A surface of revolution about z by radius and height from bottom to top; radius 0 is a point.
fn turned(profile: &[(f32, f32)], steps: usize) -> Polygons {
    let at = |(r, z): (f32, f32), i: usize| {
        let (sin, cos) = (std::f32::consts::TAU * (i % steps) as f32 / steps as f32).sin_cos();
        Vec3::new(r * cos, r * sin, z)
    };
    let mut faces = Polygons::new();
    for ring in profile.windows(2) {
        for i in 0..steps {
            let mut face = vec![
                at(ring[0], i),
                at(ring[0], i + 1),
                at(ring[1], i + 1),
                at(ring[1], i),
            ];
            face.dedup();
            if face.first() == face.last() {
                face.pop();
            }
            faces.push((face, 0));
        }
    }
    faces
}

fn ball() -> Polygons {
    let ring = |i: i32| {
        let (sin, cos) = (std::f32::consts::PI * i as f32 / 8.0).sin_cos();
        (if i % 8 == 0 { 0.0 } else { sin }, -cos)
    };
    let profile: Vec<_> = (0..=8).map(ring).collect();
    turned(&profile, 16)
}

/// Every polygon with corners of its own, as many programs write them.
fn build(polygons: &Polygons, materials: Vec<MtlMaterial>) -> Scene {
    let mut file = ObjFile {
        materials,
        ..Default::default()
    };
    for (corners, material) in polygons {
        let first = file.positions.len() as u32;
        file.positions.extend(corners);
        for i in 1..corners.len() as u32 - 1 {
            file.triangles.push([first, first + i, first + i + 1]);
            file.material_of.push(*material);
        }
    }
    let settings = SceneSettings {
        camera: CameraTable {
            origin: Some([0.0, 0.0, 6.0]),
            target: Some([0.0; 3]),
            fov: Some(15.0),
            ..Default::default()
        },
        size: (8, 8),
        environment: Vec3::ONE.into(),
        roughness_threshold: 0.01,
        ..Default::default()
    };
    let mut warnings = Warnings::new(true);
    Scene::build(Path::new("test.obj"), file, &settings, &mut warnings).unwrap()
}

/// Of each polygon whether it is thin.
fn thin(polygons: &Polygons) -> Vec<bool> {
    let kinds = vec![parse("illum 7"), parse("illum 7;Pr .5"), lambert(0.5)];
    let scene = build(polygons, kinds);
    let mut triangles = scene.mesh.material_of.iter();
    let mut is_thin = || {
        let material = &scene.materials[*triangles.next().unwrap() as usize];
        assert_eq!(material.parameters, material.bsdf.parameters());
        matches!(material.bsdf, Bsdf::Thin { .. } | Bsdf::RoughThin { .. })
    };
    let mut of_polygon = |(corners, _): &(Vec<Vec3>, u32)| {
        let all: Vec<bool> = (2..corners.len()).map(|_| is_thin()).collect();
        assert!(all.iter().all(|thin| *thin == all[0]));
        all[0]
    };
    polygons.iter().map(&mut of_polygon).collect()
}

fn backwards(polygons: &Polygons) -> Polygons {
    let back = |(corners, m): &(Vec<Vec3>, u32)| (corners.iter().rev().copied().collect(), *m);
    polygons.iter().map(back).collect()
}

#[test]
fn open_sheets_are_thin_and_bodies_are_not() {
    let all = |shape: &Polygons, is_thin: bool, what: &str| {
        assert_eq!(thin(shape), vec![is_thin; shape.len()], "{what}");
    };
    let joined = |parts: &[Polygons]| -> Polygons { parts.concat() };

    // Sheets.
    all(&quad(0.0, 0), true, "a pane");
    all(&quad(0.0, 1), true, "a frosted pane");
    let both = joined(&[quad(0.0, 0), backwards(&quad(0.0, 0))]);
    all(&both, true, "a pane with a back");
    let (mut other, front) = (backwards(&quad(0.0, 0)), quad(0.0, 0));
    other[0].0.rotate_left(1);
    all(
        &joined(&[front, other]),
        true,
        "a back with the other diagonal",
    );
    let shift = |p: &Polygons, by: Vec3| -> Polygons {
        let moved = |(c, m): &(Vec<Vec3>, u32)| (c.iter().map(|&p| p + by).collect(), *m);
        p.iter().map(moved).collect()
    };
    let beside = shift(&quad(0.0, 0), Vec3::X * 2.0);
    all(
        &joined(&[quad(0.0, 0), backwards(&beside)]),
        true,
        "two windings side by side",
    );
    all(
        &joined(&[quad(0.0, 0), beside]),
        true,
        "two panes side by side",
    );
    let goblet = [(0.0, 0.0), (0.6, 0.2), (1.0, 1.0), (0.9, 2.0)];
    all(&turned(&goblet, 24), true, "a goblet without thickness");
    all(
        &turned(&[(0.0, 0.0), (0.1, 0.0), (0.1, 2.0)], 24),
        true,
        "a flute",
    );
    all(&turned(&[(1.0, 0.0), (1.0, 3.0)], 24), true, "a tube");
    let mut open = cube(Vec3::ZERO, 0);
    open.remove(2);
    all(&open, true, "a box without a lid");

    // Bodies.
    all(&cube(Vec3::ZERO, 0), false, "a cube");
    all(&cube(Vec3::ZERO, 1), false, "a frosted cube");
    all(&backwards(&cube(Vec3::ZERO, 0)), false, "a cube inside out");
    all(
        &joined(&[cube(Vec3::ZERO, 0), backwards(&cube(Vec3::ZERO, 0))]),
        false,
        "a cube with backs",
    );
    let mut twisted = cube(Vec3::ZERO, 0);
    for face in twisted.iter_mut().step_by(2) {
        face.0.reverse();
    }
    all(&twisted, false, "a cube of both windings");
    let mut two = cube(Vec3::ZERO, 0);
    two[0].1 = 1;
    all(&two, false, "a cube of two kinds of glass");
    all(&ball(), false, "a ball");
    let mut cracked = ball();
    cracked.remove(40);
    all(&cracked, false, "a ball without one of its 128 faces");
    let wall = [
        (0.0, 0.0),
        (1.0, 0.0),
        (1.0, 2.0),
        (0.9, 2.0),
        (0.9, 0.1),
        (0.0, 0.1),
    ];
    all(&turned(&wall, 24), false, "a tumbler with a thickness");
    // The top in four, so that its outer edges meet longer ones.
    let mut patched = cube(Vec3::ZERO, 0);
    let top = patched
        .iter()
        .position(|(c, _)| c.iter().all(|p| p.z == 1.0))
        .unwrap();
    patched.remove(top);
    for (x, y) in [(-0.5, -0.5), (0.5, -0.5), (0.5, 0.5), (-0.5, 0.5)] {
        let corners = [(-0.5, -0.5), (0.5, -0.5), (0.5, 0.5), (-0.5, 0.5)];
        let corners = corners.map(|(a, b)| Vec3::new(x + a, y + b, 1.0));
        patched.push((corners.to_vec(), 0));
    }
    all(&patched, false, "a cube whose top has edges of its own");

    // Others beside them do not count.
    let window = joined(&[quad(0.0, 0), shift(&quad(0.0, 2), Vec3::X * 2.0)]);
    assert_eq!(thin(&window), [true, false]);
    let touching = joined(&[
        cube(Vec3::ZERO, 0),
        shift(&quad(1.0, 0), Vec3::new(2.0, 2.0, 0.0)),
    ]);
    assert_eq!(thin(&touching), [vec![false; 6], vec![true]].concat());
}

/// One material on a pane and on a body becomes two of one name.
#[test]
fn a_material_of_both_kinds_becomes_two() {
    let shapes = [cube(Vec3::ZERO, 0), quad(3.0, 0), quad(-3.0, 1)].concat();
    let scene = build(&shapes, vec![parse("illum 7;Tf .25"), lambert(0.2)]);
    let names: Vec<&str> = scene.materials.iter().map(|m| m.name.as_str()).collect();
    assert_eq!(names, ["m", "", "m"]);
    assert_eq!(scene.materials[0].bsdf, glass(1.5, [0.25; 3]));
    let tint = Vec3::splat(0.25);
    assert_eq!(scene.materials[2].bsdf, Bsdf::Thin { ior: 1.5, tint });
    assert_eq!(scene.materials[2].class, Class::Specular);
}

/// On planes metal and glass are specular up to twice the threshold, which is 0.01 here; not
/// on what is curved, or made of many facets.
#[test]
fn planes_are_specular_up_to_twice_the_threshold() {
    let class = |shape: &Polygons, statements: &str| {
        let scene = build(shape, vec![parse(statements), lambert(0.2)]);
        scene.materials[0].class
    };
    let cube = cube(Vec3::ZERO, 0);
    let with_floor = [cube.clone(), quad(-3.0, 1)].concat();
    for shape in [&quad(0.0, 0), &cube, &with_floor] {
        assert_eq!(class(shape, "Pm 1;Ks .9;Pr .14"), Class::Specular);
        assert_eq!(class(shape, "Pm 1;Ks .9;Pr .15"), Class::Rough);
    }
    for (statements, of_cube) in [
        ("illum 7;Ni 1.5;Pr .09", Class::Specular),
        ("illum 7;Ni 1.5;Pr .11", Class::Rough),
        ("Kd .5;Ks .5;Pr .1", Class::Rough),
        ("Pm 1;Ks .9;Pr .14;Ke 1", Class::Rough),
    ] {
        assert_eq!(class(&cube, statements), of_cube, "{statements}");
    }
    assert_eq!(class(&ball(), "Pm 1;Ks .9;Pr .099"), Class::Specular);
    assert_eq!(class(&ball(), "Pm 1;Ks .9;Pr .14"), Class::Rough);
    let tiles: Polygons = (0..40).flat_map(|n| quad(0.1 * n as f32, 0)).collect();
    assert_eq!(class(&tiles, "Pm 1;Ks .9;Pr .14"), Class::Rough);
}

/// Every pixel of a shape that fills the picture, under light of 1 from everywhere.
fn seen(shape: &Polygons, statements: &str, method: Method) -> Vec<Vec3> {
    let scene = build(shape, vec![parse(statements), lambert(0.5)]);
    let render = Render {
        method,
        spp: 64,
        depth: 40,
        ..Render::default()
    };
    let image = render.estimate(&scene, &*tracer(&scene)).primal;
    let pixels = 0..image.width * image.height;
    let at = |i: usize| Vec3::from([0, 1, 2].map(|c| image.channels[c][i]));
    pixels.map(at).collect()
}

/// In light of 1 from everywhere a pane without a tint is invisible, and so is a white surface of any opacity; a
/// tint shows once, through a pane as through a body.
#[test]
fn panes_in_a_furnace() {
    let pane = quad(0.0, 0);
    let tint = Vec3::new(0.25, 0.64, 1.0);
    for (shape, statements, wanted, tolerance) in [
        (&pane, "illum 7;Ni 1.5", Vec3::ONE, 1e-5),
        (&pane, "illum 7;Ni 0.7", Vec3::ONE, 1e-5),
        (&pane, "Kd 1;d .3", Vec3::ONE, 1e-5),
        (&pane, "Kd 0;d .3", Vec3::splat(0.7), 1e-5),
        (
            &pane,
            "Kd .5;d .5;Tf 1 .5 0",
            Vec3::new(0.75, 0.5, 0.25),
            0.02,
        ),
        (&pane, "illum 7;Ni 1;Tf .25 .64 1", tint, 1e-5),
        (
            &cube(Vec3::ZERO, 0),
            "illum 7;Ni 1;Tf .25 .64 1",
            tint,
            1e-5,
        ),
        // Frosted glass loses what leaves between its facets.
        (&pane, "illum 7;Ni 1.5;Pr .2", Vec3::ONE, 0.05),
    ] {
        for method in [Method::Pt, Method::Gpt] {
            for pixel in seen(shape, statements, method) {
                assert!(
                    (pixel - wanted).abs().max_element() < tolerance,
                    "{statements} {method:?}: {pixel} instead of {wanted}"
                );
            }
        }
    }
}

/// The Vulkan tutorial's room: `usemtl` names a material that is defined before any face, and before the
/// faces another, which is not.
#[test]
fn a_name_that_is_not_defined_means_the_one_that_nothing_uses() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("room.obj");
    let faces = "v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n";
    let text = format!("mtllib room.mtl\nusemtl room\no room\nusemtl Texture1\n{faces}");
    std::fs::write(&path, text).unwrap();
    std::fs::write(folder.path().join("room.mtl"), "newmtl room\nKd .2 .5 .2\n").unwrap();
    let mut warnings = Warnings::new(false);
    let file = gdpt::load::obj::load(&path, &mut warnings).unwrap();
    let material = &file.materials[file.material_of[0] as usize];
    assert_eq!(material.kd, Some([0.2, 0.5, 0.2]));
    let [warning] = warnings.list() else {
        panic!("{:?}", warnings.list());
    };
    for word in ["room.obj:4: ", "'Texture1'", "'room'"] {
        assert!(warning.contains(word), "{warning}");
    }
}

/// A scene of three materials, one of which the MTL does not define, with a TOML.
fn repaired(toml: &str) -> Result<(Vec<MtlMaterial>, usize), String> {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("a.obj");
    let text = "mtllib lib/a.mtl\nv 0 0 0\nv 1 0 0\nv 0 1 0\nusemtl wall\nf 1 2 3\nusemtl roof tile\nf 1 3 2\n\
                usemtl door\nf 1 2 3\n";
    let mtl = "newmtl wall\nKd .1 .2 .3\nNs 7\nd .5\nmap_Kd wall.png\nmap_d wall.png\nnewmtl roof tile\nKs .4\n\
               newmtl spare\nnewmtl other\n";
    std::fs::create_dir(folder.path().join("lib")).unwrap();
    let picture = image::RgbImage::from_pixel(2, 2, image::Rgb([255, 0, 0]));
    picture.save(folder.path().join("lib/wall.png")).unwrap();
    picture.save(folder.path().join("brick.png")).unwrap();
    for (name, text) in [("a.obj", text), ("lib/a.mtl", mtl), ("a.toml", toml)] {
        std::fs::write(folder.path().join(name), text).unwrap();
    }
    let mut warnings = Warnings::new(false);
    let options = gdpt::load::obj::Options {
        textures: None,
        repairs: gdpt::load::sidecar::load(&path)
            .map_err(|e| e.to_string())?
            .repairs,
        ..Default::default()
    };
    let file = gdpt::load::obj::load_with(&path, &options, &mut warnings);
    let file = file.map_err(|e| e.to_string())?;
    let of_face = |t: usize| file.materials[file.material_of[t] as usize].clone();
    Ok(((0..3).map(of_face).collect(), warnings.list().len()))
}

/// `[materials.NAME]` wins over the MTL key by key.
#[test]
fn tables_of_materials_win_over_the_library() {
    let (before, warnings) = repaired("").unwrap();
    assert_eq!(
        (before[0].kd, before[0].maps.len(), warnings),
        (Some([0.1, 0.2, 0.3]), 2, 1)
    );
    let toml = "[materials.wall]\nKd = [0.8, 0.2, 0]\nillum = 7\nTr = 0.25\n\
                [materials.\"roof tile\"]\nmap_Kd = \"brick.png\"\nks = 1\nNi = 1.3\n\
                [materials.door]\nKe = 3\n[materials.spare]\nPm = 1\n";
    let (after, warnings) = repaired(toml).unwrap();
    // Also the undefined one is defined.
    assert_eq!(warnings, 0);
    let [wall, roof, door] = &after[..] else {
        panic!("{after:?}")
    };
    let wanted = MtlMaterial {
        name: "wall".into(),
        kd: Some([0.8, 0.2, 0.0]),
        ns: Some(7.0),
        opacity: Some(0.75),
        illum: Some(7),
        // Textures would take the place of what the TOML says.
        ..Default::default()
    };
    assert_eq!(*wall, wanted);
    assert_eq!(
        (roof.ks, roof.ni, roof.kd),
        (Some([1.0; 3]), Some(1.3), None)
    );
    assert!(roof.maps[0].bitmap.is_some() && roof.maps[0].key == "map_kd");
    assert_eq!((door.ke, door.name.as_str()), (Some([3.0; 3]), "door"));
    // A texture from the TOML's folder takes the other's place; "" is none.
    let (after, _) = repaired("[materials.wall]\nmap_Kd = \"brick.png\"\nmap_d = \"\"\n").unwrap();
    let files: Vec<&str> = after[0].maps.iter().map(|m| m.file.as_str()).collect();
    assert_eq!(files.last(), Some(&"brick.png"));
    assert!(after[0].map("map_d").is_none() && after[0].kd == Some([0.1, 0.2, 0.3]));
    assert!(after[0].map("map_kd").unwrap().bitmap.is_some());
}

#[test]
fn tables_of_materials_say_what_is_wrong() {
    for (table, words) in [
        (
            "wal]\nKd = 1",
            vec![
                "[materials.wal]",
                "'door'",
                "'roof tile'",
                "'spare'",
                "'wall'",
            ],
        ),
        (
            "wall]\ncolour = 1",
            vec!["[materials.wall]", "'colour'", "Kd", "illum", "map_"],
        ),
        ("wall]\nKd = [1, 2]", vec!["Kd needs", "[1, 2]"]),
        ("wall]\nKd = \"red\"", vec!["Kd needs"]),
        ("wall]\nNs = [1, 2, 3]", vec!["Ns needs a number"]),
        ("wall]\nNs = nan", vec!["Ns needs a number"]),
        ("wall]\nillum = 7.5", vec!["illum needs a whole number"]),
        ("wall]\nillum = 11", vec!["illum needs a whole number"]),
        ("wall]\nmap_Kd = 3", vec!["needs a file"]),
        ("wall]\nnewmtl = \"x\"", vec!["'newmtl'"]),
    ] {
        let error = repaired(&format!("[materials.{table}\n")).unwrap_err();
        assert!(error.contains("a.toml"), "{error}");
        for word in words {
            assert!(error.contains(word), "{table}: {error}");
        }
    }
}
