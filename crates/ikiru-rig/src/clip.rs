//! A clip: poses over time, as a motion file holds them.

use crate::pose::Pose;

/// Poses at increasing times, all of one rig.
#[derive(Clone, Debug, PartialEq)]
pub struct Clip {
    name: String,
    times: Vec<f64>,
    poses: Vec<Pose>,
}

/// Why a clip cannot exist.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum ClipError {
    /// There is no pose.
    #[error("a clip needs at least one pose")]
    Empty,
    /// Not as many times as poses.
    #[error("{times} times do not fit {poses} poses")]
    Count {
        /// How many times there were.
        times: usize,
        /// How many poses there were.
        poses: usize,
    },
    /// A time that is not finite, or not later than the one before.
    #[error("time {idx} must be finite and later than the one before it, not {secs} s")]
    Time {
        /// Its position.
        idx: usize,
        /// What it was.
        secs: f64,
    },
    /// A pose of another rig than the first.
    #[error("pose {0} belongs to another rig than pose 0")]
    Rig(usize),
}

impl Clip {
    /// A clip of `poses` at `times` (seconds).
    ///
    /// # Errors
    /// When there is no pose, the counts differ, times do not increase, or poses belong to different rigs.
    pub fn new(name: impl Into<String>, times: Vec<f64>, poses: Vec<Pose>) -> Result<Self, ClipError> {
        let first = poses.first().ok_or(ClipError::Empty)?;
        if times.len() != poses.len() {
            return Err(ClipError::Count { times: times.len(), poses: poses.len() });
        }
        if let Some(idx) = poses.iter().position(|p| !p.rig().is_same(first.rig())) {
            return Err(ClipError::Rig(idx));
        }
        let mut previous = f64::NEG_INFINITY;
        for (idx, secs) in times.iter().copied().enumerate() {
            if !secs.is_finite() || secs <= previous {
                return Err(ClipError::Time { idx, secs });
            }
            previous = secs;
        }
        Ok(Self { name: name.into(), times, poses })
    }

    /// Its name; empty where the file gave none.
    #[must_use]
    pub fn name(&self) -> &str {
        &self.name
    }

    /// The times, in seconds.
    #[must_use]
    pub fn times(&self) -> &[f64] {
        &self.times
    }

    /// The poses, one a time.
    #[must_use]
    pub fn poses(&self) -> &[Pose] {
        &self.poses
    }

    /// From the first to the last time, in seconds.
    #[must_use]
    pub fn duration_secs(&self) -> f64 {
        self.times[self.times.len() - 1] - self.times[0]
    }

    /// The pose at a time (seconds), between its neighbours on the manifold: angles linearly, rotations
    /// about one axis at constant speed. Before the first and after the last pose the clip holds still; so
    /// it does at a time that is not a number.
    #[must_use]
    pub fn sample(&self, secs: f64) -> Pose {
        let after = self.times.partition_point(|t| *t <= secs);
        if after == 0 || after == self.times.len() {
            return self.poses[after.min(self.times.len() - 1)].clone();
        }
        let before = after - 1;
        let t = (secs - self.times[before]) / (self.times[after] - self.times[before]);
        // Both poses belong to one rig, so there is always a way between them.
        self.poses[before].interpolate(&self.poses[after], t).unwrap_or_else(|_| self.poses[before].clone())
    }
}
