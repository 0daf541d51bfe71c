//! What is odd about a scenario without being wrong.

/// Something that the user of a scenario should know.
#[derive(Clone, Debug, PartialEq)]
#[non_exhaustive]
pub enum Warning {
    /// What the rig's reader mended.
    Rig(ikiru_formats::Warning),
    /// A pose that lies outside a joint's limits.
    Projected {
        /// Which pose.
        pose: ScenarioPose,
        /// Name of the joint.
        joint: String,
        /// How far outside, in radians, or metres where [`is_slider`](Self::Projected::is_slider).
        distance: f64,
        /// Whether the joint slides.
        is_slider: bool,
    },
    /// A target that is wanted from the first sample on, which is given and has the joint elsewhere.
    AwayAtStart {
        /// Position of the objective, from 1.
        objective: usize,
        /// Its kind.
        kind: &'static str,
        /// The joint's name.
        joint: String,
        /// From its target, in metres.
        distance: f64,
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

/// A pose that a scenario has.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[non_exhaustive]
pub enum ScenarioPose {
    /// The rest pose, where the scenario does not say otherwise.
    Rest,
    /// What `[start]` gives.
    Start,
    /// What `[motion.end]` gives.
    End,
}

impl Warning {
    /// Whether both say the same, of different places: many of one kind can be counted instead of repeated.
    #[must_use]
    pub fn is_alike(&self, other: &Self) -> bool {
        match (self, other) {
            (Self::Rig(a), Self::Rig(b)) => a.is_alike(b),
            (a, b) => std::mem::discriminant(a) == std::mem::discriminant(b),
        }
    }
}

impl std::fmt::Display for Warning {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        match self {
            Self::Rig(warning) => warning.fmt(f),
            Self::Projected { pose, joint, distance, is_slider } => {
                let what = match pose {
                    ScenarioPose::Rest => "the rest pose",
                    ScenarioPose::Start => "the start",
                    ScenarioPose::End => "the end",
                };
                let by = if *is_slider {
                    format!("{:.2} mm", distance * 1e3)
                } else {
                    format!("{:.3}°", distance.to_degrees())
                };
                write!(
                    f,
                    "{what} of '{joint}' lies {by} outside its limits: it was moved to the nearest pose inside"
                )
            }
            Self::AwayAtStart { objective, kind, joint, distance } => write!(
                f,
                "objective {objective} ({kind}) holds from 0 s on, where the start has '{joint}' {distance:.3} m \
                 from its target: the motion has one sample to get there. Let it begin later, or start where it is met"
            ),
            Self::OutOfHand { objective, kind, joint } => {
                write!(
                    f,
                    "objective {objective} ({kind}): no active joint moves '{joint}', so nothing can change it"
                )
            }
        }
    }
}

/// The joint that a warning says no active joint moves.
pub(crate) fn out_of_hand(warnings: &[Warning], objective: usize) -> Option<&str> {
    warnings.iter().find_map(|warning| match warning {
        Warning::OutOfHand { objective: number, joint, .. } if *number == objective + 1 => {
            Some(joint.as_str())
        }
        _ => None,
    })
}
