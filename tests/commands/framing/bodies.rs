//! Bodies with y upwards and their front towards z, as OBJ files have them.

use gdpt::load::mtl::MtlMaterial;
use gdpt::load::obj::ObjFile;
use glam::Vec3;
use std::f32::consts::TAU;

/// Triangles of one material.
#[derive(Clone, Default)]
pub struct Body {
    pub positions: Vec<Vec3>,
    pub triangles: Vec<[u32; 3]>,
}

/// The faces of a box.
#[derive(Clone, Copy, PartialEq)]
pub enum Face {
    Left,
    Right,
    Bottom,
    Top,
    Back,
    Front,
}

use Face::{Back, Bottom, Front, Left, Right, Top};

impl Body {
    /// A convex polygon, counter-clockwise seen from the front.
    pub fn face(mut self, corners: &[[f32; 3]]) -> Self {
        let first = self.positions.len() as u32;
        self.positions
            .extend(corners.iter().map(|&c| Vec3::from(c)));
        for i in 1..corners.len() as u32 - 1 {
            self.triangles.push([first, first + i, first + i + 1]);
        }
        self
    }

    pub fn block(self, low: [f32; 3], high: [f32; 3]) -> Self {
        self.block_without(low, high, &[])
    }

    pub fn block_without(mut self, low: [f32; 3], high: [f32; 3], skip: &[Face]) -> Self {
        let ([x0, y0, z0], [x1, y1, z1]) = (low, high);
        let faces = [
            (
                Left,
                [[x0, y0, z0], [x0, y0, z1], [x0, y1, z1], [x0, y1, z0]],
            ),
            (
                Right,
                [[x1, y0, z0], [x1, y1, z0], [x1, y1, z1], [x1, y0, z1]],
            ),
            (
                Bottom,
                [[x0, y0, z0], [x1, y0, z0], [x1, y0, z1], [x0, y0, z1]],
            ),
            (
                Top,
                [[x0, y1, z0], [x0, y1, z1], [x1, y1, z1], [x1, y1, z0]],
            ),
            (
                Back,
                [[x0, y0, z0], [x0, y1, z0], [x1, y1, z0], [x1, y0, z0]],
            ),
            (
                Front,
                [[x0, y0, z1], [x1, y0, z1], [x1, y1, z1], [x0, y1, z1]],
            ),
        ];
        for (face, corners) in faces {
            if !skip.contains(&face) {
                self = self.face(&corners);
            }
        }
        self
    }

    /// Turned about the y axis: radii and heights from below.
    pub fn lathe(mut self, profile: &[[f32; 2]]) -> Self {
        let steps = 24;
        for i in 0..steps {
            let at = |[r, y]: [f32; 2], k: i32| {
                let (sin, cos) = (TAU * k as f32 / steps as f32).sin_cos();
                [r * sin, y, r * cos]
            };
            for pair in profile.windows(2) {
                let (a, b) = (pair[0], pair[1]);
                let corners = [at(a, i), at(a, i + 1), at(b, i + 1), at(b, i)];
                self = match (a[0] > 0.0, b[0] > 0.0) {
                    (true, true) => self.face(&corners),
                    (true, false) => self.face(&corners[..3]),
                    _ => self.face(&[corners[0], corners[2], corners[3]]),
                };
            }
        }
        self
    }

    /// A rod with ends.
    pub fn rod(mut self, from: [f32; 3], to: [f32; 3], radius: f32) -> Self {
        let (a, b) = (Vec3::from(from), Vec3::from(to));
        let (u, v) = (b - a).normalize().any_orthonormal_pair();
        let steps = 16;
        let at = |end: Vec3, k: i32| {
            let (sin, cos) = (TAU * k as f32 / steps as f32).sin_cos();
            (end + radius * (u * cos + v * sin)).to_array()
        };
        for k in 0..steps {
            self = self
                .face(&[at(a, k), at(a, k + 1), at(b, k + 1), at(b, k)])
                .face(&[a.to_array(), at(a, k + 1), at(a, k)])
                .face(&[b.to_array(), at(b, k), at(b, k + 1)]);
        }
        self
    }

    pub fn ball(mut self, middle: [f32; 3], radii: [f32; 3]) -> Self {
        let steps = 10;
        let at = |i: i32, j: i32| {
            let (theta, phi) = (
                0.5 * TAU * i as f32 / steps as f32,
                0.5 * TAU * j as f32 / steps as f32,
            );
            let d = Vec3::new(
                theta.sin() * phi.cos(),
                theta.cos(),
                -theta.sin() * phi.sin(),
            );
            (Vec3::from(middle) + d * Vec3::from(radii)).to_array()
        };
        for i in 0..steps {
            for j in 0..2 * steps {
                let (a, b, c, d) = (at(i, j), at(i + 1, j), at(i + 1, j + 1), at(i, j + 1));
                if i > 0 {
                    self = self.face(&[a, b, d]);
                }
                if i + 1 < steps {
                    self = self.face(&[b, c, d]);
                }
            }
        }
        self
    }

