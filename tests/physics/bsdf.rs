//! Every BSDF and sampler: sampling against density (χ²), densities integrate to 1, reciprocity, energy.

use crate::common::{Rng, chi_square};
use gdpt::bsdf::plastic::Coat;
use gdpt::bsdf::{Bsdf, Lobe, fresnel, ggx};
use gdpt::warp;
use glam::{Vec2, Vec3};
use std::f32::consts::{PI, TAU};

/// For each χ² test; there are about 80, so together they fail by chance once in 1200 changes of seeds.
const SIGNIFICANCE: f64 = 1e-5;

fn bsdfs() -> Vec<(&'static str, Bsdf)> {
    let f0 = Vec3::new(0.9, 0.6, 0.3);
    let tint = Vec3::new(0.9, 0.8, 1.0);
    vec![
        (
            "lambert",
            Bsdf::Lambert {
                albedo: Vec3::new(0.8, 0.5, 0.2),
            },
        ),
        ("conductor 0.15", Bsdf::Conductor { f0, alpha: 0.15 }),
        ("conductor 0.5", Bsdf::Conductor { f0, alpha: 0.5 }),
        ("conductor 1", Bsdf::Conductor { f0, alpha: 1.0 }),
        (
            "rough glass 1.5 0.35",
            Bsdf::RoughGlass {
                ior: 1.5,
                alpha: 0.35,
                tint,
            },
        ),
        (
            "rough glass 1.5 0.6",
            Bsdf::RoughGlass {
                ior: 1.5,
                alpha: 0.6,
                tint,
            },
        ),
        (
            "rough glass 0.7 0.4",
            Bsdf::RoughGlass {
                ior: 0.7,
                alpha: 0.4,
                tint,
            },
        ),
        ("plastic 0.1", plastic(0.1, 0.0)),
        ("plastic 0.5", plastic(0.5, 0.0)),
        ("plastic under a smooth coat", plastic(0.0, 0.0)),
        ("half metal 0.3", plastic(0.3, 0.5)),
        (
            "rough pane 1.5 0.35",
            Bsdf::RoughThin {
                ior: 1.5,
                alpha: 0.35,
                tint,
            },
        ),
        (
            "rough pane 0.7 0.6",
            Bsdf::RoughThin {
                ior: 0.7,
                alpha: 0.6,
                tint,
            },
        ),
        ("half open Lambert", half_open(Coat::NONE)),
        ("half open plastic 0.3", half_open(coat(0.3, 0.2))),
        (
            "half open plastic under a smooth coat",
            half_open(coat(0.0, 0.0)),
        ),
    ]
}

fn half_open(coat: Coat) -> Bsdf {
    Bsdf::Plastic {
        albedo: Vec3::new(0.9, 0.5, 0.2),
        coat: Coat {
            opacity: 0.4,
            through: Vec3::new(0.6, 0.3, 0.5),
            ..coat
        },
    }
}

fn plastic(alpha: f32, metallic: f32) -> Bsdf {
    Bsdf::Plastic {
        albedo: Vec3::new(0.9, 0.5, 0.2),
        coat: coat(alpha, metallic),
    }
}

fn coat(alpha: f32, metallic: f32) -> Coat {
    Coat {
        f0: 0.04,
        tint: Vec3::new(1.0, 0.9, 0.5),
        metallic,
        metal: Vec3::new(0.9, 0.6, 0.3),
        alpha,
        ..Coat::NONE
    }
}

const LOBES: [Lobe; 2] = [Lobe::Reflection, Lobe::Transmission];

/// Directions towards the camera: steep, slanted, grazing, and from below.
fn outgoing() -> [Vec3; 4] {
    let at = |degrees: f32, phi: f32, side: f32| {
        let (sin, cos) = degrees.to_radians().sin_cos();
        Vec3::new(sin * phi.cos(), sin * phi.sin(), cos * side)
    };
    [
        at(5.0, 0.3, 1.0),
        at(40.0, 2.0, 1.0),
        at(80.0, 4.0, 1.0),
        at(50.0, 1.0, -1.0),
    ]
}

