//! Renders that are killed and go on: the same bits as without.

use assert_cmd::cargo::cargo_bin;
use gdpt::load::exr::{self, ExrFile};
use std::fs;
use std::path::Path;
use std::process::{Command, Output, Stdio};
use std::thread::sleep;
use std::time::Duration;

/// A render of 96x64 pixels, 40 samples, into `folder`.
fn command(folder: &Path, more: &[&str]) -> Command {
    let mut command = Command::new(cargo_bin!("gdpt"));
    let fixed = [
        "render",
        "scenes/glossy.obj",
        "--size",
        "96x64",
        "--spp",
        "40",
        "--quiet",
    ];
    command.args(fixed).args(more);
    command.arg("-o").arg(folder.join("out.exr"));
    command.arg("--checkpoint").arg(folder.join("c.gdpt"));
    command
}

fn run(folder: &Path, more: &[&str]) -> Output {
    command(folder, more).output().unwrap()
}

fn error(output: &Output) -> String {
    assert!(!output.status.success());
    let text = String::from_utf8(output.stderr.clone()).unwrap();
    assert_eq!(text.lines().count(), 1, "{text}");
    text
}

fn picture(folder: &Path) -> ExrFile {
    exr::load(&folder.join("out.exr")).unwrap()
}

fn assert_same_bits(a: &ExrFile, b: &ExrFile) {
    let bits = |file: &ExrFile| -> Vec<(String, Vec<u32>)> {
        let channels = file.channels.iter();
        let bits = |values: &Vec<f32>| values.iter().map(|v| v.to_bits()).collect();
        channels
            .map(|(name, values)| (name.clone(), bits(values)))
            .collect()
    };
    assert!(bits(a) == bits(b), "pixels differ");
}

#[test]
fn a_render_killed_at_any_moment_ends_with_the_same_bits() {
    let whole = tempfile::tempdir().unwrap();
    let output = run(whole.path(), &[]);
    assert!(output.status.success(), "{output:?}");
    let expected = picture(whole.path());

    // With a checkpoint after every pass most kills are during a write. One process after another, each
    // killed a little later than the one before, until one comes to its end.
    let folder = tempfile::tempdir().unwrap();
    let mut kills = 0;
    for attempt in 0..200 {
        let flags = ["--every", "0.001s", "--resume"];
        let mut child = command(folder.path(), &flags)
            .stderr(Stdio::null())
            .spawn()
            .unwrap();
        sleep(Duration::from_millis(20 + 7 * attempt));
        // SIGKILL on Unix.
        child.kill().unwrap();
        if child.wait().unwrap().success() {
            break;
        }
        kills += 1;
    }
    assert!(kills >= 5, "only {kills} kills");
    assert_same_bits(&picture(folder.path()), &expected);
    assert_eq!(
        picture(folder.path()).texts["gdpt.samples"],
        expected.texts["gdpt.samples"]
    );
}

#[test]
fn more_samples_go_on_from_a_finished_render() {
    let folder = tempfile::tempdir().unwrap();
    let folder = folder.path();
    assert!(
        run(folder, &["--seed", "3", "--threads", "1"])
            .status
            .success()
    );

    // Nothing is left to do, but for the picture, here with another reconstruction.
    let again = run(folder, &["--seed", "3", "--resume", "--reconstruct", "l2"]);
    assert!(again.status.success(), "{again:?}");

    let render = |more: &[&str]| {
        let mut command = Command::new(cargo_bin!("gdpt"));
        let fixed = [
            "render",
            "scenes/glossy.obj",
            "--size",
            "96x64",
            "--seed",
            "3",
        ];
        command.args(fixed).args(["--spp", "64"]).args(more);
        command.arg("-o").arg(folder.join("out.exr"));
        let output = command.output().unwrap();
        assert!(output.status.success());
        String::from_utf8(output.stderr).unwrap()
    };
    let checkpoint = folder.join("c.gdpt");
    // Not from 41: the last pass was cut short, and sums are grouped by passes.
    let text = render(&["--resume", "--checkpoint", checkpoint.to_str().unwrap()]);
    assert!(text.contains("going on from 40 samples"), "{text}");
    let resumed = picture(folder);

    render(&[]);
    assert_same_bits(&resumed, &picture(folder));
}

