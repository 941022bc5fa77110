//! Weighted reconstruction and the error estimate: on synthetic halves with noise of known variance, and
//! on what no solver likes.

use crate::common::Rng;
use gdpt::estimate::Planes;
use gdpt::image::Image;
use gdpt::reconstruct::error_estimate::{self, HalfPictures, Halved};
use gdpt::reconstruct::{Alpha, Method, Reconstruction, Source, run};

/// Samples of each half that the synthetic variances stand for.
const SAMPLES: [u64; 2] = [32, 32];

/// A normally distributed number (Box and Muller).
fn normal(rng: &mut Rng) -> f32 {
    let (u, v) = (1.0 - rng.next(), rng.next());
    (-2.0 * u.ln()).sqrt() * (std::f32::consts::TAU * v).cos()
}

/// Standard deviations of the noise of one half at pixel `i`: of the primal and of the differences.
type Noise<'a> = &'a dyn Fn(usize) -> (f32, f32);

/// One channel of a half: the truth with noise.
fn noisy(truth: &[f32], width: usize, noise: Noise, rng: &mut Rng) -> Planes {
    let n = truth.len();
    let mut p = Planes::default();
    for i in 0..n {
        let (sp, sg) = noise(i);
        p.primal.push(truth[i] + sp * normal(rng));
        p.primal_variance.push(sp * sp);
        let mut difference = |other: usize, exists: bool| {
            let g = normal(rng);
            if exists {
                (truth[other] - truth[i] + sg * g, sg * sg)
            } else {
                (0.0, 0.0)
            }
        };
        let (dx, dx_variance) = difference((i + 1).min(n - 1), i % width + 1 < width);
        let (dy, dy_variance) = difference((i + width).min(n - 1), i + width < n);
        p.dx.push(dx);
        p.dx_variance.push(dx_variance);
        p.dy.push(dy);
        p.dy_variance.push(dy_variance);
    }
    p
}

/// Both halves of three channels of the same truth.
fn halves(truth: &[f32], width: usize, noise: Noise, seed: u64) -> Vec<[Planes; 3]> {
    let mut rng = Rng(seed);
    let mut half = || [(); 3].map(|()| noisy(truth, width, noise, &mut rng));
    vec![half(), half()]
}

fn solve(halves: &[[Planes; 3]], width: usize, method: Method) -> Reconstruction {
    let height = halves[0][0].primal.len() / width;
    let source = Source {
        size: (width, height),
        samples: SAMPLES,
        planes: &|half, channel| halves[half][channel].clone(),
        features: None,
    };
    run(method, &source)
}

fn picture(width: usize, height: usize) -> Vec<f32> {
    (0..width * height)
        .map(|i| {
            let (x, y) = ((i % width) as f32, (i / width) as f32);
            0.5 + 0.3 * (0.4 * x).sin() * (0.3 * y).cos() + if x > y { 0.4 } else { 0.0 }
        })
        .collect()
}

/// The Cramér-Rao bound: the mean variance of the best unbiased estimate that knows all variances, the
/// trace of the inverse of the normal equations over the number of pixels.
fn bound(width: usize, height: usize, noise: Noise) -> f64 {
    let n = width * height;
    let mut a = vec![vec![0.0f64; 2 * n]; n];
    for i in 0..n {
        a[i][n + i] = 1.0;
        // Both halves together have half the variance.
        let weights = noise(i);
        let (v, w) = (
            2.0 / f64::from(weights.0).powi(2),
            2.0 / f64::from(weights.1).powi(2),
        );
        a[i][i] += v;
        let right = (i % width + 1 < width).then_some(i + 1);
        let below = (i + width < n).then_some(i + width);
        for j in [right, below].into_iter().flatten() {
            a[i][i] += w;
            a[j][j] += w;
            a[i][j] -= w;
            a[j][i] -= w;
        }
    }
    // Gauss and Jordan.
    for i in 0..n {
        let scale = 1.0 / a[i][i];
        a[i].iter_mut().for_each(|x| *x *= scale);
        let pivot = a[i].clone();
        for (j, row) in a.iter_mut().enumerate() {
            if j != i && row[i] != 0.0 {
                let factor = row[i];
                row.iter_mut()
                    .zip(&pivot)
                    .for_each(|(x, p)| *x -= factor * p);
            }
        }
    }
    (0..n).map(|i| a[i][n + i]).sum::<f64>() / n as f64
}

