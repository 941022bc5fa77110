//! The light step: at every rough vertex a point on a light is sampled (next event estimation), for
//! the base path and, with the same point, for its offset paths.

use super::{BasePath, Context, Wavefront, gather, survival, trace_any};
use crate::geometry::solid_angle_per_area;
use crate::gradient::{Base, Shift};
use crate::sampler::{self, Dimension};
use crate::scene::Scene;
use crate::scene::light::LightSample;
use crate::scene::material::Class;
use crate::shift::Offset;
use crate::trace::RayKind;
use crate::trace::rays::{AnyBatch, Ray};
use crate::vertex::Vertex;
use glam::Vec3;

/// A path that is complete but for its shadow rays.
#[derive(Clone, Debug)]
pub(super) struct LightPath<const N: usize> {
    pixel: u32,
    base: Connection,
    offsets: [Option<Connection>; N],
}

/// A vertex connected to a point on a light. Densities are over that of light sampling at the base
/// path.
#[derive(Clone, Copy, Debug)]
struct Connection {
    /// The path's value over the density, if nothing blocks it.
    value: Vec3,
    /// Density of light sampling. Kept where the way is blocked: light sampling makes such paths too.
    by_light: f32,
    /// Density of BSDF sampling, if nothing blocks it; it makes no blocked paths.
    by_bsdf: f32,
    /// The shadow ray.
    ray: u32,
}

impl Connection {
    #[inline]
    fn resolve(&self, rays: &AnyBatch) -> (Vec3, f32) {
        if rays.is_blocked(self.ray) {
            (Vec3::ZERO, self.by_light)
        } else {
            (self.value, self.by_light + self.by_bsdf)
        }
    }
}

impl<const N: usize> LightPath<N> {
    /// The complete paths, once the shadow rays are traced.
    #[inline]
    pub(super) fn resolve(&self, rays: &AnyBatch) -> (Base, [Shift; N]) {
        let (value, densities) = self.base.resolve(rays);
        let shifts = std::array::from_fn(|j| match &self.offsets[j] {
            Some(connection) => {
                let (value, densities) = connection.resolve(rays);
                Shift {
                    value: value.into(),
                    densities,
                }
            }
            None => Shift::DEAD,
        });
        let base = Base {
            value: value.into(),
            densities,
        };
        (base, shifts)
    }
}

impl<const N: usize> Wavefront<N> {
    pub(super) fn light_step(&mut self, context: Context, k: u32) {
        let scene = context.scene;
        if scene.lights.is_empty() {
            return;
        }
        self.light_paths.clear();
        self.shadow.clear();
        let samplers = self.paths.iter().map(|path| path.sampler);
        sampler::draw_all(samplers, Dimension::Light(k), &mut self.numbers);
        for (path, &[u0, u1, u2, _]) in self.paths.iter().zip(&self.numbers) {
            if path.vertex.class(scene) == Class::Rough {
                let light = scene.sample_light(path.vertex.position, [u0, u1, u2]);
                let connected =
                    light.and_then(|light| connect(scene, path, &light, k, &mut self.shadow));
                self.light_paths.extend(connected);
            }
        }
        trace_any(context, &mut self.shadow, RayKind::Shadow, &mut self.counts);
        for light_path in &self.light_paths {
            let (base, shifts) = light_path.resolve(&self.shadow);
            let sample = &mut self.samples[light_path.pixel as usize];
            gather(sample, context.settings.weights, &base, &shifts);
        }
    }
}

/// Connects x_k and the offset paths' vertices to the same point on a light. `None` where the base path
/// is outside of the path space: it sees the back of the light, or the light is on a side to which
/// the surface does not scatter.
#[inline]
fn connect<const N: usize>(
    scene: &Scene,
    path: &BasePath<N>,
    light: &LightSample,
    k: u32,
    rays: &mut AnyBatch,
) -> Option<LightPath<N>> {
    let x = &path.vertex;
    let seen = seen(x, light)?;
    let wi = seen.wi;
    let eval = x.eval(scene, wi)?;
    let arriving = seen.radiance * seen.per_density;
    let x_survival = survival(scene, x, k);
    let base = Connection {
        value: path.throughput * eval.value * arriving,
        by_light: 1.0,
        by_bsdf: eval.pdf * x_survival * seen.per_density,
        ray: rays.push(&seen.ray(x, light)),
    };
    let offsets = std::array::from_fn(|j| match &path.offsets[j] {
        Offset::Dead => None,
        Offset::Connected(carried) => Some(Connection {
            value: carried.throughput * eval.value * arriving,
            by_light: carried.ratio,
            by_bsdf: carried.ratio * base.by_bsdf,
            ray: base.ray,
        }),
        Offset::Joined { wo, carried } => {
            let eval = x.eval_seen_from(scene, *wo, wi)?;
            Some(Connection {
                value: carried.throughput * eval.value * arriving,
                by_light: carried.ratio,
                by_bsdf: carried.ratio * eval.pdf * x_survival * seen.per_density,
                ray: base.ray,
            })
        }
        // The offset path is reconnected at the light itself; |T'| turns its solid angle into the base
        // path's, through the area on the light, or the direction, that they share.
        Offset::Free { vertex, carried } => {
            let seen = self::seen(vertex, light)?;
            let eval = vertex.eval(scene, seen.wi)?;
            let value = carried.throughput * eval.value * seen.radiance * seen.per_density;
            let by_bsdf = carried.ratio * eval.pdf * survival(scene, vertex, k) * seen.per_density;
            // What is not finite is dead.
            (value.is_finite() && by_bsdf.is_finite()).then(|| Connection {
                value,
                by_light: carried.ratio * relative_density(scene, light, vertex),
                by_bsdf,
                ray: rays.push(&seen.ray(vertex, light)),
            })
        }
    });
    Some(LightPath {
        pixel: path.pixel,
        base,
        offsets,
    })
}

/// A light sample as seen from a vertex.
struct Seen {
    /// Unit direction to it.
    wi: Vec3,
    radiance: Vec3,
    /// One over the density of the sample per solid angle.
    per_density: f32,
}

impl Seen {
    /// The shadow ray.
    #[inline]
    fn ray(&self, from: &Vertex, light: &LightSample) -> Ray {
        match light {
            LightSample::Surface(point) => from.ray_to(point.position, point.ng, point.offset),
            LightSample::Sky(_) => from.ray(self.wi),
        }
    }
}

/// The density with which light sampling at an offset vertex has the sample, over that at the base vertex.
#[inline]
fn relative_density(scene: &Scene, light: &LightSample, offset: &Vertex) -> f32 {
    match light {
        LightSample::Surface(point) if scene.lights.depend_on_place() => {
            scene.lights.density(point.triangle, offset.position) / point.density
        }
        _ => 1.0,
    }
}

/// A light sample as seen from a vertex; `None` at the light's back.
#[inline]
fn seen(from: &Vertex, light: &LightSample) -> Option<Seen> {
    match light {
        LightSample::Surface(point) => {
            let (wi, g) = solid_angle_per_area(from.position, point.position, point.ng)?;
            (point.ng.dot(wi) < 0.0).then(|| Seen {
                wi,
                radiance: point.radiance,
                per_density: g / point.density,
            })
        }
        LightSample::Sky(sky) => Some(Seen {
            wi: sky.direction,
            radiance: sky.radiance,
            per_density: 1.0 / sky.density,
        }),
    }
}
