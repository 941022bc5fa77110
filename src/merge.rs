//! Films of parts and crops of one render, put together into one.
//!
//! Headers are read first, and say what belongs together; then one film after another is added, in an order that
//! does not depend on that of the files. So there is never more than one film in memory.

use crate::checkpoint::{About, Header, Identity, Opened, Progress, difference};
use crate::error::{Error, Result};
use crate::film::{Counted, Film, Window};
use crate::part::Share;
use crate::render::TILE_SIZE;
use std::collections::{BTreeMap, BTreeSet};
use std::path::{Path, PathBuf};

/// What the bits of the film of a part depend on, and those of others not.
pub const OF_ONE_PART: [&str; 2] = ["part", "crop"];

/// Which files become one film.
#[derive(Debug)]
pub struct Plan {
    /// The pixels of the film.
    pub window: Window,
    /// What its bits depend on.
    pub identity: Identity,
    /// What all films have counted, and their times.
    pub progress: Progress,
    /// What is to be told of the first of them.
    pub about: About,
    /// What there is to say: what is missing, or left out.
    pub remarks: Vec<String>,
    /// What the machines compute with, each once.
    pub processors: BTreeSet<String>,
    /// In the order in which they are added.
    members: Vec<Member>,
}

/// A file with what is kept of its header: there may be thousands.
#[derive(Clone, Debug)]
struct Member {
    path: PathBuf,
    share: Share,
    progress: Progress,
}

impl Member {
    /// Its place in the order in which films are added.
    fn place(&self) -> (Window, u32) {
        (self.share.window, self.number())
    }

    /// From 1 on.
    fn number(&self) -> u32 {
        self.share.samples.part().map_or(1, |p| p.number)
    }

    fn parts(&self) -> u32 {
        self.share.samples.part().map_or(1, |p| p.parts)
    }
}

/// What the film of a header has in common with all that belong to it.
fn common(header: &Header) -> Identity {
    let mut identity = header.identity.clone();
    identity.retain(|name, _| !OF_ONE_PART.contains(&name.as_str()));
    // Samples do not depend on it, but a picture has one.
    identity.insert("background".into(), header.about.background.clone());
    identity
}

/// The headers of all files.
struct Headers {
    /// In the order in which their films are added.
    members: Vec<Member>,
    /// What they have in common.
    identity: Identity,
    /// That of the first one.
    about: About,
    processors: BTreeSet<String>,
}

impl Headers {
    /// Reads them. Refuses those that are not of the render of which most are.
    fn read(paths: &[PathBuf]) -> Result<Self> {
        let mut members = Vec::new();
        let mut processors = BTreeSet::new();
        let mut first = None;
        // Of each render that there is a film of: how many there are, and the first of them.
        let mut renders: Vec<(Identity, Vec<usize>)> = Vec::new();
        for (index, path) in paths.iter().enumerate() {
            let file = Opened::open(path)?;
            file.check_length(Film::bytes_of(file.header.share.window))?;
            let header = file.header;
            let identity = common(&header);
            processors.insert(header.about.processor.clone());
            match renders.iter_mut().find(|(there, _)| *there == identity) {
                Some((_, of)) => of.push(index),
                None => renders.push((identity, vec![index])),
            }
            let member = Member {
                path: path.clone(),
                share: header.share,
                progress: header.progress,
            };
            if first
                .as_ref()
                .is_none_or(|(place, _)| member.place() < *place)
            {
                first = Some((member.place(), header.about));
            }
            members.push(member);
        }
        renders.sort_by_key(|(_, of)| std::cmp::Reverse(of.len()));
        let mut renders = renders.into_iter();
        let (Some((identity, of)), Some((_, about))) = (renders.next(), first) else {
            return Err(Error::Setting("there is nothing to merge".into()));
        };
        let of = &members[of[0]];
        if let Some((other, them)) = renders.next() {
            let difference = difference(&other, &identity).unwrap_or_default();
            let message = format!(
                "is of another render than {}: {difference}",
                of.path.display()
            );
            return Err(Error::input(&members[them[0]].path, None, message));
        }
        let size = of.share.window.picture;
        if let Some(other) = members.iter().find(|m| m.share.window.picture != size) {
            return Err(Error::input(
                &other.path,
                None,
                "is of a picture of another size",
            ));
        }
        members.sort_by_key(Member::place);
        Ok(Self {
            members,
            identity,
            about,
            processors,
        })
    }
}