const ROWS: usize = 20;
const COLUMNS: usize = 20;
/// Integration points of a bin along each axis.
const FINE: usize = 64;

fn direction(z: f32, phi: f32) -> Vec3 {
    let r = (1.0 - z * z).max(0.0).sqrt();
    Vec3::new(r * phi.cos(), r * phi.sin(), z)
}

/// Integrals of a function over equal bins of the sphere in (z, φ).
fn integrate(f: impl Fn(Vec3) -> f64) -> Vec<f64> {
    let mut out = vec![0.0; ROWS * COLUMNS];
    let area = 4.0 * std::f64::consts::PI / (ROWS * COLUMNS * FINE * FINE) as f64;
    for row in 0..ROWS * FINE {
        for column in 0..COLUMNS * FINE {
            let z = -1.0 + 2.0 * (row as f32 + 0.5) / (ROWS * FINE) as f32;
            let phi = TAU * (column as f32 + 0.5) / (COLUMNS * FINE) as f32;
            out[row / FINE * COLUMNS + column / FINE] += area * f(direction(z, phi));
        }
    }
    out
}

fn bin(w: Vec3) -> usize {
    let row = ((w.z + 1.0) / 2.0 * ROWS as f32) as usize;
    let phi = w.y.atan2(w.x).rem_euclid(TAU);
    let column = (phi / TAU * COLUMNS as f32) as usize;
    row.min(ROWS - 1) * COLUMNS + column.min(COLUMNS - 1)
}

#[test]
fn samples_follow_the_density_and_the_density_integrates_to_one() {
    const N: usize = 200_000;
    for (name, bsdf) in bsdfs() {
        for (index, wo) in outgoing().into_iter().enumerate() {
            let what = format!("{name}, direction {index}");
            let density = integrate(|wi| bsdf.eval(wo, wi).map_or(0.0, |e| f64::from(e.pdf)));
            let mut rng = Rng(index as u64 + 77);
            let mut observed = vec![0.0; ROWS * COLUMNS];
            let (mut ended, mut single) = (0.0, 0.0);
            for _ in 0..N {
                match bsdf.sample(wo, [rng.next(), rng.next(), rng.next()]) {
                    Some(s) if s.delta => {
                        let e = bsdf.eval_delta(wo, s.lobe).unwrap();
                        assert_eq!((e.value, e.pdf), (s.value, s.pdf));
                        single += 1.0;
                    }
                    Some(s) => {
                        let e = bsdf
                            .eval(wo, s.wi)
                            .expect("what is sampled can be evaluated");
                        assert!(
                            (e.pdf - s.pdf).abs() <= 1e-4 * s.pdf,
                            "{what}: {} {}",
                            e.pdf,
                            s.pdf
                        );
                        assert!((s.wi.z * wo.z > 0.0) == (s.lobe == Lobe::Reflection));
                        observed[bin(s.wi)] += 1.0;
                    }
                    None => ended += 1.0,
                }
            }
            let total: f64 = density.iter().sum::<f64>() + (ended + single) / N as f64;
            let single_of = |lobe| bsdf.eval_delta(wo, lobe).map_or(0.0, |e| f64::from(e.pdf));
            let probability: f64 = LOBES.map(single_of).iter().sum();
            let deviation = (probability * (1.0 - probability) / N as f64).sqrt();
            assert!(
                (single / N as f64 - probability).abs() <= 5.0 * deviation,
                "{what}"
            );
            assert!(
                (total - 1.0).abs() < 0.01,
                "{what}: density and ended paths add to {total}"
            );
            let expected: Vec<f64> = density.iter().map(|d| d * N as f64).collect();
            chi_square(&what, &observed, &expected, SIGNIFICANCE);
        }
    }
}

