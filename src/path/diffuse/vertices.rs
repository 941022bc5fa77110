//! Vertices, and the lights they see, in lanes.
//!
//! `DIFFUSE` says that the scene is diffuse: then all are Lambert's, and there is no code for anything else.

use super::arrival::end;
use crate::bsdf::packed::{Kind, Kinds, Packed, Texels};
use crate::bsdf::{Bsdf, Evals, Samples, Texel, lambert};
use crate::frame::Frame;
use crate::geometry::{Seen, offset_origin};
use crate::lanes::{Float, LANES, Vec3x8, lanes_of, mask_of, negative, positive};
use crate::path::ROULETTE_FROM;
use crate::sampler::{self, Dimension, Sampler};
use crate::scene::Scene;
use crate::scene::light::LightSamplesX8;
use crate::scene::material::{Class, Material};
use crate::trace::rays::{HitsX8, Ray};
use crate::vertex::{End, Vertex};
use glam::Vec3;
use wide::f32x8;

/// [`Vertex`] in lanes.
#[derive(Clone)]
pub(super) struct VerticesX8 {
    pub(super) position: Vec3x8,
    /// Geometric normals.
    pub(super) ng: Vec3x8,
    /// Interpolated shading normals.
    ns: Vec3x8,
    /// The normals to shade with, as seen from where the paths came from.
    pub(super) normal: Vec3x8,
    /// Their cosines to the directions to there.
    cos_o: f32x8,
    /// Whether both normals are on that side.
    agrees: f32x8,
    /// Distances by which rays start off the surfaces.
    pub(super) offset: f32x8,
    /// What [`Bsdf::colour`] is: of Lambert surfaces the albedo.
    pub(super) albedo: Vec3x8,
    survival: f32x8,
    /// A bit for each lane whose surface is of class rough.
    pub(super) rough: u32,
    /// The lanes whose surfaces are not Lambert's; in diffuse scenes none.
    pub(super) others: u32,
    other: Other,
}

/// What is known of vertices where not all surfaces are Lambert's; it means nothing where all are.
#[derive(Clone)]
struct Other {
    /// Unit directions to the previous vertices.
    wo: Vec3x8,
    /// Of the lanes `others`.
    kinds: Kinds,
    /// Indices into [`Scene::materials`].
    material: [u32; LANES],
    /// GGX roughness where there is one.
    alpha: f32x8,
    /// Factor on the reflectance of plastic's coat.
    specular: f32x8,
    /// Share of plastic that is metal.
    metallic: f32x8,
}

impl Other {
    const NONE: Self = Self {
        wo: Vec3x8::ZERO,
        kinds: Kinds::NONE,
        material: [0; LANES],
        alpha: f32x8::ZERO,
        specular: f32x8::ZERO,
        metallic: f32x8::ZERO,
    };
}

/// Paths that have scattered.
pub(super) struct ScatteringX8 {
    /// Unit directions in the world.
    pub(super) wi: Vec3x8,
    /// Their densities, roulette included.
    pub(super) pdf: f32x8,
    /// f/p up to the next vertices.
    pub(super) throughput: Vec3x8,
    /// A bit for each lane that goes on.
    pub(super) holds: u32,
    /// The lanes in which they are single directions.
    pub(super) delta: u32,
}

/// Rays that leave vertices.
#[derive(Clone, Copy)]
pub(super) struct RaysX8 {
    pub(super) origin: Vec3x8,
    pub(super) direction: Vec3x8,
    pub(super) length: f32x8,
}

impl RaysX8 {
    pub(super) const NONE: Self = Self {
        origin: Vec3x8::ZERO,
        direction: Vec3x8::ZERO,
        length: f32x8::ZERO,
    };

    /// Lanes of `a` where `mask` is set, of `b` elsewhere.
    #[inline(always)]
    pub(super) fn select(mask: f32x8, a: Self, b: Self) -> Self {
        Self {
            origin: Vec3x8::select(mask, a.origin, b.origin),
            direction: Vec3x8::select(mask, a.direction, b.direction),
            length: mask.select(a.length, b.length),
        }
    }

