//! Light of scenes that have none, skies, backgrounds and exposure: the studio about the camera, alpha in
//! files, and what pictures of 8 bits are shown with.

use crate::common::{Rng, chi_square};
use assert_cmd::Command;
use gdpt::error::Warnings;
use gdpt::load::environment::Background;
use gdpt::load::exr;
use gdpt::load::obj;
use gdpt::load::sidecar::CameraTable;
use gdpt::scene::{EnvironmentSetting, EnvironmentSource, Scene, SceneSettings};
use glam::{Quat, Vec3};
use std::path::Path;
use tempfile::TempDir;

const CUBE: &str = "mtllib a.mtl\nv -1 -1 -1\nv 1 -1 -1\nv 1 1 -1\nv -1 1 -1\nv -1 -1 1\nv 1 -1 1\nv 1 1 1\n\
                    v -1 1 1\nusemtl white\nf 5 6 7 8\nf 2 1 4 3\nf 6 2 3 7\nf 1 5 8 4\nf 8 7 3 4\nf 1 2 6 5\n";
const LAMP: &str =
    "v -1 5 -1\nv 1 5 -1\nv 1 5 1\nv -1 5 1\nusemtl lamp\nf 1 2 3 4\nf -4 -3 -2 -1\n";
/// Three sides of the cube; what is around it.
const VIEW: &str = "--size 48x36 --origin 3.5,2.7,4.5 --target 0,0,0 --fov 40";

/// A folder with `a.obj`, and `a.mtl` with lines that follow white.
fn folder(obj: &str, mtl: &str) -> TempDir {
    let folder = TempDir::new().unwrap();
    std::fs::write(folder.path().join("a.obj"), obj).unwrap();
    let mtl = format!("newmtl white\nKd 0.8 0.8 0.8\n{mtl}");
    std::fs::write(folder.path().join("a.mtl"), mtl).unwrap();
    folder
}

/// Runs the program in a folder. Whether it succeeded, and what it said.
fn gdpt(folder: &TempDir, args: &str) -> (bool, String) {
    let mut command = Command::cargo_bin("gdpt").unwrap();
    command.current_dir(folder.path());
    let output = command.args(args.split_whitespace()).output().unwrap();
    let text = [output.stdout, output.stderr].concat();
    (output.status.success(), String::from_utf8(text).unwrap())
}

/// [`gdpt`] that must succeed.
fn done(folder: &TempDir, args: &str) -> String {
    let (success, text) = gdpt(folder, args);
    assert!(success, "{args}: {text}");
    text
}

/// The pixels of a PNG: colours and opacity.
fn png(folder: &TempDir, name: &str) -> image::RgbaImage {
    image::open(folder.path().join(name)).unwrap().to_rgba8()
}

/// The largest difference between two pictures.
fn farthest(a: &image::RgbaImage, b: &image::RgbaImage) -> u8 {
    assert_eq!(a.dimensions(), b.dimensions());
    let differences = a.iter().zip(b.iter()).map(|(a, b)| a.abs_diff(*b));
    differences.max().unwrap()
}

fn scene(settings: &SceneSettings) -> Scene {
    let folder = folder(CUBE, "");
    let path = folder.path().join("a.obj");
    let mut warnings = Warnings::new(false);
    let file = obj::load(&path, &mut warnings).unwrap();
    Scene::build(Path::new("a.obj"), file, settings, &mut warnings).unwrap()
}

fn seen_from(origin: Vec3, up: Vec3) -> SceneSettings {
    SceneSettings {
        camera: CameraTable {
            origin: Some(origin.to_array()),
            target: Some([0.0; 3]),
            up: Some(up.to_array().into()),
            ..Default::default()
        },
        size: (48, 36),
        ..Default::default()
    }
}

