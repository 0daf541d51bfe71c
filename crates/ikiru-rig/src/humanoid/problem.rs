//! Where the names of a humanoid and its skeleton contradict each other.

use crate::humanoid::Role;

/// A contradiction between the names of a humanoid and its skeleton at rest.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum RoleProblem {
    /// A joint whose name does not fit its place in the tree. It gets no role.
    #[error(
        "joint '{joint}' has the name of the {role}, but it is not on one chain with '{other_joint}', \
         the {other}: it gets no role"
    )]
    Order {
        /// The role that was taken away.
        role: Role,
        /// The joint.
        joint: String,
        /// A role that should lie above or below.
        other: Role,
        /// The joint that has it.
        other_joint: String,
    },
    /// Legs and trunk hang side by side, so that the joint which is called the hips carries no legs, or none is called
    /// so: what carries both is the hips.
    #[error(
        "'{joint}' is the hips, since it carries the legs and the trunk{but}",
        but = .named.as_ref().map_or_else(String::new, |named| format!("; '{named}' carries no legs and is the trunk's first joint"))
    )]
    HipsByStructure {
        /// The joint that is the hips.
        joint: String,
        /// The joint that is called so.
        named: Option<String>,
    },
    /// The joints that are called left lie on the character's right: left and right were exchanged, so that
    /// every role is where the body has it.
    #[error(
        "what is called left lies on the character's right: left and right were exchanged, so '{left_hip}' \
         is the rightUpperLeg"
    )]
    Mirrored {
        /// The joint that is called the left thigh (or what else of the left there is).
        left_hip: String,
    },
    /// The character does not face +z. The roles hold; directions in the world are not what one expects.
    #[error("the character faces {degrees:.0} degrees to its left of +z, expected +z")]
    Facing {
        /// Heading about the vertical axis: 0 is +z, 90 is +x, ±180 is −z.
        degrees: f64,
    },
    /// The character does not stand along +y at rest. The roles hold.
    #[error("at rest the character's up is {up:.2?}, expected +y")]
    NotUpright {
        /// From the hips to the head, a unit vector of the world.
        up: [f64; 3],
    },
}
