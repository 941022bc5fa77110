//! The shift: how offset paths follow their base paths, vertex by vertex (Kettunen et al. 2015,
//! section 5.2), for eight of them at once.
//!
//! Every decision is symmetric: seen from the offset path, with base and offset exchanged, it comes out
//! the same, so that T_ji(T_ij(x)) = x.
//!
//! An offset path that is still *free* goes on from y_k when the base path goes x_k → x_{k+1} in one of two ways.
//! Where x_k and x_{k+1} are rough (y_k has the class of x_k, or it would be dead) it is reconnected: y_k is joined to
//! x_{k+1}. Lights and the environment count as rough. Elsewhere y_k copies the half vector of x_k, and goes where
//! that leads.
//!
#![doc = include_str!("shift.md")]

use crate::bsdf::{Evals, Lobe, half_vector};
use crate::frame::Frame;
use crate::geometry::Seen;
use crate::lanes::{Float, Vec3x8, copy_bit, lanes_of, mask_of, positive};
use crate::scene::Scene;
use crate::vertex::{ScatteringX8, VerticesX8};
use wide::f32x8;

/// The states of offset paths, one for each of eight base paths, up to their current vertices x_k: each is free,
/// joined, connected, or dead.
#[derive(Clone, Copy, Debug)]
pub struct OffsetsX8 {
    /// Those at vertices y_k of their own.
    free: u32,
    /// Those that have just joined the base path at x_k, which they see from y_{k-1}.
    joined: u32,
    /// Those that have shared the base path's vertices and directions for a while.
    connected: u32,
    /// Unit directions from where they have left their own vertices back to these.
    pub wo: Vec3x8,
    /// What they carry.
    pub carried: CarriedX8,
}

/// What offset paths carry along, up to their current vertices, the scattering there excluded.
#[derive(Clone, Copy, Debug)]
pub struct CarriedX8 {
    /// f(y)|T'|/p(x): the offset paths' throughputs, times the Jacobian, over the base paths' densities.
    pub throughput: Vec3x8,
    /// p(y)|T'|/p(x): the densities' ratios.
    pub ratio: f32x8,
}

impl OffsetsX8 {
    /// At the primary hits, where all carry 1; a bit for each lane whose offset path has a vertex of its own.
    #[inline(always)]
    pub const fn start(free: u32) -> Self {
        Self {
            free,
            joined: 0,
            connected: 0,
            wo: Vec3x8::ZERO,
            carried: CarriedX8 {
                throughput: Vec3x8::ONE,
                ratio: f32x8::ONE,
            },
        }
    }

    /// A bit for each lane whose offset path is at a vertex of its own.
    #[inline(always)]
    pub fn free(&self) -> u32 {
        self.free
    }

    /// A bit for each lane whose offset path has just joined the base path.
    #[inline(always)]
    pub fn joined(&self) -> u32 {
        self.joined
    }

    /// A bit for each lane whose offset path shares all that follows with the base path.
    #[inline(always)]
    pub fn connected(&self) -> u32 {
        self.connected
    }

    /// A bit for each lane whose shift holds.
    #[inline(always)]
    pub fn alive(&self) -> u32 {
        self.free | self.joined | self.connected
    }

    /// At the next vertices: the lanes `copied` have followed half vectors to vertices of their own, `reconnected`
    /// have joined the base paths, what was joined shares the base paths' directions; all in `lanes`, else dead.
    #[inline(always)]
    pub fn arrive(&mut self, lanes: u32, copied: u32, reconnected: u32) {
        let (free, shared) = (self.free, self.joined | self.connected);
        self.free = free & copied & lanes;
        self.joined = free & reconnected & !copied & lanes;
        self.connected = shared & lanes;
    }

    /// Puts the offset path in lane `from` of `other` into a lane.
    #[inline(always)]
    pub fn copy(&mut self, lane: usize, other: &Self, from: usize) {
        copy_bit(&mut self.free, lane, other.free, from);
        copy_bit(&mut self.joined, lane, other.joined, from);
        copy_bit(&mut self.connected, lane, other.connected, from);
        self.wo.set(lane, other.wo.lane(from));
        let (to, other) = (&mut self.carried, &other.carried);
        to.throughput.set(lane, other.throughput.lane(from));
        to.ratio.set_lane(lane, other.ratio.lane(from));
    }

    /// Ends the offset paths that are not in `lanes`.
    #[inline(always)]
    pub fn keep(&mut self, lanes: u32) {
        self.free &= lanes;
        self.joined &= lanes;
        self.connected &= lanes;
    }
}