#[test]
fn a_cube_in_the_studio_shows_three_sides() {
    let folder = folder(CUBE, "");
    let text = done(&folder, &format!("render a.obj -o o.png --spp 64 {VIEW}"));
    assert!(text.contains("no light: a studio"), "{text}");
    let picture = png(&folder, "o.png");
    let tone = |x, y| picture.get_pixel(x, y).0[0];
    // The top, the sides to the left and to the right, and what is behind.
    let tones = [tone(22, 9), tone(17, 20), tone(32, 20), tone(2, 2)];
    let mut sorted = tones;
    sorted.sort();
    assert!(sorted.windows(2).all(|w| w[1] - w[0] >= 12), "{tones:?}");
    assert!(tones[0] > tones[1] && tones[1] > tones[2], "{tones:?}");
    assert!(tones[2] > 60 && tones[0] < 250, "{tones:?}");
    assert!(picture.pixels().all(|p| p.0[0] < 253), "something is white");
}

#[test]
fn a_scene_with_lamps_has_no_studio() {
    let lit = folder(&format!("{CUBE}{LAMP}"), "newmtl lamp\nKe 9 9 9\n");
    let text = done(&lit, &format!("render a.obj -o o.png --spp 4 {VIEW}"));
    assert!(!text.contains("studio"), "{text}");
    assert_eq!(png(&lit, "o.png").get_pixel(1, 1).0, [0, 0, 0, 255]);
    // A lamp that is black is one too, or at least no reason for light that nobody asked for.
    let told = done(&lit, "info a.obj");
    assert!(told.contains("environment [0.0, 0.0, 0.0]"), "{told}");
    assert!(done(&folder(CUBE, ""), "info a.obj").contains("a studio"));
}

/// Whatever is up, from wherever it is seen: the lamps are where they were about the camera.
#[test]
fn the_studio_goes_with_the_camera() {
    let mut rng = Rng(7);
    let directions: Vec<Vec3> = (0..200).map(|_| rng.unit_vector()).collect();
    // By the camera's right, upwards and towards who looks at the scene.
    let light = |scene: &Scene| -> Vec<f32> {
        let (right, up) = (scene.camera.right(), scene.camera.up());
        let out = right.cross(up);
        let radiance = |d: &Vec3| {
            let d = right * d.x + up * d.y + out * d.z;
            scene.environment.radiance(d).x
        };
        directions.iter().map(radiance).collect()
    };
    let wanted = light(&scene(&seen_from(Vec3::new(0.0, 1.0, 5.0), Vec3::Y)));
    let close = |found: Vec<f32>, what: &str| {
        for (found, wanted) in found.iter().zip(&wanted) {
            assert!((found - wanted).abs() < 2e-3, "{what}: {found} {wanted}");
        }
    };
    for up in [Vec3::Y, Vec3::Z, Vec3::X, -Vec3::Y, -Vec3::Z, -Vec3::X] {
        let side = if up.z == 0.0 { Vec3::Z } else { Vec3::X };
        for angle in [0.0, 1.0, 2.0, 4.0] {
            let turn = Quat::from_axis_angle(up, angle);
            let origin = turn * (4.0 * side + 2.0 * up);
            close(light(&scene(&seen_from(origin, up))), "seen from around");
        }
    }
    // A scene that is looked at by another camera, as a turntable does.
    let mut scene = scene(&seen_from(Vec3::new(1.0, 1.0, 5.0), Vec3::Y));
    scene.look_by(scene.camera.turned(2.5));
    close(light(&scene), "turned");

    // Brighter from the upper left than from the right and from below, and from behind at the edges.
    let from = |x: f32, y: f32, z: f32| {
        let d = Vec3::new(x, y, z).normalize();
        scene
            .environment
            .radiance(
                scene.camera.right() * d.x
                    + Vec3::Y * d.y
                    + scene.camera.right().cross(Vec3::Y) * d.z,
            )
            .x
    };
    assert!(from(-1.0, 1.0, 1.0) > 5.0 * from(1.0, 0.5, 1.0));
    assert!(from(0.5, 0.7, -1.0) > 3.0 * from(0.5, -0.7, -1.0));
}

