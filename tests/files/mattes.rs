//! `--cryptomatte`: the layers of an .exr tell which objects and materials each pixel shows, and how much of it.

use assert_cmd::cargo::cargo_bin;
use gdpt::load::exr;
use std::collections::BTreeMap;
use std::fs;
use std::path::{Path, PathBuf};
use std::process::Command;

/// Two squares side by side, which meet at x = 0.1: objects with groups in them, and a material each.
const OBJ: &str = "mtllib a.mtl
v -1 -1 0\nv 0.1 -1 0\nv 1 -1 0\nv 1 1 0\nv 0.1 1 0\nv -1 1 0
o left one\ng part\nusemtl red\nf 1 2 5 6
o right\nusemtl grün\nf 2 3 4 5
";
const MTL: &str = "newmtl red\nKd 0.8 0.1 0.1\nnewmtl grün\nKd 0.1 0.8 0.1\n";
const TOML: &str = "[camera]
origin = [0, 0, 4]
target = [0, 0, 0]
fov = 45
[environment]
radiance = [1, 1, 1]
";

fn written(obj: &str) -> tempfile::TempDir {
    let folder = tempfile::tempdir().unwrap();
    for (name, text) in [("a.obj", obj), ("a.mtl", MTL), ("a.toml", TOML)] {
        fs::write(folder.path().join(name), text).unwrap();
    }
    folder
}

fn render(folder: &Path, flags: &str) -> PathBuf {
    let out = folder.join("out.exr");
    let status = Command::new(cargo_bin!("gdpt"))
        .args(["render", "--quiet", "--cryptomatte", "--size", "20x20"])
        .args(flags.split_whitespace())
        .arg(folder.join("a.obj"))
        .arg("-o")
        .arg(&out)
        .status();
    assert!(status.unwrap().success());
    out
}

/// What each pixel shows of a layer, by the names of the manifest.
fn shares(path: &Path, layer: &str) -> Vec<BTreeMap<String, f32>> {
    let file = exr::load(path).unwrap();
    // The key of the header's texts that has the layer's name.
    let mut of_layer = file.texts.iter().filter(|(_, text)| **text == layer);
    let key = of_layer.next().unwrap().0.strip_suffix("/name").unwrap();
    assert_eq!(key.len(), "cryptomatte/1234567".len());
    let of_key = |name: &str| &file.texts[&format!("{key}/{name}")];
    assert_eq!(of_key("hash"), "MurmurHash3_32");
    assert_eq!(of_key("conversion"), "uint32_to_float32");
    let manifest: BTreeMap<String, String> = serde_json::from_str(of_key("manifest")).unwrap();
    let names: BTreeMap<u32, &String> = manifest
        .iter()
        .map(|(name, id)| (u32::from_str_radix(id, 16).unwrap(), name))
        .collect();
    let mut pixels = vec![BTreeMap::new(); file.size.0 * file.size.1];
    for rank in ["00", "01", "02"] {
        for [id, share] in [["R", "G"], ["B", "A"]] {
            let of = |c: &str| file.channels[&format!("{layer}{rank}.{c}")].iter();
            for ((pixel, id), &share) in pixels.iter_mut().zip(of(id)).zip(of(share)) {
                if share > 0.0 {
                    let name = names[&id.to_bits()].clone();
                    assert!(pixel.insert(name, share).is_none());
                } else {
                    assert_eq!(*id, 0.0);
                }
            }
        }
    }
    pixels
}

/// The share of a pixel in which `name` is.
fn of(pixel: &BTreeMap<String, f32>, name: &str) -> f32 {
    pixel.get(name).copied().unwrap_or(0.0)
}

fn coverage(path: &Path) -> Vec<f32> {
    exr::load(path).unwrap().channels["coverage.A"].clone()
}

#[test]
fn pixels_tell_objects_and_materials_by_area() {
    let folder = written(OBJ);
    let path = render(folder.path(), "--spp 256");
    let objects = shares(&path, "CryptoObject");
    let materials = shares(&path, "CryptoMaterial");
    let coverage = coverage(&path);
    // Half of the picture at the plane of the squares, and what a pixel is wide there.
    let half = 4.0 * 22.5f32.to_radians().tan();
    let width = 2.0 * half / 20.0;
    for (i, (objects, materials)) in objects.iter().zip(&materials).enumerate() {
        let (low, high) = (
            |k: usize| k as f32 * width - half,
            |k: usize| (k + 1) as f32 * width - half,
        );
        let (x, y) = (i % 20, i / 20);
        let part =
            |from: f32, to: f32, k: usize| ((high(k).min(to) - low(k).max(from)) / width).max(0.0);
        let down = part(-1.0, 1.0, y);
        for (object, material, from, to) in
            [("left one", "red", -1.0, 0.1), ("right", "grün", 0.1, 1.0)]
        {
            let expected = part(from, to, x) * down;
            // 64 points of a Sobol sequence.
            assert!(
                (of(objects, object) - expected).abs() < 0.04,
                "{i}: {objects:?} {expected}"
            );
            assert_eq!(of(objects, object), of(materials, material));
        }
        let all: f32 = objects.values().sum();
        assert!((all - coverage[i]).abs() < 0.04, "{all} {}", coverage[i]);
    }
}

/// Crops, lenses and filters: the shares are those of the same rays.
#[test]
fn mattes_are_of_the_rays_of_the_picture() {
    let folder = written(OBJ);
    let flags = "--spp 16 --aperture 0.5 --focus 3 --filter gaussian";
    let whole = shares(&render(folder.path(), flags), "CryptoObject");
    let crop = shares(
        &render(folder.path(), &format!("{flags} --crop 5,3,12,9")),
        "CryptoObject",
    );
    for (i, pixel) in crop.iter().enumerate() {
        assert_eq!(*pixel, whole[(3 + i / 7) * 20 + 5 + i % 7]);
    }
    let path = render(folder.path(), flags);
    for (pixel, coverage) in whole.iter().zip(coverage(&path)) {
        let all: f32 = pixel.values().sum();
        assert!((all - coverage).abs() < 1e-5, "{all} {coverage}");
    }
}

/// Without `o` the groups are objects; faces that name what comes later belong to where they stand.
#[test]
fn groups_are_objects_where_there_are_none() {
    let obj = "mtllib a.mtl\ng early\nusemtl red\nf 1 2 5 6\nv -1 -1 0\nv 0.1 -1 0\nv 1 -1 0\nv 1 1 0\nv 0.1 1 0\nv -1 1 0
g\nusemtl grün\nf 2 3 4 5\n";
    let folder = written(obj);
    let pixels = shares(&render(folder.path(), "--spp 4"), "CryptoObject");
    assert_eq!(
        pixels[10 * 20 + 8],
        BTreeMap::from([("early".to_owned(), 1.0)])
    );
    assert_eq!(
        pixels[10 * 20 + 13],
        BTreeMap::from([("default".to_owned(), 1.0)])
    );
}

#[test]
fn mattes_need_an_exr() {
    let folder = written(OBJ);
    for output in ["a.png", "a.gdpt"] {
        let output = Command::new(cargo_bin!("gdpt"))
            .args(["render", "--cryptomatte", "-o", output, "a.obj"])
            .current_dir(folder.path())
            .output()
            .unwrap();
        assert!(!output.status.success());
        let text = String::from_utf8(output.stderr).unwrap();
        assert!(text.contains("--cryptomatte"), "{text}");
    }
}
