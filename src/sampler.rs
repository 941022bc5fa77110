//! Random numbers: Owen-scrambled Sobol sequences (Burley 2020), by position in the path.
//!
//! A pixel's samples are split into two halves A and B, each with a sequence of its own, scrambled
//! independently, so that the two halves of the film are independent estimates. Sample `n` belongs to
//! half `n % 2`. A sequence ends after 2^16 points; a fresh scramble takes over.
//!
//! Independent numbers, for measurements that need them, are the first point of a sequence whose
//! scramble is new for every sample.

use crate::lanes;
use sobol_burley::parts::{hash, owen_scramble_rev, sobol_rev, u32_to_f32_norm};
use sobol_burley::{NUM_DIMENSION_SETS_4D, sample_4d};
use std::sync::LazyLock;
use wide::f32x8;

/// Number of points of one scrambled sequence.
const SEQUENCE: u64 = 1 << 16;

/// How the samples of a pixel are spread.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash, clap::ValueEnum)]
pub enum SamplerKind {
    /// Evenly, so that the error falls faster than one over the samples.
    #[default]
    Sobol,
    /// Independently of one another. Within a pass all pixels share the position inside the pixel even so,
    /// as the offset paths need it.
    Independent,
}

/// Which of the two independent halves of the film a sample belongs to.
#[inline]
pub fn half(sample: u64) -> usize {
    (sample & 1) as usize
}

/// What a path draws four numbers for. Each use has dimensions of its own.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Dimension {
    /// Of a pass: the position inside the pixel (numbers 0 and 1). Of a pixel: the point on the lens.
    Pixel,
    /// Light sampling at vertex k ≥ 1: the light (0), the point on it (1, 2).
    Light(u32),
    /// BSDF sampling at vertex k ≥ 1: the direction (0, 1), the lobe (2), Russian roulette (3).
    Bsdf(u32),
    /// Light sampling through mirrors at vertex k ≥ 1: the light (0), the point on it (1, 2), the mirror (3).
    Mirrored(u32),
    /// And of a mirror that is a little rough: the normal of the microfacet (0, 1).
    Microfacet(u32),
}

/// The random numbers of one sample of one pixel.
#[derive(Clone, Copy, Debug)]
pub struct Sampler {
    index: u32,
    scramble: u32,
}

impl Sampler {
    /// In the place of one where there is no pixel.
    pub const NONE: Self = Self {
        index: 0,
        scramble: 0,
    };

    /// The numbers of sample `sample` of the pixel (`x`, `y`), scrambled apart from all other pixels.
    #[inline]
    pub fn for_pixel(kind: SamplerKind, seed: u64, x: u32, y: u32, sample: u64) -> Self {
        Self::new(kind, seed, 1 + (u64::from(y) << 32 | u64::from(x)), sample)
    }

    /// The numbers of sample `sample` that all pixels share: one position inside the pixel for the
    /// whole pass, so that an offset path's primary hit is the neighbour's.
    #[inline]
    pub fn for_pass(kind: SamplerKind, seed: u64, sample: u64) -> Self {
        Self::new(kind, seed, 0, sample)
    }

    #[inline]
    fn new(kind: SamplerKind, seed: u64, stream: u64, sample: u64) -> Self {
        let point = sample / 2;
        let (sequence, point) = match kind {
            SamplerKind::Sobol => (
                (point / SEQUENCE) * 2 + half(sample) as u64,
                point % SEQUENCE,
            ),
            SamplerKind::Independent => (sample, 0),
        };
        let mixed = mix(mix(mix(seed) ^ stream) ^ sequence);
        Self {
            index: point as u32,
            scramble: (mixed ^ (mixed >> 32)) as u32,
        }
    }

    /// A number in [0, 1) for a decision at vertex k that has no place among the dimensions.
    #[inline]
    pub fn coin(&self, k: u32) -> f32 {
        u32_to_f32_norm(hash(
            self.scramble ^ hash(self.index ^ k.wrapping_mul(0x9e37_79b9)),
        ))
    }

    /// Four numbers in [0, 1).
    #[inline]
    pub fn draw(&self, dimension: Dimension) -> [f32; 4] {
        let (set, padding) = dimension.set();
        sample_4d(self.index, set, self.scramble.wrapping_add(padding))
    }
}

impl Dimension {
    /// The library's set of four dimensions, and what to add to the scramble: deep vertices use the
    /// dimensions again under another scramble ("padding").
    #[inline]
    fn set(self) -> (u32, u32) {
        // Those of mirrors under a scramble of their own.
        let (set, apart) = match self {
            Dimension::Pixel => (0, 0),
            Dimension::Light(k) => (2 * k - 1, 0),
            Dimension::Bsdf(k) => (2 * k, 0),
            Dimension::Mirrored(k) => (2 * k - 1, 0x85eb_ca6b),
            Dimension::Microfacet(k) => (2 * k, 0x85eb_ca6b),
        };
        let round = set / NUM_DIMENSION_SETS_4D;
        let padding = round.wrapping_mul(0x9e37_79b9).wrapping_add(apart);
        (set % NUM_DIMENSION_SETS_4D, padding)
    }
}

