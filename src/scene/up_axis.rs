//! Which way is up in a file that does not say: OBJ files have y upwards by custom, but those of CAD, GIS
//! and 3ds Max often z.
//!
//! The geometry decides between the two where it is plain: by what the scene would stand on, where its level
//! faces lie, where it is open, where its floors and ceilings are by name, and whereto its lamps shine. Each
//! is a number from 0 to 1 for an axis; z is taken if their weighted sum is larger for z by `PLAIN`. The
//! weights were chosen on 65 scenes, each with y and with z upwards.

use super::material::Material;
use super::mesh::Mesh;
use crate::error::{Error, Result};
use crate::load::sidecar::{CameraTable, Up};
use glam::{Vec2, Vec3};
use rayon::prelude::*;

/// The direction that is upwards, and why.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct UpAxis {
    /// Unit.
    pub direction: Vec3,
    /// Who says so.
    pub source: UpSource,
}

/// Who says which way is up.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum UpSource {
    /// The user.
    Given,
    /// The shape of the scene.
    Shape,
    /// Nobody: it is y by custom.
    Custom,
}

/// By how much more must speak for z than for y.
const PLAIN: f32 = 0.25;
/// A scene this thin, in parts of its largest extent, is a single sheet.
const SHEET: f32 = 1e-3;
/// The part of the extent in which things touch the ground.
const CONTACT: f32 = 0.01;
/// Least cosine to the axis of level faces.
const LEVEL: f32 = 0.996;
/// Where the surface as a whole faces one way this much, it is a terrain or has a ground, and what stands on
/// its rim is no support.
const GROUND: f32 = 0.6;

impl UpAxis {
    /// The direction that the user gives, or that the geometry has. A camera with an origin of its own has y.
    pub fn new(table: &CameraTable, mesh: &Mesh, materials: &[Material]) -> Result<Self> {
        match table.up {
            Some(Up::Along(vector)) => {
                let direction = Vec3::from(vector).try_normalize();
                let direction = direction.filter(|d| d.is_finite()).ok_or_else(|| {
                    Error::Setting(format!("camera: up {vector:?} must be finite and not zero"))
                })?;
                Ok(Self {
                    direction,
                    source: UpSource::Given,
                })
            }
            None if table.origin.is_some() => Ok(Self::CUSTOM),
            _ => Ok(Self::of_shape(mesh, materials)),
        }
    }

    const CUSTOM: Self = Self {
        direction: Vec3::Y,
        source: UpSource::Custom,
    };

    /// As the geometry has it.
    fn of_shape(mesh: &Mesh, materials: &[Material]) -> Self {
        let evidence = evidence(mesh, materials);
        if evidence.abs() <= PLAIN {
            return Self::CUSTOM;
        }
        Self {
            direction: if evidence > 0.0 { Vec3::Z } else { Vec3::Y },
            source: UpSource::Shape,
        }
    }

    /// Whether it is along z rather than y.
    pub fn is_z(&self) -> bool {
        let d = self.direction.abs();
        d.z > d.x.max(d.y)
    }

    /// The horizontal direction from a scene to who sees it from the front, unit. With z upwards that is -y, as
    /// in modelling programs, else z.
    pub fn front(&self) -> Vec3 {
        let d = self.direction.abs();
        let towards = if d.z == d.max_element() {
            Vec3::NEG_Y
        } else {
            Vec3::Z
        };
        towards.reject_from_normalized(self.direction).normalize()
    }
}

/// What speaks for an axis.
#[derive(Clone, Copy, Debug, Default)]
struct Case {
    /// How much of its footprint the scene stands on, if it stands.
    support: f32,
    /// How much better it stands than it would upside down.
    steady: f32,
    /// Which part of the surface, taken together, faces up: grounds, terrains, bodies that are open below.
    open: f32,
    /// Level faces between bottom and top.
    level: f32,
    /// How far the surface is unevenly spread along the axis.
    uneven: f32,
    /// Level faces of what is called a floor or a ceiling.
    named: f32,
    /// The part of the lamps that shine down from above.
    lamps: f32,
}