/// χ² of the sampled directions in 32 x 16 regions, and the integral of their density.
#[test]
fn directions_to_studio_and_sky_follow_their_density() {
    let sky = |elevation| EnvironmentSource::Sky {
        azimuth: 20.0,
        elevation,
    };
    for (what, source) in [
        ("studio", EnvironmentSource::Studio),
        ("sky", sky(40.0)),
        ("low sun", sky(1.0)),
    ] {
        let settings = SceneSettings {
            environment: EnvironmentSetting {
                rotation: -20.0,
                ..source.into()
            },
            ..seen_from(Vec3::new(0.0, 0.0, 5.0), Vec3::Y)
        };
        let scene = scene(&settings);
        let map = scene.environment.map().unwrap();
        let (width, height) = map.size();
        let region = |d: Vec3| {
            let across = d.x.atan2(-d.z) / std::f32::consts::TAU;
            let down = d.y.clamp(-1.0, 1.0).acos() / std::f32::consts::PI;
            let column = (((across - across.floor()) * 32.0) as usize).min(31);
            ((down * 16.0) as usize).min(15) * 32 + column
        };
        // The density is constant in a pixel.
        let mut expected = vec![0.0f64; 32 * 16];
        let mut light = Vec3::ZERO;
        for y in 0..height {
            let edge = |y: u32| (std::f64::consts::PI * f64::from(y) / f64::from(height)).cos();
            let solid = std::f64::consts::TAU / f64::from(width) * (edge(y) - edge(y + 1));
            let (sin, cos) = (std::f32::consts::PI * (y as f32 + 0.5) / height as f32).sin_cos();
            for x in 0..width {
                let angle = std::f32::consts::TAU * (x as f32 + 0.5) / width as f32;
                let d = Vec3::new(angle.sin() * sin, cos, -angle.cos() * sin);
                expected[region(d)] += f64::from(map.density(d)) * solid;
                light += scene.environment.radiance(d) * solid as f32;
            }
        }
        let total: f64 = expected.iter().sum();
        assert!((total - 1.0).abs() < 1e-3, "{what}: {total}");

        const N: usize = 200_000;
        let mut rng = Rng(5);
        let mut observed = vec![0.0; 32 * 16];
        let mut sampled = Vec3::ZERO;
        for _ in 0..N {
            let s = map.sample::<f32>([rng.next(), rng.next()], 1);
            observed[region(s.direction.into())] += 1.0;
            sampled += Vec3::from(s.radiance) / s.density / N as f32;
        }
        let counts: Vec<f64> = expected.iter().map(|e| e * N as f64).collect();
        chi_square(what, &observed, &counts, 1e-5);
        let far = (sampled / light - 1.0).abs().max_element();
        assert!(far < 0.02, "{what}: {sampled} {light}");
    }
}

#[test]
fn the_sun_is_where_it_is_said() {
    // From the front towards the right, by a right angle; and up.
    for (up, front, right) in [(Vec3::Y, Vec3::Z, Vec3::X), (Vec3::Z, Vec3::NEG_Y, Vec3::X)] {
        let settings = SceneSettings {
            environment: EnvironmentSetting {
                rotation: 60.0,
                ..EnvironmentSource::Sky {
                    azimuth: 30.0,
                    elevation: 30.0,
                }
                .into()
            },
            ..seen_from(5.0 * front + up, up)
        };
        let scene = scene(&settings);
        let (sin, cos) = 30f32.to_radians().sin_cos();
        let sun = right * cos + up * sin;
        let radiance = |d: Vec3| scene.environment.radiance(d.normalize()).y;
        assert!(radiance(sun) > 1000.0);
        for beside in [front, -front, up, -up, -right] {
            assert!(radiance(sun + 0.1 * beside) < 5.0, "{beside}");
        }
        assert_eq!(scene.background, Background::Environment);
    }
    let folder = folder(CUBE, "");
    let render = |flags: &str| {
        gdpt(
            &folder,
            &format!("render a.obj -o o.png --spp 1 {VIEW} {flags}"),
        )
    };
    assert!(render("--environment sky").0 && render("--sun 60,20").0);
    let (success, text) = render("--environment white --sun 60,20");
    assert!(!success && text.contains("--sun"), "{text}");
}

