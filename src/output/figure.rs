//! Figures with two logarithmic axes, as SVG and as PNG.

use super::format::Encoding;
use super::png::Pixels;
use super::write_whole;
use crate::error::{Error, Result};
use plotters::coord::Shift;
use plotters::element::DashedPathElement;
use plotters::prelude::*;
use std::path::Path;
use std::sync::Once;

/// Size in pixels.
const SIZE: (u32, u32) = (900, 600);
/// Told apart by people who do not see all colours (Wong 2011).
const COLOURS: [RGBColor; 7] = [
    RGBColor(0, 0, 0),
    RGBColor(230, 159, 0),
    RGBColor(0, 114, 178),
    RGBColor(213, 94, 0),
    RGBColor(0, 158, 115),
    RGBColor(204, 121, 167),
    RGBColor(86, 180, 233),
];

/// A figure.
#[derive(Clone, Debug, Default)]
pub struct Figure {
    /// Above it.
    pub title: String,
    /// Under the horizontal axis.
    pub x_label: String,
    /// Beside the vertical axis.
    pub y_label: String,
    /// What is drawn, in this order.
    pub series: Vec<Series>,
    /// Places on the horizontal axis with a vertical line and a text.
    pub marks: Vec<(f64, String)>,
}

/// A line or points. What is not above 0 has no place on a logarithmic axis and is left out.
#[derive(Clone, Debug)]
pub struct Series {
    /// In the legend; series without a name are not in it.
    pub name: String,
    /// Series with the same number have the same colour.
    pub colour: usize,
    /// How it is drawn.
    pub style: Style,
    /// Horizontal and vertical values.
    pub points: Vec<(f64, f64)>,
    /// A shaded band: horizontal value, lower and upper end. Empty if there is none.
    pub band: Vec<(f64, f64, f64)>,
}

/// How a series is drawn.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Style {
    /// Straight lines with a dot at each value.
    Line,
    /// Dots alone.
    Dots,
    /// A dashed line.
    Dashed,
}

/// Makes text possible: the same font on every machine, without looking for one on the system.
pub fn register_font() {
    static ONCE: Once = Once::new();
    ONCE.call_once(|| {
        let font = epaint_default_fonts::UBUNTU_LIGHT;
        // Fails only for what is no font.
        let _ = plotters::style::register_font("sans-serif", FontStyle::Normal, font);
    });
}

impl Figure {
    /// Writes `path` with the extensions .svg and .png.
    pub fn write(&self, path: &Path) -> Result<()> {
        let svg = self.svg()?;
        write_whole(&path.with_extension("svg"), |file| {
            file.write_all(svg.as_bytes())
        })?;
        self.pixels()?
            .write(&path.with_extension("png"), Encoding::Png)
    }

    /// As the text of an SVG file.
    pub fn svg(&self) -> Result<String> {
        register_font();
        let mut text = String::new();
        draw(
            self,
            SVGBackend::with_string(&mut text, SIZE).into_drawing_area(),
        )
        .map_err(|e| self.failed(&e))?;
        Ok(text)
    }

    fn pixels(&self) -> Result<Pixels> {
        register_font();
        let (width, height) = (SIZE.0 as usize, SIZE.1 as usize);
        let mut rgb = vec![0; width * height * 3];
        draw(
            self,
            BitMapBackend::with_buffer(&mut rgb, SIZE).into_drawing_area(),
        )
        .map_err(|e| self.failed(&e))?;
        Ok(Pixels {
            width,
            height,
            rgb,
            alpha: None,
        })
    }

    fn failed(&self, e: &dyn std::fmt::Display) -> Error {
        Error::Setting(format!(
            "the figure '{}' could not be drawn: {e}",
            self.title
        ))
    }

    /// The least and the largest value along both axes, with room around them.
    fn ranges(&self) -> [(f64, f64); 2] {
        let mut ranges = [(f64::INFINITY, 0.0f64); 2];
        let mut add = |axis: usize, value: f64| {
            let (low, high) = &mut ranges[axis];
            if drawable(value) {
                (*low, *high) = (low.min(value), high.max(value));
            }
        };
        for series in &self.series {
            let points = series
                .points
                .iter()
                .filter(|p| drawable(p.0) && drawable(p.1));
            points.for_each(|&(x, y)| {
                add(0, x);
                add(1, y);
            });
            series.band.iter().for_each(|&(_, low, high)| {
                add(1, low);
                add(1, high);
            });
        }
        ranges.map(|(low, high)| {
            if low > high {
                (0.1, 10.0)
            } else {
                (low / 1.2, high * 1.2)
            }
        })
    }
}

