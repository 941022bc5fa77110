//! Courses of light inside slabs of glass: it comes in by a face, is reflected at sides across the slab and to and fro
//! between its faces, and leaves. Unfolded, such a course is straight, so it is known where it begins.

use super::{NONE, Plane, Reflector, Sequence, Slab, Target, Targets};
use crate::bsdf::fresnel;
use crate::lanes::{Float, Mask, Vector, positive};
use glam::Vec3;

/// How light is reflected inside a slab.
#[derive(Clone, Debug)]
pub struct Course {
    slab: Slab,
    /// At these sides, each once: with their numbers. They are across the slab, and across one another.
    sides: Vec<(u32, Plane)>,
    /// So often at the faces, in turns.
    bounces: u32,
}

/// Ways on a course, from points in lanes.
pub(super) struct OnCourse<F: Float> {
    /// In which they set out, of any length.
    way: Vector<F>,
    /// How much is reflected, in [0, 1].
    pub(super) reflected: F,
    /// Where there is a way.
    pub(super) valid: F::Mask,
    /// Where it comes in by the first face.
    is_above: F::Mask,
    /// How far inside it meets the sides, counted along the slab's normal, to and fro.
    depths: [F; MOST_SIDES],
}

impl<F: Float> OnCourse<F> {
    fn none() -> Self {
        Self {
            way: Vector::ZERO,
            reflected: F::ZERO,
            valid: F::Mask::none(),
            is_above: F::Mask::none(),
            depths: [F::ZERO; MOST_SIDES],
        }
    }
}

/// Most sides of a course.
const MOST_SIDES: usize = 2;
/// Most courses of a scene beside those with a single reflection.
pub(super) const COURSES: usize = 18;

impl Course {
    /// The courses inside a slab with these sides across it, and that with a single reflection at each of the sides and the
    /// faces, with the numbers of these.
    pub(super) fn all(slab: &Slab, sides: &[(u32, Plane)]) -> (Vec<Self>, Vec<(u32, Self)>) {
        let course = |sides: &[&(u32, Plane)], bounces| Self {
            slab: slab.clone(),
            sides: sides.iter().map(|&side| side.clone()).collect(),
            bounces,
        };
        let mut several = vec![course(&[], 2)];
        let mut single: Vec<_> = slab.numbers.map(|face| (face, course(&[], 1))).into();
        for (place, side) in sides.iter().enumerate() {
            single.push((side.0, course(&[side], 0)));
            several.push(course(&[side], 2));
            let others = sides[place + 1..].iter();
            let others = others.filter(|other| other.1.is_upright_on(&side.1));
            several.extend(others.map(|other| course(&[side, other], 0)));
        }
        (several, single)
    }

    /// Area of the slab.
    pub(super) fn area(&self) -> f32 {
        self.slab.area
    }

    /// Whether light is reflected at these, in whichever order.
    pub(super) fn has(&self, numbers: &[u32]) -> bool {
        let of_sides = |number: &u32| self.sides.iter().any(|side| side.0 == *number);
        let sides = numbers.iter().filter(|number| of_sides(number)).count();
        let mut others = numbers.iter().filter(|number| !of_sides(number));
        numbers.len() == self.sides.len() + self.bounces as usize
            && sides == self.sides.len()
            && others.all(|number| self.slab.numbers.contains(number))
    }

