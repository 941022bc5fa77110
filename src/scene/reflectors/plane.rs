//! Flat mirrors: what they show, and where.

use super::{Bounds, Target, Targets};
use crate::frame::Frame;
use crate::lanes::{Float, Mask, Vector, positive};
use glam::{Vec2, Vec3};

/// A plane, and what part of it a reflector may cover.
#[derive(Clone, Debug)]
pub struct Plane {
    /// Unit normal, on the side that is seen if only one is.
    pub(super) normal: Vec3,
    point: Vec3,
    axes: [Vec3; 2],
    /// Smallest and largest coordinates along the axes.
    low: Vec2,
    high: Vec2,
    /// Whether it is seen on the side of its normal alone.
    pub(super) one_sided: bool,
}

/// Planes are perpendicular with this cosine between them.
const UPRIGHT: f32 = 1e-3;

impl Plane {
    /// Of the triangles with these corners, of which `largest` has the most exact normal.
    pub(super) fn new(
        largest: [Vec3; 3],
        normal: Vec3,
        corners: impl Iterator<Item = Vec3>,
    ) -> Self {
        let [a, b, c] = largest;
        let corners: Vec<Vec3> = corners.collect();
        // Along that of its edges about which a rectangle around all is the smallest: of what is one, itself.
        let rectangle = |edge: Vec3| {
            let across = edge.normalize_or(normal.any_orthonormal_vector());
            let axes = [across, normal.cross(across)];
            let places = corners.iter();
            let places = places.map(|&p| Vec2::new(axes[0].dot(p - a), axes[1].dot(p - a)));
            let around = (Vec2::INFINITY, Vec2::NEG_INFINITY);
            let (low, high) = places.fold(around, |(low, high), p| (low.min(p), high.max(p)));
            (axes, low, high)
        };
        let area = |&(_, low, high): &([Vec3; 2], Vec2, Vec2)| (high - low).element_product();
        let edges = [b - a, c - b, a - c].map(rectangle).into_iter();
        let smallest = edges.min_by(|a, b| area(a).total_cmp(&area(b)));
        let (axes, low, high) = smallest.unwrap_or_else(|| rectangle(b - a));
        let margin = 1e-4 * (high - low).max_element();
        Self {
            normal,
            point: a,
            axes,
            low: low - margin,
            high: high + margin,
            one_sided: false,
        }
    }

    /// Whether another one is perpendicular to it.
    pub(super) fn is_upright_on(&self, other: &Self) -> bool {
        self.normal.dot(other.normal).abs() < UPRIGHT
    }

    /// A point on it.
    pub(super) fn point(&self) -> Vec3 {
        self.point
    }

    /// How far points are above it.
    #[inline(always)]
    pub(super) fn above<F: Float>(&self, p: Vector<F>) -> F {
        self.n().dot(p - Vector::splat(self.point))
    }

    /// Whether it may reach points in its plane, or so far beyond its edges.
    #[inline(always)]
    pub(super) fn covers<F: Float>(&self, p: Vector<F>, margin: f32) -> F::Mask {
        let p = p - Vector::splat(self.point);
        let [x, y] = self.axes.map(|axis| Vector::<F>::splat(axis).dot(p));
        let within = |x: F, low: f32, high: f32| {
            !(x.below(F::splat(low - margin)) | x.above(F::splat(high + margin)))
        };
        within(x, self.low.x, self.high.x) & within(y, self.low.y, self.high.y)
    }

    /// How far `p` is above it.
    pub(super) fn height(&self, p: Vec3) -> f32 {
        self.above::<f32>(p.into())
    }

    /// Whether it can be seen from a part of a box.
    pub(super) fn is_seen_from(&self, &(low, high): &Bounds) -> bool {
        let least = 1e-4 * (high - low).length();
        let reach = (0.5 * (high - low)).dot(self.normal.abs());
        let middle = self.height(0.5 * (low + high));
        middle + reach > least || !self.one_sided && reach - middle > least
    }

    /// What it shows in the place of `p`.
    pub(super) fn mirror(&self, p: Vec3) -> Vec3 {
        p - self.normal * (2.0 * self.height(p))
    }

    /// What it shows in the place of `target`.
    pub fn image(&self, target: &Target) -> Target {
        match *target {
            Target::Surface {
                position,
                ng,
                offset,
            } => Target::Surface {
                position: self.mirror(position),
                ng,
                offset,
            },
            Target::Point(position) => Target::Point(self.mirror(position)),
            Target::Direction(d) => Target::Direction(d - self.normal * (2.0 * self.normal.dot(d))),
        }
    }

