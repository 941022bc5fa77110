//! Where gradient-domain path tracing fails it stays correct, and costs little more than path tracing.
//!
//! Every scene of every sweep is rendered many times by both methods: (a) differences, l2 picture and
//! path-traced image agree in the mean, region by region; (b) no sample is dropped as not finite; (c) the
//! weighted picture has no larger error than path tracing with as many samples; (d) no sample of a
//! difference is larger than what the primal holds (`gradient.rs` proves the bound).
//!
//! Seeds are fixed. The z-tests of one scene fail by chance with a probability of 1e-5.

mod examine;
mod model;
mod sweeps;

use crate::common;
use examine::{Figures, Gain, HEIGHT, WHOLE, WIDTH, examine, gain};
use std::fmt::Write;
use std::path::Path;
use sweeps::{SWEEPS, Sweep};

const FOLDER: &str = "scenes/failures";

fn measure(sweep: &Sweep) -> Vec<(f32, Figures)> {
    let scene = |&value: &f32| (value, (sweep.model)(value).scene(WIDTH, HEIGHT));
    let scenes = sweep.values.iter().map(scene);
    scenes
        .map(|(value, scene)| (value, examine(&scene)))
        .collect()
}

fn check(name: &str) {
    let sweep = SWEEPS.iter().find(|s| s.name == name).unwrap();
    for (value, figures) in measure(sweep) {
        let what = format!("{name} {value:e}: {figures:.3?}");
        assert!(figures.largest_z < 1.0, "{what}");
        assert!(figures.weighted < 1.0, "{what}");
        // Trimming makes it dark where light is rare.
        let bias = figures.bias.abs() - 4.0 * figures.bias_error;
        assert!(bias < 0.02, "{what}");
        assert!(figures.largest < 2.0, "{what}");
    }
}

macro_rules! sweeps {
    ($($test:ident $name:literal),* $(,)?) => {
        $(
            #[test]
            fn $test() {
                check($name);
            }
        )*

        #[test]
        fn every_sweep_is_tested() {
            let tested = [$($name),*];
            assert!(SWEEPS.iter().all(|s| tested.contains(&s.name)));
        }
    };
}

sweeps!(
    contact "contact", corner "corner", roughness "roughness", index "index",
    rough_index "rough-index", rim "rim", knife "knife", slit "slit", tiny_lamp "tiny-lamp",
    caustic "caustic", silhouette "silhouette", chequers "chequers", bars "bars", hair "hair",
    stripes "stripes", scale "scale", origin "origin", narrow "narrow", exposure "exposure",
    mirror "mirror", curvature "curvature", facets "facets", near_mirror "near-mirror",
    ball "ball", pane "pane", far_lamp "far-lamp",
);

/// Through the roughness threshold the image does not jump, only its variance.
#[test]
fn the_class_of_a_surface_does_not_change_the_mean() {
    for model in [sweeps::roughness(0.01), sweeps::slab(1.5, 0.01)] {
        let [specular, rough] = [(0.02, 0), (0.002, 1000)].map(|(threshold, seed)| {
            let mut model = model.clone();
            model.roughness_threshold = threshold;
            examine::picture_means(&model.scene(WIDTH, HEIGHT), seed)
        });
        let z = examine::largest_deviation(&specular, &rough);
        assert!(z < 1.0, "{z}");
    }
}

/// Scale and place of a scene do not matter, up to the precision of coordinates: the same seeds give
/// nearly the same picture.
#[test]
fn scale_and_place_do_not_matter() {
    let mean = |sweep: &str, value: f32| {
        let sweep = SWEEPS.iter().find(|s| s.name == sweep).unwrap();
        examine::picture_means(&(sweep.model)(value).scene(WIDTH, HEIGHT), 0)
    };
    let plain = mean("scale", 1.0);
    let brightness = plain.iter().map(common::Mean::mean).sum::<f64>() / plain.len() as f64;
    for (sweep, value, tolerance) in [
        ("scale", 1e-3, 1e-3),
        ("scale", 1e4, 1e-3),
        ("origin", 1e1, 1e-2),
        ("origin", 1e3, 0.05),
    ] {
        let moved = mean(sweep, value);
        for (a, b) in plain.iter().zip(&moved) {
            let difference = (a.mean() - b.mean()).abs() / brightness;
            assert!(difference < tolerance, "{sweep} {value}: {difference}");
        }
    }
}

