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
    walks: Vec<Walk>,
    under_way: Vec<u32>,
    rays: ClosestBatch,
    /// Those that have arrived, and their last segments.
    arrived: Vec<u32>,
    ends: AnyBatch,
    traced: [u64; RayKind::ALL.len()],
}

impl Walks {
    /// Forgets all walks; keeps the memory.
    pub fn clear(&mut self) {
        self.walks.clear();
    }

    /// Adds a walk; the result is what to ask [`Walks::link`] for.
    pub fn push(&mut self, scene: &Scene, start: Start, target: Target, through: Through) -> u32 {
        let guess = match through {
            Through::Passage => {
                let there = || target.from(start.position).0;
                let may = scene.reflectors.may_pass(start.position, &target);
                may.then(there)
            }
            Through::Mirrors(by) => scene.reflectors.guess(&by, start.position, &target),
            Through::Microfacet(reflector, normal) => {
                let by = (reflector, normal);
                let reflectors = &scene.reflectors;
                reflectors.guess_by_microfacet(by, start.position, &target)
            }
            Through::Ball(reflector, branch) => {
                let ball = scene.reflectors.ball(reflector);
                ball.and_then(|ball| ball.guess(branch, start.position, &target))
            }
        };
        let guess = guess.filter(|wi| wi.is_normalized());
        let index = self.walks.len() as u32;
        if guess.is_some() {
            self.under_way.push(index);
        }
        self.walks.push(Walk::new(start, target, through, guess));
        index
    }

    /// Ends the walks that have been added since the last time.
    pub fn solve(&mut self, scene: &Scene, tracer: &dyn Traverse) {
        self.ends.clear();
        self.arrived.clear();
        while !self.under_way.is_empty() {
            self.rays.clear();
            for &index in &self.under_way {
                self.rays.push(&self.walks[index as usize].shot.ray());
            }
            self.traced[RayKind::Walk.index()] += self.rays.len() as u64;
            tracer.closest(&mut self.rays, RayKind::Walk);
            let (walks, rays, arrived) = (&mut self.walks, &self.rays, &mut self.arrived);
            let mut ray = 0;
            self.under_way.retain(|&index| {
                let walk = &mut walks[index as usize];
                ray += 1;
                let goes_on = walk.advance(scene, rays.hit(ray - 1));
                if !goes_on && walk.result.is_ok() {
                    arrived.push(index);
                }
                goes_on
            });
        }
        for &index in &self.arrived {
            let walk = &mut self.walks[index as usize];
            walk.end = self.ends.push(&walk.shot.last(&walk.target));
        }
        if self.arrived.is_empty() {
            return;
        }
        self.traced[RayKind::Shadow.index()] += self.ends.len() as u64;
        tracer.any(&mut self.ends, RayKind::Shadow);
        for &index in &self.arrived {
            let walk = &mut self.walks[index as usize];
            if let Ok(link) = &mut walk.result {
                link.free = !self.ends.is_blocked(walk.end);
            }
        }
    }

    /// Rays traced since the last time, see [`RayKind::index`].
    pub fn take_traced(&mut self) -> [u64; RayKind::ALL.len()] {
        std::mem::take(&mut self.traced)
    }

    /// The chain of a walk that has ended.
    pub fn link(&self, walk: u32) -> Result<&Link, Failure> {
        self.walks[walk as usize].result.as_ref().map_err(|&f| f)
    }

    /// How often a walk has set out from its vertex.
    pub fn shots(&self, walk: u32) -> u32 {
        self.walks[walk as usize].shots
    }

    /// How many rays that has taken, the last segment apart.
    pub fn rays(&self, walk: u32) -> u32 {
        self.walks[walk as usize].rays
    }
}