/// Samplers that draw together in [`draw_blocks`]: as many as the widest vector instructions take.
const LANES: usize = 16;

/// The bits of a point's index that matter.
const INDEX_BITS: usize = SEQUENCE.trailing_zeros() as usize;

/// The Sobol matrices of each set of four dimensions: what bit b of the index contributes.
type Matrices = [[u32; 4]; INDEX_BITS];

static MATRICES: LazyLock<Vec<Matrices>> = LazyLock::new(|| {
    let column = |set: u32, bit: usize| {
        std::array::from_fn(|d| sobol_rev((1u32 << bit).reverse_bits(), 4 * set + d as u32))
    };
    (0..NUM_DIMENSION_SETS_4D)
        .map(|set| std::array::from_fn(|bit| column(set, bit)))
        .collect()
});

/// [`Sampler::draw`] for samplers in blocks: the same numbers, lane by lane in vector instructions. Of the four
/// numbers only those of `wanted` are drawn; the others are 0. Replaces what is in `out`.
pub fn draw_blocks<'a, const D: usize>(
    blocks: impl IntoIterator<Item = &'a [Sampler; lanes::LANES]>,
    dimension: Dimension,
    wanted: [usize; D],
    out: &mut Vec<[f32x8; 4]>,
) {
    let (set, padding) = dimension.set();
    let matrices = &MATRICES[set as usize];
    let mut blocks = blocks.into_iter();
    out.clear();
    while let Some(first) = blocks.next() {
        let second = blocks.next();
        let sampler = |lane: usize| match second {
            Some(second) if lane >= lanes::LANES => &second[lane - lanes::LANES],
            _ => &first[lane % lanes::LANES],
        };
        let index = std::array::from_fn(|lane| sampler(lane).index);
        let scramble = std::array::from_fn(|lane| sampler(lane).scramble.wrapping_add(padding));
        let numbers = draw_lanes(matrices, set, &index, &scramble, wanted);
        let at = out.len();
        out.push([f32x8::ZERO; 4]);
        out.extend(second.map(|_| [f32x8::ZERO; 4]));
        for (half, out) in out[at..].iter_mut().enumerate() {
            for (numbers, d) in numbers.iter().zip(wanted) {
                let numbers = &numbers[half * lanes::LANES..][..lanes::LANES];
                out[d].as_mut_array().copy_from_slice(numbers);
            }
        }
    }
}

