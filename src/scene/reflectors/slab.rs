//! Slabs of glass: two faces of a body that are parallel. What passes goes on in its direction, a step aside; what comes
//! to a side of the body that is across them, comes through one and leaves through the other.

use super::plane::Plane;
use super::{Form, Reflector, Reflectors, Target, Targets};
use crate::bsdf::fresnel;
use crate::lanes::{Float, Mask, Vector, positive};
use glam::Vec3;

/// A slab of glass.
#[derive(Clone, Debug)]
pub struct Slab {
    /// Both faces, whose normals point outwards.
    faces: [Plane; 2],
    /// Which reflectors they are.
    numbers: [u32; 2],
    thickness: f32,
    /// Refractive index, inside over outside.
    ior: f32,
    area: f32,
}

/// Light on its way by a side of a body.
pub(super) struct WayAcross<F: Float> {
    /// The way on which it sets out, of any length.
    pub(super) way: Vector<F>,
    /// Squared sine at the side, inside.
    squared_sine: F,
    /// Where there is a way.
    pub(super) valid: F::Mask,
}

/// Most slabs of a scene, the largest.
const SLABS: usize = 16;
/// Most slabs of a body that are tried for a side across them.
const FOR_A_SIDE: usize = 2;
/// Planes are across one another with this cosine, and parallel with this one.
const ACROSS: f32 = 1e-3;
const PARALLEL: f32 = 1.0 - 1e-6;
/// So often the way is corrected by how far aside light steps on it: by a factor of at most a third each time.
const ROUNDS: usize = 4;

impl Slab {
    /// That of two sides of a body, if they are parallel.
    fn new(list: &[Reflector], numbers: [u32; 2], ior: f32) -> Option<Self> {
        let [a, b] = numbers.map(|r| &list[r as usize]);
        let (Form::Plane(p), Form::Plane(q)) = (&a.form, &b.form) else {
            return None;
        };
        let thickness = -p.height(q.point());
        let is_slab = p.normal.dot(q.normal) < -PARALLEL && thickness > 0.0;
        is_slab.then(|| Self {
            faces: [p.clone(), q.clone()],
            numbers,
            thickness,
            ior,
            area: a.area.min(b.area),
        })
    }

    /// Those of the bodies of glass with these sides, by body, and for each side those across which it is.
    pub(super) fn find(
        list: &[Reflector],
        bodies: impl Iterator<Item = (Vec<u32>, f32)>,
    ) -> (Vec<Self>, Vec<(u32, Self)>) {
        let (mut slabs, mut across) = (Vec::new(), Vec::new());
        for (sides, ior) in bodies {
            let mut own: Vec<Self> = Vec::new();
            for (place, &a) in sides.iter().enumerate() {
                let pairs = sides[place + 1..].iter();
                own.extend(pairs.filter_map(|&b| Self::new(list, [a, b], ior)));
            }
            own.sort_by(|a, b| b.area.total_cmp(&a.area));
            for &side in &sides {
                let Form::Plane(plane) = &list[side as usize].form else {
                    continue;
                };
                let crossed = |slab: &&Self| slab.faces[0].normal.dot(plane.normal).abs() < ACROSS;
                let crossed = own.iter().filter(crossed).take(FOR_A_SIDE);
                across.extend(crossed.map(|slab| (side, slab.clone())));
            }
            slabs.extend(own);
        }
        slabs.sort_by(|a, b| b.area.total_cmp(&a.area));
        slabs.truncate(SLABS);
        (slabs, across)
    }

    /// How much further aside light gets between the faces than straight on, along `way`, which is of any length.
    #[inline(always)]
    fn step_aside<F: Float>(&self, way: Vector<F>) -> Vector<F> {
        let normal = Vector::splat(self.faces[0].normal);
        let up = normal.dot(way);
        let along = way - normal * up;
        let inside = self.depth_inside(way, up);
        along * (F::splat(self.thickness) * (F::ONE / inside - F::ONE / up.magnitude()))
    }

    /// By what to divide the part of `way` along the faces, of which `up` is the other, for how far light gets aside inside
    /// for each unit of depth.
    #[inline(always)]
    fn depth_inside<F: Float>(&self, way: Vector<F>, up: F) -> F {
        (F::splat(self.ior * self.ior - 1.0) * way.dot(way) + up * up).root()
    }

