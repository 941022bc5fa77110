//! Where a camera stands whose place the user leaves open: so that the scene fills the picture.

use super::camera::{Aim, Camera, Optics};
use super::mesh::Mesh;
use super::up_axis::{UpAxis, UpSource};
use crate::error::{Error, Result};
use crate::load::sidecar::{CameraTable, View};
use glam::{Quat, Vec3};
use rayon::prelude::*;

/// Degrees from top to bottom.
const FOV: f32 = 40.0;
/// The part of the picture, from its middle to its border, that the scene takes.
const FILL: f32 = 0.95;
/// Least distance along the view to the nearest vertex, in parts of the scene's diagonal: with a wide field of view a
/// corner alone would hold the camera.
const CLEARANCE: f32 = 0.05;

/// The side from which a scene is seen.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Side {
    /// Degrees from the front, counter-clockwise seen from above.
    pub azimuth: f32,
    /// Degrees above the horizon, from -90 to 90.
    pub elevation: f32,
}

impl Side {
    /// From the front and the right, and from above: what shows most of a thing of which nothing is known.
    pub const THREE_QUARTER: Side = Side {
        azimuth: 30.0,
        elevation: 20.0,
    };

    fn of_view(view: View) -> Self {
        let (azimuth, elevation) = match view {
            View::ThreeQuarter => return Self::THREE_QUARTER,
            View::Front => (0.0, 0.0),
            View::Back => (180.0, 0.0),
            View::Left => (-90.0, 0.0),
            View::Right => (90.0, 0.0),
            View::Top => (0.0, 90.0),
            View::Bottom => (0.0, -90.0),
            // As a room is seen from a corner: down a little.
            View::Inside => (30.0, 5.0),
        };
        Self { azimuth, elevation }
    }
}

/// What is left to choose of where the camera stands.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Open {
    /// Nothing: the user says it.
    Nothing,
    /// All of it.
    Everything,
    /// A place inside of the scene.
    Inside,
}

/// What the user says of the camera, and the rules for the rest.
#[derive(Clone, Debug)]
pub struct Framing {
    table: CameraTable,
    optics: Optics,
    /// Which way is up.
    pub up: UpAxis,
}

impl Framing {
    /// The rules for what `table` leaves open, for a picture of `size`.
    pub fn new(table: &CameraTable, size: (u32, u32), up: UpAxis) -> Result<Self> {
        let fail = |what: &str| Err(Error::Setting(format!("camera: {what}")));
        if table.origin.is_some() && table.has_side() {
            return fail(
                "an origin says from where the scene is seen, and so do view, azimuth and elevation: give one of them",
            );
        }
        if table.azimuth.is_some_and(|a| !a.is_finite()) {
            return fail("the azimuth must be finite");
        }
        if table
            .elevation
            .is_some_and(|e| !(-90.0..=90.0).contains(&e))
        {
            return fail("the elevation must be from -90 to 90 degrees");
        }
        let optics = Optics {
            size,
            fov: table.fov.unwrap_or(FOV),
            zoom: table.zoom.unwrap_or(1.0),
            aperture: table.aperture.unwrap_or(0.0),
            focus: table.focus,
        };
        Ok(Self {
            table: table.clone(),
            optics,
            up,
        })
    }

    /// What is left to choose.
    pub fn open(&self) -> Open {
        let table = &self.table;
        if table.view == Some(View::Inside) {
            Open::Inside
        } else if table.origin.is_some() || table.target.is_some() || table.has_side() {
            Open::Nothing
        } else {
            Open::Everything
        }
    }

    /// The camera that the user asks for; what is open is as usual.
    pub fn camera(&self, mesh: &Mesh) -> Result<Camera> {
        let centre = 0.5 * (mesh.bounds.0 + mesh.bounds.1);
        let target = self.table.target.map(Vec3::from);
        match (self.table.origin.map(Vec3::from), target) {
            (Some(origin), target) => {
                let ahead = (mesh.bounds.1 - mesh.bounds.0).length() * self.up.front();
                let centre = if origin == centre {
                    centre - ahead
                } else {
                    centre
                };
                self.placed(origin, target.unwrap_or(centre))
            }
            (None, Some(target)) => self.looking_at(mesh, target),
            (None, None) => self.seen_from(mesh, self.side(), 1),
        }
    }

    /// Degrees from the front that the user asks for, if so.
    pub fn azimuth(&self) -> Option<f32> {
        self.table.azimuth
    }

