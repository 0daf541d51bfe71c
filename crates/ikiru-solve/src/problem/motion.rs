//! A motion problem: objectives at times, smoothness, and samples that are given.

use std::ops::Range;

use ikiru_rig::{Joint, JointId, JointMotion, Pose, RateLimit, Rig};

use crate::objective::{Objective, TermReads, Unfit, check_objective};
use crate::problem::MotionError;
use crate::problem::Timeline;
use crate::problem::When;
use crate::problem::term::{AnyObjective, TermId, Tolerance};
use crate::problem::track::{Track, n_earlier, reads_the_same};
use crate::problem::{Problem, check_joint};

/// Which joints may move, what is wanted when, how smooth the motion should be, and which samples are given.
///
/// A term that holds over a span says nothing of samples that are given. One whose samples are all given, and whose
/// tolerance their poses do not meet, is invalid.
///
/// The cost is `Σ λ ρ(r)` over all terms and the samples at which they hold, plus
/// `Σₙ wₙ Σₜ ‖Δⁿ qₜ‖²` for the orders 1 to 3 (equations 25 and 26). The differences are those from sample to sample, not
/// divided by time; those of balls and of a free root are differences of rotations.
#[derive(Clone, Debug)]
pub struct MotionProblem {
    pub(super) base: Problem,
    pub(super) timeline: Timeline,
    pub(super) tracks: Vec<Track>,
    smoothness: [f64; 3],
    of_joints: Vec<(JointId, [f64; 3])>,
    even_spacing: f64,
    at_rest: [bool; 2],
    /// Samples that are given, from the first on.
    pub(super) history: Vec<Pose>,
    pub(super) end: Option<Pose>,
    rate_limits: Vec<RateLimit>,
    free_duration: bool,
}

impl MotionProblem {
    /// A problem without terms in which the given joints may move, with smoothness weights of 0.001 for each
    /// order, as the paper's authors have them. All other joints stay where the guess has them.
    ///
    /// # Errors
    /// The first id that the rig does not have.
    pub fn new(
        rig: &Rig,
        active: impl IntoIterator<Item = JointId>,
        timeline: Timeline,
    ) -> Result<Self, MotionError> {
        Ok(Self::of_problem(Problem::new(rig, active)?, timeline))
    }

    /// A problem without terms in which every joint that has a degree of freedom may move, with the smoothness that
    /// [`new`](Self::new) gives.
    #[must_use]
    pub fn whole_body(rig: &Rig, timeline: Timeline) -> Self {
        Self::of_problem(Problem::whole_body(rig), timeline)
    }

    fn of_problem(base: Problem, timeline: Timeline) -> Self {
        Self {
            base,
            timeline,
            tracks: Vec::new(),
            smoothness: [0.001; 3],
            of_joints: Vec::new(),
            even_spacing: 0.0,
            at_rest: [false; 2],
            history: Vec::new(),
            end: None,
            rate_limits: Vec::new(),
            free_duration: false,
        }
    }

    /// The terms of a problem of single poses, each at its own time: `when` has one entry a term, and where it ends
    /// the rest hold at the last sample.
    ///
    /// # Errors
    /// A time that is not on the timeline, or a span that ends before it begins.
    pub fn from_problem(problem: Problem, timeline: Timeline, when: &[When]) -> Result<Self, MotionError> {
        let mut motion = Self::of_problem(problem, timeline);
        for term in 0..motion.base.terms().len() {
            let samples = when.get(term).copied().unwrap_or_default().samples(&timeline)?;
            let n_earlier = n_earlier(motion.rig(), motion.base.terms()[term].objective());
            motion.tracks.push(Track { samples, n_earlier, moving: Vec::new() });
        }
        Ok(motion)
    }

    /// The rig.
    #[must_use]
    pub fn rig(&self) -> &Rig {
        self.base.rig()
    }

    /// This motion on another rig of the same shape: other limits, other ways of its joints to move. Joints, terms
    /// and ids stay as they are, and so do the numbers of the samples that are given.
    ///
    /// # Errors
    /// The first joint whose name, parent or rest transform differs; where samples are given, one whose numbers mean
    /// something else on the other rig; a limit on a rate that the other rig does not have.
    pub fn with_rig(&self, rig: &Rig) -> Result<Self, MotionError> {
        let base = self.base.with_rig(rig)?;
        for limit in &self.rate_limits {
            limit.check(rig)?;
        }
        let carry = |pose: &Pose| {
            let mut joints = self.rig().joints().iter().zip(rig.joints());
            match joints.find(|(ours, theirs)| !moves_alike(ours, theirs)) {
                Some((joint, _)) => Err(MotionError::GivenMoves { joint: joint.name.clone() }),
                None => Pose::from_coords(rig, pose.coords()).map_err(|_| MotionError::Pose),
            }
        };
        let history = self.history.iter().map(carry).collect::<Result<_, _>>()?;
        let end = self.end.as_ref().map(carry).transpose()?;
        let mut tracks = self.tracks.clone();
        for (track, term) in tracks.iter_mut().zip(base.terms()) {
            track.n_earlier = n_earlier(rig, term.objective());
        }
        Ok(Self { base, tracks, history, end, ..self.clone() })
    }

