//! Planning: a motion problem and a guess in, a clip and a report out.

use ikiru_rig::{Clip, Pose};

use crate::layout::Layout;
use crate::motion::adam::MotionAdam;
use crate::motion::explain::explain;
use crate::motion::problem::MotionProblem;
use crate::motion::report::{MotionReport, report_terms};
use crate::motion::state::MotionState;
use crate::motion::step::MotionStep;
use crate::options::{Method, Search};
use crate::report::{Invalid, StopReason};
use crate::solver::Solver;
use crate::solvers::search::{Bar, Budget, HELD};
use crate::solvers::seeds::Seeds;

/// How many starts are looked at for each restart; the cheapest is taken.
const SCREENED: usize = 3;

/// Most restarts of a motion that limits on rates keep from what it reaches without them.
const MOST_RATE_BOUND: usize = 2;

/// A planned motion.
#[derive(Clone, Debug)]
pub struct PlannedMotion {
    /// The poses over time, one a sample of the timeline: given ones as they are, all others inside their limits. The
    /// guess itself where the input is invalid.
    pub clip: Clip,
    /// What came of planning it.
    pub report: MotionReport,
}

/// Scratch memory for planning. It is laid out anew for every plan: unlike a warm solve of a pose, a plan allocates.
#[derive(Clone, Debug, Default)]
pub struct MotionWorkspace {
    pub(super) step: MotionStep,
    adam: MotionAdam,
    pub(super) accepted: Vec<f64>,
    pub(super) first_try: Vec<f64>,
    pub(super) residual: Vec<f64>,
    pub(super) guards: Vec<f64>,
    pub(super) start: Vec<f64>,
    best: Vec<f64>,
}

/// What came of one start.
#[derive(Clone, Copy, Debug)]
pub(super) struct Outcome {
    /// Of the motion, without limits on rates; infinite where those do not hold.
    pub(super) cost: f64,
    /// By how much hard rows are missed.
    pub(super) violation: f64,
    pub(super) stop: StopReason,
    /// Whether all that is wanted was met as if nothing limited rates: another start hardly helps then.
    pub(super) is_rate_bound: bool,
    /// Whether it was measured to keep all limits on rates.
    pub(super) keeps_rates: bool,
}

impl Outcome {
    pub(super) fn new(cost: f64, violation: f64, stop: StopReason) -> Self {
        Self { cost, violation, stop, is_rate_bound: false, keeps_rates: false }
    }

    /// Whether it is better than another one: limits on rates come first, then what is hard.
    fn is_better(&self, other: &Self) -> bool {
        let (own, others) = (self.violation.max(HELD), other.violation.max(HELD));
        match (self.cost.is_finite(), other.cost.is_finite()) {
            (true, true) if own != others => own < others,
            _ => self.cost < other.cost,
        }
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
        match Run::new(self, motion, guess, workspace) {
            Ok(mut run) => run.plan(),
            Err(invalid) => PlannedMotion { clip: guess.clone(), report: MotionReport::invalid(invalid) },
        }
    }
}

/// One call of [`Solver::plan`].
pub(super) struct Run<'a> {
    solver: &'a Solver,
    pub(super) motion: &'a MotionProblem,
    /// What does not move is in every sample as it is here.
    still: Pose,
    guess: &'a Clip,
    pub(super) layout: Layout,
    pub(super) state: MotionState,
    pub(super) workspace: &'a mut MotionWorkspace,
    pub(super) budget: Budget,
    /// What the terms cost that given samples settle.
    settled_cost: f64,
}

/// The first pose of a clip.
fn start_of(clip: &Clip) -> Pose {
    clip.sample(clip.times().first().copied().unwrap_or_default())
}

