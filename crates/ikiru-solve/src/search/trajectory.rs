//! Starts of a trajectory: other poses at its keys, the straight way between them.

use crate::algebra::room::make_room;
use crate::layout::Layout;
use crate::method::limited::{run_limited, run_unlimited};
use crate::method::{Bar, Budget, Method, Methods, Outcome};
use crate::model::Trajectory;
use crate::search::Starts;
use crate::search::seeds::Seeds;
use crate::state::motion::MotionState;

/// Most restarts of a motion that meets everything without limits on rates, and misses something inside them.
const MOST_RATE_BOUND: usize = 2;
/// Keys beside each other in the sequence of starts are so many poses apart.
const SEEDS_APART: usize = 17;

/// The poses to start from, and memory.
#[derive(Clone, Debug, Default)]
pub(crate) struct TrajectoryStartsMemory {
    seeds: Seeds,
    /// Samples between which a start goes straight.
    anchors: Vec<usize>,
}

impl TrajectoryStartsMemory {
    pub(crate) fn new(layout: &Layout) -> Self {
        Self { seeds: Seeds::new(layout), anchors: Vec::new() }
    }

    /// Takes over the samples of a motion.
    pub(crate) fn fit(&mut self, state: &MotionState) {
        // A sample may be given and have terms that read ones before it.
        make_room(&mut self.anchors, state.n_samples + state.keyed.len());
    }
}

/// Starts of a trajectory.
pub(crate) struct TrajectoryStarts<'a> {
    pub(crate) model: Trajectory<'a>,
    pub(crate) memory: &'a mut TrajectoryStartsMemory,
}

impl<'a> Starts for TrajectoryStarts<'a> {
    type Model = Trajectory<'a>;

    fn model(&mut self) -> &mut Trajectory<'a> {
        &mut self.model
    }

    /// Other poses at the keys, and the straight way between them and what is given.
    fn seed(&mut self, number: usize, start: &[f64]) {
        let (layout, state) = (self.model.layout, &mut *self.model.state);
        let TrajectoryStartsMemory { seeds, anchors } = &mut *self.memory;
        let (nc, last) = (layout.n_coords, state.n_samples - 1);
        state.coords.copy_from_slice(start);
        anchors.clear();
        anchors.extend((0..=last).filter(|t| state.is_given[*t]));
        // Runs of keyed samples share one pose: the seed of their number.
        let (mut n_runs, mut before) = (0, None);
        for i in 0..state.keyed.len() {
            let t = state.keyed[i];
            n_runs += usize::from(before.is_none_or(|b: usize| b + 1 != t));
            before = Some(t);
            if !state.is_given[t] {
                let at = t * nc..(t + 1) * nc;
                let number = number + (n_runs - 1) * SEEDS_APART;
                seeds.write(layout, number, &start[at.clone()], &mut state.coords[at]);
                anchors.push(t);
            }
        }
        anchors.sort_unstable();
        anchors.dedup();
        for pair in anchors.windows(2) {
            state.interpolate(layout, pair[0], pair[1]);
        }
        // Before the first and after the last there is nowhere to go.
        if let (Some(&first), Some(&end)) = (anchors.first(), anchors.last()) {
            for t in (0..first).chain(end + 1..=last) {
                let from = if t < first { first } else { end };
                state.coords.copy_within(from * nc..(from + 1) * nc, t * nc);
            }
        }
    }

    fn most_restarts(&self, wanted: usize) -> usize {
        if self.model.is_rate_bound { wanted.min(MOST_RATE_BOUND) } else { wanted }
    }

    fn improve(
        &mut self,
        method: &Method,
        methods: &mut Methods,
        cost: f64,
        bar: &Bar,
        budget: &mut Budget<'_>,
    ) -> Outcome {
        let model = &mut self.model;
        match method {
            Method::Adam(options) => methods.adam.run(options, model, cost, bar, budget),
            _ if model.motion.holds_rates() => run_limited(model, &mut methods.lm, cost, bar, budget),
            _ => run_unlimited(model, &mut methods.lm, cost, bar, budget),
        }
    }
}
