//! The interior-point peer: the same problem through the system's Ipopt, with exact gradients and the limits as
//! bounds and constraints.
//!
//! Each degree of freedom is a variable. Angles and offsets are their own, a range is a bound. A rotation without
//! limits is `start · exp(v)`. One with a cone is its swing and twist `(s₁, s₂, θ)`: the range of the twist is a bound, and
//! `(s₁/a)² + (s₂/b)² ≤ 1` a constraint. On the way Ipopt may break a constraint: each pose that it looks at is
//! brought inside the limits before it may be kept. Hard rows are constraints too, equalities and inequalities; wishes that
//! want to be at least something stay in the cost.

use std::f64::consts::TAU;

use glam::{DQuat, DVec3};
use ikiru_ipopt::{Bounds, Function, Options, Status, minimise};
use ikiru_rig::{Cone, JointMotion, maths};

use crate::layout::{Layout, Place};
use crate::method::{Bar, Budget, Outcome};
use crate::model::PoseModel;
use crate::problem::Problem;
use crate::state::State;
use crate::state::gradient::whole_gradient;
use crate::words::Sense;
use crate::words::StopReason;

/// What does not have this much room (radians or metres) is held: an interior has to have room.
const LEAST_ROOM: f64 = 1e-9;
/// Ipopt's `tol`.
const TOLERANCE: f64 = 1e-9;
/// From how many steps the Hessian is guessed. The distance to a target has a kink there, near which Ipopt's own 6
/// stalled on 7 of 41 of the paper's combined tasks, and 20 on 2.
const HISTORY: usize = 20;
/// How far equalities may be off where there are more of them than variables, which Ipopt refuses: they are then narrow
/// inequalities, in metres or radians.
const NARROW: f64 = 1e-9;

/// Memory of the method. Ipopt allocates beside it in every solve.
#[derive(Clone, Debug, Default)]
pub(crate) struct Ipopt {
    best: Vec<f64>,
    asked: Vec<f64>,
    gradient: Vec<f64>,
}

impl Ipopt {
    pub(crate) fn new(layout: &Layout) -> Self {
        let zeros = vec![0.0; layout.n_kept_coords()];
        Self { best: zeros.clone(), asked: zeros, gradient: vec![0.0; layout.n_dofs] }
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
        let outcome = |stop| Outcome::new(cost, state.violation, stop, true);
        if bar.is_met(cost) && state.holds(layout, problem) {
            return outcome(StopReason::Reached);
        }
        if let Some(stop) = budget.spend(false, cost) {
            return outcome(stop);
        }
        let charts = Charts::new(layout, &state.coords);
        if charts.free.is_empty() {
            return outcome(StopReason::Converged);
        }
        let mut x: Vec<f64> = charts.free.iter().map(|dof| charts.values[*dof]).collect();
        let of_free = |bounds: &[f64]| -> Vec<f64> { charts.free.iter().map(|dof| bounds[*dof]).collect() };
        let (lower, upper) = (of_free(&charts.lower), of_free(&charts.upper));
        let hard = HardRow::all(layout, problem);
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
        self.best.copy_from_slice(&state.coords);
        let (best, is_met) = (outcome(StopReason::NoProgress), false);
        let mut cost_function = Cost {
            layout,
            problem,
            state,
            charts,
            hard,
            memory: self,
            bar,
            budget,
            best,
            is_met,
            at: Vec::new(),
            is_linearized: false,
            stop: None,
        };
        let status = minimise(&mut cost_function, &bounds, &options, &mut x);
        let (mut best, is_met, asked) = (cost_function.best, cost_function.is_met, cost_function.stop);
        state.coords.copy_from_slice(&self.best);
        best.is_evaluated = false;
        best.stop = match status {
            _ if is_met => StopReason::Reached,
            Ok(Status::Solved | Status::Acceptable) => StopReason::Converged,
            Ok(Status::IterationLimit) => StopReason::IterationLimit,
            _ => asked.unwrap_or(StopReason::NoProgress),
        };
        best
    }
}

/// A hard row: which of all rows it is, and which of those with a force.
#[derive(Clone, Copy, Debug)]
struct HardRow {
    row: usize,
    force: usize,
    sense: Sense,
}

