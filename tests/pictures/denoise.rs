//! Pictures with a denoiser's help. Where Open Image Denoise is missing this says so and skips, unless REQUIRE_OIDN is set.

use crate::common::{Render, Rng, glass, lambert, level, mirror, polygons, shipped, tracer};
use assert_cmd::Command;
use gdpt::compare::{References, errors};
use gdpt::denoise::Denoiser;
use gdpt::estimate::Planes;
use gdpt::film::Film;
use gdpt::image::Image;
use gdpt::load::mtl::MtlMaterial;
use gdpt::load::sidecar::CameraTable;
use gdpt::picture::{self, Picture};
use gdpt::reconstruct::error_estimate::{HalfPictures, Halved, estimate};
use gdpt::reconstruct::{Method, Source, run};
use gdpt::render::Method as RenderMethod;
use gdpt::scene::{Scene, SceneSettings};
use glam::Vec3;
use std::path::Path;

fn denoiser() -> Option<&'static Denoiser> {
    match Denoiser::get(2) {
        Ok(denoiser) => Some(denoiser),
        Err(e) => {
            assert!(std::env::var_os("REQUIRE_OIDN").is_none(), "{e}");
            eprintln!("skipped: {e}");
            None
        }
    }
}

fn gdpt(arguments: &str, folder: &Path) -> std::process::Output {
    let mut command = Command::cargo_bin("gdpt").unwrap();
    let scene = std::path::absolute("scenes/corner.obj").unwrap();
    let arguments = arguments.replace("SCENE", scene.to_str().unwrap());
    let arguments = arguments.split_whitespace();
    command
        .args(arguments)
        .current_dir(folder)
        .output()
        .unwrap()
}

#[test]
fn without_the_library_everything_else_works() {
    let folder = tempfile::tempdir().unwrap();
    let run = |named: &str, flags: &str| {
        let mut command = Command::cargo_bin("gdpt").unwrap();
        command.args(["render", "scenes/corner.obj", "--size", "8x8", "--spp", "4"]);
        command.arg("-o").arg(folder.path().join("o.exr"));
        command
            .args(flags.split_whitespace())
            .env("GDPT_OIDN", named);
        command.output().unwrap()
    };
    assert!(run("/nowhere/at/all", "").status.success());
    for (named, words) in [
        ("/nowhere/at/all", "is not there"),
        ("libm.so.6", "is no Open Image Denoise 2"),
    ] {
        for flags in ["--denoise", "--reconstruct mix", "--method pt --denoise"] {
            let output = run(named, flags);
            let said = String::from_utf8(output.stderr).unwrap();
            assert_eq!(output.status.code(), Some(1));
            let lines: Vec<&str> = said.lines().collect();
            assert!(lines.len() == 1 && lines[0].contains(words), "{said}");
            assert!(lines[0].contains("ffi/setup.sh --denoiser"), "{said}");
        }
    }
}

#[test]
fn flags_that_do_not_go_together_are_refused() {
    let folder = tempfile::tempdir().unwrap();
    let refused = |arguments: &str| {
        let output = gdpt(arguments, folder.path());
        assert!(!output.status.success(), "{arguments}");
        String::from_utf8(output.stderr).unwrap()
    };
    refused("render SCENE -o o.png --denoise --reconstruct l2");
    let said = refused("render SCENE -o o.png --method pt --reconstruct guided");
    assert!(said.contains("oidn"), "{said}");
}

fn film(scene: &Scene, spp: u64, seed: u64) -> Film {
    let render = Render {
        spp,
        seed,
        ..Render::default()
    };
    render.film(scene, &*tracer(scene))
}

/// What has no noise has nothing to be divided by.
#[test]
fn a_bright_picture_without_noise_stays() {
    let Some(denoiser) = denoiser() else {
        return;
    };
    let (width, height) = (24, 16);
    let zeros = vec![0.0; width * height];
    let planes = Planes {
        primal: vec![50.0; width * height],
        dx: zeros.clone(),
        dy: zeros.clone(),
        primal_variance: zeros.clone(),
        dx_variance: zeros.clone(),
        dy_variance: zeros,
    };
    let source = Source {
        size: (width, height),
        samples: [8, 8],
        planes: &|_, _| planes.clone(),
        features: None,
    };
    for method in [Method::Mix(denoiser), Method::Guided(denoiser)] {
        let picture = run(method, &source).picture;
        let values = picture.channels.iter().flatten();
        for v in values {
            assert!((v - 50.0).abs() < 1.0, "{method:?}: {v}");
        }
    }
}

