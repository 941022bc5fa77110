//! Parts of a render: some of its samples, some of its pixels, for one of many machines.

use crate::film::Window;
use crate::render::PASS;
use crate::sampler::mix;
use serde::{Deserialize, Serialize};
use std::fmt;
use std::ops::Range;
use std::str::FromStr;

/// One of several parts of the samples, such as `3/16`.
///
/// ```
/// use gdpt::part::{Part, Samples};
///
/// let part: Part = "3/16".parse().unwrap();
/// // Whole passes of four samples: together the parts have each sample once.
/// assert_eq!(Samples::Some { part, all: 1024 }.range(), 128..192);
/// ```
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct Part {
    /// From 1 to `parts`.
    pub number: u32,
    /// How many there are.
    pub parts: u32,
}

/// Most parts.
const MOST: u32 = 100_000;

/// The samples that a film is to hold.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub enum Samples {
    /// All from the first on, as many as there are.
    All,
    /// Some of one sequence of `all` samples: together the parts have each sample once.
    Some {
        /// Which part.
        part: Part,
        /// Samples of all parts together.
        all: u64,
    },
    /// As many as fit into its time, of a sequence that no other part has.
    Own(Part),
}

/// What a film is to hold of its picture.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct Share {
    /// Which pixels.
    pub window: Window,
    /// Which samples of each.
    pub samples: Samples,
}

impl Samples {
    /// Which part, if it is one.
    pub fn part(&self) -> Option<Part> {
        match *self {
            Samples::All => None,
            Samples::Some { part, .. } | Samples::Own(part) => Some(part),
        }
    }

    /// The samples by their number in the sequence; without an end where there is none.
    pub fn range(&self) -> Range<u64> {
        match *self {
            Samples::All | Samples::Own(_) => 0..u64::MAX,
            Samples::Some { part, all } => part.range(all),
        }
    }

    /// What of it the film's bits depend on, by name; of these `part` differs between the parts of one render.
    pub fn identity(&self) -> Vec<(&'static str, String)> {
        let of_part = |part: Part, all: String| {
            vec![
                ("part", part.number.to_string()),
                ("number of parts", part.parts.to_string()),
                ("spp", all),
            ]
        };
        match *self {
            Samples::All => Vec::new(),
            Samples::Some { part, all } => of_part(part, all.to_string()),
            Samples::Own(part) => of_part(part, "as many as fit".to_owned()),
        }
    }

    /// The seed of the sequence, where the render's is `seed`.
    pub fn seed(&self, seed: u64) -> u64 {
        match *self {
            Samples::All | Samples::Some { .. } => seed,
            // The first part's too is no other render's.
            Samples::Own(Part { number, parts }) => {
                mix(seed ^ mix(u64::from(parts) << 32 | u64::from(number)))
            }
        }
    }
}

impl Share {
    /// Whether it can be: not so in files that are damaged.
    pub fn is_valid(&self) -> bool {
        self.window.is_valid() && self.samples.part().is_none_or(Part::is_valid)
    }
}

impl Part {
    /// Whether it can be.
    fn is_valid(self) -> bool {
        (1..=self.parts).contains(&self.number) && self.parts <= MOST
    }

    /// Its samples of `all`: whole passes, but that the last part's may be cut short. Empty only if there are more
    /// parts than passes.
    pub fn range(self, all: u64) -> Range<u64> {
        let passes = all.div_ceil(PASS);
        let start = |number: u32| {
            let passes = u128::from(passes) * u128::from(number) / u128::from(self.parts);
            (passes as u64 * PASS).min(all)
        };
        start(self.number - 1)..start(self.number)
    }
}

impl FromStr for Part {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        let numbers = text.split_once('/');
        let numbers = numbers.and_then(|(k, n)| Some((k.parse().ok()?, n.parse().ok()?)));
        let part = numbers.map(|(number, parts)| Self { number, parts });
        part.filter(|p| p.is_valid()).ok_or_else(|| {
            format!("a part is one of several, from 1/16 to 16/16 for example (of at most {MOST})")
        })
    }
}

impl fmt::Display for Part {
    fn fmt(&self, f: &mut fmt::Formatter) -> fmt::Result {
        write!(f, "{}/{}", self.number, self.parts)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    proptest! {
        #[test]
        fn parts_have_each_sample_once(all in 1u64..5000, parts in 1u32..300) {
            let mut next = 0;
            for number in 1..=parts {
                let range = Part { number, parts }.range(all);
                prop_assert_eq!(range.start, next);
                prop_assert_eq!(range.start % PASS, 0);
                if u64::from(parts) <= all.div_ceil(PASS) {
                    prop_assert!(!range.is_empty());
                }
                next = range.end;
            }
            prop_assert_eq!(next, all);
        }
    }

    #[test]
    fn parts_are_read_as_they_are_written() {
        let part = Part {
            number: 3,
            parts: 16,
        };
        assert_eq!(part.to_string().parse(), Ok(part));
        for wrong in [
            "", "3", "0/4", "5/4", "-1/4", "1/0", "a/b", "1/4/2", "1/200000", "1 / 4",
        ] {
            assert!(wrong.parse::<Part>().is_err(), "{wrong}");
        }
    }

    #[test]
    fn parts_with_sequences_of_their_own_have_seeds_of_their_own() {
        let seeds = (1..=64).map(|number| Samples::Own(Part { number, parts: 64 }).seed(1));
        let mut seeds: Vec<u64> = seeds.chain([1]).collect();
        seeds.sort_unstable();
        seeds.dedup();
        assert_eq!(seeds.len(), 65);
    }
}
