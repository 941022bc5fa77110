//! The program in a shell: outputs that are links, pipes and devices, a standard output that is full or
//! closed, pictures without a name, several scenes.

use std::fs;
use std::os::unix::fs::FileTypeExt;
use std::path::Path;
use std::process::{Command, Output};
use tempfile::TempDir;

const OBJ: &str = "mtllib scene.mtl\n\
    v -1 0 -1\nv 1 0 -1\nv 1 0 1\nv -1 0 1\n\
    v -0.4 1.5 -0.4\nv 0.4 1.5 -0.4\nv 0.4 1.5 0.4\nv -0.4 1.5 0.4\n\
    usemtl floor\nf 4 3 2 1\nusemtl lamp\nf 5 6 7 8\n";
const MTL: &str = "newmtl floor\nKd 0.7 0.7 0.7\nnewmtl lamp\nKd 0 0 0\nKe 5 5 5\n";
const TOML: &str =
    "[camera]\norigin=[0,1.2,3.2]\ntarget=[0,0.6,0]\nfov=45\n[film]\nwidth=16\nheight=8\n";

/// A folder with a small scene.
fn scene() -> TempDir {
    let folder = TempDir::new().unwrap();
    for (name, text) in [("scene.obj", OBJ), ("scene.mtl", MTL), ("scene.toml", TOML)] {
        fs::write(folder.path().join(name), text).unwrap();
    }
    folder
}

/// Runs `script` in `folder`, where `$G` is the program and `$R` renders little and says nothing.
fn shell(folder: &TempDir, script: &str) -> Output {
    let gdpt = assert_cmd::cargo::cargo_bin("gdpt").display().to_string();
    Command::new("bash")
        .args(["-c", script])
        .current_dir(folder.path())
        .env("G", &gdpt)
        .env("R", format!("{gdpt} render scene.obj --spp 2 --quiet"))
        .env("TMPDIR", folder.path())
        .output()
        .unwrap()
}

/// The same, which must succeed; what was printed.
fn succeeds(folder: &TempDir, script: &str) -> Vec<u8> {
    let output = shell(folder, script);
    assert!(output.status.success(), "{script}: {output:?}");
    output.stdout
}

/// The same, which must fail with this exit code; the error.
fn fails(folder: &TempDir, script: &str, code: i32) -> String {
    let output = shell(folder, script);
    assert_eq!(output.status.code(), Some(code), "{script}: {output:?}");
    String::from_utf8(output.stderr).unwrap()
}

fn read(folder: &TempDir, name: &str) -> Vec<u8> {
    fs::read(folder.path().join(name)).unwrap()
}

fn kind(folder: &TempDir, name: &str) -> fs::FileType {
    let path = folder.path().join(name);
    fs::symlink_metadata(path).unwrap().file_type()
}

fn is_png(bytes: &[u8]) -> bool {
    image::load_from_memory_with_format(bytes, image::ImageFormat::Png).is_ok()
}

/// Names in the folder that are not the scene's.
fn others(folder: &TempDir) -> Vec<String> {
    let names = fs::read_dir(folder.path()).unwrap();
    let names = names.map(|f| f.unwrap().file_name().into_string().unwrap());
    let mut names: Vec<String> = names.filter(|n| !n.starts_with("scene.")).collect();
    names.sort();
    names
}

#[test]
fn a_link_goes_on_being_one_and_its_target_is_replaced() {
    let folder = scene();
    let script = "mkdir store; echo old > store/real.png; chmod 640 store/real.png\n\
        ln -s store/real.png a.png; ln -s a.png b.png; ln -s store/new.png c.png; ln store/real.png other\n\
        $R -o b.png && $R -o c.png";
    succeeds(&folder, script);
    for link in ["a.png", "b.png", "c.png"] {
        assert!(kind(&folder, link).is_symlink(), "{link}");
    }
    assert!(is_png(&read(&folder, "store/real.png")));
    assert_eq!(
        read(&folder, "store/real.png"),
        read(&folder, "store/new.png")
    );
    // By a rename, not in place; and as readable as before.
    assert_eq!(read(&folder, "other"), b"old\n");
    let mode = std::os::unix::fs::PermissionsExt::mode;
    let meta = fs::metadata(folder.path().join("store/real.png")).unwrap();
    assert_eq!(mode(&meta.permissions()) & 0o777, 0o640);
    // A link to the scene is no place for anything, nor one in a circle.
    let error = fails(&folder, "ln -s scene.obj d.png; $R -o d.png", 1);
    assert!(error.contains("two purposes"), "{error}");
    let error = fails(
        &folder,
        "ln -s f.png e.png; ln -s e.png f.png; $R -o e.png",
        1,
    );
    assert!(error.contains("links"), "{error}");
    assert_eq!(read(&folder, "scene.obj"), OBJ.as_bytes());
}

