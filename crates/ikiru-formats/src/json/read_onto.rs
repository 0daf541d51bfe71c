//! JSON → a motion of a rig whose joints are made such that they can move so.

use ikiru_rig::{EulerOrder, JointMotion, Range, Rig};
use serde::Deserialize;

use super::document::{Document, parse};
use super::read::{read_motion_json, resolved};
use crate::error::{Error, ErrorKind, Fault};
use crate::loaded::Loaded;

/// Reads a motion as [`motion_json`](crate::motion_json) and `ikiru plan` write it, for the file of a rig; what is given
/// back is that file with the motion as its only clip.
///
/// A scenario may let a rig's joints move otherwise than its file does, and the motion tells: where
/// `root_translation` is not 0, the root floats ([`free_root`](ikiru_rig::RigBuilder::free_root)); a joint with an entry
/// in `translations` is free; a ball with `euler_deg` turns by these angles, `Rz · Ry · Rx`, without ranges.
///
/// # Errors
/// As [`read_motion_json`]; where the root should float and cannot.
pub fn read_motion(bytes: &[u8], name: &str, loaded: Loaded) -> Result<Loaded, Error> {
    let document: Document = parse(bytes).map_err(|fault| fault.in_file(name))?;
    let rig = fitting(&document, &loaded.rig).map_err(|fault| fault.in_file(name))?;
    drop(document);
    let clip = read_motion_json(bytes, name, &rig)?;
    let mut loaded = loaded.without_clips().with_rig(rig)?;
    loaded.clips = vec![clip];
    Ok(loaded)
}

/// What the rig of a motion was read from, as its JSON has it under `"rig"`: a path, or the name of a built-in rig.
/// `None` where it does not say, or is no JSON; [`read_motion`] then says what is wrong.
#[must_use]
pub fn motion_rig(bytes: &[u8]) -> Option<String> {
    #[derive(Deserialize)]
    struct Text {
        rig: Option<String>,
    }
    serde_json::from_slice::<Text>(bytes).ok()?.rig
}

/// The rig with joints that can do what a motion says of them.
fn fitting(document: &Document, rig: &Rig) -> Result<Rig, Fault> {
    let mut builder = rig.to_builder();
    let mut changed = false;
    for (id, _, angles) in resolved(rig, "angles", &document.angles)? {
        if let (Some(JointMotion::Ball { cone: None }), Some(_)) =
            (rig.get(id).map(|j| j.motion), &angles.euler_deg)
        {
            let ranges = [Range::UNLIMITED; 3];
            builder.set_motion(id, JointMotion::Euler { order: EulerOrder::default(), ranges });
            changed = true;
        }
    }
    for (id, ..) in resolved(rig, "translations", &document.translations)? {
        if let Some(JointMotion::Ball { cone }) = rig.get(id).map(|joint| joint.motion) {
            builder.set_motion(id, JointMotion::Free { cone });
            changed = true;
        }
    }
    let floats = rig.floating_root().is_some();
    if !floats && document.root_translation.0.iter().any(|numbers| numbers.0 != [0.0; 3]) {
        builder.free_root().map_err(|error| Fault::at("/root_translation", error.into()))?;
        changed = true;
    }
    if changed { builder.build().map_err(|error| ErrorKind::from(error).into()) } else { Ok(rig.clone()) }
}
