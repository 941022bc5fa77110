//! Whatever is put in: one clear line with file and line, exit code ≠ 0, no panic, no file half
//! written. What can be rendered all the same is, with a warning, and refused under `--strict`.

use assert_cmd::Command;
use std::fs;
use std::path::{Path, PathBuf};
use tempfile::TempDir;

const QUAD: &str = "v 0 0 0\nv 1 0 0\nv 1 1 0\nv 0 1 0\n";

/// A folder with the files of a scene.
struct Case {
    folder: TempDir,
}

impl Case {
    fn new(files: &[(&str, &str)]) -> Self {
        let folder = TempDir::new().unwrap();
        for (name, text) in files {
            fs::write(folder.path().join(name), text).unwrap();
        }
        Self { folder }
    }

    fn path(&self, name: &str) -> PathBuf {
        self.folder.path().join(name)
    }

    fn run(&self, scene: &str, output: &Path, flags: &[&str]) -> std::process::Output {
        let mut command = Command::cargo_bin("gdpt").unwrap();
        command
            .arg("render")
            .arg(self.path(scene))
            .arg("-o")
            .arg(output);
        command
            .args(["--spp", "2", "--size", "16x16"])
            .args(flags)
            .output()
            .unwrap()
    }

    /// Must fail with exactly one line that has all of `words`, and leave the folder as it was.
    fn refuses(&self, scene: &str, flags: &[&str], words: &[&str]) {
        self.refuses_at(scene, &self.path("out.exr"), flags, words);
    }

    fn refuses_at(&self, scene: &str, output: &Path, flags: &[&str], words: &[&str]) {
        let before = self.listing();
        let result = self.run(scene, output, flags);
        let text = String::from_utf8(result.stderr).unwrap();
        let lines: Vec<&str> = text
            .lines()
            .filter(|l| !l.starts_with("warning: "))
            .collect();
        let body = fs::read_to_string(self.path(scene)).unwrap_or_default();
        assert!(
            !result.status.success(),
            "{scene} {flags:?} was accepted: {body}"
        );
        assert!(
            matches!(result.status.code(), Some(1 | 2)),
            "{scene}: {:?}: {text}",
            result.status
        );
        assert!(lines[0].starts_with("error: "), "{text}");
        // Usage errors come from clap, which adds a hint.
        assert!(
            lines.len() == 1 || result.status.code() == Some(2),
            "{text}"
        );
        for word in words {
            assert!(
                text.contains(word),
                "{scene} {flags:?}: no '{word}' in: {text}"
            );
        }
        assert_eq!(before, self.listing(), "files were left behind");
    }

    /// Must render, with a warning that has all of `words`; and must fail under `--strict`.
    fn warns(&self, scene: &str, words: &[&str]) {
        let result = self.run(scene, &self.path("out.exr"), &[]);
        let text = String::from_utf8(result.stderr).unwrap();
        assert!(result.status.success(), "{text}");
        let warning = text
            .lines()
            .find(|l| l.starts_with("warning: "))
            .expect("a warning");
        for word in words {
            assert!(warning.contains(word), "no '{word}' in: {text}");
        }
        fs::remove_file(self.path("out.exr")).unwrap();
        self.refuses(scene, &["--strict"], words);
    }

    fn listing(&self) -> Vec<PathBuf> {
        let mut list: Vec<_> = fs::read_dir(self.folder.path())
            .unwrap()
            .map(|e| e.unwrap().path())
            .collect();
        list.sort();
        list
    }
}

fn quad() -> Case {
    Case::new(&[("a.obj", &format!("{QUAD}f 1 2 3 4\n"))])
}

#[test]
fn a_plain_scene_renders() {
    let case = quad();
    for output in ["out.exr", "out.png"] {
        let result = case.run("a.obj", &case.path(output), &["--strict"]);
        assert!(
            result.status.success(),
            "{}",
            String::from_utf8_lossy(&result.stderr)
        );
        assert!(fs::metadata(case.path(output)).unwrap().len() > 100);
    }
}

