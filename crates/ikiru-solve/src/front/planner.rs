//! Planning: a motion problem and a guess in, a clip and a report out.

use std::borrow::Cow;

use ikiru_rig::{Clip, JointId, Pose, RateExcess};

use crate::front::options::check_options;
use crate::front::slower::slow_down;
use crate::front::solver::Solver;
use crate::layout::Layout;
use crate::method::limited::{exceeded, known_excess};
use crate::method::{Bar, Budget, Method};
use crate::model::{Model, Trajectory, TrajectoryMemory};
use crate::objective::{TermReads, Unfit};
use crate::problem::motion::MotionProblem;
use crate::report::explain::{Explainer, Unmet};
use crate::report::explain_motion::explain;
use crate::report::invalid::{Invalid, InvalidOptions, InvalidPose, InvalidTerm};
use crate::report::motion::report_terms;
use crate::report::{Report, TermReport};
use crate::search::{Searcher, TrajectoryStarts, TrajectoryStartsMemory};
use crate::state::motion::MotionState;
use crate::words::StopReason;
use crate::words::Watch;

/// A planned motion. It borrows from the workspace; [`into_owned`](Self::into_owned) keeps it.
#[derive(Clone, Debug)]
#[non_exhaustive]
pub struct PlannedMotion<'a> {
    /// The poses over time, one a sample of the timeline: given ones as they are, all others inside their limits. The
    /// guess itself where the input is invalid.
    pub clip: Cow<'a, Clip>,
    /// What came of planning it.
    pub report: Report<'a>,
}

impl PlannedMotion<'_> {
    /// The same, borrowing nothing.
    #[must_use]
    pub fn into_owned(self) -> PlannedMotion<'static> {
        PlannedMotion { clip: Cow::Owned(self.clip.into_owned()), report: self.report.into_owned() }
    }
}

/// Scratch memory for planning one motion at a time. A plan with a workspace that has seen a motion of the same shape does
/// not allocate, but for what limits on speed and acceleration need; one of another shape is laid out anew.
#[derive(Clone, Debug, Default)]
pub struct MotionWorkspace {
    layout: Layout,
    state: MotionState,
    memory: TrajectoryMemory,
    starts: TrajectoryStartsMemory,
    searcher: Searcher,
    /// The coordinates that a plan begins from.
    start: Vec<f64>,
    led: Vec<JointId>,
    reads: TermReads,
    /// The motion that was planned last; what does not move in it, and a sample that is looked at.
    clip: Option<Clip>,
    still: Option<Pose>,
    pose: Option<Pose>,
    terms: Vec<TermReport>,
    explainer: Explainer,
    unmet: Unmet,
    smoothness: Vec<f64>,
    exceeded: Vec<RateExcess>,
    watch: Watch,
}

impl MotionWorkspace {
    /// Has the plans to come watched, and forgets who watched before.
    pub fn watch(&mut self, watch: Watch) {
        self.watch = watch;
    }

    /// Checks a motion, and lays it out as far as it is another one than before.
    fn fit(&mut self, motion: &MotionProblem) -> Result<(), Invalid> {
        let unfit = |(term, unfit): (usize, Unfit)| Invalid::Term(term, unfit.into());
        motion.check_moving(&mut self.reads).map_err(unfit)?;
        motion.led(&mut self.led);
        if self.layout.signature.check(motion.terms(), &self.led).map_err(unfit)? {
            self.state.fit(&self.layout, motion);
        } else {
            self.layout = Layout::with(motion.terms(), &self.led).map_err(unfit)?;
            self.state = MotionState::new(&self.layout, motion);
            self.memory = TrajectoryMemory::new(&self.layout);
            self.starts = TrajectoryStartsMemory::new(&self.layout);
            self.explainer = Explainer::new(&self.layout);
            self.unmet = Unmet::new(self.layout.terms.len(), 0);
        }
        self.memory.fit(&self.layout, &self.state);
        self.searcher.fit(self.state.coords.len(), self.layout.n_dofs * self.state.n_samples);
        Ok(())
    }

