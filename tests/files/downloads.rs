//! Small scenes as programs write them and people download them: what is in them is in the picture.

use crate::common::{Render, tracer};
use assert_cmd::Command;
use gdpt::error::Warnings;
use gdpt::film::{FirstHits, Halves};
use gdpt::load::{obj, sidecar};
use gdpt::render::Method;
use gdpt::scene::{EnvironmentSetting, Scene, SceneSettings, smoothing};
use glam::Vec3;
use image::{Rgb, RgbImage};
use std::path::PathBuf;
use tempfile::TempDir;

/// A square of area 4 before the camera.
const SQUARE: &str = "v -1 -1 0\nv 1 -1 0\nv 1 1 0\nv -1 1 0\n";
const RED: Vec3 = Vec3::new(0.8, 0.1, 0.1);
const RED_MTL: &str = "newmtl red\nKd 0.8 0.1 0.1\n";
const TOML: &str = "[camera]\norigin = [0, 0, 3]\ntarget = [0, 0, 0]\nfov = 45\n[environment]\nradiance = [1, 1, 1]\n";

/// A folder of these files; the scene is `scene.obj`.
fn folder(files: &[(&str, &str)]) -> TempDir {
    let folder = TempDir::new().unwrap();
    for (name, text) in files.iter().chain(&[("scene.toml", TOML)]) {
        let path = folder.path().join(name);
        std::fs::create_dir_all(path.parent().unwrap()).unwrap();
        if !path.exists() {
            std::fs::write(path, text).unwrap();
        }
    }
    folder
}

/// What is seen of a scene at a size of 24x24, and the warnings.
fn seen(folder: &TempDir) -> (FirstHits, Vec<String>) {
    let (scene, warnings) = scene(folder, None);
    (render(&scene, 16).0, warnings)
}

fn scene(folder: &TempDir, smooth: Option<f32>) -> (Scene, Vec<String>) {
    let path: PathBuf = folder.path().join("scene.obj");
    let mut warnings = Warnings::new(false);
    let mut file = obj::load(&path, &mut warnings).unwrap();
    if let Some(degrees) = smooth {
        smoothing::smooth_edges(&mut file, degrees);
    }
    let toml = sidecar::load(&path).unwrap();
    let settings = SceneSettings {
        camera: toml.camera,
        size: (24, 24),
        environment: EnvironmentSetting::of_table(&toml.environment),
        roughness_threshold: 0.01,
        ..Default::default()
    };
    let scene = Scene::build(&path, file, &settings, &mut warnings).unwrap();
    (scene, warnings.list().to_vec())
}

/// First hits, and the mean radiance of the lower half of the picture.
fn render(scene: &Scene, spp: u64) -> (FirstHits, Vec3) {
    let render = Render {
        method: Method::Pt,
        spp,
        ..Render::default()
    };
    let film = render.film(scene, &*tracer(scene));
    let image = film.estimate(Halves::Both).primal;
    let sum: Vec3 = (288..576).map(|pixel| image.get(pixel)).sum();
    (film.first_hits(), sum / 288.0)
}

fn albedo(hits: &FirstHits, x: usize, y: usize) -> Vec3 {
    hits.albedo.get(24 * y + x)
}

fn near(a: Vec3, b: Vec3, tolerance: f32) -> bool {
    (a - b).abs().max_element() <= tolerance
}

