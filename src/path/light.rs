//! The light step: at every rough vertex a point on a light is sampled (next event estimation), for
//! the base path and, with the same point, for its offset paths.

use super::base::{BasePaths, Block, Own};
use super::link::{by_balls, steps_aside};
use super::{Context, trace_any};
use crate::bsdf::Evals;
use crate::geometry::Seen;
use crate::gradient::{Base, Offset};
use crate::lanes::{Float, LANES, Vec3x8, lanes_of, mask_of, negative, positive};
use crate::sampler::{self, Dimension, Sampler};
use crate::scene::Scene;
use crate::scene::light_sample::LightSamplesX8;
use crate::trace::RayKind;
use crate::trace::rays::AnyBatch;
use crate::vertex::{RaysX8, VerticesX8};
use wide::f32x8;

/// The numbers for light sampling at x_k.
pub(super) fn draw<'a>(
    samplers: impl IntoIterator<Item = &'a [Sampler; LANES]>,
    k: u32,
    numbers: &mut Vec<[f32x8; 4]>,
) {
    sampler::draw_blocks(samplers, Dimension::Light(k), [0, 1, 2], numbers);
}

/// Points on lights as they are seen from vertices.
pub(super) struct SeenX8 {
    /// Unit directions to them.
    pub(super) wi: Vec3x8,
    /// What their radiance, or intensity, is multiplied by: solid angle per area there, over the density.
    factor: f32x8,
    /// One over the densities per solid angle; 0 for lights without extent, which no ray meets.
    per_density: f32x8,
    /// Where there is a light, and it is seen from its front.
    pub(super) valid: f32x8,
}

impl SeenX8 {
    #[inline(always)]
    pub(super) fn new<const DIFFUSE: bool>(
        scene: &Scene,
        from: Vec3x8,
        light: &LightSamplesX8,
    ) -> Self {
        let seen = Seen::new(from, light.position, light.ng);
        let from_front = negative(light.ng.dot(seen.direction));
        let factor = seen.solid_angle_per_area / light.density;
        let mut light_seen = SeenX8 {
            wi: seen.direction,
            factor,
            per_density: factor,
            valid: light.valid & seen.valid & from_front,
        };
        if DIFFUSE {
            return light_seen;
        }
        let points = light.punctual & !light.far;
        if points != 0 {
            let lanes = mask_of(points);
            let factor = light.per_distance_squared(scene, from, points) / light.density;
            let valid = light.valid & positive(factor) & factor.finite();
            light_seen.factor = lanes.select(factor, light_seen.factor);
            light_seen.valid = lanes.select(valid, light_seen.valid);
        }
        if light.far != 0 {
            let far = mask_of(light.far);
            light_seen.wi = Vec3x8::select(far, light.position, light_seen.wi);
            light_seen.factor = far.select(f32x8::ONE / light.density, light_seen.factor);
            light_seen.valid = far.select(light.valid, light_seen.valid);
        }
        light_seen.per_density = light_seen.factor;
        if light.punctual != 0 {
            let punctual = mask_of(light.punctual);
            light_seen.per_density = punctual.select(f32x8::ZERO, light_seen.factor);
        }
        light_seen
    }
}

/// The rays from vertices to points on lights.
#[inline(always)]
pub(super) fn shadow_rays<const DIFFUSE: bool>(
    from: &VerticesX8,
    light: &LightSamplesX8,
) -> RaysX8 {
    let rays = from.rays_to(light.position, light.ng, light.offset);
    if DIFFUSE || light.far == 0 {
        return rays;
    }
    RaysX8::select(mask_of(light.far), from.rays(light.position), rays)
}

/// Vertices x_k connected to points on lights.
pub(super) struct ConnectedX8 {
    /// Unit directions to the lights.
    wi: Vec3x8,
    /// One over the densities per solid angle, or 0.
    per_density: f32x8,
    /// What arrives from there, over the density.
    arriving: Vec3x8,
    eval: Evals<f32x8>,
    survival: f32x8,
    /// A bit for each lane with a connection. The others are outside of the path space: they see the back of the
    /// light, or the light is on a side to which the surface does not scatter.
    pub(super) valid: u32,
}

impl ConnectedX8 {
    #[inline(always)]
    pub(super) fn new<const DIFFUSE: bool>(
        scene: &Scene,
        from: &VerticesX8,
        light: &LightSamplesX8,
        k: u32,
    ) -> Self {
        let seen = SeenX8::new::<DIFFUSE>(scene, from.position, light);
        let eval = from.eval::<DIFFUSE>(scene, seen.wi);
        ConnectedX8 {
            wi: seen.wi,
            per_density: seen.per_density,
            arriving: light.radiance * seen.factor,
            eval,
            survival: from.survival(k),
            valid: (seen.valid & eval.valid).to_bitmask(),
        }
    }

    /// The values of paths that arrive at x_k with `throughput`, over the density, if nothing blocks them.
    #[inline(always)]
    pub(super) fn value(&self, throughput: Vec3x8) -> Vec3x8 {
        throughput * self.eval.value * self.arriving
    }

