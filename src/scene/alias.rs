//! A choice by weight in constant time: the alias table (Walker 1977, built as by Vose 1991).

/// Indices in proportion to weights.
#[derive(Clone, Debug, Default)]
pub struct Alias {
    bins: Vec<Bin>,
}

/// A share of 1/n of the unit interval: of it, `own` goes to the bin's own index, the rest to `other`.
#[derive(Clone, Copy, Debug)]
pub(super) struct Bin {
    own: f32,
    other: u32,
}

impl Alias {
    /// The table of weights, not negative, with a positive sum.
    pub fn new(weights: &[f64]) -> Self {
        let n = weights.len();
        let scale = n as f64 / weights.iter().sum::<f64>();
        let mut share: Vec<f64> = weights.iter().map(|w| w * scale).collect();
        let mut bins: Vec<Bin> = (0..n as u32).map(|other| Bin { own: 1.0, other }).collect();
        let (mut small, mut large): (Vec<usize>, Vec<usize>) =
            (0..n).partition(|&i| share[i] < 1.0);
        while let (Some(&s), Some(&l)) = (small.last(), large.last()) {
            small.pop();
            bins[s] = Bin {
                own: share[s] as f32,
                other: l as u32,
            };
            share[l] -= 1.0 - share[s];
            if share[l] < 1.0 {
                large.pop();
                small.push(l);
            }
        }
        Self { bins }
    }

    /// The index for `u` in [0, 1).
    #[inline]
    pub fn choose(&self, u: f32) -> usize {
        Bin::choose(&self.bins, |bin| *bin, u)
    }

    /// The bins, in the order of the weights.
    pub(super) fn into_bins(self) -> Vec<Bin> {
        self.bins
    }
}

impl Bin {
    /// The index for `u` in [0, 1) among things that hold the bins of a table.
    #[inline]
    pub(super) fn choose<T>(things: &[T], bin: impl Fn(&T) -> Bin, u: f32) -> usize {
        let x = u * things.len() as f32;
        let index = (x as usize).min(things.len() - 1);
        let bin = bin(&things[index]);
        if x - (index as f32) < bin.own {
            index
        } else {
            bin.other as usize
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn indices_come_in_proportion_to_weights() {
        let weights = [3.0, 0.0, 1.0, 0.5, 7.5, 4.0];
        let table = Alias::new(&weights);
        const STEPS: usize = 1 << 16;
        let mut counts = [0.0; 6];
        for i in 0..STEPS {
            counts[table.choose((i as f32 + 0.5) / STEPS as f32)] += 1.0 / STEPS as f64;
        }
        for (count, weight) in counts.iter().zip(weights) {
            assert!((count - weight / 16.0).abs() < 1e-3, "{counts:?}");
        }
    }
}