fn squared_error(image: &Image, truth: &[f32]) -> f64 {
    let of = |channel: &Vec<f32>| -> f64 {
        let pairs = channel.iter().zip(truth);
        pairs.map(|(a, b)| f64::from(a - b).powi(2)).sum()
    };
    image.channels.iter().map(of).sum::<f64>() / (3 * truth.len()) as f64
}

/// Within a tenth of the Cramér-Rao bound, for noise that is the same everywhere and for noise that
/// varies ten times in variance; and the estimated error is the true one.
#[test]
fn it_reaches_the_cramer_rao_bound_and_knows_its_error() {
    let (width, height) = (22, 18);
    let truth = picture(width, height);
    let varying = |i: usize| {
        let x = (i % width) as f32 / width as f32;
        (0.1 * (1.0 + 2.0 * x), 0.02 * (1.0 + 2.0 * (1.0 - x)))
    };
    let noises: [(&str, Noise); 3] = [
        ("constant", &|_| (0.1, 0.03)),
        ("varying", &varying),
        ("gradients worse than the primal", &|_| (0.02, 0.2)),
    ];
    const SEEDS: u64 = 60;
    for (name, noise) in noises {
        let bound = bound(width, height, noise);
        let (mut error, mut estimated) = (0.0, 0.0);
        for seed in 0..SEEDS {
            let made = solve(&halves(&truth, width, noise, seed), width, Method::Weighted);
            error += squared_error(&made.picture, &truth) / SEEDS as f64;
            let [black, others @ ..] = [(); 3].map(|()| Image::new(width, height));
            let solved = Halved {
                all: &made.picture,
                halves: &made.halves.unwrap(),
            };
            let direct = Halved {
                all: &black,
                halves: &HalfPictures::Alike(others),
            };
            let standard = error_estimate::estimate(solved, direct, SAMPLES).standard;
            let squares = standard.channels.iter().flatten().map(|s| f64::from(s * s));
            estimated += squares.sum::<f64>() / (3 * truth.len() as u64 * SEEDS) as f64;
        }
        // The mean over 60 seeds and 3 channels of 396 correlated pixels has a deviation of about 1 %.
        let ratio = error / bound;
        assert!(
            (0.95..1.1).contains(&ratio),
            "{name}: {ratio:.3} of the bound"
        );
        // Disagreeing differences count for less, so the halves agree somewhat too well; and not all is noise that the
        // witness takes from their mean.
        let ratio = estimated / error;
        assert!(
            (0.7..1.1).contains(&ratio),
            "{name}: estimated {ratio:.3} of the error"
        );
    }
}

/// One difference of one half is an outlier: it must not spread.
#[test]
fn an_outlier_stays_where_it_is() {
    let (width, height) = (40, 40);
    let truth = picture(width, height);
    let mut halves = halves(&truth, width, &|_| (0.1, 0.02), 3);
    let clean = solve(&halves, width, Method::Weighted).picture;
    for planes in &mut halves[0] {
        planes.dx[20 * width + 20] += 100.0;
        planes.dy[10 * width + 30] -= 100.0;
    }
    let change = |method| {
        let picture = solve(&halves, width, method).picture;
        let pairs = picture.channels[0].iter().zip(&clean.channels[0]);
        pairs.map(|(a, b)| (a - b).abs()).fold(0.0, f32::max)
    };
    let weighted = change(Method::Weighted);
    let plain = change(Method::L2(Alpha::Fixed(0.2)));
    assert!(weighted < 0.1 && plain > 1.0, "{weighted} {plain}");
}

/// A highlight of four pixels, with noise as large as it is bright, leaves the picture around it what it is without one.
#[test]
fn a_highlight_leaves_the_rest_as_it_is() {
    let (w, h) = (256, 256);
    let lit = |i: usize| (i % w / 2, i / w / 2) == (20, 30);
    let far = |i: usize| (i % w).abs_diff(40) > 24 || (i / w).abs_diff(60) > 24;
    let error = |brightness: f32| {
        let mut truth = picture(w, h);
        (0..w * h)
            .filter(|&i| lit(i))
            .for_each(|i| truth[i] += brightness);
        let near = |i: usize| lit(i) || lit(i + 1) || lit(i + w);
        let noise = |i: usize| {
            let of_highlight = |there: bool| if there { 0.5 * brightness } else { 0.0 };
            (0.1 + of_highlight(lit(i)), 0.02 + of_highlight(near(i)))
        };
        let made = solve(&halves(&truth, w, &noise, 5), w, Method::Weighted).picture;
        let pairs = made.channels[0].iter().zip(&truth).enumerate();
        let squares = pairs.filter(|(i, _)| far(*i));
        squares
            .map(|(_, (a, b))| f64::from(a - b).powi(2))
            .sum::<f64>()
    };
    let (without, with) = (error(0.0), error(100.0));
    assert!(with < 1.3 * without, "{with} against {without}");
}

