//! Vectors of eight points at once, for loops that do the same to all: the eight rays of a block, or
//! eight paths.
//!
//! Each operation rounds as glam's does for one vector, so what is computed in lanes has the bits of what
//! is computed one by one.

use glam::Vec3;
use std::ops::{Add, Div, Mul, Neg, Sub};
use wide::{bytemuck, f32x8, u32x8};

/// Numbers in a vector; rays in a block.
pub const LANES: usize = 8;

/// Eight vectors. A mask is an `f32x8` whose lanes have all bits set or none.
#[derive(Clone, Copy, Debug)]
pub struct Vec3x8 {
    /// Their first components.
    pub x: f32x8,
    /// Their second components.
    pub y: f32x8,
    /// Their third components.
    pub z: f32x8,
}

impl Vec3x8 {
    /// 1 in all lanes.
    pub const ONE: Self = Self {
        x: f32x8::ONE,
        y: f32x8::ONE,
        z: f32x8::ONE,
    };

    /// 0 in all lanes.
    pub const ZERO: Self = Self {
        x: f32x8::ZERO,
        y: f32x8::ZERO,
        z: f32x8::ZERO,
    };

    /// The same vector in all lanes.
    #[inline(always)]
    pub fn splat(v: Vec3) -> Self {
        Self::from(v.to_array().map(|c| [c; LANES]))
    }

    /// What `vector` gives for each lane.
    #[inline(always)]
    pub fn from_lanes(vector: impl Fn(usize) -> Vec3) -> Self {
        let [mut x, mut y, mut z] = [[0.0; LANES]; 3];
        let components = x.iter_mut().zip(&mut y).zip(&mut z);
        for (lane, ((x, y), z)) in components.enumerate() {
            [*x, *y, *z] = vector(lane).to_array();
        }
        Self::from([x, y, z])
    }

    /// The vector in one lane.
    #[inline(always)]
    pub fn lane(&self, lane: usize) -> Vec3 {
        let Self { x, y, z } = self;
        Vec3::new(x.as_array()[lane], y.as_array()[lane], z.as_array()[lane])
    }

    /// Puts a vector into one lane.
    #[inline(always)]
    pub fn set(&mut self, lane: usize, v: Vec3) {
        set_lane(&mut self.x, lane, v.x);
        set_lane(&mut self.y, lane, v.y);
        set_lane(&mut self.z, lane, v.z);
    }

    /// Dot products.
    #[inline(always)]
    pub fn dot(self, other: Self) -> f32x8 {
        self.x * other.x + self.y * other.y + self.z * other.z
    }

    /// Cross products.
    #[inline(always)]
    pub fn cross(self, other: Self) -> Self {
        Self {
            x: self.y * other.z - other.y * self.z,
            y: self.z * other.x - other.z * self.x,
            z: self.x * other.y - other.x * self.y,
        }
    }

    /// One over the lengths.
    #[inline(always)]
    pub fn length_recip(self) -> f32x8 {
        f32x8::ONE / self.dot(self).sqrt()
    }

    /// Lanes of `a` where `mask` is set, of `b` elsewhere.
    #[inline(always)]
    pub fn select(mask: f32x8, a: Self, b: Self) -> Self {
        Self {
            x: mask.select(a.x, b.x),
            y: mask.select(a.y, b.y),
            z: mask.select(a.z, b.z),
        }
    }

    /// Absolute values.
    #[inline(always)]
    pub fn abs(self) -> Self {
        Self {
            x: self.x.abs(),
            y: self.y.abs(),
            z: self.z.abs(),
        }
    }

    /// The largest component of each; none may be NaN.
    #[inline(always)]
    pub fn max_element(self) -> f32x8 {
        self.x.fast_max(self.y).fast_max(self.z)
    }

    /// The larger components of two; none may be NaN.
    #[inline(always)]
    pub fn max(self, other: Self) -> Self {
        Self {
            x: self.x.fast_max(other.x),
            y: self.y.fast_max(other.y),
            z: self.z.fast_max(other.z),
        }
    }

    /// Where any component is not 0.
    #[inline(always)]
    pub fn is_not_zero(self) -> f32x8 {
        !(self.x.simd_eq(f32x8::ZERO) & self.y.simd_eq(f32x8::ZERO) & self.z.simd_eq(f32x8::ZERO))
    }

    /// Where all components are finite.
    #[inline(always)]
    pub fn is_finite(self) -> f32x8 {
        self.x.is_finite() & self.y.is_finite() & self.z.is_finite()
    }
}

/// The number that `number` gives for each lane.
#[inline(always)]
pub fn from_lanes(number: impl Fn(usize) -> f32) -> f32x8 {
    let mut numbers = [0.0; LANES];
    for (lane, n) in numbers.iter_mut().enumerate() {
        *n = number(lane);
    }
    numbers.into()
}

/// Puts a number into one lane.
#[inline(always)]
pub fn set_lane(numbers: &mut f32x8, lane: usize, number: f32) {
    numbers.as_mut_array()[lane] = number;
}

