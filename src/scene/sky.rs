//! A clear sky with the sun: the sky by the model of Hosek and Wilkie (2012), the sun by the extinction that
//! Preetham, Shirley and Smits (1999) give, and below the horizon a ground that both light.

use crate::error::{Error, Result};
use crate::load::bitmap::{Bitmap, Texels};
use glam::Vec3;
use hw_skymodel::rgb::{Channel, SkyParams, SkyState};
use std::f32::consts::{FRAC_PI_2, PI, TAU};

/// Pixels across and down.
const WIDTH: u32 = 1024;
const HEIGHT: u32 = 512;

/// How hazy the air is: that of a clear day.
const TURBIDITY: f32 = 3.0;
/// Reflectance of the ground.
const GROUND: f32 = 0.2;
/// Degrees from the middle of the sun's disc to its edge. The sun's own 0.27 are smaller than a pixel; its
/// irradiance is the sun's.
const SUN_RADIUS: f32 = 1.0;

/// Luminance of radiance 1, in cd/m²: about that of white paper in the sun.
const LUMINANCE: f32 = 25_000.0;
/// Illuminance of the sun above the atmosphere, in lux.
const SOLAR_ILLUMINANCE: f32 = 128_000.0;
/// Its colour: linear sRGB of luminance 1 at the chromaticity x = 0.3224, y = 0.3324 of the solar spectrum.
const SOLAR_COLOUR: Vec3 = Vec3::new(1.088, 0.979, 0.948);
/// Wavelengths that stand for red, green and blue, in micrometres.
const WAVELENGTHS: [f32; 3] = [0.61, 0.55, 0.465];

/// A picture of the sky by longitude and latitude, its middle towards the horizon below the sun, which is
/// `elevation` degrees high.
pub(super) fn bitmap(elevation: f32) -> Result<Bitmap> {
    if !(0.0..=90.0).contains(&elevation) {
        return Err(Error::Setting(format!(
            "the sun's elevation must be from 0 to 90 degrees, got {elevation}"
        )));
    }
    let elevation = elevation.to_radians().min(FRAC_PI_2);
    let sky = Sky::new(elevation)?;
    let sun = sun_irradiance(elevation);

    // The sky, and its irradiance of the ground.
    let mut values = vec![[0.0f32; 3]; (WIDTH * HEIGHT) as usize];
    let mut ground = Vec3::ZERO;
    for y in 0..HEIGHT / 2 {
        for x in 0..WIDTH {
            let d = direction(x as f32 + 0.5, y as f32 + 0.5);
            let radiance = sky.radiance(d);
            ground += radiance * (d.y * solid_angle(y));
            values[(y * WIDTH + x) as usize] = radiance.to_array();
        }
    }
    ground += sun * elevation.sin();
    let ground = (ground * (GROUND / PI)).to_array();
    values[(WIDTH * HEIGHT / 2) as usize..].fill(ground);

    // The sun: the share of each pixel that its disc covers.
    let mut disc = Vec::new();
    let mut size = 0.0;
    for index in 0..WIDTH * HEIGHT {
        let (x, y) = (index % WIDTH, index / WIDTH);
        let share = covered(x, y, sky.sun);
        if share > 0.0 {
            size += share * solid_angle(y);
            disc.push((index, share));
        }
    }
    for (index, share) in disc {
        let value = &mut values[index as usize];
        *value = (Vec3::from(*value) + sun * (share / size)).to_array();
    }
    Ok(Bitmap {
        width: WIDTH,
        height: HEIGHT,
        texels: Texels::Floats {
            values,
            alpha: None,
            encoded: false,
        },
        has_alpha: false,
    })
}

/// The sky without the sun.
struct Sky {
    state: SkyState,
    /// Unit direction to the sun.
    sun: Vec3,
}

impl Sky {
    /// The sun's `elevation` is in radians, from 0 to π/2.
    fn new(elevation: f32) -> Result<Self> {
        let params = SkyParams {
            elevation,
            turbidity: TURBIDITY,
            albedo: [GROUND; 3],
        };
        let failed = |e: hw_skymodel::rgb::Error| Error::Setting(e.to_string());
        Ok(Self {
            state: SkyState::new(&params).map_err(failed)?,
            sun: Vec3::new(0.0, elevation.sin(), elevation.cos()),
        })
    }

    /// The radiance from a unit direction above the horizon.
    fn radiance(&self, d: Vec3) -> Vec3 {
        let theta = d.y.clamp(0.0, 1.0).acos();
        let gamma = d.dot(self.sun).clamp(-1.0, 1.0).acos();
        let channel = |c| self.state.radiance(theta, gamma, c).max(0.0);
        let radiance = Vec3::new(
            channel(Channel::R),
            channel(Channel::G),
            channel(Channel::B),
        );
        // The model gives luminance without the 683 lm/W.
        radiance * (683.0 / LUMINANCE)
    }
}

