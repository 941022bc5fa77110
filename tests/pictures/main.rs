//! Pictures are made well of their samples: reconstructions, denoiser and measures of error do what they claim. Threads
//! and tiles change no bit, and all traversal backends find the same hits.

mod bias;
#[path = "../common/mod.rs"]
mod common;
mod compare;
mod denoise;
mod determinism;
mod parts;
mod reconstruction;
mod traversal;
mod weighted;
