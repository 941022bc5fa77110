//! What lies between a path's last rough vertex and where it is now, as long as these are single directions: should
//! it end on a light, this says how a walk would have found it.

use crate::lanes::{LANES, lanes_of};
use crate::manifold::{Link, Start, Through, trail};
use crate::scene::Scene;
use crate::scene::reflectors::{Sequence, Target};
use crate::trace::rays::HitsX8;
use crate::vertex::ScatteringX8;
use glam::Vec3;

/// In place of the number of a chain: none.
pub(super) const NONE: u32 = u32::MAX;

/// A chain so far.
#[derive(Clone, Copy, Debug)]
pub(super) struct Chain {
    /// The rough vertex x_r.
    pub(super) start: Start,
    /// Unit direction in which it was left.
    pub(super) wi: Vec3,
    /// Density of that direction, roulette included.
    pub(super) pdf: f32,
    /// What else is known of x_r: a number for whoever began the chain.
    pub(super) note: u32,
    gone: Gone,
    /// The reflector at which it is, and the triangle.
    reflector: Option<u32>,
    triangle: u32,
    /// By which triangles it has gone, see [`trail`].
    trail: u32,
}

/// By what a chain has gone.
#[derive(Clone, Copy, Debug)]
enum Gone {
    /// It has not scattered yet.
    Nowhere,
    /// Through what does not focus.
    Passing,
    /// By reflections alone.
    Mirrors(Sequence),
    /// Into this ball of glass.
    Into(u32),
    /// And out of it.
    OutOf(u32),
}

/// The chains of the paths of a tile.
#[derive(Debug, Default)]
pub(super) struct Chains {
    list: Vec<Chain>,
}

impl Chain {
    /// By what a walk could have found it, if it ends at `target`.
    pub(super) fn through(&self, scene: &Scene, target: &Target) -> Option<Through> {
        match self.gone {
            Gone::Nowhere | Gone::Into(_) => None,
            Gone::Passing => Some(Through::Passage),
            Gone::Mirrors(by) => Some(Through::Mirrors(by)),
            Gone::OutOf(reflector) => {
                let ball = scene.reflectors.ball(reflector)?;
                let branch = ball.branch(self.start.position, self.wi, target);
                Some(Through::Ball(reflector, branch))
            }
        }
    }

    /// Whether a walk has found this chain.
    pub(super) fn is(&self, link: &Link) -> bool {
        // Others by the same triangles are far off. By others they may be close, as on a finely faceted ball; those
        // of one chain differ where it meets an edge, by rounding.
        let near = if link.trail == self.trail {
            NEAR
        } else {
            AS_ROUNDED
        };
        link.free && link.wi.distance_squared(self.wi) < near * near
    }
}

/// Chains by the same triangles are the same whose first directions differ by no more than this: by as much as
/// what a walk may miss is of a wide view that curved mirrors make narrow.
const NEAR: f32 = 2e-3;
/// Chains are the same whose first directions differ by no more than rounding.
const AS_ROUNDED: f32 = 5e-5;

impl Chains {
    /// Forgets all chains.
    pub(super) fn clear(&mut self) {
        self.list.clear();
    }

    /// Begins a chain.
    pub(super) fn begin(&mut self, start: Start, wi: Vec3, pdf: f32, note: u32) -> u32 {
        self.list.push(Chain {
            start,
            wi,
            pdf,
            note,
            gone: Gone::Nowhere,
            reflector: None,
            triangle: 0,
            trail: 0,
        });
        (self.list.len() - 1) as u32
    }

    /// The chain `at`, if it is one.
    pub(super) fn get(&self, at: u32) -> Option<&Chain> {
        self.list.get(at as usize)
    }

    /// Goes on from where the chain is, in a single direction; the chain then, if a walk could find it.
    pub(super) fn scatter(&mut self, scene: &Scene, at: u32, transmits: bool) -> u32 {
        let Some(chain) = self.list.get_mut(at as usize) else {
            return NONE;
        };
        let Some(reflector) = chain.reflector else {
            return NONE;
        };
        let focuses = scene.reflectors.focuses(reflector);
        chain.gone = match (chain.gone, transmits) {
            (Gone::Nowhere | Gone::Passing, true) if !focuses => Gone::Passing,
            (Gone::Nowhere, true) if scene.reflectors.ball(reflector).is_some() => {
                Gone::Into(reflector)
            }
            (Gone::Into(ball), true) if ball == reflector => Gone::OutOf(ball),
            (Gone::Nowhere, false) => Gone::Mirrors(Sequence::of(reflector)),
            (Gone::Mirrors(so_far), false) => match so_far.and(reflector) {
                Some(by) => Gone::Mirrors(by),
                None => return NONE,
            },
            _ => return NONE,
        };
        chain.trail = trail(chain.trail, chain.triangle);
        at
    }

