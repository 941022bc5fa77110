//! Errors against references: known pairs, and `gdpt compare` from the shell.

use crate::common::Rng;
use assert_cmd::Command;
use gdpt::compare::{References, compare, relative_errors};
use gdpt::image::Image;
use gdpt::output::exr::Layers;
use glam::Vec3;
use std::path::Path;

const SIZE: usize = 96;

fn image(width: usize, height: usize, pixel: impl Fn(usize, usize) -> Vec3) -> Image {
    let mut image = Image::new(width, height);
    for i in 0..width * height {
        image.set(i, pixel(i % width, i / width));
    }
    image
}

/// Something with bright and dark regions.
fn truth() -> Image {
    image(SIZE, SIZE, |x, y| {
        let (x, y) = (x as f32 / 20.0, y as f32 / 15.0);
        Vec3::new(1.0 + x.sin(), 0.5 + 0.4 * (x * y).cos(), 0.02 + 0.1 * y)
    })
}

/// `truth` and noise of standard deviation `deviation`, smoothed over `width` pixels along the rows.
fn noisy(truth: &Image, rng: &mut Rng, deviation: f32, width: usize) -> Image {
    let mut noisy = truth.clone();
    for channel in &mut noisy.channels {
        // Irwin-Hall: sums of uniform numbers with variance 1/12.
        let white: Vec<f32> = (0..channel.len() + width)
            .map(|_| (0..6).map(|_| rng.next() - 0.5).sum::<f32>() * 2.0f32.sqrt())
            .collect();
        for (i, value) in channel.iter_mut().enumerate() {
            let sum: f32 = white[i..i + width].iter().sum();
            *value += deviation * sum / (width as f32).sqrt();
        }
    }
    noisy
}

/// Mean and relative squared error against the truth itself.
fn true_errors(image: &Image, truth: &Image) -> (f64, f64) {
    let found = compare(image, References::One(truth));
    (found.errors.mse.value, found.errors.rel_mse.value)
}

#[test]
fn two_references_of_known_noise_give_the_true_error_within_its_interval() {
    // Noise of the references 3 times as large as the error. 300 pairs for white noise and for noise
    // that is correlated along rows: with a probability of 0.95 of lying within the interval, fewer than
    // 266 or more than 299 happen with a probability of 1e-6 together.
    let truth = truth();
    for smoothing in [1, 5] {
        let mut rng = Rng(11 + smoothing as u64);
        let (mut inside, mut inside_relative) = (0, 0);
        const PAIRS: usize = 300;
        for _ in 0..PAIRS {
            let picture = noisy(&truth, &mut rng, 0.02, 3);
            let [a, b] = [(); 2].map(|()| noisy(&truth, &mut rng, 0.06, smoothing));
            let found = compare(&picture, References::Two(&a, &b));
            let (mse, rel_mse) = true_errors(&picture, &truth);
            let within = |m: gdpt::compare::Measured, truth: f64| {
                (m.value - truth).abs() < m.interval.unwrap()
            };
            inside += usize::from(within(found.errors.mse, mse));
            inside_relative += usize::from(within(found.errors.rel_mse, rel_mse));

            // The error that a single reference gives is 10 times too large.
            let one = compare(&picture, References::One(&a));
            assert!((8.0..12.0).contains(&(one.errors.mse.value / mse)));
            assert_eq!(one.errors.mse.interval, None);
        }
        assert!((266..300).contains(&inside), "{smoothing}: {inside}");
        // The denominator has the references' noise in it, so this one is not exact: dark regions.
        assert!(inside_relative > 200, "{smoothing}: {inside_relative}");
    }
}

#[test]
fn bias_and_worst_pixels_are_what_they_are() {
    let truth = truth();
    let brighter = image(SIZE, SIZE, |x, y| truth.get(y * SIZE + x) * 1.1);
    let found = compare(&brighter, References::One(&truth));
    assert!((found.errors.rel_bias.unwrap() - 0.1).abs() < 1e-6);

    // Nine bright pixels of 9216 are the worst 0.1 %.
    let mut fireflies = truth.clone();
    for k in 0..9 {
        fireflies.set(k * 1000 + 7, Vec3::splat(1e3));
    }
    let found = compare(&fireflies, References::One(&truth));
    assert!(found.errors.rel_mse.value > 100.0);
    assert_eq!(found.errors.rel_mse_trimmed, 0.0);
    let errors = relative_errors(&fireflies, References::One(&truth));
    assert_eq!(errors.iter().filter(|&&e| e > 0.0).count(), 9);
    let mean = errors.iter().map(|&e| f64::from(e)).sum::<f64>() / errors.len() as f64;
    assert!((mean / found.errors.rel_mse.value - 1.0).abs() < 1e-6);
}

