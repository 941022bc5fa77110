//! A walk: shots from its vertex, each turned by what the last one missed, until one arrives.

use super::shot::Shot;
use super::{Failure, Link, Start, Through};
use crate::bsdf::Lobe;
use crate::scene::Scene;
use crate::scene::reflectors::Target;
use crate::trace::rays::Hit;
use crate::vertex::Interaction;
use glam::{Vec2, Vec3};

/// Most vertices of a chain.
const MOST_VERTICES: u32 = 8;
/// Most rays of a walk from its vertex.
const MOST_SHOTS: u32 = 16;
/// A walk has arrived that misses its target by this angle.
const NEAR: f32 = 2e-5;
/// The largest turn at once, as a tangent.
const LARGEST_STEP: f32 = 0.5;
/// Steps that lead away are halved until they are this short.
const SHORTEST: f32 = 1.0 / 64.0;

/// A walk under way, or ended.
#[derive(Clone, Copy, Debug)]
pub(super) struct Walk {
    pub(super) start: Start,
    pub(super) target: Target,
    pub(super) through: Through,
    pub(super) shot: Shot,
    /// The best shot so far: its direction, by how much it missed, and how to turn it.
    pub(super) best: Option<(Vec3, f32, Vec3)>,
    /// The share of that turn that is being tried.
    pub(super) share: f32,
    pub(super) shots: u32,
    pub(super) result: Result<Link, Failure>,
    /// The ray of its last segment.
    pub(super) end: u32,
}

/// What has come of a ray.
enum Outcome {
    /// It goes on from another surface.
    On,
    /// It is past the chain's last vertex.
    Through,
    Failed(Failure),
}

impl Walk {
    /// One that begins in the direction `guess`; without one there is nowhere to begin.
    pub(super) fn new(start: Start, target: Target, through: Through, guess: Option<Vec3>) -> Self {
        Self {
            start,
            target,
            through,
            shot: Shot::new(&start, guess.unwrap_or(Vec3::X)),
            best: None,
            share: 1.0,
            shots: 1,
            result: Err(Failure::Missed),
            end: 0,
        }
    }

    /// Goes on with what its ray has hit; whether it is still under way.
    pub(super) fn advance(&mut self, scene: &Scene, hit: Option<Hit>) -> bool {
        let outcome = match self.through {
            Through::Mirrors(by) => {
                let numbers = by.numbers();
                let due = numbers[self.shot.vertices as usize];
                self.meet(scene, hit, (due, Lobe::Reflection), numbers.len())
            }
            Through::Passage => self.pass(scene, hit),
            // In and out.
            Through::Ball(ball, _) => self.meet(scene, hit, (ball, Lobe::Transmission), 2),
        };
        match outcome {
            Outcome::On => true,
            Outcome::Through => self.correct(scene),
            Outcome::Failed(failure) => self.retreat(failure),
        }
    }

    /// Goes on by `lobe` where it has met the reflector that is due, in a chain of so many vertices.
    fn meet(
        &mut self,
        scene: &Scene,
        hit: Option<Hit>,
        (due, lobe): (u32, Lobe),
        vertices: usize,
    ) -> Outcome {
        let Some(hit) = hit else {
            return Outcome::Failed(Failure::Missed);
        };
        if scene.reflectors.of(hit.triangle) != Some(due) {
            return Outcome::Failed(Failure::Opaque);
        }
        match Interaction::new(scene, Some(hit), self.shot.direction) {
            Interaction::Surface(vertex) => {
                let scattered = self.shot.scatter(scene, &hit, &vertex, lobe, self.start.k);
                match scattered {
                    Ok(()) if self.shot.vertices as usize == vertices => Outcome::Through,
                    Ok(()) => Outcome::On,
                    Err(failure) => Outcome::Failed(failure),
                }
            }
            _ => Outcome::Failed(Failure::Opaque),
        }
    }

