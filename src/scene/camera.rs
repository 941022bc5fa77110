//! The pinhole camera.

use crate::error::{Error, Result};
use crate::load::sidecar::CameraTable;
use glam::Vec3;

/// A pinhole camera and the size of its film.
#[derive(Clone, Debug, PartialEq)]
pub struct Camera {
    /// Pixels across.
    pub width: u32,
    /// Pixels down.
    pub height: u32,
    /// Position of the pinhole.
    pub origin: Vec3,
    /// Direction to the upper left corner of the film, at unit distance along the view.
    corner: Vec3,
    /// Step of one pixel to the right and one down.
    step: (Vec3, Vec3),
}

const DEFAULT_FOV: f32 = 40.0;

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
                target + Vec3::new(0.35, 0.25, 1.0).normalize() * (radius / narrow.sin())
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
        Ok(Self {
            width,
            height,
            origin,
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
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn rays_pass_where_they_should() {
        let table = CameraTable {
            origin: Some([0.0, 1.0, 4.0]),
            target: Some([0.0, 1.0, 0.0]),
            up: None,
            fov: Some(90.0),
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
        for table in [same, along, wide] {
            assert!(Camera::new(&table, (10, 10), bounds).is_err());
        }
    }
}