/// Two pictures of other samples, nearly without noise.
fn references(scene: &Scene) -> [Image; 2] {
    [1, 2].map(|seed| picture::of_film(&film(scene, 700, seed), Method::Weighted).image)
}

/// relMSE of a picture, and of what it was estimated to be.
fn error(picture: &Picture, [a, b]: &[Image; 2]) -> (f64, f64) {
    let found = errors(&picture.image, References::Two(a, b));
    (found.rel_mse.value, picture.rel_mse.unwrap())
}

/// Glass and metal at 8 and 128 samples: the second witness helps, ever less, and its errors fall on, where a
/// denoised picture keeps its bias. What the halves say of the errors is about true, bias and all.
#[test]
fn the_second_witness_is_better_than_either_alone() {
    let Some(denoiser) = denoiser() else {
        return;
    };
    let scene = shipped("glossy", 64, 64);
    let references = references(&scene);
    let [few, many] = [8, 128].map(|spp| {
        let film = film(&scene, spp, 7);
        [
            Method::Weighted,
            Method::Guided(denoiser),
            Method::Mix(denoiser),
            Method::Denoised(denoiser),
        ]
        .map(|method| error(&picture::of_film(&film, method), &references))
    });
    let [weighted, guided, mix, denoised] = few.map(|e| e.0);
    assert!(guided < 0.8 * weighted && mix < 0.8 * weighted, "{few:?}");
    let [weighted, guided, mix, denoised_by_many] = many.map(|e| e.0);
    assert!(guided < weighted && mix < 1.05 * weighted, "{many:?}");
    assert!(
        guided < 0.8 * denoised_by_many && mix < denoised_by_many,
        "{many:?}"
    );
    // Sixteen times the samples.
    let falls = |few: f64, many: f64| few / many;
    assert!(falls(few[1].0, guided) > 4.0 && falls(denoised, denoised_by_many) < 8.0);
    // Eight samples of rare light know little of it.
    for (errors, bound) in [(few, 3.0), (many, 2.0)] {
        for (measured, estimated) in errors {
            let ratio = estimated / measured;
            assert!(ratio > 1.0 / bound && ratio < bound, "{few:?} {many:?}");
        }
    }
}

/// Albedo and normal are of what a mirror shows, also through a pane, by either method.
#[test]
fn features_are_of_what_mirrors_show() {
    let floor = level(0.0, 40.0);
    let [mut ceiling, mut below, above] = [level(3.0, 40.0), level(0.5, 40.0), level(0.6, 40.0)];
    ceiling.reverse();
    below.reverse();
    let red = MtlMaterial {
        kd: Some([0.8, 0.1, 0.2]),
        ..lambert(0.0)
    };
    let materials = vec![mirror(), red, glass(1.5)];
    let settings = SceneSettings {
        size: (8, 8),
        camera: CameraTable {
            origin: Some([0.0, 1.0, 0.0]),
            target: Some([0.0, 0.0, -0.4]),
            fov: Some(20.0),
            ..Default::default()
        },
        ..Default::default()
    };
    let expected = Vec3::new(0.8 * 0.9, 0.1 * 0.8, 0.2 * 0.7);
    for sheets in [vec![], vec![(&below[..], 2), (&above[..], 2)]] {
        let mut all = vec![(&floor[..], 0), (&ceiling[..], 1)];
        all.extend(sheets);
        let scene = polygons(&all, materials.clone(), &settings);
        for method in [RenderMethod::Pt, RenderMethod::Gpt] {
            let render = Render {
                method,
                spp: 8,
                ..Render::default()
            };
            let hits = render.film(&scene, &*tracer(&scene)).first_hits();
            for pixel in 0..64 {
                let (albedo, normal) = (hits.albedo.get(pixel), hits.normal.get(pixel));
                // Panes reflect the ceiling, too, without the mirror's colour, or send light to the mirror again.
                let near = if all.len() > 2 { 0.3 } else { 1e-4 };
                assert!(albedo.distance(expected) < near, "{albedo}");
                assert!(normal.distance(Vec3::NEG_Y) < near, "{normal}");
                assert!(hits.depth[pixel] < 1.5);
            }
        }
    }
}