    /// The timeline.
    #[must_use]
    pub fn timeline(&self) -> &Timeline {
        &self.timeline
    }

    /// The active joints and the terms, as a problem of a single pose: for weights, tolerances and lookups.
    #[must_use]
    pub fn terms(&self) -> &Problem {
        &self.base
    }

    /// Adds an objective with its weight λ, at a time, over a span or throughout.
    ///
    /// # Errors
    /// A time that is not on the timeline, or a span that ends before it begins.
    pub fn add<T: Objective + Clone>(
        &mut self,
        weight: f64,
        when: When,
        objective: T,
    ) -> Result<TermId<T>, MotionError> {
        let samples = when.samples(&self.timeline)?;
        let n_earlier = n_earlier(self.rig(), &objective);
        self.tracks.push(Track { samples, n_earlier, moving: Vec::new() });
        Ok(self.base.add(weight, objective))
    }

    /// Adds an objective as a constraint at a time, over a span or throughout: [hard](crate::Term::hard), within
    /// [`Tolerance::HARD`] at every sample.
    ///
    /// # Errors
    /// A time that is not on the timeline, or a span that ends before it begins.
    pub fn add_hard<T: Objective + Clone>(
        &mut self,
        when: When,
        objective: T,
    ) -> Result<TermId<T>, MotionError> {
        let id = self.add(1.0, when, objective)?;
        let term = self.term_mut(id);
        (term.hard, term.tolerance) = (true, Tolerance::HARD);
        Ok(id)
    }

    /// Adds an objective that moves in time: `at` gives it for each sample of the span (seconds), always with the
    /// same joints and parts. The objective that the id leads to is that of the first sample, for looking at.
    ///
    /// # Errors
    /// A time that is not on the timeline, or objectives that read different things at different times.
    pub fn add_moving<T: Objective + Clone>(
        &mut self,
        weight: f64,
        when: When,
        mut at: impl FnMut(f64) -> T,
    ) -> Result<TermId<T>, MotionError> {
        let samples = when.samples(&self.timeline)?;
        let first = at(self.timeline.time(samples.start));
        let moving = self.follow(&samples, &first, at)?;
        let n_earlier = n_earlier(self.rig(), &first);
        self.tracks.push(Track { samples, n_earlier, moving });
        Ok(self.base.add(weight, first))
    }

    /// Gives a term another objective at each of its samples, whether or not it moved before: a target that goes
    /// another way from now on. Weight, tolerance and span stay; one that stays still is changed by its id.
    ///
    /// # Errors
    /// Objectives that read other things than the term did; the term is then left as it was.
    pub fn set_moving<T: Objective + Clone>(
        &mut self,
        id: TermId<T>,
        mut at: impl FnMut(f64) -> T,
    ) -> Result<(), MotionError> {
        let (Some(at_term), Some(known)) = (self.base.position(id), self.base.get(id)) else {
            return Err(MotionError::Term);
        };
        let samples = self.tracks[at_term].samples.clone();
        let first = at(self.timeline.time(samples.start));
        if !reads_the_same(self.rig(), known, &first) {
            return Err(MotionError::Changes(self.timeline.time(samples.start)));
        }
        let moving = self.follow(&samples, &first, at)?;
        self.tracks[at_term].moving = moving;
        self.base[id] = first;
        Ok(())
    }

    /// The objective of every sample, all of which read what `first` does.
    fn follow<T: Objective + Clone>(
        &self,
        samples: &Range<usize>,
        first: &T,
        mut at: impl FnMut(f64) -> T,
    ) -> Result<Vec<Box<dyn AnyObjective>>, MotionError> {
        let mut moving: Vec<Box<dyn AnyObjective>> = Vec::with_capacity(samples.len());
        for sample in samples.clone() {
            let secs = self.timeline.time(sample);
            let objective = at(secs);
            if !reads_the_same(self.rig(), first, &objective) {
                return Err(MotionError::Changes(secs));
            }
            moving.push(Box::new(objective));
        }
        Ok(moving)
    }

    /// Weights of smoothness, for the orders 1 (velocity), 2 (acceleration) and 3 (jerk), of every joint without
    /// its own.
    ///
    /// # Errors
    /// A weight that is not finite or below 0.
    pub fn set_smoothness(&mut self, weights: [f64; 3]) -> Result<(), MotionError> {
        check_weights(weights)?;
        self.smoothness = weights;
        Ok(())
    }

