//! Counts of rays, dead shifts and dropped samples.

use crate::shift::Death;
use crate::trace::RayKind;
use serde::{Deserialize, Serialize};

/// Counts over the work done.
#[derive(Clone, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
pub struct Counts {
    /// Rays by kind, see [`RayKind::index`].
    pub rays: [u64; RayKind::ALL.len()],
    /// Dead shifts by reason, see [`Death::ALL`].
    pub deaths: [u64; Death::ALL.len()],
    /// Samples dropped because they were not finite.
    pub dropped: u64,
    /// The first of them, in the order of samples and pixels: column, row and sample number.
    pub first_dropped: [Option<(u32, u32, u64)>; 4],
}

impl Counts {
    /// Adds what another tile counted.
    pub fn add(&mut self, other: &Counts) {
        self.add_rays(other.rays);
        self.deaths
            .iter_mut()
            .zip(other.deaths)
            .for_each(|(a, b)| *a += b);
        self.dropped += other.dropped;
        other
            .first_dropped
            .iter()
            .flatten()
            .for_each(|&d| self.note_dropped(d));
    }

    /// Adds rays by kind.
    pub(super) fn add_rays(&mut self, rays: [u64; RayKind::ALL.len()]) {
        self.rays.iter_mut().zip(rays).for_each(|(a, b)| *a += b);
    }

    /// Counts dead shifts, one for each bit of `lanes`.
    #[inline(always)]
    pub(super) fn die(&mut self, death: Death, lanes: u32) {
        self.deaths[death as usize] += u64::from(lanes.count_ones());
    }

    /// Keeps a dropped sample if it is among the first: the least, so that it does not matter which thread
    /// came first.
    pub(super) fn note_dropped(&mut self, dropped: (u32, u32, u64)) {
        let order = |(x, y, n): (u32, u32, u64)| (n, y, x);
        let mut rest = Some(dropped);
        for place in &mut self.first_dropped {
            match (*place, rest) {
                (_, None) => return,
                (None, _) => (*place, rest) = (rest, None),
                (Some(there), Some(new)) if order(new) < order(there) => {
                    (*place, rest) = (rest, *place);
                }
                _ => (),
            }
        }
    }
}
