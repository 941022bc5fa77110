//! Smoothing of variances: a blur of two boxes one after the other, at a cost that does not grow with its
//! radius.

use rayon::prelude::*;

const BOXES: usize = 2;

/// Blurs rows of `width` values with a standard deviation of about `sigma` pixels, reflecting at the
/// borders. The sum is kept. What is blurred is not negative, nor is what comes out.
pub(super) fn blur(data: &mut Vec<f32>, width: usize, sigma: f32) {
    both_ways(data, width, sigma, 0.0);
}

/// The same of values of any sign.
pub(super) fn blur_signed(data: &mut Vec<f32>, width: usize, sigma: f32) {
    both_ways(data, width, sigma, f64::NEG_INFINITY);
}

fn both_ways(data: &mut Vec<f32>, width: usize, sigma: f32, least: f64) {
    let height = data.len() / width;
    // The variance of two boxes of side 2r + 1 is ((2r + 1)² − 1)/6.
    let radius = ((((6.0 * sigma * sigma + 1.0).sqrt() - 1.0) / 2.0).round() as usize).max(1);
    along_rows(data, width, radius, least);
    let mut columns = super::dct::transpose(data, width, height);
    along_rows(&mut columns, height, radius, least);
    *data = super::dct::transpose(&columns, height, width);
}

fn along_rows(data: &mut [f32], width: usize, radius: usize, least: f64) {
    data.par_chunks_mut(width).for_each_init(
        || vec![0.0; width + 2 * radius + 1],
        |padded, row| {
            for _ in 0..BOXES {
                pad(row, padded, radius);
                box_filter(padded, row, radius, least);
            }
        },
    );
}

/// The row with `radius` values more on its left and `radius` + 1 on its right, reflected at the borders,
/// again and again where the box is wider than the row.
fn pad(row: &[f32], padded: &mut [f32], radius: usize) {
    let n = row.len();
    let reflected = |i: isize| {
        let i = i.rem_euclid(2 * n as isize) as usize;
        row[if i < n { i } else { 2 * n - 1 - i }]
    };
    let (left, rest) = padded.split_at_mut(radius);
    let (middle, right) = rest.split_at_mut(n);
    middle.copy_from_slice(row);
    for (i, out) in left.iter_mut().enumerate() {
        *out = reflected(i as isize - radius as isize);
    }
    for (i, out) in right.iter_mut().enumerate() {
        *out = reflected((n + i) as isize);
    }
}

/// The mean over `radius` values to each side. Running sums are in double precision: what was added is
/// taken away again, which may leave a rest below `least`.
fn box_filter(padded: &[f32], row: &mut [f32], radius: usize, least: f64) {
    let side = 2 * radius + 1;
    let scale = 1.0 / side as f64;
    let mut sum: f64 = padded[..side].iter().map(|&v| f64::from(v)).sum();
    for ((out, old), new) in row.iter_mut().zip(padded).zip(&padded[side..]) {
        *out = (sum * scale).max(least) as f32;
        sum += f64::from(*new) - f64::from(*old);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_spot_spreads_to_the_right_width_and_keeps_its_sum() {
        for sigma in [2.0, 8.0] {
            let width = 129;
            let mut data = vec![0.0; width * width];
            data[64 * width + 64] = 1.0;
            blur(&mut data, width, sigma);
            let (mut sum, mut second) = (0.0, 0.0);
            for (i, v) in data.iter().enumerate() {
                sum += v;
                second += v * ((i % width) as f32 - 64.0).powi(2);
            }
            assert!((sum - 1.0).abs() < 1e-4, "{sum}");
            assert!((second.sqrt() / sigma - 1.0).abs() < 0.25, "{second}");
        }
    }

    #[test]
    fn borders_reflect() {
        for (width, height) in [(1, 1), (1, 9), (3, 2), (40, 1)] {
            let mut data = vec![0.5; width * height];
            blur(&mut data, width, 8.0);
            assert!(data.iter().all(|&v| (v - 0.5).abs() < 1e-6));
        }
    }
}
