//! What a problem costs at a pose, and how that changes with the pose: for methods of your own.

use ikiru_rig::{Pose, Rig};

use crate::front::course::check_start;
use crate::layout::Layout;
use crate::objective::Unfit;
use crate::problem::{Problem, TermId};
use crate::report::TermReport;
use crate::report::explain::{Explainer, Unmet, explain};
use crate::report::force::Force;
use crate::report::invalid::{Invalid, InvalidPose};
use crate::report::subject::{PoseSubject, Subject};
use crate::state::State;
use crate::state::gradient::whole_gradient;
use crate::words::{Sense, Unit};

/// One row of a term that is on: what it misses, and how it counts.
#[derive(Clone, Copy, Debug, PartialEq)]
#[non_exhaustive]
pub struct EvaluatedRow {
    /// The term's position in the problem.
    pub term: usize,
    /// The sample at which it was evaluated; 0 for a pose.
    pub sample: usize,
    /// Which of the term's parts it belongs to.
    pub part: usize,
    /// The residual `r`, as the objective gives it, in `unit`.
    pub residual: f64,
    /// Its unit.
    pub unit: Unit,
    /// Whether it wants to be 0, or at least 0.
    pub sense: Sense,
    /// How much a wish counts here: `λ · ρ'(‖r‖²)`, so that twice that times what the row misses is the slope of the cost by
    /// the row. `None` for a row of a constraint.
    pub weight: Option<f64>,
    /// Whether nothing that may move changes it.
    pub is_constant: bool,
}

/// A problem at a pose: cost, rows, and their derivatives by the pose's tangent.
///
/// A tangent has [`Rig::n_dofs`] entries (radians and metres), those of [`Pose::retract`]; what may not move, and what nothing
/// reads, has derivatives of 0. It looks and changes nothing: neither limits nor budgets have a say here.
///
/// ```
/// use glam::DVec3;
/// use ikiru_rig::{Joint, JointMotion, Range, RigBuilder};
/// use ikiru_solve::objectives::Position;
/// use ikiru_solve::{Evaluation, Problem};
///
/// let mut builder = RigBuilder::new();
/// let motion = JointMotion::Hinge { axis: DVec3::Z, range: Range::UNLIMITED };
/// let root = builder.add(Joint { motion, ..Joint::new("root", None) });
/// let tip = builder.add(Joint { rest_translation: DVec3::X, ..Joint::new("tip", Some(root)) });
/// let rig = builder.build()?;
/// let mut problem = Problem::whole_body(&rig);
/// let reach = problem.add(2.0, Position::new(tip, DVec3::new(1.0, 0.5, 0.0)));
/// let mut evaluation = Evaluation::default();
/// evaluation.at(&problem, &rig.rest_pose())?;
/// assert_eq!(evaluation.cost(), 2.0 * 0.25);
/// // The tip moves along y as the root turns.
/// assert!((evaluation.gradient()[0] + 2.0).abs() < 1e-12);
/// let rows = evaluation.rows_of(&problem, reach);
/// assert!((evaluation.jacobian(rows.start + 1)[0] - 1.0).abs() < 1e-12);
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
#[derive(Clone, Debug, Default)]
pub struct Evaluation {
    layout: Layout,
    state: State,
    cost: f64,
    violation: f64,
    rows: Vec<EvaluatedRow>,
    /// Row by row, by the rig's tangent; like the gradient, empty where derivatives were not asked for.
    jacobian: Vec<f64>,
    gradient: Vec<f64>,
    n_dofs: usize,
    /// Which of the rig's degrees of freedom each of the layout's is.
    dofs: Vec<usize>,
    of_layout: Vec<f64>,
    terms: Vec<TermReport>,
    explainer: Explainer,
    unmet: Unmet,
}

impl Evaluation {
    /// Evaluates a problem at a pose: cost, rows, derivatives, terms and forces. Does not allocate for a problem of the same
    /// shape as the last.
    ///
    /// # Errors
    /// What a solve would refuse: a term that does not fit or gives no finite residual, a pose of another rig or with numbers
    /// that are not finite. There are then no rows, derivatives, terms and forces, and the cost is infinite.
    pub fn at(&mut self, problem: &Problem, pose: &Pose) -> Result<(), Invalid> {
        self.derivatives_at(problem, pose)?;
        let Self { layout, state, terms, explainer, unmet, .. } = self;
        state.differentiate(layout, problem);
        let subject = &mut PoseSubject { layout, problem, state };
        subject.report_terms(terms);
        let success = terms.iter().all(|t| t.satisfied || !t.mandatory);
        unmet.forget();
        explain(subject, terms, (explainer, unmet), success, true);
        Ok(())
    }

    /// Evaluates cost and rows alone.
    ///
    /// # Errors
    /// As [`at`](Self::at).
    pub fn values_at(&mut self, problem: &Problem, pose: &Pose) -> Result<(), Invalid> {
        self.evaluate(problem, pose)?;
        self.find_rows(problem);
        Ok(())
    }

    /// Evaluates cost, rows, gradient and Jacobian: all but terms and forces.
    ///
    /// # Errors
    /// As [`at`](Self::at).
    pub fn derivatives_at(&mut self, problem: &Problem, pose: &Pose) -> Result<(), Invalid> {
        self.evaluate(problem, pose)?;
        let Self { layout, state, .. } = self;
        // Once scaled by weights, as the gradient wants it, and once as the rows are.
        state.linearize(layout, problem, false);
        whole_gradient(layout, state, 0.0, &mut self.of_layout);
        self.gradient.resize(self.n_dofs, 0.0);
        self.dofs.iter().zip(&self.of_layout).for_each(|(dof, g)| self.gradient[*dof] = *g);
        state.differentiate(layout, problem);
        state.linearize(layout, problem, true);
        self.find_rows(problem);
        self.write_jacobian(problem);
        Ok(())
    }

