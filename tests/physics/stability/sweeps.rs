//! What makes gradient-domain path tracing fail, each as a sweep from harmless to extreme.

use super::model::{FLOOR, LAMP, Model, OWN, WALL, glass, metal};
use crate::common::lambert;

/// A sweep: one parameter over a row of values.
pub struct Sweep {
    pub name: &'static str,
    /// What is made worse.
    pub about: &'static str,
    pub values: &'static [f32],
    /// The value whose scene stands in `scenes/failures`.
    pub shown: f32,
    pub model: fn(f32) -> Model,
}

pub const SWEEPS: &[Sweep] = &[
    Sweep {
        name: "contact",
        about: "gap between a box and the floor",
        values: &[1e-1, 1e-2, 1e-3, 1e-4, 1e-5, 1e-6],
        shown: 1e-2,
        model: contact,
    },
    Sweep {
        name: "corner",
        about: "gap between a board and the wall behind it, which it lights",
        values: &[1e-1, 1e-2, 1e-3, 1e-4, 1e-5, 1e-6],
        shown: 1e-2,
        model: corner,
    },
    Sweep {
        name: "roughness",
        about: "alpha of a metal floor; up to 0.09 it copies half vectors",
        values: &[1e-4, 1e-3, 1e-2, 5e-2, 8.99e-2, 9.01e-2, 0.5],
        shown: 9.01e-2,
        model: roughness,
    },
    Sweep {
        name: "index",
        about: "index of a smooth glass slab over the floor",
        values: &[1.0, 1.0001, 1.0009, 1.002, 1.1, 1.5, 2.5],
        shown: 1.5,
        model: |index| slab(index, 0.0),
    },
    Sweep {
        name: "rough-index",
        about: "index of a glass slab of alpha 0.1 over the floor",
        values: &[1.0, 1.0009, 1.002, 1.1, 1.5, 2.5],
        shown: 1.1,
        model: |index| slab(index, 0.1),
    },
    Sweep {
        name: "rim",
        about: "index of a prism with total internal reflection beside transmission",
        values: &[1.2, 1.41, 1.6, 2.4],
        shown: 1.6,
        model: rim,
    },
    Sweep {
        name: "knife",
        about: "height of a knife's edge over the floor",
        values: &[0.5, 0.1, 1e-2, 1e-3, 1e-4],
        shown: 0.1,
        model: knife,
    },
    Sweep {
        name: "slit",
        about: "width of the slit through which all light comes",
        values: &[0.5, 0.1, 3e-2, 1e-2, 1e-3],
        shown: 3e-2,
        model: slit,
    },
    Sweep {
        name: "tiny-lamp",
        about: "side of the lamp, its power kept",
        values: &[1.0, 0.1, 1e-2, 1e-3, 1e-4],
        shown: 1e-2,
        model: |side| {
            let mut model = Model::room(side, 4.0 / (side * side));
            model.cuboid([-0.5, 0.0, -0.5], [0.6, 0.6, 0.6], WALL);
            model
        },
    },
    Sweep {
        name: "caustic",
        about: "side of a lamp, its power kept, whose light a mirror throws on the floor",
        values: &[1.0, 0.3, 0.1, 1e-2, 1e-4],
        shown: 0.3,
        model: caustic,
    },
    Sweep {
        name: "silhouette",
        about: "radiance of the environment behind a board's edge",
        values: &[0.0, 0.1, 1.0, 10.0],
        shown: 1.0,
        model: silhouette,
    },
    Sweep {
        name: "chequers",
        about: "side of the squares of a floor, mirrors and diffuse by turns",
        values: &[1.0, 0.4, 0.1],
        shown: 0.4,
        model: chequers,
    },
    Sweep {
        name: "bars",
        about: "bars in front of the wall, each as wide as the gap to the next",
        values: &[8.0, 24.0, 96.0],
        shown: 24.0,
        model: bars,
    },
    Sweep {
        name: "hair",
        about: "width of triangles of length 2",
        values: &[1e-1, 1e-2, 1e-4, 1e-6],
        shown: 1e-2,
        model: hair,
    },
    Sweep {
        name: "stripes",
        about: "stripes of reflectance 0.9 and 0.1 on the floor",
        values: &[8.0, 24.0, 96.0],
        shown: 24.0,
        model: stripes,
    },
    Sweep {
        name: "scale",
        about: "scale of the whole scene",
        values: &[1e-3, 1e-2, 1.0, 1e2, 1e4],
        shown: 1e4,
        model: |scale| furnished().transformed(scale, 0.0),
    },
    Sweep {
        name: "origin",
        about: "distance of the whole scene from the origin",
        values: &[0.0, 1e1, 1e2, 1e3],
        shown: 1e3,
        model: |shift| furnished().transformed(1.0, shift),
    },
    Sweep {
        name: "narrow",
        about: "width of the triangles of length 4 that make up the floor",
        values: &[0.5, 0.1, 1e-2],
        shown: 1e-2,
        model: narrow,
    },
    Sweep {
        name: "exposure",
        about: "radiance of a second lamp that lights half of the room, beside one of 1",
        values: &[1.0, 10.0, 100.0],
        shown: 100.0,
        model: exposure,
    },
    Sweep {
        name: "mirror",
        about: "side of a mirror beside the lamp",
        values: &[0.1, 0.3, 1.0, 3.0],
        shown: 1.0,
        model: mirror,
    },
    Sweep {
        name: "curvature",
        about: "curvature of a mirror, which is a ball on the floor",
        values: &[1.0, 2.0, 5.0, 20.0],
        shown: 2.0,
        model: |curvature| ball_on_floor(1.0 / curvature, metal(0.0), None),
    },
    Sweep {
        name: "facets",
        about: "flat triangles along the equator of a ball that is a mirror",
        values: &[8.0, 16.0, 32.0, 128.0],
        shown: 16.0,
        model: |count| ball_on_floor(0.5, metal(0.0), Some(count)),
    },
    Sweep {
        name: "near-mirror",
        about: "alpha of a ball of metal on the floor",
        values: &[0.0, 1e-3, 1e-2, 2e-2, 4.49e-2, 4.51e-2],
        shown: 1e-2,
        model: |alpha| ball_on_floor(0.5, metal(alpha), None),
    },
    Sweep {
        name: "ball",
        about: "index of a ball of glass on the floor",
        values: &[1.01, 1.2, 1.5, 2.5],
        shown: 1.5,
        model: |index| ball_on_floor(0.5, glass(index, 0.0), None),
    },
    Sweep {
        name: "pane",
        about: "index of a sheet of glass between lamp and room",
        values: &[1.01, 1.2, 1.5, 2.5],
        shown: 1.5,
        model: |index| behind_glass(index, 0.4),
    },
    Sweep {
        name: "far-lamp",
        about: "distance of a lamp behind a sheet of glass, its light below kept",
        values: &[0.03, 0.4, 3.0, 30.0],
        shown: 3.0,
        model: |distance| behind_glass(1.5, distance),
    },
];

