//! New clips of old ones: at other times, and one behind another.

use super::{Clip, ClipError};
use crate::pose::Pose;

/// Seconds from pose to pose where no clip says how many.
const STEP_SECS: f64 = 1.0 / 30.0;

/// Poses that differ by less, in radians and metres, are one pose.
const SAME: f64 = 1e-9;

/// The most numbers that a made clip may have: 2 GiB.
pub(super) const MOST_NUMBERS: usize = 1 << 28;

impl Clip {
    /// The clip at even steps, along the curve of [`sample_cubic`](Self::sample_cubic). First and last pose stay at
    /// their times: the step is the one nearest to `1 / rate_hz` seconds that divides the duration, at
    /// least one. A single pose stays alone.
    ///
    /// # Errors
    /// When the rate (poses a second) is not finite or not above 0, or there would be more poses than fit
    /// into 2 GiB.
    pub fn resample(&self, rate_hz: f64) -> Result<Self, ClipError> {
        if !rate_hz.is_finite() || rate_hz <= 0.0 {
            return Err(ClipError::Rate(rate_hz));
        }
        let last = self.times.len() - 1;
        if last == 0 {
            return Ok(self.clone());
        }
        let n_steps = (self.duration_secs() * rate_hz).round().max(1.0);
        self.check_length(n_steps + 1.0)?;
        let (start, duration, n) = (self.times[0], self.duration_secs(), n_steps as usize);
        let mut times: Vec<f64> = (0..=n).map(|i| start + duration * (i as f64 / n_steps)).collect();
        times[n] = self.times[last];
        self.resample_at(times)
    }

    /// The clip at other times (seconds), along the curve of [`sample_cubic`](Self::sample_cubic). Before its first
    /// and after its last pose it holds still.
    ///
    /// # Errors
    /// When there is no time, times do not increase or are not finite, or there are more poses than fit
    /// into 2 GiB.
    pub fn resample_at(&self, times: Vec<f64>) -> Result<Self, ClipError> {
        self.check_length(times.len() as f64)?;
        let poses = times.iter().map(|secs| self.sample_cubic(*secs)).collect();
        Self::new(self.name.clone(), times, poses)
    }

    /// This clip and then another of the same rig, under this one's name (the other's if it has none).
    ///
    /// The other begins `gap_secs` after this one ends. Without a gap, a first pose that equals this one's
    /// last (within 1e-9 rad and m) is left out, so that both meet in one pose; if it differs, and for any
    /// gap shorter than that, it follows one frame later: as long as this clip's last step, else the other's
    /// first, else 1/30 s.
    ///
    /// # Errors
    /// When the clips belong to different rigs, the gap is negative or not finite, or times get so large that
    /// they are one.
    pub fn concat(&self, other: &Self, gap_secs: f64) -> Result<Self, ClipError> {
        if !self.rig().is_same(other.rig()) {
            return Err(ClipError::OtherRig);
        }
        if !gap_secs.is_finite() || gap_secs < 0.0 {
            return Err(ClipError::Gap(gap_secs));
        }
        self.check_length((self.times.len() + other.times.len()) as f64)?;
        let meets = gap_secs == 0.0 && is_equal(&self.poses[self.poses.len() - 1], &other.poses[0]);
        let step = match (self.times.as_slice(), other.times.as_slice()) {
            ([.., a, b], _) | (_, [a, b, ..]) => b - a,
            _ => STEP_SECS,
        };
        let gap = if meets { 0.0 } else { gap_secs.max(step) };
        let shift = self.times[self.times.len() - 1] + gap;
        let skipped = usize::from(meets);
        let later = other.times.iter().skip(skipped).map(|secs| shift + (secs - other.times[0]));
        Self::new(
            if self.name.is_empty() { other.name.clone() } else { self.name.clone() },
            self.times.iter().copied().chain(later).collect(),
            self.poses.iter().chain(other.poses.iter().skip(skipped)).cloned().collect(),
        )
    }

    /// Refuses what would not fit into memory before it is made.
    pub(super) fn check_length(&self, n_poses: f64) -> Result<(), ClipError> {
        // A pose has a few words of its own besides its numbers.
        let most = MOST_NUMBERS / (self.rig().n_coords() + 8);
        if n_poses > most as f64 { Err(ClipError::TooLong { n_poses, most }) } else { Ok(()) }
    }
}

fn is_equal(a: &Pose, b: &Pose) -> bool {
    a.difference(b).is_ok_and(|tangent| tangent.iter().all(|d| d.abs() <= SAME))
}