/// Irradiance by the sun of a surface that faces it, with the sun at this elevation in radians.
fn sun_irradiance(elevation: f32) -> Vec3 {
    let zenith = 90.0 - elevation.to_degrees();
    // Way through the air, over that from the zenith (Kasten).
    let mass = 1.0 / (elevation.sin() + 0.15 * (93.885 - zenith).powf(-1.253));
    let haze = 0.046_08 * TURBIDITY - 0.045_86;
    let transmitted = WAVELENGTHS.map(|l| {
        let molecules = 0.008_735 * l.powf(-4.08);
        let aerosols = haze * l.powf(-1.3);
        (-(molecules + aerosols) * mass).exp()
    });
    SOLAR_COLOUR * Vec3::from(transmitted) * (SOLAR_ILLUMINANCE / LUMINANCE)
}

/// The unit direction at a place in the picture.
fn direction(x: f32, y: f32) -> Vec3 {
    let (across, down) = (TAU * x / WIDTH as f32, PI * y / HEIGHT as f32);
    let (sin, cos) = down.sin_cos();
    Vec3::new(across.sin() * sin, cos, -across.cos() * sin)
}

/// Of a pixel in this row.
fn solid_angle(y: u32) -> f32 {
    let edge = |y: u32| (PI * y as f32 / HEIGHT as f32).cos();
    (edge(y) - edge(y + 1)) * TAU / WIDTH as f32
}

/// The share of a pixel that the sun's disc covers, by 8 x 8 points.
fn covered(x: u32, y: u32, sun: Vec3) -> f32 {
    const SIDE: u32 = 8;
    let radius = SUN_RADIUS.to_radians();
    let distance = |d: Vec3| (d - sun).length();
    // No pixel reaches further from its middle than this.
    let pixel = PI / HEIGHT as f32;
    if distance(direction(x as f32 + 0.5, y as f32 + 0.5)) > radius + pixel {
        return 0.0;
    }
    let place = |i: u32| (i as f32 + 0.5) / SIDE as f32;
    let hits = (0..SIDE * SIDE).filter(|i| {
        let (u, v) = (place(i % SIDE), place(i / SIDE));
        distance(direction(x as f32 + u, y as f32 + v)) < radius
    });
    hits.count() as f32 / (SIDE * SIDE) as f32
}

#[cfg(test)]
mod tests {
    use super::*;

    fn luminance(c: Vec3) -> f32 {
        c.dot(Vec3::new(0.2126, 0.7152, 0.0722))
    }

    /// Values of the published formula with the data set's coefficients, evaluated in double precision.
    #[test]
    fn the_sky_is_the_models() {
        let sky = Sky::new(40f32.to_radians()).unwrap();
        let unit = 683.0 / LUMINANCE;
        for (direction, wanted) in [
            (Vec3::Y, [2.15224, 3.843_125, 7.797_721]),
            // 60 degrees from the zenith, 10 degrees below the sun.
            (at(30.0), [20.94304, 24.02914, 27.42431]),
        ] {
            let radiance = sky.radiance(direction) / unit;
            let far = (radiance / Vec3::from(wanted) - 1.0).abs().max_element();
            assert!(far < 1e-3, "{direction}: {radiance}");
        }
    }

    fn at(elevation: f32) -> Vec3 {
        let (sin, cos) = elevation.to_radians().sin_cos();
        Vec3::new(0.0, sin, cos)
    }

    /// What the picture lights the ground with, in lux: at 40 degrees of elevation 52 000 by the sun, by the
    /// formula above for 81 000 across its rays, and 16 300 by the sky, by the model integrated in double
    /// precision. Measured ones of clear days are about as large.
    #[test]
    fn the_ground_gets_the_light_of_a_clear_day() {
        for (elevation, wanted) in [(10.0f32, 13_630.0), (40.0, 68_310.0), (70.0, 105_960.0)] {
            let bitmap = bitmap(elevation).unwrap();
            let Texels::Floats { values, .. } = &bitmap.texels else {
                panic!("the sky has floats");
            };
            let mut ground = 0.0f64;
            for (index, value) in values.iter().enumerate() {
                let (x, y) = (index as u32 % WIDTH, index as u32 / WIDTH);
                let up = direction(x as f32 + 0.5, y as f32 + 0.5).y.max(0.0);
                ground += f64::from(luminance(Vec3::from(*value)) * up * solid_angle(y));
            }
            let lux = ground * f64::from(LUMINANCE);
            assert!((lux / wanted - 1.0).abs() < 0.01, "{elevation}: {lux} lux");
            // The ground reflects its share of that.
            let below = luminance(Vec3::from(values[values.len() - 1]));
            let reflected = f64::from(GROUND) * lux / f64::from(PI * LUMINANCE);
            assert!((f64::from(below) / reflected - 1.0).abs() < 0.01, "{below}");
        }
    }

    #[test]
    fn suns_that_are_not_up_are_refused() {
        for elevation in [-1.0, 90.5, f32::NAN] {
            assert!(bitmap(elevation).is_err(), "{elevation}");
        }
        for elevation in [0.0, 90.0] {
            assert!(bitmap(elevation).is_ok(), "{elevation}");
        }
    }
}