    #[inline(always)]
    pub(super) fn lane(&self, lane: usize) -> Ray {
        Ray {
            origin: self.origin.lane(lane),
            direction: self.direction.lane(lane),
            length: self.length.as_array()[lane],
        }
    }
}

impl VerticesX8 {
    /// Nothing in all lanes.
    pub(super) const NONE: Self = Self {
        position: Vec3x8::ZERO,
        ng: Vec3x8::ZERO,
        ns: Vec3x8::ZERO,
        normal: Vec3x8::ZERO,
        cos_o: f32x8::ZERO,
        agrees: f32x8::ZERO,
        offset: f32x8::ZERO,
        albedo: Vec3x8::ZERO,
        survival: f32x8::ZERO,
        rough: 0,
        others: 0,
        other: Other::NONE,
    };

    /// How many numbers a vertex of a diffuse scene on a primary hit has, see [`VerticesX8::rows`].
    pub(super) const ROWS: usize = 16;

    /// Gives `put` each number of primary hits of a diffuse scene with its row. Interpolated normals are left out:
    /// nobody looks at primary hits but the camera.
    #[inline(always)]
    pub(super) fn rows(&self, mut put: impl FnMut(usize, f32x8)) {
        let vectors = [self.position, self.ng, self.normal, self.albedo];
        for (index, v) in vectors.into_iter().enumerate() {
            put(3 * index, v.x);
            put(3 * index + 1, v.y);
            put(3 * index + 2, v.z);
        }
        put(12, self.cos_o);
        put(13, self.agrees);
        put(14, self.offset);
        put(15, self.survival);
    }

    /// Primary hits whose rows `row` gives.
    #[inline(always)]
    pub(super) fn from_rows(row: impl Fn(usize) -> f32x8) -> Self {
        let vector = |index: usize| Vec3x8 {
            x: row(3 * index),
            y: row(3 * index + 1),
            z: row(3 * index + 2),
        };
        let normal = vector(2);
        Self {
            position: vector(0),
            ng: vector(1),
            ns: normal,
            normal,
            albedo: vector(3),
            cos_o: row(12),
            agrees: row(13),
            offset: row(14),
            survival: row(15),
            rough: u32::MAX,
            others: 0,
            other: Other::NONE,
        }
    }

    /// Moves to where rays arrived at triangles of these materials, as by [`End::new`]: surfaces in the lanes
    /// `surfaces`. Points on lights have position, normal and offset; where there is no hit it means
    /// nothing.
    #[inline(always)]
    pub(super) fn meet<const DIFFUSE: bool>(
        &mut self,
        scene: &Scene,
        hits: &HitsX8,
        materials: &[&Material; LANES],
        surfaces: u32,
    ) {
        self.albedo = Vec3x8::from_lanes(|lane| materials[lane].texel.colour);
        self.survival = f32x8::from_lanes(|lane| materials[lane].survival);
        (self.rough, self.others) = (surfaces, 0);
        if !DIFFUSE {
            self.meet_others(scene, hits, materials, surfaces);
        }
        let mut points = scene.mesh.points(&hits.triangle, hits.u, hits.v);
        for lane in lanes_of(surfaces) {
            if materials[lane].textures.is_some()
                && let End::Surface(vertex) = end(scene, hits, lane)
            {
                points.ns.set(lane, vertex.ns);
                self.albedo.set(lane, vertex.texel.colour);
                if !DIFFUSE {
                    self.meet_textured(scene, lane, &vertex);
                }
            }
        }
        self.position = points.position;
        self.ng = points.ng;
        self.ns = points.ns;
        self.offset = points.offset;
        let wo = -hits.direction;
        (self.normal, self.cos_o, self.agrees) = seen_from(points.ng, points.ns, wo);
    }

