//! Base paths with offset paths of their own, from the camera to x_2.

use super::arrival;
use super::grid::Grid;
use super::plain::PlainPaths;
use super::vertices::VerticesX8;
use super::{front_bounce::Flight, front_light::LightBlock};
use crate::gradient::{Base, Neighbour, Shift, Weights};
use crate::lanes::{Float, LANES, Vec3x8, first_lanes, lanes_of, mask_of, negative};
use crate::path::{Context, Counts, PathSettings, Share, Tile, trace_closest};
use crate::sampler::Sampler;
use crate::shift::Death;
use crate::sums::{PixelSample, TileSums};
use crate::trace::RayKind;
use crate::trace::rays::{AnyBatch, ClosestBatch, HitsX8, Ray};
use crate::vertex::End;
use glam::Vec3;
use wide::f32x8;

/// Base paths at one vertex with their `N` offset paths, with the buffers for their next steps.
#[derive(Default)]
pub(in crate::path) struct Front<const N: usize> {
    pub(super) grid: Grid,
    pub(super) blocks: Vec<Block<N>>,
    /// Random numbers for one step of each path.
    pub(super) numbers: Vec<[f32x8; 4]>,
    pub(super) lights: Vec<LightBlock<N>>,
    pub(super) flights: Vec<Flight<N>>,
    primary: ClosestBatch,
    pub(super) bounce: ClosestBatch,
    pub(super) shadow: AnyBatch,
    pub(super) reconnection: AnyBatch,
    pub(in crate::path) counts: Counts,
}

/// The base paths of eight pixels in a row, at their current vertices x_k.
#[derive(Clone)]
pub(super) struct Block<const N: usize> {
    /// The first pixel's index in the tile.
    pixel: u32,
    /// Its place in the grid.
    pub(super) place: usize,
    pub(super) vertices: VerticesX8,
    /// f/p up to x_k, the scattering there excluded.
    pub(super) throughput: Vec3x8,
    pub(super) samplers: [Sampler; LANES],
    /// A bit for each lane that holds a path.
    pub(super) alive: u32,
    pub(super) offsets: [OffsetX8; N],
    /// What the paths gathered: [`PixelSample`] in lanes.
    primal: Vec3x8,
    to: [Vec3x8; N],
}

/// Where the offset paths are that have not died, when their base paths are at x_k.
#[derive(Clone, Copy)]
pub(super) enum Stage {
    /// x_1: at vertices of their own, in the grid.
    Free,
    /// x_2: they have joined the base path, coming from vertices of their own.
    Joined,
    /// From x_3 on: they share the base path's direction too.
    Connected,
}

impl Stage {
    pub(super) fn at(k: u32) -> Self {
        match k {
            1 => Stage::Free,
            2 => Stage::Joined,
            _ => Stage::Connected,
        }
    }
}

/// Offset paths in lanes.
#[derive(Clone, Copy)]
pub(super) struct OffsetX8 {
    /// A bit for each lane in which the shift holds.
    pub(super) alive: u32,
    /// Where they are joined: directions to where they came from.
    pub(super) wo: Vec3x8,
    /// [`Carried`](crate::shift::Carried) in lanes.
    pub(super) throughput: Vec3x8,
    pub(super) ratio: f32x8,
}

/// Steps in the grid to a [`Neighbour`].
#[inline(always)]
pub(super) fn step(neighbour: usize, width: usize) -> isize {
    let (x, y) = Neighbour::ALL[neighbour].step();
    x as isize + y as isize * width as isize
}

impl<const N: usize> Front<N> {
    /// Whether no path goes on.
    pub(in crate::path) fn is_empty(&self) -> bool {
        self.blocks.iter().all(|block| block.alive == 0)
    }

