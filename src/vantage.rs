//! Where a camera stands whose place is open: from where most of the scene is seen that has light.
//!
//! What a place is worth is the area of the surfaces that a few hundred rays from there meet, as far as light
//! falls on them (where lamps are the only light) or as far as they show their front. So an open box is
//! seen from its open side, a room without a wall through where the wall would be, and a closed room with
//! lamps from within.

use crate::error::Result;
use crate::film::Film;
use crate::filter::Filter;
use crate::geometry::offset_origin;
use crate::gradient::Weights;
use crate::lanes::Vec3x8;
use crate::path::{Manifold, PathSettings};
use crate::render::{Job, Limits, Method, TILE_SIZE};
use crate::sampler::SamplerKind;
use crate::scene::Scene;
use crate::scene::camera::Camera;
use crate::scene::framing::{Open, Side};
use crate::scene::light::Source;
use crate::scene::material::Class;
use crate::scene::reflectors::Target;
use crate::trace::rays::{AnyBatch, ClosestBatch, Hit, Ray};
use crate::trace::{RayKind, Traverse};
use glam::{Quat, Vec3};
use rayon::prelude::*;
use wide::f32x8;

/// Rays along the longer side of the picture by which a place is judged.
const RAYS: u32 = 64;
/// Pixels along the longer side of a picture that is made to see whether there is light.
const PROBE: u32 = 64;
/// Points on lamps to which each surface point is connected.
const CONNECTIONS: usize = 2;
/// What the back of a surface counts.
const BACK: f64 = 0.25;
/// Of a scene with more triangles than this, some are enough to try a place.
const ENOUGH: usize = 1 << 14;
/// Sides to look from, azimuth and elevation in degrees; each must be worth this many times more than the
/// first.
const SIDES: [(f32, f32, f64); 14] = [
    (30.0, 20.0, 1.0),
    (-30.0, 20.0, 1.3),
    (0.0, 0.0, 1.4),
    (0.0, 10.0, 1.6),
    (60.0, 20.0, 1.5),
    (-60.0, 20.0, 1.5),
    (30.0, 45.0, 2.5),
    (-30.0, 45.0, 2.5),
    (120.0, 20.0, 2.0),
    (-120.0, 20.0, 2.0),
    (150.0, 20.0, 2.0),
    (-150.0, 20.0, 2.0),
    (180.0, 0.0, 2.0),
    (180.0, 45.0, 2.5),
];

/// Degrees from top to bottom inside of a room.
const ROOM_FOV: f32 = 65.0;
/// Steps of the places inside of a scene: east, up and south.
const PLACES: [usize; 3] = [8, 3, 8];
/// Rays from each of them, all around.
const AROUND: usize = 64;
/// Part of those that must meet something.
const ENCLOSED: f64 = 0.6;
/// How many of the places are looked from, and into how many directions.
const BEST: usize = 16;
const HEADINGS: usize = 16;

/// Moves the camera of a scene as far as its place is open. What the user is to know of it. Works on the
/// current pool.
pub fn settle(scene: &mut Scene, tracer: &dyn Traverse) -> Result<Option<&'static str>> {
    match scene.framing.open() {
        Open::Nothing => Ok(None),
        Open::Inside => {
            let lit = Value::of(scene);
            let inside = inside(scene, tracer, lit).or_else(|| inside(scene, tracer, Value::Front));
            match inside {
                Some(camera) => {
                    scene.look_by(camera);
                    Ok(None)
                }
                None => Ok(Some(
                    "there is no place inside of the scene: it is seen from outside",
                )),
            }
        }
        Open::Everything => {
            let (camera, worth) = best_side(scene, tracer)?;
            scene.look_by(camera);
            if worth > 0.0 || Value::of(scene) == Value::Front {
                return Ok(None);
            }
            // No lamp shines on what is seen from outside. Perhaps light gets there by other ways.
            let camera = match inside(scene, tracer, Value::Lit) {
                Some(camera) => camera,
                None if !is_dark(scene, tracer) => return Ok(None),
                None => match inside(scene, tracer, Value::Front) {
                    Some(camera) => camera,
                    None => return Ok(None),
                },
            };
            let outside = scene.camera.clone();
            scene.look_by(camera);
            if is_dark(scene, tracer) {
                scene.look_by(outside);
                return Ok(None);
            }
            Ok(Some(
                "no light is seen from outside: the camera is inside, where the lamps are (--view three-quarter is outside)",
            ))
        }
    }
}

