//! A pose or a clip → a BVH file.

use std::borrow::Cow;
use std::collections::HashMap;
use std::io::Write;

use ikiru_rig::{Clip, Joint, JointId, Pose, Rig};

use crate::bvh::Layout;
use crate::bvh::write_plan::{JointPlan, Plan};
use crate::error::{Error, Fault};
use crate::gltf::write::check_pose;
use crate::loaded::Loaded;
use crate::names::Namer;

/// Seconds from frame to frame where nothing says how many.
const FRAME_TIME: f64 = 1.0 / 30.0;

/// A pose as a BVH file of one frame. The [module](crate::bvh) says how a rig is written; [`Loaded::from_rig`]
/// makes one of a rig that was not read from a file.
///
/// # Errors
/// When the pose has other joints than `loaded` or is not valid.
pub fn write_bvh_pose(loaded: &Loaded, pose: &Pose) -> Result<Vec<u8>, Error> {
    let frame_time = loaded.layout.as_ref().map_or(FRAME_TIME, |l| l.frame_time);
    check_pose(loaded, pose, "the pose")
        .and_then(|()| write(loaded, std::slice::from_ref(pose), frame_time))
        .map_err(|fault| fault.in_file(file_name(loaded)))
}

/// A clip as a BVH file, starting at 0 s. The [module](crate::bvh) says how a rig is written;
/// [`Loaded::from_rig`] makes one of a rig that was not read from a file.
///
/// BVH has frames at even steps. A clip at even times (within a thousandth of the step) is written pose by
/// pose; any other is sampled ([`Clip::sample`]) from its first to its last time, at its smallest step or a
/// little less, with at most ten times as many frames as it has poses.
///
/// # Errors
/// When the clip has other joints than `loaded` or a pose is not valid.
pub fn write_bvh_clip(loaded: &Loaded, clip: &Clip) -> Result<Vec<u8>, Error> {
    let frame_time = loaded.layout.as_ref().map_or(FRAME_TIME, |l| l.frame_time);
    let checked = clip.poses().iter().try_for_each(|pose| check_pose(loaded, pose, "the clip"));
    checked
        .and_then(|()| {
            let (poses, frame_time) = even(clip, frame_time);
            write(loaded, &poses, frame_time)
        })
        .map_err(|fault| fault.in_file(file_name(loaded)))
}

fn file_name(loaded: &Loaded) -> &str {
    match (&loaded.layout, loaded.source()) {
        (Some(layout), _) => &layout.file,
        (None, Some(source)) => source.name(),
        (None, None) => "rig",
    }
}

/// A clip's poses at even steps, and the step.
fn even(clip: &Clip, of_one: f64) -> (Cow<'_, [Pose]>, f64) {
    let (times, poses) = (clip.times(), clip.poses());
    let [start, second, ..] = *times else { return (Cow::Borrowed(poses), of_one) };
    let (duration, n_steps) = (clip.duration_secs(), times.len() - 1);
    let step = duration / n_steps as f64;
    if times.iter().enumerate().all(|(idx, t)| (t - start - idx as f64 * step).abs() <= 1e-3 * step) {
        // The first step has fewer digits than the mean of all, and most often is the same.
        let first = second - start;
        let is_same = (first * n_steps as f64 - duration).abs() <= 1e-9 * duration;
        return (Cow::Borrowed(poses), if is_same { first } else { step });
    }
    let smallest = times.windows(2).map(|pair| pair[1] - pair[0]).fold(duration, f64::min);
    let n_steps = (duration / smallest - 1e-6).ceil().clamp(1.0, 10.0 * n_steps as f64) as usize;
    let step = duration / n_steps as f64;
    let sampled = (0..=n_steps).map(|idx| clip.sample(start + idx as f64 * step)).collect();
    (Cow::Owned(sampled), step)
}

fn write(loaded: &Loaded, poses: &[Pose], frame_time: f64) -> Result<Vec<u8>, Fault> {
    let layout = loaded.layout.as_deref();
    let plan = Plan::new(&loaded.rig, layout, poses)?;
    let mut out = Output { bytes: Vec::new(), length_decimals: decimals(plan.extent) };
    let order = write_hierarchy(&mut out, &loaded.rig, layout, &plan);
    out.text(&format!("MOTION\nFrames: {}\nFrame Time: {frame_time}\n", poses.len()));
    let mut frame = Vec::new();
    for pose in poses {
        frame.clear();
        order.iter().for_each(|id| frame.extend(plan.numbers(pose, *id)));
        let lengths = frame.iter().filter(|(_, is_length)| *is_length).map(|(value, _)| value.abs());
        out.length_decimals = decimals(lengths.fold(plan.extent, f64::max));
        let mut separator = "";
        for (value, is_length) in &frame {
            out.text(separator);
            out.number(*value, *is_length);
            separator = " ";
        }
        out.text("\n");
    }
    Ok(out.bytes)
}

