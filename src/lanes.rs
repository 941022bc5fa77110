//! Numbers and vectors in lanes: what is written once over [`Float`] runs for one path, or for the eight of a
//! block at once.
//!
//! Each operation rounds as glam's does for one vector, but for those on angles: so what is computed in lanes without
//! angles has the bits of what is computed one by one.

use glam::Vec3;
use std::fmt::Debug;
use std::ops::{Add, BitAnd, BitOr, Div, Mul, Neg, Not, Sub};
use wide::{bytemuck, f32x8, u32x8};

/// Numbers in a vector; rays in a block.
pub const LANES: usize = 8;

/// A number in each lane: `f32` has one lane, `f32x8` has eight.
pub trait Float:
    Copy
    + Debug
    + Add<Output = Self>
    + Sub<Output = Self>
    + Mul<Output = Self>
    + Div<Output = Self>
    + Neg<Output = Self>
{
    /// Whether something holds, in each lane.
    type Mask: Mask;
    /// 0 in all lanes.
    const ZERO: Self;
    /// 1 in all lanes.
    const ONE: Self;

    /// The same number in all lanes.
    fn splat(number: f32) -> Self;
    /// The number that `number` gives for each lane.
    fn from_lanes(number: impl Fn(usize) -> f32) -> Self;
    /// The components of what `vector` gives for each lane.
    fn from_vectors(vector: impl Fn(usize) -> Vec3) -> [Self; 3];
    /// The number in one lane.
    fn lane(&self, lane: usize) -> f32;
    /// Puts a number into one lane.
    fn set_lane(&mut self, lane: usize, number: f32);
    /// Numbers of `a` where `mask` holds, of `b` elsewhere.
    fn select(mask: Self::Mask, a: Self, b: Self) -> Self;
    /// Square roots.
    fn root(self) -> Self;
    /// Arcsines of numbers in [−1, 1].
    fn arcsine(self) -> Self;
    /// The angles in [−π, π] of points with these ordinates and those abscissae.
    fn angle_at(self, x: Self) -> Self;
    /// Sines and cosines.
    fn sine_and_cosine(self) -> (Self, Self);
    /// The largest whole numbers that are not larger.
    fn whole(self) -> Self;
    /// Numbers without their signs.
    fn magnitude(self) -> Self;
    /// With the signs of `other`.
    fn signed_as(self, other: Self) -> Self;
    /// The larger of two numbers that are not NaN.
    fn larger(self, other: Self) -> Self;
    /// The smaller of two numbers that are not NaN.
    fn smaller(self, other: Self) -> Self;
    /// Where this is above `other`; NaN is not.
    fn above(self, other: Self) -> Self::Mask;
    /// Where this is below `other`; NaN is not.
    fn below(self, other: Self) -> Self::Mask;
    /// Where both are equal; NaN is not.
    fn equals(self, other: Self) -> Self::Mask;
    /// Where it is neither infinite nor NaN.
    fn finite(self) -> Self::Mask;

    /// The number where `mask` holds, 0 elsewhere.
    #[inline(always)]
    fn only(self, mask: Self::Mask) -> Self {
        Self::select(mask, self, Self::ZERO)
    }

    /// From 0 to 1.
    #[inline(always)]
    fn clamped(self) -> Self {
        self.larger(Self::ZERO).smaller(Self::ONE)
    }
}

/// Whether something holds, in each lane.
pub trait Mask:
    Copy + Debug + BitAnd<Output = Self> + BitOr<Output = Self> + Not<Output = Self>
{
    /// In the lanes whose bits are set.
    fn of_bits(bits: u32) -> Self;
    /// A bit for each lane.
    fn bits(self) -> u32;

    /// Whether it holds in all lanes.
    fn all(self) -> bool;

    /// In all lanes.
    #[inline(always)]
    fn every() -> Self {
        !Self::none()
    }

    /// In no lane.
    #[inline(always)]
    fn none() -> Self {
        Self::of_bits(0)
    }

    /// Whether it holds in any lane.
    #[inline(always)]
    fn any(self) -> bool {
        self.bits() != 0
    }
}

