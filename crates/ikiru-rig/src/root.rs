//! The root of the body: which joint carries everything that moves, and so is the one to float.

use glam::{DQuat, DVec3};

use crate::humanoid::Role;
use crate::joint::{Joint, JointId, JointMotion};
use crate::limit::Range;
use crate::pose::{Pose, PoseError};
use crate::rig::{Rig, RigBuilder};
use crate::rig_error::RigError;

impl Rig {
    /// The lowest joint that carries all of the given ones: each is this joint or hangs below it. `None` for
    /// no joints, for joints of different roots, and for ids of another, larger rig.
    ///
    /// ```
    /// use ikiru_rig::{Joint, RigBuilder};
    ///
    /// let mut builder = RigBuilder::new();
    /// let hips = builder.add(Joint::new("hips", None));
    /// let left = builder.add(Joint::new("left thigh", Some(hips)));
    /// let knee = builder.add(Joint::new("left knee", Some(left)));
    /// let right = builder.add(Joint::new("right thigh", Some(hips)));
    /// let rig = builder.build()?;
    /// assert_eq!(rig.carrier(&[knee, right]), Some(hips));
    /// assert_eq!(rig.carrier(&[knee, left]), Some(left));
    /// # Ok::<(), ikiru_rig::RigError>(())
    /// ```
    #[must_use]
    pub fn carrier(&self, joints: &[JointId]) -> Option<JointId> {
        let mut is_given = vec![false; self.n_joints()];
        for joint in joints {
            *is_given.get_mut(joint.index())? = true;
        }
        carrier(self.joints(), &is_given).map(JointId::from_index)
    }

    /// The root of the body, if it floats.
    #[must_use]
    pub fn floating_root(&self) -> Option<JointId> {
        let floats = |root: &JointId| matches!(self.joints()[root.index()].motion, JointMotion::Free { .. });
        self.root().filter(floats)
    }

    /// From the axes in which a free joint translates to those of the world, with all joints above at rest.
    fn world_from_translation(&self, joint: JointId) -> DQuat {
        let rest = |joint: JointId| self.joints()[joint.index()].rest_rotation;
        self.ancestors(joint).fold(DQuat::IDENTITY, |below, joint| rest(joint) * below)
    }
}

impl Pose {
    /// How far the root of the body ([`Rig::floating_root`]) has moved from where it is at rest: metres along
    /// the axes of the world. Zero where it does not float.
    #[must_use]
    pub fn root_translation(&self) -> DVec3 {
        let Some(root) = self.rig().floating_root() else { return DVec3::ZERO };
        let turn = self.rig().world_from_translation(root);
        // A turn by nothing keeps the bits.
        if turn == DQuat::IDENTITY { self.translation_of(root) } else { turn * self.translation_of(root) }
    }

    /// Moves the root of the body so far from where it is at rest: metres along the axes of the world.
    ///
    /// # Errors
    /// When it does not float, or the value is not finite.
    pub fn set_root_translation(&mut self, translation: DVec3) -> Result<(), PoseError> {
        let Some(root) = self.rig().floating_root() else { return Err(PoseError::NoFloatingRoot) };
        let turn = self.rig().world_from_translation(root);
        let along = if turn == DQuat::IDENTITY { translation } else { turn.inverse() * translation };
        self.set_translation(root, along)
    }
}

impl RigBuilder {
    /// Lets the root of the body float: it translates, then rotates freely inside the cone that it had.
    ///
    /// The root is the lowest joint that carries everything that moves, itself included; of a humanoid the
    /// hips, where all else that moves and is not above them hangs below. What moves above it is fixed from
    /// here on, for the root can do all that it did. A hinge or slider cannot do what a floating joint does, so the joint
    /// above it floats in its place: the base link of a robot.
    ///
    /// # Errors
    /// When no joint moves, when what moves has no joint in common that carries it, and when the joint that
    /// does cannot float: a hinge or slider without a parent, or an Euler joint whose ranges a floating joint
    /// could not keep. Nothing is changed then.
    pub fn free_root(&mut self) -> Result<JointId, RigError> {
        let root = root_of(self.joints())?;
        let joints = self.joints_mut();
        let cone = joints[root].motion.cone().copied();
        joints[root].motion = JointMotion::Free { cone };
        let above: Vec<usize> = line(joints, root).skip(1).collect();
        for joint in above {
            joints[joint].motion = JointMotion::Fixed;
            joints[joint].mimic = None;
        }
        Ok(JointId::from_index(root))
    }
}

