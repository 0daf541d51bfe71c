//! FABRIK: forward and backward reaching (Aristidou and Lasenby, 2011), on trees with several effectors.
//!
//! One iteration moves the joints' positions alone, from the effectors to the root and back, so that every segment keeps
//! its length; then, from the root outwards, each joint turns inside its limits to bring what lies below it
//! nearest to those positions. The next iteration starts from where that led, and the cheapest pose is kept.

use ikiru_rig::{JointMotion, Vec3};

use crate::layout::{Layout, Mover, NONE, Node};
use crate::method::turn::{AxisFit, nudge, room};
use crate::method::{Bar, Budget, Outcome};
use crate::model::PoseModel;
use crate::objective::Reach;
use crate::problem::Problem;
use crate::state::State;
use crate::words::StopReason;

/// How often the degrees of freedom of one joint are gone through in each iteration; each is at its best
/// while the others hold still.
const PASSES: usize = 2;
/// What a position further down counts beside those at the end of a joint's own segment: little, but it
/// decides the turn about the segment, on which hinges further down depend.
const FURTHER_DOWN: f64 = 0.05;
/// An iteration that moves no coordinate by more than this is the last.
const LEAST_MOVE: f64 = 1e-10;

/// A point, its place, and the node that carries it.
#[derive(Clone, Copy, Debug)]
struct Effector {
    node: u32,
    weight: f64,
    reach: Reach,
}

/// Memory of the method.
#[derive(Clone, Debug, Default)]
pub(crate) struct Fabrik {
    effectors: Vec<Effector>,
    /// Where the nodes are, and where reaching wants them.
    origins: Vec<Vec3<f64>>,
    wanted: Vec<Vec3<f64>>,
    /// How much asks for a node; 0 where no effector lies below.
    weights: Vec<f64>,
    before: Vec<f64>,
    best: Vec<f64>,
}

