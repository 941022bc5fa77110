//! Eight vertices at once: how they scatter, and the rays that leave them.
//!
//! `DIFFUSE` says that the scene is diffuse: then all are Lambert's, and there is no code for anything else.

use super::{Vertex, textured};
use crate::bsdf::packed::{Kind, Kinds, Packed, PackedParameters};
use crate::bsdf::{Bsdf, Evals, Parameters, Samples, half_vector, lambert};
use crate::frame::Frame;
use crate::geometry::{Site, offset_origin, segment};
use crate::lanes::{Float, LANES, Vec3x8, Vector, copy_bit, lanes_of, mask_of, positive, set_bit};
use crate::scene::Scene;
use crate::scene::material::{Class, Material};
use crate::scene::textured::Textures;
use crate::trace::rays::{HitsX8, Ray};
use glam::Vec3;
use wide::f32x8;

/// Russian roulette starts at this vertex. It depends on the material alone, so its probabilities are
/// the same for what base and offset path share; where they do not share they are part of p.
pub const ROULETTE_FROM: u32 = 4;

/// [`Vertex`] in lanes.
#[derive(Clone, Debug)]
pub struct VerticesX8 {
    /// Where they are.
    pub position: Vec3x8,
    /// Geometric normals.
    pub ng: Vec3x8,
    /// Interpolated shading normals.
    ns: Vec3x8,
    /// The normals to shade with, as seen from where the paths came from.
    pub normal: Vec3x8,
    /// Their cosines to the directions to there.
    cos_o: f32x8,
    /// Whether both normals are on that side.
    agrees: f32x8,
    /// Distances by which rays start off the surfaces.
    pub offset: f32x8,
    /// What [`Bsdf::colour`] is: of Lambert surfaces the albedo.
    albedo: Vec3x8,
    survival: f32x8,
    /// A bit for each lane whose surface is of class rough.
    pub rough: u32,
    /// The lanes whose surfaces are not Lambert's; in diffuse scenes none.
    others: u32,
    more: More,
}

/// What is known of vertices in scenes that are not diffuse; it means nothing in those that are.
#[derive(Clone, Debug)]
struct More {
    /// Unit directions to the previous vertices.
    wo: Vec3x8,
    /// Indices into [`Scene::materials`].
    material: [u32; LANES],
    /// Of the lanes `others`.
    kinds: Kinds,
    /// GGX roughness where there is one.
    alpha: f32x8,
    /// Factor on the reflectance of plastic's coat.
    specular: f32x8,
    /// Share of plastic that is metal.
    metallic: f32x8,
}

impl More {
    const NONE: Self = Self {
        wo: Vec3x8::ZERO,
        material: [0; LANES],
        kinds: Kinds::NONE,
        alpha: f32x8::ZERO,
        specular: f32x8::ZERO,
        metallic: f32x8::ZERO,
    };
}

/// Paths that have scattered.
#[derive(Clone, Copy, Debug)]
pub struct ScatteringX8 {
    /// Unit directions in the world.
    pub wi: Vec3x8,
    /// The same in the vertices' frames.
    pub local_wi: Vec3x8,
    /// The BSDFs with the cosines.
    pub value: Vec3x8,
    /// Densities of the directions, roulette included.
    pub pdf: f32x8,
    /// A bit for each lane that goes on.
    pub valid: u32,
    /// The lanes in which they are single directions.
    pub delta: u32,
    /// The lanes in which they go through the surface.
    pub transmits: u32,
}

impl ScatteringX8 {
    /// In no lane.
    pub const NONE: Self = Self {
        wi: Vec3x8::ZERO,
        local_wi: Vec3x8::ZERO,
        value: Vec3x8::ZERO,
        pdf: f32x8::ZERO,
        valid: 0,
        delta: 0,
        transmits: 0,
    };

    /// f/p up to the next vertices, of paths that arrived with `throughput`.
    #[inline(always)]
    pub fn carry(&self, throughput: Vec3x8) -> Vec3x8 {
        throughput * self.value * (f32x8::ONE / self.pdf)
    }
}

