//! Search: one start, or many until one succeeds, with the bar and the budget that all of them share.

use std::time::{Duration, Instant};

use crate::layout::Layout;
use crate::options::{Method, Search, SolverOptions};
use crate::problem::Problem;
use crate::report::StopReason;
use crate::solvers::adam::Adam;
use crate::solvers::ccd::Ccd;
use crate::solvers::fabrik::Fabrik;
#[cfg(feature = "ipopt")]
use crate::solvers::ipopt::Ipopt;
use crate::solvers::lm::Lm;
use crate::solvers::seeds::Seeds;
use crate::state::State;

/// How many poses of the sequence are looked at for each restart; the cheapest is started from.
const SCREENED: usize = 3;

/// What came of one start.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Outcome {
    pub(crate) cost: f64,
    /// By how much hard rows are missed.
    pub(crate) violation: f64,
    pub(crate) stop: StopReason,
    /// Whether the state was evaluated last at the pose that it holds.
    pub(crate) is_evaluated: bool,
}

/// Hard rows that are missed by less than this in all (metres, radians) count as held when poses are compared.
pub(crate) const HELD: f64 = 1e-6;

impl Outcome {
    pub(crate) fn new(cost: f64, violation: f64, stop: StopReason, is_evaluated: bool) -> Self {
        Self { cost, violation, stop, is_evaluated }
    }

    /// Whether it is better than another one: what is hard comes first.
    pub(crate) fn is_better(&self, other: &Self) -> bool {
        let (own, others) = (self.violation.max(HELD), other.violation.max(HELD));
        if own == others { self.cost < other.cost } else { own < others }
    }
}

/// What counts as done.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Bar {
    pub(crate) cost_below: Option<f64>,
    /// A cost below this is nothing but rounding.
    pub(crate) nothing: f64,
    /// The largest weight of a term, at least 1: what a metre or radian of a missed hard row counts when starts are chosen.
    pub(crate) largest_weight: f64,
    /// Whether another start waits, so that a slow one is given up.
    pub(crate) impatient: bool,
}

/// The squared length of a residual that is nothing but rounding (metres², radians²).
const NOTHING: f64 = 1e-24;

impl Bar {
    /// A cost to come below, or none where the tolerances of a problem's terms decide.
    pub(crate) fn new(cost_below: Option<f64>, problem: &Problem, impatient: bool) -> Self {
        // Weights that are all tiny make every cost tiny, whether or not the terms are met.
        let largest = problem.terms().iter().filter(|t| t.is_on).map(|t| t.weight).fold(0.0, f64::max);
        Self { cost_below, nothing: NOTHING * largest.min(1.0), largest_weight: largest.max(1.0), impatient }
    }

    /// Whether the solve may end here. Without `cost_below` only a pose that meets every term exactly, within
    /// rounding, ends it early: otherwise it goes on until it converges.
    #[inline]
    pub(crate) fn is_met(&self, cost: f64) -> bool {
        match self.cost_below {
            Some(bar) => cost < bar,
            None => cost < self.nothing,
        }
    }

    pub(crate) fn patience(&self, cost: f64, violation: f64) -> Patience {
        // Where the bar is a cost, each step must bring it a good deal nearer. Where tolerances decide, the
        // cost that a success ends at is not known, so that more steps are given.
        let most_steps = if self.cost_below.is_some() { 1 } else { 4 };
        Patience {
            most_steps,
            impatient: self.impatient,
            last: cost,
            violation,
            steps: 0,
            bar: self.cost_below.unwrap_or(0.0),
        }
    }
}

/// Gives up a start that gets on too slowly while others wait.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Patience {
    impatient: bool,
    most_steps: usize,
    last: f64,
    violation: f64,
    steps: usize,
    bar: f64,
}

/// The part of the cost above the bar that must have gone after each round of steps.
const PATIENCE_GAIN: f64 = 0.1;

