//! Images in memory: planar, 32-bit float.

/// An RGB image, each channel row by row from the upper left corner.
#[derive(Clone, Debug, PartialEq)]
pub struct Image {
    /// Pixels across.
    pub width: usize,
    /// Pixels down.
    pub height: usize,
    /// Red, green and blue, `width * height` values each.
    pub channels: [Vec<f32>; 3],
}

impl Image {
    /// All zero.
    pub fn new(width: usize, height: usize) -> Self {
        Self {
            width,
            height,
            channels: std::array::from_fn(|_| vec![0.0; width * height]),
        }
    }

    /// Sets a pixel by its index `y * width + x`.
    #[inline]
    pub fn set(&mut self, index: usize, value: glam::Vec3) {
        for (channel, v) in self.channels.iter_mut().zip(value.to_array()) {
            channel[index] = v;
        }
    }

    /// A pixel by its index.
    #[inline]
    pub fn get(&self, index: usize) -> glam::Vec3 {
        glam::Vec3::new(
            self.channels[0][index],
            self.channels[1][index],
            self.channels[2][index],
        )
    }

    /// The sum of two images of one size, pixel by pixel.
    pub fn plus(mut self, other: &Image) -> Image {
        assert_eq!((self.width, self.height), (other.width, other.height));
        for (a, b) in self.channels.iter_mut().zip(&other.channels) {
            a.iter_mut().zip(b).for_each(|(a, b)| *a += b);
        }
        self
    }
}

/// The sRGB transfer function, to a byte: below 0 and not a number are 0, above 1 is 255.
pub fn to_srgb(linear: f32) -> u8 {
    let x = linear.clamp(0.0, 1.0);
    let encoded = if x <= 0.003_130_8 {
        12.92 * x
    } else {
        1.055 * x.powf(1.0 / 2.4) - 0.055
    };
    (encoded * 255.0 + 0.5) as u8
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn srgb_bytes() {
        assert_eq!(
            [0.0, 1.0, -1.0, f32::NAN, 9.0, 0.214_04].map(to_srgb),
            [0, 255, 0, 0, 255, 127]
        );
    }
}