#[test]
fn sampled_values_are_those_evaluated_and_conserve_energy() {
    for (name, bsdf) in bsdfs() {
        for wo in outgoing() {
            let mut rng = Rng(5);
            let (mut sampled, n) = (Vec3::ZERO, 100_000);
            for _ in 0..n {
                if let Some(s) = bsdf.sample(wo, [rng.next(), rng.next(), rng.next()]) {
                    let e = if s.delta {
                        bsdf.eval_delta(wo, s.lobe).unwrap()
                    } else {
                        bsdf.eval(wo, s.wi).unwrap()
                    };
                    assert!(
                        (e.value - s.value).abs().max_element() <= 1e-4 * s.value.max_element()
                    );
                    // Refraction into a denser medium gathers radiance: count power, not radiance.
                    let eta = if s.lobe == Lobe::Reflection {
                        1.0
                    } else if wo.z > 0.0 {
                        bsdf.ior()
                    } else {
                        1.0 / bsdf.ior()
                    };
                    sampled += s.value / s.pdf * eta * eta / n as f32;
                }
            }
            let integral = integrate(|wi| {
                let eta = if wo.z * wi.z > 0.0 {
                    1.0
                } else if wo.z > 0.0 {
                    bsdf.ior()
                } else {
                    1.0 / bsdf.ior()
                };
                bsdf.eval(wo, wi)
                    .map_or(0.0, |e| f64::from(e.value.x * eta * eta))
            });
            let single_of = |lobe| {
                bsdf.eval_delta(wo, lobe)
                    .map_or(0.0, |e| f64::from(e.value.x))
            };
            let single: f64 = LOBES.map(single_of).iter().sum();
            let integral: f64 = integral.iter().sum::<f64>() + single;
            assert!(integral < 1.0 + 1e-3, "{name}: reflects {integral}");
            assert!(
                (integral - f64::from(sampled.x)).abs() < 0.012,
                "{name}: {integral} {sampled}"
            );
        }
    }
}

/// What the coat of a white plastic does not reflect its Lambert part does: nothing is lost, nothing gained.
#[test]
fn white_plastic_reflects_everything() {
    for alpha in [0.0, 0.01, 0.05, 0.2, 0.5, 1.0] {
        let bsdf = Bsdf::Plastic {
            albedo: Vec3::ONE,
            coat: Coat {
                f0: 0.04,
                tint: Vec3::ONE,
                alpha,
                // What passes straight through is not lost either.
                opacity: 0.3,
                through: Vec3::splat(0.7),
                ..Coat::NONE
            },
        };
        for wo in outgoing() {
            let mut rng = Rng(8);
            let n = 200_000;
            let reflected: f64 = (0..n)
                .filter_map(|_| bsdf.sample(wo, [rng.next(), rng.next(), rng.next()]))
                .map(|s| f64::from(s.value.x / s.pdf) / f64::from(n))
                .sum();
            assert!(
                (reflected - 1.0).abs() < 0.01,
                "alpha {alpha}, {wo}: {reflected}"
            );
        }
    }
}

#[test]
fn bsdfs_are_reciprocal() {
    let mut rng = Rng(9);
    for (name, bsdf) in bsdfs() {
        for _ in 0..2000 {
            let (a, b) = (rng.unit_vector(), rng.unit_vector());
            if a.z.abs() < 0.05 || b.z.abs() < 0.05 {
                continue;
            }
            let there = bsdf.eval(a, b).map_or(Vec3::ZERO, |e| e.value / b.z.abs());
            let back = bsdf.eval(b, a).map_or(Vec3::ZERO, |e| e.value / a.z.abs());
            // With wo first: n_b² f(a, b) = n_a² f(b, a) (Veach 1997, equation 5.14).
            let index = |w: Vec3| if w.z > 0.0 { 1.0 } else { bsdf.ior() };
            let (there, back) = (there * index(b).powi(2), back * index(a).powi(2));
            let error = (there - back).abs().max_element();
            assert!(
                error <= 2e-3 * there.max_element() + 1e-6,
                "{name}: {a} {b}: {there} {back}"
            );
        }
    }
}

