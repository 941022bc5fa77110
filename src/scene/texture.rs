//! Textures: pictures over texture coordinates, looked up bilinearly.

use crate::load::bitmap::{Bitmap, Texels};
use crate::load::map::{Channel, MapStatement};
use glam::{Vec2, Vec3};
use serde::Serialize;
use std::sync::{Arc, LazyLock};
use xxhash_rust::xxh3::Xxh3;

/// A picture, where it lies and what it means. Pictures are shared between textures.
#[derive(Clone)]
pub struct Texture {
    bitmap: Arc<Bitmap>,
    /// Repetitions across and up.
    scale: Vec2,
    /// Added to coordinates after scaling.
    offset: Vec2,
    /// Whether it ends at its borders, instead of being repeated.
    clamp: bool,
    meaning: Meaning,
    channel: Channel,
}

/// What the values of a picture mean.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
pub enum Meaning {
    /// Colours: sRGB in files with integers.
    Colour,
    /// Numbers, as they are.
    Data,
    /// Numbers: the alpha channel where there is one.
    Opacity,
}

/// Linear values of sRGB bytes.
static LINEAR: LazyLock<[f32; 256]> =
    LazyLock::new(|| std::array::from_fn(|byte| linear(byte as f32 / 255.0)));

/// sRGB to linear.
pub(super) fn linear(x: f32) -> f32 {
    if x <= 0.04045 {
        x / 12.92
    } else {
        ((x + 0.055) / 1.055).powf(2.4)
    }
}

impl Texture {
    /// The texture of a statement; `None` where its picture is missing.
    pub fn new(map: &MapStatement, meaning: Meaning) -> Option<Self> {
        let bitmap = map.bitmap.clone()?;
        let channel = match (map.channel, meaning) {
            (Channel::Auto, Meaning::Opacity) if bitmap.has_alpha => Channel::Alpha,
            (Channel::Auto, _) => Channel::Luminance,
            (channel, _) => channel,
        };
        Some(Self {
            bitmap,
            scale: map.scale.into(),
            offset: map.offset.into(),
            clamp: map.clamp,
            meaning,
            channel,
        })
    }

    /// A picture once over [0, 1]², its values as they are.
    pub fn of_bitmap(bitmap: Arc<Bitmap>) -> Self {
        Self {
            bitmap,
            scale: Vec2::ONE,
            offset: Vec2::ZERO,
            clamp: false,
            meaning: Meaning::Data,
            channel: Channel::Luminance,
        }
    }

    /// Pixels across and down.
    pub fn size(&self) -> (u32, u32) {
        (self.bitmap.width, self.bitmap.height)
    }

    /// Whether some of the picture is not opaque.
    pub fn has_alpha(&self) -> bool {
        self.bitmap.has_alpha
    }

    /// Bytes of the picture.
    pub fn bytes(&self) -> usize {
        match &self.bitmap.texels {
            Texels::Bytes(bytes) => size_of_val(&bytes[..]),
            Texels::Floats { values, alpha, .. } => {
                size_of_val(&values[..]) + alpha.as_deref().map_or(0, size_of_val)
            }
        }
    }

    /// Whether two textures share their picture.
    pub fn shares_picture(&self, other: &Self) -> bool {
        Arc::ptr_eq(&self.bitmap, &other.bitmap)
    }

    /// The linear colour at `uv`.
    #[inline]
    pub fn colour(&self, uv: Vec2) -> Vec3 {
        self.bilinear(uv, |index| self.texel(index))
    }

    /// The value at `uv`: one channel, or the mean of the colours.
    #[inline]
    pub fn value(&self, uv: Vec2) -> f32 {
        self.bilinear(uv, |index| self.texel_value(index))
    }

    /// How the value at `uv` grows from one pixel to the next, to the right and upwards in texture coordinates.
    pub fn slope(&self, uv: Vec2) -> Vec2 {
        let (width, height) = self.size();
        let half = Vec2::new(0.5 / width as f32, 0.5 / height as f32) / self.scale.abs();
        let along = |half: Vec2| self.value(uv + half) - self.value(uv - half);
        Vec2::new(along(Vec2::X * half), along(Vec2::Y * half))
    }

    /// The linear colour of a pixel by its place in the file.
    #[inline(always)]
    pub fn texel(&self, index: usize) -> Vec3 {
        let colour = self.meaning == Meaning::Colour;
        match &self.bitmap.texels {
            Texels::Bytes(bytes) => {
                let [r, g, b, _] = bytes[index];
                if colour {
                    Vec3::from([r, g, b].map(|byte| LINEAR[byte as usize]))
                } else {
                    Vec3::new(r as f32, g as f32, b as f32) / 255.0
                }
            }
            Texels::Floats {
                values,
                encoded: true,
                ..
            } if colour => Vec3::from(values[index].map(linear)),
            Texels::Floats { values, .. } => values[index].into(),
        }
    }

    #[inline]
    fn texel_value(&self, index: usize) -> f32 {
        if self.channel == Channel::Alpha {
            return self.bitmap.alpha(index);
        }
        let c = self.texel(index);
        match self.channel {
            Channel::Red => c.x,
            Channel::Green => c.y,
            Channel::Blue => c.z,
            _ => (c.x + c.y + c.z) / 3.0,
        }
    }

