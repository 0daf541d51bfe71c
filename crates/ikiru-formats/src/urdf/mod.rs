//! URDF: robots, read into rigs of hinges and sliders with their limits.
//!
//! quick-xml hands over one tag after the other, so that neither deep nor wide documents cost memory, and
//! entities of a document type are never expanded. roxmltree compares all attributes of an element with each
//! other and needs ten times the text's size for them; urdf-rs tells no line and keeps no place.

mod document;
mod element;
mod kind;
mod names;
mod problem;
pub(crate) mod read;
mod tree;
mod trouble;
mod warning;
mod xml;

pub use problem::UrdfProblem;
pub use warning::UrdfWarning;
