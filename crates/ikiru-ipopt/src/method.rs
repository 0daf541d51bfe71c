//! Ipopt as a method: the same problem, with exact gradients, and limits and constraints as bounds and constraints of
//! its own.
//!
//! On the way Ipopt may break a constraint: each pose that it looks at is brought inside the limits before it may be kept.
//! Constraints of the problem are constraints here too, equalities and inequalities; wishes that want to be at least something
//! stay in the cost.

use ikiru_rig::Pose;
use ikiru_solve::{Evaluation, Method, PoseMethod, Sense, Start};

use crate::charts::{Charts, Ellipse};
use crate::{Bounds, Function, Options, Status, minimise};

/// Ipopt's `tol`.
const TOLERANCE: f64 = 1e-9;
/// From how many steps the Hessian is guessed. The distance to a target has a kink there, near which Ipopt's own 6
/// stalled on 7 of 41 of the paper's combined tasks, and 20 on 2.
const HISTORY: usize = 20;
/// How far equalities may be off where there are more of them than variables, which Ipopt refuses: they are then narrow
/// inequalities, in metres or radians.
const NARROW: f64 = 1e-9;

/// The interior-point peer, to compare with: the same cost, gradients and limits through the system's Ipopt (Wächter and
/// Biegler, 2006) with a limited-memory Hessian. Unlike all other methods it allocates in every solve, and solves of one
/// process wait for each other.
#[derive(Clone, Copy, Debug)]
pub struct Ipopt;

/// [`Ipopt`] as a method.
pub const IPOPT: Method = Method::Outside(&Ipopt);

impl PoseMethod for Ipopt {
    fn name(&self) -> &'static str {
        "ipopt"
    }

    fn holds_constraints(&self) -> bool {
        true
    }

    fn improve(&self, start: &mut Start<'_, '_>) -> bool {
        // This iteration is Ipopt's first.
        if !start.goes_on() {
            return false;
        }
        let mut evaluation = Evaluation::default();
        if evaluation.values_at(start.problem(), start.pose()).is_err() {
            return false;
        }
        let charts = Charts::new(start.pose(), evaluation.moving());
        if charts.free.is_empty() {
            return true;
        }
        let hard = HardRow::all(&evaluation);
        let mut x: Vec<f64> = charts.free.iter().map(|dof| charts.values[*dof]).collect();
        let of_free = |bounds: &[f64]| -> Vec<f64> { charts.free.iter().map(|dof| bounds[*dof]).collect() };
        let (lower, upper) = (of_free(&charts.lower), of_free(&charts.upper));
        let (constraint_lower, constraint_upper) = constraint_ranges(&charts, &hard);
        let jacobian = charts.jacobian(hard.len());
        let bounds = Bounds {
            lower: &lower,
            upper: &upper,
            constraint_lower: &constraint_lower,
            constraint_upper: &constraint_upper,
            jacobian: &jacobian,
        };
        // The budget counts; Ipopt's own limit would end it in another way.
        let options = Options {
            tolerance: TOLERANCE,
            max_iterations: usize::MAX,
            history: HISTORY,
            ..Options::default()
        };
        let pose = start.pose().clone();
        let gradient = Vec::new();
        let mut cost =
            Cost { start, evaluation, charts, hard, pose, at: Vec::new(), has_slopes: false, gradient };
        let status = minimise(&mut cost, &bounds, &options, &mut x);
        matches!(status, Ok(Status::Solved | Status::Acceptable))
    }
}

/// A row of a constraint: the term and the part that it belongs to, and which of their open rows it is.
#[derive(Clone, Copy, Debug, PartialEq)]
struct HardRow {
    term: usize,
    part: usize,
    number: usize,
    sense: Sense,
}

impl HardRow {
    /// The constraints' rows that are open. What nothing moves is left out: no pose changes it.
    fn all(evaluation: &Evaluation) -> Vec<Self> {
        hard_rows(evaluation).map(|(_, row)| row).collect()
    }
}

/// Rows of constraints, each with its position among all rows.
fn hard_rows(evaluation: &Evaluation) -> impl Iterator<Item = (usize, HardRow)> + '_ {
    let mut last = (usize::MAX, usize::MAX, 0);
    let numbered = evaluation.rows().iter().enumerate().map(move |(idx, row)| {
        let number = if (last.0, last.1) == (row.term, row.part) { last.2 + 1 } else { 0 };
        last = (row.term, row.part, number);
        (idx, row, number)
    });
    numbered
        .filter(|(_, row, _)| row.weight.is_none() && !row.is_constant)
        .map(|(idx, row, number)| (idx, HardRow { term: row.term, part: row.part, number, sense: row.sense }))
}

