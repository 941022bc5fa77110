//! The program does from the shell what its flags say, with any output, signal or limit of time. What a scene leaves
//! open, such as its camera and its light, is filled in well.

mod cli;
#[path = "../common/mod.rs"]
mod common;
mod framing;
mod info;
mod reconstruct_command;
mod report;
#[cfg(unix)]
mod shell;
mod spectrum_command;
mod studio;
mod views;