/// Whatever is blank, unknown or broken beside it, the square is red, by the colour in the MTL.
#[test]
fn the_square_is_red() {
    let obj = format!("mtllib scene.mtl\nusemtl red\n{SQUARE}f 1 2 3 4\n");
    let with = |mtl: &str| vec![("scene.obj", obj.clone()), ("scene.mtl", mtl.to_owned())];
    let of = |obj: &str| {
        let obj = obj.replace("SQUARE\n", SQUARE);
        vec![("scene.obj", obj), ("scene.mtl", RED_MTL.to_owned())]
    };
    let at = |place: &'static str, named: &str| {
        let obj = obj.replace("scene.mtl", named);
        vec![("scene.obj", obj), (place, RED_MTL.to_owned())]
    };
    for (files, words) in [
        // Blank statements say nothing.
        (with(&format!("{RED_MTL}map_Kd \nmap_Bump\n")), None),
        (with(&format!("{RED_MTL}norm\t\nmap_d\nmap_Ks  \n")), None),
        (with(&format!("{RED_MTL}Kd\nNs\n")), None),
        (
            with(&format!("{RED_MTL}newmtl\nKd 0.1 0.8 0.1\n")),
            Some("newmtl"),
        ),
        (
            with(&format!("newmtl \t\nKd 0 1 0\n{RED_MTL}")),
            Some("newmtl"),
        ),
        (
            of("mtllib scene.mtl\nusemtl red\nusemtl\nSQUARE\nf 1 2 3 4\n"),
            None,
        ),
        (
            of("mtllib\nmtllib scene.mtl\nusemtl red\nSQUARE\ng\no\ns\nf 1 2 3 4\n"),
            None,
        ),
        // Line ends, letter case, marks at the front.
        (with(&RED_MTL.replace('\n', "\r")), None),
        (with(&RED_MTL.replace('\n', "\r\n")), None),
        (with(&format!("\u{feff}{RED_MTL}")), None),
        (with("newmtl red\nkd 0.8 0.1 0.1\n"), Some("kd for Kd")),
        (
            with("NEWMTL red\nKD 0.8 0.1 0.1\n"),
            Some("NEWMTL for newmtl"),
        ),
        // Numbers that are none.
        (with(&format!("{RED_MTL}Ns nan\n")), Some("'Ns nan'")),
        (
            with(&format!("{RED_MTL}Ni 1.#QNAN\nd -nan(ind)\nillum x\n")),
            Some("'Ni 1.#QNAN'"),
        ),
        (
            with(&format!("{RED_MTL}Kd 3.1+e2 0 0\nKs 0 0\n")),
            Some("'Kd 3.1+e2 0 0'"),
        ),
        // Libraries that are written down for another place.
        (at("materials/scene.mtl", r"materials\scene.mtl"), None),
        (at("Scene.MTL", "scene.mtl"), None),
        (at("scene.mtl", r"C:\Users\me\scene.mtl"), None),
        (at("scene.mtl", "gone.mtl"), Some("gone.mtl")),
        // Names that are not there.
        (
            of("mtllib scene.mtl\nusemtl rot\nSQUARE\nf 1 2 3 4\n"),
            Some("'rot'"),
        ),
        // Normals and texture coordinates that are not there, or no numbers.
        (
            of("mtllib scene.mtl\nusemtl red\nSQUARE\nf 1//1 2//2 3//3 4//4\n"),
            Some("1 faces name normals"),
        ),
        (
            of("mtllib scene.mtl\nusemtl red\nSQUARE\nvn 0 0 1\nf 1//1 2//1 3//7 4//1\n"),
            Some("1 faces name normals"),
        ),
        (
            of("mtllib scene.mtl\nusemtl red\nSQUARE\nf 1/4 2/4 3/4 4/4\n"),
            Some("1 faces name texture"),
        ),
        (
            of("mtllib scene.mtl\nusemtl red\nSQUARE\nvt nan(ind) 0\nf 1/1 2/1 3/1 4/1\n"),
            Some("1 texture coord"),
        ),
        (
            of("mtllib scene.mtl\nusemtl red\nSQUARE\nvt 0.5\nf 1/1 2/1 3/1 4/1\n"),
            None,
        ),
        (
            of("mtllib scene.mtl\nusemtl red\nSQUARE\nvn 1.#IND 0 0\nf 1//1 2//1 3//1 4//1\n"),
            Some("1 normals"),
        ),
        (
            of("mtllib scene.mtl\nusemtl red\nSQUARE\nv -nan(ind) 0 0\nf 1 2 3 4\nf 1 2 5\n"),
            Some("1 vertices"),
        ),
        (
            of("mtllib scene.mtl\nusemtl red\nSQUARE\nv 3.1+e2 0 0\nf 1 2 3 4\nf 1 2 -1\n"),
            Some("1 faces with them"),
        ),
        // Words of other programs.
        (
            of("mtllib scene.mtl\nusemtl red\nSQUARE\nf 1 2 3 4\nzap 1 2\nzap\n"),
            Some(":8: 2 lines of 'zap'"),
        ),
    ] {
        let list: Vec<(&str, &str)> = files.iter().map(|(n, t)| (*n, t.as_str())).collect();
        let folder = folder(&list);
        let (hits, warnings) = seen(&folder);
        assert!(near(albedo(&hits, 12, 12), RED, 1e-4), "{list:?}");
        match words {
            Some(words) => assert!(
                warnings.iter().any(|w| w.contains(words)),
                "{words}: {warnings:?}"
            ),
            None => assert!(warnings.is_empty(), "{list:?}: {warnings:?}"),
        }
    }
}

