//! The figures of a chart: error against seconds and against samples.

use super::statistics::{self, Mean};
use super::{Curve, Row};
use crate::output::figure::{Figure, Series, Style};

/// Error against seconds, making the picture included.
pub fn against_seconds(scene: &str, curves: &[Curve]) -> Figure {
    figure(scene, curves, "seconds", |r| r.seconds, |p| p.seconds)
}

/// Error against samples.
pub fn against_samples(scene: &str, curves: &[Curve]) -> Figure {
    figure(
        scene,
        curves,
        "samples per pixel",
        |r| r.samples as f64,
        |p| p.samples,
    )
}

fn figure(
    scene: &str,
    curves: &[Curve],
    x_label: &str,
    of_row: fn(&Row) -> f64,
    of_point: fn(&statistics::Point) -> f64,
) -> Figure {
    let series = curves
        .iter()
        .enumerate()
        .map(|(colour, Curve { name, rows })| {
            let curve = statistics::curve(rows);
            let point = |p: &statistics::Point| (of_point(p), p.error);
            let band = |p: &statistics::Point| (of_point(p), p.band.0, p.band.1);
            Series {
                name: match statistics::slope(rows, of_row) {
                    Some(slope) => format!("{name}: slope {}", signed(slope)),
                    None => name.clone(),
                },
                colour,
                style: Style::Line,
                points: curve.iter().map(point).collect(),
                band: curve.iter().map(band).filter(|b| b.2.is_finite()).collect(),
            }
        });
    Figure {
        title: format!("{scene}: error against {x_label}"),
        x_label: x_label.to_owned(),
        y_label: "relMSE".to_owned(),
        series: series.collect(),
        marks: Vec::new(),
    }
}

/// A mean with its interval, where there is one.
pub fn signed(mean: Mean) -> String {
    if mean.interval.is_finite() {
        format!("{:.2} ± {:.2}", mean.value, mean.interval)
    } else {
        format!("{:.2}", mean.value)
    }
}
