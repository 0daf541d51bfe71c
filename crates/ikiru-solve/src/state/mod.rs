//! The state of a solve: coordinates, frames, residuals and their derivative, in memory that is kept.

use ikiru_rig::{Frame, JointId, JointMotion, Pose, Vec3, kinematics, project_joint};

use crate::layout::{Layout, NONE, Node, PartLayout, TermLayout};
use crate::objective::{Objective, RowMemory, Rows, Scratch, View};
use crate::problem::Terms;
use crate::problem::term::Tolerance;
use crate::words::Sense;

#[cfg(test)]
pub(crate) mod cases;
pub(crate) mod gradient;
pub(crate) mod guards;
mod linearize;
pub(crate) mod most;
pub(crate) mod motion;
pub(crate) mod rate_bounds;
pub(crate) mod smoothness;
pub(crate) mod spacing;

/// What is known of the terms that read nothing that moves.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
enum Constants {
    /// Nothing yet, of this pose and these targets.
    #[default]
    Unknown,
    /// Their residuals.
    Evaluated,
    /// Their scaled residuals too.
    Linearized,
}

/// Everything that changes while a problem is solved.
#[derive(Clone, Debug, Default)]
pub(crate) struct State {
    /// Coordinates of the movers, then those that are only read.
    pub(crate) coords: Vec<f64>,
    /// Fixed transform of each node from its parent, and whether it only translates.
    links: Vec<(Frame<f64>, bool)>,
    /// The coordinates that the links were made from.
    link_coords: Vec<f64>,
    links_are_current: bool,
    constants: Constants,
    /// Whether the derivatives in the memory are those of the last evaluation.
    has_derivatives: bool,
    frames: Vec<Frame<f64>>,
    /// World axis of each direction of each node.
    directions: Vec<Vec3<f64>>,
    /// Residuals as the objectives gave them: rows of the step, guards, separable rows.
    pub(crate) residual: Vec<f64>,
    /// Squared length of what each part misses.
    pub(crate) squares: Vec<f64>,
    /// Those that were kept, to tell whether terms get on.
    pub(crate) kept_squares: Vec<f64>,
    /// How many rows of each part are open.
    pub(crate) n_open: Vec<usize>,
    /// By how much hard rows are missed that something moves, summed up (metres, radians).
    pub(crate) violation: f64,
    /// `λ · ρ'` of each part, as of the last linearization.
    pub(crate) weights: Vec<f64>,
    /// Residuals of the step's rows, times the root of their part's weight, as of the last linearization.
    pub(crate) scaled: Vec<f64>,
    /// The derivative of the step's rows in `scaled` by the degrees of freedom, as [`Layout::spans`] says.
    pub(crate) jacobian: Vec<f64>,
    /// The derivative of guards by the degrees of freedom, row by row.
    pub(crate) guard_jacobian: Vec<f64>,
    /// Half the gradient and the curvature of separable rows and potentials.
    pub(crate) own_gradient: Vec<f64>,
    pub(crate) own_curvature: Vec<f64>,
    /// The potential of each term that has one.
    pub(crate) values: Vec<f64>,
    gathered: Vec<Frame<f64>>,
    /// Frames of the nodes at earlier samples, the nearest first, and those of them that a term reads.
    earlier: Vec<Vec<Frame<f64>>>,
    gathered_earlier: Vec<Frame<f64>>,
    /// Sums of rows up the tree: `[node][row]`, force and moment about the world's origin.
    wrenches: Vec<[Vec3<f64>; 2]>,
    pub(crate) memory: RowMemory,
    /// Every pose that was evaluated, for tests that ask for them.
    #[cfg(test)]
    pub(crate) seen: Option<Vec<Vec<f64>>>,
}

