//! The solver: options on one side, a problem, a pose and a workspace on the other, a report out.

use ikiru_rig::Pose;

use crate::front::options::check_options;
use crate::layout::Layout;
use crate::method::{Bar, Budget, Method, Outcome, SolverOptions};
use crate::model::PoseModel;
use crate::objective::Unfit;
use crate::problem::Problem;
use crate::problem::term::Term;
use crate::report::explain::{Explainer, Unmet};
use crate::report::invalid::{Invalid, InvalidOptions, InvalidPose, InvalidTerm};
use crate::report::pose::{explain, report_terms};
use crate::report::{Report, TermReport};
use crate::search::{PoseStarts, PoseStartsMemory, Searcher};
use crate::state::State;
use crate::step::pose::StepSolver;
use crate::words::{StopReason, Watch};

/// Solves problems by its options. Cheap to make and to copy: memory is the [`Workspace`]'s.
#[derive(Clone, Copy, Debug, Default)]
pub struct Solver {
    options: SolverOptions,
}

/// Scratch memory for one problem at a time. A solve with a workspace that has seen the problem does not
/// allocate; one with another problem lays it out anew.
#[derive(Clone, Debug, Default)]
pub struct Workspace {
    layout: Layout,
    state: State,
    step: StepSolver,
    starts: PoseStartsMemory,
    searcher: Searcher,
    watch: Watch,
    terms: Vec<TermReport>,
    explainer: Explainer,
    unmet: Unmet,
}

impl Workspace {
    /// Has the solves to come watched, and forgets who watched before.
    pub fn watch(&mut self, watch: Watch) {
        self.watch = watch;
    }

    /// Checks a problem, and lays it out if it is another one than before.
    fn fit(&mut self, problem: &Problem) -> Result<(), (usize, Unfit)> {
        if self.layout.signature.check(problem, &[])? {
            return Ok(());
        }
        let layout = Layout::new(problem)?;
        self.state = State::new(&layout);
        self.step = StepSolver::new(&layout);
        self.starts = PoseStartsMemory::new(&layout);
        self.searcher.fit(layout.n_kept_coords(), layout.n_dofs);
        self.terms = Vec::with_capacity(layout.terms.len());
        self.explainer = Explainer::new(&layout);
        self.unmet = Unmet::new(layout.terms.len(), layout.n_coords);
        self.layout = layout;
        Ok(())
    }
}

impl Solver {
    /// A solver with the given options.
    #[must_use]
    pub fn new(options: SolverOptions) -> Self {
        Self { options }
    }

    /// The options.
    #[must_use]
    pub fn options(&self) -> &SolverOptions {
        &self.options
    }

    /// Memory for solving a problem, laid out already.
    #[must_use]
    pub fn workspace(&self, problem: &Problem) -> Workspace {
        let mut workspace = Workspace::default();
        // What is wrong with a problem is told by the solve.
        let _ = workspace.fit(problem);
        workspace
    }

