//! Files are read as they are meant, and what cannot be read or written gives one clear line. No result is lost, whether
//! a disk is full or the render is killed.

mod bad_input;
mod checkpoint;
#[path = "../common/mod.rs"]
mod common;
mod downloads;
mod load;
mod mattes;
mod models;
#[cfg(unix)]
mod outputs;
#[cfg(unix)]
mod parts;
mod reading;
mod textures;
