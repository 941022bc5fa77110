//! Checkpoints, gone on from and merged. Inputs go without their checksum, which is put right here: no fuzzer guesses it.
#![no_main]

mod common;

use gdpt::checkpoint::{self, Opened};
use gdpt::film::{Film, Halves};
use gdpt::merge::Plan;
use libfuzzer_sys::fuzz_target;

/// Larger films take too long.
const MOST_PIXELS: usize = 10_000;

fuzz_target!(init: common::abort_on_panic(), |data: &[u8]| {
    let mut data = data.to_vec();
    let checksum = checkpoint::checksum(&data);
    data.extend(checksum.to_le_bytes());
    let path = common::file("input.gdpt", &data);
    let Ok(file) = Opened::open(&path) else {
        return;
    };
    let share = file.header.share;
    if share.window.pixels() > MOST_PIXELS {
        return;
    }
    share.samples.range();
    let mut film = Film::of(share.window, 32);
    if checkpoint::load(&path, &file.header.identity, &mut film).is_ok() {
        film.estimate(Halves::Both);
    }
    if let Ok(plan) = Plan::new(&[path], true) {
        let _ = plan.sum(&mut |_| ());
    }
});