/// What makes a surface worth seeing.
#[derive(Clone, Copy, PartialEq)]
enum Value {
    /// Light of lamps falls on it.
    Lit,
    /// It shows its front.
    Front,
}

impl Value {
    fn of(scene: &Scene) -> Self {
        if scene.environment.is_black() && !scene.lights.is_empty() {
            Value::Lit
        } else {
            Value::Front
        }
    }
}

/// The camera of the side that is worth most, and what it is worth.
fn best_side(scene: &Scene, tracer: &dyn Traverse) -> Result<(Camera, f64)> {
    let mesh = &scene.mesh;
    let stride = mesh.triangles.len() / ENOUGH + 1;
    let value = Value::of(scene);
    let worths = SIDES.par_iter().map(|&(azimuth, elevation, handicap)| {
        let side = Side { azimuth, elevation };
        let camera = scene.framing.seen_from(mesh, side, stride)?;
        let worth = worth(scene, tracer, &rays(&camera), value).area / handicap;
        Ok((side, worth))
    });
    let worths = worths.collect::<Result<Vec<_>>>()?;
    let mut best = worths[0];
    for &other in &worths[1..] {
        if other.1 > best.1 {
            best = other;
        }
    }
    Ok((scene.framing.seen_from(mesh, best.0, 1)?, best.1))
}

/// The best camera inside of the scene; `None` where nothing that is seen from any place is worth anything.
fn inside(scene: &Scene, tracer: &dyn Traverse, value: Value) -> Option<Camera> {
    let up = scene.framing.up.direction;
    let places = places(scene, tracer);
    let mut worths: Vec<(f64, Vec3)> = places
        .into_par_iter()
        .map(|place| {
            let rays: Vec<Ray> = around().map(|d| Ray::without_end(place, d)).collect();
            let seen = worth(scene, tracer, &rays, value);
            let enclosed = seen.met as f64 >= ENCLOSED * rays.len() as f64;
            (if enclosed { seen.area } else { 0.0 }, place)
        })
        .collect();
    worths.retain(|(worth, _)| *worth > 0.0);
    // Stable, so that the first of equals goes first.
    worths.sort_by(|a, b| b.0.total_cmp(&a.0));
    worths.truncate(BEST);

    // All around from those, a little down.
    let front = scene.framing.up.front();
    let headings: Vec<f32> = match scene.framing.azimuth() {
        // As seen from there: the other way.
        Some(azimuth) => vec![azimuth.to_radians()],
        None => (0..HEADINGS)
            .map(|i| std::f32::consts::TAU * i as f32 / HEADINGS as f32)
            .collect(),
    };
    let down = scene.framing.elevation().unwrap_or(6.0).to_radians();
    let cameras: Vec<(f64, Camera)> = worths
        .par_iter()
        .flat_map_iter(|&(_, place)| {
            headings.iter().filter_map(move |&heading| {
                let towards = Quat::from_axis_angle(up, heading) * front;
                let forward = -(towards * down.cos() + up * down.sin());
                let camera = scene
                    .framing
                    .standing_at(&scene.mesh, place, forward, ROOM_FOV)
                    .ok()?;
                Some((worth(scene, tracer, &rays(&camera), value).area, camera))
            })
        })
        .collect();
    let mut best: Option<(f64, Camera)> = None;
    for (worth, camera) in cameras {
        if worth > best.as_ref().map_or(0.0, |b| b.0) {
            best = Some((worth, camera));
        }
    }
    best.map(|(_, camera)| camera)
}

