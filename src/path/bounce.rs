//! The bounce step: the base path scatters at x_k, its offset paths follow.

use super::arrival::{self, Arrival, Left};
use super::base::{BasePaths, Block, Own};
use super::by_light::ByLight;
use super::chain::by_microfacets;
use super::copied::CopiedChain;
use super::link::{light_end, start};
use super::manifold::{Found, Kept};
use super::{Context, Counts, trace_any, trace_closest};
use crate::gradient::{Base, Offset};
use crate::lanes::{Float, LANES, Vec3x8, lanes_of, mask_of};
use crate::sampler::{self, Dimension, Sampler};
use crate::scene::Scene;
use crate::shift::{self, CarriedX8, Death, JointsX8, ShiftedX8};
use crate::trace::RayKind;
use crate::trace::rays::{AnyBatch, ClosestBatch};
use crate::vertex::{Interaction, ROULETTE_FROM, RaysX8, ScatteringX8, VerticesX8};
use wide::f32x8;

/// The numbers for scattering at x_k; in diffuse scenes without that for the lobe, and where there is no roulette
/// without that.
pub(super) fn draw<'a, const DIFFUSE: bool>(
    samplers: impl IntoIterator<Item = &'a [Sampler; LANES]>,
    k: u32,
    numbers: &mut Vec<[f32x8; 4]>,
) {
    let dimension = Dimension::Bsdf(k);
    if !DIFFUSE {
        sampler::draw_blocks(samplers, dimension, [0, 1, 2, 3], numbers);
    } else if k < ROULETTE_FROM {
        sampler::draw_blocks(samplers, dimension, [0, 1], numbers);
    } else {
        sampler::draw_blocks(samplers, dimension, [0, 1, 3], numbers);
    }
}

/// The base paths of eight pixels between x_k and x_{k+1}.
pub(super) struct Flight<const N: usize> {
    pub(super) scattering: ScatteringX8,
    /// The rays to x_{k+1}.
    pub(super) ray: [u32; LANES],
    /// A bit for each lane that has scattered.
    pub(super) alive: u32,
    /// The lanes that go on from a surface.
    pub(super) surfaces: u32,
    /// The lanes that have reached light.
    pub(super) ends: u32,
    /// Of these the lanes that have reached the environment.
    environment: u32,
    /// What they found there.
    pub(super) radiance: Vec3x8,
    /// Density of light sampling there, over that of BSDF sampling.
    by_light: f32x8,
    /// Of `ends` the lanes whose paths a walk could have found, and of these those which one has found.
    pub(super) by_chain: u32,
    pub(super) walked: u32,
    pub(super) followers: [FollowerX8; N],
}

/// Offset paths on their way to the base paths' next vertices.
#[derive(Clone, Copy)]
pub(super) struct FollowerX8 {
    /// Density of light sampling at y_k, over that of BSDF sampling at x_k, whatever the segment to the light
    /// does. In the lanes `copies`, until it is known where they arrive: that of which the light's density per solid angle
    /// at y_k is a factor.
    by_light: f32x8,
    /// The lanes that join the base paths if these any-hit rays are free.
    pub(super) joins: u32,
    /// The lanes that follow copied half vectors along these closest-hit rays.
    pub(super) copies: u32,
    ray: [u32; LANES],
    /// The lanes that do not join, as their rays are blocked.
    pub(super) blocked: u32,
    /// The lanes that have found what their base paths found: surfaces of the same class, or light.
    pub(super) arrived: u32,
    /// This light, in the lanes `copies`.
    radiance: Vec3x8,
    /// |T'| of this scattering event.
    pub(super) jacobian: f32x8,
}

impl FollowerX8 {
    const NONE: Self = Self {
        by_light: f32x8::ZERO,
        joins: 0,
        copies: 0,
        ray: [0; LANES],
        blocked: 0,
        arrived: 0,
        radiance: Vec3x8::ZERO,
        jacobian: f32x8::ONE,
    };
}

impl<const N: usize> Flight<N> {
    pub(super) const NONE: Self = Self {
        scattering: ScatteringX8::NONE,
        ray: [0; LANES],
        alive: 0,
        surfaces: 0,
        ends: 0,
        environment: 0,
        radiance: Vec3x8::ZERO,
        by_light: f32x8::ZERO,
        by_chain: 0,
        walked: 0,
        followers: [FollowerX8::NONE; N],
    };
}

