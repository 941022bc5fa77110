//! Mattes: which objects and materials each pixel shows, and how much of it, as compositing needs them (Friedman and
//! Jones 2015, *Fully automatic ID mattes with support for motion blur and transparency*).

use crate::film::Window;
use crate::path::PathSettings;
use crate::sampler::{Dimension, Sampler};
use crate::scene::Scene;
use crate::trace::rays::{ClosestBatch, Ray};
use crate::trace::{RayKind, Traverse};
use rayon::prelude::*;
use std::collections::HashMap;
use std::ops::Range;

/// Most things that are kept of a pixel: those that cover most of it.
pub const RANKS: usize = 6;

/// How much of a pixel a thing covers.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Share {
    /// Its number.
    pub thing: u32,
    /// The share of the pixel, by its filter, from 0 (there is none) to 1.
    pub share: f32,
}

/// The shares of things of one kind.
#[derive(Clone, Debug, PartialEq)]
pub struct Matte {
    /// Names of the things, each once.
    pub names: Vec<String>,
    /// Of each pixel, row by row, the things that cover most of it, by falling shares.
    pub pixels: Vec<[Share; RANKS]>,
}

/// The mattes of a picture.
#[derive(Clone, Debug, PartialEq)]
pub struct Mattes {
    /// Of the objects of the file.
    pub objects: Matte,
    /// Of its materials.
    pub materials: Matte,
}

/// The mattes of what the camera sees of a scene whose objects are known, by the camera rays of these samples. Works on
/// the current pool.
pub fn of_scene(
    scene: &Scene,
    tracer: &dyn Traverse,
    settings: &PathSettings,
    window: Window,
    samples: Range<u64>,
) -> Mattes {
    let (objects, object_names) = distinct(scene.objects.iter());
    let (materials, material_names) = distinct(scene.materials.iter().map(|m| &m.name));
    let kinds = [
        (&scene.mesh.object_of, &objects),
        (&scene.mesh.material_of, &materials),
    ];
    let rows = (window.y..window.bottom()).into_par_iter().map(|y| {
        let width = window.width as usize;
        let mut counts = [(); 2].map(|()| vec![Vec::<Share>::new(); width]);
        let mut all = 0.0;
        let mut batch = ClosestBatch::default();
        for sample in samples.clone() {
            let position = settings.position(sample);
            // Lobes below zero have no share.
            if position.weight <= 0.0 {
                continue;
            }
            all += position.weight;
            batch.clear();
            for x in window.x..window.right() {
                let at = (x as f32 + position.x, y as f32 + position.y);
                batch.push(&camera_ray(scene, settings, (x, y), at, sample));
            }
            tracer.closest(&mut batch, RayKind::Primary);
            for x in 0..width {
                let Some(hit) = batch.hit(x as u32) else {
                    continue;
                };
                for ((of_triangle, numbers), counts) in kinds.iter().zip(&mut counts) {
                    let thing = numbers[of_triangle[hit.triangle as usize] as usize];
                    add(&mut counts[x], thing, position.weight);
                }
            }
        }
        counts.map(|counts| -> Vec<[Share; RANKS]> {
            counts
                .into_iter()
                .map(|shares| ranked(shares, all))
                .collect()
        })
    });
    let rows: Vec<[Vec<[Share; RANKS]>; 2]> = rows.collect();
    let of_kind = |kind: usize| {
        rows.iter()
            .flat_map(|row| row[kind].iter().copied())
            .collect()
    };
    Mattes {
        objects: Matte {
            names: object_names,
            pixels: of_kind(0),
        },
        materials: Matte {
            names: material_names,
            pixels: of_kind(1),
        },
    }
}

/// The camera ray of a sample of the pixel (`x`, `y`), through the film at `at`: as the picture's.
fn camera_ray(
    scene: &Scene,
    settings: &PathSettings,
    (x, y): (u32, u32),
    at: (f32, f32),
    sample: u64,
) -> Ray {
    let camera = &scene.camera;
    let (origin, direction) = match &camera.lens {
        None => (camera.origin, camera.direction(at.0, at.1)),
        Some(lens) => {
            let sampler = Sampler::for_pixel(settings.sampler, settings.seed, x, y, sample);
            let [u, v, ..] = sampler.draw(Dimension::Pixel);
            camera.through_lens(lens, at.0, at.1, [u, v])
        }
    };
    Ray::without_end(origin, direction)
}

/// The number of each name among the distinct ones, and these.
fn distinct<'a>(names: impl Iterator<Item = &'a String>) -> (Vec<u32>, Vec<String>) {
    let mut numbers = HashMap::new();
    let mut list = Vec::new();
    let of_names = names.map(|name| {
        *numbers.entry(name).or_insert_with(|| {
            list.push(name.clone());
            list.len() as u32 - 1
        })
    });
    (of_names.collect(), list)
}

fn add(shares: &mut Vec<Share>, thing: u32, share: f32) {
    match shares.iter_mut().find(|s| s.thing == thing) {
        Some(there) => there.share += share,
        None => shares.push(Share { thing, share }),
    }
}

/// The largest shares of `all`.
fn ranked(mut shares: Vec<Share>, all: f32) -> [Share; RANKS] {
    shares.sort_by(|a, b| b.share.total_cmp(&a.share).then(a.thing.cmp(&b.thing)));
    let mut ranks = [Share::default(); RANKS];
    for (rank, share) in ranks.iter_mut().zip(shares) {
        *rank = Share {
            share: share.share / all,
            ..share
        };
    }
    ranks
}
