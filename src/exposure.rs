//! Exposure: by how many stops a picture is brightened for a display, given or metered.

use crate::image::Image;
use glam::Vec3;
use std::str::FromStr;

/// By how many stops pictures of 8 bits are brightened.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub enum Exposure {
    /// As metered.
    #[default]
    Auto,
    /// By so many.
    Stops(f32),
}

impl FromStr for Exposure {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        match text.parse() {
            _ if text == "auto" => Ok(Exposure::Auto),
            Ok(stops) if f32::is_finite(stops) => Ok(Exposure::Stops(stops)),
            _ => Err("needs auto or a number of stops, such as -0.5".into()),
        }
    }
}

impl Exposure {
    /// In stops, of a picture or of those that shall look like it.
    pub fn stops(self, picture: &Metered) -> f32 {
        match self {
            Exposure::Auto => meter(picture),
            Exposure::Stops(stops) => stops,
        }
    }
}

/// What is metered.
pub struct Metered<'a> {
    /// The light of the scene, over black.
    pub image: &'a Image,
    /// The part of it that is seen directly: lamps and environment, which do not count where there is
    /// anything else.
    pub direct: &'a Image,
    /// Whether samples of a pixel have found any other light. Where they have not, a picture shows what a solver leaves.
    pub lit: &'a [bool],
    /// The share of each pixel that the scene covers, from 0 to 1.
    pub coverage: &'a [f32],
    /// Reflectance of what is seen, over black; where it is not known, middle grey is assumed.
    pub albedo: Option<&'a Image>,
}

/// Reflectance and brightness of middle grey.
const MIDDLE_GREY: f32 = 0.18;
/// The exposure is rounded to this, so that it can be said and asked for by number.
const STEPS_PER_STOP: f32 = 100.0;
/// Cells along the longer side of the picture. Light is averaged inside of them, so noise hardly matters.
const CELLS: usize = 64;
/// Light so many stops above or below the middle one does not count: fireflies, lamps in mirrors, what is
/// hardly lit.
const RANGE: f32 = 6.0;

/// Of the stops by which things reflect more or less than middle grey, the share that is shown: with all of
/// it black things would be shown black, with none of it white ones grey.
const REFLECTANCE_SEEN: f64 = 2.0 / 3.0;

/// The exposure is reduced by so many stops at most where much of the picture would be white.
const LARGEST_REGARD: f32 = 1.0;

/// Sums over a cell.
#[derive(Clone, Copy, Default)]
struct Cell {
    light: f32,
    albedo: f32,
    coverage: f32,
    is_lit: bool,
}

/// The exposure in stops that shows the lit part of a picture in tones that suit it: its log-average
/// luminance is shown as middle grey if it reflects as much, brighter or darker by two thirds of the stops that
/// it reflects more or less. So white things are lighter than black ones, and both show their form. Up to a
/// stop darker where more than a twentieth would be brighter than 1. 0 for a picture without any light.
fn meter(metered: &Metered) -> f32 {
    let width = metered.image.width;
    let side = width.max(metered.image.height).div_ceil(CELLS).max(1);
    let columns = width.div_ceil(side);
    let luminance = |c: Vec3| c.dot(Vec3::new(0.2126, 0.7152, 0.0722));
    // Of what light, over what share of each pixel, and with what reflectance.
    type Of<'a, T> = &'a dyn Fn(usize) -> T;
    let cells = |light: Of<Vec3>, lit: Of<bool>, coverage: Of<f32>, albedo: Option<&Image>| {
        let mut cells = vec![Cell::default(); columns * metered.image.height.div_ceil(side)];
        for index in 0..width * metered.image.height {
            let (light, coverage) = (luminance(light(index)), coverage(index));
            if coverage > 0.0 && light.is_finite() {
                let (x, y) = (index % width, index / width);
                let cell = &mut cells[y / side * columns + x / side];
                cell.light += light;
                let albedo = albedo.map(|albedo| luminance(albedo.get(index)));
                cell.albedo += albedo.unwrap_or(coverage * MIDDLE_GREY);
                cell.coverage += coverage;
                cell.is_lit |= lit(index);
            }
        }
        cells.retain(|cell| cell.is_lit && cell.light > 0.0 && cell.coverage > 0.0);
        cells
    };
    let (image, direct) = (metered.image, metered.direct);
    let reflected = |index| image.get(index) - direct.get(index);
    let (is_lit, coverage) = (|i: usize| metered.lit[i], |i: usize| metered.coverage[i]);
    let mut lit = cells(&reflected, &is_lit, &coverage, metered.albedo);
    if lit.is_empty() {
        lit = cells(&|index| image.get(index), &|_| true, &|_| 1.0, None);
    }
    if lit.is_empty() {
        return 0.0;
    }

    // The middle one, then the average around it.
    let stops_of = |cell: &Cell| (cell.light / cell.coverage).log2();
    let mut stops: Vec<f32> = lit.iter().map(stops_of).collect();
    stops.sort_by(f32::total_cmp);
    let middle = stops[stops.len() / 2];
    let (mut light, mut albedo, mut coverage) = (0.0, 0.0, 0.0);
    for cell in &lit {
        let stops = stops_of(cell);
        if (stops - middle).abs() <= RANGE {
            let reflectance = (cell.albedo / cell.coverage).clamp(0.02, 1.0);
            light += f64::from(cell.coverage * stops);
            albedo += f64::from(cell.coverage * (reflectance / MIDDLE_GREY).log2());
            coverage += f64::from(cell.coverage);
        }
    }
    let wanted = f64::from(MIDDLE_GREY.log2()) + REFLECTANCE_SEEN * albedo / coverage;
    let wanted = (wanted - light / coverage) as f32;
    // White things beside dark ones: somewhat darker, if they would be white all over.
    let bright = stops[stops.len() * 19 / 20];
    let stops = wanted.min((-bright).max(wanted - LARGEST_REGARD));
    (stops * STEPS_PER_STOP).round() / STEPS_PER_STOP
}

