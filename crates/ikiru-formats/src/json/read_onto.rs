//! JSON → a motion of a rig whose joints are made such that they can move so.

use ikiru_rig::{EulerOrder, JointMotion, Range, Rig, RigError};
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

/// What the rig of a motion was read from.
#[derive(Clone, Debug, PartialEq, Deserialize)]
#[non_exhaustive]
pub struct MotionRig {
    /// A path, or the name of a built-in rig; in JSON `"rig"`.
    #[serde(rename = "rig")]
    pub name: String,
    /// The length in metres that a unit of its file was read as; in JSON `"rig_scale"`, left out where it is 1.
    #[serde(rename = "rig_scale", default = "one")]
    pub scale: f64,
}

fn one() -> f64 {
    1.0
}

/// What the rig of a motion was read from, as its JSON has it. `None` where it does not say, or is no JSON;
/// [`read_motion`] then says what is wrong.
#[must_use]
pub fn motion_rig(bytes: &[u8]) -> Option<MotionRig> {
    serde_json::from_slice(bytes).ok()
}

/// Says in a motion's JSON what its rig was read from, so that [`motion_rig`] finds it again; nothing for a rig from memory.
pub fn name_motion_rig(motion: &mut serde_json::Value, loaded: &Loaded) {
    let (Some(members), Some(name)) = (motion.as_object_mut(), loaded.name()) else { return };
    members.insert("rig".to_owned(), name.into());
    if loaded.scale() != 1.0 {
        members.insert("rig_scale".to_owned(), loaded.scale().into());
    }
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
            let motion = JointMotion::Euler { order: EulerOrder::default(), ranges };
            builder.set_motion(id, motion).map_err(|e| Fault::at("/angles", RigError::from(e).into()))?;
            changed = true;
        }
    }
    for (id, ..) in resolved(rig, "translations", &document.translations)? {
        if let Some(JointMotion::Ball { cone }) = rig.get(id).map(|joint| joint.motion) {
            let motion = JointMotion::Free { cone };
            builder
                .set_motion(id, motion)
                .map_err(|e| Fault::at("/translations", RigError::from(e).into()))?;
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
