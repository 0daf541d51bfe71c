//! A pose → the file that the rig was read from, with its nodes turned and nothing else changed.

use glam::DQuat;
use ikiru_rig::{JointId, Pose};
use serde::Deserialize;

use crate::error::{Error, ErrorKind, Fault, Place};
use crate::gltf::buffer::Buffer;
use crate::gltf::container::{self, Container};
use crate::gltf::document::Node;
use crate::gltf::patch::{Members, list, numbers, string};
use crate::gltf::source::{Binding, Source, check_turns};
use crate::gltf::transform::parts;
use crate::gltf::uri::{self, Target};
use crate::loaded::Loaded;
use crate::vrm::read::Version;
use crate::warning::Warning;
use crate::written::Written;

/// The file that the rig was read from, as `.glb`, with its nodes in a pose.
///
/// Mesh, skin, materials, extensions, unknown members and the BIN chunk stay as they are; only rotations (and
/// translations, of joints that translate) of nodes that moved are changed, in the nodes' own units. Buffers
/// and images in other files are embedded; an image that cannot be found keeps its reference.
///
/// Animations that move nodes are left out where the pose moves some: many viewers start the first animation
/// that there is, and would not show the pose. [`write_pose`](crate::write_pose) says how many those were, and writes
/// `.gltf` and `.vrm` too.
///
/// # Errors
/// When the rig was not read from a glTF file, the pose has other joints or is not valid, or a buffer cannot
/// be embedded.
pub fn write_posed_glb(loaded: &Loaded, pose: &Pose) -> Result<Vec<u8>, Error> {
    pose_file(loaded, pose, Container::Binary).map(|written| written.bytes)
}

pub(crate) fn pose_file(loaded: &Loaded, pose: &Pose, container: Container) -> Result<Written, Error> {
    let source = source(loaded)?;
    check_pose(loaded, pose, "the pose")
        .and_then(|()| posed(loaded, source, pose, container))
        .map_err(|f| f.in_file(&source.name))
}

pub(crate) fn source(loaded: &Loaded) -> Result<&Source, Error> {
    loaded.source().ok_or_else(|| Error::new("rig", Place::File, ErrorKind::NoSource))
}

/// Whether a pose is one of the file's joints, has finite numbers, and turns what the file can turn.
pub(crate) fn check_pose(loaded: &Loaded, pose: &Pose, what: &'static str) -> Result<(), Fault> {
    if let Some(difference) = loaded.rig.shape_difference(pose.rig()) {
        return Err(ErrorKind::OtherRig { what, difference }.into());
    }
    if !pose.is_valid() {
        return Err(ErrorKind::InvalidPose { what }.into());
    }
    match loaded.source() {
        Some(source) if !loaded.rig.is_same(pose.rig()) => check_turns(pose.rig().joints(), &source.bindings),
        _ => Ok(()),
    }
}

fn posed(loaded: &Loaded, source: &Source, pose: &Pose, container: Container) -> Result<Written, Fault> {
    let mut out = Output::new(source)?;
    let mut moves = false;
    for (id, binding) in loaded.rig.ids().zip(&source.bindings) {
        let (Ok(rotation), Ok(translation)) = (pose.rotation(id), pose.translation(id)) else { continue };
        if rotation.w.abs() == 1.0 && translation == glam::DVec3::ZERO {
            continue;
        }
        moves = true;
        out.change_node(binding, |members| {
            members.set("rotation", numbers(&node_rotation(loaded, id, binding, rotation).to_array()));
            if translation != glam::DVec3::ZERO {
                members.set("translation", numbers(&node_translation(loaded, id, binding, translation)));
            }
        })?;
    }
    let mut warnings = Vec::new();
    if moves {
        let count = out.drop_animations()?;
        warnings.extend((count > 0).then_some(Warning::ClipsLeftOut { count }));
    }
    Ok(Written { bytes: out.finish(source, container)?, warnings })
}

/// The node's rotation for a joint's motion.
pub(crate) fn node_rotation(loaded: &Loaded, id: JointId, binding: &Binding, rotation: DQuat) -> DQuat {
    let rest = loaded.rig.get(id).map_or(DQuat::IDENTITY, |j| j.rest_rotation);
    binding.node_rotation(rest * rotation)
}

