//! Slabs of glass: two faces of a body that are parallel. What passes goes on in its direction, a step aside.

use super::plane::Plane;
use super::{Form, Reflector, Reflectors, Target};
use crate::bsdf::fresnel;
use crate::lanes::Float;
use glam::Vec3;

/// A slab of glass.
#[derive(Clone, Debug)]
pub struct Slab {
    /// Both faces, whose normals point outwards.
    pub(super) faces: [Plane; 2],
    /// Which reflectors they are.
    pub(super) numbers: [u32; 2],
    pub(super) thickness: f32,
    /// Refractive index, inside over outside.
    pub(super) ior: f32,
    /// At normal incidence.
    pub(super) reflectance: f32,
    /// That of the smaller face.
    pub(super) area: f32,
}

/// Most slabs of a scene, the largest.
const SLABS: usize = 16;
/// Planes are parallel with this cosine between them.
const PARALLEL: f32 = 1.0 - 1e-6;
/// Through several slabs, the way is corrected so often by how far aside light steps on it. A walk does the rest.
const ROUNDS: usize = 4;
/// Steps of Newton's method.
const STEPS: usize = 3;
/// Courses are looked for inside slabs whose faces are at least this share of their body's surface.
const LARGE: f32 = 0.25;

impl Slab {
    /// That of two sides of a body, if they are parallel.
    fn new(list: &[Reflector], numbers: [u32; 2], ior: f32) -> Option<Self> {
        let [a, b] = numbers.map(|r| &list[r as usize]);
        let (Form::Plane(p), Form::Plane(q)) = (&a.form, &b.form) else {
            return None;
        };
        let thickness = -p.height(q.point());
        let is_slab = p.normal.dot(q.normal) < -PARALLEL && thickness > 0.0 && ior > 1.0;
        is_slab.then(|| Self {
            faces: [p.clone(), q.clone()],
            numbers,
            thickness,
            ior,
            reflectance: fresnel::dielectric(1.0, ior),
            area: a.area.min(b.area),
        })
    }

    /// Those of a body of glass with these sides, the largest first.
    pub(super) fn of_body(list: &[Reflector], sides: &[u32], ior: f32) -> Vec<Self> {
        let mut slabs: Vec<Self> = Vec::new();
        for (place, &a) in sides.iter().enumerate() {
            let others = sides[place + 1..].iter();
            slabs.extend(others.filter_map(|&b| Self::new(list, [a, b], ior)));
        }
        sort(&mut slabs);
        slabs
    }

    /// Whether its faces are a good part of its body, of which this is the surface.
    pub(super) fn is_large(&self, surface: f32) -> bool {
        2.0 * self.area >= LARGE * surface
    }

    /// The largest of all, the largest first.
    pub(super) fn largest(mut slabs: Vec<Self>) -> Vec<Self> {
        sort(&mut slabs);
        slabs.truncate(SLABS);
        slabs
    }

    /// How much further aside light gets between the faces than straight on, along `way`, which is of any length.
    fn step_aside(&self, way: Vec3) -> Vec3 {
        let up = self.faces[0].normal.dot(way);
        let along = (way - self.faces[0].normal * up) / up.abs();
        let inside = self.depth_inside(along.length_squared());
        along * (self.thickness * (1.0 / inside - 1.0))
    }

    /// What the sideways part of a way is divided by inside, for each unit of depth, by its square outside.
    #[inline(always)]
    pub(super) fn depth_inside<F: Float>(&self, squared: F) -> F {
        let squared_index = self.ior * self.ior;
        (F::splat(squared_index) + F::splat(squared_index - 1.0) * squared).root()
    }

    /// Of light that gets sideways by a distance of which this is the square, over the depths `outside` and `inside` in all:
    /// the tangent of its angle outside over that distance.
    #[inline(always)]
    pub(super) fn steepness<F: Float>(&self, squared: F, outside: F, inside: F) -> F {
        // The root of share (outside + inside / depth_inside) = 1 by Newton's method: the left side is concave, so it is
        // come to from below.
        let mut share = F::ONE / (outside + inside);
        for _ in 0..STEPS {
            let per_inside = F::ONE / self.depth_inside(squared * share * share);
            let inside = inside * per_inside;
            let left = share * (outside + inside);
            let slope = outside + inside * F::splat(self.ior * self.ior) * per_inside * per_inside;
            share = share + (F::ONE - left) / slope;
        }
        share
    }