impl HardRow {
    /// The hard rows of a problem. What nothing moves is left out: no pose changes it.
    fn all(layout: &Layout, problem: &Problem) -> Vec<Self> {
        let counts = |t: usize| problem.terms()[t].is_on;
        let mut rows = Vec::new();
        for t in layout.terms.iter().filter(|t| t.is_hard && !t.is_constant && counts(t.term)) {
            for part in &layout.parts[t.parts.clone()] {
                let Place::Force { first } = part.place else { continue };
                let row = |i| Self { row: part.row + i, force: first + i, sense: part.sense };
                rows.extend((0..part.n_rows).map(row));
            }
        }
        rows
    }
}

/// The ranges of all constraints: of cones, then of hard rows.
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

/// How variables make a rotation.
#[derive(Clone, Copy, Debug)]
enum Chart {
    /// `start · exp(v)`
    About(DQuat),
    /// `exp(s) · twist(θ)`, about the cone's centre
    SwingTwist(Cone),
}

/// A rotation: where its quaternion, its directions and its three variables lie.
#[derive(Clone, Copy, Debug)]
struct Turn {
    coord: usize,
    dof: usize,
    chart: Chart,
}

/// A swing's constraint: the first of its two variables, and the half-widths.
#[derive(Clone, Copy, Debug)]
struct Ellipse {
    dof: usize,
    widths: [f64; 2],
}

/// The variables of a problem, one for each degree of freedom.
#[derive(Clone, Debug)]
struct Charts {
    turns: Vec<Turn>,
    ellipses: Vec<Ellipse>,
    /// The variables that have room, in order.
    free: Vec<usize>,
    /// The value and range of each.
    values: Vec<f64>,
    lower: Vec<f64>,
    upper: Vec<f64>,
    /// For each variable that is a coordinate, where it lies: (variable, coordinate).
    plain: Vec<(usize, usize)>,
}

impl Charts {
    /// Charts about a pose inside its limits.
    fn new(layout: &Layout, coords: &[f64]) -> Self {
        let mut charts = Self {
            turns: Vec::new(),
            ellipses: Vec::new(),
            free: Vec::new(),
            values: vec![0.0; layout.n_dofs],
            lower: layout.lower.clone(),
            upper: layout.upper.clone(),
            plain: Vec::new(),
        };
        for m in &layout.movers {
            let has_rotation = matches!(m.motion, JointMotion::Ball { .. } | JointMotion::Free { .. });
            let n_plain = if has_rotation { m.n_dofs - 3 } else { m.n_dofs };
            for k in 0..n_plain {
                charts.plain.push((m.dof + k, m.coord + k));
                charts.values[m.dof + k] = coords[m.coord + k];
            }
            if has_rotation {
                charts.push_turn(m.coord + n_plain, m.dof + n_plain, m.motion.cone(), coords);
            }
        }
        charts.free =
            (0..layout.n_dofs).filter(|k| charts.upper[*k] - charts.lower[*k] > LEAST_ROOM).collect();
        charts
    }

    fn push_turn(&mut self, coord: usize, dof: usize, cone: Option<&Cone>, coords: &[f64]) {
        let q = DQuat::from_slice(&coords[coord..coord + 4]);
        let Some(cone) = cone else {
            self.turns.push(Turn { coord, dof, chart: Chart::About(q) });
            return;
        };
        let (swing, twist) = cone.decompose(q);
        let (widths, range) = (cone.swing(), cone.twist());
        let whole_turn = range.max - range.min >= TAU;
        for k in 0..2 {
            self.values[dof + k] = swing[k];
            (self.lower[dof + k], self.upper[dof + k]) = (-widths[k], widths[k]);
        }
        self.values[dof + 2] = twist;
        if !whole_turn {
            (self.lower[dof + 2], self.upper[dof + 2]) = (range.min, range.max);
        }
        if widths.iter().all(|w| 2.0 * w > LEAST_ROOM) {
            self.ellipses.push(Ellipse { dof, widths });
        }
        self.turns.push(Turn { coord, dof, chart: Chart::SwingTwist(*cone) });
    }

