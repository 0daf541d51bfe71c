//! One animation as a clip: all its channels that move joints, sampled at the union of their key times.

use std::borrow::Cow;
use std::cell::OnceCell;
use std::collections::{BTreeMap, HashMap, HashSet};

use glam::{DMat3, DVec3};
use ikiru_rig::{Clip, JointId, JointMotion, Pose, Rig};
use serde::Deserialize;

use crate::gltf::accessor::{At, Data, Kind};
use crate::gltf::document::parse_part;
use crate::gltf::problem::DataProblem;
use crate::gltf::scale::UNIFORM;
use crate::gltf::source::Binding;
use crate::gltf::track::{Budget, Interpolation, MotionOf, Track, sample, union};
use crate::gltf::transform::unit;
use crate::gltf::tree::NONE;
use crate::warning::{Warning, Warnings, short};

#[derive(Deserialize)]
#[serde(expecting = "an animation object")]
struct AnimationEntry<'a> {
    #[serde(borrow)]
    channels: Vec<ChannelEntry<'a>>,
    samplers: Vec<SamplerEntry>,
}

#[derive(Deserialize)]
#[serde(expecting = "a channel object")]
struct ChannelEntry<'a> {
    sampler: u32,
    #[serde(borrow)]
    target: TargetEntry<'a>,
}

#[derive(Deserialize)]
#[serde(expecting = "a target object")]
struct TargetEntry<'a> {
    node: Option<u32>,
    #[serde(borrow)]
    path: Cow<'a, str>,
}

#[derive(Deserialize)]
#[serde(expecting = "a sampler object")]
struct SamplerEntry {
    input: u32,
    output: u32,
    #[serde(default)]
    interpolation: Interpolation,
}

/// What the clips are for. What is asked of the whole rig is asked once: a clip may be short and a rig large.
pub(super) struct Scene<'s> {
    pub(super) rig: &'s Rig,
    pub(super) bindings: &'s [Binding],
    pub(super) joint_of_node: &'s [u32],
}

/// The rig at rest, and its size once that is needed.
pub(super) struct AtRest {
    pub(super) pose: Pose,
    pub(super) size: OnceCell<f64>,
}

/// What clips do with joints that cannot do so: one entry a joint.
#[derive(Debug)]
pub(crate) struct Needs {
    pub(crate) turns: Vec<bool>,
    pub(crate) translates: Vec<bool>,
}

impl Needs {
    pub(crate) fn none(rig: &Rig) -> Self {
        Self { turns: vec![false; rig.n_joints()], translates: vec![false; rig.n_joints()] }
    }
}

/// The clip of one animation, under a name.
pub(super) fn clip(
    idx: usize,
    text: &str,
    name: &str,
    data: &Data<'_>,
    scene: &Scene<'_>,
    at_rest: &AtRest,
    budget: &mut Budget,
    warnings: &mut Warnings,
    needs: Option<&mut Needs>,
) -> At<Clip> {
    let entry: AnimationEntry<'_> = parse_part(text, &format!("/animations/{idx}"))
        .map_err(|(place, message)| (place, DataProblem::Shape(message)))?;
    let mut reader = Reader {
        at: format!("/animations/{idx}"),
        entry: &entry,
        data,
        scene,
        at_rest,
        times: HashMap::new(),
        ignored: BTreeMap::new(),
        needs,
    };
    // A joint has two at most. They are large: a list that grows by doubling would take a third more.
    let mut tracks = Vec::with_capacity(entry.channels.len().min(2 * scene.rig.n_joints()));
    let mut targets = HashSet::new();
    for (at, channel) in entry.channels.iter().enumerate() {
        if let Some(node) = channel.target.node
            && !targets.insert((node, &*channel.target.path))
        {
            return Err((format!("/animations/{idx}/channels/{at}"), DataProblem::Repeated));
        }
        tracks.extend(reader.track(at, channel, budget)?);
    }
    let Reader { times, ignored, .. } = reader;
    if tracks.is_empty() {
        return Err((format!("/animations/{idx}"), DataProblem::Still));
    }
    let times = union(&tracks, &times, scene.rig, budget)
        .map_err(|problem| (format!("/animations/{idx}"), problem))
        .map(|union| (union, times))?;
    let clip = sample(name, &mut tracks, times.0, &times.1, &at_rest.pose)
        .map_err(|message| (format!("/animations/{idx}"), DataProblem::Shape(message)))?;
    for (path, (count, first)) in ignored {
        warnings.push(|| Warning::ChannelsIgnored { clip: short(name), path, count, first });
    }
    Ok(clip)
}

struct Reader<'r, 'b> {
    at: String,
    entry: &'r AnimationEntry<'r>,
    data: &'r Data<'b>,
    scene: &'r Scene<'r>,
    at_rest: &'r AtRest,
    /// Key times by accessor.
    times: HashMap<u32, Vec<f64>>,
    /// Channels that change nothing a rig has: how many by path, and the first one's node.
    ignored: BTreeMap<String, (usize, String)>,
    /// Where what joints lack for them is noted.
    needs: Option<&'r mut Needs>,
}