/// A room with things of three materials.
fn furnished() -> Model {
    let mut model = Model::room(0.8, 8.0);
    let shiny = model.material("metal", metal(0.05));
    let clear = model.material("glass", glass(1.5, 0.0));
    model.cuboid([-0.9, 0.0, -0.6], [0.6, 0.8, 0.6], shiny);
    model.cuboid([0.2, 0.1, -0.2], [0.4, 0.5, 0.4], clear);
    model.cuboid([-0.1, 0.0, 0.6], [0.3, 0.2, 0.3], WALL);
    model
}

fn contact(gap: f32) -> Model {
    let mut model = Model::room(0.8, 8.0);
    model.cuboid([-0.5, gap, -0.5], [0.9, 0.7, 0.9], WALL);
    model
}

fn corner(gap: f32) -> Model {
    let mut model = Model::room(0.8, 8.0);
    model.rectangle(
        [-1.0, 0.0, -2.0 + gap],
        [2.0, 0.0, 0.0],
        [0.0, 1.0, gap],
        WALL,
    );
    model.rectangle([-2.0, gap, -1.0], [4.0, 0.0, 0.0], [0.0, 0.0, -1.0], WALL);
    model
}

pub fn roughness(alpha: f32) -> Model {
    let mut model = Model::room(0.8, 8.0);
    model.materials[FLOOR] = gdpt::load::mtl::MtlMaterial {
        name: "floor".into(),
        ..metal(alpha)
    };
    model.cuboid([-0.5, 0.1, -0.5], [0.6, 0.6, 0.6], WALL);
    model.environment = 0.2;
    model
}

