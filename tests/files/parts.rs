//! Renders in parts and crops, and their merge: the same picture, whatever is killed; what does not belong is refused.

use assert_cmd::cargo::cargo_bin;
use gdpt::load::exr::{self, ExrFile};
use std::fs;
use std::path::{Path, PathBuf};
use std::process::{Command, Output, Stdio};
use std::thread::sleep;
use std::time::Duration;

const FIXED: [&str; 5] = ["render", "scenes/glossy.obj", "--size", "80x60", "--quiet"];

fn render(folder: &Path, output: &str, more: &[&str]) -> Command {
    let mut command = Command::new(cargo_bin!("gdpt"));
    command
        .args(FIXED)
        .args(more)
        .arg("-o")
        .arg(folder.join(output));
    command
}

fn rendered(folder: &Path, output: &str, more: &[&str]) -> PathBuf {
    let done = render(folder, output, more).output().unwrap();
    assert!(done.status.success(), "{done:?}");
    folder.join(output)
}

/// Merges into `merged.exr`.
fn merge(folder: &Path, parts: &[&Path], more: &[&str]) -> Output {
    let _ = fs::remove_file(folder.join("merged.exr"));
    let mut command = Command::new(cargo_bin!("gdpt"));
    command.arg("merge").args(parts).args(more);
    command
        .arg("-o")
        .arg(folder.join("merged.exr"))
        .output()
        .unwrap()
}

fn merged(folder: &Path, parts: &[&Path], more: &[&str]) -> ExrFile {
    let done = merge(folder, parts, more);
    assert!(done.status.success(), "{done:?}");
    exr::load(&folder.join("merged.exr")).unwrap()
}

/// The one line of an error, which names a file or says `what`; nothing is written.
fn refused(folder: &Path, parts: &[&Path], what: &[&str]) {
    let done = merge(folder, parts, &[]);
    assert_eq!(done.status.code(), Some(1), "{done:?}");
    let text = String::from_utf8(done.stderr).unwrap();
    assert_eq!(text.lines().count(), 1, "{text}");
    for what in what {
        assert!(text.contains(what), "{what} is not in: {text}");
    }
    assert!(!folder.join("merged.exr").exists());
}

fn bits(file: &ExrFile) -> Vec<(&String, Vec<u32>)> {
    let bits = |values: &Vec<f32>| values.iter().map(|v| v.to_bits()).collect();
    file.channels
        .iter()
        .map(|(name, values)| (name, bits(values)))
        .collect()
}

/// The layers of sums are the same but for rounding, and so is the picture.
fn assert_close(a: &ExrFile, b: &ExrFile) {
    assert!(a.channels.keys().eq(b.channels.keys()));
    for (name, a) in &a.channels {
        let b = &b.channels[name];
        let largest = b.iter().fold(0.0f32, |m, v| m.max(v.abs()));
        // What a solve of nearly the same makes differs more than the sums; the estimated error is the difference of
        // two of them.
        let solved = ["R", "G", "B"].contains(&name.as_str()) || name.starts_with("error.");
        let tolerance = if solved { 1e-5 } else { 1e-6 } * largest;
        for (a, b) in a.iter().zip(b) {
            assert!((a - b).abs() <= tolerance, "{name}: {a} against {b}");
        }
    }
    assert_eq!(a.texts["gdpt.samples"], b.texts["gdpt.samples"]);
}