impl State {
    pub(crate) fn new(layout: &Layout) -> Self {
        let most = |f: &dyn Fn(&TermLayout) -> usize| layout.terms.iter().map(f).max().unwrap_or(0);
        let identity = Frame::identity();
        let n_rows = layout.n_all_rows();
        let of_run = |t: &TermLayout| t.runs.iter().map(|run| run.slots.len()).max().unwrap_or(0);
        let n_wrenches = layout.nodes.len() * most(&|t| if t.sums_up { of_run(t) } else { 0 });
        Self {
            coords: vec![0.0; layout.n_kept_coords()],
            links: vec![(identity, false); layout.nodes.len()],
            link_coords: vec![0.0; layout.link_coords.len()],
            links_are_current: false,
            constants: Constants::Unknown,
            has_derivatives: false,
            frames: vec![identity; layout.nodes.len()],
            directions: vec![Vec3::zero(); layout.n_screws],
            residual: vec![0.0; n_rows],
            squares: vec![0.0; layout.parts.len()],
            kept_squares: vec![0.0; layout.parts.len()],
            n_open: vec![0; layout.parts.len()],
            violation: 0.0,
            weights: vec![0.0; layout.parts.len()],
            scaled: vec![0.0; layout.n_rows],
            jacobian: vec![0.0; layout.n_jacobian],
            guard_jacobian: vec![0.0; layout.n_guards * layout.n_dofs],
            own_gradient: vec![0.0; layout.n_dofs],
            own_curvature: vec![0.0; layout.n_dofs],
            values: vec![0.0; layout.terms.len()],
            gathered: vec![identity; most(&|t| t.nodes.len())],
            earlier: vec![vec![identity; layout.nodes.len()]; layout.n_earlier],
            gathered_earlier: Vec::with_capacity(most(&|t| t.n_earlier * t.nodes.len())),
            wrenches: vec![[Vec3::zero(); 2]; n_wrenches],
            memory: RowMemory {
                by_frame: vec![0.0; layout.n_by_frame],
                by_motion: vec![0.0; layout.n_by_motion],
                own_motion: vec![0; layout.n_own_rows],
                own: vec![[0.0; 6]; layout.n_own_rows],
                slope: vec![0.0; layout.n_slope],
                curvature: vec![0.0; layout.n_slope],
                scratch: Scratch::of(layout.terms.iter().filter(|t| t.is_by_duals)),
                ..RowMemory::default()
            },
            #[cfg(test)]
            seen: None,
        }
    }

    /// Takes over a pose: coordinates of what moves, links of what does not. False where a number that
    /// matters is not finite or a quaternion not of unit length.
    pub(crate) fn load(&mut self, layout: &Layout, pose: &Pose) -> bool {
        self.load_coords(layout, pose);
        self.forget_constants();
        if !layout.movers.iter().all(|m| is_valid(&m.motion, &self.coords[m.coord..m.coord + m.n_coords])) {
            return false;
        }
        // Links change only where joints that do not move here have been moved elsewhere.
        let held = layout.link_coords.iter().map(|at| pose.coords()[*at]);
        if self.links_are_current && held.clone().eq(self.link_coords.iter().copied()) {
            return true;
        }
        let rig = pose.rig();
        let is_bad = |joint: &JointId| {
            rig.get(*joint).is_some_and(|data| !is_valid(&data.motion, &pose.coords()[rig.coords_of(*joint)]))
        };
        self.links_are_current = false;
        if layout.link_joints.iter().any(is_bad) {
            return false;
        }
        for (to, from) in self.link_coords.iter_mut().zip(held) {
            *to = from;
        }
        self.links_are_current = true;
        for (idx, range) in layout.links.iter().enumerate() {
            let mut link = Frame::identity();
            let joints = &layout.link_joints[range.clone()];
            for (position, &joint) in joints.iter().enumerate() {
                link = kinematics::rest_frame(rig, joint, &link);
                let moves =
                    position + 1 == joints.len() && !matches!(layout.nodes[idx].motion, JointMotion::Fixed);
                if !moves {
                    kinematics::apply_motion_in(pose, joint, &mut link);
                }
            }
            let is_translation = link.rotation == ikiru_rig::Rotation::identity();
            self.links[idx] = (link, is_translation);
        }
        true
    }

    /// Has terms that read nothing that moves evaluated again: joints that stay may stand elsewhere, or targets.
    pub(crate) fn forget_constants(&mut self) {
        self.constants = Constants::Unknown;
    }

    fn load_coords(&mut self, layout: &Layout, pose: &Pose) {
        layout.load(pose.coords(), &mut self.coords);
        for &(to, from, n) in &layout.held {
            self.coords[to..to + n].copy_from_slice(&pose.coords()[from..from + n]);
        }
    }