#[test]
fn unreadable_scenes() {
    let case = quad();
    case.refuses("none.obj", &[], &["none.obj", "cannot be read"]);
    fs::create_dir(case.path("folder.obj")).unwrap();
    case.refuses("folder.obj", &[], &["folder.obj", "directory"]);
    fs::write(case.path("empty.obj"), "").unwrap();
    case.refuses("empty.obj", &[], &["empty.obj", "is empty"]);
    fs::write(
        case.path("binary.obj"),
        [0u8, 159, 146, 150, 255, 10, 102, 32, 0],
    )
    .unwrap();
    case.refuses("binary.obj", &[], &["binary.obj", "binary data"]);
    for (name, text, word) in [
        ("a.stl", "solid x\nfacet normal 0 0 1\n", "STL"),
        (
            "lfs.obj",
            "version https://git-lfs.github.com/spec/v1\n",
            "git lfs pull",
        ),
        ("page.obj", "<!DOCTYPE html><html></html>", "HTML"),
    ] {
        fs::write(case.path(name), text).unwrap();
        case.refuses(name, &[], &[name, word]);
    }
}

#[test]
fn malformed_geometry() {
    for (body, words) in [
        ("", vec!["no faces"]),
        ("l 1 2\n", vec!["no faces"]),
        ("f 1 2 9\n", vec!["line 5", "vertex 9", "4"]),
        ("f 1 2 x\n", vec!["line 5", "'x'"]),
        (
            "v 1 nan(ind) 2\nf 1 2 5\n",
            vec!["line 5", "no finite numbers"],
        ),
        ("f 1 1 2\n", vec!["no faces"]),
        ("surf 0 1 0 1 1 2 3 4\n", vec!["no faces", "free-form"]),
    ] {
        let case = Case::new(&[("a.obj", &format!("{QUAD}{body}"))]);
        case.refuses("a.obj", &[], &words);
    }
}

#[test]
fn tolerable_geometry() {
    for (body, words) in [
        ("f 1 2 3\nf 1 2 2\n", vec![":6:", "1 faces without area"]),
        (
            "vn 0 0 1\nvn 0 0 0\nf 1//1 2//1 3//2\n",
            vec![":6:", "1 normals"],
        ),
        ("vn 0 0 nan\nf 1//1 2//1 3//1\n", vec![":5:", "1 normals"]),
        ("vn 0 0\nf 1//1 2//1 3//1\n", vec![":5:", "1 normals"]),
        ("usemtl steel\nf 1 2 3\n", vec![":5:", "'steel'", "grey"]),
        ("mtllib no.mtl\nf 1 2 3\n", vec![":5:", "no.mtl"]),
        ("f 1 2 3\nf 1 2 -5\n", vec![":6:", "1 faces", "vertex -5"]),
        ("f 1 2 3\nf 1 2 0\n", vec![":6:", "vertex 0"]),
        ("f 1 2 3\nf 1 2\n", vec![":6:", "fewer than three"]),
        (
            "f 1 2 99999999999999999999\nf 1 2 3\n",
            vec![":5:", "vertex"],
        ),
        (
            "f 1//1 2//1 3//1\nf 1//2 2//1 3//1\n",
            vec![":5:", "2 faces", "normals"],
        ),
        (
            "f 1/1 2/1 3/1\n",
            vec![":5:", "1 faces", "texture coordinates"],
        ),
        ("v 1 2\nf 1 2 3\n", vec![":5:", "1 vertices", "0 faces"]),
        (
            "v 1 3.1+e2 2\nf 1 2 5\nf 1 2 3\n",
            vec![":5:", "1 vertices", "1 faces"],
        ),
        ("v 1 1e39 2\nf 1 2 3\n", vec![":5:", "finite"]),
        ("v 1 2 3 0\nf 1 2 3\n", vec![":5:", "weight"]),
        ("vt 1.#QNAN 0\nf 1/1 2/1 3/1\n", vec![":5:", "1 texture"]),
        ("f 1 \\\n2 3\nf 1 2 9\n", vec![":7:", "vertex 9"]),
        (
            "curv 0 1 1 2 3\ncurv 0 1 1 2 3\nf 1 2 3\n",
            vec![":5:", "2 free-form curves"],
        ),
        ("quad 1 2 3 4\nf 1 2 3\n", vec![":5:", "'quad'"]),
    ] {
        let case = Case::new(&[("a.obj", &format!("{QUAD}{body}"))]);
        case.warns("a.obj", &words);
    }
}

