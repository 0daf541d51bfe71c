//! JSON → a motion: lists of a frame's entries, checked against the rig that is to move.

use glam::{DQuat, DVec3};
use ikiru_rig::{Clip, JointId, JointMotion, Pose, PoseError, Rig, rotation_vector};

use super::document::{Angles, Document, List, Named, Numbers, parse};
use super::key;
use crate::error::{Error, ErrorKind, Fault};
use crate::warning::short;

/// Reads a motion as [`motion_json`](crate::motion_json) and `ikiru plan` write it, for a rig; `name` stands
/// in messages and, without its ending, becomes the clip's.
///
/// Members besides `times`, `root_translation`, `joints`, `angles` and `translations` are left alone. Joints
/// answer to their names, other names and humanoid roles; those that the file does not name stay at rest.
/// Quaternions are brought to unit length. A hinge or Euler joint without an entry in `angles` takes its angles
/// from its rotations, each nearest to the one before. Followers follow: what the file says of them is not
/// used. Limits are not applied. [`read_motion`](crate::read_motion) makes joints such that they can move so.
///
/// # Errors
/// When the text is not JSON or lacks a member, a list does not have one entry a frame, times do not
/// increase, the rig does not have a joint, or a joint cannot move as its entries say. The error names the
/// member (a JSON pointer), what was found and what was expected.
pub fn read_motion_json(bytes: &[u8], name: &str, rig: &Rig) -> Result<Clip, Error> {
    read(bytes, name, rig).map_err(|fault| fault.in_file(name))
}

fn read(bytes: &[u8], name: &str, rig: &Rig) -> Result<Clip, Fault> {
    let document: Document = parse(bytes)?;
    check_times(&document.times.0)?;
    check_memory(document.times.0.len(), rig, bytes.len())?;
    let poses = poses(&document, &rig.rest_pose())?;
    let stem = std::path::Path::new(name).file_stem().map(|stem| stem.to_string_lossy().into_owned());
    let clip = Clip::new(stem.unwrap_or_default(), document.times.0, poses);
    // Times and counts are checked: what is left cannot happen.
    clip.map_err(|error| ErrorKind::MotionShape { message: error.to_string() }.into())
}

/// The poses of all frames, each on top of `base`.
pub(super) fn poses(document: &Document, base: &Pose) -> Result<Vec<Pose>, Fault> {
    let (rig, n_frames) = (base.rig(), document.times.0.len());
    let mut motion =
        Frames { rig, poses: vec![base.clone(); n_frames], has_angles: vec![false; rig.n_joints()] };
    motion.take_angles(&document.angles)?;
    motion.take_rotations(&document.joints)?;
    motion.take_root(&document.root_translation)?;
    motion.take_translations(&document.translations)?;
    Ok(motion.poses)
}

fn check_times(times: &[f64]) -> Result<(), Fault> {
    if times.is_empty() {
        let kind = ErrorKind::Unexpected { found: "no times".to_owned(), expected: "at least one" };
        return Err(Fault::at("/times", kind));
    }
    match times.windows(2).position(|pair| pair[1] <= pair[0]) {
        None => Ok(()),
        Some(idx) => {
            let found = format!("{} s after {} s", times[idx + 1], times[idx]);
            let kind = ErrorKind::Unexpected { found, expected: "times that increase" };
            Err(Fault::at(format!("/times/{}", idx + 1), kind))
        }
    }
}

/// A file may name few joints of a large rig, and each frame is a whole pose.
fn check_memory(frames: usize, rig: &Rig, file: usize) -> Result<(), Fault> {
    let bytes = (frames as u64).saturating_mul(8 * rig.n_coords() as u64 + 64);
    let most = (32 << 20) + 3 * file as u64;
    if bytes > most {
        return Err(ErrorKind::LongMotion { frames: frames as u64, bytes, most }.into());
    }
    Ok(())
}

/// The motion while it is put together.
struct Frames<'r> {
    rig: &'r Rig,
    poses: Vec<Pose>,
    has_angles: Vec<bool>,
}

/// Rotations nearer than this (radians) are the same.
const SAME_TURN: f64 = 1e-4;

