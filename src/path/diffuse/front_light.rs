//! The light step of base and offset paths.

use super::front::{Block, Front, Stage, step};
use super::grid::Grid;
use super::vertices::{ConnectedX8, RaysX8, draw_light};
use crate::gradient::{Base, Shift};
use crate::lanes::{LANES, Vec3x8, lanes_of, mask_of};
use crate::path::{Context, trace_any};
use crate::scene::Scene;
use crate::scene::light::LightSamplesX8;
use crate::trace::RayKind;
use crate::trace::rays::AnyBatch;
use wide::f32x8;

/// Complete paths of eight pixels, but for their shadow rays.
#[derive(Clone)]
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

impl<const N: usize> LightBlock<N> {
    const DARK: Self = Self {
        base: ConnectionX8::DARK,
        offsets: [ConnectionX8::DARK; N],
    };
}

impl ConnectionX8 {
    const DARK: Self = Self {
        value: Vec3x8::ZERO,
        by_light: f32x8::ZERO,
        by_bsdf: f32x8::ZERO,
        holds: 0,
        ray: [0; LANES],
    };

    #[inline(always)]
    fn resolve(&self, rays: &AnyBatch) -> Shift<f32x8> {
        let free = mask_of(self.holds & !rays.blocked(&self.ray, self.holds));
        Shift {
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
        self.shadow.clear();
        let samplers = self.blocks.iter().map(|block| &block.samplers);
        draw_light(samplers, k, &mut self.numbers);
        self.lights.resize(self.blocks.len(), LightBlock::DARK);
        let steps = self.blocks.iter().zip(&mut self.lights);
        for ((block, connections), &[u0, u1, u2, _]) in steps.zip(&self.numbers) {
            let from = block.vertices.position;
            let light = scene.sample_lights::<true>(from, block.alive, [u0, u1, u2]);
            let to_light = block
                .vertices
                .connect::<true>(k, block.throughput, &light, scene);
            match Stage::at(k) {
                Stage::Free => {
                    let sites = Sites {
                        scene,
                        grid: &self.grid,
                        light: &light,
                    };
                    block.connect_free(&sites, &to_light, connections, &mut self.shadow);
                }
                _ => {
                    let rays = block.vertices.shadow_rays::<true>(&light);
                    block.connect_joined(k, &to_light, &rays, connections, &mut self.shadow);
                }
            }
        }
        trace_any(context, &mut self.shadow, RayKind::Shadow, &mut self.counts);
        let weights = context.settings.weights;
        for (block, connections) in self.blocks.iter_mut().zip(&self.lights) {
            let Shift { value, densities } = connections.base.resolve(&self.shadow);
            let base = Base { value, densities };
            let mut shifts = [Shift::DEAD; N];
            for (shift, offset) in shifts.iter_mut().zip(&connections.offsets) {
                *shift = offset.resolve(&self.shadow);
            }
            block.gather(weights, &base, &shifts, connections.base.holds);
        }
    }
}

/// What offset paths are connected to.
struct Sites<'a> {
    scene: &'a Scene,
    grid: &'a Grid,
    light: &'a LightSamplesX8,
}

impl<const N: usize> Block<N> {
    /// The base paths' connections, but for their rays.
    #[inline(always)]
    fn base_connection(&self, to_light: &ConnectedX8) -> ConnectionX8 {
        ConnectionX8 {
            value: to_light.value,
            by_light: f32x8::ONE,
            by_bsdf: to_light.by_bsdf,
            holds: to_light.holds & self.alive,
            ray: [0; LANES],
        }
    }

    /// Connects x_1 and the offset paths' own vertices to the same points on lights.
    #[inline(always)]
    fn connect_free(
        &self,
        &Sites { scene, grid, light }: &Sites,
        to_light: &ConnectedX8,
        to: &mut LightBlock<N>,
        shadow: &mut AnyBatch,
    ) {
        let LightBlock { base, offsets } = to;
        *base = self.base_connection(to_light);
        let base_rays = self.vertices.shadow_rays::<true>(light);
        let mut rays = [RaysX8::NONE; N];
        for (j, offset) in self.offsets.iter().enumerate() {
            let y = grid.load(self.place, step(j, grid.width));
            let seen = y.see::<true>(light);
            let eval = y.eval::<true>(scene, seen.wi);
            let value = offset.throughput * eval.value * light.radiance * seen.per_density;
            let by_bsdf = offset.ratio * eval.pdf * y.survival(1) * seen.per_density;
            // What is not finite is dead.
            let holds = seen.holds & eval.holds & value.is_finite() & by_bsdf.is_finite();
            offsets[j] = ConnectionX8 {
                value,
                by_light: offset.ratio,
                by_bsdf,
                holds: holds.to_bitmask() & offset.alive & base.holds,
                ray: [0; LANES],
            };
            rays[j] = y.shadow_rays::<true>(light);
        }
        for lane in lanes_of(base.holds) {
            base.ray[lane] = shadow.push(&base_rays.lane(lane));
            for (offset, rays) in offsets.iter_mut().zip(&rays) {
                if offset.holds >> lane & 1 == 1 {
                    offset.ray[lane] = shadow.push(&rays.lane(lane));
                }
            }
        }
    }

    /// Connects x_2, where the offset paths have joined the base path.
    #[inline(always)]
    fn connect_joined(
        &self,
        k: u32,
        to_light: &ConnectedX8,
        rays: &RaysX8,
        to: &mut LightBlock<N>,
        shadow: &mut AnyBatch,
    ) {
        let x = &self.vertices;
        let LightBlock { base, offsets } = to;
        *base = self.base_connection(to_light);
        for lane in lanes_of(base.holds) {
            base.ray[lane] = shadow.push(&rays.lane(lane));
        }
        for (connection, offset) in offsets.iter_mut().zip(&self.offsets) {
            let eval = x.eval_seen_from(offset.wo, to_light.wi);
            *connection = ConnectionX8 {
                value: offset.throughput * eval.value * to_light.arriving,
                by_light: offset.ratio,
                by_bsdf: offset.ratio * eval.pdf * x.survival(k) * to_light.per_density,
                holds: eval.holds.to_bitmask() & offset.alive & base.holds,
                ray: base.ray,
            };
        }
    }
}