#[test]
fn smooth_materials_choose_lobes_by_their_coefficients() {
    let tint = Vec3::ONE;
    for (bsdf, lossless) in [
        (Bsdf::Mirror { f0: Vec3::ONE }, true),
        (Bsdf::Glass { ior: 1.5, tint }, true),
        (Bsdf::Glass { ior: 1.0, tint }, true),
        (Bsdf::Thin { ior: 1.5, tint }, true),
        (Bsdf::Thin { ior: 0.7, tint }, true),
        (Bsdf::Thin { ior: 1.0, tint }, true),
        (
            Bsdf::Mirror {
                f0: Vec3::splat(0.5),
            },
            false,
        ),
    ] {
        for wo in outgoing() {
            let mut reflected = 0;
            let mut rng = Rng(3);
            let n = 20_000;
            for _ in 0..n {
                let s = bsdf
                    .sample(wo, [rng.next(), rng.next(), rng.next()])
                    .unwrap();
                let e = bsdf.eval_delta(wo, s.lobe).unwrap();
                assert_eq!((e.value, e.pdf), (s.value, s.pdf));
                let index = if wo.z > 0.0 {
                    bsdf.ior()
                } else {
                    1.0 / bsdf.ior()
                };
                let eta = if s.lobe == Lobe::Reflection {
                    1.0
                } else {
                    index
                };
                let weight = s.value / s.pdf * eta * eta;
                if lossless {
                    assert!((weight - Vec3::ONE).abs().max_element() < 1e-5);
                }
                // Snell's law.
                let sine = |w: Vec3| (1.0 - w.z * w.z).max(0.0).sqrt();
                assert!((sine(wo) - eta * sine(s.wi)).abs() < 1e-5);
                reflected += u32::from(s.lobe == Lobe::Reflection);
            }
            let reflected = reflected as f32 / n as f32;
            let p = bsdf.eval_delta(wo, Lobe::Reflection).map_or(0.0, |e| e.pdf);
            let deviation = (p * (1.0 - p) / n as f32).sqrt();
            assert!(
                (reflected - p).abs() <= 5.0 * deviation + 1e-6,
                "{bsdf:?} {wo}: {reflected} {p}"
            );
        }
    }
}

/// The shares of a pane against the sum of all paths between its boundaries, one after the other.
#[test]
fn panes_sum_up_the_bounces_between_their_boundaries() {
    for (ior, tint) in [(1.5, 1.0), (1.5, 0.5), (2.4, 0.9), (0.8, 0.7), (1.33, 0.0)] {
        for wo in outgoing() {
            let cos = wo.z.abs();
            let r = f64::from(fresnel::dielectric(cos, ior));
            let (mut reflected, mut passes) = (r, 0.0);
            // Light inside, each time it arrives at a boundary.
            let mut inside = (1.0 - r) * f64::from(tint);
            for _ in 0..2000 {
                passes += inside * (1.0 - r);
                inside *= r * f64::from(tint);
                reflected += inside * (1.0 - r);
                inside *= r * f64::from(tint);
            }
            let pane = Bsdf::Thin {
                ior,
                tint: Vec3::splat(tint),
            };
            for (lobe, share) in LOBES.into_iter().zip([reflected, passes]) {
                let value = pane.eval_delta(wo, lobe).map_or(0.0, |e| e.value.x);
                assert!(
                    (f64::from(value) - share).abs() < 1e-5,
                    "{pane:?} {wo} {lobe:?}: {value} {share}"
                );
            }
        }
    }
}

