//! A pose or a clip → a BVH file.

use std::borrow::Cow;
use std::collections::HashMap;
use std::io::Write;

use ikiru_rig::{Clip, JointId, JointMotion, Pose, Rig};

use crate::bvh::Layout;
use crate::bvh::channel::{Channels, DEFAULT_ORDER};
use crate::bvh::tree::{Entry, Kind, Tree};
use crate::bvh::write_plan::{JointPlan, Plan};
use crate::error::{Error, Fault};
use crate::gltf::Source;
use crate::gltf::write::check_pose;
use crate::loaded::Loaded;
use crate::names::Namer;
use crate::warning::{Warning, Warnings, short};
use crate::written::Written;

/// Seconds from frame to frame where nothing says how many.
const FRAME_TIME: f64 = 1.0 / 30.0;

/// A pose as a BVH file of one frame. The [module](crate::bvh) says how a rig is written; [`Loaded::from_rig`]
/// makes one of a rig that was not read from a file. [`write_pose`](crate::write_pose) tells besides which joints had
/// to be called otherwise.
///
/// # Errors
/// When the pose has other joints than `loaded` or is not valid.
pub fn write_bvh_pose(loaded: &Loaded, pose: &Pose) -> Result<Vec<u8>, Error> {
    pose_file(loaded, pose).map(|written| written.bytes)
}

/// A clip as a BVH file, starting at 0 s. The [module](crate::bvh) says how a rig is written;
/// [`Loaded::from_rig`] makes one of a rig that was not read from a file. [`write_clip`](crate::write_clip) tells
/// besides which joints had to be called otherwise.
///
/// BVH has frames at even steps. A clip at even times (within a thousandth of the step) is written pose by
/// pose; any other is sampled ([`Clip::sample`]) from its first to its last time, at its smallest step or a
/// little less, with at most ten times as many frames as it has poses.
///
/// # Errors
/// When the clip has other joints than `loaded` or a pose is not valid.
pub fn write_bvh_clip(loaded: &Loaded, clip: &Clip) -> Result<Vec<u8>, Error> {
    clip_file(loaded, clip).map(|written| written.bytes)
}

pub(crate) fn pose_file(loaded: &Loaded, pose: &Pose) -> Result<Written, Error> {
    let frame_time = loaded.layout.as_ref().map_or(FRAME_TIME, |l| l.frame_time);
    check_pose(loaded, pose, "the pose")
        .and_then(|()| write(loaded, std::slice::from_ref(pose), frame_time))
        .map_err(|fault| fault.in_file(file_name(loaded)))
}

