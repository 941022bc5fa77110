//! What eight rays have met.

use super::vertices::VerticesX8;
use crate::lanes::{Float, LANES, Vec3x8, lanes_of};
use crate::path::Context;
use crate::path::by_light::{ByLight, radiance};
use crate::scene::Scene;
use crate::scene::material::Material;
use crate::trace::rays::HitsX8;
use crate::vertex::End;
use wide::f32x8;

/// How rays left x_k.
#[derive(Clone, Copy)]
pub(super) struct Left {
    /// Where.
    pub(super) from: Vec3x8,
    /// Densities of the directions, roulette included.
    pub(super) pdf: f32x8,
    /// A bit for each lane whose scattering event is of class rough, so that light sampling could have made it.
    pub(super) rough: u32,
}

/// The ends of the segments from x_k to x_{k+1}.
pub(super) struct Arrival<'a> {
    /// Of the triangles.
    materials: [&'a Material; LANES],
    /// The lanes that go on from a surface.
    pub(super) surfaces: u32,
    /// The lanes that have reached light.
    pub(super) ends: u32,
    /// What they found there.
    pub(super) radiance: Vec3x8,
    /// Density of light sampling there, over that of BSDF sampling.
    pub(super) by_light: f32x8,
}

impl<'a> Arrival<'a> {
    /// Where the rays `rays` arrived, which left x_k as `left` says.
    #[inline(always)]
    pub(super) fn new(context: Context<'a>, k: u32, hits: &HitsX8, rays: u32, left: Left) -> Self {
        let scene = context.scene;
        let materials = materials(scene, hits);
        let lights = lights(&materials, hits);
        // At the last vertex only light counts.
        let goes_on = k + 2 <= context.settings.depth;
        let mut arrival = Self {
            materials,
            surfaces: if goes_on { hits.found & !lights } else { 0 },
            ends: 0,
            radiance: Vec3x8::ZERO,
            by_light: f32x8::ZERO,
        };
        let mut ends = lights;
        if !scene.environment.is_black() {
            ends |= rays & !hits.found;
        }
        for lane in lanes_of(ends) {
            let end = end(scene, hits, lane);
            // Light sampling leaves the backs of lights out, and so does everything else.
            if matches!(&end, End::Light(light) if !light.front) {
                continue;
            }
            let (from, wi) = (left.from.lane(lane), hits.direction.lane(lane));
            arrival.ends |= 1 << lane;
            arrival.radiance.set(lane, radiance(scene, &end, wi));
            if left.rough >> lane & 1 == 1 {
                let by_light = ByLight::of(scene, from, &end, wi, left.pdf.lane(lane));
                let density = by_light.density(scene, from);
                arrival.by_light.set_lane(lane, density);
            }
        }
        arrival
    }

    /// Moves `vertices` to x_{k+1}, also where it is on a light.
    #[inline(always)]
    pub(super) fn put<const DIFFUSE: bool>(
        &self,
        scene: &Scene,
        hits: &HitsX8,
        vertices: &mut VerticesX8,
    ) {
        vertices.meet::<DIFFUSE>(scene, hits, &self.materials, self.surfaces);
    }
}

/// Moves `vertices` to primary hits; the lanes in which they are surfaces.
#[inline(always)]
pub(super) fn primary(scene: &Scene, hits: &HitsX8, vertices: &mut VerticesX8) -> u32 {
    let materials = materials(scene, hits);
    let surfaces = hits.found & !lights(&materials, hits);
    if scene.is_diffuse() {
        vertices.meet::<true>(scene, hits, &materials, surfaces);
    } else {
        vertices.meet::<false>(scene, hits, &materials, surfaces);
    }
    surfaces
}

/// What the ray in a lane met.
pub(super) fn end(scene: &Scene, hits: &HitsX8, lane: usize) -> End {
    let hit = (hits.found >> lane & 1 == 1).then(|| hits.lane(lane));
    End::new(scene, hit, hits.direction.lane(lane))
}

/// The triangles' materials.
#[inline(always)]
fn materials<'a>(scene: &'a Scene, hits: &HitsX8) -> [&'a Material; LANES] {
    let mut materials = [&scene.materials[0]; LANES];
    for (material, &triangle) in materials.iter_mut().zip(&hits.triangle) {
        let index = scene.mesh.material_of[triangle as usize];
        *material = &scene.materials[index as usize];
    }
    materials
}

/// A bit for each lane whose ray met a light.
#[inline(always)]
fn lights(materials: &[&Material; LANES], hits: &HitsX8) -> u32 {
    let emits = |lane: usize| u32::from(materials[lane].emission.is_some()) << lane;
    (0..LANES).fold(0, |bits, lane| bits | emits(lane)) & hits.found
}
