//! The forces of limits and constraints at a pose: those that balance a gradient best.
//!
//! For a gradient `g`, constraints with derivatives `aᵢ` and limits with outward normals `nₖ` these are the `yᵢ` and
//! `μₖ` of least `‖g − Σ yᵢ aᵢ + Σ μₖ nₖ‖`, where what can push and not pull has a force of at least 0. What remains is the
//! way downhill that is left. The forces depend on the pose alone, not on the steps that led there.

use glam::{DQuat, DVec3};
use ikiru_rig::JointId;

use crate::algebra::cholesky;
use crate::layout::Layout;
use crate::report::force::LimitKind;
use crate::state::State;
use crate::words::Unit;

/// How near to a limit a pose counts as on it, in radians or metres.
pub(crate) const ON_LIMIT: f64 = 1e-7;
/// Constraints that say the same share their force: the diagonal of their system grows by this part.
const SHARED: f64 = 1e-9;
/// A force of the wrong sign counts as wrong beyond this, relative to the gradient.
const SLACK: f64 = 1e-10;
/// So often all that is wrong is exchanged without getting better before one at a time is, and at all.
const PATIENCE: usize = 3;
const MOST_ROUNDS: usize = 100;

/// A limit that the pose lies on.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Limit {
    pub(crate) joint: JointId,
    pub(crate) kind: LimitKind,
    pub(crate) unit: Unit,
    /// Its first degree of freedom, and how many it spans.
    dof: usize,
    n_dofs: usize,
    /// Outward, of unit length.
    normal: DVec3,
    /// What of the normal is perpendicular to those that act before it, of unit length.
    axis: DVec3,
    /// By how much the limited number grows along the normal.
    rate: f64,
    both_ways: bool,
    acts: bool,
    /// μ, along the normal.
    pub(crate) push: f64,
}

impl Limit {
    /// The part of a vector along an axis.
    fn along(&self, axis: DVec3, vector: &[f64]) -> f64 {
        vector[self.dof..self.dof + self.n_dofs].iter().zip(axis.to_array()).map(|(v, a)| v * a).sum()
    }

    fn add(&self, axis: DVec3, factor: f64, vector: &mut [f64]) {
        let own = vector[self.dof..self.dof + self.n_dofs].iter_mut();
        own.zip(axis.to_array()).for_each(|(v, a)| *v += factor * a);
    }

    /// What a vector is by the push.
    pub(crate) fn pull(&self, vector: &[f64]) -> f64 {
        self.push * self.along(self.normal, vector)
    }

    /// How much the cost would fall for each radian or metre by which the limit gave way.
    pub(crate) fn amount(&self) -> f64 {
        self.push.abs() / self.rate
    }
}

/// A row of a constraint.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Row {
    /// Which of the rows with a force.
    pub(crate) row: usize,
    /// The part that it belongs to.
    pub(crate) part: usize,
    /// Whether it can pull as well as push.
    both_ways: bool,
    acts: bool,
    /// y
    pub(crate) force: f64,
}

/// Memory, and the forces.
#[derive(Clone, Debug, Default)]
pub(crate) struct Balance {
    /// In the order of the joints.
    pub(crate) limits: Vec<Limit>,
    pub(crate) rows: Vec<Row>,
    /// The rows that act: which, what of them limits leave, and their system.
    acting: Vec<usize>,
    projected: Vec<f64>,
    matrix: Vec<f64>,
    forces: Vec<f64>,
    /// What of the gradient is not balanced.
    pub(crate) rest: Vec<f64>,
}

impl Balance {
    pub(crate) fn new(layout: &Layout) -> Self {
        let (n, m) = (layout.n_dofs, layout.n_guards);
        Self {
            limits: Vec::with_capacity(most_limits(layout)),
            rows: Vec::with_capacity(m),
            acting: Vec::with_capacity(m),
            projected: vec![0.0; n * m],
            matrix: vec![0.0; m * m],
            forces: vec![0.0; m],
            rest: vec![0.0; n],
        }
    }

