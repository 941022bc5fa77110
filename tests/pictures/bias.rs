//! The bias of the reconstructions, over many seeds. L2 is unbiased (`tests/physics/gradients.rs` holds it against
//! path tracing), so a method's bias is its mean difference from L2 on the same films: of that the noise
//! is small.

use crate::common::{Render, shipped, tracer};
use gdpt::film::Halves;
use gdpt::reconstruct::{Alpha, Method, Source, run};
use gdpt::scene::Scene;
use gdpt::trace::Traverse;

const SIZE: u32 = 48;
const SEEDS: u64 = 200;
const REGION: usize = 8;

/// Of one method at one number of samples.
struct Bias {
    /// Of the mean of the image, relative.
    overall: f64,
    /// The largest of a region of 8 x 8 pixels, relative to the region's mean, or to a tenth of the
    /// image's where that is more.
    worst: f64,
    /// Mean squared bias, and variance, of pixels and channels; both relative as in relMSE.
    squared: f64,
    variance: f64,
}

#[derive(Clone, Copy, Default)]
struct Moments {
    sum: f64,
    sum_sq: f64,
}

impl Moments {
    fn add(&mut self, x: f64) {
        self.sum += x;
        self.sum_sq += x * x;
    }

    fn mean(&self) -> f64 {
        self.sum / SEEDS as f64
    }

    fn variance(&self) -> f64 {
        (self.sum_sq / SEEDS as f64 - self.mean().powi(2)) * SEEDS as f64 / (SEEDS - 1) as f64
    }
}

fn measure(scene: &Scene, tracer: &dyn Traverse, spp: u64) -> [Bias; 2] {
    let n = 3 * (SIZE * SIZE) as usize;
    let mut plain = vec![Moments::default(); n];
    let mut values = vec![[Moments::default(); 2]; n];
    let mut differences = values.clone();
    for seed in 0..SEEDS {
        let render = Render {
            spp,
            seed,
            ..Render::default()
        };
        let film = render.film(scene, tracer);
        let source = Source {
            size: (SIZE as usize, SIZE as usize),
            samples: film.samples,
            planes: &|half, channel| film.planes([Halves::A, Halves::B][half], channel),
            features: None,
        };
        let alpha = Alpha::Fixed(0.2);
        let [l2, weighted, l1] = [Method::L2(alpha), Method::Weighted, Method::L1(alpha)]
            .map(|method| run(method, &source).picture.channels.concat());
        for i in 0..n {
            plain[i].add(f64::from(l2[i]));
            for (m, picture) in [&weighted, &l1].into_iter().enumerate() {
                values[i][m].add(f64::from(picture[i]));
                differences[i][m].add(f64::from(picture[i] - l2[i]));
            }
        }
    }
    [0, 1].map(|m| {
        let total: f64 = plain.iter().map(Moments::mean).sum();
        let side = SIZE as usize / REGION;
        let mut regions = vec![(0.0, 0.0); side * side];
        let (mut squared, mut variance) = (0.0, 0.0);
        for i in 0..n {
            let (difference, mean) = (&differences[i][m], plain[i].mean());
            let pixel = i % (SIZE * SIZE) as usize;
            let (x, y) = (
                pixel % SIZE as usize / REGION,
                pixel / SIZE as usize / REGION,
            );
            regions[y * side + x].0 += difference.mean();
            regions[y * side + x].1 += mean;
            let relative = 1.0 / ((mean * mean + 0.01) * n as f64);
            // The mean's own noise is not bias.
            let noise = difference.variance() / SEEDS as f64;
            squared += (difference.mean().powi(2) - noise) * relative;
            variance += values[i][m].variance() * relative;
        }
        let worst = regions
            .iter()
            .map(|(d, mean)| d / mean.max(0.1 * total / regions.len() as f64));
        Bias {
            overall: differences.iter().map(|d| d[m].mean()).sum::<f64>() / total,
            worst: worst.fold(0.0, |a: f64, b| if b.abs() > a.abs() { b } else { a }),
            squared,
            variance,
        }
    })
}

/// Five minutes of rendering: run it after a change of the weights, with `--ignored --nocapture`, for the
/// table and for the promise that bias is the smaller part of the error and falls with samples.
#[test]
#[ignore = "takes five minutes"]
fn weighted_is_nearly_unbiased() {
    println!("scene    spp method    overall    worst region  squared bias / variance");
    for name in ["cornell", "glossy", "mirrors", "ajar", "caustic", "corner"] {
        let scene = shipped(name, SIZE, SIZE);
        let tracer = tracer(&scene);
        let mut before = f64::INFINITY;
        for spp in [16, 64] {
            // Inside the pool: the solver's many small steps need not wait for it to wake up.
            let measured = rayon::scope(|_| measure(&scene, &*tracer, spp));
            for (method, b) in ["weighted", "l1"].iter().zip(&measured) {
                println!(
                    "{name:8} {spp:3} {method:8} {:+8.3} % {:+9.2} %  {:10.4}",
                    100.0 * b.overall,
                    100.0 * b.worst,
                    b.squared / b.variance
                );
            }
            let weighted = &measured[0];
            assert!(weighted.squared < before, "{name}: the bias does not fall");
            before = weighted.squared;
            let share = weighted.squared / weighted.variance;
            assert!(
                spp < 64 || share < 0.1,
                "{name}: squared bias over variance is {share}"
            );
        }
    }
}