impl<'a> Run<'a> {
    fn new(
        solver: &'a Solver,
        motion: &'a MotionProblem,
        guess: &'a Clip,
        workspace: &'a mut MotionWorkspace,
    ) -> Result<Self, Invalid> {
        solver.options().check().map_err(Invalid::Options)?;
        if !matches!(solver.options().method, Method::Lm | Method::Adam(_)) {
            return Err(Invalid::Options("plan motions by lm or adam: the other methods know poses alone"));
        }
        if matches!(solver.options().method, Method::Adam(_)) && motion.holds_rates() {
            let reason = "limits on speed and acceleration of a fixed duration need the method lm: \
                adam knows them only where the duration is free";
            return Err(Invalid::Options(reason));
        }
        if motion.has_free_duration() && motion.n_history() > 1 {
            let reason = "a free duration gives all samples new times, those of a history too: \
                fix one first sample, or the duration";
            return Err(Invalid::Options(reason));
        }
        let unfit = |(term, unfit)| Invalid::Term(term, unfit);
        motion.check().map_err(unfit)?;
        let budget = Budget::new(solver.options());
        let layout = Layout::with(motion.terms(), &motion.led()).map_err(unfit)?;
        let mut state = MotionState::new(&layout, motion);
        let timeline = motion.timeline();
        let still = motion.first_given().map_or_else(|| start_of(guess), Pose::clone);
        for t in 0..timeline.n_samples() {
            let pose = motion.given(t).map_or_else(|| guess.sample(timeline.time(t)), Pose::clone);
            if !pose.rig().is_same(motion.rig()) {
                return Err(Invalid::Pose("belongs to another rig than the motion"));
            }
            if !state.load(&layout, t, &pose) {
                let reason = "has numbers that are not finite, or quaternions that are not of unit length";
                return Err(Invalid::Pose(reason));
            }
        }
        if (0..timeline.n_samples())
            .filter_map(|t| motion.given(t))
            .any(|pose| motion.moves_others(&still, pose))
        {
            let reason = "and the given samples differ in joints that are not active: make those active, or give them alike";
            return Err(Invalid::Pose(reason));
        }
        // Terms read what does not move as all samples have it.
        state.sample.load(&layout, &still);
        workspace.step = MotionStep::new(&layout, &state);
        workspace.adam = MotionAdam::new(&layout, &state);
        workspace.accepted.clone_from(&state.coords);
        workspace.first_try.clone_from(&state.coords);
        workspace.start.clone_from(&state.coords);
        workspace.best.clone_from(&state.coords);
        Ok(Self { solver, motion, still, guess, layout, state, workspace, budget, settled_cost: 0.0 })
    }

