//! `gdpt bench`: traversal backends compared on the rays of a real render.

pub mod measure;
pub mod plot;
pub mod record;
pub mod report;
