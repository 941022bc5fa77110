//! The primary step: one camera ray for each pixel and sample serves the pixel's base path and the
//! offset paths of its four neighbours.

use super::{BasePath, Context, PathSettings, Tile, Wavefront, or_dead, trace_closest};
use crate::gradient::Neighbour;
use crate::sampler::{Dimension, Sampler};
use crate::shift::{self, Offset};
use crate::sums::TileSums;
use crate::trace::RayKind;
use crate::trace::rays::Ray;
use crate::vertex::{End, Vertex};
use glam::Vec3;

impl<const N: usize> Wavefront<N> {
    /// Traces the camera rays of one sample and starts the base paths at their first vertices.
    pub(super) fn primary_step(
        &mut self,
        context: Context,
        tile: Tile,
        sample: u64,
        sums: &mut TileSums,
    ) {
        let scene = context.scene;
        let camera = &scene.camera;
        let PathSettings { points, seed, .. } = *context.settings;
        // All pixels have the same position inside the pixel, so that the offset path's camera ray is
        // the neighbour's.
        let position = context.settings.position(sample);
        let border = if N == 0 { 0 } else { 1 };
        let columns = tile.width as i32 + 2 * border;
        let own_sampler = |x, y| Sampler::for_pixel(points, seed, x, y, sample);

        // Camera rays; outside of the film there is nothing to compare with.
        self.primary.clear();
        self.ends.clear();
        let on_film = |x: i32, y: i32| {
            x >= 0 && y >= 0 && x < camera.width as i32 && y < camera.height as i32
        };
        let (rays, rows) = (&mut self.primary, tile.height as i32 + 2 * border);
        // Whether there is a ray, in the order of `self.ends`.
        let there = &mut self.there;
        there.clear();
        match &camera.lens {
            None => {
                for row in 0..rows {
                    for column in 0..columns {
                        let (x, y) = (
                            tile.x as i32 + column - border,
                            tile.y as i32 + row - border,
                        );
                        there.push(on_film(x, y));
                        if on_film(x, y) {
                            let (x, y) = (x as f32 + position.x, y as f32 + position.y);
                            let direction = camera.direction(x, y);
                            rays.push(&Ray::without_end(camera.origin, direction));
                        }
                    }
                }
            }
            // A point of the lens for each pixel, which its offset paths share.
            Some(lens) => {
                for y in tile.y..tile.y + tile.height {
                    for x in tile.x..tile.x + tile.width {
                        let [u, v, ..] = own_sampler(x, y).draw(Dimension::Pixel);
                        let steps = Neighbour::ALL.iter().map(|n| n.step()).take(N);
                        for (sx, sy) in std::iter::once((0, 0)).chain(steps) {
                            let (x, y) = (x as i32 + sx, y as i32 + sy);
                            there.push(on_film(x, y));
                            if on_film(x, y) {
                                let (x, y) = (x as f32 + position.x, y as f32 + position.y);
                                let (origin, direction) = camera.through_lens(lens, x, y, [u, v]);
                                rays.push(&Ray::without_end(origin, direction));
                            }
                        }
                    }
                }
            }
        }
        trace_closest(
            context,
            &mut self.primary,
            RayKind::Primary,
            &mut self.counts,
        );

        // What they met.
        let mut index = 0;
        for &there in &self.there {
            let end = there.then(|| {
                let direction = self.primary.ray(index).direction;
                let end = End::new(scene, self.primary.hit(index), direction);
                index += 1;
                end
            });
            self.ends.push(end);
        }
        // Where the rays of a pixel and of its offset paths are.
        let has_lens = camera.lens.is_some();
        let place = |x: u32, y: u32| {
            if has_lens {
                ((y * tile.width + x) * (N as u32 + 1)) as i32
            } else {
                (y as i32 + border) * columns + x as i32 + border
            }
        };
        let neighbour = |at: i32, j: usize| {
            let (sx, sy) = Neighbour::ALL[j].step();
            if has_lens {
                at + 1 + j as i32
            } else {
                at + sy * columns + sx
            }
        };

        // Buffers, light seen directly, and the base paths.
        self.paths.clear();
        for y in 0..tile.height {
            for x in 0..tile.width {
                let pixel = y * tile.width + x;
                let at = place(x, y);
                let Some(end) = &self.ends[at as usize] else {
                    continue;
                };
                let sum = &mut sums.pixels[pixel as usize];
                let own = &mut self.samples[pixel as usize];
                own.coverage = f32::from(!matches!(end, End::Environment(_)));
                match end {
                    End::Environment(direction) => own.direct = scene.seen_directly(*direction),
                    End::Light(light) => {
                        own.direct = light.radiance;
                        let albedo = light.radiance.min(Vec3::ONE);
                        sum.first_hit(albedo, light.ng, camera.origin.distance(light.position));
                    }
                    End::Surface(vertex) => {
                        let albedo = vertex.bsdf(scene).albedo();
                        let normal = facing_normal(vertex);
                        sum.first_hit(albedo, normal, camera.origin.distance(vertex.position));
                        let offsets: [Offset; N] = std::array::from_fn(|j| {
                            match &self.ends[neighbour(at, j) as usize] {
                                Some(other) => {
                                    or_dead(shift::primary(scene, vertex, other), &mut self.counts)
                                }
                                // The film ends here: this difference does not exist.
                                None => Offset::Dead,
                            }
                        });
                        self.paths.push(BasePath {
                            pixel,
                            sampler: own_sampler(tile.x + x, tile.y + y),
                            vertex: *vertex,
                            throughput: Vec3::ONE,
                            offsets,
                        });
                    }
                }
            }
        }
    }
}

/// The shading normal on the side of the camera.
fn facing_normal(vertex: &Vertex) -> Vec3 {
    if vertex.ng.dot(vertex.wo) < 0.0 {
        -vertex.normal()
    } else {
        vertex.normal()
    }
}
