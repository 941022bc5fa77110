//! Diffuse scenes: eight paths at once, in the lanes of vectors.
//!
//! What may happen to a path is known beforehand here. Its offset paths start at the neighbours' primary
//! hits, are joined to it at x_2, and share its direction from there on: so there are two vertices with
//! offset paths (`front`), and a plain path from then on (`plain`). With a lens, whose offset paths have camera
//! rays of their own, `front` is left to the general loop. The steps are those of the general loop
//! (`primary`, `light` and `bounce` one folder up), with the same bits.

mod arrival;
mod front;
mod front_bounce;
mod front_light;
mod grid;
mod plain;
mod vertices;

pub(super) use front::Front;
pub(super) use plain::PlainPaths;
