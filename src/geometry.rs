//! Distances and angles between points on surfaces, and ray origins that leave a surface without hitting it
//! again.

use crate::lanes::{Float, Vector, negative, positive};
use glam::Vec3;

/// How far, relative to the largest coordinate of the triangle, a ray's origin is moved off it:
/// 16 times the rounding unit of a coordinate, which covers the interpolation of the hit point and the
/// distance computed by the next intersection. Relative, so that scenes of any scale look alike.
const OFFSET: f32 = 16.0 * f32::EPSILON;

/// The distance by which rays leaving a triangle start off its plane; `extent` is the largest
/// absolute coordinate of its corners.
#[inline(always)]
pub fn offset_distance<F: Float>(extent: F) -> F {
    F::splat(OFFSET) * extent
}

/// The origin of a ray that leaves the surface point `p` with unit geometric normal `ng` in the
/// direction `towards`, moved by `distance` to the side that the ray goes to.
#[inline(always)]
pub fn offset_origin<F: Float>(
    p: Vector<F>,
    ng: Vector<F>,
    distance: F,
    towards: Vector<F>,
) -> Vector<F> {
    let side = F::select(negative(ng.dot(towards)), -distance, distance);
    p + ng * side
}

/// A point of a surface, for rays that begin or end there.
#[derive(Clone, Copy, Debug)]
pub struct Site<F: Float> {
    /// Where it is.
    pub position: Vector<F>,
    /// Unit geometric normal.
    pub ng: Vector<F>,
    /// Distance by which rays start off the surface, or end before it.
    pub offset: F,
}

/// Origin and direction of the ray from one surface to just before another, which is reached at length 1.
#[inline(always)]
pub fn segment<F: Float>(from: Site<F>, to: Site<F>) -> (Vector<F>, Vector<F>) {
    let towards = to.position - from.position;
    let origin = offset_origin(from.position, from.ng, from.offset, towards);
    let end = offset_origin(to.position, to.ng, to.offset, -towards);
    (origin, end - origin)
}

/// A point on a surface, as it is seen from another point.
#[derive(Clone, Copy, Debug)]
pub struct Seen<F: Float = f32> {
    /// Unit direction to it.
    pub direction: Vector<F>,
    /// The geometry term: turns area there into solid angle here.
    pub solid_angle_per_area: F,
    /// Where it can be seen; a point in its own plane cannot.
    pub valid: F::Mask,
}

impl<F: Float> Seen<F> {
    /// The point `to` on a surface with normal `ng`, from `from`.
    #[inline(always)]
    pub fn new(from: Vector<F>, to: Vector<F>, ng: Vector<F>) -> Self {
        let d = to - from;
        // One division for both.
        let per_distance = d.length_recip();
        let direction = d * per_distance;
        let g = ng.dot(direction).magnitude() * (per_distance * per_distance);
        Self {
            direction,
            solid_angle_per_area: g,
            valid: positive(g) & g.finite(),
        }
    }
}

/// The unit direction from one point to another on a surface with normal `ng`, and the geometry term that turns
/// area there into solid angle at `from`. `None` for a point in its own plane.
#[inline]
pub fn solid_angle_per_area(from: Vec3, to: Vec3, ng: Vec3) -> Option<(Vec3, f32)> {
    let seen = Seen::<f32>::new(from.into(), to.into(), ng.into());
    seen.valid
        .then(|| (seen.direction.into(), seen.solid_angle_per_area))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::lanes::Mask;
    use wide::f32x8;

    #[test]
    fn lanes_have_the_bits_of_one() {
        let from = Vec3::new(0.3, -0.7, 2.0);
        for (to, ng) in [
            (Vec3::new(1.0, 0.1, -0.4), Vec3::Y),
            (Vec3::new(5.0, -0.7, 2.5), Vec3::Y),
            (from, Vec3::Z),
        ] {
            let (one, lanes) = (Vector::<f32>::from, Vector::<f32x8>::splat);
            let seen = Seen::new(lanes(from), lanes(to), lanes(ng));
            let alone = solid_angle_per_area(from, to, ng);
            assert_eq!(seen.valid.bits(), if alone.is_some() { 255 } else { 0 });
            if let Some((direction, g)) = alone {
                assert_eq!(seen.direction.lane(3), direction);
                assert_eq!(seen.solid_angle_per_area.lane(4), g);
            }
            let origin = offset_origin(lanes(to), lanes(ng), f32x8::splat(0.1), lanes(from));
            let alone = offset_origin(one(to), one(ng), 0.1, one(from));
            assert_eq!(origin.lane(2), alone.into());
        }
    }
}
