//! What the loader makes of well-formed files.

use gdpt::error::Warnings;
use gdpt::load::obj;
use std::fmt::Write;
use tempfile::TempDir;

/// More faces than the parser is given at once, with a group of the file's own, and a change from flat to
/// smooth in between: every triangle comes out, in order, with its own corners and normals.
#[test]
fn many_faces_come_out_in_order() {
    const SIDE: usize = 260;
    let mut text = String::new();
    for y in 0..=SIDE {
        for x in 0..=SIDE {
            writeln!(text, "v {x} {y} 0").unwrap();
        }
    }
    text += "vn 0 0 1\ng mine\n";
    let corner = |x: usize, y: usize| y * (SIDE + 1) + x + 1;
    for y in 0..SIDE {
        for x in 0..SIDE {
            let [a, b, c] = [corner(x, y), corner(x + 1, y), corner(x + 1, y + 1)];
            if y < 100 {
                writeln!(text, "f {a} {b} {c}").unwrap();
            } else {
                writeln!(text, "f {a}//1 {b}//1 {c}//1").unwrap();
            }
        }
    }
    let folder = TempDir::new().unwrap();
    let path = folder.path().join("many.obj");
    std::fs::write(&path, text).unwrap();

    let file = obj::load(&path, &mut Warnings::new(true)).unwrap();
    assert_eq!(file.triangles.len(), SIDE * SIDE);
    assert_eq!(file.normal_triangles.len(), SIDE * SIDE);
    for (i, triangle) in file.triangles.iter().enumerate() {
        let (x, y) = ((i % SIDE) as f32, (i / SIDE) as f32);
        let corners = triangle.map(|c| file.positions[c as usize].to_array());
        let want = [[x, y, 0.0], [x + 1.0, y, 0.0], [x + 1.0, y + 1.0, 0.0]];
        assert_eq!(corners, want, "triangle {i}");
        let smooth = file.normal_triangles[i] != [obj::NONE; 3];
        assert_eq!(smooth, y >= 100.0, "triangle {i}");
    }
}
