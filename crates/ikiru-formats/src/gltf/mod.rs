//! glTF 2.0: `.glb` and `.gltf`, read into rigs and clips, and written with poses and animations.
//!
//! A thin typed layer over serde_json rather than the `gltf` crate: that one builds every node into a large
//! structure (memory could not be bounded), narrows numbers to 32 bits, refuses unknown required extensions,
//! and keeps no text to pass through.

mod accessor;
pub(crate) mod animation;
mod buffer;
mod chunk;
pub(crate) mod clips;
pub(crate) mod container;
pub(crate) mod document;
mod names;
mod patch;
mod problem;
pub(crate) mod read;
pub(crate) mod scale;
pub(crate) mod source;
mod track;
mod transform;
mod tree;
mod uri;
pub(crate) mod write;
pub(crate) mod write_animation;

pub(crate) use chunk::{JSON_CHUNK, MAGIC};
pub(crate) use container::Container;
pub use problem::DataProblem;
pub use source::Source;
