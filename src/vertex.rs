//! Path vertices: what a ray met, with all that scattering and shifting need there.

use crate::bsdf::{Bsdf, Eval, Lobe, Sampled, Texel, lambert};
use crate::frame::Frame;
use crate::geometry::offset_origin;
use crate::lanes::Vector;
use crate::scene::Scene;
use crate::scene::material::{Class, Material};
use crate::scene::mesh::SHALLOWEST;
use crate::scene::textured::{Place, Textures};
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
    /// Unit direction to the previous vertex, in the world.
    pub wo: Vec3,
    /// Distance by which rays start off the surface.
    pub offset: f32,
    /// Index into [`Scene::materials`].
    pub material: u32,
    /// What the material's textures say here.
    pub texel: Texel,
}

/// The end of a path segment.
#[derive(Clone, Copy, Debug)]
pub enum End {
    /// A surface that scatters.
    Surface(Vertex),
    /// A light, on which every path ends.
    Light(LightPoint),
    /// Nothing; this unit direction leads to the environment.
    Environment(Vec3),
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
    /// The triangle; light sampling has its density by [`Lights::density`](crate::scene::light::Lights::density).
    pub triangle: u32,
    /// Distance by which rays end before the surface.
    pub offset: f32,
    /// Whether the ray met the side that emits. The back is outside of the path space: light sampling
    /// leaves it out, and so does everything else.
    pub front: bool,
}

impl End {
    /// What the ray with unit direction `direction` met.
    #[inline(always)]
    pub fn new(scene: &Scene, hit: Option<Hit>, direction: Vec3) -> Self {
        let Some(hit) = hit else {
            return End::Environment(direction);
        };
        let index = scene.mesh.material_of[hit.triangle as usize];
        let material = &scene.materials[index as usize];
        let mut point = scene.mesh.point(hit.triangle, hit.u, hit.v);
        if let Some(radiance) = material.emission {
            let front = point.ng.dot(direction) < 0.0;
            let radiance = match material.textures {
                _ if !front => Vec3::ZERO,
                None => radiance,
                Some(_) => material.radiance(&scene.mesh, hit.triangle, hit.u, hit.v),
            };
            return End::Light(LightPoint {
                position: point.position,
                ng: point.ng,
                radiance,
                triangle: hit.triangle,
                offset: point.offset,
                front,
            });
        }
        let texel = match &material.textures {
            None => material.texel,
            Some(textures) => {
                let (texel, ns) = textured(scene, material, textures, hit, (point.ng, point.ns));
                point.ns = ns;
                texel
            }
        };
        End::Surface(Vertex {
            position: point.position,
            ng: point.ng,
            ns: point.ns,
            wo: -direction,
            offset: point.offset,
            material: index,
            texel,
        })
    }

    /// The class that decides between reconnection and half-vector copy: lights and the environment
    /// count as rough.
    #[inline]
    pub fn class(&self, scene: &Scene) -> Class {
        match self {
            End::Surface(v) => v.class(scene),
            End::Light(_) | End::Environment(_) => Class::Rough,
        }
    }
}

/// What textures say of a point, and its shading normal `ns` turned by relief. Not inlined: scenes without
/// textures shall not have it in their loops.
#[cold]
#[inline(never)]
fn textured(
    scene: &Scene,
    material: &Material,
    textures: &Textures,
    hit: Hit,
    (ng, ns): (Vec3, Vec3),
) -> (Texel, Vec3) {
    let uv = scene.mesh.texcoord(hit.triangle, hit.u, hit.v);
    let place = Place {
        mesh: &scene.mesh,
        triangle: hit.triangle,
        barycentric: [hit.u, hit.v],
        uv,
    };
    let texel = textures.texel(&material.bsdf, &material.texel, place);
    let turned = match (&textures.relief, scene.mesh.tangents(hit.triangle)) {
        (Some(relief), Some(tangents)) => relief.turn(ns, tangents, uv),
        _ => ns,
    };
    // A normal that looks away from the triangle's front has nothing to shade with.
    let ns = if turned.dot(ng) > SHALLOWEST {
        turned
    } else {
        ns
    };
    (texel, ns)
}

