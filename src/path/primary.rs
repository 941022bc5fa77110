//! The primary step: one camera ray for each pixel and sample serves the pixel's base path and the
//! offset paths of its four neighbours (method.md section 4).

use super::{BasePath, Context, PathSettings, Tile, Wavefront, or_dead};
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
        let [dx, dy, ..] = Sampler::for_pass(points, seed, sample).draw(Dimension::Pixel);
        let border = if N == 0 { 0 } else { 1 };
        let columns = tile.width as i32 + 2 * border;
        let rows = tile.height as i32 + 2 * border;

        // Camera rays of the tile and its border; outside of the film there is nothing to compare with.
        let on_film = |column: i32, row: i32| {
            let (x, y) = (
                tile.x as i32 + column - border,
                tile.y as i32 + row - border,
            );
            let inside = x >= 0 && y >= 0 && x < camera.width as i32 && y < camera.height as i32;
            inside.then_some((x, y))
        };
        self.primary.clear();
        for row in 0..rows {
            for column in 0..columns {
                if let Some((x, y)) = on_film(column, row) {
                    let direction = camera.direction(x as f32 + dx, y as f32 + dy);
                    self.primary.push(&Ray {
                        origin: camera.origin,
                        direction,
                        length: f32::INFINITY,
                    });
                }
            }
        }
        Self::trace_closest(
            context,
            &mut self.primary,
            RayKind::Primary,
            &mut self.counts,
        );

        // What they met.
        self.ends.clear();
        let mut index = 0;
        for row in 0..rows {
            for column in 0..columns {
                let end = on_film(column, row).map(|_| {
                    let direction = self.primary.ray(index).direction;
                    let end = End::new(scene, self.primary.hit(index), direction);
                    index += 1;
                    end
                });
                self.ends.push(end);
            }
        }

        // Buffers, light seen directly, and the base paths.
        self.paths.clear();
        for y in 0..tile.height {
            for x in 0..tile.width {
                let pixel = y * tile.width + x;
                let at = (y as i32 + border) * columns + x as i32 + border;
                let Some(end) = &self.ends[at as usize] else {
                    continue;
                };
                let sum = &mut sums.pixels[pixel as usize];
                match end {
                    End::Environment(direction) => {
                        self.samples[pixel as usize].direct = scene.sky(*direction);
                    }
                    End::Light(light) => {
                        self.samples[pixel as usize].direct = light.radiance;
                        let albedo = light.radiance.min(Vec3::ONE);
                        sum.first_hit(albedo, light.ng, camera.origin.distance(light.position));
                    }
                    End::Surface(vertex) => {
                        let albedo = vertex.bsdf(scene).albedo();
                        let normal = facing_normal(vertex);
                        sum.first_hit(albedo, normal, camera.origin.distance(vertex.position));
                        let offsets: [Offset; N] = std::array::from_fn(|j| {
                            let (sx, sy) = Neighbour::ALL[j].step();
                            match &self.ends[(at + sy * columns + sx) as usize] {
                                Some(other) => {
                                    or_dead(shift::primary(scene, vertex, other), &mut self.counts)
                                }
                                // The film ends here: this difference does not exist.
                                None => Offset::Dead,
                            }
                        });
                        self.paths.push(BasePath {
                            pixel,
                            sampler: Sampler::for_pixel(
                                points,
                                seed,
                                tile.x + x,
                                tile.y + y,
                                sample,
                            ),
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