/// Writes the tree; the order in which joints stand in it. Without recursion, for rigs of any depth.
fn write_hierarchy(out: &mut Output, rig: &Rig, layout: Option<&Layout>, plan: &Plan) -> Vec<JointId> {
    let mut children: Vec<Vec<JointId>> = vec![Vec::new(); rig.n_joints()];
    // From the last to the first, since what is stacked last is written first.
    let mut stack = Vec::new();
    for id in rig.ids().rev() {
        match rig.get(id).and_then(|j| j.parent) {
            Some(parent) => children[parent.index()].push(id),
            None => stack.push((id, 0)),
        }
    }
    let names = names(rig, layout, plan);
    let mut order = Vec::with_capacity(rig.n_joints());
    out.text("HIERARCHY\n");
    let mut n_open = 0;
    while let Some((id, depth)) = stack.pop() {
        for depth in (depth..n_open).rev() {
            out.line(depth, "}");
        }
        n_open = depth + 1;
        let Some(joint) = plan.joints.get(id.index()) else { continue };
        out.indent(depth);
        out.text(match (joint.is_end_site, depth) {
            (true, _) => "End Site",
            (false, 0) => "ROOT",
            (false, _) => "JOINT",
        });
        if let Some(name) = names.get(id.index()).filter(|name| !name.is_empty()) {
            out.text(" ");
            out.bytes.extend_from_slice(name);
        }
        out.text("\n");
        out.line(depth, "{");
        out.indent(depth + 1);
        out.text("OFFSET");
        for value in joint.offset {
            out.text(" ");
            out.number(value, true);
        }
        out.text("\n");
        if !joint.is_end_site {
            let channels = joint.channels.as_slice();
            let words: String = channels.iter().map(|c| format!(" {}", c.name())).collect();
            out.line(depth + 1, &format!("CHANNELS {}{words}", channels.len()));
        }
        order.push(id);
        stack.extend(children[id.index()].iter().map(|child| (*child, depth + 1)));
    }
    for depth in (0..n_open).rev() {
        out.line(depth, "}");
    }
    order
}

/// The names as they are written, empty for none: as they stood in a BVH file, else such that every reader
/// takes them for one word.
fn names<'r>(rig: &'r Rig, layout: Option<&'r Layout>, plan: &Plan) -> Vec<Cow<'r, [u8]>> {
    let joints = (0u32..).zip(rig.joints().iter().zip(&plan.joints));
    if let Some(layout) = layout {
        let name = |(idx, (joint, plan)): (u32, (&'r Joint, &JointPlan))| match layout.name(idx) {
            Some(name) => Cow::Borrowed(name),
            None if plan.is_end_site => Cow::default(),
            None => Cow::Borrowed(joint.name.as_bytes()),
        };
        return joints.map(name).collect();
    }
    let is_bad = |c: char| c.is_whitespace() || c.is_control() || matches!(c, '{' | '}');
    let words: Vec<String> = rig.joints().iter().map(|j| j.name.replace(is_bad, "_")).collect();
    let mut first: HashMap<&str, u32> = HashMap::new();
    for (idx, word) in (0u32..).zip(&words) {
        first.entry(word).or_insert(idx);
    }
    let mut namer = Namer::new(&first);
    let unique = joints.zip(&words).map(|((idx, (_, plan)), word)| {
        let is_own = first.get(word.as_str()) == Some(&idx);
        match (plan.is_end_site, is_own) {
            (true, _) => Cow::default(),
            (false, true) => Cow::Owned(word.clone().into_bytes()),
            (false, false) => Cow::Owned(namer.give(word, false).into_bytes()),
        }
    });
    unique.collect()
}

/// Digits after the point that leave lengths twelve significant ones, measured by the largest.
fn decimals(extent: f64) -> usize {
    if extent > 0.0 { (11.0 - extent.log10().floor()).clamp(0.0, 300.0) as usize } else { 0 }
}

/// A text being written.
struct Output {
    bytes: Vec<u8>,
    length_decimals: usize,
}

impl Output {
    const ANGLE_DECIMALS: usize = 9;
    /// Trees that are deeper are not indented further: the text would grow with the square of the depth.
    const DEEPEST: usize = 40;

    fn text(&mut self, text: &str) {
        self.bytes.extend(text.as_bytes());
    }

    fn indent(&mut self, depth: usize) {
        (0..depth.min(Self::DEEPEST)).for_each(|_| self.bytes.push(b'\t'));
    }

    fn line(&mut self, depth: usize, text: &str) {
        self.indent(depth);
        self.text(text);
        self.text("\n");
    }

    /// A number with as many digits as it needs, up to a billionth of a degree or the twelfth digit of the
    /// frame's largest length.
    fn number(&mut self, value: f64, is_length: bool) {
        let decimals = if is_length { self.length_decimals } else { Self::ANGLE_DECIMALS };
        let start = self.bytes.len();
        // Writing to memory does not fail.
        let _ = write!(self.bytes, "{value:.decimals$}");
        if decimals > 0 {
            let is_zero = |b: &&u8| **b == b'0';
            let zeros = self.bytes.iter().skip(start).rev().take_while(is_zero).count();
            self.bytes.truncate(self.bytes.len() - zeros);
            if self.bytes.last() == Some(&b'.') {
                self.bytes.pop();
            }
        }
        if self.bytes.get(start..) == Some(b"-0") {
            self.bytes.remove(start);
        }
    }
}
