//! `gdpt spectrum` from a scene to figures of the error theory.

use super::{Ended, SceneFlags, distinct, load_with_camera, thread_pool};
use crate::cli::SpectrumArgs;
use crate::error::{Error, Result, Warnings};
use crate::film::{Film, Halves};
use crate::filter::Filter;
use crate::load::scene_name;
use crate::output::format::Encoding;
use crate::output::{check_outputs, colour_map, print, write_whole};
use crate::path::{Counts, Manifold, PathSettings};
use crate::progress::Steps;
use crate::render::{Ending, Job, Limits, Method, TILE_SIZE};
use crate::scene::Scene;
use crate::spectrum::measure::{Measured, Sums};
use crate::spectrum::one_dimensional::{self, Samples};
use crate::spectrum::table::{self, Bin};
use crate::spectrum::{figures, theory::difference_power};
use std::io::Write;
use std::path::Path;

const BINS_PER_OCTAVE: u32 = 4;
/// Runs and samples per pixel of the experiment in one dimension: its bins are within 1 %.
const RUNS: u64 = 40_000;
const SAMPLES: f64 = 2.0;

/// Measures the error theory. `stop` is asked between passes whether to end early.
pub fn spectrum(args: &SpectrumArgs, stop: &(dyn Fn() -> bool + Sync)) -> Result<Ended> {
    if args.renders < 2 || args.spp == 0 || args.depth == 0 {
        let message = "--renders must be at least 2, --spp and --depth at least 1";
        return Err(Error::Setting(message.into()));
    }
    let folder = &args.output;
    std::fs::create_dir_all(folder).map_err(Error::io(folder, "cannot be made"))?;
    if let Some(scene) = &args.scene {
        check_outputs(&[scene], &[&folder.join("spectrum.csv")])?;
    }
    let pool = thread_pool(args.threads)?;
    let Some(path) = &args.scene else {
        let text = pool.install(|| one_dimension(folder))?;
        tell(args, &text)?;
        return Ok(Ended::Done);
    };

    let flags = SceneFlags::of_size(args.size, &args.reading);
    let mut warnings = Warnings::new(false);
    let scene = load_with_camera(path, flags, &mut warnings)?;
    if scene.camera.width < 2 || scene.camera.height < 2 {
        let message = "a spectrum needs a picture of at least 2x2 pixels: see --size";
        return Err(Error::Setting(message.into()));
    }
    let mut steps = Steps::new(args.quiet, args.renders as f64);
    steps.warnings(warnings.list());
    let measured = pool.install(|| measure(args, &scene, &mut steps, stop));
    steps.end();
    let Some(measured) = measured? else {
        let _ = writeln!(std::io::stderr(), "interrupted; nothing is written");
        return Ok(Ended::Interrupted);
    };
    if measured.variances.primal <= 0.0 {
        let message = "has no light but what is seen directly: there are no errors to measure";
        return Err(Error::input(path, None, message));
    }
    let text = write(args, &scene_name(path), &scene, &measured)?;
    tell(args, &text)?;
    Ok(Ended::Done)
}

fn tell(args: &SpectrumArgs, text: &str) -> Result<()> {
    match args.quiet {
        true => Ok(()),
        false => print(text),
    }
}

/// Renders with one seed after another. `None` if it was interrupted.
fn measure(
    args: &SpectrumArgs,
    scene: &Scene,
    steps: &mut Steps,
    stop: &(dyn Fn() -> bool + Sync),
) -> Result<Option<Measured>> {
    let tracer = args
        .backend
        .build(&scene.mesh, rayon::current_num_threads())?;
    let (width, height) = (scene.camera.width, scene.camera.height);
    let mut sums = Sums::new((width as usize, height as usize));
    for seed in 0..args.renders {
        steps.begin(&format!("render {} of {}", seed + 1, args.renders));
        let mut film = Film::new(width, height, TILE_SIZE);
        let job = Job {
            scene,
            tracer: &*tracer,
            method: Method::Gpt,
            settings: PathSettings {
                depth: args.depth,
                seed,
                sampler: args.sampler,
                weights: args.weights,
                filter: Filter::Box,
                manifold: Manifold::Auto,
            },
            first: 0,
            limits: Limits {
                samples: args.spp,
                time: None,
            },
        };
        let mut ask = |_: &Film, _: &Counts| stop().then_some(Ending::Interrupted);
        if job.run(&mut film, &mut ask, &mut |_| ()).ended == Ending::Interrupted {
            return Ok(None);
        }
        sums.add(&[0, 1, 2].map(|channel| film.planes(Halves::Both, channel)));
        steps.done(1.0);
    }
    Ok(Some(sums.finish()))
}

/// Writes tables, figures and maps; what is printed.
fn write(args: &SpectrumArgs, name: &str, scene: &Scene, measured: &Measured) -> Result<String> {
    let folder = &args.output;
    let file = |what: &str| folder.join(format!("{name}-{what}"));
    let best = measured.variances.best_alpha();
    // Gradients alone first, the best one last.
    let mut alphas = distinct(&[&[0.0], &args.alphas[..]].concat());
    alphas.retain(|&alpha| alpha == 0.0 || alpha != best);
    alphas.push(best);
    let bins = table::bins(measured, &alphas, BINS_PER_OCTAVE);
    let octaves = table::bins(measured, &alphas, 1);
    write_csv(&file("spectrum.csv"), &bins, &alphas)?;
    figures::spectra(name, &bins, &alphas).write(&file("spectrum.svg"))?;
    figures::totals(name, measured).write(&file("alpha.svg"))?;
    let width = scene.camera.width as usize;
    for (what, variances, mean) in [
        (
            "primal-variance.png",
            &measured.primal_variance,
            measured.variances.primal,
        ),
        (
            "gradient-variance.png",
            &measured.gradient_variance,
            measured.variances.gradient,
        ),
    ] {
        // The mean is in the middle of the colours.
        let relative: Vec<f32> = variances.iter().map(|v| (1e-3 * v / mean) as f32).collect();
        colour_map::heat_map(&relative, width).write(&file(what), Encoding::Png)?;
    }
    Ok(summary(args, name, measured, &octaves, &alphas))
}