    /// Traces the camera rays of one sample and starts the base paths at their first vertices.
    pub(in crate::path) fn primary_step(
        &mut self,
        context: Context,
        tile: Tile,
        sample: u64,
        samples: &mut [PixelSample],
        sums: &mut TileSums,
    ) {
        let camera = &context.scene.camera;
        let position = context.settings.position(sample);

        // Camera rays of the tile and its border, as far as it is on the film.
        let border = if N == 0 { 0 } else { 1 };
        let (left, top) = (tile.x.max(border) - border, tile.y.max(border) - border);
        let right = (tile.x + tile.width + border).min(camera.width);
        let bottom = (tile.y + tile.height + border).min(camera.height);
        self.primary.clear();
        for y in top..bottom {
            for x in (left..right).step_by(LANES) {
                let across = f32x8::from_lanes(|lane| (x + lane as u32) as f32 + position.x);
                let directions = camera.directions(across, y as f32 + position.y);
                for lane in lanes_of(first_lanes((right - x) as usize)) {
                    let ray = Ray::without_end(camera.origin, directions.lane(lane));
                    self.primary.push(&ray);
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
        let width = (right - left) as usize;
        self.blocks.clear();
        self.grid.resize(width, self.primary.len());
        let mut vertices = VerticesX8::NONE;
        let (mut column, mut row) = (left, top);
        for place in (0..self.primary.len()).step_by(LANES) {
            let hits = self.primary.hits(place / LANES);
            let surfaces = arrival::primary(context.scene, &hits, &mut vertices);
            if N > 0 {
                self.grid.store(place, &vertices, surfaces);
            }
            let mut pixels = [None; LANES];
            for pixel in pixels.iter_mut().take(self.primary.len() - place) {
                // In the border this wraps around.
                let (x, y) = (column.wrapping_sub(tile.x), row.wrapping_sub(tile.y));
                let in_tile = x < tile.width && y < tile.height;
                *pixel = in_tile.then_some((y * tile.width + x) as usize);
                column += 1;
                if column == right {
                    (column, row) = (left, row + 1);
                }
            }
            first_hits(context, &hits, &vertices, surfaces, pixels, samples, sums);
            if N == 0 && surfaces != 0 {
                self.start_plain(context, tile, place, sample, (&vertices, surfaces));
            }
        }
        if N == 0 {
            return;
        }

        // Base and offset paths.
        for y in 0..tile.height {
            for x in (0..tile.width).step_by(LANES) {
                let row = (tile.y + y - top) as usize;
                let place = row * width + (tile.x + x - left) as usize;
                self.start(context, tile, (x, y), place, sample);
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
        let PathSettings { points, seed, .. } = *context.settings;
        self.blocks.push(Block::NONE);
        let block = self.blocks.last_mut().expect("it was just pushed");
        block.pixel = place as u32;
        block.vertices = vertices.clone();
        block.alive = alive;
        for lane in lanes_of(alive) {
            let pixel = block.pixel + lane as u32;
            let (x, y) = (tile.x + pixel % tile.width, tile.y + pixel / tile.width);
            block.samplers[lane] = Sampler::for_pixel(points, seed, x, y, sample);
        }
    }

    /// Starts the paths of the eight pixels from (`x`, `y`) in the tile on.
    #[inline(always)]
    fn start(
        &mut self,
        context: Context,
        tile: Tile,
        (x, y): (u32, u32),
        place: usize,
        sample: u64,
    ) {
        let camera = &context.scene.camera;
        let PathSettings { points, seed, .. } = *context.settings;
        let alive = self.grid.surfaces(place, 0) & first_lanes((tile.width - x) as usize);
        if alive == 0 {
            return;
        }
        let (film_x, film_y) = (tile.x + x, tile.y + y);
        self.blocks.push(Block::NONE);
        let block = self.blocks.last_mut().expect("it was just pushed");
        block.pixel = y * tile.width + x;
        block.place = place;
        block.vertices = self.grid.load(place, 0);
        block.alive = alive;
        for (lane, sampler) in block.samplers.iter_mut().enumerate() {
            *sampler = Sampler::for_pixel(points, seed, film_x + lane as u32, film_y, sample);
        }
        for (j, offset) in block.offsets.iter_mut().enumerate() {
            // Where the film ends the difference does not exist.
            let on_film = match Neighbour::ALL[j] {
                Neighbour::Right => first_lanes((camera.width - 1 - film_x) as usize),
                Neighbour::Left => !u32::from(film_x == 0),
                Neighbour::Down => u32::from(film_y + 1 < camera.height).wrapping_neg(),
                Neighbour::Up => u32::from(film_y > 0).wrapping_neg(),
            };
            let there = self.grid.surfaces(place, step(j, self.grid.width));
            let missed = alive & on_film & !there;
            self.counts.deaths[Death::Missed as usize] += u64::from(missed.count_ones());
            offset.alive = alive & on_film & there;
        }
    }

    /// Light and bounce at x_k.
    pub(in crate::path) fn step(&mut self, context: Context, k: u32) {
        if !self.is_empty() {
            self.light_step(context, k);
            self.bounce_step(context, k);
        }
    }

    /// Makes plain paths of those at x_k whose offset paths are all connected or dead.
    pub(in crate::path) fn hand_over(
        &mut self,
        k: u32,
        weights: Weights,
        plain: &mut PlainPaths,
        shares: &mut Vec<Share<N>>,
    ) {
        for block in &mut self.blocks {
            let on_their_own = block.offsets.iter().fold(0, |bits, o| bits | o.alive);
            let settled = match Stage::at(k) {
                Stage::Free | Stage::Joined => block.alive & !on_their_own,
                Stage::Connected => block.alive,
            };
            if settled == 0 {
                continue;
            }
            block.alive &= !settled;
            // Densities of the base path are inside what follows: here they are 1.
            let base = Base {
                value: block.throughput,
                densities: f32x8::ONE,
            };
            let mut to = [Vec3x8::ZERO; N];
            let mut counts = base.value.is_not_zero();
            for (to, offset) in to.iter_mut().zip(&block.offsets) {
                let connected = mask_of(offset.alive);
                let shift = Shift {
                    value: Vec3x8::select(connected, offset.throughput, Vec3x8::ZERO),
                    densities: connected & offset.ratio,
                };
                *to = base.difference(&shift, weights);
                counts |= to.is_not_zero();
            }
            let primal = base.primal();
            for lane in lanes_of(settled & counts.to_bitmask()) {
                plain.push_lane(&block.vertices, lane, block.samplers[lane]);
                shares.push(Share {
                    pixel: block.pixel + lane as u32,
                    primal: primal.lane(lane),
                    to: to.each_ref().map(|to| to.lane(lane)),
                });
            }
        }
    }

    /// Puts what the paths gathered into the samples of their pixels.
    pub(in crate::path) fn collect(&mut self, tile: Tile, samples: &mut [PixelSample]) {
        if N == 0 {
            // They have all become plain paths.
            return;
        }
        for block in self.blocks.drain(..) {
            let columns = (tile.width - block.pixel % tile.width) as usize;
            for lane in 0..LANES.min(columns) {
                let sample = &mut samples[block.pixel as usize + lane];
                sample.primal = block.primal.lane(lane);
                for (sum, to) in sample.to.iter_mut().zip(&block.to) {
                    *sum = to.lane(lane);
                }
            }
        }
    }
}

impl OffsetX8 {
    /// With what all start, [`Carried::START`](crate::shift::Carried::START), but in no lane.
    const START: Self = Self {
        alive: 0,
        wo: Vec3x8::ZERO,
        throughput: Vec3x8::ONE,
        ratio: f32x8::ONE,
    };
}

impl<const N: usize> Block<N> {
    /// No paths.
    const NONE: Self = Self {
        pixel: 0,
        place: 0,
        vertices: VerticesX8::NONE,
        throughput: Vec3x8::ONE,
        samplers: [Sampler::NONE; LANES],
        alive: 0,
        offsets: [OffsetX8::START; N],
        primal: Vec3x8::ZERO,
        to: [Vec3x8::ZERO; N],
    };

    /// Adds complete paths and their shifts, in the lanes `holds`.
    #[inline(always)]
    pub(super) fn gather(
        &mut self,
        weights: Weights,
        base: &Base<f32x8>,
        shifts: &[Shift<f32x8>; N],
        holds: u32,
    ) {
        let holds = mask_of(holds);
        let zero = Vec3x8::ZERO;
        self.primal = self.primal + Vec3x8::select(holds, base.primal(), zero);
        for (to, shift) in self.to.iter_mut().zip(shifts) {
            *to = *to + Vec3x8::select(holds, base.difference(shift, weights), zero);
        }
    }
}

/// Adds what camera rays met to the buffers of their `pixels`, and light seen directly to their samples.
#[inline(always)]
fn first_hits(
    context: Context,
    hits: &HitsX8,
    vertices: &VerticesX8,
    surfaces: u32,
    pixels: [Option<usize>; LANES],
    samples: &mut [PixelSample],
    sums: &mut TileSums,
) {
    let camera = &context.scene.camera;
    let behind = negative(vertices.ng.dot(-hits.direction));
    let normal = Vec3x8::select(behind, -vertices.normal, vertices.normal);
    let way = Vec3x8::splat(camera.origin) - vertices.position;
    let distance = way.dot(way).sqrt();
    for (lane, pixel) in pixels.into_iter().enumerate() {
        let Some(pixel) = pixel else {
            continue;
        };
        let (sample, sums) = (&mut samples[pixel], &mut sums.pixels[pixel]);
        if surfaces >> lane & 1 == 1 {
            sample.coverage = 1.0;
            let albedo = vertices.reflectance(context.scene, lane);
            sums.first_hit(albedo, normal.lane(lane), distance.as_array()[lane]);
            continue;
        }
        match arrival::end(context.scene, hits, lane) {
            End::Environment(direction) => {
                sample.direct = context.scene.seen_directly(direction);
            }
            End::Light(light) => {
                sample.coverage = 1.0;
                sample.direct = light.radiance;
                let albedo = light.radiance.min(Vec3::ONE);
                sums.first_hit(albedo, light.ng, camera.origin.distance(light.position));
            }
            End::Surface(_) => (),
        }
    }
}
