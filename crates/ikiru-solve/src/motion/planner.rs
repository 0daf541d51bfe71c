//! Planning: a motion problem and a guess in, a clip and a report out.

use ikiru_rig::{Clip, JointId, Pose};

use crate::layout::Layout;
use crate::model::{Model, Trajectory, TrajectoryMemory};
use crate::motion::explain::explain;
use crate::motion::limited::exceeded;
use crate::motion::problem::MotionProblem;
use crate::motion::report::{MotionReport, report_terms};
use crate::motion::slower::slow_down;
use crate::motion::state::MotionState;
use crate::options::Method;
use crate::report::{Invalid, StopReason};
use crate::search::{Bar, Budget, Searcher};
use crate::solver::Solver;
use crate::watch::Watch;

/// A planned motion.
#[derive(Clone, Debug)]
pub struct PlannedMotion {
    /// The poses over time, one a sample of the timeline: given ones as they are, all others inside their limits. The
    /// guess itself where the input is invalid.
    pub clip: Clip,
    /// What came of planning it.
    pub report: MotionReport,
}

/// Scratch memory for planning one motion at a time.
#[derive(Clone, Debug, Default)]
pub struct MotionWorkspace {
    layout: Layout,
    state: MotionState,
    memory: TrajectoryMemory,
    searcher: Searcher,
    /// The coordinates that a plan begins from.
    start: Vec<f64>,
    led: Vec<JointId>,
    watch: Watch,
}

impl MotionWorkspace {
    /// Has the plans to come watched, and forgets who watched before.
    pub fn watch(&mut self, watch: Watch) {
        self.watch = watch;
    }

