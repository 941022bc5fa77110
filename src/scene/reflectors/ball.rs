//! Balls of glass: the ways by which light passes them, straight through or once reflected inside, in closed form but for
//! one root.
//!
//! See [`sphere`](super::sphere) for g: the turn about the centre is π + g where light passes, 2π + g where it is
//! reflected inside. So if the target is by δ off from where it would be without any turn, its ways are those of g(p) =
//! −δ on one side, and of g(p) = δ on the other: beyond the centre. g falls at first, where rays have not met yet (up to
//! the rainbow, where light is reflected), and rises then: so there are up to three ways of each kind, each alone in its
//! [`Branch`]. (Both ends closer to the ball than a hundredth of its radius, g may fall below −π, and there is a fourth:
//! it is in no branch.)

use super::sphere::{InPlane, Plane, Sphere, bisect};
use super::{Target, Targets};
use crate::lanes::{Float, Vec3x8};
use glam::Vec3;
use std::f32::consts::{FRAC_PI_2, PI};
use wide::f32x8;

/// A ball of glass, as its mesh comes near to it.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Ball {
    /// Its surface.
    pub sphere: Sphere,
    /// The index of refraction inside over that outside, above 1.
    pub index: f32,
    /// The largest turn back of light from far away to far away, in radians: nothing where it passes; where it is
    /// reflected inside, the angle of its rainbow.
    turned_back: [f32; 2],
}

/// What becomes of light inside a ball.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Inside {
    /// It passes.
    Passes,
    /// It is reflected once.
    Reflected,
}

/// Which of the ways of a kind.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Part {
    /// On the near side, of rays that have not met yet.
    Inner,
    /// On the near side, of rays outside of those that meet.
    Outer,
    /// On the far side of the centre.
    Crossed,
}

/// Which of the ways through a ball.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Branch {
    /// What becomes of light inside.
    pub inside: Inside,
    /// Which of these ways.
    pub part: Part,
}

impl Inside {
    /// Both.
    const ALL: [Inside; 2] = [Inside::Passes, Inside::Reflected];

    /// Chords of the way.
    fn chords(self) -> u32 {
        match self {
            Inside::Passes => 1,
            Inside::Reflected => 2,
        }
    }
}

impl Branch {
    /// All of them, in the order of [`Branch::number`].
    pub const ALL: [Branch; 6] = [
        Self::new(Inside::Passes, Part::Inner),
        Self::new(Inside::Passes, Part::Outer),
        Self::new(Inside::Passes, Part::Crossed),
        Self::new(Inside::Reflected, Part::Inner),
        Self::new(Inside::Reflected, Part::Outer),
        Self::new(Inside::Reflected, Part::Crossed),
    ];

    const fn new(inside: Inside, part: Part) -> Self {
        Self { inside, part }
    }

    /// Its place in [`Branch::ALL`].
    #[inline]
    pub fn number(self) -> usize {
        3 * self.inside as usize + self.part as usize
    }

    /// The vertices of its chains.
    #[inline]
    pub fn vertices(self) -> u32 {
        self.inside.chords() + 1
    }

    /// In words.
    pub fn describe(self) -> &'static str {
        match (self.inside, self.part) {
            (Inside::Passes, Part::Inner) => "before rays meet",
            (Inside::Passes, Part::Outer) => "outside of rays that meet",
            (Inside::Passes, Part::Crossed) => "behind where rays meet",
            (Inside::Reflected, Part::Inner) => "reflected inside of the rainbow",
            (Inside::Reflected, Part::Outer) => "reflected outside of the rainbow",
            (Inside::Reflected, Part::Crossed) => "reflected beyond the centre",
        }
    }
}

/// Ways beyond the centre are tried at this many times the squared sine under which the ball is seen: by so much of
/// what there is to be seen they take. The other ways are rarer, and what they bring is bright.
const CROSSED: f32 = 1.0;
/// And so are all ways by which light is reflected inside.
const REFLECTED: f32 = 0.05;

impl Ball {
    /// That of this surface and index; `None` if the index is not above 1.
    pub(super) fn new(sphere: Sphere, index: f32) -> Option<Self> {
        // Where the derivative of 2 asin p − 4 asin(p/n) is 0.
        let least = ((4.0 - index * index).max(0.0) / 3.0).sqrt().min(1.0);
        let rainbow = 4.0 * (least / index).asin() - 2.0 * least.asin();
        (index > 1.0).then_some(Self {
            sphere,
            index,
            turned_back: [0.0, rainbow],
        })
    }

    /// The unit direction from `from` in which the way of a branch to `target` leaves, for an exact ball; `None`
    /// where there is none.
    pub fn guess(&self, branch: Branch, from: Vec3, target: &Target) -> Option<Vec3> {
        let in_plane = self.plane(from, target, branch.inside);
        let (plane, off) = (&in_plane.plane, in_plane.off);
        let g = |p: f32| plane.turn(p);
        let valley = || {
            let valley = (plane.slope(0.0) < 0.0).then(|| plane.valley());
            valley.filter(|&p| g(p) <= -off)
        };
        in_plane.leaving(match branch.part {
            Part::Inner => bisect((0.0, valley()?), |p| g(p) > -off),
            Part::Outer if g(1.0) >= -off => bisect((valley()?, 1.0), |p| g(p) < -off),
            Part::Crossed if g(1.0) >= off => -bisect((0.0, 1.0), |p| g(p) < off),
            Part::Outer | Part::Crossed => return None,
        })
    }

