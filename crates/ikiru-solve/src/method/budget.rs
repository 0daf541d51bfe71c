//! Iterations and time, and who watches.

use std::time::{Duration, Instant};

use crate::words::SolverOptions;
use crate::words::StopReason;
use crate::words::{Progress, Watch};

/// What a whole solve may spend, and what it has.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Budget<'a> {
    pub(crate) iterations: usize,
    restarts: usize,
    of_this_start: usize,
    most: usize,
    started: Option<(Instant, Duration)>,
    /// Who watches, if anybody does.
    watch: Option<&'a Watch>,
}

impl<'a> Budget<'a> {
    pub(crate) fn new(options: &SolverOptions, watch: &'a Watch) -> Self {
        Self {
            iterations: 0,
            restarts: 0,
            of_this_start: 0,
            most: options.max_iterations,
            started: options.max_time.map(|most| (Instant::now(), most)),
            watch: watch.is_set().then_some(watch),
        }
    }

    /// Another start, or the same followed further, has iterations of its own.
    pub(crate) fn next_start(&mut self) {
        self.of_this_start = 0;
    }

    /// The same for a start of its own.
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
        let Some((start, most)) = self.started else { return false };
        let spent = start.elapsed();
        let mean = spent / u32::try_from(self.iterations.max(1)).unwrap_or(u32::MAX);
        spent + mean > most
    }
}
