//! A document's animations as clips: each under a name of its own.

use std::cell::{Cell, OnceCell};
use std::collections::HashMap;

use ikiru_rig::{Clip, Rig};
use serde::Deserialize;
use serde::de::IgnoredAny;
use serde_json::value::RawValue;

use crate::gltf::accessor::Data;
use crate::gltf::animation::{AtRest, Needs, Scene, clip};
use crate::gltf::buffer::Buffer;
use crate::gltf::document::{Capped, parse_part};
use crate::gltf::problem::DataProblem;
use crate::gltf::source::Source;
use crate::gltf::track::Budget;
use crate::gltf::tree::NONE;
use crate::names::Namer;
use crate::warning::{Warning, Warnings, short};

/// The members of a document that clips are made of.
#[derive(Deserialize)]
#[serde(rename_all = "camelCase")]
struct Parts<'a> {
    #[serde(default)]
    nodes: Vec<IgnoredAny>,
    #[serde(borrow)]
    buffer_views: Option<&'a RawValue>,
    #[serde(borrow)]
    accessors: Option<&'a RawValue>,
    #[serde(borrow)]
    animations: Option<&'a RawValue>,
}

/// All clips of a document, for its rig or one with the same joints and other motions; what cannot be read becomes a
/// warning. What the rig's joints cannot do of it is noted in `needs`.
pub(crate) fn clips(
    source: &Source,
    rig: &Rig,
    warnings: &mut Warnings,
    mut needs: Option<&mut Needs>,
) -> Vec<Clip> {
    // The text was read as a document before.
    let Ok(parts) = serde_json::from_str::<Parts<'_>>(source.json()) else { return Vec::new() };
    let Some(animations) = parts.animations else { return Vec::new() };
    let dropped = |(place, problem)| Warning::Animations { place, problem };
    let shape = |(place, message)| (place, DataProblem::Shape(message));
    let animations: Capped<&RawValue> = match parse_part(animations.get(), "/animations").map_err(shape) {
        Ok(list) => list,
        Err(fault) => {
            warnings.push(|| dropped(fault));
            return Vec::new();
        }
    };
    if animations.is_empty() {
        return Vec::new();
    }
    let accessors = parse_part(list(parts.accessors), "/accessors").map_err(shape);
    let views = parse_part(list(parts.buffer_views), "/bufferViews").map_err(shape);
    let (accessors, views) = match (accessors, views) {
        (Ok(accessors), Ok(views)) => (accessors, views),
        (Err(fault), _) | (_, Err(fault)) => {
            warnings.push(|| dropped(fault));
            return Vec::new();
        }
    };
    let buffers = source.buffers.iter().map(|buffer| match buffer {
        Buffer::Missing(reason) => Err(reason.clone()),
        found => found.bytes(&source.file).ok_or_else(|| "it is empty".to_owned()),
    });
    let n_bytes = source.buffers.iter().fold(source.file.len(), |sum, buffer| match buffer {
        Buffer::External(bytes) => sum.saturating_add(bytes.len()),
        _ => sum,
    });
    let most = (n_bytes as u64).saturating_add(65_536);
    let data = Data { accessors, views, buffers: buffers.collect(), most, sparse_left: Cell::new(most) };
    let joint_of_node = joint_of_node(source, parts.nodes.len());
    let scene = Scene { rig, bindings: &source.bindings, joint_of_node: &joint_of_node };
    let at_rest = AtRest { pose: rig.rest_pose(), size: OnceCell::new() };
    let mut budget = Budget::new(n_bytes, rig.n_joints());
    let texts: Vec<&str> = animations.iter().map(|text| text.get()).collect();
    let names = names(&texts);
    let mut clips = Vec::new();
    for (idx, (text, name)) in texts.iter().zip(&names).enumerate() {
        if let Some(own) = &name.in_file {
            warnings.push(|| Warning::ClipRenamed { clip: short(own), renamed: short(&name.name) });
        }
        let (name, needs) = (&name.name, needs.as_deref_mut());
        match clip(idx, text, name, &data, &scene, &at_rest, &mut budget, warnings, needs) {
            Ok(clip) => clips.push(clip),
            Err((place, problem)) => {
                warnings.push(|| Warning::ClipDropped { clip: short(name), place, problem });
            }
        }
    }
    clips
}

fn list(part: Option<&RawValue>) -> &str {
    part.map_or("[]", RawValue::get)
}

fn joint_of_node(source: &Source, n_nodes: usize) -> Vec<u32> {
    let mut joints = vec![NONE; n_nodes];
    for (joint, binding) in (0u32..).zip(&source.bindings) {
        if let Some(slot) = joints.get_mut(binding.node as usize) {
            *slot = joint;
        }
    }
    joints
}

/// The name of an animation's clip.
pub(crate) struct ClipName {
    /// Its own, which no other of the file has.
    pub(crate) name: String,
    /// The one that it has in the file, where another has it as well.
    pub(crate) in_file: Option<String>,
}

/// The names of all clips: those in the file, `clip_i` for animation `i` without one, and `_2`, `_3`, … behind one that
/// another has already.
pub(crate) fn names(animations: &[&str]) -> Vec<ClipName> {
    #[derive(Deserialize)]
    struct Named {
        #[serde(default)]
        name: String,
    }
    // What is wrong with an animation is said when the whole of it is read.
    let own = |text: &&str| serde_json::from_str(text).map_or_else(|_| String::new(), |Named { name }| name);
    let own: Vec<String> = animations.iter().map(own).collect();
    let mut first: HashMap<&str, u32> = HashMap::new();
    for (idx, name) in (0u32..).zip(&own).filter(|(_, name)| !name.is_empty()) {
        first.entry(name).or_insert(idx);
    }
    let mut namer = Namer::new(&first);
    let names = (0u32..).zip(&own).map(|(idx, name)| {
        if name.is_empty() {
            ClipName { name: namer.give(&format!("clip_{idx}"), true), in_file: None }
        } else if first.get(name.as_str()) == Some(&idx) {
            ClipName { name: name.clone(), in_file: None }
        } else {
            ClipName { name: namer.give(name, false), in_file: Some(name.clone()) }
        }
    });
    names.collect()
}
