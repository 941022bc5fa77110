//! Pixel filters by importance: the position inside or around the pixel is drawn from the filter, so that
//! every sample counts the same, or with the sign of the filter where it is negative. All pixels of a pass
//! share the position, as the offset paths need it.

use statrs::function::erf::{erf, erf_inv};

/// A pixel filter.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash, clap::ValueEnum)]
pub enum Filter {
    /// The pixel's area.
    #[default]
    Box,
    /// A pyramid two pixels wide.
    Tent,
    /// A Gaussian of standard deviation 0.5 pixels, cut off at 1.5.
    Gaussian,
    /// Mitchell and Netravali's of 1988 with B = C = 1/3, four pixels wide: sharper, in part negative.
    Mitchell,
}

/// A position drawn from a filter.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Position {
    /// Columns from the pixel's left edge; 0.5 is its middle.
    pub x: f32,
    /// Rows from its upper edge.
    pub y: f32,
    /// What the sample counts; 1 in the mean.
    pub weight: f32,
}

/// Standard deviation of the Gaussian, in pixels.
const DEVIATION: f64 = 0.5;
/// Where it ends, in pixels.
const CUT: f64 = 1.5;

impl Filter {
    /// The position for `u` in [0, 1)².
    pub fn position(self, u: [f32; 2]) -> Position {
        let [x, y] = u.map(|u| {
            let u = f64::from(u);
            match self {
                Filter::Box => (u - 0.5, 1.0),
                Filter::Tent if u < 0.5 => ((2.0 * u).sqrt() - 1.0, 1.0),
                Filter::Tent => (1.0 - (2.0 - 2.0 * u).sqrt(), 1.0),
                Filter::Gaussian => {
                    let scale = DEVIATION * std::f64::consts::SQRT_2;
                    (scale * erf_inv((2.0 * u - 1.0) * erf(CUT / scale)), 1.0)
                }
                Filter::Mitchell => mitchell_position(u),
            }
        });
        if self == Filter::Box {
            // Not by way of the middle: the bits of the number.
            return Position {
                x: u[0],
                y: u[1],
                weight: 1.0,
            };
        }
        Position {
            x: (0.5 + x.0) as f32,
            y: (0.5 + y.0) as f32,
            weight: (x.1 * y.1) as f32,
        }
    }

    /// The filter's value at a distance from the pixel's middle along one axis; its integral is 1.
    pub fn value(self, x: f64) -> f64 {
        let x = x.abs();
        match self {
            Filter::Box => f64::from(u8::from(x < 0.5)),
            Filter::Tent => (1.0 - x).max(0.0),
            Filter::Gaussian if x < CUT => {
                let scale = DEVIATION * std::f64::consts::SQRT_2;
                let whole = scale * std::f64::consts::PI.sqrt() * erf(CUT / scale);
                (-(x / scale).powi(2)).exp() / whole
            }
            Filter::Gaussian => 0.0,
            Filter::Mitchell if x < 1.0 => (7.0 * x.powi(3) - 12.0 * x * x + 16.0 / 3.0) / 6.0,
            Filter::Mitchell if x < 2.0 => {
                (-7.0 / 3.0 * x.powi(3) + 12.0 * x * x - 20.0 * x + 32.0 / 3.0) / 6.0
            }
            Filter::Mitchell => 0.0,
        }
    }
}

/// Position and weight along one axis, with the density |f| / ∫|f|: by bisection of its integral.
fn mitchell_position(u: f64) -> (f64, f64) {
    // Where the filter crosses 0, and ∫|f| from 0 to there and from there to 2.
    let (mut low, mut high) = (1.0, 1.5);
    for _ in 0..60 {
        let middle = 0.5 * (low + high);
        if Filter::Mitchell.value(middle) > 0.0 {
            low = middle;
        } else {
            high = middle;
        }
    }
    let zero = low;
    // Antiderivatives of both pieces.
    let inner = |x: f64| (7.0 / 4.0 * x.powi(4) - 4.0 * x.powi(3) + 16.0 / 3.0 * x) / 6.0;
    let outer =
        |x: f64| (-7.0 / 12.0 * x.powi(4) + 4.0 * x.powi(3) - 10.0 * x * x + 32.0 / 3.0 * x) / 6.0;
    let absolute = |x: f64| {
        if x < 1.0 {
            inner(x)
        } else if x < zero {
            inner(1.0) + outer(x) - outer(1.0)
        } else {
            inner(1.0) + 2.0 * outer(zero) - outer(1.0) - outer(x)
        }
    };
    let half = absolute(2.0);
    // Both sides alike.
    let (side, u) = if u < 0.5 {
        (-1.0, 1.0 - 2.0 * u)
    } else {
        (1.0, 2.0 * u - 1.0)
    };
    let (mut low, mut high) = (0.0, 2.0);
    for _ in 0..60 {
        let middle = 0.5 * (low + high);
        if absolute(middle) < u * half {
            low = middle;
        } else {
            high = middle;
        }
    }
    let x = 0.5 * (low + high);
    (side * x, 2.0 * half * Filter::Mitchell.value(x).signum())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn positions_have_the_density_of_the_filter() {
        // Weights of equidistant numbers, summed over intervals, against the integral of the filter.
        const STEPS: usize = 100_000;
        const BINS: usize = 40;
        for filter in [
            Filter::Box,
            Filter::Tent,
            Filter::Gaussian,
            Filter::Mitchell,
        ] {
            let mut found = [0.0f64; BINS];
            for i in 0..STEPS {
                let u = (i as f32 + 0.5) / STEPS as f32;
                // The other axis in the middle, where it counts alike for all.
                let p = filter.position([u, 0.5]);
                let middle = filter.position([0.5, 0.5]).weight.abs().sqrt();
                let bin = ((f64::from(p.x) + 1.5) * 10.0).floor() as usize;
                found[bin.min(BINS - 1)] += f64::from(p.weight / middle) / STEPS as f64;
            }
            for (bin, found) in found.iter().enumerate() {
                let low = bin as f64 / 10.0 - 2.0;
                let integral: f64 = (0..100)
                    .map(|k| filter.value(low + (k as f64 + 0.5) / 1000.0) / 1000.0)
                    .sum();
                assert!(
                    (found - integral).abs() < 2e-4,
                    "{filter:?} {low}: {found} {integral}"
                );
            }
            assert!((found.iter().sum::<f64>() - 1.0).abs() < 1e-3, "{filter:?}");
        }
    }
}