#[cfg(test)]
mod tests {
    use super::*;

    const SIDE: usize = 128;

    fn constant(value: f32) -> Image {
        let mut image = Image::new(SIDE, SIDE);
        (0..SIDE * SIDE).for_each(|i| image.set(i, Vec3::splat(value)));
        image
    }

    fn stops(image: &Image, direct: &Image, coverage: f32, albedo: Option<f32>) -> f32 {
        meter(&Metered {
            image,
            direct,
            lit: &[true; SIDE * SIDE],
            coverage: &[coverage; SIDE * SIDE],
            albedo: albedo.map(constant).as_ref(),
        })
    }

    #[test]
    fn light_is_shown_as_bright_as_it_should_be() {
        let black = constant(0.0);
        assert_eq!(stops(&constant(0.18), &black, 1.0, None), 0.0);
        assert_eq!(stops(&constant(0.18 * 8.0), &black, 1.0, Some(0.18)), -3.0);
        // An eighth of middle grey: three stops, of which two are seen.
        assert_eq!(stops(&constant(0.18), &black, 1.0, Some(0.0225)), -2.0);
        // As much light from a quarter of each pixel.
        assert_eq!(stops(&constant(0.18), &black, 0.25, Some(0.045)), -2.0);
        assert_eq!(stops(&black, &black, 1.0, Some(0.5)), 0.0);
        assert_eq!(stops(&constant(f32::NAN), &black, 1.0, None), 0.0);
    }

    #[test]
    fn lamps_fireflies_and_darkness_do_not_count() {
        let black = constant(0.0);
        let mut image = constant(0.18);
        let mut direct = constant(0.0);
        for i in 0..SIDE * SIDE {
            match i / SIDE {
                // A lamp, and what is all but black.
                0..20 => {
                    image.set(i, Vec3::splat(900.0));
                    direct.set(i, Vec3::splat(900.0));
                }
                20..40 => image.set(i, Vec3::splat(1e-5)),
                _ => (),
            }
        }
        image.set(77 * SIDE + 5, Vec3::splat(1e7));
        assert_eq!(stops(&image, &direct, 1.0, None), 0.0);
        // A tenth of the picture that is white, and brighter than white.
        for (bright, wanted) in [(1.0, -0.25), (1.5, -0.58), (9.0, -1.57)] {
            let mut image = constant(0.18);
            (0..SIDE * SIDE / 10).for_each(|i| image.set(i, Vec3::splat(bright)));
            let stops = stops(&image, &black, 1.0, None);
            assert!((stops - wanted).abs() < 0.03, "{bright}: {stops}");
        }
        // Where nothing but a lamp is seen, it is metered.
        let lamp = constant(0.18 * 4.0);
        assert_eq!(stops(&lamp, &lamp, 1.0, None), -2.0);
        assert_eq!(stops(&lamp, &lamp, 0.0, None), -2.0);
        assert_eq!(stops(&black, &black, 0.0, None), 0.0);
    }

    /// A solver leaves a little light in what is black, however much of the picture that is.
    #[test]
    fn what_no_sample_found_lit_does_not_count() {
        let mut image = constant(1e-5);
        let is_lit = |i: usize| i / SIDE < 10;
        let lit: Vec<bool> = (0..SIDE * SIDE).map(is_lit).collect();
        (0..10 * SIDE).for_each(|i| image.set(i, Vec3::splat(0.09)));
        let stops = meter(&Metered {
            image: &image,
            direct: &constant(0.0),
            lit: &lit,
            coverage: &[1.0; SIDE * SIDE],
            albedo: None,
        });
        assert_eq!(stops, 1.0);
    }

    #[test]
    fn exposures_are_read() {
        assert_eq!("auto".parse(), Ok(Exposure::Auto));
        assert_eq!("-0.5".parse(), Ok(Exposure::Stops(-0.5)));
        for bad in ["", "nan", "inf", "bright"] {
            assert!(bad.parse::<Exposure>().is_err(), "{bad}");
        }
    }
}
