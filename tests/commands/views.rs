//! Cameras, views and filters: what the TOML and flags make of them, from the shell and in closed form.

use crate::common::{light, polygons, tracer};
use assert_cmd::Command;
use gdpt::film::{Film, Halves};
use gdpt::filter::Filter;
use gdpt::gradient::Weights;
use gdpt::load::sidecar::CameraTable;
use gdpt::path::{Manifold, PathSettings};
use gdpt::render::{Job, Limits, Method};
use gdpt::sampler::SamplerKind;
use gdpt::scene::SceneSettings;
use glam::Vec3;
use std::collections::BTreeMap;
use std::io::{BufRead, Read};
use std::net::TcpListener;
use std::path::Path;
use std::time::{Duration, Instant};
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
        environment: Vec3::ZERO.into(),
        roughness_threshold: 0.01,
        ..Default::default()
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
                sampler: SamplerKind::Sobol,
                weights: Weights::Mis,
                filter,
                manifold: Manifold::Auto,
            },
            first: 0,
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

/// What a program that speaks tev's protocol was told.
#[derive(Default)]
struct Watched {
    /// Names of the pictures with their sizes and channels, as they were created.
    created: Vec<(String, [u32; 2], Vec<String>)>,
    /// Channels as they are at last.
    channels: BTreeMap<String, Vec<f32>>,
    /// Pictures that were updated, channel by channel.
    updates: usize,
}

/// A packet of tev's protocol.
struct Packet(std::io::Cursor<Vec<u8>>);

impl Packet {
    fn bytes<const N: usize>(&mut self) -> [u8; N] {
        let mut bytes = [0; N];
        self.0.read_exact(&mut bytes).unwrap();
        bytes
    }

    fn int(&mut self) -> u32 {
        u32::from_le_bytes(self.bytes())
    }

    fn text(&mut self) -> String {
        let mut text = Vec::new();
        self.0.read_until(0, &mut text).unwrap();
        text.pop();
        String::from_utf8(text).unwrap()
    }

    fn texts(&mut self) -> Vec<String> {
        (0..self.int()).map(|_| self.text()).collect()
    }
}

/// Takes packets from one connection until it closes.
fn watch(listener: &TcpListener) -> Watched {
    let mut watched = Watched::default();
    let mut stream = listener.accept().unwrap().0;
    let mut length = [0; 4];
    while stream.read_exact(&mut length).is_ok() {
        let mut body = vec![0; u32::from_le_bytes(length) as usize - 4];
        if stream.read_exact(&mut body).is_err() {
            break;
        }
        let mut packet = Packet(std::io::Cursor::new(body));
        let [kind, _grab] = packet.bytes();
        let name = packet.text();
        if kind == 4 {
            let size = [packet.int(), packet.int()];
            watched.created.push((name, size, packet.texts()));
            continue;
        }
        assert_eq!(kind, 6);
        let channels = packet.texts();
        let (place, width, height) = ([packet.int(), packet.int()], packet.int(), packet.int());
        let [offset, stride] = [0, 1].map(|_| u64::from_le_bytes(packet.bytes()));
        assert_eq!((place, offset, stride, channels.len()), ([0, 0], 0, 1, 1));
        let values = (0..width * height).map(|_| f32::from_le_bytes(packet.bytes()));
        watched
            .channels
            .insert(channels[0].clone(), values.collect());
        watched.updates += 1;
    }
    watched
}

/// Renders while a program listens; what was printed, and what was watched.
fn render_watched(out: &Path, spp: &str) -> (String, Watched) {
    let listener = TcpListener::bind("127.0.0.1:0").unwrap();
    let address = listener.local_addr().unwrap().to_string();
    let watching = std::thread::spawn(move || watch(&listener));
    let out = out.to_str().unwrap();
    let (success, text) = gdpt(&[
        "render",
        "scenes/still.obj",
        "-o",
        out,
        "--size",
        "24x16",
        "--spp",
        spp,
        "--watch",
        &address,
    ]);
    assert!(success, "{text}");
    (text, watching.join().unwrap())
}

#[test]
fn the_picture_is_watched_as_it_grows() {
    let folder = TempDir::new().unwrap();
    let out = folder.path().join("a.exr");
    let (text, watched) = render_watched(&out, "1024");
    assert!(!text.contains("--watch"), "{text}");
    let file = gdpt::load::exr::load(&out).unwrap();
    // One picture, all layers of the file, updated more than once, and in the end as in the file.
    let [(name, size, channels)] = &watched.created[..] else {
        panic!("{:?}", watched.created);
    };
    assert_eq!((Path::new(name), *size), (&*out, [24, 16]));
    assert_eq!(channels.len(), file.channels.len());
    assert!(watched.updates > channels.len(), "{}", watched.updates);
    assert_eq!(watched.updates % channels.len(), 0);
    assert_eq!(watched.channels, file.channels);
}

#[test]
fn a_render_goes_on_without_tev() {
    let folder = TempDir::new().unwrap();
    let out = folder.path().join("a.exr");
    let listener = TcpListener::bind("127.0.0.1:0").unwrap();
    let address = listener.local_addr().unwrap().to_string();
    // Nobody listens any more.
    drop(listener);
    let name = out.to_str().unwrap();
    let watched = |size: &str, samples: &str, address: &str| {
        gdpt(&[
            "render",
            "scenes/still.obj",
            "-o",
            name,
            "--size",
            size,
            "--spp",
            samples,
            "--watch",
            address,
        ])
    };
    let (success, text) = watched("24x16", "4", &address);
    assert!(success && out.exists(), "{text}");
    assert_eq!(text.matches(&address).count(), 1, "{text}");
    // One that takes nothing of what is more than any buffer holds: the end of the render does not wait for it.
    let listener = TcpListener::bind("127.0.0.1:0").unwrap();
    let address = listener.local_addr().unwrap().to_string();
    let start = Instant::now();
    let (success, text) = watched("400x300", "2", &address);
    assert!(success, "{text}");
    assert!(
        start.elapsed() < Duration::from_secs(20),
        "{:?}",
        start.elapsed()
    );
}

