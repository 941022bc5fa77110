//! Textures: files of every kind, what is missing, what buffers and rays see of them; maps of the environment.

use crate::common::{Render, Rng, chi_square, scene_of_file, tracer};
use assert_cmd::Command;
use clap::ValueEnum;
use gdpt::error::Warnings;
use gdpt::film::Halves;
use gdpt::load::bitmap::{self, Bitmap, Texels};
use gdpt::load::obj;
use gdpt::render::Method;
use gdpt::scene::environment::{Axes, EnvironmentMap};
use gdpt::scene::texture::Texture;
use gdpt::scene::textured::Place;
use gdpt::trace::Backend;
use glam::{Vec2, Vec3};
use image::{Rgb, Rgb32FImage, RgbImage, Rgba, RgbaImage};
use std::sync::Arc;
use tempfile::TempDir;

/// A floor with texture coordinates seen from above, under a white sky.
const FLOOR: &str = "mtllib a.mtl\nusemtl m\nv -1 0 1\nv 1 0 1\nv 1 0 -1\nv -1 0 -1\n\
                     vt 0 0\nvt 1 0\nvt 1 1\nvt 0 1\nf 1/1 2/2 3/3 4/4\n";
const ABOVE: &str = "[camera]\norigin = [0, 2, 0]\ntarget = [0, 0, 0]\nup = [0, 0, -1]\nfov = 50\n\
                     [environment]\nradiance = [1, 1, 1]\n";

fn folder(mtl: &str) -> TempDir {
    let folder = TempDir::new().unwrap();
    for (name, text) in [("a.obj", FLOOR), ("a.mtl", mtl), ("a.toml", ABOVE)] {
        std::fs::write(folder.path().join(name), text).unwrap();
    }
    folder
}

/// A DDS file without compression: blue, green, red, alpha.
fn dds(picture: &RgbImage) -> Vec<u8> {
    let (width, height) = picture.dimensions();
    let mut words = [0u32; 32];
    words[0] = u32::from_le_bytes(*b"DDS ");
    // Size of the header; what of it is given; height, width, bytes of a row.
    words[1..6].copy_from_slice(&[124, 0x100f, height, width, 4 * width]);
    // Size of the format, what of it is given, bits of a pixel, masks of the channels.
    words[19..21].copy_from_slice(&[32, 0x41]);
    words[22..27].copy_from_slice(&[32, 0xff_0000, 0xff00, 0xff, 0xff00_0000]);
    words[27] = 0x1000;
    let pixels = picture.pixels().map(|p| [p.0[2], p.0[1], p.0[0], 255]);
    let head = words.iter().flat_map(|w| w.to_le_bytes());
    head.chain(pixels.flatten()).collect()
}

/// Colours of 5 x 3 pixels.
fn colour(x: u32, y: u32) -> [u8; 3] {
    [40 * x as u8 + 20, 80 * y as u8 + 10, 200 - 30 * x as u8]
}

