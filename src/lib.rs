//! temp
#![deny(unsafe_code)]
pub mod app;
pub mod bsdf;
pub mod cli;
pub mod error;
pub mod film;
pub mod frame;
pub mod gradient;
pub mod image;
pub mod load;
pub mod output;
pub mod path;
pub mod progress;
pub mod reconstruct;
pub mod render;
pub mod sampler;
pub mod scene;
pub mod shift;
pub mod sums;
pub mod trace;
pub mod vertex;
pub mod warp;