    pub fn and(mut self, other: Body) -> Self {
        let first = self.positions.len() as u32;
        self.positions.extend(other.positions);
        let moved = other.triangles.into_iter().map(|t| t.map(|c| c + first));
        self.triangles.extend(moved);
        self
    }

    pub fn inside_out(mut self) -> Self {
        self.triangles.iter_mut().for_each(|t| t.swap(1, 2));
        self
    }

    /// The same thing in a program that has z upwards.
    pub fn z_up(mut self) -> Self {
        for p in &mut self.positions {
            *p = Vec3::new(p.x, -p.z, p.y);
        }
        self
    }

    pub fn obj(self, material: MtlMaterial) -> ObjFile {
        ObjFile {
            material_of: vec![0; self.triangles.len()],
            positions: self.positions,
            triangles: self.triangles,
            materials: vec![material],
            ..Default::default()
        }
    }
}

fn body() -> Body {
    Body::default()
}

fn legs(x: f32, z: f32, thick: f32, height: f32) -> Body {
    let mut legs = body();
    for (sx, sz) in [(-1.0, -1.0), (-1.0, 1.0), (1.0, -1.0), (1.0, 1.0)] {
        let (x, z) = (sx * x, sz * z);
        let half = 0.5 * thick;
        legs = legs.block([x - half, 0.0, z - half], [x + half, height, z + half]);
    }
    legs
}

pub fn house(overhang: f32, floor: bool) -> Body {
    let (w, h, d, top) = (2.0, 3.0, 3.0, 5.0);
    let (x, z) = (w + overhang, d + overhang);
    let y = h - overhang;
    let skip: &[Face] = if floor { &[Top] } else { &[Top, Bottom] };
    body()
        .block_without([-w, 0.0, -d], [w, h, d], skip)
        .face(&[[-x, y, z], [0.0, top, z], [0.0, top, -z], [-x, y, -z]])
        .face(&[[x, y, -z], [0.0, top, -z], [0.0, top, z], [x, y, z]])
        .face(&[[-w, h, d], [w, h, d], [0.0, top, d]])
        .face(&[[w, h, -d], [-w, h, -d], [0.0, top, -d]])
}

pub fn ground(half: f32) -> Body {
    let h = half;
    body().face(&[[-h, 0.0, -h], [-h, 0.0, h], [h, 0.0, h], [h, 0.0, -h]])
}

pub fn table() -> Body {
    legs(0.9, 0.4, 0.1, 0.7).block([-1.0, 0.7, -0.5], [1.0, 0.75, 0.5])
}

fn chair() -> Body {
    legs(0.22, 0.22, 0.05, 0.42)
        .block([-0.25, 0.42, -0.25], [0.25, 0.47, 0.25])
        .block([-0.25, 0.47, -0.25], [0.25, 1.0, -0.2])
}

fn car() -> Body {
    let mut car = body()
        .block([-0.9, 0.3, -2.2], [0.9, 0.9, 2.2])
        .block([-0.75, 0.9, -1.6], [0.75, 1.5, 0.8]);
    for (x, z) in [(-0.95, -1.4), (-0.95, 1.4), (0.75, -1.4), (0.75, 1.4)] {
        car = car.rod([x, 0.35, z], [x + 0.2, 0.35, z], 0.35);
    }
    car
}

fn tree() -> Body {
    body().rod([0.0; 3], [0.0, 2.0, 0.0], 0.15).lathe(&[
        [0.0, 1.2],
        [1.2, 1.2],
        [0.5, 2.4],
        [0.9, 2.4],
        [0.0, 4.0],
    ])
}

pub fn person(arms_out: bool) -> Body {
    let mut person = body()
        .ball([0.0, 1.65, 0.02], [0.11, 0.13, 0.12])
        .ball([0.0, 1.2, 0.0], [0.23, 0.33, 0.14])
        .ball([0.0, 0.9, 0.0], [0.18, 0.16, 0.12]);
    for s in [-1.0, 1.0] {
        let arm = if arms_out {
            ([s * 0.2, 1.4, 0.0], [s * 0.85, 1.4, 0.0])
        } else {
            ([s * 0.25, 1.42, 0.0], [s * 0.35, 0.75, 0.03])
        };
        let foot = s * 0.12;
        person = person
            .rod([s * 0.1, 0.85, 0.0], [foot, 0.08, -0.02], 0.08)
            .block([foot - 0.05, 0.0, -0.09], [foot + 0.05, 0.08, 0.18])
            .rod(arm.0, arm.1, 0.05);
    }
    person
}

fn dog() -> Body {
    let mut dog = body()
        .ball([0.0, 0.55, 0.0], [0.15, 0.15, 0.3])
        .ball([0.0, 0.75, 0.4], [0.12, 0.12, 0.16])
        .rod([0.0, 0.6, -0.28], [0.0, 0.75, -0.5], 0.02);
    for (x, z) in [(-0.1, -0.2), (-0.1, 0.2), (0.1, -0.2), (0.1, 0.2)] {
        dog = dog.rod([x, 0.0, z], [x, 0.5, z], 0.04);
    }
    dog
}