    /// Which derivatives of constraints there are: (constraint, variable of Ipopt's). Hard rows may have all.
    fn jacobian(&self, n_hard: usize) -> Vec<(usize, usize)> {
        let (n_cones, n_free) = (self.ellipses.len(), self.free.len());
        let mut entries = Vec::with_capacity(2 * n_cones + n_hard * n_free);
        for (row, ellipse) in self.ellipses.iter().enumerate() {
            // Both have room, so that they stand side by side.
            let column = self.free.partition_point(|dof| *dof < ellipse.dof);
            entries.extend([(row, column), (row, column + 1)]);
        }
        for row in n_cones..n_cones + n_hard {
            entries.extend((0..n_free).map(|column| (row, column)));
        }
        entries
    }

    /// Takes over what Ipopt varies.
    fn set(&mut self, x: &[f64]) {
        for (dof, x) in self.free.iter().zip(x) {
            self.values[*dof] = *x;
        }
    }

    /// Writes the coordinates that the variables stand for.
    fn write(&self, coords: &mut [f64]) {
        for (dof, coord) in &self.plain {
            coords[*coord] = self.values[*dof];
        }
        for turn in &self.turns {
            let [a, b, c] = self.variables(turn);
            let q = match &turn.chart {
                Chart::About(start) => (*start * maths::turn_by(DVec3::new(a, b, c))).normalize(),
                Chart::SwingTwist(cone) => cone.compose([a, b], c),
            };
            coords[turn.coord..turn.coord + 4].copy_from_slice(&q.to_array());
        }
    }

    fn variables(&self, turn: &Turn) -> [f64; 3] {
        [self.values[turn.dof], self.values[turn.dof + 1], self.values[turn.dof + 2]]
    }

    /// Turns a gradient by directions of motion into one by the variables.
    fn pull_back(&self, gradient: &mut [f64]) {
        for turn in &self.turns {
            let [a, b, c] = self.variables(turn);
            let to = &mut gradient[turn.dof..turn.dof + 3];
            let g = DVec3::from_slice(to);
            let by_variables = match &turn.chart {
                Chart::About(_) => right_jacobian_transposed(DVec3::new(a, b, c), g),
                Chart::SwingTwist(cone) => {
                    // Directions of the joint are turned by K against those of the cone.
                    let g = cone.centre().map_or(g, |centre| centre.joint_rotation.conjugate() * g);
                    // exp(s + ds) = exp(s) · exp(J ds), and exp(δ) · twist = twist · exp(twist⁻¹ δ).
                    let axes = [cone.first_swing_axis(), cone.second_swing_axis()];
                    let before_twist = maths::turn_about(cone.axis(), c) * g;
                    let s = right_jacobian_transposed(axes[0] * a + axes[1] * b, before_twist);
                    DVec3::new(s.dot(axes[0]), s.dot(axes[1]), g.dot(cone.axis()))
                }
            };
            to.copy_from_slice(&by_variables.to_array());
        }
    }
}

/// `Jᵀ g` for the right Jacobian of the rotations: `exp(v + dv) = exp(v) · exp(J dv)` to first order, with
/// `J = 1 − (1 − cos θ)/θ² [v]ₓ + (θ − sin θ)/θ³ [v]ₓ²` and θ the length of `v`.
fn right_jacobian_transposed(v: DVec3, g: DVec3) -> DVec3 {
    let square = v.length_squared();
    let angle = square.sqrt();
    let (a, b) = if angle < 1e-3 {
        (0.5 - square / 24.0, 1.0 / 6.0 - square / 120.0)
    } else {
        (2.0 * maths::sin(0.5 * angle).powi(2) / square, (angle - maths::sin(angle)) / (square * angle))
    };
    let turned = v.cross(g);
    g + a * turned + b * v.cross(turned)
}

/// The cost as Ipopt sees it, which keeps the best pose inside the limits that it was asked for.
struct Cost<'a, 'b> {
    layout: &'a Layout,
    problem: &'a Problem,
    state: &'a mut State,
    charts: Charts,
    hard: Vec<HardRow>,
    memory: &'a mut Ipopt,
    bar: &'a Bar,
    budget: &'a mut Budget<'b>,
    best: Outcome,
    /// Whether the best one meets the bar.
    is_met: bool,
    /// Where the state was evaluated last; empty where that was another pose.
    at: Vec<f64>,
    /// Whether it was linearized there.
    is_linearized: bool,
    stop: Option<StopReason>,
}

