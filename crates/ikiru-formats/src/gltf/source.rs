//! The document that a rig was read from, kept for writing: mesh, skin, materials and all else.

use std::ops::Range;

use glam::{DQuat, DVec3};
use ikiru_rig::{Joint, JointId, JointMotion};
use serde::Deserialize;

use crate::error::{ErrorKind, Fault};
use crate::gltf::buffer::Buffer;
use crate::gltf::scale::Scale;
use crate::gltf::transform::HalfTurn;
use crate::vrm::read::Version;
use crate::warning::short;

/// How a joint hangs together with its node.
#[derive(Clone, Debug)]
pub(crate) struct Binding {
    /// The node's position in the document.
    pub(crate) node: u32,
    /// The turn of the file's world into ours: every joint's frame is turned with it, about the world's origin and about
    /// its own, so that a joint whose axes lie along the file's has them along ours.
    pub(crate) turn: HalfTurn,
    /// What follows the node's rotation to give the joint's, in the file's axes.
    pub(crate) half_turn: HalfTurn,
    /// What takes the node's translation to metres, in the file's axes.
    pub(crate) above: Scale,
    /// The node's own scale, without signs.
    pub(crate) scale: DVec3,
}

impl Binding {
    /// The node's rotation for that of its joint in the joint above.
    pub(crate) fn node_rotation(&self, rotation: DQuat) -> DQuat {
        let turn = self.turn.quaternion();
        // A half turn is its own inverse, but for the sign of the quaternion.
        (turn.inverse() * rotation * turn * self.half_turn.quaternion()).normalize()
    }

    /// The node's translation for that of its joint in the joint above.
    pub(crate) fn node_translation(&self, translation: DVec3) -> DVec3 {
        self.above.to_file(self.turn.quaternion().inverse() * translation)
    }

    /// The joint's translation in the joint above for that of its node.
    pub(crate) fn joint_translation(&self, translation: DVec3) -> DVec3 {
        self.turn.quaternion() * self.above.to_metres(translation)
    }
}

/// Whether joints turn only where the file can turn them as a rig does: nowhere below scales that differ between
/// the axes.
pub(crate) fn check_turns(joints: &[Joint], bindings: &[Binding]) -> Result<(), Fault> {
    let turns = |joint: &Joint| !matches!(joint.motion, JointMotion::Fixed | JointMotion::Slider { .. });
    for (joint, binding) in joints.iter().zip(bindings) {
        if !turns(joint) || binding.above.is_uniform() {
            continue;
        }
        // The one above whose own axes differ the most.
        let parents = |joint: &Joint| joint.parent.map(JointId::index).filter(|p| *p < joints.len());
        let above = std::iter::successors(parents(joint), |at| joints.get(*at).and_then(parents));
        let ratio =
            |at: &usize| bindings.get(*at).map_or(1.0, |b| b.scale.max_element() / b.scale.min_element());
        let culprit = above.max_by(|a, b| ratio(a).total_cmp(&ratio(b))).unwrap_or_default();
        let (Some(scaled), Some(of)) = (joints.get(culprit), bindings.get(culprit)) else { continue };
        let kind = ErrorKind::TurnsBelowScale {
            node: short(&scaled.name),
            scale: of.scale.to_array(),
            joint: short(&joint.name),
        };
        return Err(Fault::at(format!("/nodes/{}", of.node), kind));
    }
    Ok(())
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