#[test]
fn pictures_of_every_kind_are_read() {
    let folder = TempDir::new().unwrap();
    let bytes = RgbImage::from_fn(5, 3, |x, y| Rgb(colour(x, y)));
    let floats = Rgb32FImage::from_fn(5, 3, |x, y| Rgb(colour(x, y).map(|b| f32::from(b) / 64.0)));
    for name in [
        "a.png", "a.TGA", "a.bmp", "a.jpg", "a.gif", "a.webp", "a.tiff", "a.ppm", "a.dds", "a.hdr",
        "a.exr",
    ] {
        let path = folder.path().join(name);
        let (tolerance, scale) = match name {
            "a.hdr" => {
                let encoder =
                    image::codecs::hdr::HdrEncoder::new(std::fs::File::create(&path).unwrap());
                let pixels: Vec<Rgb<f32>> = floats.pixels().copied().collect();
                encoder.encode(&pixels, 5, 3).unwrap();
                (0.02, 64.0)
            }
            "a.exr" => {
                let value = |x: usize, y: usize| {
                    let [r, g, b] = floats.get_pixel(x as u32, y as u32).0;
                    (r, g, b)
                };
                exr::prelude::write_rgb_file(&path, 5, 3, value).unwrap();
                (1e-3, 64.0)
            }
            "a.dds" => {
                std::fs::write(&path, dds(&bytes)).unwrap();
                (0.0, 255.0)
            }
            _ => {
                bytes.save(&path).unwrap();
                let tolerance = match name {
                    "a.jpg" => 0.35,
                    // Colours of a palette.
                    "a.gif" => 0.02,
                    _ => 0.0,
                };
                (tolerance, 255.0)
            }
        };
        // What a file holds says what it is.
        let misnamed = folder.path().join("misnamed.png");
        std::fs::copy(&path, &misnamed).unwrap();
        assert_eq!(
            bitmap::load(&misnamed).unwrap(),
            bitmap::load(&path).unwrap()
        );
        let read = bitmap::load(&path).unwrap();
        assert_eq!(
            (read.width, read.height, read.has_alpha),
            (5, 3, false),
            "{name}"
        );
        assert_eq!(
            matches!(read.texels, Texels::Bytes(_)),
            scale == 255.0,
            "{name}"
        );
        let texture = Texture::of_bitmap(Arc::new(read));
        for index in 0..15u32 {
            let wanted = Vec3::from(colour(index % 5, index / 5).map(f32::from));
            let found = texture.texel(index as usize) * scale;
            let error = (found - wanted).abs().max_element();
            assert!(
                error <= tolerance * 200.0 + 1e-3,
                "{name} {index}: {found} {wanted}"
            );
        }
    }
    // As other programs begin Radiance files.
    let radiance = std::fs::read(folder.path().join("a.hdr")).unwrap();
    let rest = radiance.strip_prefix(b"#?RADIANCE").unwrap();
    let path = folder.path().join("rgbe.hdr");
    std::fs::write(&path, [b"#?RGBE", rest].concat()).unwrap();
    let plain = bitmap::load(&folder.path().join("a.hdr")).unwrap();
    assert_eq!(bitmap::load(&path).unwrap(), plain);

    std::fs::write(folder.path().join("b.png"), b"no picture").unwrap();
    let message = bitmap::load(&folder.path().join("b.png"))
        .unwrap_err()
        .to_string();
    assert!(message.contains("b.png") && message.contains("no picture that can be read"));
}

#[test]
fn a_missing_texture_is_named_with_its_path_and_grey() {
    let folder = folder("newmtl m\nmap_Kd maps\\none.png\n");
    let scene = folder.path().join("a.obj");
    let render = |flags: &[&str]| {
        let mut command = Command::cargo_bin("gdpt").unwrap();
        command
            .arg("render")
            .arg(&scene)
            .arg("-o")
            .arg(folder.path().join("o.exr"));
        command
            .args(["--size", "8x8", "--spp", "2"])
            .args(flags)
            .output()
            .unwrap()
    };
    let output = render(&[]);
    assert!(output.status.success());
    let text = String::from_utf8(output.stderr).unwrap();
    let path = folder.path().canonicalize().unwrap();
    for word in [
        path.to_str().unwrap(),
        "maps\\none.png",
        "a.mtl:2",
        "--textures",
    ] {
        assert!(text.contains(word), "no {word} in: {text}");
    }
    assert!(!render(&["--textures", "nowhere"]).status.success());
    let more = TempDir::new().unwrap();
    RgbImage::from_pixel(1, 1, Rgb([99; 3]))
        .save(more.path().join("None.png"))
        .unwrap();
    let output = render(&["--strict", "--textures", more.path().to_str().unwrap()]);
    assert!(output.status.success());
    assert!(!render(&["--strict"]).status.success());
    let mut warnings = Warnings::new(false);
    let file = obj::load(&scene, &mut warnings).unwrap();
    let scene = gdpt::scene::Scene::build(&scene, file, &settings(), &mut warnings).unwrap();
    assert_eq!(scene.materials[0].bsdf.colour(), Vec3::splat(0.5));
}

fn settings() -> gdpt::scene::SceneSettings {
    gdpt::scene::SceneSettings {
        size: (8, 8),
        roughness_threshold: 0.01,
        ..Default::default()
    }
}