/// Rays that leave vertices.
#[derive(Clone, Copy, Debug)]
pub struct RaysX8 {
    /// Where they start.
    pub origin: Vec3x8,
    /// Where they go.
    pub direction: Vec3x8,
    /// How far, in units of the directions' lengths.
    pub length: f32x8,
}

impl RaysX8 {
    /// None.
    pub const NONE: Self = Self {
        origin: Vec3x8::ZERO,
        direction: Vec3x8::ZERO,
        length: f32x8::ZERO,
    };

    /// Lanes of `a` where `mask` is set, of `b` elsewhere.
    #[inline(always)]
    pub fn select(mask: f32x8, a: Self, b: Self) -> Self {
        Self {
            origin: Vec3x8::select(mask, a.origin, b.origin),
            direction: Vec3x8::select(mask, a.direction, b.direction),
            length: mask.select(a.length, b.length),
        }
    }

    /// The ray in a lane.
    #[inline(always)]
    pub fn lane(&self, lane: usize) -> Ray {
        Ray {
            origin: self.origin.lane(lane),
            direction: self.direction.lane(lane),
            length: self.length.lane(lane),
        }
    }
}

impl VerticesX8 {
    /// Nothing in all lanes.
    pub const NONE: Self = Self {
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
        more: More::NONE,
    };

    /// Makes it nothing in all lanes; the numbers stay.
    #[inline(always)]
    pub fn clear(&mut self) {
        (self.rough, self.others) = (0, 0);
        self.more.kinds = Kinds::NONE;
    }

    /// How many numbers a vertex of a diffuse scene on a primary hit has, see [`VerticesX8::rows`].
    pub const ROWS: usize = 16;

    /// Gives `put` each number of primary hits of a diffuse scene with its row. Interpolated normals are left out:
    /// nobody looks at primary hits but the camera.
    #[inline(always)]
    pub fn rows(&self, mut put: impl FnMut(usize, f32x8)) {
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
    pub fn from_rows(row: impl Fn(usize) -> f32x8) -> Self {
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
            more: More::NONE,
        }
    }