    /// Degrees above the horizon that the user asks for, if so.
    pub fn elevation(&self) -> Option<f32> {
        self.table.elevation
    }

    fn side(&self) -> Side {
        let side = self.table.view.map_or(Side::THREE_QUARTER, Side::of_view);
        Side {
            azimuth: self.table.azimuth.unwrap_or(side.azimuth),
            elevation: self.table.elevation.unwrap_or(side.elevation),
        }
    }

    /// The unit direction to who sees the scene from a side, and what is upwards in the picture.
    fn axes(&self, side: Side) -> (Vec3, Vec3) {
        let up = self.up.direction;
        let turn = Quat::from_axis_angle(up, side.azimuth.to_radians());
        let level = turn * self.up.front();
        let (sin, cos) = side.elevation.to_radians().sin_cos();
        (level * cos + up * sin, up * cos - level * sin)
    }

    fn placed(&self, origin: Vec3, target: Vec3) -> Result<Camera> {
        let vertical = self.up.direction;
        let forward = (target - origin).normalize_or_zero();
        let mut up = vertical;
        // Straight down or up, where nobody says what is upwards in the picture, it is what lies behind or in front.
        if self.up.source != UpSource::Given && forward.cross(up).length() < 1e-4 {
            up = self.up.front() * forward.dot(up);
        }
        let aim = Aim {
            origin,
            target,
            up,
            vertical,
        };
        Camera::new(&aim, &self.optics)
    }

    /// The camera at `origin` in the scene that looks along the unit vector `forward`, with a field of view of `fov`
    /// degrees if the user does not give one.
    pub fn standing_at(
        &self,
        mesh: &Mesh,
        origin: Vec3,
        forward: Vec3,
        fov: f32,
    ) -> Result<Camera> {
        let diagonal = (mesh.bounds.1 - mesh.bounds.0).length();
        // A camera that turns does so on the spot.
        let ahead = if self.table.all_around { 1e-3 } else { 0.25 };
        let aim = Aim {
            origin,
            target: origin + forward * (ahead * diagonal),
            up: self.up.direction,
            vertical: self.up.direction,
        };
        let optics = Optics {
            fov: self.table.fov.unwrap_or(fov),
            ..self.optics
        };
        Camera::new(&aim, &optics)
    }

    /// The camera that sees all of the scene from a side, as near as can be. Of many triangles, every `stride`th
    /// counts.
    pub fn seen_from(&self, mesh: &Mesh, side: Side, stride: usize) -> Result<Camera> {
        let (towards, up) = self.axes(side);
        let (forward, right) = (-towards, up.cross(towards));
        let centre = 0.5 * (mesh.bounds.0 + mesh.bounds.1);
        let tangents = self.tangents();
        let reach = self.reach(mesh, stride, centre, [right, up, forward], tangents);
        // The film's left and right border are planes through the camera at x = position · right and
        // z = position · forward. All is on their inner sides where x - tan z is at least the reach to the right,
        // and -x - tan z at least that to the left; likewise up and down.
        let back = |i: usize, tan: f32| -(reach[i] + reach[i + 1]) / (2.0 * tan);
        let z = back(0, tangents.0)
            .min(back(2, tangents.1))
            .min(-reach[4] - clearance(mesh));
        let (x, y) = (0.5 * (reach[0] - reach[1]), 0.5 * (reach[2] - reach[3]));
        let place = right * x + up * y + forward * z;
        let mut ahead = (-z).max(clearance(mesh));
        if self.table.all_around {
            // The target is on the axis about which the camera turns.
            let level = |v: Vec3| v.reject_from_normalized(self.up.direction);
            let (from, way) = (level(place), level(forward));
            if way.length() > 1e-3 {
                ahead = -from.dot(way) / way.length_squared();
            }
        }
        let origin = centre + place;
        let aim = Aim {
            origin,
            target: origin + forward * ahead,
            up,
            vertical: self.up.direction,
        };
        Camera::new(&aim, &self.optics)
    }

    /// The camera that sees all of the scene with `target` in the middle.
    fn looking_at(&self, mesh: &Mesh, target: Vec3) -> Result<Camera> {
        let (towards, up) = self.axes(self.side());
        let axes = [up.cross(towards), up, -towards];
        let tangents = self.tangents();
        let reach = self.reach(mesh, 1, target, axes, tangents);
        let across = reach[0].max(reach[1]) / tangents.0;
        let back = across.max(reach[2].max(reach[3]) / tangents.1);
        let back = back.max(reach[4] + clearance(mesh));
        let aim = Aim {
            origin: target + towards * back.max(clearance(mesh)),
            target,
            up,
            vertical: self.up.direction,
        };
        Camera::new(&aim, &self.optics)
    }

