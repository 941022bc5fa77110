//! The order of rays by what they have met, so that the eight paths of a block are at surfaces of one kind where that
//! is possible.

use crate::bsdf::packed::Kind;
use crate::path::Context;
use crate::trace::rays::ClosestBatch;

/// Rays in a new order, with the buffers to find it.
#[derive(Default)]
pub(super) struct Order {
    /// Indices into the batch. What ends without light is left out.
    pub(super) rays: Vec<u32>,
    /// Where each ray of the batch belongs.
    places: Vec<u8>,
}

/// Behind the kinds: what ends on a light or in the environment, and what ends without light.
const LIGHT: usize = Kind::ALL.len();
const DARK: usize = LIGHT + 1;

impl Order {
    /// Sorts the rays to x_{k+1}, which have been traced, by the kinds of surfaces, in the order of the batch inside
    /// of each: first those that go on, whose number is returned, then those that have reached light.
    pub(super) fn sort(&mut self, context: Context, k: u32, batch: &ClosestBatch) -> usize {
        let scene = context.scene;
        let goes_on = k + 2 <= context.settings.depth;
        let sky = if scene.environment.is_black() {
            DARK
        } else {
            LIGHT
        };
        let mut counts = [0usize; DARK + 1];
        self.places.clear();
        self.places.extend((0..batch.len() as u32).map(|ray| {
            let place = match batch.triangle(ray) {
                None => sky,
                Some(triangle) => {
                    let material = scene.mesh.material_of[triangle as usize];
                    let material = &scene.materials[material as usize];
                    if material.emission.is_some() {
                        LIGHT
                    } else if goes_on {
                        material.bsdf.kind() as usize
                    } else {
                        DARK
                    }
                }
            };
            counts[place] += 1;
            place as u8
        }));
        let mut starts = [0usize; DARK + 1];
        for place in 1..=DARK {
            starts[place] = starts[place - 1] + counts[place - 1];
        }
        let going_on = starts[LIGHT];
        self.rays.clear();
        self.rays.resize(starts[DARK], 0);
        for (ray, &place) in (0..).zip(&self.places) {
            if let Some(at) = self.rays.get_mut(starts[place as usize]) {
                *at = ray;
                starts[place as usize] += 1;
            }
        }
        going_on
    }
}
