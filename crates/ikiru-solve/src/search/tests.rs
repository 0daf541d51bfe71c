//! The search over starts of a model whose costs and ends a test says.

use super::*;
use crate::method::{Method, Search};
use crate::model::cases::Line;
use crate::words::Watch;

/// Starts on a line: where each begins, and where each ends.
struct OnLine {
    model: Line,
    seeds: Vec<f64>,
    /// Where an improvement leads from a place, and why it ends there.
    improved: fn(f64) -> (f64, StopReason),
    /// Where improvements began, and at which cost they were said to.
    began: Vec<(f64, f64)>,
}

impl Starts for OnLine {
    type Model = Line;
    fn model(&mut self) -> &mut Line {
        &mut self.model
    }
    fn seed(&mut self, number: usize, _: &[f64]) {
        self.model.x = [self.seeds[number]];
    }
    fn most_restarts(&self, wanted: usize) -> usize {
        wanted
    }
    fn improve(&mut self, _: &Method, _: &mut Methods, cost: f64, _: &Bar, _: &mut Budget<'_>) -> Outcome {
        self.began.push((self.model.x[0], cost));
        let (to, stop) = (self.improved)(self.model.x[0]);
        self.model.x = [to];
        let cost = self.model.evaluate();
        Outcome::new(cost, self.model.violation(), stop, true)
    }
}

fn on_line(cost_of: fn(f64) -> f64, seeds: &[f64]) -> OnLine {
    let improved = |x| (x, StopReason::Converged);
    OnLine { model: Line::new(cost_of), seeds: seeds.to_vec(), improved, began: Vec::new() }
}

fn run(starts: &mut OnLine, max_restarts: usize, cost_below: Option<f64>) -> (Outcome, usize) {
    let search = if max_restarts > 0 { Search::Global { max_restarts } } else { Search::Local };
    let options = SolverOptions { search, ..SolverOptions::default() };
    let (watch, mut searcher) = (Watch::new(), Searcher::default());
    searcher.fit(1, 1);
    let bar = Bar { cost_below, nothing: 0.0, largest_weight: 3.0, impatient: true, settles: false };
    let cost = starts.model.evaluate();
    searcher.run(&options, bar, starts, cost, &mut Budget::new(&options, &watch))
}

#[test]
fn the_cheapest_of_those_screened_is_started_from() {
    for (seeds, wanted) in
        [([1.0, 2.0, 3.0], 1.0), ([2.0, 1.0, 3.0], 1.0), ([3.0, 2.0, 1.0], 1.0), ([2.0, 1.0, 1.0], 1.0)]
    {
        let mut starts = on_line(|x| 10.0 + x, &seeds);
        let (_, restarts) = run(&mut starts, 1, Some(0.0));
        assert_eq!((starts.began[1], restarts), ((wanted, 10.0 + wanted), 1), "{seeds:?}");
    }
    // A missed metre of what is hard counts as the largest weight says.
    let mut starts = on_line(|x| 10.0 + x, &[1.0, 2.0, 3.5]);
    starts.model.violation_of = |x| if x == 1.0 { 0.5 } else { 0.0 };
    run(&mut starts, 1, Some(0.0));
    assert_eq!(starts.began[1], (2.0, 12.0));
}

#[test]
fn each_restart_looks_at_seeds_of_its_own_until_one_succeeds() {
    let mut starts = on_line(|x| x, &[9.0, 8.0, 7.0, 3.0, 4.0, 5.0, 1.0, 1.0, 1.0]);
    starts.model.x = [20.0];
    let (outcome, restarts) = run(&mut starts, 3, Some(3.5));
    assert_eq!((outcome.cost, restarts, starts.model.x), (3.0, 2, [3.0]));
    assert_eq!(starts.began, [(20.0, 20.0), (7.0, 7.0), (3.0, 3.0)]);
}

