//! The solver: options on one side, a problem, a pose and a workspace on the other, a report out.

use ikiru_rig::Pose;

use crate::front::course::{Told, check_start, conclude};
use crate::front::options::check_options;
use crate::layout::Layout;
use crate::method::{Bar, Budget, Clock, Method, Settle, SolverOptions};
use crate::model::PoseModel;
use crate::objective::Unfit;
use crate::problem::Problem;
use crate::problem::term::Term;
use crate::report::Report;
use crate::report::invalid::{Invalid, InvalidOptions, InvalidPose, InvalidTerm};
use crate::report::subject::PoseSubject;
use crate::search::{PoseStarts, PoseStartsMemory, Searcher};
use crate::state::State;
use crate::step::pose::StepSolver;
use crate::words::Watch;

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
    told: Told,
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
        self.told = Told::new(&layout);
        self.told.unmet.fit(layout.n_coords);
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
        let clock = Clock::start(self.options.max_time);
        workspace.told.clear();
        let report = self.solve_on(clock, problem, pose, workspace);
        workspace.told.lend(report.unwrap_or_else(Report::invalid))
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

    /// What counts as done.
    fn bar(&self, problem: &Problem) -> Bar {
        let SolverOptions { cost_below, settle, search, .. } = self.options;
        let is_single = search.max_restarts() == 0;
        let is_wanted = problem.terms().iter().any(Term::counts);
        let settles = settle == Settle::Tolerances && is_single && cost_below.is_none() && is_wanted;
        Bar { settles, ..Bar::new(cost_below, problem, !is_single) }
    }

    fn solve_on(
        &self,
        clock: Clock,
        problem: &Problem,
        pose: &mut Pose,
        workspace: &mut Workspace,
    ) -> Result<Report<'static>, Invalid> {
        workspace.fit(problem).map_err(|(term, unfit)| Invalid::Term(term, unfit.into()))?;
        self.check(problem, pose)?;
        let Workspace { layout, state, step, starts, searcher, watch, told } = workspace;
        let mut budget = Budget::on(clock, &self.options, watch);
        if !state.load(layout, pose) {
            return Err(Invalid::Pose(InvalidPose::NotFinite));
        }
        told.unmet.begin(&state.coords[..layout.n_coords]);
        let start_projected = state.project(layout);
        state.memory.failure = None;
        let cost = state.differentiate(layout, problem);
        check_start(&mut PoseSubject { layout, problem, state }, cost)?;
        let bar = self.bar(problem);
        let model = PoseModel { layout, problem, state, step };
        let mut starts = PoseStarts { model, memory: starts, pose };
        let found = searcher.run(&self.options, bar, &mut starts, cost, &mut budget);
        state.store(layout, pose);
        let subject = &mut PoseSubject { layout, problem, state };
        let report = conclude(subject, &self.options, found, budget.iterations, told, |_| true);
        Ok(Report { start_projected, ..report })
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
                let settle = if case % 4 < 2 { Settle::Fully } else { Settle::Tolerances };
                let options =
                    SolverOptions { method, search, settle, max_iterations: 25, ..SolverOptions::default() };
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