    /// Finds the limits that the pose lies on; no constraint counts yet.
    pub(crate) fn begin(&mut self, layout: &Layout, state: &State) {
        self.limits.clear();
        self.rows.clear();
        for m in &layout.movers {
            for (i, range) in m.motion.ranges().iter().enumerate() {
                let x = state.coords[m.coord + i];
                let (is_least, is_most) = (x <= range.min + ON_LIMIT, x >= range.max - ON_LIMIT);
                if is_least || is_most {
                    self.limits.push(Limit {
                        joint: m.joint,
                        kind: LimitKind::of_coordinate(&m.motion, i),
                        unit: if m.is_translation(i) { Unit::Metres } else { Unit::Radians },
                        dof: m.dof + i,
                        n_dofs: 1,
                        normal: if is_most { DVec3::X } else { DVec3::NEG_X },
                        axis: DVec3::X,
                        rate: 1.0,
                        both_ways: is_least && is_most,
                        acts: false,
                        push: 0.0,
                    });
                }
            }
            let Some(cone) = m.motion.cone() else { continue };
            let at = m.coord + m.n_coords - 4;
            let normals = cone.normals(DQuat::from_slice(&state.coords[at..at + 4]), ON_LIMIT);
            for (slot, normal) in normals.into_iter().enumerate() {
                let Some(normal) = normal else { continue };
                self.limits.push(Limit {
                    joint: m.joint,
                    kind: if slot < 2 { LimitKind::Swing } else { LimitKind::Twist },
                    unit: Unit::Radians,
                    dof: m.dof + m.n_dofs - 3,
                    n_dofs: 3,
                    normal: normal.direction,
                    axis: normal.direction,
                    rate: normal.rate,
                    both_ways: normal.both_ways,
                    acts: false,
                    push: 0.0,
                });
            }
        }
    }

    /// Has a row of a constraint take part.
    pub(crate) fn push_row(&mut self, part: usize, row: usize, both_ways: bool) {
        self.rows.push(Row { row, part, both_ways, acts: both_ways, force: 0.0 });
    }

    /// Finds the forces of least rest. Which ones act is found by exchanging all that are wrong at once, and one at a time
    /// where that does not get on.
    pub(crate) fn solve(&mut self, jacobian: &[f64], gradient: &[f64]) {
        let slack = SLACK * gradient.iter().map(|g| g * g).sum::<f64>().sqrt();
        for limit in &mut self.limits {
            limit.acts = limit.both_ways || limit.along(limit.normal, gradient) < 0.0;
        }
        let (mut least_wrong, mut patience) = (usize::MAX, PATIENCE);
        for _ in 0..MOST_ROUNDS {
            self.solve_for_acting(jacobian, gradient);
            let n_wrong = self.exchange(jacobian, slack, usize::MAX);
            if n_wrong == 0 {
                break;
            }
            let all = if n_wrong < least_wrong {
                (least_wrong, patience) = (n_wrong, PATIENCE);
                true
            } else {
                patience = patience.saturating_sub(1);
                patience > 0
            };
            self.exchange(jacobian, slack, if all { 0 } else { n_wrong - 1 });
        }
        // What is wrong by rounding alone, or after the last round.
        for limit in self.limits.iter_mut().filter(|limit| !limit.both_ways) {
            limit.push = limit.push.max(0.0);
        }
        for row in self.rows.iter_mut().filter(|row| !row.both_ways) {
            row.force = row.force.max(0.0);
        }
    }