    /// Writes the coordinates of what moves into a pose.
    pub(crate) fn store(&self, layout: &Layout, pose: &mut Pose) {
        layout.store(&self.coords, pose.coords_mut());
    }

    /// Moves every joint that is outside its limits to the nearest value inside; says whether one was.
    pub(crate) fn project(&mut self, layout: &Layout) -> bool {
        let mut moved = false;
        for m in &layout.movers {
            moved |= project_joint(&m.motion, &mut self.coords[m.coord..m.coord + m.n_coords]);
        }
        moved
    }

    /// `coords := project(from ⊕ tangent)`.
    pub(crate) fn step(&mut self, layout: &Layout, from: &[f64], tangent: &[f64]) {
        let n = layout.n_coords;
        if layout.is_flat {
            let (coords, from, tangent) = (&mut self.coords[..n], &from[..n], &tangent[..n]);
            let (lower, upper) = (&layout.lower[..n], &layout.upper[..n]);
            for i in 0..n {
                coords[i] = (from[i] + tangent[i]).max(lower[i]).min(upper[i]);
            }
            return;
        }
        self.coords[..n].copy_from_slice(&from[..n]);
        layout.move_by(&mut self.coords, tangent);
    }

    /// Forward kinematics of the reduced tree.
    #[inline]
    pub(crate) fn forward(&mut self, layout: &Layout) {
        for idx in 0..layout.nodes.len() {
            self.place(layout, idx);
        }
    }

    /// The frame of one node, from its parent's and the current coordinates.
    #[inline(always)]
    pub(crate) fn place(&mut self, layout: &Layout, idx: usize) {
        let node = &layout.nodes[idx];
        let (link, is_translation) = &self.links[idx];
        let mut frame = if node.parent == NONE {
            *link
        } else {
            let parent = &self.frames[node.parent as usize];
            let origin = parent.point(link.origin);
            let rotation =
                if *is_translation { parent.rotation } else { parent.rotation.compose(&link.rotation) };
            Frame { rotation, origin }
        };
        let directions = &mut self.directions[node.screw as usize..(node.screw + node.n_screws) as usize];
        let coords = &self.coords[node.coord as usize..];
        match node.mimic {
            None => kinematics::apply_motion::<f64, true>(&node.motion, coords, &mut frame, directions),
            Some((multiplier, offset)) => {
                let value = coords[0] * multiplier + offset;
                kinematics::apply_motion::<f64, true>(&node.motion, &[value], &mut frame, directions);
            }
        }
        self.frames[idx] = frame;
    }

    /// Takes over the frames so many samples back, from 0, from a state of that sample.
    pub(crate) fn set_earlier(&mut self, layout: &Layout, back: usize, state: &mut Self) {
        state.forward(layout);
        self.earlier[back].copy_from_slice(&state.frames);
        self.forget_constants();
    }

    /// World frames of the nodes.
    pub(crate) fn frames(&self) -> &[Frame<f64>] {
        &self.frames
    }

    /// The world axes that a node turns about or moves along, one for each of its degrees of freedom.
    pub(crate) fn directions(&self, node: &Node) -> &[Vec3<f64>] {
        &self.directions[node.screw as usize..(node.screw + node.n_screws) as usize]
    }

    /// Frames, residuals and cost at the current coordinates. A cost that is not a number comes out as
    /// infinite, so that no step leads there; so does that of an objective that gave up.
    pub(crate) fn evaluate(&mut self, layout: &Layout, terms: &impl Terms) -> f64 {
        self.evaluate_with::<false>(layout, terms)
    }

    /// The same with the derivatives of the residuals, for a pose from which a step will likely be taken:
    /// [`linearize`](Self::linearize) then finds them.
    #[inline(never)]
    pub(crate) fn differentiate(&mut self, layout: &Layout, terms: &impl Terms) -> f64 {
        self.evaluate_with::<true>(layout, terms)
    }

