//! Measured spectra as dots over predicted lines.

use super::measure::Measured;
use super::one_dimensional::{self, ALPHAS, Errors};
use super::table::{self, Bin};
use super::theory::{Variances, difference_power};
use crate::output::figure::{Figure, Series, Style};

/// Values of α over which the total error is drawn.
const ALPHA_RANGE: (f64, f64) = (1e-3, 10.0);
const ALPHA_STEPS: u32 = 60;

/// A predicted line and measured dots of one colour.
fn pair(
    name: &str,
    colour: usize,
    predicted: Vec<(f64, f64)>,
    measured: Vec<(f64, f64)>,
) -> [Series; 2] {
    let series = |name: &str, style, points| Series {
        name: name.to_owned(),
        colour,
        style,
        points,
        band: Vec::new(),
    };
    [
        series("", Style::Dashed, predicted),
        series(name, Style::Dots, measured),
    ]
}

fn alpha_name(alpha: f64, best: f64) -> String {
    let remark = if alpha == best { " (best)" } else { "" };
    format!("alpha {alpha:.3}{remark}")
}

/// Errors of a scene by frequency. The first of `alphas` is 0, the last the best one.
pub fn spectra(scene: &str, bins: &[Bin], alphas: &[f64]) -> Figure {
    let points = |f: &dyn Fn(&Bin) -> f64| bins.iter().map(|b| (b.middle(), f(b))).collect();
    let mut series = Vec::from(pair(
        "primal",
        0,
        points(&|b| b.primal_predicted),
        points(&|b| b.primal),
    ));
    let best = alphas.last().copied().unwrap_or_default();
    for (index, &alpha) in alphas.iter().enumerate() {
        let name = if alpha == 0.0 {
            "gradients alone".to_owned()
        } else {
            alpha_name(alpha, best)
        };
        series.extend(pair(
            &name,
            index + 1,
            points(&|b| b.screened_predicted[index]),
            points(&|b| b.screened[index]),
        ));
    }
    Figure {
        title: format!("{scene}: error by frequency, measured (dots) and predicted (lines)"),
        x_label: "cycles per pixel".to_owned(),
        y_label: "squared error".to_owned(),
        series,
        marks: Vec::new(),
    }
}

/// The mean squared error as a function of α.
pub fn totals(scene: &str, measured: &Measured) -> Figure {
    let (low, high) = ALPHA_RANGE;
    let alphas =
        (0..=ALPHA_STEPS).map(|i| low * (high / low).powf(f64::from(i) / f64::from(ALPHA_STEPS)));
    let totals: Vec<(f64, (f64, f64))> = alphas.map(|a| (a, table::total(measured, a))).collect();
    let points = |f: &dyn Fn((f64, f64)) -> f64| totals.iter().map(|t| (t.0, f(t.1))).collect();
    let best = measured.variances.best_alpha();
    Figure {
        title: format!("{scene}: error of the solve, measured (dots) and predicted (line)"),
        x_label: "alpha".to_owned(),
        y_label: "mean squared error".to_owned(),
        series: Vec::from(pair(
            "all frequencies",
            2,
            points(&|t| t.1),
            points(&|t| t.0),
        )),
        marks: vec![(best, format!("best by the variances: {best:.3}"))],
    }
}

/// The experiment in one dimension.
pub fn one_dimensional(title: &str, errors: &[Errors], variances: Variances) -> Figure {
    let inner = || errors.iter().filter(|e| e.frequency > 0.0);
    let measured = |f: &dyn Fn(&Errors) -> f64| inner().map(|e| (e.frequency, f(e))).collect();
    let predicted = |f: &dyn Fn(f64) -> f64| {
        inner()
            .map(|e| (e.frequency, f(difference_power(e.frequency))))
            .collect()
    };
    let mut series = Vec::from(pair(
        "primal",
        0,
        predicted(&|_| variances.primal),
        measured(&|e| e.primal),
    ));
    series.extend(pair(
        "gradients alone",
        1,
        predicted(&|d2| variances.screened(0.0, d2)),
        measured(&|e| e.gradient_only),
    ));
    for (index, alpha) in ALPHAS.into_iter().enumerate() {
        series.extend(pair(
            &format!("alpha {alpha}"),
            index + 2,
            predicted(&|d2| variances.screened(alpha, d2)),
            measured(&|e| e.screened[index]),
        ));
    }
    let pixels = one_dimensional::PIXELS;
    Figure {
        title: title.to_owned(),
        x_label: format!("cycles per pixel ({pixels} pixels)"),
        y_label: "squared error".to_owned(),
        series,
        marks: Vec::new(),
    }
}