    /// What surfaces are that are not Lambert's, or not rough.
    #[inline(never)]
    fn meet_others(
        &mut self,
        scene: &Scene,
        hits: &HitsX8,
        materials: &[&Material; LANES],
        surfaces: u32,
    ) {
        let other = &mut self.other;
        other.kinds = Kinds::NONE;
        for lane in lanes_of(surfaces) {
            let material = materials[lane];
            set_bit(&mut self.rough, lane, material.class == Class::Rough);
            let kind = material.bsdf.kind();
            if kind != Kind::Lambert {
                self.others |= 1 << lane;
                other.kinds.set(lane, kind);
                other.material[lane] = scene.mesh.material_of[hits.triangle[lane] as usize];
            }
        }
        if self.others != 0 {
            other.wo = -hits.direction;
            other.alpha = f32x8::from_lanes(|lane| materials[lane].texel.alpha);
            other.specular = f32x8::from_lanes(|lane| materials[lane].texel.specular);
            other.metallic = f32x8::from_lanes(|lane| materials[lane].texel.metallic);
        }
    }

    /// What textures say of the surface in a lane, beside its colour.
    #[inline(never)]
    fn meet_textured(&mut self, scene: &Scene, lane: usize, vertex: &Vertex) {
        let is_rough = vertex.class(scene) == Class::Rough;
        set_bit(&mut self.rough, lane, is_rough);
        self.other.alpha.set_lane(lane, vertex.texel.alpha);
        self.other.specular.set_lane(lane, vertex.texel.specular);
        self.other.metallic.set_lane(lane, vertex.texel.metallic);
    }

    /// Puts a vertex into a lane.
    pub(super) fn set(&mut self, lane: usize, scene: &Scene, vertex: &Vertex) {
        let normal = vertex.normal();
        let cos_o = normal.dot(vertex.wo);
        let agrees = mask_of(u32::from(vertex.agrees(vertex.wo, cos_o)));
        self.position.set(lane, vertex.position);
        self.ng.set(lane, vertex.ng);
        self.ns.set(lane, vertex.ns);
        self.normal.set(lane, normal);
        self.albedo.set(lane, vertex.texel.colour);
        self.cos_o.set_lane(lane, cos_o);
        self.agrees.set_lane(lane, agrees.lane(0));
        self.offset.set_lane(lane, vertex.offset);
        self.survival.set_lane(lane, vertex.survival(scene));
        let is_rough = vertex.class(scene) == Class::Rough;
        set_bit(&mut self.rough, lane, is_rough);
        let kind = scene.materials[vertex.material as usize].bsdf.kind();
        set_bit(&mut self.others, lane, kind != Kind::Lambert);
        if kind != Kind::Lambert {
            let other = &mut self.other;
            other.wo.set(lane, vertex.wo);
            other.kinds.set(lane, kind);
            other.material[lane] = vertex.material;
            other.alpha.set_lane(lane, vertex.texel.alpha);
            other.specular.set_lane(lane, vertex.texel.specular);
            other.metallic.set_lane(lane, vertex.texel.metallic);
        }
    }

    /// Puts the vertex in lane `from` of `others` into a lane.
    pub(super) fn copy(&mut self, lane: usize, others: &Self, from: usize) {
        self.position.set(lane, others.position.lane(from));
        self.ng.set(lane, others.ng.lane(from));
        self.ns.set(lane, others.ns.lane(from));
        self.normal.set(lane, others.normal.lane(from));
        self.albedo.set(lane, others.albedo.lane(from));
        self.cos_o.set_lane(lane, others.cos_o.lane(from));
        self.agrees.set_lane(lane, others.agrees.lane(from));
        self.offset.set_lane(lane, others.offset.lane(from));
        self.survival.set_lane(lane, others.survival.lane(from));
        set_bit(&mut self.rough, lane, others.rough >> from & 1 == 1);
        let is_other = others.others >> from & 1 == 1;
        set_bit(&mut self.others, lane, is_other);
        if is_other {
            let (other, from_other) = (&mut self.other, &others.other);
            other.wo.set(lane, from_other.wo.lane(from));
            other.kinds.copy(lane, &from_other.kinds, from);
            other.material[lane] = from_other.material[from];
            other.alpha.set_lane(lane, from_other.alpha.lane(from));
            other
                .specular
                .set_lane(lane, from_other.specular.lane(from));
            other
                .metallic
                .set_lane(lane, from_other.metallic.lane(from));
        }
    }

