//! What several tests share: scenes, a random number generator, and statistics.
#![allow(dead_code)] // each test crate uses a part

use gdpt::error::Warnings;
use gdpt::estimate::Estimate;
use gdpt::film::{Film, Halves};
use gdpt::filter::Filter;
use gdpt::gradient::Weights;
use gdpt::image::Image;
use gdpt::load::{mtl::MtlMaterial, obj, obj::ObjFile, sidecar};
use gdpt::path::{Counts, Manifold, PathSettings};
use gdpt::render::{Job, Limits, Method};
use gdpt::sampler::{SamplerKind, mix};
use gdpt::scene::{EnvironmentSetting, Scene, SceneSettings};
use gdpt::trace::{Backend, Traverse};
use glam::Vec3;
use proptest::test_runner::{Config as ProptestConfig, RngSeed};
use statrs::distribution::{ChiSquared, ContinuousCDF, StudentsT};
use std::path::Path;

pub const SCENES: [&str; 10] = [
    "cornell", "glossy", "mirrors", "ajar", "caustic", "corner", "furnace", "still", "pane",
    "rings",
];

/// A shipped scene at another size.
pub fn shipped(name: &str, width: u32, height: u32) -> Scene {
    scene_of_file(Path::new(&format!("scenes/{name}.obj")), width, height)
}

/// The scene of an OBJ and the TOML beside it, at a size of its own. Nothing in them may need a warning.
pub fn scene_of_file(path: &Path, width: u32, height: u32) -> Scene {
    let mut warnings = Warnings::new(true);
    let toml = sidecar::load(path).unwrap();
    let options = obj::Options {
        textures: None,
        repairs: toml.repairs.clone(),
        ..Default::default()
    };
    let file = obj::load_with(path, &options, &mut warnings).unwrap();
    let settings = SceneSettings {
        camera: toml.camera,
        size: (width, height),
        environment: EnvironmentSetting::of_table(&toml.environment),
        lights: toml.lights,
        roughness_threshold: 0.05,
    };
    Scene::build(path, file, &settings, &mut warnings).unwrap()
}

/// A scene of polygons with corners counter-clockwise seen from the front, each with a material.
pub fn polygons(
    polygons: &[(&[[f32; 3]], usize)],
    materials: Vec<MtlMaterial>,
    settings: &SceneSettings,
) -> Scene {
    polygons_and_balls(polygons, &[], materials, settings)
}

/// A ball or an ellipsoid.
#[derive(Clone, Debug)]
pub struct Ball {
    pub centre: Vec3,
    /// Its radii along the axes.
    pub radii: Vec3,
    /// See [`sphere`].
    pub level: u32,
    /// Whether it has normals.
    pub smooth: bool,
    pub material: usize,
}

impl Ball {
    /// The corners of its triangles.
    pub fn triangles(&self) -> impl Iterator<Item = [Vec3; 3]> {
        let triangles = sphere(self.level).into_iter();
        triangles.map(|corners| corners.map(|p| self.centre + p * self.radii))
    }

    /// The unit normal at one of them.
    pub fn normal(&self, corner: Vec3) -> Vec3 {
        ((corner - self.centre) / (self.radii * self.radii)).normalize()
    }
}

/// A scene of polygons and balls.
pub fn polygons_and_balls(
    polygons: &[(&[[f32; 3]], usize)],
    balls: &[Ball],
    materials: Vec<MtlMaterial>,
    settings: &SceneSettings,
) -> Scene {
    let mut file = ObjFile {
        materials,
        ..Default::default()
    };
    for (corners, material) in polygons {
        let first = file.positions.len() as u32;
        file.positions
            .extend(corners.iter().copied().map(Vec3::from));
        for i in 1..corners.len() as u32 - 1 {
            file.triangles.push([first, first + i, first + i + 1]);
            file.material_of.push(*material as u32);
        }
    }
    if !balls.is_empty() {
        file.normal_triangles
            .resize(file.triangles.len(), [gdpt::load::obj::NONE; 3]);
    }
    for ball in balls {
        for corners in ball.triangles() {
            let next = |length: usize| [0, 1, 2].map(|i| length as u32 + i);
            file.triangles.push(next(file.positions.len()));
            file.positions.extend(corners);
            file.normal_triangles.push(if ball.smooth {
                next(file.normals.len())
            } else {
                [gdpt::load::obj::NONE; 3]
            });
            if ball.smooth {
                file.normals.extend(corners.map(|p| ball.normal(p)));
            }
            file.material_of.push(ball.material as u32);
        }
    }
    Scene::build(
        Path::new("test.obj"),
        file,
        settings,
        &mut Warnings::new(false),
    )
    .unwrap()
}

