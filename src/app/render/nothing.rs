//! Pictures of nothing: a camera that sees no surface, or no light.

use crate::film::{Film, Halves, Window};
use crate::progress::Reporter;
use crate::scene::Scene;
use glam::Vec3;

/// Samples by which there should be something.
const FIRST_LOOK: u64 = 16;
/// Samples after which `--error` alone, which nothing ever meets, goes on no more.
const ENOUGH: u64 = 64;

/// Looks whether there is anything in the picture, and says so once while it is being made.
pub(super) struct Lookout {
    quiet: bool,
    /// Whether it is a crop, which may well be of nothing.
    is_crop: bool,
    /// Whether the error alone ends the render.
    error_alone: bool,
    looked: bool,
    message: Option<String>,
}

impl Lookout {
    /// `error_alone`: the error alone ends the render.
    pub(super) fn new(error_alone: bool, window: Window, quiet: bool) -> Self {
        Self {
            quiet,
            is_crop: !window.is_whole(),
            error_alone,
            looked: false,
            message: None,
        }
    }

    /// Whether to end, because there is nothing whose error could become small.
    pub(super) fn gives_up(&mut self, scene: &Scene, film: &Film) -> bool {
        let done = film.count(Halves::Both);
        if !self.looked && done >= FIRST_LOOK {
            self.look(scene, film);
        }
        self.error_alone && done >= ENOUGH && !film.shows_something()
    }

    /// What is wrong with the picture at last.
    pub(super) fn end(mut self, scene: &Scene, film: &Film) -> Option<String> {
        if !self.looked {
            self.look(scene, film);
        }
        self.message.filter(|_| !film.shows_something())
    }

    fn look(&mut self, scene: &Scene, film: &Film) {
        self.looked = true;
        if !self.is_crop && !film.shows_something() {
            let message = reason(scene, film);
            Reporter::new(self.quiet).warnings(std::slice::from_ref(&message));
            self.message = Some(message);
        }
    }
}

/// Why there is nothing, and what to do.
fn reason(scene: &Scene, film: &Film) -> String {
    if !film.has_hits() {
        return "the camera sees nothing of the scene; check --origin, --target and --up, or see all of it with \
                --view three-quarter"
            .to_owned();
    }
    if let Some((low, high)) = lamps(scene) {
        let origin = scene.camera.origin;
        let (least, most) = scene.mesh.bounds;
        let outside = origin.cmplt(least).any() || origin.cmpgt(most).any();
        let place = if outside {
            "is outside of the scene"
        } else {
            "sees nothing that they shine on"
        };
        return format!(
            "no light reaches the picture: the lamps are between {low} and {high}, and the camera at {origin} {place}; \
             try --view inside"
        );
    }
    if scene.environment.is_black() {
        let punctual = scene.lights.punctual();
        return if punctual.is_empty() {
            "there is no light: no material emits (Ke), and the environment is black".to_owned()
        } else {
            let lights = punctual.describe().join("; ");
            format!("no light reaches what the camera sees; there is: {lights}")
        };
    }
    "no light reaches the picture: what the camera sees is closed, and there is no lamp in it (a material with Ke, or \
     [[lights]] of the TOML)"
        .to_owned()
}

/// The smallest and the largest coordinates of all lamps; `None` without any.
fn lamps(scene: &Scene) -> Option<(Vec3, Vec3)> {
    let mesh = &scene.mesh;
    let with_materials = mesh.triangles.iter().zip(&mesh.material_of);
    let lamps = with_materials.filter(|&(_, &m)| scene.materials[m as usize].emission.is_some());
    let corners = lamps.flat_map(|(triangle, _)| triangle);
    let points = corners.map(|&c| mesh.positions[c as usize]);
    points.fold(None, |bounds, p| {
        let (low, high) = bounds.unwrap_or((p, p));
        Some((p.min(low), p.max(high)))
    })
}