pub fn slab(index: f32, alpha: f32) -> Model {
    let mut model = Model::room(0.8, 8.0);
    let slab = model.material("glass", glass(index, alpha));
    model.cuboid([-1.0, 0.3, -1.0], [1.6, 0.3, 1.6], slab);
    model.environment = 0.3;
    model
}

fn rim(index: f32) -> Model {
    let mut model = Model::room(0.8, 8.0);
    model.environment = 0.3;
    let prism = model.material("glass", glass(index, 0.0));
    // A right angle away from the camera.
    for polygon in crate::common::wedge([-0.8, 0.8], [0.2, 1.2], [0.6, -0.6]) {
        model.polygons.push((polygon, prism));
    }
    model
}

fn knife(height: f32) -> Model {
    let mut model = Model::room(0.3, 30.0);
    model.rectangle([-2.0, height, 0.2], [4.0, 0.0, 0.0], [0.0, 1.0, 0.0], WALL);
    model
}

fn slit(width: f32) -> Model {
    let mut model = Model::room(0.8, 8.0 / width);
    // A ceiling below the lamp, open along a line.
    let half = 0.5 * width;
    model.rectangle(
        [-2.0, 1.8, -2.0],
        [4.0, 0.0, 0.0],
        [0.0, 0.0, 2.5 - half],
        WALL,
    );
    model.rectangle(
        [-2.0, 1.8, 0.5 + half],
        [4.0, 0.0, 0.0],
        [0.0, 0.0, 1.5 - half],
        WALL,
    );
    model
}

fn caustic(side: f32) -> Model {
    let mut model = Model::room(side, 4.0 / (side * side));
    let mirror = model.material("mirror", metal(0.0));
    model.rectangle([-1.5, 0.0, -0.5], [0.0, 1.6, -0.4], [0.4, 0.0, 2.0], mirror);
    model
}

fn mirror(side: f32) -> Model {
    let mut model = Model::room(0.4, 20.0);
    let mirror = model.material("mirror", metal(0.0));
    let (low, middle) = (1.0 - 0.5 * side.min(2.0), -0.5 - 0.5 * side);
    model.rectangle(
        [-1.5, low, middle],
        [0.0, side, 0.0],
        [0.0, 0.0, side],
        mirror,
    );
    model.cuboid([-0.5, 0.0, -0.5], [0.4, 0.4, 0.4], WALL);
    model
}

/// A ball of this material; with so many flat triangles along its equator.
fn ball_on_floor(
    radius: f32,
    material: gdpt::load::mtl::MtlMaterial,
    facets: Option<f32>,
) -> Model {
    let mut model = Model::room(0.4, 20.0);
    let material = model.material("ball", material);
    let level = facets.map_or(4, |count| (count / 4.0).log2().round() as u32);
    model.ball([-0.2, radius, 0.0], radius, level, material);
    model.balls[0].smooth = facets.is_none();
    model
}

/// A room under a sheet of glass, which is above the camera too, with a lamp above it.
fn behind_glass(index: f32, distance: f32) -> Model {
    let (side, height) = (0.4, 2.0);
    let mut model = Model::room(side, 20.0 * (1.0 + distance / height).powi(2));
    model.polygons.pop();
    model.lamp([0.5, height + 0.05 + distance, 0.5], side);
    let pane = model.material("glass", glass(index, 0.0));
    model.cuboid([-3.0, height, -3.0], [6.0, 0.05, 6.0], pane);
    model
}