    /// The ways from the points `from` to the targets.
    #[inline(always)]
    pub(super) fn ways<F: Float>(&self, from: Vector<F>, targets: &Targets<F>) -> OnCourse<F> {
        let slab = &self.slab;
        let [first, second] = &slab.faces;
        let [above, below] = [first, second].map(|face| face.above(from));
        let is_above = positive(above);
        let height = F::select(is_above, above, below);
        let all_depth = F::splat(slab.thickness * (self.bounces + 1) as f32);

        let leaves_above = if self.bounces % 2 == 1 {
            is_above
        } else {
            !is_above
        };
        let [past_first, past_second] = [first, second].map(|face| face.heights(targets));
        let past = F::select(leaves_above, past_first, past_second);
        let mut valid = positive(height) & positive(past);
        if !valid.any() {
            return OnCourse::none();
        }

        // Unfolded at the sides: how far along the slab, and how far into it and past it.
        let mut images = *targets;
        for (_, side) in &self.sides {
            images = side.images(&images);
        }
        let upwards = Vector::splat(first.normal) * F::select(is_above, F::ONE, -F::ONE);
        let near = F::select(targets.distant, F::ZERO, F::ONE);
        let along = images.place - from * near;
        let along = along - upwards * upwards.dot(along);
        let outside = past + height * near;
        // Where most have none: it comes in before a side, and leaves the slab behind it, unfolded. As if glass bent light not
        // at all, and as if it had no depth, tells between which.
        let (least, most) = (F::ONE / (outside + all_depth * near), F::ONE / outside);
        let reach = height + all_depth * F::splat(1.0 / slab.ior);
        for (_, side) in &self.sides {
            let (start, rise) = (side.above(from), along.dot(Vector::splat(side.normal)));
            let comes_in_before = (start + rise * least * height).below(F::ZERO);
            valid =
                valid & positive(rise) & comes_in_before & positive(start + rise * most * reach);
        }
        if !self.sides.is_empty() && !valid.any() {
            return OnCourse::none();
        }
        let steepness = slab.steepness(along.dot(along), outside, all_depth * near);
        let way = along * steepness - upwards;

        let covers = |is_first: F::Mask, p: Vector<F>| {
            is_first & first.covers(p, 0.0) | !is_first & second.covers(p, 0.0)
        };
        // Where it comes in, where inside it meets the sides, and where it leaves.
        let come_in = from + way * height;
        let aside = way + upwards;
        let squared = aside.dot(aside);
        let aside = aside * (F::ONE / slab.depth_inside(squared));
        let mut leave = come_in + aside * all_depth;
        valid = valid & covers(is_above, come_in);
        let inside = (F::ONE + aside.dot(aside)).root();
        let mut depths = [F::ZERO; MOST_SIDES];
        let mut reflected = F::ONE;
        for ((_, side), to) in self.sides.iter().zip(&mut depths) {
            let rise = aside.dot(Vector::splat(side.normal));
            let depth = -side.above(come_in) / rise;
            valid = valid & positive(rise) & positive(depth) & depth.below(all_depth);
            let above = side.above(leave);
            leave = leave - Vector::splat(side.normal) * (above + above);
            let cos = rise / inside;
            reflected = reflected * slab.reflects_inside(cos);
            *to = depth;
        }
        valid = valid & covers(leaves_above, leave);
        if self.bounces > 0 {
            let cos = F::ONE / (F::ONE + squared).root();
            let at_face = fresnel::schlick_grey(slab.reflectance, cos);
            for _ in 0..self.bounces {
                reflected = reflected * at_face;
            }
        }
        OnCourse {
            way,
            reflected,
            valid,
            is_above,
            depths,
        }
    }

    /// The reflectors by which the way from a point to a target goes, in their order, if there is one.
    pub(super) fn sequence(&self, from: Vec3, target: &Targets<f32>) -> Option<Sequence> {
        self.order(&self.ways(from.into(), target))
    }

    fn order(&self, way: &OnCourse<f32>) -> Option<Sequence> {
        if !way.valid {
            return None;
        }
        let mut faces = self.slab.numbers;
        if !way.is_above {
            faces.reverse();
        }
        let [near, far] = faces;
        let at_faces = (1..=self.bounces).map(|bounce| {
            let face = if bounce % 2 == 1 { far } else { near };
            (bounce as f32 * self.slab.thickness, face)
        });
        let at_sides = self.sides.iter().zip(&way.depths);
        let at_sides = at_sides.map(|((number, _), depth)| (*depth, *number));
        let mut all = [(f32::INFINITY, NONE); Sequence::MOST];
        for (to, reflection) in all.iter_mut().zip(at_faces.chain(at_sides)) {
            *to = reflection;
        }
        all.sort_unstable_by(|a, b| a.0.total_cmp(&b.0).then(a.1.cmp(&b.1)));
        let mut all = all.into_iter().filter(|(_, number)| *number != NONE);
        all.try_fold(Sequence::NONE, |sequence, (_, number)| sequence.and(number))
    }

    /// The way from `from` to `target`, if it goes by these reflectors in this order.
    pub(super) fn way(&self, by: &Sequence, from: Vec3, target: &Target) -> Option<Vec3> {
        let on_course = self.ways(from.into(), &Targets::of(target));
        (self.order(&on_course)? == *by).then(|| on_course.way.into())
    }
}

impl Reflector {
    /// About how much of the targets it shows to the points `from`, inside a slab of which it is a face or a side; 0 where it
    /// shows none.
    #[inline(always)]
    pub(super) fn shows_inside<F: Float>(
        &self,
        number: u32,
        from: Vector<F>,
        targets: &Targets<F>,
    ) -> F {
        let mut shown = F::ZERO;
        for course in &self.courses {
            let ways = course.ways(from, targets);
            let by_this = match (course.bounces, course.slab.numbers) {
                (0, _) => F::Mask::every(),
                (_, [_, second]) if second == number => ways.is_above,
                _ => !ways.is_above,
            };
            shown = shown.larger(ways.reflected.only(ways.valid & by_this));
        }
        shown
    }
}
