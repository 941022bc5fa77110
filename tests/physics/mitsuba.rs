//! Pictures against those of Mitsuba 3, an independent renderer, on scenes that both read from the same
//! files. Each picture is cut into regions; the means of every region, and of the whole, over independent
//! runs must agree within their measured standard errors.
//!
//! Needs a Python that imports `mitsuba`: the one that GDPT_MITSUBA_PYTHON names, else `python3`. Skipped
//! where there is none, unless REQUIRE_MITSUBA is set.

use crate::common::{Mean, Render, Rng, largest_z, scene_of_file, tracer};
use ::image::{Rgb, RgbImage};
use gdpt::image::Image;
use gdpt::picture;
use gdpt::reconstruct::{Alpha, Method as Reconstruct, PAPER_ALPHA};
use gdpt::render::Method;
use serde_json::json;
use std::env;
use std::ffi::{OsStr, OsString};
use std::fmt::Write;
use std::fs;
use std::path::Path;
use std::process::{Command, Stdio};

/// The probability that the whole test fails by chance. Seeds are fixed: what passes goes on passing.
const SIGNIFICANCE: f64 = 1e-4;
const WIDTH: u32 = 32;
const HEIGHT: u32 = 24;
/// Regions across and down.
const REGIONS: usize = 4;
/// Values compared for each picture: the regions and the whole, three channels each.
const VALUES: usize = 3 * (REGIONS * REGIONS + 1);
/// Independent runs of each renderer.
const RUNS: u64 = 48;
/// Samples per pixel of a run of gdpt, and of Mitsuba.
const SPP: [u64; 2] = [16, 25];
/// The same of shipped scenes, where Mitsuba's light comes by chance: it meets the lamp behind mirrors and glass.
const SPP_OF_SHIPPED: [u64; 2] = [32, 900];
/// Relative rounding of 32-bit floats, counted as a standard error: where a light is seen there is no noise.
const ROUNDING: f64 = 1e-6;

