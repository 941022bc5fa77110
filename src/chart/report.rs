//! `report.html`: one file with all pictures in it, to be opened without a network.

use super::figures::{self, signed};
use super::{Curve, Row, statistics};
use crate::error::{Error, Result};
use crate::output::figure::Figure;
use crate::output::format::Encoding;
use crate::output::png::Pixels;
use crate::output::write_whole;
use base64::Engine;
use maud::{DOCTYPE, Markup, PreEscaped, html};
use std::path::Path;

const STYLE: &str = include_str!("report.css");
const SCRIPT: &str = include_str!("report.js");

/// A scene of the report.
pub struct SceneReport {
    /// Its name.
    pub name: String,
    /// What it is: size, triangles, references.
    pub about: String,
    /// Pictures to lay side by side, the reference first.
    pub views: Vec<View>,
    /// Differences as grey pictures, each with a caption.
    pub differences: Vec<(String, Pixels)>,
}

/// A picture with the heat map of its errors.
pub struct View {
    /// The method, or "reference".
    pub name: String,
    /// The picture.
    pub picture: Pixels,
    /// Its errors; the reference has none.
    pub heat: Option<Pixels>,
}

/// Times at which gains are told: halves of the longest.
pub fn times(longest: f64) -> Vec<f64> {
    (0..5).rev().map(|k| longest / f64::from(1 << k)).collect()
}

/// Writes the report. `settings` are names and values.
pub fn write(
    path: &Path,
    scenes: &[SceneReport],
    rows: &[Row],
    times: &[f64],
    settings: &[(&str, String)],
) -> Result<()> {
    let failed = |e| Error::io(path, "cannot be written")(e);
    let sections: std::io::Result<Vec<Markup>> = scenes
        .iter()
        .map(|scene| section(scene, rows, times))
        .collect();
    let sections = sections.map_err(failed)?;
    let page = html! {
        (DOCTYPE)
        html lang="en" {
            head {
                meta charset="utf-8";
                meta name="viewport" content="width=device-width, initial-scale=1";
                title { "gdpt: error against time" }
                style { (PreEscaped(STYLE)) }
            }
            body {
                h1 { "Error against time" }
                @for section in &sections { (section) }
                h2 { "Settings" }
                table {
                    @for (name, value) in settings {
                        tr { th { (name) } td { (value) } }
                    }
                }
                script { (PreEscaped(SCRIPT)) }
            }
        }
    };
    write_whole(path, |file| file.write_all(page.into_string().as_bytes()))
}

fn section(scene: &SceneReport, rows: &[Row], times: &[f64]) -> std::io::Result<Markup> {
    let curves = super::curves(rows, &scene.name);
    let drawn = |figure: Figure| {
        figure
            .svg()
            .map_err(|e| std::io::Error::other(e.to_string()))
    };
    let seconds = drawn(figures::against_seconds(&scene.name, &curves))?;
    let samples = drawn(figures::against_samples(&scene.name, &curves))?;
    Ok(html! {
        section {
            h2 { (scene.name) }
            p { (scene.about) }
            (viewer(&scene.views)?)
            div.figures {
                div { (PreEscaped(seconds)) }
                div { (PreEscaped(samples)) }
            }
            (gains(&curves, times))
            (last_errors(&curves))
            @if !scene.differences.is_empty() {
                h3 { "Differences (grey is 0)" }
                div.figures {
                    @for (caption, pixels) in &scene.differences {
                        figure {
                            img src=(data(pixels)?) alt=(caption);
                            figcaption { (caption) }
                        }
                    }
                }
            }
        }
    })
}

