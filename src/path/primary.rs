//! The primary step: one camera ray for each pixel and sample serves the pixel's base path and the
//! offset paths of its four neighbours.

use super::arrival;
use super::base::{BasePaths, Block, step};
use super::features::{self, Glimpses};
use super::pool::Pool;
use super::{Context, PathSettings, Tile, trace_closest};
use crate::gradient::Neighbour;
use crate::lanes::{Float, LANES, Vec3x8, first_lanes, lanes_of, lanes_where};
use crate::sampler::{Dimension, Sampler};
use crate::scene::camera::{Camera, Lens};
use crate::shift::{Death, OffsetsX8};
use crate::sums::{PixelSample, TileSums};
use crate::trace::RayKind;
use crate::trace::rays::{ClosestBatch, HitsX8, Ray};
use crate::vertex::{Interaction, VerticesX8};
use glam::Vec3;
use wide::f32x8;

/// The camera rays of a tile, and what they met.
#[derive(Default)]
pub(super) struct Buffers {
    rays: ClosestBatch,
    /// The pixel of the tile to whose base path each ray belongs, if to any: [`NONE`] are those of offset paths alone.
    pixels: Vec<u32>,
    /// With a lens, the rays of each pixel and of its `N` offset paths; [`NONE`] outside of the film.
    through_lens: Vec<u32>,
    /// What they met, eight by eight, and a bit for each surface. Not in diffuse scenes: there the grid has it.
    hits: Pool<(VerticesX8, u32)>,
    /// Those that have met mirrors and glass.
    glimpses: Glimpses,
}

const NONE: u32 = u32::MAX;

impl Buffers {
    /// The block with the surface that a ray met, if it did, and the lane.
    #[inline(always)]
    fn surface(&self, ray: u32) -> Option<(&VerticesX8, usize)> {
        let (block, lane) = (ray as usize / LANES, ray as usize % LANES);
        let (vertices, surfaces) = &self.hits[block];
        (surfaces >> lane & 1 == 1).then_some((vertices, lane))
    }
}

/// The part of the film that the camera rays of a tile go through: the tile and a border of one pixel for the offset
/// paths, as far as it is on the film.
#[derive(Clone, Copy)]
struct Window {
    left: u32,
    top: u32,
    right: u32,
    bottom: u32,
}

impl Window {
    fn new(tile: Tile, border: u32, camera: &Camera) -> Self {
        Self {
            left: tile.x.max(border) - border,
            top: tile.y.max(border) - border,
            right: (tile.x + tile.width + border).min(camera.width),
            bottom: (tile.y + tile.height + border).min(camera.height),
        }
    }

    fn width(&self) -> usize {
        (self.right - self.left) as usize
    }

    /// The place of a pixel of `tile`, row by row.
    fn place(&self, tile: Tile, (x, y): (u32, u32)) -> usize {
        let (x, y) = (tile.x + x - self.left, tile.y + y - self.top);
        y as usize * self.width() + x as usize
    }
}

/// The lanes of eight pixels in a row, from (`x`, `y`) on, whose neighbours are on the film.
fn on_film(camera: &Camera, (x, y): (u32, u32), neighbour: usize) -> u32 {
    match Neighbour::ALL[neighbour] {
        Neighbour::Right => first_lanes((camera.width - 1 - x) as usize),
        Neighbour::Left => !u32::from(x == 0),
        Neighbour::Down => u32::from(y + 1 < camera.height).wrapping_neg(),
        Neighbour::Up => u32::from(y > 0).wrapping_neg(),
    }
}

