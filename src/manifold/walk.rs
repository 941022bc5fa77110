//! A walk: shots from its vertex, each turned by what the last one missed, until one arrives.

use super::shot::Shot;
use super::{Ended, Failure, Link, Question, Through};
use crate::bsdf::Lobe;
use crate::scene::Scene;
use crate::scene::reflectors::{Branch, Inside, Target};
use crate::trace::rays::Hit;
use crate::vertex::Interaction;
use glam::{Vec2, Vec3};

/// Most vertices of a chain.
const MOST_VERTICES: u32 = 8;
/// Most rays of a walk from its vertex.
const MOST_SHOTS: u32 = 12;
/// A walk has arrived that misses its target by this angle.
const NEAR: f32 = 2e-5;
/// With less than the whole bend at glass, this is near enough.
const NEAR_WHILE_BENDING: f32 = 3e-2;
/// Least step of the bend.
const LEAST_BEND: f32 = 1.0 / 10.0;
/// The largest turn at once, as a tangent.
const LARGEST_STEP: f32 = 0.5;
/// Steps that lead away are halved until they are this short.
const SHORTEST: f32 = 1.0 / 4.0;

/// A walk under way, or just ended.
#[derive(Clone, Copy, Debug)]
pub(super) struct Walk {
    /// Its place among those that have been asked for.
    pub(super) number: u32,
    pub(super) question: Question,
    pub(super) shot: Shot,
    /// The best shot so far: its direction, by how much it missed, and how to turn it.
    best: Option<(Vec3, f32, Vec3)>,
    /// The share of that turn that is being tried.
    share: f32,
    /// The most of the bend at glass for which there is a way, and that way's direction: with none at all it is where the
    /// walk begins. It has arrived only with all of it.
    bent: (f32, Vec3),
    /// Whether it has begun again, in another direction, as it got nowhere.
    again: bool,
    /// Whether the shot was reflected by another patch than by that which is due. Such shots lead on, and do not arrive.
    strayed: bool,
    pub(super) ended: Ended,
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
    /// One that sets out in the unit direction `wi`.
    pub(super) fn new(number: u32, question: Question, wi: Vec3) -> Self {
        Self {
            number,
            question,
            shot: Shot::new(&question.start, wi, question.through.microfacet()),
            best: None,
            share: 1.0,
            bent: (0.0, wi),
            again: false,
            strayed: false,
            ended: Ended::NOT_YET,
        }
    }

    /// Goes on with what its ray has hit; whether it is still under way.
    pub(super) fn advance(&mut self, scene: &Scene, hit: Option<Hit>) -> bool {
        self.ended.rays += 1;
        let through = self.question.through;
        let outcome = match through {
            Through::Ball(ball, branch) => self.go_through(scene, hit, (ball, branch)),
            Through::Passage | Through::Mirrors(_) | Through::Microfacet(..) => {
                self.go(scene, hit, through.mirrors().numbers())
            }
        };
        match outcome {
            Outcome::On => true,
            Outcome::Through => self.correct(scene),
            Outcome::Failed(failure) => self.retreat(scene, failure),
        }
    }

    /// Goes on where reflections at the reflectors `by` are due in this order, and all else lets it pass.
    fn go(&mut self, scene: &Scene, hit: Option<Hit>, by: &[u32]) -> Outcome {
        let due = by.get(self.shot.reflections as usize).copied();
        // After the last reflection the target is the next to come.
        let to_target = || self.question.target.from(self.shot.position).1;
        let Some(hit) = hit.filter(|hit| due.is_some() || hit.t < to_target()) else {
            return match (due, self.shot.vertices) {
                (Some(_), _) => Outcome::Failed(Failure::Missed),
                (None, 0) => Outcome::Failed(Failure::Opaque),
                _ => Outcome::Through,
            };
        };
        let reflector = scene.reflectors.of(hit.triangle);
        let lobe = match (reflector, due) {
            (Some(met), Some(due)) if scene.reflectors.are_one(met, due) => {
                self.strayed |= met != due;
                Lobe::Reflection
            }
            _ => Lobe::Transmission,
        };
        let focuses = |r| scene.reflectors.focuses(r);
        if lobe == Lobe::Transmission && reflector.is_some_and(focuses) {
            return Outcome::Failed(Failure::Opaque);
        }
        match Interaction::new(scene, Some(hit), self.shot.direction) {
            Interaction::Surface(vertex) if reflector.is_some() && vertex.bsdf(scene).has(lobe) => {
                if self.shot.vertices == MOST_VERTICES {
                    return Outcome::Failed(Failure::Unsolved);
                }
                let scattered =
                    self.shot
                        .scatter(scene, &hit, &vertex, lobe, self.question.start.k);
                match scattered {
                    Ok(()) if self.is_past_all(scene, by) => Outcome::Through,
                    Ok(()) => Outcome::On,
                    Err(failure) => Outcome::Failed(failure),
                }
            }
            // Whether it reaches the target shows when it goes there.
            _ if due.is_none() && self.shot.vertices > 0 => Outcome::Through,
            _ => Outcome::Failed(Failure::Opaque),
        }
    }

    /// Whether reflections at all of `by` have been, and nothing that lets light pass can follow.
    fn is_past_all(&self, scene: &Scene, by: &[u32]) -> bool {
        // From a little further on, lest the surface where it is counts.
        let ahead = self.shot.position + self.shot.direction * (4.0 * self.shot.offset);
        self.shot.reflections as usize == by.len()
            && !scene.reflectors.may_pass(ahead, &self.question.target)
    }

