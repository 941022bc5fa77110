//! The summary of a render: for people and for machines.

use super::write_json;
use crate::error::Result;
use crate::path::Counts;
use crate::shift::Death;
use crate::tone::Tone;
use crate::trace::RayKind;
use serde::Serialize;
use std::collections::BTreeMap;
use std::path::Path;

/// What `--stats` writes.
#[derive(Clone, Debug, Serialize)]
pub struct Stats {
    /// Version of this program.
    pub version: &'static str,
    /// The OBJ.
    pub scene: String,
    /// Fingerprint of geometry, materials, light and camera, in hexadecimal.
    pub scene_hash: String,
    /// Settings by name.
    pub settings: BTreeMap<String, String>,
    /// Pixels across.
    pub width: u32,
    /// Pixels down.
    pub height: u32,
    /// Where the camera stands, and why, in words.
    pub camera: String,
    /// Triangles of the scene.
    pub triangles: usize,
    /// Samples of every pixel.
    pub samples: u64,
    /// Whether it ended before the samples that were asked for, on a signal.
    pub interrupted: bool,
    /// Why it ended: samples, time, error, nothing or interrupted; partial where parts of a merge are missing.
    pub ended: &'static str,
    /// Seconds reading the scene.
    pub seconds_loading: f64,
    /// Seconds building the acceleration structure.
    pub seconds_building: f64,
    /// Seconds tracing paths.
    pub seconds_tracing: f64,
    /// Seconds reconstructing.
    pub seconds_solving: f64,
    /// Iterations of the solver, 0 for a direct solve.
    pub solver_iterations: usize,
    /// Relative residual of the solver, 0 for a direct solve.
    pub solver_residual: f64,
    /// The picture's error as relMSE, from its two halves; none with a single sample.
    pub estimated_rel_mse: Option<f64>,
    /// Whether there is anything in the picture: a surface, and light. Where there is nothing, its error is not known.
    pub shows_something: bool,
    /// Rays by kind.
    pub rays: BTreeMap<&'static str, u64>,
    /// Million rays per second of tracing.
    pub mrays_per_second: f64,
    /// Dead shifts by reason.
    pub dead_shifts: BTreeMap<&'static str, u64>,
    /// Samples dropped because they were not finite.
    pub dropped: u64,
    /// Bytes of film for each pixel.
    pub film_bytes_per_pixel: usize,
    /// How pictures of 8 bits are shown, if there are any.
    pub shown: Option<Shown>,
    /// Warnings of the whole run.
    pub warnings: Vec<String>,
}

/// How a picture of 8 bits is shown.
#[derive(Clone, Copy, Debug, Serialize)]
pub struct Shown {
    /// By how many stops it is brightened.
    pub exposure: f32,
    /// Its tone curve.
    pub tone: Tone,
}

impl Shown {
    /// With what shows another picture in the same way.
    pub fn summary(&self) -> String {
        format!(
            "shown with --exposure {} --tone {}",
            self.exposure,
            self.tone.name()
        )
    }
}

impl Stats {
    /// Takes over the counts of the tracer.
    pub fn count(&mut self, counts: &Counts) {
        self.rays = RayKind::ALL
            .iter()
            .map(|k| (k.name(), counts.rays[k.index()]))
            .collect();
        self.dead_shifts = Death::ALL
            .iter()
            .map(|d| (d.name(), counts.deaths[*d as usize]))
            .collect();
        self.dropped = counts.dropped;
        let rays: u64 = counts.rays.iter().sum();
        self.mrays_per_second = rays as f64 / 1e6 / self.seconds_tracing.max(1e-9);
    }

    /// Writes it as JSON.
    pub fn write(&self, path: &Path) -> Result<()> {
        write_json(path, self)
    }

    /// The summary in a few lines.
    pub fn summary(&self) -> String {
        let rays: u64 = self.rays.values().sum();
        let mut text = format!(
            "{} samples per pixel, {}x{}: {:.2} s tracing ({:.1} Mray, {:.1} Mray/s), {}",
            self.samples,
            self.width,
            self.height,
            self.seconds_tracing,
            rays as f64 / 1e6,
            self.mrays_per_second,
            solving(
                self.seconds_solving,
                self.solver_iterations,
                self.solver_residual
            ),
        );
        text += &format!("\n{}", self.camera);
        if !self.shows_something {
            text += "\nthere is nothing in the picture, estimated relMSE none";
        }
        if let Some(error) = self.estimated_rel_mse {
            text += &format!("\nestimated relMSE {error:.2e}");
        }
        if let Some(shown) = &self.shown {
            text += &format!("\n{}", shown.summary());
        }
        let dead: u64 = self.dead_shifts.values().sum();
        if dead > 0 {
            let reasons: Vec<String> = self
                .dead_shifts
                .iter()
                .filter(|(_, n)| **n > 0)
                .map(|(name, n)| format!("{name} {n}"))
                .collect();
            text += &format!("\n{dead} dead shifts: {}", reasons.join(", "));
        }
        text += &format!("\n{} samples dropped", self.dropped);
        text
    }
}

/// What the summary says of a solve.
pub fn solving(seconds: f64, iterations: usize, residual: f64) -> String {
    let mut text = format!("{seconds:.2} s solving");
    if iterations > 0 {
        text += &format!(" ({iterations} iterations, residual {residual:.1e})");
    }
    text
}