impl Plan {
    /// What the files hold together. Refuses what does not belong, or holds what another one holds, and what lacks
    /// anything unless it may be `partial`.
    pub fn new(paths: &[PathBuf], partial: bool) -> Result<Self> {
        let Headers {
            members,
            identity,
            about,
            processors,
        } = Headers::read(paths)?;
        no_overlap(&members)?;

        // What is missing.
        let mut missing = Vec::new();
        let unfinished = members.iter().filter(|m| !m.progress.finished);
        let unfinished: Vec<String> = unfinished.map(|m| m.path.display().to_string()).collect();
        if !unfinished.is_empty() {
            missing.push(format!("not finished: {}", unfinished.join(", ")));
        }
        let mut windows: BTreeMap<Window, BTreeSet<u32>> = BTreeMap::new();
        for member in &members {
            windows
                .entry(member.share.window)
                .or_default()
                .insert(member.number());
        }
        // There is one at least.
        let parts = members[0].parts();
        for (window, numbers) in &windows {
            let absent: Vec<u32> = (1..=parts).filter(|n| !numbers.contains(n)).collect();
            if !absent.is_empty() {
                let of = if window.is_whole() {
                    String::new()
                } else {
                    format!(" of the crop {window}")
                };
                missing.push(format!("part {} of {parts}{of} missing", ranges(&absent)));
            }
        }
        let of_first = members[0].share.window;
        let window = windows
            .keys()
            .fold(of_first, |all, window| all.with(window));
        let covered: usize = windows.keys().map(Window::pixels).sum();
        if covered < window.pixels() {
            return Err(Error::Setting(format!(
                "the crops leave gaps: {} of {} pixels within {window} are in none",
                window.pixels() - covered,
                window.pixels()
            )));
        }
        if !window.is_whole() {
            let (width, height) = window.picture;
            missing.push(format!(
                "only the crop {window} of {width}x{height} is there"
            ));
        }
        if !missing.is_empty() && !partial {
            return Err(Error::Setting(format!(
                "{}; --partial makes the picture of what is there",
                missing.join("; ")
            )));
        }

        // All pixels have the same samples: what only some crops have is left out.
        let everywhere = |number: &u32| windows.values().all(|numbers| numbers.contains(number));
        let (kept, left): (Vec<_>, Vec<_>) =
            members.into_iter().partition(|m| everywhere(&m.number()));
        if !left.is_empty() {
            let names: Vec<String> = left.iter().map(|m| m.path.display().to_string()).collect();
            let names = names.join(", ");
            missing.push(format!(
                "left out, as other crops do not have these parts: {names}"
            ));
        }
        if kept.is_empty() {
            return Err(Error::Setting("no part is there of all crops".into()));
        }

        let mut progress = Progress {
            finished: missing.is_empty(),
            ..Progress::default()
        };
        for member in &kept {
            progress.counts.add(&member.progress.counts);
            progress.seconds += member.progress.seconds;
        }
        Ok(Self {
            window,
            identity,
            progress,
            about,
            remarks: missing,
            processors,
            members: kept,
        })
    }

    /// Number of films, at least one.
    pub fn films(&self) -> usize {
        self.members.len()
    }

    /// Adds all films. `progress` is called after each, with how many there are so far.
    pub fn sum(&self, progress: &mut dyn FnMut(usize)) -> Result<Film> {
        let mut film = Film::of(self.window, TILE_SIZE);
        let mut samples: BTreeMap<u32, ([Counted; 2], &Path)> = BTreeMap::new();
        for (index, member) in self.members.iter().enumerate() {
            let Member {
                path,
                share,
                progress: done,
            } = member;
            let mut file = Opened::open(path)?;
            let header = &file.header;
            let is_the_same = header.share == *share
                && header.progress == *done
                && common(header) == self.identity;
            if !is_the_same {
                return Err(Error::input(path, None, "has changed while it was read"));
            }
            file.check_length(Film::bytes_of(share.window))?;
            let counted = file.read(|mut input| film.add_from(share.window, &mut input))?;
            let number = member.number();
            match samples.get(&number) {
                Some((there, other)) if *there != counted => {
                    let message = format!(
                        "has {} samples of each pixel, but {} has {}: crops must have the same",
                        counted[0].samples + counted[1].samples,
                        other.display(),
                        there[0].samples + there[1].samples
                    );
                    return Err(Error::input(path, None, message));
                }
                Some(_) => (),
                None => {
                    film.count_samples(counted);
                    samples.insert(number, (counted, path));
                }
            }
            progress(index + 1);
        }
        Ok(film)
    }
}

/// Refuses two films that hold the same samples of a pixel, and crops that share some of their pixels. The members
/// are in order.
fn no_overlap(members: &[Member]) -> Result<()> {
    let of_one_window = members.chunk_by(|a, b| a.share.window == b.share.window);
    let mut windows: Vec<&Member> = Vec::new();
    for same in of_one_window {
        for pair in same.windows(2) {
            if pair[0].number() == pair[1].number() {
                return Err(both_hold("samples", &pair[1], &pair[0]));
            }
        }
        if let Some(other) = windows
            .iter()
            .find(|m| m.share.window.meets(&same[0].share.window))
        {
            return Err(both_hold("pixels", &same[0], other));
        }
        windows.push(&same[0]);
    }
    Ok(())
}

fn both_hold(what: &str, one: &Member, other: &Member) -> Error {
    let message = format!("holds {what} that {} holds too", other.path.display());
    Error::input(&one.path, None, message)
}

/// Numbers in ascending order, as `1-3, 7`.
fn ranges(numbers: &[u32]) -> String {
    let stretches = numbers.chunk_by(|a, b| a + 1 == *b);
    let names = stretches.map(|stretch| match stretch {
        [one] => one.to_string(),
        [first, .., last] => format!("{first}-{last}"),
        [] => String::new(),
    });
    names.collect::<Vec<_>>().join(", ")
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn numbers_in_a_row_are_one_range() {
        assert_eq!(ranges(&[1]), "1");
        assert_eq!(ranges(&[1, 2, 3, 7, 9, 10]), "1-3, 7, 9-10");
    }
}