/// `sobol_burley::sample_4d`, from the library's own parts; of its numbers those of `wanted`.
#[inline]
fn draw_lanes<const D: usize>(
    matrices: &Matrices,
    set: u32,
    index: &[u32; LANES],
    scramble: &[u32; LANES],
    wanted: [usize; D],
) -> [[f32; LANES]; D] {
    const DIMENSION_SCRAMBLES: [u32; 4] = [0x912f_69ba, 0x174f_18ab, 0x691e_72ca, 0xb40c_c1b8];
    let mut shuffled = [0u32; LANES];
    for lane in 0..LANES {
        let shuffle = hash(scramble[lane] ^ 0x79c6_8e4a);
        shuffled[lane] = owen_scramble_rev(index[lane].reverse_bits(), shuffle);
    }
    // Each inner loop is one vector instruction for all lanes.
    let mut points = [[0u32; LANES]; D];
    for (bit, columns) in matrices.iter().enumerate() {
        let mut mask = [0u32; LANES];
        for lane in 0..LANES {
            // All ones where the bit is set; the index has its bits reversed.
            mask[lane] = ((shuffled[lane] << bit) as i32 >> 31) as u32;
        }
        for (points, &d) in points.iter_mut().zip(&wanted) {
            for lane in 0..LANES {
                points[lane] ^= columns[d] & mask[lane];
            }
        }
    }
    let mut numbers = [[0.0; LANES]; D];
    for ((numbers, points), &d) in numbers.iter_mut().zip(&points).zip(&wanted) {
        for lane in 0..LANES {
            let seed = scramble[lane].wrapping_mul(0x9c8f_2d3b) ^ set ^ DIMENSION_SCRAMBLES[d];
            let scrambled = owen_scramble_rev(points[lane], hash(seed));
            numbers[lane] = u32_to_f32_norm(scrambled.reverse_bits());
        }
    }
    numbers
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
                    let s = Sampler::for_pixel(SamplerKind::Sobol, 7, 3, 5, 2 * n + parity);
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
    fn many_draw_the_same_numbers_as_one() {
        let samplers: Vec<Sampler> = (0..LANES as u64 * 3 + 5)
            .map(|n| Sampler::for_pixel(SamplerKind::Sobol, n, 3 * n as u32, 5, n * 7919))
            .collect();
        for dimension in [
            Dimension::Pixel,
            Dimension::Light(1),
            Dimension::Bsdf(31),
            Dimension::Bsdf(32),
            Dimension::Light(700),
        ] {
            let one_by_one: Vec<_> = samplers.iter().map(|s| s.draw(dimension)).collect();
            for blocks in [0, 1, 2, 5] {
                let blocks = samplers.as_chunks().0.iter().take(blocks);
                let one_by_one = |lane: usize, d: usize| one_by_one[lane][d];
                check_blocks(blocks.clone(), dimension, [0, 1, 2], one_by_one);
                check_blocks(blocks.clone(), dimension, [0, 1, 2, 3], one_by_one);
                check_blocks(blocks.clone(), dimension, [0, 1], one_by_one);
                check_blocks(blocks, dimension, [0, 1, 3], one_by_one);
            }
        }
    }

    fn check_blocks<'a, const D: usize>(
        blocks: impl ExactSizeIterator<Item = &'a [Sampler; lanes::LANES]>,
        dimension: Dimension,
        wanted: [usize; D],
        one_by_one: impl Fn(usize, usize) -> f32,
    ) {
        let count = blocks.len();
        let mut drawn = Vec::new();
        draw_blocks(blocks, dimension, wanted, &mut drawn);
        assert_eq!(drawn.len(), count);
        for (index, lane) in (0..count * lanes::LANES).map(|n| (n, n % lanes::LANES)) {
            for (d, numbers) in drawn[index / lanes::LANES].iter().enumerate() {
                let drawn = wanted.contains(&d);
                let want = if drawn { one_by_one(index, d) } else { 0.0 };
                assert_eq!(numbers.as_array()[lane], want);
            }
        }
    }

    #[test]
    fn independent_numbers_are_uniform_and_independent() {
        // Counts in 16 x 16 cells of pairs of numbers: of one use, of two, of two samples, of two pixels,
        // of two halves. χ² with 255 degrees of freedom has standard deviation 22.6; 5 of them above
        // 255 happens with a probability of 3e-6 a pair.
        let draw = |n, x, d| Sampler::for_pixel(SamplerKind::Independent, 3, x, 0, n).draw(d);
        let (light, bsdf) = (Dimension::Light(1), Dimension::Bsdf(1));
        let pairs: [&dyn Fn(u64) -> (f32, f32); 6] = [
            &|n| (draw(n, 0, bsdf)[0], draw(n, 0, bsdf)[1]),
            &|n| (draw(n, 0, bsdf)[2], draw(n, 0, bsdf)[3]),
            &|n| (draw(n, 0, light)[0], draw(n, 0, bsdf)[0]),
            &|n| (draw(n, 0, bsdf)[0], draw(n + 2, 0, bsdf)[0]),
            &|n| (draw(n, 0, bsdf)[0], draw(n, 1, bsdf)[0]),
            &|n| (draw(n, 0, bsdf)[0], draw(n + 1, 0, bsdf)[0]),
        ];
        for (which, pair) in pairs.iter().enumerate() {
            const SAMPLES: u64 = 1 << 16;
            let mut counts = [0.0; 256];
            for n in 0..SAMPLES {
                let (a, b) = pair(n);
                counts[(a * 16.0) as usize * 16 + (b * 16.0) as usize] += 1.0;
            }
            let expected = SAMPLES as f64 / 256.0;
            let chi2: f64 = counts
                .iter()
                .map(|c: &f64| (c - expected).powi(2) / expected)
                .sum();
            assert!(chi2 < 255.0 + 5.0 * 22.6, "pair {which}: {chi2}");
        }
    }

    #[test]
    fn halves_pixels_dimensions_and_sequences_differ() {
        let draw = |x, sample, d| Sampler::for_pixel(SamplerKind::Sobol, 1, x, 0, sample).draw(d);
        let base = draw(0, 0, Dimension::Bsdf(1));
        for other in [
            draw(0, 1, Dimension::Bsdf(1)),
            draw(1, 0, Dimension::Bsdf(1)),
            draw(0, 0, Dimension::Light(1)),
            draw(0, 0, Dimension::Bsdf(33)),
            draw(0, 2 * SEQUENCE, Dimension::Bsdf(1)),
            Sampler::for_pass(SamplerKind::Sobol, 1, 0).draw(Dimension::Bsdf(1)),
        ] {
            assert_ne!(base, other);
        }
    }
}