#[test]
fn likeness_is_that_of_scikit_image() {
    // structural_similarity with gaussian_weights, sigma 1.5, use_sample_covariance False, and
    // peak_signal_noise_ratio of scikit-image 0.26, on the same pictures.
    let (a, b) = (
        |x: usize, y: usize| ((x * 7 + y * 13) % 101) as f32 / 100.0,
        |x: usize, y: usize| ((x * 7 + y * 11) % 97) as f32 / 100.0,
    );
    let first = image(37, 29, |x, y| Vec3::new(a(x, y), a(x, y) * 0.5, b(x, y)));
    let second = image(37, 29, |x, y| {
        Vec3::new(a(x, y) * 0.9, b(x, y) * 0.5, b(x, y))
    });
    let found = compare(&first, References::One(&second));
    assert!(
        (found.ssim.unwrap() - 0.538_940_1).abs() < 1e-4,
        "{:?}",
        found.ssim
    );
    assert!((found.psnr - 17.874_656).abs() < 1e-3, "{}", found.psnr);

    let same = compare(&first, References::One(&first));
    assert_eq!((same.ssim, same.psnr), (Some(1.0), f64::INFINITY));
    let small = image(10, 29, |_, _| Vec3::ONE);
    assert_eq!(compare(&small, References::One(&small)).ssim, None);
}

fn write(folder: &Path, name: &str, image: &Image) -> String {
    let mut layers = Layers::default();
    layers.picture(image);
    let path = folder.join(name);
    layers.write(&path, image.width, image.height).unwrap();
    path.to_str().unwrap().to_owned()
}

fn run(arguments: &[&str]) -> (bool, String, String) {
    let mut command = Command::cargo_bin("gdpt").unwrap();
    let output = command.arg("compare").args(arguments).output().unwrap();
    let text = |bytes| String::from_utf8(bytes).unwrap();
    (
        output.status.success(),
        text(output.stdout),
        text(output.stderr),
    )
}

#[test]
fn the_command_prints_and_writes_what_was_measured() {
    let folder = tempfile::tempdir().unwrap();
    let folder = folder.path();
    let truth = truth();
    let mut rng = Rng(5);
    let picture = write(folder, "i.exr", &noisy(&truth, &mut rng, 0.1, 1));
    let [a, b] = ["a.exr", "b.exr"].map(|name| {
        let reference = noisy(&truth, &mut rng, 0.01, 1);
        write(folder, name, &reference)
    });
    let (json, heat) = (folder.join("c.json"), folder.join("h.png"));
    let files = [
        "--json",
        json.to_str().unwrap(),
        "--heatmap",
        heat.to_str().unwrap(),
    ];
    let (done, text, _) = run(&[&[&picture[..], &a, &b], &files[..]].concat());
    assert!(
        done && text.contains('±') && text.contains("SSIM"),
        "{text}"
    );
    let report: serde_json::Value = serde_json::from_slice(&std::fs::read(&json).unwrap()).unwrap();
    let mse = report["mse"]["value"].as_f64().unwrap();
    assert!((mse / 0.01 - 1.0).abs() < 0.1, "{mse}");
    assert!(report["mse"]["interval"].as_f64().unwrap() < 0.1 * mse);
    assert_eq!(report["references"].as_array().unwrap().len(), 2);
    let map = image::open(&heat).unwrap().to_rgb8();
    assert_eq!(map.dimensions(), (SIZE as u32, SIZE as u32));
    assert!(map.pixels().any(|p| p != map.get_pixel(0, 0)));

    let (done, text, _) = run(&[&picture, &a]);
    assert!(
        done && text.contains("give a second one") && !text.contains('±'),
        "{text}"
    );
}

#[test]
fn what_cannot_be_compared_is_refused_in_one_line() {
    let folder = tempfile::tempdir().unwrap();
    let folder = folder.path();
    let good = write(folder, "good.exr", &truth());
    let small = write(folder, "small.exr", &image(8, 9, |_, _| Vec3::ONE));
    let broken = image(SIZE, SIZE, |x, y| {
        Vec3::splat(if (x, y) == (3, 4) { f32::NAN } else { 1.0 })
    });
    let broken = write(folder, "nan.exr", &broken);
    let mut layers = Layers::default();
    layers.channel("depth.Z", vec![1.0; SIZE * SIZE]);
    let bare = folder.join("bare.exr");
    layers.write(&bare, SIZE, SIZE).unwrap();
    let text = folder.join("text.exr");
    std::fs::write(&text, "no image").unwrap();
    let [bare, text] = [bare, text].map(|p| p.to_str().unwrap().to_owned());
    for (arguments, says) in [
        (vec![&good[..], &small], "is 8x9, but"),
        (vec![&good, &good, &small], "is 8x9, but"),
        (
            vec![&good, &good, &good],
            "is the same picture as the first reference",
        ),
        (vec![&broken, &good], "pixel 3,4 is not a finite number"),
        (vec![&good, &bare], "channels R, G and B are needed"),
        (vec![&text, &good], "no EXR file"),
        (vec![&good, "absent.exr"], "absent.exr"),
        (
            vec![&good, &small, "--heatmap", "h.tif"],
            "--heatmap writes a .png",
        ),
        (
            vec![&good, &small, "--heatmap", &good],
            "--heatmap writes a .png",
        ),
        (
            vec![&good, &small, "--json", &good],
            "named for two purposes",
        ),
    ] {
        let (done, _, error) = run(&arguments);
        assert!(!done && error.contains(says), "{arguments:?}: {error}");
        assert_eq!(error.lines().count(), 1, "{error}");
    }
}
