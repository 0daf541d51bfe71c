//! VRM animations, `.vrma`: a clip of a normalised humanoid, for every avatar.

use glam::DVec3;
use ikiru_rig::humanoid::{Reference, normalised, transfer};
use ikiru_rig::{Clip, JointId, Pose, Role};
use serde_json::{Map, Value, json};

use crate::error::{Error, ErrorKind, Fault, Place};
use crate::gltf::container;
use crate::gltf::read::load;
use crate::gltf::write_animation::{in_32_bits, key_times};
use crate::loaded::Loaded;
use crate::vrm::fold::fold;
use crate::vrm::read::Version;
use crate::written::Written;

/// Reads a VRM animation from memory; `name` stands in messages.
///
/// The rig is the file's own skeleton, in T-pose: hips are free, all other humanoid bones are balls. Its clips
/// go to another rig by [`transfer`] with [`Reference::TPose`]. Expressions and the gaze are no motions of
/// joints: their channels are left out with a warning.
///
/// # Errors
/// When the file is not valid, or no VRM animation.
pub fn read_vrma(bytes: &[u8], name: &str) -> Result<Loaded, Error> {
    match load(bytes.to_vec(), true, None, name) {
        Ok((loaded, Version::Animation)) => Ok(loaded),
        Ok(_) => Err(Error::new(name, Place::Pointer("/extensions".to_owned()), ErrorKind::NotVrma)),
        Err(fault) => Err(fault.in_file(name)),
    }
}

/// A clip as a VRM animation, which any avatar plays: `.vrma`.
///
/// The file's skeleton is the clip's in T-pose with all rest rotations the identity ([`normalised`]); the
/// clip is [transferred](transfer) to it. It holds one rotation channel for each humanoid bone that moves and
/// a translation channel for the hips, linear between the clip's times; times before 0 are moved up to begin
/// at 0. Eyes are left out, as the format wants it; there are no expressions.
///
/// What joints without a role do between two bones is folded into these: each bone points to where its far end is, and
/// every bone ends where it should, as long as its length stays. [`write_clip`](crate::write_clip) says where that
/// cannot be.
///
/// ```
/// use ikiru_rig::{Clip, humanoid::{Reference, transfer}};
///
/// let human = ikiru_formats::builtin("human")?.rig;
/// let mut wave = human.rest_pose();
/// wave.set_rotation(human.joint("leftLowerArm")?, glam::DQuat::from_rotation_y(-1.0))?;
/// let clip = Clip::new("wave", vec![0.0, 0.5], vec![human.rest_pose(), wave])?;
///
/// let file = ikiru_formats::read_vrma(&ikiru_formats::write_vrma(&clip)?, "wave.vrma")?;
/// let other = ikiru_formats::builtin("reference")?.rig;
/// let on_other = transfer(&file.clips[0], &other, Reference::TPose)?;
/// assert_eq!(on_other.clip.duration_secs(), 0.5);
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
///
/// # Errors
/// When the clip's rig lacks a humanoid role that VRM requires, or the clip has numbers that are not finite.
pub fn write_vrma(clip: &Clip) -> Result<Vec<u8>, Error> {
    clip_file(clip).map(|written| written.bytes)
}

pub(crate) fn clip_file(clip: &Clip) -> Result<Written, Error> {
    write(clip).map_err(|fault| fault.in_file(if clip.name().is_empty() { "clip" } else { clip.name() }))
}

/// A pose as an animation that holds it.
pub(crate) fn pose_file(pose: &Pose) -> Result<Written, Error> {
    clip_file(&Clip::still(pose.clone()).with_name("pose"))
}

fn write(clip: &Clip) -> Result<Written, Fault> {
    let source = clip.poses().first().map(Pose::rig);
    let has = |role: &Role| source.is_some_and(|rig| rig.role(*role).is_some());
    let missing: Vec<&str> =
        Role::REQUIRED.iter().filter(|role| !has(role)).map(|role| role.name()).collect();
    let (Some(source), true) = (source, missing.is_empty()) else {
        return Err(ErrorKind::RolesMissing { missing: missing.join(", ") }.into());
    };
    let rig = normalised(source).map_err(ErrorKind::from)?;
    let moved = transfer(clip, &rig, Reference::TPose).map_err(ErrorKind::from)?.clip;
    let (clip, warning) = fold(&moved, clip).map_err(|error| ErrorKind::Transfer(error.into()))?;

    let (mut nodes, mut bones): (Vec<Value>, _) = (Vec::new(), Map::new());
    for (node, joint) in rig.joints().iter().enumerate() {
        let translation = joint.rest_translation.to_array();
        nodes.push(json!({ "name": joint.name, "translation": translation }));
        bones.insert(joint.name.clone(), json!({ "node": node }));
        if let Some(Value::Object(parent)) = joint.parent.and_then(|parent| nodes.get_mut(parent.index())) {
            let children = parent.entry("children").or_insert_with(|| json!([]));
            if let Value::Array(children) = children {
                children.push(json!(node));
            }
        }
    }
    let roots: Vec<usize> = (0..rig.n_joints()).filter(|node| rig.joints()[*node].parent.is_none()).collect();
    let mut animation = Animation::new(&clip);
    for joint in rig.ids() {
        animation.rotate(joint);
        animation.translate(joint)?;
    }
    let document = json!({
        "asset": { "version": "2.0", "generator": concat!("Ikiru ", env!("CARGO_PKG_VERSION")) },
        "extensionsUsed": ["VRMC_vrm_animation"],
        "extensions": {
            "VRMC_vrm_animation": { "specVersion": "1.0", "humanoid": { "humanBones": bones } }
        },
        "scene": 0,
        "scenes": [{ "nodes": roots }],
        "nodes": nodes,
        "animations": [{ "name": clip.name(), "channels": animation.channels, "samplers": animation.samplers }],
        "accessors": animation.accessors,
        "bufferViews": animation.views,
        "buffers": [{ "byteLength": animation.bytes.len() }]
    });
    let bytes = container::join(&document.to_string(), Some(&[&animation.bytes]), &[])?;
    Ok(Written { bytes, warnings: warning.into_iter().collect() })
}