/// Where a number is above 0; NaN is not.
#[inline(always)]
pub fn positive(a: f32x8) -> f32x8 {
    a.simd_gt(f32x8::ZERO)
}

/// Where a number is below 0; NaN is not.
#[inline(always)]
pub fn negative(a: f32x8) -> f32x8 {
    a.simd_lt(f32x8::ZERO)
}

/// The lanes of a mask, in their order.
#[inline(always)]
pub fn set_lanes(mask: f32x8) -> impl Iterator<Item = usize> {
    lanes_of(mask.to_bitmask())
}

/// The lanes whose bits are set, in their order.
#[inline(always)]
pub fn lanes_of(mut bits: u32) -> impl Iterator<Item = usize> {
    std::iter::from_fn(move || {
        (bits != 0).then(|| {
            let lane = bits.trailing_zeros() as usize;
            bits &= bits - 1;
            // Tells the compiler that it needs no check of bounds.
            lane % LANES
        })
    })
}

/// The mask of the lanes whose bits are set.
#[inline(always)]
pub fn mask_of(bits: u32) -> f32x8 {
    let lanes: [u32; LANES] = std::array::from_fn(|lane| (bits >> lane & 1).wrapping_neg());
    bytemuck::cast(u32x8::from(lanes))
}

/// A bit for each of the lanes below `count`.
#[inline(always)]
pub fn first_lanes(count: usize) -> u32 {
    (1 << count.min(LANES)) - 1
}

impl From<[[f32; LANES]; 3]> for Vec3x8 {
    #[inline(always)]
    fn from([x, y, z]: [[f32; LANES]; 3]) -> Self {
        Self {
            x: x.into(),
            y: y.into(),
            z: z.into(),
        }
    }
}

impl Add for Vec3x8 {
    type Output = Self;
    #[inline(always)]
    fn add(self, other: Self) -> Self {
        Self {
            x: self.x + other.x,
            y: self.y + other.y,
            z: self.z + other.z,
        }
    }
}

impl Sub for Vec3x8 {
    type Output = Self;
    #[inline(always)]
    fn sub(self, other: Self) -> Self {
        Self {
            x: self.x - other.x,
            y: self.y - other.y,
            z: self.z - other.z,
        }
    }
}

impl Mul for Vec3x8 {
    type Output = Self;
    #[inline(always)]
    fn mul(self, other: Self) -> Self {
        Self {
            x: self.x * other.x,
            y: self.y * other.y,
            z: self.z * other.z,
        }
    }
}

impl Mul<f32x8> for Vec3x8 {
    type Output = Self;
    #[inline(always)]
    fn mul(self, factor: f32x8) -> Self {
        Self {
            x: self.x * factor,
            y: self.y * factor,
            z: self.z * factor,
        }
    }
}

impl Div<f32x8> for Vec3x8 {
    type Output = Self;
    #[inline(always)]
    fn div(self, divisor: f32x8) -> Self {
        Self {
            x: self.x / divisor,
            y: self.y / divisor,
            z: self.z / divisor,
        }
    }
}

impl Neg for Vec3x8 {
    type Output = Self;
    #[inline(always)]
    fn neg(self) -> Self {
        Self {
            x: -self.x,
            y: -self.y,
            z: -self.z,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn masks_are_their_bits() {
        for bits in 0..256 {
            assert_eq!(mask_of(bits).to_bitmask(), bits);
            let lanes: Vec<usize> = lanes_of(bits).collect();
            assert_eq!(lanes, set_lanes(mask_of(bits)).collect::<Vec<_>>());
            assert_eq!(lanes.iter().map(|lane| 1 << lane).sum::<u32>(), bits);
        }
        assert_eq!(
            [0, 1, 7, 8, 9, 1000].map(first_lanes),
            [0, 1, 127, 255, 255, 255]
        );
    }

    #[test]
    fn vectors_are_where_they_were_put() {
        let vector = |lane: usize| Vec3::new(lane as f32, 10.0 + lane as f32, -(lane as f32));
        let mut vectors = Vec3x8::from_lanes(vector);
        vectors.set(3, Vec3::ONE);
        for lane in 0..LANES {
            let want = if lane == 3 { Vec3::ONE } else { vector(lane) };
            assert_eq!(vectors.lane(lane), want);
            assert_eq!(vectors.max_element().as_array()[lane], want.max_element());
            assert_eq!(vectors.length_recip().as_array()[lane], want.length_recip());
            let other = Vec3::new(0.3, 0.0, -7.0);
            assert_eq!(
                vectors.cross(Vec3x8::splat(other)).lane(lane),
                want.cross(other)
            );
            let zero = vectors.is_not_zero().as_array()[lane].to_bits() == 0;
            assert_eq!(zero, want == Vec3::ZERO);
        }
        assert_eq!(from_lanes(|lane| lane as f32).as_array()[5], 5.0);
    }
}