/// The same bits for any number of threads, from the film and from its file; first hits help.
#[test]
fn a_file_is_denoised_as_its_render_was() {
    if denoiser().is_none() {
        return;
    }
    let folder = tempfile::tempdir().unwrap();
    let folder = folder.path();
    let made = |arguments: &str, file: &str| {
        let output = gdpt(arguments, folder);
        assert!(output.status.success(), "{arguments}: {output:?}");
        let file = gdpt::load::exr::load(&folder.join(file)).unwrap();
        file.colour("").unwrap().map(Vec::clone)
    };
    let render = "render SCENE --size 40x32 --spp 8";
    for (flag, method) in [
        ("--denoise", "guided"),
        ("--reconstruct mix", "mix"),
        ("--reconstruct oidn", "oidn"),
    ] {
        let one = made(
            &format!("{render} {flag} --threads 1 -o one.exr"),
            "one.exr",
        );
        let two = made(
            &format!("{render} {flag} --threads 2 -o two.exr"),
            "two.exr",
        );
        assert!(one == two, "{method}");
        made(&format!("{render} -o plain.exr"), "plain.exr");
        let again = made(
            &format!("reconstruct plain.exr --reconstruct {method} -o again.exr"),
            "again.exr",
        );
        // Half B is the rest of all samples, to rounding, which denoising may enlarge.
        for (a, b) in one.iter().flatten().zip(again.iter().flatten()) {
            assert!((a - b).abs() <= 1e-2 * a.abs() + 1e-3, "{method}: {a} {b}");
        }
    }
    // Without gradients, and from three files.
    made(
        &format!("{render} --method pt --denoise -o pt.exr"),
        "pt.exr",
    );
}

/// A bias that both halves share shows against pictures without it.
#[test]
fn the_estimate_sees_bias() {
    let (width, height) = (64, 64);
    let mut rng = Rng(5);
    let mut noisy = |mean: f32, deviation: f32| {
        let mut image = Image::new(width, height);
        // Uniform numbers of this deviation.
        let side = deviation * 12f32.sqrt();
        let values = image.channels.iter_mut().flatten();
        values.for_each(|v| *v = mean + side * (rng.next() - 0.5));
        image
    };
    let (truth, bias) = (1.0, 0.1);
    let halves = [noisy(truth + bias, 0.05), noisy(truth + bias, 0.05)];
    let unbiased = [noisy(truth, 0.2), noisy(truth, 0.2)];
    let all = halves[0].clone().plus(&halves[1]);
    let all = Image {
        channels: all
            .channels
            .map(|c| c.into_iter().map(|v| 0.5 * v).collect()),
        ..all
    };
    let black = [(); 3].map(|()| Image::new(width, height));
    let [black, others @ ..] = black;
    let direct = Halved {
        all: &black,
        halves: &HalfPictures::Alike(others),
    };
    let found = |halves| {
        let solved = Halved {
            all: &all,
            halves: &halves,
        };
        estimate(solved, direct, [8, 8]).rel_mse
    };
    let brightness = f64::from((truth + bias) * (truth + bias)) + 0.01;
    let variance = 0.05 * 0.05 / 2.0;
    // 12288 values: half a per cent of the variance, 3 per cent of the bias.
    assert!(
        (found(HalfPictures::Alike(halves.clone())) * brightness / variance - 1.0).abs() < 0.05
    );
    let with_bias = variance + f64::from(bias * bias);
    let biased = HalfPictures::Biased { halves, unbiased };
    assert!((found(biased) * brightness / with_bias - 1.0).abs() < 0.12);
}
