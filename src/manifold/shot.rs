//! A ray through mirrors and glass, with its derivatives by the direction in which it left (Igehy 1999).

use super::{Failure, Start, trail};
use crate::bsdf::{Bsdf, Eval, Lobe, fresnel};
use crate::frame::Frame;
use crate::geometry::{Site, offset_origin, segment};
use crate::lanes::Vector;
use crate::scene::Scene;
use crate::scene::reflectors::Target;
use crate::trace::rays::{Hit, Ray};
use crate::vertex::{ROULETTE_FROM, Vertex};
use glam::Vec3;

/// A ray on its way from the vertex.
#[derive(Clone, Copy, Debug)]
pub(super) struct Shot {
    /// Its direction at the vertex, and the tangents along which it is turned.
    pub(super) wi: Vec3,
    pub(super) tangents: [Vec3; 2],
    /// Where it is, and where it goes on.
    pub(super) position: Vec3,
    pub(super) ng: Vec3,
    pub(super) offset: f32,
    pub(super) direction: Vec3,
    /// How these change along the tangents.
    pub(super) moved: [Vec3; 2],
    pub(super) turned: [Vec3; 2],
    pub(super) factor: Vec3,
    pub(super) probability: f32,
    /// How much of the bend at glass it is given, in (0, 1]; all of it is what glass does.
    pub(super) bend: f32,
    /// The local normal of the microfacet that reflects it where the surface is a little rough.
    microfacet: Option<Vec3>,
    /// Where it has been: vertices, and those of them that have reflected it.
    pub(super) vertices: u32,
    pub(super) reflections: u32,
    pub(super) trail: u32,
}

impl Shot {
    pub(super) fn new(start: &Start, wi: Vec3, microfacet: Option<Vec3>) -> Self {
        let (a, b) = wi.any_orthonormal_pair();
        Self {
            wi,
            tangents: [a, b],
            position: start.position,
            ng: start.ng,
            offset: start.offset,
            direction: wi,
            moved: [Vec3::ZERO; 2],
            turned: [a, b],
            factor: Vec3::ONE,
            probability: 1.0,
            bend: 1.0,
            microfacet,
            vertices: 0,
            reflections: 0,
            trail: 0,
        }
    }

    pub(super) fn ray(&self) -> Ray {
        self.ray_along(self.direction)
    }

    fn ray_along(&self, direction: Vec3) -> Ray {
        let from = site(self.position, self.ng, self.offset);
        let origin = offset_origin(from.position, from.ng, from.offset, direction.into());
        Ray::without_end(origin.into(), direction)
    }

    /// The ray of the last segment.
    pub(super) fn last(&self, target: &Target) -> Ray {
        match *target {
            Target::Direction(direction) => self.ray_along(direction),
            Target::Surface {
                position,
                ng,
                offset,
            } => self.segment_to(site(position, ng, offset)),
            Target::Point(position) => self.segment_to(site(position, Vec3::ZERO, 0.0)),
        }
    }

    fn segment_to(&self, end: Site<f32>) -> Ray {
        let (origin, direction) = segment(site(self.position, self.ng, self.offset), end);
        Ray {
            origin: origin.into(),
            direction: direction.into(),
            length: 1.0,
        }
    }

