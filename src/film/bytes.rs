//! The film as bytes, for checkpoints: exactly its sums, little-endian.

use super::{Counted, Film, HalfPixel, MAX_SAMPLES, Outside, Pixel, Term, Window};
use crate::sums::Auxiliary;
use glam::Vec3;
use std::io::{Error, ErrorKind, Read, Result, Write};

impl Film {
    /// Bytes that [`Film::write_to`] writes.
    pub fn bytes(&self) -> u64 {
        Self::bytes_of(self.window)
    }

    /// Bytes that [`Film::write_to`] writes of a film of these pixels.
    pub fn bytes_of(window: Window) -> u64 {
        let left = if window.x > 0 { window.height } else { 0 };
        let up = if window.y > 0 { window.width } else { 0 };
        let outside = (left + up) as usize;
        (HEAD + window.pixels() * BYTES + outside * BYTES_OUTSIDE) as u64
    }

    /// Writes the sums of all samples. What tiles hold for their neighbours is empty between passes.
    pub fn write_to(&self, out: &mut impl Write) -> Result<()> {
        for n in self.samples {
            out.write_all(&n.to_le_bytes())?;
        }
        for weight in self.weights.iter().chain(&self.squares) {
            out.write_all(&weight.to_le_bytes())?;
        }
        for pixel in self.tiles.iter().flat_map(|t| &t.pixels) {
            out.write_all(&pixel.to_bytes())?;
        }
        for terms in self.outside.left.iter().chain(&self.outside.up) {
            out.write_all(&to_bytes(terms))?;
        }
        Ok(())
    }

    /// Replaces the sums with those of a film of the same pixels.
    pub fn read_from(&mut self, input: &mut impl Read) -> Result<()> {
        let counted = read_counted(input)?;
        self.samples = counted.map(|half| half.samples);
        self.weights = counted.map(|half| half.weight);
        self.squares = counted.map(|half| half.square);
        for pixel in self.tiles.iter_mut().flat_map(|t| &mut t.pixels) {
            *pixel = Pixel::read_from(input)?;
        }
        let Outside { left, up } = &mut self.outside;
        for terms in left.iter_mut().chain(up) {
            *terms = read_terms(input)?;
        }
        Ok(())
    }
}

/// Bytes before the pixels.
const HEAD: usize = 48;

/// What stands before the pixels.
pub(super) fn read_counted(input: &mut impl Read) -> Result<[Counted; 2]> {
    let mut word = || -> Result<[u8; 8]> {
        let mut bytes = [0; 8];
        input.read_exact(&mut bytes)?;
        Ok(bytes)
    };
    let samples = [word()?, word()?].map(u64::from_le_bytes);
    let weights = [word()?, word()?].map(f64::from_le_bytes);
    let squares = [word()?, word()?].map(f64::from_le_bytes);
    let finite = weights.iter().chain(&squares).all(|w| w.is_finite());
    if !finite || samples.iter().any(|&n| n > MAX_SAMPLES) {
        return Err(Error::new(
            ErrorKind::InvalidData,
            "its samples make no sense",
        ));
    }
    Ok([0, 1].map(|half| Counted {
        samples: samples[half],
        weight: weights[half],
        square: squares[half],
    }))
}

/// Bytes of what a pixel says of one difference to a pixel outside.
const BYTES_OUTSIDE: usize = 2 * 2 * 12;

fn to_bytes(terms: &[Term; 2]) -> [u8; BYTES_OUTSIDE] {
    let vectors = terms.iter().flat_map(|p| [p.sum, p.square]);
    let numbers = vectors.flat_map(|v| v.to_array());
    let mut bytes = [0; BYTES_OUTSIDE];
    for (place, number) in bytes.chunks_exact_mut(4).zip(numbers) {
        place.copy_from_slice(&number.to_le_bytes());
    }
    bytes
}

pub(super) fn read_terms(input: &mut impl Read) -> Result<[Term; 2]> {
    let mut bytes = [0; BYTES_OUTSIDE];
    input.read_exact(&mut bytes)?;
    let mut numbers = bytes
        .chunks_exact(4)
        .map(|b| f32::from_le_bytes(b.try_into().expect("4 bytes")));
    let mut vector = || Vec3::from_array([(); 3].map(|()| numbers.next().expect("12 numbers")));
    Ok([(); 2].map(|()| Term {
        sum: vector(),
        square: vector(),
    }))
}

/// Numbers of 4 bytes in a pixel.
const WORDS: usize = 2 * 21 + 10;
const BYTES: usize = 4 * WORDS;
const _: () = assert!(BYTES == super::BYTES_PER_PIXEL);

impl Pixel {
    pub(super) fn read_from(input: &mut impl Read) -> Result<Self> {
        let mut bytes = [0; BYTES];
        input.read_exact(&mut bytes)?;
        Ok(Self::from_bytes(&bytes))
    }

    fn to_bytes(self) -> [u8; BYTES] {
        let mut words = [0u32; WORDS];
        let mut places = words.iter_mut();
        let mut put = |word: u32| *places.next().expect("as many words as asserted") = word;
        let mut vector = |v: Vec3| v.to_array().iter().for_each(|x| put(x.to_bits()));
        for half in &self.halves {
            half.vectors().into_iter().for_each(&mut vector);
        }
        let Auxiliary {
            albedo,
            normal,
            depth,
            hits,
            coverage,
            dropped,
        } = self.auxiliary;
        vector(albedo);
        vector(normal);
        put(depth.to_bits());
        put(hits);
        put(coverage.to_bits());
        put(dropped);
        let mut bytes = [0; BYTES];
        for (place, word) in bytes.chunks_exact_mut(4).zip(words) {
            place.copy_from_slice(&word.to_le_bytes());
        }
        bytes
    }

    fn from_bytes(bytes: &[u8; BYTES]) -> Self {
        let mut words = bytes
            .chunks_exact(4)
            .map(|b| u32::from_le_bytes(b.try_into().expect("4 bytes")));
        let mut word = || words.next().expect("as many words as asserted");
        let mut vector = || Vec3::from_array([(); 3].map(|()| f32::from_bits(word())));
        let halves = [(); 2].map(|()| HalfPixel::from_vectors([(); 7].map(|()| vector())));
        let (albedo, normal) = (vector(), vector());
        let auxiliary = Auxiliary {
            albedo,
            normal,
            depth: f32::from_bits(word()),
            hits: word(),
            coverage: f32::from_bits(word()),
            dropped: word(),
        };
        Self { halves, auxiliary }
    }
}

impl HalfPixel {
    fn vectors(&self) -> [Vec3; 7] {
        let h = self;
        [
            h.primal,
            h.dx,
            h.dy,
            h.primal_sq,
            h.dx_sq,
            h.dy_sq,
            h.direct,
        ]
    }

    fn from_vectors([primal, dx, dy, primal_sq, dx_sq, dy_sq, direct]: [Vec3; 7]) -> Self {
        Self {
            primal,
            dx,
            dy,
            primal_sq,
            dx_sq,
            dy_sq,
            direct,
        }
    }
}
