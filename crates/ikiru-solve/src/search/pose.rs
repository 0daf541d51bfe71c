//! Starts of a pose, by every method.

use ikiru_rig::Pose;

use crate::layout::Layout;
use crate::method::ccd::Ccd;
use crate::method::fabrik::Fabrik;
use crate::method::{Bar, Budget, Method, Methods, Outcome, outside};
use crate::model::{Effort, PoseModel};
use crate::search::Starts;
use crate::search::seeds::Seeds;

/// Memory of the methods that know poses alone, and the poses to start from.
#[derive(Clone, Debug, Default)]
pub(crate) struct PoseStartsMemory {
    ccd: Ccd,
    fabrik: Fabrik,
    seeds: Seeds,
}

impl PoseStartsMemory {
    pub(crate) fn new(layout: &Layout) -> Self {
        Self { ccd: Ccd::new(layout), fabrik: Fabrik::new(layout), seeds: Seeds::new(layout) }
    }
}

/// Starts of a pose.
pub(crate) struct PoseStarts<'a> {
    pub(crate) model: PoseModel<'a>,
    pub(crate) memory: &'a mut PoseStartsMemory,
    /// Where joints are that do not move.
    pub(crate) pose: &'a Pose,
}

impl<'a> Starts for PoseStarts<'a> {
    type Model = PoseModel<'a>;

    #[inline(always)]
    fn model(&mut self) -> &mut PoseModel<'a> {
        &mut self.model
    }

    fn seed(&mut self, number: usize, start: &[f64]) {
        let PoseModel { layout, state, .. } = &mut self.model;
        self.memory.seeds.write(layout, number, start, &mut state.coords);
    }

    fn most_restarts(&self, wanted: usize) -> usize {
        wanted
    }

    fn improve(
        &mut self,
        method: &Method,
        methods: &mut Methods,
        cost: f64,
        bar: &Bar,
        budget: &mut Budget<'_>,
    ) -> Outcome {
        let (model, memory) = (&mut self.model, &mut *self.memory);
        match method {
            Method::Lm => methods.lm.run(model, cost, bar, budget, &mut { Effort::FULL }),
            Method::Adam(options) => methods.adam.run(options, model, cost, bar, budget),
            Method::Ccd => memory.ccd.run(model, cost, bar, budget),
            Method::Fabrik => memory.fabrik.run(model, cost, bar, budget),
            Method::Outside(method) => outside::run(*method, model, self.pose, cost, bar, budget),
        }
    }
}
