//! A clip → the file that the rig was read from, with the clip as its first animation.

use glam::DVec3;
use ikiru_rig::{Clip, JointId, JointMotion};

use crate::error::{Error, ErrorKind, Fault};
use crate::gltf::clips::names;
use crate::gltf::container::{Container, pad};
use crate::gltf::patch::{Members, list, string};
use crate::gltf::uri;
use crate::gltf::write::{Output, check_pose, node_rotation, node_translation, source};
use crate::loaded::Loaded;
use crate::warning::{Warning, short};
use crate::written::Written;

/// The file that the rig was read from, as `.glb`, with a clip as its first animation: the one that viewers start.
///
/// Every joint that moves in the clip has a rotation channel, linear between the clip's times; one that
/// translates a translation channel besides, in the node's own unit. All else stays as for
/// [`write_posed_glb`](crate::write_posed_glb); what was in the BIN chunk stays at its place in it. Times
/// before 0, which glTF does not have, are moved up to begin at 0.
///
/// The file's own animations follow, each under a name of its own; one with the clip's name gives way to it, so that
/// what is written again and again is there once. [`write_clip`](crate::write_clip) says which that was, and writes
/// `.gltf` and `.vrm` too.
///
/// # Errors
/// When the rig was not read from a glTF file, the clip has other joints or is not valid, or a buffer cannot
/// be embedded.
pub fn write_animated_glb(loaded: &Loaded, clip: &Clip) -> Result<Vec<u8>, Error> {
    clip_file(loaded, clip, Container::Binary).map(|written| written.bytes)
}

pub(crate) fn clip_file(loaded: &Loaded, clip: &Clip, container: Container) -> Result<Written, Error> {
    let source = source(loaded)?;
    animated(loaded, clip, container).map_err(|fault| fault.in_file(source.name()))
}

/// Numbers of one accessor, as they are written.
struct Track {
    node: u32,
    path: &'static str,
    values: Vec<f32>,
}

fn animated(loaded: &Loaded, clip: &Clip, container: Container) -> Result<Written, Fault> {
    for pose in clip.poses() {
        check_pose(loaded, pose, "the clip")?;
    }
    let Some(source) = loaded.source() else { return Err(ErrorKind::NoSource.into()) };
    let mut out = Output::new(source)?;
    let (times, keys) = key_times(clip);
    let mut tracks: Vec<Track> = Vec::new();
    let mut any = None;
    for (id, binding) in loaded.rig.ids().zip(&source.bindings) {
        any.get_or_insert(id);
        let before = tracks.len();
        tracks.extend(rotations(loaded, clip, &keys, id, false));
        tracks.extend(translations(loaded, clip, &keys, id)?);
        if tracks.len() > before {
            out.change_node(binding, |_| ())?;
        }
    }
    // A clip that stands still has its length all the same, and glTF wants a channel.
    if let (true, Some(id)) = (tracks.is_empty(), any) {
        let binding = source.bindings.first();
        if let Some(binding) = binding {
            out.change_node(binding, |_| ())?;
        }
        tracks.extend(rotations(loaded, clip, &keys, id, true));
    }
    let mut warnings = Vec::new();
    // A clip of the file that is only written again is no news.
    if insert(&mut out, clip.name(), &times, &tracks)? && !loaded.clips.contains(clip) {
        warnings.push(Warning::ClipReplaced { clip: short(clip.name()) });
    }
    Ok(Written { bytes: out.finish(source, container)?, warnings })
}

/// The times as 32-bit numbers that increase, and the pose of each.
pub(crate) fn key_times(clip: &Clip) -> (Vec<f32>, Vec<usize>) {
    let first = clip.times().first().copied().unwrap_or(0.0).min(0.0);
    let (mut times, mut keys) = (Vec::<f32>::new(), Vec::new());
    for (key, secs) in clip.times().iter().enumerate() {
        let secs = ((secs - first) as f32).min(f32::MAX);
        // Times too near to each other for 32 bits are one time.
        if times.last().is_none_or(|last| secs > *last) {
            times.push(secs);
            keys.push(key);
        }
    }
    (times, keys)
}

