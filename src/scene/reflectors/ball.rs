//! Balls of glass: the ways by which light passes them, in closed form.
//!
//! A ray that passes a ball stays in the plane of its centre. It is told by its impact parameter p, its distance from
//! the centre before it is bent, here over the radius. From a point at the distance a to one at the distance b it
//! turns about the centre by π + g(p),
//!
//! > g(p) = 2 asin p − 2 asin(p/n) − asin(p/a) − asin(p/b).
//!
//! If the two are by δ off from opposite sides of the centre, its solutions are those of g(p) = −δ on their side, and
//! of g(p) = δ beyond the centre. Near the ball g falls at first, where the rays have not met yet, and rises then: so
//! there are up to three ways, each alone in its [`Branch`].

use super::{Target, Targets};
use crate::lanes::{Float, Vec3x8};
use crate::scene::mesh::Mesh;
use glam::{DMat4, DVec3, DVec4, Vec3};
use std::f32::consts::{FRAC_PI_2, PI};
use wide::f32x8;

/// A ball of glass, as its mesh comes near to it.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Ball {
    /// Its centre.
    pub centre: Vec3,
    /// Its radius.
    pub radius: f32,
    /// The index of refraction inside over that outside, above 1.
    pub index: f32,
}

/// Which of the ways through a ball.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Branch {
    /// On the near side, of rays that have not met yet.
    Inner,
    /// On the near side, of rays outside of those that meet.
    Outer,
    /// On the far side of the centre.
    Crossed,
}

impl Branch {
    /// All of them, in order.
    pub const ALL: [Branch; 3] = [Branch::Inner, Branch::Outer, Branch::Crossed];

    /// In words.
    pub fn describe(self) -> &'static str {
        match self {
            Branch::Inner => "before rays meet",
            Branch::Outer => "outside of rays that meet",
            Branch::Crossed => "behind where rays meet",
        }
    }
}

/// Corners may be off by this share of the radius, and normals as much.
const TOLERANCE: f64 = 2e-3;
/// Steps of bisection: the walk that begins there does the rest.
const STEPS: u32 = 10;

/// Ways beyond the centre are tried at this many times the squared sine under which the ball is seen: by so much of
/// what there is to be seen they take. The other ways are rarer, and what they bring is bright.
const CROSSED: f32 = 1.0;

/// Points and targets as a ball has them.
struct Plane<F> {
    /// The radius over the distances from the points to the centre, and from there to the targets; at most 1.
    near: F,
    far: F,
    /// One over the index.
    per_index: F,
}

impl Ball {
    /// That of which `triangles` are the surface; `None` if they are no ball.
    pub(super) fn of(mesh: &Mesh, triangles: &[u32], index: f32) -> Option<Self> {
        let corners = || triangles.iter().flat_map(|&t| mesh.corners(t));
        // Least squares for |p|² = 2 c·p + (r² − |c|²), about some point of it.
        let about = corners().next()?.as_dvec3();
        let (mut normal, mut right) = (DMat4::ZERO, DVec4::ZERO);
        for p in corners() {
            let p = p.as_dvec3() - about;
            let row = p.extend(1.0);
            for (column, factor) in row.to_array().into_iter().enumerate() {
                *normal.col_mut(column) += row * factor;
            }
            right += row * p.length_squared();
        }
        let solution = normal.inverse() * right;
        let centre = solution.truncate() * 0.5;
        let radius = (solution.w + centre.length_squared()).sqrt();
        let is_near = |p: Vec3, n: Vec3| {
            let out = p.as_dvec3() - about - centre;
            let straight = n.as_dvec3().dot(out.normalize()).abs();
            (out.length() - radius).abs() < TOLERANCE * radius && straight > 1.0 - TOLERANCE
        };
        let on_it = |&t: &u32| {
            let normals = mesh.corner_normals(t);
            normals.is_some_and(|n| mesh.corners(t).iter().zip(n).all(|(&p, n)| is_near(p, n)))
        };
        let is_ball = radius.is_finite() && index > 1.0 && triangles.iter().all(on_it);
        let centre: DVec3 = centre + about;
        is_ball.then_some(Self {
            centre: centre.as_vec3(),
            radius: radius as f32,
            index,
        })
    }

    /// The unit direction from `from` in which the way of a branch to `target` leaves, for an exact ball; `None`
    /// where there is none.
    pub fn guess(&self, branch: Branch, from: Vec3, target: &Target) -> Option<Vec3> {
        let (plane, off, [to, across]) = self.plane(from, target);
        let g = |p: f32| plane.turn(p);
        let valley = || {
            let valley = (plane.slope(0.0) < 0.0).then(|| plane.valley());
            valley.filter(|&p| g(p) <= -off)
        };
        let p = match branch {
            Branch::Inner => bisect((0.0, valley()?), |p| g(p) > -off),
            Branch::Outer if g(1.0) >= -off => bisect((valley()?, 1.0), |p| g(p) < -off),
            Branch::Crossed if g(1.0) >= off => -bisect((0.0, 1.0), |p| g(p) < off),
            Branch::Outer | Branch::Crossed => return None,
        };
        let sine = p * plane.near;
        let direction = to * (1.0 - sine * sine).max(0.0).sqrt() + across * sine;
        direction.try_normalize()
    }

