//! What the URDF reader mended or left out.

/// Something in a robot description that was mended or left out.
#[derive(Clone, Debug, PartialEq)]
#[non_exhaustive]
pub enum UrdfWarning {
    /// The root link bears the name of a joint, so that its own joint needs another.
    RootRenamed {
        /// The link.
        link: String,
        /// The name of its joint in the rig.
        renamed: String,
    },
    /// A link bears the name of a joint that is not the one above it: the name means that joint.
    LinkHidden {
        /// The link.
        link: String,
        /// The joint above it, by whose name it can be found.
        joint: String,
    },
    /// A limit without `lower` and `upper`: both are 0 by URDF's rule, and the joint cannot move.
    NoRange {
        /// The joint.
        joint: String,
    },
    /// A `<mimic>` in a joint without a value that could follow another's.
    MimicIgnored {
        /// The joint.
        joint: String,
        /// Its type.
        kind: &'static str,
    },
    /// An element that may be there once; the first was used.
    Repeated {
        /// Its name.
        element: String,
        /// The line of the one that was left out.
        line: usize,
        /// Link or joint, with its name.
        owner: String,
    },
    /// A collision shape that could not be read.
    CollisionDropped {
        /// The link.
        link: String,
        /// The line of its `<collision>`.
        line: usize,
        /// What was found and what was expected.
        reason: String,
    },
}

impl std::fmt::Display for UrdfWarning {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        match self {
            Self::RootRenamed { link, renamed } => {
                write!(f, "the root link '{link}' bears the name of a joint, its own is called '{renamed}'")
            }
            Self::LinkHidden { link, joint } => write!(
                f,
                "the name '{link}' means the joint of that name, the link '{link}' is found as '{joint}'"
            ),
            Self::NoRange { joint } => write!(
                f,
                "joint '{joint}': its limit has neither lower nor upper, both are 0, so that it cannot move"
            ),
            Self::MimicIgnored { joint, kind } => {
                write!(f, "joint '{joint}' is {kind}, its <mimic> was left out")
            }
            Self::Repeated { element, line, owner } => {
                write!(f, "{owner} has another <{element}> in line {line}, the first was used")
            }
            Self::CollisionDropped { link, line, reason } => {
                write!(f, "a collision shape of link '{link}' (line {line}) was left out: {reason}")
            }
        }
    }
}
