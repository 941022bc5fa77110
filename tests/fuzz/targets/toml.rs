//! The TOML beside a scene.
#![no_main]

mod common;

use gdpt::load::sidecar;
use libfuzzer_sys::fuzz_target;

fuzz_target!(init: common::abort_on_panic(), |data: &[u8]| {
    let path = common::file("input.toml", data);
    let _ = sidecar::load(&path.with_extension("obj"));
});