    /// The mean over the picture, coarsely.
    pub fn mean(&self) -> Vec3 {
        const SIDE: u32 = 64;
        let (width, height) = self.size();
        let (nx, ny) = (width.min(SIDE), height.min(SIDE));
        let mut sum = Vec3::ZERO;
        for y in 0..ny {
            for x in 0..nx {
                let (column, row) = (x * width / nx, y * height / ny);
                sum += self.texel((row as usize) * width as usize + column as usize);
            }
        }
        sum / (nx * ny) as f32
    }

    /// Interpolates between the four nearest pixels, whose centres are at half-integer coordinates.
    #[inline]
    fn bilinear<T>(&self, uv: Vec2, texel: impl Fn(usize) -> T) -> T
    where
        T: std::ops::Add<Output = T> + std::ops::Mul<f32, Output = T>,
    {
        let (width, height) = (self.bitmap.width as usize, self.bitmap.height as usize);
        let uv = uv * self.scale + self.offset;
        let uv = if uv.is_finite() { uv } else { Vec2::ZERO };
        let uv = if self.clamp {
            uv.clamp(Vec2::ZERO, Vec2::ONE)
        } else {
            uv - uv.floor()
        };
        // Rows go down, the second coordinate up.
        let x = uv.x * width as f32 - 0.5;
        let y = (1.0 - uv.y) * height as f32 - 0.5;
        let (column, row) = (x.floor(), y.floor());
        let (fx, fy) = (x - column, y - row);
        let places = |first: f32, count: usize| {
            let first = first as i64;
            if self.clamp {
                [first, first + 1].map(|i| i.clamp(0, count as i64 - 1) as usize)
            } else {
                // From −1 to `count`; a remainder would take longer than all the rest.
                let last = count as i64 - 1;
                debug_assert!((-1..=last).contains(&first));
                let before = if first < 0 { last } else { first };
                let after = if first < last { first + 1 } else { 0 };
                [before, after].map(|i| i as usize)
            }
        };
        let ([c0, c1], [r0, r1]) = (places(column, width), places(row, height));
        let along =
            |row: usize| texel(row * width + c0) * (1.0 - fx) + texel(row * width + c1) * fx;
        along(r0) * (1.0 - fy) + along(r1) * fy
    }

    /// A fingerprint of picture, place and meaning.
    fn hash(&self) -> u64 {
        let mut hasher = Xxh3::new();
        match &self.bitmap.texels {
            Texels::Bytes(bytes) => bytes.iter().for_each(|t| hasher.update(t)),
            Texels::Floats { values, alpha, .. } => {
                let all = values.iter().flatten().chain(alpha.iter().flatten());
                all.for_each(|x| hasher.update(&x.to_le_bytes()));
            }
        }
        hasher.digest()
    }
}

/// For the scene's hash: the picture by its fingerprint.
impl Serialize for Texture {
    fn serialize<S: serde::Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        let place = (self.scale, self.offset, self.clamp);
        let meaning = (self.meaning, self.channel);
        (self.size(), self.hash(), place, meaning).serialize(serializer)
    }
}

impl std::fmt::Debug for Texture {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        let (width, height) = self.size();
        write!(f, "Texture of {width}x{height}")
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// 2 x 2 grey bytes, upper row first.
    fn texture(bytes: [u8; 4], clamp: bool, meaning: Meaning) -> Texture {
        let bitmap = Bitmap {
            width: 2,
            height: 2,
            texels: Texels::Bytes(bytes.map(|b| [b, b, b, 255]).to_vec()),
            has_alpha: false,
        };
        Texture {
            clamp,
            meaning,
            ..Texture::of_bitmap(Arc::new(bitmap))
        }
    }

    #[test]
    fn lookups_are_bilinear_and_upright() {
        let t = texture([0, 255, 51, 102], false, Meaning::Data);
        let at = |u, v| t.value(Vec2::new(u, v));
        let close = |a: f32, b: f32| assert!((a - b).abs() < 1e-6, "{a} {b}");
        // Centres of pixels: v goes up.
        close(at(0.25, 0.75), 0.0);
        close(at(0.75, 0.75), 1.0);
        close(at(0.25, 0.25), 0.2);
        close(at(0.75, 0.25), 0.4);
        close(at(0.5, 0.75), 0.5);
        close(at(0.5, 0.5), 0.4);
        // Repeated: the border is half way to the other side.
        close(at(0.0, 0.75), 0.5);
        close(at(-0.75, 3.25), 0.2);
        let c = texture([0, 255, 51, 102], true, Meaning::Data);
        close(c.value(Vec2::new(0.0, 0.75)), 0.0);
        close(c.value(Vec2::new(7.0, 7.0)), 1.0);
        close(t.slope(Vec2::new(0.5, 0.75)).x, 1.0);
    }

    #[test]
    fn colours_are_decoded_before_they_are_mixed() {
        let t = texture([0, 255, 0, 255], false, Meaning::Colour);
        assert!((t.colour(Vec2::new(0.5, 0.5)) - Vec3::splat(0.5)).length() < 1e-6);
        let half = texture([188; 4], false, Meaning::Colour);
        assert!((half.colour(Vec2::ZERO).x - 0.5029).abs() < 1e-3);
        assert!((half.mean().x - 0.5029).abs() < 1e-3);
    }
}