    /// What the albedo buffer gets of the surface in a lane.
    pub(super) fn reflectance(&self, scene: &Scene, lane: usize) -> Vec3 {
        let colour = self.albedo.lane(lane);
        if self.others >> lane & 1 == 0 {
            return colour;
        }
        let other = &self.other;
        let material = &scene.materials[other.material[lane] as usize];
        let texel = Texel {
            colour,
            alpha: other.alpha.lane(lane),
            specular: other.specular.lane(lane),
            metallic: other.metallic.lane(lane),
        };
        material.bsdf.with(&texel).albedo()
    }

    /// The BSDF (with the cosine at `wi`) and its density for unit directions in the world, as by
    /// [`Vertex::eval`].
    #[inline(always)]
    pub(super) fn eval<const DIFFUSE: bool>(&self, scene: &Scene, wi: Vec3x8) -> Evals<f32x8> {
        let mut eval = self.eval_lambert((self.normal, self.cos_o, self.agrees), wi);
        if !DIFFUSE && self.others != 0 {
            self.eval_others(scene, self.normal, self.other.wo, wi, &mut eval);
        }
        eval
    }

    /// As by [`Vertex::eval_seen_from`], in diffuse scenes; not for primary hits, see [`VerticesX8::rows`].
    #[inline(always)]
    pub(super) fn eval_seen_from(&self, wo: Vec3x8, wi: Vec3x8) -> Evals<f32x8> {
        self.eval_lambert(seen_from(self.ng, self.ns, wo), wi)
    }

    /// With what [`seen_from`] says.
    #[inline(always)]
    fn eval_lambert(
        &self,
        (normal, cos_o, agrees): (Vec3x8, f32x8, f32x8),
        wi: Vec3x8,
    ) -> Evals<f32x8> {
        let cos_i = normal.dot(wi);
        let mut eval = lambert::eval(self.albedo, cos_o, cos_i);
        eval.holds &= agrees & positive(self.ng.dot(wi) * cos_i);
        eval
    }

    /// Puts what is not Lambert's into its lanes.
    #[inline(never)]
    fn eval_others(
        &self,
        scene: &Scene,
        normal: Vec3x8,
        wo: Vec3x8,
        wi: Vec3x8,
        eval: &mut Evals<f32x8>,
    ) {
        let frame = Frame::new(normal);
        let (local_o, local_i) = (frame.to_local(wo), frame.to_local(wi));
        let mut others = self.packed(scene).eval(local_o, local_i);
        others.holds &= self.agree(wo, local_o.z) & self.agree(wi, local_i.z);
        *eval = Evals::select(mask_of(self.others), others, *eval);
    }

    /// As by [`Vertex::agrees`].
    #[inline(always)]
    fn agree(&self, direction: Vec3x8, cos: f32x8) -> f32x8 {
        positive(self.ng.dot(direction) * cos)
    }

    /// The BSDFs of the lanes `others`.
    #[inline(always)]
    fn packed<'a>(&'a self, scene: &'a Scene) -> Packed<f32x8, impl Fn(usize) -> &'a Bsdf> {
        let other = &self.other;
        Packed {
            kinds: other.kinds,
            bsdf: move |lane: usize| &scene.materials[other.material[lane] as usize].bsdf,
            texels: Texels {
                colour: self.albedo,
                alpha: other.alpha,
                specular: other.specular,
                metallic: other.metallic,
            },
        }
    }

