//! Where the search for a chain begins.

use super::{Curved, Form, Reflectors, Sequence, Target, Targets};
use crate::lanes::{Float, LANES, Vec3x8, positive};
use glam::Vec3;
use wide::f32x8;

impl Reflectors {
    /// The unit direction from `from` in which a search for `target` by these reflectors begins: exact where all are
    /// planes and no glass on the way bends it, and on courses inside slabs. None where there is none, or where more than one is curved.
    pub fn guess(&self, by: &Sequence, from: Vec3, target: &Target) -> Option<Vec3> {
        if let Some(way) = self.inside_a_slab(by, from, target) {
            return way.try_normalize();
        }
        self.guess_by(by, from, target, |curved, from, target| {
            curved
                .exact(from, target)
                .or_else(|| curved.best(from, target))
        })
    }

    /// The way from `from` to `target` by these reflectors inside a slab of glass, if it is there.
    fn inside_a_slab(&self, by: &Sequence, from: Vec3, target: &Target) -> Option<Vec3> {
        let courses = match by.numbers() {
            &[reflector] => &self.list[reflector as usize].courses,
            _ => &self.courses,
        };
        let mut fitting = courses.iter().filter(|course| course.has(by.numbers()));
        fitting.find_map(|course| course.way(by, from, target))
    }

    /// The same, for a microfacet of a reflector with the local normal `h`: exact where that is a plane.
    pub fn guess_by_microfacet(
        &self,
        (reflector, h): (u32, Vec3),
        from: Vec3,
        target: &Target,
    ) -> Option<Vec3> {
        match &self.list[reflector as usize].form {
            Form::Plane(plane) => plane.by_microfacet(h, from, target),
            Form::Curved(_) => self.guess(&Sequence::of(reflector), from, target),
        }
    }

    /// Another one, if that comes to nothing: where the way to the first of these reflectors is through planes of glass that
    /// bend it, the direction to its middle; where a curved one is a sphere but for its facets, that to one of its points.
    pub fn other_guess(&self, by: &Sequence, from: Vec3, target: &Target) -> Option<Vec3> {
        let first = &self.list[*by.numbers().first()? as usize];
        if first.is_across {
            let middle = 0.5 * (first.bounds.0 + first.bounds.1);
            return (middle - from).try_normalize();
        }
        let flat = |&r: &u32| matches!(self.list[r as usize].form, Form::Plane(_));
        if by.numbers().iter().all(flat) {
            return None;
        }
        self.guess_by(by, from, target, |curved, from, target| {
            curved.exact(from, target)?;
            curved.best(from, target)
        })
    }

    /// With `of_curved`, what is to be aimed at of a curved reflector from a point for a target.
    fn guess_by(
        &self,
        by: &Sequence,
        from: Vec3,
        target: &Target,
        of_curved: impl Fn(&Curved, Vec3, &Target) -> Option<Vec3>,
    ) -> Option<Vec3> {
        let forms = by.numbers().iter().map(|&r| &self.list[r as usize].form);
        let curved = |form: &Form| matches!(form, Form::Curved(_));
        let Some(place) = forms.clone().position(curved) else {
            // What the first shows of what the others show.
            let image = forms.rev().fold(*target, |image, form| form.image(&image));
            return image.towards(from).try_normalize();
        };
        if forms.clone().skip(place + 1).any(curved) {
            return None;
        }
        // Planes before and behind the curved one are unfolded.
        let image = forms.clone().skip(place + 1).rev();
        let image = image.fold(*target, |image, form| form.image(&image));
        let before = forms.clone().take(place);
        let seen_from = before.clone().fold(from, |p, form| form.mirror(p));
        let Some(Form::Curved(curved)) = forms.clone().nth(place) else {
            return None;
        };
        let best = of_curved(curved, seen_from, &image)?;
        let p = before.rev().fold(best, |p, form| form.mirror(p));
        (p - from).try_normalize()
    }
}

impl Curved {
    /// Of a sphere, a point on the way to where it reflects `target`.
    fn exact(&self, from: Vec3, target: &Target) -> Option<Vec3> {
        Some(from + self.sphere?.reflected(from, target)?)
    }

    /// The point at which the half vector of the ways to `from` and to `target` is the nearest to the normal.
    fn best(&self, from: Vec3, target: &Target) -> Option<Vec3> {
        let from = Vec3x8::splat(from);
        let Targets { place, distant } = Targets::of(target);
        let to = Vec3x8::splat(place.into());
        // The squared cosine of the angle between them, and the point: in each lane the best, of equal ones the first.
        let mut best = (f32x8::ZERO, Vec3x8::ZERO);
        for &(p, normal) in &self.points {
            let (here, there) = (from - p, if distant { to } else { to - p });
            let (cos_o, cos_i) = (normal.dot(here), normal.dot(there));
            let mut seen = positive(cos_o * cos_i);
            if self.outside.is_some() {
                seen &= positive(cos_o);
            }
            let half = here * here.length_recip() + there * there.length_recip();
            let cos = normal.dot(half);
            let fits = (cos * cos / half.dot(half)).only(seen);
            let better = fits.above(best.0);
            best.0 = f32x8::select(better, fits, best.0);
            best.1 = Vec3x8::select(better, p, best.1);
        }
        let fits = best.0.as_array();
        let lane = (0..LANES).max_by(|&a, &b| fits[a].total_cmp(&fits[b]).then(b.cmp(&a)))?;
        (fits[lane] > 0.0).then(|| best.1.lane(lane))
    }
}

impl Form {
    /// What a plane shows in the place of `target`.
    fn image(&self, target: &Target) -> Target {
        match self {
            Form::Plane(plane) => plane.image(target),
            Form::Curved(_) => *target,
        }
    }

    /// Where a plane shows `p`.
    fn mirror(&self, p: Vec3) -> Vec3 {
        match self {
            Form::Plane(plane) => plane.mirror(p),
            Form::Curved(_) => p,
        }
    }
}