impl CarriedX8 {
    /// One scattering event further. `eval` is the offset paths', `jacobian` that of the shift of their
    /// directions, `pdf` the base paths' densities with their roulette, `survival` the offset paths'.
    #[inline(always)]
    pub fn scatter(
        &self,
        eval: &Evals<f32x8>,
        jacobian: f32x8,
        pdf: f32x8,
        survival: f32x8,
    ) -> Self {
        let scale = jacobian / pdf;
        Self {
            throughput: self.throughput * eval.value * scale,
            ratio: self.ratio * eval.pdf * survival * scale,
        }
    }

    /// Where all of it is finite.
    #[inline(always)]
    pub fn is_finite(&self) -> f32x8 {
        self.throughput.is_finite() & self.ratio.is_finite()
    }

    /// Lanes of `a` where `mask` is set, of `b` elsewhere.
    #[inline(always)]
    pub fn select(mask: f32x8, a: Self, b: Self) -> Self {
        Self {
            throughput: Vec3x8::select(mask, a.throughput, b.throughput),
            ratio: mask.select(a.ratio, b.ratio),
        }
    }
}

/// Why a shift failed; for the statistics.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Death {
    /// A ray hits nothing, or a light, where the other path's hits a surface.
    Missed,
    /// The classes of the two vertices differ.
    Class,
    /// The reconnection is blocked.
    Blocked,
    /// A direction lies on the other side of a surface, or of a light.
    Side,
    /// The lobe does not exist at the offset vertex, or there is total internal reflection.
    Lobe,
    /// A value is not finite.
    NotFinite,
    /// There is no chain of single directions to the light.
    Walk,
}

impl Death {
    /// All reasons, in the order of their numbers.
    pub const ALL: [Death; 7] = [
        Death::Missed,
        Death::Class,
        Death::Blocked,
        Death::Side,
        Death::Lobe,
        Death::NotFinite,
        Death::Walk,
    ];

    /// Lower-case name.
    pub fn name(self) -> &'static str {
        [
            "missed",
            "class",
            "blocked",
            "side",
            "lobe",
            "not_finite",
            "walk",
        ][self as usize]
    }
}

/// Directions of offset paths at y_k, before it is known whether the way is free.
#[derive(Clone, Copy, Debug)]
pub struct ShiftedX8 {
    /// Unit directions at y_k in the world.
    pub wi: Vec3x8,
    /// The offset paths' BSDFs with the cosines, and their densities; where it does not hold the shift has failed, by
    /// [`Death::Side`] or [`Death::Lobe`].
    pub eval: Evals<f32x8>,
    /// |T'| of these directions, solid angle at y_k over solid angle at x_k.
    pub jacobian: f32x8,
    /// A bit for each lane that has failed by [`Death::Lobe`].
    pub no_lobe: u32,
}

impl ShiftedX8 {
    /// Lanes of `a` where `mask` is set, of `b` elsewhere.
    #[inline(always)]
    pub fn select(mask: f32x8, a: Self, b: Self) -> Self {
        let bits = mask.to_bitmask();
        Self {
            wi: Vec3x8::select(mask, a.wi, b.wi),
            eval: Evals::select(mask, a.eval, b.eval),
            jacobian: mask.select(a.jacobian, b.jacobian),
            no_lobe: a.no_lobe & bits | b.no_lobe & !bits,
        }
    }
}

/// Where offset paths may join base paths that go on from x_k in the directions `wi`: at x_{k+1}, or in the
/// environment.
#[derive(Clone, Copy, Debug)]
pub struct JointsX8 {
    /// The points x_{k+1}.
    pub position: Vec3x8,
    /// Geometric normals of their surfaces.
    pub ng: Vec3x8,
    /// The base paths' directions.
    wi: Vec3x8,
    /// As they are seen from x_k.
    here: Seen<f32x8>,
    /// A bit for each lane whose base path goes to the environment.
    pub distant: u32,
}

impl JointsX8 {
    /// The points `position` on surfaces with normals `ng`, which the base paths reached from `from` in the directions
    /// `wi`; in the lanes `distant` they reached the environment.
    #[inline(always)]
    pub fn new(from: Vec3x8, wi: Vec3x8, position: Vec3x8, ng: Vec3x8, distant: u32) -> Self {
        Self {
            position,
            ng,
            wi,
            // A point in the surface's own plane sees neither side of it.
            here: Seen::new(from, position, ng),
            distant,
        }
    }
}