#[test]
fn pipes_get_whole_pictures_of_every_format() {
    let folder = scene();
    for (name, format) in [("pipe.png", ""), ("pipe", "--format exr"), ("pipe.jpg", "")] {
        let script = format!("mkfifo {name}; cat {name} > got & $R -o {name} {format} && wait");
        succeeds(&folder, &script);
        assert!(kind(&folder, name).is_fifo());
        let got = read(&folder, "got");
        let file = format!(
            "$R -o file.{}",
            if format.is_empty() { &name[5..] } else { "exr" }
        );
        succeeds(&folder, &file);
        let file = read(&folder, file.split(' ').next_back().unwrap());
        if format.is_empty() {
            assert_eq!(got, file, "{name}");
        } else {
            // The seconds that it took are in it.
            let [got, file] = [got, file].map(|bytes| {
                use exr::prelude::{ReadChannels, ReadLayers};
                let reader = exr::prelude::read()
                    .no_deep_data()
                    .largest_resolution_level();
                let reader = reader.all_channels().all_layers().all_attributes();
                reader
                    .from_buffered(std::io::Cursor::new(bytes))
                    .unwrap()
                    .layer_data
            });
            assert_eq!(got[0].channel_data, file[0].channel_data);
        }
    }
    // What has no name that says it is a PNG; also where the shell makes the pipe.
    succeeds(&folder, "$R -o >(cat > got); sleep 0.2");
    assert!(is_png(&read(&folder, "got")));
    let error = fails(&folder, "$R -o pipe.png --format jpg", 1);
    assert!(error.contains("--format"), "{error}");
}

#[test]
fn standard_output_has_the_output_alone() {
    let folder = scene();
    let png = succeeds(
        &folder,
        "$R -o file.png; $G render scene.obj --spp 2 -o - 2>said",
    );
    assert_eq!(png, read(&folder, "file.png"));
    let said = String::from_utf8(read(&folder, "said")).unwrap();
    assert!(said.contains("wrote standard output"), "{said}");
    // By any of its names, through links, behind what was printed before.
    for name in ["-", "/dev/stdout", "/dev/fd/1", "/proc/self/fd/1", "mine"] {
        let script = format!(
            "[ {name} = mine ] && ln -s /proc/self/fd/1 mine; echo head; $R -o {name}; echo tail"
        );
        for script in [script.clone(), format!("({script}) > got; cat got")] {
            let text = succeeds(&folder, &script);
            let text = text.strip_prefix(b"head\n").expect(name);
            let text = text.strip_suffix(b"tail\n").expect(name);
            assert_eq!(text, png, "{script}");
            let _ = fs::remove_file(folder.path().join("mine"));
        }
    }
    for command in [
        "$G info scene.obj --json -",
        "$R -o a.png --stats /dev/stdout",
        "$R -o a.exr; $G compare a.exr a.exr --json /dev/fd/1",
    ] {
        let json = succeeds(&folder, command);
        assert!(
            serde_json::from_slice::<serde_json::Value>(&json).is_ok(),
            "{command}"
        );
    }
    let error = fails(&folder, "$R -o - --stats /dev/stdout", 1);
    assert!(error.contains("two purposes"), "{error}");
}

#[test]
fn devices_and_open_files_are_written_into() {
    let folder = scene();
    succeeds(
        &folder,
        "$R -o /dev/null --stats /dev/null; [ -c /dev/null ]",
    );
    succeeds(
        &folder,
        "(echo head >&3; $R -o a.png --stats /dev/fd/3; echo tail >&3) 3>>log",
    );
    let log = String::from_utf8(read(&folder, "log")).unwrap();
    assert!(
        log.starts_with("head\n{") && log.ends_with("}\ntail\n"),
        "{log}"
    );
    let error = fails(&folder, "$R -o /dev/full", 1);
    assert!(error.contains("/dev/full: cannot be written"), "{error}");
    assert!(
        error.contains("scene.png"),
        "where the picture is instead: {error}"
    );
    assert_eq!(others(&folder).len(), 3, "{:?}", others(&folder));
    // Where something must be read again, they are refused.
    for place in ["/dev/null", "pipe"] {
        let script = format!("[ -e pipe ] || mkfifo pipe; $R -o a.png --checkpoint {place}");
        assert!(fails(&folder, &script, 1).contains("needs a file"));
    }
    let error = fails(&folder, "$R -o /dev/null --turntable 2 --format png", 1);
    assert!(error.contains("--turntable"), "{error}");
}