impl<const N: usize> BasePaths<N> {
    /// Samples the BSDF at x_k, and finds where that leads.
    pub(super) fn scatter<const DIFFUSE: bool>(&mut self, context: Context, k: u32) {
        self.bounce.clear();
        let live = self.live.iter().map(|&at| &self.blocks[at as usize]);
        let samplers = live.map(|block| &block.samplers);
        draw::<DIFFUSE>(samplers, k, &mut self.numbers);
        self.flights.resize(self.live.len(), || Flight::NONE);
        let steps = self.live.iter().zip(self.flights.iter_mut());
        for ((&at, flight), numbers) in steps.zip(&self.numbers) {
            let block = &self.blocks[at as usize];
            let x = &block.vertices;
            flight.scattering = x.scatter::<DIFFUSE>(context.scene, k, numbers);
            flight.alive = flight.scattering.valid & block.alive;
            if !DIFFUSE {
                flight.alive &= block.carries_light() | block.in_chain();
            }
            let rays = x.rays(flight.scattering.wi);
            for lane in lanes_of(flight.alive) {
                flight.ray[lane] = self.bounce.push(&rays.lane(lane));
            }
        }
        trace_closest(context, &mut self.bounce, RayKind::Bounce, &mut self.counts);
    }

    /// Moves the base paths to where they arrive, shifts the scattering events to their offset paths, and finds where
    /// these arrive.
    pub(super) fn follow<const DIFFUSE: bool>(&mut self, context: Context, k: u32) {
        let scene = context.scene;
        self.reconnection.clear();
        self.continuation.clear();
        let own = Own {
            grid: &self.grid,
            stored: &self.own,
        };
        self.found.clear();
        for (index, (&at, flight)) in self.live.iter().zip(self.flights.iter_mut()).enumerate() {
            let block = &mut self.blocks[at as usize];
            // Of the paths that were here before.
            (flight.by_chain, flight.walked) = (0, 0);
            let ScatteringX8 { wi, pdf, .. } = flight.scattering;
            let hits = self.bounce.hits_of(&flight.ray, flight.alive, wi);
            let rough = flight.alive & block.vertices.rough & !flight.scattering.delta;
            let mut lit = rough;
            if !DIFFUSE && context.aims {
                lit |= flight.alive & block.aims(&self.chains);
            }
            if !DIFFUSE && context.walks {
                let ScatteringX8 {
                    delta, transmits, ..
                } = flight.scattering;
                let by_microfacets = by_microfacets(&block.vertices, &flight.scattering);
                let by_microfacets = by_microfacets & flight.alive;
                let single = delta & flight.alive;
                for lane in lanes_of(block.in_chain() & (single | by_microfacets)) {
                    let copies = self.copies[block.chain[lane] as usize].iter_mut();
                    copies.for_each(|copy| copy.scatter(transmits >> lane & 1 == 1));
                }
                let event = (&block.vertices, &flight.scattering);
                self.chains
                    .scatter_all(scene, &mut block.chain, event, flight.alive);
                block
                    .kinds
                    .scatter(rough, single, transmits, by_microfacets);
            }
            let left = Left {
                from: block.vertices.position,
                pdf,
                lit,
            };
            let arrival = Arrival::new(context, k, &hits, flight.alive, left);
            flight.surfaces = arrival.surfaces;
            flight.ends = arrival.ends;
            flight.environment = arrival.ends & !hits.found;
            flight.radiance = arrival.radiance;
            flight.by_light = arrival.by_light;
            let mut next = VerticesX8::NONE;
            arrival.put::<DIFFUSE>(scene, &hits, &mut next);
            if !DIFFUSE && context.walks {
                for lane in lanes_of(arrival.ends) {
                    if let Some(chain) = self.chains.get(block.chain[lane])
                        && let Some(end) = light_end(scene, &hits, lane)
                        && let Some(through) = chain.through(scene, &end.target)
                    {
                        self.found.push(Found::new(index, lane, (end, through)));
                        flight.by_chain |= 1 << lane;
                    }
                }
                let begins = rough & arrival.surfaces & !next.rough;
                if begins != 0 {
                    let note = self.kept.len() as u32;
                    let kept = self.kept.next(|| Kept::NONE);
                    kept.set(block, &self.own[at as usize]);
                    for lane in lanes_of(begins) {
                        let (start, pdf) = (start(&block.vertices, lane, k), pdf.lane(lane));
                        let wi = wi.lane(lane);
                        block.chain[lane] = self.chains.begin(start, wi, pdf, note);
                        self.copies.push([CopiedChain::NONE; N]);
                    }
                }
                block
                    .kinds
                    .arrive(scene, &hits, arrival.surfaces, next.rough);
                let surfaces = (arrival.surfaces, next.rough);
                self.chains.arrive(scene, &mut block.chain, &hits, surfaces);
            }
            // Reconnect where x_k and x_{k+1} are rough, copy elsewhere.
            let copies = if DIFFUSE {
                0
            } else {
                !rough | arrival.surfaces & !next.rough
            };
            let following = Following {
                scene,
                k,
                at,
                own: &own,
                arrival: &arrival,
                next: &next,
                copies,
                lit,
            };
            let batches = (&mut self.reconnection, &mut self.continuation);
            flight.shift::<DIFFUSE>(block, &following, batches, &mut self.counts);
            if !DIFFUSE && context.walks {
                for lane in lanes_of(rough & block.in_chain()) {
                    let copies = &mut self.copies[block.chain[lane] as usize];
                    for (copy, offset) in copies.iter_mut().zip(&block.offsets) {
                        copy.wi = -offset.wo.lane(lane);
                    }
                }
            }
            block.throughput = flight.scattering.carry(block.throughput);
            block.vertices = next;
            block.alive = flight.surfaces;
        }
        let counts = &mut self.counts;
        trace_any(
            context,
            &mut self.reconnection,
            RayKind::Reconnection,
            counts,
        );
        trace_closest(
            context,
            &mut self.continuation,
            RayKind::Continuation,
            counts,
        );
    }