#[test]
fn parts_make_the_picture_of_one_render() {
    let folder = tempfile::tempdir().unwrap();
    let folder = folder.path();
    // Not a multiple of the parts, nor of passes.
    let spp = ["--spp", "30", "--filter", "mitchell"];
    let one = exr::load(&rendered(folder, "one.exr", &spp)).unwrap();
    let part = |k: u32| {
        let part = format!("{k}/4");
        let flags = [&spp[..], &["--part", &part]].concat();
        rendered(folder, &format!("{k}.gdpt"), &flags)
    };
    let [a, b, c, d] = [1, 2, 3, 4].map(part);
    let all = merged(folder, &[&a, &b, &c, &d], &[]);
    assert_close(&all, &one);
    // In any order the same bits.
    let again = merged(folder, &[&d, &b, &a, &c], &["--threads", "1"]);
    assert!(bits(&again) == bits(&all));
    // All of it in one part is that render, to the bit.
    let flags = [&spp[..], &["--part", "1/1"]].concat();
    let whole = rendered(folder, "whole.gdpt", &flags);
    assert!(bits(&merged(folder, &[&whole], &[])) == bits(&one));
    // With any reconstruction.
    let l1 = merged(folder, &[&whole], &["--reconstruct", "l1"]);
    let flags = [&spp[..], &["--reconstruct", "l1"]].concat();
    let one = exr::load(&rendered(folder, "l1.exr", &flags)).unwrap();
    assert!(bits(&l1) == bits(&one));
    assert_eq!(l1.texts["gdpt.reconstruct"], "l1");

    // Something is missing.
    refused(folder, &[&a, &d], &["part 2-3 of 4 missing", "--partial"]);
    let some = merged(folder, &[&a, &d], &["--partial"]);
    assert_eq!(some.texts["gdpt.samples"], "14");
    let warned = merge(folder, &[&a, &d], &["--partial", "--strict"]);
    assert_eq!(warned.status.code(), Some(1));
}

#[test]
fn crops_make_the_picture_of_one_render() {
    let folder = tempfile::tempdir().unwrap();
    let folder = folder.path();
    let spp = ["--spp", "16"];
    let one = exr::load(&rendered(folder, "one.exr", &spp)).unwrap();
    // Borders off the tiles', one of a single column.
    let crops = ["0,0,33,25", "33,0,80,25", "0,25,1,60", "1,25,80,60"];
    let mut parts = Vec::new();
    for (c, crop) in crops.iter().enumerate() {
        for part in ["1/2", "2/2"] {
            let name = format!("{c}-{}.gdpt", &part[..1]);
            let flags = [&spp[..], &["--crop", crop, "--part", part]].concat();
            parts.push(rendered(folder, &name, &flags));
        }
    }
    let all: Vec<&Path> = parts.iter().map(PathBuf::as_path).collect();
    assert_close(&merged(folder, &all, &[]), &one);

    // What is missing, and what is of it there.
    refused(
        folder,
        &all[1..],
        &["part 1 of 2 of the crop 0,0,33,25 missing"],
    );
    refused(folder, &all[2..], &["the crops leave gaps"]);
    refused(folder, &all[..4], &["only the crop 0,0,80,25 of 80x60"]);
    let upper = merged(folder, &all[1..4], &["--partial"]);
    assert_eq!((upper.size, upper.picture), ((80, 25), (80, 60)));
    assert_eq!(upper.texts["gdpt.samples"], "8");

    // Crops with pixels in common.
    let flags = [&spp[..], &["--crop", "30,0,80,25", "--part", "1/2"]].concat();
    let other = rendered(folder, "other.gdpt", &flags);
    refused(
        folder,
        &[&all[..], &[&other]].concat(),
        &["pixels", "other.gdpt"],
    );
}

