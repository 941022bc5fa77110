//! What was met of one kind, counted: one message for all of it, with the first place.

/// Names in one message; more are counted.
const NAMES: usize = 8;

/// Things of one kind in the order in which they were met.
#[derive(Debug, Default)]
pub struct Tally {
    /// File and line.
    first: String,
    /// What each is called, and how often it was met.
    met: Vec<(String, usize)>,
}

impl Tally {
    /// Counts one more at a place, file and line.
    pub fn add(&mut self, at: &str, name: &str) {
        if self.met.is_empty() {
            self.first = at.to_owned();
        }
        match self.met.iter_mut().find(|(met, _)| met == name) {
            Some((_, count)) => *count += 1,
            None => self.met.push((name.to_owned(), 1)),
        }
    }

    /// The first place, `what`, and the names; `None` where nothing was met.
    pub fn message(&self, what: &str) -> Option<String> {
        let name = |(name, count): &(String, usize)| match count {
            1 => name.clone(),
            _ => format!("{name} ({count} times)"),
        };
        let mut names: Vec<String> = self.met.iter().take(NAMES).map(name).collect();
        if self.met.len() > NAMES {
            names.push(format!("{} more", self.met.len() - NAMES));
        }
        let message = format!("{}: {what}: {}", self.first, names.join(", "));
        (!self.met.is_empty()).then_some(message)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn names_are_counted_and_the_first_place_is_told() {
        let mut tally = Tally::default();
        assert_eq!(tally.message("left out"), None);
        for (line, name) in ["a", "b", "a"].iter().enumerate() {
            tally.add(&format!("x:{}", line + 4), name);
        }
        let message = tally.message("left out").unwrap();
        assert_eq!(message, "x:4: left out: a (2 times), b");
        for name in 0..10 {
            tally.add("x:9", &name.to_string());
        }
        let message = tally.message("left out").unwrap();
        assert!(message.ends_with(", 5, 4 more"), "{message}");
    }
}