/// Reconnects y_k to x_{k+1}: |T'| = (cosθ'/cosθ)(|x_k - x_{k+1}|²/|y_k - x_{k+1}|²). The environment is reached in
/// the same direction: |T'| = 1.
#[inline(always)]
pub fn reconnect<const DIFFUSE: bool>(
    scene: &Scene,
    joints: &JointsX8,
    y: &VerticesX8,
) -> ShiftedX8 {
    let &JointsX8 {
        position,
        ng,
        wi,
        here,
        distant,
    } = joints;
    let distant = mask_of(distant);
    let there = Seen::new(y.position, position, ng);
    // Both must see the same side of the surface at x_{k+1}.
    let same_side = positive(ng.dot(there.direction) * ng.dot(wi));
    let direction = Vec3x8::select(distant, wi, there.direction);
    let mut eval = y.eval::<DIFFUSE>(scene, direction);
    eval.valid &= (here.valid & there.valid & same_side) | distant;
    let jacobian = there.solid_angle_per_area / here.solid_angle_per_area;
    ShiftedX8 {
        wi: direction,
        eval,
        jacobian: distant.select(f32x8::ONE, jacobian),
        no_lobe: 0,
    }
}

/// Copies the half vectors of the scattering events at x_k to y_k, frame to frame. Single directions have |T'| = 1,
/// the probability of their choice being inside the densities.
#[inline(never)]
pub fn copy_half_vector(
    scene: &Scene,
    x: &VerticesX8,
    scattering: &ScatteringX8,
    y: &VerticesX8,
) -> ShiftedX8 {
    let (x_frame, y_frame) = (Frame::new(x.normal), Frame::new(y.normal));
    let (x_wo, y_wo) = (x_frame.to_local(x.wo()), y_frame.to_local(y.wo()));
    let (transmits, delta) = (mask_of(scattering.transmits), mask_of(scattering.delta));
    let (x_ior, y_ior) = (indices(scene, x), indices(scene, y));
    // Inside stays inside.
    let same_side = positive(x_wo.z * y_wo.z);

    // The half vectors; that of a single direction is the normal.
    let (h, there) = half_vector::from_directions(x_ior, x_wo, scattering.local_wi);
    let up = Vec3x8::new(f32x8::ZERO, f32x8::ZERO, f32x8::ONE.signed_as(y_wo.z));
    let carried = Vec3x8::select(delta, up, h);

    // Where they lead, and what the surface at y_k does with it. A single direction stays one.
    let (local_wi, leads) = half_vector::to_direction(transmits, y_ior, y_wo, carried);
    let mut eval = y.eval_local(scene, y_wo, local_wi);
    let mut jacobian = half_vector::jacobian(transmits, y_ior, y_wo, local_wi, h)
        / half_vector::jacobian(transmits, x_ior, x_wo, scattering.local_wi, h);
    if scattering.delta != 0 {
        eval = Evals::select(delta, y.eval_delta(scene, y_wo, transmits), eval);
        jacobian = delta.select(f32x8::ONE, jacobian);
    }
    let has = mask_of(lanes_with(scene, y, scattering.transmits));
    let has = has & (there | delta) & leads & eval.valid;

    let wi = y_frame.to_world(local_wi).normalize();
    let agree = y.agree(wi, local_wi.z) & y.agree(y.wo(), y_wo.z);
    eval.valid = same_side & has & agree;
    ShiftedX8 {
        wi,
        eval,
        jacobian,
        no_lobe: (same_side & !has).to_bitmask(),
    }
}

/// The refractive indices of surfaces, inside over outside.
#[inline(always)]
fn indices(scene: &Scene, vertices: &VerticesX8) -> f32x8 {
    f32x8::from_lanes(|lane| vertices.bsdf(scene, lane).ior())
}

/// A bit for each lane whose surface has the lobe: transmission in the lanes `transmits`, else reflection.
#[inline(always)]
fn lanes_with(scene: &Scene, vertices: &VerticesX8, transmits: u32) -> u32 {
    let has = |lane: usize| vertices.bsdf(scene, lane).has(Lobe::Transmission);
    lanes_of(transmits).fold(!transmits, |bits, lane| bits | u32::from(has(lane)) << lane)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Tables of counts go by these numbers.
    #[test]
    fn deaths_are_numbered_in_order() {
        for (index, death) in Death::ALL.into_iter().enumerate() {
            assert_eq!(death as usize, index);
        }
    }

    /// Whatever is asked for, an offset path is in one state.
    #[test]
    fn states_exclude_each_other() {
        let mut rng = 1u32;
        let mut bits = || {
            rng = rng.wrapping_mul(1_664_525).wrapping_add(1_013_904_223);
            rng >> 24
        };
        for _ in 0..1000 {
            let mut offsets = OffsetsX8::start(bits());
            for _ in 0..4 {
                let before = offsets.alive();
                offsets.arrive(bits(), bits(), bits());
                let states = [offsets.free, offsets.joined, offsets.connected];
                let sum: u32 = states.iter().map(|s| s.count_ones()).sum();
                assert_eq!(sum, offsets.alive().count_ones());
                assert_eq!(offsets.alive() & !before, 0, "the dead stay dead");
            }
        }
    }
}
