//! Whether two rigs have the same joints in the same places, whatever moves and however far.

use crate::joint::Joint;
use crate::rig::Rig;

/// The first difference of the shapes of two rigs.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
#[non_exhaustive]
pub enum ShapeDifference {
    /// One has more joints.
    #[error("it has {found} joints, expected {expected}")]
    Count {
        /// How many the other has.
        found: usize,
        /// How many this one has.
        expected: usize,
    },
    /// A joint has another name.
    #[error("joint {idx} is '{found}', expected '{expected}'")]
    Name {
        /// Its position.
        idx: usize,
        /// What the other calls it.
        found: String,
        /// What this one calls it.
        expected: String,
    },
    /// A joint has another parent.
    #[error("joint '{0}' has another parent")]
    Parent(String),
    /// A joint has another rest transform.
    #[error("joint '{0}' has another rest transform")]
    Rest(String),
}

impl Rig {
    /// How the shape of another rig differs from this one's: names, parents and rest transforms of the joints, in order.
    /// `None` for the same shape: a pose of the one then has its places as one of the other, where joints move
    /// alike. Motions, limits, roles and other names do not matter.
    ///
    /// ```
    /// use ikiru_rig::{Joint, JointMotion, RigBuilder, ShapeDifference};
    ///
    /// let mut builder = RigBuilder::new();
    /// builder.add(Joint::new("hips", None));
    /// let rig = builder.clone().build()?;
    /// builder.joints_mut()[0].motion = JointMotion::FREE;
    /// assert_eq!(rig.shape_difference(&builder.clone().build()?), None);
    /// builder.joints_mut()[0].name = "pelvis".to_owned();
    /// let difference = rig.shape_difference(&builder.build()?);
    /// assert!(matches!(difference, Some(ShapeDifference::Name { idx: 0, .. })));
    /// # Ok::<(), ikiru_rig::RigError>(())
    /// ```
    #[must_use]
    pub fn shape_difference(&self, other: &Self) -> Option<ShapeDifference> {
        if self.is_same(other) {
            return None;
        }
        if self.n_joints() != other.n_joints() {
            return Some(ShapeDifference::Count { found: other.n_joints(), expected: self.n_joints() });
        }
        self.joints().iter().zip(other.joints()).enumerate().find_map(|(idx, (ours, theirs))| {
            let rest = |joint: &Joint| (joint.rest_rotation, joint.rest_translation);
            if ours.name != theirs.name {
                let (found, expected) = (theirs.name.clone(), ours.name.clone());
                Some(ShapeDifference::Name { idx, found, expected })
            } else if ours.parent != theirs.parent {
                Some(ShapeDifference::Parent(ours.name.clone()))
            } else if rest(ours) != rest(theirs) {
                Some(ShapeDifference::Rest(ours.name.clone()))
            } else {
                None
            }
        })
    }
}