#[test]
fn a_file_is_read_once() {
    let folder = folder("newmtl m\nmap_Kd A.png\nmap_Pr a.png\nnewmtl n\nmap_Ke -s 2 2 ./a.png\n");
    RgbImage::new(2, 2)
        .save(folder.path().join("a.png"))
        .unwrap();
    let text = format!("{FLOOR}usemtl n\nf 1/1 2/2 3/3\n");
    std::fs::write(folder.path().join("a.obj"), text).unwrap();
    let file = obj::load(&folder.path().join("a.obj"), &mut Warnings::new(true)).unwrap();
    let maps: Vec<_> = file.materials.iter().flat_map(|m| &m.maps).collect();
    let first = maps[0].bitmap.as_ref().unwrap();
    assert_eq!(maps.len(), 3);
    assert!(
        maps.iter()
            .all(|m| Arc::ptr_eq(first, m.bitmap.as_ref().unwrap()))
    );
}

/// The quarters of a picture lie on the floor as they should, and the albedo buffer sees their colours.
#[test]
fn textures_lie_upright_and_are_in_the_albedo_buffer() {
    let folder = folder("newmtl m\nKd 0.1 0.2 0.3\nmap_Kd a.png\n");
    let quarters = [[255, 0, 0], [0, 255, 0], [0, 0, 255], [255, 255, 255]];
    let picture = RgbImage::from_fn(64, 64, |x, y| {
        Rgb(quarters[(x / 32 + 2 * (y / 32)) as usize])
    });
    picture.save(folder.path().join("a.png")).unwrap();
    let scene = scene_of_file(&folder.path().join("a.obj"), 16, 16);
    let film = Render {
        spp: 16,
        ..Default::default()
    }
    .film(&scene, &*tracer(&scene));
    let albedo = film.first_hits().albedo;
    for (index, [r, g, b]) in quarters.into_iter().enumerate() {
        let (x, y) = (4 + 8 * (index % 2), 4 + 8 * (index / 2));
        let wanted = Vec3::new(r as f32, g as f32, b as f32) / 255.0;
        let found = albedo.get(y * 16 + x);
        assert!(
            (found - wanted).abs().max_element() < 1e-6,
            "{index}: {found}"
        );
    }
}

/// A board of which everything is cut out is not there, to the bit; one of which nothing is hides the floor.
#[test]
fn what_is_cut_out_is_not_there() {
    let render = |board: bool, alpha: u8| {
        let folder = folder("newmtl m\nKd 0.6 0.6 0.6\nnewmtl n\nKd 0.1 0.1 0.1\nmap_d a.png\n");
        let picture = RgbaImage::from_pixel(4, 4, Rgba([255, 255, 255, alpha]));
        picture.save(folder.path().join("a.png")).unwrap();
        let board = if board {
            "usemtl n\nv -1 0.5 1\nv 1 0.5 1\nv 1 0.5 -1\nv -1 0.5 -1\nf 5/1 6/2 7/3 8/4\n"
        } else {
            ""
        };
        std::fs::write(folder.path().join("a.obj"), format!("{FLOOR}{board}")).unwrap();
        let scene = scene_of_file(&folder.path().join("a.obj"), 8, 8);
        assert_eq!(scene.mesh.cutouts.is_some(), !board.is_empty());
        let film = Render {
            spp: 4,
            ..Default::default()
        }
        .film(&scene, &*tracer(&scene));
        film.estimate(Halves::Both).primal.channels
    };
    let without = render(false, 0);
    assert_eq!(render(true, 0), without);
    let hidden = render(true, 255);
    assert!(hidden[0].iter().zip(&without[0]).all(|(h, w)| h < w));
}

