//! The bounce step of base and offset paths: at x_1 offset paths are reconnected at x_2, at x_2 they take the
//! base path's direction.

use super::arrival::{Arrival, Left};
use super::front::{Block, Front, OffsetX8, Stage, step};
use super::grid::Grid;
use super::vertices::{RaysX8, VerticesX8, draw_bsdf};
use crate::bsdf::Evals;
use crate::geometry::Seen;
use crate::gradient::{Base, Shift};
use crate::lanes::{LANES, Vec3x8, lanes_of, mask_of, positive};
use crate::path::{Context, Counts, trace_any, trace_closest};
use crate::scene::Scene;
use crate::shift::Death;
use crate::trace::RayKind;
use crate::trace::rays::AnyBatch;
use wide::f32x8;

/// The base paths of eight pixels between x_k and x_{k+1}.
#[derive(Clone)]
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
    /// Density of light sampling at y_k, over that of BSDF sampling at x_k, whatever the segment to the light
    /// does.
    by_light: f32x8,
    /// The lanes that are yet to be joined to the base paths, and their rays.
    joins: u32,
    ray: [u32; LANES],
}

impl FollowerX8 {
    const NONE: Self = Self {
        by_light: f32x8::ZERO,
        joins: 0,
        ray: [0; LANES],
    };
}

impl<const N: usize> Flight<N> {
    const NONE: Self = Self {
        wi: Vec3x8::ZERO,
        pdf: f32x8::ZERO,
        throughput: Vec3x8::ZERO,
        ray: [0; LANES],
        alive: 0,
        surfaces: 0,
        ends: 0,
        radiance: Vec3x8::ZERO,
        by_light: f32x8::ZERO,
        followers: [FollowerX8::NONE; N],
    };
}