    /// Evaluates the residuals.
    fn evaluate(&mut self, problem: &Problem, pose: &Pose) -> Result<(), Invalid> {
        (self.cost, self.violation) = (f64::INFINITY, 0.0);
        self.rows.clear();
        self.jacobian.clear();
        self.gradient.clear();
        self.terms.clear();
        self.explainer.forces.clear();
        self.fit(problem).map_err(|(term, unfit)| Invalid::Term(term, unfit.into()))?;
        if !pose.rig().is_same(problem.rig()) {
            return Err(Invalid::Pose(InvalidPose::OtherRig));
        }
        let Self { layout, state, .. } = self;
        if !state.load(layout, pose) {
            return Err(Invalid::Pose(InvalidPose::NotFinite));
        }
        state.memory.failure = None;
        let cost = state.differentiate(layout, problem);
        check_start(&mut PoseSubject { layout, problem, state }, cost)?;
        self.cost = cost;
        self.violation = if layout.n_guards > 0 { state.violation } else { 0.0 };
        Ok(())
    }

    fn fit(&mut self, problem: &Problem) -> Result<(), (usize, Unfit)> {
        if self.layout.signature.check(problem, &[])? {
            return Ok(());
        }
        let layout = Layout::new(problem)?;
        self.state = State::new(&layout);
        self.explainer = Explainer::new(&layout);
        self.unmet = Unmet::new(layout.terms.len());
        self.unmet.fit(layout.n_coords);
        self.dofs = dofs_of(&layout, problem.rig());
        self.of_layout = vec![0.0; layout.n_dofs];
        self.n_dofs = problem.rig().n_dofs();
        self.gradient = Vec::with_capacity(self.n_dofs);
        self.layout = layout;
        Ok(())
    }

    /// Finds the rows that are open.
    fn find_rows(&mut self, problem: &Problem) {
        let Self { layout, state, rows, .. } = self;
        for t in layout.terms.iter().filter(|t| problem.terms()[t.term].is_on) {
            let term = &problem.terms()[t.term];
            for (number, idx) in t.parts.clone().enumerate() {
                let part = &layout.parts[idx];
                let weight = term.weight * term.loss.weight(state.squares[idx]);
                let residuals = &state.residual[part.row..part.row + state.n_open[idx]];
                rows.extend(residuals.iter().map(|residual| EvaluatedRow {
                    term: t.term,
                    sample: 0,
                    part: number,
                    residual: *residual,
                    unit: part.unit,
                    sense: part.sense,
                    weight: (!term.hard).then_some(weight),
                    is_constant: t.is_constant,
                }));
            }
        }
    }

    /// Writes the derivatives of the rows that are open, as of a linearization without weights.
    fn write_jacobian(&mut self, problem: &Problem) {
        let Self { layout, state, jacobian, dofs, n_dofs, .. } = self;
        for t in layout.terms.iter().filter(|t| problem.terms()[t.term].is_on) {
            for idx in t.parts.clone() {
                let part = &layout.parts[idx];
                for row in 0..state.n_open[idx] {
                    let at = jacobian.len();
                    jacobian.resize(at + *n_dofs, 0.0);
                    for (k, dof) in dofs.iter().enumerate() {
                        jacobian[at + dof] = state.entry(layout, t, part, row, k);
                    }
                }
            }
        }
    }

    /// The cost `J = Σ λ ρ(r)`, constraints left out.
    #[must_use]
    pub fn cost(&self) -> f64 {
        self.cost
    }

    /// By how much constraints are missed that something moves, summed up over their rows (metres, radians).
    #[must_use]
    pub fn violation(&self) -> f64 {
        self.violation
    }

    /// The gradient of the cost by the tangent; empty where derivatives were not asked for.
    #[must_use]
    pub fn gradient(&self) -> &[f64] {
        &self.gradient
    }

    /// The rows that are open, term by term, constraints among them.
    #[must_use]
    pub fn rows(&self) -> &[EvaluatedRow] {
        &self.rows
    }

    /// Where the rows of a term lie; empty where it is off or has none.
    #[must_use]
    pub fn rows_of<T>(&self, problem: &Problem, id: TermId<T>) -> std::ops::Range<usize> {
        let Some(term) = problem.position(id) else { return 0..0 };
        let first = self.rows.partition_point(|row| row.term < term);
        first..first + self.rows[first..].iter().take_while(|row| row.term == term).count()
    }

    /// The derivative of a row's residual by the tangent; empty where there is no such row, or derivatives were not asked for.
    #[must_use]
    pub fn jacobian(&self, row: usize) -> &[f64] {
        let n = self.n_dofs;
        self.jacobian.get(row * n..(row + 1) * n).unwrap_or_default()
    }

    /// The entries of the tangent that may move and that something reads, in the order in which a solver has them.
    #[must_use]
    pub fn moving(&self) -> &[usize] {
        &self.dofs
    }

    /// Every term, as a report would have it.
    #[must_use]
    pub fn terms(&self) -> &[TermReport] {
        &self.terms
    }

    /// The forces that act here, as a [report](crate::Report::forces) would have them. They balance each other where a solve
    /// converged; elsewhere they say what limits and constraints hold back.
    #[must_use]
    pub fn forces(&self) -> &[Force] {
        &self.explainer.forces
    }
}

/// Which of a rig's degrees of freedom each of a layout's is.
pub(super) fn dofs_of(layout: &Layout, rig: &Rig) -> Vec<usize> {
    layout.movers.iter().flat_map(|m| (0..m.n_dofs).map(|k| rig.dofs_of(m.joint).start + k)).collect()
}