    /// The forces of what acts now.
    fn solve_for_acting(&mut self, jacobian: &[f64], gradient: &[f64]) {
        let n = gradient.len();
        self.orthogonalise();
        self.acting.clear();
        self.acting.extend((0..self.rows.len()).filter(|row| self.rows[*row].acts));
        let m = self.acting.len();
        for (a, &row) in self.acting.iter().enumerate() {
            let own = &mut self.projected[a * n..(a + 1) * n];
            own.copy_from_slice(&jacobian[self.rows[row].row * n..][..n]);
            for limit in self.limits.iter().filter(|limit| limit.acts) {
                let along = limit.along(limit.axis, own);
                limit.add(limit.axis, -along, own);
            }
        }
        for a in 0..m {
            let own = &self.projected[a * n..(a + 1) * n];
            for b in 0..=a {
                self.matrix[a * m + b] = dot(own, &self.projected[b * n..(b + 1) * n]);
            }
            let diagonal = self.matrix[a * m + a];
            // Rows that limits hold altogether have no say.
            self.matrix[a * m + a] += (SHARED * diagonal).max(f64::MIN_POSITIVE.sqrt());
            self.forces[a] = dot(own, gradient);
        }
        let is_solved = cholesky::factor(m, &mut self.matrix[..m * m]).is_ok();
        if is_solved {
            cholesky::solve(m, &self.matrix[..m * m], &mut self.forces[..m]);
        }
        self.rest.copy_from_slice(gradient);
        self.rows.iter_mut().for_each(|row| row.force = 0.0);
        for (a, &row) in self.acting.iter().enumerate().filter(|_| is_solved) {
            let row = &mut self.rows[row];
            row.force = self.forces[a];
            let entries = &jacobian[row.row * n..][..n];
            self.rest.iter_mut().zip(entries).for_each(|(r, e)| *r -= row.force * e);
        }
        // From the last to the first: each axis is perpendicular to the normals before it.
        for limit in self.limits.iter_mut().rev() {
            limit.push = 0.0;
            if limit.acts {
                limit.push = -limit.along(limit.axis, &self.rest) / limit.axis.dot(limit.normal);
                limit.add(limit.normal, limit.push, &mut self.rest);
            }
        }
    }

    /// Makes the normals of what acts into perpendicular axes, joint by joint.
    fn orthogonalise(&mut self) {
        for k in 0..self.limits.len() {
            let (before, own) = self.limits.split_at_mut(k);
            let limit = &mut own[0];
            let mut axis = limit.normal;
            for other in before.iter().rev().take_while(|other| other.dof == limit.dof) {
                if other.acts {
                    axis -= other.axis * axis.dot(other.axis);
                }
            }
            let length = axis.length();
            // A limit that says the same as those before it has no say.
            limit.acts &= length > 1e-9;
            limit.axis = if length > 1e-9 { axis / length } else { limit.normal };
        }
    }

    /// Counts what is wrong about what acts, and exchanges all of it but the first `skipped`.
    fn exchange(&mut self, jacobian: &[f64], slack: f64, skipped: usize) -> usize {
        let n = self.rest.len();
        let mut n_wrong = 0;
        for limit in self.limits.iter_mut().filter(|limit| !limit.both_ways) {
            let is_wrong =
                if limit.acts { limit.push < -slack } else { limit.along(limit.normal, &self.rest) < -slack };
            if is_wrong {
                limit.acts ^= n_wrong >= skipped;
                n_wrong += 1;
            }
        }
        for row in self.rows.iter_mut().filter(|row| !row.both_ways) {
            let entries = &jacobian[row.row * n..][..n];
            let length = dot(entries, entries).sqrt();
            let is_wrong = if row.acts {
                row.force * length < -slack
            } else {
                dot(entries, &self.rest) > slack * length
            };
            if is_wrong {
                row.acts ^= n_wrong >= skipped;
                n_wrong += 1;
            }
        }
        n_wrong
    }
}

#[cfg(test)]
impl Balance {
    /// Whether what can push and not pull does so.
    pub(crate) fn has_signs(&self) -> bool {
        self.limits.iter().all(|limit| limit.both_ways || limit.push >= 0.0)
            && self.rows.iter().all(|row| row.both_ways || row.force >= 0.0)
    }
}

/// How many limits a pose can lie on at once.
pub(crate) fn most_limits(layout: &Layout) -> usize {
    let of =
        |m: &crate::layout::Mover| m.motion.ranges().len() + if m.motion.cone().is_some() { 3 } else { 0 };
    layout.movers.iter().map(of).sum()
}

pub(crate) fn dot(a: &[f64], b: &[f64]) -> f64 {
    a.iter().zip(b).map(|(a, b)| a * b).sum()
}