#[test]
fn watching_needs_an_address() {
    let (success, text) = gdpt(&["render", "--watch", "scenes/still.obj", "-o", "x.exr"]);
    assert!(!success && text.contains("localhost:14158"), "{text}");
}

/// A closed room with a lamp on its ceiling, in a folder.
fn closed_room(folder: &Path) -> String {
    let obj = folder.join("room.obj");
    let room = "mtllib room.mtl\nusemtl wall\n\
        v -3 0 -2\nv 3 0 -2\nv 3 2.6 -2\nv -3 2.6 -2\nv -3 0 2\nv 3 0 2\nv 3 2.6 2\nv -3 2.6 2\n\
        f 1 2 3 4\nf 6 5 8 7\nf 5 1 4 8\nf 2 6 7 3\nf 5 6 2 1\nf 4 3 7 8\n\
        v -1 2.5 -1\nv 1 2.5 -1\nv 1 2.5 1\nv -1 2.5 1\nusemtl lamp\nf 9 10 11 12\n";
    std::fs::write(&obj, room).unwrap();
    let materials = "newmtl wall\nKd 0.7 0.7 0.7\nnewmtl lamp\nKe 5 5 5\n";
    std::fs::write(folder.join("room.mtl"), materials).unwrap();
    obj.to_str().unwrap().to_owned()
}

/// The JSON of a render, and what was printed.
fn stats(folder: &Path, scene: &str, flags: &[&str]) -> (serde_json::Value, String) {
    let (out, json) = (folder.join("a.png"), folder.join("a.json"));
    let files = [
        "-o",
        out.to_str().unwrap(),
        "--stats",
        json.to_str().unwrap(),
    ];
    let size = ["render", scene, "--size", "32x24"];
    let (success, text) = gdpt(&[&size[..], &files, flags].concat());
    assert!(success, "{text}");
    let json = std::fs::read_to_string(json).unwrap();
    (serde_json::from_str(&json).unwrap(), text)
}

#[test]
fn a_closed_room_is_rendered_from_within() {
    let folder = TempDir::new().unwrap();
    let room = closed_room(folder.path());
    let (json, text) = stats(folder.path(), &room, &["--spp", "16"]);
    assert!(json["shows_something"].as_bool().unwrap(), "{text}");
    assert!(json["estimated_rel_mse"].as_f64().unwrap() > 0.0);
    assert!(text.contains("the camera is inside"), "{text}");
    // Other commands take the same camera.
    let info = folder.path().join("info.json");
    let args = [
        "info",
        &room,
        "--size",
        "32x24",
        "--json",
        info.to_str().unwrap(),
    ];
    let (success, text) = gdpt(&args);
    assert!(success && text.contains("the camera is inside"), "{text}");
}

/// Nothing is not a picture without error.
#[test]
fn the_error_of_nothing_is_not_known() {
    let folder = TempDir::new().unwrap();
    let room = closed_room(folder.path());
    // From outside there is no light; away from the room, nothing.
    let outside = ["--origin", "0,1,9", "--target", "0,1,0"];
    let away = ["--origin", "0,1,9", "--target", "0,1,99"];
    let sky = ["--environment", "1,1,1"];
    let cases: [(&[&str], &[&str], &str); 3] = [
        (&outside, &[], "outside of the scene; try --view inside"),
        (&away, &[], "sees nothing of the scene"),
        (&away, &sky, "sees nothing of the scene"),
    ];
    for (place, light, reason) in cases {
        for end in [&["--spp", "20"][..], &["--error", "0.5"]] {
            let flags = [place, light, end].concat();
            let (json, text) = stats(folder.path(), &room, &flags);
            assert!(json["estimated_rel_mse"].is_null(), "{flags:?}: {text}");
            assert!(!json["shows_something"].as_bool().unwrap());
            assert!(text.contains("relMSE none"), "{text}");
            assert_eq!(text.matches(reason).count(), 1, "{text}");
            let ended = if end[0] == "--error" {
                "nothing"
            } else {
                "samples"
            };
            assert_eq!(json["ended"], ended);
        }
    }
    // Nor does another picture made of the same samples know it.
    let out = folder.path().join("a.exr");
    let out = out.to_str().unwrap();
    let args = ["render", &room, "-o", out, "--size", "32x24", "--spp", "4"];
    assert!(gdpt(&[&args[..], &outside].concat()).0);
    let again = folder.path().join("b.exr");
    let (success, text) = gdpt(&["reconstruct", out, "-o", again.to_str().unwrap()]);
    assert!(success && !text.contains("estimated relMSE"), "{text}");
}

#[test]
fn contradicting_places_are_refused() {
    let args = [
        "render",
        "scenes/still.obj",
        "-o",
        "x.exr",
        "--origin",
        "0,0,9",
        "--view",
        "left",
    ];
    let (success, text) = gdpt(&args);
    assert!(
        !success && text.contains("--origin") && text.contains("--view"),
        "{text}"
    );
}
