//! `check_jacobian`: derivatives against central differences, for every objective that exists.

use ikiru_rig::{JointId, Pose};

use crate::layout::Layout;
use crate::objective::Unfit;
use crate::problem::Problem;
use crate::state::State;
use crate::state::gradient::whole_gradient;
use crate::words::Loss;

/// A derivative that does not agree with central differences.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum CheckError {
    /// An entry of the Jacobian differs.
    #[error(
        "term {term}, row {row}: the derivative by degree of freedom {dof} of joint {joint:?} is {exact}, by central differences {numeric}"
    )]
    Differs {
        /// The term.
        term: usize,
        /// The row of its residual.
        row: usize,
        /// The joint.
        joint: JointId,
        /// Which of the joint's degrees of freedom.
        dof: usize,
        /// What the objective gave.
        exact: f64,
        /// What central differences give.
        numeric: f64,
    },
    /// An entry of the gradient of the cost differs, weights and losses included.
    #[error(
        "the gradient of the cost by degree of freedom {dof} of joint {joint:?} is {exact}, by central differences {numeric}"
    )]
    Gradient {
        /// The joint.
        joint: JointId,
        /// Which of the joint's degrees of freedom.
        dof: usize,
        /// What the solver descends along.
        exact: f64,
        /// What central differences give.
        numeric: f64,
    },
    /// What a potential says of its curvature along a direction is less than there is.
    #[error(
        "the curvature of the potentials along degree of freedom {dof} of joint {joint:?} is at most {bound}, by central differences it is {numeric}"
    )]
    Curvature {
        /// The joint.
        joint: JointId,
        /// Which of the joint's degrees of freedom.
        dof: usize,
        /// The bound.
        bound: f64,
        /// What central differences give.
        numeric: f64,
    },
    /// A term is not usable.
    #[error("term {0} {1}")]
    Invalid(usize, Unfit),
    /// An objective gave up, and why.
    #[error("term {0} {1}")]
    Failed(usize, &'static str),
    /// The pose belongs to another rig.
    #[error("the pose belongs to another rig than the problem")]
    Pose,
}

/// Step of the differences, in radians or metres.
const STEP: f64 = 1e-5;

/// Step of the differences that measure curvature.
const WIDE_STEP: f64 = 1e-3;

/// How short a residual may be under a loss that has a kink at 0, for the gradient to be compared too.
const NEAR_KINK: f64 = 100.0 * STEP;

