//! Forward kinematics: `world_from_joint = world_from_parent · rest · motion(q)` (the paper's equation 1).
//!
//! [`Pose::frame`] and [`Pose::frames`] are for users. The functions are the kernels below them, for whoever computes with
//! [`Frame`]s of any scalar: they take ids of the rig's own joints and panic on others, as a slice does on an index.

use glam::DVec3;

use crate::foreign::ForeignJoint;
use crate::frame::{Frame, Rotation, Vec3};
use crate::joint::{JointId, JointMotion};
use crate::joint_frame::JointFrame;
use crate::pose::Pose;
use crate::rig::{ROOT, Rig};
use crate::scalar::Scalar;

/// Moves a frame by a joint's motion: `frame := frame · motion(coords)`.
///
/// `coords` holds the joint's coordinates ([`JointMotion::n_coords`]). With `DIRECTIONS`, `directions` takes, for
/// each degree of freedom, the world axis that the joint turns about (through the resulting origin) or
/// moves along ([`JointMotion::n_dofs`]); without, it is left alone and may be empty.
#[inline(always)]
pub fn apply_motion<S: Scalar, const DIRECTIONS: bool>(
    motion: &JointMotion,
    coords: &[S],
    frame: &mut Frame<S>,
    directions: &mut [Vec3<S>],
) {
    match motion {
        JointMotion::Fixed => {}
        JointMotion::Hinge { axis, .. } => {
            if DIRECTIONS {
                directions[0] = frame.rotation.apply_constant(*axis);
            }
            frame.rotation = frame.rotation.compose(&Rotation::about(*axis, coords[0]));
        }
        JointMotion::Slider { axis, .. } => {
            let direction = frame.rotation.apply_constant(*axis);
            if DIRECTIONS {
                directions[0] = direction;
            }
            frame.origin += direction * coords[0];
        }
        JointMotion::Euler { order, .. } => {
            let (sin, cos) = S::sin_cos3([coords[0], coords[1], coords[2]]);
            let rotation = &mut frame.rotation;
            for axis in order.axes() {
                let direction = match axis {
                    0 => {
                        rotation.turn_x((sin[0], cos[0]));
                        rotation.x
                    }
                    1 => {
                        rotation.turn_y((sin[1], cos[1]));
                        rotation.y
                    }
                    _ => {
                        rotation.turn_z((sin[2], cos[2]));
                        rotation.z
                    }
                };
                if DIRECTIONS {
                    directions[axis] = direction;
                }
            }
        }
        JointMotion::Ball { .. } => turn_ball::<S, DIRECTIONS>(coords, frame, directions),
        JointMotion::Free { .. } => {
            let r = frame.rotation;
            if DIRECTIONS {
                directions[..3].copy_from_slice(&[r.x, r.y, r.z]);
            }
            frame.origin += r.apply(Vec3::new(coords[0], coords[1], coords[2]));
            turn_ball::<S, DIRECTIONS>(
                &coords[3..],
                frame,
                if DIRECTIONS { &mut directions[3..] } else { &mut [] },
            );
        }
    }
}

#[inline(always)]
fn turn_ball<S: Scalar, const DIRECTIONS: bool>(
    coords: &[S],
    frame: &mut Frame<S>,
    directions: &mut [Vec3<S>],
) {
    let turn = Rotation::from_quaternion(coords[0], coords[1], coords[2], coords[3]);
    frame.rotation = frame.rotation.compose(&turn);
    if DIRECTIONS {
        // The tangent of a ball is the space of ω in q · exp(ω): its axes are those of the turned frame.
        directions[..3].copy_from_slice(&[frame.rotation.x, frame.rotation.y, frame.rotation.z]);
    }
}

/// A rest transform behind a frame: `frame := frame · rest`.
#[inline(always)]
fn apply_rest<S: Scalar>(
    frame: &Frame<S>,
    translation: DVec3,
    rotation: &Rotation<f64>,
    is_translation: bool,
) -> Frame<S> {
    let origin = frame.origin + frame.rotation.apply_constant(translation);
    if is_translation {
        return Frame { rotation: frame.rotation, origin };
    }
    let constant = |v: Vec3<f64>| frame.rotation.apply_constant(v.value());
    Frame {
        rotation: Rotation { x: constant(rotation.x), y: constant(rotation.y), z: constant(rotation.z) },
        origin,
    }
}

/// A joint's frame before its motion: `parent · rest` (the rest alone for a root).
#[must_use]
#[inline(always)]
pub fn rest_frame<S: Scalar>(rig: &Rig, joint: JointId, world_from_parent: &Frame<S>) -> Frame<S> {
    let (data, kernel) = (&rig.joints()[joint.index()], &rig.kernels()[joint.index()]);
    apply_rest(world_from_parent, data.rest_translation, &kernel.rest_rotation, kernel.rest_is_translation)
}