    /// What a side reflects of light inside that meets it with this cosine.
    #[inline(always)]
    pub(super) fn reflects_inside<F: Float>(&self, cos: F) -> F {
        let squared_sine = F::splat(self.ior * self.ior) * (F::ONE - cos * cos);
        let cos = (F::ONE - squared_sine).larger(F::ZERO).root();
        fresnel::schlick_grey(self.reflectance, cos)
    }

    /// The way from a point on one side of it, of any length, on which light comes to one on the other.
    fn way_through(&self, from: Vec3, to: Vec3) -> Vec3 {
        let normal = self.faces[0].normal;
        let up = normal.dot(to - from);
        let along = to - from - normal * up;
        let outside = up.abs() - self.thickness;
        along * self.steepness(along.length_squared(), outside, self.thickness)
            + normal * 1f32.copysign(up)
    }

    /// Whether two points are on different sides of it.
    #[inline]
    fn is_between(&self, from: Vec3, to: Vec3) -> bool {
        let [a, b] = &self.faces;
        let above = |p| (a.height(p) > 0.0, b.height(p) > 0.0);
        matches!(
            (above(from), above(to)),
            ((true, _), (_, true)) | ((_, true), (true, _))
        )
    }

    /// Whether `way` from `from`, which leads to the other side of it, comes in by a face and leaves by the other, at most so
    /// far beyond their edges.
    fn is_passed(&self, from: Vec3, way: Vec3, margin: f32) -> bool {
        let [a, b] = &self.faces;
        let (near, far) = if a.height(from) > 0.0 { (a, b) } else { (b, a) };
        let down = -near.normal.dot(way);
        if down.is_nan() || down <= 0.0 {
            return false;
        }
        let way = way / down;
        let into = from + way * near.height(from);
        let aside = way + near.normal;
        let aside = aside / self.depth_inside(aside.length_squared());
        let out_of = into + (aside - near.normal) * self.thickness;
        near.covers::<f32>(into.into(), margin) && far.covers::<f32>(out_of.into(), margin)
    }
}

/// The largest first; of equal ones the first stays so.
fn sort(slabs: &mut [Slab]) {
    slabs.sort_by(|a, b| b.area.total_cmp(&a.area));
}

impl Reflectors {
    /// The unit direction in which light sets out from `from` for `target` through slabs, if it steps aside on its way.
    /// With one slab on the way it is exactly that way, with more about that.
    pub fn aside(&self, from: Vec3, target: &Target) -> Option<Vec3> {
        let to = match *target {
            Target::Surface { position, .. } | Target::Point(position) => position,
            Target::Direction(_) => return None,
        };
        let straight = to - from;
        let between = self.slabs.iter().filter(|slab| slab.is_between(from, to));
        // Straight on it may be beyond their edges by all the steps aside.
        let margin = between
            .clone()
            .map(|slab| slab.step_aside(straight).length());
        let margin = margin.sum();
        let mut passed = between
            .clone()
            .filter(|slab| slab.is_passed(from, straight, margin));
        let first = passed.next()?;
        if passed.next().is_none() {
            let way = first.way_through(from, to);
            return first
                .is_passed(from, way, 0.0)
                .then(|| way.try_normalize())?;
        }
        let steps = |way: Vec3, margin: f32| {
            let passed = between
                .clone()
                .filter(|slab| slab.is_passed(from, way, margin));
            passed.map(|slab| slab.step_aside(way)).sum::<Vec3>()
        };
        let mut way = straight - steps(straight, margin);
        for _ in 0..ROUNDS {
            way = straight - steps(way, 0.0);
        }
        (way != straight).then(|| way.try_normalize())?
    }

    /// Whether there are slabs of glass.
    #[inline]
    pub fn have_slabs(&self) -> bool {
        !self.slabs.is_empty()
    }
}
