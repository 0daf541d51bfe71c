//! The state of a solve: coordinates, frames, residuals and their derivative, in memory that is kept.

use ikiru_rig::{Frame, JointId, JointMotion, Pose, Vec3, kinematics, project_joint, retract_joint};

use crate::layout::{Layout, NONE, Node, TermLayout, n_translations};
use crate::objective::{Inputs, JointRows, Objective, Rows, Scratch};
use crate::problem::Terms;
use crate::term::Tolerance;

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
    frames: Vec<Frame<f64>>,
    /// World axis of each direction of each node.
    directions: Vec<Vec3<f64>>,
    /// Residuals from frames, as the objectives gave them.
    pub(crate) residual: Vec<f64>,
    /// Squared length of each part's residual.
    pub(crate) squares: Vec<f64>,
    /// `λ · ρ'` of each part, as of the last linearization.
    pub(crate) weights: Vec<f64>,
    /// Residuals from frames, times the root of their part's weight, as of the last linearization.
    pub(crate) scaled: Vec<f64>,
    /// The derivative of `scaled` by the degrees of freedom, as [`Layout::spans`] says.
    pub(crate) jacobian: Vec<f64>,
    /// Half the gradient and the curvature of joint rows.
    pub(crate) joint_gradient: Vec<f64>,
    pub(crate) joint_curvature: Vec<f64>,
    gathered: Vec<Frame<f64>>,
    term_jacobian: Vec<f64>,
    joint_residual: [f64; 6],
    joint_jacobian: Vec<f64>,
    scratch: Scratch,
    /// Every pose that was evaluated, for tests that ask for them.
    #[cfg(test)]
    pub(crate) seen: Option<Vec<Vec<f64>>>,
}