#[test]
fn malformed_materials() {
    for (mtl, words) in [
        ("newmtl a\nKd 1 1\n", vec!["a.mtl:2:", "'Kd 1 1'"]),
        ("newmtl a\n\nNi glass\n", vec!["a.mtl:3:", "'Ni glass'"]),
        (
            "newmtl a\nNs nan\nNs 1.#QNAN\n",
            vec!["a.mtl:2:", "'Ns nan'", "'Ns 1.#QNAN'"],
        ),
        ("newmtl a\nkd 1 0 0\n", vec!["a.mtl:2:", "kd for Kd"]),
        ("newmtl a\nKq 1\nKq 2\n", vec!["a.mtl:2:", "Kq (2 times)"]),
        ("newmtl\nKd 1 0 0\n", vec!["a.mtl:2:", "newmtl"]),
        ("newmtl\n", vec!["a.obj:2:", "'a'"]),
        ("", vec!["a.obj:2:", "'a'"]),
    ] {
        let obj = format!("mtllib a.mtl\nusemtl a\n{QUAD}f 1 2 3 4\n");
        Case::new(&[("a.obj", &obj), ("a.mtl", mtl)]).warns("a.obj", &words);
    }
}

#[test]
fn malformed_toml() {
    for (toml, words) in [
        ("[camera]\nfov = \n", vec!["a.toml:2:"]),
        ("[camera]\nfov = 30\nfar = 3\n", vec!["a.toml:3:", "far"]),
        ("[film]\nwidth = -4\n", vec!["a.toml:2:"]),
        ("[lens]\nf = 1\n", vec!["a.toml:1:", "lens"]),
        ("[camera]\norigin = [0, 1]\n", vec!["a.toml:2:"]),
        ("[camera]\nfov = 200\n", vec!["field of view"]),
        ("[camera]\norigin = [0, 0, nan]\n", vec!["finite"]),
        (
            "[environment]\nradiance = [1, -1, 1]\n",
            vec!["environment"],
        ),
        (
            "[[lights]]\nposition = [0, 1, 0]\n",
            vec!["a.toml:1:", "kind"],
        ),
        ("[[lights]]\nkind = 'lamp'\n", vec!["a.toml:2:", "spot"]),
        (
            "[[lights]]\nkind = 'point'\nintensity = 1\n",
            vec!["a.toml:1:", "a point needs position"],
        ),
        (
            "[film]\nwidth = 4\n[[lights]]\nkind = 'point'\nposition = [0, 1, 0]\nintensity = [1, -1, 1]\n",
            vec!["a.toml:3:", "intensity"],
        ),
        (
            "[[lights]]\nkind = 'point'\nposition = [0, 1, 0]\nintensity = 'bright'\n",
            vec!["a.toml:4:", "[red, green, blue]"],
        ),
        (
            "[[lights]]\nkind = 'point'\nposition = [0, inf, 0]\nintensity = 1\n",
            vec!["a.toml:1:", "position must be finite"],
        ),
        (
            "[[lights]]\nkind = 'point'\nposition = [0, 1, 0]\nintensity = 1\ncutoff_angle = 9\n",
            vec!["a.toml:1:", "a point has no cutoff_angle"],
        ),
        (
            "[[lights]]\nkind = 'spot'\nposition = [0, 1, 0]\nintensity = 1\n",
            vec!["a.toml:1:", "direction or target"],
        ),
        (
            "[[lights]]\nkind = 'spot'\nposition = [0, 1, 0]\ntarget = [0, 1, 0]\nintensity = 1\n",
            vec!["a.toml:1:", "no direction"],
        ),
        (
            "[[lights]]\nkind = 'spot'\nposition = [0, 1, 0]\ntarget = [0, 0, 0]\nintensity = 1\nbeam_width = 30\n",
            vec!["a.toml:1:", "beam_width", "20"],
        ),
        (
            "[[lights]]\nkind = 'directional'\ndirection = [0, -1, 0]\nintensity = 1\n",
            vec!["a.toml:1:", "no intensity"],
        ),
    ] {
        let case = Case::new(&[("a.obj", &format!("{QUAD}f 1 2 3 4\n")), ("a.toml", toml)]);
        case.refuses("a.obj", &[], &words);
    }
}

