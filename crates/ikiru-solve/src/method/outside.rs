//! Methods from outside of this crate: what they see of a start, and how they hand in what they find.

use std::fmt;

use ikiru_rig::Pose;

use crate::method::{Bar, Budget, Outcome};
use crate::model::{Model, PoseModel};
use crate::problem::Problem;
use crate::words::StopReason;

/// A way to improve poses that is not of this crate: [`Method::Outside`](crate::Method::Outside) solves by it, with the
/// searches, budgets and reports of all others. What a problem costs, and its derivatives, are those of an
/// [`Evaluation`](crate::Evaluation).
///
/// ```
/// use ikiru_solve::{Evaluation, Method, PoseMethod, Start};
///
/// /// A tenth of the way down the gradient in each iteration.
/// #[derive(Debug)]
/// struct Downhill;
///
/// impl PoseMethod for Downhill {
///     fn name(&self) -> &'static str {
///         "downhill"
///     }
///
///     fn improve(&self, start: &mut Start<'_, '_>) -> bool {
///         let (mut at, mut pose) = (Evaluation::default(), start.pose().clone());
///         while start.goes_on() {
///             if at.derivatives_at(start.problem(), &pose).is_err() {
///                 return false;
///             }
///             let step: Vec<f64> = at.gradient().iter().map(|g| -0.1 * g).collect();
///             if step.iter().all(|s| s.abs() < 1e-6) || pose.retract(&step).is_err() {
///                 return true;
///             }
///             pose.project();
///             start.offer(&pose);
///         }
///         false
///     }
/// }
///
/// let method = Method::Outside(&Downhill);
/// # assert_eq!(method.name(), "downhill");
/// ```
pub trait PoseMethod: fmt::Debug + Sync {
    /// One lower-case word, as scenarios and the command name it.
    fn name(&self) -> &'static str;

    /// Whether it holds constraints. Where it does not, the default, a problem that has some is refused.
    fn holds_constraints(&self) -> bool {
        false
    }

    /// Improves a start: [offers](Start::offer) poses as long as it [goes on](Start::goes_on). Whether it converged, where
    /// nothing else ended it.
    fn improve(&self, start: &mut Start<'_, '_>) -> bool;
}

/// Two of one [`name`](PoseMethod::name) are equal, whatever settings they have: names say which method it is, and nothing else
/// of a method can be compared.
impl PartialEq for dyn PoseMethod {
    fn eq(&self, other: &Self) -> bool {
        self.name() == other.name()
    }
}

/// A start, as a method from outside sees it. The best pose that is offered comes of it.
pub struct Start<'a, 'b> {
    model: PoseModel<'a>,
    bar: &'a Bar,
    budget: &'a mut Budget<'b>,
    pose: Pose,
    best: Outcome,
    coords: Vec<f64>,
    is_met: bool,
    stop: Option<StopReason>,
}

impl fmt::Debug for Start<'_, '_> {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.debug_struct("Start")
            .field("from", &self.pose)
            .field("cost", &self.best.cost)
            .finish_non_exhaustive()
    }
}

impl Start<'_, '_> {
    /// The problem.
    #[must_use]
    pub fn problem(&self) -> &Problem {
        self.model.problem
    }

    /// The pose to begin from, inside its limits.
    #[must_use]
    pub fn pose(&self) -> &Pose {
        &self.pose
    }

    /// The lowest cost so far, that of the start at first.
    #[must_use]
    pub fn cost(&self) -> f64 {
        self.best.cost
    }

    /// Counts an iteration that is about to begin. False where it is none, since a stopping rule says so or the bar is met: the
    /// method is then to end.
    pub fn goes_on(&mut self) -> bool {
        if self.is_met {
            return false;
        }
        self.stop = self.budget.spend(self.model.has_failed(), self.best.cost);
        self.stop.is_none()
    }

    /// Looks at a pose, brought inside its limits, and keeps it where it is the best so far. The answer is its cost, infinite
    /// where the pose is of another rig or has numbers that are not finite. Joints that are not active have no say.
    pub fn offer(&mut self, pose: &Pose) -> f64 {
        if !pose.rig().is_same(self.model.problem.rig()) || !pose.is_valid() {
            return f64::INFINITY;
        }
        self.model.layout.load(pose.coords(), &mut self.model.state.coords);
        self.model.state.project(self.model.layout);
        let cost = self.model.evaluate();
        let found = Outcome::new(cost, self.model.violation(), self.best.stop, false);
        if found.is_better(&self.best) {
            self.best = found;
            self.is_met = self.bar.is_met(cost) && self.model.holds();
            self.coords.copy_from_slice(&self.model.state.coords);
        }
        cost
    }
}

/// Improves a model, whose cost is `cost` and which was evaluated last, by a method from outside. `pose` says where joints are
/// that do not move.
pub(crate) fn run(
    method: &dyn PoseMethod,
    model: &mut PoseModel<'_>,
    pose: &Pose,
    cost: f64,
    bar: &Bar,
    budget: &mut Budget<'_>,
) -> Outcome {
    let mut best = Outcome::new(cost, model.violation(), StopReason::NoProgress, true);
    if bar.is_met(cost) && model.holds() {
        best.stop = StopReason::Reached;
        return best;
    }
    let (coords, mut pose) = (model.state.coords.clone(), pose.clone());
    model.state.store(model.layout, &mut pose);
    let model = PoseModel { state: &mut *model.state, step: &mut *model.step, ..*model };
    let mut start = Start { model, bar, budget, pose, best, coords, is_met: false, stop: None };
    let has_converged = method.improve(&mut start);
    let Start { model, mut best, coords, is_met, stop, .. } = start;
    model.state.coords.copy_from_slice(&coords);
    best.is_evaluated = false;
    best.stop = match stop {
        _ if is_met => StopReason::Reached,
        Some(stop) => stop,
        None if has_converged => StopReason::Converged,
        None => StopReason::NoProgress,
    };
    best
}
