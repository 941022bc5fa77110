//! `gdpt reconstruct` and `gdpt render --error` from the shell.

use assert_cmd::Command;
use exr::prelude::*;
use std::collections::BTreeMap;
use std::path::Path;
use tempfile::TempDir;

/// Runs the program; its standard output, or what it says of the error.
fn gdpt(folder: &Path, line: &str) -> std::result::Result<String, String> {
    let line = line.replace("DIR", folder.to_str().unwrap());
    let mut command = Command::cargo_bin("gdpt").unwrap();
    let result = command.args(line.split_whitespace()).output().unwrap();
    let text = |bytes: Vec<u8>| String::from_utf8(bytes).unwrap();
    if result.status.success() {
        Ok(text(result.stdout))
    } else {
        assert_eq!(result.status.code(), Some(1), "{line}");
        Err(text(result.stderr))
    }
}

fn channels(path: &Path) -> BTreeMap<String, Vec<f32>> {
    let image = read_all_flat_layers_from_file(path).unwrap();
    let list = image.layer_data[0].channel_data.list.iter();
    list.map(|c| (c.name.to_string(), c.sample_data.values_as_f32().collect()))
        .collect()
}

fn largest_difference(a: &[f32], b: &[f32]) -> f32 {
    a.iter()
        .zip(b)
        .map(|(a, b)| (a - b).abs() / (1.0 + b.abs()))
        .fold(0.0, f32::max)
}

const RENDER: &str = "render scenes/glossy.obj --size 40x30 --seed 3 --quiet";

/// From its own file every method gives the picture that the render would have given.
#[test]
fn a_renders_own_file_gives_the_same_pictures() {
    let folder = TempDir::new().unwrap();
    let path = |name: &str| folder.path().join(name);
    for spp in [2, 7, 16] {
        gdpt(
            folder.path(),
            &format!("{RENDER} --spp {spp} -o DIR/own.exr"),
        )
        .unwrap();
        for flags in [
            "",
            "--reconstruct weighted",
            "--reconstruct l2",
            "--reconstruct l2 --alpha auto",
            "--reconstruct l1 --alpha 0.1",
            "--reconstruct none",
        ] {
            gdpt(
                folder.path(),
                &format!("{RENDER} --spp {spp} {flags} -o DIR/want.exr"),
            )
            .unwrap();
            gdpt(
                folder.path(),
                &format!("reconstruct DIR/own.exr {flags} -o DIR/got.exr"),
            )
            .unwrap();
            let (want, got) = (channels(&path("want.exr")), channels(&path("got.exr")));
            assert_eq!(
                want.keys().collect::<Vec<_>>(),
                got.keys().collect::<Vec<_>>()
            );
            for (name, values) in &want {
                // Half B is told from the whole and half A, up to rounding; L1's weights magnify it.
                let difference = largest_difference(&got[name], values);
                assert!(
                    difference < 5e-3,
                    "{spp} {flags}: {name} differs by {difference}"
                );
            }
        }
    }
}

/// Three images of another renderer are solved as the same three inside a render's file.
#[test]
fn three_files_give_the_same_picture() {
    let folder = TempDir::new().unwrap();
    let path = |name: &str| folder.path().join(name);
    gdpt(
        folder.path(),
        &format!("{RENDER} --spp 8 --reconstruct l2 -o DIR/own.exr"),
    )
    .unwrap();
    let own = channels(&path("own.exr"));
    for layer in ["primal", "dx", "dy", "direct"] {
        let at = |i: usize, c: &str| own[&format!("{layer}.{c}")][i];
        write_rgb_file(path(&format!("{layer}.exr")), 40, 30, |x, y| {
            let i = y * 40 + x;
            (at(i, "R"), at(i, "G"), at(i, "B"))
        })
        .unwrap();
    }
    let three = "reconstruct --primal DIR/primal.exr --dx DIR/dx.exr --dy DIR/dy.exr";
    gdpt(
        folder.path(),
        &format!("{three} --direct DIR/direct.exr -o DIR/got.exr"),
    )
    .unwrap();
    let got = channels(&path("got.exr"));
    for c in ["R", "G", "B"] {
        assert!(largest_difference(&got[c], &own[c]) < 1e-4);
    }
    gdpt(
        folder.path(),
        &format!("{three} --reconstruct l1 -o DIR/got.png"),
    )
    .unwrap();
    assert!(path("got.png").exists());

    // What cannot be.
    let flags = "--reconstruct weighted -o DIR/x.exr";
    let message = gdpt(folder.path(), &format!("{three} {flags}")).unwrap_err();
    assert!(message.contains("halves"), "{message}");
    let message = gdpt(folder.path(), &format!("{three} --alpha auto -o DIR/x.exr")).unwrap_err();
    assert!(message.contains("variances"), "{message}");
}