/// The node's translation for a joint's motion, in the node's own unit.
pub(crate) fn node_translation(
    loaded: &Loaded,
    id: JointId,
    binding: &Binding,
    translation: glam::DVec3,
) -> [f64; 3] {
    let Some(joint) = loaded.rig.get(id) else { return [0.0; 3] };
    binding.node_translation(joint.rest_translation + joint.rest_rotation * translation).to_array()
}

/// A file being written: the document's members, and what its BIN chunk holds.
pub(crate) struct Output<'s> {
    pub(crate) members: Members<'s>,
    nodes: Vec<String>,
    pub(crate) buffers: Vec<String>,
    /// Bytes of buffer 0, if it is to be the BIN chunk.
    pub(crate) bin: Option<&'s [u8]>,
    /// What follows them.
    pub(crate) appended: Vec<u8>,
}

/// The text was valid when it was read, so this does not happen; it is no reason to panic either.
fn shape(error: &serde_json::Error) -> Fault {
    ErrorKind::Shape { message: error.to_string() }.into()
}

impl<'s> Output<'s> {
    pub(crate) fn new(source: &'s Source) -> Result<Self, Fault> {
        let members = Members::parse(source.json()).map_err(|e| shape(&e))?;
        let nodes = members.list("nodes").map_err(|e| shape(&e))?;
        let buffers = members.list("buffers").map_err(|e| shape(&e))?;
        // A chunk that no buffer refers to is kept as well.
        let unused = source.bin.clone().filter(|_| buffers.is_empty());
        let bin = unused.and_then(|range| source.file.get(range));
        let mut out = Self { members, nodes, buffers, bin, appended: Vec::new() };
        out.embed_buffers(source)?;
        out.embed_images(source)?;
        Ok(out)
    }