    /// Densities of BSDF sampling, over those of light sampling.
    #[inline(always)]
    pub(super) fn by_bsdf(&self) -> f32x8 {
        self.eval.pdf * self.survival * self.per_density
    }
}

/// Complete paths of eight pixels, but for their shadow rays.
pub(super) struct LightBlock<const N: usize> {
    base: ConnectionX8,
    offsets: [ConnectionX8; N],
}

/// Vertices connected to points on lights. Densities are over that of light sampling at the base path.
#[derive(Clone, Copy)]
struct ConnectionX8 {
    /// The paths' values over the density, if nothing blocks them.
    value: Vec3x8,
    /// Densities of light sampling, which makes blocked paths too.
    by_light: f32x8,
    /// Densities of BSDF sampling, if nothing blocks the paths; it makes no blocked ones.
    by_bsdf: f32x8,
    /// A bit for each lane with a connection.
    valid: u32,
    /// The shadow rays.
    ray: [u32; LANES],
}

impl<const N: usize> LightBlock<N> {
    const DARK: Self = Self {
        base: ConnectionX8::DARK,
        offsets: [ConnectionX8::DARK; N],
    };

    /// The complete paths, once the shadow rays are traced; a bit for each lane with one.
    #[inline(always)]
    pub(super) fn resolve(&self, rays: &AnyBatch) -> (Base<f32x8>, [Offset<f32x8>; N], u32) {
        let Offset { value, densities } = self.base.resolve(rays);
        let base = Base { value, densities };
        let mut shifts = [Offset::DEAD; N];
        for (shift, offset) in shifts.iter_mut().zip(&self.offsets) {
            *shift = offset.resolve(rays);
        }
        (base, shifts, self.base.valid)
    }
}

impl ConnectionX8 {
    const DARK: Self = Self {
        value: Vec3x8::ZERO,
        by_light: f32x8::ZERO,
        by_bsdf: f32x8::ZERO,
        valid: 0,
        ray: [0; LANES],
    };

    #[inline(always)]
    fn resolve(&self, rays: &AnyBatch) -> Offset<f32x8> {
        let free = mask_of(self.valid & !rays.blocked(&self.ray, self.valid));
        Offset {
            value: Vec3x8::select(free, self.value, Vec3x8::ZERO),
            densities: mask_of(self.valid) & (self.by_light + (free & self.by_bsdf)),
        }
    }

    /// Takes the lanes `lanes` from `other`, the shadow rays aside.
    #[inline(always)]
    fn put(&mut self, other: Self, lanes: u32) {
        let mask = mask_of(lanes);
        self.value = Vec3x8::select(mask, other.value, self.value);
        self.by_light = mask.select(other.by_light, self.by_light);
        self.by_bsdf = mask.select(other.by_bsdf, self.by_bsdf);
        self.valid |= other.valid & lanes;
    }
}

impl<const N: usize> BasePaths<N> {
    /// Samples a point on a light for each path, and gathers what comes from there.
    pub(super) fn light_step<const DIFFUSE: bool>(&mut self, context: Context, k: u32) {
        let scene = context.scene;
        if scene.lights.is_empty() {
            return;
        }
        self.shadow.clear();
        let live = self.live.iter().map(|&at| &self.blocks[at as usize]);
        draw(live.map(|block| &block.samplers), k, &mut self.numbers);
        self.lights.resize(self.live.len(), || LightBlock::DARK);
        let through_glass = !DIFFUSE && context.walks_through_glass();
        let through_balls = !DIFFUSE && context.walks_through_balls();
        self.unseen.clear();
        self.by_balls.clear();
        let own = Own {
            grid: &self.grid,
            stored: &self.own,
        };
        let steps = self.live.iter().zip(self.lights.iter_mut());
        for (index, ((&at, to), &[u0, u1, u2, _])) in steps.zip(&self.numbers).enumerate() {
            let block = &self.blocks[at as usize];
            let x = &block.vertices;
            let rough = x.rough & block.alive;
            // At surfaces of class specular other paths are aimed at lights with extent.
            let to_points = if !DIFFUSE && context.aims_at_points() {
                block.aims(&self.chains)
            } else {
                0
            };
            to.base.valid = 0;
            if rough | to_points == 0 {
                if through_glass {
                    self.unseen.push((LightSamplesX8::NONE, 0));
                }
                continue;
            }
            let lanes = rough | to_points;
            let light = scene.sample_lights::<DIFFUSE>(x.position, lanes, [u0, u1, u2]);
            let lit = rough | to_points & light.punctual;
            if through_glass {
                self.unseen.push((light, rough));
            }
            if through_balls {
                let (from, samplers) = ((x.position, k), &block.samplers);
                let found = &mut self.by_balls;
                by_balls(context, from, samplers, &light, rough, |lane, way, _| {
                    found.push((index as u32, lane, way));
                });
            }
            let to_light = ConnectedX8::new::<DIFFUSE>(scene, x, &light, k);
            to.base = ConnectionX8 {
                value: to_light.value(block.throughput),
                by_light: f32x8::ONE,
                by_bsdf: to_light.by_bsdf(),
                valid: to_light.valid & lit,
                ray: [0; LANES],
            };
            let rays = block.connect::<DIFFUSE>((scene, k), (&own, at), &light, &to_light, to);
            for lane in lanes_of(to.base.valid) {
                to.base.ray[lane] = self.shadow.push(&rays.base.lane(lane));
                for (j, connection) in to.offsets.iter_mut().enumerate() {
                    connection.ray[lane] = if rays.own[j] >> lane & 1 == 1 {
                        self.shadow.push(&rays.offsets[j].lane(lane))
                    } else {
                        to.base.ray[lane]
                    };
                }
            }
        }
        trace_any(context, &mut self.shadow, RayKind::Shadow, &mut self.counts);
        for ((at, (sampled, unseen)), light) in self
            .live
            .iter()
            .zip(&mut self.unseen)
            .zip(self.lights.iter())
        {
            let ConnectionX8 { valid, ray, .. } = &light.base;
            let seen = *unseen & valid & !self.shadow.blocked(ray, *valid);
            let from = self.blocks[*at as usize].vertices.position;
            *unseen &= !seen | steps_aside(scene, from, sampled, seen);
        }
        let weights = context.settings.weights;
        for (&at, light) in self.live.iter().zip(self.lights.iter()) {
            if light.base.valid != 0 {
                let (base, shifts, valid) = light.resolve(&self.shadow);
                self.blocks[at as usize].gather(weights, &base, &shifts, valid);
            }
        }
    }
}