impl Patience {
    #[inline]
    pub(crate) fn is_over(&mut self, cost: f64) -> bool {
        self.is_over_with(cost, 0.0)
    }

    /// The same with hard rows that are missed by so much: as long as that falls, it gets on.
    #[inline]
    pub(crate) fn is_over_with(&mut self, cost: f64, violation: f64) -> bool {
        if !self.impatient {
            return false;
        }
        self.steps += 1;
        if self.steps < self.most_steps {
            return false;
        }
        self.steps = 0;
        let slow = cost > self.bar && self.last - cost < PATIENCE_GAIN * (self.last - self.bar);
        let falls = violation < (1.0 - PATIENCE_GAIN) * self.violation;
        (self.last, self.violation) = (cost, violation);
        slow && !falls
    }
}

/// Iterations and time.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Budget {
    pub(crate) iterations: usize,
    of_this_start: usize,
    most: usize,
    started: Option<(Instant, Duration)>,
}

impl Budget {
    pub(crate) fn new(options: &SolverOptions) -> Self {
        Self {
            iterations: 0,
            of_this_start: 0,
            most: options.max_iterations,
            started: options.max_time.map(|most| (Instant::now(), most)),
        }
    }

    pub(crate) fn next_start(&mut self) {
        self.of_this_start = 0;
    }

    /// Counts one more iteration, or says why there may be none: an objective gave up, or a budget is used up (equations 21, 23 and 24: with the mean
    /// time of an iteration so far, one more would end after the budget).
    #[inline]
    pub(crate) fn spend(&mut self, has_failed: bool) -> Option<StopReason> {
        if has_failed {
            return Some(StopReason::ObjectiveFailed);
        }
        if self.of_this_start >= self.most {
            return Some(StopReason::IterationLimit);
        }
        if self.is_late() {
            return Some(StopReason::TimeBudget);
        }
        self.of_this_start += 1;
        self.iterations += 1;
        None
    }

    #[inline]
    pub(crate) fn is_late(&self) -> bool {
        let Some((start, most)) = self.started else { return false };
        let spent = start.elapsed();
        let mean = spent / u32::try_from(self.iterations.max(1)).unwrap_or(u32::MAX);
        spent + mean > most
    }
}

/// Memory of all methods and of the search.
#[derive(Clone, Debug, Default)]
pub(crate) struct Searcher {
    pub(crate) lm: Lm,
    adam: Adam,
    ccd: Ccd,
    fabrik: Fabrik,
    #[cfg(feature = "ipopt")]
    ipopt: Ipopt,
    seeds: Seeds,
    start: Vec<f64>,
    best: Vec<f64>,
    screened: Vec<f64>,
}

impl Searcher {
    pub(crate) fn new(layout: &Layout) -> Self {
        let zeros = vec![0.0; layout.n_kept_coords()];
        Self {
            lm: Lm::new(layout),
            adam: Adam::new(layout),
            ccd: Ccd::new(layout),
            fabrik: Fabrik::new(layout),
            #[cfg(feature = "ipopt")]
            ipopt: Ipopt::new(layout),
            seeds: Seeds::new(layout),
            start: zeros.clone(),
            best: zeros.clone(),
            screened: zeros,
        }
    }