    /// Changes a node's members. One with a matrix has translation, rotation and scale from here on.
    pub(crate) fn change_node(
        &mut self,
        binding: &Binding,
        change: impl FnOnce(&mut Members<'_>),
    ) -> Result<(), Fault> {
        let Some(text) = self.nodes.get_mut(binding.node as usize) else { return Ok(()) };
        let changed = {
            let mut members = Members::parse(text).map_err(|e| shape(&e))?;
            if members.get("matrix").is_some_and(|m| m != "null") {
                let node: Node = serde_json::from_str(text).map_err(|e| shape(&e))?;
                let parts = parts(&node, binding.node)?;
                members.remove("matrix");
                members.set("translation", numbers(&parts.translation.to_array()));
                members.set("rotation", numbers(&parts.rotation.to_array()));
                members.set("scale", numbers(&parts.scale.to_array()));
            }
            change(&mut members);
            members.text()
        };
        *text = changed;
        Ok(())
    }

    /// Buffer 0 becomes the BIN chunk, buffers in other files data inside the document.
    fn embed_buffers(&mut self, source: &'s Source) -> Result<(), Fault> {
        let mut embedded = 0u64;
        for (index, (text, buffer)) in self.buffers.iter_mut().zip(&source.buffers).enumerate() {
            let Some(bytes) = buffer.bytes(&source.file) else {
                let members = Members::parse(text).map_err(|e| shape(&e))?;
                if let (Buffer::Missing(reason), Some(_)) = (buffer, members.get("uri")) {
                    let kind = ErrorKind::Buffer { index, reason: reason.clone() };
                    return Err(Fault::at(format!("/buffers/{index}"), kind));
                }
                continue;
            };
            if index == 0 {
                self.bin = Some(bytes);
                if !matches!(buffer, Buffer::Bin(_)) {
                    let mut members = Members::parse(text).map_err(|e| shape(&e))?;
                    members.remove("uri");
                    let changed = members.text();
                    *text = changed;
                }
            } else if matches!(buffer, Buffer::External(_)) {
                embedded = embedded.saturating_add(bytes.len() as u64);
                if embedded > u64::from(u32::MAX) {
                    return Err(ErrorKind::TooLarge { bytes: embedded }.into());
                }
                let mut members = Members::parse(text).map_err(|e| shape(&e))?;
                members.set("uri", string(&uri::encode_data("application/octet-stream", bytes)));
                let changed = members.text();
                *text = changed;
            }
        }
        Ok(())
    }

    /// Images in the document's folder become data inside the document. An image that is not there stays a
    /// reference: a picture less does not keep a user from the file.
    fn embed_images(&mut self, source: &Source) -> Result<(), Fault> {
        let Some(folder) = &source.folder else { return Ok(()) };
        let mut images = self.members.list("images").map_err(|e| shape(&e))?;
        let mut left = u64::from(u32::MAX);
        let mut changed = false;
        for text in &mut images {
            let Ok(mut members) = Members::parse(text) else { continue };
            let uri = members.get("uri").and_then(|text| serde_json::from_str::<String>(text).ok());
            let Some(Ok(Target::File(file))) = uri.as_deref().map(uri::target) else { continue };
            let ending = file.extension().map(|e| e.to_string_lossy().to_ascii_lowercase());
            let mime = match ending.as_deref() {
                Some("png") => "image/png",
                Some("jpg" | "jpeg") => "image/jpeg",
                Some("webp") => "image/webp",
                Some("ktx2") => "image/ktx2",
                _ => continue,
            };
            let Ok(bytes) = uri::read_file(folder, &file, left) else { continue };
            left = left.saturating_sub(bytes.len() as u64);
            members.set("uri", string(&uri::encode_data(mime, &bytes)));
            let new = members.text();
            *text = new;
            changed = true;
        }
        if changed {
            self.members.set_list("images", &images);
        }
        Ok(())
    }

    /// Leaves out the animations that move nodes; how many.
    fn drop_animations(&mut self) -> Result<usize, Fault> {
        #[derive(Deserialize)]
        struct Animation {
            channels: Vec<Channel>,
        }
        #[derive(Deserialize)]
        struct Channel {
            target: ChannelTarget,
        }
        #[derive(Deserialize)]
        struct ChannelTarget {
            path: String,
        }
        let mut animations = self.members.list("animations").map_err(|e| shape(&e))?;
        let before = animations.len();
        // What cannot be read moves nothing.
        animations.retain(|text| {
            let channels = serde_json::from_str(text).map_or_else(|_| Vec::new(), |a: Animation| a.channels);
            let moves = |c: &Channel| matches!(c.target.path.as_str(), "translation" | "rotation" | "scale");
            !channels.iter().any(moves)
        });
        // A list of a document has at least one element.
        if animations.is_empty() {
            self.members.remove("animations");
        } else if animations.len() < before {
            self.members.set_list("animations", &animations);
        }
        Ok(before - animations.len())
    }

    pub(crate) fn finish(mut self, source: &Source, container: Container) -> Result<Vec<u8>, Fault> {
        if container == Container::Vrm && !matches!(source.version, Version::Old | Version::One) {
            return Err(ErrorKind::NotVrm.into());
        }
        self.members.set("nodes", list(&self.nodes));
        if !self.buffers.is_empty() {
            self.members.set("buffers", list(&self.buffers));
        }
        let bin = self.bin.or_else(|| (!self.appended.is_empty()).then_some(&[][..]));
        if container == Container::Text {
            return self.text(bin);
        }
        let others = source.file.get(source.others.clone()).unwrap_or_default();
        let chunks = bin.map(|bin| [bin, &self.appended]);
        container::join(&self.members.text(), chunks.as_ref().map(|c| &c[..]), others)
    }

    /// The document alone, the BIN chunk as data inside of it. Chunks that nobody knows have no place there.
    fn text(mut self, bin: Option<&[u8]>) -> Result<Vec<u8>, Fault> {
        if let (Some(bin), Some(first)) = (bin, self.buffers.first_mut()) {
            let mut members = Members::parse(first).map_err(|e| shape(&e))?;
            let bytes = [bin, &self.appended].concat();
            members.set("uri", string(&uri::encode_data("application/octet-stream", &bytes)));
            let changed = members.text();
            *first = changed;
            self.members.set("buffers", list(&self.buffers));
        }
        let mut text = self.members.text().into_bytes();
        text.push(b'\n');
        Ok(text)
    }
}
