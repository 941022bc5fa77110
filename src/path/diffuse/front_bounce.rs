//! The bounce step of base and offset paths: at x_1 offset paths are reconnected at x_2, at x_2 they take the
//! base path's direction.

use super::front::{Block, Front, OffsetX8, step};
use super::vertices::{RaysX8, VerticesX8, light_at, set};
use crate::bsdf::lambert::EvalX8;
use crate::gradient::{BaseX8, ShiftX8};
use crate::lanes::{LANES, Vec3x8, lanes_of, mask_of, positive};
use crate::path::{Context, Counts, trace_any, trace_closest};
use crate::sampler::{self, Dimension};
use crate::shift::{Death, solid_angle_per_area_x8};
use crate::trace::RayKind;
use crate::trace::rays::AnyBatch;
use wide::f32x8;

/// The base paths of eight pixels between x_k and x_{k+1}.
pub(super) struct Flight<const N: usize> {
    /// Unit directions.
    wi: Vec3x8,
    /// Their densities, roulette included.
    pdf: f32x8,
    /// f/p up to x_{k+1}.
    throughput: Vec3x8,
    /// The rays to x_{k+1}.
    ray: [u32; LANES],
    /// A bit for each lane that has scattered.
    alive: u32,
    /// x_{k+1}, also where it is on a light.
    vertices: VerticesX8,
    /// The lanes that go on from a surface.
    surfaces: u32,
    /// The lanes that have reached light.
    ends: u32,
    /// What they found there.
    radiance: Vec3x8,
    /// Density of light sampling there, over that of BSDF sampling.
    by_light: f32x8,
    followers: [FollowerX8; N],
}

/// Offset paths on their way to the base paths' next vertices.
#[derive(Clone, Copy)]
struct FollowerX8 {
    /// What they will be if their rays are free.
    offset: OffsetX8,
    /// Density of light sampling at y_k, whatever the segment to the light does.
    by_light: f32x8,
    /// The lanes that are yet to be joined to the base paths, and their rays.
    joins: u32,
    ray: [u32; LANES],
}

impl<const N: usize> Front<N> {
    pub(super) fn bounce_step(&mut self, context: Context, k: u32) {
        self.scatter(k);
        trace_closest(context, &mut self.bounce, RayKind::Bounce, &mut self.counts);
        self.follow(context, k);
        trace_any(
            context,
            &mut self.reconnection,
            RayKind::Reconnection,
            &mut self.counts,
        );
        self.arrive(context);
    }

    /// Samples the BSDF at x_k.
    fn scatter(&mut self, k: u32) {
        self.bounce.clear();
        self.flights.clear();
        let samplers = self.blocks.iter().map(|block| &block.samplers);
        sampler::draw_blocks(samplers, Dimension::Bsdf(k), &mut self.numbers);
        for (block, &[u0, u1, _, u_roulette]) in self.blocks.iter().zip(&self.numbers) {
            let x = &block.vertices;
            let survival = x.survival(k);
            let scattering = x.sample([u0, u1]);
            let eval = scattering.eval;
            let pdf = eval.pdf * survival;
            let carries_light = block
                .offsets
                .iter()
                .fold(block.throughput.is_not_zero(), |any, o| {
                    any | (mask_of(o.alive) & o.throughput.is_not_zero())
                });
            let mask = u_roulette.simd_lt(survival) & carries_light & eval.holds;
            let alive = mask.to_bitmask() & block.alive;
            let rays = x.rays(scattering.wi);
            let mut ray = [0; LANES];
            for lane in lanes_of(alive) {
                ray[lane] = self.bounce.push(&rays.lane(lane));
            }
            self.flights.push(Flight {
                wi: scattering.wi,
                pdf,
                throughput: block.throughput * eval.value * (f32x8::ONE / pdf),
                ray,
                alive,
                vertices: VerticesX8::default(),
                surfaces: 0,
                ends: 0,
                radiance: Vec3x8::ZERO,
                by_light: f32x8::ZERO,
                followers: block.offsets.map(|offset| FollowerX8 {
                    offset: OffsetX8 { alive: 0, ..offset },
                    by_light: f32x8::ZERO,
                    joins: 0,
                    ray: [0; LANES],
                }),
            });
        }
    }

