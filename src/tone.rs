//! Tone curves: from light of any brightness to what a display can show.

use glam::{Mat3, Vec3};

/// A tone curve.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash, clap::ValueEnum, serde::Serialize)]
#[serde(rename_all = "lowercase")]
pub enum Tone {
    /// None: what is above 1 is white.
    Srgb,
    /// Khronos PBR Neutral: colours as they are up to 0.8, brighter ones ever nearer to white.
    #[default]
    Neutral,
    /// AgX: like film, with less contrast and paler bright colours.
    Agx,
}

/// Brighter light is white in every curve; an infinite one would have no colour.
const BRIGHTEST: f32 = 1e9;

impl Tone {
    /// As the flags have it.
    pub fn name(self) -> &'static str {
        match self {
            Tone::Srgb => "srgb",
            Tone::Neutral => "neutral",
            Tone::Agx => "agx",
        }
    }

    /// What a display shows for linear sRGB light: linear too, from 0 to 1. What is below 0 or no number is
    /// black.
    pub fn apply(self, light: Vec3) -> Vec3 {
        let shown = |x: f32| {
            if x.is_nan() {
                0.0
            } else {
                x.clamp(0.0, BRIGHTEST)
            }
        };
        let light = light.to_array().map(shown);
        let shown = match self {
            Tone::Srgb => light.into(),
            Tone::Neutral => neutral(light.into()),
            Tone::Agx => agx(light.into()),
        };
        shown.clamp(Vec3::ZERO, Vec3::ONE)
    }
}

/// Khronos PBR Neutral, as its specification has it (Khronos Group 2024).
fn neutral(light: Vec3) -> Vec3 {
    const START: f32 = 0.8 - 0.04;
    const DESATURATION: f32 = 0.15;
    // What a dielectric reflects at normal incidence goes off.
    let least = light.min_element();
    let offset = if least < 0.08 {
        least - 6.25 * least * least
    } else {
        0.04
    };
    let colour = light - offset;
    let peak = colour.max_element();
    if peak < START {
        return colour;
    }
    // Bright colours are compressed, and become paler.
    let d = 1.0 - START;
    let compressed = 1.0 - d * d / (peak + d - START);
    let paler = 1.0 - 1.0 / (DESATURATION * (peak - compressed) + 1.0);
    (colour * (compressed / peak)).lerp(Vec3::splat(compressed), paler)
}

/// AgX by Sobotka, with the curve that Wrensch fitted to it ("Minimal AgX implementation", 2023). Its display
/// has a gamma of 2.2.
fn agx(light: Vec3) -> Vec3 {
    // Columns.
    const INSET: Mat3 = Mat3::from_cols_array(&[
        0.842_479_06,
        0.042_328_242,
        0.042_375_655, //
        0.078_433_6,
        0.878_468_64,
        0.078_433_6, //
        0.079_223_745,
        0.079_166_13,
        0.879_143,
    ]);
    const OUTSET: Mat3 = Mat3::from_cols_array(&[
        1.196_879,
        -0.052_896_852,
        -0.052_971_635, //
        -0.098_020_88,
        1.151_903_1,
        -0.098_043_45, //
        -0.099_029_74,
        -0.098_961_18,
        1.151_073_7,
    ]);
    const LOWEST: f32 = -12.473_93;
    const HIGHEST: f32 = 4.026_069;
    let curve = |light: f32| {
        let stops = light.log2().clamp(LOWEST, HIGHEST);
        let x = (stops - LOWEST) / (HIGHEST - LOWEST);
        let (x2, x4) = (x * x, x * x * x * x);
        15.5 * x4 * x2 - 40.14 * x4 * x + 31.96 * x4 - 6.868 * x2 * x + 0.4298 * x2 + 0.1191 * x
            - 0.002_32
    };
    let shown = OUTSET * Vec3::from((INSET * light).to_array().map(curve));
    shown.max(Vec3::ZERO).powf(2.2)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn close(tone: Tone, light: [f32; 3], wanted: [f32; 3]) {
        let shown = tone.apply(light.into());
        let far = (shown - Vec3::from(wanted)).abs().max_element();
        assert!(far < 1e-5, "{tone:?} of {light:?} is {shown}");
    }

    /// Values that the published shader code gives in double precision.
    #[test]
    fn curves_have_their_published_values() {
        close(Tone::Srgb, [0.5, 1.5, -1.0], [0.5, 1.0, 0.0]);
        // Below 0.08, at the offset of 0.04, beyond the start of compression, and a bright colour.
        close(Tone::Neutral, [0.04; 3], [0.01; 3]);
        close(Tone::Neutral, [0.5; 3], [0.46; 3]);
        close(Tone::Neutral, [0.8, 0.3, 0.1], [0.76, 0.26, 0.06]);
        close(Tone::Neutral, [2.0; 3], [0.96; 3]);
        close(
            Tone::Neutral,
            [5.0, 1.0, 0.2],
            [0.987_027, 0.488_269_8, 0.388_518_4],
        );
        close(
            Tone::Agx,
            [0.18; 3],
            [0.214_467_4, 0.214_532_7, 0.214_536_7],
        );
        close(
            Tone::Agx,
            [5.0, 1.0, 0.2],
            [0.955_457_8, 0.624_135_9, 0.372_424_4],
        );
    }

    #[test]
    fn curves_grow_from_black_to_white() {
        for tone in [Tone::Srgb, Tone::Neutral, Tone::Agx] {
            let mut last = -1.0;
            for step in 0..2000 {
                let light = (-14.0 + 0.01 * step as f32).exp2();
                let shown = tone.apply(Vec3::splat(light));
                // The fitted curve of AgX is not quite monotonic in its toe.
                let slack = if tone == Tone::Agx { 1e-6 } else { 0.0 };
                assert!(shown.x >= last - slack, "{tone:?} at {light}");
                assert!((shown.x - shown.y).abs() < 1e-3, "{tone:?} at {light}");
                last = shown.x;
            }
            assert!(last > 0.95, "{tone:?}: {last}");
            assert!(tone.apply(Vec3::splat(0.0)).max_element() < 1e-4);
            assert!(tone.apply(Vec3::splat(f32::INFINITY)).min_element() > 0.98);
            assert_eq!(tone.apply(Vec3::splat(f32::NAN)), tone.apply(Vec3::ZERO));
        }
    }
}