    fn pass(&mut self, scene: &Scene, hit: Option<Hit>) -> Outcome {
        let behind = |hit: &Hit| hit.t >= self.target.from(self.shot.position).1;
        let before = hit.filter(|hit| !behind(hit));
        let reflector = before.and_then(|hit| scene.reflectors.of(hit.triangle));
        if reflector.is_some_and(|r| scene.reflectors.focuses(r)) {
            return Outcome::Failed(Failure::Opaque);
        }
        if let (Some(hit), Some(_)) = (before, reflector)
            && let Interaction::Surface(vertex) =
                Interaction::new(scene, Some(hit), self.shot.direction)
            && vertex.bsdf(scene).has(Lobe::Transmission)
        {
            if self.shot.vertices == MOST_VERTICES {
                return Outcome::Failed(Failure::Unsolved);
            }
            return match self
                .shot
                .scatter(scene, &hit, &vertex, Lobe::Transmission, self.start.k)
            {
                Ok(()) => Outcome::On,
                Err(failure) => Outcome::Failed(failure),
            };
        }
        match self.shot.vertices {
            0 => Outcome::Failed(Failure::Opaque),
            // Whether it reaches the target shows when it goes there.
            _ => Outcome::Through,
        }
    }

    /// By how much the shot misses, and another one unless that is little.
    fn correct(&mut self, scene: &Scene) -> bool {
        let shot = &self.shot;
        let (there, distance) = self.target.from(shot.position);
        // The miss as an angle, along two axes across the way to the target.
        let (a, b) = there.any_orthonormal_pair();
        let across = |v: Vec3| Vec2::new(a.dot(v), b.dot(v));
        let sine = across(shot.direction);
        let length = sine.length();
        let cosine = shot.direction.dot(there);
        // The sine is the angle where it is small.
        let angle = if cosine > 0.999 {
            length
        } else {
            length.atan2(cosine)
        };
        let nearer = match self.best {
            None => angle.is_finite(),
            Some((_, best, _)) => angle < best,
        };
        if !nearer {
            return self.retreat(Failure::Unsolved);
        }
        if angle < NEAR {
            self.result = self.arrive(scene, there, distance);
            return false;
        }
        // How the miss changes: the ray turns, and the target is seen from elsewhere.
        let per_distance = 1.0 / distance;
        let change = [0, 1].map(|i| across(shot.turned[i] + shot.moved[i] * per_distance));
        let determinant = change[0].perp_dot(change[1]);
        let miss = sine * (angle / length);
        let step = Vec2::new(change[1].perp_dot(miss), miss.perp_dot(change[0])) / determinant;
        if !step.is_finite() || self.shots == MOST_SHOTS {
            self.result = Err(Failure::Unsolved);
            return false;
        }
        let step = step.clamp_length_max(LARGEST_STEP);
        let turn = shot.tangents[0] * step.x + shot.tangents[1] * step.y;
        self.best = Some((shot.wi, angle, turn));
        self.share = 1.0;
        self.again()
    }

    /// Tries half of the last turn, if there was one.
    fn retreat(&mut self, failure: Failure) -> bool {
        self.share *= 0.5;
        if self.best.is_none() || self.share < SHORTEST || self.shots == MOST_SHOTS {
            self.result = Err(failure);
            return false;
        }
        self.again()
    }

    fn again(&mut self) -> bool {
        if let Some((wi, _, turn)) = self.best {
            self.shot = Shot::new(&self.start, (wi + turn * self.share).normalize());
            self.shots += 1;
        }
        true
    }

    /// The chain that has been found.
    fn arrive(&self, scene: &Scene, there: Vec3, distance: f32) -> Result<Link, Failure> {
        let shot = &self.shot;
        // Each way through a ball is that of one branch.
        if let Through::Ball(reflector, branch) = self.through
            && let Some(ball) = scene.reflectors.ball(reflector)
            && ball.branch(self.start.position, shot.wi, &self.target) != branch
        {
            return Err(Failure::Unsolved);
        }
        // The beam's cross-section at the target over the solid angle at the vertex, and what it covers there.
        let near = || [0, 1].map(|i| shot.moved[i] + shot.turned[i] * distance);
        let (section, cos) = match self.target {
            Target::Direction(_) => (shot.turned, 1.0),
            Target::Point(_) => (near(), 1.0),
            Target::Surface { ng, .. } => {
                let cos = -ng.dot(there);
                let from_front = cos > 0.0;
                if !from_front {
                    return Err(Failure::Behind);
                }
                (near(), cos)
            }
        };
        let spread = section[0].cross(section[1]).dot(there).abs();
        let geometry = cos / spread;
        if !(geometry.is_finite() && geometry > 0.0 && shot.probability > 0.0) {
            return Err(Failure::Unsolved);
        }
        Ok(Link {
            wi: shot.wi,
            arrival: there,
            factor: shot.factor,
            probability: shot.probability,
            geometry,
            vertices: shot.vertices,
            trail: shot.trail,
            free: false,
        })
    }
}