    /// Finds where the base paths arrived, and shifts the scattering events to their offset paths.
    fn follow(&mut self, context: Context, k: u32) {
        let scene = context.scene;
        self.reconnection.clear();
        // At the last vertex only light counts.
        let goes_on = k + 2 <= context.settings.depth;
        for (block, flight) in self.blocks.iter().zip(&mut self.flights) {
            if flight.alive == 0 {
                continue;
            }
            let hits = self.bounce.hits_of(&flight.ray, flight.alive, flight.wi);
            let lights = hits.lights(scene);
            let mut ends = lights;
            if !scene.environment.is_black() {
                ends |= flight.alive & !hits.found;
            }
            for lane in lanes_of(ends) {
                let (from, wi) = (block.vertices.position.lane(lane), flight.wi.lane(lane));
                let pdf = flight.pdf.as_array()[lane];
                if let Some((radiance, by_light)) =
                    light_at(scene, &hits.end(scene, lane), from, wi, pdf)
                {
                    flight.radiance.set(lane, radiance);
                    set(&mut flight.by_light, lane, by_light);
                    flight.ends |= 1 << lane;
                }
            }
            flight.surfaces = if goes_on { hits.found & !lights } else { 0 };
            flight.vertices = VerticesX8::met(scene, &hits, flight.surfaces);
            if k == 1 {
                let neighbour = |j| self.grid.load(block.place, step(j, self.grid.width));
                let missed = !hits.found;
                flight.reconnect(
                    block,
                    missed,
                    neighbour,
                    &mut self.reconnection,
                    &mut self.counts,
                );
            } else {
                flight.share(block, k, &mut self.counts);
            }
        }
    }

    /// Moves the paths to their next vertices; those that reached light are complete.
    fn arrive(&mut self, context: Context) {
        for (block, flight) in self.blocks.iter_mut().zip(&self.flights) {
            let base = BaseX8 {
                value: flight.throughput * flight.radiance,
                densities: f32x8::ONE + flight.by_light,
            };
            let mut shifts = [ShiftX8::DEAD; N];
            for (j, follower) in flight.followers.iter().enumerate() {
                let OffsetX8 {
                    alive,
                    throughput,
                    ratio,
                    ..
                } = follower.offset;
                let blocked = self.reconnection.blocked(&follower.ray, follower.joins);
                self.counts.deaths[Death::Blocked as usize] += u64::from(blocked.count_ones());
                // Light sampling makes the blocked path too, with value 0.
                let free = mask_of(alive & !blocked);
                shifts[j] = ShiftX8 {
                    value: Vec3x8::select(free, throughput * flight.radiance, Vec3x8::ZERO),
                    densities: mask_of(alive) & ((free & ratio) + follower.by_light),
                };
                block.offsets[j] = OffsetX8 {
                    alive: alive & !blocked & flight.surfaces,
                    ..follower.offset
                };
            }
            if flight.ends != 0 {
                block.gather(context.settings.weights, &base, &shifts, flight.ends);
            }
            block.alive = flight.surfaces;
            block.vertices = flight.vertices.clone();
            block.throughput = flight.throughput;
        }
    }
}