/// The triangles of a sphere of radius 1 around 0: those of an octahedron, split in four `level` times.
pub fn sphere(level: u32) -> Vec<[Vec3; 3]> {
    let mut triangles: Vec<[Vec3; 3]> = Vec::new();
    for x in [Vec3::X, Vec3::NEG_X] {
        for y in [Vec3::Y, Vec3::NEG_Y] {
            for z in [Vec3::Z, Vec3::NEG_Z] {
                let outside = x.cross(y).dot(z) > 0.0;
                triangles.push(if outside { [x, y, z] } else { [x, z, y] });
            }
        }
    }
    for _ in 0..level {
        let split = |&[a, b, c]: &[Vec3; 3]| {
            let [ab, bc, ca] = [a + b, b + c, c + a].map(Vec3::normalize);
            [[a, ab, ca], [b, bc, ab], [c, ca, bc], [ab, bc, ca]]
        };
        triangles = triangles.iter().flat_map(split).collect();
    }
    triangles
}

pub fn lambert(reflectance: f32) -> MtlMaterial {
    MtlMaterial {
        kd: Some([reflectance; 3]),
        ..Default::default()
    }
}

pub fn light(radiance: f32) -> MtlMaterial {
    MtlMaterial {
        ke: Some([radiance; 3]),
        ..Default::default()
    }
}

pub fn mirror() -> MtlMaterial {
    MtlMaterial {
        kd: Some([0.0; 3]),
        ks: Some([0.9, 0.8, 0.7]),
        pm: Some(1.0),
        pr: Some(0.0),
        ..Default::default()
    }
}

pub fn glass(ior: f32) -> MtlMaterial {
    MtlMaterial {
        kd: Some([0.0; 3]),
        ni: Some(ior),
        illum: Some(7),
        ..Default::default()
    }
}

/// A level square about the vertical axis, its front upwards.
pub fn level(y: f32, half: f32) -> [[f32; 3]; 4] {
    [(-half, half), (half, half), (half, -half), (-half, -half)].map(|(x, z)| [x, y, z])
}

/// What and how to render in a test.
#[derive(Clone, Copy)]
pub struct Render {
    pub method: Method,
    pub weights: Weights,
    pub spp: u64,
    pub seed: u64,
    pub sampler: SamplerKind,
    pub depth: u32,
    pub tile_size: u32,
    pub filter: Filter,
    pub manifold: Manifold,
}

impl Default for Render {
    fn default() -> Self {
        Self {
            method: Method::Gpt,
            weights: Weights::Mis,
            spp: 16,
            seed: 0,
            sampler: SamplerKind::Sobol,
            depth: 12,
            tile_size: 32,
            filter: Filter::Box,
            manifold: Manifold::Auto,
        }
    }
}

impl Render {
    pub fn film(&self, scene: &Scene, tracer: &dyn Traverse) -> Film {
        let (film, counts) = self.film_and_counts(scene, tracer);
        assert_eq!(counts.dropped, 0, "samples were not finite");
        film
    }

    pub fn film_and_counts(&self, scene: &Scene, tracer: &dyn Traverse) -> (Film, Counts) {
        let mut film = Film::new(scene.camera.width, scene.camera.height, self.tile_size);
        let job = Job {
            scene,
            tracer,
            method: self.method,
            settings: self.settings(),
            first: 0,
            limits: Limits {
                samples: self.spp,
                time: None,
            },
        };
        let outcome = job.run(&mut film, &mut |_, _| None, &mut |_| ());
        (film, outcome.counts)
    }

    pub fn settings(&self) -> PathSettings {
        PathSettings {
            depth: self.depth,
            seed: self.seed,
            sampler: self.sampler,
            weights: self.weights,
            filter: self.filter,
            manifold: self.manifold,
        }
    }

    pub fn estimate(&self, scene: &Scene, tracer: &dyn Traverse) -> Estimate {
        self.film(scene, tracer).estimate(Halves::Both)
    }
}

pub fn tracer(scene: &Scene) -> Box<dyn Traverse> {
    Backend::DEFAULT.build(&scene.mesh, 2).unwrap()
}

