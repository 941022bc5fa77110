//! Likeness as displays show it: of pictures in sRGB, 8 bits a channel.

use crate::image::{Image, to_srgb};

const PEAK: f64 = 255.0;
/// Wang et al. 2004, section III-C: an 11×11 Gaussian window of standard deviation 1.5, K₁ and K₂.
const WINDOW: usize = 11;
const DEVIATION: f64 = 1.5;
const C1: f64 = (0.01 * PEAK) * (0.01 * PEAK);
const C2: f64 = (0.03 * PEAK) * (0.03 * PEAK);

/// Peak signal-to-noise ratio in decibels; infinite for equal pictures.
pub fn psnr(image: &Image, reference: &Image) -> f64 {
    let pairs = image.channels.iter().flatten();
    let pairs = pairs.zip(reference.channels.iter().flatten());
    let squares = pairs.map(|(&a, &b)| (f64::from(to_srgb(a)) - f64::from(to_srgb(b))).powi(2));
    let count = 3 * image.width * image.height;
    10.0 * (PEAK * PEAK / (squares.sum::<f64>() / count as f64)).log10()
}

/// Mean structural similarity (Wang et al. 2004, equation 13) of the Rec. 709 luma: 1 for equal pictures.
/// `None` where the image is smaller than the window.
pub fn ssim(image: &Image, reference: &Image) -> Option<f64> {
    let (width, height) = (image.width, image.height);
    if width < WINDOW || height < WINDOW {
        return None;
    }
    let [a, b] = [image, reference].map(luma);
    let mean = |f: &dyn Fn(f64, f64) -> f64| {
        let values: Vec<f64> = a.iter().zip(&b).map(|(&a, &b)| f(a, b)).collect();
        windows(&values, width, height)
    };
    let (mean_a, mean_b) = (mean(&|a, _| a), mean(&|_, b| b));
    let (aa, bb, ab) = (
        mean(&|a, _| a * a),
        mean(&|_, b| b * b),
        mean(&|a, b| a * b),
    );
    let sum: f64 = (0..mean_a.len())
        .map(|i| {
            let (ma, mb) = (mean_a[i], mean_b[i]);
            let (var_a, var_b) = (aa[i] - ma * ma, bb[i] - mb * mb);
            let covariance = ab[i] - ma * mb;
            (2.0 * ma * mb + C1) * (2.0 * covariance + C2)
                / ((ma * ma + mb * mb + C1) * (var_a + var_b + C2))
        })
        .sum();
    Some(sum / mean_a.len() as f64)
}

fn luma(image: &Image) -> Vec<f64> {
    let srgb = |i: usize| image.get(i).to_array().map(|v| f64::from(to_srgb(v)));
    (0..image.width * image.height)
        .map(srgb)
        .map(|[r, g, b]| 0.2126 * r + 0.7152 * g + 0.0722 * b)
        .collect()
}

/// Weighted means over all windows inside the image.
fn windows(values: &[f64], width: usize, height: usize) -> Vec<f64> {
    let away = |i: usize| i as f64 - (WINDOW / 2) as f64;
    let weights: [f64; WINDOW] =
        std::array::from_fn(|i| (-0.5 * (away(i) / DEVIATION).powi(2)).exp());
    let total: f64 = weights.iter().sum();
    let weights = weights.map(|w| w / total);
    let rows: Vec<f64> = values
        .chunks(width)
        .flat_map(|row| row.windows(WINDOW))
        .map(|w| w.iter().zip(&weights).map(|(v, w)| v * w).sum())
        .collect();
    let columns = width - WINDOW + 1;
    let mean = |y: usize, x: usize| {
        let column = weights.iter().enumerate();
        column.map(|(k, w)| w * rows[(y + k) * columns + x]).sum()
    };
    (0..height - WINDOW + 1)
        .flat_map(|y| (0..columns).map(move |x| (y, x)))
        .map(|(y, x)| mean(y, x))
        .collect()
}
