//! The camera: a pinhole, or a thin lens.

use crate::error::{Error, Result};
use crate::lanes::Vec3x8;
use crate::load::sidecar::CameraTable;
use crate::warp;
use glam::{Quat, Vec2, Vec3};
use wide::f32x8;

/// A camera and the size of its film.
#[derive(Clone, Debug, PartialEq)]
pub struct Camera {
    /// Pixels across.
    pub width: u32,
    /// Pixels down.
    pub height: u32,
    /// Position of the pinhole, or of the middle of the lens.
    pub origin: Vec3,
    /// The lens, if it is not a pinhole.
    pub lens: Option<Lens>,
    /// The point in the middle of the picture.
    target: Vec3,
    /// Upwards, unit.
    up: Vec3,
    /// Direction to the upper left corner of the film, at unit distance along the view.
    corner: Vec3,
    /// Step of one pixel to the right and one down.
    step: (Vec3, Vec3),
}

/// A thin lens.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Lens {
    radius: f32,
    /// Distance along the view of the plane in focus.
    focus: f32,
}

const DEFAULT_FOV: f32 = 40.0;

/// Whether an upward direction is along z rather than y.
pub(super) fn is_z_up(up: Option<[f32; 3]>) -> bool {
    up.is_some_and(|[x, y, z]| z.abs() > x.abs().max(y.abs()))
}

/// From where a scene is seen of which nothing is known: from the front, a little from the right and from
/// above. With z upwards the front is towards -y, as in modelling programs.
fn default_side(up: Vec3) -> Vec3 {
    let (right, above, front) = (0.35, 0.25, 1.0);
    let largest = up.abs().max_element();
    if up.abs().z == largest {
        Vec3::new(right, -front, above * up.z.signum())
    } else if up.abs().y == largest {
        Vec3::new(right, above * up.y.signum(), front)
    } else {
        Vec3::new(above * up.x.signum(), -right, front)
    }
}

impl Camera {
    /// The camera of `table`; what it leaves open is framed so that `bounds` fill the picture, seen
    /// from the front, a little from the right and from above.
    pub fn new(
        table: &CameraTable,
        (width, height): (u32, u32),
        bounds: (Vec3, Vec3),
    ) -> Result<Self> {
        let fail = |what: String| Err(Error::Setting(format!("camera: {what}")));
        let fov = table.fov.unwrap_or(DEFAULT_FOV);
        if !(fov > 0.0 && fov < 180.0) {
            return fail(format!(
                "the field of view must be between 0 and 180 degrees, got {fov}"
            ));
        }
        let centre = 0.5 * (bounds.0 + bounds.1);
        let radius = 0.5 * (bounds.1 - bounds.0).length();
        let tan = (0.5 * fov).to_radians().tan();
        let aspect = width as f32 / height as f32;
        let up = table.up.map_or(Vec3::Y, Vec3::from);
        let target = table.target.map_or(centre, Vec3::from);
        let origin = table.origin.map_or_else(
            || {
                let narrow = (tan * aspect.min(1.0)).atan();
                target + default_side(up).normalize() * (radius / narrow.sin())
            },
            Vec3::from,
        );
        let forward = (target - origin).try_normalize();
        let Some(forward) = forward.filter(|f| f.is_finite() && origin.is_finite()) else {
            return fail(format!(
                "origin {origin} and target {target} must be finite and apart"
            ));
        };
        let Some(right) = forward.cross(up).try_normalize().filter(|r| r.is_finite()) else {
            return fail(format!("up {up} must be finite and not along the view"));
        };
        let down = forward.cross(right);
        let size = 2.0 * tan / height as f32;
        let corner = forward - right * (tan * aspect) - down * tan;
        let aperture = table.aperture.unwrap_or(0.0);
        let focus = table
            .focus
            .unwrap_or_else(|| (target - origin).dot(forward));
        if !(aperture.is_finite() && aperture >= 0.0 && focus.is_finite() && focus > 0.0) {
            return fail(format!(
                "the aperture {aperture} must be finite and not negative, the focus {focus} above 0"
            ));
        }
        Ok(Self {
            width,
            height,
            origin,
            lens: (aperture > 0.0).then_some(Lens {
                radius: 0.5 * aperture,
                focus,
            }),
            target,
            up: up.normalize(),
            corner,
            step: (right * size, down * size),
        })
    }

    /// The unit direction through the film at (`x`, `y`) in pixels from the upper left corner; the
    /// middle of the first pixel is (0.5, 0.5). Positions outside of the film are fine.
    #[inline]
    pub fn direction(&self, x: f32, y: f32) -> Vec3 {
        (self.corner + self.step.0 * x + self.step.1 * y).normalize()
    }

    /// [`Camera::direction`] in lanes.
    #[inline(always)]
    pub fn directions(&self, x: f32x8, y: f32) -> Vec3x8 {
        let of = Vec3x8::splat;
        let d = of(self.corner) + of(self.step.0) * x + of(self.step.1 * y);
        d * d.length_recip()
    }

    /// The ray's origin and unit direction through the film at (`x`, `y`) and through the point of the
    /// lens that belongs to `u` in [0, 1)².
    pub fn through_lens(&self, lens: &Lens, x: f32, y: f32, u: [f32; 2]) -> (Vec3, Vec3) {
        let p = Vec2::from(warp::disk(u)) * lens.radius;
        let (right, down) = (self.step.0.normalize(), self.step.1.normalize());
        let at = right * p.x + down * p.y;
        // The corner is at unit distance along the view.
        let in_focus = (self.corner + self.step.0 * x + self.step.1 * y) * lens.focus;
        (self.origin + at, (in_focus - at).normalize())
    }

