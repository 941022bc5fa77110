//! `--pixel` and `--sample`: the sample that is told is the one that was rendered.

mod common;

use assert_cmd::Command;
use common::{shipped, tracer};
use gdpt::gradient::Weights;
use gdpt::path::replay::replay;
use gdpt::path::{PathSettings, PathTracer, Tile};
use gdpt::sampler::{self, Points};
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
                points: Points::Sobol,
                weights,
            };
            let tile = Tile {
                x: 0,
                y: 0,
                width: SIZE,
                height: SIZE,
            };
            for sample in [0, 5] {
                let mut sums = TileSums::default();
                sums.reset((SIZE * SIZE) as usize);
                let mut paths = PathTracer::<4>::default();
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
    assert!(!run(&[]).0);
}
