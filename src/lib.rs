//! **gdpt**, a gradient-domain path tracer (Kettunen et al. 2015) for OBJ scenes.
//!
//! Data flows one way: files → [`scene`] → traversal ([`trace`]) → paths of a tile ([`path`]) with their
//! shifts ([`shift`]) and gradient estimates ([`gradient`]) → sums ([`film`]) → [`reconstruct`] → files.
//! Each module uses only modules above it in this list (a test keeps it so):
//!
//! | module | what it is | uses |
//! |---|---|---|
//! | [`error`] | Errors and warnings in one line that says where and what to do. | |
//! | [`machine`] | How much memory the machine has, and which processor. | |
//! | [`load`] | OBJ, MTL, TOML and EXR to data, as written. | error, machine |
//! | [`lanes`] | Numbers and vectors in lanes, one or eight. | |
//! | [`warp`] | Maps from the unit square to disks, hemispheres and triangles. | lanes |
//! | [`frame`] | Shading frames. | lanes |
//! | [`geometry`] | Solid angles, and ray origins that leave a surface. | lanes |
//! | [`sampler`] | Owen-scrambled Sobol numbers by position in the path. | lanes |
//! | [`filter`] | Pixel filters: positions drawn by importance. | |
//! | [`bsdf`] | How materials scatter, in local coordinates. | lanes, warp |
//! | [`scene`] | Geometry, materials, lights and camera: immutable, no I/O, no tracing. | error, load, lanes, warp, frame, geometry, bsdf |
//! | [`trace`] | Closest and any hits for batches of rays, on several backends. | error, lanes, scene |
//! | [`vertex`] | What a ray met, ready for scattering and shifting. | lanes, frame, geometry, bsdf, scene, trace |
//! | [`shift`] | How an offset path follows its base path. | lanes, frame, geometry, bsdf, scene, vertex |
//! | [`manifold`] | Chains of single directions from a rough vertex to a light. | lanes, frame, geometry, bsdf, scene, trace, vertex |
//! | [`gradient`] | What a base path and its shift add to a difference of two pixels. | lanes |
//! | [`sums`] | What the samples of a pixel add up to. | gradient |
//! | [`path`] | Base and offset paths of a tile, traced together. | lanes, frame, geometry, sampler, filter, bsdf, scene, trace, vertex, shift, manifold, gradient, sums |
//! | [`image`] | Images in memory. | |
//! | [`estimate`] | What a render estimates: means and the variances of the means. | image |
//! | [`film`] | The sums of all samples, tile by tile, in two halves. | gradient, sums, path, image, estimate |
//! | [`render`] | Passes over all tiles until enough samples or enough time. | sampler, scene, trace, sums, path, film |
//! | [`part`] | Parts of a render: some of its samples, some of its pixels. | sampler, film, render |
//! | [`vantage`] | Where a camera stands whose place is open, by what is seen from there. | error, lanes, sampler, filter, geometry, scene, trace, gradient, path, film, render |
//! | [`mattes`] | Which objects and materials pixels show, and how much of it. | sampler, scene, trace, path, film |
//! | [`checkpoint`] | The film in a file, to go on from. | error, path, film, part |
//! | [`merge`] | Films of parts and crops of one render, put together into one. | error, film, render, part, checkpoint |
//! | [`denoise`] | Pictures without their noise, by a library that may be there. | error, image |
//! | [`reconstruct`] | The picture from primal and differences. | error, image, estimate, denoise |
//! | [`tone`] | Tone curves: from light of any brightness to what a display can show. | |
//! | [`exposure`] | By how many stops a picture is brightened for a display. | image |
//! | [`picture`] | The picture of a film: reconstruction, light seen directly, error. | image, film, denoise, reconstruct |
//! | [`compare`] | How far an image is from references. | image |
//! | [`output`] | EXR, PNG, JPEG and JSON files, whole or not at all; pipes, devices, standard output. | error, image, trace, shift, path, film, mattes, tone |
//! | [`develop`] | Pictures as they are shown, before their background. | load, image, tone, output |
//! | [`watch`] | The picture as it grows, in another program. | output |
//! | [`bench`](mod@bench) | Traversal backends compared on the rays of a real render. | error, sampler, filter, scene, trace, gradient, path, film, render, output |
//! | [`chart`] | Error against time of every method, and the report on it. | error, load, sampler, filter, scene, trace, gradient, path, image, estimate, film, render, reconstruct, picture, compare, output |
//! | [`spectrum`] | The error theory against measurement, by frequency. | sampler, estimate, reconstruct, output |
//! | [`cli`] | The command line: definitions only. | load, sampler, filter, scene, trace, gradient, part, path, render, reconstruct, output, tone, exposure |
//! | [`progress`] | What the user sees while it works. | error, render, output |
//! | [`app`] | The commands, from flags to files. | error, machine, load, filter, bsdf, scene, trace, gradient, path, image, estimate, film, render, part, mattes, checkpoint, merge, reconstruct, picture, compare, output, bench, chart, spectrum, cli, progress, exposure, denoise, develop, vantage, watch, tone |
//!
//! # A tour
//!
//! What `gdpt render` does, in the order of the map:
//!
//! ```
//! use gdpt::error::Warnings;
//! use gdpt::film::Film;
//! use gdpt::filter::Filter;
//! use gdpt::gradient::Weights;
//! use gdpt::load::{obj, sidecar};
//! use gdpt::path::{Manifold, PathSettings};
//! use gdpt::render::{Job, Limits, Method, TILE_SIZE};
//! use gdpt::sampler::SamplerKind;
//! use gdpt::scene::{EnvironmentSetting, Scene, SceneSettings};
//! use gdpt::trace::Backend;
//!
//! # fn main() -> gdpt::error::Result<()> {
//! // Files to data, as written; then what they mean.
//! let path = std::path::Path::new("scenes/still.obj");
//! let mut warnings = Warnings::new(false);
//! let file = obj::load(path, &mut warnings)?;
//! let toml = sidecar::load(path)?;
//! let settings = SceneSettings {
//!     environment: EnvironmentSetting::of_table(&toml.environment),
//!     camera: toml.camera,
//!     size: (48, 32),
//!     roughness_threshold: 0.01,
//!     lights: toml.lights,
//! };
//! let scene = Scene::build(path, file, &settings, &mut warnings)?;
//!
//! // A tree to trace with, and a film of sums.
//! let tracer = Backend::DEFAULT.build(&scene.mesh, 2)?;
//! let mut film = Film::new(48, 32, TILE_SIZE);
//!
//! // Base and offset paths of 8 samples of every pixel, tile by tile.
//! let job = Job {
//!     scene: &scene,
//!     tracer: &*tracer,
//!     method: Method::Gpt,
//!     settings: PathSettings {
//!         depth: 12,
//!         seed: 0,
//!         sampler: SamplerKind::Sobol,
//!         weights: Weights::Mis,
//!         filter: Filter::Box,
//!         manifold: Manifold::Auto,
//!     },
//!     first: 0,
//!     limits: Limits { samples: 8, time: None },
//! };
//! job.run(&mut film, &mut |_, _| None, &mut |_| ());
//!
//! // The picture of primal and differences.
//! let picture = gdpt::picture::of_film(&film, gdpt::reconstruct::Method::Weighted);
//! assert_eq!(picture.image.width, 48);
//! assert!(picture.rel_mse.is_some_and(|error| error < 0.5));
//! # Ok(())
//! # }
//! ```
//!
//! Where to read on: a path's vertices are in [`vertex`], eight at once; the loop over them in `path/mod.rs`; what the
//! base path does at one, and how its offset paths follow, in `path/light.rs` and `path/bounce.rs`, how paths that go on
//! move together in `path/pack.rs`, and what follows when all share the rest in `path/plain`; light sampling where offset paths copy half vectors in `path/aim.rs`; light through mirrors
//! and glass in `path/manifold.rs`, by the walks of [`manifold`] between the surfaces of [`scene::reflectors`]; the shift itself, decision by decision, in [`shift`]; what
//! the two paths add to a difference in [`gradient`]; how materials scatter in [`bsdf`], one file each; how light is
//! chosen in [`scene::light`], and sampled in [`scene::light_sample`]; the solves in [`reconstruct`].
//!
//! Words are those of the field: a *base path* x, its *offset path* y = T(x) through a neighbouring
//! pixel, the *shift* T with its *Jacobian* |T'|; *primal*, *dx* and *dy*; *very direct* for light seen
//! directly, which stays out of gradients and solve. Depth is counted in segments.
#![deny(unsafe_code)]

pub mod app;
pub mod bench;
pub mod bsdf;
pub mod chart;
pub mod checkpoint;
pub mod cli;
pub mod compare;
pub mod denoise;
pub mod develop;
pub mod error;
pub mod estimate;
pub mod exposure;
pub mod film;
pub mod filter;
pub mod frame;
pub mod geometry;
pub mod gradient;
pub mod image;
pub mod lanes;
pub mod load;
pub mod machine;
pub mod manifold;
pub mod mattes;
pub mod merge;
pub mod output;
pub mod part;
pub mod path;
pub mod picture;
pub mod progress;
pub mod reconstruct;
pub mod render;
pub mod sampler;
pub mod scene;
pub mod shift;
pub mod spectrum;
pub mod sums;
pub mod tone;
pub mod trace;
pub mod vantage;
pub mod vertex;
pub mod warp;
pub mod watch;
