//! OBJ files as other programs write them, read as they are meant.

use gdpt::error::Warnings;
use gdpt::load::obj::{self, NONE, ObjFile};
use gdpt::scene::{Scene, SceneSettings};
use glam::Vec3;
use std::io::Write;
use tempfile::TempDir;

/// The file of these bytes, and its warnings.
fn read_as(name: &str, bytes: &[u8]) -> (ObjFile, Vec<String>) {
    let folder = TempDir::new().unwrap();
    let path = folder.path().join(name);
    std::fs::write(&path, bytes).unwrap();
    let mut warnings = Warnings::new(false);
    let file = obj::load(&path, &mut warnings).unwrap();
    (file, warnings.list().to_vec())
}

fn read(text: &str) -> (ObjFile, Vec<String>) {
    read_as("scene.obj", text.as_bytes())
}

fn area(file: &ObjFile) -> f32 {
    let area = |t: &[u32; 3]| {
        let [a, b, c] = t.map(|i| file.positions[i as usize]);
        0.5 * (b - a).cross(c - a).length()
    };
    file.triangles.iter().map(area).sum()
}

const SQUARE: &str = "v -1 -1 0\nv 1 -1 0\nv 1 1 0\nv -1 1 0\n";

#[test]
fn polygons_keep_their_shape() {
    let u = "v -1 -1 0\nv 1 -1 0\nv 1 1 0\nv 0.6 1 0\nv 0.6 -0.6 0\nv -0.6 -0.6 0\nv -0.6 1 0\nv -1 1 0\n";
    let arrow = "v -1 -1 0\nv 0 -0.4 0\nv 1 -1 0\nv 0 1 0\n";
    let hole = "v -0.5 -0.5 0\nv -0.5 0.5 0\nv 0.5 0.5 0\nv 0.5 -0.5 0\n";
    for (text, want) in [
        (format!("{u}f 1 2 3 4 5 6 7 8\n"), 2.08),
        (format!("{u}f 8 7 6 5 4 3 2 1\nf 1 2 3\n"), 2.08 + 2.0),
        (format!("{arrow}f 1 2 3 4\n"), 1.4),
        (format!("{arrow}vn 0 0 1\nf 2//1 3//1 4//1 1//1\n"), 1.4),
        (format!("{SQUARE}{hole}f 1 2 3 4 1 5 6 7 8 5\n"), 3.0),
    ] {
        let (file, warnings) = read(&text);
        assert!((area(&file) - want).abs() < 1e-5, "{text}: {}", area(&file));
        assert!(warnings.is_empty(), "{warnings:?}");
    }
}

#[test]
fn every_packing_and_encoding_is_read() {
    let text = format!("{SQUARE}f 1 2 3 4\n");
    let mut packed = flate2::write::GzEncoder::new(Vec::new(), Default::default());
    packed.write_all(text.as_bytes()).unwrap();
    let units = std::iter::once(0xfeff).chain(text.encode_utf16());
    let utf16: Vec<u8> = units.flat_map(u16::to_be_bytes).collect();
    for (name, bytes) in [
        ("a.obj.gz", packed.finish().unwrap()),
        ("a.obj", text.replace('\n', "\r").into_bytes()),
        ("a.obj", text.replace('\n', "\r\n").into_bytes()),
        ("a.obj", utf16),
    ] {
        assert_eq!(read_as(name, &bytes).0.triangles.len(), 2);
    }
}

#[test]
fn what_is_not_there_is_left_out() {
    // Normals and texture coordinates that are not there, or are no numbers.
    let (file, warnings) = read(&format!("{SQUARE}f 1//1 2//2 3//3 4//4\n"));
    assert!(file.normal_triangles.is_empty());
    assert_eq!(warnings.len(), 1);
    let (file, warnings) = read(&format!(
        "{SQUARE}vt 0\nvt -nan(ind) 0\nf 1/1 2/1 3/2 4/1\nusemtl\n"
    ));
    assert_eq!(file.triangles.len(), 2);
    assert_eq!(warnings.len(), 1);
    // A corner that is no number takes its face with it, and no other.
    let (file, warnings) = read(&format!("{SQUARE}v 1 -1.#IND 0\nf 1 2 5\nf 1 2 3 4\n"));
    assert_eq!(file.triangles.len(), 2);
    assert!(warnings[0].contains("1 vertices") && warnings[0].contains("1 faces"));
    // Faces before the vertices that they name.
    let (file, warnings) = read(&format!("f 1//1 2//1 3//1\n{SQUARE}vn 0 0 1\nf 1 2 4\n"));
    assert_eq!(file.triangles.len(), 2);
    assert!(warnings.is_empty(), "{warnings:?}");
    let flat = |n: &&[u32; 3]| **n == [NONE; 3];
    assert_eq!(file.normal_triangles.iter().filter(flat).count(), 1);
}

#[test]
fn smoothing_groups_and_colours_come_with_the_faces() {
    let (file, _) = read(&format!("{SQUARE}f 1 2 3\ns 2\nf 1 3 4\ns off\nf 2 3 4\n"));
    assert_eq!(file.smoothing_of, [0, 2, 0]);
    let (file, _) = read("v 0 0 0\nv 1 0 0 1 0.5 0\nv 0 1 0 0 0 1 1\nf 1 2 3\n");
    assert!(file.colours[0].is_nan());
    assert_eq!(file.colours[1..], [Vec3::new(1.0, 0.5, 0.0), Vec3::Z]);
}

#[test]
fn lamps_shine_on_the_side_of_their_normals() {
    let folder = TempDir::new().unwrap();
    let path = folder.path().join("lamp.obj");
    std::fs::write(folder.path().join("lamp.mtl"), "newmtl lamp\nKe 5 5 5\n").unwrap();
    let normals = "vn 0 0 1\nvn 0 0 -1\n";
    for (faces, up) in [
        ("f 1 2 3 4\n", true),
        ("f 4 3 2 1\n", false),
        // Mirrored: the normals know.
        ("f 4//1 3//1 2//1 1//1\n", true),
        ("f 1//2 2//2 3//2 4//2\n", false),
        // Normals that contradict one another do not.
        ("f 1//1 2//2 3//2\n", true),
    ] {
        std::fs::write(
            &path,
            format!("mtllib lamp.mtl\nusemtl lamp\n{SQUARE}{normals}{faces}"),
        )
        .unwrap();
        let mut warnings = Warnings::new(false);
        let file = obj::load(&path, &mut warnings).unwrap();
        let settings = SceneSettings {
            size: (4, 4),
            roughness_threshold: 0.01,
            ..Default::default()
        };
        let scene = Scene::build(&path, file, &settings, &mut warnings).unwrap();
        for triangle in 0..scene.mesh.triangles.len() as u32 {
            let [a, b, c] = scene.mesh.corners(triangle);
            assert_eq!((b - a).cross(c - a).z > 0.0, up, "{faces}");
        }
    }
}