/// Behind a scene of lamps and Lambert surfaces, which goes through lanes, and behind one with a lens or with
/// a map, by both methods: the colour, and the light of the scene over it.
#[test]
fn the_background_is_behind_the_scene() {
    let lit = folder(&format!("{CUBE}{LAMP}"), "newmtl lamp\nKe 9 9 9\n");
    let dark = folder(CUBE, "");
    for (folder, flags) in [
        (&lit, "--method pt"),
        (&lit, "--method gpt"),
        (&lit, "--aperture 0.1"),
        (&dark, "--method pt"),
        (&dark, "--method gpt"),
        (&dark, "--environment 1 --filter mitchell"),
    ] {
        let render = |background: &str, output: &str| {
            done(
                folder,
                &format!(
                    "render a.obj -o {output} --spp 4 {VIEW} {flags} --background {background}"
                ),
            )
        };
        render("0.25,0.5,1", "o.png");
        let picture = png(folder, "o.png");
        assert_eq!(picture.get_pixel(1, 1).0, [137, 188, 255, 255], "{flags}");
        assert_ne!(picture.get_pixel(24, 20).0, [137, 188, 255, 255], "{flags}");
        render("0.25,0.5,1", "colour.exr");
        render("transparent", "alpha.exr");
        let read = |name: &str| exr::load(&folder.path().join(name)).unwrap();
        let (colour, alpha) = (read("colour.exr"), read("alpha.exr"));
        let a = &alpha.channels["A"];
        assert_eq!(a, &colour.channels["coverage.A"], "{flags}");
        assert!(a.contains(&0.0) && a.contains(&1.0), "{flags}");
        assert!(a.iter().any(|a| (0.1..0.9).contains(a)), "{flags}");
        for (channel, behind) in [("R", 0.25), ("G", 0.5), ("B", 1.0)] {
            let pixels = colour.channels[channel].iter();
            for ((over, scene), a) in pixels.zip(&alpha.channels[channel]).zip(a) {
                assert!(*a > 0.0 || *scene == 0.0, "{flags}");
                assert!((over - scene - behind * (1.0 - a)).abs() < 1e-5, "{flags}");
            }
        }
        // Nothing else depends on it.
        assert_eq!(colour.channels["primal.G"], alpha.channels["primal.G"]);
    }
}

/// A lamp of radiance 1 over nothing: its light is its coverage, whatever the filter.
#[test]
fn coverage_is_by_the_pixel_filter() {
    let folder = folder(
        "mtllib a.mtl\nv -1 0 -1\nv 1 0 -1\nv 0.3 0 1\nusemtl lamp\nf 3 2 1\n",
        "newmtl lamp\nKe 1 1 1\n",
    );
    for filter in ["box", "tent", "gaussian", "mitchell"] {
        done(
            &folder,
            &format!(
                "render a.obj -o o.exr --size 24x24 --spp 64 --filter {filter} --background transparent \
                 --origin 0,3,0 --target 0,0,0 --up 0,0,-1"
            ),
        );
        let file = exr::load(&folder.path().join("o.exr")).unwrap();
        let (light, alpha) = (&file.channels["R"], &file.channels["A"]);
        assert!(alpha.iter().any(|a| (0.1..0.9).contains(a)), "{filter}");
        for (light, alpha) in light.iter().zip(alpha) {
            assert!(
                (light.clamp(0.0, 1.0) - alpha).abs() < 1e-5,
                "{filter}: {light} {alpha}"
            );
        }
    }
}