    /// Finds out which offset paths arrive where their base paths do.
    pub(super) fn land<const DIFFUSE: bool>(&mut self, context: Context) {
        for (&at, flight) in self.live.iter().zip(self.flights.iter_mut()) {
            for j in 0..N {
                let follower = &mut flight.followers[j];
                follower.blocked = self.reconnection.blocked(&follower.ray, follower.joins);
                self.counts.die(Death::Blocked, follower.blocked);
                if !DIFFUSE && follower.copies != 0 {
                    let own = &mut self.own[at as usize][j];
                    let block = &mut self.blocks[at as usize];
                    let batch = &self.continuation;
                    let copies = &mut self.copies;
                    flight.follow_to_end(
                        context,
                        (block, j),
                        batch,
                        (own, copies),
                        &mut self.counts,
                    );
                }
            }
        }
    }

    /// Moves the offset paths to the next vertices; base paths that have reached light are complete.
    pub(super) fn arrive<const DIFFUSE: bool>(&mut self, context: Context) {
        for (&at, flight) in self.live.iter().zip(self.flights.iter()) {
            let block = &mut self.blocks[at as usize];
            if flight.ends != 0 {
                let (base, shifts) = flight.complete::<DIFFUSE>(block);
                let weights = context.settings.weights;
                block.gather(weights, &base, &shifts, flight.ends & !flight.walked);
            }
            for (offset, follower) in block.offsets.iter_mut().zip(&flight.followers) {
                let joined = follower.joins & !follower.blocked;
                offset.arrive(flight.surfaces, follower.arrived, joined);
            }
        }
        self.live.retain(|&at| self.blocks[at as usize].alive != 0);
    }
}

/// What the offset paths of a block follow.
struct Following<'a, const N: usize> {
    scene: &'a Scene,
    k: u32,
    /// The block.
    at: u32,
    own: &'a Own<'a, N>,
    arrival: &'a Arrival<'a>,
    /// x_{k+1}
    next: &'a VerticesX8,
    /// A bit for each lane in which free offset paths copy the half vector.
    copies: u32,
    /// The lanes whose directions light sampling could have drawn.
    lit: u32,
}