    /// Draws directions for paths that arrive at x_k with `throughput`, as by [`Vertex::sample`], with the
    /// numbers of [`draw_bsdf`].
    #[inline(always)]
    pub(super) fn scatter<const DIFFUSE: bool>(
        &self,
        scene: &Scene,
        k: u32,
        throughput: Vec3x8,
        u: &[f32x8; 4],
    ) -> ScatteringX8 {
        let &[u0, u1, _, u_roulette] = u;
        let survival = self.survival(k);
        let frame = Frame::new(self.normal);
        let mut sampled = lambert::sample(self.albedo, self.cos_o, [u0, u1]);
        if !DIFFUSE && self.others != 0 {
            self.sample_others(scene, &frame, u, &mut sampled);
        }
        let Samples {
            wi: local, eval, ..
        } = sampled;
        let wi = frame.to_world(local).normalize();
        let pdf = eval.pdf * survival;
        let holds = eval.holds & self.agree(wi, local.z) & u_roulette.simd_lt(survival);
        ScatteringX8 {
            wi,
            pdf,
            throughput: throughput * eval.value * (f32x8::ONE / pdf),
            holds: holds.to_bitmask(),
            delta: sampled.delta.to_bitmask(),
        }
    }

    /// Puts what is not Lambert's into its lanes.
    #[inline(never)]
    fn sample_others(
        &self,
        scene: &Scene,
        frame: &Frame<f32x8>,
        &[u0, u1, u_lobe, _]: &[f32x8; 4],
        sampled: &mut Samples<f32x8>,
    ) {
        let wo = frame.to_local(self.other.wo);
        let others = self.packed(scene).sample(wo, [u0, u1, u_lobe]);
        *sampled = Samples::select(mask_of(self.others), others, *sampled);
    }

    /// Probability that a path goes on from here as its vertex x_k.
    #[inline(always)]
    pub(super) fn survival(&self, k: u32) -> f32x8 {
        if k < ROULETTE_FROM {
            f32x8::ONE
        } else {
            self.survival
        }
    }

    /// Rays in these unit directions, without end, as by [`Vertex::ray`].
    #[inline(always)]
    pub(super) fn rays(&self, direction: Vec3x8) -> RaysX8 {
        RaysX8 {
            origin: offset_origin(self.position, self.ng, self.offset, direction),
            direction,
            length: f32x8::splat(f32::INFINITY),
        }
    }

    /// Rays to just before points on surfaces, as by [`Vertex::ray_to`].
    #[inline(always)]
    pub(super) fn rays_to(&self, position: Vec3x8, ng: Vec3x8, offset: f32x8) -> RaysX8 {
        let towards = position - self.position;
        let origin = offset_origin(self.position, self.ng, self.offset, towards);
        let end = offset_origin(position, ng, offset, -towards);
        RaysX8 {
            origin,
            direction: end - origin,
            length: f32x8::ONE,
        }
    }

    /// Connects paths that arrive at x_k with `throughput` to lights.
    #[inline(always)]
    pub(super) fn connect<const DIFFUSE: bool>(
        &self,
        k: u32,
        throughput: Vec3x8,
        light: &LightSamplesX8,
        scene: &Scene,
    ) -> ConnectedX8 {
        let seen = self.see::<DIFFUSE>(light);
        let eval = self.eval::<DIFFUSE>(scene, seen.wi);
        let arriving = light.radiance * seen.per_density;
        ConnectedX8 {
            wi: seen.wi,
            arriving,
            per_density: seen.per_density,
            value: throughput * eval.value * arriving,
            by_bsdf: eval.pdf * self.survival(k) * seen.per_density,
            holds: (seen.holds & eval.holds).to_bitmask(),
        }
    }

