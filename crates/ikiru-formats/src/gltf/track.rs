//! Rotation and translation channels over time: at which times poses are needed, and what they are.

use std::collections::{HashMap, HashSet};

use glam::{DMat3, DQuat, DVec3};
use ikiru_rig::{Clip, JointId, Pose, Rig};
use serde::Deserialize;

use crate::gltf::accessor::Values;
use crate::gltf::problem::DataProblem;
use crate::gltf::transform::unit;

/// How a channel goes from one key to the next.
#[derive(Clone, Copy, Debug, Default, Deserialize, PartialEq, Eq)]
#[serde(rename_all = "UPPERCASE")]
pub(crate) enum Interpolation {
    #[default]
    Linear,
    Step,
    CubicSpline,
}

/// A step is a linear move this short (seconds), and at most half of the time between the keys.
const STEP_SECS: f64 = 1e-4;
/// A cubic spline is followed by linear moves not longer than this (seconds), at most 16 between two keys.
const SPLINE_SECS: f64 = 1.0 / 30.0;
const SPLINE_PARTS: f64 = 16.0;

/// What the clips of one file may cost: limits that follow from its size, so that a small file that refers
/// to the same numbers again and again neither fills the memory nor takes forever.
pub(crate) struct Budget {
    /// Bytes for poses.
    pub(crate) poses: usize,
    /// Key times to be held at once.
    pub(crate) times: usize,
    /// Elements to be looked at.
    pub(crate) elements: usize,
}

impl Budget {
    /// For a file of `n_bytes` and a rig of `n_joints`: with the file, the times and the rig itself, reading
    /// stays below 64 MiB and eight times the file's size.
    pub(crate) fn new(n_bytes: usize, n_joints: usize) -> Self {
        const MIB: usize = 1 << 20;
        let left = (44 * MIB).saturating_sub(n_joints.saturating_mul(600)).max(4 * MIB);
        Self {
            poses: n_bytes.saturating_mul(4).saturating_add(left),
            times: (n_bytes / 8).saturating_add(MIB / 4),
            elements: n_bytes.saturating_mul(8).saturating_add(4 * MIB),
        }
    }
}

/// A channel of a joint that moves so.
pub(crate) struct Track<'b> {
    pub(crate) joint: JointId,
    /// The accessor of its times.
    pub(crate) input: u32,
    pub(crate) interpolation: Interpolation,
    pub(crate) values: Values<'b>,
    pub(crate) motion_of: MotionOf,
    /// The key before the time that is sampled.
    pub(crate) key: usize,
}

/// How a joint's motion follows from its node's transform.
#[derive(Clone, Copy)]
pub(crate) enum MotionOf {
    /// Of the node's rotation: what it is multiplied with from the left and from the right.
    Rotation(DQuat, DQuat),
    /// Of the node's translation: what it is multiplied with, then what is added.
    Translation(DMat3, DVec3),
}