    /// Goes on from `hit`, where the surface is `vertex`, in its single direction: reflected, or passing.
    pub(super) fn scatter(
        &mut self,
        scene: &Scene,
        hit: &Hit,
        vertex: &Vertex,
        lobe: Lobe,
        k: u32,
    ) -> Result<(), Failure> {
        let (wo, d) = (vertex.wo, self.direction);
        // As seen from `wo`, see `VerticesX8`.
        let (by_ng, by_ns) = (vertex.ng.dot(wo), vertex.ns.dot(wo));
        let smooth = (by_ns > 0.0) == (by_ng > 0.0);
        let (normal, cos_o) = if smooth {
            (vertex.ns, by_ns)
        } else {
            (vertex.ng, by_ng)
        };
        let seen = by_ng * cos_o > 0.0;
        if !seen {
            return Err(Failure::Missed);
        }
        let bsdf = vertex.bsdf(scene);
        let local = Vec3::new((1.0 - cos_o * cos_o).max(0.0).sqrt(), 0.0, cos_o);

        // Where the ray meets the plane of the triangle when it is turned, and how the normal changes there.
        let per_cos = 1.0 / d.dot(vertex.ng);
        let distance = hit.t;
        let moved = [0, 1].map(|i| {
            let there = self.moved[i] + self.turned[i] * distance;
            there - d * (vertex.ng.dot(there) * per_cos)
        });
        let bent = if smooth {
            scene
                .mesh
                .normal_change(hit.triangle, [hit.u, hit.v], moved)
        } else {
            [Vec3::ZERO; 2]
        };

        // What it is reflected by, or passes: the surface, on the side of `wo`, or a microfacet.
        let side = 1f32.copysign(cos_o);
        let is_rough = matches!(bsdf, Bsdf::Conductor { .. });
        let microfacet = self.microfacet.filter(|_| is_rough);
        let microfacet = microfacet.map(|h| (Frame::<f32>::new(normal.into()), h));
        let (n, bent) = match microfacet {
            None => (normal * side, bent.map(|b| b * side)),
            Some((frame, h)) => {
                let h = Vec3::new(h.x, h.y, h.z * side).into();
                let turn = |b: Vec3| Vec3::from(frame.change(b.into()).to_world(h));
                (Vec3::from(frame.to_world(h)), bent.map(turn))
            }
        };
        let cos = wo.dot(n);
        if cos <= 0.0 {
            return Err(Failure::Missed);
        }

        // The direction, and how it changes.
        // Derivatives of cos = -d·n.
        let cos_change = |i: usize| -(self.turned[i].dot(n) + d.dot(bent[i]));
        let (direction, turned) = match (lobe, &bsdf) {
            (Lobe::Transmission, Bsdf::Thin { .. }) => (d, self.turned),
            (Lobe::Transmission, _) => {
                let index = 1.0 / fresnel::relative_index(bsdf.ior(), Vector::<f32>::from(local));
                let index = 1.0 + (index - 1.0) * self.bend;
                let squared = 1.0 - index * index * (1.0 - cos * cos);
                let bends = squared > 0.0;
                if !bends {
                    return Err(Failure::Reflected);
                }
                let cos_t = squared.sqrt();
                let along = index * cos - cos_t;
                let turned = [0, 1].map(|i| {
                    let along_change = (index - index * index * cos / cos_t) * cos_change(i);
                    self.turned[i] * index + bent[i] * along + n * along_change
                });
                (d * index + n * along, turned)
            }
            (Lobe::Reflection, _) => {
                let turned =
                    [0, 1].map(|i| self.turned[i] + (bent[i] * cos + n * cos_change(i)) * 2.0);
                (d + n * (2.0 * cos), turned)
            }
        };
        let direction = direction.normalize();
        let cos_i = normal.dot(direction);
        let on_side = if lobe == Lobe::Reflection {
            cos_i * cos_o > 0.0
        } else {
            cos_i * cos_o < 0.0
        };
        if !(on_side && vertex.ng.dot(direction) * cos_i > 0.0) {
            return Err(Failure::Missed);
        }

        // The coefficient and the probability; per solid angle of the microfacet's normal, if it is one.
        let eval = match microfacet {
            None => bsdf.eval_delta(local, lobe),
            Some((frame, _)) => {
                let local = |v: Vec3| frame.to_local(v.into()).into();
                let eval = bsdf.eval(local(wo), local(direction));
                let per_normal = 4.0 * cos;
                eval.map(|eval| Eval {
                    value: eval.value * per_normal,
                    pdf: eval.pdf * per_normal,
                })
            }
        };
        let (value, pdf) = match eval {
            Some(eval) => (eval.value, eval.pdf),
            // On the way to all of the bend it does not count.
            None if self.bend < 1.0 => (Vec3::ZERO, 0.0),
            None => return Err(Failure::Reflected),
        };

        self.vertices += 1;
        self.reflections += u32::from(lobe == Lobe::Reflection);
        self.trail = trail(self.trail, hit.triangle);
        let survival = if k + self.vertices < ROULETTE_FROM {
            1.0
        } else {
            vertex.survival(scene)
        };
        self.factor *= value;
        self.probability *= pdf * survival;
        self.position = vertex.position;
        self.ng = vertex.ng;
        self.offset = vertex.offset;
        (self.direction, self.moved, self.turned) = (direction, moved, turned);
        Ok(())
    }
}

fn site(position: Vec3, ng: Vec3, offset: f32) -> Site<f32> {
    Site {
        position: position.into(),
        ng: ng.into(),
        offset,
    }
}

impl Target {
    /// The unit direction to it from `p`, and the distance.
    pub(super) fn from(&self, p: Vec3) -> (Vec3, f32) {
        match *self {
            Target::Surface { position, .. } | Target::Point(position) => {
                let way = position - p;
                let distance = way.length();
                (way / distance, distance)
            }
            Target::Direction(direction) => (direction, f32::INFINITY),
        }
    }
}