    /// The lights as they are seen from here.
    #[inline(always)]
    pub(super) fn see<const DIFFUSE: bool>(&self, light: &LightSamplesX8) -> SeenX8 {
        let seen = Seen::new(self.position, light.position, light.ng);
        let from_front = negative(light.ng.dot(seen.direction));
        let mut on_surface = SeenX8 {
            wi: seen.direction,
            per_density: seen.solid_angle_per_area / light.density,
            holds: light.holds & seen.holds & from_front,
        };
        if !DIFFUSE && light.sky != 0 {
            let sky = mask_of(light.sky);
            let (wi, per_density) = (light.position, f32x8::ONE / light.density);
            on_surface.wi = Vec3x8::select(sky, wi, on_surface.wi);
            on_surface.per_density = sky.select(per_density, on_surface.per_density);
            on_surface.holds = sky.select(light.holds, on_surface.holds);
        }
        on_surface
    }

    /// The rays to them.
    #[inline(always)]
    pub(super) fn shadow_rays<const DIFFUSE: bool>(&self, light: &LightSamplesX8) -> RaysX8 {
        let rays = self.rays_to(light.position, light.ng, light.offset);
        if DIFFUSE || light.sky == 0 {
            return rays;
        }
        RaysX8::select(mask_of(light.sky), self.rays(light.position), rays)
    }
}

/// Points on lights as they are seen from vertices.
pub(super) struct SeenX8 {
    /// Unit directions to them.
    pub(super) wi: Vec3x8,
    /// One over the densities per solid angle.
    pub(super) per_density: f32x8,
    /// Where there is a light, and it is seen from its front.
    pub(super) holds: f32x8,
}

/// Paths that arrive at vertices, connected to points on lights.
pub(super) struct ConnectedX8 {
    /// Unit directions to the lights.
    pub(super) wi: Vec3x8,
    /// What arrives from there.
    pub(super) arriving: Vec3x8,
    /// One over the densities per solid angle.
    pub(super) per_density: f32x8,
    /// The paths' values over the density, if nothing blocks them.
    pub(super) value: Vec3x8,
    /// Densities of BSDF sampling, over those of light sampling.
    pub(super) by_bsdf: f32x8,
    /// A bit for each lane with a connection.
    pub(super) holds: u32,
}

/// The normals to shade with as seen from the directions `wo`, their cosines to it, and whether both
/// normals are on that side.
#[inline(always)]
fn seen_from(ng: Vec3x8, ns: Vec3x8, wo: Vec3x8) -> (Vec3x8, f32x8, f32x8) {
    let (by_ng, by_ns) = (ng.dot(wo), ns.dot(wo));
    let same_side = !(positive(by_ns) ^ positive(by_ng));
    let cos_o = same_side.select(by_ns, by_ng);
    let normal = Vec3x8::select(same_side, ns, ng);
    (normal, cos_o, positive(by_ng * cos_o))
}

/// The numbers for light sampling at x_k.
pub(super) fn draw_light<'a>(
    samplers: impl IntoIterator<Item = &'a [Sampler; LANES]>,
    k: u32,
    numbers: &mut Vec<[f32x8; 4]>,
) {
    sampler::draw_blocks(samplers, Dimension::Light(k), [0, 1, 2], numbers);
}

/// The numbers for scattering at x_k: the lobe where it matters, and no roulette at the first vertices.
pub(super) fn draw_bsdf<'a, const DIFFUSE: bool>(
    samplers: impl IntoIterator<Item = &'a [Sampler; LANES]>,
    k: u32,
    numbers: &mut Vec<[f32x8; 4]>,
) {
    let dimension = Dimension::Bsdf(k);
    if !DIFFUSE {
        sampler::draw_blocks(samplers, dimension, [0, 1, 2, 3], numbers);
    } else if k < ROULETTE_FROM {
        sampler::draw_blocks(samplers, dimension, [0, 1], numbers);
    } else {
        sampler::draw_blocks(samplers, dimension, [0, 1, 3], numbers);
    }
}

#[inline(always)]
fn set_bit(bits: &mut u32, lane: usize, value: bool) {
    *bits = *bits & !(1 << lane) | u32::from(value) << lane;
}