    /// The branch of a way that leaves `from` in the unit direction `wi` and ends at `target`.
    pub fn branch(&self, from: Vec3, wi: Vec3, target: &Target) -> Branch {
        let (plane, _, [_, across]) = self.plane(from, target);
        let sine = across.dot(wi);
        if sine < 0.0 {
            Branch::Crossed
        } else if plane.slope((sine / plane.near).min(1.0)) < 0.0 {
            Branch::Inner
        } else {
            Branch::Outer
        }
    }

    /// The probabilities of trying the branches, in the order of [`Branch::ALL`], from the points `from` to the targets:
    /// 0 where there is no such way; 1 where there is, if it shall be `always`.
    #[inline(always)]
    pub fn probabilities(
        &self,
        from: Vec3x8,
        targets: &Targets<f32x8>,
        always: bool,
    ) -> [f32x8; 3] {
        let (zero, one) = (f32x8::ZERO, f32x8::ONE);
        let centre = Vec3x8::splat(self.centre);
        let radius = f32x8::splat(self.radius);
        let to = centre - from;
        let there = Vec3x8::select(targets.distant, targets.place, targets.place - centre);
        let near = radius / to.dot(to).root();
        let length = there.dot(there).root();
        let far = targets.distant.select(zero, (radius / length).smaller(one));
        let cosine = to.dot(there) * near / (radius * length);
        let near = near.smaller(one);
        // With bounds for angles first: no less than 2 sin(δ/2), and arcsines between x and π/2 x. Ways beyond the
        // centre turn by g(1) at most. Before it nothing bends rays away from what is straight ahead.
        let least = (one - cosine).larger(zero) * f32x8::splat(2.0);
        let least = least.root();
        let both = near + far;
        let most = f32x8::splat(PI - 2.0 * (1.0 / self.index).asin()) - both;
        let may_be = least.simd_le(most) | least.simd_le(both * f32x8::splat(FRAC_PI_2));
        if may_be.to_bitmask() == 0 {
            return [zero; 3];
        }
        let off = cosine.larger(-one).smaller(one).acos();
        let plane = Plane {
            near,
            far,
            per_index: f32x8::splat(1.0 / self.index),
        };
        let last = plane.turn(one);
        let crossed = one.only(last.simd_ge(off));
        let crossed = if always {
            crossed
        } else {
            crossed * (f32x8::splat(CROSSED) * near * near).smaller(one)
        };
        let ahead = off.simd_lt(near.arcsine() + far.arcsine());
        let may_be = ahead & plane.slope(zero).simd_lt(zero);
        if may_be.to_bitmask() == 0 {
            return [zero, zero, crossed];
        }
        let before = may_be & plane.turn(plane.valley()).simd_le(-off);
        let outer = one.only(before & last.simd_ge(-off));
        [one.only(before), outer, crossed]
    }

    /// A point and a target, the angle δ, and unit directions from the point to the centre, and across that to the side
    /// of the target.
    fn plane(&self, from: Vec3, target: &Target) -> (Plane<f32>, f32, [Vec3; 2]) {
        let to = self.centre - from;
        let there = target.towards(self.centre);
        let far = match target {
            Target::Direction(_) => 0.0,
            Target::Surface { .. } | Target::Point(_) => self.radius / there.length(),
        };
        let plane = Plane {
            near: (self.radius / to.length()).min(1.0),
            far: far.min(1.0),
            per_index: 1.0 / self.index,
        };
        let (to, there) = (to.normalize_or_zero(), there.normalize_or_zero());
        let along = to.dot(there);
        let across = there - to * along;
        let off = across.length().atan2(along);
        // On the axis any side will do.
        let across = across.try_normalize();
        let across = across.unwrap_or_else(|| to.any_orthonormal_vector());
        (plane, off, [to, across])
    }
}

impl<F: Float> Plane<F> {
    /// g(p), for p in [0, 1].
    #[inline(always)]
    fn turn(&self, p: F) -> F {
        let bent = p.arcsine() - (p * self.per_index).arcsine();
        bent + bent - (p * self.near).arcsine() - (p * self.far).arcsine()
    }

    /// Its derivative.
    #[inline(always)]
    fn slope(&self, p: F) -> F {
        let least = F::splat(1e-12);
        let of = |x: F| x / (F::ONE - (x * p) * (x * p)).larger(least).root();
        let bent = of(F::ONE) - of(self.per_index);
        bent + bent - of(self.near) - of(self.far)
    }

    /// Where g is the least.
    #[inline(always)]
    fn valley(&self) -> F {
        bisect((F::ZERO, F::ONE), |p| self.slope(p).below(F::ZERO))
    }
}

/// Where `is_before` ends to hold between two numbers.
#[inline(always)]
fn bisect<F: Float>((mut low, mut high): (F, F), is_before: impl Fn(F) -> F::Mask) -> F {
    let half = F::splat(0.5);
    for _ in 0..STEPS {
        let middle = half * (low + high);
        let before = is_before(middle);
        low = F::select(before, middle, low);
        high = F::select(before, high, middle);
    }
    half * (low + high)
}
