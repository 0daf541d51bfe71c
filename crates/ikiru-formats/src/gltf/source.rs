//! The document that a rig was read from, kept for writing: mesh, skin, materials and all else.

use std::ops::Range;

use crate::gltf::buffer::Buffer;
use crate::gltf::transform::HalfTurn;

/// How a joint hangs together with its node.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Binding {
    /// The node's position in the document.
    pub(crate) node: u32,
    /// What precedes the transform of a root's node: the turn of the file's world into ours.
    pub(crate) before: HalfTurn,
    /// What follows the node's rotation to give the joint's.
    pub(crate) half_turn: HalfTurn,
    /// Product of the scales of all nodes above: metres per unit of the node's translation.
    pub(crate) scale_above: f64,
    /// The node's own scale.
    pub(crate) scale: f64,
}

/// The glTF document that a rig was read from, with everything that a rig does not hold.
#[derive(Clone)]
pub struct Source {
    pub(crate) name: String,
    pub(crate) folder: Option<std::path::PathBuf>,
    pub(crate) file: Vec<u8>,
    pub(crate) json: Range<usize>,
    pub(crate) bin: Option<Range<usize>>,
    pub(crate) others: Range<usize>,
    pub(crate) buffers: Vec<Buffer>,
    pub(crate) bindings: Vec<Binding>,
}

impl Source {
    /// The name of the file, as it was given.
    #[must_use]
    pub fn name(&self) -> &str {
        &self.name
    }

    /// The document's JSON text.
    #[must_use]
    pub fn json(&self) -> &str {
        let text = self.file.get(self.json.clone()).unwrap_or_default();
        std::str::from_utf8(text).unwrap_or_default()
    }
}

impl std::fmt::Debug for Source {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.debug_struct("Source")
            .field("name", &self.name)
            .field("n_bytes", &self.file.len())
            .finish_non_exhaustive()
    }
}