    /// Takes over a guess and what is given; says whether a guess had to be moved inside its limits.
    fn load(&mut self, motion: &MotionProblem, guess: &Clip) -> Result<bool, Invalid> {
        let timeline = motion.timeline();
        if !guess.rig().is_same(motion.rig()) {
            return Err(Invalid::Pose(InvalidPose::OtherRig));
        }
        let kept = |pose: &mut Option<Pose>| {
            pose.take()
                .filter(|pose| pose.rig().is_same(motion.rig()))
                .unwrap_or_else(|| motion.rig().rest_pose())
        };
        let (mut still, mut pose) = (kept(&mut self.still), kept(&mut self.pose));
        match motion.first_given() {
            Some(given) => still.coords_mut().copy_from_slice(given.coords()),
            None => guess.sample_into(guess.times()[0], &mut still),
        }
        let clip = self.clip.take().filter(|clip| {
            let fits = clip.rig().is_same(motion.rig()) && clip.name() == guess.name();
            fits && timeline.are_times(clip.times())
        });
        let mut clip = clip.unwrap_or_else(|| {
            let poses = vec![still.clone(); timeline.n_samples()];
            // Times of a timeline increase, and there are as many poses of one rig.
            Clip::new(guess.name(), timeline.times(), poses).unwrap_or_else(|_| guess.clone())
        });
        let mut is_projected = false;
        for t in 0..timeline.n_samples() {
            let given = motion.given(t);
            match given {
                Some(given) => pose.coords_mut().copy_from_slice(given.coords()),
                None => guess.sample_into(timeline.time(t), &mut pose),
            }
            match self.state.load(&self.layout, t, &pose) {
                Some(projected) => is_projected |= projected,
                None => return Err(Invalid::Pose(InvalidPose::NotFinite)),
            }
            if given.is_some_and(|pose| motion.moves_others(&still, pose)) {
                return Err(Invalid::Pose(InvalidPose::GivenDiffer));
            }
            if let Some(coords) = clip.coords_mut(t) {
                coords.copy_from_slice(given.unwrap_or(&still).coords());
            }
        }
        // Terms read what does not move as all samples have it.
        self.state.load_still(&self.layout, &still);
        self.start.clone_from(&self.state.coords);
        (self.clip, self.still, self.pose) = (Some(clip), Some(still), Some(pose));
        Ok(is_projected)
    }
}

