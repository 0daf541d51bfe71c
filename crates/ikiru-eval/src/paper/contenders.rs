//! The methods, as the tables name them.

use ikiru_solve::{AdamOptions, Method, Search, SolverOptions};

use crate::error::Error;
use crate::paper::task::COST_BELOW;

/// A row of the tables: a method and how it searches.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Contender {
    /// One word, as the command and the rows name it.
    pub name: &'static str,
    method: Method,
    /// Whether it starts again where a start fails. All others have one start, as in the paper.
    pub(super) has_restarts: bool,
}

/// Every contender of this build.
pub const CONTENDERS: &[Contender] = &[
    Contender { name: "lm", method: Method::Lm, has_restarts: true },
    Contender { name: "lm-local", method: Method::Lm, has_restarts: false },
    Contender { name: "adam", method: Method::Adam(AdamOptions::DEFAULT), has_restarts: false },
    Contender { name: "ccd", method: Method::Ccd, has_restarts: false },
    Contender { name: "fabrik", method: Method::Fabrik, has_restarts: false },
    #[cfg(feature = "ipopt")]
    Contender { name: "ipopt", method: ikiru_ipopt::IPOPT, has_restarts: false },
];

impl Contender {
    /// Whether it plans trajectories too.
    #[must_use]
    pub fn plans(&self) -> bool {
        matches!(self.method, Method::Lm | Method::Adam(_))
    }

    /// The contender of that name.
    ///
    /// # Errors
    /// An unknown name, which is answered with those that this build has.
    pub fn from_name(name: &str) -> Result<Self, Error> {
        CONTENDERS.iter().find(|c| c.name == name).copied().ok_or_else(|| {
            let mut known: Vec<&str> = CONTENDERS.iter().map(|c| c.name).collect();
            if !cfg!(feature = "ipopt") {
                known.push("ipopt (in a build with the feature ipopt)");
            }
            Error::Unknown { what: "method", name: name.to_owned(), known: known.join(", ") }
        })
    }

    /// The paper's stopping rules: a cost below 0.005, at most 500 iterations a start.
    #[must_use]
    pub fn options(&self, max_restarts: usize) -> SolverOptions {
        let search = if self.has_restarts && max_restarts > 0 {
            Search::Global { max_restarts }
        } else {
            Search::Local
        };
        SolverOptions {
            method: self.method,
            search,
            cost_below: Some(COST_BELOW),
            max_iterations: 500,
            ..SolverOptions::default()
        }
    }
}