    /// The branch of a way that leaves `from` in the unit direction `wi` and ends at `target`.
    pub fn branch(&self, inside: Inside, from: Vec3, wi: Vec3, target: &Target) -> Branch {
        let InPlane { plane, across, .. } = self.plane(from, target, inside);
        let sine = across.dot(wi);
        let part = if sine < 0.0 {
            Part::Crossed
        } else if plane.slope((sine / plane.near).min(1.0)) < 0.0 {
            Part::Inner
        } else {
            Part::Outer
        };
        Branch { inside, part }
    }

    /// The probabilities of trying the branches, in the order of [`Branch::ALL`], from the points `from` to the targets:
    /// 0 where there is no such way; 1 where there is, if it shall be `always`. Those that are not above `least` may be
    /// 0, too.
    #[inline(always)]
    pub fn probabilities(
        &self,
        from: Vec3x8,
        targets: &Targets<f32x8>,
        always: bool,
        least: f32x8,
    ) -> [f32x8; 6] {
        let (zero, one) = (f32x8::ZERO, f32x8::ONE);
        let centre = Vec3x8::splat(self.sphere.centre);
        let radius = f32x8::splat(self.sphere.radius);
        let to = centre - from;
        let there = Vec3x8::select(targets.distant, targets.place, targets.place - centre);
        let near = radius / to.dot(to).root();
        let length = there.dot(there).root();
        let far = targets.distant.select(zero, (radius / length).smaller(one));
        let cosine = to.dot(there) * near / (radius * length);
        let near = near.smaller(one);
        let mut probabilities = [zero; 6];
        for inside in Inside::ALL {
            let seen = (near * near).smaller(one);
            let (rare, crossed) = match inside {
                Inside::Passes => (one, f32x8::splat(CROSSED) * seen),
                Inside::Reflected => {
                    let often = f32x8::splat(REFLECTED) * seen;
                    (often, often)
                }
            };
            let share = |p: f32x8| if always { one } else { p.smaller(one) };
            let (rare, crossed) = (share(rare), share(crossed));
            if rare.simd_gt(least).to_bitmask() == 0 && !always {
                continue;
            }
            let [inner, outer, beyond] = self.ways(inside, (near, far), cosine);
            let first = 3 * inside as usize;
            probabilities[first] = rare.only(inner);
            probabilities[first + 1] = rare.only(outer);
            probabilities[first + 2] = crossed.only(beyond);
        }
        probabilities
    }

    /// Where there are ways of each [`Part`], in order. `cosine` is that of the angle between the ways to the centre
    /// and on to the target, for the other two see [`Plane`].
    #[inline(always)]
    fn ways(&self, inside: Inside, (near, far): (f32x8, f32x8), cosine: f32x8) -> [f32x8; 3] {
        let (zero, one) = (f32x8::ZERO, f32x8::ONE);
        let chords = inside.chords() as f32;
        // Of the angle δ.
        let cosine = match inside {
            Inside::Passes => cosine,
            Inside::Reflected => -cosine,
        };
        // With bounds for angles first: no less than 2 sin(δ/2), and arcsines between x and π/2 x. Ways beyond the
        // centre turn by g(1) at most. Before it rays are turned back by no more than what points nearby add.
        let least = (one - cosine).larger(zero) * f32x8::splat(2.0);
        let least = least.root();
        let both = near + far;
        let most = f32x8::splat(PI - 2.0 * chords * (1.0 / self.index).asin()) - both;
        let back = f32x8::splat(self.turned_back[inside as usize]);
        let may_be = least.simd_le(most) | least.simd_le(back + both * f32x8::splat(FRAC_PI_2));
        if may_be.to_bitmask() == 0 {
            return [zero; 3];
        }
        let off = cosine.larger(-one).smaller(one).acos();
        let plane = Plane {
            near,
            far,
            per_index: f32x8::splat(1.0 / self.index),
            chords: f32x8::splat(chords),
        };
        let last = plane.turn(one);
        let crossed = last.simd_ge(off);
        let near_enough = off.simd_lt(back + near.arcsine() + far.arcsine());
        let may_be = near_enough & plane.slope(zero).simd_lt(zero);
        if may_be.to_bitmask() == 0 {
            return [zero, zero, crossed];
        }
        let inner = may_be & plane.turn(plane.valley()).simd_le(-off);
        [inner, inner & last.simd_ge(-off), crossed]
    }

    /// The plane of a point and a target, with the angle δ, and across to the near side.
    fn plane(&self, from: Vec3, target: &Target, inside: Inside) -> InPlane {
        let of_index = (inside.chords(), self.index);
        let mut in_plane = self.sphere.plane(from, target, of_index);
        if inside == Inside::Reflected {
            in_plane.off = PI - in_plane.off;
            in_plane.across = -in_plane.across;
        }
        in_plane
    }
}