/// As a picture, a crop has the pixels of the whole, at their place.
#[test]
fn a_crop_is_a_piece_of_the_picture() {
    let folder = tempfile::tempdir().unwrap();
    let folder = folder.path();
    let whole = exr::load(&rendered(folder, "whole.exr", &["--spp", "8"])).unwrap();
    let crop = rendered(folder, "crop.exr", &["--spp", "8", "--crop", "20,7,57,40"]);
    let file = exr::load(&crop).unwrap();
    assert_eq!(
        (file.size, file.position, file.picture),
        ((37, 33), (20, 7), (80, 60))
    );
    for name in [
        "primal.G", "direct.R", "albedo.B", "depth.Z", "dx.R", "dy.G",
    ] {
        for (index, value) in file.channels[name].iter().enumerate() {
            let (x, y) = (index % 37, index / 37);
            // Differences across the border are not known.
            let cut = name == "dx.R" && x == 36 || name == "dy.G" && y == 32;
            let there = whole.channels[name][(y + 7) * 80 + x + 20];
            let wanted = if cut { 0.0 } else { there };
            assert_eq!(value.to_bits(), wanted.to_bits(), "{name} at {x}, {y}");
        }
    }
    // Its place is kept when it is made again.
    let mut again = Command::new(cargo_bin!("gdpt"));
    again
        .arg("reconstruct")
        .arg(&crop)
        .args(["--quiet", "--reconstruct", "l2", "-o"]);
    let place = folder.join("again.exr");
    assert!(again.arg(&place).status().unwrap().success());
    assert_eq!(exr::load(&place).unwrap().position, (20, 7));
    // Nothing outside of the picture.
    let outside = render(folder, "x.png", &["--crop", "0,0,81,60"])
        .output()
        .unwrap();
    assert_eq!(outside.status.code(), Some(1), "{outside:?}");
}

/// Killed by SIGKILL, and told to end by SIGTERM: each time the part goes on, to the same bits.
#[test]
fn a_part_that_is_ended_goes_on() {
    let folder = tempfile::tempdir().unwrap();
    let folder = folder.path();
    let flags = [
        "--spp",
        "600",
        "--part",
        "2/3",
        "--every",
        "0.05s",
        "--threads",
        "1",
    ];
    let undisturbed = rendered(folder, "undisturbed.gdpt", &flags);
    let flags = [&flags[..], &["--resume"]].concat();
    let (mut kills, mut ends) = (0, 0);
    loop {
        let mut child = render(folder, "part.gdpt", &flags)
            .stderr(Stdio::null())
            .spawn()
            .unwrap();
        // Longer each time: on a busy machine a signal may come before anybody minds it.
        sleep(Duration::from_millis(250 + 50 * (kills + ends)));
        if kills == 0 {
            child.kill().unwrap();
        } else {
            let id = child.id().to_string();
            assert!(Command::new("kill").args(["-TERM", &id]).status().is_ok());
        }
        match child.wait().unwrap().code() {
            Some(0) => break,
            Some(75) => ends += 1,
            None => kills += 1,
            Some(other) => panic!("ended with {other}"),
        }
    }
    assert!(kills > 0 && ends > 0, "{kills} kills, {ends} ends");
    let part = folder.join("part.gdpt");
    let merged = |file: &Path| merged(folder, &[file], &["--partial"]);
    assert!(bits(&merged(&part)) == bits(&merged(&undisturbed)));
    // A part that is done stays as it is.
    let before = fs::read(&part).unwrap();
    rendered(folder, "part.gdpt", &flags);
    assert!(fs::read(&part).unwrap() == before);
    // A part that is there is not written over.
    let again = render(folder, "part.gdpt", &flags[..flags.len() - 1])
        .output()
        .unwrap();
    assert_eq!(again.status.code(), Some(1));
    assert!(fs::read(&part).unwrap() == before);
}

