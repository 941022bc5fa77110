//! Pictures as they are shown: scene light, exposed and by a tone curve, before the background.

use crate::image::{Image, to_srgb};
use crate::load::environment::Background;
use crate::output::png::Pixels;
use crate::tone::Tone;
use glam::Vec3;

/// A picture and what is behind it.
pub struct Plate<'a> {
    /// The light of the scene, linear; over black where the background is not the environment.
    pub image: &'a Image,
    /// The share of each pixel that the scene covers, from 0 to 1.
    pub coverage: &'a [f32],
    /// What is behind the scene.
    pub background: Background,
}

impl Plate<'_> {
    /// The linear picture, as it is but for the background: black where that is transparent.
    pub fn linear(&self) -> Image {
        let colour = match self.background {
            Background::Environment => return self.image.clone(),
            Background::Colour(colour) => colour.into(),
            Background::Transparent => Vec3::ZERO,
        };
        let mut image = self.image.clone();
        for (index, &coverage) in self.coverage.iter().enumerate() {
            // Where no ray met anything there is nothing, whatever the solve made of the pixels beside.
            let scene = if coverage > 0.0 {
                image.get(index)
            } else {
                Vec3::ZERO
            };
            image.set(index, scene + colour * (1.0 - coverage));
        }
        image
    }

    /// The picture for a display, brightened by `exposure` stops. The background is not: a colour is shown as
    /// it is, and a transparent one becomes an alpha channel, not multiplied into the colours.
    pub fn pixels(&self, exposure: f32, tone: Tone) -> Pixels {
        let scale = exposure.exp2();
        let shown = |light: Vec3| tone.apply(light * scale);
        let count = self.image.width * self.image.height;
        let mut rgb = Vec::with_capacity(3 * count);
        for index in 0..count {
            let light = self.image.get(index);
            let coverage = self.coverage[index];
            let scene = || {
                if coverage > 0.0 {
                    shown(light / coverage)
                } else {
                    Vec3::ZERO
                }
            };
            let colour = match self.background {
                Background::Environment => shown(light),
                Background::Transparent => scene(),
                Background::Colour(colour) => Vec3::from(colour).lerp(scene(), coverage),
            };
            rgb.extend(colour.to_array().map(to_srgb));
        }
        let alpha = || {
            let byte = |a: &f32| (a * 255.0 + 0.5) as u8;
            self.coverage.iter().map(byte).collect()
        };
        Pixels {
            width: self.image.width,
            height: self.image.height,
            rgb,
            alpha: (self.background == Background::Transparent).then(alpha),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Three pixels: no scene, half, all of it.
    fn plate(image: &Image, background: Background) -> Plate<'_> {
        Plate {
            image,
            coverage: &[0.0, 0.5, 1.0],
            background,
        }
    }

    fn image() -> Image {
        let mut image = Image::new(3, 1);
        image.set(0, Vec3::new(-0.01, 0.02, 0.0)); // a solve's
        image.set(1, Vec3::new(0.05, 0.1, 0.2));
        image.set(2, Vec3::new(0.1, 0.2, 0.4));
        image
    }

    #[test]
    fn the_scene_lies_over_its_background() {
        let image = image();
        let linear = plate(&image, Background::Colour([0.5, 1.0, 0.25])).linear();
        let pixels: Vec<Vec3> = (0..3).map(|i| linear.get(i)).collect();
        let wanted = [
            Vec3::new(0.5, 1.0, 0.25),
            Vec3::new(0.3, 0.6, 0.325),
            Vec3::new(0.1, 0.2, 0.4),
        ];
        assert_eq!(pixels, wanted);
        assert_eq!(plate(&image, Background::Environment).linear(), image);
        let transparent = plate(&image, Background::Transparent).linear();
        assert_eq!(transparent.get(0), Vec3::ZERO);
        assert_eq!(transparent.get(1), image.get(1));
    }

    #[test]
    fn exposure_is_of_the_scene_alone() {
        let image = image();
        let over = |colour| plate(&image, Background::Colour(colour)).pixels(1.0, Tone::Srgb);
        let pixels = over([0.5, 1.0, 0.25]);
        let wanted = [0.5, 1.0, 0.25, 0.35, 0.7, 0.525, 0.2, 0.4, 0.8].map(to_srgb);
        assert_eq!(pixels.rgb, wanted);
        assert_eq!(pixels.alpha, None);
        // The same over black, and by its alpha channel.
        let pixels = plate(&image, Background::Transparent).pixels(1.0, Tone::Srgb);
        assert_eq!(pixels.alpha, Some(vec![0, 128, 255]));
        assert_eq!(pixels.rgb[3..6], pixels.rgb[6..9]);
        let environment = plate(&image, Background::Environment).pixels(1.0, Tone::Srgb);
        assert_eq!(environment.rgb[3..6], [0.1, 0.2, 0.4].map(to_srgb));
    }
}