fn rotations(loaded: &Loaded, clip: &Clip, keys: &[usize], id: JointId, always: bool) -> Option<Track> {
    let binding = loaded.source()?.bindings.get(id.index())?;
    let motions =
        || keys.iter().filter_map(|key| clip.poses().get(*key)).filter_map(|pose| pose.rotation(id).ok());
    if !always && motions().all(|q| q.w.abs() == 1.0) {
        return None;
    }
    let mut values = Vec::with_capacity(keys.len().saturating_mul(4));
    let mut previous = None;
    for motion in motions() {
        let mut rotation = node_rotation(loaded, id, binding, motion);
        // Neighbours on the same side, for viewers that do not look for the short way themselves.
        if previous.is_some_and(|p| rotation.dot(p) < 0.0) {
            rotation = -rotation;
        }
        previous = Some(rotation);
        values.extend(rotation.to_array().map(|c| c as f32));
    }
    Some(Track { node: binding.node, path: "rotation", values })
}

fn translations(loaded: &Loaded, clip: &Clip, keys: &[usize], id: JointId) -> Result<Option<Track>, Fault> {
    let binding = loaded.source().and_then(|source| source.bindings.get(id.index()));
    let joint = clip.poses().first().and_then(|pose| pose.rig().get(id));
    let (Some(binding), Some(joint)) = (binding, joint) else { return Ok(None) };
    let poses = || keys.iter().filter_map(|key| clip.poses().get(*key));
    let translates = matches!(joint.motion, JointMotion::Free { .. } | JointMotion::Slider { .. });
    if !translates || poses().all(|pose| pose.translation(id).unwrap_or_default() == DVec3::ZERO) {
        return Ok(None);
    }
    let mut values = Vec::with_capacity(keys.len().saturating_mul(3));
    for pose in poses() {
        values.extend(in_32_bits(node_translation(
            loaded,
            id,
            binding,
            pose.translation(id).unwrap_or_default(),
        ))?);
    }
    Ok(Some(Track { node: binding.node, path: "translation", values }))
}

/// A translation as 32-bit numbers; one beyond their range is an error rather than infinite.
pub(crate) fn in_32_bits(translation: [f64; 3]) -> Result<[f32; 3], Fault> {
    let narrow = translation.map(|c| c as f32);
    if narrow.iter().all(|c| c.is_finite()) {
        return Ok(narrow);
    }
    let found = translation.to_vec();
    Err(ErrorKind::Magnitude32 { what: "the translation", found }.into())
}

