//! Where chains end.

use crate::lanes::{Float, LANES, Vec3x8, Vector, mask_of};
use glam::Vec3;
use wide::f32x8;

/// Where a chain of single directions ends.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Target {
    /// On a light that is a surface.
    Surface {
        /// Where.
        position: Vec3,
        /// Unit normal of the side that emits.
        ng: Vec3,
        /// Distance by which rays end before the surface.
        offset: f32,
    },
    /// A light that is a point.
    Point(Vec3),
    /// In the environment, or a directional light: the unit direction to it.
    Direction(Vec3),
}

/// Targets in lanes.
#[derive(Clone, Copy, Debug)]
pub struct Targets<F: Float> {
    /// Points, or unit directions.
    pub place: Vector<F>,
    /// Where they are directions.
    pub distant: F::Mask,
}

impl Target {
    /// The way to it from `p`, of any length.
    #[inline]
    pub fn towards(&self, p: Vec3) -> Vec3 {
        match *self {
            Target::Surface { position, .. } | Target::Point(position) => position - p,
            Target::Direction(direction) => direction,
        }
    }
}

impl Targets<f32> {
    /// A single one.
    pub(super) fn of(target: &Target) -> Self {
        let (place, distant) = match *target {
            Target::Surface { position, .. } | Target::Point(position) => (position, false),
            Target::Direction(direction) => (direction, true),
        };
        Self {
            place: place.into(),
            distant,
        }
    }
}

impl Targets<f32x8> {
    /// Those that there are.
    pub fn gather(target: impl Fn(usize) -> Option<Target>) -> Self {
        let (mut place, mut distant) = (Vec3x8::ZERO, 0);
        for lane in 0..LANES {
            match target(lane) {
                Some(Target::Surface { position, .. } | Target::Point(position)) => {
                    place.set(lane, position);
                }
                Some(Target::Direction(direction)) => {
                    place.set(lane, direction);
                    distant |= 1 << lane;
                }
                None => (),
            }
        }
        Self {
            place,
            distant: mask_of(distant),
        }
    }

    /// That of a lane.
    pub(super) fn single(&self, lane: usize) -> Targets<f32> {
        Targets {
            place: self.place.lane(lane).into(),
            distant: self.distant.to_bitmask() >> lane & 1 == 1,
        }
    }

    /// That of a lane, in all.
    pub(super) fn lane(&self, lane: usize) -> Self {
        Self {
            place: Vec3x8::splat(self.place.lane(lane)),
            distant: mask_of(0u32.wrapping_sub(self.distant.to_bitmask() >> lane & 1)),
        }
    }
}
