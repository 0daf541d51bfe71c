//! How fast a clip moves, by finite differences of its poses: speed, acceleration and jerk.

use std::ops::Range;

use super::Clip;
use crate::foreign::ForeignJoint;
use crate::joint::{JointId, JointMotion};
use crate::rig::Rig;

/// A derivative of a motion by time.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
#[cfg_attr(feature = "serde", derive(serde::Serialize), serde(rename_all = "snake_case"))]
pub enum Rate {
    /// The first: rad/s and m/s.
    Speed,
    /// The second: rad/s² and m/s².
    Acceleration,
    /// The third: rad/s³ and m/s³.
    Jerk,
}

impl Rate {
    /// All three, by their order.
    pub const ALL: [Self; 3] = [Self::Speed, Self::Acceleration, Self::Jerk];

    /// 1, 2 or 3.
    #[must_use]
    pub fn order(self) -> usize {
        self as usize + 1
    }

    /// What it is called in messages.
    pub(super) fn name(self) -> &'static str {
        match self {
            Self::Speed => "speed",
            Self::Acceleration => "acceleration",
            Self::Jerk => "jerk",
        }
    }
}

/// What of a joint's motion is measured: radians and metres cannot be added up.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
#[cfg_attr(feature = "serde", derive(serde::Serialize), serde(rename_all = "snake_case"))]
pub enum RatePart {
    /// Hinges, Euler angles, balls, and the turning of free joints: radians.
    Rotation,
    /// Sliders, and the moving of free joints: metres.
    Translation,
}

impl RatePart {
    /// What it is called in messages.
    pub(super) fn name(self) -> &'static str {
        match self {
            Self::Rotation => "rotation",
            Self::Translation => "translation",
        }
    }

    /// The unit of one of its derivatives.
    pub(super) fn unit(self, rate: Rate) -> &'static str {
        match (self, rate) {
            (Self::Rotation, Rate::Speed) => "rad/s",
            (Self::Rotation, Rate::Acceleration) => "rad/s²",
            (Self::Rotation, Rate::Jerk) => "rad/s³",
            (Self::Translation, Rate::Speed) => "m/s",
            (Self::Translation, Rate::Acceleration) => "m/s²",
            (Self::Translation, Rate::Jerk) => "m/s³",
        }
    }

    /// Whether a joint has degrees of freedom of its own of this part: one of another, larger rig has none.
    #[must_use]
    pub fn is_of(self, rig: &Rig, joint: JointId) -> bool {
        !self.dofs(rig, joint).is_empty()
    }

    /// Which of a joint's own degrees of freedom, counted from its first, belong to this part.
    pub(super) fn dofs(self, rig: &Rig, joint: JointId) -> Range<usize> {
        let Some(data) = rig.get(joint).filter(|data| data.n_dofs() > 0) else { return 0..0 };
        match (data.motion, self) {
            (JointMotion::Slider { .. }, Self::Translation) => 0..1,
            (JointMotion::Free { .. }, Self::Translation) => 0..3,
            (JointMotion::Free { .. }, Self::Rotation) => 3..6,
            (JointMotion::Slider { .. }, Self::Rotation) | (_, Self::Translation) => 0..0,
            (motion, Self::Rotation) => 0..motion.n_dofs(),
        }
    }
}

/// A largest value, and when.
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize))]
#[non_exhaustive]
pub struct Peak {
    /// How large, 0 or more.
    pub value: f64,
    /// When, in seconds of the clip.
    pub secs: f64,
}

/// A derivative of every degree of freedom over time; see [`Clip::rates`].
#[derive(Clone, Debug)]
pub struct Rates {
    rig: Rig,
    rate: Rate,
    times: Vec<f64>,
    /// How long each row stands for, in seconds.
    spans: Vec<f64>,
    /// Row after row, one number a degree of freedom.
    values: Vec<f64>,
}

/// What a [`Rates`] comes to for some joints.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
#[non_exhaustive]
pub struct RateSummary {
    /// The largest of a single joint (the length over its degrees of freedom): rad/sⁿ or m/sⁿ for the n-th
    /// derivative. 0 where nothing moves.
    pub peak: f64,
    /// When that is, in seconds of the clip.
    pub peak_secs: f64,
    /// Whose it is; `None` where nothing moves.
    pub peak_joint: Option<JointId>,
    /// The root of the mean over time of the squared length over all the joints: rad/sⁿ or m/sⁿ.
    pub rms: f64,
    /// `∫ ‖x‖² dt` over all the joints: rad²/s²ⁿ⁻¹ or m²/s²ⁿ⁻¹. Of the jerk, it is the total jerk.
    pub integral: f64,
}

