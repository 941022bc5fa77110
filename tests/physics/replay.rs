//! `--pixel` and `--sample`: the sample that is told is the one that was rendered.

use crate::common::{shipped, tracer};
use assert_cmd::Command;
use gdpt::filter::Filter;
use gdpt::gradient::Weights;
use gdpt::path::replay::replay;
use gdpt::path::{Manifold, PathSettings, PathTracer, Shares, Tile};
use gdpt::sampler::{self, SamplerKind};
use gdpt::sums::TileSums;

#[test]
fn a_replayed_sample_has_the_bits_of_the_render() {
    const SIZE: u32 = 24;
    for name in ["cornell", "glossy", "mirrors", "caustic", "furnace"] {
        let scene = shipped(name, SIZE, SIZE);
        let tracer = tracer(&scene);
        let mut told = 0;
        for (seed, weights) in [(3, Weights::Mis), (4, Weights::Symmetric)] {
            let settings = PathSettings {
                depth: 12,
                seed,
                sampler: SamplerKind::Sobol,
                weights,
                filter: Filter::Box,
                manifold: Manifold::Auto,
            };
            let tile = Tile {
                x: 0,
                y: 0,
                width: SIZE,
                height: SIZE,
            };
            let walks = Shares::learn(&scene, &*tracer, &settings);
            for sample in [0, 5] {
                let mut sums = TileSums::default();
                sums.reset((SIZE * SIZE) as usize);
                let mut paths = PathTracer::<4>::new(walks);
                paths.render(
                    &scene,
                    &*tracer,
                    &settings,
                    tile,
                    sample..sample + 1,
                    &mut sums,
                );
                for (index, pixel) in sums.pixels.iter().enumerate() {
                    let (x, y) = (index as u32 % SIZE, index as u32 / SIZE);
                    let again = replay::<4>(&scene, &*tracer, &settings, (x, y), sample);
                    let rendered = &pixel.halves[sampler::half(sample)];
                    let what = format!("{name} {x},{y} sample {sample}");
                    assert_eq!(again.sample.primal, rendered.primal, "{what}");
                    assert_eq!(again.sample.direct, rendered.direct, "{what}");
                    assert_eq!(again.sample.to, rendered.to, "{what}");
                    told += again.lines.len();
                }
            }
        }
        assert!(told > 10_000, "{name}: {told} lines");
    }
}

#[test]
fn the_command_tells_a_sample_and_refuses_what_is_outside() {
    let run = |flags: &[&str]| {
        let mut command = Command::cargo_bin("gdpt").unwrap();
        let fixed = ["render", "scenes/mirrors.obj", "--size", "40x30"];
        let output = command.args(fixed).args(flags).output().unwrap();
        let text = |bytes| String::from_utf8(bytes).unwrap();
        (
            output.status.success(),
            text(output.stdout),
            text(output.stderr),
        )
    };
    let (done, text, error) = run(&["--pixel", "20,15", "--sample", "2"]);
    assert!(done, "{error}");
    for word in [
        "pixel 20,15, sample 2, seed 0",
        "x1: the camera sees",
        "|T'|",
        "the sample:",
    ] {
        assert!(text.contains(word), "{text}");
    }
    let (done, _, error) = run(&["--pixel", "40,0"]);
    assert!(
        !done && error.contains("columns are 0 to 39, rows 0 to 29"),
        "{error}"
    );
    assert!(!run(&["--pixel", "3"]).0 && !run(&["--sample", "3"]).0);
}

#[test]
fn samples_that_are_not_finite_are_dropped_and_can_be_looked_at() {
    // A lamp at the end of 32-bit floats.
    let folder = tempfile::tempdir().unwrap();
    let place = |name: &str| folder.path().join(name);
    for extension in ["obj", "toml"] {
        let name = format!("contact.{extension}");
        std::fs::copy(format!("scenes/failures/{name}"), place(&name)).unwrap();
    }
    let mtl = std::fs::read_to_string("scenes/failures/contact.mtl").unwrap();
    let bright = mtl.replace("Ke 8 8 8", "Ke 3e38 3e38 3e38");
    assert_ne!(bright, mtl);
    std::fs::write(place("contact.mtl"), bright).unwrap();
    let run = |flags: &[&str]| {
        let mut command = Command::cargo_bin("gdpt").unwrap();
        command.arg("render").arg(place("contact.obj"));
        let output = command
            .args(["--size", "48x40"])
            .args(flags)
            .output()
            .unwrap();
        let text = |bytes| String::from_utf8(bytes).unwrap();
        (
            output.status.success(),
            text(output.stdout),
            text(output.stderr),
        )
    };
    let picture = place("o.png");
    let picture = picture.to_str().unwrap();

    // Counted and named, the same ones for any number of threads.
    let told = ["1", "3"].map(|threads| {
        let (done, text, error) = run(&["--spp", "8", "-o", picture, "--threads", threads]);
        assert!(done && text.contains("samples dropped"), "{error}");
        error
    });
    assert_eq!(told[0], told[1]);
    let flags = told[0].split("--pixel ").nth(1).unwrap();
    let (pixel, rest) = flags.split_once(" --sample ").unwrap();
    let sample = rest.split_once(' ').unwrap().0;
    let (done, text, _) = run(&["--pixel", pixel, "--sample", sample]);
    assert!(done && text.contains("not finite: it is dropped"), "{text}");

    // Under --strict they fail the run, but not before the picture is there.
    std::fs::remove_file(picture).unwrap();
    let (done, _, error) = run(&["--spp", "8", "-o", picture, "--strict", "--quiet"]);
    assert!(!done && error.contains("not finite"), "{error}");
    assert!(std::path::Path::new(picture).exists());
}
