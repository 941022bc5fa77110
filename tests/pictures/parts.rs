//! Parts with sequences of their own, merged: mean and error of one long render.

use crate::common::{Mean, Render, largest_z, shipped, tracer};
use gdpt::film::{Film, Halves};
use gdpt::part::{Part, Samples, Share};
use gdpt::render::TILE_SIZE;

const SIZE: u32 = 32;
const PARTS: u32 = 4;
const SPP: u64 = 16;
const SEEDS: u64 = 64;

/// Of all samples, and of their squared errors in mean, by regions of 8×8 pixels.
fn add(means: &mut [Mean], film: &Film, reference: &[f64]) {
    let image = film.estimate(Halves::Both).primal;
    let mut regions = [[0.0; 2]; 16];
    for (index, &value) in image.channels[1].iter().enumerate() {
        let (x, y) = (index % SIZE as usize, index / SIZE as usize);
        let region = &mut regions[y / 8 * 4 + x / 8];
        region[0] += f64::from(value) / 64.0;
        region[1] += (f64::from(value) - reference[index]).powi(2) / 64.0;
    }
    for (mean, value) in means.iter_mut().zip(regions.as_flattened()) {
        mean.add(*value);
    }
}

/// Independent samples, as the evenness of one long sequence is lost to several short ones. All comparisons together
/// fail by chance with probability 1e-4; seeds are fixed.
#[test]
fn parts_of_their_own_agree_with_one_long_render() {
    let scene = shipped("cornell", SIZE, SIZE);
    let tracer = tracer(&scene);
    let render = Render {
        sampler: gdpt::sampler::SamplerKind::Independent,
        ..Render::default()
    };
    let reference = Render {
        spp: 4096,
        seed: 999,
        ..Render::default()
    };
    let reference = reference.estimate(&scene, &*tracer).primal;
    let reference: Vec<f64> = reference.channels[1]
        .iter()
        .map(|&v| f64::from(v))
        .collect();
    let mut long = vec![Mean::default(); 32];
    let mut merged = long.clone();
    for seed in 0..SEEDS {
        let one = Render {
            spp: SPP * u64::from(PARTS),
            seed: 1000 + seed,
            ..render
        };
        add(&mut long, &one.film(&scene, &*tracer), &reference);
        let mut sum = Film::new(SIZE, SIZE, TILE_SIZE);
        for number in 1..=PARTS {
            let part = Part {
                number,
                parts: PARTS,
            };
            let share = Share {
                window: sum.window,
                samples: Samples::Own(part),
            };
            let part = Render {
                spp: SPP,
                seed: share.samples.seed(seed),
                ..render
            };
            let mut bytes = Vec::new();
            part.film(&scene, &*tracer).write_to(&mut bytes).unwrap();
            let counted = sum.add_from(share.window, &mut &bytes[..]).unwrap();
            sum.count_samples(counted);
        }
        assert_eq!(sum.count(Halves::Both), SPP * u64::from(PARTS));
        add(&mut merged, &sum, &reference);
    }
    let limit = largest_z(long.len(), SEEDS as usize, 1e-4);
    for (index, (a, b)) in long.iter().zip(&merged).enumerate() {
        let z = (a.mean() - b.mean()) / (a.variance() + b.variance()).sqrt();
        let what = ["mean", "squared error"][index % 2];
        assert!(
            z.abs() < limit,
            "{what} of region {}: {} against {}",
            index / 2,
            a.mean(),
            b.mean()
        );
    }
}