impl<const N: usize> Flight<N> {
    /// Reconnects the offset paths' own vertices, which `neighbour` gives, to x_2, or lets them take the
    /// same direction where the base path has `missed` everything.
    #[inline(always)]
    fn reconnect(
        &mut self,
        block: &Block<N>,
        missed: u32,
        neighbour: impl Fn(usize) -> VerticesX8,
        reconnection: &mut AnyBatch,
        counts: &mut Counts,
    ) {
        let x = &block.vertices;
        let (position, ng, offset) = (
            self.vertices.position,
            self.vertices.ng,
            self.vertices.offset,
        );
        let environment = self.ends & missed;
        let distant = mask_of(environment);
        let (_, here, seen) = solid_angle_per_area_x8(x.position, position, ng);
        let side = ng.dot(self.wi);
        let rays: [RaysX8; N] = std::array::from_fn(|j| {
            let y = neighbour(j);
            let (direction, there, holds) = solid_angle_per_area_x8(y.position, position, ng);
            // Both must see the same side of the surface at x_2.
            let holds = seen & holds & positive(ng.dot(direction) * side);
            let direction = Vec3x8::select(distant, self.wi, direction);
            let jacobian = distant.select(f32x8::ONE, there / here);
            let eval = y.eval(direction);
            let scattered = ScatteredX8 {
                wo: -direction,
                scale: jacobian / self.pdf,
                survival: y.survival(1),
                eval: EvalX8 {
                    holds: (holds | distant) & eval.holds,
                    ..eval
                },
            };
            self.followers[j] = self.scatter(&block.offsets[j], &scattered, counts);
            let mut rays = y.rays_to(position, ng, offset);
            if environment != 0 {
                rays = RaysX8::select(distant, y.rays(self.wi), rays);
            }
            rays
        });
        let joins = self
            .followers
            .iter()
            .fold(0, |bits, f| bits | f.offset.alive);
        for follower in &mut self.followers {
            follower.joins = follower.offset.alive;
        }
        for lane in lanes_of(joins) {
            for (follower, rays) in self.followers.iter_mut().zip(&rays) {
                if follower.joins >> lane & 1 == 1 {
                    follower.ray[lane] = reconnection.push(&rays.lane(lane));
                }
            }
        }
    }

    /// Offset paths that have joined the base path at x_k take its direction.
    #[inline(always)]
    fn share(&mut self, block: &Block<N>, k: u32, counts: &mut Counts) {
        let x = &block.vertices;
        for (j, offset) in block.offsets.iter().enumerate() {
            let scattered = ScatteredX8 {
                wo: -self.wi,
                scale: f32x8::ONE / self.pdf,
                survival: x.survival(k),
                eval: x.eval_seen_from(offset.wo, self.wi),
            };
            self.followers[j] = self.scatter(offset, &scattered, counts);
        }
    }

    /// Offset paths one scattering event further, as by [`Carried::scatter`](crate::shift::Carried::scatter).
    #[inline(always)]
    fn scatter(
        &self,
        offset: &OffsetX8,
        scattered: &ScatteredX8,
        counts: &mut Counts,
    ) -> FollowerX8 {
        let ScatteredX8 {
            wo,
            scale,
            survival,
            eval,
        } = *scattered;
        let throughput = offset.throughput * eval.value * scale;
        let ratio = offset.ratio * eval.pdf * survival * scale;
        let alive = offset.alive & (self.surfaces | self.ends);
        let on_side = alive & eval.holds.to_bitmask();
        let finite = on_side & (throughput.is_finite() & ratio.is_finite()).to_bitmask();
        counts.deaths[Death::Side as usize] += u64::from((alive & !on_side).count_ones());
        counts.deaths[Death::NotFinite as usize] += u64::from((on_side & !finite).count_ones());
        FollowerX8 {
            offset: OffsetX8 {
                alive: finite,
                wo,
                throughput,
                ratio,
            },
            by_light: offset.ratio * self.by_light,
            joins: 0,
            ray: [0; LANES],
        }
    }
}

/// Scattering events of offset paths.
struct ScatteredX8 {
    /// Directions from their next vertices back.
    wo: Vec3x8,
    /// Jacobians over the base paths' densities.
    scale: f32x8,
    survival: f32x8,
    eval: EvalX8,
}
