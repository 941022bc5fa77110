//! The bounce step: every base path scatters, and its offset paths follow by reconnection or by
//! half-vector copy.

use super::by_light::{ByLight, radiance};
use super::{
    BasePath, Context, Counts, Wavefront, gather, or_dead, survival, trace_any, trace_closest,
};
use crate::gradient::{Base, Shift};
use crate::lanes::Vector;
use crate::sampler::{self, Dimension};
use crate::scene::Scene;
use crate::scene::material::Class;
use crate::shift::{self, Carried, Death, Joint, Offset, Shifted, Way};
use crate::trace::RayKind;
use crate::trace::rays::{AnyBatch, ClosestBatch};
use crate::vertex::{End, Scattering, Vertex};
use glam::Vec3;

/// A base path that has scattered at x_k.
#[derive(Clone, Debug)]
pub(super) struct Bounce<const N: usize> {
    pub(super) scattering: Scattering,
    /// Density of the direction, roulette included.
    pub(super) pdf: f32,
    /// The ray to x_{k+1}.
    ray: u32,
    /// x_{k+1}; the environment until it is known.
    pub(super) end: End,
    pub(super) followers: [Follower; N],
}

/// An offset path on its way to y_{k+1}.
#[derive(Clone, Copy, Debug)]
pub(super) struct Follower {
    pub(super) progress: Progress,
    /// The densities' ratio up to y_k: what light sampling at y_k has, whatever the segment to the
    /// light does.
    ratio: f32,
}

#[derive(Clone, Copy, Debug)]
pub(super) enum Progress {
    /// The shift is dead.
    Dead,
    /// It shares the segment with the base path.
    Shared(Carried),
    /// It joins the base path at x_{k+1}, if this any-hit ray is free.
    Reconnecting {
        ray: u32,
        wo: Vec3,
        carried: Carried,
    },
    /// It follows a copied half vector along this closest-hit ray.
    Copying { ray: u32, carried: Carried },
}

impl Follower {
    const DEAD: Self = Self {
        progress: Progress::Dead,
        ratio: 0.0,
    };
}

impl<const N: usize> Wavefront<N> {
    pub(super) fn bounce_step(&mut self, context: Context, k: u32) {
        self.scatter(context, k);
        trace_closest(context, &mut self.bounce, RayKind::Bounce, &mut self.counts);
        self.follow(context, k);
        trace_any(
            context,
            &mut self.reconnection,
            RayKind::Reconnection,
            &mut self.counts,
        );
        trace_closest(
            context,
            &mut self.continuation,
            RayKind::Continuation,
            &mut self.counts,
        );
        self.arrive(context, k);
    }

    /// Samples the BSDF at x_k; paths that end leave the list.
    pub(super) fn scatter(&mut self, context: Context, k: u32) {
        let scene = context.scene;
        self.bounce.clear();
        self.bounces.clear();
        let samplers = self.paths.iter().map(|path| path.sampler);
        sampler::draw_all(samplers, Dimension::Bsdf(k), &mut self.numbers);
        let mut numbers = self.numbers.iter();
        let (bounces, batch) = (&mut self.bounces, &mut self.bounce);
        self.paths.retain(|path| {
            let &[u0, u1, u2, u_roulette] = numbers.next().expect("one for each path");
            let survival = survival(scene, &path.vertex, k);
            if u_roulette >= survival || !path.carries_light() {
                return false;
            }
            let Some(scattering) = path.vertex.sample(scene, [u0, u1, u2]) else {
                return false;
            };
            bounces.push(Bounce {
                pdf: scattering.eval.pdf * survival,
                ray: batch.push(&path.vertex.ray(scattering.wi)),
                end: End::Environment(scattering.wi),
                scattering,
                followers: [Follower::DEAD; N],
            });
            true
        });
    }

    /// Shifts the scattering event of each base path to its offset paths.
    pub(super) fn follow(&mut self, context: Context, k: u32) {
        let scene = context.scene;
        self.reconnection.clear();
        self.continuation.clear();
        for (path, bounce) in self.paths.iter().zip(&mut self.bounces) {
            bounce.end = End::new(scene, self.bounce.hit(bounce.ray), bounce.scattering.wi);
            if !leads_to_light(context, &bounce.end, k) {
                continue;
            }
            let mut step = None;
            for j in 0..N {
                bounce.followers[j] = follow(
                    context,
                    k,
                    path,
                    bounce,
                    &path.offsets[j],
                    &mut step,
                    &mut self.reconnection,
                    &mut self.continuation,
                    &mut self.counts,
                );
            }
        }
    }