/// The one animation of the file, while it is made; its first accessor holds the times.
struct Animation<'c> {
    clip: &'c Clip,
    keys: Vec<usize>,
    channels: Vec<Value>,
    samplers: Vec<Value>,
    accessors: Vec<Value>,
    views: Vec<Value>,
    bytes: Vec<u8>,
}

impl<'c> Animation<'c> {
    fn new(clip: &'c Clip) -> Self {
        let (times, keys) = key_times(clip);
        let mut animation = Self {
            clip,
            keys,
            channels: Vec::new(),
            samplers: Vec::new(),
            accessors: Vec::new(),
            views: Vec::new(),
            bytes: Vec::new(),
        };
        animation.accessor(&times, "SCALAR", 1);
        if let Some(accessor) = animation.accessors.first_mut() {
            accessor["min"] = json!([times.first().copied().unwrap_or_default()]);
            accessor["max"] = json!([times.last().copied().unwrap_or_default()]);
        }
        animation
    }

    fn poses(&self) -> impl Iterator<Item = &'c Pose> {
        let clip = self.clip;
        self.keys.iter().filter_map(move |key| clip.poses().get(*key))
    }

    /// The rotations of a joint, if it turns.
    fn rotate(&mut self, joint: JointId) {
        let mut values: Vec<f32> = Vec::new();
        let mut previous = None;
        let mut turns = false;
        for pose in self.poses() {
            let Ok(mut rotation) = pose.rotation(joint) else { return };
            turns |= rotation.w.abs() < 1.0 - 1e-12;
            // Neighbours on the same side, for players that do not look for the short way themselves.
            if previous.is_some_and(|p| rotation.dot(p) < 0.0) {
                rotation = -rotation;
            }
            previous = Some(rotation);
            values.extend(rotation.to_array().map(|c| c as f32));
        }
        if turns {
            self.channel(joint, "rotation", &values, "VEC4", 4);
        }
    }

    /// The way of the hips, always: then there is a channel.
    fn translate(&mut self, joint: JointId) -> Result<(), Fault> {
        let rig = self.clip.poses().first().map(Pose::rig);
        let Some(rest) = rig.and_then(|rig| rig.get(joint)) else { return Ok(()) };
        if rest.role == Some(Role::Hips) {
            let at = |pose: &Pose| -> DVec3 {
                rest.rest_translation + pose.translation(joint).unwrap_or_default()
            };
            let mut values: Vec<f32> = Vec::new();
            for pose in self.poses() {
                values.extend(in_32_bits(at(pose).to_array())?);
            }
            self.channel(joint, "translation", &values, "VEC3", 3);
        }
        Ok(())
    }

    fn channel(&mut self, joint: JointId, path: &str, values: &[f32], kind: &str, width: usize) {
        let output = self.accessor(values, kind, width);
        let sampler = self.samplers.len();
        self.samplers.push(json!({ "input": 0, "output": output, "interpolation": "LINEAR" }));
        self.channels.push(json!({ "sampler": sampler, "target": { "node": joint.index(), "path": path } }));
    }

    fn accessor(&mut self, values: &[f32], kind: &str, width: usize) -> usize {
        let (start, count) = (self.bytes.len(), values.len() / width);
        self.bytes.extend(values.iter().flat_map(|value| value.to_le_bytes()));
        self.views.push(json!({ "buffer": 0, "byteOffset": start, "byteLength": self.bytes.len() - start }));
        let view = self.views.len() - 1;
        self.accessors
            .push(json!({ "bufferView": view, "componentType": 5126, "count": count, "type": kind }));
        self.accessors.len() - 1
    }
}
