//! OBJ files, as far as the scene.
#![no_main]

mod common;

use gdpt::error::Warnings;
use gdpt::load::obj;
use gdpt::scene::{Scene, SceneSettings};
use libfuzzer_sys::fuzz_target;

fuzz_target!(init: common::abort_on_panic(), |data: &[u8]| {
    let path = common::file("input.obj", data);
    let mut warnings = Warnings::new(false);
    let Ok(file) = obj::load(&path, &mut warnings) else {
        return;
    };
    let settings = SceneSettings {
        size: (8, 8),
        roughness_threshold: 0.01,
        ..SceneSettings::default()
    };
    if let Ok(scene) = Scene::build(&path, file, &settings, &mut warnings) {
        scene.hash();
    }
});