/// The shadow rays of a block.
struct ShadowRays<const N: usize> {
    base: RaysX8,
    offsets: [RaysX8; N],
    /// A bit for each lane whose offset path has a ray of its own, not that of the base path.
    own: [u32; N],
}

impl<const N: usize> Block<N> {
    /// Connects the offset paths to the same points on lights.
    #[inline(always)]
    fn connect<const DIFFUSE: bool>(
        &self,
        (scene, k): (&Scene, u32),
        (own, at): (&Own<N>, u32),
        light: &LightSamplesX8,
        to_light: &ConnectedX8,
        to: &mut LightBlock<N>,
    ) -> ShadowRays<N> {
        let x = &self.vertices;
        let there = to.base.valid;
        let mut rays = ShadowRays {
            base: shadow_rays::<DIFFUSE>(x, light),
            offsets: [RaysX8::NONE; N],
            own: [0; N],
        };
        for (j, offset) in self.offsets.iter().enumerate() {
            let carried = offset.carried;
            let connection = &mut to.offsets[j];
            connection.valid = 0;
            if !DIFFUSE && offset.connected() != 0 {
                let shared = ConnectionX8 {
                    value: to_light.value(carried.throughput),
                    by_light: carried.ratio,
                    by_bsdf: carried.ratio * to.base.by_bsdf,
                    valid: there,
                    ray: [0; LANES],
                };
                connection.put(shared, offset.connected());
            }
            if offset.joined() != 0 {
                let eval = x.eval_seen_from::<DIFFUSE>(scene, offset.wo, to_light.wi);
                let joined = ConnectionX8 {
                    value: carried.throughput * eval.value * to_light.arriving,
                    by_light: carried.ratio,
                    by_bsdf: carried.ratio * eval.pdf * to_light.survival * to_light.per_density,
                    valid: eval.valid.to_bitmask() & there,
                    ray: [0; LANES],
                };
                connection.put(joined, offset.joined());
            }
            // A free offset path is reconnected at the light itself; |T'| turns its solid angle into the base path's,
            // through the area on the light, or the direction, that they share.
            if offset.free() & there != 0 {
                own.with::<DIFFUSE, _>((at, self.place), j, |y| {
                    let seen = SeenX8::new::<DIFFUSE>(scene, y.position, light);
                    let eval = y.eval::<DIFFUSE>(scene, seen.wi);
                    let value = carried.throughput * eval.value * light.radiance * seen.factor;
                    let by_bsdf = carried.ratio * eval.pdf * y.survival(k) * seen.per_density;
                    // What is not finite is dead.
                    let valid = seen.valid & eval.valid & value.is_finite() & by_bsdf.is_finite();
                    // There is no shift from where a walk would find the light to where none does.
                    let mut lanes = offset.free() & there;
                    if !DIFFUSE {
                        lanes &= !self.kinds.differ(j) | x.rough;
                    }
                    let mut by_light = carried.ratio;
                    if !DIFFUSE && scene.lights.depend_on_place() {
                        by_light *= light.relative_density(scene, y.position, lanes);
                    }
                    let free = ConnectionX8 {
                        value,
                        by_light,
                        by_bsdf,
                        valid: valid.to_bitmask() & lanes,
                        ray: [0; LANES],
                    };
                    connection.put(free, lanes);
                    rays.own[j] = free.valid;
                    rays.offsets[j] = shadow_rays::<DIFFUSE>(y, light);
                });
            }
        }
        rays
    }
}