fn drawable(value: f64) -> bool {
    value > 0.0 && value.is_finite()
}

fn draw<B: DrawingBackend>(
    figure: &Figure,
    root: DrawingArea<B, Shift>,
) -> std::result::Result<(), DrawingAreaErrorKind<B::ErrorType>>
where
    B::ErrorType: 'static,
{
    root.fill(&WHITE)?;
    let [x, y] = figure.ranges();
    let mut chart = ChartBuilder::on(&root)
        .caption(&figure.title, ("sans-serif", 22))
        .margin(12)
        .x_label_area_size(45)
        .y_label_area_size(70)
        .build_cartesian_2d((x.0..x.1).log_scale(), (y.0..y.1).log_scale())?;
    chart
        .configure_mesh()
        .x_desc(&figure.x_label)
        .y_desc(&figure.y_label)
        .axis_desc_style(("sans-serif", 16))
        .label_style(("sans-serif", 14))
        .light_line_style(RGBColor(240, 240, 240))
        .bold_line_style(RGBColor(215, 215, 215))
        .x_label_formatter(&|v| number(*v))
        .y_label_formatter(&|v| number(*v))
        .draw()?;
    for (place, text) in &figure.marks {
        let line = DashedPathElement::new(vec![(*place, y.0), (*place, y.1)], 4, 4, BLACK.mix(0.6));
        chart.draw_series([line])?;
        chart.draw_series([Text::new(
            text.clone(),
            (*place, y.1 * 0.8),
            ("sans-serif", 14),
        )])?;
    }
    for series in &figure.series {
        let colour = COLOURS[series.colour % COLOURS.len()];
        let band = series.band.iter();
        let band: Vec<_> = band.filter(|b| drawable(b.1) && drawable(b.2)).collect();
        let upper = band.iter().map(|&&(x, _, high)| (x, high));
        let lower = band.iter().rev().map(|&&(x, low, _)| (x, low));
        let outline: Vec<(f64, f64)> = upper.chain(lower).collect();
        if !outline.is_empty() {
            chart.draw_series([Polygon::new(outline, colour.mix(0.15))])?;
        }
        let points = series.points.iter().copied();
        let points: Vec<(f64, f64)> = points.filter(|p| drawable(p.0) && drawable(p.1)).collect();
        let stroke = colour.stroke_width(2);
        if series.style == Style::Line {
            chart.draw_series([PathElement::new(points.clone(), stroke)])?;
        }
        if series.style != Style::Dashed {
            let dots = points.iter().map(|&p| Circle::new(p, 3, colour.filled()));
            chart.draw_series(dots)?;
        }
        let drawn = if series.style == Style::Dashed {
            chart.draw_series([DashedPathElement::new(points, 7, 5, stroke)])?
        } else {
            chart.draw_series(std::iter::empty::<Circle<(f64, f64), i32>>())?
        };
        if !series.name.is_empty() {
            let style = series.style;
            drawn.label(&series.name).legend(move |(x, y)| match style {
                Style::Dots => {
                    EmptyElement::at((x, y))
                        + Circle::new((10, 0), 3, colour.filled())
                        + PathElement::new(vec![], colour)
                }
                Style::Line | Style::Dashed => {
                    EmptyElement::at((x, y))
                        + Circle::new(
                            (10, 0),
                            if style == Style::Line { 3 } else { 0 },
                            colour.filled(),
                        )
                        + PathElement::new(vec![(0, 0), (20, 0)], colour.stroke_width(2))
                }
            });
        }
    }
    chart
        .configure_series_labels()
        .position(SeriesLabelPosition::UpperRight)
        .background_style(WHITE.mix(0.85))
        .border_style(RGBColor(200, 200, 200))
        .label_font(("sans-serif", 14))
        .draw()?;
    root.present()
}

/// Powers of ten as such, what is near 1 in plain digits.
fn number(value: f64) -> String {
    if (1e-2..1e4).contains(&value) {
        format!("{value:.3}")
            .trim_end_matches('0')
            .trim_end_matches('.')
            .to_owned()
    } else {
        format!("{value:.0e}")
    }
}