/// The scenes in `scenes/failures` are those of the sweeps.
#[test]
fn the_shipped_scenes_are_those_of_the_sweeps() {
    let folder = tempfile::tempdir().unwrap();
    for sweep in SWEEPS {
        write_scene(sweep, folder.path());
        for extension in ["obj", "mtl", "toml"] {
            let file = format!("{}.{extension}", sweep.name);
            let [here, there] = [Path::new(FOLDER), folder.path()].map(|f| f.join(&file));
            let same = std::fs::read(&here).ok() == std::fs::read(&there).ok();
            assert!(
                same,
                "{} is not up to date: see write_scenes_and_table",
                here.display()
            );
        }
    }
}

fn write_scene(sweep: &Sweep, folder: &Path) {
    let about = format!("{}: {}", sweep.about, sweep.shown);
    (sweep.model)(sweep.shown).write(folder, sweep.name, &about);
}

/// Writes `scenes/failures` and its table. To be run alone, as it measures time:
/// `cargo test --release --test physics stability:: -- --ignored`.
#[test]
#[ignore = "writes scenes/failures"]
fn write_scenes_and_table() {
    let folder = Path::new(FOLDER);
    std::fs::create_dir_all(folder).unwrap();
    let mut table = "# Where gradient-domain path tracing fails\n\n\
        Measured by `cargo test --release --test physics stability:: -- --ignored`, 24x16 pixels, 40 seeds of 16 \
        samples. *z*: largest deviation of differences and l2 picture from the path tracer over what chance \
        allows (1e-5 a scene). *weighted*, *l2*: relMSE over that of path tracing with the same samples. A caustic \
        from a lamp of side 0.01 or less is found by neither method: dark, not wrong. *bias* of weighted \
        over the whole picture, ± one standard error. *largest*: largest sample of a difference over the \
        largest of the primal. Then at 128x128 pixels, 8 seeds of 16 samples: *weighted* as before, and without \
        the values where path tracing is worst, one in a hundred (*99 %*); *cost* of a gradient sample over a path \
        sample, solve included; *equal time*: weighted times cost, of all and of 99 %. Above 1 path tracing is ahead. \
        The scene of the value in bold stands here as OBJ.\n"
        .to_owned();
    for sweep in SWEEPS {
        write_scene(sweep, folder);
        writeln!(table, "\n## {}: {}\n", sweep.name, sweep.about).unwrap();
        table += "| value | z | weighted | l2 | bias | largest | weighted, 128x128 | 99 % | cost | equal time | 99 % |\n";
        table += "|---|---|---|---|---|---|---|---|---|---|---|\n";
        for (value, f) in measure(sweep) {
            let Gain {
                weighted,
                trimmed,
                cost,
            } = gain(&(sweep.model)(value).scene(WHOLE, WHOLE));
            let bold = if value == sweep.shown { "**" } else { "" };
            writeln!(
                table,
                "| {bold}{value}{bold} | {:.2} | {:.2} | {:.2} | {:+.2} ± {:.2} % | {:.2} | {weighted:.2} | {trimmed:.2} | {cost:.1} | {:.2} | {:.2} |",
                f.largest_z,
                f.weighted,
                f.l2,
                100.0 * f.bias,
                100.0 * f.bias_error,
                f.largest,
                weighted * cost,
                trimmed * cost,
            )
            .unwrap();
        }
    }
    table += &threshold_table();
    std::fs::write(folder.join("README.md"), table).unwrap();
}

/// The error of either class at the same surface: what decides the roughness threshold.
fn threshold_table() -> String {
    let mut table = "\n## The roughness threshold\n\n\
        relMSE of weighted where the surface is of class rough (light is sampled, offset paths reconnect) and \
        of class specular (half vectors are copied, paths are aimed at lights where no walk may find these; walks lead to light by \
        metal), which takes two to four times the time. The threshold is 0.045, on planes, as here, 0.09; glass counts as twice as \
        rough.\n\n\
        | surface | alpha | rough | specular | ratio |\n|---|---|---|---|---|\n"
        .to_owned();
    type Surface = (&'static str, fn(f32) -> model::Model);
    let models: [Surface; 2] = [
        ("metal floor", sweeps::roughness),
        ("glass slab", |alpha| sweeps::slab(1.5, alpha)),
    ];
    for (name, model) in models {
        for alpha in [
            3e-4, 1e-3, 3e-3, 1e-2, 2e-2, 3e-2, 5e-2, 7e-2, 0.1, 0.2, 0.4,
        ] {
            let [rough, specular] = [1e-4, 0.9].map(|threshold| {
                let mut model = model(alpha);
                model.roughness_threshold = threshold;
                examine(&model.scene(WIDTH, HEIGHT)).absolute
            });
            let ratio = specular / rough;
            writeln!(
                table,
                "| {name} | {alpha} | {rough:.2e} | {specular:.2e} | {ratio:.2} |"
            )
            .unwrap();
        }
    }
    table
}