impl<const N: usize> BasePaths<N> {
    /// Traces the camera rays of one sample and starts the base paths at their first vertices.
    pub(super) fn primary_step<const DIFFUSE: bool>(
        &mut self,
        context: Context,
        tile: Tile,
        sample: u64,
        samples: &mut [PixelSample],
        sums: &mut TileSums,
    ) {
        let camera = &context.scene.camera;
        let window = Window::new(tile, u32::from(N > 0), camera);
        self.primary.rays.clear();
        self.primary.pixels.clear();
        match &camera.lens {
            None => self.push_window(context, tile, window, sample),
            Some(lens) => self.push_through_lens(context, lens, tile, sample),
        }
        trace_closest(
            context,
            &mut self.primary.rays,
            RayKind::Primary,
            &mut self.counts,
        );

        // What they met.
        self.blocks.clear();
        self.own.clear();
        self.primary.hits.clear();
        if DIFFUSE && N > 0 {
            self.grid.resize(window.width(), self.primary.rays.len());
        }
        let mut one = (VerticesX8::NONE, 0);
        for block in 0..self.primary.rays.len().div_ceil(LANES) {
            let hits = self.primary.rays.hits(block);
            let place = block * LANES;
            let pixels = &self.primary.pixels[place..];
            let met = if DIFFUSE || N == 0 {
                &mut one
            } else {
                self.primary.hits.next(|| (VerticesX8::NONE, 0))
            };
            met.1 = arrival::meet::<DIFFUSE>(context.scene, &hits, &mut met.0);
            let (vertices, surfaces) = (&met.0, met.1);
            let going_on = first_hits(context, &hits, (vertices, surfaces), pixels, samples, sums);
            if !DIFFUSE && going_on != 0 {
                let pixels = std::array::from_fn(|lane| pixels.get(lane).copied().unwrap_or(NONE));
                self.primary.glimpses.push(vertices, going_on, pixels);
            }
            if N == 0 {
                self.start_plain(context, tile, place, sample, (&one.0, surfaces));
            } else if DIFFUSE {
                self.grid.store(place, &one.0, surfaces);
            }
        }

        if !DIFFUSE {
            let to = (sums, &mut self.counts);
            self.primary.glimpses.follow(context, tile, sample, to);
        }

        // Base and offset paths.
        if N > 0 {
            for y in 0..tile.height {
                for x in (0..tile.width).step_by(LANES) {
                    let place = window.place(tile, (x, y));
                    if DIFFUSE {
                        self.start_on_grid(context, tile, (x, y), place, sample);
                    } else {
                        self.start(context, tile, (x, y), window, sample);
                    }
                }
            }
        }
        self.live.clear();
        self.live.extend(0..self.blocks.len() as u32);
    }

    /// Camera rays through a window, row by row. All pixels have the same position inside the pixel, so that the
    /// offset path's camera ray is the neighbour's.
    fn push_window(&mut self, context: Context, tile: Tile, window: Window, sample: u64) {
        let camera = &context.scene.camera;
        let position = context.settings.position(sample);
        for y in window.top..window.bottom {
            for x in (window.left..window.right).step_by(LANES) {
                let across = f32x8::from_lanes(|lane| (x + lane as u32) as f32 + position.x);
                let directions = camera.directions(across, y as f32 + position.y);
                for lane in lanes_of(first_lanes((window.right - x) as usize)) {
                    let ray = Ray::without_end(camera.origin, directions.lane(lane));
                    self.primary.rays.push(&ray);
                    // In the border this wraps around.
                    let x = (x + lane as u32).wrapping_sub(tile.x);
                    let y = y.wrapping_sub(tile.y);
                    let in_tile = x < tile.width && y < tile.height;
                    let pixel = if in_tile { y * tile.width + x } else { NONE };
                    self.primary.pixels.push(pixel);
                }
            }
        }
    }

