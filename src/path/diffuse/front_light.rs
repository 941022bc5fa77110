//! The light step of base and offset paths.

use super::front::{Block, Front, OffsetX8, step};
use super::vertices::VerticesX8;
use crate::gradient::{BaseX8, ShiftX8};
use crate::lanes::{LANES, Vec3x8, lanes_of, mask_of};
use crate::path::{Context, trace_any};
use crate::sampler::{self, Dimension};
use crate::scene::light::LightSamplesX8;
use crate::trace::RayKind;
use crate::trace::rays::AnyBatch;
use wide::f32x8;

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
    /// Densities of BSDF sampling, if nothing blocks the paths.
    by_bsdf: f32x8,
    /// A bit for each lane with a connection.
    holds: u32,
    /// The shadow rays.
    ray: [u32; LANES],
}

impl ConnectionX8 {
    #[inline(always)]
    fn resolve(&self, rays: &AnyBatch) -> ShiftX8 {
        let free = mask_of(self.holds & !rays.blocked(&self.ray, self.holds));
        ShiftX8 {
            value: Vec3x8::select(free, self.value, Vec3x8::ZERO),
            densities: mask_of(self.holds) & (self.by_light + (free & self.by_bsdf)),
        }
    }
}

impl<const N: usize> Front<N> {
    pub(super) fn light_step(&mut self, context: Context, k: u32) {
        let scene = context.scene;
        if scene.lights.is_empty() {
            return;
        }
        self.lights.clear();
        self.shadow.clear();
        let samplers = self.blocks.iter().map(|block| &block.samplers);
        sampler::draw_blocks(samplers, Dimension::Light(k), &mut self.numbers);
        for (block, &[u0, u1, u2, _]) in self.blocks.iter().zip(&self.numbers) {
            let light = scene.sample_lights([u0, u1, u2]);
            let neighbour = |j| self.grid.load(block.place, step(j, self.grid.width));
            let step = match k {
                1 => block.connect_free(&light, neighbour, &mut self.shadow),
                _ => block.connect_joined(&light, k, &mut self.shadow),
            };
            self.lights.push(step);
        }
        trace_any(context, &mut self.shadow, RayKind::Shadow, &mut self.counts);
        let weights = context.settings.weights;
        for (block, light) in self.blocks.iter_mut().zip(&self.lights) {
            let ShiftX8 { value, densities } = light.base.resolve(&self.shadow);
            let shifts = light.offsets.each_ref().map(|c| c.resolve(&self.shadow));
            let base = BaseX8 { value, densities };
            block.gather(weights, &base, &shifts, light.base.holds);
        }
    }
}

impl<const N: usize> Block<N> {
    /// The base paths' connections, without their rays, and what they share with the offset paths: directions
    /// to the light, what arrives from there, and one over the density.
    #[inline(always)]
    fn connect_base(
        &self,
        light: &LightSamplesX8,
        k: u32,
    ) -> (ConnectionX8, Vec3x8, Vec3x8, f32x8) {
        let x = &self.vertices;
        let seen = x.see(light);
        let eval = x.eval(seen.wi);
        let arriving = light.radiance * seen.per_density;
        let base = ConnectionX8 {
            value: self.throughput * eval.value * arriving,
            by_light: f32x8::ONE,
            by_bsdf: eval.pdf * x.survival(k) * seen.per_density,
            holds: (seen.holds & eval.holds).to_bitmask() & self.alive,
            ray: [0; LANES],
        };
        (base, seen.wi, arriving, seen.per_density)
    }

    /// Connects x_1 and the offset paths' own vertices, which `neighbour` gives, to the same points on lights.
    #[inline(always)]
    fn connect_free(
        &self,
        light: &LightSamplesX8,
        neighbour: impl Fn(usize) -> VerticesX8,
        shadow: &mut AnyBatch,
    ) -> LightBlock<N> {
        let (mut base, ..) = self.connect_base(light, 1);
        let to_light = |from: &VerticesX8| from.rays_to(light.position, light.ng, light.offset);
        let base_rays = to_light(&self.vertices);
        let vertices: [VerticesX8; N] = std::array::from_fn(neighbour);
        let rays = vertices.each_ref().map(to_light);
        let mut offsets = std::array::from_fn(|j| {
            let OffsetX8 {
                alive,
                throughput,
                ratio,
                ..
            } = self.offsets[j];
            let y = &vertices[j];
            let seen = y.see(light);
            let eval = y.eval(seen.wi);
            let value = throughput * eval.value * light.radiance * seen.per_density;
            let by_bsdf = ratio * eval.pdf * y.survival(1) * seen.per_density;
            // What is not finite is dead.
            let holds = seen.holds & eval.holds & value.is_finite() & by_bsdf.is_finite();
            ConnectionX8 {
                value,
                by_light: ratio,
                by_bsdf,
                holds: holds.to_bitmask() & alive & base.holds,
                ray: [0; LANES],
            }
        });
        for lane in lanes_of(base.holds) {
            base.ray[lane] = shadow.push(&base_rays.lane(lane));
            for (offset, rays) in offsets.iter_mut().zip(&rays) {
                if offset.holds >> lane & 1 == 1 {
                    offset.ray[lane] = shadow.push(&rays.lane(lane));
                }
            }
        }
        LightBlock { base, offsets }
    }

    /// Connects x_2, where the offset paths have joined the base path.
    #[inline(always)]
    fn connect_joined(
        &self,
        light: &LightSamplesX8,
        k: u32,
        shadow: &mut AnyBatch,
    ) -> LightBlock<N> {
        let x = &self.vertices;
        let (mut base, wi, arriving, per_density) = self.connect_base(light, k);
        let rays = x.rays_to(light.position, light.ng, light.offset);
        for lane in lanes_of(base.holds) {
            base.ray[lane] = shadow.push(&rays.lane(lane));
        }
        let offsets = self.offsets.each_ref().map(|offset| {
            let eval = x.eval_seen_from(offset.wo, wi);
            ConnectionX8 {
                value: offset.throughput * eval.value * arriving,
                by_light: offset.ratio,
                by_bsdf: offset.ratio * eval.pdf * x.survival(k) * per_density,
                holds: eval.holds.to_bitmask() & offset.alive & base.holds,
                ray: base.ray,
            }
        });
        LightBlock { base, offsets }
    }
}