/// The lowest joint at or above all of the given ones.
fn carrier(joints: &[Joint], is_given: &[bool]) -> Option<usize> {
    let n_given = is_given.iter().filter(|given| **given).count();
    let mut carries: Vec<usize> = is_given.iter().map(|given| usize::from(*given)).collect();
    // Children stand behind their parents: backwards, each has all of its own when it is added to its parent.
    for idx in (0..joints.len()).rev() {
        if carries[idx] == n_given {
            return (n_given > 0).then_some(idx);
        }
        if let Some(parent) = joints[idx].parent.filter(|parent| parent.index() < idx) {
            carries[parent.index()] += carries[idx];
        }
    }
    None
}

/// The joint that is to float.
pub(crate) fn root_of(joints: &[Joint]) -> Result<usize, RigError> {
    let mut is_given: Vec<bool> = joints.iter().map(|joint| joint.motion != JointMotion::Fixed).collect();
    if !is_given.contains(&true) {
        return Err(RigError::NoRoot);
    }
    if let Some(body) = body_of(joints) {
        // What moves above the body carries it without being a part of it.
        line(joints, body).skip(1).for_each(|joint| is_given[joint] = false);
        is_given[body] = true;
    }
    let Some(lowest) = carrier(joints, &is_given) else { return Err(apart(joints, &is_given)) };
    let fail = |joint: usize| {
        let Joint { name, motion, .. } = &joints[joint];
        RigError::CannotFloat { joint: name.clone(), motion: motion.name() }
    };
    let root = line(joints, lowest).find(|joint| !joints[*joint].motion.is_scalar());
    let root = root.ok_or_else(|| fail(lowest))?;
    match joints[root].motion {
        JointMotion::Euler { ranges, .. } if !ranges.iter().all(Range::is_unlimited) => Err(fail(root)),
        JointMotion::Fixed
        | JointMotion::Hinge { .. }
        | JointMotion::Slider { .. }
        | JointMotion::Euler { .. }
        | JointMotion::Ball { .. }
        | JointMotion::Free { .. } => Ok(root),
    }
}

/// What carries every bone of a humanoid: its hips, where the rig hangs together as a body does.
fn body_of(joints: &[Joint]) -> Option<usize> {
    let has_role: Vec<bool> = joints.iter().map(|joint| joint.role.is_some()).collect();
    joints.iter().any(|joint| joint.role == Some(Role::Hips)).then(|| carrier(joints, &has_role)).flatten()
}

/// Two joints that nothing carries together.
fn apart(joints: &[Joint], is_given: &[bool]) -> RigError {
    let top = |joint: usize| line(joints, joint).last();
    let mut given = (0..joints.len()).filter(|joint| is_given[*joint]);
    let first = given.next();
    let second = given.find(|joint| Some(top(*joint)) != first.map(top));
    let name = |joint: Option<usize>| joint.map_or_else(String::new, |joint| joints[joint].name.clone());
    RigError::NoCommonRoot { first: name(first), second: name(second) }
}

/// The joint itself, its parent, and so on up to the root; a builder's may be wrong, and no walk minds.
fn line(joints: &[Joint], joint: usize) -> impl Iterator<Item = usize> + '_ {
    let parent = |idx: &usize| joints[*idx].parent.map(JointId::index).filter(|parent| parent < idx);
    std::iter::successors(Some(joint), parent)
}
