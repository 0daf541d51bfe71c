//! Methods that improve a single start of any model; the baselines know poses alone.

pub(crate) mod adam;
mod bar;
mod budget;
pub(crate) mod ccd;
pub(crate) mod fabrik;
pub(crate) mod limited;
pub(crate) mod lm;
mod options;
mod outcome;
pub(crate) mod outside;
mod settling;
mod turn;

pub(crate) use bar::Bar;
pub(crate) use budget::{Budget, Clock};
pub use options::{AdamOptions, Method, Search, Settle, SolverOptions};
pub(crate) use outcome::{HELD, Outcome};
pub use outside::{PoseMethod, Start};

use adam::Adam;
use lm::Lm;

/// Memory of the methods.
#[derive(Clone, Debug, Default)]
pub(crate) struct Methods {
    pub(crate) lm: Lm,
    pub(crate) adam: Adam,
}

impl Methods {
    /// Makes room for so many coordinates and tangents.
    pub(crate) fn fit(&mut self, n_coords: usize, n_tangents: usize) {
        self.lm.fit(n_coords);
        self.adam.fit(n_coords, n_tangents);
    }
}