/// The ranges of all constraints: of cones, then of rows.
fn constraint_ranges(charts: &Charts, hard: &[HardRow]) -> (Vec<f64>, Vec<f64>) {
    let n_equal = hard.iter().filter(|row| row.sense == Sense::Equal).count();
    let narrow = if n_equal > charts.free.len() { NARROW } else { 0.0 };
    let of_cones = charts.ellipses.iter().map(|_| (f64::NEG_INFINITY, 1.0));
    let of_rows = hard.iter().map(|row| match row.sense {
        Sense::Equal => (-narrow, narrow),
        Sense::AtLeast => (0.0, f64::INFINITY),
    });
    of_cones.chain(of_rows).unzip()
}

/// The cost as Ipopt sees it; every pose that it asks for is offered to the start.
struct Cost<'s, 'a, 'b> {
    start: &'s mut Start<'a, 'b>,
    evaluation: Evaluation,
    charts: Charts,
    /// Those that are constraints: what is not open at the start is none.
    hard: Vec<HardRow>,
    pose: Pose,
    /// Where it was evaluated last; empty where that failed.
    at: Vec<f64>,
    /// Whether derivatives were evaluated there.
    has_slopes: bool,
    gradient: Vec<f64>,
}

impl Cost<'_, '_, '_> {
    /// Evaluates at some variables; says whether there is a value.
    fn evaluate(&mut self, x: &[f64], with_slopes: bool) -> bool {
        if self.at == x && (self.has_slopes || !with_slopes) {
            return true;
        }
        self.charts.set(x);
        self.charts.write(self.pose.coords_mut());
        let (problem, pose) = (self.start.problem(), &self.pose);
        let evaluated = if with_slopes {
            self.evaluation.derivatives_at(problem, pose)
        } else {
            self.evaluation.values_at(problem, pose)
        };
        self.at.clear();
        self.has_slopes = with_slopes;
        if evaluated.is_ok() {
            self.at.extend_from_slice(x);
        }
        evaluated.is_ok()
    }

    /// Writes something of every row that is a constraint; 0 where it is not open here.
    fn write_rows(
        &mut self,
        values: &mut [f64],
        stride: usize,
        mut write: impl FnMut(&mut Self, usize, &mut [f64]),
    ) {
        values.fill(0.0);
        let open: Vec<(usize, HardRow)> = hard_rows(&self.evaluation).collect();
        let mut open = open.into_iter().peekable();
        for (idx, to) in values.chunks_exact_mut(stride).enumerate() {
            let wanted = self.hard[idx];
            let key = |row: &HardRow| (row.term, row.part, row.number);
            while open.next_if(|(_, row)| key(row) < key(&wanted)).is_some() {}
            if let Some((row, _)) = open.next_if(|(_, row)| *row == wanted) {
                write(self, row, to);
            }
        }
    }
}

impl Function for Cost<'_, '_, '_> {
    fn value(&mut self, x: &[f64]) -> Option<f64> {
        let has_value = self.evaluate(x, false);
        // Where there is none, the start is to hear of it too.
        self.start.offer(&self.pose);
        has_value.then(|| self.evaluation.cost())
    }

    fn gradient(&mut self, x: &[f64], gradient: &mut [f64]) -> bool {
        // What is known may be of these variables while the charts are at others.
        self.charts.set(x);
        if !self.evaluate(x, true) {
            return false;
        }
        self.gradient.clear();
        self.gradient.extend_from_slice(self.evaluation.gradient());
        self.charts.pull_back(&mut self.gradient);
        for (to, dof) in gradient.iter_mut().zip(&self.charts.free) {
            *to = self.gradient[*dof];
        }
        true
    }

    fn constraints(&mut self, x: &[f64], values: &mut [f64]) -> bool {
        self.charts.set(x);
        let (of_cones, of_rows) = values.split_at_mut(self.charts.ellipses.len());
        for (to, Ellipse { dof, widths }) in of_cones.iter_mut().zip(&self.charts.ellipses) {
            *to = (0..2).map(|k| (self.charts.values[dof + k] / widths[k]).powi(2)).sum();
        }
        if of_rows.is_empty() {
            return true;
        }
        if !self.evaluate(x, false) {
            return false;
        }
        self.write_rows(of_rows, 1, |cost, row, to| to[0] = cost.evaluation.rows()[row].residual);
        true
    }

    fn constraint_jacobian(&mut self, x: &[f64], values: &mut [f64]) -> bool {
        self.charts.set(x);
        let (of_cones, of_rows) = values.split_at_mut(2 * self.charts.ellipses.len());
        for (to, Ellipse { dof, widths }) in of_cones.chunks_exact_mut(2).zip(&self.charts.ellipses) {
            for k in 0..2 {
                to[k] = 2.0 * self.charts.values[dof + k] / (widths[k] * widths[k]);
            }
        }
        if of_rows.is_empty() {
            return true;
        }
        if !self.evaluate(x, true) {
            return false;
        }
        self.write_rows(of_rows, self.charts.free.len(), |cost, row, to| {
            cost.gradient.clear();
            cost.gradient.extend_from_slice(cost.evaluation.jacobian(row));
            cost.charts.pull_back(&mut cost.gradient);
            for (to, dof) in to.iter_mut().zip(&cost.charts.free) {
                *to = cost.gradient[*dof];
            }
        });
        true
    }

    fn goes_on(&mut self, n_iterations: usize) -> bool {
        // The first iteration was counted before Ipopt began.
        n_iterations == 0 || self.start.goes_on()
    }
}