/// A polygon with corners counter-clockwise seen from the front, and its material.
type Polygon = (&'static str, Vec<[f32; 3]>);

struct Case {
    name: &'static str,
    depth: u32,
    mtl: &'static str,
    polygons: Vec<Polygon>,
    toml: &'static str,
}

/// Texture coordinates of every polygon's corners: turned, repeated, no square.
const TEXTURE_CORNERS: [[f32; 2]; 4] = [[-0.3, 0.2], [1.6, -0.1], [1.4, 1.3], [-0.2, 0.9]];

impl Case {
    fn write(&self, folder: &Path) {
        let mut obj = format!("mtllib {}.mtl\n", self.name);
        let mut corners = 0;
        for (material, polygon) in &self.polygons {
            writeln!(obj, "usemtl {material}").unwrap();
            for ([x, y, z], [u, v]) in polygon.iter().zip(TEXTURE_CORNERS) {
                writeln!(obj, "v {x} {y} {z}\nvt {u} {v}").unwrap();
            }
            let face = (corners + 1..=corners + polygon.len()).map(|i| format!(" {i}/{i}"));
            writeln!(obj, "f{}", face.collect::<String>()).unwrap();
            corners += polygon.len();
        }
        let path = folder.join(self.name);
        fs::write(path.with_extension("obj"), obj).unwrap();
        fs::write(path.with_extension("mtl"), self.mtl).unwrap();
        let film = format!("[film]\nwidth = {WIDTH}\nheight = {HEIGHT}\n");
        fs::write(path.with_extension("toml"), self.toml.to_owned() + &film).unwrap();
    }
}

/// Looks into the room, neither straight nor upright.
macro_rules! into_room {
    () => {
        "[camera]
origin = [0.3, 1.1, 3.3]
target = [-0.05, 0.75, 0]
up = [0.1, 1, 0]
fov = 32
"
    };
}
const INTO_ROOM: &str = into_room!();

/// A room with walls of three colours, a lamp under the ceiling and one at the right wall, both just outside
/// of the picture; open towards the camera. `back` is the material of the wall behind.
fn room(back: &'static str) -> Vec<Polygon> {
    vec![
        (
            "white",
            vec![[-1., 0., 1.], [1., 0., 1.], [1., 0., -1.], [-1., 0., -1.]],
        ),
        (
            "white",
            vec![[-1., 2., -1.], [1., 2., -1.], [1., 2., 1.], [-1., 2., 1.]],
        ),
        (
            back,
            vec![[-1., 0., -1.], [1., 0., -1.], [1., 2., -1.], [-1., 2., -1.]],
        ),
        (
            "red",
            vec![[-1., 0., 1.], [-1., 0., -1.], [-1., 2., -1.], [-1., 2., 1.]],
        ),
        (
            "blue",
            vec![[1., 0., -1.], [1., 0., 1.], [1., 2., 1.], [1., 2., -1.]],
        ),
        (
            "lamp",
            vec![
                [-0.7, 1.9, -0.6],
                [0.1, 1.9, -0.6],
                [0.1, 1.9, 0.3],
                [-0.7, 1.9, 0.3],
            ],
        ),
        (
            "cold",
            vec![[0.97, 0.4, 0.8], [0.97, 0.4, 1.3], [0.97, 1.2, 1.1]],
        ),
    ]
}

/// A block around `centre`, turned about the vertical by `degrees`.
fn block(
    material: &'static str,
    centre: [f32; 3],
    half: [f32; 3],
    degrees: f32,
) -> impl Iterator<Item = Polygon> {
    let (sin, cos) = degrees.to_radians().sin_cos();
    // Faces from -1 to 1, seen from outside.
    let corner = move |[x, y, z]: [f32; 3]| {
        let [x, y, z] = [x * half[0], y * half[1], z * half[2]];
        let [cx, cy, cz] = centre;
        [cx + cos * x + sin * z, cy + y, cz - sin * x + cos * z]
    };
    (0..3).flat_map(move |axis| {
        [-1f32, 1.].map(|side| {
            let around = [[-side, -1.], [side, -1.], [side, 1.], [-side, 1.]];
            let polygon = around.map(|[a, b]| {
                let mut p = [0.; 3];
                (p[axis], p[(axis + 1) % 3], p[(axis + 2) % 3]) = (side, a, b);
                corner(p)
            });
            (material, polygon.to_vec())
        })
    })
}

/// The right half of the picture: a panel that shows the left wall, the lamp and the blocks before it.
fn panel() -> Polygon {
    (
        "panel",
        vec![
            [-0.05, 0.05, -0.8],
            [0.95, 0.15, -0.1],
            [0.95, 1.75, -0.2],
            [-0.05, 1.7, -0.9],
        ],
    )
}

macro_rules! room_mtl {
    ($more:literal) => {
        concat!(
            "newmtl white\nKd 0.75 0.7 0.65\nnewmtl red\nKd 0.7 0.15 0.1\nnewmtl blue\nKd 0.1 0.25 0.65\n",
            "newmtl lamp\nKe 7 6 4\nnewmtl cold\nKe 1 3 6\n",
            $more
        )
    };
}

macro_rules! from_above {
    () => {
        "[camera]
origin = [0.5, 1.4, 3.3]
target = [0.1, 0.7, 0]
up = [0.1, 1, 0]
fov = 34
"
    };
}

fn cases() -> Vec<Case> {
    let with = |back, more: Vec<Polygon>| [room(back), more].concat();
    let blocks = || -> Vec<Polygon> {
        let tall = block("white", [-0.4, 0.6, -0.4], [0.25, 0.6, 0.3], 25.);
        let low = block("blue", [0.4, 0.3, 0.2], [0.3, 0.3, 0.25], -20.);
        tall.chain(low).collect()
    };
    let beside_panel = || -> Vec<Polygon> {
        let low = block("white", [-0.5, 0.35, 0.1], [0.3, 0.35, 0.25], 30.);
        low.chain([panel()]).collect()
    };
    let slab = || block("glass", [0.05, 1., 1.2], [0.75, 0.6, 0.08], 22.);
    let corners = [[-3., 0., 2.5], [3., 0., 2.5], [3., 0., -2.], [-3., 0., -2.]];
    let floor = ("white", corners.to_vec());
    let upright = |material, z: f32| -> Polygon {
        let corners = [(-0.7, 0.2), (0.8, 0.3), (0.6, 1.4), (-0.6, 1.3)];
        (material, corners.map(|(x, y)| [x, y, z + 0.2 * x]).to_vec())
    };
    let open_air = || -> Vec<Polygon> {
        let glass = block("glass", [-0.2, 0.3, 0.7], [0.2, 0.25, 0.2], 10.);
        let lamp = room("white").swap_remove(6);
        let more = [floor.clone(), lamp, panel()];
        glass.chain(blocks()).chain(more).collect()
    };
    let room_mtl = room_mtl!("");
    vec![
        // Paths of two segments: the depth means the same.
        Case {
            name: "direct",
            depth: 2,
            mtl: room_mtl,
            polygons: with("white", blocks()),
            toml: INTO_ROOM,
        },
        // Long enough for roulette.
        Case {
            name: "lambert",
            depth: 8,
            mtl: room_mtl,
            polygons: with("white", blocks()),
            toml: INTO_ROOM,
        },
        // Lights of several colours and shapes in the picture: the back of one before the front of another,
        // and one that touches what it lights.
        Case {
            name: "lights",
            depth: 4,
            mtl: room_mtl!("newmtl green\nKe 1 9 0.5\nnewmtl dim\nKe 0.5 0.3 0.6\n"),
            polygons: with(
                "white",
                vec![
                    (
                        "green",
                        vec![
                            [0.5, 0.4, 0.3],
                            [-0.1, 0.4, 0.],
                            [-0.1, 1.1, 0.],
                            [0.5, 1.1, 0.3],
                        ],
                    ),
                    (
                        "dim",
                        vec![
                            [-0.2, 0.2, -0.7],
                            [0.7, 0.2, -0.7],
                            [0.7, 1.3, -0.4],
                            [-0.2, 1.3, -0.4],
                        ],
                    ),
                    (
                        "lamp",
                        vec![[-0.9, 0., -0.2], [-0.5, 0., -0.6], [-0.7, 0.5, -0.5]],
                    ),
                ],
            ),
            toml: INTO_ROOM,
        },
        // The left wall sees itself in the panel, and the other way round.
        Case {
            name: "mirror",
            depth: 7,
            mtl: room_mtl!("newmtl panel\nPm 1\nPr 0\nKs 1 1 1\n"),
            polygons: with("panel", beside_panel()),
            toml: INTO_ROOM,
        },
        // Mitsuba's Smith masking is the product of both directions', gdpt's is correlated in height, larger
        // by the factor 1 + Λo Λi / (1 + Λo + Λi). With the product in gdpt too, and the same seeds, no
        // region of this scene changes by more than 0.012 %, and of rough-glass 0.063 %: less than a
        // fourteenth of the standard error. Rougher materials would need a correction.
        Case {
            name: "conductor",
            depth: 6,
            mtl: room_mtl!(
                "newmtl panel\nPm 1\nPr 0.2\nKs 1 1 1\nnewmtl back\nPm 1\nPr 0.4\nKs 1 1 1\n"
            ),
            polygons: with("back", beside_panel()),
            toml: INTO_ROOM,
        },
        Case {
            name: "glass",
            depth: 9,
            mtl: room_mtl!("newmtl glass\nillum 7\nNi 1.5\nTf 0.95 0.8 0.7\n"),
            polygons: with(
                "white",
                block("glass", [-0.4, 0.5, -0.3], [0.3, 0.45, 0.3], 25.)
                    .chain(slab())
                    .collect(),
            ),
            toml: INTO_ROOM,
        },
        Case {
            name: "rough-glass",
            depth: 7,
            mtl: room_mtl!("newmtl glass\nillum 7\nNi 1.5\nPr 0.3\nTf 0.95 0.8 0.7\n"),
            polygons: with("white", blocks().into_iter().chain(slab()).collect()),
            toml: INTO_ROOM,
        },
        // A pane across the room, and a half open board behind it.
        Case {
            name: "panes",
            depth: 8,
            mtl: room_mtl!("newmtl pane\nillum 7\nNi 1.5\nnewmtl board\nKd 0.6 0.3 0.1\nd 0.4\n"),
            polygons: with(
                "white",
                blocks()
                    .into_iter()
                    .chain([upright("pane", 0.4), upright("board", -0.1)])
                    .collect(),
            ),
            toml: INTO_ROOM,
        },
        // Constant light from all around and a lamp, on Lambert, a mirror and glass.
        Case {
            name: "environment",
            depth: 7,
            mtl: room_mtl!("newmtl panel\nPm 1\nPr 0\nKs 1 1 1\nnewmtl glass\nillum 7\nNi 1.4\n"),
            polygons: open_air(),
            toml: concat!(from_above!(), "[environment]\nradiance = [0.5, 0.8, 1.3]\n"),
        },
        // Lights without extent beside those of the room, on Lambert and rough metal.
        Case {
            name: "punctual",
            depth: 5,
            mtl: room_mtl!("newmtl panel\nPm 1\nPr 0.3\nKs 1 1 1\n"),
            polygons: with("white", beside_panel()),
            toml: concat!(
                into_room!(),
                "[[lights]]
kind = \"point\"
position = [0.4, 1.6, 0.3]
intensity = [0.5, 0.4, 0.9]
[[lights]]
kind = \"spot\"
position = [-0.5, 1.7, 0.8]
target = [0.1, 0, -0.2]
intensity = 4
cutoff_angle = 35
beam_width = 12
[[lights]]
kind = \"directional\"
direction = [-0.1, -0.4, -1]
irradiance = [0.6, 0.9, 0.5]
"
            ),
        },
        // A texture on all that is white: floor, ceiling, back wall and a block.
        Case {
            name: "textures",
            depth: 6,
            mtl: concat!(
                "newmtl white\nKd 1 1 1\nmap_Kd texture.png\nnewmtl red\nKd 0.7 0.15 0.1\n",
                "newmtl blue\nKd 0.1 0.25 0.65\nnewmtl lamp\nKe 7 6 4\nnewmtl cold\nKe 1 3 6\n",
            ),
            polygons: with("white", blocks()),
            toml: INTO_ROOM,
        },
        // The same with the light of a map, turned and scaled.
        Case {
            name: "environment-map",
            depth: 6,
            mtl: room_mtl!("newmtl panel\nPm 1\nPr 0\nKs 1 1 1\nnewmtl glass\nillum 7\nNi 1.4\n"),
            polygons: open_air(),
            toml: concat!(
                from_above!(),
                "[environment]\nmap = \"sky.exr\"\nrotation = 40\nscale = 0.7\n"
            ),
        },
    ]
}

/// A texture of 4 x 3 random texels.
fn write_texture(path: &Path) {
    let mut rng = Rng(1);
    let texels = RgbImage::from_fn(
        7,
        5,
        |_, _| Rgb([(); 3].map(|_| (256.0 * rng.next()) as u8)),
    );
    texels.save(path).unwrap();
}

/// An environment of 16 x 8 random texels with a bright patch, its upper half of another colour.
fn write_sky(path: &Path) {
    let mut rng = Rng(2);
    let texels = (0..16 * 8).map(|i| {
        let (x, y) = (i % 16, i / 16);
        let sun = if (5..7).contains(&x) && y == 2 {
            12.0
        } else {
            0.0
        };
        let sky = if y < 4 {
            [0.4, 0.7, 1.2]
        } else {
            [0.5, 0.3, 0.2]
        };
        sky.map(|c: f32| c * 2.0 * rng.next() + sun)
    });
    let texels: Vec<[f32; 3]> = texels.collect();
    exr::prelude::write_rgb_file(path, 16, 8, |x, y| texels[16 * y + x].into()).unwrap();
}

/// The means of the regions, and of the whole, channel by channel. `value` is of a pixel and a channel.
fn regions(value: impl Fn(usize, usize) -> f32) -> [f64; VALUES] {
    let (width, height) = (WIDTH as usize, HEIGHT as usize);
    let mut means = [0.0; VALUES];
    let share = 1.0 / (width * height) as f64;
    for y in 0..height {
        for x in 0..width {
            let region = y * REGIONS / height * REGIONS + x * REGIONS / width;
            for channel in 0..3 {
                let value = f64::from(value(y * width + x, channel)) * share;
                means[3 * region + channel] += value * (REGIONS * REGIONS) as f64;
                means[VALUES - 3 + channel] += value;
            }
        }
    }
    means
}

fn add(means: &mut [Mean; VALUES], run: [f64; VALUES]) {
    means.iter_mut().zip(run).for_each(|(m, v)| m.add(v));
}

/// Mitsuba's pictures of a scene.
fn of_mitsuba(folder: &Path, job: &Job) -> [Mean; VALUES] {
    let bytes = fs::read(folder.join(job.scene).with_extension("f32")).unwrap();
    let floats = bytes.chunks_exact(4).map(|b| b.try_into().unwrap());
    let floats: Vec<f32> = floats.map(f32::from_ne_bytes).collect();
    let pictures = floats.chunks_exact(3 * (WIDTH * HEIGHT) as usize);
    assert_eq!(pictures.len() as u64, RUNS);
    let mut means = [Mean::default(); VALUES];
    for picture in pictures {
        add(
            &mut means,
            regions(|pixel, channel| picture[3 * pixel + channel]),
        );
    }
    means
}

/// gdpt's pictures of a scene, by path tracing or by gradients and L2.
fn of_gdpt(folder: &Path, job: &Job, method: Method) -> [Mean; VALUES] {
    let path = folder.join(job.scene).with_extension("obj");
    let scene = scene_of_file(&path, WIDTH, HEIGHT);
    let tracer = tracer(&scene);
    let mut means = [Mean::default(); VALUES];
    for seed in 0..RUNS {
        let film = Render {
            method,
            spp: job.spp[0],
            seed,
            depth: job.depth,
            tile_size: 8,
            ..Render::default()
        }
        .film(&scene, &*tracer);
        let reconstruct = match method {
            Method::Pt => Reconstruct::Primal,
            Method::Gpt => Reconstruct::L2(Alpha::Fixed(PAPER_ALPHA)),
        };
        let picture: Image = picture::of_film(&film, reconstruct).image;
        add(
            &mut means,
            regions(|pixel, channel| picture.channels[channel][pixel]),
        );
    }
    means
}

/// The Python that has Mitsuba; `None` where there is none and none is required.
fn python() -> Option<OsString> {
    let python = env::var_os("GDPT_MITSUBA_PYTHON").unwrap_or("python3".into());
    let imports = Command::new(&python)
        .args(["-c", "import mitsuba"])
        .stderr(Stdio::null())
        .status();
    if imports.is_ok_and(|status| status.success()) {
        return Some(python);
    }
    let what = format!(
        "{} cannot import mitsuba (pip install mitsuba; GDPT_MITSUBA_PYTHON names another Python)",
        python.display()
    );
    assert!(env::var_os("REQUIRE_MITSUBA").is_none(), "{what}");
    eprintln!("skipped: {what}");
    None
}

/// A scene in a folder, to be rendered by both.
struct Job {
    scene: &'static str,
    depth: u32,
    /// Samples per pixel of a run of gdpt, and of Mitsuba.
    spp: [u64; 2],
}

#[test]
fn pictures_are_those_of_mitsuba() {
    let Some(python) = python() else { return };
    let folder = tempfile::tempdir().unwrap();
    let folder = folder.path();
    let cases = cases();
    cases.iter().for_each(|case| case.write(folder));
    write_texture(&folder.join("texture.png"));
    write_sky(&folder.join("sky.exr"));
    let jobs = cases.iter().map(|case| Job {
        scene: case.name,
        depth: case.depth,
        spp: SPP,
    });
    compare(&python, folder, &jobs.collect::<Vec<_>>());
}

/// The shipped scenes with mirrors and glass, where most light comes by walks: of metal that reflects all in either
/// renderer, and in `pane` of another sky.
#[test]
#[ignore = "takes five minutes; for changes of walks and their weights"]
fn shipped_scenes_are_those_of_mitsuba() {
    let Some(python) = python() else { return };
    let folder = tempfile::tempdir().unwrap();
    let folder = folder.path();
    write_sky(&folder.join("sky.exr"));
    let jobs = ["mirrors", "pane", "rings", "caustic"].map(|scene| {
        let file = |extension: &str| Path::new(scene).with_extension(extension);
        let read = |extension: &str| {
            fs::read_to_string(Path::new("scenes").join(file(extension))).unwrap()
        };
        let mut obj = read("obj");
        if scene == "pane" {
            // The sheet is the last face of the glass.
            let (slab, rest) = obj.split_once("usemtl light").unwrap();
            let (slab, sheet) = slab.rsplit_once("\nf ").unwrap();
            obj = format!("{slab}\nusemtl pane\nf {sheet}usemtl light{rest}");
        }
        let mtl = read("mtl").lines().fold(String::new(), |mtl, line| {
            let line = if line.starts_with("Ks ") {
                "Ks 1 1 1"
            } else {
                line
            };
            mtl + line + "\n"
        });
        let glass = mtl.split("newmtl glass").nth(1);
        let pane = glass.map_or(String::new(), |glass| format!("newmtl pane{glass}"));
        let toml = read("toml");
        let camera = toml.split("[film]").next().unwrap();
        let sky = if scene == "pane" {
            "[environment]\nmap = \"sky.exr\"\n"
        } else {
            ""
        };
        let film = format!("[film]\nwidth = {WIDTH}\nheight = {HEIGHT}\n");
        fs::write(folder.join(file("obj")), obj).unwrap();
        fs::write(folder.join(file("mtl")), mtl + &pane).unwrap();
        fs::write(folder.join(file("toml")), format!("{camera}{film}{sky}")).unwrap();
        Job {
            scene,
            depth: 8,
            spp: SPP_OF_SHIPPED,
        }
    });
    compare(&python, folder, &jobs);
}

/// Renders the scenes of a folder by both, and compares the means of regions.
fn compare(python: &OsStr, folder: &Path, jobs: &[Job]) {
    let written = jobs.iter().map(
        |job| json!({ "scene": job.scene, "depth": job.depth, "runs": RUNS, "spp": job.spp[1] }),
    );
    let written: Vec<_> = written.collect();
    fs::write(folder.join("jobs.json"), json!(written).to_string()).unwrap();
    let mut mitsuba = Command::new(python)
        .arg("tests/mitsuba/render.py")
        .arg(folder)
        .spawn()
        .unwrap();
    let methods = [Method::Pt, Method::Gpt];
    let ours = jobs
        .iter()
        .map(|job| methods.map(|method| of_gdpt(folder, job, method)));
    let ours: Vec<_> = ours.collect();
    assert!(
        mitsuba.wait().unwrap().success(),
        "Mitsuba's renders failed"
    );

    let limit = largest_z(2 * jobs.len() * VALUES, RUNS as usize, SIGNIFICANCE);
    println!("standard errors are those of the difference, relative; |z| may reach {limit:.2}");
    println!("scene        method  largest |z|  median error of regions  error of the whole");
    let mut failures = String::new();
    for (job, ours) in jobs.iter().zip(&ours) {
        let theirs = of_mitsuba(folder, job);
        for (method, ours) in methods.iter().zip(ours) {
            let mut largest = 0f64;
            let mut errors = Vec::new();
            for (i, (a, b)) in ours.iter().zip(&theirs).enumerate() {
                let (a, b, variance) = (a.mean(), b.mean(), a.variance() + b.variance());
                let error = variance.sqrt() + ROUNDING * b;
                let z = (a - b) / error;
                largest = largest.max(z.abs());
                errors.push(100.0 * error / b);
                if z.is_nan() || z.abs() > limit {
                    let (name, region, channel) =
                        (job.scene, i / 3, ["red", "green", "blue"][i % 3]);
                    writeln!(
                        failures,
                        "{name} {method:?} region {region} {channel}: {a:.5} instead of {b:.5}, z {z:.1}"
                    )
                    .unwrap();
                }
            }
            let whole = errors[VALUES - 2];
            errors.sort_by(f64::total_cmp);
            println!(
                "{:12} {:6}  {largest:11.2}  {:21.2} %  {whole:16.2} %",
                job.scene,
                format!("{method:?}"),
                errors[VALUES / 2],
            );
        }
    }
    assert!(failures.is_empty(), "\n{failures}");
}