/// A scene of nothing but triangles with holes.
#[test]
fn everything_may_have_holes() {
    let folder = folder("newmtl m\nKd 0.6 0.6 0.6\nmap_d a.png\n");
    let picture = RgbaImage::from_fn(64, 64, |x, _| {
        Rgba([255, 255, 255, if x < 32 { 0 } else { 255 }])
    });
    picture.save(folder.path().join("a.png")).unwrap();
    let scene = scene_of_file(&folder.path().join("a.obj"), 16, 16);
    assert_eq!(scene.mesh.cutouts.as_ref().unwrap().first, 0);
    for backend in Backend::value_variants() {
        let tracer = backend.build(&scene.mesh, 1).unwrap();
        let film = Render {
            spp: 4,
            ..Default::default()
        }
        .film(&scene, &*tracer);
        let hits = film.first_hits().depth;
        // The floor fills the picture but for its border.
        for (index, depth) in hits.iter().enumerate() {
            let (x, y) = (index % 16, index / 16);
            if (2..14).contains(&x) && (2..14).contains(&y) && x != 7 && x != 8 {
                assert_eq!(*depth > 0.0, x > 7, "{backend:?} {x} {y}");
            }
        }
    }
}

/// Emission by a texture of two halves: light sampling and BSDF sampling agree on what arrives.
#[test]
fn a_textured_lamp_gives_the_light_of_its_bright_half() {
    let folder = folder(
        "newmtl m\nKd 0.5 0.5 0.5\nnewmtl lamp\nKe 4 4 4\nmap_Ke a.png\nnewmtl half\nKe 4 4 4\n",
    );
    let picture = RgbImage::from_fn(64, 1, |x, _| Rgb(if x < 32 { [255; 3] } else { [0; 3] }));
    picture.save(folder.path().join("a.png")).unwrap();
    let dark = ABOVE.replace("[1, 1, 1]", "[0, 0, 0]");
    std::fs::write(folder.path().join("a.toml"), dark).unwrap();
    let mean = |lamp: &str| {
        std::fs::write(folder.path().join("a.obj"), format!("{FLOOR}{lamp}")).unwrap();
        let scene = scene_of_file(&folder.path().join("a.obj"), 8, 8);
        let render = Render {
            method: Method::Pt,
            spp: 1024,
            ..Default::default()
        };
        let image = render.estimate(&scene, &*tracer(&scene)).primal;
        image.channels[0].iter().sum::<f32>() / 64.0
    };
    // Above the camera; the plain lamp is the bright half alone.
    let textured = mean("usemtl lamp\nv -1 3 -1\nv 1 3 -1\nv 1 3 1\nv -1 3 1\nf 5/1 6/2 7/3 8/4\n");
    let plain = mean("usemtl half\nv -1 3 -1\nv 0 3 -1\nv 0 3 1\nv -1 3 1\nf 5/1 6/2 7/3 8/4\n");
    // Bilinear lookups blur the borders by half a pixel of 64, at the middle and where the picture repeats.
    assert!((textured / plain - 1.0).abs() < 0.01, "{textured} {plain}");
}

/// A sky with a dark band, a bright spot and values next to black.
fn sky(sun: f32) -> EnvironmentMap {
    let mut values = vec![[0.2f32, 0.3, 0.5]; 32 * 16];
    values[32 * 7..32 * 9].fill([0.0; 3]);
    values[32 * 4 + 9] = [sun, 0.9 * sun, 0.7 * sun];
    let bitmap = Bitmap {
        width: 32,
        height: 16,
        texels: Texels::Floats {
            values,
            alpha: None,
            encoded: false,
        },
        has_alpha: false,
    };
    EnvironmentMap::new(Arc::new(bitmap), 1.5, 35.0, Axes::of_up(Vec3::Y)).unwrap()
}

/// Samples against their density by χ² at 1e-5, the integral of the density, and the light in all.
#[test]
fn directions_to_the_sky_follow_their_density() {
    for sun in [90.0, 1e5] {
        check_sky(sun);
    }
}