    fn plan(&mut self) -> PlannedMotion {
        self.settled_cost = self.state.settled_cost(&self.layout, self.motion);
        let cost = self.state.evaluate(&self.layout, self.motion);
        if !(cost + self.settled_cost + self.state.violation).is_finite() {
            let invalid = match self.state.not_finite(&self.layout, self.motion) {
                Some(term) => {
                    Invalid::Term(term, "gives a residual that is not finite at one of its samples".into())
                }
                None => Invalid::Pose("gives a cost that is not finite"),
            };
            return self.refuse(invalid);
        }
        if let Some((term, reason)) = self.state.sample.memory.failure {
            return self.refuse(Invalid::Term(term, reason.into()));
        }
        if self.solver.options().cost_below.is_none()
            && let Some(term) = self.state.conflict(&self.layout, self.motion)
        {
            let conflict = "holds at given samples alone, and their poses do not meet it: \
                give it another time, or leave those samples free";
            return self.refuse(Invalid::Term(term, conflict.into()));
        }
        let (outcome, restarts) = self.search(cost);
        let failure = self.state.sample.memory.failure.take();
        let mut cost = self.settled_cost + self.state.evaluate(&self.layout, self.motion);
        if failure.is_some() {
            // What gave up once may give up again: the cost is what it was when this motion was found.
            cost = self.settled_cost + outcome.cost;
            self.state.sample.memory.failure = None;
        }
        let (smoothness, spacing) = (self.state.smoothness_cost, self.state.spacing_cost);
        let mut terms = report_terms(&self.layout, self.motion, &mut self.state);
        let within = match self.solver.options().cost_below {
            Some(bar) => cost < bar && terms.iter().all(|t| t.satisfied || !t.hard),
            None => terms.iter().all(|t| t.satisfied || !t.mandatory),
        };
        let (forces, hint) = if within {
            (Vec::new(), None)
        } else {
            explain(&self.layout, self.motion, &mut self.state, &terms)
        };
        let mut clip = self.clip();
        let exceeded;
        if self.motion.has_free_duration() {
            (clip, exceeded) = self.slow_down(clip, &mut terms);
        } else if outcome.keeps_rates {
            exceeded = Vec::new();
        } else {
            exceeded = self.exceeded(&clip);
        }
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
            iterations: self.budget.iterations,
            restarts,
            terms,
            forces,
            hint,
            exceeded,
            invalid: failure.map(|(term, reason)| Invalid::Term(term, reason.into())),
        };
        PlannedMotion { clip, report }
    }

    fn refuse(&self, invalid: Invalid) -> PlannedMotion {
        PlannedMotion { clip: self.guess.clone(), report: MotionReport::invalid(invalid) }
    }

    /// The motion in the state as a clip.
    pub(super) fn clip(&mut self) -> Clip {
        let timeline = self.motion.timeline();
        let poses = (0..timeline.n_samples())
            .map(|t| {
                let mut pose = self.motion.given(t).unwrap_or(&self.still).clone();
                self.state.store(&self.layout, t, &mut pose);
                pose
            })
            .collect();
        // Times of a timeline increase, and there are as many poses of one rig.
        Clip::new(self.guess.name(), timeline.times(), poses).unwrap_or_else(|_| self.guess.clone())
    }

    /// From the guess, then from others until one succeeds; the best motion is in the state afterwards.
    fn search(&mut self, cost: f64) -> (Outcome, usize) {
        let options = self.solver.options();
        let max_restarts = match options.search {
            Search::Local => 0,
            Search::Global { max_restarts } => max_restarts,
        };
        let mut bar = Bar::new(self.cost_below(), self.motion.terms(), max_restarts > 0);
        let mut best = self.run_once(cost, &bar);
        let mut success = self.succeeded(&best);
        if max_restarts == 0 || success {
            return (best, 0);
        }
        self.workspace.best.copy_from_slice(&self.state.coords);
        let seeds = Seeds::new(&self.layout);
        let mut restarts = 0;
        let max_restarts = if best.is_rate_bound { max_restarts.min(MOST_RATE_BOUND) } else { max_restarts };
        while !success && restarts < max_restarts && !best.stop.is_final() {
            self.budget.next_start();
            let cost = self.screen(&seeds, bar.largest_weight, restarts);
            restarts += 1;
            let outcome = self.run_once(cost, &bar);
            success = self.succeeded(&outcome);
            if success || outcome.is_better(&best) {
                best = outcome;
                self.workspace.best.copy_from_slice(&self.state.coords);
            } else if outcome.stop.is_final() {
                best.stop = outcome.stop;
            }
        }
        self.state.coords.copy_from_slice(&self.workspace.best);
        if !success && !best.stop.is_final() {
            // Starts were given up while others waited: the best of them is now followed to its end.
            let cost = self.state.evaluate(&self.layout, self.motion);
            bar.impatient = false;
            self.budget.next_start();
            let again = self.run_once(cost, &bar);
            if !best.is_better(&again) {
                best = again;
            } else {
                self.state.coords.copy_from_slice(&self.workspace.best);
            }
        }
        (best, restarts)
    }

    /// The cost that is to be undercut by what is not settled.
    fn cost_below(&self) -> Option<f64> {
        self.solver.options().cost_below.map(|bar| bar - self.settled_cost)
    }

    pub(super) fn succeeded(&mut self, outcome: &Outcome) -> bool {
        match self.cost_below() {
            Some(bar) => outcome.cost < bar && self.state.holds(&self.layout, self.motion),
            None => outcome.cost.is_finite() && self.state.is_satisfied(&self.layout, self.motion),
        }
    }

    /// Looks at some other motions, each through other poses at the keys and straight in between, and leaves the
    /// cheapest in the state, evaluated.
    fn screen(&mut self, seeds: &Seeds, largest_weight: f64, restart: usize) -> f64 {
        let mut best = (f64::INFINITY, 0);
        for i in 0..SCREENED {
            self.seed(seeds, restart * SCREENED + i);
            let cost = self.state.evaluate(&self.layout, self.motion) + largest_weight * self.state.violation;
            if cost < best.0 || i == 0 {
                best = (cost, i);
            }
        }
        self.seed(seeds, restart * SCREENED + best.1);
        self.state.evaluate(&self.layout, self.motion)
    }

    /// Poses of the sequence at the keys, the straight way between them and what is given, in the state.
    fn seed(&mut self, seeds: &Seeds, idx: usize) {
        let nc = self.layout.n_coords;
        self.state.coords.copy_from_slice(&self.workspace.start);
        let last = self.state.n_samples - 1;
        // Runs of keyed samples share one pose: the seed of their number.
        let mut anchors: Vec<usize> = (0..=last).filter(|t| self.state.is_given[*t]).collect();
        let mut n_runs = 0;
        let mut before = None;
        for i in 0..self.state.keyed.len() {
            let t = self.state.keyed[i];
            let follows = before.is_some_and(|b: usize| b + 1 == t);
            if !follows {
                n_runs += 1;
            }
            before = Some(t);
            if self.state.is_given[t] {
                continue;
            }
            let start = self.workspace.start[t * nc..(t + 1) * nc].to_vec();
            let number = idx + (n_runs - 1) * 17;
            seeds.write(&self.layout, number, &start, &mut self.state.coords[t * nc..(t + 1) * nc]);
            anchors.push(t);
        }
        anchors.sort_unstable();
        anchors.dedup();
        for pair in anchors.windows(2) {
            self.state.interpolate(&self.layout, pair[0], pair[1]);
        }
        // Before the first and after the last there is nowhere to go.
        if let (Some(&first), Some(&end)) = (anchors.first(), anchors.last()) {
            for t in (0..first).chain(end + 1..=last) {
                let from = if t < first { first } else { end };
                self.state.coords.copy_within(from * nc..(from + 1) * nc, t * nc);
            }
        }
    }

    fn run_once(&mut self, cost: f64, bar: &Bar) -> Outcome {
        match &self.solver.options().method {
            Method::Adam(options) => {
                let adam = &mut self.workspace.adam;
                adam.run(options, &self.layout, self.motion, &mut self.state, cost, bar, &mut self.budget)
            }
            _ if self.holds_rates() => self.run_limited(cost, bar),
            _ => self.run_unlimited(cost, bar),
        }
    }
}