impl Cost<'_, '_> {
    fn evaluate(&mut self, x: &[f64]) -> f64 {
        self.charts.set(x);
        self.charts.write(&mut self.state.coords);
        self.at.clear();
        self.at.extend_from_slice(x);
        self.is_linearized = false;
        self.state.evaluate(self.layout, self.problem)
    }

    fn linearize(&mut self, x: &[f64]) {
        if self.at != x {
            self.evaluate(x);
        }
        if !self.is_linearized {
            self.state.linearize(self.layout, self.problem, false);
            self.is_linearized = true;
        }
    }

    /// Keeps the pose in the state, brought inside its limits, where it is the best so far.
    fn keep(&mut self, cost: f64) {
        self.memory.asked.copy_from_slice(&self.state.coords);
        self.state.project(self.layout);
        let cost = if self.state.coords == self.memory.asked {
            cost
        } else {
            self.at.clear();
            self.state.evaluate(self.layout, self.problem)
        };
        let found = Outcome::new(cost, self.state.violation, self.best.stop, true);
        if found.is_better(&self.best) {
            self.best = found;
            self.is_met = self.bar.is_met(cost) && self.state.holds(self.layout, self.problem);
            self.memory.best.copy_from_slice(&self.state.coords);
        }
    }
}

impl Function for Cost<'_, '_> {
    fn value(&mut self, x: &[f64]) -> Option<f64> {
        let cost = self.evaluate(x);
        self.keep(cost);
        cost.is_finite().then_some(cost)
    }

    fn gradient(&mut self, x: &[f64], gradient: &mut [f64]) -> bool {
        self.linearize(x);
        whole_gradient(self.layout, self.state, 0.0, &mut self.memory.gradient);
        self.charts.pull_back(&mut self.memory.gradient);
        for (to, dof) in gradient.iter_mut().zip(&self.charts.free) {
            *to = self.memory.gradient[*dof];
        }
        true
    }

    fn constraints(&mut self, x: &[f64], values: &mut [f64]) -> bool {
        self.charts.set(x);
        for (to, Ellipse { dof, widths }) in values.iter_mut().zip(&self.charts.ellipses) {
            *to = (0..2).map(|k| (self.charts.values[dof + k] / widths[k]).powi(2)).sum();
        }
        if !self.hard.is_empty() && self.at != x {
            self.evaluate(x);
        }
        for (to, hard) in values[self.charts.ellipses.len()..].iter_mut().zip(&self.hard) {
            *to = self.state.residual[hard.row];
        }
        true
    }

    fn constraint_jacobian(&mut self, x: &[f64], values: &mut [f64]) -> bool {
        self.charts.set(x);
        for (to, Ellipse { dof, widths }) in values.chunks_exact_mut(2).zip(&self.charts.ellipses) {
            for k in 0..2 {
                to[k] = 2.0 * self.charts.values[dof + k] / (widths[k] * widths[k]);
            }
        }
        if self.hard.is_empty() {
            return true;
        }
        self.linearize(x);
        let (n, gradient) = (self.layout.n_dofs, &mut self.memory.gradient);
        let of_rows = &mut values[2 * self.charts.ellipses.len()..];
        for (to, hard) in of_rows.chunks_exact_mut(self.charts.free.len()).zip(&self.hard) {
            gradient.copy_from_slice(&self.state.force_jacobian[hard.force * n..][..n]);
            self.charts.pull_back(gradient);
            for (to, dof) in to.iter_mut().zip(&self.charts.free) {
                *to = gradient[*dof];
            }
        }
        true
    }

    fn goes_on(&mut self, n_iterations: usize) -> bool {
        if self.is_met {
            return false;
        }
        // The first iteration was counted before Ipopt began.
        if n_iterations > 0 {
            self.stop = self.budget.spend(self.state.memory.failure.is_some(), self.best.cost);
        }
        self.stop.is_none()
    }
}

#[cfg(test)]
mod tests {
    use ikiru_rig::{JointId, Rig};
    use ikiru_testkit::rigs::{Random, random_pose, random_rig};