impl Vertex {
    #[inline]
    fn material<'a>(&self, scene: &'a Scene) -> &'a Material {
        &scene.materials[self.material as usize]
    }

    /// Its BSDF.
    #[inline]
    pub fn bsdf(&self, scene: &Scene) -> Bsdf {
        self.material(scene).bsdf.with(&self.texel)
    }

    /// Rough or specular.
    #[inline]
    pub fn class(&self, scene: &Scene) -> Class {
        let material = self.material(scene);
        match &material.textures {
            None => material.class,
            Some(textures) => textures.class(&material.bsdf, &self.texel, material.class),
        }
    }

    /// The normal to shade with as seen from `wo`: `ns`, or `ng` where that is behind `ns`.
    #[inline]
    pub fn normal(&self) -> Vec3 {
        normal_seen_from(self.ng, self.ns, self.wo)
    }

    /// Probability that Russian roulette lets the path go on from here.
    #[inline]
    pub fn survival(&self, scene: &Scene) -> f32 {
        self.material(scene).survival
    }

    /// The shading frame as seen from `wo`.
    #[inline]
    pub fn frame(&self) -> Frame {
        Frame::new(self.normal().into())
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
        match self.material(scene).bsdf {
            // Needs no tangents.
            Bsdf::Lambert { .. } => {
                lambert::eval::<f32>(self.texel.colour.into(), cos_o, cos_i).held()
            }
            _ => self.eval_other(scene, normal, wo, wi),
        }
    }

    /// Whether a direction, whose cosine to the shading normal is `cos`, is on the same side of the
    /// triangle.
    #[inline]
    pub fn agrees(&self, direction: Vec3, cos: f32) -> bool {
        self.ng.dot(direction) * cos > 0.0
    }

    /// Draws a direction in the world with `u` as in [`Bsdf::sample`]. `None` ends the path.
    #[inline(always)]
    pub fn sample(&self, scene: &Scene, u: [f32; 3]) -> Option<Scattering> {
        let frame = self.frame();
        let wo = frame.to_local(self.wo.into());
        let sampled = match self.material(scene).bsdf {
            Bsdf::Lambert { .. } => {
                let colour = self.texel.colour.into();
                lambert::sample::<f32>(colour, wo.z, [u[0], u[1]]).held()?
            }
            _ => self.sample_other(scene, wo.into(), u)?,
        };
        let wi = Vec3::from(frame.to_world(sampled.wi.into())).normalize();
        self.agrees(wi, sampled.wi.z).then_some(Scattering {
            wi,
            local_wi: sampled.wi,
            eval: Eval {
                value: sampled.value,
                pdf: sampled.pdf,
            },
            lobe: sampled.lobe,
            delta: sampled.delta,
        })
    }

    /// As [`Bsdf::sample`]. Not inlined: diffuse scenes shall not have it in their loops.
    #[inline(never)]
    fn sample_other(&self, scene: &Scene, wo: Vec3, u: [f32; 3]) -> Option<Sampled> {
        self.bsdf(scene).sample(wo, u)
    }

    /// As [`Bsdf::eval`]. Not inlined, as above.
    #[inline(never)]
    fn eval_other(&self, scene: &Scene, normal: Vec3, wo: Vec3, wi: Vec3) -> Option<Eval> {
        let frame = Frame::<f32>::new(normal.into());
        let (wo, wi) = (frame.to_local(wo.into()), frame.to_local(wi.into()));
        self.bsdf(scene).eval(wo.into(), wi.into())
    }

    /// A ray from here in the unit direction `direction`, without end.
    #[inline]
    pub fn ray(&self, direction: Vec3) -> Ray {
        Ray::without_end(self.leave(direction), direction)
    }

    /// A ray from here to just before the point `position` on a surface with normal `ng`.
    #[inline]
    pub fn ray_to(&self, position: Vec3, ng: Vec3, offset: f32) -> Ray {
        let towards = position - self.position;
        let origin = self.leave(towards);
        let end = offset_origin::<f32>(position.into(), ng.into(), offset, (-towards).into());
        Ray {
            origin,
            direction: Vec3::from(end) - origin,
            length: 1.0,
        }
    }

    /// Where rays start that go in the direction `towards`.
    #[inline]
    fn leave(&self, towards: Vec3) -> Vec3 {
        let [position, ng, towards] = [self.position, self.ng, towards].map(Vector::<f32>::from);
        offset_origin(position, ng, self.offset, towards).into()
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
    /// Whether it is a single direction.
    pub delta: bool,
}

impl Scattering {
    /// The class of the event at `vertex`: a single direction is specular, also where the vertex is rough
    /// otherwise.
    #[inline]
    pub fn class(&self, scene: &Scene, vertex: &Vertex) -> Class {
        if self.delta {
            Class::Specular
        } else {
            vertex.class(scene)
        }
    }
}