    /// Weights of smoothness of one joint, for the orders 1 to 3, in the place of those that
    /// [all others](Self::set_smoothness) have.
    ///
    /// # Errors
    /// A joint that the rig does not have; a weight that is not finite or below 0.
    pub fn set_joint_smoothness(&mut self, joint: JointId, weights: [f64; 3]) -> Result<(), MotionError> {
        check_joint(self.rig(), joint)?;
        check_weights(weights)?;
        self.of_joints.push((joint, weights));
        Ok(())
    }

    /// The weight of even spacing: `w Σₜ (ℓₜ − ℓ̄)²`, where `ℓₜ` is the length of the step to the next sample over all
    /// degrees of freedom (radians and metres) and `ℓ̄` the mean of all steps. Key poses far apart then take longer to
    /// go between than near ones. The default is 0: lengths are not compared.
    ///
    /// # Errors
    /// A weight that is not finite or below 0.
    pub fn set_even_spacing(&mut self, weight: f64) -> Result<(), MotionError> {
        if !(weight.is_finite() && weight >= 0.0) {
            return Err(MotionError::EvenSpacing(weight));
        }
        self.even_spacing = weight;
        Ok(())
    }

    /// Whether the body stands still before the first and after the last sample. If so, getting into motion and coming to
    /// a stop count for acceleration and jerk as they do in between: the motion sets in and ends softly. The
    /// default is false for both: a motion then begins and ends at any speed.
    pub fn set_at_rest(&mut self, start: bool, end: bool) {
        self.at_rest = [start, end];
    }

    /// Whether the body stands still before the first and after the last sample.
    #[must_use]
    pub fn at_rest(&self) -> [bool; 2] {
        self.at_rest
    }

    /// The weight of even spacing.
    #[must_use]
    pub fn even_spacing(&self) -> f64 {
        self.even_spacing
    }

    /// The problem of the pose at one sample: the terms that hold there, under the same ids, with the targets that they
    /// have there; smoothness, given samples and limits on rates are no part of it. Beyond the last sample it
    /// has no terms.
    #[must_use]
    pub fn at(&self, sample: usize) -> Problem {
        let mut problem = self.base.clone();
        problem.keep(|term| {
            let track = &self.tracks[term];
            let moved = track.moving.get(sample.wrapping_sub(track.samples.start));
            // What reads other samples too is no part of a single pose.
            let holds = track.holds(sample) && track.n_earlier == 0;
            holds.then(|| moved.unwrap_or(&self.base.terms()[term].objective).clone())
        });
        problem
    }

    /// The first sample is this pose.
    ///
    /// # Errors
    /// A pose of another rig or with numbers that are not finite.
    pub fn fix_start(&mut self, pose: &Pose) -> Result<(), MotionError> {
        self.fix_history(std::slice::from_ref(pose))
    }

    /// The first samples are these poses, which have been executed: the motion goes on from them without a kick,
    /// since smoothness counts them too. None leaves the first sample free.
    ///
    /// # Errors
    /// More samples than the timeline leaves, poses of another rig or with numbers that are not finite.
    pub fn fix_history(&mut self, poses: &[Pose]) -> Result<(), MotionError> {
        self.check_given(poses.len(), "start", usize::from(self.end.is_some()))?;
        for pose in poses {
            self.check_pose(pose)?;
        }
        self.history = poses.to_vec();
        Ok(())
    }

    /// The last sample is this pose; `None` leaves it free.
    ///
    /// # Errors
    /// No sample left for it, a pose of another rig or with numbers that are not finite.
    pub fn fix_end(&mut self, pose: Option<&Pose>) -> Result<(), MotionError> {
        if let Some(pose) = pose {
            self.check_given(1, "end", self.history.len())?;
            self.check_pose(pose)?;
        }
        self.end = pose.cloned();
        Ok(())
    }

    /// Limits on the speed and acceleration of joints, in the place of those before. They are hard: they hold
    /// anywhere on the curve of [`Clip::sample_cubic`](ikiru_rig::Clip::sample_cubic), between samples too, and what
    /// cannot be reached in time is missed. Where no motion was found that keeps them, they are exceeded, and the
    /// [report](crate::Report::exceeded) says why that can be, and names joint and time.
    ///
    /// Needs [`Method::Lm`](crate::Method::Lm), unless the [duration is free](Self::set_free_duration).
    ///
    /// # Errors
    /// A limit on what the rig does not have, on a jerk, or that is not a finite number above 0.
    pub fn set_rate_limits(&mut self, limits: &[RateLimit]) -> Result<(), MotionError> {
        for limit in limits {
            limit.check(self.rig())?;
        }
        self.rate_limits = limits.to_vec();
        Ok(())
    }

