//! Eight paths at once, in the lanes of vectors.
//!
//! Plain paths (`plain`) go so in all scenes. Base paths with offset paths (`front`) do in diffuse scenes: what may
//! happen to a path is known beforehand there. Its offset paths start at the neighbours' primary
//! hits, are joined to it at x_2, and share its direction from there on: so there are two vertices with
//! offset paths, and a plain path from then on. With a lens, whose offset paths have camera
//! rays of their own, `front` is left to the general loop. The steps are those of the general loop
//! (`primary`, `light` and `bounce` one folder up), with the same bits.

mod arrival;
mod front;
mod front_bounce;
mod front_light;
mod grid;
mod order;
mod plain;
mod vertices;

pub(super) use front::Front;
pub(super) use plain::PlainPaths;