    /// Moves the paths to their next vertices; those that reached light are complete.
    pub(super) fn arrive(&mut self, context: Context, k: u32) {
        let scene = context.scene;
        let mut index = 0;
        let Self {
            paths,
            bounces,
            samples,
            counts,
            reconnection,
            continuation,
            ..
        } = self;
        paths.retain_mut(|path| {
            let bounce = &bounces[index];
            index += 1;
            if !leads_to_light(context, &bounce.end, k) {
                return false;
            }
            if let End::Surface(vertex) = &bounce.end {
                for (offset, follower) in path.offsets.iter_mut().zip(&bounce.followers) {
                    *offset = match follower.progress {
                        Progress::Dead => Offset::Dead,
                        Progress::Shared(carried) => Offset::Connected(carried),
                        Progress::Reconnecting { ray, .. } if reconnection.is_blocked(ray) => {
                            or_dead(Err(Death::Blocked), counts)
                        }
                        Progress::Reconnecting { wo, carried, .. } => {
                            Offset::Joined { wo, carried }
                        }
                        Progress::Copying { ray, carried } => {
                            let direction = continuation.ray(ray).direction;
                            let end = End::new(scene, continuation.hit(ray), direction);
                            or_dead(shift::arrive(scene, vertex, &end, carried), counts)
                        }
                    };
                }
                path.throughput = bounce.throughput(path);
                path.vertex = *vertex;
                return true;
            }
            let (base, shifts) = bounce.complete(scene, path, reconnection, continuation, counts);
            let sample = &mut samples[path.pixel as usize];
            gather(sample, context.settings.weights, &base, &shifts);
            false
        });
    }
}

impl<const N: usize> Bounce<N> {
    /// f/p of the base path up to x_{k+1}.
    #[inline]
    fn throughput(&self, path: &BasePath<N>) -> Vec3 {
        path.throughput * self.scattering.eval.value * self.pdf.recip()
    }

    /// The complete paths where the base path reached a light or the environment, once all rays are
    /// traced. Counts the shifts that died here.
    #[inline]
    pub(super) fn complete(
        &self,
        scene: &Scene,
        path: &BasePath<N>,
        reconnection: &AnyBatch,
        continuation: &ClosestBatch,
        counts: &mut Counts,
    ) -> (Base, [Shift; N]) {
        let x = &path.vertex;
        let radiance = radiance(scene, &self.end, self.scattering.wi);
        let by_light = if self.scattering.class(scene, x) == Class::Rough {
            ByLight::of(scene, x.position, &self.end, self.scattering.wi, self.pdf)
        } else {
            ByLight::Never
        };
        let at_base = by_light.density(scene, x.position);
        let base = Base {
            value: (self.throughput(path) * radiance).into(),
            densities: 1.0 + at_base,
        };
        let shifts = std::array::from_fn(|j| {
            let follower = &self.followers[j];
            let light_density = follower.ratio
                * match &path.offsets[j] {
                    Offset::Free { vertex, .. } if scene.lights.depend_on_place() => {
                        by_light.density(scene, vertex.position)
                    }
                    _ => at_base,
                };
            let reached = |carried: Carried, radiance: Vec3| Shift {
                value: (carried.throughput * radiance).into(),
                densities: carried.ratio + light_density,
            };
            match follower.progress {
                Progress::Dead => Shift::DEAD,
                Progress::Shared(carried) => reached(carried, radiance),
                // Light sampling makes the blocked path too, with value 0.
                Progress::Reconnecting { ray, .. } if reconnection.is_blocked(ray) => {
                    counts.deaths[Death::Blocked as usize] += 1;
                    Shift {
                        value: Vector::ZERO,
                        densities: light_density,
                    }
                }
                Progress::Reconnecting { carried, .. } => reached(carried, radiance),
                Progress::Copying { ray, carried } => {
                    let direction = continuation.ray(ray).direction;
                    let end = End::new(scene, continuation.hit(ray), direction);
                    let arrived = match (&self.end, &end) {
                        (End::Environment(_), End::Environment(direction)) => {
                            Ok(scene.environment.radiance(*direction))
                        }
                        (End::Environment(_), _) => Err(Death::Missed),
                        (_, end) => shift::arrive_at_light(end).map(|light| light.radiance),
                    };
                    match arrived {
                        Ok(radiance) => reached(carried, radiance),
                        Err(death) => {
                            counts.deaths[death as usize] += 1;
                            Shift::DEAD
                        }
                    }
                }
            }
        });
        (base, shifts)
    }
}

/// Whether a path that arrived at `end` as its vertex k + 1 can still gather light.
#[inline]
pub(super) fn leads_to_light(context: Context, end: &End, k: u32) -> bool {
    match end {
        End::Surface(_) => k + 2 <= context.settings.depth,
        End::Light(light) => light.front,
        End::Environment(_) => !context.scene.environment.is_black(),
    }
}

