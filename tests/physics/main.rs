//! What is estimated is right: scattering, shifts and light agree with closed forms, with theory, with path tracing and
//! with another renderer, also where scenes are hard. Films have the bits that they had.

mod bsdf;
mod chains;
mod closed_form;
#[path = "../common/mod.rs"]
mod common;
mod gradients;
mod lanes;
mod manifold;
mod materials;
mod mitsuba;
mod patches;
mod replay;
mod shift;
mod stability;
mod theory;