impl Float for f32 {
    type Mask = bool;
    const ZERO: Self = 0.0;
    const ONE: Self = 1.0;

    #[inline(always)]
    fn splat(number: f32) -> Self {
        number
    }
    #[inline(always)]
    fn from_lanes(number: impl Fn(usize) -> f32) -> Self {
        number(0)
    }
    #[inline(always)]
    fn from_vectors(vector: impl Fn(usize) -> Vec3) -> [Self; 3] {
        vector(0).to_array()
    }
    #[inline(always)]
    fn lane(&self, _: usize) -> f32 {
        *self
    }
    #[inline(always)]
    fn set_lane(&mut self, _: usize, number: f32) {
        *self = number;
    }
    #[inline(always)]
    fn select(mask: bool, a: Self, b: Self) -> Self {
        if mask { a } else { b }
    }
    #[inline(always)]
    fn root(self) -> Self {
        self.sqrt()
    }
    #[inline(always)]
    fn arcsine(self) -> Self {
        self.asin()
    }
    #[inline(always)]
    fn angle_at(self, x: Self) -> Self {
        self.atan2(x)
    }
    #[inline(always)]
    fn sine_and_cosine(self) -> (Self, Self) {
        self.sin_cos()
    }
    #[inline(always)]
    fn whole(self) -> Self {
        self.floor()
    }
    #[inline(always)]
    fn magnitude(self) -> Self {
        self.abs()
    }
    #[inline(always)]
    fn signed_as(self, other: Self) -> Self {
        self.copysign(other)
    }
    #[inline(always)]
    fn larger(self, other: Self) -> Self {
        if self > other { self } else { other }
    }
    #[inline(always)]
    fn smaller(self, other: Self) -> Self {
        if self < other { self } else { other }
    }
    #[inline(always)]
    fn above(self, other: Self) -> bool {
        self > other
    }
    #[inline(always)]
    fn below(self, other: Self) -> bool {
        self < other
    }
    #[inline(always)]
    fn equals(self, other: Self) -> bool {
        self == other
    }
    #[inline(always)]
    fn finite(self) -> bool {
        self.is_finite()
    }
}

impl Mask for bool {
    #[inline(always)]
    fn of_bits(bits: u32) -> Self {
        bits & 1 == 1
    }
    #[inline(always)]
    fn bits(self) -> u32 {
        u32::from(self)
    }
    #[inline(always)]
    fn all(self) -> bool {
        self
    }
}

impl Float for f32x8 {
    /// Lanes have all bits set or none.
    type Mask = f32x8;
    const ZERO: Self = f32x8::ZERO;
    const ONE: Self = f32x8::ONE;

    #[inline(always)]
    fn splat(number: f32) -> Self {
        f32x8::splat(number)
    }
    #[inline(always)]
    fn from_lanes(number: impl Fn(usize) -> f32) -> Self {
        let mut numbers = [0.0; LANES];
        for (lane, n) in numbers.iter_mut().enumerate() {
            *n = number(lane);
        }
        numbers.into()
    }
    #[inline(always)]
    fn from_vectors(vector: impl Fn(usize) -> Vec3) -> [Self; 3] {
        let [mut x, mut y, mut z] = [[0.0; LANES]; 3];
        let components = x.iter_mut().zip(&mut y).zip(&mut z);
        for (lane, ((x, y), z)) in components.enumerate() {
            [*x, *y, *z] = vector(lane).to_array();
        }
        [x.into(), y.into(), z.into()]
    }
    #[inline(always)]
    fn lane(&self, lane: usize) -> f32 {
        self.as_array()[lane]
    }
    #[inline(always)]
    fn set_lane(&mut self, lane: usize, number: f32) {
        self.as_mut_array()[lane] = number;
    }
    #[inline(always)]
    fn select(mask: f32x8, a: Self, b: Self) -> Self {
        mask.select(a, b)
    }
    #[inline(always)]
    fn root(self) -> Self {
        self.sqrt()
    }
    #[inline(always)]
    fn arcsine(self) -> Self {
        self.asin()
    }
    #[inline(always)]
    fn angle_at(self, x: Self) -> Self {
        self.atan2(x)
    }
    #[inline(always)]
    fn sine_and_cosine(self) -> (Self, Self) {
        self.sin_cos()
    }
    #[inline(always)]
    fn whole(self) -> Self {
        self.floor()
    }
    #[inline(always)]
    fn magnitude(self) -> Self {
        self.abs()
    }
    #[inline(always)]
    fn signed_as(self, other: Self) -> Self {
        self.copysign(other)
    }
    #[inline(always)]
    fn larger(self, other: Self) -> Self {
        self.fast_max(other)
    }
    #[inline(always)]
    fn smaller(self, other: Self) -> Self {
        self.fast_min(other)
    }
    #[inline(always)]
    fn above(self, other: Self) -> f32x8 {
        self.simd_gt(other)
    }
    #[inline(always)]
    fn below(self, other: Self) -> f32x8 {
        self.simd_lt(other)
    }
    #[inline(always)]
    fn equals(self, other: Self) -> f32x8 {
        self.simd_eq(other)
    }
    #[inline(always)]
    fn finite(self) -> f32x8 {
        self.is_finite()
    }
}