/// Places at eye height all over the scene.
fn places(scene: &Scene, tracer: &dyn Traverse) -> Vec<Vec3> {
    let (low, high) = scene.mesh.bounds;
    let up = scene.framing.up.direction;
    // The grid has its three steps along the axis that is nearest to the vertical.
    let axis = up.abs().max_position();
    let steps = |i: usize| if i == axis { PLACES[1] } else { PLACES[0] };
    let mut rays = Vec::new();
    for index in 0..steps(0) * steps(1) * steps(2) {
        let at = [
            index % steps(0),
            index / steps(0) % steps(1),
            index / steps(0) / steps(1),
        ];
        let part = Vec3::from([0, 1, 2].map(|i| (at[i] as f32 + 0.5) / steps(i) as f32));
        let place = low + part * (high - low);
        rays.push(Ray::without_end(place, up));
        rays.push(Ray::without_end(place, -up));
    }
    let mut batch = ClosestBatch::of(&rays);
    tracer.closest(&mut batch, RayKind::Bounce);
    let distance = |index: usize| batch.hit(index as u32).map(|hit| hit.t);
    let places = (0..rays.len()).step_by(2).filter_map(|index| {
        let (above, below) = (distance(index), distance(index + 1)?);
        // Between floor and ceiling, a little above the middle.
        let rise = above.map_or(0.0, |above| 0.55 * (above + below) - below);
        Some(rays[index].origin + up * rise)
    });
    places.collect()
}

/// What rays see.
#[derive(Clone, Copy, Debug, Default)]
struct Seen {
    /// Area of surfaces of value.
    area: f64,
    /// Rays that meet anything.
    met: usize,
}

/// What `rays` see, each of which stands for the same solid angle; in units of that.
fn worth(scene: &Scene, tracer: &dyn Traverse, rays: &[Ray], value: Value) -> Seen {
    let mut batch = ClosestBatch::of(rays);
    tracer.closest(&mut batch, RayKind::Primary);
    let mut seen = Seen::default();
    // Surface points that light may reach: area by connection.
    let mut shadows = AnyBatch::default();
    let mut areas = Vec::new();
    for index in 0..rays.len() as u32 {
        let Some(hit) = batch.hit(index) else {
            continue;
        };
        seen.met += 1;
        let met = Met::new(scene, &rays[index as usize], &hit);
        if value == Value::Front {
            seen.area += met.area * if met.front { 1.0 } else { BACK };
            continue;
        }
        if !met.scatters {
            continue;
        }
        for connection in 0..CONNECTIONS {
            let number = index as usize * CONNECTIONS + connection;
            if let Some(ray) = met.connection(scene, number) {
                shadows.push(&ray);
                areas.push(met.area / CONNECTIONS as f64);
            }
        }
    }
    tracer.any(&mut shadows, RayKind::Shadow);
    let lit = areas.iter().enumerate();
    let lit = lit.filter(|&(index, _)| !shadows.is_blocked(index as u32));
    seen.area += lit.map(|(_, area)| area).sum::<f64>();
    seen
}

/// A surface that a ray met.
struct Met {
    position: Vec3,
    /// On the side of the ray.
    normal: Vec3,
    offset: f32,
    front: bool,
    /// Whether light that falls on it is seen: it is no lamp, nor smooth glass or a mirror.
    scatters: bool,
    area: f64,
}

impl Met {
    fn new(scene: &Scene, ray: &Ray, hit: &Hit) -> Self {
        let point = scene.mesh.point(hit.triangle, hit.u, hit.v);
        let cosine = -ray.direction.dot(point.ng);
        let front = cosine > 0.0;
        let material = scene.mesh.material_of[hit.triangle as usize] as usize;
        let material = &scene.materials[material];
        // Slanted surfaces would be worth as much as they please.
        let slant = cosine.abs().max(0.3);
        Self {
            position: point.position,
            normal: if front { point.ng } else { -point.ng },
            offset: point.offset,
            front,
            scatters: material.emission.is_none() && material.class == Class::Rough,
            area: f64::from(hit.t) * f64::from(hit.t) / f64::from(slant),
        }
    }