/// Compares the derivative of every term by every degree of freedom with central differences at a pose, and the
/// gradient of the cost, weights and losses included. `tolerance` is relative to 1 plus the entry; 1e-6 suits smooth
/// objectives. Where a residual under [`Loss::Norm`] is shorter than a millimetre (or a thousandth of a radian), the
/// cost has a kink nearby, and its gradient is not compared.
///
/// # Errors
/// The first entry that differs, or what is wrong with the problem.
pub fn check_jacobian(problem: &Problem, pose: &Pose, tolerance: f64) -> Result<(), CheckError> {
    let layout = Layout::new(problem).map_err(|(term, unfit)| CheckError::Invalid(term, unfit))?;
    if !pose.rig().is_same(problem.rig()) {
        return Err(CheckError::Pose);
    }
    let mut state = State::new(&layout);
    state.load(&layout, pose);
    let cost = state.evaluate(&layout, problem);
    if let Some((term, reason)) = state.memory.failure {
        return Err(CheckError::Failed(term, reason));
    }
    let mut gradient = vec![0.0; layout.n_dofs];
    let is_kinked = layout.terms.iter().any(|t| {
        let loss = problem.terms()[t.term].loss;
        let is_short = |part| state.squares[part] < NEAR_KINK * NEAR_KINK;
        !t.is_hard && loss == Loss::Norm && t.parts.clone().any(is_short)
    });
    if !is_kinked {
        let mut weighted = state.clone();
        weighted.linearize(&layout, problem, false);
        whole_gradient(&layout, &weighted, 0.0, &mut gradient);
    }
    state.linearize(&layout, problem, true);
    let start = state.coords.clone();
    let only_potentials = layout.terms.iter().all(|t| t.has_potential && t.parts.is_empty());
    let mut tangent = vec![0.0; layout.n_dofs];
    for mover in &layout.movers {
        for k in 0..mover.n_dofs {
            let dof = mover.dof + k;
            let mut shifted = |step: f64| {
                tangent[dof] = step;
                let mut at = state.clone();
                // Not `step`: limits must not hold the difference back.
                let coords = &mut at.coords[mover.coord..mover.coord + mover.n_coords];
                coords.copy_from_slice(&start[mover.coord..mover.coord + mover.n_coords]);
                ikiru_rig::retract_joint(
                    &mover.motion,
                    coords,
                    &tangent[mover.dof..mover.dof + mover.n_dofs],
                );
                let cost = at.evaluate(&layout, problem);
                tangent[dof] = 0.0;
                (at, cost)
            };
            let ((ahead, cost_ahead), (behind, cost_behind)) = (shifted(STEP), shifted(-STEP));
            let differs = |term, row, exact: f64, numeric: f64| {
                if (exact - numeric).abs() <= tolerance * (1.0 + exact.abs()) {
                    return Ok(());
                }
                Err(CheckError::Differs { term, row, joint: mover.joint, dof: k, exact, numeric })
            };
            for t in &layout.terms {
                for part in &layout.parts[t.parts.clone()] {
                    for row in 0..part.n_rows {
                        let exact = state.entry(&layout, t, part, row, dof);
                        let at = part.row + row;
                        let numeric = (ahead.residual[at] - behind.residual[at]) / (2.0 * STEP);
                        differs(t.term, part.slot + row, exact, numeric)?;
                    }
                }
            }
            let (exact, numeric) = (gradient[dof], (cost_ahead - cost_behind) / (2.0 * STEP));
            if !is_kinked && (exact - numeric).abs() > tolerance * (1.0 + exact.abs()) {
                return Err(CheckError::Gradient { joint: mover.joint, dof: k, exact, numeric });
            }
            if only_potentials {
                let ((_, ahead), (_, behind)) = (shifted(WIDE_STEP), shifted(-WIDE_STEP));
                let numeric = (ahead - 2.0 * cost + behind) / (WIDE_STEP * WIDE_STEP);
                let bound = 2.0 * state.own_curvature[dof];
                if numeric > bound + 1e-3 * (1.0 + bound.abs()) {
                    return Err(CheckError::Curvature { joint: mover.joint, dof: k, bound, numeric });
                }
            }
        }
    }
    Ok(())
}

#[cfg(test)]
pub(crate) use tests::{check_on_random_rigs, check_on_whole_rigs, residual_at, told_at};

#[cfg(test)]
mod tests {
    use ikiru_rig::{Frame, Rig};
    use ikiru_testkit::rigs::{Random, random_pose, random_rig};

    use super::*;
    use crate::layout::{PartLayout, Place, TermLayout};
    use crate::objective::{Objective, Reads, RowMemory, Rows, TermWarning, View};
    use crate::objectives::Position;
    use crate::words::Unit;
    use glam::DVec3;

    /// The residual of an objective for given frames of the first joints, as many as it reads.
    pub(crate) fn residual_at(objective: &(impl Objective + Clone), frames: &[Frame<f64>]) -> Vec<f64> {
        told_at(objective, frames).0
    }

    /// The same, and what it finds odd.
    pub(crate) fn told_at(
        objective: &(impl Objective + Clone),
        frames: &[Frame<f64>],
    ) -> (Vec<f64>, Option<TermWarning>) {
        let mut problem = Problem::new(&random_rig(8, 0), []).unwrap();
        problem.add(1.0, objective.clone());
        let layout = Layout::new(&problem).unwrap();
        let t = &layout.terms[0];
        let mut residual = vec![f64::NAN; layout.n_all_rows()];
        let mut memory = RowMemory::default();
        let view = View { frames, earlier: &[], motions: &[], coords: &[] };
        let parts = &layout.parts[t.parts.clone()];
        objective.evaluate(&view, &mut Rows::new(&mut residual, t, parts, &mut memory, false));
        let of_part = |part: &PartLayout| residual[part.row..part.row + part.n_rows].to_vec();
        (parts.iter().flat_map(of_part).collect(), memory.warning)
    }

    /// Checks an objective made for two random joints, on random trees with every joint motion, at many
    /// poses inside the limits and at the limits themselves.
    pub(crate) fn check_on_random_rigs<T: Objective + Clone>(make: impl Fn(&[JointId], &mut Random) -> T) {
        check_on_whole_rigs(|rig, random| {
            let joints = [0, 1].map(|_| JointId::from_index(random.below(rig.n_joints())));
            make(&joints, random)
        });
    }