#[test]
fn what_does_not_belong_is_refused() {
    let folder = tempfile::tempdir().unwrap();
    let folder = folder.path();
    let spp = ["--spp", "16"];
    let part = |name: &str, more: &[&str]| rendered(folder, name, &[&spp[..], more].concat());
    let [a, b, c, d] =
        ["1/4", "2/4", "3/4", "4/4"].map(|k| part(&format!("{}.gdpt", &k[..1]), &["--part", k]));
    let with = |other: &Path, what: &[&str]| refused(folder, &[&a, &b, &c, other], what);

    // Twice, also as a copy.
    let copy = folder.join("copy.gdpt");
    fs::copy(&a, &copy).unwrap();
    refused(folder, &[&a, &b, &c, &d, &copy], &["copy.gdpt", "1.gdpt"]);
    // Of another render: of another scene, settings, number of parts or samples.
    with(
        &part("seed.gdpt", &["--part", "4/4", "--seed", "1"]),
        &["seed.gdpt", "seed is 1"],
    );
    with(
        &part("depth.gdpt", &["--part", "4/4", "--depth", "3"]),
        &["depth.gdpt", "depth is 3"],
    );
    with(
        &part("fov.gdpt", &["--part", "4/4", "--fov", "30"]),
        &["fov.gdpt", "its scene is"],
    );
    with(
        &part("three.gdpt", &["--part", "3/3"]),
        &["three.gdpt", "number of parts is 3"],
    );
    let more = rendered(folder, "more.gdpt", &["--spp", "32", "--part", "4/4"]);
    with(&more, &["more.gdpt", "spp is 32"]);
    // Damaged: cut short, with a byte changed, empty, no film at all, of a later version.
    let bytes = fs::read(&d).unwrap();
    let damaged = |name: &str, bytes: &[u8], what: &str| {
        let file = folder.join(name);
        fs::write(&file, bytes).unwrap();
        with(&file, &[name, what]);
    };
    damaged("short.gdpt", &bytes[..bytes.len() - 100], "damaged");
    damaged("header.gdpt", &bytes[..40], "damaged");
    let mut changed = bytes.clone();
    changed[bytes.len() / 2] ^= 1;
    damaged("changed.gdpt", &changed, "checksum");
    damaged("empty.gdpt", b"", "no checkpoint");
    damaged(
        "picture.gdpt",
        b"\x89PNG\r\n\x1a\nabcdefghijklmnop",
        "no checkpoint",
    );
    let text = b"gdpt checkpoint 5\n";
    assert_eq!(bytes[..text.len()], text[..]);
    let later = [&b"gdpt checkpoint 99\n"[..], &bytes[text.len()..]].concat();
    damaged("later.gdpt", &later, "its format is 99");
    // Not there.
    with(&folder.join("none.gdpt"), &["none.gdpt"]);
    // And with the right one all is well.
    merged(folder, &[&a, &b, &c, &d], &[]);
}

#[test]
fn two_merges_at_once_do_no_harm() {
    let folder = tempfile::tempdir().unwrap();
    let folder = folder.path();
    let part = |k: &str| {
        rendered(
            folder,
            &format!("{}.gdpt", &k[..1]),
            &["--spp", "8", "--part", k],
        )
    };
    let parts = ["1/2", "2/2"].map(part);
    let start = || {
        let mut command = Command::new(cargo_bin!("gdpt"));
        command.arg("merge").args(&parts).args(["--quiet", "-o"]);
        command.arg(folder.join("merged.exr")).spawn().unwrap()
    };
    let mut running = [start(), start(), start(), start()];
    for child in &mut running {
        assert!(child.wait().unwrap().success());
    }
    let both = exr::load(&folder.join("merged.exr")).unwrap();
    let alone = merged(folder, &[&parts[0], &parts[1]], &[]);
    assert!(bits(&both) == bits(&alone));
}

/// With a time alone each part has a sequence of its own, and takes what fits; parts that hold different numbers of
/// samples make one picture.
#[test]
fn parts_of_a_time_are_merged() {
    let folder = tempfile::tempdir().unwrap();
    let folder = folder.path();
    let part = |k: &str, time: &str| {
        let flags = ["--time", time, "--part", k, "--threads", "1"];
        rendered(folder, &format!("{}.gdpt", &k[..1]), &flags)
    };
    let parts = [
        part("1/3", "0.2s"),
        part("2/3", "0.8s"),
        part("3/3", "0.4s"),
    ];
    let parts: Vec<&Path> = parts.iter().map(PathBuf::as_path).collect();
    let samples = |parts: &[&Path], more: &[&str]| -> u64 {
        merged(folder, parts, more).texts["gdpt.samples"]
            .parse()
            .unwrap()
    };
    let [a, b, c] = [0, 1, 2].map(|k| samples(&parts[k..=k], &["--partial"]));
    assert_eq!(samples(&parts, &[]), a + b + c);
    let primal =
        |k: usize| merged(folder, &parts[k..=k], &["--partial"]).channels["primal.R"].clone();
    assert!(primal(0) != primal(1));
}

