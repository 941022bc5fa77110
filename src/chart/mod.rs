//! Error against time: every method on a scene over a range of times and seeds, against two references.
//!
//! A `Run` is one progressive render: it is stopped at 4, 8, 16… samples to measure the error of every
//! picture that can be made of its film, and for the last time when its seconds are over. Rows at the
//! same number of samples are means over the seeds.

pub mod figures;
pub mod report;
pub mod run;
pub mod statistics;
pub mod store;

use crate::gradient::Weights;
use crate::render::Method;
use crate::trace::Backend;
use serde::{Deserialize, Serialize};

/// A way to fill the film.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Tracing {
    /// Which estimator.
    pub method: Method,
    /// Weights of its differences.
    pub weights: Weights,
    /// What finds the hits.
    pub backend: Backend,
}

/// One measurement: a line of `chart.csv`.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Row {
    /// The scene.
    pub scene: String,
    /// `pt`, or how the picture is made of primal and gradients.
    pub method: String,
    /// Weights of the differences; empty for `pt`.
    pub weights: String,
    /// What finds the hits.
    pub backend: String,
    /// Seed of the run.
    pub seed: u64,
    /// Samples of every pixel.
    pub samples: u64,
    /// Whether the run ended here, its time being over.
    pub last: bool,
    /// Seconds tracing and making this picture.
    pub seconds: f64,
    /// Seconds of them that made the picture.
    pub seconds_solving: f64,
    /// Relative squared error.
    pub rel_mse: f64,
    /// Half of its 95 % interval, of the references' noise, which all rows of a scene share.
    pub rel_mse_interval: Option<f64>,
    /// The same error without the worst 0.1 % of pixels.
    pub rel_mse_trimmed: f64,
    /// What of the error is dots and dashes.
    pub rel_mse_specks: f64,
    /// Squared error.
    pub mse: f64,
    /// Mean of image minus reference, as a share of the reference's mean; none for a black reference.
    pub rel_bias: Option<f64>,
}

/// All rows of one way to render, over samples and seeds.
pub struct Curve<'a> {
    /// What it is called: what differs from the defaults.
    pub name: String,
    /// Its rows, at least one.
    pub rows: Vec<&'a Row>,
}

/// The curves of one scene, in the order in which they come.
pub fn curves<'a>(rows: &'a [Row], scene: &str) -> Vec<Curve<'a>> {
    let mut curves: Vec<Curve> = Vec::new();
    for row in rows.iter().filter(|r| r.scene == scene) {
        let name = row.curve();
        match curves.iter_mut().find(|c| c.name == name) {
            Some(curve) => curve.rows.push(row),
            None => curves.push(Curve {
                name,
                rows: vec![row],
            }),
        }
    }
    curves
}

impl Row {
    /// The name of its curve.
    pub fn curve(&self) -> String {
        let mut name = self.method.clone();
        if !self.weights.is_empty() && self.weights != name_of(Weights::Mis) {
            name += &format!(", {}", self.weights);
        }
        if self.backend != Backend::DEFAULT.name() {
            name += &format!(", {}", self.backend);
        }
        name
    }
}

impl Curve<'_> {
    /// Whether this is plain path tracing.
    pub fn is_baseline(&self) -> bool {
        self.rows[0].method == name_of(Method::Pt)
    }

    /// Plain path tracing on the same backend: what gains are measured against.
    pub fn baseline<'a>(&self, curves: &'a [Curve<'a>]) -> Option<&'a Curve<'a>> {
        let mut baselines = curves.iter().filter(|c| c.is_baseline());
        baselines.find(|c| c.rows[0].backend == self.rows[0].backend)
    }
}

/// The name of a value as the flags have it.
pub fn name_of(value: impl clap::ValueEnum) -> String {
    let value = value.to_possible_value();
    value.map_or_else(String::new, |v| v.get_name().to_owned())
}