    pub(crate) fn check_on_whole_rigs<T: Objective + Clone>(make: impl Fn(&Rig, &mut Random) -> T) {
        let mut random = Random::new(7);
        for case in 0..120 {
            let rig = random_rig(1 + random.below(14), case);
            let mut problem = Problem::whole_body(&rig);
            let objective = make(&rig, &mut random);
            let weight = random.between(0.1, 2.0);
            let id = problem.add(weight, objective);
            problem.term_mut(id).loss =
                [Loss::Squared, Loss::Norm, Loss::Huber { width: 0.3 }][random.below(3)];
            for at_limits in [false, true] {
                let mut pose = random_pose(&rig, &mut random);
                if at_limits {
                    let far: Vec<f64> = (0..rig.n_dofs()).map(|_| random.between(-4.0, 4.0)).collect();
                    pose.retract(&far).unwrap();
                    pose.project();
                }
                if let Err(error) = check_jacobian(&problem, &pose, 2e-5) {
                    assert!(is_near_cut(&problem, &pose, &error), "case {case}: {error}");
                }
            }
        }
    }

    /// Whether an angle that the error is about is within a hundredth of its cut at π, where there is no difference to
    /// compare with.
    fn is_near_cut(problem: &Problem, pose: &Pose, error: &CheckError) -> bool {
        let layout = Layout::new(problem).unwrap();
        let mut state = State::new(&layout);
        state.load(&layout, pose);
        state.evaluate(&layout, problem);
        state.linearize(&layout, problem, true);
        let is_cut = |t: &TermLayout, part: &PartLayout, row: usize| {
            let length = match part.place {
                Place::Own { first } => {
                    // The rows of one joint, which are scaled by how many joints there are.
                    let motion = |row: usize| state.memory.own_motion[first + row];
                    let of_joint = (0..part.n_rows).filter(|other| motion(*other) == motion(row));
                    let square: f64 = of_joint.map(|row| state.residual[part.row + row].powi(2)).sum();
                    (square * t.joint_reads.len() as f64).sqrt()
                }
                Place::Step | Place::Guard { .. } => {
                    let rows = &state.residual[part.row..part.row + part.n_rows];
                    rows.iter().map(|r| r * r).sum::<f64>().sqrt()
                }
            };
            part.unit == Unit::Radians && length > 3.13
        };
        let wrong = |slot: usize| match error {
            CheckError::Differs { row, .. } => *row == slot,
            CheckError::Gradient { .. } => true,
            _ => false,
        };
        layout.terms.iter().any(|t| {
            let mut parts = layout.parts[t.parts.clone()].iter();
            parts.any(|part| (0..part.n_rows).any(|row| wrong(part.slot + row) && is_cut(t, part, row)))
        })
    }

    #[test]
    fn a_wrong_derivative_is_found() {
        /// A position whose second row says a little too much of one direction.
        #[derive(Clone, Debug)]
        struct Lies(Position);
        impl Objective for Lies {
            fn kind(&self) -> &'static str {
                "lies"
            }
            fn reads(&self, reads: &mut Reads<'_>) -> Result<(), Unfit> {
                self.0.reads(reads)
            }
            fn check(&self) -> Result<(), Unfit> {
                Ok(())
            }
            fn evaluate(&self, view: &View<'_>, rows: &mut Rows<'_>) {
                self.0.evaluate(view, rows);
                if rows.wants_jacobian() {
                    rows.by_frame(1, 0)[1] *= 1.001;
                }
            }
        }
        let rig = random_rig(6, 3);
        let joint = JointId::from_index(5);
        let pose = random_pose(&rig, &mut Random::new(1));
        let honest = Position::new(joint, DVec3::new(3.0, 2.0, 1.0));
        let mut problem = Problem::whole_body(&rig);
        problem.add(1.0, honest);
        assert_eq!(check_jacobian(&problem, &pose, 1e-6), Ok(()));
        let mut problem = Problem::whole_body(&rig);
        problem.add(1.0, Lies(honest));
        assert!(matches!(check_jacobian(&problem, &pose, 1e-6), Err(CheckError::Differs { row: 1, .. })));
    }
}