impl Solver {
    /// Plans a motion: improves a guess until the bar is met or a stopping rule says otherwise.
    ///
    /// The guess is taken at the times of the timeline and held still beyond its ends: a clip of one pose
    /// is a motion that stands still, the clip of an earlier plan a warm start. Samples that the problem gives take
    /// their place in it. Joints that are not active, and active ones that nothing moves, are in every sample as in the
    /// first one given, or as the guess has them at its first time. By [`Method::Lm`] or [`Method::Adam`].
    ///
    /// Invalid input ends at once with [`StopReason::InvalidInput`], the guess given back.
    pub fn plan<'w>(
        &self,
        motion: &MotionProblem,
        guess: &Clip,
        workspace: &'w mut MotionWorkspace,
    ) -> PlannedMotion<'w> {
        workspace.terms.clear();
        workspace.explainer.forces.clear();
        workspace.exceeded.clear();
        match self.plan_valid(motion, guess, workspace) {
            Ok(report) => {
                let MotionWorkspace { clip, terms, explainer, exceeded, .. } = workspace;
                let report = Report {
                    terms: Cow::Borrowed(terms),
                    forces: Cow::Borrowed(&explainer.forces),
                    exceeded: Cow::Borrowed(exceeded),
                    ..report
                };
                let clip = clip.as_ref().map_or_else(|| Cow::Owned(guess.clone()), Cow::Borrowed);
                PlannedMotion { clip, report }
            }
            Err(invalid) => {
                PlannedMotion { clip: Cow::Owned(guess.clone()), report: Report::invalid(invalid) }
            }
        }
    }

    fn plan_valid(
        &self,
        motion: &MotionProblem,
        guess: &Clip,
        workspace: &mut MotionWorkspace,
    ) -> Result<Report<'static>, Invalid> {
        self.check_motion(motion)?;
        workspace.fit(motion)?;
        let start_projected = workspace.load(motion, guess)?;
        let MotionWorkspace { layout, state, memory, starts, searcher, start, watch, terms, .. } = workspace;
        let (explainer, unmet) = (&mut workspace.explainer, &mut workspace.unmet);
        let Some(clip) = &mut workspace.clip else { return Err(Invalid::Pose(InvalidPose::NotFinite)) };
        let layout = &*layout;
        let mut budget = Budget::new(self.options(), watch);
        let settled_cost = state.settled_cost(layout, motion);
        let cost = state.evaluate(layout, motion);
        if let Some((term, reason)) = state.failure {
            return Err(Invalid::Term(term, InvalidTerm::GaveUp(reason)));
        }
        if !(cost + settled_cost + state.violation).is_finite() {
            return Err(match state.not_finite(layout, motion) {
                Some(term) => Invalid::Term(term, InvalidTerm::NotFiniteAtSample),
                None => Invalid::Pose(InvalidPose::Cost),
            });
        }
        if self.options().cost_below.is_none()
            && let Some(term) = state.conflict(layout, motion)
        {
            return Err(Invalid::Term(term, InvalidTerm::Settled));
        }
        // What given samples settle is no part of what a plan can bring down.
        let cost_below = self.options().cost_below.map(|bar| bar - settled_cost);
        let bar = Bar::new(cost_below, motion.terms(), self.options().search.max_restarts() > 0);
        let (start, is_rate_bound) = (&start[..], false);
        let model = Trajectory { layout, motion, state, memory, start, clip, is_rate_bound };
        let mut starts = TrajectoryStarts { model, memory: starts };
        let (outcome, restarts) = searcher.run(self.options(), bar, &mut starts, cost, &mut budget);
        let mut model = starts.model;
        let failure = model.state.failure.take();
        let mut cost = settled_cost + model.evaluate();
        if failure.is_some() {
            // What gave up once may give up again: the cost is what it was when this motion was found.
            (cost, model.state.failure) = (settled_cost + outcome.cost, None);
        }
        model.write_clip();
        let known = known_excess(&model).map(<[_]>::to_vec);
        let (smoothness, spacing) = (state.smoothness_cost, state.spacing_cost);
        report_terms(layout, motion, state, terms);
        let within = match self.options().cost_below {
            Some(bar) => cost < bar && terms.iter().all(|t| t.satisfied || !t.hard),
            None => terms.iter().all(|t| t.satisfied || !t.mandatory),
        };
        let hint = if within {
            None
        } else {
            explain(layout, motion, state, terms, (explainer, unmet), &mut workspace.smoothness)
        };
        workspace.exceeded = if motion.has_free_duration() {
            slow_down(motion, clip, terms, &budget)
        } else {
            known.unwrap_or_else(|| exceeded(motion, clip))
        };
        let success = within && workspace.exceeded.is_empty();
        let stop = match outcome.stop {
            _ if failure.is_some() => StopReason::ObjectiveFailed,
            _ if success => StopReason::Reached,
            // All that is wanted, but beyond a limit on rates.
            StopReason::Reached => StopReason::NoProgress,
            other => other,
        };
        Ok(Report {
            success,
            stop,
            cost,
            smoothness,
            spacing,
            iterations: budget.iterations,
            restarts,
            start_projected,
            hint,
            invalid: failure.map(|(term, reason)| Invalid::Term(term, InvalidTerm::GaveUp(reason))),
            ..Report::EMPTY
        })
    }

    fn check_motion(&self, motion: &MotionProblem) -> Result<(), Invalid> {
        check_options(self.options()).map_err(Invalid::Options)?;
        let is_adam = matches!(self.options().method, Method::Adam(_));
        let wrong = if !is_adam && self.options().method != Method::Lm {
            InvalidOptions::MethodOfPoses
        } else if is_adam && motion.holds_rates() {
            InvalidOptions::RateLimitsNeedLm
        } else if motion.has_free_duration() && motion.n_history() > 1 {
            InvalidOptions::FreeDurationWithHistory
        } else {
            return Ok(());
        };
        Err(Invalid::Options(wrong))
    }
}