    /// Of light that comes to `across`, a side of the body, through one face from the points `from` and leaves through the
    /// other to the targets: the ways.
    #[inline(always)]
    pub(super) fn ways_by<F: Float>(
        &self,
        across: &Plane,
        from: Vector<F>,
        targets: &Targets<F>,
    ) -> WayAcross<F> {
        let normal = Vector::splat(self.faces[0].normal);
        let heights = [&self.faces[0], &self.faces[1]].map(|face| face.above(from));
        let is_above = positive(heights[0]);
        let height = F::select(is_above, heights[0], heights[1]);
        let images = across.images(targets);
        let near = F::select(targets.distant, F::ZERO, F::ONE);
        let straight = images.place - from * near;
        let mut way = straight;
        if !targets.distant.all() {
            for _ in 0..ROUNDS {
                way = straight - self.step_aside(way) * near;
            }
        }
        let up = normal.dot(way);
        let (cos, along) = (up.magnitude(), way - normal * up);
        let towards = F::select(is_above, -up, up);
        // Where it comes in, and where inside it meets the side.
        let p = from + way * (height / cos);
        let aside = along * (F::ONE / self.depth_inside(way, up));
        let side = Vector::splat(across.normal);
        let rise = side.dot(aside);
        let depth = -across.above(p) / rise;
        let inwards = F::select(is_above, -F::ONE, F::ONE);
        let q = p + (aside + normal * inwards) * depth;
        // Past the slab there is the target.
        let beyond = F::select(targets.distant, F::ONE, cos - height - F::splat(self.thickness));
        let valid = positive(height)
            & positive(towards)
            & positive(rise)
            & positive(beyond)
            & across.covers(q, 0.0)
            & positive(depth)
            & depth.below(F::splat(self.thickness));
        let squared = F::ONE + aside.dot(aside);
        WayAcross {
            way,
            squared_sine: F::ONE - rise * rise / squared,
            valid,
        }
    }

    /// What a side reflects of light on its way inside.
    #[inline(always)]
    pub(super) fn reflected<F: Float>(&self, way: &WayAcross<F>) -> F {
        let squared = F::ONE - F::splat(self.ior * self.ior) * way.squared_sine;
        let least = F::splat(fresnel::dielectric(1.0, self.ior));
        let cos = squared.larger(F::ZERO).root();
        least + (F::ONE - least) * fresnel::fifth_power(F::ONE - cos)
    }
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
        let mut way = straight;
        for round in 0..=ROUNDS {
            let steps = self.slabs.iter().filter_map(|slab| {
                let step = slab.step_aside::<f32>(way.into()).into();
                // Straight on it may be beyond the edges by as much.
                let margin = if round == 0 { step } else { Vec3::ZERO };
                let is_passed = slab.is_passed(from, to, way, margin.length());
                is_passed.then_some(step)
            });
            let aside = steps.reduce(|sum, step| sum + step);
            if round == 0 && aside.is_none() {
                return None;
            }
            way = straight - aside.unwrap_or(Vec3::ZERO);
        }
        (way != straight).then(|| way.try_normalize())?
    }

    /// Whether light may pass slabs on its way, other than straight on.
    #[inline]
    pub fn have_slabs(&self) -> bool {
        !self.slabs.is_empty()
    }

    /// The slab of which a reflector is a face, with the number of the other face.
    pub(super) fn slab_of(&self, reflector: u32) -> Option<(&Slab, &Plane)> {
        self.slabs.iter().find_map(|slab| match slab.numbers {
            [a, _] if a == reflector => Some((slab, &slab.faces[1])),
            [_, b] if b == reflector => Some((slab, &slab.faces[0])),
            _ => None,
        })
    }
}

impl Slab {
    /// Whether `way` from `from` comes in by a face and leaves by the other, at most so far beyond their edges, and `to` is
    /// past that.
    fn is_passed(&self, from: Vec3, to: Vec3, way: Vec3, margin: f32) -> bool {
        let [a, b] = &self.faces;
        let (near, far) = if a.height(from) > 0.0 { (a, b) } else { (b, a) };
        let (height, up) = (near.height(from), near.normal.dot(way));
        if !(height > 0.0 && far.height(to) > 0.0 && up < 0.0) {
            return false;
        }
        let into = from - way * (height / up);
        let aside = (way - near.normal * up) / self.depth_inside::<f32>(way.into(), up);
        let out_of = into + (aside - near.normal) * self.thickness;
        near.covers::<f32>(into.into(), margin) && far.covers::<f32>(out_of.into(), margin)
    }

    /// The way from `from` to the `image` that the face with this plane shows, of the light that came in by the other one.
    pub(super) fn way_back(&self, other: &Plane, from: Vec3, image: &Target) -> Option<Vec3> {
        let to = match *image {
            Target::Surface { position, .. } | Target::Point(position) => position,
            Target::Direction(_) => return None,
        };
        if other.height(from) <= 0.0 {
            return None;
        }
        let straight = to - from;
        let mut way = straight;
        for _ in 0..ROUNDS {
            way = straight - Vec3::from(self.step_aside::<f32>(way.into())) * 2.0;
        }
        Some(way)
    }
}