/// Makes the animation the document's first, and appends its numbers to a buffer; whether another gave way to it.
fn insert(out: &mut Output<'_>, name: &str, times: &[f32], tracks: &[Track]) -> Result<bool, Fault> {
    let shape = |error: serde_json::Error| Fault::from(ErrorKind::Shape { message: error.to_string() });
    let mut accessors = out.members.list("accessors").map_err(shape)?;
    let mut views = out.members.list("bufferViews").map_err(shape)?;
    let mut animations = out.members.list("animations").map_err(shape)?;

    let mut bytes = Vec::new();
    let (buffer, start) = place(out)?;
    let mut accessor = |values: &[f32], kind: &str, width: usize, bounds: &str| {
        let offset = start.saturating_add(bytes.len() as u64);
        bytes.extend(values.iter().flat_map(|v| v.to_le_bytes()));
        let length = values.len().saturating_mul(4);
        views.push(format!(r#"{{"buffer":{buffer},"byteOffset":{offset},"byteLength":{length}}}"#));
        let (view, count) = (views.len() - 1, values.len() / width);
        accessors.push(format!(
            r#"{{"bufferView":{view},"componentType":5126,"count":{count},"type":"{kind}"{bounds}}}"#
        ));
        accessors.len() - 1
    };
    let bound = |time: Option<&f32>| f64::from(time.copied().unwrap_or(0.0));
    let bounds = format!(r#","min":[{:?}],"max":[{:?}]"#, bound(times.first()), bound(times.last()));
    let input = accessor(times, "SCALAR", 1, &bounds);
    let (mut samplers, mut channels) = (Vec::new(), Vec::new());
    for (sampler, Track { node, path, values }) in tracks.iter().enumerate() {
        let (kind, width) = if *path == "rotation" { ("VEC4", 4) } else { ("VEC3", 3) };
        let output = accessor(values, kind, width, "");
        samplers.push(format!(r#"{{"input":{input},"output":{output},"interpolation":"LINEAR"}}"#));
        channels.push(format!(r#"{{"sampler":{sampler},"target":{{"node":{node},"path":"{path}"}}}}"#));
    }
    let mut animation = Members::parse("{}").map_err(shape)?;
    if !name.is_empty() {
        animation.set("name", string(name));
    }
    animation.set("channels", list(&channels));
    animation.set("samplers", list(&samplers));
    let before = animations.len();
    make_way(&mut animations, name).map_err(shape)?;
    let replaces = animations.len() < before;
    animations.insert(0, animation.text());
    out.members.set_list("accessors", &accessors);
    out.members.set_list("bufferViews", &views);
    out.members.set_list("animations", &animations);
    store(out, buffer, bytes)?;
    Ok(replaces)
}

/// Takes out the animation whose clip has the new one's name, and gives all others that have names names of their own.
fn make_way(animations: &mut Vec<String>, name: &str) -> serde_json::Result<()> {
    let names = names(&animations.iter().map(String::as_str).collect::<Vec<_>>());
    for (text, of_clip) in animations.iter_mut().zip(&names).filter(|(_, of_clip)| of_clip.in_file.is_some())
    {
        let mut members = Members::parse(text)?;
        members.set("name", string(&of_clip.name));
        let changed = members.text();
        *text = changed;
    }
    let mut names = names.iter();
    animations.retain(|_| names.next().is_none_or(|of_clip| name.is_empty() || of_clip.name != name));
    Ok(())
}

/// The buffer that new numbers go to, and where they begin in it.
fn place(out: &mut Output<'_>) -> Result<(usize, u64), Fault> {
    match out.bin {
        Some(bin) => {
            // What buffer 0 says of its length may leave out the chunk's padding, not what it refers to.
            let claimed = claimed_length(out)?;
            if claimed > bin.len() as u64 {
                let reason = format!("it claims {claimed} bytes, {} are there", bin.len());
                let kind = ErrorKind::Buffer { index: 0, reason };
                return Err(Fault::at("/buffers/0", kind));
            }
            while !(bin.len() + out.appended.len()).is_multiple_of(4) {
                out.appended.push(0);
            }
            Ok((0, (bin.len() + out.appended.len()) as u64))
        }
        None => Ok((out.buffers.len(), 0)),
    }
}

fn claimed_length(out: &Output<'_>) -> Result<u64, Fault> {
    let shape = |error: serde_json::Error| Fault::from(ErrorKind::Shape { message: error.to_string() });
    let Some(text) = out.buffers.first() else { return Ok(0) };
    let members = Members::parse(text).map_err(shape)?;
    members.get("byteLength").map_or(Ok(0), |text| serde_json::from_str(text).map_err(shape))
}

fn store(out: &mut Output<'_>, buffer: usize, mut bytes: Vec<u8>) -> Result<(), Fault> {
    let shape = |error: serde_json::Error| Fault::from(ErrorKind::Shape { message: error.to_string() });
    pad(&mut bytes, 0);
    if out.bin.is_none() && buffer > 0 {
        let uri = string(&uri::encode_data("application/octet-stream", &bytes));
        out.buffers.push(format!(r#"{{"byteLength":{},"uri":{uri}}}"#, bytes.len()));
        return Ok(());
    }
    out.appended.append(&mut bytes);
    let length = (out.bin.map_or(0, <[u8]>::len) + out.appended.len()).to_string();
    match out.buffers.first_mut() {
        Some(first) => {
            let mut members = Members::parse(first).map_err(shape)?;
            members.set("byteLength", length);
            let changed = members.text();
            *first = changed;
        }
        None => out.buffers.push(format!(r#"{{"byteLength":{length}}}"#)),
    }
    Ok(())
}