impl Frames<'_> {
    fn check_count<T>(&self, at: &str, list: &List<T>) -> Result<(), Fault> {
        let (found, expected) = (list.0.len(), self.poses.len());
        if found == expected { Ok(()) } else { Err(Fault::at(at, ErrorKind::FrameCount { found, expected })) }
    }

    fn take_angles(&mut self, angles: &Named<Angles>) -> Result<(), Fault> {
        for (id, at, angles) in resolved(self.rig, "angles", angles)? {
            let joint = &self.rig.joints()[id.index()];
            self.has_angles[id.index()] = true;
            let Angles { euler_deg, angle_deg, offset } = angles;
            match (&joint.motion, euler_deg, angle_deg, offset) {
                (JointMotion::Euler { .. }, Some(list), None, None) => {
                    let at = format!("{at}/{}", key::EULER);
                    self.check_count(&at, list)?;
                    for (pose, Numbers(degrees)) in self.poses.iter_mut().zip(&list.0) {
                        pose.set_euler(id, degrees.map(f64::to_radians)).map_err(|e| unset(&at, &e))?;
                    }
                }
                (JointMotion::Hinge { .. }, None, Some(list), None) => {
                    self.take_values(id, &format!("{at}/{}", key::ANGLE), list, f64::to_radians)?;
                }
                (JointMotion::Slider { .. }, None, None, Some(list)) => {
                    self.take_values(id, &format!("{at}/{}", key::OFFSET), list, |offset| offset)?;
                }
                (motion, ..) => return Err(Fault::at(at, other_keys(motion, angles))),
            }
        }
        Ok(())
    }

    fn take_values(
        &mut self,
        id: JointId,
        at: &str,
        list: &List<f64>,
        si: fn(f64) -> f64,
    ) -> Result<(), Fault> {
        self.check_count(at, list)?;
        if self.rig.get(id).is_some_and(|joint| joint.mimic.is_some()) {
            return Ok(());
        }
        for (pose, value) in self.poses.iter_mut().zip(&list.0) {
            pose.set_value(id, si(*value)).map_err(|e| unset(at, &e))?;
        }
        Ok(())
    }

    fn take_rotations(&mut self, joints: &Named<List<Numbers<4>>>) -> Result<(), Fault> {
        for (id, at, list) in resolved(self.rig, "joints", joints)? {
            self.check_count(&at, list)?;
            for (frame, Numbers(numbers)) in list.0.iter().enumerate() {
                let Some(rotation) = unit(*numbers) else {
                    let (what, expected) = ("the rotation", "a quaternion (x, y, z, w)");
                    let kind = ErrorKind::Zero { what, found: numbers.to_vec(), expected };
                    return Err(Fault::at(format!("{at}/{frame}"), kind));
                };
                self.turn(id, frame, rotation).map_err(|expected| {
                    let found = numbers.to_vec();
                    Fault::at(format!("{at}/{frame}"), cannot_move(self.rig, id, found, expected))
                })?;
            }
        }
        Ok(())
    }

    /// Turns a joint in one frame, or says what it could do.
    fn turn(&mut self, id: JointId, frame: usize, rotation: DQuat) -> Result<(), &'static str> {
        let joint = &self.rig.joints()[id.index()];
        if joint.mimic.is_some() {
            return Ok(());
        }
        let (before, rest) = self.poses.split_at_mut(frame);
        let (Some(pose), before) = (rest.first_mut(), before.last()) else { return Ok(()) };
        let differs = |a: DQuat, b: DQuat| rotation_vector(a.inverse() * b).length() > SAME_TURN;
        if self.has_angles[id.index()] {
            let is_same = pose.rotation(id).is_ok_and(|own| !differs(own, rotation));
            return if is_same { Ok(()) } else { Err("the rotation that its \"angles\" give") };
        }
        // What is set is finite, and the joint has it.
        let set = match joint.motion {
            JointMotion::Ball { .. } | JointMotion::Free { .. } => pose.set_rotation(id, rotation),
            JointMotion::Euler { order, ranges } => {
                let middle = ranges.map(|range| range.middle());
                let near = before.and_then(|before| before.euler(id)).unwrap_or(middle);
                pose.set_euler(id, order.angles_near(rotation, near))
            }
            JointMotion::Hinge { axis, range } => {
                let angle = 2.0 * rotation.xyz().dot(axis).atan2(rotation.w);
                if differs(DQuat::from_axis_angle(axis, angle), rotation) {
                    return Err("a rotation about its axis");
                }
                // Whole turns do not show in a rotation.
                let near = before.and_then(|before| before.value(id)).unwrap_or(range.middle());
                let turns = ((angle - near) / std::f64::consts::TAU).round();
                pose.set_value(id, angle - turns * std::f64::consts::TAU)
            }
            JointMotion::Fixed | JointMotion::Slider { .. } => {
                let turns = differs(DQuat::IDENTITY, rotation);
                return if turns { Err("no rotation: [0, 0, 0, 1]") } else { Ok(()) };
            }
        };
        set.map_err(|_| "a rotation")
    }

    fn take_root(&mut self, list: &List<Numbers<3>>) -> Result<(), Fault> {
        let at = "/root_translation";
        self.check_count(at, list)?;
        if self.rig.floating_root().is_some() {
            for (pose, numbers) in self.poses.iter_mut().zip(&list.0) {
                pose.set_root_translation(numbers.0.into()).map_err(|e| unset(at, &e))?;
            }
            return Ok(());
        }
        match self.rig.root().or(self.rig.ids().next()) {
            Some(root) => {
                let moves = |numbers: &Numbers<3>| DVec3::from(numbers.0).length() > 1e-9;
                let Some(frame) = list.0.iter().position(moves) else { return Ok(()) };
                let kind =
                    cannot_move(self.rig, root, list.0[frame].0.to_vec(), "zeros: it cannot translate");
                Err(Fault::at(format!("{at}/{frame}"), kind))
            }
            None => Ok(()),
        }
    }

    fn take_translations(&mut self, named: &Named<List<Numbers<3>>>) -> Result<(), Fault> {
        let root = self.rig.floating_root();
        for (id, at, list) in resolved(self.rig, "translations", named)? {
            self.check_count(&at, list)?;
            let is_free = matches!(self.rig.joints()[id.index()].motion, JointMotion::Free { .. });
            if !is_free || Some(id) == root {
                let expected = if is_free { "\"root_translation\" for it" } else { "a free joint" };
                let found = list.0.first().map_or_else(Vec::new, |first| first.0.to_vec());
                return Err(Fault::at(at, cannot_move(self.rig, id, found, expected)));
            }
            self.translate(id, &at, list)?;
        }
        Ok(())
    }

    fn translate(&mut self, id: JointId, at: &str, list: &List<Numbers<3>>) -> Result<(), Fault> {
        for (pose, numbers) in self.poses.iter_mut().zip(&list.0) {
            pose.set_translation(id, numbers.0.into()).map_err(|e| unset(at, &e))?;
        }
        Ok(())
    }
}