    /// What the user is told of a camera: what gives it again, and why it stands where it does.
    pub fn describe(&self, camera: &Camera) -> String {
        let list = |v: Vec3| v.to_array().map(rounded).join(",");
        let (origin, target) = (list(camera.origin), list(camera.target()));
        let axis = match self.up.direction.to_array() {
            [0.0, 1.0, 0.0] => "y".to_owned(),
            [0.0, 0.0, 1.0] => "z".to_owned(),
            _ => list(self.up.direction),
        };
        let why = match self.up.source {
            UpSource::Given => "",
            UpSource::Shape if self.up.is_z() => " (by the shape of the scene; else --up y)",
            UpSource::Shape => " (by the shape of the scene)",
            UpSource::Custom => " (as usual; else --up z)",
        };
        let seen = if self.table.origin.is_some() || self.table.target.is_some() {
            format!("camera at {origin}, towards {target}")
        } else {
            let side = self.side_of(camera);
            let [azimuth, elevation] = [side.azimuth, side.elevation].map(rounded);
            format!("camera at {origin}, azimuth {azimuth}, elevation {elevation}")
        };
        format!(
            "{seen}, field of view {}, up {axis}{why}",
            rounded(camera.fov())
        )
    }

    /// From which side a camera looks.
    pub fn side_of(&self, camera: &Camera) -> Side {
        let (front, up) = (self.up.front(), self.up.direction);
        let towards = (camera.origin - camera.target()).normalize();
        Side {
            azimuth: towards
                .dot(up.cross(front))
                .atan2(towards.dot(front))
                .to_degrees(),
            elevation: towards.dot(up).clamp(-1.0, 1.0).asin().to_degrees(),
        }
    }

    /// Tangents of half the angles that the scene is to fill.
    fn tangents(&self) -> (f32, f32) {
        let (x, y) = self.optics.tangents();
        (FILL * x, FILL * y)
    }

    /// How far the scene reaches beyond `origin` towards the outer sides of planes whose normals are right - tan
    /// forward, -right - tan forward, up - tan forward, -up - tan forward and -forward. With `all_around` the scene is all places
    /// where it is while it turns about the vertical axis through `origin`.
    fn reach(
        &self,
        mesh: &Mesh,
        stride: usize,
        origin: Vec3,
        [right, up, forward]: [Vec3; 3],
        (across, down): (f32, f32),
    ) -> [f32; 5] {
        let normals = [
            right - across * forward,
            -right - across * forward,
            up - down * forward,
            -up - down * forward,
            -forward,
        ];
        let vertical = self.up.direction;
        let turned =
            normals.map(|n| (n.dot(vertical), n.reject_from_normalized(vertical).length()));
        let all_around = self.table.all_around;
        let of_point = |p: Vec3| {
            let p = p - origin;
            if all_around {
                let height = p.dot(vertical);
                let radius = (p - height * vertical).length();
                turned.map(|(along, beside)| along * height + beside * radius)
            } else {
                normals.map(|n| n.dot(p))
            }
        };
        let larger = |mut a: [f32; 5], b: [f32; 5]| {
            a.iter_mut().zip(b).for_each(|(a, b)| *a = a.max(b));
            a
        };
        let none = [f32::NEG_INFINITY; 5];
        mesh.triangles
            .par_chunks(1 << 16)
            .map(|triangles| {
                let corners = triangles.iter().step_by(stride).flatten();
                let points = corners.map(|&c| of_point(mesh.positions[c as usize]));
                points.fold(none, larger)
            })
            .reduce(|| none, larger)
    }
}

/// Least distance along the view to the nearest vertex.
fn clearance(mesh: &Mesh) -> f32 {
    CLEARANCE * (mesh.bounds.1 - mesh.bounds.0).length()
}

/// With four digits.
fn rounded(value: f32) -> String {
    let digits = 3 - (value.abs().max(1e-3).log10().floor() as i32).min(3);
    let scale = 10f64.powi(digits);
    let value = (f64::from(value) * scale).round() / scale;
    // No minus before 0.
    (value + 0.0).to_string()
}
