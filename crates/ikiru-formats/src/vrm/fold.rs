//! What joints without a role do between two that have one, folded into these: a VRM animation has no others.

use glam::{DQuat, DVec3};
use ikiru_rig::humanoid::t_pose;
use ikiru_rig::{Clip, ClipError, JointId, Pose, Rig, Role};

use crate::warning::Warning;

/// Directions nearer to each other (radians) are one.
const SAME_DIRECTION: f64 = 1e-7;

/// What a joint may be off (metres) before it is worth a word.
const OFF_METRES: f64 = 1e-3;

/// The clip of the normalised skeleton, corrected by the one that it was made of: a bone points where the joints
/// between its ends bring its far one, and that one keeps its rotation in the world.
///
/// What a single bone cannot do stays: its length changing, or one of several bones of a joint moving by itself. Where a
/// joint is more than a millimetre off for that, the warning says which is farthest.
pub(super) fn fold(clip: &Clip, from: &Clip) -> Result<(Clip, Option<Warning>), ClipError> {
    let Some(skeleton) = Skeleton::new(clip.rig(), from.rig()) else { return Ok((clip.clone(), None)) };
    let mut farthest: Option<(f64, JointId)> = None;
    let mut poses = Vec::with_capacity(clip.poses().len());
    for (pose, from) in clip.poses().iter().zip(from.poses()) {
        let wanted = skeleton.wanted(from);
        let pose = skeleton.point(pose, &wanted);
        for (id, (frame, wanted)) in clip.rig().ids().zip(pose.frames().iter().zip(&wanted)) {
            let off = frame.position.distance(*wanted);
            if off > farthest.map_or(OFF_METRES, |(most, _)| most) {
                farthest = Some((off, id));
            }
        }
        poses.push(pose);
    }
    let name = |id: JointId| clip.rig().get(id).map_or_else(String::new, |joint| joint.name.clone());
    let warning = farthest.map(|(metres, id)| Warning::BoneOff { bone: name(id), metres });
    Ok((Clip::new(clip.name(), clip.times().to_vec(), poses)?, warning))
}

struct Skeleton<'r> {
    rig: &'r Rig,
    /// For each joint: the one of its role in the other rig.
    sources: Vec<JointId>,
    /// From the heading of the other rig to that of the skeleton.
    turn: DQuat,
    /// The joint at the far end of each joint's bone, where it has one bone.
    far_end: Vec<Option<JointId>>,
}

impl<'r> Skeleton<'r> {
    fn new(rig: &'r Rig, from: &Rig) -> Option<Self> {
        let source = |name: &str| Role::from_name(name).and_then(|role| from.role(role));
        let sources = rig.joints().iter().map(|joint| source(&joint.name)).collect::<Option<Vec<_>>>()?;
        let mut far_end = vec![None; rig.n_joints()];
        for (id, joint) in rig.ids().zip(rig.joints()) {
            let Some(parent) = joint.parent else { continue };
            let is_first = !rig.joints()[..id.index()].iter().any(|other| other.parent == Some(parent));
            far_end[parent.index()] = is_first.then_some(id);
        }
        // Characters face along an axis; the skeleton was made of the same T-pose.
        let (rest, stance) = (rig.rest_pose().frames(), t_pose(from).frames());
        let off = |turn: &DQuat| -> f64 {
            let pairs = rest.iter().zip(&sources);
            pairs.map(|(at, of)| (*turn * stance[of.index()].position).distance(at.position)).sum()
        };
        let quarters = [0.0, 1.0, 2.0, 3.0].map(|n| DQuat::from_rotation_y(n * std::f64::consts::FRAC_PI_2));
        let turn = quarters.into_iter().min_by(|a, b| off(a).total_cmp(&off(b)))?;
        Some(Self { rig, sources, turn, far_end })
    }

    /// Where the joints should be in the world.
    fn wanted(&self, from: &Pose) -> Vec<DVec3> {
        let frames = from.frames();
        self.sources.iter().map(|source| self.turn * frames[source.index()].position).collect()
    }

    /// The pose with each bone turned to where its far end should be, all else turned in the world as it was.
    fn point(&self, pose: &Pose, wanted: &[DVec3]) -> Pose {
        let before: Vec<DQuat> = pose.frames().iter().map(|frame| frame.rotation).collect();
        let mut after = before.clone();
        for (idx, far_end) in self.far_end.iter().enumerate() {
            let Some(far_end) = far_end else { continue };
            let is = before[idx] * self.rig.joints()[far_end.index()].rest_translation;
            let should = wanted[far_end.index()] - wanted[idx];
            let (Some(is), Some(should)) = (is.try_normalize(), should.try_normalize()) else { continue };
            if is.cross(should).length() > SAME_DIRECTION || is.dot(should) < 0.0 {
                after[idx] = DQuat::from_rotation_arc(is, should) * before[idx];
            }
        }
        let mut pose = pose.clone();
        for (id, joint) in self.rig.ids().zip(self.rig.joints()) {
            let parent = joint.parent.map(JointId::index);
            if after[id.index()] == before[id.index()] && parent.is_none_or(|p| after[p] == before[p]) {
                continue;
            }
            let above = parent.map_or(DQuat::IDENTITY, |parent| after[parent]);
            let local = (above * joint.rest_rotation).inverse() * after[id.index()];
            // Each joint is a ball or free, and the rotation is finite.
            let _ = pose.set_rotation(id, local.normalize());
        }
        pose
    }
}
