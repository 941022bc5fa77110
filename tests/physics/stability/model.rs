//! Small scenes made of polygons: in memory for the tests, as files for everyone.

use crate::common::{self, Ball};
use gdpt::load::mtl::MtlMaterial;
use gdpt::load::sidecar::CameraTable;
use gdpt::scene::{Scene, SceneSettings};
use std::collections::HashMap;
use std::fmt::Write;
use std::path::Path;

/// A scene.
#[derive(Clone, Debug)]
pub struct Model {
    pub polygons: Vec<(Vec<[f32; 3]>, usize)>,
    pub balls: Vec<Ball>,
    pub materials: Vec<MtlMaterial>,
    pub origin: [f32; 3],
    pub target: [f32; 3],
    pub environment: f32,
    pub roughness_threshold: f32,
}

/// Materials that every model has, by their place.
pub const FLOOR: usize = 0;
pub const WALL: usize = 1;
pub const LAMP: usize = 2;
/// The first of its own.
pub const OWN: usize = 3;

impl Model {
    /// A floor of 4 by 4 with a wall behind it and a lamp of this side and radiance above, without front
    /// or sides; the camera looks down on it.
    pub fn room(lamp_side: f32, radiance: f32) -> Self {
        let mut model = Self {
            polygons: Vec::new(),
            balls: Vec::new(),
            materials: vec![
                named("floor", common::lambert(0.7)),
                named("wall", common::lambert(0.5)),
                named("lamp", common::light(radiance)),
            ],
            origin: [0.3, 1.6, 2.6],
            target: [0.0, 0.4, 0.0],
            environment: 0.0,
            roughness_threshold: gdpt::scene::material::ROUGHNESS_THRESHOLD,
        };
        model.rectangle([-2.0, 0.0, 2.0], [4.0, 0.0, 0.0], [0.0, 0.0, -4.0], FLOOR);
        model.rectangle([-2.0, 0.0, -2.0], [4.0, 0.0, 0.0], [0.0, 3.0, 0.0], WALL);
        model.lamp([0.5, 2.0, 0.5], lamp_side);
        model
    }

    /// A lamp that shines downwards.
    pub fn lamp(&mut self, middle: [f32; 3], side: f32) {
        let [x, y, z] = middle;
        let h = 0.5 * side;
        self.rectangle([x - h, y, z - h], [side, 0.0, 0.0], [0.0, 0.0, side], LAMP);
    }

    /// With corners p, p + a, p + a + b, p + b: its front is where these run counter-clockwise.
    pub fn rectangle(&mut self, p: [f32; 3], a: [f32; 3], b: [f32; 3], material: usize) {
        let add = |p: [f32; 3], q: [f32; 3]| [p[0] + q[0], p[1] + q[1], p[2] + q[2]];
        let corners = vec![p, add(p, a), add(add(p, a), b), add(p, b)];
        self.polygons.push((corners, material));
    }

    /// A box with its front outside, from its lowest corner.
    pub fn cuboid(&mut self, [x, y, z]: [f32; 3], [w, h, d]: [f32; 3], material: usize) {
        let (a, b, c) = ([w, 0.0, 0.0], [0.0, h, 0.0], [0.0, 0.0, d]);
        self.rectangle([x, y, z + d], a, b, material);
        self.rectangle([x, y, z], b, a, material);
        self.rectangle([x, y, z], c, b, material);
        self.rectangle([x + w, y, z], b, c, material);
        self.rectangle([x, y + h, z], c, a, material);
        self.rectangle([x, y, z], a, c, material);
    }

    /// A ball with this many triangles along a quarter of its equator, as a power of two.
    pub fn ball(&mut self, centre: [f32; 3], radius: f32, level: u32, material: usize) {
        self.balls.push(Ball {
            centre: centre.into(),
            radii: glam::Vec3::splat(radius),
            level,
            smooth: true,
            material,
        });
    }

    /// Adds a material and gives its place.
    pub fn material(&mut self, name: &str, material: MtlMaterial) -> usize {
        self.materials.push(named(name, material));
        self.materials.len() - 1
    }

    /// All coordinates times `scale`, then moved by `shift` along all axes.
    pub fn transformed(mut self, scale: f32, shift: f32) -> Self {
        let polygons = self.polygons.iter_mut().flat_map(|(p, _)| p.iter_mut());
        let points = polygons.chain([&mut self.origin, &mut self.target]);
        points.for_each(|p| *p = p.map(|x| x * scale + shift));
        for ball in &mut self.balls {
            ball.centre = ball.centre * scale + shift;
            ball.radii *= scale;
        }
        self
    }