#[test]
fn what_makes_no_sense_is_said_before_anything_is_rendered() {
    let folder = tempfile::tempdir().unwrap();
    let folder = folder.path();
    let cases: [(&str, &[&str], &str); 13] = [
        ("a.gdpt", &["--spp", "8", "--time", "1s"], "--time"),
        ("a.gdpt", &["--crop", "0,0,9,9", "--time", "1s"], "--crop"),
        ("a.gdpt", &["--denoise"], "--denoise"),
        ("a.gdpt", &["--part", "16/16", "--spp", "61"], "--spp 64"),
        ("a.png", &["--part", "1/4"], ".gdpt"),
        ("a.gdpt", &["--part", "1/4", "--spp", "12"], "--spp 16"),
        ("a.gdpt", &["--error", "0.1"], "--error"),
        ("a.gdpt", &["--preview", "b.png"], "--preview"),
        ("a.png", &["--resume"], "--checkpoint"),
        ("a.gdpt", &["--turntable", "4"], "--frame"),
        (
            "a.png",
            &["--turntable", "4", "--frame", "4"],
            "from 0 to 3",
        ),
        ("a.gdpt", &["--part", "5/4"], "--part"),
        ("a.gdpt", &["--crop", "5,5,5,9"], "--crop"),
    ];
    for (output, flags, what) in cases {
        let done = render(folder, output, flags).output().unwrap();
        assert!(!done.status.success(), "{flags:?}");
        let text = String::from_utf8(done.stderr).unwrap();
        assert!(text.contains(what), "{flags:?}: {text}");
        assert!(!folder.join(output).exists());
    }
}

/// A part that another process renders is not rendered twice at once; later it may be.
#[test]
fn a_part_is_rendered_once_at_a_time() {
    let folder = tempfile::tempdir().unwrap();
    let folder = folder.path();
    let flags = ["--spp", "4000", "--part", "1/2", "--resume"];
    let mut first = render(folder, "a.gdpt", &flags)
        .stderr(Stdio::null())
        .spawn()
        .unwrap();
    let lock = folder.join("a.gdpt.lock");
    while !lock.exists() {
        sleep(Duration::from_millis(10));
    }
    let second = render(folder, "a.gdpt", &flags).output().unwrap();
    assert_eq!(second.status.code(), Some(75), "{second:?}");
    first.kill().unwrap();
    first.wait().unwrap();
    // Both files are looked after where there are two.
    fs::write(folder.join("b.gdpt"), "mine").unwrap();
    let checkpoint = folder.join("c.gdpt");
    let two = ["--spp", "4", "--checkpoint", checkpoint.to_str().unwrap()];
    let refused = render(folder, "b.gdpt", &two).output().unwrap();
    assert_eq!(refused.status.code(), Some(1), "{refused:?}");
    assert_eq!(fs::read(folder.join("b.gdpt")).unwrap(), b"mine");
}

