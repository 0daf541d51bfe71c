//! The document that a rig was read from, kept for writing: mesh, skin, materials and all else.

use std::ops::Range;

use serde::Deserialize;

use crate::gltf::buffer::Buffer;
use crate::gltf::transform::HalfTurn;
use crate::vrm::read::Version;

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
    /// The extension that tells its humanoid bones.
    pub(crate) version: Version,
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

    /// For each joint, whether its node is there to show a mesh or for a camera.
    pub(crate) fn things(&self) -> Vec<bool> {
        #[derive(Deserialize)]
        struct Nodes {
            #[serde(default)]
            nodes: Vec<Thing>,
        }
        #[derive(Deserialize)]
        struct Thing {
            mesh: Option<u32>,
            camera: Option<u32>,
        }
        // The text was valid when it was read; what these two members hold does not matter to a rig.
        let Ok(Nodes { nodes }) = serde_json::from_str(self.json()) else { return Vec::new() };
        let is_thing = |binding: &Binding| {
            nodes.get(binding.node as usize).is_some_and(|node| node.mesh.is_some() || node.camera.is_some())
        };
        self.bindings.iter().map(is_thing).collect()
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
