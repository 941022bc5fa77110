//! Random numbers: Owen-scrambled Sobol sequences (Burley 2020), by position in the path.
//!
//! A pixel's samples are split into two halves A and B, each with a sequence of its own, scrambled
//! independently, so that the two halves of the film are independent estimates. Sample `n` belongs to
//! half `n % 2`. A sequence ends after 2^16 points; a fresh scramble takes over.

use sobol_burley::{NUM_DIMENSION_SETS_4D, sample_4d};

/// Number of points of one scrambled sequence.
const SEQUENCE: u64 = 1 << 16;

/// Which of the two independent halves of the film a sample belongs to.
#[inline]
pub fn half(sample: u64) -> usize {
    (sample & 1) as usize
}

/// What a path draws four numbers for. Each use has dimensions of its own.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Dimension {
    /// The position inside the pixel (numbers 0 and 1).
    Pixel,
    /// Light sampling at vertex k ≥ 1: the light (0), the point on it (1, 2).
    Light(u32),
    /// BSDF sampling at vertex k ≥ 1: the direction (0, 1), the lobe (2), Russian roulette (3).
    Bsdf(u32),
}

/// The random numbers of one sample of one pixel.
#[derive(Clone, Copy, Debug)]
pub struct Sampler {
    index: u32,
    scramble: u32,
}

impl Sampler {
    /// The numbers of sample `sample` of the pixel (`x`, `y`), scrambled apart from all other pixels.
    #[inline]
    pub fn for_pixel(seed: u64, x: u32, y: u32, sample: u64) -> Self {
        Self::new(seed, 1 + (u64::from(y) << 32 | u64::from(x)), sample)
    }

    /// The numbers of sample `sample` that all pixels share: one position inside the pixel for the
    /// whole pass, so that an offset path's primary hit is the neighbour's (method.md section 4).
    #[inline]
    pub fn for_pass(seed: u64, sample: u64) -> Self {
        Self::new(seed, 0, sample)
    }

    #[inline]
    fn new(seed: u64, stream: u64, sample: u64) -> Self {
        let point = sample / 2;
        let sequence = (point / SEQUENCE) * 2 + half(sample) as u64;
        let mixed = mix(mix(mix(seed) ^ stream) ^ sequence);
        Self {
            index: (point % SEQUENCE) as u32,
            scramble: (mixed ^ (mixed >> 32)) as u32,
        }
    }

    /// Four numbers in [0, 1).
    #[inline]
    pub fn draw(&self, dimension: Dimension) -> [f32; 4] {
        let set = match dimension {
            Dimension::Pixel => 0,
            Dimension::Light(k) => 2 * k - 1,
            Dimension::Bsdf(k) => 2 * k,
        };
        // Deep vertices use the dimensions again under another scramble ("padding").
        let (set, round) = (set % NUM_DIMENSION_SETS_4D, set / NUM_DIMENSION_SETS_4D);
        sample_4d(
            self.index,
            set,
            self.scramble.wrapping_add(round.wrapping_mul(0x9e37_79b9)),
        )
    }
}

/// A bijective mix of 64 bits (the finaliser of SplitMix64).
#[inline]
pub fn mix(x: u64) -> u64 {
    let x = x.wrapping_add(0x9e37_79b9_7f4a_7c15);
    let x = (x ^ (x >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
    let x = (x ^ (x >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
    x ^ (x >> 31)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn each_half_is_stratified() {
        // 64 points of one half fill each of 64 intervals once, in every dimension.
        for parity in 0..2 {
            for dim in 0..4 {
                let mut seen = [0; 64];
                for n in 0..64u64 {
                    let s = Sampler::for_pixel(7, 3, 5, 2 * n + parity);
                    seen[(s.draw(Dimension::Bsdf(2))[dim] * 64.0) as usize] += 1;
                }
                assert!(
                    seen.iter().all(|&c| c == 1),
                    "half {parity} dimension {dim}: {seen:?}"
                );
            }
        }
    }

    #[test]
    fn halves_pixels_dimensions_and_sequences_differ() {
        let draw = |x, sample, d| Sampler::for_pixel(1, x, 0, sample).draw(d);
        let base = draw(0, 0, Dimension::Bsdf(1));
        for other in [
            draw(0, 1, Dimension::Bsdf(1)),
            draw(1, 0, Dimension::Bsdf(1)),
            draw(0, 0, Dimension::Light(1)),
            draw(0, 0, Dimension::Bsdf(33)),
            draw(0, 2 * SEQUENCE, Dimension::Bsdf(1)),
            Sampler::for_pass(1, 0).draw(Dimension::Bsdf(1)),
        ] {
            assert_ne!(base, other);
        }
    }
}