pub fn terrain(height: f32) -> Body {
    let n = 40;
    let at = |i: i32, j: i32| {
        let (x, z) = (i as f32 / 20.0 - 1.0, j as f32 / 20.0 - 1.0);
        let wave = (3.0 * x).sin() * (2.3 * z).cos();
        let ripple = 0.5 * (7.0 * x + 1.0).sin() * (6.0 * z).sin();
        [x, height * (wave + ripple), z]
    };
    let mut terrain = body();
    for (i, j) in (0..n).flat_map(|i| (0..n).map(move |j| (i, j))) {
        terrain = terrain.face(&[at(i, j), at(i, j + 1), at(i + 1, j + 1), at(i + 1, j)]);
    }
    terrain
}

/// Walls that face inwards.
pub fn room(skip: &[Face]) -> Body {
    body()
        .block_without([-3.0, 0.0, -2.5], [3.0, 2.6, 2.5], skip)
        .inside_out()
}

fn monitor() -> Body {
    body()
        .block([-0.4, 0.2, -0.02], [0.4, 0.7, 0.02])
        .block([-0.38, 0.22, 0.02], [0.38, 0.68, 0.021])
        .block([-0.03, 0.02, -0.03], [0.03, 0.25, -0.02])
        .block([-0.15, 0.0, -0.12], [0.15, 0.02, 0.12])
}

fn bed() -> Body {
    body()
        .block([-0.8, 0.2, -1.0], [0.8, 0.5, 1.0])
        .block([-0.8, 0.0, -1.05], [0.8, 1.0, -1.0])
        .block([-0.8, 0.0, 1.0], [0.8, 0.6, 1.05])
}

fn bust() -> Body {
    body()
        .lathe(&[
            [0.0, 0.0],
            [0.3, 0.0],
            [0.28, 0.1],
            [0.1, 0.3],
            [0.12, 0.35],
        ])
        .ball([0.0, 0.65, 0.03], [0.24, 0.33, 0.3])
}

fn cupboard() -> Body {
    body()
        .block([-0.5, 0.0, -0.3], [0.5, 2.0, 0.3])
        .block([-0.48, 0.05, 0.3], [-0.02, 1.95, 0.32])
        .block([0.02, 0.05, 0.3], [0.48, 1.95, 0.32])
}

fn fence() -> Body {
    let mut fence = body()
        .block([0.0, 0.2, 0.03], [2.4, 0.3, 0.06])
        .block([0.0, 0.7, 0.03], [2.4, 0.8, 0.06]);
    for i in 0..12 {
        let x = 0.2 * i as f32;
        fence = fence.block([x, 0.0, 0.0], [x + 0.1, 1.0, 0.03]);
    }
    fence
}

/// What stands plainly, whichever axis is up.
pub fn plain() -> Vec<(&'static str, Body)> {
    vec![
        ("house on a ground", house(0.3, true).and(ground(10.0))),
        ("house", house(0.3, true)),
        ("house without overhang", house(0.0, true)),
        ("house without floor", house(0.0, false)),
        ("table", table()),
        ("chair", chair()),
        ("car", car()),
        ("tree", tree()),
        ("person, arms out", person(true)),
        ("person", person(false)),
        ("dog", dog()),
        ("terrain", terrain(0.15)),
        ("flat terrain", terrain(0.03)),
        ("hills", terrain(0.4)),
        ("room, open above", room(&[Top]).and(table())),
        ("corner of a room", room(&[Top, Front, Right]).and(table())),
        ("monitor", monitor()),
        ("bed", bed()),
        ("bust", bust()),
        (
            "vase",
            body().lathe(&[[0.0, 0.0], [0.3, 0.0], [0.5, 0.5], [0.2, 1.0], [0.25, 1.2]]),
        ),
        (
            "street lamp",
            body()
                .rod([0.0; 3], [0.0, 4.0, 0.0], 0.06)
                .rod([0.0; 3], [0.0, 0.2, 0.0], 0.2)
                .block([-0.1, 3.95, 0.0], [0.1, 4.05, 0.8]),
        ),
    ]
}

/// What might stand one way or another.
pub fn undecidable() -> Vec<(&'static str, Body)> {
    vec![
        ("sphere", body().ball([0.0; 3], [1.0; 3])),
        ("cube", body().block([-1.0; 3], [1.0; 3])),
        ("cupboard", cupboard()),
        ("fence", fence()),
        (
            "slab on edge",
            body().block([-2.0, 0.0, -0.1], [2.0, 3.0, 0.1]),
        ),
        (
            "wall",
            body().face(&[
                [-2.0, 0.0, 0.0],
                [2.0, 0.0, 0.0],
                [2.0, 3.0, 0.0],
                [-2.0, 3.0, 0.0],
            ]),
        ),
        ("empty room", room(&[])),
        ("room, open in front", room(&[Front])),
    ]
}
