//! Path vertices: what a ray met, with all that scattering and shifting need there.

mod vertices;

pub use vertices::{ROULETTE_FROM, RaysX8, ScatteringX8, VerticesX8};

use crate::bsdf::{Bsdf, Parameters};
use crate::scene::Scene;
use crate::scene::material::{Class, Material};
use crate::scene::mesh::SHALLOWEST;
use crate::scene::textured::{Place, Textures};
use crate::trace::rays::{Hit, HitsX8};
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
    pub parameters: Parameters,
}

/// The end of a path segment.
#[derive(Clone, Copy, Debug)]
pub enum Interaction {
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

impl Interaction {
    /// What the ray with unit direction `direction` met.
    #[inline(always)]
    pub fn new(scene: &Scene, hit: Option<Hit>, direction: Vec3) -> Self {
        let Some(hit) = hit else {
            return Interaction::Environment(direction);
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
            return Interaction::Light(LightPoint {
                position: point.position,
                ng: point.ng,
                radiance,
                triangle: hit.triangle,
                offset: point.offset,
                front,
            });
        }
        let parameters = match &material.textures {
            None => material.parameters,
            Some(textures) => {
                let (parameters, ns) =
                    textured(scene, material, textures, hit, (point.ng, point.ns));
                point.ns = ns;
                parameters
            }
        };
        Interaction::Surface(Vertex {
            position: point.position,
            ng: point.ng,
            ns: point.ns,
            wo: -direction,
            offset: point.offset,
            material: index,
            parameters,
        })
    }

    /// What the ray in a lane met.
    pub fn in_lane(scene: &Scene, hits: &HitsX8, lane: usize) -> Self {
        let hit = (hits.found >> lane & 1 == 1).then(|| hits.lane(lane));
        Self::new(scene, hit, hits.direction.lane(lane))
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
) -> (Parameters, Vec3) {
    let uv = scene.mesh.texcoord(hit.triangle, hit.u, hit.v);
    let place = Place {
        mesh: &scene.mesh,
        triangle: hit.triangle,
        barycentric: [hit.u, hit.v],
        uv,
    };
    let parameters = textures.parameters(&material.bsdf, &material.parameters, place);
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
    (parameters, ns)
}

impl Vertex {
    #[inline]
    fn material<'a>(&self, scene: &'a Scene) -> &'a Material {
        &scene.materials[self.material as usize]
    }

    /// Its BSDF.
    #[inline]
    pub fn bsdf(&self, scene: &Scene) -> Bsdf {
        self.material(scene).bsdf.with(&self.parameters)
    }

    /// Rough or specular.
    #[inline]
    pub fn class(&self, scene: &Scene) -> Class {
        let material = self.material(scene);
        match &material.textures {
            None => material.class,
            Some(textures) => textures.class(&material.bsdf, &self.parameters, material.class),
        }
    }

    /// Probability that Russian roulette lets the path go on from here.
    #[inline]
    pub fn survival(&self, scene: &Scene) -> f32 {
        self.material(scene).survival
    }
}
