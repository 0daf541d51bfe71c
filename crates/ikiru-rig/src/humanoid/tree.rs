//! The joints of a rig or of a builder, walked upwards: a builder's may be wrong, and no walk minds.

use glam::{DQuat, DVec3};

use crate::humanoid::Role;
use crate::joint::Joint;

/// A joint for each role.
pub(super) type Found = [Option<usize>; Role::ALL.len()];

/// Joints by position, parents first.
#[derive(Clone, Copy)]
pub(super) struct Tree<'j>(pub(super) &'j [Joint]);

impl<'j> Tree<'j> {
    pub(super) fn name(self, joint: usize) -> String {
        self.0.get(joint).map_or_else(String::new, |j| j.name.clone())
    }

    /// The joint itself, its parent, and so on up to the root.
    pub(super) fn line(self, joint: usize) -> impl Iterator<Item = usize> + 'j {
        let parent = move |idx: &usize| {
            let parent = self.0.get(*idx)?.parent?.index();
            (parent < *idx).then_some(parent)
        };
        std::iter::successors((joint < self.0.len()).then_some(joint), parent)
    }

    /// How many joints lie above.
    pub(super) fn depth(self, joint: usize) -> usize {
        self.line(joint).count()
    }

    /// Where the joint is at rest, in the world.
    pub(super) fn position(self, joint: usize) -> DVec3 {
        self.line(joint).fold(DVec3::ZERO, |point, idx| {
            let rest = self
                .0
                .get(idx)
                .map_or((DQuat::IDENTITY, DVec3::ZERO), |j| (j.rest_rotation, j.rest_translation));
            rest.0 * point + rest.1
        })
    }
}