/// Whether normals that `sample` draws, with two numbers in [0, 1), have this density per solid angle.
fn normals_follow(what: &str, density: impl Fn(Vec3) -> f32, sample: impl Fn([f32; 2]) -> Vec3) {
    const N: usize = 200_000;
    let density = integrate(|h| {
        if h.z <= 0.0 {
            0.0
        } else {
            f64::from(density(h))
        }
    });
    let total: f64 = density.iter().sum();
    assert!((total - 1.0).abs() < 0.01, "{what}: {total}");
    let mut observed = vec![0.0; ROWS * COLUMNS];
    let mut rng = Rng(1);
    for _ in 0..N {
        observed[bin(sample([rng.next(), rng.next()]))] += 1.0;
    }
    let expected: Vec<f64> = density.iter().map(|d| d * N as f64).collect();
    chi_square(what, &observed, &expected, SIGNIFICANCE);
}

#[test]
fn visible_normals_follow_their_density() {
    for alpha in [0.2, 0.5, 1.0] {
        for wo in outgoing().into_iter().filter(|w| w.z > 0.0) {
            normals_follow(
                &format!("visible normals, alpha {alpha}"),
                |h| ggx::visible_density::<f32>(wo.into(), h.into(), alpha),
                |u| ggx::sample::<f32>(wo.into(), alpha, u).into(),
            );
        }
    }
}

#[test]
fn normals_of_any_microfacet_follow_their_density() {
    for alpha in [0.1, 0.2, 0.5, 1.0] {
        normals_follow(
            &format!("normals, alpha {alpha}"),
            |h| h.z * ggx::density::<f32>(h.into(), alpha),
            |u| ggx::sample_any::<f32>(alpha, u).into(),
        );
    }
}

#[test]
fn warps_follow_their_densities() {
    const N: usize = 100_000;
    let mut rng = Rng(4);
    // Cosine hemisphere.
    let density = integrate(|w| f64::from(w.z.max(0.0) / PI));
    let mut observed = vec![0.0; ROWS * COLUMNS];
    for _ in 0..N {
        let w = warp::cosine_hemisphere::<f32>([rng.next(), rng.next()]);
        observed[bin(w.into())] += 1.0;
    }
    let expected: Vec<f64> = density.iter().map(|d| d * N as f64).collect();
    chi_square("cosine hemisphere", &observed, &expected, SIGNIFICANCE);
    // Disk, in 10 rings and 16 sectors of equal area.
    let mut observed = vec![0.0; 160];
    for _ in 0..N {
        let p = Vec2::from(warp::disk([rng.next(), rng.next()]));
        let ring = (p.length_squared() * 10.0).min(9.99) as usize;
        let sector = (p.y.atan2(p.x).rem_euclid(TAU) / TAU * 16.0).min(15.99) as usize;
        observed[ring * 16 + sector] += 1.0;
    }
    chi_square("disk", &observed, &[N as f64 / 160.0; 160], SIGNIFICANCE);
    // Triangle, in 100 small triangles of equal area: 10 strips along each axis, two halves a square.
    let mut observed = vec![0.0; 200];
    for _ in 0..N {
        let (u, v) = warp::triangle([rng.next(), rng.next()]);
        assert!(u >= 0.0 && v >= 0.0 && u + v <= 1.0 + 1e-6);
        let (i, j) = ((u * 10.0) as usize, (v * 10.0) as usize);
        let upper = (u * 10.0).fract() + (v * 10.0).fract() > 1.0;
        observed[(i.min(9) * 10 + j.min(9)) * 2 + usize::from(upper)] += 1.0;
    }
    let expected: Vec<f64> = (0..200)
        .map(|k| {
            let (i, j, upper) = (k / 20, k / 2 % 10, k % 2);
            if i + j + upper < 10 {
                N as f64 / 100.0
            } else {
                0.0
            }
        })
        .collect();
    chi_square("triangle", &observed, &expected, SIGNIFICANCE);
}
