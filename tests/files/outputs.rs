//! Outputs that cannot be written: the result is never lost silently.

use assert_cmd::cargo::cargo_bin;
use std::fs;
use std::path::{Path, PathBuf};
use std::process::{Command, Output};

/// Runs gdpt in a shell after `before`; temporary files go to `temporary`, the working directory is one
/// that is not there any more.
fn shell(before: &str, arguments: &str, temporary: &Path) -> Output {
    let gdpt = cargo_bin!("gdpt").display().to_string();
    let scene = fs::canonicalize("scenes/corner.obj").unwrap();
    let script = format!(
        "{before}\nexec {gdpt} render {} {arguments}",
        scene.display()
    );
    let mut command = Command::new("sh");
    command
        .args(["-c", &script])
        .env("TMPDIR", temporary)
        .output()
        .unwrap()
}

fn error(output: &Output) -> String {
    assert!(!output.status.success());
    String::from_utf8(output.stderr.clone()).unwrap()
}

fn files(folder: &Path) -> Vec<PathBuf> {
    let files = fs::read_dir(folder).unwrap();
    files.map(|f| f.unwrap().path()).collect()
}

#[test]
fn a_folder_that_vanishes_during_the_render_costs_nothing() {
    let there = tempfile::tempdir().unwrap();
    let folder = there.path().join("results");
    fs::create_dir(&folder).unwrap();
    let temporary = tempfile::tempdir().unwrap();
    // The folder goes while it renders.
    let before = format!("(sleep 0.3; rm -r {}) &", folder.display());
    let arguments = format!(
        "--size 64x64 --time 1s --quiet -o {}/out.exr",
        folder.display()
    );
    let text = error(&shell(&before, &arguments, temporary.path()));
    assert!(
        text.contains("results/out.exr") && text.contains("the picture is in"),
        "{text}"
    );
    let [saved] = &files(temporary.path())[..] else {
        panic!("{text}");
    };
    assert!(text.contains(&saved.display().to_string()), "{text}");
    let saved = gdpt::load::exr::load(saved).unwrap();
    assert_eq!(saved.size, (64, 64));
    assert!(saved.colour("dx").is_some());
}

#[test]
fn where_no_place_is_left_the_checkpoint_stays() {
    // The folder goes while it renders, and there is neither one for temporary files nor one to work in.
    let there = tempfile::tempdir().unwrap();
    let path = there.path().display();
    let before = format!(
        "cd {path}; mkdir results work; cd work; rmdir ../work; (sleep 0.3; rm -r {path}/results) &"
    );
    let arguments = format!(
        "--size 64x64 --time 1s --quiet -o {path}/results/out.exr --checkpoint {path}/c.gdpt --resume"
    );
    let text = error(&shell(&before, &arguments, Path::new("/nowhere")));
    assert!(
        text.contains("c.gdpt") && text.contains("--resume"),
        "{text}"
    );
    assert_eq!(files(there.path()), [there.path().join("c.gdpt")]);

    // With room, the same command writes the picture.
    let again = shell(&format!("mkdir {path}/results"), &arguments, there.path());
    assert!(again.status.success(), "{again:?}");
    assert!(there.path().join("results/out.exr").exists());
}

#[test]
fn a_full_disk_is_told_with_and_without_a_checkpoint() {
    // A limit on the size of files, which fails as a full disk does, for picture and checkpoint.
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().display();
    let before = format!("cd {path}; trap '' XFSZ; ulimit -f 20");
    for checkpoint in ["", "--checkpoint c.gdpt"] {
        let arguments = format!("--size 64x64 --spp 8 --quiet -o out.exr {checkpoint}");
        let text = error(&shell(&before, &arguments, folder.path()));
        assert!(text.contains("out.exr: cannot be written"), "{text}");
        // What is not there is not promised.
        assert!(!text.contains("--resume"), "{text}");
        let told = text.contains("the checkpoint cannot be written");
        assert_eq!(told, !checkpoint.is_empty(), "{text}");
        assert_eq!(files(folder.path()).len(), 0);
    }
}

#[test]
fn a_checkpoint_that_cannot_be_written_does_not_end_the_render() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().display();
    let before = format!("cd {path}; trap '' XFSZ; ulimit -f 60");
    let arguments = "--size 64x64 --spp 8 -o out.png --checkpoint c.gdpt --every 0.001s";
    let output = shell(&before, arguments, folder.path());
    assert!(output.status.success(), "{output:?}");
    let text = String::from_utf8(output.stderr).unwrap();
    assert!(text.contains("the checkpoint cannot be written"), "{text}");
    assert!(folder.path().join("out.png").exists());
    assert_eq!(files(folder.path()).len(), 1);
}

#[test]
fn what_is_too_large_is_refused_before_anything_is_allocated() {
    let folder = tempfile::tempdir().unwrap();
    for (flags, says) in [
        ("--size 16384x16384", "GB of memory"),
        ("--size 100000x3", "at most"),
        ("--spp 1000000000", "--spp must be from 1 to 16777216"),
    ] {
        let memory = sysinfo::System::new_all().total_memory();
        if says == "GB of memory" && memory > 100_000_000_000 {
            continue; // it fits
        }
        // 1.5 GB of address space would not be enough for what is asked.
        let output = shell(
            "ulimit -v 1500000",
            &format!("{flags} -o {}/o.exr", folder.path().display()),
            folder.path(),
        );
        let text = error(&output);
        assert!(text.contains(says), "{flags}: {text}");
        assert_eq!(
            text.lines().filter(|l| l.starts_with("error")).count(),
            1,
            "{text}"
        );
    }
}

#[test]
fn an_exr_that_announces_more_than_a_picture_can_be_is_refused() {
    // A header for 2^20 + 1 by 2^10 + 1 pixels over a small picture.
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("small.exr");
    let mut layers = gdpt::output::exr::Layers::default();
    layers.picture(&gdpt::image::Image::new(16, 16));
    layers.write(&path, 16, 16).unwrap();
    let mut bytes = fs::read(&path).unwrap();
    for window in [&b"dataWindow\0box2i\0"[..], b"displayWindow\0box2i\0"] {
        let at = bytes
            .windows(window.len())
            .position(|w| w == window)
            .unwrap();
        let corner = at + window.len() + 4 + 8;
        bytes[corner..corner + 4].copy_from_slice(&(1i32 << 20).to_le_bytes());
        bytes[corner + 4..corner + 8].copy_from_slice(&(1i32 << 10).to_le_bytes());
    }
    fs::write(&path, &bytes).unwrap();
    let error = gdpt::load::exr::load(&path).unwrap_err().to_string();
    assert!(error.contains("at most"), "{error}");
}