    #[inline(always)]
    fn evaluate_with<const DERIVATIVES: bool>(&mut self, layout: &Layout, terms: &impl Terms) -> f64 {
        #[cfg(test)]
        if let Some(seen) = &mut self.seen {
            seen.push(self.coords.clone());
        }
        self.forward(layout);
        let mut cost = 0.0;
        let mut violation = 0.0;
        for t in layout.terms.iter().filter(|t| terms.is_on(t.term)) {
            if !t.is_constant || self.constants == Constants::Unknown {
                self.measure::<DERIVATIVES>(layout, terms.objective(t.term), t);
            }
            if t.is_hard {
                // What no step can change must not say how much a step is worth.
                if !t.is_constant {
                    violation += self.violation_of(layout, t);
                }
                continue;
            }
            let term = terms.term(t.term);
            for square in &self.squares[t.parts.clone()] {
                cost += term.weight * term.loss.cost(*square);
            }
            if t.has_potential {
                cost += term.weight * self.values[t.term];
            }
        }
        if layout.n_guards > 0 {
            self.violation = if violation.is_nan() { f64::INFINITY } else { violation };
        }
        if self.constants == Constants::Unknown {
            self.constants = Constants::Evaluated;
        }
        self.has_derivatives = DERIVATIVES;
        if cost.is_nan() || self.memory.failure.is_some() { f64::INFINITY } else { cost }
    }

    /// The residuals of guards, in the order of the layout, as of the last evaluation.
    #[inline(always)]
    pub(crate) fn guard_residual(&self, layout: &Layout) -> &[f64] {
        &self.residual[layout.n_rows..layout.n_rows + layout.n_guards]
    }

    /// By how much the rows of a hard term are missed, summed up.
    fn violation_of(&self, layout: &Layout, t: &TermLayout) -> f64 {
        let of_part = |part: &PartLayout| {
            let rows = &self.residual[part.row..part.row + part.n_rows];
            rows.iter().map(|r| part.sense.missing(*r).abs()).sum::<f64>()
        };
        layout.parts[t.parts.clone()].iter().map(of_part).sum()
    }

    /// The residual of one term, from the frames of the last [`evaluate`](Self::evaluate), and its derivatives.
    #[inline(always)]
    pub(crate) fn measure<const DERIVATIVES: bool>(
        &mut self,
        layout: &Layout,
        objective: &dyn Objective,
        t: &TermLayout,
    ) {
        let parts = &layout.parts[t.parts.clone()];
        let frames = if let [node] = t.nodes[..] {
            std::slice::from_ref(&self.frames[node as usize])
        } else {
            let gathered = &mut self.gathered[..t.nodes.len()];
            for (to, node) in gathered.iter_mut().zip(&t.nodes) {
                *to = self.frames[*node as usize];
            }
            &*gathered
        };
        let earlier = if t.n_earlier == 0 {
            &[][..]
        } else {
            self.gathered_earlier.clear();
            for back in &self.earlier[..t.n_earlier] {
                self.gathered_earlier.extend(t.nodes.iter().map(|node| back[*node as usize]));
            }
            &self.gathered_earlier
        };
        let view = View { frames, earlier, motions: &t.joint_reads, coords: &self.coords };
        objective
            .evaluate(&view, &mut Rows::new(&mut self.residual, t, parts, &mut self.memory, DERIVATIVES));
        let squares = self.squares[t.parts.clone()].iter_mut().zip(&mut self.n_open[t.parts.clone()]);
        for ((part, n_open), (square, open)) in parts.iter().zip(self.memory.n_open).zip(squares) {
            let rows = &mut self.residual[part.row..part.row + part.n_rows];
            if n_open < rows.len() {
                rows[n_open..].fill(0.0);
            }
            *square = match part.sense {
                Sense::Equal => rows.iter().map(|r| r * r).sum(),
                Sense::AtLeast => rows.iter().map(|r| r.min(0.0).powi(2)).sum(),
            };
            *open = n_open;
        }
        if t.has_potential {
            self.values[t.term] = self.memory.value;
        }
    }

    /// The smallest residual of a part whose rows want to be at least 0, as of the last evaluation: of those that are open.
    pub(crate) fn least(&self, layout: &Layout, part: usize) -> Option<f64> {
        let PartLayout { sense, row, .. } = layout.parts[part];
        let rows = &self.residual[row..row + self.n_open[part]];
        if sense == Sense::AtLeast { rows.iter().copied().reduce(f64::min) } else { None }
    }

