//! Path vertices: what a ray met, with all that scattering and shifting need there.

use crate::bsdf::{Bsdf, Eval, Lobe, lambert};
use crate::frame::{Frame, offset_origin};
use crate::scene::Scene;
use crate::scene::material::Class;
use crate::trace::rays::{Hit, Ray};
use glam::Vec3;

/// A surface point seen from a direction; not on a light.
#[derive(Clone, Copy, Debug)]
pub struct Vertex {
    /// Where it is.
    pub position: Vec3,
    /// Geometric normal, unit, on the front side of the triangle.
    pub ng: Vec3,
    /// Interpolated shading normal, unit, on the front side too.
    pub ns: Vec3,
    /// The normal to shade with as seen from `wo`: `ns`, or `ng` where that is behind `ns`.
    pub normal: Vec3,
    /// Unit direction to the previous vertex, in the world.
    pub wo: Vec3,
    /// Distance by which rays start off the surface.
    pub offset: f32,
    /// Index into [`Scene::materials`].
    pub material: u32,
}

/// The end of a path segment.
#[derive(Clone, Copy, Debug)]
pub enum End {
    /// A surface that scatters.
    Surface(Vertex),
    /// A light, on which every path ends.
    Light(LightPoint),
    /// Nothing; the direction leads to the environment.
    Environment,
}

/// A point on a light, met by a ray.
#[derive(Clone, Copy, Debug)]
pub struct LightPoint {
    /// Where it is.
    pub position: Vec3,
    /// Geometric normal, on the side that emits.
    pub ng: Vec3,
    /// Radiance towards where the ray came from; 0 at the back.
    pub radiance: Vec3,
    /// Density per area with which light sampling draws this point.
    pub density: f32,
    /// Distance by which rays end before the surface.
    pub offset: f32,
    /// Whether the ray met the side that emits. The back is outside of the path space: light sampling
    /// leaves it out, and so does everything else.
    pub front: bool,
}

impl End {
    /// What the ray with unit direction `direction` met.
    #[inline]
    pub fn new(scene: &Scene, hit: Option<Hit>, direction: Vec3) -> Self {
        let Some(hit) = hit else {
            return End::Environment;
        };
        let material = scene.mesh.material_of[hit.triangle as usize];
        let point = scene.mesh.point(hit.triangle, hit.u, hit.v);
        let front = point.ng.dot(direction) < 0.0;
        match scene.materials[material as usize].emission {
            Some(radiance) => End::Light(LightPoint {
                position: point.position,
                ng: point.ng,
                radiance: if front { radiance } else { Vec3::ZERO },
                density: scene.lights.density(material),
                offset: point.offset,
                front,
            }),
            None => End::Surface(Vertex {
                position: point.position,
                ng: point.ng,
                ns: point.ns,
                normal: normal_seen_from(point.ng, point.ns, -direction),
                wo: -direction,
                offset: point.offset,
                material,
            }),
        }
    }

    /// The class that decides between reconnection and half-vector copy: lights and the environment
    /// count as rough.
    #[inline]
    pub fn class(&self, scene: &Scene) -> Class {
        match self {
            End::Surface(v) => v.class(scene),
            End::Light(_) | End::Environment => Class::Rough,
        }
    }
}

impl Vertex {
    /// Its BSDF.
    #[inline]
    pub fn bsdf<'a>(&self, scene: &'a Scene) -> &'a Bsdf {
        &scene.materials[self.material as usize].bsdf
    }

    /// Rough or specular.
    #[inline]
    pub fn class(&self, scene: &Scene) -> Class {
        scene.materials[self.material as usize].class
    }

    /// Probability that Russian roulette lets the path go on from here.
    #[inline]
    pub fn survival(&self, scene: &Scene) -> f32 {
        scene.materials[self.material as usize].survival
    }

    /// The shading frame as seen from `wo`.
    #[inline]
    pub fn frame(&self) -> Frame {
        Frame::new(self.normal)
    }

    /// The BSDF (with the cosine at `wi`) and its density for a unit direction `wi` in the world.
    /// `None` where sampling cannot produce `wi`, also because shading and geometric normal disagree
    /// about its side.
    #[inline]
    pub fn eval(&self, scene: &Scene, wi: Vec3) -> Option<Eval> {
        self.eval_seen_from(scene, self.wo, wi)
    }

    /// As [`Vertex::eval`], seen from another vertex in the unit direction `wo`.
    #[inline]
    pub fn eval_seen_from(&self, scene: &Scene, wo: Vec3, wi: Vec3) -> Option<Eval> {
        let normal = normal_seen_from(self.ng, self.ns, wo);
        let (cos_o, cos_i) = (normal.dot(wo), normal.dot(wi));
        if !self.agrees(wo, cos_o) || !self.agrees(wi, cos_i) {
            return None;
        }
        match self.bsdf(scene) {
            // Needs no tangents.
            Bsdf::Lambert { albedo } => lambert::eval(*albedo, cos_o, cos_i),
            bsdf => {
                let frame = Frame::new(normal);
                bsdf.eval(frame.to_local(wo), frame.to_local(wi))
            }
        }
    }

    /// Whether a direction, whose cosine to the shading normal is `cos`, is on the same side of the
    /// triangle.
    #[inline]
    pub fn agrees(&self, direction: Vec3, cos: f32) -> bool {
        self.ng.dot(direction) * cos > 0.0
    }

    /// Draws a direction in the world with `u` as in [`Bsdf::sample`]. `None` ends the path.
    #[inline]
    pub fn sample(&self, scene: &Scene, u: [f32; 3]) -> Option<Scattering> {
        let frame = self.frame();
        let sampled = self.bsdf(scene).sample(frame.to_local(self.wo), u)?;
        let wi = frame.to_world(sampled.wi).normalize();
        self.agrees(wi, sampled.wi.z).then_some(Scattering {
            wi,
            local_wi: sampled.wi,
            eval: Eval {
                value: sampled.value,
                pdf: sampled.pdf,
            },
            lobe: sampled.lobe,
        })
    }

    /// A ray from here in the unit direction `direction`, without end.
    #[inline]
    pub fn ray(&self, direction: Vec3) -> Ray {
        Ray {
            origin: offset_origin(self.position, self.ng, self.offset, direction),
            direction,
            length: f32::INFINITY,
        }
    }

    /// A ray from here to just before the point `position` on a surface with normal `ng`.
    #[inline]
    pub fn ray_to(&self, position: Vec3, ng: Vec3, offset: f32) -> Ray {
        let towards = position - self.position;
        let origin = offset_origin(self.position, self.ng, self.offset, towards);
        let end = offset_origin(position, ng, offset, -towards);
        Ray {
            origin,
            direction: end - origin,
            length: 1.0,
        }
    }
}

/// The normal to shade with. From the front of the triangle but from behind the shading normal (or the
/// other way round) there is nothing to shade with: then it is the geometric one. It depends on who
/// looks, so base and offset path must each have their own.
#[inline]
fn normal_seen_from(ng: Vec3, ns: Vec3, wo: Vec3) -> Vec3 {
    if (ns.dot(wo) > 0.0) == (ng.dot(wo) > 0.0) {
        ns
    } else {
        ng
    }
}

/// A scattering event at a vertex.
#[derive(Clone, Copy, Debug)]
pub struct Scattering {
    /// Unit direction in the world.
    pub wi: Vec3,
    /// The same in the vertex's frame.
    pub local_wi: Vec3,
    /// The BSDF with the cosine, and the density.
    pub eval: Eval,
    /// Reflection or transmission.
    pub lobe: Lobe,
}