fn write_csv(path: &Path, bins: &[Bin], alphas: &[f64]) -> Result<()> {
    let mut head: Vec<String> = [
        "from",
        "to",
        "coefficients",
        "primal",
        "primal_predicted",
        "divergence",
        "divergence_predicted",
        "correlation",
    ]
    .map(str::to_owned)
    .into();
    for alpha in alphas {
        for kind in ["", "_predicted", "_if_independent"] {
            head.push(format!("alpha_{alpha}{kind}"));
        }
    }
    write_whole(path, |file| {
        let mut csv = csv::Writer::from_writer(file);
        csv.write_record(&head)?;
        for bin in bins {
            let mut values = vec![
                bin.from,
                bin.to,
                bin.coefficients as f64,
                bin.primal,
                bin.primal_predicted,
                bin.divergence,
                bin.divergence_predicted,
                bin.correlation,
            ];
            for a in 0..alphas.len() {
                values.push(bin.screened[a]);
                values.push(bin.screened_predicted[a]);
                values.push(bin.screened_if_independent[a]);
            }
            csv.write_record(values.iter().map(f64::to_string))?;
        }
        csv.flush()
    })
}

/// Where theory and measurement part, octave by octave.
fn summary(
    args: &SpectrumArgs,
    name: &str,
    measured: &Measured,
    octaves: &[Bin],
    alphas: &[f64],
) -> String {
    let n = args.spp as f64;
    let v = measured.variances;
    let mut text = format!(
        "{name}: {} renders of {} samples\n\
         variance of a sample: primal {:.4e}, gradient {:.4e}, ratio {:.4}\n",
        measured.renders,
        args.spp,
        v.primal * n,
        v.gradient * n,
        v.gradient / v.primal
    );
    let best = v.best_alpha();
    let (measured_best, predicted_best) = table::total(measured, best);
    text += &format!(
        "best alpha {best:.4}: squared error {measured_best:.3e} measured, {predicted_best:.3e} predicted \
         ({:.2}), {:.1} times below the primal's\n",
        measured_best / predicted_best,
        v.primal / measured_best
    );
    text += "measured over predicted, by octave:\n";
    let mut head = format!(
        "{:<19}{:>8}{:>11}{:>13}",
        "cycles per pixel", "primal", "gradient", "correlation"
    );
    for &alpha in alphas {
        let title = if alpha == 0.0 {
            "alone".to_owned()
        } else {
            format!("a {alpha:.3}")
        };
        head += &format!("{title:>9}");
    }
    text += &format!("{head}   best, if independent\n");
    for bin in octaves {
        text += &format!(
            "{:<19}{:>8.3}{:>11.3}{:>13.3}",
            format!("{:.4} to {:.4}", bin.from, bin.to),
            bin.primal / bin.primal_predicted,
            bin.divergence / bin.divergence_predicted,
            bin.correlation
        );
        for a in 0..alphas.len() {
            text += &format!("{:>9.3}", bin.screened[a] / bin.screened_predicted[a]);
        }
        let last = alphas.len() - 1;
        let independent = bin.screened_if_independent[last] / bin.screened_predicted[last];
        text += &format!("   {independent:.3}\n");
    }
    text += "variance in the noisiest 1 % and 10 % of the pixels, which would be 1 % and 10 % if it were \
             stationary:\n";
    for (what, variances) in [
        ("primal", &measured.primal_variance),
        ("gradient", &measured.gradient_variance),
    ] {
        let [one, ten] = [0.01, 0.1].map(|share| 100.0 * table::concentration(variances, share));
        text += &format!("{what:<9} {one:.0} %, {ten:.0} %\n");
    }
    text
}

/// The experiment in one dimension: figures, and the largest deviation.
fn one_dimension(folder: &Path) -> Result<String> {
    let variances = one_dimensional::variances(SAMPLES);
    let mut text = String::new();
    for (kind, name, title) in [
        (Samples::Independent, "independent", "samples of their own"),
        (Samples::Shared, "shared", "the primal's samples"),
    ] {
        let errors = one_dimensional::measure(kind, RUNS, SAMPLES, 0);
        let title =
            format!("one dimension, gradients from {title}: measured (dots), predicted (lines)");
        let figure = figures::one_dimensional(&title, &errors, variances);
        figure.write(&folder.join(format!("one-dimension-{name}.svg")))?;
        let mut worst = [0.0f64; 2];
        for error in errors.iter().filter(|e| e.frequency > 0.0) {
            let d2 = difference_power(error.frequency);
            for (alpha, measured) in one_dimensional::ALPHAS.iter().zip(error.screened) {
                let predictions = [
                    variances.screened(*alpha, d2),
                    variances.screened_shared(*alpha, d2),
                ];
                for (worst, predicted) in worst.iter_mut().zip(predictions) {
                    *worst = worst.max((measured / predicted - 1.0).abs());
                }
            }
        }
        text += &format!(
            "gradients from {name} samples: screened errors within {:.1} % of the formula for \
             independent ones, {:.1} % of that for shared ones\n",
            100.0 * worst[0],
            100.0 * worst[1]
        );
    }
    Ok(text)
}