    /// A ray to a lamp that shines on the side that is seen; `number` is the connection's in the picture.
    fn connection(&self, scene: &Scene, number: usize) -> Option<Ray> {
        // Points of the R3 sequence (Roberts 2018).
        let u = [0.819_172_5, 0.671_043_6, 0.549_700_5]
            .map(|step: f64| ((number + 1) as f64 * step).fract() as f32);
        // One lane is asked for.
        let from = Vec3x8::splat(self.position);
        let lamps = scene.sample_lights::<false>(from, 1, u.map(f32x8::splat));
        let lamp = lamps.lane(0)?;
        if lamp.source == Source::Sky {
            return None;
        }
        let to = lamp.target.towards(self.position);
        // Not along either surface, where rounding would tell.
        let grazing = 1e-3 * to.length();
        let shines = match lamp.target {
            Target::Surface { ng, .. } => to.dot(ng) < -grazing,
            Target::Point(_) => scene.falloff(lamp.source, -to.normalize()) > 0.0,
            Target::Direction(_) => true,
        };
        if to.dot(self.normal) <= grazing || !shines {
            return None;
        }
        let origin = offset_origin(
            self.position.into(),
            self.normal.into(),
            self.offset,
            to.into(),
        );
        Some(Ray {
            origin: origin.into(),
            direction: lamp.target.towards(origin.into()),
            length: match lamp.target {
                Target::Surface { .. } | Target::Point(_) => 1.0 - 1e-3,
                Target::Direction(_) => f32::INFINITY,
            },
        })
    }
}

/// Columns and rows of a coarse picture with `longer` along its longer side.
fn coarse(camera: &Camera, longer: u32) -> (u32, u32) {
    let longest = u64::from(camera.width.max(camera.height));
    let along = |side: u32| (u64::from(side) * u64::from(longer) / longest).max(1) as u32;
    (along(camera.width), along(camera.height))
}

/// Rays through the middles of a coarse picture's pixels.
fn rays(camera: &Camera) -> Vec<Ray> {
    let (columns, rows) = coarse(camera, RAYS);
    let camera = camera.at_size(columns, rows);
    let pixels = (0..rows).flat_map(|y| (0..columns).map(move |x| (x, y)));
    pixels
        .map(|(x, y)| {
            let direction = camera.direction(x as f32 + 0.5, y as f32 + 0.5);
            Ray::without_end(camera.origin, direction)
        })
        .collect()
}

/// Directions evenly all around: a Fibonacci spiral.
fn around() -> impl Iterator<Item = Vec3> {
    let turn = std::f32::consts::PI * (3.0 - 5f32.sqrt());
    (0..AROUND).map(move |i| {
        let y = 1.0 - (2 * i + 1) as f32 / AROUND as f32;
        let (sin, cos) = (turn * i as f32).sin_cos();
        let r = (1.0 - y * y).sqrt();
        Vec3::new(r * cos, y, r * sin)
    })
}

/// Whether the first paths through a coarse picture find no light at all.
fn is_dark(scene: &mut Scene, tracer: &dyn Traverse) -> bool {
    let (width, height) = coarse(&scene.camera, PROBE);
    let probe = scene.camera.at_size(width, height);
    let camera = std::mem::replace(&mut scene.camera, probe);
    let mut film = Film::new(width, height, TILE_SIZE);
    let job = Job {
        scene,
        tracer,
        method: Method::Pt,
        settings: PathSettings {
            depth: 12,
            seed: 0,
            sampler: SamplerKind::Sobol,
            weights: Weights::Mis,
            filter: Filter::Box,
            manifold: Manifold::Off,
        },
        first: 0,
        limits: Limits {
            samples: 4,
            time: None,
        },
    };
    job.run(&mut film, &mut |_, _| None, &mut |_| ());
    scene.look_by(camera);
    !film.has_light()
}