    /// Camera rays through a lens: a point of the lens for each pixel, which its offset paths share.
    fn push_through_lens(&mut self, context: Context, lens: &Lens, tile: Tile, sample: u64) {
        let camera = &context.scene.camera;
        let PathSettings {
            sampler: kind,
            seed,
            ..
        } = *context.settings;
        let position = context.settings.position(sample);
        let Buffers {
            rays,
            pixels,
            through_lens,
            ..
        } = &mut self.primary;
        through_lens.clear();
        for y in tile.y..tile.y + tile.height {
            for x in tile.x..tile.x + tile.width {
                let sampler = Sampler::for_pixel(kind, seed, x, y, sample);
                let [u, v, ..] = sampler.draw(Dimension::Pixel);
                let mut pixel = (y - tile.y) * tile.width + (x - tile.x);
                let steps = Neighbour::ALL.iter().map(|n| n.step()).take(N);
                for (sx, sy) in std::iter::once((0, 0)).chain(steps) {
                    let (x, y) = (x as i32 + sx, y as i32 + sy);
                    // Outside of the film there is nothing to compare with.
                    let columns = 0..camera.width as i32;
                    if !columns.contains(&x) || !(0..camera.height as i32).contains(&y) {
                        through_lens.push(NONE);
                        continue;
                    }
                    let (x, y) = (x as f32 + position.x, y as f32 + position.y);
                    let (origin, direction) = camera.through_lens(lens, x, y, [u, v]);
                    through_lens.push(rays.push(&Ray::without_end(origin, direction)));
                    // The first is the pixel's own.
                    pixels.push(std::mem::replace(&mut pixel, NONE));
                }
            }
        }
    }

    /// Starts the paths of eight pixels of which the first is at `place`, row by row, without offset paths.
    #[inline(always)]
    fn start_plain(
        &mut self,
        context: Context,
        tile: Tile,
        place: usize,
        sample: u64,
        (vertices, alive): (&VerticesX8, u32),
    ) {
        if alive == 0 {
            return;
        }
        let PathSettings {
            sampler: kind,
            seed,
            ..
        } = *context.settings;
        let block = self.blocks.next(|| Block::NONE);
        block.clear();
        block.vertices.clone_from(vertices);
        block.alive = alive;
        for lane in lanes_of(alive) {
            let pixel = (place + lane) as u32;
            block.pixels[lane] = pixel;
            let (x, y) = (tile.x + pixel % tile.width, tile.y + pixel / tile.width);
            block.samplers[lane] = Sampler::for_pixel(kind, seed, x, y, sample);
        }
    }

    /// Starts the paths of the eight pixels from (`x`, `y`) in the tile on, which are at `place` in the grid.
    #[inline(always)]
    fn start_on_grid(
        &mut self,
        context: Context,
        tile: Tile,
        (x, y): (u32, u32),
        place: usize,
        sample: u64,
    ) {
        let camera = &context.scene.camera;
        let alive = self.grid.surfaces(place, 0) & first_lanes((tile.width - x) as usize);
        if alive == 0 {
            return;
        }
        let block = self.blocks.next(|| Block::NONE);
        block.start(context, tile, (x, y), sample);
        block.place = place;
        block.vertices = self.grid.load(place, 0);
        block.alive = alive;
        for (j, offsets) in block.offsets.iter_mut().enumerate() {
            // Where the film ends the difference does not exist.
            let wanted = alive & on_film(camera, (tile.x + x, tile.y + y), j);
            let there = self.grid.surfaces(place, step(j, self.grid.width));
            self.counts.die(Death::Missed, wanted & !there);
            *offsets = OffsetsX8::start(wanted & there);
        }
    }

