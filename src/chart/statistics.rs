//! From rows to curves, slopes and gains, each with a 95 % interval over the seeds.

use super::Row;
use statrs::distribution::{ContinuousCDF, StudentsT};
use std::collections::BTreeMap;

/// Errors at few samples are not yet on the straight line: slopes leave them out.
const SLOPE_FROM: u64 = 16;

/// A mean with half of its 95 % interval; infinite for one value alone.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Mean {
    /// The mean.
    pub value: f64,
    /// Half of the interval.
    pub interval: f64,
}

/// A point of a curve.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Point {
    /// Samples of every pixel, the mean over the seeds.
    pub samples: f64,
    /// Seconds, the mean over the seeds.
    pub seconds: f64,
    /// relMSE, the mean over the seeds.
    pub error: f64,
    /// Ends of its 95 % interval.
    pub band: (f64, f64),
}

/// The mean of values by Student's t.
pub fn mean(values: &[f64]) -> Mean {
    let n = values.len() as f64;
    let value = values.iter().sum::<f64>() / n;
    let variance = values.iter().map(|v| (v - value).powi(2)).sum::<f64>() / (n - 1.0);
    let quantile = StudentsT::new(0.0, 1.0, (n - 1.0).max(1.0)).map(|t| t.inverse_cdf(0.975));
    let interval = match quantile {
        Ok(t) if n > 1.0 => t * (variance / n).sqrt(),
        _ => f64::INFINITY,
    };
    Mean { value, interval }
}

/// The rows of each seed, by samples.
fn by_seed<'a>(rows: &[&'a Row]) -> Vec<Vec<&'a Row>> {
    let mut seeds: BTreeMap<u64, Vec<&Row>> = BTreeMap::new();
    for row in rows {
        seeds.entry(row.seed).or_default().push(row);
    }
    let sorted = |mut rows: Vec<&'a Row>| {
        rows.sort_by_key(|r| r.samples);
        rows
    };
    seeds.into_values().map(sorted).collect()
}

/// The points of one method: the numbers of samples that all seeds reached, and the ends of the runs.
/// The band is that of the logarithms' mean, so it does not go below 0.
pub fn curve(rows: &[&Row]) -> Vec<Point> {
    let seeds = by_seed(rows);
    let mut groups: BTreeMap<(bool, u64), Vec<&Row>> = BTreeMap::new();
    for row in rows {
        let samples = if row.last { 0 } else { row.samples };
        groups.entry((row.last, samples)).or_default().push(row);
    }
    let complete = groups.into_values().filter(|g| g.len() == seeds.len());
    complete
        .map(|group| {
            let of = |f: fn(&Row) -> f64| mean(&group.iter().map(|r| f(r)).collect::<Vec<_>>());
            let error = of(|r| r.rel_mse).value;
            let spread = of(|r| r.rel_mse.ln()).interval.exp();
            Point {
                samples: of(|r| r.samples as f64).value,
                seconds: of(|r| r.seconds).value,
                error,
                band: (error / spread, error * spread),
            }
        })
        .collect()
}

/// The slope of the error over samples or seconds, both logarithmic, by least squares for each seed.
/// `None` with fewer than three points.
pub fn slope(rows: &[&Row], over: fn(&Row) -> f64) -> Option<Mean> {
    let slopes: Option<Vec<f64>> = by_seed(rows)
        .iter()
        .map(|rows| {
            let points = rows
                .iter()
                .filter(|r| r.samples >= SLOPE_FROM && r.rel_mse > 0.0);
            let points: Vec<(f64, f64)> = points.map(|r| (over(r).ln(), r.rel_mse.ln())).collect();
            fit(&points)
        })
        .collect();
    slopes.map(|s| mean(&s))
}

/// The slope of a straight line through at least three points.
fn fit(points: &[(f64, f64)]) -> Option<f64> {
    if points.len() < 3 {
        return None;
    }
    let n = points.len() as f64;
    let (mx, my) = (
        points.iter().map(|p| p.0).sum::<f64>() / n,
        points.iter().map(|p| p.1).sum::<f64>() / n,
    );
    let covariance: f64 = points.iter().map(|p| (p.0 - mx) * (p.1 - my)).sum();
    let variance: f64 = points.iter().map(|p| (p.0 - mx).powi(2)).sum();
    Some(covariance / variance)
}

/// A run ends a little before its time, which it cannot hit exactly: up to this factor after its last row
/// that is still its error.
const LATE: f64 = 1.1;

/// The error of one run after `seconds`, on straight lines between its rows in logarithmic axes. `None`
/// before its first row and long after its last one.
fn error_at(rows: &[&Row], seconds: f64) -> Option<f64> {
    let last = rows.last()?;
    if (last.seconds..=last.seconds * LATE).contains(&seconds) {
        return Some(last.rel_mse).filter(|&e| e > 0.0);
    }
    let pair = rows
        .windows(2)
        .find(|w| (w[0].seconds..=w[1].seconds).contains(&seconds))?;
    let [a, b] = [pair[0], pair[1]].map(|r| (r.seconds.ln(), r.rel_mse.ln()));
    let share = if b.0 > a.0 {
        (seconds.ln() - a.0) / (b.0 - a.0)
    } else {
        0.0
    };
    let error = (a.1 + share * (b.1 - a.1)).exp();
    (error > 0.0 && error.is_finite()).then_some(error)
}

/// How many times lower the error of `rows` is than that of `baseline` after `seconds`: the geometric
/// mean over the seeds, its interval as a factor. `None` where a run has no error at that time.
pub fn gain(rows: &[&Row], baseline: &[&Row], seconds: f64) -> Option<Mean> {
    let errors = |rows: &[&Row]| -> Option<Mean> {
        let errors = by_seed(rows);
        let errors = errors
            .iter()
            .map(|rows| error_at(rows, seconds).map(f64::ln));
        errors.collect::<Option<Vec<f64>>>().map(|e| mean(&e))
    };
    let (method, baseline) = (errors(rows)?, errors(baseline)?);
    Some(Mean {
        value: (baseline.value - method.value).exp(),
        interval: method.interval.hypot(baseline.interval).exp(),
    })
}
