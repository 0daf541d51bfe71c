//! One motion in numbers.

use std::time::Duration;

use ikiru_rig::{Clip, JointId, Rate, RateLimit, RatePart};
use serde::Serialize;

use super::judge::Unmet;
use super::way::{Way, peak_speed};

/// A motion got in one way. Angles are those of rotations; what joints move along is in no number but the path.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Row {
    /// The scenario's name.
    pub scenario: String,
    /// The way's name.
    pub way: &'static str,
    /// Whether every mandatory objective is met wherever it holds.
    pub met: bool,
    /// The first one that is not.
    pub unmet: Option<Unmet>,
    /// How many poses there are.
    pub frames: usize,
    /// Seconds.
    pub duration_secs: f64,
    /// The fastest joint anywhere on the curve of [`Clip::sample_cubic`], °/s.
    pub peak_speed_deg: f64,
    /// The fastest joint in the first or the last step, °/s: how abruptly the motion begins or ends, which no
    /// acceleration and no jerk below counts.
    pub end_speed_deg: f64,
    /// The largest acceleration of a joint by finite differences ([`Clip::rates`]), °/s².
    pub peak_acceleration_deg: f64,
    /// The largest jerk of a joint by finite differences, °/s³.
    pub peak_jerk_deg: f64,
    /// `∫ ‖jerk‖² dt` over all joints, rad²/s⁵.
    pub total_jerk: f64,
    /// The joint of the first objective that has one.
    pub path_joint: Option<String>,
    /// How far that joint's origin travels on the curve, metres.
    pub path_length: Option<f64>,
    /// How far inside its limits the curve stays at least, degrees, negative outside; none where no angle has limits.
    pub limit_margin_deg: Option<f64>,
    /// The joint that comes so near.
    pub limit_margin_joint: Option<String>,
    /// The largest speed (or acceleration, where the scenario limits one) on the curve as a part of its limit, at most
    /// 1 where all are kept; none without limits.
    pub part_of_limit: Option<f64>,
    /// The limit on every active joint's speed that the limited ways have, °/s.
    pub speed_limit_deg: Option<f64>,
    /// The median time of planning, milliseconds.
    pub time_ms: f64,
}

impl Row {
    /// Measures a motion. `limits` are those that it was planned with, `path_of` is the joint whose way is measured.
    pub(super) fn new(
        scenario: &str,
        way: Way,
        clip: &Clip,
        active: &[JointId],
        limits: &[RateLimit],
        path_of: Option<JointId>,
        unmet: Option<Unmet>,
        time: Duration,
    ) -> Self {
        let measure = clip.measure();
        let name = |joint: JointId| clip.rig().get(joint).map(|j| j.name.clone());
        let is_limited = matches!(way, Way::SpeedLimited | Way::TimeFree);
        // The limits of these ways come behind the scenario's own.
        let of_way =
            limits.iter().rfind(|l| is_limited && (l.part, l.rate) == (RatePart::Rotation, Rate::Speed));
        Self {
            scenario: scenario.to_owned(),
            way: way.name(),
            met: unmet.is_none(),
            unmet,
            frames: measure.n_poses,
            duration_secs: measure.duration_secs,
            peak_speed_deg: peak_speed(clip, active, RatePart::Rotation).to_degrees(),
            end_speed_deg: end_speed(clip, active).to_degrees(),
            peak_acceleration_deg: measure.rotation.acceleration.peak.to_degrees(),
            peak_jerk_deg: measure.rotation.jerk.peak.to_degrees(),
            total_jerk: measure.rotation.jerk.integral,
            path_joint: path_of.and_then(name),
            path_length: path_of.and_then(|joint| clip.path_length(joint).ok()),
            limit_margin_deg: measure.limit_margin.rotation.map(|margin| margin.value.to_degrees()),
            limit_margin_joint: measure.limit_margin.rotation.and_then(|margin| name(margin.joint)),
            part_of_limit: part_of_limit(clip, limits),
            speed_limit_deg: of_way.map(|limit| limit.most.to_degrees()),
            time_ms: time.as_secs_f64() * 1e3,
        }
    }
}

/// The speed of the fastest joint in the first or the last step, rad/s.
fn end_speed(clip: &Clip, active: &[JointId]) -> f64 {
    let speeds = clip.rates(Rate::Speed);
    let ends = |joint: &JointId| {
        let last = speeds.times().len().saturating_sub(1);
        let of_joint = speeds.of_joint(*joint, RatePart::Rotation).map(Vec::from_iter).unwrap_or_default();
        [0, last].map(|idx| of_joint.get(idx).copied().unwrap_or_default())
    };
    active.iter().flat_map(ends).fold(0.0, f64::max)
}

/// The largest of what is limited anywhere on the curve, as a part of its limit.
fn part_of_limit(clip: &Clip, limits: &[RateLimit]) -> Option<f64> {
    let part = |limit: &RateLimit| {
        let peak = match limit.rate {
            Rate::Speed => clip.peak_speed(limit.joint, limit.part),
            _ => clip.peak_acceleration(limit.joint, limit.part),
        };
        Some(peak.ok()?.value / limit.most)
    };
    limits.iter().filter_map(part).reduce(f64::max)
}
