//! The measurements as a bar chart.

use super::measure::Row;
use crate::error::{Error, Result};
use crate::output::{figure, write_whole};
use plotters::prelude::*;
use std::path::Path;

const BAR: i32 = 13;
const GAP: i32 = 10;
const LEFT: i32 = 300;
const WIDTH: i32 = 1000;
const TOP: i32 = 60;
const COLOURS: [RGBColor; 3] = [
    RGBColor(38, 110, 180),
    RGBColor(120, 170, 215),
    RGBColor(225, 130, 40),
];

/// Writes an SVG with a bar for each row, its run-to-run spread as a line, and a star where the
/// renderer goes that way.
pub fn svg(path: &Path, title: &str, rows: &[Row]) -> Result<()> {
    let groups = rows
        .windows(2)
        .filter(|w| w[0].kind != w[1].kind || w[0].backend != w[1].backend);
    let height = TOP + rows.len() as i32 * BAR + groups.count() as i32 * GAP + 30;
    let mut text = String::new();
    draw(&mut text, title, rows, height as u32)
        .map_err(|e| Error::Setting(format!("the plot could not be drawn: {e}")))?;
    write_whole(path, |file| file.write_all(text.as_bytes()))
}

fn draw(
    text: &mut String,
    title: &str,
    rows: &[Row],
    height: u32,
) -> std::result::Result<(), Box<dyn std::error::Error>> {
    figure::register_font();
    let root = SVGBackend::with_string(text, (WIDTH as u32, height)).into_drawing_area();
    root.fill(&WHITE)?;
    let small = ("sans-serif", 11).into_font().color(&BLACK);
    root.draw_text(
        title,
        &("sans-serif", 18).into_font().color(&BLACK),
        (10, 10),
    )?;
    root.draw_text(
        "million rays per second: median, slowest to fastest run; * is the way that gdpt goes",
        &small,
        (10, 34),
    )?;
    let largest = rows
        .iter()
        .map(|r| r.fastest)
        .fold(f64::MIN_POSITIVE, f64::max);
    let x = |v: f64| LEFT + (v / largest * f64::from(WIDTH - LEFT - 60)) as i32;
    let mut backends: Vec<&str> = Vec::new();
    let mut y = TOP;
    for (index, row) in rows.iter().enumerate() {
        if index > 0 && (rows[index - 1].kind != row.kind || rows[index - 1].backend != row.backend)
        {
            y += GAP;
        }
        if !backends.contains(&row.backend) {
            backends.push(row.backend);
        }
        let colour = COLOURS[(backends.len() - 1) % COLOURS.len()];
        let star = if row.chosen { " *" } else { "" };
        let label = format!("{}  {}  {}{star}", row.backend, row.kind, row.way);
        root.draw_text(&label, &small, (10, y))?;
        root.draw(&Rectangle::new(
            [(LEFT, y), (x(row.mrays_per_second), y + BAR - 2)],
            colour.filled(),
        ))?;
        let middle = y + BAR / 2 - 1;
        root.draw(&PathElement::new(
            [(x(row.slowest), middle), (x(row.fastest), middle)],
            BLACK,
        ))?;
        root.draw_text(
            &format!("{:.1}", row.mrays_per_second),
            &small,
            (x(row.fastest) + 5, y),
        )?;
        y += BAR;
    }
    root.present()?;
    Ok(())
}
