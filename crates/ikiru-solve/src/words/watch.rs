//! A solve watched from outside: a flag that cancels it, a call that hears how it gets on.

use std::fmt;
use std::ops::ControlFlow;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};

/// How far a solve has come.
#[derive(Clone, Copy, Debug, PartialEq)]
#[non_exhaustive]
pub struct Progress {
    /// Iterations so far, of all starts.
    pub iterations: usize,
    /// Restarts so far.
    pub restarts: usize,
    /// The lowest cost of this start so far.
    pub cost: f64,
}

/// What hears of progress.
type OnProgress = Arc<dyn Fn(Progress) -> ControlFlow<()> + Send + Sync>;

/// Who watches a solve or a plan. It ends at most one iteration after the flag is set or the call answers
/// [`Break`](ControlFlow::Break), with [`StopReason::Cancelled`](crate::StopReason::Cancelled); the best answer so far comes
/// back as ever, with what is in the way of terms that are not met, and the limits on rates that it does not keep. By default
/// nobody does.
#[derive(Clone, Default)]
pub struct Watch {
    cancel: Option<Arc<AtomicBool>>,
    on_progress: Option<OnProgress>,
}

impl Watch {
    /// Nobody watches.
    #[must_use]
    pub fn new() -> Self {
        Self::default()
    }

    /// Ends the solve once this flag is true, set from any thread. It stays as it is: clear it before the next solve.
    #[must_use]
    pub fn cancelled_by(mut self, flag: Arc<AtomicBool>) -> Self {
        self.cancel = Some(flag);
        self
    }

    /// Calls this before every iteration, on the thread that solves. What it takes counts as time of the solve.
    #[must_use]
    pub fn on_progress(mut self, call: impl Fn(Progress) -> ControlFlow<()> + Send + Sync + 'static) -> Self {
        self.on_progress = Some(Arc::new(call));
        self
    }

    #[inline]
    pub(crate) fn is_set(&self) -> bool {
        self.cancel.is_some() || self.on_progress.is_some()
    }

    pub(crate) fn is_cancelled(&self) -> bool {
        self.cancel.as_ref().is_some_and(|flag| flag.load(Ordering::Relaxed))
    }

    /// Whether the solve is to end here.
    pub(crate) fn says_stop(&self, progress: Progress) -> bool {
        self.is_cancelled() || self.on_progress.as_ref().is_some_and(|call| call(progress).is_break())
    }
}

impl fmt::Debug for Watch {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.debug_struct("Watch")
            .field("cancel", &self.cancel)
            .field("on_progress", &self.on_progress.is_some())
            .finish()
    }
}
