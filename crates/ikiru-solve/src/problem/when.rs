//! When an objective holds.

use std::ops::Range;

use crate::problem::{Timeline, TimelineError};

/// Where on the timeline an objective holds.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
#[non_exhaustive]
pub enum When {
    /// At the last sample.
    #[default]
    End,
    /// At the sample nearest to a time (seconds).
    At(f64),
    /// From the sample nearest to one time to that nearest to another (seconds), both included.
    Span {
        /// Seconds.
        from: f64,
        /// Seconds.
        to: f64,
    },
    /// At every sample.
    Throughout,
}

impl When {
    /// The samples of a timeline at which an objective holds: at least one.
    ///
    /// # Errors
    /// A time that is not on the timeline, or a span that ends before it begins.
    pub fn samples(self, timeline: &Timeline) -> Result<Range<usize>, TimelineError> {
        let n_samples = timeline.n_samples();
        Ok(match self {
            Self::End => n_samples - 1..n_samples,
            Self::At(secs) => {
                let sample = timeline.sample_at(secs)?;
                sample..sample + 1
            }
            Self::Span { from, to } => {
                if from.partial_cmp(&to).is_none_or(std::cmp::Ordering::is_gt) {
                    return Err(TimelineError::Span { from, to });
                }
                timeline.sample_at(from)?..timeline.sample_at(to)? + 1
            }
            Self::Throughout => 0..n_samples,
        })
    }
}