impl Mask for f32x8 {
    #[inline(always)]
    fn of_bits(bits: u32) -> Self {
        mask_of(bits)
    }
    #[inline(always)]
    fn bits(self) -> u32 {
        self.to_bitmask()
    }
    #[inline(always)]
    fn all(self) -> bool {
        self.to_bitmask() == 255
    }
}

/// A vector in each lane.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Vector<F> {
    /// Their first components.
    pub x: F,
    /// Their second components.
    pub y: F,
    /// Their third components.
    pub z: F,
}

/// Eight vectors.
pub type Vec3x8 = Vector<f32x8>;

impl<F: Float> Vector<F> {
    /// 1 in all lanes.
    pub const ONE: Self = Self {
        x: F::ONE,
        y: F::ONE,
        z: F::ONE,
    };

    /// 0 in all lanes.
    pub const ZERO: Self = Self {
        x: F::ZERO,
        y: F::ZERO,
        z: F::ZERO,
    };

    /// With these components.
    #[inline(always)]
    pub fn new(x: F, y: F, z: F) -> Self {
        Self { x, y, z }
    }

    /// The same number in all three components.
    #[inline(always)]
    pub fn grey(c: F) -> Self {
        Self { x: c, y: c, z: c }
    }

    /// The same vector in all lanes.
    #[inline(always)]
    pub fn splat(v: Vec3) -> Self {
        Self {
            x: F::splat(v.x),
            y: F::splat(v.y),
            z: F::splat(v.z),
        }
    }

    /// What `vector` gives for each lane.
    #[inline(always)]
    pub fn from_lanes(vector: impl Fn(usize) -> Vec3) -> Self {
        let [x, y, z] = F::from_vectors(vector);
        Self { x, y, z }
    }

    /// The vector in one lane.
    #[inline(always)]
    pub fn lane(&self, lane: usize) -> Vec3 {
        Vec3::new(self.x.lane(lane), self.y.lane(lane), self.z.lane(lane))
    }

    /// Puts a vector into one lane.
    #[inline(always)]
    pub fn set(&mut self, lane: usize, v: Vec3) {
        self.x.set_lane(lane, v.x);
        self.y.set_lane(lane, v.y);
        self.z.set_lane(lane, v.z);
    }