#[cfg(test)]
mod tests {
    use std::sync::Mutex;

    use glam::DVec3;
    use ikiru_rig::{Cone, JointId, JointMotion, Rig};
    use ikiru_solve::objectives::{Bound, Distance, PoseTarget, RestPose};
    use ikiru_solve::{Problem, Solver, SolverOptions};
    use ikiru_testkit::rigs::{Random, random_pose, random_rig};

    use super::*;

    /// A step of the differences and how near they come with it. The second is for where an angle passes its cut
    /// within the first.
    const STEPS: [(f64, f64); 2] = [(1e-5, 1e-6), (1e-7, 1e-4)];

    fn is_near(exact: f64, numeric: f64, tolerance: f64) -> bool {
        (exact - numeric).abs() <= tolerance * (1.0 + exact.abs())
    }

    /// Compares every derivative that Ipopt gets with central differences, instead of improving anything.
    #[derive(Debug)]
    struct Check {
        case: u64,
        n_hard: usize,
        /// Variables and cones.
        found: Mutex<(usize, usize)>,
    }

    impl PoseMethod for Check {
        fn name(&self) -> &'static str {
            "check"
        }

        fn holds_constraints(&self) -> bool {
            true
        }

        fn improve(&self, start: &mut Start<'_, '_>) -> bool {
            let (case, mut random) = (self.case, Random::new(self.case + 1000));
            let mut evaluation = Evaluation::default();
            evaluation.values_at(start.problem(), start.pose()).unwrap();
            let begin = start.pose().clone();
            let (charts, hard) = (Charts::new(&begin, evaluation.moving()), HardRow::all(&evaluation));
            assert_eq!(hard.len(), self.n_hard, "case {case}");
            let mut x: Vec<f64> = charts.free.iter().map(|dof| charts.values[*dof]).collect();
            let jacobian = charts.jacobian(hard.len());
            let (n_cones, n_constraints) = (charts.ellipses.len(), charts.ellipses.len() + hard.len());
            let ranges = constraint_ranges(&charts, &hard);
            assert_eq!((ranges.0.len(), ranges.1.len()), (n_constraints, n_constraints));
            let pose = begin.clone();
            let (at, gradient) = (Vec::new(), Vec::new());
            let mut cost = Cost { start, evaluation, charts, hard, pose, at, has_slopes: false, gradient };
            assert!(cost.evaluate(&x, false));
            for (a, b) in cost.pose.coords().iter().zip(begin.coords()) {
                // A quaternion and its opposite are the same rotation.
                assert!(
                    (a - b).abs() < 1e-12 || (a + b).abs() < 1e-12,
                    "the start is where the variables say"
                );
            }
            // Away from the start, limits or not.
            for value in &mut x {
                *value += random.between(-0.7, 0.7);
            }
            let (mut gradient, mut values) = (vec![0.0; x.len()], vec![0.0; jacobian.len()]);
            assert!(cost.gradient(&x, &mut gradient) && cost.constraint_jacobian(&x, &mut values));
            // Constraints may be asked for elsewhere in between.
            let (mut again, elsewhere) = (vec![0.0; x.len()], vec![0.1; x.len()]);
            assert!(cost.constraints(&elsewhere, &mut vec![0.0; n_constraints]));
            assert!(cost.gradient(&x, &mut again));
            assert_eq!(again, gradient);
            for k in 0..x.len() {
                let mut shifted = |shift: f64| {
                    let mut x = x.clone();
                    x[k] += shift;
                    let mut constraints = vec![0.0; n_constraints];
                    assert!(cost.constraints(&x, &mut constraints));
                    (cost.value(&x).unwrap(), constraints)
                };
                let agrees = STEPS.map(|(step, tolerance)| {
                    let (ahead, behind) = (shifted(step), shifted(-step));
                    let slope = |ahead: f64, behind: f64| (ahead - behind) / (2.0 * step);
                    is_near(gradient[k], slope(ahead.0, behind.0), tolerance)
                        && (0..n_constraints).all(|row| {
                            let entry = jacobian.iter().position(|place| *place == (row, k));
                            let exact = entry.map_or(0.0, |entry| values[entry]);
                            is_near(exact, slope(ahead.1[row], behind.1[row]), tolerance)
                        })
                });
                assert!(agrees[0] || agrees[1], "case {case}, variable {k} of {}", x.len());
            }
            *self.found.lock().unwrap() = (x.len(), n_cones);
            true
        }
    }

    /// Checks derivatives on a rig, with rows of every kind; the answer counts variables and cones.
    fn check(rig: &Rig, case: u64) -> (usize, usize) {
        let mut random = Random::new(case);
        let mut problem = Problem::whole_body(rig);
        let joint = JointId::from_index(rig.n_joints() - 1);
        problem.add(1.0, PoseTarget::new(joint, random.vector(0.5), random.rotation()));
        let joints: Vec<JointId> = problem.active().collect();
        problem.add(0.1, RestPose::new(&joints, rig.rest_pose()));
        // Without constraints, what was evaluated last and where the charts are may differ.
        let is_hard = !case.is_multiple_of(4);
        if is_hard {
            problem.add_hard(PoseTarget::new(joint, random.vector(0.5), random.rotation()));
        }
        let other = JointId::from_index(random.below(rig.n_joints()));
        if is_hard && other != joint {
            problem.add_hard(Distance::new([other, joint], Bound::AtLeast(0.2)));
            // A wish that wants to be at least something stays in the cost.
            problem.add(0.3, Distance::new([other, joint], Bound::AtLeast(1.0)));
        }
        // What nothing moves is no constraint.
        let moves = |tip: JointId, until: Option<JointId>| {
            let above = rig.ancestors(tip).take_while(|joint| Some(*joint) != until);
            above.filter_map(|joint| rig.get(joint)).any(|joint| joint.motion.n_dofs() > 0)
        };
        let mut evaluation = Evaluation::default();
        let mut pose = random_pose(rig, &mut random);
        evaluation.values_at(&problem, &pose).unwrap();
        let constant = |row: &&ikiru_solve::EvaluatedRow| row.weight.is_none() && !row.is_constant;
        let n_hard = evaluation.rows().iter().filter(constant).count();
        assert!(n_hard >= if is_hard && moves(joint, None) { 6 } else { 0 }, "case {case}");
        let method: &'static Check = Box::leak(Box::new(Check { case, n_hard, found: Mutex::new((0, 0)) }));
        let solver =
            Solver::new(SolverOptions { method: Method::Outside(method), ..SolverOptions::default() });
        let report = solver.solve(&problem, &mut pose, &mut solver.workspace(&problem)).into_owned();
        assert!(report.invalid.is_none(), "case {case}: {:?}", report.invalid);
        *method.found.lock().unwrap()
    }

    #[test]
    fn derivatives_agree_with_central_differences_for_every_motion() {
        let (mut n_variables, mut n_constraints) = (0, 0);
        for case in 0..200 {
            let n = check(&random_rig(1 + case as usize % 14, case), case);
            n_variables += n.0;
            n_constraints += n.1;
        }
        assert!(n_variables > 1000 && n_constraints > 100, "{n_variables}, {n_constraints}");
    }

    #[test]
    fn limits_without_room_are_held() {
        use ikiru_rig::{Joint, Range, RigBuilder};
        let mut builder = RigBuilder::new();
        let swings = [[0.0, 0.5], [0.5, 0.0], [0.0, 0.0], [0.5, 0.7]];
        let mut parent = None;
        for (idx, swing) in swings.into_iter().enumerate() {
            let mut joint = Joint::new(format!("joint_{idx}"), parent);
            joint.rest_translation = DVec3::X * 0.2;
            let twist = if idx == 3 { Range::new(0.0, 0.0) } else { Range::new(-0.1, 0.2) };
            joint.motion = JointMotion::Ball { cone: Some(Cone::new(DVec3::Y, swing, twist).unwrap()) };
            parent = Some(builder.add(joint));
        }
        let rig = builder.build().unwrap();
        // 2 + 2 + 1 + 2 variables have room, one cone has an inside.
        assert_eq!(check(&rig, 1), (7, 1));
    }
}
