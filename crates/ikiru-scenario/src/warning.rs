//! What is odd about a scenario without being wrong.

/// Something that the user of a scenario should know.
#[derive(Clone, Debug, PartialEq)]
#[non_exhaustive]
pub enum Warning {
    /// What the rig's reader mended.
    Rig(ikiru_formats::Warning),
    /// The start, or the rest pose where no start is given, lies outside a joint's limits.
    StartProjected {
        /// Name of the joint.
        joint: String,
        /// How far outside, in radians or metres.
        distance: f64,
        /// Whether the scenario gave that start itself.
        given: bool,
    },
    /// No active joint moves what an objective is about.
    OutOfHand {
        /// Position of the objective, from 1.
        objective: usize,
        /// Its kind.
        kind: &'static str,
        /// The joint's name.
        joint: String,
    },
}

impl std::fmt::Display for Warning {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        match self {
            Self::Rig(warning) => warning.fmt(f),
            Self::StartProjected { joint, distance, given } => {
                let what = if *given { "the start" } else { "the rest pose" };
                let degrees = distance.to_degrees();
                write!(
                    f,
                    "{what} of '{joint}' lies {degrees:.3}° outside its limits: it was moved to the nearest pose inside"
                )
            }
            Self::OutOfHand { objective, kind, joint } => {
                write!(
                    f,
                    "objective {objective} ({kind}): no active joint moves '{joint}', so nothing can change it"
                )
            }
        }
    }
}
