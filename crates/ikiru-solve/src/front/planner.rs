//! Planning: a motion problem and a guess in, a clip and a report out.

use std::borrow::Cow;

use ikiru_rig::{Clip, Pose, RateExcess};

use crate::front::course::{Told, check_start, conclude};
use crate::front::motion_layout::MotionLayout;
use crate::front::options::check_options;
use crate::front::slower::slow_down;
use crate::front::solver::Solver;
use crate::method::limited::{exceeded, known_excess};
use crate::method::{Bar, Budget, Clock, Method};
use crate::model::{Trajectory, TrajectoryMemory};
use crate::problem::motion::MotionProblem;
use crate::report::Report;
use crate::report::invalid::{Invalid, InvalidOptions, InvalidPose, InvalidTerm};
use crate::report::subject::MotionSubject;
use crate::search::{Searcher, TrajectoryStarts, TrajectoryStartsMemory};
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
/// not allocate, but for what limits on speed and acceleration need, and many joints over hundreds of samples; one of another
/// shape is laid out anew.
#[derive(Clone, Debug, Default)]
pub struct MotionWorkspace {
    laid_out: MotionLayout,
    memory: TrajectoryMemory,
    starts: TrajectoryStartsMemory,
    searcher: Searcher,
    /// The coordinates that a plan begins from.
    start: Vec<f64>,
    /// The motion that was planned last; what does not move in it, and a sample that is looked at.
    clip: Option<Clip>,
    still: Option<Pose>,
    pose: Option<Pose>,
    told: Told,
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
        let is_new = self.laid_out.fit(motion)?;
        let MotionLayout { layout, state, .. } = &self.laid_out;
        if is_new {
            self.memory = TrajectoryMemory::new(layout);
            self.starts = TrajectoryStartsMemory::new(layout);
            self.told = Told::new(layout);
        }
        self.memory.fit(layout, state);
        self.starts.fit(state);
        self.smoothness.resize(layout.n_dofs, 0.0);
        self.searcher.fit(state.coords.len(), layout.n_dofs * state.n_samples);
        self.told.unmet.fit(state.coords.len());
        Ok(())
    }

    /// Takes over a guess and what is given; says whether a guess had to be moved inside its limits.
    fn load(&mut self, motion: &MotionProblem, guess: &Clip) -> Result<bool, Invalid> {
        let timeline = motion.timeline();
        let MotionLayout { layout, state, .. } = &mut self.laid_out;
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
            match state.load(layout, t, &pose) {
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
        state.load_still(layout, &still);
        self.start.clone_from(&state.coords);
        self.told.unmet.begin(&self.start);
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
    /// Invalid input ends at once with [`StopReason::InvalidInput`](crate::StopReason::InvalidInput), the guess given back.
    pub fn plan<'w>(
        &self,
        motion: &MotionProblem,
        guess: &Clip,
        workspace: &'w mut MotionWorkspace,
    ) -> PlannedMotion<'w> {
        let clock = Clock::start(self.options().max_time);
        workspace.told.clear();
        workspace.exceeded.clear();
        match self.plan_on(clock, motion, guess, workspace) {
            Ok(report) => {
                let MotionWorkspace { clip, told, exceeded, .. } = workspace;
                let report = told.lend(Report { exceeded: Cow::Borrowed(exceeded), ..report });
                let clip = clip.as_ref().map_or_else(|| Cow::Owned(guess.clone()), Cow::Borrowed);
                PlannedMotion { clip, report }
            }
            Err(invalid) => {
                PlannedMotion { clip: Cow::Owned(guess.clone()), report: Report::invalid(invalid) }
            }
        }
    }

    fn plan_on(
        &self,
        clock: Clock,
        motion: &MotionProblem,
        guess: &Clip,
        workspace: &mut MotionWorkspace,
    ) -> Result<Report<'static>, Invalid> {
        self.check_motion(motion)?;
        workspace.fit(motion)?;
        let start_projected = workspace.load(motion, guess)?;
        let MotionWorkspace { laid_out, memory, starts, searcher, start, watch, told, smoothness, .. } =
            workspace;
        let MotionLayout { layout, state, .. } = laid_out;
        let (layout, exceeding) = (&*layout, &mut workspace.exceeded);
        let Some(clip) = &mut workspace.clip else { return Err(Invalid::Pose(InvalidPose::NotFinite)) };
        let mut budget = Budget::on(clock, self.options(), watch);
        let settled_cost = state.settled_cost(layout, motion);
        let cost = state.evaluate(layout, motion);
        let subject = &mut MotionSubject { layout, motion, state, settled_cost, smoothness };
        check_start(subject, settled_cost + cost)?;
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
        let found = searcher.run(self.options(), bar, &mut starts, cost, &mut budget);
        let mut model = starts.model;
        model.write_clip();
        let known = known_excess(&model).map(<[_]>::to_vec);
        let subject = &mut MotionSubject { layout, motion, state, settled_cost, smoothness };
        let report = conclude(subject, self.options(), found, budget.iterations, told, |told| {
            *exceeding = if motion.has_free_duration() {
                slow_down(motion, clip, told, &budget)
            } else {
                // To the end, whatever the budget says: a report that has not looked could only guess.
                known.unwrap_or_else(|| exceeded(motion, clip))
            };
            exceeding.is_empty()
        });
        let (smoothness, spacing) = (state.smoothness_cost, state.spacing_cost);
        Ok(Report { smoothness, spacing, start_projected, ..report })
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
