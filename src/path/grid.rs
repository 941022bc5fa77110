//! Primary hits of a tile and its border, so stored that eight neighbours in a row can be loaded from any
//! place: the offset paths of eight pixels start one place further.

use crate::lanes::{LANES, mask_of};
use crate::vertex::VerticesX8;
use wide::f32x8;

/// Primary vertices row by row, each number of theirs in an array of its own.
#[derive(Default)]
pub(super) struct Grid {
    numbers: [Vec<f32>; VerticesX8::ROWS],
    /// A mask: where there is a surface.
    surfaces: Vec<f32>,
    /// Places in a row.
    pub(super) width: usize,
}

impl Grid {
    /// Makes room for `places` places in rows of `width`. What is there means nothing yet.
    pub(super) fn resize(&mut self, width: usize, places: usize) {
        self.width = width;
        let length = self.padding() + places.next_multiple_of(LANES) + self.padding();
        for list in self.numbers.iter_mut().chain([&mut self.surfaces]) {
            list.resize(length, 0.0);
        }
    }

    /// Loads begin up to a row before the first place, and end up to a row and a vector behind the last.
    fn padding(&self) -> usize {
        self.width + LANES
    }

    #[inline(always)]
    fn at(&self, place: usize, step: isize) -> usize {
        (self.padding() + place)
            .checked_add_signed(step)
            .expect("a step is at most a row")
    }

    /// Stores the vertices from `place` on, and a bit for each lane: whether it is a surface.
    #[inline(always)]
    pub(super) fn store(&mut self, place: usize, vertices: &VerticesX8, surfaces: u32) {
        let at = self.padding() + place;
        vertices.rows(|row, numbers| {
            self.numbers[row][at..at + LANES].copy_from_slice(numbers.as_array());
        });
        self.surfaces[at..at + LANES].copy_from_slice(mask_of(surfaces).as_array());
    }

    /// The vertices from `step` places after `place` on; `step` is at most a row.
    #[inline(always)]
    pub(super) fn load(&self, place: usize, step: isize) -> VerticesX8 {
        let at = self.at(place, step);
        VerticesX8::from_rows(|row| load(&self.numbers[row], at))
    }

    /// Which of them are surfaces.
    #[inline(always)]
    pub(super) fn surfaces(&self, place: usize, step: isize) -> u32 {
        let at = self.at(place, step);
        load(&self.surfaces, at).to_bitmask()
    }
}

#[inline(always)]
fn load(list: &[f32], at: usize) -> f32x8 {
    let numbers: [f32; LANES] = list[at..at + LANES].try_into().expect("as many as lanes");
    numbers.into()
}