    /// The squares of what hard terms miss, as of the last evaluation.
    pub(crate) fn hard_square(&self, layout: &Layout, terms: &impl Terms) -> f64 {
        let hard = layout.terms.iter().filter(|t| t.is_hard && terms.is_on(t.term));
        hard.flat_map(|t| &self.squares[t.parts.clone()]).sum()
    }

    /// Whether every hard term is within its tolerance, as of the last evaluation.
    pub(crate) fn holds(&self, layout: &Layout, problem: &crate::Problem) -> bool {
        layout.terms.iter().filter(|t| t.is_hard).all(|t| {
            let term = &problem.terms()[t.term];
            !term.is_on || self.is_within(layout, t, &term.tolerance)
        })
    }

    /// Whether every part of a term is within a tolerance, as of the last evaluation.
    pub(crate) fn is_within(&self, layout: &Layout, t: &TermLayout, tolerance: &Tolerance) -> bool {
        t.parts.clone().all(|part| {
            let tolerance = tolerance.of(layout.parts[part].unit);
            self.squares[part] <= tolerance * tolerance
        })
    }
}

/// Whether a joint's coordinates are finite, its quaternion of unit length within 1e-6.
fn is_valid(motion: &JointMotion, coords: &[f64]) -> bool {
    let finite = coords.iter().all(|c| c.is_finite());
    let (JointMotion::Ball { .. } | JointMotion::Free { .. }, Some(q)) = (motion, coords.last_chunk::<4>())
    else {
        return finite;
    };
    finite && (q.iter().map(|c| c * c).sum::<f64>() - 1.0).abs() < 2e-6
}

#[cfg(test)]
mod tests {
    use glam::DVec3;
    use ikiru_rig::Range;
    use ikiru_testkit::rigs::random_rig;

    use super::*;
    use crate::objective::{Part, Reads, Unfit};
    use crate::problem::Problem;
    use crate::words::Unit;

    /// As many rows of 1 as it is told to open.
    #[derive(Clone, Debug)]
    struct Open(JointId, usize);

    impl Objective for Open {
        fn kind(&self) -> &'static str {
            "open"
        }
        fn reads(&self, reads: &mut Reads<'_>) -> Result<(), Unfit> {
            reads.frame(self.0)?;
            reads.part(Part::new(3, Unit::Metres))
        }
        fn check(&self) -> Result<(), Unfit> {
            Ok(())
        }
        fn evaluate(&self, _: &View<'_>, rows: &mut Rows<'_>) {
            (0..self.1).for_each(|_| _ = rows.open(0, [1.0]));
        }
    }

    #[test]
    fn a_row_that_is_no_longer_opened_wants_nothing() {
        let rig = random_rig(4, 1);
        let mut problem = Problem::whole_body(&rig);
        let term = problem.add(2.0, Open(JointId::from_index(3), 3));
        let layout = Layout::new(&problem).unwrap();
        let mut state = State::new(&layout);
        assert!(state.load(&layout, &rig.rest_pose()));
        for n_open in [3, 1, 2, 0, 3] {
            problem.get_mut(term).unwrap().1 = n_open;
            assert_eq!(state.evaluate(&layout, &problem), 2.0 * n_open as f64);
            assert_eq!((state.squares[0], state.n_open[0]), (n_open as f64, n_open));
            let open = state.residual[..3].iter().filter(|r| **r == 1.0).count();
            assert!(open == n_open && state.residual[n_open..3].iter().all(|r| *r == 0.0));
        }
    }

    #[test]
    fn coordinates_are_finite_and_quaternions_of_unit_length() {
        let ball = JointMotion::BALL;
        let hinge = JointMotion::Hinge { axis: DVec3::X, range: Range::UNLIMITED };
        assert!(is_valid(&ball, &[0.0, 0.0, 0.6, 0.8]) && is_valid(&hinge, &[5.0]));
        for length in [0.0, 1.0 - 2e-6, 1.0 + 2e-6] {
            assert!(!is_valid(&ball, &[0.0, 0.0, 0.0, length]), "{length}");
        }
        assert!(is_valid(&ball, &[0.0, 0.0, 0.0, 1.0 + 0.5e-6]));
        assert!(!is_valid(&ball, &[f64::NAN, 0.0, 0.0, 1.0]) && !is_valid(&hinge, &[f64::INFINITY]));
    }
}