    /// Goes into a ball of glass and out of it, once reflected inside or not.
    fn go_through(
        &mut self,
        scene: &Scene,
        hit: Option<Hit>,
        (ball, branch): (u32, Branch),
    ) -> Outcome {
        let Some(hit) = hit else {
            return Outcome::Failed(Failure::Missed);
        };
        if scene.reflectors.of(hit.triangle) != Some(ball) {
            return Outcome::Failed(Failure::Opaque);
        }
        let Interaction::Surface(vertex) = Interaction::new(scene, Some(hit), self.shot.direction)
        else {
            return Outcome::Failed(Failure::Opaque);
        };
        let lobe = match (branch.inside, self.shot.vertices) {
            (Inside::Reflected, 1) => Lobe::Reflection,
            _ => Lobe::Transmission,
        };
        match self
            .shot
            .scatter(scene, &hit, &vertex, lobe, self.question.start.k)
        {
            Ok(()) if self.shot.vertices == branch.vertices() => Outcome::Through,
            Ok(()) => Outcome::On,
            Err(failure) => Outcome::Failed(failure),
        }
    }

    /// By how much the shot misses, and another one unless that is little.
    fn correct(&mut self, scene: &Scene) -> bool {
        let shot = &self.shot;
        let (there, distance) = self.question.target.from(shot.position);
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
            return self.retreat(scene, Failure::Unsolved);
        }
        if shot.bend < 1.0 && angle < NEAR_WHILE_BENDING {
            let (bend, wi) = self.bent;
            let per_bend = (shot.wi - wi) / (shot.bend - bend);
            let ahead = shot.wi + per_bend * (1.0 - shot.bend);
            self.bent = (shot.bend, shot.wi);
            return self.bend_to(1.0, ahead);
        }
        if angle < NEAR {
            self.ended.result = self.arrive(scene, there, distance);
            return false;
        }
        // How the miss changes: the ray turns, and the target is seen from elsewhere.
        let per_distance = 1.0 / distance;
        let change = [0, 1].map(|i| across(shot.turned[i] + shot.moved[i] * per_distance));
        let determinant = change[0].perp_dot(change[1]);
        let miss = sine * (angle / length);
        let step = Vec2::new(change[1].perp_dot(miss), miss.perp_dot(change[0])) / determinant;
        if !step.is_finite() || self.ended.shots >= MOST_SHOTS {
            self.ended.result = Err(Failure::Unsolved);
            return false;
        }
        let step = step.clamp_length_max(LARGEST_STEP);
        let turn = shot.tangents[0] * step.x + shot.tangents[1] * step.y;
        let next = shot.wi + turn;
        self.best = Some((shot.wi, angle, turn));
        self.share = 1.0;
        self.shoot(shot.bend, next)
    }

    /// Tries half of the last turn, if there was one; else glass that bends less.
    fn retreat(&mut self, scene: &Scene, failure: Failure) -> bool {
        self.share *= 0.5;
        self.ended.result = Err(failure);
        if self.ended.shots >= MOST_SHOTS {
            return false;
        }
        if let Some((wi, _, turn)) = self.best
            && self.share >= SHORTEST
        {
            return self.shoot(self.shot.bend, wi + turn * self.share);
        }
        let (bent, wi) = self.bent;
        let more_bend = 0.5 * (self.shot.bend - bent);
        let bends = !matches!(self.question.through, Through::Ball(..)) && more_bend > LEAST_BEND;
        if bends && self.best.is_none() && failure == Failure::Reflected {
            return self.bend_to(bent + more_bend, wi);
        }
        match self.other_guess(scene) {
            Some(wi) => {
                self.again = true;
                self.bent = (0.0, wi);
                self.bend_to(1.0, wi)
            }
            None => false,
        }
    }

    /// Where it begins again, once.
    fn other_guess(&self, scene: &Scene) -> Option<Vec3> {
        let (reflectors, from) = (&scene.reflectors, self.question.start.position);
        let other = || {
            reflectors.other_guess(
                &self.question.through.mirrors(),
                from,
                &self.question.target,
            )
        };
        (!self.again).then(other)?
    }

    /// Begins again in the direction `wi`, with so much of the bend at glass.
    fn bend_to(&mut self, bend: f32, wi: Vec3) -> bool {
        (self.best, self.share) = (None, 1.0);
        self.shoot(bend, wi)
    }

    fn shoot(&mut self, bend: f32, wi: Vec3) -> bool {
        let microfacet = self.question.through.microfacet();
        self.shot = Shot::new(&self.question.start, wi.normalize(), microfacet);
        self.strayed = false;
        self.shot.bend = bend;
        self.ended.shots += 1;
        true
    }

    /// The chain that has been found.
    fn arrive(&self, scene: &Scene, there: Vec3, distance: f32) -> Result<Link, Failure> {
        let shot = &self.shot;
        if self.strayed {
            return Err(Failure::Unsolved);
        }
        // Each way through a ball is that of one branch.
        if let Through::Ball(reflector, branch) = self.question.through
            && let Some(ball) = scene.reflectors.ball(reflector)
            && ball.branch(
                branch.inside,
                self.question.start.position,
                shot.wi,
                &self.question.target,
            ) != branch
        {
            return Err(Failure::Unsolved);
        }
        // The beam's cross-section at the target over the solid angle at the vertex, and what it covers there.
        let near = || [0, 1].map(|i| shot.moved[i] + shot.turned[i] * distance);
        let (section, cos) = match self.question.target {
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
