//! When an objective holds.

use std::ops::Range;

use crate::motion::timeline::{Timeline, TimelineError};

/// Where on the timeline an objective holds.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub enum When {
    /// At the last frame.
    #[default]
    End,
    /// At the frame nearest to a time (seconds).
    At(f64),
    /// From the frame nearest to one time to that nearest to another (seconds), both included.
    Span {
        /// Seconds.
        from: f64,
        /// Seconds.
        to: f64,
    },
    /// At every frame.
    Throughout,
}

impl When {
    /// The frames of a timeline at which an objective holds: at least one.
    ///
    /// # Errors
    /// A time that is not on the timeline, or a span that ends before it begins.
    pub fn frames(self, timeline: &Timeline) -> Result<Range<usize>, TimelineError> {
        let n_frames = timeline.n_frames();
        Ok(match self {
            Self::End => n_frames - 1..n_frames,
            Self::At(secs) => {
                let frame = timeline.frame_at(secs)?;
                frame..frame + 1
            }
            Self::Span { from, to } => {
                if from.partial_cmp(&to).is_none_or(std::cmp::Ordering::is_gt) {
                    return Err(TimelineError::Span { from, to });
                }
                timeline.frame_at(from)?..timeline.frame_at(to)? + 1
            }
            Self::Throughout => 0..n_frames,
        })
    }
}