fn silhouette(radiance: f32) -> Model {
    let mut model = Model::room(0.8, 8.0);
    model.environment = radiance;
    model.origin = [0.3, 1.0, 3.5];
    model.target = [0.0, 1.8, 0.0];
    model.polygons.remove(1);
    model.rectangle([-0.7, 0.8, 0.0], [1.2, 0.3, 0.0], [0.0, 1.0, 0.1], WALL);
    model
}

/// The floor in `count` rows and columns, with one of two materials each.
fn tiles(model: &mut Model, columns: usize, rows: usize, material: impl Fn(usize, usize) -> usize) {
    model.polygons.remove(FLOOR);
    let (w, d) = (4.0 / columns as f32, 4.0 / rows as f32);
    for row in 0..rows {
        for column in 0..columns {
            let p = [-2.0 + w * column as f32, 0.0, 2.0 - d * row as f32];
            model.rectangle(p, [w, 0.0, 0.0], [0.0, 0.0, -d], material(column, row));
        }
    }
}

fn chequers(side: f32) -> Model {
    let mut model = Model::room(0.8, 8.0);
    let mirror = model.material("mirror", metal(0.0));
    let count = (4.0 / side).round() as usize;
    tiles(&mut model, count, count, |column, row| {
        if (column + row) % 2 == 0 {
            mirror
        } else {
            FLOOR
        }
    });
    model
}

fn stripes(count: f32) -> Model {
    let mut model = Model::room(0.8, 8.0);
    let dark = model.material("dark", lambert(0.1));
    let bright = model.material("bright", lambert(0.9));
    assert_eq!(dark, OWN);
    tiles(&mut model, count as usize, 1, |column, _| {
        [dark, bright][column % 2]
    });
    model
}

fn bars(count: f32) -> Model {
    let mut model = Model::room(0.8, 8.0);
    let width = 3.0 / (2.0 * count);
    for i in 0..count as usize {
        let x = -1.5 + 2.0 * width * i as f32;
        model.rectangle([x, 0.0, 0.8], [width, 0.0, 0.0], [0.0, 1.2, 0.0], WALL);
    }
    model
}

fn hair(width: f32) -> Model {
    let mut model = Model::room(0.8, 8.0);
    for i in 0..40 {
        let x = -1.5 + 0.075 * i as f32;
        let lean = 0.3 * (i as f32 * 1.7).sin();
        let z = 0.5 * (i as f32 * 2.3).cos();
        let triangle = vec![[x, 0.0, z], [x + width, 0.0, z], [x + lean, 2.0, z]];
        model.polygons.push((triangle, WALL));
    }
    model
}

fn narrow(width: f32) -> Model {
    let mut model = furnished();
    model.polygons.remove(FLOOR);
    let count = (4.0 / width).round() as usize;
    for i in 0..count {
        let p = [-2.0 + width * i as f32, 0.0, 2.0];
        model.rectangle(p, [width, 0.0, 0.0], [0.0, 0.0, -4.0], FLOOR);
    }
    model
}

fn exposure(radiance: f32) -> Model {
    let mut model = Model::room(0.8, 1.0);
    // A wall down the middle, seen from above, and the second lamp on its left.
    model.origin = [-0.2, 4.5, 2.0];
    model.target = [-0.2, 0.0, -0.2];
    model.rectangle([-0.2, 0.0, 2.0], [0.0, 2.5, 0.0], [0.0, 0.0, -4.0], WALL);
    let lamp = model.materials[LAMP].clone();
    let second = model.material(
        "second",
        gdpt::load::mtl::MtlMaterial {
            ke: Some([radiance; 3]),
            ..lamp
        },
    );
    model.rectangle([-1.4, 2.0, 0.0], [0.5, 0.0, 0.0], [0.0, 0.0, 0.5], second);
    model
}