/// A dot that value and differences of one half agree about: the other half knows better, and the light that it stands
/// for stays in its neighbourhood.
#[test]
fn a_dot_of_one_half_goes_and_leaves_its_light() {
    let (width, height) = (40, 40);
    let truth = picture(width, height);
    let mut halves = halves(&truth, width, &|_| (0.1, 0.02), 7);
    let clean = solve(&halves, width, Method::Weighted).picture;
    let (dot, at) = (10.0, 18 * width + 22);
    for planes in &mut halves[0] {
        // A single sample, so its mean is its deviation.
        planes.primal[at] += dot;
        planes.primal_variance[at] += dot * dot;
        for (edge, sign) in [(at, -1.0), (at - 1, 1.0)] {
            planes.dx[edge] += sign * dot;
            planes.dx_variance[edge] += dot * dot;
        }
        for (edge, sign) in [(at, -1.0), (at - width, 1.0)] {
            planes.dy[edge] += sign * dot;
            planes.dy_variance[edge] += dot * dot;
        }
    }
    let dotted = solve(&halves, width, Method::Weighted);
    let change = |pixel: usize| dotted.picture.channels[1][pixel] - clean.channels[1][pixel];
    // The mean of both halves has a half of it.
    assert!(change(at).abs() < 0.05 * dot, "{}", change(at));
    let sum: f32 = (0..width * height).map(change).sum();
    assert!((sum / (0.5 * dot) - 1.0).abs() < 0.1, "{sum}");
    let [with, _] = dotted.halves.unwrap().pictures().clone();
    assert!(with.channels[1][at] > 0.7 * dot);
}

#[test]
fn auto_alpha_is_the_ratio_of_the_variances() {
    let (width, height) = (24, 20);
    let truth = picture(width, height);
    let halves = halves(&truth, width, &|_| (0.1, 0.03), 5);
    let auto = solve(&halves, width, Method::L2(Alpha::Auto)).picture;
    // The last column and row have no differences: 1 in 24 and 1 in 20 fewer.
    let missing = 0.5 * (23.0f32 / 24.0 + 19.0 / 20.0);
    let fixed = Alpha::Fixed(0.3 * missing.sqrt());
    let fixed = solve(&halves, width, Method::L2(fixed)).picture;
    for (a, b) in auto
        .channels
        .iter()
        .flatten()
        .zip(fixed.channels.iter().flatten())
    {
        assert!((a - b).abs() < 1e-5);
    }
}

fn all_finite(made: &Reconstruction) -> bool {
    made.picture
        .channels
        .iter()
        .flatten()
        .all(|v| v.is_finite())
}

#[test]
fn degenerate_inputs_come_out_finite() {
    for (width, height) in [(1, 1), (1, 30), (30, 1), (2, 2), (17, 9)] {
        let truth = picture(width, height);
        let black = vec![0.0; truth.len()];
        let still: Noise = &|_| (0.0, 0.0);
        // Variances of up to 12 orders of magnitude apart, pixel by pixel.
        let wild: Noise = &|i| {
            let s = 10f32.powi((i * 7 % 13) as i32 - 6);
            (s.sqrt(), (1.0 / s).sqrt())
        };
        for (what, truth, noise) in [
            ("black", &black, still),
            ("no noise", &truth, still),
            ("wild weights", &truth, wild),
            ("noise on black", &black, &|_| (0.1, 0.1)),
        ] {
            for method in [
                Method::Weighted,
                Method::L2(Alpha::Auto),
                Method::L1(Alpha::Auto),
                Method::Primal,
            ] {
                let made = solve(&halves(truth, width, noise, 1), width, method);
                assert!(all_finite(&made), "{what} {width}x{height} {method:?}");
                if what == "no noise" || what == "black" {
                    for (got, want) in made.picture.channels[1].iter().zip(truth) {
                        assert!(
                            (got - want).abs() < 1e-4,
                            "{what} {width}x{height} {method:?}"
                        );
                    }
                }
            }
        }
    }
}

