//! Reading an OBJ file of a million triangles, against tobj alone: what is done around the parser (groups,
//! materials, texture coordinates, tidying, triangles without area) shall not cost more than reading ahead saves.

use criterion::{Criterion, criterion_group, criterion_main};
use gdpt::error::Warnings;
use gdpt::load::obj;
use std::fmt::Write;
use std::hint::black_box;
use std::path::Path;

/// Vertices along each side of a sheet.
const SIDE: usize = 708;

/// A bumpy sheet with normals and texture coordinates, in squares of two triangles each.
fn write_sheet(path: &Path) {
    let mut text = String::from("o sheet\n");
    let height = |x: usize, y: usize| (0.1 * x as f64).sin() * (0.07 * y as f64).cos();
    for y in 0..SIDE {
        for x in 0..SIDE {
            let (u, v) = (x as f64 / SIDE as f64, y as f64 / SIDE as f64);
            let _ = write!(
                text,
                "v {u:.6} {:.6} {v:.6}\nvt {u:.5} {v:.5}\nvn {:.4} 1.0000 {:.4}\n",
                0.01 * height(x, y),
                0.1 * height(y, x),
                0.1 * height(x, x)
            );
        }
    }
    for y in 0..SIDE - 1 {
        for x in 0..SIDE - 1 {
            let (a, b) = (y * SIDE + x + 1, (y + 1) * SIDE + x + 1);
            let _ = writeln!(text, "f {a}/{a}/{a} {b}/{b}/{b} {0}/{0}/{0}", b + 1);
            let _ = writeln!(text, "f {a}/{a}/{a} {0}/{0}/{0} {1}/{1}/{1}", b + 1, a + 1);
        }
    }
    std::fs::write(path, text).expect("a temporary file");
}

fn load(c: &mut Criterion) {
    let folder = tempfile::tempdir().expect("a temporary folder");
    let path = folder.path().join("sheet.obj");
    write_sheet(&path);
    let mut group = c.benchmark_group("load");
    group.sample_size(10);
    group.bench_function("tobj alone", |b| {
        let options = tobj::LoadOptions {
            triangulate: true,
            ..Default::default()
        };
        b.iter(|| black_box(tobj::load_obj(&path, &options).expect("it can be read")));
    });
    group.bench_function("gdpt", |b| {
        b.iter(|| black_box(obj::load(&path, &mut Warnings::new(false)).expect("it can be read")));
    });
    group.finish();
}

criterion_group!(benches, load);
criterion_main!(benches);
