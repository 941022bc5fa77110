//! Chains of single directions from a rough vertex to a given point on a light, or to a given direction: Newton's
//! method on the specular manifold (Jakob and Marschner 2012), by shooting. A ray leaves the vertex and goes through
//! mirrors and glass; derivatives that travel along (Igehy 1999) say by how much it misses its end, and how to turn
//! it.
//!
//! No random numbers: the same question has always the same answer. The techniques of sampling, their densities and the
//! shift all rest on that.
//!
#![doc = include_str!("chains.md")]

mod shot;
mod walk;

use crate::scene::Scene;
use crate::scene::reflectors::Target;
pub use crate::scene::reflectors::Through;
use crate::trace::rays::{AnyBatch, ClosestBatch};
use crate::trace::{RayKind, Traverse};
use glam::Vec3;
use walk::Walk;

/// Where a chain begins: at the rough vertex x_k.
#[derive(Clone, Copy, Debug)]
pub struct Start {
    /// Where it is.
    pub position: Vec3,
    /// Geometric normal.
    pub ng: Vec3,
    /// Distance by which rays start off the surface.
    pub offset: f32,
    /// Its number k in the path: Russian roulette depends on it.
    pub k: u32,
}

/// A chain s_1 … s_m between a vertex and a target.
#[derive(Clone, Copy, Debug)]
pub struct Link {
    /// Unit direction at the vertex.
    pub wi: Vec3,
    /// Unit direction in which it arrives at the target.
    pub arrival: Vec3,
    /// The product of the coefficients of its single directions.
    pub factor: Vec3,
    /// The product of the probabilities with which BSDF sampling chooses them, roulette included.
    pub probability: f32,
    /// The generalised geometry term 𝒢: solid angle at the vertex over area at the target, its cosine included; over
    /// solid angle where the target is a direction.
    pub geometry: f32,
    /// Its vertices m.
    pub vertices: u32,
    /// By which triangles it goes, see [`trail`].
    pub trail: u32,
    /// Whether nothing blocks the last segment.
    pub free: bool,
}

/// A number for the triangles by which a chain goes: that of those before, and one more.
pub fn trail(before: u32, triangle: u32) -> u32 {
    (before.rotate_left(5) ^ (triangle + 1)).wrapping_mul(0x9e37_79b9)
}

/// Why there is no chain.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Failure {
    /// There is nowhere to begin, or a ray missed what it had to meet.
    Missed,
    /// Something opaque is in the way, or curved glass.
    Opaque,
    /// Total internal reflection.
    Reflected,
    /// The target is seen from behind.
    Behind,
    /// It did not come near enough.
    Unsolved,
}

impl Failure {
    /// In words.
    pub fn describe(self) -> &'static str {
        match self {
            Failure::Missed => "a ray misses what it has to meet",
            Failure::Opaque => "something else is in the way",
            Failure::Reflected => "total internal reflection",
            Failure::Behind => "the light is seen from behind",
            Failure::Unsolved => "it does not come near enough",
        }
    }
}

/// Walks to their targets, many together: each round traces one ray of each that is under way.
#[derive(Debug, Default)]
pub struct Walks {
    asked: Vec<Question>,
    /// What has come of those that have set out: nothing yet, of those that are under way.
    ended: Vec<Ended>,
    under_way: Vec<Walk>,
    rays: ClosestBatch,
    /// Those that have arrived, with their last segments.
    arrived: Vec<(u32, u32)>,
    ends: AnyBatch,
    traced: [u64; RayKind::ALL.len()],
}

/// Where a walk begins, where it shall end, and by what it shall go.
#[derive(Clone, Copy, Debug)]
struct Question {
    start: Start,
    target: Target,
    through: Through,
}

/// What has come of a walk.
#[derive(Clone, Copy, Debug)]
struct Ended {
    result: Result<Link, Failure>,
    /// How often it has set out.
    shots: u32,
    /// Rays that it has traced, the last segment apart.
    rays: u32,
}

impl Ended {
    /// Of a walk that has set out, or has nowhere to begin.
    const NOT_YET: Self = Self {
        result: Err(Failure::Missed),
        shots: 1,
        rays: 0,
    };
}

