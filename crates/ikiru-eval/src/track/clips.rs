//! Courses by recorded motions, on the human and on the reference human.

use std::path::Path;

use ikiru_formats::BvhOptions;
use ikiru_rig::humanoid::{Reference, transfer};
use ikiru_rig::{Clip, JointId, Pose, Rig, Role};

use crate::error::Error;
use crate::track::course::{Course, Source};

/// The recorded motions that ship, by their names.
pub const CLIPS: [(&str, &str); 4] = [
    ("cmu_01_01", include_str!("../../clips/cmu_01_01.bvh")),
    ("walk", include_str!("../../clips/deepmimic_walk.bvh")),
    ("run", include_str!("../../clips/deepmimic_run.bvh")),
    ("dance", include_str!("../../clips/deepmimic_dance_a.bvh")),
];

/// Where a body is led by pose targets: pelvis, chest, wrists and ankles.
const LED: [Role; 6] =
    [Role::Hips, Role::Chest, Role::LeftHand, Role::RightHand, Role::LeftFoot, Role::RightFoot];
/// How fast fingers curl and open again, radians a second, and how far, radians.
const CURL: (f64, f64) = (2.0, 0.25);

impl Course {
    /// The human after a recorded motion: six pose targets.
    ///
    /// # Errors
    /// A clip that does not fit the human.
    pub fn human(name: &str, clip: &Clip, rate_hz: f64, n_frames: usize) -> Result<Self, Error> {
        let clip = onto("builtin:human", clip)?;
        let targets = led(clip.rig(), &LED)?.into_iter().map(|joint| (joint, true)).collect();
        let pose = |secs: f64| to_and_fro(&clip, secs);
        Self::new(
            &Source {
                name: format!("human, {name}"),
                rate_hz,
                n_frames,
                targets,
                rest: clip.rig().rest_pose(),
            },
            clip.rig(),
            pose,
        )
    }

    /// The reference human after a recorded motion, fingers curling: all of its 55 joints and the two at its finger tips, led by pose targets at pelvis, chest, head,
    /// wrists and ankles, and by the places of the fingers' last joints.
    ///
    /// # Errors
    /// A clip that does not fit the reference human.
    pub fn reference(name: &str, clip: &Clip, rate_hz: f64, n_frames: usize) -> Result<Self, Error> {
        let clip = onto("builtin:reference", clip)?;
        let rig = clip.rig();
        let mut targets: Vec<(JointId, bool)> =
            led(rig, &LED)?.into_iter().chain(led(rig, &[Role::Head])?).map(|joint| (joint, true)).collect();
        let hands = led(rig, &[Role::LeftHand, Role::RightHand])?;
        let below = |joint: JointId| {
            joint != hands[0] && joint != hands[1] && rig.ancestors(joint).any(|j| hands.contains(&j))
        };
        let fingers: Vec<JointId> = rig.ids().filter(|joint| below(*joint)).collect();
        let is_last = |joint: &JointId| !rig.joints().iter().any(|other| other.parent == Some(*joint));
        targets.extend(fingers.iter().filter(|joint| is_last(joint)).map(|joint| (*joint, false)));
        let pose = |secs: f64| {
            let mut pose = to_and_fro(&clip, secs)?;
            let mut tangent = vec![0.0; rig.n_dofs()];
            for (number, finger) in fingers.iter().enumerate() {
                let curl = CURL.1 * (CURL.0 * secs + number as f64).sin();
                if let Some(dof) = rig.dofs_of(*finger).nth(number % 3) {
                    tangent[dof] = curl;
                }
            }
            pose.retract(&tangent).map_err(Error::course)?;
            pose.project();
            Ok(pose)
        };
        Self::new(
            &Source {
                name: format!("reference human, {name}"),
                rate_hz,
                n_frames,
                targets,
                rest: rig.rest_pose(),
            },
            rig,
            pose,
        )
    }

    /// The clip that ships under a name, else the first of a file.
    ///
    /// # Errors
    /// A file that cannot be read or has no clip; a name that nothing has.
    pub fn clip(name_or_path: &Path) -> Result<(String, Clip), Error> {
        let shipped = CLIPS.iter().find(|(name, _)| Path::new(name) == name_or_path);
        let loaded = match shipped {
            Some((name, text)) => ikiru_formats::read_bvh(text.as_bytes(), name, &BvhOptions::default())?,
            None if name_or_path.extension().is_none() && !name_or_path.exists() => {
                let known = CLIPS.map(|(name, _)| name).join(", ");
                return Err(Error::Unknown {
                    what: "clip",
                    name: name_or_path.display().to_string(),
                    known: format!("{known}, or the path of a file with a motion"),
                });
            }
            None => ikiru_formats::read(name_or_path)?,
        };
        let name = name_or_path.file_stem().unwrap_or_default().to_string_lossy().into_owned();
        let loaded = loaded.carrying_clips()?;
        let clip = loaded.clips.first().cloned();
        clip.map(|clip| (name, clip)).ok_or_else(|| Error::Course {
            reason: format!("{}: there is no motion in it", name_or_path.display()),
        })
    }
}

/// A motion on a built-in rig, inside its limits.
fn onto(rig: &str, clip: &Clip) -> Result<Clip, Error> {
    let target = ikiru_formats::read(rig)?;
    Ok(transfer(clip, &target.rig, Reference::TPose).map_err(Error::course)?.clip)
}

fn led(rig: &Rig, roles: &[Role]) -> Result<Vec<JointId>, Error> {
    let joint = |role: &Role| {
        rig.role(*role)
            .ok_or_else(|| Error::Course { reason: format!("no joint has the role {}", role.name()) })
    };
    roles.iter().map(joint).collect()
}

/// A clip that turns round at both of its ends, at a time since its beginning.
fn to_and_fro(clip: &Clip, secs: f64) -> Result<Pose, Error> {
    let length = clip.duration_secs();
    let along = if length > 0.0 { secs % (2.0 * length) } else { 0.0 };
    let mut pose =
        clip.sample_cubic(clip.times()[0] + if along > length { 2.0 * length - along } else { along });
    pose.project();
    Ok(pose)
}
