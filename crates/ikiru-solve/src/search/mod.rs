//! Search: one start, or many until one succeeds, with the bar and the budget that all of them share.

mod bar;
mod budget;
pub(crate) mod seeds;

pub(crate) use bar::Bar;
pub(crate) use budget::Budget;

use crate::method::Methods;
use crate::model::Model;
use crate::options::SolverOptions;
use crate::report::StopReason;

/// How many of the sequence are looked at for each restart; the cheapest is started from.
const SCREENED: usize = 3;

/// Hard rows that are missed by less than this in all (metres, radians) count as held when answers are compared.
pub(crate) const HELD: f64 = 1e-6;

/// What came of one start.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Outcome {
    /// The cost; infinite where limits on rates do not hold.
    pub(crate) cost: f64,
    /// By how much hard rows are missed.
    pub(crate) violation: f64,
    pub(crate) stop: StopReason,
    /// Whether the model was evaluated last at the coordinates that it has.
    pub(crate) is_evaluated: bool,
}

impl Outcome {
    pub(crate) fn new(cost: f64, violation: f64, stop: StopReason, is_evaluated: bool) -> Self {
        Self { cost, violation, stop, is_evaluated }
    }

    /// Whether it is better than another one: limits on rates come first, then what is hard.
    pub(crate) fn is_better(&self, other: &Self) -> bool {
        let (own, others) = (self.violation.max(HELD), other.violation.max(HELD));
        let comparable = self.cost.is_finite() && other.cost.is_finite();
        if own == others || !comparable { self.cost < other.cost } else { own < others }
    }
}

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
    pub(crate) fn run<M: Model>(
        &mut self,
        options: &SolverOptions,
        mut bar: Bar,
        model: &mut M,
        cost: f64,
        budget: &mut Budget<'_>,
    ) -> (Outcome, usize) {
        let Self { methods, start, best: best_coords, .. } = self;
        let method = &options.method;
        let max_restarts = options.search.max_restarts();
        if max_restarts == 0 {
            return (model.improve(method, methods, cost, &bar, budget), 0);
        }
        start.copy_from_slice(model.coords());
        let mut best = model.improve(method, methods, cost, &bar, budget);
        best_coords.copy_from_slice(model.coords());
        let mut restarts = 0;
        let mut success = succeeded(model, &bar, &mut best);
        let max_restarts = model.most_restarts(max_restarts);
        while !success && restarts < max_restarts && !best.stop.is_final() {
            budget.restart();
            let cost = self.screen(model, &bar, restarts);
            restarts += 1;
            let mut outcome = model.improve(method, &mut self.methods, cost, &bar, budget);
            success = succeeded(model, &bar, &mut outcome);
            if success || outcome.is_better(&best) {
                best = outcome;
                self.best.copy_from_slice(model.coords());
            } else if outcome.stop.is_final() {
                best.stop = outcome.stop;
            }
        }
        // What is hard is held to the last digit, not just within its tolerance.
        let is_given_up = best.stop == StopReason::NoProgress && model.may_have_forces();
        if success && !(is_given_up && bar.cost_below.is_none()) {
            // The last start is the best one, and the model still stands there.
            return (best, restarts);
        }
        model.set_coords(&self.best);
        let cost = model.differentiate();
        best.is_evaluated = true;
        if !best.stop.is_final() {
            // Starts were given up while others waited: the best of them is now followed to its end.
            bar.impatient = false;
            budget.next_start();
            let again = model.improve(method, &mut self.methods, cost, &bar, budget);
            if best.is_better(&again) {
                model.set_coords(&self.best);
                best.is_evaluated = false;
            } else {
                best = again;
            }
        }
        (best, restarts)
    }

    /// Looks at some starts of the sequence and leaves the model at the best, evaluated; the answer is its cost.
    fn screen<M: Model>(&mut self, model: &mut M, bar: &Bar, restart: usize) -> f64 {
        let (mut best, mut cost_of_best) = (f64::INFINITY, f64::INFINITY);
        let mut last = 0;
        for i in 0..SCREENED {
            model.seed(restart * SCREENED + i, &self.start);
            let cost = model.evaluate();
            let merit = cost + bar.largest_weight * model.violation();
            if merit < best || i == 0 {
                (best, cost_of_best) = (merit, cost);
                last = i;
                self.screened.copy_from_slice(model.coords());
            }
        }
        if last + 1 < SCREENED {
            model.set_coords(&self.screened);
            cost_of_best = model.differentiate();
        }
        cost_of_best
    }
}

/// Whether a start met the bar; evaluates the model where tolerances decide.
fn succeeded<M: Model>(model: &mut M, bar: &Bar, outcome: &mut Outcome) -> bool {
    if let Some(bar) = bar.cost_below
        && !model.may_have_forces()
    {
        return outcome.cost < bar;
    }
    if !outcome.is_evaluated {
        model.evaluate();
        outcome.is_evaluated = true;
    }
    match bar.cost_below {
        Some(bar) => outcome.cost < bar && model.holds(),
        None => outcome.cost.is_finite() && model.is_satisfied(),
    }
}