    /// Whether the motion may take longer than its timeline: it is then planned as if nothing limited speed and
    /// acceleration, and slowed down afterwards where limits ask for it. Its poses stay the same, their times come
    /// later and at uneven distances, and the report has the new ones. Not with a history of more than one sample, whose
    /// times have been. The default is false.
    pub fn set_free_duration(&mut self, is_free: bool) {
        self.free_duration = is_free;
    }

    /// Whether the motion may take longer than its timeline.
    #[must_use]
    pub fn has_free_duration(&self) -> bool {
        self.free_duration
    }

    /// The limits on speed and acceleration.
    #[must_use]
    pub fn rate_limits(&self) -> &[RateLimit] {
        &self.rate_limits
    }

    /// Whether limits on rates are to be held at the times of the timeline.
    pub(crate) fn holds_rates(&self) -> bool {
        !self.free_duration && !self.rate_limits.is_empty()
    }

    fn check_given(&self, given: usize, side: &'static str, taken: usize) -> Result<(), MotionError> {
        let n_samples = self.timeline.n_samples();
        // A motion of given samples alone has nothing to plan.
        if given + taken >= n_samples {
            return Err(MotionError::GivenSamples { given, side, n_samples, taken });
        }
        Ok(())
    }

    fn check_pose(&self, pose: &Pose) -> Result<(), MotionError> {
        if !pose.rig().is_same(self.rig()) {
            return Err(MotionError::OtherRig);
        }
        if pose.is_valid() { Ok(()) } else { Err(MotionError::Pose) }
    }

    pub(crate) fn tracks(&self) -> &[Track] {
        &self.tracks
    }

    /// The weights of smoothness of a joint.
    pub(crate) fn smoothness_of(&self, joint: JointId) -> [f64; 3] {
        self.of_joints
            .iter()
            .rev()
            .find(|(j, _)| *j == joint)
            .map_or(self.smoothness, |(_, weights)| *weights)
    }

    /// The first term that moves whose numbers are wrong at some sample, and what is wrong.
    pub(crate) fn check_moving(&self, reads: &mut TermReads) -> Result<(), (usize, Unfit)> {
        for (idx, track) in self.tracks.iter().enumerate() {
            for objective in &track.moving {
                check_objective(self.rig(), &**objective, reads).map_err(|unfit| (idx, unfit))?;
            }
        }
        Ok(())
    }
}

/// Whether the numbers of one joint's pose mean the same for another, whatever its limits.
fn moves_alike(a: &Joint, b: &Joint) -> bool {
    let motion = match (a.motion, b.motion) {
        (JointMotion::Hinge { axis: a, .. }, JointMotion::Hinge { axis: b, .. })
        | (JointMotion::Slider { axis: a, .. }, JointMotion::Slider { axis: b, .. }) => a == b,
        (JointMotion::Euler { order: a, .. }, JointMotion::Euler { order: b, .. }) => a == b,
        (
            JointMotion::Fixed
            | JointMotion::Hinge { .. }
            | JointMotion::Slider { .. }
            | JointMotion::Euler { .. }
            | JointMotion::Ball { .. }
            | JointMotion::Free { .. },
            _,
        ) => std::mem::discriminant(&a.motion) == std::mem::discriminant(&b.motion),
    };
    motion && a.mimic == b.mimic
}

fn check_weights(weights: [f64; 3]) -> Result<(), MotionError> {
    let is_good = weights.iter().all(|w| w.is_finite() && *w >= 0.0);
    if is_good { Ok(()) } else { Err(MotionError::Smoothness(weights)) }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::objectives::Position;
    use ikiru_testkit::rigs::random_rig;

    #[test]
    fn a_term_is_settled_where_all_its_samples_are_given() {
        let rig = random_rig(3, 1);
        let rest = rig.rest_pose();
        let timeline = Timeline::points(4).unwrap();
        let n_samples = timeline.n_samples();
        let (mut n_settled, mut n_open) = (0, 0);
        for n_history in 0..n_samples - 1 {
            for end in [None, Some(&rest)] {
                let mut motion = MotionProblem::whole_body(&rig, timeline);
                motion.fix_history(&vec![rest.clone(); n_history]).unwrap();
                motion.fix_end(end).unwrap();
                for from in 0..n_samples {
                    for to in from..n_samples {
                        let when = When::Span { from: timeline.time(from), to: timeline.time(to) };
                        let target = Position::new(JointId::from_index(0), glam::DVec3::ZERO);
                        let id = motion.add(1.0, when, target).unwrap();
                        let term = motion.base.position(id).unwrap();
                        let is_given = (from..=to).all(|sample| motion.given(sample).is_some());
                        assert_eq!(motion.is_settled(term), is_given, "{n_history} given, {from} to {to}");
                        *(if is_given { &mut n_settled } else { &mut n_open }) += 1;
                    }
                }
            }
        }
        assert!(n_settled > 20 && n_open > 20, "{n_settled}, {n_open}");
    }
}