    fn camera(&self) -> CameraTable {
        CameraTable {
            origin: Some(self.origin),
            target: Some(self.target),
            up: None,
            fov: Some(45.0),
            ..Default::default()
        }
    }

    pub fn scene(&self, width: u32, height: u32) -> Scene {
        let settings = SceneSettings {
            camera: self.camera(),
            size: (width, height),
            environment: glam::Vec3::splat(self.environment).into(),
            roughness_threshold: self.roughness_threshold,
            ..Default::default()
        };
        let polygons: Vec<(&[[f32; 3]], usize)> = self
            .polygons
            .iter()
            .map(|(p, m)| (p.as_slice(), *m))
            .collect();
        let materials = self.materials.clone();
        common::polygons_and_balls(&polygons, &self.balls, materials, &settings)
    }

    /// Writes `NAME.obj`, `NAME.mtl` and `NAME.toml`.
    pub fn write(&self, folder: &Path, name: &str, about: &str) {
        let mut obj = format!("# {about}\nmtllib {name}.mtl\n");
        let mut count = 0;
        for (corners, material) in &self.polygons {
            for [x, y, z] in corners {
                writeln!(obj, "v {x} {y} {z}").unwrap();
            }
            writeln!(obj, "usemtl {}", self.materials[*material].name).unwrap();
            let indices: Vec<String> = (1..=corners.len())
                .map(|i| (count + i).to_string())
                .collect();
            writeln!(obj, "f {}", indices.join(" ")).unwrap();
            count += corners.len();
        }
        let mut normals = 0;
        for ball in &self.balls {
            writeln!(obj, "usemtl {}", self.materials[ball.material].name).unwrap();
            // Triangles share their corners.
            let mut numbers = HashMap::new();
            for corners in ball.triangles() {
                let mut face = "f".to_owned();
                for p in corners {
                    let place = p.to_array().map(f32::to_bits);
                    let is_new = !numbers.contains_key(&place);
                    let (v, vn) = *numbers.entry(place).or_insert((count + 1, normals + 1));
                    if is_new {
                        count += 1;
                        writeln!(obj, "v {:.5} {:.5} {:.5}", p.x, p.y, p.z).unwrap();
                        if ball.smooth {
                            normals += 1;
                            let n = ball.normal(p);
                            writeln!(obj, "vn {:.4} {:.4} {:.4}", n.x, n.y, n.z).unwrap();
                        }
                    }
                    write!(face, " {v}").unwrap();
                    if ball.smooth {
                        write!(face, "//{vn}").unwrap();
                    }
                }
                writeln!(obj, "{face}").unwrap();
            }
        }
        let mut mtl = String::new();
        for m in &self.materials {
            writeln!(mtl, "newmtl {}", m.name).unwrap();
            for (key, value) in [("Kd", m.kd), ("Ks", m.ks), ("Ke", m.ke)] {
                if let Some([r, g, b]) = value {
                    writeln!(mtl, "{key} {r} {g} {b}").unwrap();
                }
            }
            for (key, value) in [("Ni", m.ni), ("Pr", m.pr), ("Pm", m.pm)] {
                if let Some(value) = value {
                    writeln!(mtl, "{key} {value}").unwrap();
                }
            }
            if let Some(illum) = m.illum {
                writeln!(mtl, "illum {illum}").unwrap();
            }
        }
        let (o, t, e) = (self.origin, self.target, self.environment);
        let toml = format!(
            "[camera]\norigin = {o:?}\ntarget = {t:?}\nfov = 45.0\n\
             [film]\nwidth = 256\nheight = 192\n[environment]\nradiance = [{e:?}, {e:?}, {e:?}]\n"
        );
        std::fs::write(folder.join(format!("{name}.obj")), obj).unwrap();
        std::fs::write(folder.join(format!("{name}.mtl")), mtl).unwrap();
        std::fs::write(folder.join(format!("{name}.toml")), toml).unwrap();
    }
}

fn named(name: &str, material: MtlMaterial) -> MtlMaterial {
    MtlMaterial {
        name: name.to_owned(),
        ..material
    }
}

/// GGX metal of this alpha; 0 is a mirror.
pub fn metal(alpha: f32) -> MtlMaterial {
    MtlMaterial {
        ks: Some([0.9, 0.8, 0.6]),
        pm: Some(1.0),
        pr: Some(alpha.sqrt()),
        ..Default::default()
    }
}

/// Glass of this index and alpha; 0 is smooth.
pub fn glass(index: f32, alpha: f32) -> MtlMaterial {
    MtlMaterial {
        ni: Some(index),
        pr: Some(alpha.sqrt()),
        illum: Some(7),
        ..Default::default()
    }
}