#[test]
fn what_does_not_fit_is_refused_and_named() {
    let folder = tempfile::tempdir().unwrap();
    let folder = folder.path();
    assert!(run(folder, &[]).status.success());
    assert!(error(&run(folder, &[])).contains("--resume goes on from it"));
    for (flags, says) in [
        (&["--seed", "5"][..], "its seed is 0, this one's is 5"),
        (&["--depth", "3"], "its depth is 12, this one's is 3"),
        (&["--method", "pt"], "its method is gpt, this one's is pt"),
        (&["--sampler", "independent"], "its sampler is sobol"),
        (&["--fov", "20"], "its scene is"),
        (
            &["--backend", "bvh"],
            if cfg!(feature = "embree") {
                "its backend is embree"
            } else {
                ""
            },
        ),
    ] {
        let output = run(folder, &[flags, &["--resume"]].concat());
        if !says.is_empty() {
            assert!(error(&output).contains(says), "{flags:?}: {output:?}");
        }
    }
}

#[test]
fn damage_is_detected() {
    let folder = tempfile::tempdir().unwrap();
    let folder = folder.path();
    assert!(run(folder, &[]).status.success());
    let place = folder.join("c.gdpt");
    let good = fs::read(&place).unwrap();
    let refused = |bytes: &[u8], says: &str| {
        fs::write(&place, bytes).unwrap();
        let text = error(&run(folder, &["--resume"]));
        assert!(text.contains(says), "{text}");
    };
    for length in [0, 5] {
        refused(&good[..length], "is no checkpoint of this program");
    }
    for length in [20, 30, 400, good.len() / 2, good.len() - 1] {
        refused(&good[..length], "is damaged");
    }
    refused(&[&good[..], b"x"].concat(), "is damaged");
    refused(b"something else, but long enough", "is no checkpoint");
    for place in [19, good.len() / 3, good.len() - 9, good.len() - 1] {
        let mut bad = good.clone();
        bad[place] ^= 0x10;
        refused(&bad, "is damaged");
    }
    // A header that announces 2^60 bytes allocates nothing.
    let mut bad = good.clone();
    bad[18..26].copy_from_slice(&(1u64 << 60).to_le_bytes());
    refused(&bad, "its header makes no sense");

    // While another process has it, nobody else does.
    fs::write(&place, &good).unwrap();
    let lock = fs::File::create(folder.join("c.gdpt.lock")).unwrap();
    lock.lock().unwrap();
    assert!(error(&run(folder, &["--resume"])).contains("another render is writing"));
    drop(lock);

    // What a kill left behind of the next checkpoint does not matter, and goes.
    fs::write(&place, &good).unwrap();
    let part = folder.join("c.gdpt.part");
    fs::write(&part, &good[..100]).unwrap();
    assert!(run(folder, &["--resume"]).status.success());
    assert!(!part.exists());
}

#[test]
fn time_counts_what_was_rendered_before() {
    let folder = tempfile::tempdir().unwrap();
    let place = |name: &str| folder.path().join(name);
    let render = || {
        let mut command = Command::new(cargo_bin!("gdpt"));
        command.args([
            "render",
            "scenes/glossy.obj",
            "--size",
            "64x64",
            "--quiet",
            "--resume",
        ]);
        command
            .args(["--time", "0.4s", "--checkpoint"])
            .arg(place("c"));
        command
            .arg("--stats")
            .arg(place("s.json"))
            .arg("-o")
            .arg(place("o.png"));
        assert!(command.output().unwrap().status.success());
        let stats = fs::read(place("s.json")).unwrap();
        let stats: serde_json::Value = serde_json::from_slice(&stats).unwrap();
        let seconds = stats["seconds_tracing"].as_f64().unwrap();
        (
            stats["samples"].as_u64().unwrap(),
            seconds,
            stats["rays"].clone(),
        )
    };
    let (samples, seconds, rays) = render();
    assert!(samples > 0 && seconds >= 0.4);
    let (again, _, rays_again) = render();
    assert_eq!((again, rays_again), (samples, rays));
}