/// With less than two samples in a half there are no variances: then it is L2.
#[test]
fn few_samples_fall_back_to_l2() {
    let (width, height) = (20, 10);
    let truth = picture(width, height);
    let mut halves = halves(&truth, width, &|_| (0.1, 0.02), 3);
    for plane in halves.iter_mut().flatten() {
        for variance in [
            &mut plane.primal_variance,
            &mut plane.dx_variance,
            &mut plane.dy_variance,
        ] {
            variance.fill(f32::INFINITY);
        }
    }
    for samples in [[0, 0], [1, 0], [1, 1], [2, 1]] {
        let source = Source {
            size: (width, height),
            samples,
            planes: &|half, channel| halves[half][channel].clone(),
            features: None,
        };
        let weighted = run(Method::Weighted, &source);
        assert!(all_finite(&weighted));
        let l2 = run(Method::L2(Alpha::Fixed(0.2)), &source);
        assert_eq!(weighted.picture, l2.picture, "{samples:?}");
        assert_eq!(weighted.halves.is_some(), samples[1] > 0);
    }
}

#[test]
fn scale_transposition_and_channels_do_not_matter() {
    let (width, height) = (26, 19);
    let truth = picture(width, height);
    let noise = |i: usize| (0.05 + 0.01 * (i % 7) as f32, 0.02);
    let original = halves(&truth, width, &noise, 11);
    let want = solve(&original, width, Method::Weighted).picture;
    let near = |a: &[f32], b: &[f32], scale: f32| {
        a.iter()
            .zip(b)
            .all(|(a, b)| (a - b * scale).abs() < 2e-3 * scale)
    };

    // A power of two changes no mantissa.
    let mut scaled = original.clone();
    for p in scaled.iter_mut().flatten() {
        [&mut p.primal, &mut p.dx, &mut p.dy]
            .into_iter()
            .flatten()
            .for_each(|v| *v *= 1024.0);
        let variances = [
            &mut p.primal_variance,
            &mut p.dx_variance,
            &mut p.dy_variance,
        ];
        variances
            .into_iter()
            .flatten()
            .for_each(|v| *v *= 1024.0 * 1024.0);
    }
    let got = solve(&scaled, width, Method::Weighted).picture;
    for c in 0..3 {
        assert!(near(&got.channels[c], &want.channels[c], 1024.0), "scaled");
    }

    let mut swapped = original.clone();
    swapped.iter_mut().for_each(|half| half.swap(0, 2));
    let got = solve(&swapped, width, Method::Weighted).picture;
    assert_eq!(got.channels[2], want.channels[0]);
    assert_eq!(got.channels[0], want.channels[2]);

    let transpose = |v: &[f32], width: usize| -> Vec<f32> {
        let height = v.len() / width;
        (0..v.len())
            .map(|i| v[i % height * width + i / height])
            .collect()
    };
    let turned: Vec<[Planes; 3]> = original
        .iter()
        .map(|half| {
            half.clone().map(|p| Planes {
                primal: transpose(&p.primal, width),
                dx: transpose(&p.dy, width),
                dy: transpose(&p.dx, width),
                primal_variance: transpose(&p.primal_variance, width),
                dx_variance: transpose(&p.dy_variance, width),
                dy_variance: transpose(&p.dx_variance, width),
            })
        })
        .collect();
    let got = solve(&turned, height, Method::Weighted).picture;
    for c in 0..3 {
        assert!(
            near(&transpose(&got.channels[c], height), &want.channels[c], 1.0),
            "turned"
        );
    }
}

/// A constant image with exact differences and a noisy primal comes out constant.
#[test]
fn exact_differences_leave_the_noise_of_the_mean_alone() {
    let (width, height) = (32, 32);
    let truth = vec![0.7; width * height];
    let halves = halves(&truth, width, &|_| (0.1, 0.0), 2);
    let picture = solve(&halves, width, Method::Weighted).picture;
    for channel in &picture.channels {
        let mean = channel.iter().sum::<f32>() / truth.len() as f32;
        // The noise was 0.1; the solve ends when little of it is left.
        assert!(channel.iter().all(|v| (v - mean).abs() < 5e-3));
        // 2048 values with a deviation of 0.1: that of their mean is 0.0022.
        assert!((mean - 0.7).abs() < 0.01, "{mean}");
    }
}