/// The joints of a member, each once, with their pointers.
pub(super) fn resolved<'d, T>(
    rig: &Rig,
    member: &'static str,
    named: &'d Named<T>,
) -> Result<Vec<(JointId, String, &'d T)>, Fault> {
    let mut is_seen = vec![false; rig.n_joints()];
    let one = |(name, entries): &'d (String, T)| {
        let at = format!("/{member}/{}", short(name).replace('~', "~0").replace('/', "~1"));
        let id = rig.joint(name).map_err(|error| Fault::at(&*at, error.into()))?;
        if std::mem::replace(&mut is_seen[id.index()], true) {
            let joint = rig.joints()[id.index()].name.clone();
            return Err(Fault::at(at, ErrorKind::Repeated { joint, what: "a list" }));
        }
        Ok((id, at, entries))
    };
    named.0.iter().map(one).collect()
}

fn unit(numbers: [f64; 4]) -> Option<DQuat> {
    // Scaled first, so that neither huge nor tiny numbers overflow on the way.
    let largest = numbers.into_iter().fold(0.0, |most: f64, number| most.max(number.abs()));
    (largest > 0.0).then(|| DQuat::from_array(numbers.map(|number| number / largest)).normalize())
}

fn cannot_move(rig: &Rig, id: JointId, found: Vec<f64>, expected: &'static str) -> ErrorKind {
    let joint = &rig.joints()[id.index()];
    ErrorKind::CannotMove { joint: joint.name.clone(), motion: joint.motion.name(), found, expected }
}

/// A number that a pose refuses, which finite ones are not.
fn unset(at: &str, error: &PoseError) -> Fault {
    Fault::at(at, ErrorKind::MotionShape { message: error.to_string() })
}

fn other_keys(motion: &JointMotion, angles: &Angles) -> ErrorKind {
    let keys = [
        (key::EULER, angles.euler_deg.is_some()),
        (key::ANGLE, angles.angle_deg.is_some()),
        (key::OFFSET, angles.offset.is_some()),
    ];
    let found: Vec<String> =
        keys.into_iter().filter(|(_, is_there)| *is_there).map(|(key, _)| format!("\"{key}\"")).collect();
    let found = if found.is_empty() { "no key".to_owned() } else { found.join(" and ") };
    let expected = match motion {
        JointMotion::Euler { .. } => "\"euler_deg\" alone, as the joint is Euler",
        JointMotion::Hinge { .. } => "\"angle_deg\" alone, as the joint is a hinge",
        JointMotion::Slider { .. } => "\"offset\" alone, as the joint is a slider",
        JointMotion::Fixed => "nothing, as the joint is fixed",
        JointMotion::Ball { .. } | JointMotion::Free { .. } => {
            "rotations alone, as the joint is a ball or free"
        }
    };
    ErrorKind::Unexpected { found, expected }
}
