//! MTL files, as far as materials.
#![no_main]

mod common;

use gdpt::error::Warnings;
use gdpt::load::mtl;
use gdpt::scene::material::Material;
use gdpt::scene::remarks::Remarks;
use libfuzzer_sys::fuzz_target;

fuzz_target!(init: common::abort_on_panic(), |data: &[u8]| {
    let path = common::file("input.mtl", data);
    let mut warnings = Warnings::new(false);
    for material in mtl::load(&path, &mut warnings).unwrap_or_default() {
        let _ = Material::from_mtl(&material, None, 0.01, &mut Remarks::default());
    }
});
