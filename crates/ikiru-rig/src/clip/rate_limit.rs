//! The most that a joint's speed or acceleration may be, and where a clip goes beyond it.

use super::rates::{Peak, Rate, RatePart};
use super::{Clip, ClipError};
use crate::joint::JointId;
use crate::pose::Pose;
use crate::rig::Rig;

/// How far above its limit a peak may be, relative to it: rounding is no excess.
pub(super) const TOLERANCE: f64 = 1e-9;

/// The most that one joint's speed or acceleration may be.
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize))]
pub struct RateLimit {
    /// Whose it is: a joint with a degree of freedom of its own.
    pub joint: JointId,
    /// What of its motion is limited. The length over its degrees of freedom is meant, as in
    /// [`Clip::peak_speed`].
    pub part: RatePart,
    /// [`Rate::Speed`] or [`Rate::Acceleration`]; a jerk is refused.
    pub rate: Rate,
    /// Above 0: rad/s or m/s for a speed, rad/s² or m/s² for an acceleration.
    pub most: f64,
}

/// A limit that a clip does not keep, and where it is furthest above it.
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize))]
#[non_exhaustive]
pub struct RateExcess {
    /// The limit.
    pub limit: RateLimit,
    /// The largest value of what it limits, and when.
    pub peak: Peak,
}

impl RateLimit {
    /// Whether the limit means something for a rig.
    ///
    /// # Errors
    /// When it is on a joint that the rig does not have, on a jerk, on a motion that the joint does not have, or not a
    /// finite number above 0.
    pub fn check(&self, rig: &Rig) -> Result<(), ClipError> {
        let Self { joint: id, part, rate, most } = *self;
        let data = rig.own(id)?;
        let joint = || data.name.clone();
        if rate == Rate::Jerk {
            return Err(ClipError::RateLimitJerk { joint: joint() });
        }
        if !most.is_finite() || most <= 0.0 {
            return Err(ClipError::RateLimitMost { joint: joint(), part, rate, most });
        }
        if !part.is_of(rig, id) {
            let motion = if data.mimic.is_some() { "a follower of another" } else { data.motion.name() };
            return Err(ClipError::RateLimitPart { joint: joint(), motion, part });
        }
        Ok(())
    }
}

impl RateExcess {
    /// The peak as a multiple of its limit: above 1.
    #[must_use]
    pub fn ratio(&self) -> f64 {
        self.peak.value / self.limit.most
    }

    /// How many times as long the clip must take for the limit to hold: speeds fall with the tempo, accelerations
    /// with its square.
    #[must_use]
    pub fn needed_stretch(&self) -> f64 {
        match self.limit.rate {
            Rate::Speed => self.ratio(),
            Rate::Acceleration | Rate::Jerk => self.ratio().sqrt(),
        }
    }
}

impl Clip {
    /// The limits that the clip does not keep anywhere on the curve of [`sample_cubic`](Self::sample_cubic), the worst
    /// ([`RateExcess::ratio`]) first; empty where it keeps all of them.
    ///
    /// A peak up to a part in 10⁹ above its limit counts as kept. Peaks are found as in
    /// [`peak_speed`](Self::peak_speed) and [`peak_acceleration`](Self::peak_acceleration), for the joints with
    /// limits alone: time grows with the number of poses times that of limits. Between poses that are too near to each
    /// other to come near a limit nothing is measured.
    ///
    /// # Errors
    /// When a limit is on a joint that the rig does not have, on a jerk, on a motion that the joint does not have,
    /// or not a finite number above 0; and when a pose has a number of such a joint that is not finite.
    pub fn exceeded(&self, limits: &[RateLimit]) -> Result<Vec<RateExcess>, ClipError> {
        Ok(self.exceeded_while(limits, || true)?.unwrap_or_default())
    }

    /// The limits that the clip does not keep, as [`exceeded`](Self::exceeded) finds them, as long as `may_go_on` says so, which is asked
    /// before each limit that is measured; `None` where it was stopped: for who has little time.
    ///
    /// # Errors
    /// Those of [`exceeded`](Self::exceeded).
    pub fn exceeded_while(
        &self,
        limits: &[RateLimit],
        may_go_on: impl Fn() -> bool,
    ) -> Result<Option<Vec<RateExcess>>, ClipError> {
        self.check_rate_limits(limits)?;
        let mut excesses = Vec::new();
        for limit in limits {
            if !may_go_on() {
                return Ok(None);
            }
            let floor = limit.most * (1.0 + TOLERANCE);
            if let Some(peak) = self.peak_above(limit.joint, limit.part, limit.rate, floor) {
                excesses.push(RateExcess { limit: *limit, peak });
            }
        }
        excesses.sort_by(|a, b| b.ratio().total_cmp(&a.ratio()));
        Ok(Some(excesses))
    }

    /// Refuses limits that mean nothing for this clip.
    fn check_rate_limits(&self, limits: &[RateLimit]) -> Result<(), ClipError> {
        let rig = self.rig();
        for limit in limits {
            limit.check(rig)?;
            let at = rig.coords_of(limit.joint);
            let is_finite = |pose: &Pose| pose.coords()[at.clone()].iter().all(|c| c.is_finite());
            if let Some(pose) = self.poses.iter().position(|pose| !is_finite(pose)) {
                let joint = rig.joints()[limit.joint.index()].name.clone();
                return Err(ClipError::NotFinite { pose, joint });
            }
        }
        Ok(())
    }
}
