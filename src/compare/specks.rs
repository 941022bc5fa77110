//! How much of an error is dots and dashes: what the eye sees first, and relMSE does not tell from blotches.

use super::{EPSILON, References};
use crate::image::Image;

/// What the Laplacian (four times a pixel, less its four neighbours) makes of the variance of white noise.
const OF_WHITE_NOISE: f64 = 20.0;

/// The relative squared error of the Laplacian over that of white noise: relMSE where errors of neighbouring pixels are
/// independent, next to nothing where they are alike. As relMSE it is free of the noise of two references. 0 of pictures of fewer than
/// 3×3 pixels: those at the border have no Laplacian.
pub(super) fn rel_mse_specks(image: &Image, references: References) -> f64 {
    let (width, height) = (image.width, image.height);
    if width < 3 || height < 3 {
        return 0.0;
    }
    let mut sum = 0.0;
    for c in 0..3 {
        let error = |i: usize| {
            let value = f64::from(image.channels[c][i]);
            references.at(c, i).map(|r| value - r)
        };
        for y in 1..height - 1 {
            for x in 1..width - 1 {
                let i = y * width + x;
                let mut laplacian = error(i).map(|e| 4.0 * e);
                for neighbour in [i - 1, i + 1, i - width, i + width] {
                    let there = error(neighbour);
                    laplacian = [0, 1].map(|r| laplacian[r] - there[r]);
                }
                let [r1, r2] = references.at(c, i);
                let reference = 0.5 * (r1 + r2);
                sum += laplacian[0] * laplacian[1] / (reference * reference + EPSILON);
            }
        }
    }
    sum / (OF_WHITE_NOISE * (3 * (width - 2) * (height - 2)) as f64)
}

#[cfg(test)]
mod tests {
    use super::super::errors;
    use super::*;
    use glam::Vec3;

    /// Grey of 1 with errors by place.
    fn grey(size: usize, error: impl Fn(usize, usize) -> f32) -> [Image; 2] {
        let (mut image, mut reference) = (Image::new(size, size), Image::new(size, size));
        for i in 0..size * size {
            reference.set(i, Vec3::ONE);
            image.set(i, Vec3::splat(1.0 + error(i % size, i / size)));
        }
        [image, reference]
    }

    #[test]
    fn noise_is_specks_and_blotches_are_not() {
        let noise = |x: usize, y: usize| {
            let bits = ((x + 1000 * y + 1) as u64).wrapping_mul(0x9e37_79b9_7f4a_7c15);
            let bits = (bits ^ bits >> 29).wrapping_mul(0xbf58_476d_1ce4_e5b9) >> 40;
            0.1 * (bits as f32 / (1u64 << 23) as f32 - 1.0)
        };
        let [image, reference] = grey(128, noise);
        let found = errors(&image, References::One(&reference));
        // 16,000 independent values: both are known to 1 %.
        let ratio = found.rel_mse_specks / found.rel_mse.value;
        assert!((ratio - 1.0).abs() < 0.05, "{ratio}");
        let wave = |x: usize, y: usize| 0.1 * (0.1 * x as f32).sin() * (0.1 * y as f32).cos();
        let [image, reference] = grey(128, wave);
        let found = errors(&image, References::One(&reference));
        assert!(found.rel_mse_specks < 1e-4 * found.rel_mse.value);
        // A dot of 1 has 16 + 4 times its square.
        let [image, reference] = grey(12, |x, y| f32::from(u8::from((x, y) == (5, 6))));
        let found = errors(&image, References::One(&reference));
        assert!((found.rel_mse_specks * 100.0 * 1.01 - 1.0).abs() < 1e-6);
    }
}
