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
fn scenes_that_are_diffuse_throughout_say_so() {
    for (scene, diffuse) in [("scenes/cornell.obj", true), ("scenes/mirrors.obj", false)] {
        let mut command = Command::cargo_bin("gdpt").unwrap();
        let output = command.args(["info", scene]).output().unwrap();
        let text = String::from_utf8(output.stdout).unwrap();
        assert_eq!(text.contains("diffuse throughout"), diffuse, "{text}");
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

/// A folder with a scene of two materials that are used, and two that are not.
fn scene() -> tempfile::TempDir {
    let folder = tempfile::tempdir().unwrap();
    let obj = "mtllib a.mtl\nv 0 0 0\nv 2 0 0\nv 2 1 0\nv 0 1 0\nv 5 5 5\nvt 0 0\nvt 1 0\nvt 1 1\nvt 0 1\n\
        vn 0 0 1\nusemtl wood\nf 1/1/1 2/2/1 3/3/1\nusemtl pane\nf 1 3 4\n";
    let mtl = "newmtl wood\nKd 0.123 0 0\nmap_Kd wood.png\nnewmtl pane\nd 0.1\nNi 1.5\nillum 9\n\
        newmtl other\nKs 1 1 1\nPm 1\nPr 0.3\nnewmtl another\n";
    std::fs::write(folder.path().join("a.obj"), obj).unwrap();
    std::fs::write(folder.path().join("a.mtl"), mtl).unwrap();
    let wood = image::RgbImage::from_pixel(4, 2, image::Rgb([200, 100, 50]));
    wood.save(folder.path().join("wood.png")).unwrap();
    folder
}

fn info(folder: &tempfile::TempDir, arguments: &[&str]) -> std::process::Output {
    let mut command = Command::cargo_bin("gdpt").unwrap();
    command.current_dir(folder.path()).arg("info");
    command.args(arguments).output().unwrap()
}

#[test]
fn what_is_told_is_what_is_rendered() {
    let output = info(&scene(), &["a.obj", "--size", "100x50"]);
    let text = String::from_utf8(output.stdout).unwrap();
    for line in [
        "a.obj: 2 triangles",
        "area 2.0000",
        "size 2 x 1 x 0, from 0,0,0 to 2,1,0",
        "normals: 1 triangles smooth, 1 flat",
        "picture 100x50, camera at ",
        ", up ",
        "  wood: Lambert texture of 4x2, 1 triangles, area 1.0000",
        "  pane: thin glass 1.5",
        "  2 materials that no triangle has",
        "kernels: Lambert, smooth panes, walks to lights by mirrors and glass, reconnection",
        "reflectors, by which walks lead to lights: 1 flat of pane",
        " MB for the picture, 1.0 MB of them its film, and about 0.",
    ] {
        assert!(text.contains(line), "{line}: {text}");
    }
    for word in ["0.123", "other", "metal"] {
        assert!(!text.contains(word), "{word}: {text}");
    }
}

#[test]
fn several_scenes_are_told_one_after_the_other() {
    let folder = scene();
    let output = info(&folder, &["a.obj", "absent.obj", "a.obj", "--json", "-"]);
    assert_eq!(output.status.code(), Some(1));
    let infos: serde_json::Value = serde_json::from_slice(&output.stdout).unwrap();
    let infos = infos.as_array().unwrap();
    assert_eq!(infos.len(), 2);
    assert_eq!(infos[1]["area"], 2.0);
    assert_eq!(
        infos[1]["unused_materials"],
        serde_json::json!(["other", "another"])
    );
    assert!(infos[1]["view"].as_str().unwrap().starts_with("camera at "));
    let text = String::from_utf8(output.stderr).unwrap();
    assert_eq!(text.matches("a.obj: 2 triangles").count(), 2, "{text}");
    assert!(
        text.contains("error: absent.obj") && text.contains("1 of 3 scenes failed"),
        "{text}"
    );
}
