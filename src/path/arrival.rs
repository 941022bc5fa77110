//! What eight rays have met.

use super::Context;
use super::by_light::ByLight;
use crate::lanes::{Float, LANES, Vec3x8, lanes_of, mask_of};
use crate::scene::Scene;
use crate::scene::environment::Environment;
use crate::scene::material::Material;
use crate::trace::rays::HitsX8;
use crate::vertex::{Interaction, VerticesX8};
use wide::f32x8;

/// How rays left x_k.
#[derive(Clone, Copy)]
pub(super) struct Left {
    /// Where.
    pub(super) from: Vec3x8,
    /// Densities of the directions, roulette included.
    pub(super) pdf: f32x8,
    /// A bit for each lane whose direction light sampling could have drawn.
    pub(super) lit: u32,
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
    /// How light sampling would have found it.
    ways: [ByLight; LANES],
    /// Its density from x_k, over that of BSDF sampling.
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
            ways: [ByLight::Never; LANES],
            by_light: f32x8::ZERO,
        };
        for lane in lanes_of(lights) {
            let end = Interaction::in_lane(scene, hits, lane);
            // Light sampling leaves the backs of lights out, and so does everything else.
            if let Interaction::Light(light) = &end
                && light.front
            {
                arrival.ends |= 1 << lane;
                arrival.radiance.set(lane, light.radiance);
                if left.lit >> lane & 1 == 1 {
                    let (from, wi) = (left.from.lane(lane), hits.direction.lane(lane));
                    let way = ByLight::of(scene, from, &end, wi, left.pdf.lane(lane));
                    arrival.by_light.set_lane(lane, way.density(scene, from));
                    arrival.ways[lane] = way;
                }
            }
        }
        let open = rays & !hits.found;
        if open != 0 && !scene.environment.is_black() {
            arrival.see(scene, hits.direction, open, left);
        }
        arrival
    }

    /// Finds the environment in the lanes `open`.
    fn see(&mut self, scene: &Scene, directions: Vec3x8, open: u32, left: Left) {
        self.ends |= open;
        let radiance = match &scene.environment {
            // It is not sampled as a light.
            Environment::Constant(radiance) => Vec3x8::splat(*radiance),
            Environment::Map(map) => {
                let seen = map.seen(directions, open);
                let lit = open & left.lit;
                if lit != 0 {
                    let by_light = f32x8::splat(scene.lights.sky()) * seen.density() / left.pdf;
                    self.by_light = mask_of(lit).select(by_light, self.by_light);
                    for lane in lanes_of(lit) {
                        self.ways[lane] = ByLight::Sky(by_light.lane(lane));
                    }
                }
                seen.radiance()
            }
        };
        self.radiance = Vec3x8::select(mask_of(open), radiance, self.radiance);
    }

    /// Density of light sampling from other vertices in the lanes `others`, over that of BSDF sampling at x_k.
    #[inline(always)]
    pub(super) fn by_light_from(&self, scene: &Scene, from: Vec3x8, others: u32) -> f32x8 {
        let mut by_light = self.by_light;
        if scene.lights.depend_on_place() {
            for lane in lanes_of(self.ends & others) {
                by_light.set_lane(lane, self.ways[lane].density(scene, from.lane(lane)));
            }
        }
        by_light
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

/// Moves `vertices` to where rays have met something; the lanes in which they are surfaces.
#[inline(always)]
pub(super) fn meet<const DIFFUSE: bool>(
    scene: &Scene,
    hits: &HitsX8,
    vertices: &mut VerticesX8,
) -> u32 {
    // There may be no triangle at all.
    if hits.found == 0 {
        return 0;
    }
    let materials = materials(scene, hits);
    let surfaces = hits.found & !lights(&materials, hits);
    vertices.meet::<DIFFUSE>(scene, hits, &materials, surfaces);
    surfaces
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