impl State {
    pub(crate) fn new(layout: &Layout) -> Self {
        let most = |f: &dyn Fn(&TermLayout) -> usize| layout.terms.iter().map(f).max().unwrap_or(0);
        let identity = Frame::identity();
        let most_rows = most(&|t| t.rows.len());
        Self {
            coords: vec![0.0; layout.n_kept_coords()],
            links: vec![(identity, false); layout.nodes.len()],
            link_coords: vec![0.0; layout.link_coords.len()],
            links_are_current: false,
            constants: Constants::Unknown,
            frames: vec![identity; layout.nodes.len()],
            directions: vec![Vec3::zero(); layout.n_screws],
            residual: vec![0.0; layout.n_rows],
            squares: vec![0.0; layout.parts.len()],
            weights: vec![0.0; layout.parts.len()],
            scaled: vec![0.0; layout.n_rows],
            jacobian: vec![0.0; layout.n_jacobian],
            joint_gradient: vec![0.0; layout.n_dofs],
            joint_curvature: vec![0.0; layout.n_dofs],
            gathered: vec![identity; most(&|t| t.nodes.len())],
            term_jacobian: vec![0.0; most(&|t| t.nodes.len() * t.rows.len() * 6)],
            joint_residual: [0.0; 6],
            joint_jacobian: vec![0.0; 36],
            scratch: Scratch {
                frames: Vec::with_capacity(most(&|t| t.nodes.len())),
                residual: Vec::with_capacity(most_rows),
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
                    pose.apply_motion_to(joint, &mut link);
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
        for m in &layout.movers {
            self.coords[m.coord..m.coord + m.n_coords]
                .copy_from_slice(&pose.coords()[m.pose_coord..m.pose_coord + m.n_coords]);
        }
        for &(to, from, n) in &layout.held {
            self.coords[to..to + n].copy_from_slice(&pose.coords()[from..from + n]);
        }
    }

    /// Writes the coordinates of what moves into a pose.
    pub(crate) fn store(&self, layout: &Layout, pose: &mut Pose) {
        let coords = pose.coords_mut();
        for m in &layout.movers {
            coords[m.pose_coord..m.pose_coord + m.n_coords]
                .copy_from_slice(&self.coords[m.coord..m.coord + m.n_coords]);
        }
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
        for m in &layout.movers {
            let coords = &mut self.coords[m.coord..m.coord + m.n_coords];
            retract_joint(&m.motion, coords, &tangent[m.dof..m.dof + m.n_dofs]);
            project_joint(&m.motion, coords);
        }
    }

    /// Forward kinematics of the reduced tree.
    #[inline]
    fn forward(&mut self, layout: &Layout) {
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

    /// World frames of the nodes.
    pub(crate) fn frames(&self) -> &[Frame<f64>] {
        &self.frames
    }

    /// The world axes that a node turns about or moves along, one for each of its degrees of freedom.
    pub(crate) fn directions(&self, node: &Node) -> &[Vec3<f64>] {
        &self.directions[node.screw as usize..(node.screw + node.n_screws) as usize]
    }

    /// Frames, residuals and cost at the current coordinates. A cost that is not a number comes out as
    /// infinite, so that no step leads there.
    pub(crate) fn evaluate(&mut self, layout: &Layout, terms: &impl Terms) -> f64 {
        #[cfg(test)]
        if let Some(seen) = &mut self.seen {
            seen.push(self.coords.clone());
        }
        self.forward(layout);
        let mut cost = 0.0;
        for t in layout.terms.iter().filter(|t| terms.is_on(t.term)) {
            let (weight, loss) = (terms.term(t.term).weight, terms.term(t.term).loss);
            if !t.is_constant || self.constants == Constants::Unknown {
                self.measure(layout, terms.objective(t.term), t);
            }
            for part in t.parts.clone() {
                cost += weight * loss.cost(self.squares[part]);
            }
        }
        if self.constants == Constants::Unknown {
            self.constants = Constants::Evaluated;
        }
        if cost.is_nan() { f64::INFINITY } else { cost }
    }

    /// The residual of one term, from the frames of the last [`evaluate`](Self::evaluate).
    #[inline(always)]
    pub(crate) fn measure(&mut self, layout: &Layout, objective: &dyn Objective, t: &TermLayout) {
        if !t.rows.is_empty() {
            let residual = &mut self.residual[t.rows.clone()];
            let gathered = &mut self.gathered[..t.nodes.len()];
            for (to, node) in gathered.iter_mut().zip(&t.nodes) {
                *to = self.frames[*node as usize];
            }
            objective
                .evaluate(&Inputs { frames: gathered }, &mut Rows::new(residual, &mut [], &mut self.scratch));
            let mut rest: &[f64] = residual;
            for part in t.frame_parts() {
                let (rows, others) = rest.split_at(layout.parts[part].n_rows);
                self.squares[part] = rows.iter().map(|r| r * r).sum::<f64>();
                rest = others;
            }
        }
        if !t.joint_reads.is_empty()
            && let Some(rows) = objective.joint_rows()
        {
            self.squares[t.joint_parts()].fill(0.0);
            for (idx, read) in t.joint_reads.iter().enumerate() {
                let residual = &mut self.joint_residual[..read.n_rows];
                residual.fill(0.0);
                let coords = &self.coords[read.coord..read.coord + read.n_coords];
                rows.evaluate(idx, &read.motion, coords, residual, None);
                let (slides, turns) = residual.split_at(read.n_translations);
                for (part, rows) in [(t.turn_part, turns), (t.slide_part, slides)] {
                    if !rows.is_empty() {
                        self.squares[part] += rows.iter().map(|r| r * r).sum::<f64>();
                    }
                }
            }
        }
    }

    /// The derivative of the residuals at the coordinates that were evaluated last, rows scaled by the root
    /// of their weight `λ · ρ'` (by 1 where `plain`).
    pub(crate) fn linearize(&mut self, layout: &Layout, terms: &impl Terms, plain: bool) {
        self.jacobian.fill(0.0);
        self.joint_gradient.fill(0.0);
        self.joint_curvature.fill(0.0);
        for t in &layout.terms {
            if !terms.is_on(t.term) {
                self.scaled[t.rows.clone()].fill(0.0);
                self.weights[t.parts.clone()].fill(0.0);
                continue;
            }
            if t.is_constant && self.constants == Constants::Linearized {
                continue;
            }
            let (weight, loss) = (terms.term(t.term).weight, terms.term(t.term).loss);
            for part in t.parts.clone() {
                self.weights[part] = if plain { 1.0 } else { weight * loss.weight(self.squares[part]) };
            }
            if !t.rows.is_empty() {
                self.linearize_frames(layout, terms, t);
            }
            if !t.joint_reads.is_empty()
                && let Some(rows) = terms.objective(t.term).joint_rows()
            {
                self.linearize_joints(rows, t);
            }
        }
        self.constants = Constants::Linearized;
    }

    fn linearize_frames(&mut self, layout: &Layout, terms: &impl Terms, t: &TermLayout) {
        let n_rows = t.rows.len();
        let gathered = &mut self.gathered[..t.nodes.len()];
        for (to, node) in gathered.iter_mut().zip(&t.nodes) {
            *to = self.frames[*node as usize];
        }
        let scaled = &mut self.scaled[t.rows.clone()];
        let jacobian = &mut self.term_jacobian[..t.nodes.len() * n_rows * 6];
        jacobian.fill(0.0);
        let mut rows = Rows::new(scaled, jacobian, &mut self.scratch);
        terms.objective(t.term).evaluate(&Inputs { frames: gathered }, &mut rows);
        let mut first = 0;
        for part in t.frame_parts() {
            let (last, scale) = (first + layout.parts[part].n_rows, self.weights[part].sqrt());
            for row in first..last {
                scaled[row] *= scale;
                for frame in 0..t.nodes.len() {
                    let at = (frame * n_rows + row) * 6;
                    for entry in &mut jacobian[at..at + 6] {
                        *entry *= scale;
                    }
                }
            }
            first = last;
        }
        // The shared walk: for a rotation about axis a through o, a frame at p moves by a × (p − o) and
        // turns by a. With rows (f, m) by velocity and turn, a's entry is a · ((p − o) × f + m).
        for (frame, &read) in t.nodes.iter().enumerate() {
            let rows = &self.term_jacobian[frame * n_rows * 6..(frame + 1) * n_rows * 6];
            let p = self.frames[read as usize].origin;
            let mut at = read;
            while let Some(node) = layout.nodes.get(at as usize) {
                if node.n_screws > 0 {
                    let directions =
                        &self.directions[node.screw as usize..(node.screw + node.n_screws) as usize];
                    let arm = p - self.frames[at as usize].origin;
                    let span = layout.spans[node.dof as usize];
                    let offset = span.start + t.rows.start - span.first;
                    let n_translations = n_translations(&node.motion);
                    let (factor, stride) = match node.mimic {
                        Some((multiplier, _)) => (multiplier, 0),
                        None => (1.0, span.len),
                    };
                    for (row, r) in rows.chunks_exact(6).enumerate() {
                        let force = Vec3::new(r[0], r[1], r[2]);
                        let moment = arm.cross(force) + Vec3::new(r[3], r[4], r[5]);
                        for (k, direction) in directions.iter().enumerate() {
                            let entry = direction.dot(if k < n_translations { force } else { moment });
                            self.jacobian[offset + row + k * stride] += factor * entry;
                        }
                    }
                }
                at = node.parent;
            }
        }
    }

    fn linearize_joints(&mut self, rows: &dyn JointRows, t: &TermLayout) {
        for (idx, read) in t.joint_reads.iter().enumerate() {
            let Some(dof) = read.dof else { continue };
            let n = read.n_rows;
            let residual = &mut self.joint_residual[..n];
            let jacobian = &mut self.joint_jacobian[..n * n];
            residual.fill(0.0);
            jacobian.fill(0.0);
            let coords = &self.coords[read.coord..read.coord + read.n_coords];
            rows.evaluate(idx, &read.motion, coords, residual, Some(jacobian));
            for (part, rows) in
                [(t.slide_part, 0..read.n_translations), (t.turn_part, read.n_translations..n)]
            {
                if rows.is_empty() {
                    continue;
                }
                let weight = self.weights[part];
                for k in 0..n {
                    let mut gradient = 0.0;
                    let mut curvature = 0.0;
                    for row in rows.clone() {
                        gradient += jacobian[row * n + k] * residual[row];
                        curvature += jacobian[row * n + k] * jacobian[row * n + k];
                    }
                    self.joint_gradient[dof + k] += weight * gradient;
                    self.joint_curvature[dof + k] += weight * curvature;
                }
            }
        }
        // The three directions of a ball share one curvature, the largest: a limit may mix them.
        for read in &t.joint_reads {
            let (Some(dof), JointMotion::Ball { .. } | JointMotion::Free { .. }) = (read.dof, &read.motion)
            else {
                continue;
            };
            let turns = &mut self.joint_curvature[dof + read.n_rows - 3..dof + read.n_rows];
            let largest = turns.iter().fold(0.0, |a: f64, b| a.max(*b));
            turns.fill(largest);
        }
    }

    /// The frames that a term reads, as of the last evaluation.
    pub(crate) fn frames_of(&mut self, t: &TermLayout) -> &[Frame<f64>] {
        let gathered = &mut self.gathered[..t.nodes.len()];
        for (to, node) in gathered.iter_mut().zip(&t.nodes) {
            *to = self.frames[*node as usize];
        }
        gathered
    }

    /// Whether every mandatory term is within its tolerance, as of the last evaluation.
    pub(crate) fn is_satisfied(&self, layout: &Layout, problem: &crate::Problem) -> bool {
        layout.terms.iter().all(|t| {
            let term = &problem.terms()[t.term];
            !term.counts() || self.is_within(layout, t, &term.tolerance)
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
