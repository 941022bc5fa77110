//! What denoisers like to know of pixels: albedo and normal of what is seen. A mirror's own say nothing of the edges in
//! it, so behind surfaces that send light on in single directions it is what these show that counts.

use super::{Context, Counts, Tile, arrival, trace_closest};
use crate::lanes::{LANES, Vec3x8, lanes_of, negative};
use crate::sampler::Sampler;
use crate::sums::{Auxiliary, TileSums};
use crate::trace::RayKind;
use crate::trace::rays::{ClosestBatch, HitsX8};
use crate::vertex::{Interaction, VerticesX8};
use glam::Vec3;
use wide::f32x8;

/// After so many surfaces it is the last one that counts.
const MOST: u32 = 12;

/// Camera rays at surfaces that send them on in single directions.
#[derive(Default)]
pub(super) struct Glimpses {
    going_on: Vec<Glimpse>,
    rays: ClosestBatch,
}

/// Eight of them.
struct Glimpse {
    vertices: VerticesX8,
    /// A bit for each lane that is under way.
    lanes: u32,
    /// The pixels of the tile.
    pixels: [u32; LANES],
    /// The product of what the surfaces so far leave of light.
    seen: Vec3x8,
    /// Where the rays come from.
    ray: [u32; LANES],
    direction: Vec3x8,
}

/// Shading normals on the side from which rays of these directions came.
pub(super) fn normals(vertices: &VerticesX8, direction: Vec3x8) -> Vec3x8 {
    let behind = negative(vertices.ng.dot(-direction));
    Vec3x8::select(behind, -vertices.normal, vertices.normal)
}

/// Adds light that is seen.
pub(super) fn add_light(sums: &mut Auxiliary, radiance: Vec3, normal: Vec3, seen: Vec3) {
    sums.features(seen * radiance.min(Vec3::ONE), normal);
}

impl Glimpses {
    /// Rays of `pixels` in `lanes` have met `vertices`, which send them on.
    pub(super) fn push(&mut self, vertices: &VerticesX8, lanes: u32, pixels: [u32; LANES]) {
        self.going_on.push(Glimpse {
            vertices: vertices.clone(),
            lanes,
            pixels,
            seen: Vec3x8::ONE,
            ray: [0; LANES],
            direction: Vec3x8::ZERO,
        });
    }

    /// Follows all to what they show, and adds that to the sums of their pixels.
    pub(super) fn follow(
        &mut self,
        context: Context,
        tile: Tile,
        sample: u64,
        (sums, counts): (&mut TileSums, &mut Counts),
    ) {
        for step in 1..=MOST {
            if self.going_on.is_empty() {
                return;
            }
            self.rays.clear();
            for glimpse in &mut self.going_on {
                let coins = glimpse.coins(context, tile, sample, step);
                glimpse.scatter(context, coins, &mut self.rays);
            }
            trace_closest(context, &mut self.rays, RayKind::Bounce, counts);
            let rays = &self.rays;
            self.going_on.retain_mut(|glimpse| {
                let hits = rays.hits_of(&glimpse.ray, glimpse.lanes, glimpse.direction);
                glimpse.arrive(context, &hits, step == MOST, sums);
                glimpse.lanes != 0
            });
        }
    }
}

impl Glimpse {
    /// Numbers by which one of several single directions is chosen.
    fn coins(&self, context: Context, tile: Tile, sample: u64, step: u32) -> f32x8 {
        let mut coins = f32x8::ZERO;
        for lane in lanes_of(self.lanes) {
            let (x, y) = (
                self.pixels[lane] % tile.width,
                self.pixels[lane] / tile.width,
            );
            let settings = context.settings;
            let (kind, seed) = (settings.sampler, settings.seed);
            let sampler = Sampler::for_pixel(kind, seed, tile.x + x, tile.y + y, sample);
            coins.as_mut_array()[lane] = sampler.coin(u32::MAX / 2 + step);
        }
        coins
    }

    /// Goes on from the surfaces; those on which nothing goes on count no more.
    fn scatter(&mut self, context: Context, coins: f32x8, rays: &mut ClosestBatch) {
        let middle = f32x8::splat(0.5);
        let numbers = [middle, middle, coins, middle];
        // Without roulette.
        let scattering = self.vertices.scatter::<false>(context.scene, 1, &numbers);
        self.lanes &= scattering.valid;
        self.seen = scattering.carry(self.seen);
        self.direction = scattering.wi;
        let leaving = self.vertices.rays(scattering.wi);
        for lane in lanes_of(self.lanes) {
            self.ray[lane] = rays.push(&leaving.lane(lane));
        }
    }

    /// Moves to what the rays have met; what shows something itself is added.
    fn arrive(&mut self, context: Context, hits: &HitsX8, ends: bool, sums: &mut TileSums) {
        let scene = context.scene;
        let surfaces = arrival::meet::<false>(scene, hits, &mut self.vertices);
        let normals = normals(&self.vertices, hits.direction);
        for lane in lanes_of(self.lanes) {
            let seen = self.seen.lane(lane).clamp(Vec3::ZERO, Vec3::ONE);
            let sums = &mut sums.pixels[self.pixels[lane] as usize].auxiliary;
            if surfaces >> lane & 1 == 1 {
                if !ends && self.vertices.rough >> lane & 1 == 0 {
                    continue;
                }
                let albedo = seen * self.vertices.reflectance(scene, lane);
                sums.features(albedo, normals.lane(lane));
            } else if let Interaction::Light(light) = Interaction::in_lane(scene, hits, lane) {
                add_light(sums, light.radiance, light.ng, seen);
            }
            self.lanes &= !(1 << lane);
        }
    }
}