fn check_sky(sun: f32) {
    const FINE: usize = 8;
    let sky = sky(sun);
    // Longitude and latitude in turns, as the documentation has them: the middle of the picture towards +z,
    // a quarter of it towards +x, turned by 35 degrees.
    let turned = 35.0 / 360.0;
    let direction = |across: f32, down: f32| {
        let (sin, cos) = (std::f32::consts::TAU * (across - turned)).sin_cos();
        let (r, up) = (std::f32::consts::PI * down).sin_cos();
        Vec3::new(r * sin, up, -r * cos)
    };
    // Over each pixel, evenly by angle and weighted by solid angle.
    let grid = |f: &dyn Fn(Vec3) -> f64| {
        let mut sums = vec![0.0f64; 32 * 16];
        let (columns, rows) = (32 * FINE, 16 * FINE);
        for j in 0..rows {
            let edge = |j: usize| (std::f64::consts::PI * j as f64 / rows as f64).cos();
            let solid = std::f64::consts::TAU / columns as f64 * (edge(j) - edge(j + 1));
            for i in 0..columns {
                let (across, down) = (i as f32 + 0.5, j as f32 + 0.5);
                let d = direction(across / columns as f32, down / rows as f32);
                sums[j / FINE * 32 + i / FINE] += f(d) * solid;
            }
        }
        sums
    };
    let expected = grid(&|d| f64::from(sky.density(d)));
    let total: f64 = expected.iter().sum();
    assert!(
        (total - 1.0).abs() < 1e-4,
        "the density integrates to {total}"
    );

    const N: usize = 400_000;
    let mut rng = Rng(12);
    let mut observed = vec![0.0; 32 * 16];
    let (mut light, mut square) = (0.0f64, 0.0f64);
    for _ in 0..N {
        let s = sky.sample::<f32>([rng.next(), rng.next()], 1);
        let d = Vec3::from(s.direction);
        assert!((d.length() - 1.0).abs() < 1e-5);
        let there = sky.density(d);
        // At the border of two pixels rounding decides.
        if (there - s.density).abs() > 1e-4 * s.density {
            let near = sky.density((d + Vec3::splat(2e-6)).normalize());
            let far = sky.density((d - Vec3::splat(2e-6)).normalize());
            assert!(near != far || near == s.density, "{there} {}", s.density);
        }
        let across = d.x.atan2(-d.z) / std::f32::consts::TAU + turned;
        let down = d.y.clamp(-1.0, 1.0).acos() / std::f32::consts::PI;
        let column = (((across - across.floor()) * 32.0) as usize).min(31);
        observed[((down * 16.0) as usize).min(15) * 32 + column] += 1.0;
        let value = f64::from(s.radiance.x / s.density);
        light += value / N as f64;
        square += value * value / N as f64;
    }
    let counts: Vec<f64> = expected.iter().map(|e| e * N as f64).collect();
    chi_square("sky", &observed, &counts, 1e-5);
    // The same light by the grid.
    let environment = gdpt::scene::environment::Environment::Map(Box::new(sky));
    let by_grid: f64 = grid(&|d| f64::from(environment.radiance(d).x)).iter().sum();
    let deviation = ((square - light * light) / N as f64).sqrt();
    assert!(
        (light - by_grid).abs() < 5.0 * deviation + 2e-3 * by_grid,
        "{light} {by_grid} {deviation}"
    );
}

#[test]
fn black_maps_and_impossible_settings_are_refused() {
    let folder = folder("newmtl m\n");
    let render = |toml: &str| {
        std::fs::write(folder.path().join("a.toml"), toml).unwrap();
        let mut command = Command::cargo_bin("gdpt").unwrap();
        command.args(["render", "--spp", "1", "--size", "4x4", "-o"]);
        let output = command
            .arg(folder.path().join("o.png"))
            .arg(folder.path().join("a.obj"))
            .output()
            .unwrap();
        (
            output.status.success(),
            String::from_utf8(output.stderr).unwrap(),
        )
    };
    RgbImage::new(4, 2)
        .save(folder.path().join("black.png"))
        .unwrap();
    RgbImage::from_pixel(4, 2, Rgb([9; 3]))
        .save(folder.path().join("grey.png"))
        .unwrap();
    for (toml, word) in [
        ("[environment]\nmap = 'black.png'\n", "black"),
        ("[environment]\nmap = 'none.exr'\n", "none.exr"),
        (
            "[environment]\nmap = 'grey.png'\nradiance = [1, 1, 1]\n",
            "one of them",
        ),
        (
            "[environment]\nmap = 'grey.png'\nmodel = 'sky'\n",
            "one of them",
        ),
        ("[environment]\nmodel = 'studio'\nsun = [1, 2]\n", "no sky"),
        ("[environment]\nsun = [1, 91]\n", "elevation"),
        ("[environment]\nsun = [nan, 9]\n", "azimuth"),
        ("[environment]\nbackground = 'grey'\n", "transparent"),
        ("[environment]\nmap = 'grey.png'\nscale = -1.0\n", "scale"),
    ] {
        let (success, text) = render(toml);
        assert!(
            !success && text.contains(word) && text.lines().count() == 1,
            "{toml}: {text}"
        );
    }
    assert!(render("[environment]\nmap = 'grey.png'\nrotation = -90.0\n").0);
}

