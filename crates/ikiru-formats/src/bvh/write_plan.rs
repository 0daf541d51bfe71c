//! What is to be written of each joint: its offset, and the channels that can hold all it does.

use glam::{DQuat, DVec3};
use ikiru_rig::{EulerOrder, JointId, JointMotion, Pose, Rig};

use crate::bvh::angles::{TINY_DEG, nearest};
use crate::bvh::channel::{Channel, Channels, DEFAULT_ORDER};
use crate::bvh::tree::{Entry, Kind, Tree, is_turned};
use crate::bvh::{JointLayout, Layout, are_in_place};
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
    /// The joint that stands for all above it, and where its parent is in the world.
    top: Option<(JointId, DQuat, DVec3)>,
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
    /// x, y, z in radians.
    angles: [f64; 3],
}

impl Plan {
    /// For poses of a rig; `layout` is that of the file which the rig was read from.
    pub(super) fn new(
        rig: &Rig,
        layout: Option<&Layout>,
        tree: &Tree,
        poses: &[Pose],
    ) -> Result<Self, Fault> {
        let scale = layout.map_or(1.0, |l| l.scale);
        let top = match (layout, tree.entries.first()) {
            (None, Some(Entry { kind: Kind::Joint(top), .. })) => {
                Some((*top, tree.world_from_top.0, tree.world_from_top.1))
            }
            _ => None,
        };
        let mut joints: Vec<JointPlan> = match layout {
            Some(layout) => layout.joints.iter().map(JointPlan::of_file).collect(),
            None => {
                rig.ids().map(|id| JointPlan::of_rig(rig, id, top.is_some_and(|top| top.0 == id))).collect()
            }
        };
        for (idx, entry) in tree.entries.iter().enumerate() {
            let has_child = tree.entries.get(idx + 1).is_some_and(|next| next.depth > entry.depth);
            match entry.kind {
                Kind::EndSite(id) => {
                    joints[id.index()].channels = Channels::NONE;
                    joints[id.index()].is_end_site = true;
                }
                Kind::Joint(id) => joints[id.index()].is_end_site &= !has_child,
                Kind::Join | Kind::Tip(_) => {}
            }
        }
        let in_place = layout.is_some_and(|l| l.in_place);
        let mut plan = Self { joints, scale, in_place, extent: 0.0, top };
        let means = plan.fit(poses)?;
        plan.make_clear(&means);
        plan.extent = plan.joints.iter().flat_map(|j| j.offset).fold(0.0, |m, c| m.max(c.abs()));
        Ok(plan)
    }

    /// A joint's rest transform, in metres.
    fn rest(&self, rig: &Rig, id: JointId) -> (DQuat, DVec3) {
        let Some(joint) = rig.get(id) else { return (DQuat::IDENTITY, DVec3::ZERO) };
        let (rotation, translation) = (joint.rest_rotation, joint.rest_translation);
        match self.top {
            Some((top, above, origin)) if top == id => {
                let rotation = if is_turned(above) { (above * rotation).normalize() } else { rotation };
                (rotation, above * translation + origin)
            }
            _ => (rotation, translation),
        }
    }

    /// Where a joint ends that has nothing below it, in its own axes and the file's unit: its bone goes on as far as it
    /// came.
    pub(super) fn tip(&self, rig: &Rig, id: JointId) -> [f64; 3] {
        let is_top = self.top.is_some_and(|top| top.0 == id);
        match rig.get(id) {
            Some(joint) if !is_top => {
                (joint.rest_rotation.inverse() * joint.rest_translation / self.scale).to_array()
            }
            _ => [0.0; 3],
        }
    }