#[test]
fn a_checkpoint_is_kept_where_its_link_leads() {
    let folder = scene();
    let script = "mkdir store; ln -s store/c here; $R -o a.png --checkpoint here; \
        $G render scene.obj --quiet --spp 4 -o b.png --checkpoint here --resume; $R -o c.png --spp 4";
    succeeds(&folder, script);
    assert!(kind(&folder, "here").is_symlink() && kind(&folder, "store/c").is_file());
    assert_eq!(read(&folder, "b.png"), read(&folder, "c.png"));
}

#[test]
fn a_standard_output_that_is_full_or_closed_is_an_error() {
    let folder = scene();
    succeeds(&folder, "$R -o a.exr");
    for command in [
        "$G info scene.obj",
        "$G render scene.obj --spp 1 -o a.png",
        "$G render scene.obj --pixel 3,3",
        "$G compare a.exr a.exr",
        "$G reconstruct a.exr -o b.exr",
        "$G bench scene.obj --runs 1 --kilorays 1 --depth 2",
        "$G completions bash",
        "$G man",
        "$G help render",
        "$G render --help",
        "$G --version",
    ] {
        let error = fails(&folder, &format!("{command} > /dev/full"), 1);
        let last = error.lines().last().unwrap();
        assert!(
            last.starts_with("error: standard output: "),
            "{command}: {error}"
        );
        // A pipe whose reader is gone.
        let script = format!("mkfifo p; (: < p) & exec 3> p; wait; rm p; {command} >&3 2> said");
        fails(&folder, &script, 141);
        let said = String::from_utf8(read(&folder, "said")).unwrap();
        assert!(!said.contains("error"), "{command}: {said}");
    }
    // A picture that nobody takes is not lost.
    let script = "mkfifo p; (: < p) & exec 3> p; wait; rm p; $R -o - >&3";
    for script in [script, "$R -o - > /dev/full"] {
        let error = fails(&folder, script, 1);
        assert!(
            error.contains("standard output: cannot be written"),
            "{error}"
        );
        assert!(
            error.contains("-scene.png"),
            "where the picture is instead: {error}"
        );
    }
    // What could be written is.
    succeeds(
        &folder,
        "rm a.png; $G render scene.obj --spp 1 -o a.png > /dev/full || [ -s a.png ]",
    );
    // Nobody to tell is no reason to crash.
    fails(&folder, "$G info absent.obj 2> /dev/full", 1);
    fails(&folder, "$G render --frob 2> /dev/full", 2);
}

#[test]
fn without_a_name_a_picture_is_named_after_its_scene() {
    let folder = scene();
    succeeds(&folder, "$R; $R --format jpg; $R --format exr");
    assert!(is_png(&read(&folder, "scene.png")));
    assert!(read(&folder, "scene.jpg").starts_with(b"\xff\xd8"));
    assert!(read(&folder, "scene.exr").starts_with(b"\x76\x2f\x31\x01"));
    // What is there stays.
    fs::write(folder.path().join("scene.png"), "mine").unwrap();
    let error = fails(&folder, "$R", 1);
    assert!(
        error.contains("is there already") && error.contains("-o scene.png"),
        "{error}"
    );
    // The folder of the scene may have a texture of that name.
    let error = fails(
        &folder,
        "mkdir away; cd away; $G render ../scene.obj -o ..",
        1,
    );
    assert!(error.contains("is there already"), "{error}");
    assert_eq!(read(&folder, "scene.png"), b"mine");
    // In a folder that was named for it, the picture of an earlier call is replaced.
    let script = "for i in 1 2; do $R -o new/pictures/; $R -o new; $R --turntable 2 -o new; done";
    succeeds(&folder, script);
    for file in [
        "new/pictures/scene.png",
        "new/scene.png",
        "new/scene/001.png",
    ] {
        assert!(is_png(&read(&folder, file)), "{file}");
    }
    succeeds(&folder, "$R -o scene.png");
    assert!(is_png(&read(&folder, "scene.png")));
}