/// Relief that is flat changes nothing, and bumps do; normals that look away are left out.
#[test]
fn relief_turns_normals() {
    let render = |picture: RgbImage, line: &str| {
        let folder = folder(&format!("newmtl m\nKd 0.6 0.6 0.6\n{line}\n"));
        picture.save(folder.path().join("a.png")).unwrap();
        let scene = scene_of_file(&folder.path().join("a.obj"), 8, 8);
        let film = Render {
            spp: 4,
            ..Default::default()
        }
        .film(&scene, &*tracer(&scene));
        let normal = film.first_hits().normal;
        (0..64).map(|i| normal.get(i)).collect::<Vec<Vec3>>()
    };
    let flat = RgbImage::from_pixel(8, 8, Rgb([77; 3]));
    let plain = render(flat.clone(), "");
    assert_eq!(render(flat, "map_Bump -bm 3 a.png"), plain);
    // Higher to the right: normals lean to the left, by the slope of 1/255 a texel times 127.5.
    let ramp = RgbImage::from_fn(256, 1, |x, _| Rgb([x as u8; 3]));
    let leaning = render(ramp, "map_Bump -bm 127.5 a.png");
    let wanted = Vec3::new(-0.5, 1.0, 0.0).normalize();
    assert!(
        (leaning[8 * 4 + 4] - wanted).length() < 0.01,
        "{}",
        leaning[36]
    );
    // A normal map that leans up in the picture, which is -z on the floor.
    let normals = RgbImage::from_pixel(4, 4, Rgb([128, 218, 218]));
    let turned = render(normals, "norm a.png");
    let wanted = Vec3::new(0.0, 1.0, -1.0).normalize();
    assert!((turned[36] - wanted).length() < 0.02, "{}", turned[36]);
    let away = RgbImage::from_pixel(4, 4, Rgb([128, 128, 0]));
    assert_eq!(render(away, "norm a.png"), plain);

    // The picture says what it is, whatever the key.
    let normals = RgbImage::from_fn(8, 8, |x, _| Rgb([128, if x < 4 { 218 } else { 37 }, 218]));
    let by_norm = render(normals.clone(), "norm a.png");
    assert_ne!(by_norm, plain);
    assert_eq!(
        render(normals.clone(), "map_Bump -bm 1.000000 a.png"),
        by_norm
    );
    assert_eq!(render(normals.clone(), "bump a.png"), by_norm);
    // Half the slope.
    let weaker = render(normals, "map_Bump -bm 0.5 a.png");
    let wanted = Vec3::new(0.0, 1.0, -0.5).normalize();
    assert!((weaker[33] - wanted).length() < 0.02, "{}", weaker[33]);
    let heights = RgbImage::from_fn(8, 8, |x, _| Rgb([(30 * x) as u8; 3]));
    assert_eq!(
        render(heights.clone(), "norm a.png"),
        render(heights, "map_Bump a.png")
    );
}