    /// Gives joints more channels where those that they have do not hold all poses. The mean position
    /// of each.
    fn fit(&mut self, poses: &[Pose]) -> Result<Vec<[f64; 3]>, Fault> {
        let mut means = vec![[0.0; 3]; self.joints.len()];
        for pose in poses {
            for (id, mean) in pose.rig().ids().zip(&mut means) {
                let rest = self.rest(pose.rig(), id);
                let Some(joint) = self.joints.get_mut(id.index()) else { continue };
                let local = joint.local(pose, id, rest, self.scale, None);
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

    /// The numbers of a joint in a frame, with whether each is a length. `before` are the joint's angles in the frame
    /// before, which these go on from.
    pub(super) fn numbers(
        &self,
        pose: &Pose,
        id: JointId,
        before: &mut Option<[f64; 3]>,
    ) -> impl Iterator<Item = (f64, bool)> + use<> {
        let joint = self.joints.get(id.index()).copied().unwrap_or(JointPlan::FIXED);
        let local = joint.local(pose, id, self.rest(pose.rig(), id), self.scale, *before);
        *before = Some(local.angles);
        let base = if self.in_place { [0.0; 3] } else { joint.offset };
        (0..joint.channels.len()).filter_map(move |idx| {
            let channel = joint.channels.as_slice().get(idx)?;
            let axis = channel.axis();
            Some(if channel.is_position {
                (local.position[axis] - base[axis], true)
            } else {
                (local.angles[axis].to_degrees(), false)
            })
        })
    }
}

impl JointPlan {
    pub(super) const FIXED: Self =
        Self { offset: [0.0; 3], channels: Channels::NONE, is_end_site: false, order: DEFAULT_ORDER };

    /// As it stands in the file that it was read from.
    fn of_file(of_file: &JointLayout) -> Self {
        let JointLayout { offset, channels, .. } = *of_file;
        let is_end_site = of_file.is_end_site && channels.len() == 0;
        Self { offset, channels, is_end_site, order: channels.order() }
    }

    /// Of a rig that was not read from BVH.
    fn of_rig(rig: &Rig, id: JointId, is_top: bool) -> Self {
        let Some(joint) = rig.get(id) else { return Self::FIXED };
        let order = match joint.motion {
            JointMotion::Euler { order, .. } => order,
            JointMotion::Fixed
            | JointMotion::Hinge { .. }
            | JointMotion::Slider { .. }
            | JointMotion::Ball { .. }
            | JointMotion::Free { .. } => DEFAULT_ORDER,
        };
        let translates = matches!(joint.motion, JointMotion::Free { .. } | JointMotion::Slider { .. });
        let all = |with_positions| Channels::complete(order, with_positions);
        let offset = joint.rest_translation.to_array();
        let plan = |offset, channels| Self { offset, channels, is_end_site: false, order };
        match hinge_axis(&joint.motion) {
            _ if is_top || joint.parent.is_none() || translates => plan([0.0; 3], all(true)),
            Some((axis, _)) if !is_turned(joint.rest_rotation) => {
                let channels = Channels::one(Channel::rotation(axis as u8));
                // Should a pose need all three after all, the hinge's own stays the first.
                Self { offset, channels, is_end_site: false, order: channels.order() }
            }
            _ => plan(offset, all(false)),
        }
    }

    /// A joint's rest times motion in a pose; of angles that are equal those nearest to the ones `before`.
    fn local(
        &self,
        pose: &Pose,
        id: JointId,
        rest: (DQuat, DVec3),
        scale: f64,
        before: Option<[f64; 3]>,
    ) -> Local {
        let Some(joint) = pose.rig().get(id) else { return Local { position: [0.0; 3], angles: [0.0; 3] } };
        let (rotation, translation) = rest;
        let position = translation + rotation * pose.translation(id).unwrap_or_default();
        let is_turned = is_turned(rotation);
        let value = pose.value(id).unwrap_or_default();
        let angles = if let JointMotion::Euler { order, .. } = joint.motion
            && !is_turned
            && order == self.order
        {
            // Their own angles, which may be more than a turn.
            pose.euler(id).unwrap_or_default()
        } else if let Some((axis, sign)) = hinge_axis(&joint.motion)
            && !is_turned
        {
            let mut angles = [0.0; 3];
            angles[axis] = sign * value;
            angles
        } else {
            let present = std::array::from_fn(|axis| self.channels.contains(Channel::rotation(axis as u8)));
            nearest(
                self.order,
                (rotation * pose.rotation(id).unwrap_or_default()).normalize(),
                present,
                before,
            )
        };
        Local { position: (position / scale).to_array(), angles }
    }

    /// Makes the channels complete if they cannot hold a transform.
    fn make_fit(&mut self, local: &Local) {
        let length = self.offset.iter().chain(&local.position).fold(0.0, |m: f64, c| m.max(c.abs()));
        let lacks_position = (0..3).any(|axis| {
            !self.channels.contains(Channel::position(axis as u8))
                && (local.position[axis] - self.offset[axis]).abs() > 1e-12 * length
        });
        let lacks_rotation = (0..3).any(|axis| {
            !self.channels.contains(Channel::rotation(axis as u8))
                && local.angles[axis].abs().to_degrees() > TINY_DEG
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
fn hinge_axis(motion: &JointMotion) -> Option<(usize, f64)> {
    let JointMotion::Hinge { axis, .. } = motion else { return None };
    (0..3).find_map(|k| {
        let sign = axis[k].signum();
        ((*axis - DVec3::AXES[k] * sign).length() < 1e-12).then_some((k, sign))
    })
}
