//! The film as bytes, for checkpoints: exactly its sums, little-endian.

use super::{Film, HalfPixel, Pixel};
use glam::Vec3;
use std::io::{Read, Result, Write};

impl Film {
    /// Bytes that [`Film::write_to`] writes.
    pub fn bytes(&self) -> u64 {
        let pixels: usize = self.tiles.iter().map(|t| t.pixels.len()).sum();
        48 + (pixels * BYTES) as u64
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
        Ok(())
    }

    /// Replaces the sums with those of a film of the same size.
    pub fn read_from(&mut self, input: &mut impl Read) -> Result<()> {
        for n in &mut self.samples {
            let mut bytes = [0; 8];
            input.read_exact(&mut bytes)?;
            *n = u64::from_le_bytes(bytes);
        }
        for weight in self.weights.iter_mut().chain(&mut self.squares) {
            let mut bytes = [0; 8];
            input.read_exact(&mut bytes)?;
            *weight = f64::from_le_bytes(bytes);
        }
        for pixel in self.tiles.iter_mut().flat_map(|t| &mut t.pixels) {
            let mut bytes = [0; BYTES];
            input.read_exact(&mut bytes)?;
            *pixel = Pixel::from_bytes(&bytes);
        }
        Ok(())
    }
}

/// Numbers of 4 bytes in a pixel.
const WORDS: usize = 2 * 21 + 10;
const BYTES: usize = 4 * WORDS;
const _: () = assert!(BYTES == super::BYTES_PER_PIXEL);

impl Pixel {
    fn to_bytes(self) -> [u8; BYTES] {
        let mut words = [0u32; WORDS];
        let mut places = words.iter_mut();
        let mut put = |word: u32| *places.next().expect("as many words as asserted") = word;
        let mut vector = |v: Vec3| v.to_array().iter().for_each(|x| put(x.to_bits()));
        for half in &self.halves {
            half.vectors().into_iter().for_each(&mut vector);
        }
        vector(self.albedo);
        vector(self.normal);
        put(self.depth.to_bits());
        put(self.hits);
        put(self.coverage.to_bits());
        put(self.dropped);
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
        Self {
            halves,
            albedo,
            normal,
            depth: f32::from_bits(word()),
            hits: word(),
            coverage: f32::from_bits(word()),
            dropped: word(),
        }
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