/// An empty library, and a material that only the file knows, are grey.
#[test]
fn what_has_no_material_is_grey() {
    for mtl in ["", "# nothing\n", "\r\n\n"] {
        let obj = format!("mtllib scene.mtl\nusemtl red\n{SQUARE}f 1 2 3 4\n");
        let (hits, warnings) = seen(&folder(&[("scene.obj", &obj), ("scene.mtl", mtl)]));
        assert!(near(albedo(&hits, 12, 12), Vec3::splat(0.5), 1e-4));
        assert!(
            warnings.iter().any(|w| w.contains("'red' is not defined")),
            "{warnings:?}"
        );
    }
}

#[test]
fn areas_are_those_of_the_faces() {
    let u = "v -1 -1 0\nv 1 -1 0\nv 1 1 0\nv 0.6 1 0\nv 0.6 -0.6 0\nv -0.6 -0.6 0\nv -0.6 1 0\nv -1 1 0\n";
    let arrow = "v -1 -1 0\nv 0 -0.4 0\nv 1 -1 0\nv 0 1 0\n";
    let hole = "v -0.5 -0.5 0\nv -0.5 0.5 0\nv 0.5 0.5 0\nv 0.5 -0.5 0\n";
    let star = "v 0 0 0\nv 3 0 0\nv 3 3 0\nv 0 3 0\nv 1.5 1.5 0\n";
    for (text, want) in [
        (format!("{u}f 1 2 3 4 5 6 7 8\n"), "2.0800"),
        (format!("{arrow}f 1 2 3 4\n"), "1.4000"),
        (format!("{arrow}f 3 4 1 2\n"), "1.4000"),
        (format!("{SQUARE}{hole}f 1 2 3 4 1 5 6 7 8 5\n"), "3.0000"),
        (format!("{SQUARE}{hole}f 5 1 2 3 4 1 5 6 7 8\n"), "3.0000"),
        // A bite out of a square, and corners on a straight edge.
        (format!("{star}f 1 2 5 3 4\n"), "6.7500"),
        (
            "v 0 0 0\nv 1 0 0\nv 2 0 0\nv 2 0 1\nv 1 0 1\nv 0 0 1\nf 1 2 3 4 5 6\n".into(),
            "2.0000",
        ),
        // Not quite in a plane.
        (
            "v 0 0 0\nv 1 0 0.001\nv 1 1 0\nv 0.5 0.2 0.001\nv 0 1 0\nf 1 2 3 4 5\n".into(),
            "0.6000",
        ),
    ] {
        let folder = folder(&[("scene.obj", &text)]);
        let mut command = Command::cargo_bin("gdpt").unwrap();
        let output = command
            .arg("info")
            .arg(folder.path().join("scene.obj"))
            .output()
            .unwrap();
        let said = String::from_utf8(output.stdout).unwrap();
        assert!(
            output.status.success() && said.contains(&format!("area {want}\n")),
            "{text}{said}"
        );
    }
}