/// All times at which a pose is needed.
pub(crate) fn union(
    tracks: &[Track<'_>],
    times: &HashMap<u32, Vec<f64>>,
    rig: &Rig,
    budget: &mut Budget,
) -> Result<Vec<f64>, DataProblem> {
    let per_pose = 64 + 8 * rig.n_coords();
    let most = budget.poses / per_pose;
    let mut all: Vec<f64> = Vec::new();
    let mut seen = HashSet::new();
    for track in tracks.iter().filter(|t| seen.insert((t.input, t.interpolation as u8))) {
        let Some(keys) = times.get(&track.input) else { continue };
        all.extend(keys);
        for pair in keys.windows(2) {
            let &[from, to] = pair else { continue };
            match track.interpolation {
                Interpolation::Linear => {}
                Interpolation::Step => {
                    // Not less than what times of 32 bits can tell apart.
                    all.push((to - STEP_SECS.max(1e-6 * to.abs())).max(0.5 * (from + to)));
                }
                Interpolation::CubicSpline => {
                    let parts = ((to - from) / SPLINE_SECS).ceil().clamp(1.0, SPLINE_PARTS);
                    let mut part = 1.0;
                    while part < parts && all.len() <= most {
                        all.push(from + (to - from) * (part / parts));
                        part += 1.0;
                    }
                }
            }
        }
    }
    all.sort_unstable_by(f64::total_cmp);
    all.dedup();
    if all.len() > most {
        return Err(DataProblem::Size { poses: all.len() });
    }
    budget.poses -= all.len() * per_pose;
    Ok(all)
}

/// The clip of some tracks at the given times, of joints that otherwise stay as in `rest`.
pub(crate) fn sample(
    name: &str,
    tracks: &mut [Track<'_>],
    union: Vec<f64>,
    times: &HashMap<u32, Vec<f64>>,
    rest: &Pose,
) -> Result<Clip, String> {
    let mut poses: Vec<Pose> = Vec::with_capacity(union.len());
    for secs in &union {
        let mut pose = rest.clone();
        for track in &mut *tracks {
            let Some(keys) = times.get(&track.input) else { continue };
            match track.motion_of {
                MotionOf::Rotation(left, right) => {
                    pose.set_rotation(track.joint, left * track.rotation(keys, *secs) * right)
                }
                MotionOf::Translation(matrix, add) => {
                    let translation = track.translation(keys, *secs);
                    pose.set_translation(track.joint, matrix * translation + add)
                }
            }
            .map_err(|error| error.to_string())?;
        }
        poses.push(pose);
    }
    Clip::new(name, union, poses).map_err(|error| error.to_string())
}

impl Track<'_> {
    fn quaternion(&self, element: usize) -> DQuat {
        unit(self.values.get(element)).unwrap_or_default()
    }

    /// The node's rotation at a time. Times come in increasing order.
    fn rotation(&mut self, keys: &[f64], secs: f64) -> DQuat {
        match self.span(keys, secs) {
            Span::Key(element) => self.quaternion(element),
            Span::Linear(from, to, t) => self.quaternion(from).slerp(self.quaternion(to), t).normalize(),
            Span::Spline(from, span, t) => {
                unit(self.spline(from, span, t)).unwrap_or_else(|| self.quaternion(from))
            }
        }
    }

    /// The node's translation at a time, in its own unit. Times come in increasing order.
    fn translation(&mut self, keys: &[f64], secs: f64) -> DVec3 {
        let values = self.values;
        let vector = |element: usize| DVec3::from_array(values.get(element));
        match self.span(keys, secs) {
            Span::Key(element) => vector(element),
            Span::Linear(from, to, t) => vector(from).lerp(vector(to), t),
            Span::Spline(from, span, t) => DVec3::from_array(self.spline(from, span, t)),
        }
    }

    fn span(&mut self, keys: &[f64], secs: f64) -> Span {
        while keys.get(self.key + 1).is_some_and(|next| *next <= secs) {
            self.key += 1;
        }
        let key = self.key;
        let cubic = self.interpolation == Interpolation::CubicSpline;
        let at = |key: usize| if cubic { 3 * key + 1 } else { key };
        let (Some(from), Some(to)) = (keys.get(key), keys.get(key + 1)) else {
            return Span::Key(at(key));
        };
        if secs <= *from || self.interpolation == Interpolation::Step {
            return Span::Key(at(key));
        }
        let t = (secs - from) / (to - from);
        if cubic { Span::Spline(at(key), to - from, t) } else { Span::Linear(at(key), at(key + 1), t) }
    }

    /// glTF's cubic Hermite spline: value and out-tangent here, in-tangent and value there.
    fn spline<const N: usize>(&self, from: usize, span: f64, t: f64) -> [f64; N] {
        let number = |element: usize| -> [f64; N] { self.values.get(element) };
        let (v0, b0, a1, v1) = (number(from), number(from + 1), number(from + 2), number(from + 3));
        let (t2, t3) = (t * t, t * t * t);
        std::array::from_fn(|c| {
            (2.0 * t3 - 3.0 * t2 + 1.0) * v0[c]
                + span * (t3 - 2.0 * t2 + t) * b0[c]
                + (3.0 * t2 - 2.0 * t3) * v1[c]
                + span * (t3 - t2) * a1[c]
        })
    }
}

/// What a value at a time comes from: elements of the accessor.
enum Span {
    Key(usize),
    /// From, to, and how far between them.
    Linear(usize, usize, f64),
    /// From, seconds to the next key, and how far on the way.
    Spline(usize, f64, f64),
}
