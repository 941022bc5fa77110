//! The error theory against measurement: at which frequencies the
//! errors of primal, of gradients and of the screened solve are, predicted from two variances and measured.
//!
//! Frequencies are in cycles per pixel. The spectra are those of means over the samples of a render, in
//! an orthonormal basis: white noise has its variance at every frequency.
//!
#![doc = include_str!("errors.md")]

pub mod figures;
pub mod measure;
pub mod one_dimensional;
pub mod table;
pub mod theory;