/// The floor of a room under a lamp is as bright whichever way its corners run, if the normals say where it shines;
/// also if its back lies on it.
#[test]
fn lamps_light_the_floor() {
    let floor = "mtllib scene.mtl\nv -1 0 -1\nv 1 0 -1\nv 1 0 1\nv -1 0 1\n\
                 v -0.4 1.5 -0.4\nv 0.4 1.5 -0.4\nv 0.4 1.5 0.4\nv -0.4 1.5 0.4\n\
                 vn 0 -1 0\nvn 0 1 0\nvn 0.3 -0.9 0.1\nusemtl floor\nf 4 3 2 1\nusemtl lamp\n";
    let mtl = "newmtl floor\nKd 0.7 0.7 0.7\nnewmtl lamp\nKd 0 0 0\nKe 5 5 5\nnewmtl back\nKd 0.5 0.5 0.5\n";
    let toml = "[camera]\norigin = [0, 1.2, 3.2]\ntarget = [0, 0.6, 0]\nfov = 45\n";
    let brightness = |faces: &str| {
        let obj = format!("{floor}{faces}");
        let folder = folder(&[
            ("scene.obj", &obj),
            ("scene.mtl", mtl),
            ("scene.toml", toml),
        ]);
        render(&scene(&folder, None).0, 256).1.x
    };
    let good = brightness("f 5 6 7 8\n");
    assert!(good > 0.05, "{good}");
    for (faces, share) in [
        ("f 8//1 7//1 6//1 5//1\n", 1.0),
        ("f 8//3 7//1 6//3 5//1\n", 1.0),
        ("f 8//1 7//1 6//1\nf 8 5 6\n", 1.0),
        // Upwards.
        ("f 8 7 6 5\n", 0.0),
        ("f 5//2 6//2 7//2 8//2\n", 0.0),
        // A back in the same place, which shines too, or does not, cut along either diagonal; the lamp twice.
        ("f 5 6 7 8\nf 8 7 6 5\n", 1.0),
        ("f 5 6 7 8\nf 7 6 5 8\n", 1.0),
        ("usemtl back\nf 7 6 5 8\nusemtl lamp\nf 5 6 7 8\n", 1.0),
        ("f 5 6 7 8\nf 5 6 7 8\n", 1.0),
    ] {
        let shown = brightness(faces);
        assert!(
            (shown - share * good).abs() < 0.01 * good,
            "{faces}: {shown}, {good}"
        );
    }
}

/// Colours at the corners are sRGB, and blend in between; in the albedo buffer too.
#[test]
fn vertices_have_their_colours() {
    let middle_of_diagonal = |obj: &str, mtl: &str| {
        let folder = folder(&[("scene.obj", obj), ("scene.mtl", mtl)]);
        RgbImage::from_pixel(1, 1, Rgb([255, 255, 0]))
            .save(folder.path().join("yellow.png"))
            .unwrap();
        let (hits, warnings) = seen(&folder);
        assert!(warnings.is_empty(), "{warnings:?}");
        // The four pixels around the middle of the square, of which the diagonal from corner 1 to 3 passes two.
        (albedo(&hits, 12, 11) + albedo(&hits, 11, 12)) / 2.0
    };
    let f = "f 1 2 3 4\n";
    let half = Vec3::new(0.5, 0.0, 0.5);
    let corners = "v -1 -1 0 1 0 0\nv 1 -1 0 0 1 0\nv 1 1 0 0 0 1\nv -1 1 0 1 1 0\n";
    let bytes = "v -1 -1 0 255 0 0\nv 1 -1 0 0 255 0\nv 1 1 0 0 0 255\nv -1 1 0 255 255 0\n";
    let brush = format!("{SQUARE}#MRGB ffff0000ff00ff00\n#MRGB ff0000ffffffff00\n{f}");
    let alpha = "v -1 -1 0 1 0 0 1\nv 1 -1 0 0 1 0 1\nv 1 1 0 0 0 1 1\nv -1 1 0 1 1 0 1\n";
    for obj in [
        format!("{corners}{f}"),
        format!("{bytes}{f}"),
        brush,
        format!("{alpha}{f}"),
    ] {
        let found = middle_of_diagonal(&obj, "");
        assert!(near(found, half, 0.06), "{obj}: {found}");
    }
    let grey =
        "v -1 -1 0 0.5 0.5 0.5\nv 1 -1 0 0.5 0.5 0.5\nv 1 1 0 0.5 0.5 0.5\nv -1 1 0 0.5 0.5 0.5\n";
    let found = middle_of_diagonal(&format!("{grey}{f}"), "");
    assert!(near(found, Vec3::splat(0.214), 1e-3), "{found}");

    // They take the place of Kd, and a texture takes theirs; all white, they are none.
    let named = |vertices: &str| format!("mtllib scene.mtl\nusemtl red\n{vertices}{f}");
    let found = middle_of_diagonal(&named(corners), RED_MTL);
    assert!(near(found, half, 0.06), "{found}");
    let found = middle_of_diagonal(
        &named(&format!("{corners}vt 0 0\n")).replace(f, "f 1/1 2/1 3/1 4/1\n"),
        "newmtl red\nmap_Kd yellow.png\n",
    );
    assert!(near(found, Vec3::new(1.0, 1.0, 0.0), 1e-4), "{found}");
    let white = SQUARE.replace(" 0\n", " 0 1 1 1\n");
    assert!(near(middle_of_diagonal(&named(&white), RED_MTL), RED, 1e-4));
    // Where a corner has none, the material's colour holds.
    let few = format!("{corners}v -1 -1 0\nv 1 -1 0\nv 1 1 0\nv -1 1 0\n");
    let found = middle_of_diagonal(&named(&few).replace(f, "f 5 6 7 8\n"), RED_MTL);
    assert!(near(found, RED, 1e-4), "{found}");
}

