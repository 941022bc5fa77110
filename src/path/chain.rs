//! What lies between a path's last rough vertex and where it is now, as long as these are single directions: should
//! it end on a light, this says how a walk would have found it.

use crate::lanes::{LANES, lanes_of, lanes_where};
use crate::manifold::{Link, Start, Through, trail};
use crate::scene::Scene;
use crate::scene::reflectors::{Inside, Sequence, Target};
use crate::trace::rays::HitsX8;
use crate::vertex::{ScatteringX8, VerticesX8};
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
    /// By reflections at these, and through what does not focus.
    Mirrors(Sequence),
    /// By a microfacet of this one, and through what does not focus.
    Microfacet(u32, Vec3),
    /// Into this ball of glass.
    Into(u32),
    /// And reflected inside.
    Back(u32),
    /// And out of it.
    OutOf(u32, Inside),
}

/// How a path has gone on from a surface of class specular.
#[derive(Clone, Copy, Debug)]
pub(super) enum Event {
    /// Passing, in a single direction.
    Passed,
    /// Reflected in a single direction.
    Reflected,
    /// Reflected by a microfacet with this local normal, `z` > 0.
    ByMicrofacet(Vec3),
}

impl Event {
    /// That in a lane; `None` where it spreads light, or passes through what does.
    pub(super) fn of(x: &VerticesX8, scattering: &ScatteringX8, lane: usize) -> Option<Self> {
        let is = |lanes: u32| lanes >> lane & 1 == 1;
        match (is(scattering.delta), is(scattering.transmits)) {
            (true, true) => Some(Self::Passed),
            (true, false) => Some(Self::Reflected),
            (false, _) => is(by_microfacets(x, scattering))
                .then(|| Self::ByMicrofacet(x.microfacet(scattering, lane))),
        }
    }
}

/// The lanes in which paths have been reflected by microfacets of surfaces of class specular.
pub(super) fn by_microfacets(x: &VerticesX8, scattering: &ScatteringX8) -> u32 {
    !(x.rough | scattering.delta | scattering.transmits)
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
            Gone::Nowhere | Gone::Into(_) | Gone::Back(_) => None,
            Gone::Passing => Some(Through::Passage),
            Gone::Mirrors(by) => Some(Through::Mirrors(by)),
            Gone::Microfacet(reflector, normal) => Some(Through::Microfacet(reflector, normal)),
            Gone::OutOf(reflector, inside) => {
                let ball = scene.reflectors.ball(reflector)?;
                let branch = ball.branch(inside, self.start.position, self.wi, target);
                Some(Through::Ball(reflector, branch))
            }
        }
    }

    /// Whether a walk has found this chain.
    pub(super) fn is(&self, link: &Link) -> bool {
        is_found(link, self.wi, self.trail)
    }
}

/// Whether a walk has found the chain that leaves its rough vertex in the direction `wi` and goes by `triangles`, see
/// [`trail`].
pub(super) fn is_found(link: &Link, wi: Vec3, triangles: u32) -> bool {
    // Others by the same triangles are far off. By others they may be close, as on a finely faceted ball; those
    // of one chain differ where it meets an edge, by rounding.
    let near = if link.trail == triangles {
        NEAR
    } else {
        AS_ROUNDED
    };
    link.free && link.wi.distance_squared(wi) < near * near
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

    /// The chain `at`, to change it.
    pub(super) fn get_mut(&mut self, at: u32) -> Option<&mut Chain> {
        self.list.get_mut(at as usize)
    }

    /// Of `lanes`, where paths are at surfaces that spread light a little, those that walks may not find should they reach
    /// light from there: of these light is sampled.
    pub(super) fn beyond(&self, at: &[u32; LANES], lanes: u32) -> u32 {
        lanes_where(lanes, |lane| {
            let chain = self.get(at[lane]);
            chain.is_none_or(|chain| !matches!(chain.gone, Gone::Nowhere | Gone::Passing))
        })
    }

    /// Goes on from where the chain is; the chain then, if a walk could find it.
    pub(super) fn scatter(&mut self, scene: &Scene, at: u32, event: Event) -> u32 {
        let Some(chain) = self.get_mut(at) else {
            return NONE;
        };
        let Some(reflector) = chain.reflector else {
            return NONE;
        };
        let focuses = scene.reflectors.focuses(reflector);
        chain.gone = match (chain.gone, event) {
            (Gone::Nowhere | Gone::Passing, Event::Passed) if !focuses => Gone::Passing,
            (Gone::Nowhere, Event::Passed) if scene.reflectors.ball(reflector).is_some() => {
                Gone::Into(reflector)
            }
            (Gone::Into(ball), Event::Passed) if ball == reflector => {
                Gone::OutOf(ball, Inside::Passes)
            }
            (Gone::Into(ball), Event::Reflected) if ball == reflector => Gone::Back(ball),
            (Gone::Back(ball), Event::Passed) if ball == reflector => {
                Gone::OutOf(ball, Inside::Reflected)
            }
            (so_far @ (Gone::Mirrors(_) | Gone::Microfacet(..)), Event::Passed) if !focuses => {
                so_far
            }
            (Gone::Nowhere | Gone::Passing, Event::Reflected) => {
                Gone::Mirrors(Sequence::of(reflector))
            }
            (Gone::Mirrors(so_far), Event::Reflected) => match so_far.and(reflector) {
                Some(by) => Gone::Mirrors(by),
                None => return NONE,
            },
            (Gone::Nowhere | Gone::Passing, Event::ByMicrofacet(normal)) => {
                Gone::Microfacet(reflector, normal)
            }
            _ => return NONE,
        };
        chain.trail = trail(chain.trail, chain.triangle);
        at
    }

    /// [`Chains::scatter`] in the lanes `alive`, from `x`; elsewhere there are no more chains.
    pub(super) fn scatter_all(
        &mut self,
        scene: &Scene,
        at: &mut [u32; LANES],
        (x, scattering): (&VerticesX8, &ScatteringX8),
        alive: u32,
    ) {
        for (lane, at) in at.iter_mut().enumerate() {
            let goes_on = *at != NONE && alive >> lane & 1 == 1;
            *at = match goes_on.then(|| Event::of(x, scattering, lane)) {
                Some(Some(event)) => self.scatter(scene, *at, event),
                _ => NONE,
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