    /// The camera turned about the vertical axis through its target by `angle`, counter-clockwise seen
    /// from above.
    pub fn turned(&self, angle: f32) -> Self {
        let turn = Quat::from_axis_angle(self.up, angle);
        Self {
            origin: self.target + turn * (self.origin - self.target),
            corner: turn * self.corner,
            step: (turn * self.step.0, turn * self.step.1),
            ..self.clone()
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn rays_pass_where_they_should() {
        let table = CameraTable {
            origin: Some([0.0, 1.0, 4.0]),
            target: Some([0.0, 1.0, 0.0]),
            fov: Some(90.0),
            ..Default::default()
        };
        let c = Camera::new(&table, (200, 100), (Vec3::ZERO, Vec3::ONE)).unwrap();
        let close = |d: Vec3, want: Vec3| assert!((d - want.normalize()).length() < 1e-6, "{d}");
        close(c.direction(100.0, 50.0), Vec3::NEG_Z);
        close(c.direction(100.0, 0.0), Vec3::new(0.0, 1.0, -1.0));
        close(c.direction(200.0, 50.0), Vec3::new(2.0, 0.0, -1.0));
    }

    #[test]
    fn automatic_framing_sees_the_whole_scene() {
        let bounds = (Vec3::new(-3.0, 10.0, 2.0), Vec3::new(5.0, 11.0, 4.0));
        for size in [(100, 100), (300, 100), (100, 300)] {
            let c = Camera::new(&CameraTable::default(), size, bounds).unwrap();
            let right = c.step.0.normalize();
            let down = c.step.1.normalize();
            let forward = right.cross(down);
            for corner in 0..8 {
                let pick = |i: usize, lo: f32, hi: f32| if corner >> i & 1 == 0 { lo } else { hi };
                let p = Vec3::new(
                    pick(0, bounds.0.x, bounds.1.x),
                    pick(1, bounds.0.y, bounds.1.y),
                    pick(2, bounds.0.z, bounds.1.z),
                );
                let v = p - c.origin;
                let v = v / v.dot(forward) - c.corner;
                let x = v.dot(right) / c.step.0.length();
                let y = v.dot(down) / c.step.1.length();
                assert!(
                    x > 0.0 && x < size.0 as f32 && y > 0.0 && y < size.1 as f32,
                    "{p}"
                );
            }
        }
    }

    #[test]
    fn rays_through_the_lens_meet_in_the_plane_of_focus() {
        let table = CameraTable {
            origin: Some([0.0, 1.0, 4.0]),
            target: Some([0.0, 1.0, 0.0]),
            fov: Some(60.0),
            aperture: Some(0.5),
            focus: Some(3.0),
            ..Default::default()
        };
        let c = Camera::new(&table, (200, 100), (Vec3::ZERO, Vec3::ONE)).unwrap();
        let sharp = |u| {
            let (origin, direction) = c.through_lens(&c.lens.unwrap(), 37.0, 81.0, u);
            assert!((origin - c.origin).length() <= 0.2501);
            origin + direction * ((1.0 - origin.z) / direction.z)
        };
        let middle = c.origin + c.direction(37.0, 81.0) * (-3.0 / c.direction(37.0, 81.0).z);
        for u in [[0.0, 0.0], [0.9, 0.3], [0.2, 0.99]] {
            assert!((sharp(u) - middle).length() < 1e-5);
        }
    }

    #[test]
    fn a_turned_camera_sees_its_target_from_another_side() {
        let table = CameraTable {
            origin: Some([0.0, 1.0, 4.0]),
            target: Some([0.0, 1.0, 1.0]),
            ..Default::default()
        };
        let c = Camera::new(&table, (100, 100), (Vec3::ZERO, Vec3::ONE)).unwrap();
        let quarter = c.turned(std::f32::consts::FRAC_PI_2);
        assert!((quarter.origin - Vec3::new(3.0, 1.0, 1.0)).length() < 1e-5);
        assert!((quarter.direction(50.0, 50.0) - Vec3::NEG_X).length() < 1e-5);
        assert!((quarter.direction(50.0, 0.0).y - c.direction(50.0, 0.0).y).abs() < 1e-5);
    }

    #[test]
    fn scenes_with_z_upwards_stand_upright() {
        let table = CameraTable {
            up: Some([0.0, 0.0, 1.0]),
            ..Default::default()
        };
        let c = Camera::new(&table, (100, 100), (-Vec3::ONE, Vec3::ONE)).unwrap();
        assert!(c.origin.z > 0.0 && c.origin.y < -1.0);
        assert!(c.direction(50.0, 0.0).z > c.direction(50.0, 100.0).z);
    }

    #[test]
    fn impossible_cameras_are_refused() {
        let bounds = (Vec3::ZERO, Vec3::ONE);
        let same = CameraTable {
            origin: Some([1.0; 3]),
            target: Some([1.0; 3]),
            ..Default::default()
        };
        let along = CameraTable {
            origin: Some([0.0, 5.0, 0.0]),
            target: Some([0.0; 3]),
            ..Default::default()
        };
        let wide = CameraTable {
            fov: Some(180.0),
            ..Default::default()
        };
        let no_focus = CameraTable {
            aperture: Some(1.0),
            focus: Some(0.0),
            ..Default::default()
        };
        for table in [same, along, wide, no_focus] {
            assert!(Camera::new(&table, (10, 10), bounds).is_err());
        }
    }
}