#[test]
fn impossible_settings() {
    let case = quad();
    for (flags, words) in [
        (vec!["--size", "0x5"], vec!["0x5"]),
        (vec!["--size", "1000000000x1000000000"], vec!["1000000000"]),
        (vec!["--size", "65536x65536"], vec!["65536"]),
        (vec!["--size", "x"], vec!["--size"]),
        (vec!["--spp", "0"], vec!["--spp"]),
        (vec!["--spp", "-1"], vec!["-1"]),
        (vec!["--depth", "0"], vec!["--depth"]),
        (vec!["--threads", "0"], vec!["--threads"]),
        (vec!["--threads", "100000"], vec!["--threads"]),
        (vec!["--time", "0s"], vec!["--time"]),
        (vec!["--alpha", "nan"], vec!["--alpha"]),
        (vec!["--fov", "180"], vec!["180"]),
        (vec!["--origin", "1,2"], vec!["--origin"]),
        (
            vec!["--origin", "1,2,3", "--target", "1,2,3"],
            vec!["origin"],
        ),
        (vec!["--up", "0,0,0"], vec!["up"]),
        (vec!["--environment=-1,0,0"], vec!["environment"]),
        (
            vec!["--method", "pt", "--reconstruct", "l2"],
            vec!["--reconstruct"],
        ),
        (vec!["--no-such-flag"], vec!["--no-such-flag"]),
    ] {
        // Later flags win over those that `run` gives.
        let mut command = Command::cargo_bin("gdpt").unwrap();
        command
            .arg("render")
            .arg(case.path("a.obj"))
            .arg("-o")
            .arg(case.path("out.exr"));
        let result = command.args(&flags).output().unwrap();
        let text = String::from_utf8(result.stderr).unwrap();
        assert!(
            matches!(result.status.code(), Some(1 | 2)),
            "{flags:?}: {:?}",
            result.status
        );
        assert!(
            text.lines().any(|l| l.starts_with("error: ")) && !text.contains("panicked"),
            "{text}"
        );
        for word in words {
            assert!(text.contains(word), "{flags:?}: {text}");
        }
        assert!(!case.path("out.exr").exists());
    }
}

#[test]
fn unwritable_outputs() {
    let case = quad();
    case.refuses_at(
        "a.obj",
        &case.path("none/out.exr"),
        &[],
        &["none/out.exr", "does not exist"],
    );
    case.refuses_at(
        "a.obj",
        &case.path("out.tif"),
        &[],
        &["out.tif", ".exr, .png or .jpg"],
    );
    case.refuses_at("a.obj", &case.path("out"), &[], &["extension"]);
    fs::create_dir(case.path("folder.exr")).unwrap();
    case.refuses(
        "a.obj",
        &["--stats", case.path("folder.exr").to_str().unwrap()],
        &["folder.exr", "directory"],
    );
    let preview = case.path("none/p.png");
    case.refuses(
        "a.obj",
        &["--preview", preview.to_str().unwrap()],
        &["none/p.png"],
    );
    let stats = case.path("none/s.json");
    case.refuses(
        "a.obj",
        &["--stats", stats.to_str().unwrap()],
        &["none/s.json"],
    );
}

/// No file is written over another one, least of all over the scene.
#[test]
fn colliding_outputs() {
    let case = quad();
    let same = case.path("out.exr");
    case.refuses(
        "a.obj",
        &["--stats", same.to_str().unwrap()],
        &["out.exr", "two purposes"],
    );
    let scene = case.path("./a.obj");
    case.refuses(
        "a.obj",
        &["--stats", scene.to_str().unwrap()],
        &["a.obj", "two purposes"],
    );
    assert!(
        fs::read_to_string(case.path("a.obj"))
            .unwrap()
            .starts_with("v 0")
    );
}

/// Faces with and without normals in one group: those without are flat.
#[test]
fn mixed_normals() {
    let obj = format!("{QUAD}vn 1 0 0\nvn 0 0 1\nf 1 2 3\nf 1//2 3//2 4//2\n");
    let case = Case::new(&[("a.obj", &obj)]);
    let mut warnings = gdpt::error::Warnings::new(true);
    let file = gdpt::load::obj::load(&case.path("a.obj"), &mut warnings).unwrap();
    assert_eq!(file.triangles.len(), 2);
    assert_eq!(file.normal_triangles[0], [gdpt::load::obj::NONE; 3]);
    assert_eq!(
        file.normals[file.normal_triangles[1][0] as usize],
        glam::Vec3::Z
    );
}
