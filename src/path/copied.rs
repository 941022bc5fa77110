//! Chains of offset paths that copy the half vectors of their base paths' chains.
//!
//! What a walk finds has the walk's shift; all else copies. So that each shift can be undone, a copy must be one of
//! what no walk finds either: of its base path's kind, and not found by what it goes by itself.

use super::chain::{NONE, is_found};
use super::link::light_end;
use crate::lanes::{LANES, copy_bit, lanes_of, lanes_where};
use crate::manifold::{Link, Through, trail};
use crate::scene::Scene;
use crate::scene::reflectors::{Sequence, Target};
use crate::trace::rays::HitsX8;
use glam::Vec3;

/// A chain of an offset path, which copies that of its base path.
#[derive(Clone, Copy, Debug)]
pub(super) struct CopiedChain {
    /// Unit direction in which it left its rough vertex y_r.
    pub(super) wi: Vec3,
    /// Where it is.
    reflector: Option<u32>,
    triangle: u32,
    /// By which triangles it has gone, see [`trail`].
    trail: u32,
    /// By what it has been reflected; it may be others than its base path's.
    by: Sequence,
    /// Where it ends.
    end: Option<Target>,
}

impl CopiedChain {
    pub(super) const NONE: Self = Self {
        wi: Vec3::ZERO,
        reflector: None,
        triangle: 0,
        trail: 0,
        by: Sequence::NONE,
        end: None,
    };

    /// Goes on as its base path does. The normal of its microfacet, if it has one, is that of the base path's: copied.
    pub(super) fn scatter(&mut self, transmits: bool) {
        self.trail = trail(self.trail, self.triangle);
        if let Some(reflector) = self.reflector.filter(|_| !transmits) {
            // A longer one is of no kind that walks know.
            self.by = self.by.and(reflector).unwrap_or(self.by);
        }
    }

    /// Has met a surface with single directions.
    pub(super) fn arrive(&mut self, scene: &Scene, hits: &HitsX8, lane: usize) {
        self.triangle = hits.triangle[lane];
        self.reflector = scene.reflectors.of(self.triangle);
    }

    /// Has reached light.
    pub(super) fn end(&mut self, scene: &Scene, hits: &HitsX8, lane: usize) {
        self.end = light_end(scene, hits, lane).map(|end| end.target);
    }

    /// The walk that could find it from `start`, where one could find its base path's chain by `way`.
    pub(super) fn way(
        &self,
        scene: &Scene,
        start: Vec3,
        way: Through,
    ) -> Option<(Target, Through)> {
        let end = self.end?;
        let through = match way {
            Through::Ball(reflector, branch) => {
                let ball = scene.reflectors.ball(reflector)?;
                let branch = ball.branch(branch.inside, start, self.wi, &end);
                Through::Ball(reflector, branch)
            }
            Through::Passage => way,
            Through::Mirrors(_) => Through::Mirrors(self.by),
            Through::Microfacet(_, normal) => {
                Through::Microfacet(*self.by.numbers().first()?, normal)
            }
        };
        Some((end, through))
    }

    /// Whether a walk has found it.
    pub(super) fn is(&self, link: &Link) -> bool {
        is_found(link, self.wi, self.trail)
    }
}

/// The kinds of chains that began at the last rough vertices, and of the chains of offset paths that copy them. Those
/// with up to four reflections, or one by a microfacet, all of whose passages are through what does not focus, or through a ball of glass alone,
/// a walk may find.
#[derive(Clone, Copy, Debug)]
pub(super) struct Kinds<const N: usize> {
    /// The lanes of base paths that are in such chains, with no more reflections.
    single: u32,
    /// Of these the lanes that have done nothing but pass, and those that have, at least once.
    passing: u32,
    passed: u32,
    /// The lanes that have passed and then been reflected at a ball of glass, inside of it.
    reflected_in: u32,
    reflections: [u8; LANES],
    base: Barred,
    offsets: [Barred; N],
    /// The balls at which the base paths are, or [`NONE`].
    balls: [u32; LANES],
}

/// Chains that no walk finds, balls apart.
#[derive(Clone, Copy, Debug)]
struct Barred {
    /// The lanes of chains that have passed what focuses, or met what walks do not know.
    lanes: u32,
    /// The lanes of chains that are at what focuses.
    before_focus: u32,
}

impl Barred {
    const NONE: Self = Self {
        lanes: 0,
        before_focus: 0,
    };