/// Two pictures over one another, with a slider between them.
fn viewer(views: &[View]) -> std::io::Result<Markup> {
    let Some(first) = views.first() else {
        return Ok(html! {});
    };
    let width = first.picture.width;
    // Path tracing against what is thought best.
    let (left, right) = (usize::from(views.len() > 2), views.len() - 1);
    let choice = |class: &str, chosen: usize| {
        html! {
            select class=(class) {
                @for (index, view) in views.iter().enumerate() {
                    option value=(index) selected[index == chosen] { (view.name) }
                }
            }
        }
    };
    Ok(html! {
        div.viewer data-width=(width) {
            div.controls {
                label { "left " (choice("left", left)) }
                label { "right " (choice("right", right)) }
                label { "show " select.kind { option { "picture" } option { "error" } } }
                span.zoom {
                    button type="button" data-zoom="out" { "−" }
                    output { "100 %" }
                    button type="button" data-zoom="in" { "+" }
                }
            }
            div.stage {
                img.under alt="left";
                img.over alt="right";
                div.divider {}
            }
            input.slider type="range" min="0" max="100" value="50" aria-label="left and right";
            div.store hidden {
                @for view in views {
                    img data-kind="picture" src=(data(&view.picture)?) alt=(view.name);
                    @let heat = view.heat.as_ref().unwrap_or(&view.picture);
                    img data-kind="error" src=(data(heat)?) alt=(view.name);
                }
            }
            p.note {
                "Drag in the picture or use the slider; wheel or buttons zoom, dragging with shift moves. \
                 Errors: relative squared error, violet 1e-6 or less, green 1e-3, yellow 1 or more."
            }
        }
    })
}

/// How many times lower the error is than that of path tracing at the same time.
fn gains(curves: &[Curve], times: &[f64]) -> Markup {
    let table = gain_table(curves, times);
    html! {
        @if !table.is_empty() {
            h3 { "How many times lower the error is than path tracing's at equal time" }
            table {
                tr { th { "method" } @for t in times { th { (format!("{t:.2} s")) } } }
                @for (name, gains) in &table {
                    tr { th { (name) } @for gain in gains { td { (gain) } } }
                }
            }
        }
    }
}

/// The gains at equal time of each method, as texts: value, and its 95 % interval as a factor.
pub fn gain_table(curves: &[Curve], times: &[f64]) -> Vec<(String, Vec<String>)> {
    let methods = curves.iter().filter(|c| !c.is_baseline());
    let cells = methods.filter_map(|curve| {
        let baseline = curve.baseline(curves)?;
        let gain = |&seconds: &f64| match statistics::gain(&curve.rows, &baseline.rows, seconds) {
            Some(gain) if gain.interval.is_finite() => {
                format!("{:.1} ×/÷ {:.2}", gain.value, gain.interval)
            }
            Some(gain) => format!("{:.1}", gain.value),
            None => "–".to_owned(),
        };
        Some((curve.name.clone(), times.iter().map(gain).collect()))
    });
    cells.collect()
}

/// The errors at the end of the runs.
fn last_errors(curves: &[Curve]) -> Markup {
    let of = |rows: &[&Row], f: fn(&Row) -> f64| {
        let values: Vec<f64> = rows.iter().filter(|r| r.last).map(|r| f(r)).collect();
        statistics::mean(&values)
    };
    html! {
        h3 { "At the end of the runs (means over the seeds; ± does not know of the references' noise)" }
        table {
            tr {
                th { "method" } th { "samples" } th { "seconds" } th { "solving" } th { "relMSE" }
                th { "trimmed" } th { "specks" } th { "bias" }
            }
            @for Curve { name, rows } in curves {
                @let bias = of(rows, |r| 100.0 * r.rel_bias.unwrap_or(0.0));
                tr {
                    th { (name) }
                    td { (format!("{:.0}", of(rows, |r| r.samples as f64).value)) }
                    td { (format!("{:.2}", of(rows, |r| r.seconds).value)) }
                    td { (format!("{:.2}", of(rows, |r| r.seconds_solving).value)) }
                    td { (format!("{:.2e}", of(rows, |r| r.rel_mse).value)) }
                    td { (format!("{:.2e}", of(rows, |r| r.rel_mse_trimmed).value)) }
                    td { (format!("{:.2e}", of(rows, |r| r.rel_mse_specks).value)) }
                    td { (signed(bias)) " %" }
                }
            }
        }
    }
}

/// A PNG inside the page.
fn data(pixels: &Pixels) -> std::io::Result<String> {
    let bytes = base64::engine::general_purpose::STANDARD.encode(pixels.encode(Encoding::Png)?);
    Ok(format!("data:image/png;base64,{bytes}"))
}