impl Clip {
    /// Speed, acceleration or jerk of every degree of freedom over time.
    ///
    /// The n-th derivative is n! times the n-th divided difference: the differences of [`Pose`](crate::Pose)s
    /// on the manifold, by the time between them, and again. It needs n + 1 poses, stands at the mean of
    /// their times, and is exact for polynomials of degree n at any spacing. At even steps it is the
    /// paper's finite difference of order n (equation 25) divided by the step to the n-th power. A ball's velocity is
    /// in the frame that turns with it. A clip of fewer poses has no row.
    #[must_use]
    pub fn rates(&self, rate: Rate) -> Rates {
        let n_dofs = self.rig().n_dofs();
        let mut values = Vec::with_capacity(n_dofs * self.times.len().saturating_sub(1));
        for (times, poses) in self.times.windows(2).zip(self.poses.windows(2)) {
            // Poses of one rig always have a difference.
            let step = poses[0].difference(&poses[1]).unwrap_or_else(|_| vec![0.0; n_dofs]);
            values.extend(step.iter().map(|d| d / (times[1] - times[0])));
        }
        for order in 2..=rate.order() {
            for (row, span) in spans(&self.times, order).enumerate() {
                for dof in 0..n_dofs {
                    let at = row * n_dofs + dof;
                    values[at] = (values[at + n_dofs] - values[at]) / span;
                }
            }
            values.truncate(n_dofs * self.times.len().saturating_sub(order));
        }
        let mean = |times: &[f64]| times.iter().sum::<f64>() / times.len() as f64;
        Rates {
            rig: self.rig().clone(),
            rate,
            times: self.times.windows(rate.order() + 1).map(mean).collect(),
            spans: spans(&self.times, rate.order()).collect(),
            values,
        }
    }
}

/// The mean of `order` neighbouring steps, for each row of that order.
fn spans(times: &[f64], order: usize) -> impl Iterator<Item = f64> + '_ {
    times.windows(order + 1).map(move |times| (times[order] - times[0]) / order as f64)
}

impl Rates {
    /// Which derivative it is.
    #[must_use]
    pub fn rate(&self) -> Rate {
        self.rate
    }

    /// When each row is, in seconds of the clip.
    #[must_use]
    pub fn times(&self) -> &[f64] {
        &self.times
    }

    /// A row: one number a degree of freedom ([`Rig::n_dofs`]), rad/sⁿ or m/sⁿ. Empty beyond the last.
    #[must_use]
    pub fn row(&self, idx: usize) -> &[f64] {
        let n_dofs = self.rig.n_dofs();
        self.values.get(idx * n_dofs..(idx + 1) * n_dofs).unwrap_or_default()
    }

    /// One degree of freedom (its place in a tangent) over time; zeros for one that the rig does not have.
    pub fn of_dof(&self, dof: usize) -> impl ExactSizeIterator<Item = f64> + '_ {
        (0..self.times.len()).map(move |idx| self.row(idx).get(dof).copied().unwrap_or_default())
    }

    /// The largest magnitude of one degree of freedom, and when. 0 at 0 s where there is no row.
    #[must_use]
    pub fn peak_of(&self, dof: usize) -> Peak {
        let mut peak = Peak { value: 0.0, secs: self.times.first().copied().unwrap_or_default() };
        for (value, secs) in self.of_dof(dof).zip(&self.times) {
            if value.abs() > peak.value {
                peak = Peak { value: value.abs(), secs: *secs };
            }
        }
        peak
    }

    /// The root of the mean square of one degree of freedom over time; 0 where there is no row.
    #[must_use]
    pub fn rms_of(&self, dof: usize) -> f64 {
        let secs: f64 = self.spans.iter().sum();
        if secs > 0.0 { (self.integral_of(dof) / secs).sqrt() } else { 0.0 }
    }

    /// `∫ x² dt` of one degree of freedom.
    #[must_use]
    pub fn integral_of(&self, dof: usize) -> f64 {
        self.of_dof(dof).zip(&self.spans).map(|(value, secs)| value * value * secs).sum()
    }

    /// One joint's rotation or translation over time: the length over its degrees of freedom. Zeros where it has no such
    /// freedom of its own.
    ///
    /// # Errors
    /// For a joint of another, larger rig.
    pub fn of_joint(
        &self,
        joint: JointId,
        part: RatePart,
    ) -> Result<impl ExactSizeIterator<Item = f64> + '_, ForeignJoint> {
        self.rig.own(joint)?;
        Ok(self.lengths(joint, part))
    }

    fn lengths(&self, joint: JointId, part: RatePart) -> impl ExactSizeIterator<Item = f64> + '_ {
        let (start, dofs) = (self.rig.dofs_of(joint).start, part.dofs(&self.rig, joint));
        let at = start + dofs.start..start + dofs.end;
        (0..self.times.len()).map(move |idx| {
            let dofs = self.row(idx).get(at.clone()).unwrap_or_default();
            dofs.iter().map(|value| value * value).sum::<f64>().sqrt()
        })
    }

    /// Peak, mean and integral over some joints, each listed once.
    ///
    /// # Errors
    /// For a joint of another, larger rig.
    pub fn summary(&self, joints: &[JointId], part: RatePart) -> Result<RateSummary, ForeignJoint> {
        joints.iter().try_for_each(|joint| self.rig.own(*joint).map(drop))?;
        Ok(self.summary_of(joints, part))
    }

    /// The [summary](Self::summary) over joints of the rig's own.
    pub(super) fn summary_of(&self, joints: &[JointId], part: RatePart) -> RateSummary {
        let mut summary = RateSummary::default();
        for joint in joints {
            for (idx, length) in self.lengths(*joint, part).enumerate() {
                summary.integral += length * length * self.spans[idx];
                if length > summary.peak {
                    summary.peak = length;
                    summary.peak_secs = self.times[idx];
                    summary.peak_joint = Some(*joint);
                }
            }
        }
        let secs: f64 = self.spans.iter().sum();
        if secs > 0.0 {
            summary.rms = (summary.integral / secs).sqrt();
        }
        summary
    }
}