/// Films that machines of two kinds have made are merged, and it is said. Pictures over two backgrounds are none.
#[test]
fn parts_of_other_machines_are_told() {
    use gdpt::checkpoint::{self, Opened};
    use gdpt::film::Film;
    use gdpt::render::TILE_SIZE;
    let folder = tempfile::tempdir().unwrap();
    let folder = folder.path();
    let part = |k: &str| {
        rendered(
            folder,
            &format!("{}.gdpt", &k[..1]),
            &["--spp", "8", "--part", k],
        )
    };
    let [a, b] = ["1/2", "2/2"].map(part);
    let alone = merged(folder, &[&a, &b], &[]);
    let with_other = |processor: &str, background: &str| {
        let mut header = Opened::open(&b).unwrap().header;
        let mut film = Film::of(header.share.window, TILE_SIZE);
        checkpoint::load(&b, &header.identity, &mut film).unwrap();
        header.about.processor = processor.to_owned();
        header.about.background = background.to_owned();
        checkpoint::save(&folder.join("other.gdpt"), &header, &film).unwrap();
    };
    let other = folder.join("other.gdpt");
    with_other("Another One", "environment");
    let told = merge(folder, &[&a, &other], &[]);
    assert!(told.status.success(), "{told:?}");
    let text = String::from_utf8(told.stderr).unwrap();
    assert!(
        text.contains("different processors") && text.contains("Another One"),
        "{text}"
    );
    let both = exr::load(&folder.join("merged.exr")).unwrap();
    assert!(bits(&both) == bits(&alone));
    with_other("", "0.1,0.2,0.3");
    refused(folder, &[&a, &other], &["background"]);
}

/// Names of films that are made up tell parts and crops apart.
#[test]
fn films_have_names_of_their_own() {
    let folder = tempfile::tempdir().unwrap();
    let place = format!("{}/", folder.path().display());
    for (flags, name) in [
        (
            &["--part", "3/12", "--spp", "48"][..],
            "glossy-03-of-12.gdpt",
        ),
        (
            &["--part", "1/2", "--crop", "0,0,9,8", "--spp", "8"],
            "glossy-0-0-9-8-1-of-2.gdpt",
        ),
        (&["--crop", "0,0,9,8", "--spp", "1"], "glossy-0-0-9-8.png"),
    ] {
        let mut command = Command::new(cargo_bin!("gdpt"));
        command.args(FIXED).args(flags).args(["-o", &place]);
        assert!(command.status().unwrap().success());
        assert!(folder.path().join(name).exists(), "{name}");
    }
}

/// Frames rendered one by one are those of all at once. Where their exposure is metered it is the same for all of them.
#[test]
fn a_frame_is_one_of_the_turntable() {
    let folder = tempfile::tempdir().unwrap();
    let folder = folder.path();
    let flags = ["--spp", "4", "--turntable", "3", "--exposure", "1.5"];
    let done = render(folder, "all.png", &flags).output().unwrap();
    assert!(done.status.success(), "{done:?}");
    let mut metered = Vec::new();
    for frame in ["2", "0"] {
        let one = [&flags[..], &["--frame", frame]].concat();
        let done = render(folder, "one.png", &one).output().unwrap();
        assert!(done.status.success(), "{done:?}");
        let name = format!("00{frame}.png");
        let bytes = |of: &str| fs::read(folder.join(of).join(&name)).unwrap();
        assert!(bytes("one") == bytes("all"), "frame {frame}");
        let stats = folder.join("stats.json");
        let auto = ["--exposure", "auto", "--stats", stats.to_str().unwrap()];
        let done = render(folder, "auto.png", &[&one[..], &auto].concat())
            .output()
            .unwrap();
        assert!(done.status.success(), "{done:?}");
        let text = fs::read_to_string(stats).unwrap();
        let exposure = text.lines().find(|l| l.contains("\"exposure\"")).unwrap();
        metered.push(exposure.to_owned());
    }
    assert_eq!(metered[0], metered[1]);
    assert!(!folder.join("one/001.png").exists());
    // A part of a view.
    let flags = [&flags[..4], &["--frame", "1", "--part", "1/1"]].concat();
    let part = rendered(folder, "view.gdpt", &flags);
    let view = merged(folder, &[&part], &[]);
    let exr = ["--spp", "4", "--turntable", "3", "--frame", "1"];
    assert!(render(folder, "exr.exr", &exr).status().unwrap().success());
    assert!(bits(&view) == bits(&exr::load(&folder.join("exr/001.exr")).unwrap()));
}