    /// Solves from the coordinates in `state`, whose cost is `cost`; the best pose found is in `state`
    /// afterwards, evaluated. The second number counts restarts.
    pub(crate) fn run(
        &mut self,
        options: &SolverOptions,
        layout: &Layout,
        problem: &Problem,
        state: &mut State,
        cost: f64,
        budget: &mut Budget,
    ) -> (Outcome, usize) {
        let max_restarts = match options.search {
            Search::Local => 0,
            Search::Global { max_restarts } => max_restarts,
        };
        let mut bar = Bar::new(options.cost_below, problem, max_restarts > 0);
        if max_restarts == 0 {
            return (self.run_once(options, layout, problem, state, cost, &bar, budget), 0);
        }
        self.start.copy_from_slice(&state.coords);
        let mut best = self.run_once(options, layout, problem, state, cost, &bar, budget);
        self.best.copy_from_slice(&state.coords);
        let mut restarts = 0;
        let mut success = self.succeeded(options, layout, problem, state, &mut best);
        while !success && restarts < max_restarts && !best.stop.is_final() {
            budget.next_start();
            let cost = self.screen(layout, problem, state, &bar, restarts);
            restarts += 1;
            let mut outcome = self.run_once(options, layout, problem, state, cost, &bar, budget);
            success = self.succeeded(options, layout, problem, state, &mut outcome);
            if success || outcome.is_better(&best) {
                best = outcome;
                self.best.copy_from_slice(&state.coords);
            } else if outcome.stop.is_final() {
                best.stop = outcome.stop;
            }
        }
        // What is hard is held to the last digit, not just within its tolerance.
        let is_given_up = best.stop == StopReason::NoProgress && layout.n_force_rows > 0;
        if success && !(is_given_up && options.cost_below.is_none()) {
            // The last start is the best one, and `state` still holds it.
            return (best, restarts);
        }
        state.coords.copy_from_slice(&self.best);
        let cost = state.evaluate(layout, problem);
        best.is_evaluated = true;
        if !best.stop.is_final() {
            // Starts were given up while others waited: the best of them is now followed to its end.
            bar.impatient = false;
            budget.next_start();
            best = self.run_once(options, layout, problem, state, cost, &bar, budget);
        }
        (best, restarts)
    }

    /// Whether a start met the bar; re-evaluates the pose where tolerances decide.
    fn succeeded(
        &self,
        options: &SolverOptions,
        layout: &Layout,
        problem: &Problem,
        state: &mut State,
        outcome: &mut Outcome,
    ) -> bool {
        match options.cost_below {
            Some(bar) if layout.n_force_rows == 0 => outcome.cost < bar,
            bar => {
                if !outcome.is_evaluated {
                    state.evaluate(layout, problem);
                    outcome.is_evaluated = true;
                }
                match bar {
                    Some(bar) => outcome.cost < bar && state.holds(layout, problem),
                    None => state.is_satisfied(layout, problem),
                }
            }
        }
    }

    fn run_once(
        &mut self,
        options: &SolverOptions,
        layout: &Layout,
        problem: &Problem,
        state: &mut State,
        cost: f64,
        bar: &Bar,
        budget: &mut Budget,
    ) -> Outcome {
        match &options.method {
            Method::Lm => self.lm.run(layout, problem, state, cost, bar, budget),
            Method::Adam(adam) => self.adam.run(adam, layout, problem, state, cost, bar, budget),
            Method::Ccd => self.ccd.run(layout, problem, state, cost, bar, budget),
            Method::Fabrik => self.fabrik.run(layout, problem, state, cost, bar, budget),
            #[cfg(feature = "ipopt")]
            Method::Ipopt => self.ipopt.run(layout, problem, state, cost, bar, budget),
        }
    }

    /// Looks at some poses of the sequence and leaves the best in `state`, evaluated; the answer is its cost.
    fn screen(
        &mut self,
        layout: &Layout,
        problem: &Problem,
        state: &mut State,
        bar: &Bar,
        restart: usize,
    ) -> f64 {
        let (mut best, mut cost_of_best) = (f64::INFINITY, f64::INFINITY);
        let mut last = 0;
        for i in 0..SCREENED {
            self.seeds.write(layout, restart * SCREENED + i, &self.start, &mut state.coords);
            let cost = state.evaluate(layout, problem);
            let merit = cost + bar.largest_weight * state.violation;
            if merit < best || i == 0 {
                (best, cost_of_best) = (merit, cost);
                last = i;
                self.screened.copy_from_slice(&state.coords);
            }
        }
        if last + 1 < SCREENED {
            state.coords.copy_from_slice(&self.screened);
            cost_of_best = state.evaluate(layout, problem);
        }
        cost_of_best
    }
}
