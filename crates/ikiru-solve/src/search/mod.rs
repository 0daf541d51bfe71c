//! Search: one start, or many until one succeeds, with the bar and the budget that all of them share.

mod pose;
mod seeds;
mod starts;
mod trajectory;

pub(crate) use pose::{PoseStarts, PoseStartsMemory};
pub(crate) use starts::Starts;
pub(crate) use trajectory::{TrajectoryStarts, TrajectoryStartsMemory};

use crate::method::{Bar, Budget, Methods, Outcome, SolverOptions};
use crate::model::Model;
use crate::words::StopReason;

/// How many of the sequence are looked at for each restart; the cheapest is started from.
const SCREENED: usize = 3;

/// Memory of all methods and of the search.
#[derive(Clone, Debug, Default)]
pub(crate) struct Searcher {
    methods: Methods,
    start: Vec<f64>,
    best: Vec<f64>,
    screened: Vec<f64>,
}

impl Searcher {
    /// Makes room for so many coordinates and tangents.
    pub(crate) fn fit(&mut self, n_coords: usize, n_tangents: usize) {
        self.methods.fit(n_coords, n_tangents);
        for coords in [&mut self.start, &mut self.best, &mut self.screened] {
            coords.resize(n_coords, 0.0);
        }
    }

    /// Solves from the coordinates of a model, whose cost is `cost` and which were evaluated last; it is at the best ones
    /// found afterwards. The second number counts restarts.
    pub(crate) fn run<S: Starts>(
        &mut self,
        options: &SolverOptions,
        mut bar: Bar,
        starts: &mut S,
        cost: f64,
        budget: &mut Budget<'_>,
    ) -> (Outcome, usize) {
        let method = &options.method;
        let max_restarts = options.search.max_restarts();
        if max_restarts == 0 {
            return (starts.improve(method, &mut self.methods, cost, &bar, budget), 0);
        }
        self.start.copy_from_slice(starts.model().coords());
        let mut best = starts.improve(method, &mut self.methods, cost, &bar, budget);
        self.best.copy_from_slice(starts.model().coords());
        let mut restarts = 0;
        let mut success = succeeded(starts.model(), &bar, &mut best);
        let max_restarts = starts.most_restarts(max_restarts);
        while !success && restarts < max_restarts && !best.stop.is_final() {
            budget.restart();
            let cost = self.screen(starts, &bar, restarts);
            restarts += 1;
            let mut outcome = starts.improve(method, &mut self.methods, cost, &bar, budget);
            success = succeeded(starts.model(), &bar, &mut outcome);
            if success || outcome.is_better(&best) {
                best = outcome;
                self.best.copy_from_slice(starts.model().coords());
            } else if outcome.stop.is_final() {
                best.stop = outcome.stop;
            }
        }
        // What is hard is held to the last digit, not just within its tolerance.
        let is_given_up = best.stop == StopReason::NoProgress && starts.model().may_have_guards();
        if success && !(is_given_up && bar.cost_below.is_none()) {
            // The last start is the best one, and the model still stands there.
            return (best, restarts);
        }
        starts.model().set_coords(&self.best);
        let cost = starts.model().differentiate();
        best.is_evaluated = true;
        if !best.stop.is_final() {
            // Starts were given up while others waited: the best of them is now followed to its end.
            bar.impatient = false;
            budget.next_start();
            let again = starts.improve(method, &mut self.methods, cost, &bar, budget);
            if best.is_better(&again) {
                starts.model().set_coords(&self.best);
                best.is_evaluated = false;
            } else {
                best = again;
            }
        }
        (best, restarts)
    }

    /// Looks at some starts of the sequence and leaves the model at the best, evaluated; the answer is its cost.
    fn screen<S: Starts>(&mut self, starts: &mut S, bar: &Bar, restart: usize) -> f64 {
        let (mut best, mut cost_of_best) = (f64::INFINITY, f64::INFINITY);
        let mut last = 0;
        for i in 0..SCREENED {
            starts.seed(restart * SCREENED + i, &self.start);
            let model = starts.model();
            let cost = model.evaluate();
            let merit = cost + bar.largest_weight * model.violation();
            if merit < best || i == 0 {
                (best, cost_of_best) = (merit, cost);
                last = i;
                self.screened.copy_from_slice(model.coords());
            }
        }
        if last + 1 < SCREENED {
            starts.model().set_coords(&self.screened);
            cost_of_best = starts.model().differentiate();
        }
        cost_of_best
    }
}

/// Whether a start met the bar; evaluates the model where tolerances decide.
fn succeeded<M: Model>(model: &mut M, bar: &Bar, outcome: &mut Outcome) -> bool {
    if let Some(bar) = bar.cost_below
        && !model.may_have_guards()
    {
        return outcome.cost < bar;
    }
    if !outcome.is_evaluated {
        model.evaluate();
        outcome.is_evaluated = true;
    }
    match bar.cost_below {
        Some(bar) => outcome.cost < bar && model.holds(),
        None => outcome.cost.is_finite() && model.is_satisfied(1.0),
    }
}

#[cfg(test)]
mod tests;
