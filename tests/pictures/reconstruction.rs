//! L2 against a dense solve and its invariants; L1 on data with outliers.

use crate::common::{self, Rng};
use gdpt::image::Image;
use gdpt::reconstruct::{Problem, l1, l2};
use proptest::prelude::*;

fn noise(width: usize, height: usize, seed: u64) -> Image {
    let mut rng = Rng(seed);
    let mut image = Image::new(width, height);
    image
        .channels
        .iter_mut()
        .flatten()
        .for_each(|v| *v = rng.next() * 2.0 - 0.5);
    image
}

fn gradients(image: &Image) -> (Image, Image) {
    let (w, h) = (image.width, image.height);
    let (mut dx, mut dy) = (Image::new(w, h), Image::new(w, h));
    for i in 0..w * h {
        if i % w + 1 < w {
            dx.set(i, image.get(i + 1) - image.get(i));
        }
        if i / w + 1 < h {
            dy.set(i, image.get(i + w) - image.get(i));
        }
    }
    (dx, dy)
}

/// The normal equations of Σ(DI − G)² + α²Σ(I − P)², solved by Gaussian elimination in doubles.
fn dense(primal: &Image, dx: &Image, dy: &Image, alpha: f32, channel: usize) -> Vec<f64> {
    let (w, h) = (primal.width, primal.height);
    let n = w * h;
    let screen = f64::from(alpha * alpha);
    let mut a = vec![vec![0.0; n + 1]; n];
    for (i, row) in a.iter_mut().enumerate() {
        row[i] += screen;
        row[n] += screen * f64::from(primal.channels[channel][i]);
    }
    let mut edge = |from: usize, to: usize, g: f32| {
        a[from][from] += 1.0;
        a[to][to] += 1.0;
        a[from][to] -= 1.0;
        a[to][from] -= 1.0;
        a[to][n] += f64::from(g);
        a[from][n] -= f64::from(g);
    };
    for i in 0..n {
        if i % w + 1 < w {
            edge(i, i + 1, dx.channels[channel][i]);
        }
        if i / w + 1 < h {
            edge(i, i + w, dy.channels[channel][i]);
        }
    }
    // Symmetric and positive definite: no pivoting needed.
    for i in 0..n {
        let pivot = a[i].clone();
        for row in a.iter_mut().skip(i + 1) {
            let factor = row[i] / pivot[i];
            for (x, p) in row.iter_mut().zip(&pivot).skip(i) {
                *x -= factor * p;
            }
        }
    }
    let mut x = vec![0.0; n];
    for i in (0..n).rev() {
        let known: f64 = (i + 1..n).map(|j| a[i][j] * x[j]).sum();
        x[i] = (a[i][n] - known) / a[i][i];
    }
    x
}

fn sum(image: &Image, channel: usize) -> f64 {
    image.channels[channel].iter().map(|&v| f64::from(v)).sum()
}

proptest! {
    #![proptest_config(common::cases(60))]

    #[test]
    fn l2_is_the_dense_solution(w in 1usize..9, h in 1usize..9, seed in any::<u64>(), alpha in 0.05f32..2.0) {
        let (primal, dx, dy) = (noise(w, h, seed), noise(w, h, seed ^ 1), noise(w, h, seed ^ 2));
        let picture = l2::solve(&Problem { primal: &primal, dx: &dx, dy: &dy }, alpha);
        for c in 0..3 {
            let want = dense(&primal, &dx, &dy, alpha, c);
            let scale = want.iter().fold(1.0f64, |m, v| m.max(v.abs()));
            for (got, want) in picture.channels[c].iter().zip(want) {
                prop_assert!((f64::from(*got) - want).abs() < 2e-5 * scale, "{got} {want}");
            }
        }
    }

    #[test]
    fn l2_keeps_the_sum_of_the_primal(w in 1usize..70, h in 1usize..70, seed in any::<u64>()) {
        let (primal, dx, dy) = (noise(w, h, seed), noise(w, h, seed ^ 1), noise(w, h, seed ^ 2));
        let picture = l2::solve(&Problem { primal: &primal, dx: &dx, dy: &dy }, 0.2);
        for c in 0..3 {
            prop_assert!((sum(&picture, c) - sum(&primal, c)).abs() < 1e-5 * (w * h) as f64 + 1e-4);
        }
    }

    #[test]
    fn exact_gradients_give_back_the_exact_image(w in 1usize..60, h in 1usize..60, seed in any::<u64>(), alpha in 0.01f32..1.0) {
        let image = noise(w, h, seed);
        let (dx, dy) = gradients(&image);
        let problem = Problem { primal: &image, dx: &dx, dy: &dy };
        for picture in [l2::solve(&problem, alpha), l1::solve(&problem, alpha).0] {
            let error = |i| (picture.get(i) - image.get(i)).abs().max_element();
            let largest = (0..w * h).map(error).fold(0.0, f32::max);
            // The mean of the differences is 0 but for rounding, and is divided by alpha².
            prop_assert!(largest < 5e-6 + 2e-7 / (alpha * alpha), "{largest} with {alpha}");
        }
    }
}