/// Property tests of a fixed seed, so that what passes goes on passing, or of the one in GDPT_TEST_SEED: CI has another
/// one for each commit, and prints it.
pub fn cases(cases: u32) -> ProptestConfig {
    let named = std::env::var("GDPT_TEST_SEED").ok();
    let seed = named.map_or(0x6764_7074, |seed| {
        seed.parse().expect("GDPT_TEST_SEED is a number")
    });
    ProptestConfig {
        cases,
        max_global_rejects: 10 * cases,
        rng_seed: RngSeed::Fixed(seed),
        failure_persistence: None,
        ..Default::default()
    }
}

/// A plain random number generator (SplitMix64).
pub struct Rng(pub u64);

impl Rng {
    pub fn next(&mut self) -> f32 {
        self.0 = self.0.wrapping_add(0x9e37_79b9_7f4a_7c15);
        (mix(self.0) >> 40) as f32 / (1u64 << 24) as f32
    }

    pub fn unit_vector(&mut self) -> Vec3 {
        let z = 1.0 - 2.0 * self.next();
        let phi = std::f32::consts::TAU * self.next();
        let r = (1.0 - z * z).max(0.0).sqrt();
        Vec3::new(r * phi.cos(), r * phi.sin(), z)
    }
}

/// Differences to the right and downwards, 0 across the border.
pub fn differences(image: &Image) -> [Image; 2] {
    let (w, h) = (image.width, image.height);
    let mut out = [Image::new(w, h), Image::new(w, h)];
    for i in 0..w * h {
        if i % w + 1 < w {
            out[0].set(i, image.get(i + 1) - image.get(i));
        }
        if i / w + 1 < h {
            out[1].set(i, image.get(i + w) - image.get(i));
        }
    }
    out
}

/// Mean and variance of the mean.
#[derive(Clone, Copy, Debug, Default)]
pub struct Mean {
    n: f64,
    sum: f64,
    sum_sq: f64,
}

impl Mean {
    pub fn add(&mut self, x: f64) {
        self.n += 1.0;
        self.sum += x;
        self.sum_sq += x * x;
    }

    pub fn mean(&self) -> f64 {
        self.sum / self.n
    }

    pub fn variance(&self) -> f64 {
        ((self.sum_sq / self.n - self.mean().powi(2)) / (self.n - 1.0)).max(0.0)
    }
}

/// The largest |z| that `tests` comparisons of means over `n` runs each may show, if all means are
/// equal, but for a probability of `significance` in all. Two samples of `n`: Student's t with at least
/// n − 1 degrees of freedom.
pub fn largest_z(tests: usize, n: usize, significance: f64) -> f64 {
    let tail = significance / (2.0 * tests as f64);
    StudentsT::new(0.0, 1.0, n as f64 - 1.0)
        .unwrap()
        .inverse_cdf(1.0 - tail)
}

/// Pearson's χ² test of counts against expected counts; bins with fewer than 5 expected are pooled.
/// Panics where the probability of such a deviation is below `significance`.
pub fn chi_square(what: &str, observed: &[f64], expected: &[f64], significance: f64) {
    let (mut statistic, mut bins) = (0.0, 0);
    let (mut pooled_o, mut pooled_e) = (0.0, 0.0);
    for (o, e) in observed.iter().zip(expected) {
        if *e < 5.0 {
            pooled_o += o;
            pooled_e += e;
        } else {
            statistic += (o - e).powi(2) / e;
            bins += 1;
        }
    }
    if pooled_e > 0.5 {
        statistic += (pooled_o - pooled_e).powi(2) / pooled_e;
        bins += 1;
    } else {
        assert!(
            pooled_o < 6.0,
            "{what}: {pooled_o} samples where {pooled_e} are expected"
        );
    }
    assert!(bins > 4, "{what}: too few bins to test");
    let p = 1.0 - ChiSquared::new(f64::from(bins - 1)).unwrap().cdf(statistic);
    assert!(
        p > significance,
        "{what}: χ² = {statistic:.1} with {bins} bins, p = {p:.2e}"
    );
}

/// A prism along x, between these bounds of x, y and z: its right angle at the low y and the first z, its sides outwards.
pub fn wedge(
    [l, r]: [f32; 2],
    [low, high]: [f32; 2],
    [front, back]: [f32; 2],
) -> [Vec<[f32; 3]>; 5] {
    let corners = |x: f32| [[x, low, front], [x, high, front], [x, low, back]];
    let ([a, b, c], [d, e, f]) = (corners(l), corners(r));
    [
        vec![a, d, e, b],
        vec![b, e, f, c],
        vec![a, c, f, d],
        vec![a, b, c],
        vec![d, f, e],
    ]
}