impl<const N: usize> Flight<N> {
    /// Shifts the scattering events at x_k to the offset paths, where the base paths may still gather light.
    #[inline(always)]
    fn shift<const DIFFUSE: bool>(
        &mut self,
        block: &mut Block<N>,
        following: &Following<N>,
        (reconnection, continuation): (&mut AnyBatch, &mut ClosestBatch),
        counts: &mut Counts,
    ) {
        let &Following { scene, k, next, .. } = following;
        let ScatteringX8 { wi, pdf, delta, .. } = self.scattering;
        let goes_on = self.surfaces | self.ends;
        let x = &block.vertices;
        let joints = JointsX8::new(x.position, wi, next.position, next.ng, self.environment);
        let mut rays = [RaysX8::NONE; N];
        let mut on_their_way = 0;
        for (j, offset) in block.offsets.iter_mut().enumerate() {
            let follower = &mut self.followers[j];
            let carried = offset.carried;
            let mut moved = carried;
            // The lanes in which the shift holds, and those in which the lobe is missing.
            let (mut valid, mut no_lobe) = (0, 0);
            offset.keep(goes_on);
            follower.by_light = carried.ratio * self.by_light;

            // One direction and one density for both.
            if !DIFFUSE && offset.connected() != 0 {
                moved.throughput = self.scattering.carry(carried.throughput);
                valid |= offset.connected();
            }

            // The base path's direction, seen from elsewhere.
            if offset.joined() != 0 {
                let eval = x.eval_seen_from::<DIFFUSE>(scene, offset.wo, wi);
                let shared = carried.scatter(&eval, f32x8::ONE, pdf, x.survival(k));
                moved = CarriedX8::select(mask_of(offset.joined()), shared, moved);
                // From another side a single direction leads elsewhere.
                no_lobe |= offset.joined() & delta;
                valid |= offset.joined() & !delta & eval.valid.to_bitmask();
            }

            // A direction of its own.
            let free = offset.free();
            if free != 0 {
                let at = (following.at, block.place);
                following.own.with::<DIFFUSE, _>(at, j, |y| {
                    let shifted =
                        following.shifted::<DIFFUSE>(x, &self.scattering, &joints, free, y);
                    let eval = &shifted.eval;
                    let own = carried.scatter(eval, shifted.jacobian, pdf, y.survival(k));
                    moved = CarriedX8::select(mask_of(free), own, moved);
                    no_lobe |= free & shifted.no_lobe;
                    valid |= free & eval.valid.to_bitmask();
                    offset.wo = -shifted.wi;
                    follower.jacobian = shifted.jacobian;
                    if !DIFFUSE && scene.lights.depend_on_place() {
                        let by_light = following.arrival.by_light_from(scene, y.position, free);
                        follower.by_light = carried.ratio * by_light;
                    }
                    if !DIFFUSE && free & following.copies != 0 {
                        let spread = carried.ratio * shifted.jacobian / pdf;
                        let spread = mask_of(following.lit) & spread;
                        let copies = mask_of(free & following.copies);
                        follower.by_light = copies.select(spread, follower.by_light);
                    }
                    rays[j] = y.rays_to(next.position, next.ng, next.offset);
                    let endless = self.environment | following.copies;
                    if endless & free != 0 {
                        rays[j] = RaysX8::select(mask_of(endless), y.rays(shifted.wi), rays[j]);
                    }
                });
            }

            let finite = valid & moved.is_finite().to_bitmask();
            let alive = offset.alive();
            counts.die(Death::Lobe, alive & no_lobe);
            counts.die(Death::Side, alive & !no_lobe & !valid);
            counts.die(Death::NotFinite, valid & !finite);
            offset.carried = moved;
            offset.keep(finite);
            follower.joins = offset.free() & !following.copies;
            follower.copies = offset.free() & following.copies;
            follower.arrived = 0;
            on_their_way |= offset.free();
        }
        for lane in lanes_of(on_their_way) {
            for (follower, rays) in self.followers.iter_mut().zip(&rays) {
                if follower.joins >> lane & 1 == 1 {
                    follower.ray[lane] = reconnection.push(&rays.lane(lane));
                } else if !DIFFUSE && follower.copies >> lane & 1 == 1 {
                    follower.ray[lane] = continuation.push(&rays.lane(lane));
                }
            }
        }
    }