    /// Checks a motion, and lays it out as far as it is another one than before.
    fn fit(&mut self, motion: &MotionProblem) -> Result<(), Invalid> {
        let unfit = |(term, unfit)| Invalid::Term(term, unfit);
        motion.check().map_err(unfit)?;
        motion.led(&mut self.led);
        if !self.layout.signature.check(motion.terms(), &self.led).map_err(unfit)? {
            self.layout = Layout::with(motion.terms(), &self.led).map_err(unfit)?;
            self.state = MotionState::new(&self.layout, motion);
            self.memory = TrajectoryMemory::new(&self.layout);
            self.searcher = Searcher::default();
        } else {
            self.state.fit(&self.layout, motion);
        }
        self.memory.fit(&self.layout, &self.state);
        self.searcher.fit(self.state.coords.len(), self.layout.n_dofs * self.state.n_samples);
        Ok(())
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
    pub fn plan(
        &self,
        motion: &MotionProblem,
        guess: &Clip,
        workspace: &mut MotionWorkspace,
    ) -> PlannedMotion {
        self.plan_valid(motion, guess, workspace).unwrap_or_else(|invalid| PlannedMotion {
            clip: guess.clone(),
            report: MotionReport::invalid(invalid),
        })
    }

    fn plan_valid(
        &self,
        motion: &MotionProblem,
        guess: &Clip,
        workspace: &mut MotionWorkspace,
    ) -> Result<PlannedMotion, Invalid> {
        self.check_motion(motion)?;
        workspace.fit(motion)?;
        let mut clip = workspace.load(motion, guess)?;
        let MotionWorkspace { layout, state, memory, searcher, start, watch, .. } = workspace;
        let layout = &*layout;
        let mut budget = Budget::new(self.options(), watch);
        let settled_cost = state.settled_cost(layout, motion);
        let cost = state.evaluate(layout, motion);
        if !(cost + settled_cost + state.violation).is_finite() && state.failure.is_none() {
            return Err(match state.not_finite(layout, motion) {
                Some(term) => {
                    Invalid::Term(term, "gives a residual that is not finite at one of its samples".into())
                }
                None => Invalid::Pose("gives a cost that is not finite"),
            });
        }
        if let Some((term, reason)) = state.failure {
            return Err(Invalid::Term(term, reason.into()));
        }
        if self.options().cost_below.is_none()
            && let Some(term) = state.conflict(layout, motion)
        {
            let conflict = "holds at given samples alone, and their poses do not meet it: \
                give it another time, or leave those samples free";
            return Err(Invalid::Term(term, conflict.into()));
        }
        // What given samples settle is no part of what a plan can bring down.
        let cost_below = self.options().cost_below.map(|bar| bar - settled_cost);
        let bar = Bar::new(cost_below, motion.terms(), self.options().search.max_restarts() > 0);
        let (start, is_rate_bound) = (&start[..], false);
        let mut model = Trajectory { layout, motion, state, memory, start, clip: &mut clip, is_rate_bound };
        let (outcome, restarts) = searcher.run(self.options(), bar, &mut model, cost, &mut budget);
        let failure = model.state.failure.take();
        let mut cost = settled_cost + model.evaluate();
        if failure.is_some() {
            // What gave up once may give up again: the cost is what it was when this motion was found.
            (cost, model.state.failure) = (settled_cost + outcome.cost, None);
        }
        model.to_clip();
        let (smoothness, spacing) = (state.smoothness_cost, state.spacing_cost);
        let mut terms = report_terms(layout, motion, state);
        let within = match self.options().cost_below {
            Some(bar) => cost < bar && terms.iter().all(|t| t.satisfied || !t.hard),
            None => terms.iter().all(|t| t.satisfied || !t.mandatory),
        };
        let (forces, hint) = if within { (Vec::new(), None) } else { explain(layout, motion, state, &terms) };
        let exceeded = if motion.has_free_duration() {
            let exceeded;
            (clip, exceeded) = slow_down(motion, clip, &mut terms);
            exceeded
        } else {
            exceeded(motion, &clip)
        };
        let success = within && exceeded.is_empty();
        let stop = match outcome.stop {
            _ if failure.is_some() => StopReason::ObjectiveFailed,
            _ if success => StopReason::Reached,
            // All that is wanted, but beyond a limit on rates.
            StopReason::Reached => StopReason::NoProgress,
            other => other,
        };
        let report = MotionReport {
            success,
            stop,
            cost,
            smoothness,
            spacing,
            iterations: budget.iterations,
            restarts,
            terms,
            forces,
            hint,
            exceeded,
            invalid: failure.map(|(term, reason)| Invalid::Term(term, reason.into())),
        };
        Ok(PlannedMotion { clip, report })
    }

    fn check_motion(&self, motion: &MotionProblem) -> Result<(), Invalid> {
        self.options().check().map_err(Invalid::Options)?;
        if !matches!(self.options().method, Method::Lm | Method::Adam(_)) {
            return Err(Invalid::Options("plan motions by lm or adam: the other methods know poses alone"));
        }
        if matches!(self.options().method, Method::Adam(_)) && motion.holds_rates() {
            let reason = "limits on speed and acceleration of a fixed duration need the method lm: \
                adam knows them only where the duration is free";
            return Err(Invalid::Options(reason));
        }
        if motion.has_free_duration() && motion.n_history() > 1 {
            let reason = "a free duration gives all samples new times, those of a history too: \
                fix one first sample, or the duration";
            return Err(Invalid::Options(reason));
        }
        Ok(())
    }
}

impl MotionWorkspace {
    /// Takes over a guess and what is given; the answer is the motion as it begins, as a clip.
    fn load(&mut self, motion: &MotionProblem, guess: &Clip) -> Result<Clip, Invalid> {
        let timeline = motion.timeline();
        let start_of = |clip: &Clip| clip.sample(clip.times().first().copied().unwrap_or_default());
        let still = motion.first_given().map_or_else(|| start_of(guess), Pose::clone);
        let mut poses = Vec::with_capacity(timeline.n_samples());
        for t in 0..timeline.n_samples() {
            let given = motion.given(t);
            let pose = given.map_or_else(|| guess.sample(timeline.time(t)), Pose::clone);
            if !pose.rig().is_same(motion.rig()) {
                return Err(Invalid::Pose("belongs to another rig than the motion"));
            }
            if !self.state.load(&self.layout, t, &pose) {
                let reason = "has numbers that are not finite, or quaternions that are not of unit length";
                return Err(Invalid::Pose(reason));
            }
            if given.is_some_and(|pose| motion.moves_others(&still, pose)) {
                let reason = "and the given samples differ in joints that are not active: make those active, or give them alike";
                return Err(Invalid::Pose(reason));
            }
            poses.push(given.unwrap_or(&still).clone());
        }
        // Terms read what does not move as all samples have it.
        self.state.load_still(&self.layout, &still);
        self.start.clone_from(&self.state.coords);
        // Times of a timeline increase, and there are as many poses of one rig.
        Ok(Clip::new(guess.name(), timeline.times(), poses).unwrap_or_else(|_| guess.clone()))
    }
}
