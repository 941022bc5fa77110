//! The camera: a pinhole, or a thin lens.

use crate::error::{Error, Result};
use crate::lanes::Vec3x8;
use crate::warp;
use glam::{Quat, Vec2, Vec3};
use serde::Serialize;
use wide::f32x8;

/// A camera and the size of its film.
#[derive(Clone, Debug, PartialEq, Serialize)]
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
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct Lens {
    radius: f32,
    /// Distance along the view of the plane in focus.
    focus: f32,
}

/// Where a camera stands and where it looks.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Aim {
    /// Position of the pinhole.
    pub origin: Vec3,
    /// The point in the middle of the picture.
    pub target: Vec3,
    /// Upwards in the picture; any length.
    pub up: Vec3,
    /// The vertical axis about which the camera turns, unit.
    pub vertical: Vec3,
}

/// What a camera sees at once, and how sharply.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Optics {
    /// Pixels across and down.
    pub size: (u32, u32),
    /// Vertical field of view in degrees.
    pub fov: f32,
    /// How many times larger things are in the picture than the field of view has them.
    pub zoom: f32,
    /// Diameter of the lens; 0 has everything in focus.
    pub aperture: f32,
    /// Distance along the view of the plane in focus; the target's if absent.
    pub focus: Option<f32>,
}

impl Optics {
    /// Tangents of half the angles across and down, without zoom.
    pub fn tangents(&self) -> (f32, f32) {
        let tan = (0.5 * self.fov).to_radians().tan();
        (tan * self.size.0 as f32 / self.size.1 as f32, tan)
    }
}

impl Camera {
    /// The camera that stands and looks as `aim` says.
    pub fn new(aim: &Aim, optics: &Optics) -> Result<Self> {
        let fail = |what: String| Err(Error::Setting(format!("camera: {what}")));
        let &Aim {
            origin, target, up, ..
        } = aim;
        let (width, height) = optics.size;
        if !(optics.fov > 0.0 && optics.fov < 180.0) {
            return fail(format!(
                "the field of view must be between 0 and 180 degrees, got {}",
                optics.fov
            ));
        }
        if !(optics.zoom > 0.0 && optics.zoom.is_finite()) {
            return fail(format!("the zoom must be above 0, got {}", optics.zoom));
        }
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
        let tan = (0.5 * optics.fov).to_radians().tan() / optics.zoom;
        let aspect = width as f32 / height as f32;
        let size = 2.0 * tan / height as f32;
        let corner = forward - right * (tan * aspect) - down * tan;
        let aperture = optics.aperture;
        let focus = optics
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
            up: aim.vertical,
            corner,
            step: (right * size, down * size),
        })
    }

    /// The point in the middle of the picture.
    pub fn target(&self) -> Vec3 {
        self.target
    }

    /// The vertical axis of the scene, unit.
    pub fn up(&self) -> Vec3 {
        self.up
    }

    /// To the right in the picture, unit.
    pub fn right(&self) -> Vec3 {
        self.step.0.normalize()
    }

    /// Vertical field of view in degrees, with the zoom.
    pub fn fov(&self) -> f32 {
        let tan = 0.5 * self.step.1.length() * self.height as f32;
        2.0 * tan.atan().to_degrees()
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

    /// The same camera with other pixels, which fill the same film.
    pub fn at_size(&self, width: u32, height: u32) -> Self {
        let step = |step: Vec3, from: u32, to: u32| step * (from as f32 / to as f32);
        Self {
            width,
            height,
            step: (
                step(self.step.0, self.width, width),
                step(self.step.1, self.height, height),
            ),
            ..self.clone()
        }
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

    const OPTICS: Optics = Optics {
        size: (200, 100),
        fov: 90.0,
        zoom: 1.0,
        aperture: 0.0,
        focus: None,
    };

    fn aim(origin: [f32; 3], target: [f32; 3]) -> Aim {
        Aim {
            origin: origin.into(),
            target: target.into(),
            up: Vec3::Y,
            vertical: Vec3::Y,
        }
    }

    #[test]
    fn rays_pass_where_they_should() {
        let c = Camera::new(&aim([0.0, 1.0, 4.0], [0.0, 1.0, 0.0]), &OPTICS).unwrap();
        let close = |d: Vec3, want: Vec3| assert!((d - want.normalize()).length() < 1e-6, "{d}");
        close(c.direction(100.0, 50.0), Vec3::NEG_Z);
        close(c.direction(100.0, 0.0), Vec3::new(0.0, 1.0, -1.0));
        close(c.direction(200.0, 50.0), Vec3::new(2.0, 0.0, -1.0));
        assert!((c.fov() - 90.0).abs() < 1e-4);
        // Twice as large.
        let optics = Optics {
            zoom: 2.0,
            ..OPTICS
        };
        let c = Camera::new(&aim([0.0, 1.0, 4.0], [0.0, 1.0, 0.0]), &optics).unwrap();
        close(c.direction(100.0, 0.0), Vec3::new(0.0, 0.5, -1.0));
    }

    #[test]
    fn rays_through_the_lens_meet_in_the_plane_of_focus() {
        let optics = Optics {
            fov: 60.0,
            aperture: 0.5,
            focus: Some(3.0),
            ..OPTICS
        };
        let c = Camera::new(&aim([0.0, 1.0, 4.0], [0.0, 1.0, 0.0]), &optics).unwrap();
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
        let c = Camera::new(&aim([0.0, 1.0, 4.0], [0.0, 1.0, 1.0]), &OPTICS).unwrap();
        let quarter = c.turned(std::f32::consts::FRAC_PI_2);
        assert!((quarter.origin - Vec3::new(3.0, 1.0, 1.0)).length() < 1e-5);
        assert!((quarter.direction(100.0, 50.0) - Vec3::NEG_X).length() < 1e-5);
        assert!((quarter.direction(100.0, 0.0).y - c.direction(100.0, 0.0).y).abs() < 1e-5);
    }

    #[test]
    fn impossible_cameras_are_refused() {
        let (origin, target) = ([0.0, 1.0, 4.0], [0.0, 1.0, 0.0]);
        let refused = |aim: Aim, optics: Optics| Camera::new(&aim, &optics).is_err();
        assert!(!refused(aim(origin, target), OPTICS));
        assert!(refused(aim(origin, origin), OPTICS));
        assert!(refused(aim([0.0, 5.0, 0.0], [0.0; 3]), OPTICS));
        assert!(refused(aim([f32::NAN, 5.0, 0.0], [0.0; 3]), OPTICS));
        for fov in [0.0, 180.0, -3.0, f32::NAN] {
            assert!(refused(aim(origin, target), Optics { fov, ..OPTICS }));
        }
        for zoom in [0.0, -1.0, f32::INFINITY, f32::NAN] {
            assert!(refused(aim(origin, target), Optics { zoom, ..OPTICS }));
        }
        let no_focus = Optics {
            aperture: 1.0,
            focus: Some(0.0),
            ..OPTICS
        };
        assert!(refused(aim(origin, target), no_focus));
    }
}
