//! What is to be written of each joint: its offset, and the channels that can hold all it does.

use glam::{DQuat, DVec3};
use ikiru_rig::{EulerOrder, JointId, Motion, Pose, Rig};

use crate::bvh::channel::{Channel, Channels, DEFAULT_ORDER};
use crate::bvh::{Layout, are_in_place};
use crate::error::{ErrorKind, Fault};

/// How all joints are written.
#[derive(Debug)]
pub(super) struct Plan {
    pub(super) joints: Vec<JointPlan>,
    /// Metres per unit of the file.
    scale: f64,
    in_place: bool,
    /// The largest component of an offset, in the file's unit.
    pub(super) extent: f64,
}

/// How one joint is written.
#[derive(Clone, Copy, Debug)]
pub(super) struct JointPlan {
    /// In the file's unit.
    pub(super) offset: [f64; 3],
    pub(super) channels: Channels,
    pub(super) is_end_site: bool,
    order: EulerOrder,
}

/// `parent_from_joint` as a file has it.
struct Local {
    /// In the file's unit.
    position: [f64; 3],
    /// x, y, z in degrees.
    angles: [f64; 3],
}

/// Degrees that are no rotation.
const TINY_ANGLE: f64 = 1e-9;

impl Plan {
    /// For poses of a rig; `layout` is that of the file which the rig was read from.
    pub(super) fn new(rig: &Rig, layout: Option<&Layout>, poses: &[Pose]) -> Result<Self, Fault> {
        let scale = layout.map_or(1.0, |l| l.scale);
        let mut has_child = vec![false; rig.n_joints()];
        for parent in rig.joints().iter().filter_map(|j| j.parent) {
            has_child[parent.index()] = true;
        }
        let joints = rig.ids().zip(&has_child).map(|(id, has_child)| {
            match layout.and_then(|l| l.joints.get(id.index())) {
                Some(of_file) => JointPlan {
                    offset: of_file.offset,
                    channels: of_file.channels,
                    is_end_site: of_file.is_end_site && !has_child && of_file.channels.len() == 0,
                    order: of_file.channels.order(),
                },
                None => JointPlan::of_rig(rig, id, *has_child),
            }
        });
        let in_place = layout.is_some_and(|l| l.in_place);
        let mut plan = Self { joints: joints.collect(), scale, in_place, extent: 0.0 };
        let means = plan.fit(poses)?;
        plan.make_clear(&means);
        plan.extent = plan.joints.iter().flat_map(|j| j.offset).fold(0.0, |m, c| m.max(c.abs()));
        Ok(plan)
    }

    /// Gives joints more channels where those that they have do not hold all poses. The mean position
    /// of each.
    fn fit(&mut self, poses: &[Pose]) -> Result<Vec<[f64; 3]>, Fault> {
        let mut means = vec![[0.0; 3]; self.joints.len()];
        for pose in poses {
            for (id, (joint, mean)) in pose.rig().ids().zip(self.joints.iter_mut().zip(&mut means)) {
                let local = joint.local(pose, id, self.scale);
                let extent = local.position.iter().fold(0.0, |m: f64, c| m.max(c.abs()));
                if extent > 1e100 {
                    let found = local.position.to_vec();
                    return Err(ErrorKind::Magnitude { what: "the position", found }.into());
                }
                joint.make_fit(&local);
                for axis in 0..3 {
                    mean[axis] += local.position[axis] / poses.len() as f64;
                }
            }
        }
        Ok(means)
    }

    /// Where a reader would take positions for what they are not: offsets of 0, so that it does not matter.
    fn make_clear(&mut self, means: &[[f64; 3]]) {
        let in_place = self.in_place;
        let joints = self.joints.iter().zip(means).filter(|(j, _)| j.channels.has_positions());
        let seen = are_in_place(joints.map(|(joint, mean)| {
            let base = if in_place { [0.0; 3] } else { joint.offset };
            (joint.offset, joint.channels, std::array::from_fn(|axis| mean[axis] - base[axis]))
        }));
        if seen == in_place {
            return;
        }
        for joint in self.joints.iter_mut().filter(|j| j.channels.has_positions()) {
            joint.offset = [0.0; 3];
            joint.channels = joint.channels.with_all_positions();
        }
    }

    /// The numbers of a joint in a frame, with whether each is a length.
    pub(super) fn numbers(&self, pose: &Pose, id: JointId) -> impl Iterator<Item = (f64, bool)> + use<> {
        let joint = self.joints.get(id.index()).copied().unwrap_or(JointPlan::FIXED);
        let local = joint.local(pose, id, self.scale);
        let base = if self.in_place { [0.0; 3] } else { joint.offset };
        (0..joint.channels.len()).filter_map(move |idx| {
            let channel = joint.channels.as_slice().get(idx)?;
            let axis = channel.axis();
            Some(if channel.is_position {
                (local.position[axis] - base[axis], true)
            } else {
                (local.angles[axis], false)
            })
        })
    }
}

