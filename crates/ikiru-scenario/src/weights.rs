//! Objectives of a motion that have no weight: the weights that meet them.
//!
//! A motion is a compromise of its objectives with smoothness, so that a fixed weight misses a target by as much as that
//! motion's speed and length happen to ask for. A scenario that names no weight asks for the target: the weight is raised
//! until the objective is within its tolerance, or until more of it does not help.

use std::time::{Duration, Instant};

use ikiru_rig::Clip;
use ikiru_solve::{Method, MotionWorkspace, PlannedMotion, Search, Solver, SolverOptions, StopReason};

use crate::motion_scenario::MotionScenario;
use crate::objective::DEFAULT_WEIGHT;

/// By how much a weight is raised at once, and how far.
const RAISE: f64 = 10.0;
const MOST: f64 = 1e8;

/// A term whose squared residuals do not fall to this part of what they were is kept from its target by something else
/// than its weight: where smoothness opposes it, they fall to a hundredth.
const HELPS: f64 = 0.5;

/// Iterations of a plan that shows whether weights suffice: the next one goes on from where it got.
const LOOK_ITERATIONS: usize = 24;

impl MotionScenario {
    /// Plans from standing still, at the timeline's samples. Weights that the scenario does not give begin at their default
    /// each time, so that planning again gives the same.
    pub(crate) fn plan_samples(&mut self, workspace: &mut MotionWorkspace) -> PlannedMotion<'static> {
        let open = self.open_terms();
        open.iter().for_each(|term| self.set_weight(*term, DEFAULT_WEIGHT));
        let options = *self.solver.options();
        let is_raised = !open.is_empty() && options.cost_below.is_none() && options.method == Method::Lm;
        if !is_raised {
            return self.solver.plan(&self.motion, &self.still(), workspace).into_owned();
        }
        let clock = Clock::new(options.max_time);
        let max_iterations = options.max_iterations.min(LOOK_ITERATIONS);
        let local = SolverOptions { search: Search::Local, max_iterations, ..options };
        let mut planned = self.plan_in(clock.rest_of(local), &self.still(), workspace);
        self.raise(&open, local, &clock, &mut planned, workspace);
        if is_over(&planned) || clock.has_run_out(&mut planned) {
            return planned;
        }
        // Another way may meet what no weight does; there, weights may help again.
        let searched = self.plan_in(clock.rest_of(options), &self.on_timeline(&planned.clip), workspace);
        follow(&mut planned, searched);
        self.raise(&open, local, &clock, &mut planned, workspace);
        planned
    }

    /// Raises the weights of open terms that are not met, as long as that helps.
    fn raise(
        &mut self,
        open: &[usize],
        local: SolverOptions,
        clock: &Clock,
        planned: &mut PlannedMotion<'static>,
        workspace: &mut MotionWorkspace,
    ) {
        let mut open = open.to_vec();
        while !is_over(planned) && !clock.has_run_out(planned) {
            open.retain(|term| {
                let report = &planned.report.terms[*term];
                report.mandatory && !report.satisfied && report.weight < MOST
            });
            if open.is_empty() {
                return;
            }
            let before: Vec<f64> = open.iter().map(|term| missed(planned, *term)).collect();
            for term in &open {
                self.set_weight(*term, RAISE * planned.report.terms[*term].weight);
            }
            let guess = self.on_timeline(&planned.clip);
            let next = self.plan_in(clock.rest_of(local), &guess, workspace);
            follow(planned, next);
            let mut before = before.into_iter();
            open.retain(|term| {
                let helps = before.next().is_some_and(|before| missed(planned, *term) <= HELPS * before);
                let is_met = planned.report.terms[*term].satisfied;
                if !helps && !is_met {
                    self.set_weight(*term, planned.report.terms[*term].weight / RAISE);
                }
                helps
            });
        }
    }

    fn plan_in(
        &self,
        options: SolverOptions,
        guess: &Clip,
        workspace: &mut MotionWorkspace,
    ) -> PlannedMotion<'static> {
        Solver::new(options).plan(&self.motion, guess, workspace).into_owned()
    }

    /// Terms without a weight of the scenario's own; to constraints, none says anything.
    fn open_terms(&self) -> Vec<usize> {
        let is_hard = |term: usize| self.motion.terms().terms()[term].hard;
        let is_open = |term: &usize| self.objectives[*term].weight.is_none() && !is_hard(*term);
        (0..self.objectives.len()).filter(is_open).collect()
    }

    fn set_weight(&mut self, term: usize, weight: f64) {
        self.motion.terms_mut()[term].weight = weight;
    }

    /// A clip's samples at the timeline's times again, where a free duration gave them others.
    fn on_timeline(&self, clip: &Clip) -> Clip {
        Clip::new(clip.name(), self.motion.timeline().times(), clip.poses().to_vec())
            .unwrap_or_else(|_| clip.clone())
    }
}

/// The squared residuals of a term, over all its samples, as its loss counts them.
fn missed(planned: &PlannedMotion<'_>, term: usize) -> f64 {
    let report = &planned.report.terms[term];
    report.cost / report.weight
}

/// Whether there is nothing left to try, or no time for it.
fn is_over(planned: &PlannedMotion<'_>) -> bool {
    let report = &planned.report;
    report.success || report.invalid.is_some() || report.stop == StopReason::TimeBudget
}

/// Puts a later plan in the place of an earlier one; a report counts all that was done.
fn follow(planned: &mut PlannedMotion<'static>, next: PlannedMotion<'static>) {
    let (iterations, restarts) = (planned.report.iterations, planned.report.restarts);
    *planned = next;
    planned.report.iterations += iterations;
    planned.report.restarts += restarts;
}

/// What is left of a time budget; no clock is read where there is none.
struct Clock {
    end: Option<Instant>,
}

impl Clock {
    fn new(budget: Option<Duration>) -> Self {
        Self { end: budget.and_then(|budget| Instant::now().checked_add(budget)) }
    }

    /// Whether nothing is left, which the report then says: laying out another plan would take time as well.
    fn has_run_out(&self, planned: &mut PlannedMotion<'_>) -> bool {
        let is_late = self.end.is_some_and(|end| Instant::now() >= end);
        if is_late {
            planned.report.stop = StopReason::TimeBudget;
        }
        is_late
    }

    fn rest_of(&self, options: SolverOptions) -> SolverOptions {
        // An end of time that is out of reach of the clock is none.
        let rest = self.end.map(|end| end.saturating_duration_since(Instant::now()));
        SolverOptions { max_time: rest, ..options }
    }
}
