//! Cyclic coordinate descent: tips first, one degree of freedom after the other is set to the value that brings the
//! cost lowest while all others hold still.
//!
//! Where one point reaches for one place that value has a closed form (Wang and Chen, 1991). For any other
//! cost it is one candidate; a Gauss–Newton step along the degree of freedom, shortened until the cost falls,
//! is the other.

use ikiru_rig::Vec3;

use crate::layout::{Layout, Mover, NONE, TermLayout};
use crate::method::turn::{AxisFit, nudge, room};
use crate::method::{Bar, Budget, Outcome};
use crate::model::PoseModel;
use crate::objective::Reach;
use crate::problem::Problem;
use crate::state::State;
use crate::state::gradient::whole_gradient;
use crate::words::Loss;
use crate::words::StopReason;

/// A sweep that takes less than this part of the cost away is the last.
const LEAST_GAIN: f64 = 1e-9;
/// How often a step that does not lower the cost is halved.
const MOST_HALVINGS: usize = 6;

/// A point, its place, and the node that carries it.
#[derive(Clone, Copy, Debug)]
struct Effector {
    term: usize,
    node: u32,
    reach: Reach,
}

/// Memory of the method.
#[derive(Clone, Debug, Default)]
pub(crate) struct Ccd {
    effectors: Vec<Effector>,
    gradient: Vec<f64>,
    from: Vec<f64>,
    best: Vec<f64>,
    node_of: Vec<Option<u32>>,
}

impl Ccd {
    pub(crate) fn new(layout: &Layout) -> Self {
        let n_kept = layout.n_kept_coords();
        Self {
            effectors: Vec::with_capacity(layout.terms.len()),
            gradient: vec![0.0; layout.n_dofs],
            from: vec![0.0; n_kept],
            best: vec![0.0; n_kept],
            node_of: nodes_of_movers(layout),
        }
    }

    /// Improves the pose of a model, whose cost is `cost` and which was evaluated last.
    pub(crate) fn run(
        &mut self,
        model: &mut PoseModel<'_>,
        cost: f64,
        bar: &Bar,
        budget: &mut Budget<'_>,
    ) -> Outcome {
        let (layout, problem, state) = (model.layout, model.problem, &mut *model.state);
        let mut cost = cost;
        let mut patience = bar.patience(cost, 0.0);
        let is_closed = self.find_effectors(layout, problem);
        let outcome = |cost, stop| Outcome::new(cost, 0.0, stop, true);
        loop {
            if bar.is_met(cost) {
                return outcome(cost, StopReason::Reached);
            }
            if let Some(stop) = budget.spend(state.memory.failure.is_some(), cost) {
                return outcome(cost, stop);
            }
            let before = cost;
            for m in (0..layout.movers.len()).rev() {
                for k in (0..layout.movers[m].n_dofs).rev() {
                    cost = self.descend(layout, problem, state, m, k, cost, is_closed);
                    if bar.is_met(cost) {
                        return outcome(cost, StopReason::Reached);
                    }
                }
            }
            if before - cost <= LEAST_GAIN * before {
                return outcome(cost, StopReason::Converged);
            }
            if patience.is_over(cost, 0.0) {
                return outcome(cost, StopReason::NoProgress);
            }
        }
    }

    /// Collects the points that terms reach for. Says whether one of them is all there is, so that its distance
    /// alone decides.
    fn find_effectors(&mut self, layout: &Layout, problem: &Problem) -> bool {
        self.effectors.clear();
        for t in layout.terms.iter().filter(|t| problem.terms()[t.term].is_on) {
            if let Some(reach) = problem.terms()[t.term].objective.reach() {
                self.effectors.push(Effector { term: t.term, node: t.nodes[reach.frame], reach });
            }
        }
        let on = || layout.terms.iter().filter(|t| problem.terms()[t.term].is_on);
        let is_alone = on().count() == 1;
        let is_sum_of_squares = |t: &TermLayout| {
            let is_one = t.parts.len() == 1 && t.joint_reads.is_empty();
            is_one && (is_alone || problem.terms()[t.term].loss == Loss::Squared)
        };
        self.effectors.len() == on().count() && on().all(is_sum_of_squares)
    }

