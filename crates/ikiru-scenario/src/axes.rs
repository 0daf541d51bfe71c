//! Whose axes targets are in: the key `world`.

use glam::{DQuat, DVec3};
use ikiru_formats::Loaded;

/// From the axes that something is given in to those of the rig: of the world, and of the joints.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Axes {
    pub(crate) world: DQuat,
    /// From a joint's axes there to the rig's.
    joint: DQuat,
}

impl Axes {
    /// The rig's own: `world = "scene"`.
    pub(crate) const RIG: Self = Self { world: DQuat::IDENTITY, joint: DQuat::IDENTITY };

    /// Those of the file that the rig was read from: `world = "file"`.
    pub(crate) fn of_file(loaded: &Loaded) -> Self {
        Self { world: loaded.world_from_file(), joint: loaded.joint_from_file() }
    }

    /// From the rig's axes to these.
    pub(crate) fn inverse(self) -> Self {
        Self { world: self.world.inverse(), joint: self.joint.inverse() }
    }

    /// A point or direction of the world.
    pub(crate) fn vector(self, vector: DVec3) -> DVec3 {
        self.world * vector
    }

    /// How a joint is turned in the world.
    pub(crate) fn rotation(self, rotation: DQuat) -> DQuat {
        self.world * rotation * self.joint.inverse()
    }
}