impl<'b> Reader<'_, 'b> {
    /// The track of a channel, if it turns a joint that can turn or moves one that can move.
    fn track(&mut self, at: usize, channel: &ChannelEntry<'_>, budget: &mut Budget) -> At<Option<Track<'b>>> {
        let place = || format!("{}/channels/{at}", self.at);
        // Without a node, an extension says what moves: nothing of a rig.
        let Some(node) = channel.target.node else { return Ok(None) };
        let Some(joint) = self.scene.joint_of_node.get(node as usize).copied() else {
            let count = self.scene.joint_of_node.len();
            let problem = DataProblem::OutOfRange { what: "node", found: node, count };
            return Err((format!("{}/target/node", place()), problem));
        };
        let Some(sampler) = self.entry.samplers.get(channel.sampler as usize) else {
            let (found, count) = (channel.sampler, self.entry.samplers.len());
            return Err((place(), DataProblem::OutOfRange { what: "sampler", found, count }));
        };
        let (kind, integers) = match &*channel.target.path {
            "rotation" => (Kind::Vec4, true),
            "translation" | "scale" => (Kind::Vec3, false),
            path => {
                self.ignore(path, node, joint);
                return Ok(None);
            }
        };
        if joint == NONE {
            self.ignore(&channel.target.path, node, joint);
            return Ok(None);
        }
        self.read_times(sampler.input, budget)?;
        let n_times = self.times.get(&sampler.input).map_or(0, Vec::len);
        let values = self.data.values(sampler.output, kind, integers)?;
        let per_key = if sampler.interpolation == Interpolation::CubicSpline { 3 } else { 1 };
        if values.count != n_times.saturating_mul(per_key) {
            let (found, expected) = (values.count as u64, n_times.saturating_mul(per_key) as u64);
            return Err((format!("/accessors/{}", sampler.output), DataProblem::Count { found, expected }));
        }
        if values.count > budget.elements {
            return Err((format!("/accessors/{}", sampler.output), DataProblem::Claims(values.count as u64)));
        }
        budget.elements -= values.count;
        let id = JointId::from_index(joint as usize);
        let (Some(data), Some(binding)) = (self.scene.rig.get(id), self.scene.bindings.get(joint as usize))
        else {
            return Ok(None);
        };
        let (input, interpolation) = (sampler.input, sampler.interpolation);
        let track =
            |values, motion_of| Some(Track { joint: id, input, interpolation, values, motion_of, key: 0 });
        let keys = || (0..n_times).map(|k| if per_key == 3 { 3 * k + 1 } else { k });
        let changes = match &*channel.target.path {
            "rotation" => {
                if let Some(at) = keys().find(|k| unit(values.get(*k)).is_none()) {
                    return Err((format!("/accessors/{}", sampler.output), DataProblem::Rotation { at }));
                }
                let turn = binding.turn.quaternion();
                let left = data.rest_rotation.inverse() * turn;
                let right = binding.half_turn.quaternion() * turn.inverse();
                if matches!(data.motion, JointMotion::Ball { .. } | JointMotion::Free { .. }) {
                    return Ok(track(values, MotionOf::Rotation(left, right)));
                }
                keys().any(|k| {
                    let q = unit(values.get(k)).unwrap_or_default();
                    (left * q * right).w.abs() < 1.0 - 1e-10
                })
            }
            "translation" if matches!(data.motion, JointMotion::Free { .. }) => {
                if let Some(at) = keys().find(|k| !DVec3::from_array(values.get(*k)).is_finite()) {
                    return Err((format!("/accessors/{}", sampler.output), DataProblem::Translation { at }));
                }
                let from_parent = data.rest_rotation.inverse();
                let axes = [DVec3::X, DVec3::Y, DVec3::Z];
                let [x, y, z] = axes.map(|axis| from_parent * binding.joint_translation(axis));
                let motion_of =
                    MotionOf::Translation(DMat3::from_cols(x, y, z), -(from_parent * data.rest_translation));
                return Ok(track(values, motion_of));
            }
            "translation" => {
                let tolerance = 1e-6 * *self.at_rest.size.get_or_init(|| self.scene.rig.size());
                keys().any(|k| {
                    let offset = binding.joint_translation(DVec3::from_array(values.get(k)));
                    // Also true of what is not a number.
                    !(offset - data.rest_translation).abs().cmple(DVec3::splat(tolerance)).all()
                })
            }
            _ => keys().any(|k| {
                let scale = DVec3::from_array(values.get(k)).abs();
                !(scale - binding.scale).abs().cmple(UNIFORM * binding.scale).all()
            }),
        };
        if changes {
            self.ignore(&channel.target.path, node, joint);
            if let Some(needs) = self.needs.as_deref_mut() {
                match &*channel.target.path {
                    "rotation" => needs.turns[id.index()] = true,
                    "translation" => needs.translates[id.index()] = true,
                    _ => {}
                }
            }
        }
        Ok(None)
    }

    fn ignore(&mut self, path: &str, node: u32, joint: u32) {
        let name = || {
            let joint = self.scene.rig.get(JointId::from_index(joint as usize));
            joint.map_or_else(|| format!("node {node}"), |j| short(&j.name))
        };
        // glTF has four; what extensions name is one more.
        let known = ["translation", "rotation", "scale", "weights"];
        let path = if known.contains(&path) { path } else { "other" }.to_owned();
        let (count, _) = self.ignored.entry(path).or_insert_with(|| (0, name()));
        *count = count.saturating_add(1);
    }

    /// Reads the times of an accessor, once.
    fn read_times(&mut self, input: u32, budget: &mut Budget) -> At<()> {
        if self.times.contains_key(&input) {
            return Ok(());
        }
        let at = format!("/accessors/{input}");
        let values = self.data.values(input, Kind::Scalar, false)?;
        if values.count > budget.times {
            return Err((at, DataProblem::Claims(values.count as u64)));
        }
        budget.times -= values.count;
        let mut times = Vec::with_capacity(values.count);
        let mut previous = f64::NEG_INFINITY;
        for at_key in 0..values.count {
            let [secs] = values.get(at_key);
            if !secs.is_finite() || secs <= previous {
                return Err((at, DataProblem::Time { at: at_key, secs }));
            }
            times.push(secs);
            previous = secs;
        }
        self.times.insert(input, times);
        Ok(())
    }
}