/// What speaks for z and against y; 0 where nothing does.
fn evidence(mesh: &Mesh, materials: &[Material]) -> f32 {
    let extent = mesh.bounds.1 - mesh.bounds.0;
    if !extent.is_finite() || extent.z < SHEET * extent.max_element() {
        return 0.0;
    }
    let kinds: Vec<Kind> = materials.iter().map(Kind::of).collect();
    let sums = sums(mesh, &kinds);
    let [y, z] = [1, 2].map(|axis| sums.case(mesh, axis));
    let on_ground = y.open.max(z.open) > GROUND;
    let standing = if on_ground {
        0.0
    } else {
        z.support - y.support + 0.2 * (z.steady - y.steady)
    };
    standing
        + 0.75 * (z.open - y.open)
        + (z.level - y.level).clamp(-0.25, 0.25)
        + 0.4 * (z.uneven - y.uneven)
        + 0.5 * (z.named - y.named)
        + 0.5 * (z.lamps - y.lamps)
}

/// What a material says of where its faces are.
#[derive(Clone, Copy)]
struct Kind {
    /// Whether it is a floor or a ceiling.
    level: bool,
    /// Power of a lamp per area.
    power: f32,
}

impl Kind {
    fn of(material: &Material) -> Self {
        let name = material.name.to_lowercase();
        let mut words = name.split(|c: char| !c.is_alphabetic());
        let level = words.any(|w| {
            ["floor", "ceiling"]
                .iter()
                .any(|l| w.starts_with(l) || w.ends_with(l))
                || ["ground", "terrain", "grass", "lawn", "road", "street"].contains(&w)
        });
        Self {
            level,
            power: material.emission.map_or(0.0, |e| e.element_sum()),
        }
    }
}

/// Sums over the triangles for one axis, y or z.
#[derive(Clone, Copy, Debug)]
struct AxisSums {
    /// Area of level faces between bottom and top.
    level: f64,
    /// Area of level faces that are called so.
    named: f64,
    /// Power of lamps that shine down from above.
    lamps: f64,
    /// What touches the ground, and what would upside down.
    contacts: [Outline; 2],
}

#[derive(Clone, Copy, Debug)]
struct Sums {
    area: f64,
    /// Area times normal.
    flux: glam::DVec3,
    /// Area times middle.
    moment: glam::DVec3,
    named: f64,
    power: f64,
    axes: [AxisSums; 2],
}

/// The points of a set that are outermost in 32 directions: its convex hull, or nearly.
#[derive(Clone, Copy, Debug)]
struct Outline {
    reach: [f32; Self::DIRECTIONS],
    points: [Vec2; Self::DIRECTIONS],
}

impl Outline {
    const DIRECTIONS: usize = 32;
    const EMPTY: Self = Self {
        reach: [f32::NEG_INFINITY; Self::DIRECTIONS],
        points: [Vec2::ZERO; Self::DIRECTIONS],
    };

    fn direction(index: usize) -> Vec2 {
        Vec2::from_angle(std::f32::consts::TAU * index as f32 / Self::DIRECTIONS as f32)
    }

    fn add(&mut self, point: Vec2, directions: &[Vec2; Self::DIRECTIONS]) {
        for (index, direction) in directions.iter().enumerate() {
            let reach = direction.dot(point);
            if reach > self.reach[index] {
                (self.reach[index], self.points[index]) = (reach, point);
            }
        }
    }

    fn merge(&mut self, other: &Self) {
        for index in 0..Self::DIRECTIONS {
            if other.reach[index] > self.reach[index] {
                self.reach[index] = other.reach[index];
                self.points[index] = other.points[index];
            }
        }
    }

    /// How well a body stands on it whose middle is over `middle`: the cubic root of its part of the
    /// footprint's area; 0 if the body falls over.
    fn support(&self, middle: Vec2, footprint: f32) -> f32 {
        if self.reach[0] == f32::NEG_INFINITY {
            return 0.0;
        }
        let (mut area, mut stands) = (0.0, true);
        for (index, &a) in self.points.iter().enumerate() {
            let b = self.points[(index + 1) % Self::DIRECTIONS];
            let side = (b - a).perp_dot(middle - a);
            area += 0.5 * (a - middle).perp_dot(b - middle);
            stands &= side >= 0.0;
        }
        let share = area / footprint;
        if stands && share > 0.0 {
            share.min(1.0).cbrt()
        } else {
            0.0
        }
    }
}

impl Sums {
    const EMPTY: Self = Self {
        area: 0.0,
        flux: glam::DVec3::ZERO,
        moment: glam::DVec3::ZERO,
        named: 0.0,
        power: 0.0,
        axes: [AxisSums {
            level: 0.0,
            named: 0.0,
            lamps: 0.0,
            contacts: [Outline::EMPTY; 2],
        }; 2],
    };