    /// Moves one degree of freedom; the answer is the cost afterwards, at which `state` is evaluated.
    fn descend(
        &mut self,
        layout: &Layout,
        problem: &Problem,
        state: &mut State,
        mover: usize,
        k: usize,
        cost: f64,
        is_closed: bool,
    ) -> f64 {
        let m = &layout.movers[mover];
        let range = room(layout, m, k, &state.coords);
        self.from.copy_from_slice(&state.coords);
        let mut best = cost;
        let closed = self.node_of[mover].map(|node| self.turn(layout, problem, state, m, node, k, range));
        if let Some(delta) = closed
            && delta != 0.0
        {
            self.attempt(layout, problem, state, m, k, delta, &mut best);
            // For a ball the limit is not a range: the best turn may end beyond the cone.
            let is_exact = is_closed && m.n_coords == m.n_dofs;
            if is_exact {
                return self.finish(layout, problem, state, best, cost);
            }
        } else if closed.is_some() && is_closed {
            return cost;
        }
        let after_turn = best;
        state.coords.copy_from_slice(&self.from);
        if closed.is_some() {
            state.evaluate(layout, problem);
        }
        let mut delta = self.newton(layout, problem, state, m.dof + k).max(range.0).min(range.1);
        for _ in 0..MOST_HALVINGS {
            if delta.abs() < 1e-12 {
                break;
            }
            self.attempt(layout, problem, state, m, k, delta, &mut best);
            if best < after_turn {
                break;
            }
            delta *= 0.5;
        }
        self.finish(layout, problem, state, best, cost)
    }

    /// Tries a change of one degree of freedom and keeps it in `best` where it is better.
    fn attempt(
        &mut self,
        layout: &Layout,
        problem: &Problem,
        state: &mut State,
        m: &Mover,
        k: usize,
        delta: f64,
        best: &mut f64,
    ) {
        state.coords.copy_from_slice(&self.from);
        nudge(m, k, delta, &mut state.coords);
        let trial = state.evaluate(layout, problem);
        if trial < *best {
            *best = trial;
            self.best.copy_from_slice(&state.coords);
        }
    }

    /// Leaves the best attempt in `state`, evaluated.
    fn finish(&self, layout: &Layout, problem: &Problem, state: &mut State, best: f64, cost: f64) -> f64 {
        let coords = if best < cost { &self.best } else { &self.from };
        if state.coords != *coords {
            state.coords.copy_from_slice(coords);
            // What gives up in between does not spoil what is known.
            return state.evaluate(layout, problem).min(best.min(cost));
        }
        best.min(cost)
    }

    /// The turn (or shift) that brings the points below a joint nearest to their places.
    fn turn(
        &self,
        layout: &Layout,
        problem: &Problem,
        state: &State,
        m: &Mover,
        node: u32,
        k: usize,
        range: (f64, f64),
    ) -> f64 {
        let origin = state.frames()[node as usize].origin;
        let axis = state.directions(&layout.nodes[node as usize])[k];
        let mut fit = AxisFit::default();
        for effector in self.effectors.iter().filter(|e| is_below(layout, e.node, node)) {
            let Reach { point, target, .. } = effector.reach;
            let now = state.frames()[effector.node as usize].point(Vec3::constant(point));
            let weight = problem.terms()[effector.term].weight;
            fit.add(weight, axis, now - origin, Vec3::constant(target) - origin);
        }
        if m.is_translation(k) { fit.best_shift(range) } else { fit.best_turn(range) }
    }

    /// The Gauss–Newton step along one degree of freedom.
    fn newton(&mut self, layout: &Layout, problem: &Problem, state: &mut State, dof: usize) -> f64 {
        state.linearize(layout, problem, false);
        whole_gradient(layout, state, 0.0, &mut self.gradient);
        let span = layout.spans[dof];
        let column = &state.jacobian[span.start..span.start + span.len];
        let curvature = state.own_curvature[dof] + column.iter().map(|a| a * a).sum::<f64>();
        if curvature > 0.0 { -0.5 * self.gradient[dof] / curvature } else { 0.0 }
    }
}

/// The node of each mover, where it has exactly one.
fn nodes_of_movers(layout: &Layout) -> Vec<Option<u32>> {
    let of = |m: &Mover| {
        let mut nodes = (0..layout.nodes.len()).filter(|n| {
            let node = &layout.nodes[*n];
            node.n_screws > 0 && node.coord as usize == m.coord
        });
        let only = nodes.next().filter(|n| layout.nodes[*n].mimic.is_none())?;
        nodes.next().is_none().then(|| u32::try_from(only).unwrap_or(NONE))
    };
    layout.movers.iter().map(of).collect()
}

/// Whether a node is another or lies below it.
pub(crate) fn is_below(layout: &Layout, node: u32, top: u32) -> bool {
    // Parents come before children.
    let mut at = node;
    while at != NONE && at > top {
        at = layout.nodes[at as usize].parent;
    }
    at == top
}
