//! Cameras, views and filters: what the TOML and flags make of them, from the shell and in closed form.

mod common;

use assert_cmd::Command;
use common::{light, polygons, tracer};
use gdpt::film::{Film, Halves};
use gdpt::filter::Filter;
use gdpt::gradient::Weights;
use gdpt::load::sidecar::CameraTable;
use gdpt::path::PathSettings;
use gdpt::render::{Job, Limits, Method};
use gdpt::sampler::Points;
use gdpt::scene::SceneSettings;
use glam::Vec3;
use tempfile::TempDir;

fn gdpt(args: &[&str]) -> (bool, String) {
    let output = Command::cargo_bin("gdpt")
        .unwrap()
        .args(args)
        .output()
        .unwrap();
    let text = [output.stdout, output.stderr].concat();
    (output.status.success(), String::from_utf8(text).unwrap())
}

#[test]
fn a_turntable_is_a_folder_of_views() {
    let folder = TempDir::new().unwrap();
    let out = folder.path().join("spin.png");
    let flags = [
        "--turntable",
        "4",
        "--size",
        "16x12",
        "--spp",
        "2",
        "--quiet",
    ];
    let args = [
        &["render", "scenes/still.obj", "-o", out.to_str().unwrap()],
        &flags[..],
    ]
    .concat();
    assert_eq!(gdpt(&args), (true, String::new()));
    let read = |i: usize| std::fs::read(folder.path().join(format!("spin/00{i}.png"))).unwrap();
    // The first is the plain view.
    let plain = folder.path().join("plain.png");
    let args = [
        &["render", "scenes/still.obj", "-o", plain.to_str().unwrap()],
        &flags[2..],
    ]
    .concat();
    assert!(gdpt(&args).0);
    assert_eq!(read(0), std::fs::read(plain).unwrap());
    for i in 1..4 {
        assert_ne!(read(i), read(i - 1));
    }
    let none = [
        "render",
        "scenes/still.obj",
        "-o",
        "x.png",
        "--turntable",
        "0",
    ];
    assert!(gdpt(&none).1.contains("--turntable"));
}

#[test]
fn cameras_have_names() {
    let folder = TempDir::new().unwrap();
    let out = folder.path().join("a.png");
    let render = |name: &str| {
        let out = out.to_str().unwrap();
        let flags = ["--size", "16x12", "--spp", "1", "--quiet", "--camera", name];
        gdpt(&[&["render", "scenes/still.obj", "-o", out], &flags[..]].concat())
    };
    assert!(render("close").0);
    let (success, text) = render("far");
    assert!(
        !success && text.contains("'far'") && text.contains("close"),
        "{text}"
    );
}

#[test]
fn completions_and_manual_pages_name_the_commands() {
    for shell in ["bash", "zsh", "fish"] {
        let (success, text) = gdpt(&["completions", shell]);
        assert!(
            success && text.contains("turntable") && text.contains("spectrum"),
            "{shell}"
        );
    }
    let (success, page) = gdpt(&["man"]);
    assert!(success && page.contains(".TH gdpt 1") && page.contains("render"));
    let folder = TempDir::new().unwrap();
    assert!(gdpt(&["man", folder.path().to_str().unwrap()]).0);
    let page = std::fs::read_to_string(folder.path().join("gdpt-render.1")).unwrap();
    assert!(page.contains("turntable") && page.contains("Examples"));
}

/// The edge of a lamp between two columns of pixels: a pixel k columns away sees what the filter has on the
/// lamp's side.
#[test]
fn an_edge_is_blurred_by_the_filter() {
    const SIDE: u32 = 8;
    let settings = SceneSettings {
        camera: CameraTable {
            origin: Some([0.0, 0.0, 1.0]),
            target: Some([0.0; 3]),
            fov: Some(90.0),
            ..Default::default()
        },
        size: (SIDE, SIDE),
        environment: Some(Vec3::ZERO.into()),
        roughness_threshold: 0.01,
    };
    // The right half of the picture, and beyond.
    let lamp: &[[f32; 3]] = &[
        [0.0, -9.0, 0.0],
        [9.0, -9.0, 0.0],
        [9.0, 9.0, 0.0],
        [0.0, 9.0, 0.0],
    ];
    let scene = polygons(&[(lamp, 0)], vec![light(1.0)], &settings);
    let tracer = tracer(&scene);
    for filter in [
        Filter::Box,
        Filter::Tent,
        Filter::Gaussian,
        Filter::Mitchell,
    ] {
        let mut film = Film::new(SIDE, SIDE, SIDE);
        let job = Job {
            scene: &scene,
            tracer: &*tracer,
            method: Method::Pt,
            settings: PathSettings {
                depth: 2,
                seed: 1,
                points: Points::Sobol,
                weights: Weights::Mis,
                filter,
            },
            limits: Limits {
                samples: 8192,
                time: None,
            },
        };
        job.run(&mut film, &mut |_, _| None, &mut |_| ());
        let direct = film.direct(Halves::Both);
        for x in 0..SIDE as usize {
            // From the pixel's middle to the edge, to the right.
            let edge = SIDE as f64 / 2.0 - (x as f64 + 0.5);
            let steps = 4000;
            let width = (3.0 - edge) / steps as f64;
            let wanted: f64 = (0..steps)
                .map(|i| filter.value(edge + (i as f64 + 0.5) * width) * width)
                .sum();
            let found = f64::from(direct.get(3 * SIDE as usize + x).x);
            assert!(
                (found - wanted).abs() < 5e-3,
                "{filter:?} column {x}: {found} {wanted}"
            );
        }
    }
}