impl JointPlan {
    const FIXED: Self =
        Self { offset: [0.0; 3], channels: Channels::NONE, is_end_site: false, order: DEFAULT_ORDER };

    /// Of a rig that was not read from BVH.
    fn of_rig(rig: &Rig, id: JointId, has_child: bool) -> Self {
        let Some(joint) = rig.get(id) else { return Self::FIXED };
        let order = match joint.motion {
            Motion::Euler { order, .. } => order,
            _ => DEFAULT_ORDER,
        };
        let translates = matches!(joint.motion, Motion::Free { .. } | Motion::Slider { .. });
        let all = |with_positions| Channels::complete(order, with_positions);
        let offset = joint.rest_translation.to_array();
        let is_turned = joint.rest_rotation.xyz().length() > 1e-12;
        let plan = |offset, channels| Self { offset, channels, is_end_site: false, order };
        match (joint.motion, hinge_axis(&joint.motion)) {
            _ if joint.parent.is_none() || translates => plan([0.0; 3], all(true)),
            (Motion::Fixed, _) if !has_child && !is_turned => {
                Self { offset, channels: Channels::NONE, is_end_site: true, order }
            }
            (_, Some((axis, _))) if !is_turned => {
                let channels = Channels::one(Channel::rotation(axis as u8));
                // Should a pose need all three after all, the hinge's own stays the first.
                Self { offset, channels, is_end_site: false, order: channels.order() }
            }
            _ => plan(offset, all(false)),
        }
    }

    /// A joint's rest times motion in a pose.
    fn local(&self, pose: &Pose, id: JointId, scale: f64) -> Local {
        let Some(joint) = pose.rig().get(id) else { return Local { position: [0.0; 3], angles: [0.0; 3] } };
        let position = joint.rest_translation + joint.rest_rotation * pose.translation(id);
        let is_turned = joint.rest_rotation.xyz().length() > 1e-12;
        let value = pose.value(id).unwrap_or_default();
        let angles = match (joint.motion, hinge_axis(&joint.motion)) {
            // Their own angles, which may be more than a turn.
            (Motion::Euler { order, .. }, _) if !is_turned && order == self.order => {
                pose.euler(id).unwrap_or_default()
            }
            (_, Some((axis, sign))) if !is_turned => {
                let mut angles = [0.0; 3];
                angles[axis] = sign * value;
                angles
            }
            _ => self.canonical((joint.rest_rotation * pose.rotation(id)).normalize()),
        };
        Local { position: (position / scale).to_array(), angles: angles.map(f64::to_degrees) }
    }

    /// The angles of a rotation; those without a third angle, if it has only two channels and such exist.
    fn canonical(&self, q: DQuat) -> [f64; 3] {
        let angles = canonical_angles(self.order, q);
        let [first, middle, last] = self.order.axes();
        if self.channels.n_rotations() != 2 || angles[last].abs().to_degrees() <= TINY_ANGLE {
            return angles;
        }
        let mut other = angles;
        for axis in [first, last] {
            other[axis] -= std::f64::consts::PI.copysign(angles[axis]);
        }
        other[middle] = std::f64::consts::PI.copysign(angles[middle]) - angles[middle];
        if other[last].abs().to_degrees() <= TINY_ANGLE { other } else { angles }
    }

    /// Makes the channels complete if they cannot hold a transform.
    fn make_fit(&mut self, local: &Local) {
        let length = self.offset.iter().chain(&local.position).fold(0.0, |m: f64, c| m.max(c.abs()));
        let lacks_position = (0..3).any(|axis| {
            !self.channels.contains(Channel::position(axis as u8))
                && (local.position[axis] - self.offset[axis]).abs() > 1e-12 * length
        });
        let lacks_rotation = (0..3).any(|axis| {
            !self.channels.contains(Channel::rotation(axis as u8)) && local.angles[axis].abs() > TINY_ANGLE
        });
        if lacks_rotation {
            self.channels = self.channels.with_all_rotations(self.order);
        }
        if lacks_position {
            self.channels = self.channels.with_all_positions();
        }
        self.is_end_site &= self.channels.len() == 0;
    }
}

/// The coordinate axis that a hinge turns about, and in which sense.
fn hinge_axis(motion: &Motion) -> Option<(usize, f64)> {
    let Motion::Hinge { axis, .. } = motion else { return None };
    (0..3).find_map(|k| {
        let sign = axis[k].signum();
        ((*axis - DVec3::AXES[k] * sign).length() < 1e-12).then_some((k, sign))
    })
}

/// The middle angle within ±π/2, the others within ±π. The last is computed from what the others leave, so
/// that the product is exact also near gimbal lock.
fn canonical_angles(order: EulerOrder, q: DQuat) -> [f64; 3] {
    let mut angles = order.angles(q);
    let [_, _, last] = order.axes();
    angles[last] = 0.0;
    let left = order.quaternion(angles).inverse() * q;
    let along = left.to_array()[last];
    angles[last] = 2.0 * if left.w < 0.0 { (-along).atan2(-left.w) } else { along.atan2(left.w) };
    angles
}