pub(crate) fn clip_file(loaded: &Loaded, clip: &Clip) -> Result<Written, Error> {
    let frame_time = loaded.layout.as_ref().map_or(FRAME_TIME, |l| l.frame_time);
    let checked = clip.poses().iter().try_for_each(|pose| check_pose(loaded, pose, "the clip"));
    checked
        .and_then(|()| {
            // The file's own angles stay as they are.
            let continued = if loaded.layout.is_some() { clip.clone() } else { clip.clone().unwrapped() };
            let (poses, frame_time) = even(&continued, frame_time);
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

fn write(loaded: &Loaded, poses: &[Pose], frame_time: f64) -> Result<Written, Fault> {
    let (rig, layout) = (&loaded.rig, loaded.layout.as_deref());
    let tree = tree(loaded, poses);
    let plan = Plan::new(rig, layout, &tree, poses)?;
    let mut warnings = Warnings::default();
    let names = names(rig, layout, &tree, &plan, &mut warnings);
    let mut out = Output { bytes: Vec::new(), length_decimals: decimals(plan.extent) };
    write_hierarchy(&mut out, rig, &tree, &plan, &names);
    out.text(&format!("MOTION\nFrames: {}\nFrame Time: {frame_time}\n", poses.len()));
    let mut frame = Vec::new();
    let mut before = vec![None; tree.entries.len()];
    for pose in poses {
        frame.clear();
        for (entry, before) in tree.entries.iter().zip(&mut before) {
            match entry.kind {
                Kind::Joint(id) => frame.extend(plan.numbers(pose, id, before)),
                Kind::Join => frame.extend([(0.0, false); 6]),
                Kind::EndSite(_) | Kind::Tip(_) => {}
            }
        }
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
    Ok(Written { bytes: out.bytes, warnings: warnings.into_vec() })
}

/// What is written of a rig: all of a BVH file's own, else its skeleton, be it that the rig or the poses move it.
fn tree(loaded: &Loaded, poses: &[Pose]) -> Tree {
    let rig = &loaded.rig;
    if loaded.layout.is_some() {
        return Tree::of_file(rig);
    }
    let moved = poses.first().map_or(rig, Pose::rig);
    let matters = |id: JointId| {
        let moves = |rig: &Rig| rig.get(id).is_some_and(|joint| joint.motion != JointMotion::Fixed);
        moves(rig) || moves(moved) || rig.get(id).is_some_and(|joint| joint.role.is_some())
    };
    let things = loaded.source().map(Source::things).unwrap_or_default();
    Tree::of_body(rig, matters, |id| things.get(id.index()) == Some(&true))
}

/// What the root over several trees has.
fn join_channels() -> Channels {
    Channels::complete(DEFAULT_ORDER, true)
}

/// Writes the tree, `names` beside its entries.
fn write_hierarchy(out: &mut Output, rig: &Rig, tree: &Tree, plan: &Plan, names: &[Cow<'_, [u8]>]) {
    out.text("HIERARCHY\n");
    let mut n_open = 0;
    for (entry, name) in tree.entries.iter().zip(names) {
        let depth = entry.depth;
        for depth in (depth..n_open).rev() {
            out.line(depth, "}");
        }
        n_open = depth + 1;
        let of_joint = |id: JointId| plan.joints.get(id.index()).copied().unwrap_or(JointPlan::FIXED);
        let (offset, channels) = match entry.kind {
            Kind::Joint(id) | Kind::EndSite(id) => {
                let joint = of_joint(id);
                (joint.offset, (!joint.is_end_site).then_some(joint.channels))
            }
            Kind::Join => ([0.0; 3], Some(join_channels())),
            Kind::Tip(id) => (plan.tip(rig, id), None),
        };
        out.indent(depth);
        out.text(match (channels, depth) {
            (None, _) => "End Site",
            (Some(_), 0) => "ROOT",
            (Some(_), _) => "JOINT",
        });
        if !name.is_empty() {
            out.text(" ");
            out.bytes.extend_from_slice(name);
        }
        out.text("\n");
        out.line(depth, "{");
        out.indent(depth + 1);
        out.text("OFFSET");
        for value in offset {
            out.text(" ");
            out.number(value, true);
        }
        out.text("\n");
        if let Some(channels) = channels {
            let words: String = channels.as_slice().iter().map(|c| format!(" {}", c.name())).collect();
            out.line(depth + 1, &format!("CHANNELS {}{words}", channels.len()));
        }
    }
    for depth in (0..n_open).rev() {
        out.line(depth, "}");
    }
}

/// The names of a tree's entries as they are written, empty for none: as they stood in a BVH file, else such that
/// every reader takes them for one word.
fn names<'r>(
    rig: &'r Rig,
    layout: Option<&'r Layout>,
    tree: &Tree,
    plan: &Plan,
    warnings: &mut Warnings,
) -> Vec<Cow<'r, [u8]>> {
    let own = |id: JointId| rig.get(id).map_or("", |joint| joint.name.as_str());
    if let Some(layout) = layout {
        let name = |entry: &Entry| match entry.kind {
            Kind::Joint(id) | Kind::EndSite(id) => match layout.name(id.index() as u32) {
                Some(name) => Cow::Borrowed(name),
                None if plan.joints.get(id.index()).is_some_and(|joint| joint.is_end_site) => Cow::default(),
                None => Cow::Borrowed(own(id).as_bytes()),
            },
            Kind::Join | Kind::Tip(_) => Cow::default(),
        };
        return tree.entries.iter().map(name).collect();
    }
    let is_bad = |c: char| c.is_whitespace() || c.is_control() || matches!(c, '{' | '}');
    let word = |entry: &Entry| match entry.kind {
        Kind::Joint(id) => own(id).replace(is_bad, "_"),
        Kind::Join => "root".to_owned(),
        Kind::EndSite(_) | Kind::Tip(_) => String::new(),
    };
    let words: Vec<String> = tree.entries.iter().map(word).collect();
    // Who bears a name keeps it before one whose name only became the same.
    let mut first: HashMap<&str, u32> = HashMap::new();
    let kept = |idx: usize| matches!(tree.entries.get(idx), Some(Entry { kind: Kind::Joint(id), .. }) if own(*id) == words[idx]);
    let (keep, rest): (Vec<usize>, Vec<usize>) = (0..words.len()).partition(|idx| kept(*idx));
    for idx in keep.into_iter().chain(rest).filter(|idx| !words[*idx].is_empty()) {
        first.entry(&words[idx]).or_insert(idx as u32);
    }
    let mut namer = Namer::new(&first);
    let mut names = Vec::with_capacity(words.len());
    for (idx, (entry, word)) in tree.entries.iter().zip(&words).enumerate() {
        let is_own = word.is_empty() || first.get(word.as_str()) == Some(&(idx as u32));
        let name = if is_own { word.clone() } else { namer.give(word, false) };
        if let Kind::Joint(id) = entry.kind
            && own(id) != name
        {
            warnings.push(|| Warning::NameWritten { joint: short(own(id)), written: short(&name) });
        }
        names.push(Cow::Owned(name.into_bytes()));
    }
    names
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