/// Highlights are wide where the factor on the exponent is small; `Pr` has the last word.
#[test]
fn exponents_by_texture() {
    let alphas = |mtl: &str| {
        let folder = folder(mtl);
        let picture = RgbImage::from_fn(2, 1, |x, _| Rgb([if x == 0 { 0 } else { 255 }; 3]));
        picture.save(folder.path().join("a.png")).unwrap();
        let scene = scene_of_file(&folder.path().join("a.obj"), 4, 4);
        let material = &scene.materials[0];
        let textures = material.textures.as_ref()?;
        let alpha = |u: f32| {
            let uv = Vec2::new(u, 0.5);
            let place = Place {
                mesh: &scene.mesh,
                triangle: 0,
                barycentric: [0.0; 2],
                uv,
            };
            textures
                .parameters(&material.bsdf, &material.parameters, place)
                .alpha
        };
        Some([alpha(0.25), alpha(0.75)])
    };
    let plastic = "newmtl m\nKd 0.5 0.5 0.5\nKs 0.5 0.5 0.5\nillum 2\n";
    let [wide, narrow] = alphas(&format!("{plastic}Ns 198\nmap_Ns a.png\n")).unwrap();
    assert!((wide - 1.0).abs() < 1e-6 && (narrow - 0.1).abs() < 1e-6);
    let [wide, narrow] = alphas(&format!("{plastic}map_Ns a.png\n")).unwrap();
    assert!((wide - 1.0).abs() < 1e-6 && (narrow - 0.01).abs() < 1e-6);
    assert_eq!(
        alphas(&format!("{plastic}Ns 9\nPr 0.5\nmap_Ns a.png\n")),
        None
    );
    assert_eq!(alphas("newmtl m\nillum 7\nNs 9\nmap_Ns a.png\n"), None);
}

/// Alpha of the colour cuts out where it is made for that, in files of 8 and 16 bits and in EXR.
#[test]
fn alpha_of_colours_cuts_leaves_out() {
    let has_holes = |mtl: &str, file: &str, alpha: &dyn Fn(u32) -> f32| {
        let folder = folder(mtl);
        let path = folder.path().join(file);
        let row: Vec<f32> = (0..16).map(alpha).collect();
        let pixel = |x: u32| [0.2, 0.8, 0.1, row[x as usize]];
        match file {
            "a.exr" => {
                let pixel = |x: usize, _: usize| {
                    let [r, g, b, a] = pixel(x as u32);
                    (r, g, b, a)
                };
                exr::prelude::write_rgba_file(&path, 16, 16, pixel).unwrap();
            }
            "a.tiff" => {
                let wide = |x: u32, _: u32| Rgba(pixel(x).map(|v| (v * 65535.0) as u16));
                let picture = image::ImageBuffer::<Rgba<u16>, Vec<u16>>::from_fn(16, 16, wide);
                picture.save(&path).unwrap();
            }
            _ => {
                let bytes = |x: u32, _: u32| Rgba(pixel(x).map(|v| (v * 255.0) as u8));
                RgbaImage::from_fn(16, 16, bytes).save(&path).unwrap();
            }
        }
        let scene = scene_of_file(&folder.path().join("a.obj"), 8, 8);
        scene.mesh.cutouts.is_some()
    };
    let leaf = |x: u32| if x < 8 { 0.0 } else { 1.0 };
    let gloss = |x: u32| x as f32 / 15.0;
    for file in ["a.png", "a.tiff", "a.exr"] {
        let colour = format!("newmtl m\nmap_Kd {file}\n");
        assert!(has_holes(&colour, file, &leaf), "{file}");
        assert!(!has_holes(&colour, file, &gloss), "{file}");
        assert!(!has_holes(&colour, file, &|_| 1.0), "{file}");
        // As pictures without alpha look to programs that read four channels.
        assert!(!has_holes(&colour, file, &|_| 0.0), "{file}");
        // What is named as opacity is.
        let both = format!("{colour}map_d {file}\n");
        assert!(has_holes(&both, file, &gloss), "{file}");
        assert!(!has_holes(&both, file, &|_| 1.0), "{file}");
    }
}

#[test]
fn texture_coordinates_of_huge_or_no_value_do_no_harm() {
    let texture = Texture::of_bitmap(Arc::new(Bitmap {
        width: 3,
        height: 2,
        texels: Texels::Bytes(vec![[9, 9, 9, 255]; 6]),
        has_alpha: false,
    }));
    for x in [0.0, 1.0, -1e-9, 1e9, -3e38, 3e38] {
        let value = texture.value(Vec2::new(x, -x));
        assert!((value - 9.0 / 255.0).abs() < 1e-6, "{x}: {value}");
    }
}
