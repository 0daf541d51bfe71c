//! `check_jacobian`: derivatives against central differences, for every objective that exists.

use ikiru_rig::{JointId, Pose};

use crate::layout::{Layout, TermLayout};
use crate::objective::Loss;
use crate::problem::Problem;
use crate::solvers::adam::whole_gradient;
use crate::state::State;

/// A derivative that does not agree with central differences.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
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
    /// A term's numbers are wrong.
    #[error("term {0} {1}")]
    Invalid(usize, &'static str),
    /// The pose belongs to another rig.
    #[error("the pose belongs to another rig than the problem")]
    Pose,
}

/// Step of the differences, in radians or metres.
const STEP: f64 = 1e-5;

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
    problem.check().map_err(|(term, reason)| CheckError::Invalid(term, reason))?;
    if !pose.rig().is_same(problem.rig()) {
        return Err(CheckError::Pose);
    }
    let layout = Layout::new(problem);
    let mut state = State::new(&layout);
    state.load(&layout, pose);
    state.evaluate(&layout, problem);
    state.linearize(&layout, problem, true);
    let mut gradient = vec![0.0; layout.n_dofs];
    let is_kinked = layout.terms.iter().any(|t| {
        let loss = problem.terms()[t.term].loss;
        loss == Loss::Norm && t.parts.clone().any(|part| state.squares[part] < NEAR_KINK * NEAR_KINK)
    });
    if !is_kinked {
        let mut weighted = state.clone();
        weighted.linearize(&layout, problem, false);
        whole_gradient(&layout, &weighted, &mut gradient);
    }
    let start = state.coords.clone();
    let mut tangent = vec![0.0; layout.n_dofs];
    for mover in &layout.movers {
        for k in 0..mover.n_dofs {
            let dof = mover.dof + k;
            let mut shifted = |sign: f64| {
                tangent[dof] = sign * STEP;
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
                at.linearize(&layout, problem, true);
                tangent[dof] = 0.0;
                (at, cost)
            };
            let ((ahead, cost_ahead), (behind, cost_behind)) = (shifted(1.0), shifted(-1.0));
            let differs = |term, row, exact: f64, numeric: f64| {
                if (exact - numeric).abs() <= tolerance * (1.0 + exact.abs()) {
                    return Ok(());
                }
                Err(CheckError::Differs { term, row, joint: mover.joint, dof: k, exact, numeric })
            };
            let span = layout.spans[dof];
            for t in &layout.terms {
                for row in t.rows.clone() {
                    let inside = (span.first..span.first + span.len).contains(&row);
                    let exact = if inside { state.jacobian[span.start + row - span.first] } else { 0.0 };
                    let numeric = (ahead.residual[row] - behind.residual[row]) / (2.0 * STEP);
                    differs(t.term, row - t.rows.start, exact, numeric)?;
                }
            }
            // Joint rows are summed up in a gradient: half that of their squares.
            let squares = |s: &State| {
                layout.terms.iter().flat_map(TermLayout::joint_parts).map(|part| s.squares[part]).sum::<f64>()
            };
            let numeric = (squares(&ahead) - squares(&behind)) / (4.0 * STEP);
            if let Some(t) = layout.terms.iter().find(|t| !t.joint_reads.is_empty()) {
                differs(t.term, t.rows.len(), state.joint_gradient[dof], numeric)?;
            }
            let (exact, numeric) = (gradient[dof], (cost_ahead - cost_behind) / (2.0 * STEP));
            if !is_kinked && (exact - numeric).abs() > tolerance * (1.0 + exact.abs()) {
                return Err(CheckError::Gradient { joint: mover.joint, dof: k, exact, numeric });
            }
        }
    }
    Ok(())
}

#[cfg(test)]
pub(crate) use tests::{check_on_random_rigs, check_on_whole_rigs, residual_at};

#[cfg(test)]
mod tests {
    use ikiru_rig::{Frame, Rig};
    use ikiru_testkit::rigs::{Random, random_pose, random_rig};

    use super::*;
    use crate::objective::{Inputs, Objective, Part, Rows, Scratch, Unit};
    use crate::objectives::Position;
    use glam::DVec3;

    /// The residual of an objective for given frames.
    pub(crate) fn residual_at(objective: &dyn Objective, frames: &[Frame<f64>]) -> Vec<f64> {
        let mut residual = vec![f64::NAN; objective.parts().iter().map(|p| p.n_rows).sum()];
        let mut scratch = Scratch::default();
        objective.evaluate(&Inputs { frames }, &mut Rows::new(&mut residual, &mut [], &mut scratch));
        residual
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
        let layout = Layout::new(problem);
        let mut state = State::new(&layout);
        state.load(&layout, pose);
        state.evaluate(&layout, problem);
        let is_cut =
            |part: usize| layout.parts[part].unit == Unit::Radians && state.squares[part].sqrt() > 3.13;
        match error {
            CheckError::Differs { row, .. } => layout.terms.iter().any(|t| {
                let mut first = 0;
                t.frame_parts().any(|part| {
                    let rows = first..first + layout.parts[part].n_rows;
                    first = rows.end;
                    rows.contains(row) && is_cut(part)
                })
            }),
            CheckError::Gradient { .. } => (0..layout.parts.len()).any(is_cut),
            _ => false,
        }
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
            fn joints(&self) -> &[JointId] {
                self.0.joints()
            }
            fn parts(&self) -> &[Part] {
                self.0.parts()
            }
            fn check(&self) -> Result<(), &'static str> {
                Ok(())
            }
            fn evaluate(&self, inputs: &Inputs<'_>, rows: &mut Rows<'_>) {
                self.0.evaluate(inputs, rows);
                if rows.wants_jacobian() {
                    rows.derivative(0, 1)[1] *= 1.001;
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