/// World frames of all joints for the coordinates of a pose: `frames[i]` is `world_from_joint` of joint `i`.
///
/// Generic, so that derivatives come from the same source. `coords` has [`Rig::n_coords`] entries (quaternions of unit
/// length), `frames` [`Rig::n_joints`]; of shorter slices only the joints that both allow are computed.
pub fn forward<S: Scalar>(rig: &Rig, coords: &[S], frames: &mut [Frame<S>]) {
    if coords.len() < rig.n_coords() {
        return;
    }
    for idx in 0..frames.len().min(rig.n_joints()) {
        frames[idx] = joint_frame(rig, idx, coords, frames);
    }
}

/// World frames of some joints: `order` lists them with all their ancestors, parents first (see
/// [`with_ancestors`]). Other entries of `frames` are left alone.
pub fn forward_some<S: Scalar>(rig: &Rig, order: &[JointId], coords: &[S], frames: &mut [Frame<S>]) {
    if coords.len() < rig.n_coords() || frames.len() < rig.n_joints() {
        return;
    }
    for joint in order.iter().filter(|j| j.index() < rig.n_joints()) {
        frames[joint.index()] = joint_frame(rig, joint.index(), coords, frames);
    }
}

#[inline(always)]
fn joint_frame<S: Scalar>(rig: &Rig, idx: usize, coords: &[S], frames: &[Frame<S>]) -> Frame<S> {
    let (joint, kernel) = (&rig.joints()[idx], &rig.kernels()[idx]);
    let mut frame = if kernel.parent == ROOT {
        apply_rest(
            &Frame::identity(),
            joint.rest_translation,
            &kernel.rest_rotation,
            kernel.rest_is_translation,
        )
    } else {
        let parent = &frames[kernel.parent as usize];
        apply_rest(parent, joint.rest_translation, &kernel.rest_rotation, kernel.rest_is_translation)
    };
    let coord = kernel.coord as usize;
    if let Some((multiplier, offset)) = kernel.mimic {
        let value = coords[coord] * multiplier + offset;
        apply_motion::<S, false>(&joint.motion, &[value], &mut frame, &mut []);
    } else {
        apply_motion::<S, false>(&joint.motion, &coords[coord..], &mut frame, &mut []);
    }
    frame
}

/// The given joints and all their ancestors, each once, parents first.
#[must_use]
pub fn with_ancestors(rig: &Rig, joints: &[JointId]) -> Vec<JointId> {
    let mut needed = vec![false; rig.n_joints()];
    for joint in joints {
        for ancestor in rig.ancestors(*joint) {
            // Everything above a joint that is marked is marked as well.
            if std::mem::replace(&mut needed[ancestor.index()], true) {
                break;
            }
        }
    }
    rig.ids().filter(|j| needed[j.index()]).collect()
}

/// `frame := frame · motion` of one joint in a pose, followers included.
pub fn apply_motion_in(pose: &Pose, joint: JointId, frame: &mut Frame<f64>) {
    let (data, kernel) = (&pose.rig().joints()[joint.index()], &pose.rig().kernels()[joint.index()]);
    let coords = &pose.coords()[kernel.coord as usize..];
    match kernel.mimic {
        Some((multiplier, offset)) => {
            apply_motion::<f64, false>(&data.motion, &[coords[0] * multiplier + offset], frame, &mut []);
        }
        None => apply_motion::<f64, false>(&data.motion, coords, frame, &mut []),
    }
}

impl Rig {
    /// The largest distance of a joint from the first root at rest, in metres: a length to measure
    /// tolerances by. At least 1e-3.
    #[must_use]
    pub fn size(&self) -> f64 {
        let frames = self.rest_pose().kernel_frames();
        let origin = frames.first().map_or(DVec3::ZERO, |f| f.origin.value());
        frames.iter().map(|f| f.origin.value().distance(origin)).fold(1e-3, f64::max)
    }
}

impl Pose {
    /// Where every joint is in the world, by the order of [`Rig::joints`].
    ///
    /// In a loop that must not allocate, [`forward`] computes the same into memory of the caller's.
    #[must_use]
    pub fn frames(&self) -> Vec<JointFrame> {
        self.kernel_frames().into_iter().map(JointFrame::from).collect()
    }

    /// Where a joint is in the world, `world_from_joint`. Only its ancestors are computed.
    ///
    /// # Errors
    /// For the id of another, larger rig.
    pub fn frame(&self, joint: JointId) -> Result<JointFrame, ForeignJoint> {
        self.rig().own(joint)?;
        Ok(self.kernel_frame(joint).into())
    }

    /// All frames, as the kernels have them.
    pub(crate) fn kernel_frames(&self) -> Vec<Frame<f64>> {
        let mut frames = vec![Frame::identity(); self.rig().n_joints()];
        forward(self.rig(), self.coords(), &mut frames);
        frames
    }

    /// The frame of a joint of the rig's own.
    pub(crate) fn kernel_frame(&self, joint: JointId) -> Frame<f64> {
        // A path is short: collected here so that it can be walked from the root.
        let path: Vec<JointId> = self.rig().ancestors(joint).collect();
        let mut frame = Frame::identity();
        for joint in path.into_iter().rev() {
            frame = rest_frame(self.rig(), joint, &frame);
            apply_motion_in(self, joint, &mut frame);
        }
        frame
    }
}
