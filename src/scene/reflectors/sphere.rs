//! Spheres: ways by them and through them lie in a plane with their centre, and have closed forms but for one root.
//!
//! A ray is told by its impact parameter p, its distance from the centre before it meets the sphere, here over the
//! radius. From a point at the distance a from the centre to one at the distance b, with c chords inside between which
//! it is reflected, it turns about the centre by cπ + g(p),
//!
//! > g(p) = 2 asin p − 2c asin(p/n) − asin(p/a) − asin(p/b).
//!
//! With no chord it is reflected outside. g falls at first, if at all, and rises then.

use super::Target;
use crate::lanes::Float;
use crate::scene::mesh::Mesh;
use glam::{DMat4, DVec3, DVec4, Vec3};

/// A sphere, as a mesh comes near to it.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Sphere {
    /// Its centre.
    pub centre: Vec3,
    /// Its radius.
    pub radius: f32,
}

/// Corners may be off by this share of the radius, and normals as much.
const TOLERANCE: f64 = 2e-3;
/// Steps of bisection: the walk that begins there does the rest.
const STEPS: u32 = 10;

/// Points and targets as a sphere has them.
pub(super) struct Plane<F> {
    /// The radius over the distances from the points to the centre, and from there to the targets; at most 1.
    pub(super) near: F,
    pub(super) far: F,
    /// One over the index of refraction inside.
    pub(super) per_index: F,
    /// The chords inside.
    pub(super) chords: F,
}

/// A point and a target in their plane.
pub(super) struct InPlane {
    pub(super) plane: Plane<f32>,
    /// The angle between the ways to the centre and on to the target.
    pub(super) off: f32,
    /// Unit directions from the point to the centre, and across that to the side of the target.
    pub(super) to: Vec3,
    pub(super) across: Vec3,
}

impl Sphere {
    /// That of which `triangles` are a part; `None` if they are of no sphere, or shaded otherwise.
    pub(super) fn of(mesh: &Mesh, triangles: &[u32]) -> Option<Self> {
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
        let is_sphere = radius.is_finite() && triangles.iter().all(on_it);
        let centre: DVec3 = centre + about;
        is_sphere.then_some(Self {
            centre: centre.as_vec3(),
            radius: radius as f32,
        })
    }

    /// The plane of a point, a target and the centre, for ways with so many chords at this index of refraction.
    pub(super) fn plane(
        &self,
        from: Vec3,
        target: &Target,
        (chords, index): (u32, f32),
    ) -> InPlane {
        let to = self.centre - from;
        let there = target.towards(self.centre);
        let far = match target {
            Target::Direction(_) => 0.0,
            Target::Surface { .. } | Target::Point(_) => self.radius / there.length(),
        };
        let plane = Plane {
            near: (self.radius / to.length()).min(1.0),
            far: far.min(1.0),
            per_index: 1.0 / index,
            chords: chords as f32,
        };
        let (to, there) = (to.normalize_or_zero(), there.normalize_or_zero());
        let along = to.dot(there);
        let across = there - to * along;
        let off = across.length().atan2(along);
        // On the axis any side will do.
        let across = across.try_normalize();
        let across = across.unwrap_or_else(|| to.any_orthonormal_vector());
        InPlane {
            plane,
            off,
            to,
            across,
        }
    }

    /// The unit direction from `from` in which `target` is seen reflected, from outside; `None` where it is not, or one
    /// of the two is inside.
    pub(super) fn reflected(&self, from: Vec3, target: &Target) -> Option<Vec3> {
        let in_plane = self.plane(from, target, (0, 1.0));
        let InPlane { plane, off, .. } = &in_plane;
        let turn = std::f32::consts::PI - off;
        let outside = plane.near < 1.0 && plane.far < 1.0;
        if !outside || plane.turn(1.0) < turn {
            return None;
        }
        in_plane.leaving(bisect((0.0, 1.0), |p| plane.turn(p) < turn))
    }
}

impl InPlane {
    /// The unit direction from the point of the ray with the impact parameter `p`, on the side of the target if that is
    /// positive.
    pub(super) fn leaving(&self, p: f32) -> Option<Vec3> {
        let sine = p * self.plane.near;
        let direction = self.to * (1.0 - sine * sine).max(0.0).sqrt() + self.across * sine;
        direction.try_normalize()
    }
}

impl<F: Float> Plane<F> {
    /// g(p), for p in [0, 1].
    #[inline(always)]
    pub(super) fn turn(&self, p: F) -> F {
        let bent = p.arcsine() - self.chords * (p * self.per_index).arcsine();
        bent + bent - (p * self.near).arcsine() - (p * self.far).arcsine()
    }

    /// Its derivative.
    #[inline(always)]
    pub(super) fn slope(&self, p: F) -> F {
        let least = F::splat(1e-12);
        let of = |x: F| x / (F::ONE - (x * p) * (x * p)).larger(least).root();
        let bent = of(F::ONE) - self.chords * of(self.per_index);
        bent + bent - of(self.near) - of(self.far)
    }

    /// Where g is the least.
    #[inline(always)]
    pub(super) fn valley(&self) -> F {
        bisect((F::ZERO, F::ONE), |p| self.slope(p).below(F::ZERO))
    }
}

/// Where `is_before` ends to hold between two numbers.
#[inline(always)]
pub(super) fn bisect<F: Float>((mut low, mut high): (F, F), is_before: impl Fn(F) -> F::Mask) -> F {
    let half = F::splat(0.5);
    for _ in 0..STEPS {
        let middle = half * (low + high);
        let before = is_before(middle);
        low = F::select(before, middle, low);
        high = F::select(before, high, middle);
    }
    half * (low + high)
}