    fn merge(&mut self, other: &Self) {
        self.area += other.area;
        self.flux += other.flux;
        self.moment += other.moment;
        self.named += other.named;
        self.power += other.power;
        for (to, from) in self.axes.iter_mut().zip(&other.axes) {
            to.level += from.level;
            to.named += from.named;
            to.lamps += from.lamps;
            for (to, from) in to.contacts.iter_mut().zip(&from.contacts) {
                to.merge(from);
            }
        }
    }

    /// What speaks for an axis, 1 for y or 2 for z.
    fn case(&self, mesh: &Mesh, axis: usize) -> Case {
        let sums = &self.axes[axis - 1];
        let extent = mesh.bounds.1 - mesh.bounds.0;
        let flat = across(extent, axis);
        let footprint = flat.x * flat.y;
        // The middle as seen from that of the bounds.
        let middle = (self.moment / self.area).as_vec3();
        let [support, upside_down] =
            [0, 1].map(|i| sums.contacts[i].support(across(middle, axis), footprint));
        let share = |part: f64, whole: f64| {
            if whole > 0.0 {
                (part / whole) as f32
            } else {
                0.0
            }
        };
        // Of a thin body, the faces across are its front and back rather than shelves.
        let thickness = (1.7 * extent[axis] / extent.max_element()).min(1.0);
        Case {
            support,
            steady: (support - upside_down).max(0.0),
            open: share(self.flux[axis], self.area).max(0.0),
            level: share(sums.level, self.area) * thickness * thickness,
            uneven: (middle[axis] / extent[axis]).abs(),
            named: share(sums.named, self.named),
            lamps: share(sums.lamps, self.power),
        }
    }
}

/// The two coordinates beside `axis`, in the order that keeps turns counter-clockwise.
fn across(v: Vec3, axis: usize) -> Vec2 {
    Vec2::new(v[(axis + 1) % 3], v[(axis + 2) % 3])
}

/// One pass over the triangles, the same for any number of threads.
fn sums(mesh: &Mesh, kinds: &[Kind]) -> Sums {
    let directions = std::array::from_fn(Outline::direction);
    let parts: Vec<Sums> = mesh
        .triangles
        .par_chunks(1 << 16)
        .zip(mesh.material_of.par_chunks(1 << 16))
        .map(|(triangles, material_of)| {
            let mut sums = Sums::EMPTY;
            for (corners, &material) in triangles.iter().zip(material_of) {
                let corners = corners.map(|c| mesh.positions[c as usize]);
                sums.add(mesh, corners, kinds[material as usize], &directions);
            }
            sums
        })
        .collect();
    let mut all = Sums::EMPTY;
    parts.iter().for_each(|part| all.merge(part));
    all
}

impl Sums {
    fn add(
        &mut self,
        mesh: &Mesh,
        corners: [Vec3; 3],
        kind: Kind,
        directions: &[Vec2; Outline::DIRECTIONS],
    ) {
        let (low, high) = mesh.bounds;
        let centre = 0.5 * (low + high);
        let [a, b, c] = corners.map(|p| p - centre);
        let doubled = (b - a).cross(c - a);
        let length = doubled.length();
        if !(length > 0.0 && length.is_finite()) {
            return;
        }
        let normal = doubled / length;
        let area = f64::from(0.5 * length);
        let middle = (a + b + c) / 3.0;
        self.area += area;
        self.flux += area * normal.as_dvec3();
        self.moment += area * middle.as_dvec3();
        let named = if kind.level { area } else { 0.0 };
        let power = area * f64::from(kind.power);
        self.named += named;
        self.power += power;
        for (sums, axis) in self.axes.iter_mut().zip([1, 2]) {
            let half = 0.5 * (high - low)[axis];
            let height = middle[axis];
            if normal[axis].abs() > LEVEL {
                if height.abs() < (1.0 - 4.0 * CONTACT) * half {
                    sums.level += area;
                }
                sums.named += named;
            }
            if normal[axis] < -0.9 && height > 0.2 * half {
                sums.lamps += power;
            }
            let contact = (1.0 - 2.0 * CONTACT) * half;
            for p in [a, b, c] {
                if p[axis] <= -contact {
                    sums.contacts[0].add(across(p, axis), directions);
                }
                if p[axis] >= contact {
                    sums.contacts[1].add(across(p, axis), directions);
                }
            }
        }
    }
}
