//! A clip: poses over time, as a motion file holds them.
//!
//! Between its poses a clip is read in one of two ways: straight ([`Clip::sample`]), or along a smooth curve
//! ([`Clip::sample_cubic`]). Measures of how it moves are finite differences of the poses ([`Clip::rates`],
//! [`Clip::measure`]), or belong to the smooth curve ([`Clip::peak_speed`], [`Clip::path_length`]).

mod cubic;
mod curve;
mod edit;
mod measure;
mod rate_bound;
mod rate_limit;
mod rates;
mod retime;
mod tempo;
mod time_map;
mod turn;
mod unwrap;

pub use measure::{ClipMeasure, LimitMargin, Margin, RateSummaries};
pub use rate_limit::{RateExcess, RateLimit};
pub use rates::{Peak, Rate, RatePart, RateSummary, Rates};
pub use retime::Retimed;

use crate::foreign::ForeignJoint;
use crate::pose::{Pose, retract_joint};
use crate::rig::Rig;

/// Poses at increasing times, all of one rig.
#[derive(Clone, Debug, PartialEq)]
pub struct Clip {
    name: String,
    times: Vec<f64>,
    poses: Vec<Pose>,
}

/// Why a clip cannot exist.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[non_exhaustive]
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
    /// Two clips of different rigs.
    #[error("the clips belong to different rigs")]
    OtherRig,
    /// A number of poses a second that is not finite or not above 0.
    #[error("the rate must be a finite number of poses a second above 0, not {0}")]
    Rate(f64),
    /// A pause that is not finite or negative.
    #[error("the gap must be a finite number of seconds, 0 or more, not {0}")]
    Gap(f64),
    /// More poses than fit into 2 GiB.
    #[error("{n_poses} poses are too many for this rig: expected at most {most}")]
    TooLong {
        /// How many there would be.
        n_poses: f64,
        /// How many there may be.
        most: usize,
    },
    /// A limit on the speed or acceleration of a joint that the rig does not have.
    #[error(transparent)]
    NoJoint(#[from] ForeignJoint),
    /// A limit on a jerk.
    #[error("joint '{joint}': a jerk cannot be limited, only a speed or an acceleration")]
    RateLimitJerk {
        /// Name of the joint.
        joint: String,
    },
    /// A largest speed or acceleration that is not finite or not above 0.
    #[error(
        "joint '{joint}': its largest {} must be a finite number of {} above 0, not {most}; \
         leave the limit out where there is none",
        .rate.name(), .part.unit(*.rate)
    )]
    RateLimitMost {
        /// Name of the joint.
        joint: String,
        /// What of its motion was to be limited.
        part: RatePart,
        /// Its speed or its acceleration.
        rate: Rate,
        /// What was given.
        most: f64,
    },
    /// A limit on a motion that the joint does not have.
    #[error("joint '{joint}' is {motion}: it has no {} of its own to limit", .part.name())]
    RateLimitPart {
        /// Name of the joint.
        joint: String,
        /// How it moves.
        motion: &'static str,
        /// What of its motion was to be limited.
        part: RatePart,
    },
    /// A joint with a limit whose numbers are not finite, so that nobody can say how fast it moves.
    #[error("pose {pose}: the numbers of joint '{joint}' must be finite for its speed to be limited")]
    NotFinite {
        /// Position of the pose.
        pose: usize,
        /// Name of the joint.
        joint: String,
    },
    /// A limit that holds at no tempo that was tried.
    #[error(
        "joint '{joint}' still reaches {:.3e} {unit}, above its largest {} of {} {unit}: raise that limit, or smooth the \
         clip (where a cone stops or turns a joint at once, no tempo is slow enough)",
        .excess.peak.value, .excess.limit.rate.name(), .excess.limit.most,
        unit = .excess.limit.part.unit(.excess.limit.rate)
    )]
    Unkept {
        /// Name of the joint.
        joint: String,
        /// The limit, and the peak that was left.
        excess: RateExcess,
    },
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

    /// A motion that stands still: one pose, at 0 s, named `still`. What a plan may start from where there is no
    /// motion yet, and what a single pose is written as where a file wants a motion.
    ///
    /// ```
    /// use ikiru_rig::{Clip, Joint, RigBuilder};
    ///
    /// let mut builder = RigBuilder::new();
    /// builder.add(Joint::new("hip", None));
    /// let pose = builder.build()?.rest_pose();
    /// let still = Clip::still(pose.clone());
    /// assert_eq!((still.sample(7.0), still.duration_secs()), (pose, 0.0));
    /// # Ok::<(), ikiru_rig::RigError>(())
    /// ```
    #[must_use]
    pub fn still(pose: Pose) -> Self {
        Self { name: "still".to_owned(), times: vec![0.0], poses: vec![pose] }
    }

    /// Its name; empty where the file gave none.
    #[must_use]
    pub fn name(&self) -> &str {
        &self.name
    }

    /// This clip under another name.
    #[must_use]
    pub fn with_name(mut self, name: impl Into<String>) -> Self {
        self.name = name.into();
        self
    }

    /// The rig that its poses are of.
    #[must_use]
    pub fn rig(&self) -> &Rig {
        self.poses[0].rig()
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

    /// The coordinates of one pose, to change it in place; `None` where there is no such pose. Their order is that
    /// of [`Pose::coords`].
    #[must_use]
    pub fn coords_mut(&mut self, idx: usize) -> Option<&mut [f64]> {
        self.poses.get_mut(idx).map(Pose::coords_mut)
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
        let mut pose = self.poses[0].clone();
        self.sample_into(secs, &mut pose);
        pose
    }

    /// Writes the pose at a time (seconds), as [`sample`](Self::sample) finds it, into one that is there already, which allocates
    /// nothing. A pose of another rig is left as it is.
    pub fn sample_into(&self, secs: f64, pose: &mut Pose) {
        let rig = self.rig();
        if !pose.rig().is_same(rig) {
            return;
        }
        let (before, t) = self.locate(secs);
        let from = &self.poses[before];
        pose.coords_mut().copy_from_slice(from.coords());
        let Some(to) = self.poses.get(before + 1).filter(|_| t > 0.0) else { return };
        for joint in rig.ids() {
            let data = &rig.joints()[joint.index()];
            let mut way = [0.0; 6];
            let way = &mut way[..data.n_dofs()];
            from.difference_of(joint, to, way);
            if way.iter().any(|w| !w.is_finite()) {
                // No way leads there.
                pose.coords_mut().copy_from_slice(from.coords());
                return;
            }
            if !way.is_empty() {
                way.iter_mut().for_each(|w| *w *= t);
                retract_joint(&data.motion, &mut pose.coords_mut()[rig.coords_of(joint)], way);
            }
        }
    }

    /// The pose at or before a time, and how far on the time is towards the next one, from 0 to below 1.
    fn locate(&self, secs: f64) -> (usize, f64) {
        let after = self.times.partition_point(|t| *t <= secs);
        if after == 0 || after == self.times.len() {
            return (after.saturating_sub(1), 0.0);
        }
        let before = after - 1;
        (before, (secs - self.times[before]) / (self.times[after] - self.times[before]))
    }
}