#[test]
fn what_is_no_renders_file_is_refused() {
    let folder = TempDir::new().unwrap();
    let path = |name: &str| folder.path().join(name);
    write_rgb_file(path("other.exr"), 4, 3, |_, _| (0.5f32, 0.5, 0.5)).unwrap();
    write_rgb_file(path("small.exr"), 3, 3, |_, _| (0.5f32, 0.5, 0.5)).unwrap();
    write_rgb_file(path("nan.exr"), 4, 3, |_, _| (f32::NAN, 0.5, 0.5)).unwrap();
    std::fs::write(path("text.exr"), "no image").unwrap();
    gdpt(
        folder.path(),
        &format!("{RENDER} --spp 2 --method pt -o DIR/pt.exr"),
    )
    .unwrap();
    for (line, word) in [
        (
            "reconstruct DIR/other.exr -o DIR/o.exr",
            "gdpt render wrote",
        ),
        ("reconstruct DIR/pt.exr -o DIR/o.exr", "dx"),
        ("reconstruct DIR/text.exr -o DIR/o.exr", "EXR"),
        ("reconstruct DIR/missing.exr -o DIR/o.exr", "missing.exr"),
        ("reconstruct DIR/other.exr -o DIR/o.tif", "extension"),
        ("reconstruct DIR/other.exr -o DIR/other.exr", "other.exr"),
        (
            "reconstruct --primal DIR/other.exr --dx DIR/other.exr --dy DIR/small.exr -o DIR/o.exr",
            "3x3",
        ),
        (
            "reconstruct --primal DIR/other.exr --dx DIR/nan.exr --dy DIR/other.exr -o DIR/o.exr",
            "finite",
        ),
    ] {
        let message = gdpt(folder.path(), line).unwrap_err();
        assert!(
            message.contains(word) && message.lines().count() == 1,
            "{line}: {message}"
        );
        assert!(!path("o.exr").exists());
    }
}

/// Rendering ends when the estimated error is small enough, or at the other limits.
#[test]
fn renders_until_the_error_is_small() {
    let folder = TempDir::new().unwrap();
    let stats = |flags: &str| -> serde_json::Value {
        gdpt(
            folder.path(),
            &format!("{RENDER} {flags} -o DIR/e.exr --stats DIR/e.json"),
        )
        .unwrap();
        let text = std::fs::read_to_string(folder.path().join("e.json")).unwrap();
        serde_json::from_str(&text).unwrap()
    };
    let reached = stats("--error 0.01");
    assert_eq!(reached["ended"], "error");
    let error = reached["estimated_rel_mse"].as_f64().unwrap();
    let samples = reached["samples"].as_u64().unwrap();
    assert!(error <= 0.01 && samples >= 16, "{error} {samples}");
    // Not many more samples than needed: they go up by at most the missing factor, or by a tenth.
    let coarse = stats("--error 0.04");
    assert!(coarse["samples"].as_u64().unwrap() < samples);
    let limited = stats("--error 1e-9 --spp 18");
    assert_eq!(
        (limited["ended"].as_str(), limited["samples"].as_u64()),
        (Some("samples"), Some(18))
    );
    let message = gdpt(folder.path(), &format!("{RENDER} --error 0 -o DIR/e.exr")).unwrap_err();
    assert!(message.contains("--error"), "{message}");
}