    /// [`Chains::scatter`] in the lanes `alive`; elsewhere there are no more chains.
    pub(super) fn scatter_all(
        &mut self,
        scene: &Scene,
        at: &mut [u32; LANES],
        scattering: &ScatteringX8,
        alive: u32,
    ) {
        for (lane, at) in at.iter_mut().enumerate() {
            let single = alive & scattering.delta;
            *at = if *at != NONE && single >> lane & 1 == 1 {
                self.scatter(scene, *at, scattering.transmits >> lane & 1 == 1)
            } else {
                NONE
            };
        }
    }

    /// Moves the chains `at` to what they have hit. They end at the surfaces `surfaces` that are
    /// rough or spread light.
    pub(super) fn arrive(
        &mut self,
        scene: &Scene,
        at: &mut [u32; LANES],
        hits: &HitsX8,
        (surfaces, rough): (u32, u32),
    ) {
        for lane in lanes_of(surfaces) {
            if at[lane] == NONE {
                continue;
            }
            let reflector = scene.reflectors.of(hits.triangle[lane]);
            if rough >> lane & 1 == 1 || reflector.is_none() {
                at[lane] = NONE;
            } else {
                let chain = &mut self.list[at[lane] as usize];
                (chain.reflector, chain.triangle) = (reflector, hits.triangle[lane]);
            }
        }
    }
}

/// Of paths that have done nothing but pass since their last rough vertices: what they have met that focuses. Those that
/// have met nothing, or a ball of glass alone, are a walk's, with the walk's shift; the others copy half vectors. A copy
/// must be of its base path's kind, or the shift could not be undone.
#[derive(Clone, Copy, Debug)]
pub(super) struct Passages<const N: usize> {
    /// The lanes of base paths that have done nothing but pass.
    passing: u32,
    /// The lanes in which something focuses.
    focused: u32,
    /// The same of the offset paths.
    offsets: [u32; N],
    /// The balls at which the base paths are, or [`NONE`].
    balls: [u32; LANES],
}

impl<const N: usize> Passages<N> {
    pub(super) const NONE: Self = Self {
        passing: 0,
        focused: 0,
        offsets: [0; N],
        balls: [NONE; LANES],
    };

    /// The base paths have scattered: those that `begin` leave rough vertices, those that `pass` go on as before.
    pub(super) fn scatter(&mut self, begin: u32, pass: u32) {
        self.passing = begin | self.passing & pass;
        self.focused &= !begin;
        self.offsets.iter_mut().for_each(|bits| *bits &= !begin);
    }

    /// The base paths have arrived at `surfaces`. Those that are rough end chains, also where light passes them
    /// straight.
    pub(super) fn arrive(&mut self, scene: &Scene, hits: &HitsX8, surfaces: u32, rough: u32) {
        self.passing &= !(surfaces & rough);
        self.focused |= focusing(scene, hits, surfaces & self.passing);
        if !scene.reflectors.balls().is_empty() {
            for lane in lanes_of(surfaces & self.passing) {
                self.balls[lane] = ball_at(scene, hits, lane);
            }
        }
    }

    /// The offset paths `j` have arrived at `surfaces`; the lanes in which they are at another ball than their base
    /// paths, or one of the two is at none.
    pub(super) fn arrive_own(
        &mut self,
        scene: &Scene,
        j: usize,
        hits: &HitsX8,
        surfaces: u32,
    ) -> u32 {
        self.offsets[j] |= focusing(scene, hits, surfaces & self.passing);
        if scene.reflectors.balls().is_empty() {
            return 0;
        }
        let elsewhere = |lane: &usize| ball_at(scene, hits, *lane) != self.balls[*lane];
        lanes_of(surfaces & self.passing)
            .filter(elsewhere)
            .fold(0, |bits, lane| bits | 1 << lane)
    }

    /// The lanes in which an offset path `j` has met nothing that focuses, and its base path has.
    pub(super) fn spared_alone(&self, j: usize) -> u32 {
        self.passing & self.focused & !self.offsets[j]
    }
}

/// The ball of glass that a ray has met, or [`NONE`].
fn ball_at(scene: &Scene, hits: &HitsX8, lane: usize) -> u32 {
    let reflector = scene.reflectors.of(hits.triangle[lane]);
    let is_ball = |r: &u32| scene.reflectors.ball(*r).is_some();
    reflector.filter(is_ball).unwrap_or(NONE)
}

/// The lanes of `surfaces` in which these focus what passes.
fn focusing(scene: &Scene, hits: &HitsX8, surfaces: u32) -> u32 {
    let focuses = |lane: &usize| {
        let reflector = scene.reflectors.of(hits.triangle[*lane]);
        reflector.is_some_and(|r| scene.reflectors.focuses(r))
    };
    lanes_of(surfaces)
        .filter(focuses)
        .fold(0, |bits, lane| bits | 1 << lane)
}