    /// Moves to where rays arrived at triangles of these materials, as by
    /// [`Interaction::new`](super::Interaction::new): surfaces in the lanes `surfaces`. Points on lights have position,
    /// normal and offset; where there is no hit it means nothing.
    #[inline(always)]
    pub fn meet<const DIFFUSE: bool>(
        &mut self,
        scene: &Scene,
        hits: &HitsX8,
        materials: &[&Material; LANES],
        surfaces: u32,
    ) {
        self.albedo = Vec3x8::from_lanes(|lane| materials[lane].parameters.colour);
        self.survival = f32x8::from_lanes(|lane| materials[lane].survival);
        (self.rough, self.others) = (surfaces, 0);
        if !DIFFUSE {
            self.meet_others(scene, hits, materials, surfaces);
        }
        let mut points = scene.mesh.points(&hits.triangle, hits.u, hits.v);
        for lane in lanes_of(surfaces) {
            if let Some(textures) = &materials[lane].textures {
                let normals = (points.ng.lane(lane), points.ns.lane(lane));
                let hit = hits.lane(lane);
                let (parameters, ns) = textured(scene, materials[lane], textures, hit, normals);
                points.ns.set(lane, ns);
                self.albedo.set(lane, parameters.colour);
                if !DIFFUSE {
                    self.meet_textured(lane, materials[lane], textures, &parameters);
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
        let more = &mut self.more;
        more.wo = -hits.direction;
        more.material = hits.triangle.map(|t| scene.mesh.material_of[t as usize]);
        more.kinds = Kinds::NONE;
        for lane in lanes_of(surfaces) {
            let material = materials[lane];
            set_bit(&mut self.rough, lane, material.class == Class::Rough);
            let kind = material.bsdf.kind();
            if kind != Kind::Lambert {
                self.others |= 1 << lane;
                more.kinds.set(lane, kind);
            }
        }
        if self.others != 0 {
            more.alpha = f32x8::from_lanes(|lane| materials[lane].parameters.alpha);
            more.specular = f32x8::from_lanes(|lane| materials[lane].parameters.specular);
            more.metallic = f32x8::from_lanes(|lane| materials[lane].parameters.metallic);
        }
    }

    /// What textures say of the surface in a lane, beside its colour.
    #[inline(never)]
    fn meet_textured(
        &mut self,
        lane: usize,
        material: &Material,
        textures: &Textures,
        parameters: &Parameters,
    ) {
        let class = textures.class(&material.bsdf, parameters, material.class);
        set_bit(&mut self.rough, lane, class == Class::Rough);
        self.more.alpha.set_lane(lane, parameters.alpha);
        self.more.specular.set_lane(lane, parameters.specular);
        self.more.metallic.set_lane(lane, parameters.metallic);
    }

    /// This vertex in all lanes.
    pub fn splat(scene: &Scene, vertex: &Vertex) -> Self {
        let kind = scene.materials[vertex.material as usize].bsdf.kind();
        let all = |yes: bool| if yes { 255 } else { 0 };
        let (ng, ns, wo) = (vertex.ng, vertex.ns, vertex.wo);
        let [ng, ns, wo] = [ng, ns, wo].map(Vec3x8::splat);
        let (normal, cos_o, agrees) = seen_from(ng, ns, wo);
        let mut kinds = Kinds::NONE;
        (0..LANES).for_each(|lane| kinds.set(lane, kind));
        Self {
            position: Vec3x8::splat(vertex.position),
            ng,
            ns,
            normal,
            cos_o,
            agrees,
            offset: f32x8::splat(vertex.offset),
            albedo: Vec3x8::splat(vertex.parameters.colour),
            survival: f32x8::splat(vertex.survival(scene)),
            rough: all(vertex.class(scene) == Class::Rough),
            others: all(kind != Kind::Lambert),
            more: More {
                wo,
                material: [vertex.material; LANES],
                kinds,
                alpha: f32x8::splat(vertex.parameters.alpha),
                specular: f32x8::splat(vertex.parameters.specular),
                metallic: f32x8::splat(vertex.parameters.metallic),
            },
        }
    }

    /// Puts the vertex in lane `from` of `others` into a lane.
    #[inline(always)]
    pub fn copy<const DIFFUSE: bool>(&mut self, lane: usize, others: &Self, from: usize) {
        self.position.set(lane, others.position.lane(from));
        self.ng.set(lane, others.ng.lane(from));
        self.ns.set(lane, others.ns.lane(from));
        self.normal.set(lane, others.normal.lane(from));
        self.albedo.set(lane, others.albedo.lane(from));
        self.cos_o.set_lane(lane, others.cos_o.lane(from));
        self.agrees.set_lane(lane, others.agrees.lane(from));
        self.offset.set_lane(lane, others.offset.lane(from));
        self.survival.set_lane(lane, others.survival.lane(from));
        copy_bit(&mut self.rough, lane, others.rough, from);
        if !DIFFUSE {
            self.copy_more(lane, others, from);
        }
    }

    #[inline(always)]
    fn copy_more(&mut self, lane: usize, others: &Self, from: usize) {
        let is_other = others.others >> from & 1 == 1;
        copy_bit(&mut self.others, lane, others.others, from);
        let (to, from_more) = (&mut self.more, &others.more);
        to.wo.set(lane, from_more.wo.lane(from));
        to.material[lane] = from_more.material[from];
        if is_other {
            to.kinds.copy(lane, &from_more.kinds, from);
            to.alpha.set_lane(lane, from_more.alpha.lane(from));
            to.specular.set_lane(lane, from_more.specular.lane(from));
            to.metallic.set_lane(lane, from_more.metallic.lane(from));
        }
    }

    fn parameters(&self, lane: usize) -> Parameters {
        Parameters {
            colour: self.albedo.lane(lane),
            alpha: self.more.alpha.lane(lane),
            specular: self.more.specular.lane(lane),
            metallic: self.more.metallic.lane(lane),
        }
    }

    /// What the albedo buffer gets of the surface in a lane.
    pub fn reflectance(&self, scene: &Scene, lane: usize) -> Vec3 {
        if self.others >> lane & 1 == 0 {
            return self.albedo.lane(lane);
        }
        let bsdf = self.bsdf(scene, lane);
        bsdf.with(&self.parameters(lane)).albedo()
    }

    /// The BSDF (with the cosine at `wi`) and its density for unit directions `wi` in the world. It does not hold
    /// where sampling cannot produce `wi`, also because shading and geometric normal disagree about its side.
    #[inline(always)]
    pub fn eval<const DIFFUSE: bool>(&self, scene: &Scene, wi: Vec3x8) -> Evals<f32x8> {
        let mut eval = self.eval_lambert((self.normal, self.cos_o, self.agrees), wi);
        if !DIFFUSE && self.others != 0 {
            self.eval_others(scene, self.normal, self.more.wo, wi, &mut eval);
        }
        eval
    }

    /// As [`VerticesX8::eval`], seen from other vertices in the unit directions `wo`; in diffuse scenes not for
    /// primary hits, see [`VerticesX8::rows`].
    #[inline(always)]
    pub fn eval_seen_from<const DIFFUSE: bool>(
        &self,
        scene: &Scene,
        wo: Vec3x8,
        wi: Vec3x8,
    ) -> Evals<f32x8> {
        let seen = seen_from(self.ng, self.ns, wo);
        let mut eval = self.eval_lambert(seen, wi);
        if !DIFFUSE && self.others != 0 {
            self.eval_others(scene, seen.0, wo, wi, &mut eval);
        }
        eval
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
        eval.valid &= agrees & self.agree(wi, cos_i);
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
        others.valid &= self.agree(wo, local_o.z) & self.agree(wi, local_i.z);
        *eval = Evals::select(mask_of(self.others), others, *eval);
    }

    /// [`Bsdf::eval`] for local directions.
    #[inline(always)]
    pub fn eval_local(&self, scene: &Scene, wo: Vec3x8, wi: Vec3x8) -> Evals<f32x8> {
        let mut eval = lambert::eval(self.albedo, wo.z, wi.z);
        if self.others != 0 {
            let others = self.packed(scene).eval(wo, wi);
            eval = Evals::select(mask_of(self.others), others, eval);
        }
        eval
    }

    /// [`Bsdf::eval_delta`] for local directions.
    #[inline(always)]
    pub fn eval_delta(&self, scene: &Scene, wo: Vec3x8, transmits: f32x8) -> Evals<f32x8> {
        let mut eval = self.packed(scene).eval_delta(wo, transmits);
        eval.valid &= mask_of(self.others);
        eval
    }

    /// Where a direction, whose cosine to the shading normal is `cos`, is on the same side of the triangle.
    #[inline(always)]
    pub fn agree(&self, direction: Vec3x8, cos: f32x8) -> f32x8 {
        positive(self.ng.dot(direction) * cos)
    }

    /// The BSDFs of the lanes that are not Lambert's.
    #[inline(always)]
    fn packed<'a>(&'a self, scene: &'a Scene) -> Packed<f32x8, impl Fn(usize) -> &'a Bsdf> {
        let more = &self.more;
        Packed {
            kinds: more.kinds,
            bsdf: |lane: usize| self.bsdf(scene, lane),
            parameters: PackedParameters {
                colour: self.albedo,
                alpha: more.alpha,
                specular: more.specular,
                metallic: more.metallic,
            },
        }
    }

    /// The BSDF in a lane, textures aside.
    #[inline(always)]
    pub fn bsdf<'a>(&self, scene: &'a Scene, lane: usize) -> &'a Bsdf {
        &scene.materials[self.more.material[lane] as usize].bsdf
    }

    /// The index into [`Scene::materials`] in a lane, in scenes that are not diffuse.
    pub fn material(&self, lane: usize) -> u32 {
        self.more.material[lane]
    }

    /// Unit directions to the previous vertices, in scenes that are not diffuse.
    #[inline(always)]
    pub fn wo(&self) -> Vec3x8 {
        self.more.wo
    }

    /// Draws directions with the numbers `u` in [0, 1)⁴: direction (0, 1), lobe (2) and Russian roulette at x_k (3).
    /// It does not hold where the path ends.
    #[inline(always)]
    pub fn scatter<const DIFFUSE: bool>(
        &self,
        scene: &Scene,
        k: u32,
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
            wi: local_wi, eval, ..
        } = sampled;
        let wi = frame.to_world(local_wi).normalize();
        let valid = eval.valid & self.agree(wi, local_wi.z) & u_roulette.simd_lt(survival);
        ScatteringX8 {
            wi,
            local_wi,
            value: eval.value,
            pdf: eval.pdf * survival,
            valid: valid.to_bitmask(),
            delta: sampled.delta.to_bitmask(),
            transmits: sampled.transmits.to_bitmask(),
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
        let wo = frame.to_local(self.more.wo);
        let others = self.packed(scene).sample(wo, [u0, u1, u_lobe]);
        *sampled = Samples::select(mask_of(self.others), others, *sampled);
    }

    /// The lanes whose surfaces are of class specular and spread light even so; in scenes that are not diffuse.
    #[inline(always)]
    pub fn spreading(&self) -> u32 {
        self.others & !self.rough & self.more.kinds.spreading()
    }

    /// The local normal, unit, `z` > 0, of the microfacet that has reflected a path in a lane.
    pub fn microfacet(&self, scattering: &ScatteringX8, lane: usize) -> Vec3 {
        let frame = Frame::<f32>::new(self.normal.lane(lane).into());
        let wo = frame.to_local(self.more.wo.lane(lane).into());
        let wi = Vector::from(scattering.local_wi.lane(lane));
        let (normal, _) = half_vector::from_directions(1.0, wo, wi);
        normal.upwards().into()
    }

    /// Probability that a path goes on from here as its vertex x_k.
    #[inline(always)]
    pub fn survival(&self, k: u32) -> f32x8 {
        if k < ROULETTE_FROM {
            f32x8::ONE
        } else {
            self.survival
        }
    }

    /// Rays in these unit directions, without end.
    #[inline(always)]
    pub fn rays(&self, direction: Vec3x8) -> RaysX8 {
        RaysX8 {
            origin: offset_origin(self.position, self.ng, self.offset, direction),
            direction,
            length: f32x8::splat(f32::INFINITY),
        }
    }

    /// Rays to just before points on surfaces with normals `ng`.
    #[inline(always)]
    pub fn rays_to(&self, position: Vec3x8, ng: Vec3x8, offset: f32x8) -> RaysX8 {
        let from = Site {
            position: self.position,
            ng: self.ng,
            offset: self.offset,
        };
        let to = Site {
            position,
            ng,
            offset,
        };
        let (origin, direction) = segment(from, to);
        RaysX8 {
            origin,
            direction,
            length: f32x8::ONE,
        }
    }
}

/// The normals to shade with as seen from the directions `wo`, their cosines to it, and whether both
/// normals are on that side. From the front of the triangle but from behind the shading normal (or the other way
/// round) there is nothing to shade with: then it is the geometric one. It depends on who looks, so base and offset
/// path must each have their own.
#[inline(always)]
fn seen_from(ng: Vec3x8, ns: Vec3x8, wo: Vec3x8) -> (Vec3x8, f32x8, f32x8) {
    let (by_ng, by_ns) = (ng.dot(wo), ns.dot(wo));
    let same_side = !(positive(by_ns) ^ positive(by_ng));
    let cos_o = same_side.select(by_ns, by_ng);
    let normal = Vec3x8::select(same_side, ns, ng);
    (normal, cos_o, positive(by_ng * cos_o))
}