#[test]
fn reconstructed_pictures_keep_their_background_and_exposure() {
    let folder = folder(CUBE, "");
    for background in ["transparent", "0.1,0.2,0.3", "environment"] {
        let flags = format!("--spp 8 {VIEW} --background {background}");
        done(
            &folder,
            &format!("render a.obj -o o.exr --preview o.png {flags}"),
        );
        let told = done(&folder, "reconstruct o.exr -o again.png");
        assert!(told.contains("--exposure"), "{told}");
        done(&folder, "reconstruct o.exr -o again.exr");
        let read = |name: &str| exr::load(&folder.path().join(name)).unwrap().channels;
        let (first, again) = (read("o.exr"), read("again.exr"));
        assert_eq!(first.get("A"), again.get("A"), "{background}");
        assert_eq!(first.get("coverage.A"), again.get("coverage.A"));
        for (a, b) in first["R"].iter().zip(&again["R"]) {
            assert!((a - b).abs() < 1e-4, "{background}: {a} {b}");
        }
        // And from that once more.
        done(&folder, "reconstruct again.exr -o more.png");
        for other in ["again.png", "more.png"] {
            let far = farthest(&png(&folder, "o.png"), &png(&folder, other));
            assert!(far <= 1, "{background}: {far} in {other}");
        }
    }
    let alpha = png(&folder, "o.png");
    assert!(alpha.pixels().all(|p| p.0[3] == 255));
    done(
        &folder,
        &format!("render a.obj -o o.png --spp 8 {VIEW} --background transparent"),
    );
    let alpha = png(&folder, "o.png");
    assert_eq!(alpha.get_pixel(1, 1).0[3], 0);
    assert_eq!(alpha.get_pixel(24, 18).0[3], 255);
    assert!(alpha.pixels().any(|p| (20..230).contains(&p.0[3])));
    // Not multiplied: the edge is not darker than the cube's darkest side.
    let opaque = alpha.pixels().filter(|p| p.0[3] == 255);
    let darkest = opaque.map(|p| p.0[0]).min().unwrap();
    let edge = alpha.pixels().filter(|p| (20..230).contains(&p.0[3]));
    let (count, sum) = edge.fold((0, 0), |(n, sum), p| (n + 1, sum + u32::from(p.0[0])));
    assert!(sum / count > u32::from(darkest), "{sum} {count} {darkest}");
}

#[test]
fn a_brighter_light_makes_the_same_picture() {
    let pictures = [1.0, 100.0, 1e-3].map(|scale: f32| {
        let ke = 3.0 * scale;
        let lit = folder(&format!("{CUBE}{LAMP}"), &format!("newmtl lamp\nKe {ke} {ke} {ke}\n"));
        let text = done(&lit, &format!("render a.obj -o o.png --spp 16 {VIEW} --environment 0.1 --environment-scale {scale}"));
        // What it says shows it so again.
        let stated = text.split("shown with ").nth(1).unwrap().lines().next().unwrap();
        done(&lit, &format!("render a.obj -o again.png --spp 16 {VIEW} --environment 0.1 --environment-scale {scale} {stated}"));
        let picture = png(&lit, "o.png");
        assert_eq!(picture, png(&lit, "again.png"), "{stated}");
        picture
    });
    let [first, others @ ..] = &pictures;
    for other in others {
        let far = farthest(first, other);
        assert!(far <= 1, "{far}");
    }
    // A picture of nothing.
    let dark = folder(CUBE, "");
    let text = done(
        &dark,
        &format!("render a.obj -o o.png --spp 1 {VIEW} --environment 0"),
    );
    assert!(text.contains("--exposure 0 "), "{text}");
}

