//! The program from the shell: files and their layers, limits of time, signals.

use assert_cmd::Command;
use exr::prelude::*;
use std::path::Path;
use std::time::{Duration, Instant};
use tempfile::TempDir;

fn gdpt(folder: &Path, output: &str, flags: &[&str]) -> std::process::Output {
    let mut command = Command::cargo_bin("gdpt").unwrap();
    command
        .args(["render", "scenes/glossy.obj", "-o"])
        .arg(folder.join(output));
    command
        .args(["--size", "40x30"])
        .args(flags)
        .output()
        .unwrap()
}

fn read(path: &Path) -> FlatImage {
    read_all_flat_layers_from_file(path).unwrap()
}

fn channel_names(image: &FlatImage) -> Vec<String> {
    image.layer_data[0]
        .channel_data
        .list
        .iter()
        .map(|c| c.name.to_string())
        .collect()
}

fn channel(image: &FlatImage, name: &str) -> Vec<f32> {
    let channels = &image.layer_data[0].channel_data.list;
    let found = channels
        .iter()
        .find(|c| c.name.to_string() == name)
        .expect(name);
    found.sample_data.values_as_f32().collect()
}

#[test]
fn an_exr_has_all_layers_and_the_settings() {
    let folder = TempDir::new().unwrap();
    let stats = folder.path().join("s.json");
    let preview = folder.path().join("p.png");
    let flags = [
        "--spp",
        "6",
        "--seed",
        "3",
        "--reconstruct",
        "l2",
        "--stats",
        stats.to_str().unwrap(),
        "--preview",
        preview.to_str().unwrap(),
    ];
    let result = gdpt(folder.path(), "a.exr", &flags);
    assert!(
        result.status.success(),
        "{}",
        String::from_utf8_lossy(&result.stderr)
    );
    let summary = String::from_utf8(result.stdout).unwrap();
    for word in [
        "6 samples per pixel",
        "Mray/s",
        "dead shifts",
        "0 samples dropped",
        "a.exr",
    ] {
        assert!(summary.contains(word), "no '{word}' in {summary}");
    }

    let image = read(&folder.path().join("a.exr"));
    let names = channel_names(&image);
    assert_eq!(names[..3], ["B", "G", "R"], "the plain channels come first");
    for layer in [
        "primal",
        "dx",
        "dy",
        "direct",
        "albedo",
        "primal_variance",
        "dx_variance",
        "dy_variance",
        "error",
        "half_a.primal",
        "half_a.dy_variance",
    ] {
        for c in ["R", "G", "B"] {
            assert!(names.contains(&format!("{layer}.{c}")), "{layer}.{c}");
        }
    }
    for name in [
        "normal.X",
        "normal.Y",
        "normal.Z",
        "depth.Z",
        "samples.count",
        "samples.dropped",
    ] {
        assert!(names.iter().any(|n| n == name), "{name}");
    }
    assert!(channel(&image, "samples.count").iter().all(|&n| n == 6.0));
    let normal = ["normal.X", "normal.Y", "normal.Z"].map(|n| channel(&image, n));
    let depth = channel(&image, "depth.Z");
    for i in 0..40 * 30 {
        let length = normal.iter().map(|c| c[i] * c[i]).sum::<f32>().sqrt();
        assert!(length < 1.001 && (depth[i] == 0.0 || (2.0..8.0).contains(&depth[i])));
    }
    // The picture is what the layers say: L2 keeps the sum of the primal, and light seen directly is
    // added.
    let sum = |name: &str| {
        channel(&image, name)
            .iter()
            .map(|&v| f64::from(v))
            .sum::<f64>()
    };
    assert!((sum("G") - sum("primal.G") - sum("direct.G")).abs() < 1e-3 * sum("G"));
    let attributes = &image.layer_data[0].attributes.other;
    let attribute = |name: &str| match attributes.get(&Text::from(name)) {
        Some(AttributeValue::Text(t)) => t.to_string(),
        other => panic!("{name}: {other:?}"),
    };
    assert_eq!(attribute("gdpt.seed"), "3");
    assert_eq!(attribute("gdpt.samples"), "6");
    assert_eq!(attribute("gdpt.version"), env!("CARGO_PKG_VERSION"));
    assert_eq!(attribute("gdpt.scene_hash").len(), 16);

    let stats: serde_json::Value =
        serde_json::from_str(&std::fs::read_to_string(stats).unwrap()).unwrap();
    assert_eq!(stats["samples"], 6);
    assert_eq!(stats["settings"]["method"], "gpt");
    assert!(stats["rays"]["primary"].as_u64().unwrap() >= 40 * 30 * 6);
    assert!(std::fs::read(preview).unwrap().starts_with(b"\x89PNG"));
}

#[test]
fn path_tracing_has_no_gradient_layers() {
    let folder = TempDir::new().unwrap();
    assert!(
        gdpt(folder.path(), "a.exr", &["--spp", "2", "--method", "pt"])
            .status
            .success()
    );
    let names = channel_names(&read(&folder.path().join("a.exr")));
    assert!(names.contains(&"primal.R".into()) && !names.contains(&"dx.R".into()));
}

#[test]
fn every_reconstruction_backend_and_weight_renders() {
    let folder = TempDir::new().unwrap();
    for flags in [
        ["--reconstruct", "weighted"],
        ["--reconstruct", "l1"],
        ["--reconstruct", "none"],
        ["--backend", "bvh"],
        ["--weights", "symmetric"],
        ["--filter", "box"],
        ["--alpha", "auto"],
    ] {
        let all = [&flags[..], &["--spp", "4", "--quiet"]].concat();
        let result = gdpt(folder.path(), "a.exr", &all);
        assert!(
            result.status.success(),
            "{}",
            String::from_utf8_lossy(&result.stderr)
        );
        assert!(
            result.stdout.is_empty() && result.stderr.is_empty(),
            "--quiet is quiet"
        );
    }
}

#[test]
fn a_time_limit_ends_the_render_with_success() {
    let folder = TempDir::new().unwrap();
    let start = Instant::now();
    let result = gdpt(folder.path(), "a.exr", &["--time", "0.5s"]);
    assert_eq!(result.status.code(), Some(0));
    // Not a measurement: it must end, and not before its time.
    assert!(start.elapsed() >= Duration::from_millis(500));
    assert!(channel(&read(&folder.path().join("a.exr")), "samples.count")[0] >= 2.0);
}

#[cfg(unix)]
#[test]
fn ctrl_c_writes_what_there_is_and_exits_with_130() {
    let folder = TempDir::new().unwrap();
    let output = folder.path().join("a.exr");
    let mut child = std::process::Command::new(assert_cmd::cargo::cargo_bin("gdpt"))
        .args([
            "render",
            "scenes/cornell.obj",
            "--size",
            "64x64",
            "--spp",
            "16000000",
            "-o",
        ])
        .arg(&output)
        .stdout(std::process::Stdio::piped())
        .spawn()
        .unwrap();
    // Long enough for the first passes; a signal before them would end without a picture to check.
    std::thread::sleep(Duration::from_secs(2));
    let kill = std::process::Command::new("kill")
        .args(["-INT", &child.id().to_string()])
        .status();
    assert!(kill.unwrap().success());
    assert_eq!(child.wait().unwrap().code(), Some(130));
    let image = read(&output);
    let samples = channel(&image, "samples.count")[0];
    assert!((2.0..1e8).contains(&samples), "{samples}");
    assert!(channel(&image, "G").iter().any(|&v| v > 0.0));
}
