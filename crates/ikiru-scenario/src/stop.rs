//! `[stop]`: when a solve ends.

use std::time::Duration;

use ikiru_solve::{Method, Search, Settle, SolverOptions};
use serde::Serialize;

use crate::at::At;
use crate::error::Error;
use crate::key::Key;
use crate::table::Table;
use crate::values::number_that;

/// The stopping rules of a scenario.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize)]
pub struct StopKeys {
    /// Success is a cost below this, above 0; left out, every objective within its tolerance.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub cost_below: Option<f64>,
    /// Of one start, at least 1; 500 by default.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub max_iterations: Option<u32>,
    /// 64 by default; 0 is a local search.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub max_restarts: Option<u32>,
    /// Milliseconds, above 0 and at most a day; left out, none.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub max_time_ms: Option<f64>,
}

const COST_BELOW: Key = Key::new(
    "cost_below",
    "a number above 0",
    "Success is a cost below this, in the place of every objective within its tolerance.",
)
.or_as("tolerances decide");
const MAX_ITERATIONS: Key = Key::new(
    "max_iterations",
    "a whole number of at least 1",
    "How many steps a start may take; that of a motion as many before even spacing, and in each of up to 40 rounds inside limits on speed and acceleration.",
)
.or("500");
const MAX_RESTARTS: Key = Key::new(
    "max_restarts",
    "a whole number of at least 0",
    "How many other starts a search may take; 0 improves the given start alone, as frame by frame.",
)
.or("64");
const MAX_TIME_MS: Key = Key::new(
    "max_time_ms",
    "milliseconds, above 0 and at most a day",
    "When to stop with the best that was found.",
)
.or_as("no limit");
/// The keys of `[stop]`.
pub(crate) const KEYS: [Key; 4] = [COST_BELOW, MAX_ITERATIONS, MAX_RESTARTS, MAX_TIME_MS];
const DEFAULT_RESTARTS: usize = 64;

impl StopKeys {
    pub(crate) fn read(table: &Table<'_>) -> Result<Self, Error> {
        table.only(&KEYS)?;
        let number = |key| table.get(key).map(|value| value.number()).transpose();
        let count = |key| table.get(key).map(|value| value.count()).transpose();
        Ok(Self {
            cost_below: number(&COST_BELOW)?,
            max_iterations: count(&MAX_ITERATIONS)?,
            max_restarts: count(&MAX_RESTARTS)?,
            max_time_ms: number(&MAX_TIME_MS)?,
        })
    }

    /// The solver's options. `at` is the table `[stop]`.
    pub(crate) fn options(&self, method: Method, at: &At<'_>) -> Result<SolverOptions, Error> {
        let mut options = SolverOptions {
            method,
            search: Search::Global { max_restarts: DEFAULT_RESTARTS },
            settle: Settle::Fully,
            ..SolverOptions::default()
        };
        if let Some(cost) = self.cost_below {
            number_that(cost, &at.key(COST_BELOW.name), |n| n > 0.0, COST_BELOW.takes)?;
            options.cost_below = Some(cost);
        }
        if let Some(most) = self.max_iterations {
            let at = at.key(MAX_ITERATIONS.name);
            number_that(f64::from(most), &at, |n| n >= 1.0, MAX_ITERATIONS.takes)?;
            options.max_iterations = most as usize;
        }
        if let Some(most) = self.max_restarts {
            options.search =
                if most == 0 { Search::Local } else { Search::Global { max_restarts: most as usize } };
        }
        if let Some(ms) = self.max_time_ms {
            const DAY_MS: f64 = 86_400_000.0;
            number_that(ms, &at.key(MAX_TIME_MS.name), |n| n > 0.0 && n <= DAY_MS, MAX_TIME_MS.takes)?;
            options.max_time = Some(Duration::from_secs_f64(ms / 1000.0));
        }
        Ok(options)
    }
}
