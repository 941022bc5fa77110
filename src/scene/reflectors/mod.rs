//! Surfaces that send light on in single directions: mirrors, smooth glass and panes, and metal so smooth that it nearly
//! does. Through them light reaches surfaces on which light sampling alone would see nothing but a shadow.
//!
//! A *reflector* is a connected surface of that kind: a plane, or what is curved by the normals of its corners. Found
//! once, when the scene is built.

mod ball;
mod choice;
mod connected;
mod course;
mod find;
mod guess;
mod patch;
mod plane;
mod sides;
mod slab;
mod sphere;
mod target;

pub use ball::{Ball, Branch, Inside, Part};
pub use choice::Choice;
pub use connected::planes;
pub use course::Course;
pub use patch::Patch;
pub use plane::Plane;
pub use slab::Slab;
pub use sphere::Sphere;
pub use target::{Target, Targets};

use super::light_grid::LightGrid;
use crate::lanes::Vec3x8;
use glam::Vec3;

/// The reflectors of a scene.
#[derive(Debug, Default)]
pub struct Reflectors {
    /// That of each triangle, or [`NONE`]; empty where there is none at all.
    of_triangle: Vec<u32>,
    list: Vec<Reflector>,
    /// What encloses those that let light pass and do not focus it.
    passages: Vec<Bounds>,
    /// Planes that may show what others show: the first met and the second.
    pairs: Vec<[u32; 2]>,
    /// Balls of glass among them, the largest.
    balls: Vec<(u32, Ball)>,
    /// Slabs of glass.
    slabs: Vec<Slab>,
    /// Courses inside of them with more than one reflection.
    courses: Vec<Course>,
    /// How much of the light they reflect where there is much, in (0, 1].
    worth: f32,
    /// The choice among many.
    grid: Option<LightGrid>,
    /// What keeps all of them out of use, if anything does.
    hindrance: Option<String>,
}

/// A connected surface that sends light on in single directions, or nearly.
#[derive(Clone, Debug)]
pub struct Reflector {
    /// Index into [`Scene::materials`](super::Scene::materials).
    pub material: u32,
    /// The number of the first patch of its surface, its own where that is not cut up.
    pub surface: u32,
    /// How many triangles it has.
    pub triangles: u32,
    /// Its area.
    pub area: f32,
    /// Its form.
    pub form: Form,
    /// GGX roughness, of metal that is of class specular; 0 where directions are single ones.
    pub alpha: f32,
    /// Reflectance at normal incidence, the mean of the channels.
    reflectance: f32,
    /// Whether it reflects that everywhere, as metal does, not more at grazing angles.
    is_metal: bool,
    /// See [`Reflectors::focuses`].
    focuses: bool,
    /// Whether it is a plane of a body of glass to which light comes, inside, mostly through planes across it. These bend
    /// the way there, and it reflects all.
    is_across: bool,
    /// The courses inside slabs on which it is the only one that reflects.
    courses: Vec<Course>,
    bounds: Bounds,
}

/// The form of a reflector.
#[derive(Clone, Debug)]
pub enum Form {
    /// Flat: mirrored points are exact.
    Plane(Plane),
    /// Curved: a search begins at the best of some points.
    Curved(Curved),
}

/// Points on a curved reflector.
#[derive(Clone, Debug)]
pub struct Curved {
    /// Points spread over it, with the unit normals there, eight by eight.
    points: Vec<(Vec3x8, Vec3x8)>,
    /// The side on which alone it is seen, if it is one: 1 for that of the mesh's normals, -1 for the other.
    outside: Option<f32>,
    /// The sphere that it is, or a part of it, seen from outside.
    sphere: Option<Sphere>,
    /// What it may show, if it is no sphere: as a part of a surface, or all of it.
    patch: Option<Patch>,
}

type Bounds = (Vec3, Vec3);

/// By what a chain goes; with start and target it leaves at most one chain.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Through {
    /// Straight on: all that lies between vertex and target lets light pass and does not focus it.
    Passage,
    /// Reflections at these reflectors in this order; all else on the way lets light pass and does not focus it.
    Mirrors(Sequence),
    /// A reflection at this one, which is rough, by a microfacet with this local normal, unit, `z` > 0; all else as with
    /// mirrors.
    Microfacet(u32, Vec3),
    /// Into this ball of glass and out of it, reflected inside or not, on one of the ways that there may be.
    Ball(u32, Branch),
}

impl Through {
    /// The reflectors at which reflections are due, in this order.
    #[inline]
    pub fn mirrors(&self) -> Sequence {
        match *self {
            Through::Mirrors(by) => by,
            Through::Microfacet(reflector, _) => Sequence::of(reflector),
            Through::Passage | Through::Ball(..) => Sequence::NONE,
        }
    }

    /// The local normal of the microfacet that reflects.
    #[inline]
    pub fn microfacet(&self) -> Option<Vec3> {
        match *self {
            Through::Microfacet(_, normal) => Some(normal),
            Through::Passage | Through::Mirrors(_) | Through::Ball(..) => None,
        }
    }
}