impl<const N: usize> Front<N> {
    pub(super) fn bounce_step(&mut self, context: Context, k: u32) {
        self.scatter(context.scene, k);
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
    fn scatter(&mut self, scene: &Scene, k: u32) {
        self.bounce.clear();
        let samplers = self.blocks.iter().map(|block| &block.samplers);
        draw_bsdf::<true>(samplers, k, &mut self.numbers);
        self.flights.resize(self.blocks.len(), Flight::NONE);
        let steps = self.blocks.iter().zip(&mut self.flights);
        for ((block, flight), numbers) in steps.zip(&self.numbers) {
            let x = &block.vertices;
            // All of them carry light yet: x_1 and x_2 are not black.
            let scattering = x.scatter::<true>(scene, k, block.throughput, numbers);
            flight.wi = scattering.wi;
            flight.pdf = scattering.pdf;
            flight.throughput = scattering.throughput;
            flight.alive = scattering.holds & block.alive;
            let rays = x.rays(scattering.wi);
            for lane in lanes_of(flight.alive) {
                flight.ray[lane] = self.bounce.push(&rays.lane(lane));
            }
        }
    }

    /// Moves the base paths to where they arrive, and shifts the scattering events to their offset paths.
    fn follow(&mut self, context: Context, k: u32) {
        let scene = context.scene;
        self.reconnection.clear();
        for (block, flight) in self.blocks.iter_mut().zip(&mut self.flights) {
            let hits = self.bounce.hits_of(&flight.ray, flight.alive, flight.wi);
            let left = Left {
                from: block.vertices.position,
                pdf: flight.pdf,
                rough: flight.alive,
            };
            let arrival = Arrival::new(context, k, &hits, flight.alive, left);
            flight.surfaces = arrival.surfaces;
            flight.ends = arrival.ends;
            flight.radiance = arrival.radiance;
            flight.by_light = arrival.by_light;
            let mut next = VerticesX8::NONE;
            arrival.put::<true>(scene, &hits, &mut next);
            match Stage::at(k) {
                Stage::Free => {
                    let missed = !hits.found;
                    let rays = &mut self.reconnection;
                    let sites = Sites {
                        scene,
                        grid: &self.grid,
                        next: &next,
                        missed,
                    };
                    flight.reconnect(block, &sites, rays, &mut self.counts);
                }
                _ => flight.share(block, k, &mut self.counts),
            }
            block.vertices = next;
            block.throughput = flight.throughput;
            block.alive = flight.surfaces;
        }
    }

    /// Ends the offset paths that are blocked; base paths that reached light are complete.
    fn arrive(&mut self, context: Context) {
        for (block, flight) in self.blocks.iter_mut().zip(&self.flights) {
            let mut blocked = [0; N];
            for (j, follower) in flight.followers.iter().enumerate() {
                blocked[j] = self.reconnection.blocked(&follower.ray, follower.joins);
                self.counts.deaths[Death::Blocked as usize] += u64::from(blocked[j].count_ones());
            }
            if flight.ends != 0 {
                let base = Base {
                    value: flight.throughput * flight.radiance,
                    densities: f32x8::ONE + flight.by_light,
                };
                let mut shifts = [Shift::DEAD; N];
                for (j, offset) in block.offsets.iter().enumerate() {
                    // Light sampling makes the blocked path too, with value 0.
                    let free = mask_of(offset.alive & !blocked[j]);
                    let value = offset.throughput * flight.radiance;
                    let densities = (free & offset.ratio) + flight.followers[j].by_light;
                    shifts[j] = Shift {
                        value: Vec3x8::select(free, value, Vec3x8::ZERO),
                        densities: mask_of(offset.alive) & densities,
                    };
                }
                block.gather(context.settings.weights, &base, &shifts, flight.ends);
            }
            for (offset, blocked) in block.offsets.iter_mut().zip(blocked) {
                offset.alive &= !blocked & flight.surfaces;
            }
        }
    }
}

impl<const N: usize> Flight<N> {
    /// Reconnects the offset paths' own vertices to x_2, or lets them take the same direction where the base path
    /// has missed everything.
    #[inline(always)]
    fn reconnect(
        &mut self,
        block: &mut Block<N>,
        sites: &Sites,
        reconnection: &mut AnyBatch,
        counts: &mut Counts,
    ) {
        let Sites {
            scene,
            grid,
            next,
            missed,
        } = *sites;
        let x = &block.vertices;
        let environment = self.ends & missed;
        let distant = mask_of(environment);
        let here = Seen::new(x.position, next.position, next.ng);
        let side = next.ng.dot(self.wi);
        let mut all_rays = [RaysX8::NONE; N];
        let mut joins = 0;
        for (j, rays) in all_rays.iter_mut().enumerate() {
            let y = grid.load(block.place, step(j, grid.width));
            let there = Seen::new(y.position, next.position, next.ng);
            // Both must see the same side of the surface at x_2.
            let same_side = positive(next.ng.dot(there.direction) * side);
            let holds = here.holds & there.holds & same_side;
            let direction = Vec3x8::select(distant, self.wi, there.direction);
            let jacobian = there.solid_angle_per_area / here.solid_angle_per_area;
            let jacobian = distant.select(f32x8::ONE, jacobian);
            let mut eval = y.eval::<true>(scene, direction);
            eval.holds &= holds | distant;
            let scattered = ScatteredX8 {
                wo: -direction,
                scale: jacobian / self.pdf,
                survival: y.survival(1),
                eval,
            };
            self.shift(j, &mut block.offsets[j], &scattered, counts);
            self.followers[j].joins = block.offsets[j].alive;
            joins |= block.offsets[j].alive;
            *rays = y.rays_to(next.position, next.ng, next.offset);
            if environment != 0 {
                *rays = RaysX8::select(distant, y.rays(self.wi), *rays);
            }
        }
        for lane in lanes_of(joins) {
            for (follower, rays) in self.followers.iter_mut().zip(&all_rays) {
                if follower.joins >> lane & 1 == 1 {
                    follower.ray[lane] = reconnection.push(&rays.lane(lane));
                }
            }
        }
    }

    /// Offset paths that have joined the base path at x_k take its direction.
    #[inline(always)]
    fn share(&mut self, block: &mut Block<N>, k: u32, counts: &mut Counts) {
        let x = &block.vertices;
        for (j, offset) in block.offsets.iter_mut().enumerate() {
            let scattered = ScatteredX8 {
                wo: -self.wi,
                scale: f32x8::ONE / self.pdf,
                survival: x.survival(k),
                eval: x.eval_seen_from(offset.wo, self.wi),
            };
            self.shift(j, offset, &scattered, counts);
            self.followers[j].joins = 0;
        }
    }

    /// Takes an offset path one scattering event further, as by
    /// [`Carried::scatter`](crate::shift::Carried::scatter).
    #[inline(always)]
    fn shift(
        &mut self,
        j: usize,
        offset: &mut OffsetX8,
        scattered: &ScatteredX8,
        counts: &mut Counts,
    ) {
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
        self.followers[j].by_light = offset.ratio * self.by_light;
        *offset = OffsetX8 {
            alive: finite,
            wo,
            throughput,
            ratio,
        };
    }
}

/// What offset paths may be reconnected at.
struct Sites<'a> {
    scene: &'a Scene,
    grid: &'a Grid,
    /// x_2
    next: &'a VerticesX8,
    /// A bit for each lane whose base path has missed everything.
    missed: u32,
}

/// Scattering events of offset paths.
struct ScatteredX8 {
    /// Directions from their next vertices back.
    wo: Vec3x8,
    /// Jacobians over the base paths' densities.
    scale: f32x8,
    survival: f32x8,
    eval: Evals<f32x8>,
}