impl Fabrik {
    pub(crate) fn new(layout: &Layout) -> Self {
        let n = layout.nodes.len();
        Self {
            effectors: Vec::with_capacity(layout.terms.len()),
            origins: vec![Vec3::zero(); n],
            wanted: vec![Vec3::zero(); n],
            weights: vec![0.0; n],
            before: vec![0.0; layout.n_kept_coords()],
            best: vec![0.0; layout.n_kept_coords()],
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
        self.find_effectors(layout, problem);
        self.best.copy_from_slice(&state.coords);
        let (mut best, mut cost) = (cost, cost);
        let mut patience = bar.patience(cost, 0.0);
        let stop = loop {
            if bar.is_met(cost) {
                break StopReason::Reached;
            }
            if let Some(stop) = budget.spend(state.memory.failure.is_some(), best) {
                break stop;
            }
            self.before.copy_from_slice(&state.coords);
            self.reach_backward(layout, state);
            self.reach_forward(layout, state);
            self.turn_joints(layout, state);
            cost = state.evaluate(layout, problem);
            if cost < best {
                best = cost;
                self.best.copy_from_slice(&state.coords);
            }
            let moved = self.before.iter().zip(&state.coords).map(|(a, b)| (a - b).abs());
            if moved.fold(0.0, f64::max) <= LEAST_MOVE {
                // Positions are where reaching wants them, or the limits let them no nearer.
                break StopReason::NoProgress;
            }
            if patience.is_over(best, 0.0) {
                break StopReason::NoProgress;
            }
        };
        state.coords.copy_from_slice(&self.best);
        Outcome::new(best, 0.0, stop, false)
    }

    fn find_effectors(&mut self, layout: &Layout, problem: &Problem) {
        self.effectors.clear();
        for t in &layout.terms {
            let term = &problem.terms()[t.term];
            if let Some(reach) = term.objective.reach()
                && term.is_on
                && term.weight > 0.0
            {
                let node = t.nodes[reach.frame];
                self.effectors.push(Effector { node, weight: term.weight, reach });
            }
        }
    }

    /// From the effectors to the root: each node goes where the segments below it want its end, the mean of
    /// them where several meet.
    fn reach_backward(&mut self, layout: &Layout, state: &State) {
        self.weights.fill(0.0);
        self.wanted.fill(Vec3::zero());
        for (origin, frame) in self.origins.iter_mut().zip(state.frames()) {
            *origin = frame.origin;
        }
        for e in &self.effectors {
            let node = e.node as usize;
            let length = e.reach.point.length();
            let at = beside(Vec3::constant(e.reach.target), self.origins[node], length);
            self.wanted[node] += at * e.weight;
            self.weights[node] += e.weight;
        }
        for idx in (0..layout.nodes.len()).rev() {
            let weight = self.weights[idx];
            if weight == 0.0 {
                continue;
            }
            self.wanted[idx] = self.wanted[idx] * (1.0 / weight);
            let node = &layout.nodes[idx];
            if node.parent != NONE {
                let parent = node.parent as usize;
                // What a slider can slide, its parent need not follow.
                let from =
                    self.wanted[idx] - slide(layout, state, node, self.wanted[idx] - self.origins[idx]);
                let length = self.origins[idx].distance(self.origins[parent]);
                self.wanted[parent] += beside(from, self.origins[parent], length) * weight;
                self.weights[parent] += weight;
            }
        }
    }

    /// From the root outwards: what cannot move stays, and each segment gets its length back.
    fn reach_forward(&mut self, layout: &Layout, state: &State) {
        for (idx, node) in layout.nodes.iter().enumerate() {
            if self.weights[idx] == 0.0 || matches!(node.motion, JointMotion::Free { .. }) {
                continue;
            }
            let shift = slide(layout, state, node, self.wanted[idx] - self.origins[idx]);
            let end = if node.parent == NONE {
                self.origins[idx]
            } else {
                let parent = node.parent as usize;
                let length = self.origins[idx].distance(self.origins[parent]);
                beside(self.wanted[parent], self.wanted[idx] - shift, length)
            };
            self.wanted[idx] = end + shift;
        }
    }

    /// From the root outwards: each joint turns, inside its limits, towards the wanted positions below it.
    fn turn_joints(&self, layout: &Layout, state: &mut State) {
        for idx in 0..layout.nodes.len() {
            state.place(layout, idx);
            let Some(m) = mover_of(layout, &layout.nodes[idx]) else { continue };
            if self.weights[idx] == 0.0 {
                continue;
            }
            let n_passes = if m.n_dofs > 1 { PASSES } else { 1 };
            for _ in 0..n_passes {
                for k in 0..m.n_dofs {
                    let delta = self.turn(layout, state, m, idx, k);
                    if delta != 0.0 {
                        nudge(m, k, delta, &mut state.coords);
                        self.place_from(layout, state, idx);
                    }
                }
            }
        }
    }

    /// Places a node and everything below it that an effector asks for.
    fn place_from(&self, layout: &Layout, state: &mut State, top: usize) {
        state.place(layout, top);
        for idx in top + 1..layout.nodes.len() {
            // Below a node lies one run of nodes, which ends at the first whose parent stands before the top.
            let parent = layout.nodes[idx].parent;
            if parent == NONE || (parent as usize) < top {
                break;
            }
            state.place(layout, idx);
        }
    }

    /// How far one degree of freedom of a node turns (or shifts).
    fn turn(&self, layout: &Layout, state: &State, m: &Mover, idx: usize, k: usize) -> f64 {
        let range = room(layout, m, k, &state.coords);
        let axis = state.directions(&layout.nodes[idx])[k];
        let origin = state.frames()[idx].origin;
        let mut fit = AxisFit::default();
        if m.is_translation(k) {
            // What moves along an axis carries its own origin with it.
            fit.add(1.0, axis, Vec3::zero(), self.wanted[idx] - origin);
            return fit.best_shift(range);
        }
        for e in self.effectors.iter().filter(|e| e.node as usize == idx) {
            let now = state.frames()[idx].point(Vec3::constant(e.reach.point));
            fit.add(e.weight, axis, now - origin, Vec3::constant(e.reach.target) - origin);
        }
        for below in idx + 1..layout.nodes.len() {
            let parent = layout.nodes[below].parent;
            if parent == NONE || (parent as usize) < idx {
                break;
            }
            if self.weights[below] > 0.0 {
                let near = if parent as usize == idx { 1.0 } else { FURTHER_DOWN };
                let now = state.frames()[below].origin;
                fit.add(near * self.weights[below], axis, now - origin, self.wanted[below] - origin);
            }
        }
        fit.best_turn(range)
    }
}

/// The part of a way (metres, world axes) that a node's own slider can go.
fn slide(layout: &Layout, state: &State, node: &Node, way: Vec3<f64>) -> Vec3<f64> {
    let JointMotion::Slider { .. } = node.motion else { return Vec3::zero() };
    let Some(m) = mover_of(layout, node) else { return Vec3::zero() };
    let (down, up) = room(layout, m, 0, &state.coords);
    let axis = state.directions(node)[0];
    axis * axis.dot(way).max(down).min(up)
}

/// The mover that a node's coordinates belong to; none for a node that does not move, or follows another.
fn mover_of<'a>(layout: &'a Layout, node: &Node) -> Option<&'a Mover> {
    if node.n_screws == 0 || node.mimic.is_some() {
        return None;
    }
    layout.movers.iter().find(|m| m.coord == node.coord as usize)
}

/// The point at a distance from `from`, on the side of `towards`; `from` itself where that has no side.
fn beside(from: Vec3<f64>, towards: Vec3<f64>, distance: f64) -> Vec3<f64> {
    let along = towards - from;
    let length = along.length();
    if length > 1e-12 { from + along * (distance / length) } else { from }
}
