//! What a clip comes to: how fast and smoothly it moves, how far a joint travels, how near it comes to limits.

use glam::DVec3;

use super::Clip;
use super::rates::{Rate, RatePart, RateSummary};
use crate::foreign::ForeignJoint;
use crate::joint::{JointId, JointMotion};
use crate::kinematics::{apply_motion_in, rest_frame};
use crate::pose::Pose;
use crate::rig::Rig;

/// A clip in numbers; see [`Clip::measure`].
#[derive(Clone, Copy, Debug, PartialEq)]
#[non_exhaustive]
pub struct ClipMeasure {
    /// From the first to the last pose, in seconds.
    pub duration_secs: f64,
    /// How many poses there are.
    pub n_poses: usize,
    /// How everything turns, in radians.
    pub rotation: RateSummaries,
    /// How everything moves along (sliders and free joints), in metres.
    pub translation: RateSummaries,
    /// How near it comes to its limits.
    pub limit_margin: LimitMargin,
}

/// Speed, acceleration and jerk.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
#[non_exhaustive]
pub struct RateSummaries {
    /// Of the first derivative.
    pub speed: RateSummary,
    /// Of the second.
    pub acceleration: RateSummary,
    /// Of the third.
    pub jerk: RateSummary,
}

/// How far inside its limits a clip stays at least.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
#[non_exhaustive]
pub struct LimitMargin {
    /// Of angles and cones, in radians; `None` where no joint that turns has a limit.
    pub rotation: Option<Margin>,
    /// Of sliders, in metres; `None` where none has a limit.
    pub translation: Option<Margin>,
}

/// How far inside its limits a joint is, and when.
#[derive(Clone, Copy, Debug, PartialEq)]
#[non_exhaustive]
pub struct Margin {
    /// Which joint.
    pub joint: JointId,
    /// When, in seconds of the clip.
    pub secs: f64,
    /// Distance to the nearest limit, in radians or metres; negative outside.
    pub value: f64,
}

impl Clip {
    /// The whole clip in numbers, over all joints: rates as in [`rates`](Self::rates), and
    /// [`limit_margin`](Self::limit_margin).
    #[must_use]
    pub fn measure(&self) -> ClipMeasure {
        let joints: Vec<JointId> = self.moving().collect();
        let [speed, acceleration, jerk] = Rate::ALL.map(|rate| {
            let rates = self.rates(rate);
            [RatePart::Rotation, RatePart::Translation].map(|part| rates.summary_of(&joints, part))
        });
        let of = |part: usize| RateSummaries {
            speed: speed[part],
            acceleration: acceleration[part],
            jerk: jerk[part],
        };
        ClipMeasure {
            duration_secs: self.duration_secs(),
            n_poses: self.poses.len(),
            rotation: of(0),
            translation: of(1),
            limit_margin: self.limit_margin(),
        }
    }

    /// How far a joint's origin travels in the world, in metres: the length of its path on the curve of
    /// [`sample_cubic`](Self::sample_cubic).
    ///
    /// Measured by straight pieces, at most 1/240 s or a 64th of the way between two poses long: a little
    /// too short where the path bends (by a part in 100,000 for a quarter turn from pose to pose).
    ///
    /// # Errors
    /// For a joint of another, larger rig.
    pub fn path_length(&self, joint: JointId) -> Result<f64, ForeignJoint> {
        self.rig().own(joint)?;
        // Joints that move the origin; the joint's own turning does not.
        let path: Vec<JointId> = self.rig().ancestors(joint).collect();
        let mut length = 0.0;
        let mut previous: Option<DVec3> = None;
        self.walk(|_, pose| {
            let origin = origin(pose, &path);
            length += previous.map_or(0.0, |previous| previous.distance(origin));
            previous = Some(origin);
        });
        Ok(length)
    }

    /// How far inside its limits the clip stays at least, at its poses and on the curve of
    /// [`sample_cubic`](Self::sample_cubic) between them. Limits without width (locked joints) do not count
    /// while they hold. Followers count with their own range.
    #[must_use]
    pub fn limit_margin(&self) -> LimitMargin {
        let mut nearest = LimitMargin::default();
        let limited: Vec<JointId> = self.rig().ids().filter(|joint| is_limited(self.rig(), *joint)).collect();
        if limited.is_empty() {
            return nearest;
        }
        self.walk(|secs, pose| {
            for joint in &limited {
                let value = pose.margin(*joint);
                let is_slider =
                    self.rig().get(*joint).is_some_and(|j| matches!(j.motion, JointMotion::Slider { .. }));
                let slot = if is_slider { &mut nearest.translation } else { &mut nearest.rotation };
                if value.is_finite() && slot.is_none_or(|margin| value < margin.value) {
                    *slot = Some(Margin { joint: *joint, secs, value });
                }
            }
        });
        nearest
    }

    /// Shows every pose and the curve between them, densely, in the order of time.
    fn walk(&self, mut show: impl FnMut(f64, &Pose)) {
        let mut pose = self.poses[0].clone();
        show(self.times[0], &pose);
        for times in self.times.windows(2) {
            let step = times[1] - times[0];
            let n = (step * 240.0).ceil().clamp(2.0, 64.0);
            for i in 1..n as usize {
                let secs = times[0] + step * (i as f64 / n);
                self.sample_cubic_into(secs, &mut pose);
                show(secs, &pose);
            }
            self.sample_cubic_into(times[1], &mut pose);
            show(times[1], &pose);
        }
    }
}

impl Pose {
    /// How far inside its limits a joint is: the distance to the nearest end of a range or edge of a cone,
    /// in radians or metres, negative outside. Infinite where nothing limits it; see
    /// [`Cone::margin`](crate::Cone::margin) for limits without width.
    ///
    /// # Errors
    /// For the id of another, larger rig.
    pub fn limit_margin_of(&self, joint: JointId) -> Result<f64, ForeignJoint> {
        self.rig().own(joint)?;
        Ok(self.margin(joint))
    }

    fn margin(&self, joint: JointId) -> f64 {
        let data = &self.rig().joints()[joint.index()];
        let scalar = self.value(joint).map(|value| [value; 3]);
        let values = scalar.or_else(|| self.euler(joint)).unwrap_or_default();
        let ranges = data.motion.ranges().iter().zip(values).map(|(range, value)| range.margin(value));
        let cone = data.motion.cone().map_or([f64::INFINITY; 2], |cone| cone.margin(self.rotation_of(joint)));
        ranges.chain(cone).fold(f64::INFINITY, f64::min)
    }
}

fn is_limited(rig: &Rig, joint: JointId) -> bool {
    rig.get(joint).is_some_and(|data| {
        data.motion.cone().is_some() || data.motion.ranges().iter().any(|range| !range.is_unlimited())
    })
}

/// A joint's origin in the world, of its path to the root.
fn origin(pose: &Pose, path: &[JointId]) -> DVec3 {
    let mut frame = crate::Frame::identity();
    for joint in path.iter().rev() {
        frame = rest_frame(pose.rig(), *joint, &frame);
        apply_motion_in(pose, *joint, &mut frame);
    }
    frame.origin.value()
}