#[test]
fn tones_are_as_the_flag_says() {
    let folder = folder(CUBE, "");
    // The environment is 0.5 behind the cube.
    for (tone, wanted) in [("srgb", 188), ("neutral", 181), ("agx", 174)] {
        let flags = format!("--environment 0.5 --exposure 0 --tone {tone}");
        done(
            &folder,
            &format!("render a.obj -o o.png --spp 1 {VIEW} {flags}"),
        );
        let corner = png(&folder, "o.png").get_pixel(1, 1).0[0];
        assert!(corner.abs_diff(wanted) <= 1, "{tone}: {corner}");
    }
    for bad in [
        "--tone filmic",
        "--exposure bright",
        "--background grey",
        "--environment-scale 0",
    ] {
        let (success, text) = gdpt(&folder, &format!("render a.obj -o o.png {bad}"));
        assert!(
            !success && text.contains("needs") || text.contains("possible values"),
            "{text}"
        );
    }
}

#[test]
fn pictures_in_the_studio_are_the_same_for_any_number_of_threads() {
    let folder = folder(CUBE, "");
    for threads in [1, 2] {
        let flags = format!("--spp 4 {VIEW} --background transparent --threads {threads}");
        done(&folder, &format!("render a.obj -o {threads}.png {flags}"));
    }
    let read = |name: &str| std::fs::read(folder.path().join(name)).unwrap();
    assert_eq!(read("1.png"), read("2.png"));
}

/// The frames have one exposure, and the light goes with the camera: a cube looks the same from its four sides.
#[test]
fn frames_of_a_turntable_are_lit_alike() {
    let folder = folder(CUBE, "");
    done(
        &folder,
        &format!("render a.obj -o o.png --spp 64 --turntable 4 {VIEW}"),
    );
    let frames: Vec<_> = (0..4)
        .map(|i| png(&folder, &format!("o/00{i}.png")))
        .collect();
    for frame in &frames[1..] {
        for (x, y) in [(22, 9), (17, 20), (32, 20)] {
            let (a, b) = (frames[0].get_pixel(x, y).0[0], frame.get_pixel(x, y).0[0]);
            assert!(a.abs_diff(b) <= 4, "{x} {y}: {a} {b}");
        }
    }
}

#[test]
fn the_toml_says_light_and_background() {
    let folder = folder(CUBE, "");
    let render = |toml: &str, flags: &str| {
        std::fs::write(folder.path().join("a.toml"), toml).unwrap();
        done(
            &folder,
            &format!("render a.obj -o o.exr --spp 4 {VIEW} {flags}"),
        );
        let file = exr::load(&folder.path().join("o.exr")).unwrap();
        ["R", "G", "B"].map(|c| (file.channels[c][0] * 1e4).round() / 1e4)
    };
    let white = "[environment]\nradiance = [1, 2, 3]\nscale = 0.5\n";
    assert_eq!(render(white, ""), [0.5, 1.0, 1.5]);
    assert_eq!(render(white, "--environment-scale 2"), [2.0, 4.0, 6.0]);
    assert_eq!(render(white, "--environment white"), [1.0; 3]);
    let grey = "[environment]\nbackground = [0.25, 0.5, 0.75]\n";
    assert_eq!(render(grey, ""), [0.25, 0.5, 0.75]);
    assert_eq!(render(grey, "--background black"), [0.0; 3]);
    assert_eq!(render(grey, "--environment 1"), [0.25, 0.5, 0.75]);
    let none = "[environment]\nmodel = 'studio'\nbackground = 'transparent'\n";
    assert_eq!(render(none, ""), [0.0; 3]);
    // The ground of a sky, by its sun.
    let sky = render("[environment]\nsun = [10, 50]\n", "");
    assert!(sky.iter().all(|x| (0.1..0.3).contains(x)), "{sky:?}");
    assert_eq!(
        sky,
        render("[environment]\nmodel = 'sky'\nsun = [10, 50]\n", "")
    );
    assert_eq!(sky, render("", "--sun 10,50"));
    assert_eq!(
        sky,
        render("", "--environment sky --sun 70,50 --rotate-environment -60")
    );
}
