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

    /// Which of the axes that something is given in points up, where the rig's y does.
    pub(crate) fn up(self) -> DVec3 {
        let up = self.world.inverse() * DVec3::Y;
        // They are those of a file, which turns by right angles: what is more is rounding.
        DVec3::AXES
            .into_iter()
            .max_by(|a, b| a.dot(up).abs().total_cmp(&b.dot(up).abs()))
            .map_or(up, |axis| axis * axis.dot(up).signum())
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

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_is_up_in_a_file_is_one_of_its_axes() {
        let vrm = concat!(env!("CARGO_MANIFEST_DIR"), "/../ikiru-formats/tests/data/mh_male_vrm0.vrm");
        for (rig, up) in [("builtin:g1", DVec3::Z), (vrm, DVec3::Y), ("builtin:human", DVec3::Y)] {
            let loaded = ikiru_formats::read(rig).unwrap_or_else(|error| panic!("{error}"));
            assert_eq!((Axes::of_file(&loaded).up(), Axes::RIG.up()), (up, DVec3::Y), "{rig}");
        }
    }
}