    /// Finds where the offset paths `j` arrive that follow copied half vectors: they must find what their base paths
    /// found, surfaces of the same class, to which `own` moves, or light.
    #[inline(never)]
    fn follow_to_end(
        &mut self,
        context: Context,
        (block, j): (&mut Block<N>, usize),
        continuation: &ClosestBatch,
        (own, chains): (&mut VerticesX8, &mut [[CopiedChain; N]]),
        counts: &mut Counts,
    ) {
        let scene = context.scene;
        let follower = &mut self.followers[j];
        let copies = follower.copies;
        let hits = continuation.hits_of(&follower.ray, copies, -block.offsets[j].wo);
        let from = own.position;
        let surfaces = arrival::meet::<false>(scene, &hits, own);

        // Where the base path goes on.
        let goes_on = copies & self.surfaces;
        let both = goes_on & surfaces;
        let mut same = both & !(own.rough ^ block.vertices.rough);
        counts.die(Death::Missed, goes_on & !surfaces);
        counts.die(Death::Class, both & !same);

        // Where it has reached light.
        let mut other_kind = 0;
        if context.walks {
            let elsewhere = block.kinds.arrive_own(scene, j, &hits, same);
            counts.die(Death::Class, elsewhere);
            same &= !elsewhere;
            for lane in lanes_of(same & block.in_chain()) {
                chains[block.chain[lane] as usize][j].arrive(scene, &hits, lane);
            }
            other_kind = block.kinds.differ(j);
            if scene.environment.map().is_none() {
                // No walk leads to the environment.
                other_kind &= !self.environment;
            }
        }
        follower.arrived = same;
        for lane in lanes_of(copies & self.ends) {
            let at_environment = self.environment >> lane & 1 == 1;
            let spread = follower.by_light.lane(lane);
            follower.by_light.set_lane(lane, 0.0);
            let end = Interaction::in_lane(scene, &hits, lane);
            let found = match end {
                Interaction::Environment(direction) if at_environment => {
                    Ok(scene.environment.radiance(direction))
                }
                Interaction::Light(light) if !at_environment && light.front => Ok(light.radiance),
                Interaction::Light(_) if !at_environment => Err(Death::Side),
                _ => Err(Death::Missed),
            };
            match found {
                Ok(_) if other_kind >> lane & 1 == 1 => counts.die(Death::Walk, 1),
                Ok(radiance) => {
                    follower.radiance.set(lane, radiance);
                    if context.aims && spread > 0.0 {
                        let (from, wi) = (from.lane(lane), hits.direction.lane(lane));
                        let by_light = ByLight::of(scene, from, &end, wi, 1.0);
                        let density = spread * by_light.density(scene, from);
                        follower.by_light.set_lane(lane, density);
                    }
                    follower.arrived |= 1 << lane;
                    if self.by_chain >> lane & 1 == 1 {
                        chains[block.chain[lane] as usize][j].end(scene, &hits, lane);
                    }
                }
                Err(death) => counts.die(death, 1),
            }
        }
    }

    /// The complete paths where base paths have reached light, in the lanes `ends`.
    #[inline(always)]
    pub(super) fn complete<const DIFFUSE: bool>(
        &self,
        block: &Block<N>,
    ) -> (Base<f32x8>, [Offset<f32x8>; N]) {
        let base = Base {
            value: block.throughput * self.radiance,
            densities: f32x8::ONE + self.by_light,
        };
        let mut shifts = [Offset::DEAD; N];
        for (j, offset) in block.offsets.iter().enumerate() {
            let follower = &self.followers[j];
            let mut radiance = self.radiance;
            if !DIFFUSE && follower.copies != 0 {
                let copies = mask_of(follower.copies);
                radiance = Vec3x8::select(copies, follower.radiance, radiance);
            }
            // Light sampling makes the blocked path too, with value 0. It makes none that copies.
            let lost = follower.blocked | follower.copies & !follower.arrived;
            let free = mask_of(offset.alive() & !lost);
            let value = offset.carried.throughput * radiance;
            let densities = (free & offset.carried.ratio) + follower.by_light;
            shifts[j] = Offset {
                value: Vec3x8::select(free, value, Vec3x8::ZERO),
                densities: mask_of(offset.alive()) & densities,
            };
        }
        (base, shifts)
    }
}

impl<const N: usize> Following<'_, N> {
    /// The directions of the offset paths at y_k (`y`) in the lanes `free`.
    #[inline(always)]
    fn shifted<const DIFFUSE: bool>(
        &self,
        x: &VerticesX8,
        scattering: &ScatteringX8,
        joints: &JointsX8,
        free: u32,
        y: &VerticesX8,
    ) -> ShiftedX8 {
        let scene = self.scene;
        if DIFFUSE || free & self.copies == 0 {
            return shift::reconnect::<DIFFUSE>(scene, joints, y);
        }
        let copied = shift::copy_half_vector(scene, x, scattering, y);
        if free & !self.copies == 0 {
            return copied;
        }
        let reconnected = shift::reconnect::<DIFFUSE>(scene, joints, y);
        ShiftedX8::select(mask_of(self.copies), copied, reconnected)
    }
}
