//! `gdpt info` from the shell.

use assert_cmd::Command;

#[test]
fn a_scene_is_told_to_people_and_machines() {
    let folder = tempfile::tempdir().unwrap();
    let json = folder.path().join("i.json");
    let mut command = Command::cargo_bin("gdpt").unwrap();
    command
        .args(["info", "scenes/glossy.obj", "--size", "100x50", "--json"])
        .arg(&json);
    let output = command.output().unwrap();
    assert!(output.status.success(), "{output:?}");
    let text = String::from_utf8(output.stdout).unwrap();
    for word in [
        "1304 triangles",
        "glass 1.5",
        "half-vector copy",
        "by power among 2 triangles",
        "memory: 3.3 MB",
    ] {
        assert!(text.contains(word), "{text}");
    }

    let info = std::fs::read(&json).unwrap();
    let info: serde_json::Value = serde_json::from_slice(&info).unwrap();
    assert_eq!(info["triangles"], 1304);
    assert_eq!(info["width"], 100);
    let materials = info["materials"].as_array().unwrap();
    let light = materials.iter().find(|m| m["name"] == "light").unwrap();
    // Radiance 16, 13, 9 over a square of side 1/2.
    let power = light["power"].as_f64().unwrap();
    assert!((power / (std::f64::consts::PI * 0.25 * 38.0 / 3.0) - 1.0).abs() < 1e-6);
    let triangles = materials.iter().map(|m| m["triangles"].as_u64().unwrap());
    assert_eq!(triangles.sum::<u64>(), 1304);
}

#[test]
fn diffuse_scenes_say_that_their_paths_go_eight_at_once() {
    for (scene, lanes) in [("scenes/cornell.obj", true), ("scenes/mirrors.obj", false)] {
        let mut command = Command::cargo_bin("gdpt").unwrap();
        let output = command.args(["info", scene]).output().unwrap();
        let text = String::from_utf8(output.stdout).unwrap();
        assert_eq!(text.contains("eight paths at once"), lanes, "{text}");
    }
}

#[test]
fn textures_and_what_they_need_are_told() {
    let mut command = Command::cargo_bin("gdpt").unwrap();
    let output = command.args(["info", "scenes/still.obj"]).output().unwrap();
    let text = String::from_utf8(output.stdout).unwrap();
    for word in [
        "texture of tiles: colour, 64x64",
        "texture of leaf: opacity, 128x128",
        "texture of brushed: roughness",
        "texture of bumpy: bumps",
        "2 triangles with holes",
        "environment a map of 128x64",
        "environment map, textures, cut-outs",
        "plastic",
    ] {
        assert!(text.contains(word), "{word}: {text}");
    }
}

#[test]
fn what_cannot_be_read_is_an_error() {
    let mut command = Command::cargo_bin("gdpt").unwrap();
    let output = command.args(["info", "absent.obj"]).output().unwrap();
    assert!(!output.status.success());
    assert!(
        String::from_utf8(output.stderr)
            .unwrap()
            .contains("absent.obj")
    );
}