/// So many walks are under way at once: enough to fill packets of rays, few enough to stay close at hand.
const AT_ONCE: usize = 256;

impl Walks {
    /// Forgets all walks; keeps the memory.
    pub fn clear(&mut self) {
        self.asked.clear();
        self.ended.clear();
    }

    /// Adds a walk; the result is what to ask [`Walks::link`] for.
    pub fn push(&mut self, start: Start, target: Target, through: Through) -> u32 {
        self.asked.push(Question {
            start,
            target,
            through,
        });
        self.asked.len() as u32 - 1
    }

    /// Ends the walks that have been added since the last time.
    pub fn solve(&mut self, scene: &Scene, tracer: &dyn Traverse) {
        self.ends.clear();
        self.arrived.clear();
        loop {
            self.set_out(scene);
            if self.under_way.is_empty() {
                break;
            }
            self.rays.clear();
            for walk in &self.under_way {
                self.rays.push(&walk.shot.ray());
            }
            self.traced[RayKind::Walk.index()] += self.rays.len() as u64;
            tracer.closest(&mut self.rays, RayKind::Walk);
            // From the last on, so that those that take the places of others have had their turn.
            for at in (0..self.under_way.len()).rev() {
                let walk = &mut self.under_way[at];
                if walk.advance(scene, self.rays.hit(at as u32)) {
                    continue;
                }
                let walk = self.under_way.swap_remove(at);
                if walk.ended.result.is_ok() {
                    let end = self.ends.push(&walk.shot.last(&walk.question.target));
                    self.arrived.push((walk.number, end));
                }
                self.ended[walk.number as usize] = walk.ended;
            }
        }
        if self.arrived.is_empty() {
            return;
        }
        self.traced[RayKind::Shadow.index()] += self.ends.len() as u64;
        tracer.any(&mut self.ends, RayKind::Shadow);
        for &(number, end) in &self.arrived {
            if let Ok(link) = &mut self.ended[number as usize].result {
                link.free = !self.ends.is_blocked(end);
            }
        }
    }

    /// Has as many walks set out as may be under way.
    fn set_out(&mut self, scene: &Scene) {
        while self.under_way.len() < AT_ONCE
            && let Some(question) = self.asked.get(self.ended.len())
        {
            if let Some(wi) = question.guess(scene) {
                let number = self.ended.len() as u32;
                self.under_way.push(Walk::new(number, *question, wi));
            }
            self.ended.push(Ended::NOT_YET);
        }
    }

    /// Rays traced since the last time, see [`RayKind::index`].
    pub fn take_traced(&mut self) -> [u64; RayKind::ALL.len()] {
        std::mem::take(&mut self.traced)
    }

    /// The chain of a walk that has ended.
    pub fn link(&self, walk: u32) -> Result<&Link, Failure> {
        self.ended[walk as usize].result.as_ref().map_err(|&f| f)
    }

    /// How often a walk has set out from its vertex.
    pub fn shots(&self, walk: u32) -> u32 {
        self.ended[walk as usize].shots
    }

    /// How many rays that has taken, the last segment apart.
    pub fn rays(&self, walk: u32) -> u32 {
        self.ended[walk as usize].rays
    }
}

impl Question {
    /// The unit direction in which the walk sets out, if there is one.
    fn guess(&self, scene: &Scene) -> Option<Vec3> {
        let reflectors = &scene.reflectors;
        let (from, target) = (self.start.position, &self.target);
        let guess = match self.through {
            Through::Passage => {
                let straight = || {
                    let may = reflectors.may_pass(from, target);
                    may.then(|| target.from(from).0)
                };
                reflectors.aside(from, target).or_else(straight)
            }
            Through::Mirrors(by) => reflectors.guess(&by, from, target),
            Through::Microfacet(reflector, normal) => {
                reflectors.guess_by_microfacet((reflector, normal), from, target)
            }
            Through::Ball(reflector, branch) => {
                let ball = reflectors.ball(reflector);
                ball.and_then(|ball| ball.guess(branch, from, target))
            }
        };
        guess.filter(|wi| wi.is_normalized())
    }
}
