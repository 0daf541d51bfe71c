//! Poses as JSON: what the command prints and other programs read.

mod write;

pub use write::pose_json;
