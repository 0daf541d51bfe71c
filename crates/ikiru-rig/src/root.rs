//! The root of the body: which joint carries everything that moves, and so is the one to float.

use glam::{DQuat, DVec3};

use crate::carrier::{carrier, line, root_of};
use crate::joint::{JointId, JointMotion};
use crate::pose::Pose;
use crate::pose_error::PoseError;
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