    /// Starts the paths of the eight pixels from (`x`, `y`) in the tile on.
    fn start(
        &mut self,
        context: Context,
        tile: Tile,
        (x, y): (u32, u32),
        window: Window,
        sample: u64,
    ) {
        let camera = &context.scene.camera;
        let met = &self.primary;
        // The ray of the pixel in a lane, or of its offset path.
        let place = window.place(tile, (x, y));
        let first = (y * tile.width + x) as usize * (N + 1);
        let ray = |lane: usize, neighbour: Option<usize>| {
            if camera.lens.is_some() {
                met.through_lens[first + lane * (N + 1) + neighbour.map_or(0, |j| 1 + j)]
            } else {
                let step = neighbour.map_or(0, |j| step(j, window.width()));
                (place + lane).wrapping_add_signed(step) as u32
            }
        };

        let columns = first_lanes((tile.width - x) as usize);
        let alive = lanes_where(columns, |lane| met.surface(ray(lane, None)).is_some());
        if alive == 0 {
            return;
        }
        let block = self.blocks.next(|| Block::NONE);
        block.start(context, tile, (x, y), sample);
        block.alive = alive;
        for lane in lanes_of(alive) {
            if let Some((met, from)) = met.surface(ray(lane, None)) {
                block.vertices.copy::<false>(lane, met, from);
            }
        }
        let own = self.own.next(|| [const { VerticesX8::NONE }; N]);
        for (j, (own, offsets)) in own.iter_mut().zip(&mut block.offsets).enumerate() {
            // Where the film ends the difference does not exist.
            let wanted = block.alive & on_film(camera, (tile.x + x, tile.y + y), j);
            let mut free = 0;
            own.clear();
            for lane in lanes_of(wanted) {
                // It must be of the base vertex's kind.
                let Some((met, from)) = met.surface(ray(lane, Some(j))) else {
                    self.counts.die(Death::Missed, 1);
                    continue;
                };
                if met.rough >> from & 1 != block.vertices.rough >> lane & 1 {
                    self.counts.die(Death::Class, 1);
                    continue;
                }
                own.copy::<false>(lane, met, from);
                free |= 1 << lane;
            }
            *offsets = OffsetsX8::start(free);
        }
    }
}

impl<const N: usize> Block<N> {
    /// Makes it that of the eight pixels from (`x`, `y`) in the tile on, without paths.
    #[inline(always)]
    fn start(&mut self, context: Context, tile: Tile, (x, y): (u32, u32), sample: u64) {
        let PathSettings {
            sampler: kind,
            seed,
            ..
        } = *context.settings;
        self.clear();
        for lane in lanes_of(first_lanes((tile.width - x) as usize)) {
            let x = x + lane as u32;
            self.pixels[lane] = y * tile.width + x;
            self.samplers[lane] = Sampler::for_pixel(kind, seed, tile.x + x, tile.y + y, sample);
        }
    }
}

/// Adds what camera rays met to the buffers of the `pixels` to which they belong, and light seen directly to their
/// samples; the lanes of those that have met what shows something else.
#[inline(always)]
fn first_hits(
    context: Context,
    hits: &HitsX8,
    (vertices, surfaces): (&VerticesX8, u32),
    pixels: &[u32],
    samples: &mut [PixelSample],
    sums: &mut TileSums,
) -> u32 {
    let camera = &context.scene.camera;
    let normals = features::normals(vertices, hits.direction);
    let mut going_on = 0;
    let wanted = lanes_where(first_lanes(pixels.len()), |lane| pixels[lane] != NONE);
    let open = wanted & !hits.found;
    let background = if open != 0 {
        context.scene.seen_directly(hits.direction, open)
    } else {
        Vec3x8::ZERO
    };
    let way = Vec3x8::splat(camera.origin) - vertices.position;
    let distance = way.dot(way).root();
    for lane in lanes_of(wanted) {
        let pixel = pixels[lane] as usize;
        let (sample, sums) = (&mut samples[pixel], &mut sums.pixels[pixel].auxiliary);
        if surfaces >> lane & 1 == 1 {
            sample.coverage = 1.0;
            sums.first_hit(distance.lane(lane));
            if vertices.rough >> lane & 1 == 0 {
                going_on |= 1 << lane;
            } else {
                let albedo = vertices.reflectance(context.scene, lane);
                sums.features(albedo, normals.lane(lane));
            }
            continue;
        }
        if open >> lane & 1 == 1 {
            sample.direct = background.lane(lane);
        } else if let Interaction::Light(light) = Interaction::in_lane(context.scene, hits, lane) {
            sample.coverage = 1.0;
            sample.direct = light.radiance;
            sums.first_hit(camera.origin.distance(light.position));
            features::add_light(sums, light.radiance, light.ng, Vec3::ONE);
        }
    }
    going_on
}