    use super::*;
    use crate::objectives::{Bound, Distance, PoseTarget, RestPose};
    use crate::words::{SolverOptions, Watch};

    /// A step of the differences and how near they come with it. The second is for where an angle passes its cut
    /// within the first.
    const STEPS: [(f64, f64); 2] = [(1e-5, 1e-6), (1e-7, 1e-4)];

    fn is_near(exact: f64, numeric: f64, tolerance: f64) -> bool {
        (exact - numeric).abs() <= tolerance * (1.0 + exact.abs())
    }

    /// Compares every derivative that Ipopt gets with central differences; the answer counts variables and cones.
    fn check(rig: &Rig, case: u64) -> (usize, usize) {
        let mut random = Random::new(case);
        let mut problem = Problem::whole_body(rig);
        let joint = JointId::from_index(rig.n_joints() - 1);
        problem.add(1.0, PoseTarget::new(joint, random.vector(0.5), random.rotation()));
        let joints: Vec<JointId> = problem.active().collect();
        problem.add(0.1, RestPose::new(&joints, rig.rest_pose()));
        problem.add_hard(PoseTarget::new(joint, random.vector(0.5), random.rotation()));
        let other = JointId::from_index(random.below(rig.n_joints()));
        if other != joint {
            problem.add_hard(Distance::new([other, joint], Bound::AtLeast(0.2)));
            // A wish that wants to be at least something stays in the cost.
            problem.add(0.3, Distance::new([other, joint], Bound::AtLeast(1.0)));
        }
        let layout = Layout::new(&problem).unwrap();
        let mut state = State::new(&layout);
        assert!(state.load(&layout, &random_pose(rig, &mut random)));
        state.project(&layout);
        let start = state.coords.clone();
        let charts = Charts::new(&layout, &state.coords);
        let (mut memory, options, watch) = (Ipopt::new(&layout), SolverOptions::default(), Watch::new());
        let mut x: Vec<f64> = charts.free.iter().map(|dof| charts.values[*dof]).collect();
        let hard = HardRow::all(&layout, &problem);
        let n_movable = layout.terms.iter().filter(|t| t.is_hard && !t.is_constant);
        let n_wanted: usize = n_movable.map(|t| if t.parts.len() == 2 { 6 } else { 1 }).sum();
        assert_eq!(hard.len(), n_wanted, "case {case}");
        let jacobian = charts.jacobian(hard.len());
        let (n_cones, n_constraints) = (charts.ellipses.len(), charts.ellipses.len() + hard.len());
        let ranges = constraint_ranges(&charts, &hard);
        assert_eq!((ranges.0.len(), ranges.1.len()), (n_constraints, n_constraints));
        let mut cost = Cost {
            layout: &layout,
            problem: &problem,
            state: &mut state,
            charts,
            hard,
            memory: &mut memory,
            bar: &Bar { cost_below: None, nothing: 0.0, largest_weight: 1.0, impatient: false },
            budget: &mut Budget::new(&options, &watch),
            best: Outcome::new(f64::INFINITY, f64::INFINITY, StopReason::NoProgress, true),
            is_met: false,
            at: Vec::new(),
            is_linearized: false,
            stop: None,
        };
        cost.evaluate(&x);
        for (a, b) in cost.state.coords.iter().zip(&start) {
            // A quaternion and its opposite are the same rotation.
            assert!((a - b).abs() < 1e-12 || (a + b).abs() < 1e-12, "the start is where the variables say");
        }
        // Away from the start, limits or not.
        for value in &mut x {
            *value += random.between(-0.7, 0.7);
        }
        cost.evaluate(&x);
        let (mut gradient, mut values) = (vec![0.0; x.len()], vec![0.0; jacobian.len()]);
        assert!(cost.gradient(&x, &mut gradient) && cost.constraint_jacobian(&x, &mut values));
        for k in 0..x.len() {
            let mut shifted = |shift: f64| {
                let mut x = x.clone();
                x[k] += shift;
                let mut constraints = vec![0.0; n_constraints];
                assert!(cost.constraints(&x, &mut constraints));
                (cost.evaluate(&x), constraints)
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
        (x.len(), n_cones)
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