/// Up to four reflectors, in the order in which a path from a rough vertex meets them.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Sequence {
    numbers: [u32; Self::MOST],
    len: u32,
}

impl Sequence {
    /// None at all.
    pub const NONE: Self = Self {
        numbers: [NONE; Self::MOST],
        len: 0,
    };

    /// A single one.
    #[inline]
    pub fn of(reflector: u32) -> Self {
        Self {
            numbers: [reflector, NONE, NONE, NONE],
            len: 1,
        }
    }

    /// With another behind it, unless it is full.
    #[inline]
    pub fn and(mut self, reflector: u32) -> Option<Self> {
        *self.numbers.get_mut(self.len as usize)? = reflector;
        self.len += 1;
        Some(self)
    }

    /// Their numbers.
    #[inline]
    pub fn numbers(&self) -> &[u32] {
        &self.numbers[..self.len as usize]
    }

    /// Most of a sequence.
    pub const MOST: usize = 4;
}

/// In place of the number of a reflector: none.
const NONE: u32 = u32::MAX;
/// From so many on the choice is by place.
const MANY: usize = 17;
/// Of so many, [`Reflectors::worth`].
const WORTH_OF_MANY: f32 = 0.25;
/// Most pairs of planes to choose from.
const PAIRS: usize = 15;
/// Most balls of glass through which walks go.
const BALLS: usize = 4;

impl Reflectors {
    /// Whether there are none.
    #[inline]
    pub fn is_empty(&self) -> bool {
        self.list.is_empty()
    }

    /// All of them.
    pub fn list(&self) -> &[Reflector] {
        &self.list
    }

    /// What keeps all of them out of use, if anything does.
    pub fn hindrance(&self) -> Option<&str> {
        self.hindrance.as_deref()
    }

    /// The reflector that a triangle belongs to.
    #[inline]
    pub fn of(&self, triangle: u32) -> Option<u32> {
        let reflector = self.of_triangle.get(triangle as usize).copied();
        reflector.filter(|&r| r != NONE)
    }

    /// Whether two reflectors are patches of one surface, or the same.
    #[inline]
    pub fn are_one(&self, a: u32, b: u32) -> bool {
        a == b || self.list[a as usize].surface == self.list[b as usize].surface
    }

    /// GGX roughness of a reflector, see [`Reflector::alpha`].
    #[inline]
    pub fn alpha(&self, reflector: u32) -> f32 {
        self.list[reflector as usize].alpha
    }

    /// Whether all of a sequence are planes.
    #[inline]
    pub fn are_flat(&self, by: &Sequence) -> bool {
        let is_flat = |&r: &u32| matches!(self.list[r as usize].form, Form::Plane(_));
        by.numbers().iter().all(is_flat)
    }

    /// Whether a reflector focuses what passes, as curved glass does: a thin pane does not, however curved.
    #[inline]
    pub fn focuses(&self, reflector: u32) -> bool {
        self.list[reflector as usize].focuses
    }

    /// The ball of glass that a reflector is, if walks go through it.
    #[inline]
    pub fn ball(&self, reflector: u32) -> Option<&Ball> {
        let mut balls = self.balls.iter();
        balls.find(|(r, _)| *r == reflector).map(|(_, ball)| ball)
    }

    /// The balls of glass through which walks go, with the numbers of the reflectors that they are.
    #[inline]
    pub fn balls(&self) -> &[(u32, Ball)] {
        &self.balls
    }

    /// So often it is worth a try to look for light in them, in (0, 1]: by how much they reflect where there is much;
    /// less often where there are many, each of which shows little.
    #[inline]
    pub fn worth(&self) -> f32 {
        match &self.grid {
            Some(_) => WORTH_OF_MANY,
            None => self.worth,
        }
    }

    /// Whether any lets light pass and does not focus it.
    #[inline]
    pub fn let_light_pass(&self) -> bool {
        !self.passages.is_empty()
    }

    /// Whether anything that lets light pass and does not focus it may lie between `from` and `target`.
    #[inline]
    pub fn may_pass(&self, from: Vec3, target: &Target) -> bool {
        let length = match *target {
            Target::Surface { .. } | Target::Point(_) => 1.0,
            Target::Direction(_) => f32::INFINITY,
        };
        let direction = target.towards(from);
        let mut boxes = self.passages.iter();
        boxes.any(|bounds| crosses(bounds, from, direction, length))
    }
}

/// Whether a ray over the distances from 0 to `length` meets a box.
#[inline]
fn crosses(&(low, high): &Bounds, from: Vec3, direction: Vec3, length: f32) -> bool {
    let inverse = direction.recip();
    let (a, b) = ((low - from) * inverse, (high - from) * inverse);
    let near = a.min(b).max_element().max(0.0);
    let far = a.max(b).min_element().min(length);
    // Comparisons with what is no number, on the box's own planes, leave nothing out.
    let misses = near > far;
    !misses
}
