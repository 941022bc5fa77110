//! Choices by cumulative weights, which keep even numbers even: by an indexed search (Chen and Asau 1974).

/// Cumulative tables of the same length, one after another, with entries into them.
#[derive(Clone)]
pub(super) struct Cumulative {
    /// Sums of shares: the last of each table is 1, or 0 where all weights are.
    sums: Vec<f32>,
    length: usize,
    /// For each of so many equal parts of [0, 1) the index at its beginning, table by table.
    entries: Vec<u32>,
    parts: usize,
}

/// An entry serves so many indices in the mean, which are side by side in memory.
const INDICES: usize = 4;

impl Cumulative {
    /// Room for `tables` tables of `length` weights.
    pub(super) fn new(length: usize, tables: usize) -> Self {
        let parts = length.div_ceil(INDICES);
        Self {
            sums: Vec::with_capacity(length * tables),
            length,
            entries: Vec::with_capacity(parts * tables),
            parts,
        }
    }

    /// Adds a table of the weights, not negative, and returns their sum.
    pub(super) fn push(&mut self, weights: impl Iterator<Item = f64>) -> f64 {
        let first = self.sums.len();
        let mut sum = 0.0;
        let cumulative: Vec<f64> = weights
            .map(|weight| {
                sum += weight;
                sum
            })
            .collect();
        debug_assert_eq!(cumulative.len(), self.length);
        let share = |c: f64| if sum > 0.0 { (c / sum) as f32 } else { 0.0 };
        self.sums.extend(cumulative.into_iter().map(share));
        let mut index = 0;
        for part in 0..self.parts {
            let begin = part as f32 / self.parts as f32;
            while index + 1 < self.length && self.sums[first + index] <= begin {
                index += 1;
            }
            self.entries.push(index as u32);
        }
        sum
    }

    /// The index of a table on which `u` in [0, 1) falls, and where inside from 0 to 1.
    #[inline]
    pub(super) fn invert(&self, table: usize, u: f32) -> (usize, f32) {
        let sums = &self.sums[table * self.length..][..self.length];
        let part = ((u * self.parts as f32) as usize).min(self.parts - 1);
        let mut index = self.entries[table * self.parts + part] as usize;
        while index + 1 < self.length && sums[index] <= u {
            index += 1;
        }
        // Where `u` has been rounded up to the part.
        while index > 0 && sums[index - 1] > u {
            index -= 1;
        }
        let low = if index == 0 { 0.0 } else { sums[index - 1] };
        let width = sums[index] - low;
        let inside = if width > 0.0 { (u - low) / width } else { 0.5 };
        (index, inside.clamp(0.0, 1.0 - f32::EPSILON))
    }

    /// The probability of an index of a table, as the table has it.
    #[inline]
    pub(super) fn probability(&self, table: usize, index: usize) -> f32 {
        let at = table * self.length + index;
        let low = if index == 0 { 0.0 } else { self.sums[at - 1] };
        self.sums[at] - low
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;
    use proptest::test_runner::RngSeed;

    proptest! {
        #![proptest_config(ProptestConfig { rng_seed: RngSeed::Fixed(3), failure_persistence: None, ..Default::default() })]
        #[test]
        fn entries_lead_where_a_plain_search_does(
            weights in prop::collection::vec(prop_oneof![Just(0.0), 0.0..1.0, 0.0..1e6], 1..300),
            u in prop::collection::vec(0f32..1.0, 32),
        ) {
            let mut tables = Cumulative::new(weights.len(), 2);
            tables.push(weights.iter().map(|w| w * w));
            let sum = tables.push(weights.iter().copied());
            prop_assume!(sum > 0.0);
            let sums = &tables.sums[weights.len()..];
            // On the borders, too.
            for &u in u.iter().chain(sums.iter().filter(|&&s| s < 1.0)) {
                let expected = sums.partition_point(|&c| c <= u).min(weights.len() - 1);
                let (index, inside) = tables.invert(1, u);
                prop_assert_eq!(index, expected);
                prop_assert!((0.0..1.0).contains(&inside));
            }
            let total: f32 = (0..weights.len()).map(|i| tables.probability(1, i)).sum();
            prop_assert!((total - 1.0).abs() < 1e-4);
        }
    }
}
