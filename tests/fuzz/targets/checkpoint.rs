//! Checkpoints of a film of 3 by 2 pixels. Inputs go without their checksum, which is put right here: no
//! fuzzer guesses it.
#![no_main]

mod common;

use gdpt::checkpoint::{self, Identity};
use gdpt::film::Film;
use libfuzzer_sys::fuzz_target;

fuzz_target!(init: common::abort_on_panic(), |data: &[u8]| {
    let mut data = data.to_vec();
    let checksum = checkpoint::checksum(&data);
    data.extend(checksum.to_le_bytes());
    let path = common::file("input.gdpt", &data);
    let mut film = Film::new(3, 2, 32);
    if checkpoint::load(&path, &Identity::new(), &mut film).is_ok() {
        film.estimate(gdpt::film::Halves::Both);
    }
});
