//! EXR files.
#![no_main]

mod common;

use gdpt::load::exr;
use libfuzzer_sys::fuzz_target;

fuzz_target!(init: common::abort_on_panic(), |data: &[u8]| {
    let _ = exr::load(&common::file("input.exr", data));
});
