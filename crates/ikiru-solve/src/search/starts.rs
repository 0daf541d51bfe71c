//! Where a search begins anew, and how a start is improved: what poses and motions differ in.

use crate::method::{Bar, Budget, Method, Methods, Outcome};
use crate::model::Model;

/// Starts of a model.
pub(crate) trait Starts {
    /// What is started.
    type Model: Model;

    /// The model, where it is now.
    fn model(&mut self) -> &mut Self::Model;

    /// Moves the model to other coordinates to start from, by number. `start` is where the first start was.
    fn seed(&mut self, number: usize, start: &[f64]);

    /// At most so many restarts are worth it after what came of the first start.
    fn most_restarts(&self, wanted: usize) -> usize;

    /// Improves the model, whose cost is `cost` and which was evaluated last, by a method.
    fn improve(
        &mut self,
        method: &Method,
        methods: &mut Methods,
        cost: f64,
        bar: &Bar,
        budget: &mut Budget<'_>,
    ) -> Outcome;
}