#[test]
fn a_cost_at_the_bar_is_no_success() {
    let mut starts = on_line(|x| x, &[5.0, 5.0, 5.0]);
    starts.model.x = [3.0];
    assert_eq!(run(&mut starts, 1, Some(3.0)).1, 1);
    let mut starts = on_line(|x| x, &[5.0, 5.0, 5.0]);
    starts.model.x = [3.0];
    assert_eq!(run(&mut starts, 1, Some(3.0001)).1, 0);
}

#[test]
fn without_restarts_there_is_one_start() {
    let mut starts = on_line(|x| x, &[]);
    starts.model.x = [3.0];
    assert_eq!((run(&mut starts, 0, Some(1.0)).1, starts.began.len()), (0, 1));
}

#[test]
fn the_best_of_all_starts_is_followed_to_its_end_where_none_succeeds() {
    let mut starts = on_line(|x| 10.0 + x, &[4.0, 5.0, 6.0, 7.0, 8.0, 9.0]);
    starts.model.x = [20.0];
    starts.improved = |x| (if x == 3.0 { 2.0 } else { x - 1.0 }, StopReason::NoProgress);
    let (outcome, restarts) = run(&mut starts, 2, Some(0.0));
    // The first restart ended at 3, and goes on from there.
    assert_eq!((outcome.cost, restarts, starts.model.x), (12.0, 2, [2.0]));
    assert_eq!(starts.began, [(20.0, 30.0), (4.0, 14.0), (7.0, 17.0), (3.0, 13.0)]);
    // What is worse at its end is not taken.
    let mut starts = on_line(|x| 10.0 + x, &[4.0, 5.0, 6.0]);
    starts.model.x = [20.0];
    starts.improved = |x| (if x == 3.0 { 9.0 } else { x - 1.0 }, StopReason::NoProgress);
    let (outcome, _) = run(&mut starts, 1, Some(0.0));
    assert_eq!((outcome.cost, starts.model.x), (13.0, [3.0]));
}

#[test]
fn what_ends_the_whole_solve_ends_the_search() {
    let mut starts = on_line(|x| x, &[4.0, 5.0, 6.0, 1.0, 1.0, 1.0]);
    starts.model.x = [3.0];
    starts.improved = |x| (x, if x == 3.0 { StopReason::Converged } else { StopReason::Cancelled });
    let (outcome, restarts) = run(&mut starts, 2, Some(0.0));
    // The best is still the first, and the search says why it is over.
    assert_eq!((outcome.cost, outcome.stop, restarts), (3.0, StopReason::Cancelled, 1));
    assert_eq!((starts.model.x, starts.began.len()), ([3.0], 2));
}

#[test]
fn where_tolerances_decide_what_is_given_up_inside_them_is_followed_as_long_as_something_is_hard() {
    for (has_guards, stop, n_began) in [
        (true, StopReason::NoProgress, 2),
        (true, StopReason::Converged, 1),
        (false, StopReason::NoProgress, 1),
    ] {
        let mut starts = on_line(|x| 10.0 + x, &[]);
        (starts.model.is_satisfied, starts.model.has_guards) = (true, has_guards);
        starts.improved = if stop == StopReason::Converged {
            |x| (x, StopReason::Converged)
        } else {
            |x| (x, StopReason::NoProgress)
        };
        let (_, restarts) = run(&mut starts, 2, None);
        assert_eq!((restarts, starts.began.len()), (0, n_began), "{has_guards} {stop:?}");
    }
}

#[test]
fn below_the_bar_what_is_hard_must_hold_too() {
    let mut starts = on_line(|x| x, &[1.5, 2.0, 2.5]);
    starts.model.x = [1.0];
    (starts.model.has_guards, starts.model.violation_of) = (true, |x| if x == 1.0 { 0.1 } else { 0.0 });
    let (outcome, restarts) = run(&mut starts, 1, Some(2.0));
    assert_eq!((outcome.cost, outcome.violation, restarts), (1.5, 0.0, 1));
}