    /// Dot products.
    #[inline(always)]
    pub fn dot(self, other: Self) -> F {
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
    pub fn length_recip(self) -> F {
        F::ONE / self.dot(self).root()
    }

    /// Of unit length; not for 0.
    #[inline(always)]
    pub fn normalize(self) -> Self {
        self * self.length_recip()
    }

    /// Local directions mirrored to the upper side, where they are not there.
    #[inline(always)]
    pub fn upwards(self) -> Self {
        Self {
            z: self.z.magnitude(),
            ..self
        }
    }

    /// Lanes of `a` where `mask` holds, of `b` elsewhere.
    #[inline(always)]
    pub fn select(mask: F::Mask, a: Self, b: Self) -> Self {
        Self {
            x: F::select(mask, a.x, b.x),
            y: F::select(mask, a.y, b.y),
            z: F::select(mask, a.z, b.z),
        }
    }

    /// Absolute values.
    #[inline(always)]
    pub fn abs(self) -> Self {
        Self {
            x: self.x.magnitude(),
            y: self.y.magnitude(),
            z: self.z.magnitude(),
        }
    }

    /// The sum of the components of each.
    #[inline(always)]
    pub fn element_sum(self) -> F {
        self.x + self.y + self.z
    }

    /// The largest component of each; none may be NaN.
    #[inline(always)]
    pub fn max_element(self) -> F {
        self.x.larger(self.y).larger(self.z)
    }

    /// The larger components of two; none may be NaN.
    #[inline(always)]
    pub fn max(self, other: Self) -> Self {
        Self {
            x: self.x.larger(other.x),
            y: self.y.larger(other.y),
            z: self.z.larger(other.z),
        }
    }

    /// Where any component is not 0.
    #[inline(always)]
    pub fn is_not_zero(self) -> F::Mask {
        let is_zero = |c: F| c.equals(F::ZERO);
        !(is_zero(self.x) & is_zero(self.y) & is_zero(self.z))
    }

    /// Where all components are finite.
    #[inline(always)]
    pub fn is_finite(self) -> F::Mask {
        self.x.finite() & self.y.finite() & self.z.finite()
    }
}

impl From<Vec3> for Vector<f32> {
    #[inline(always)]
    fn from(v: Vec3) -> Self {
        Self::splat(v)
    }
}

impl From<Vector<f32>> for Vec3 {
    #[inline(always)]
    fn from(v: Vector<f32>) -> Self {
        Vec3::new(v.x, v.y, v.z)
    }
}

/// Where a number is above 0; NaN is not.
#[inline(always)]
pub fn positive<F: Float>(a: F) -> F::Mask {
    a.above(F::ZERO)
}

/// Where a number is below 0; NaN is not.
#[inline(always)]
pub fn negative<F: Float>(a: F) -> F::Mask {
    a.below(F::ZERO)
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

/// Of the lanes whose bits are set, the bits of those that `keep` keeps.
#[inline(always)]
pub fn lanes_where(bits: u32, mut keep: impl FnMut(usize) -> bool) -> u32 {
    let kept = lanes_of(bits).filter(|&lane| keep(lane));
    kept.fold(0, |bits, lane| bits | 1 << lane)
}

/// The mask of the lanes whose bits are set.
#[inline(always)]
pub fn mask_of(bits: u32) -> f32x8 {
    let lanes: [u32; LANES] = std::array::from_fn(|lane| (bits >> lane & 1).wrapping_neg());
    bytemuck::cast(u32x8::from(lanes))
}

/// Sets or clears the bit of a lane.
#[inline(always)]
pub fn set_bit(bits: &mut u32, lane: usize, value: bool) {
    *bits = *bits & !(1 << lane) | u32::from(value) << lane;
}

/// Sets or clears the bit of a lane as that of lane `from` of `others`.
#[inline(always)]
pub fn copy_bit(bits: &mut u32, lane: usize, others: u32, from: usize) {
    set_bit(bits, lane, others >> from & 1 == 1);
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

impl<F: Float> Add for Vector<F> {
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

impl<F: Float> Sub for Vector<F> {
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

impl<F: Float> Mul for Vector<F> {
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

impl<F: Float> Mul<F> for Vector<F> {
    type Output = Self;
    #[inline(always)]
    fn mul(self, factor: F) -> Self {
        Self {
            x: self.x * factor,
            y: self.y * factor,
            z: self.z * factor,
        }
    }
}

impl<F: Float> Div<F> for Vector<F> {
    type Output = Self;
    #[inline(always)]
    fn div(self, divisor: F) -> Self {
        Self {
            x: self.x / divisor,
            y: self.y / divisor,
            z: self.z / divisor,
        }
    }
}

impl<F: Float> Neg for Vector<F> {
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
        assert_eq!(f32x8::from_lanes(|lane| lane as f32).as_array()[5], 5.0);
    }
}