    /// Improves a pose until the bar is met or a stopping rule says otherwise. The start is first moved inside
    /// its limits; the best pose found comes back in `pose`. Joints that are not active stay as they are.
    ///
    /// Invalid input (a target that is not finite, a pose of another rig) stops at once with
    /// [`StopReason::InvalidInput`](crate::StopReason::InvalidInput), the pose untouched.
    pub fn solve<'w>(&self, problem: &Problem, pose: &mut Pose, workspace: &'w mut Workspace) -> Report<'w> {
        workspace.terms.clear();
        workspace.explainer.forces.clear();
        let fit = workspace.fit(problem).map_err(|(term, unfit)| Invalid::Term(term, unfit.into()));
        let report = match fit.and_then(|()| self.check(problem, pose)) {
            Ok(()) => self.solve_valid(problem, pose, workspace),
            Err(invalid) => Report::invalid(invalid),
        };
        let (terms, forces) = (&workspace.terms[..], &workspace.explainer.forces[..]);
        Report { terms: terms.into(), forces: forces.into(), ..report }
    }

    fn check(&self, problem: &Problem, pose: &Pose) -> Result<(), Invalid> {
        check_options(&self.options).map_err(Invalid::Options)?;
        let knows_hard = match self.options.method {
            Method::Lm | Method::Adam(_) => true,
            Method::Ccd | Method::Fabrik => false,
            Method::Outside(method) => method.holds_constraints(),
        };
        if let Some(term) = problem.terms().iter().position(|t| t.is_on && t.hard).filter(|_| !knows_hard) {
            return Err(Invalid::Term(term, InvalidTerm::Hard));
        }
        let reaches = |t: &Term| t.is_on && t.weight > 0.0 && t.objective.reach().is_some();
        if self.options.method == Method::Fabrik && !problem.terms().iter().any(reaches) {
            return Err(Invalid::Options(InvalidOptions::NothingToReach));
        }
        if !pose.rig().is_same(problem.rig()) {
            return Err(Invalid::Pose(InvalidPose::OtherRig));
        }
        Ok(())
    }

    fn solve_valid(&self, problem: &Problem, pose: &mut Pose, w: &mut Workspace) -> Report<'static> {
        let Workspace { layout, state, step, starts, searcher, watch, unmet, .. } = w;
        let mut budget = Budget::new(&self.options, watch);
        if !state.load(layout, pose) {
            return Report::invalid(Invalid::Pose(InvalidPose::NotFinite));
        }
        unmet.begin(&state.coords);
        let start_projected = state.project(layout);
        state.memory.failure = None;
        let cost = state.differentiate(layout, problem);
        if let Some((term, reason)) = state.memory.failure {
            return Report::invalid(Invalid::Term(term, InvalidTerm::GaveUp(reason)));
        }
        if !(cost + state.violation).is_finite() {
            return Report::invalid(invalid_term(layout, state));
        }
        let bar = Bar::new(self.options.cost_below, problem, self.options.search.max_restarts() > 0);
        let model = PoseModel { layout, problem, state, step };
        let mut starts = PoseStarts { model, memory: starts, pose };
        let (outcome, restarts) = searcher.run(&self.options, bar, &mut starts, cost, &mut budget);
        state.store(layout, pose);
        let iterations = budget.iterations;
        self.summarize(problem, w, outcome, restarts, start_projected, iterations)
    }

    fn summarize(
        &self,
        problem: &Problem,
        w: &mut Workspace,
        outcome: Outcome,
        restarts: usize,
        start_projected: bool,
        iterations: usize,
    ) -> Report<'static> {
        let failure = w.state.memory.failure.take();
        let mut cost = if outcome.is_evaluated { outcome.cost } else { w.state.evaluate(&w.layout, problem) };
        if failure.is_some() {
            // What gave up once may give up again: the cost is what it was when this pose was found.
            (cost, w.state.memory.failure) = (outcome.cost, None);
        }
        report_terms(&w.layout, problem, &mut w.state, &mut w.terms);
        let success = match self.options.cost_below {
            Some(bar) => cost < bar && w.terms.iter().all(|t| t.satisfied || !t.hard),
            None => w.terms.iter().all(|t| t.satisfied || !t.mandatory),
        };
        let stop = match outcome.stop {
            _ if failure.is_some() => StopReason::ObjectiveFailed,
            _ if success => StopReason::Reached,
            // The cost is as good as nothing, and yet a term of next to no weight is not met.
            StopReason::Reached => StopReason::Converged,
            other => other,
        };
        // Where the bar is a cost and it is met, nothing is in the way, and this is the hot path.
        let is_plain =
            success && (self.options.cost_below.is_some() || w.explainer.is_free(&w.layout, &w.state));
        let hint = if is_plain {
            None
        } else {
            let Workspace { layout, state, terms, explainer, unmet, .. } = &mut *w;
            explain(layout, problem, state, terms, (explainer, unmet), success)
        };
        if success {
            w.unmet.forget();
        }
        let invalid = failure.map(|(term, reason)| Invalid::Term(term, InvalidTerm::GaveUp(reason)));
        Report { success, stop, cost, iterations, restarts, start_projected, hint, invalid, ..Report::EMPTY }
    }
}

/// The first term whose residual is not finite.
pub(super) fn invalid_term(layout: &Layout, state: &State) -> Invalid {
    let bad = layout.terms.iter().find(|t| t.parts.clone().any(|p| !state.squares[p].is_finite()));
    match bad {
        Some(t) => Invalid::Term(t.term, InvalidTerm::NotFinite),
        None => Invalid::Pose(InvalidPose::Cost),
    }
}

#[cfg(test)]
mod tests {
    use ikiru_testkit::rigs::{Random, random_pose, random_rig};

    use super::*;
    use crate::method::Search;
    use crate::objectives::PoseTarget;

    #[test]
    fn limits_hold_in_every_pose_that_a_method_looks_at() {
        let mut random = Random::new(9);
        for &method in Method::ALL {
            let mut n_seen = 0;
            for case in 0..40 {
                let rig = random_rig(2 + random.below(16), case);
                let joint = ikiru_rig::JointId::from_index(rig.n_joints() - 1);
                let frame = random_pose(&rig, &mut random).frame(joint).unwrap();
                let mut problem = Problem::whole_body(&rig);
                // Out of reach for some, so that limits are met.
                let (position, rotation) = (frame.position * 1.3, frame.rotation);
                problem.add(1.0, PoseTarget::new(joint, position, rotation));
                let search = if case % 2 == 0 { Search::Local } else { Search::Global { max_restarts: 2 } };
                let options =
                    SolverOptions { method, search, max_iterations: 25, ..SolverOptions::default() };
                let solver = Solver::new(options);
                let mut workspace = solver.workspace(&problem);
                workspace.state.seen = Some(Vec::new());
                let mut pose = random_pose(&rig, &mut random);
                let iterations = solver.solve(&problem, &mut pose, &mut workspace).iterations;
                let seen = workspace.state.seen.take().unwrap();
                assert!(seen.len() > iterations, "{}, {case}: {} {iterations}", method.name(), seen.len());
                n_seen += seen.len();
                for coords in seen {
                    workspace.state.coords.copy_from_slice(&coords);
                    workspace.state.store(&workspace.layout, &mut pose);
                    let beyond = pose.limit_violation();
                    assert!(beyond < 1e-9, "{}, case {case}: {beyond}", method.name());
                }
            }
            assert!(n_seen > 500, "{}: {n_seen} poses", method.name());
        }
    }
}
