//! `[stop]`: when a solve ends.

use std::time::Duration;

use ikiru_solve::{Method, Search, SolverOptions};
use serde::Serialize;

use crate::at::At;
use crate::error::Error;
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

const KEYS: [&str; 4] = ["cost_below", "max_iterations", "max_restarts", "max_time_ms"];
const ITERATIONS: &str = "a whole number of at least 1";
const DEFAULT_RESTARTS: usize = 64;

impl StopKeys {
    pub(crate) fn read(table: &Table<'_>) -> Result<Self, Error> {
        table.only(&KEYS)?;
        let number = |key: &str| table.get(key).map(|value| value.number()).transpose();
        let count = |key, expected| table.get(key).map(|value| value.count(expected)).transpose();
        Ok(Self {
            cost_below: number("cost_below")?,
            max_iterations: count("max_iterations", ITERATIONS)?,
            max_restarts: count("max_restarts", "a whole number of at least 0")?,
            max_time_ms: number("max_time_ms")?,
        })
    }

    /// The solver's options. `at` is the table `[stop]`.
    pub(crate) fn options(&self, method: Method, at: &At<'_>) -> Result<SolverOptions, Error> {
        let mut options = SolverOptions {
            method,
            search: Search::Global { max_restarts: DEFAULT_RESTARTS },
            ..SolverOptions::default()
        };
        if let Some(cost) = self.cost_below {
            number_that(cost, &at.key("cost_below"), |n| n > 0.0, "a number above 0")?;
            options.cost_below = Some(cost);
        }
        if let Some(most) = self.max_iterations {
            number_that(f64::from(most), &at.key("max_iterations"), |n| n >= 1.0, ITERATIONS)?;
            options.max_iterations = most as usize;
        }
        if let Some(most) = self.max_restarts {
            options.search =
                if most == 0 { Search::Local } else { Search::Global { max_restarts: most as usize } };
        }
        if let Some(ms) = self.max_time_ms {
            const DAY_MS: f64 = 86_400_000.0;
            let expected = "milliseconds, above 0 and at most a day";
            number_that(ms, &at.key("max_time_ms"), |n| n > 0.0 && n <= DAY_MS, expected)?;
            options.max_time = Some(Duration::from_secs_f64(ms / 1000.0));
        }
        Ok(options)
    }
}