    fn scatter(&mut self, begin: u32, transmits: u32) {
        self.lanes = (self.lanes | self.before_focus & transmits) & !begin;
    }

    fn arrive(&mut self, scene: &Scene, hits: &HitsX8, surfaces: u32) {
        self.before_focus &= !surfaces;
        for lane in lanes_of(surfaces) {
            match scene.reflectors.of(hits.triangle[lane]) {
                Some(r) => {
                    self.before_focus |= u32::from(scene.reflectors.focuses(r)) << lane;
                }
                None => self.lanes |= 1 << lane,
            }
        }
    }
}

impl<const N: usize> Kinds<N> {
    pub(super) const NONE: Self = Self {
        single: 0,
        passing: 0,
        passed: 0,
        reflected_in: 0,
        reflections: [0; LANES],
        base: Barred::NONE,
        offsets: [Barred::NONE; N],
        balls: [NONE; LANES],
    };

    /// Puts what is in lane `from` of `other` into a lane.
    pub(super) fn copy(&mut self, lane: usize, other: &Self, from: usize) {
        let put = |to: &mut u32, bits: u32| copy_bit(to, lane, bits, from);
        put(&mut self.single, other.single);
        put(&mut self.passing, other.passing);
        put(&mut self.passed, other.passed);
        put(&mut self.reflected_in, other.reflected_in);
        self.reflections[lane] = other.reflections[from];
        self.balls[lane] = other.balls[from];
        let barred = std::iter::once((&mut self.base, &other.base));
        for (to, other) in barred.chain(self.offsets.iter_mut().zip(&other.offsets)) {
            put(&mut to.lanes, other.lanes);
            put(&mut to.before_focus, other.before_focus);
        }
    }

    /// The base paths have scattered: those that `begin` leave rough vertices, others in `single` directions, of
    /// which some transmit, or by microfacets.
    pub(super) fn scatter(&mut self, begin: u32, single: u32, transmits: u32, by_microfacets: u32) {
        let reflected = self.passing & self.passed & single & !transmits;
        let at_ball = |lane: usize| self.balls[lane] != NONE;
        self.reflected_in =
            self.reflected_in & single & transmits | lanes_where(reflected, at_ball);
        self.passing = begin | self.passing & single & transmits;
        self.passed = self.passing & !begin;
        self.single = begin | self.single & (single | by_microfacets);
        for lane in lanes_of(begin) {
            self.reflections[lane] = 0;
        }
        for lane in lanes_of(self.single & !begin & !transmits) {
            // Microfacets reflect alone.
            let alone = by_microfacets >> lane & 1 == 1;
            self.reflections[lane] += if alone { Sequence::MOST as u8 } else { 1 };
            if usize::from(self.reflections[lane]) > Sequence::MOST {
                self.single &= !(1 << lane);
            }
        }
        self.base.scatter(begin, transmits);
        for offset in &mut self.offsets {
            offset.scatter(begin, transmits);
        }
    }

    /// The base paths have arrived at `surfaces`. Those that are rough end chains, also where light passes them
    /// straight.
    pub(super) fn arrive(&mut self, scene: &Scene, hits: &HitsX8, surfaces: u32, rough: u32) {
        self.single &= !(surfaces & rough);
        self.passing &= self.single;
        self.reflected_in &= self.single;
        self.base.arrive(scene, hits, surfaces & self.single);
        if !scene.reflectors.balls().is_empty() {
            for lane in lanes_of(surfaces & self.by_balls()) {
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
        self.offsets[j].arrive(scene, hits, surfaces & self.single);
        if scene.reflectors.balls().is_empty() {
            return 0;
        }
        lanes_where(surfaces & self.by_balls(), |lane| {
            ball_at(scene, hits, lane) != self.balls[lane]
        })
    }

    /// The lanes in which what has been may be the beginning of a way through a ball of glass.
    fn by_balls(&self) -> u32 {
        self.passing | self.reflected_in
    }

    /// The lanes in which a walk may find the chain of an offset path `j`, and not that of its base path, or that alone.
    pub(super) fn differ(&self, j: usize) -> u32 {
        self.single & (self.base.lanes ^ self.offsets[j].lanes)
    }
}

/// The ball of glass that a ray has met, or [`NONE`].
fn ball_at(scene: &Scene, hits: &HitsX8, lane: usize) -> u32 {
    let reflector = scene.reflectors.of(hits.triangle[lane]);
    let is_ball = |r: &u32| scene.reflectors.ball(*r).is_some();
    reflector.filter(is_ball).unwrap_or(NONE)
}