#[test]
fn without_a_screen_gradients_give_the_image_up_to_the_primals_mean() {
    let image = noise(40, 30, 5);
    let (dx, dy) = gradients(&image);
    let flat = Image {
        channels: std::array::from_fn(|_| vec![7.0; 1200]),
        ..image.clone()
    };
    let picture = l2::solve(
        &Problem {
            primal: &flat,
            dx: &dx,
            dy: &dy,
        },
        0.0,
    );
    for c in 0..3 {
        let shift = 7.0 - sum(&image, c) as f32 / 1200.0;
        for (got, want) in picture.channels[c].iter().zip(&image.channels[c]) {
            assert!((got - want - shift).abs() < 1e-4);
        }
    }
}

/// One gradient in a hundred is an outlier of a hundred times the image's contrast: L2 spreads it, L1
/// does not.
#[test]
fn l1_ignores_outliers() {
    let (w, h) = (48, 40);
    let mut image = Image::new(w, h);
    for i in 0..w * h {
        let (x, y) = (i % w, i / w);
        image.set(i, glam::Vec3::splat(if x + 2 * y < 60 { 0.2 } else { 0.9 }));
    }
    let (mut dx, dy) = gradients(&image);
    let mut rng = Rng(8);
    for i in 0..w * h {
        if i % w + 1 < w && rng.next() < 0.01 {
            dx.set(i, glam::Vec3::splat(70.0 * (rng.next() - 0.5)));
        }
    }
    let mut primal = image.clone();
    primal
        .channels
        .iter_mut()
        .flatten()
        .for_each(|v| *v += 0.05 * (rng.next() - 0.5));
    let problem = Problem {
        primal: &primal,
        dx: &dx,
        dy: &dy,
    };
    let error = |picture: &Image| -> f64 {
        let pairs = picture
            .channels
            .iter()
            .flatten()
            .zip(image.channels.iter().flatten());
        pairs.map(|(a, b)| f64::from((a - b).powi(2))).sum::<f64>() / (3 * w * h) as f64
    };
    let (robust, solution) = l1::solve(&problem, 0.2);
    let plain = l2::solve(&problem, 0.2);
    assert!(solution.iterations > 0 && solution.residual < 2e-3);
    let (robust, plain) = (error(&robust), error(&plain));
    assert!(robust < 2e-3 && plain > 1.0, "{robust} {plain}");
}

#[test]
fn degenerate_images_come_out_finite() {
    for (w, h) in [(1, 1), (1, 20), (20, 1), (16, 16)] {
        let black = Image::new(w, h);
        let problem = Problem {
            primal: &black,
            dx: &black,
            dy: &black,
        };
        assert_eq!(l2::solve(&problem, 0.2), black);
        assert!(
            l1::solve(&problem, 0.2)
                .0
                .channels
                .iter()
                .flatten()
                .all(|v| v.abs() < 1e-6)
        );
    }
}
