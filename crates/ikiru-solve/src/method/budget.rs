//! Iterations and time, and who watches.

use std::time::{Duration, Instant};

use crate::words::StopReason;
use crate::words::{Progress, Watch};

/// The time that a solve has, from its very beginning on; no clock is read where it has no end.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Clock(Option<(Instant, Duration)>);

impl Clock {
    /// Starts it.
    pub(crate) fn start(max_time: Option<Duration>) -> Self {
        Self(max_time.map(|most| (Instant::now(), most)))
    }
}

/// What a whole solve may spend, and what it has.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Budget<'a> {
    pub(crate) iterations: usize,
    restarts: usize,
    of_this_start: usize,
    most: usize,
    clock: Clock,
    /// What of the time was gone before there were iterations, for laying out.
    before: Duration,
    /// Who watches, if anybody does.
    watch: Option<&'a Watch>,
}

impl<'a> Budget<'a> {
    /// So many iterations a start, and the time of a clock for all. All is laid out by now, and iterations begin.
    pub(crate) fn of(most: usize, clock: Clock, watch: &'a Watch) -> Self {
        Self {
            iterations: 0,
            restarts: 0,
            of_this_start: 0,
            most,
            clock,
            before: clock.0.map_or(Duration::ZERO, |(start, _)| start.elapsed()),
            watch: watch.is_set().then_some(watch),
        }
    }

    /// Another start, or the same followed further, has iterations of its own.
    pub(crate) fn next_start(&mut self) {
        self.of_this_start = 0;
    }

    /// Begins a start of its own, which counts as a restart.
    pub(crate) fn restart(&mut self) {
        self.restarts += 1;
        self.next_start();
    }

    /// Counts one more iteration, or says why there may be none: an objective gave up, somebody stopped the solve, or a budget
    /// is used up (equations 21, 23 and 24: with the mean time of an iteration so far, one more would end after the budget).
    /// `cost` is the lowest of this start so far.
    #[inline]
    pub(crate) fn spend(&mut self, has_failed: bool, cost: f64) -> Option<StopReason> {
        if has_failed {
            return Some(StopReason::ObjectiveFailed);
        }
        if self.of_this_start >= self.most {
            return Some(StopReason::IterationLimit);
        }
        if let Some(watch) = self.watch {
            let Self { iterations, restarts, .. } = *self;
            if watch.says_stop(Progress { iterations, restarts, cost }) {
                return Some(StopReason::Cancelled);
            }
        }
        if self.is_late() {
            return Some(StopReason::TimeBudget);
        }
        self.of_this_start += 1;
        self.iterations += 1;
        None
    }

    /// Why what is no iteration, and may take long, is to end now.
    pub(crate) fn stop(&self) -> Option<StopReason> {
        if self.watch.is_some_and(Watch::is_cancelled) {
            return Some(StopReason::Cancelled);
        }
        self.is_late().then_some(StopReason::TimeBudget)
    }

    #[inline]
    fn is_late(&self) -> bool {
        let Clock(Some((start, most))) = self.clock else { return false };
        let spent = start.elapsed();
        let iterating = spent.saturating_sub(self.before);
        let mean = iterating / u32::try_from(self.iterations.max(1)).unwrap_or(u32::MAX);
        spent + mean > most
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::method::SolverOptions;
    use std::ops::ControlFlow;
    use std::sync::{Arc, Mutex};

    fn options(max_iterations: usize, max_time: Option<Duration>) -> SolverOptions {
        SolverOptions { max_iterations, max_time, ..SolverOptions::default() }
    }

    #[test]
    fn every_start_has_as_many_iterations_and_all_are_counted() {
        let watch = Watch::new();
        let mut budget = Budget::new(&options(2, None), &watch);
        let spend = |budget: &mut Budget<'_>| [1, 2, 3].map(|_| budget.spend(false, 1.0));
        let wanted = [None, None, Some(StopReason::IterationLimit)];
        assert_eq!(spend(&mut budget), wanted);
        budget.restart();
        assert_eq!(spend(&mut budget), wanted);
        assert_eq!(budget.iterations, 4);
        assert_eq!(budget.stop(), None);
        assert_eq!(budget.spend(true, 1.0), Some(StopReason::ObjectiveFailed));
    }

    #[test]
    fn who_watches_hears_of_iterations_restarts_and_cost() {
        let heard = Arc::new(Mutex::new(Vec::new()));
        let told = heard.clone();
        let watch = Watch::new().on_progress(move |progress| {
            told.lock().unwrap().push((progress.iterations, progress.restarts, progress.cost));
            if progress.restarts == 1 { ControlFlow::Break(()) } else { ControlFlow::Continue(()) }
        });
        let mut budget = Budget::new(&options(9, None), &watch);
        assert_eq!([budget.spend(false, 3.0), budget.spend(false, 2.0)], [None, None]);
        budget.restart();
        assert_eq!(budget.spend(false, 5.0), Some(StopReason::Cancelled));
        assert_eq!(*heard.lock().unwrap(), [(0, 0, 3.0), (1, 0, 2.0), (2, 1, 5.0)]);
    }

    #[test]
    fn an_iteration_begins_only_where_one_of_mean_length_would_end_in_time() {
        let ago = |secs: u64| Instant::now().checked_sub(Duration::from_secs(secs)).unwrap();
        let watch = Watch::new();
        let mut budget = Budget::new(&options(9, None), &watch);
        // Two iterations took 100 seconds: another one ends after 150.
        budget.iterations = 2;
        for (most, is_late) in [(99, true), (120, true), (140, true), (170, false)] {
            budget.clock = Clock(Some((ago(100), Duration::from_secs(most))));
            assert_eq!(budget.spend(false, 1.0), is_late.then_some(StopReason::TimeBudget), "{most}");
            assert_eq!(budget.stop(), budget.is_late().then_some(StopReason::TimeBudget));
            budget.iterations = 2;
        }
    }

    #[test]
    fn laying_out_takes_its_part_of_the_time_and_no_iteration_is_expected_to_take_as_long() {
        let ago = |secs: u64| Instant::now().checked_sub(Duration::from_secs(secs)).unwrap();
        let watch = Watch::new();
        // Of 100 seconds laying out took 80: two iterations of 10 seconds each, and another one ends after 110.
        for (most, is_late) in [(99, true), (109, true), (111, false)] {
            let clock = Clock(Some((ago(80), Duration::from_secs(most))));
            let mut budget = Budget::on(clock, &options(9, None), &watch);
            assert!(budget.before >= Duration::from_secs(80), "{:?}", budget.before);
            budget.clock = Clock(Some((ago(100), Duration::from_secs(most))));
            budget.iterations = 2;
            assert_eq!(budget.spend(false, 1.0), is_late.then_some(StopReason::TimeBudget), "{most}");
        }
        // Where it took all of the time, there is none.
        let mut budget =
            Budget::on(Clock(Some((ago(80), Duration::from_secs(70)))), &options(9, None), &watch);
        assert_eq!(budget.spend(false, 1.0), Some(StopReason::TimeBudget));
    }
}
