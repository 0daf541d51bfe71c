//! What gets lost where a clip is transferred.

use crate::rig_error::RigError;

/// What a clip lost when it was transferred.
#[derive(Clone, Debug, PartialEq)]
#[non_exhaustive]
pub enum TransferWarning {
    /// The hips move in the clip, and stay in place on the target.
    HipsStay {
        /// How far they would have got from where they are at rest, metres.
        metres: f64,
        /// Why nothing of the target can float.
        reason: RigError,
    },
    /// The clip goes somewhere, but one of the rigs has no joint that is the hips.
    NoHips {
        /// Which: the clip's rig, or the target.
        rig: &'static str,
    },
}

impl std::fmt::Display for TransferWarning {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        match self {
            Self::HipsStay { metres, reason } => {
                write!(
                    f,
                    "the hips, which go up to {metres:.3} m from their place, were left there: {reason}"
                )
            }
            Self::NoHips { rig } => {
                write!(
                    f,
                    "{rig} has no joint that is the hips, so their way was left out: expected the role 'hips'"
                )
            }
        }
    }
}