#[test]
fn of_several_scenes_one_that_fails_does_not_stop_the_others() {
    let folder = scene();
    fs::write(folder.path().join("broken.obj"), "v 1 2\nf 1 2 9\n").unwrap();
    fs::write(folder.path().join("other.obj"), OBJ).unwrap();
    let script = "$G render absent.obj scene.obj broken.obj other.obj --spp 1 --size 8x8 -o out/";
    let output = shell(&folder, script);
    assert_eq!(output.status.code(), Some(1), "{output:?}");
    let error = String::from_utf8(output.stderr).unwrap();
    for text in [
        "error: absent.obj",
        "error: broken.obj",
        "error: 2 of 4 scenes failed",
    ] {
        assert!(error.contains(text), "{text}: {error}");
    }
    let said = String::from_utf8(output.stdout).unwrap();
    assert!(
        said.contains("wrote out/scene.png") && said.contains("wrote out/other.png"),
        "{said}"
    );
    assert!(is_png(&read(&folder, "out/scene.png")) && is_png(&read(&folder, "out/other.png")));

    succeeds(&folder, "$G render scene.obj other.obj --spp 1 --quiet");
    assert!(is_png(&read(&folder, "other.png")));
    for (flags, says) in [
        ("-o out.png", "needs"),
        ("-o out/ --stats s.json", "--stats is for one scene"),
        ("--pixel 1,1", "--pixel is of one scene"),
    ] {
        let says = says.trim_start_matches("needs");
        let error = fails(
            &folder,
            &format!("$G render scene.obj other.obj {flags}"),
            1,
        );
        assert!(error.contains(says), "{flags}: {error}");
    }
    // Two scenes of one name would write one picture.
    let script = "mkdir a; cp other.obj a/; $G render other.obj a/other.obj -o out/";
    assert!(fails(&folder, script, 1).contains("two purposes"));
}

#[test]
fn jpeg_is_taken_wherever_png_is() {
    let folder = scene();
    let script = "$G render scene.obj --spp 16 --size 64 --quiet -o a.jpeg --preview b.JPG; \
        $G render scene.obj --spp 16 --size 64 --quiet -o a.exr --preview a.png; \
        $G reconstruct a.exr -o c.jpg --quiet; $G compare a.exr a.exr --heatmap d.jpg";
    succeeds(&folder, script);
    let open = |name: &str| image::open(folder.path().join(name)).unwrap().to_rgb8();
    let png = open("a.png");
    for name in ["a.jpeg", "b.JPG", "c.jpg"] {
        let jpeg = open(name);
        assert_eq!(jpeg.dimensions(), (64, 32));
        let off = jpeg
            .iter()
            .zip(png.iter())
            .map(|(&a, &b)| f64::from(a.abs_diff(b)));
        assert!(off.sum::<f64>() / (64.0 * 32.0 * 3.0) < 3.0, "{name}");
    }
    assert_eq!(open("d.jpg").dimensions(), (64, 32));
    let error = fails(&folder, "$R -o a.exr --preview b.exr", 1);
    assert!(error.contains("--preview writes a .png or .jpg"), "{error}");
}

#[test]
fn flags_are_read_as_they_are_meant() {
    let folder = scene();
    let size = |flags: &str| {
        succeeds(&folder, &format!("$R -o a.png {flags}"));
        image::image_dimensions(folder.path().join("a.png")).unwrap()
    };
    // A width takes the film's shape.
    assert_eq!(size("--size 40"), (40, 20));
    assert_eq!(size("--size 40x10"), (40, 10));
    // What is given last counts.
    assert_eq!(
        size("--size 40x10 --seed 1 --size 30 --seed 1 --quiet"),
        (30, 15)
    );
    succeeds(
        &folder,
        "$R -o b.png --up Z; $R -o c.png --up z; $R -o d.png --up -Y --up 0,0,1",
    );
    assert_eq!(read(&folder, "b.png"), read(&folder, "c.png"));
    assert_eq!(read(&folder, "b.png"), read(&folder, "d.png"));
    let error = fails(&folder, "$R --samples 3", 2);
    assert!(
        error.contains("'--spp'") && !error.contains("'--sample'"),
        "{error}"
    );
    assert!(
        !error.contains("Usage"),
        "a usage of what was not meant: {error}"
    );
    assert!(fails(&folder, "$R --spp=", 2).contains("--spp"));
    assert!(fails(&folder, "$G scene.obj", 2).contains("gdpt render scene.obj"));
}

#[test]
fn outputs_that_cannot_be_are_refused_before_rendering() {
    let folder = scene();
    for (output, says) in [
        ("nowhere/a.png", "does not exist"),
        ("a.bmp", "must be .exr, .png or .jpg"),
        ("picture", "must be .exr, .png or .jpg"),
        ("/dev/fd/77", "cannot be written"),
    ] {
        let error = fails(&folder, &format!("$R --spp 10000000 -o {output}"), 1);
        assert!(error.contains(says), "{output}: {error}");
    }
    assert_eq!(others(&folder), Vec::<String>::new());
    assert!(!Path::new("/dev/fd/77").exists());
}