/// A texture of 0 and 1 makes one half of a surface metal.
#[test]
fn metal_by_texture() {
    let obj = format!(
        "mtllib scene.mtl\nusemtl m\n{SQUARE}vt 0 0\nvt 1 0\nvt 1 1\nvt 0 1\nf 1/1 2/2 3/3 4/4\n"
    );
    let mtl = "newmtl m\nKd 0.9 0.6 0.1\nPr 0.5\nmap_Pm m.png\n";
    let folder = folder(&[("scene.obj", &obj), ("scene.mtl", mtl)]);
    let picture = RgbImage::from_fn(64, 1, |x, _| Rgb([if x < 32 { 0 } else { 255 }; 3]));
    picture.save(folder.path().join("m.png")).unwrap();
    let (scene, warnings) = scene(&folder, None);
    assert!(warnings.is_empty(), "{warnings:?}");
    let (hits, _) = render(&scene, 16);
    let (plastic, metal) = (albedo(&hits, 8, 12), albedo(&hits, 16, 12));
    // What metal reflects at normal incidence; plastic has a coat of about 0.05 in all.
    assert!(near(metal, Vec3::new(0.9, 0.6, 0.1), 1e-3), "{metal}");
    assert!(plastic.z > 0.13 && plastic.z < 0.2, "{plastic}");
}

/// A roof of two faces: flat as it is, smooth in a group or where the angle says so.
#[test]
fn edges_are_smooth_where_the_file_or_the_user_says_so() {
    let roof = "v -1 -1 0\nv 0 -1 0.5\nv 0 1 0.5\nv -1 1 0\nv 1 -1 0\nv 1 1 0\n";
    let normal = |faces: &str, smooth| {
        let obj = format!("{roof}{faces}");
        let (hits, _) = render(&scene(&folder(&[("scene.obj", &obj)]), smooth).0, 4);
        hits.normal.get(24 * 12 + 11)
    };
    let faces = "f 1 2 3 4\nf 2 5 6 3\n";
    let flat = Vec3::new(-0.5, 0.0, 1.0).normalize();
    assert!(near(normal(faces, None), flat, 1e-4));
    // The planes meet at 53°.
    assert!(near(normal(faces, Some(50.0)), flat, 1e-4));
    for smooth in [
        normal(faces, Some(60.0)),
        normal(&format!("s 1\n{faces}"), None),
    ] {
        assert!(smooth.z > 0.97, "{smooth}");
    }
    // Groups of their own, or none.
    assert!(near(
        normal("s 1\nf 1 2 3 4\ns 2\nf 2 5 6 3\n", None),
        flat,
        1e-4
    ));
    assert!(near(
        normal("s off\nf 1 2 3 4\ns 0\nf 2 5 6 3\n", None),
        flat,
        1e-4
    ));
}
