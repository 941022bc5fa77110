//! By how much the views of a turntable are brightened that are rendered one by one.

use crate::app::finish;
use crate::exposure::Exposure;
use crate::film::Film;
use crate::path::Counts;
use crate::picture;
use crate::reconstruct::Method;
use crate::render::{Ending, Job, Limits, Method as RenderMethod, TILE_SIZE};
use crate::scene::camera::Camera;

/// Samples by which the first view is metered, and pixels along its longer side.
const METERED: u64 = 16;
const METERED_SIDE: u32 = 256;

/// A camera that sees what `camera` does, in few pixels.
pub(super) fn of_few_pixels(camera: &Camera) -> Camera {
    let longest = camera.width.max(camera.height).max(METERED_SIDE);
    let shrink =
        |side: u32| (u64::from(side) * u64::from(METERED_SIDE) / u64::from(longest)).max(1) as u32;
    camera.at_size(shrink(camera.width), shrink(camera.height))
}

/// By how many stops views are brightened that are rendered one by one: as the first one of few samples, so that it is
/// the same for all. Works on the current pool; `stop` ends it early.
pub(super) fn stops(first: Job, stop: &(dyn Fn() -> bool + Sync)) -> f32 {
    let camera = &first.scene.camera;
    let mut film = Film::new(camera.width, camera.height, TILE_SIZE);
    let job = Job {
        method: RenderMethod::Pt,
        limits: Limits {
            samples: METERED,
            time: None,
        },
        ..first
    };
    let mut ended = |_: &Film, _: &Counts| stop().then_some(Ending::Interrupted);
    job.run(&mut film, &mut ended, &mut |_| ());
    let picture = picture::of_film(&film, Method::Primal);
    finish::stops(Exposure::Auto, &film, &picture, &film.first_hits())
}
