//! A timeline: how many samples a motion has, and when they are.

/// Samples at even distances from 0 s on.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Timeline {
    n_samples: usize,
    step_secs: f64,
}

/// A motion of more samples than this is refused: a day at 10 samples a second.
const MOST_FRAMES: usize = 1_000_000;

/// Why a timeline cannot exist, or a time is not on it.
#[derive(Clone, Copy, Debug, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum TimelineError {
    /// A duration that is no time.
    #[error("a motion lasts a finite time above 0 s, not {0} s")]
    Duration(f64),
    /// A rate that is none.
    #[error("a rate is a finite number of samples a second above 0, not {0}")]
    Rate(f64),
    /// Too short or too long.
    #[error("{0} samples: a motion has at least 2 and at most {MOST_FRAMES}")]
    Samples(usize),
    /// A time before the first or after the last sample.
    #[error("{secs} s is not on the timeline, which goes from 0 to {end} s")]
    Time {
        /// The time.
        secs: f64,
        /// Where the timeline ends.
        end: f64,
    },
    /// A span that ends before it begins.
    #[error("a span goes from an earlier to a later time, not from {from} to {to} s")]
    Span {
        /// Its beginning.
        from: f64,
        /// Its end.
        to: f64,
    },
}

impl Timeline {
    /// `duration_secs` at `rate_hz` samples a second: the first sample at 0 s, the last at the sample nearest to the
    /// duration.
    ///
    /// # Errors
    /// A duration or rate that is not finite and positive, fewer than 2 samples, or more than a million.
    pub fn seconds(duration_secs: f64, rate_hz: f64) -> Result<Self, TimelineError> {
        if !(duration_secs.is_finite() && duration_secs > 0.0) {
            return Err(TimelineError::Duration(duration_secs));
        }
        if !(rate_hz.is_finite() && rate_hz > 0.0) {
            return Err(TimelineError::Rate(rate_hz));
        }
        let n_samples = (duration_secs * rate_hz).round().min(1e15) as usize + 1;
        Self::samples(n_samples, 1.0 / rate_hz)
    }

    /// The paper's trajectory (section 3.7): `n_points` between the first and the last, over one second.
    ///
    /// # Errors
    /// More than a million samples.
    pub fn points(n_points: usize) -> Result<Self, TimelineError> {
        let n_samples = n_points.saturating_add(2);
        Self::samples(n_samples, 1.0 / (n_samples as f64 - 1.0))
    }

    fn samples(n_samples: usize, step_secs: f64) -> Result<Self, TimelineError> {
        if !(2..=MOST_FRAMES).contains(&n_samples) {
            return Err(TimelineError::Samples(n_samples));
        }
        Ok(Self { n_samples, step_secs })
    }

    /// How many samples there are; at least 2.
    #[must_use]
    pub fn n_samples(&self) -> usize {
        self.n_samples
    }

    /// From one sample to the next, in seconds.
    #[must_use]
    pub fn step_secs(&self) -> f64 {
        self.step_secs
    }

    /// When a sample is, in seconds.
    #[must_use]
    pub fn time(&self, sample: usize) -> f64 {
        sample as f64 * self.step_secs
    }

    /// When the last sample is, in seconds.
    #[must_use]
    pub fn end_secs(&self) -> f64 {
        self.time(self.n_samples - 1)
    }

    /// The sample nearest to a time.
    ///
    /// # Errors
    /// A time that is not finite, or more than half a sample outside.
    pub fn sample_at(&self, secs: f64) -> Result<usize, TimelineError> {
        let sample = (secs / self.step_secs).round();
        if !sample.is_finite() || sample < 0.0 || sample > (self.n_samples - 1) as f64 {
            return Err(TimelineError::Time { secs, end: self.end_secs() });
        }
        Ok(sample as usize)
    }

    /// The times of all samples.
    #[must_use]
    pub fn times(&self) -> Vec<f64> {
        (0..self.n_samples).map(|sample| self.time(sample)).collect()
    }

    /// Whether these are the times of all samples.
    pub(crate) fn are_times(&self, secs: &[f64]) -> bool {
        secs.len() == self.n_samples && secs.iter().enumerate().all(|(t, secs)| *secs == self.time(t))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn samples_lie_where_they_should() {
        let line = Timeline::seconds(2.0, 30.0).unwrap();
        assert_eq!((line.n_samples(), line.sample_at(1.0), line.sample_at(2.01)), (61, Ok(30), Ok(60)));
        assert!((line.end_secs() - 2.0).abs() < 1e-12);
        let points = Timeline::points(10).unwrap();
        assert_eq!((points.n_samples(), points.sample_at(1.0)), (12, Ok(11)));
    }

    #[test]
    fn what_is_no_timeline_says_why() {
        for duration in [0.0, -1.0, f64::NAN, f64::INFINITY] {
            assert!(matches!(Timeline::seconds(duration, 30.0), Err(TimelineError::Duration(_))));
            assert!(matches!(Timeline::seconds(1.0, duration), Err(TimelineError::Rate(_))));
        }
        assert_eq!(Timeline::seconds(0.01, 30.0), Err(TimelineError::Samples(1)));
        assert!(matches!(Timeline::seconds(1e9, 1e9), Err(TimelineError::Samples(_))));
        let line = Timeline::seconds(1.0, 10.0).unwrap();
        for secs in [-0.2, 1.2, f64::NAN] {
            assert!(matches!(line.sample_at(secs), Err(TimelineError::Time { .. })));
        }
    }
}