    /// [`Plane::image`] in lanes.
    #[inline(always)]
    pub(super) fn images<F: Float>(&self, targets: &Targets<F>) -> Targets<F> {
        Targets {
            place: targets.place - self.n::<F>() * (self.heights(targets) + self.heights(targets)),
            distant: targets.distant,
        }
    }

    /// Where it shows the targets to the points `from`, and the lanes in which it does: it reaches there, and both
    /// are on a side that is seen.
    #[inline(always)]
    pub(super) fn shows<F: Float>(
        &self,
        from: Vector<F>,
        targets: &Targets<F>,
    ) -> (Vector<F>, F::Mask) {
        let height = self.above(from);
        let there = self.heights(targets);
        let image = targets.place - self.n::<F>() * (there + there);
        let (way, whole) = if targets.distant.any() {
            (
                Vector::select(targets.distant, image, image - from),
                F::select(targets.distant, there, height + there),
            )
        } else {
            (image - from, height + there)
        };
        let p = from + way * (height / whole);
        let inside = self.covers(p, 0.0);
        let one_side = positive(height * there);
        let seen = if self.one_sided {
            one_side & positive(height)
        } else {
            one_side
        };
        (p, seen & inside)
    }

    /// The unit direction from `from` in which a microfacet with the local normal `h` reflects to `target`, on the plane or
    /// beyond its edge. Exact where triangles look to the side of the plane's normal.
    pub(super) fn by_microfacet(&self, h: Vec3, from: Vec3, target: &Target) -> Option<Vec3> {
        let side = 1f32.copysign(self.height(from));
        let frame = Frame::<f32>::new(self.normal.into());
        let m = Vec3::from(frame.to_world(Vec3::new(h.x, h.y, h.z * side).into()));
        let to = match *target {
            Target::Direction(d) => return Some(d - m * (2.0 * d.dot(m))),
            Target::Surface { position, .. } | Target::Point(position) => position - self.point,
        };
        // With s on the plane and R, which mirrors by m: to - s = t R (s - from), where t > 0 says by how much the second
        // part of the way is longer. So (I + t R) s = to + t R from, along m and across; and s is on the plane where
        // -height t² + b t + there = 0.
        let n = self.normal * side;
        let from_here = from - self.point;
        let (height, there) = (n.dot(from_here), n.dot(to));
        let (to_m, from_m, cos) = (to.dot(m), from_here.dot(m), n.dot(m));
        let b = height - there + 2.0 * cos * (to_m - from_m);
        let t = (b + (b * b + 4.0 * height * there).sqrt()) / (2.0 * height);
        let across = ((to - m * to_m) + (from_here - m * from_m) * t) / (1.0 + t);
        let s = across - m * (n.dot(across) / cos);
        let is_seen = there > 0.0 && t > 0.0;
        (s - from_here).try_normalize().filter(|_| is_seen)
    }

    #[inline(always)]
    fn n<F: Float>(&self) -> Vector<F> {
        Vector::splat(self.normal)
    }

    /// Heights of points above it, cosines of directions.
    #[inline(always)]
    pub(super) fn heights<F: Float>(&self, targets: &Targets<F>) -> F {
        let above = targets.place.dot(self.n());
        let own = F::splat(self.normal.dot(self.point));
        if targets.distant.any() {
            above - own.only(!targets.distant)
        } else {
            above - own
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A rectangle reaches as far as its own sides, whichever way it is turned and cut in two.
    #[test]
    fn rectangles_end_at_their_sides() {
        let frame = Frame::<f32>::new(Vec3::new(0.3, -0.8, 0.4).normalize().into());
        let at = |x: f32, y: f32| Vec3::from(frame.to_world(Vec3::new(x, y, 0.5).into()));
        let corners = [at(0.0, 0.0), at(3.0, 0.0), at(3.0, 1.0), at(0.0, 1.0)];
        for largest in [[0, 1, 2], [1, 2, 3], [2, 3, 0], [3, 0, 1]] {
            let largest = largest.map(|c: usize| corners[c]);
            let normal = (largest[1] - largest[0]).cross(largest[2] - largest[0]);
            let plane = Plane::new(largest, normal.normalize(), corners.into_iter());
            let covers = |x, y| plane.covers::<f32>(at(x, y).into(), 0.0);
            assert!(covers(0.01, 0.01) && covers(2.99, 0.99) && covers(1.5, 0.5));
            assert!(!covers(-0.01, 0.5) && !covers(3.01, 0.5));
            assert!(!covers(1.5, -0.01) && !covers(1.5, 1.01));
        }
    }
}