/// How free offset paths follow a base path to x_{k+1}.
pub(super) enum Step {
    /// They are joined to it there; rays end at this distance before the surface.
    Join(Joint, f32),
    /// They take the same direction to the environment.
    Environment,
    /// They copy the half vector.
    Copy,
}

impl Step {
    #[inline]
    pub(super) fn of<const N: usize>(
        scene: &Scene,
        x: &Vertex,
        bounce: &Bounce<N>,
    ) -> Result<Self, Death> {
        let class = bounce.scattering.class(scene, x);
        if shift::way(class, bounce.end.class(scene)) == Way::Copy {
            return Ok(Step::Copy);
        }
        let wi = bounce.scattering.wi;
        let (joint, distance) = match &bounce.end {
            End::Surface(v) => (Joint::new(x, wi, v.position, v.ng), v.offset),
            End::Light(l) => (Joint::new(x, wi, l.position, l.ng), l.offset),
            End::Environment(_) => return Ok(Step::Environment),
        };
        Ok(Step::Join(joint?, distance))
    }
}

/// Shifts the scattering event at x_k to one offset path.
#[inline]
#[allow(clippy::too_many_arguments)]
fn follow<const N: usize>(
    context: Context,
    k: u32,
    path: &BasePath<N>,
    bounce: &Bounce<N>,
    offset: &Offset,
    step: &mut Option<Result<Step, Death>>,
    reconnection: &mut AnyBatch,
    continuation: &mut ClosestBatch,
    counts: &mut Counts,
) -> Follower {
    let scene = context.scene;
    let Scattering { wi, eval, .. } = bounce.scattering;
    let x = &path.vertex;
    let mut shared = |carried: Carried, ratio: f32| match shift::finite(Offset::Connected(carried))
    {
        Ok(_) => Follower {
            progress: Progress::Shared(carried),
            ratio,
        },
        Err(death) => {
            counts.deaths[death as usize] += 1;
            Follower::DEAD
        }
    };
    let (vertex, carried) = match offset {
        Offset::Dead => return Follower::DEAD,
        // One direction and one density for both.
        Offset::Connected(carried) => {
            let throughput = carried.throughput * eval.value * bounce.pdf.recip();
            return shared(
                Carried {
                    throughput,
                    ratio: carried.ratio,
                },
                carried.ratio,
            );
        }
        Offset::Joined { wo, carried } => {
            // From another side a single direction leads elsewhere.
            let eval = if bounce.scattering.delta {
                Err(Death::Lobe)
            } else {
                x.eval_seen_from(scene, *wo, wi).ok_or(Death::Side)
            };
            return match eval {
                Ok(eval) => {
                    let next = carried.scatter(&eval, 1.0, bounce.pdf, survival(scene, x, k));
                    shared(next, carried.ratio)
                }
                Err(death) => {
                    counts.deaths[death as usize] += 1;
                    Follower::DEAD
                }
            };
        }
        Offset::Free { vertex, carried } => (vertex, carried),
    };
    // A free offset path takes a direction of its own.
    let mut dead = |death| {
        counts.deaths[death as usize] += 1;
        Follower::DEAD
    };
    let step = match step.get_or_insert_with(|| Step::of(scene, x, bounce)) {
        Ok(step) => step,
        Err(death) => return dead(*death),
    };
    let shifted = match step {
        Step::Join(joint, _) => shift::reconnect(scene, joint, vertex),
        Step::Environment => shift::same_direction(scene, wi, vertex),
        Step::Copy => shift::copy_half_vector(scene, x, &bounce.scattering, vertex),
    };
    let shifted = shifted.and_then(|shifted| {
        let survival = survival(scene, vertex, k);
        let next = carried.scatter(&shifted.eval, shifted.jacobian, bounce.pdf, survival);
        shift::finite(Offset::Connected(next))?;
        Ok((shifted, next))
    });
    let (Shifted { wi, .. }, next) = match shifted {
        Ok(shifted) => shifted,
        Err(death) => return dead(death),
    };
    let reconnecting = |ray| Progress::Reconnecting {
        ray,
        wo: -wi,
        carried: next,
    };
    let progress = match step {
        Step::Join(joint, distance) => {
            let ray = vertex.ray_to(joint.position, joint.ng, *distance);
            reconnecting(reconnection.push(&ray))
        }
        Step::Environment => reconnecting(reconnection.push(&vertex.ray(wi))),
        Step::Copy => Progress::Copying {
            ray: continuation.push(&vertex.ray(wi)),
            carried: next,
        },
    };
    Follower {
        progress,
        ratio: carried.ratio,
    }
}
