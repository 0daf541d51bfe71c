//! The linearization of a state: what frames and local motions do to rows, carried down to the degrees of freedom.

use std::ops::Range;

use ikiru_rig::{Frame, JointMotion, Vec3};

use crate::layout::{Layout, NONE, Node, PartLayout, Place, Run, TermLayout};
use crate::objective::RowMemory;
use crate::problem::Terms;
use crate::state::{Constants, State};

impl State {
    /// The derivative of the residuals at the coordinates that were evaluated last, rows of the step scaled by the root
    /// of their weight `λ · ρ'` (by 1 where `plain`).
    pub(crate) fn linearize(&mut self, layout: &Layout, terms: &impl Terms, plain: bool) {
        self.jacobian.fill(0.0);
        if layout.n_guards > 0 {
            self.guard_jacobian.fill(0.0);
        }
        if layout.has_own {
            self.own_gradient.fill(0.0);
            self.own_curvature.fill(0.0);
        }
        for t in &layout.terms {
            if !terms.is_on(t.term) {
                self.scaled[t.rows.clone()].fill(0.0);
                self.weights[t.parts.clone()].fill(0.0);
                self.n_open[t.parts.clone()].fill(0);
                continue;
            }
            if t.is_constant && self.constants == Constants::Linearized {
                continue;
            }
            let (weight, loss) = (terms.term(t.term).weight, terms.term(t.term).loss);
            for part in t.parts.clone() {
                self.weights[part] = if plain { 1.0 } else { weight * loss.weight(self.squares[part]) };
            }
            if t.is_constant || !self.has_derivatives {
                self.measure::<true>(layout, terms.objective(t.term), t);
            }
            self.linearize_term(layout, t);
            if t.has_potential {
                self.add_potential(t, if plain { 1.0 } else { weight });
            }
        }
        self.constants = Constants::Linearized;
        // They are scaled by now.
        self.has_derivatives = false;
    }

    #[inline(always)]
    fn linearize_term(&mut self, layout: &Layout, t: &TermLayout) {
        for idx in t.parts.clone() {
            let part = &layout.parts[idx];
            match part.place {
                Place::Step => self.scale_rows(t, part, self.weights[idx].sqrt()),
                Place::Guard { .. } => {}
                Place::Own { first } => {
                    self.add_own(t, part, first..first + self.n_open[idx], self.weights[idx]);
                }
            }
        }
        for run in &t.runs {
            match (t.sums_up, run.is_guard) {
                (false, false) => {
                    let tree = Tree { layout, frames: &self.frames, directions: &self.directions };
                    walk_up::<false>(&tree, t, run, 0, &self.memory.by_frame, &mut self.jacobian);
                }
                (false, true) => {
                    let tree = Tree { layout, frames: &self.frames, directions: &self.directions };
                    walk_up::<true>(&tree, t, run, 0, &self.memory.by_frame, &mut self.guard_jacobian);
                }
                (true, false) => self.sum_up::<false>(layout, t, run),
                (true, true) => self.sum_up::<true>(layout, t, run),
            }
            if !t.by_motion.is_empty() {
                self.add_motions(layout, t, run);
            }
        }
    }

    /// The derivative of the rows of a linearized sample by the degrees of freedom of this one, so many samples before it.
    pub(crate) fn carry_back(
        &mut self,
        layout: &Layout,
        terms: &impl Terms,
        linearized: &RowMemory,
        back: usize,
    ) {
        self.jacobian.fill(0.0);
        self.guard_jacobian.fill(0.0);
        let tree = Tree { layout, frames: &self.frames, directions: &self.directions };
        for t in layout.terms.iter().filter(|t| t.n_earlier >= back && terms.is_on(t.term)) {
            for run in &t.runs {
                if run.is_guard {
                    walk_up::<true>(&tree, t, run, back, &linearized.by_frame, &mut self.guard_jacobian);
                } else {
                    walk_up::<false>(&tree, t, run, back, &linearized.by_frame, &mut self.jacobian);
                }
            }
        }
    }

    #[inline(always)]
    fn scale_rows(&mut self, t: &TermLayout, part: &PartLayout, scale: f64) {
        let rows = part.row..part.row + part.n_rows;
        for (scaled, residual) in self.scaled[rows.clone()].iter_mut().zip(&self.residual[rows]) {
            *scaled = residual * scale;
        }
        for frame in 0..t.nodes.len() * (1 + t.n_earlier) {
            let at = t.by_frame.start + (frame * t.n_slots + part.slot) * 6;
            for entry in &mut self.memory.by_frame[at..at + 6 * part.n_rows] {
                *entry *= scale;
            }
        }
        if !t.by_motion.is_empty() {
            let at = t.by_motion.start + part.slot * t.n_motion_dofs;
            self.memory.by_motion[at..at + part.n_rows * t.n_motion_dofs]
                .iter_mut()
                .for_each(|entry| *entry *= scale);
        }
    }

    /// The same for many frames at once: forces and moments about the world's origin are summed up from the leaves to
    /// the root, so that each joint is passed once.
    fn sum_up<const GUARD: bool>(&mut self, layout: &Layout, t: &TermLayout, run: &Run) {
        let n = run.slots.len();
        let wrenches = &mut self.wrenches[..layout.nodes.len() * n];
        wrenches.fill([Vec3::zero(); 2]);
        for (frame, &node) in t.nodes.iter().enumerate() {
            let first = t.by_frame.start + (frame * t.n_slots + run.slots.start) * 6;
            let rows = self.memory.by_frame[first..first + 6 * n].chunks_exact(6);
            let p = self.frames[node as usize].origin;
            for ([force, moment], r) in wrenches[node as usize * n..].iter_mut().zip(rows) {
                let f = Vec3::new(r[0], r[1], r[2]);
                *force += f;
                *moment = *moment + p.cross(f) + Vec3::new(r[3], r[4], r[5]);
            }
        }
        let jacobian = if GUARD { &mut self.guard_jacobian } else { &mut self.jacobian };
        for (idx, node) in layout.nodes.iter().enumerate().rev() {
            let (above, own) = wrenches.split_at_mut(idx * n);
            let own = &own[..n];
            if node.n_screws > 0 {
                let directions = &self.directions[node.screw as usize..(node.screw + node.n_screws) as usize];
                let origin = self.frames[idx].origin;
                let n_translations = node.motion.n_translations();
                let Entries { first: mut at, by_row, by_dof, factor } = entries::<GUARD>(layout, run, node);
                for [force, moment] in own {
                    let moment = *moment - origin.cross(*force);
                    for (k, direction) in directions.iter().enumerate() {
                        let entry = direction.dot(if k < n_translations { *force } else { moment });
                        jacobian[at + k * by_dof] += factor * entry;
                    }
                    at += by_row;
                }
            }
            if node.parent != NONE {
                for (to, from) in above[node.parent as usize * n..].iter_mut().zip(own) {
                    *to = [to[0] + from[0], to[1] + from[1]];
                }
            }
        }
    }

    /// The derivative of rows by the local motions that they read.
    fn add_motions(&mut self, layout: &Layout, t: &TermLayout, run: &Run) {
        for read in &t.joint_reads {
            let Some(dof) = read.dof else { continue };
            for (row, slot) in run.slots.clone().enumerate() {
                let at = t.by_motion.start + slot * t.n_motion_dofs + read.at;
                for (k, entry) in self.memory.by_motion[at..at + read.n_dofs].iter().enumerate() {
                    if run.is_guard {
                        self.guard_jacobian[(run.first + row) * layout.n_dofs + dof + k] += entry;
                    } else {
                        let span = layout.spans[dof + k];
                        self.jacobian[span.start + run.first + row - span.first] += entry;
                    }
                }
            }
        }
    }

    /// Gradient and curvature of separable rows.
    fn add_own(&mut self, t: &TermLayout, part: &PartLayout, rows: Range<usize>, weight: f64) {
        let residual = &self.residual[part.row..part.row + rows.len()];
        let (own, motions) = (&self.memory.own[rows.clone()], &self.memory.own_motion[rows]);
        let mut row = 0;
        while row < residual.len() {
            // The rows of one joint are neighbours.
            let motion = motions[row];
            let of_joint = motions[row..].iter().take_while(|m| **m == motion).count();
            let read = &t.joint_reads[motion];
            if let Some(dof) = read.dof {
                for k in 0..read.n_dofs {
                    let (mut gradient, mut curvature) = (0.0, 0.0);
                    for row in row..row + of_joint {
                        gradient += own[row][k] * residual[row];
                        curvature += own[row][k] * own[row][k];
                    }
                    self.own_gradient[dof + k] += weight * gradient;
                    self.own_curvature[dof + k] += weight * curvature;
                }
            }
            row += of_joint;
        }
        self.level(t);
    }

    fn add_potential(&mut self, t: &TermLayout, weight: f64) {
        for read in &t.joint_reads {
            let Some(dof) = read.dof else { continue };
            for k in 0..read.n_dofs {
                self.own_gradient[dof + k] += 0.5 * weight * self.memory.slope[t.slope.start + read.at + k];
                self.own_curvature[dof + k] +=
                    0.5 * weight * self.memory.curvature[t.slope.start + read.at + k];
            }
        }
        self.level(t);
    }

    /// The three directions of a ball share one curvature, the largest: a limit may mix them.
    fn level(&mut self, t: &TermLayout) {
        for read in &t.joint_reads {
            let (Some(dof), JointMotion::Ball { .. } | JointMotion::Free { .. }) = (read.dof, &read.motion)
            else {
                continue;
            };
            let turns = &mut self.own_curvature[dof + read.n_dofs - 3..dof + read.n_dofs];
            let largest = turns.iter().fold(0.0, |a: f64, b| a.max(*b));
            turns.fill(largest);
        }
    }

    /// The derivative of one row of a part by a degree of freedom, as of the last linearization.
    pub(crate) fn entry(
        &self,
        layout: &Layout,
        t: &TermLayout,
        part: &PartLayout,
        row: usize,
        dof: usize,
    ) -> f64 {
        match part.place {
            Place::Step => {
                let (span, row) = (layout.spans[dof], part.row + row);
                let inside = (span.first..span.first + span.len).contains(&row);
                if inside { self.jacobian[span.start + row - span.first] } else { 0.0 }
            }
            Place::Guard { first } => self.guard_jacobian[(first + row) * layout.n_dofs + dof],
            Place::Own { first } => {
                let read = &t.joint_reads[self.memory.own_motion[first + row]];
                let at = read.dof.and_then(|first| dof.checked_sub(first)).filter(|k| *k < read.n_dofs);
                at.map_or(0.0, |k| self.memory.own[first + row][k])
            }
        }
    }

    /// Whether a part of a mandatory term that is not within a part of its tolerance, `well`, misses less by the part `little` of the
    /// square of what it missed when squares were kept.
    pub(crate) fn gets_on(&self, layout: &Layout, problem: &crate::Problem, well: f64, little: f64) -> bool {
        layout.terms.iter().filter(|t| problem.terms()[t.term].counts()).any(|t| {
            let tolerance = problem.terms()[t.term].tolerance.times(well);
            t.parts.clone().any(|part| {
                let (now, well) = (self.squares[part], tolerance.of(layout.parts[part].unit));
                now > well * well && now < (1.0 - little) * self.kept_squares[part]
            })
        })
    }

    /// Whether every mandatory term is within a part of its tolerance, as of the last evaluation.
    pub(crate) fn is_satisfied(&self, layout: &Layout, problem: &crate::Problem, part: f64) -> bool {
        layout.terms.iter().all(|t| {
            let term = &problem.terms()[t.term];
            !term.counts() || self.is_within(layout, t, &term.tolerance.times(part))
        })
    }
}

/// Where everything is, as far as a walk along the tree needs it.
struct Tree<'a> {
    layout: &'a Layout,
    frames: &'a [Frame<f64>],
    directions: &'a [Vec3<f64>],
}

/// The shared walk: for a rotation about axis a through o, a frame at p moves by a × (p − o) and turns by a. With
/// rows (f, m) by velocity and turn, a's entry is a · ((p − o) × f + m).
#[inline(always)]
fn walk_up<const GUARD: bool>(
    tree: &Tree<'_>,
    t: &TermLayout,
    run: &Run,
    back: usize,
    by_frame: &[f64],
    jacobian: &mut [f64],
) {
    for (frame, &read) in t.nodes.iter().enumerate() {
        let frame = back * t.nodes.len() + frame;
        let first = t.by_frame.start + (frame * t.n_slots + run.slots.start) * 6;
        let rows = &by_frame[first..first + 6 * run.slots.len()];
        let p = tree.frames[read as usize].origin;
        let mut at = read;
        while let Some(node) = tree.layout.nodes.get(at as usize) {
            if node.n_screws > 0 {
                let directions = &tree.directions[node.screw as usize..(node.screw + node.n_screws) as usize];
                let arm = p - tree.frames[at as usize].origin;
                let n_translations = node.motion.n_translations();
                let mut place = entries::<GUARD>(tree.layout, run, node);
                let (threes, rest) = rows.as_chunks::<18>();
                for rows in threes {
                    add_rows::<3, GUARD>(rows, arm, directions, n_translations, &mut place, jacobian);
                }
                match rest.len() / 6 {
                    2 => add_rows::<2, GUARD>(rest, arm, directions, n_translations, &mut place, jacobian),
                    1 => add_rows::<1, GUARD>(rest, arm, directions, n_translations, &mut place, jacobian),
                    _ => {}
                }
            }
            at = node.parent;
        }
    }
}

/// Where the entries of a run and a node lie in a Jacobian.
struct Entries {
    first: usize,
    /// How far it is to the next row, and to the next degree of freedom.
    by_row: usize,
    by_dof: usize,
    /// What they are multiplied by: a follower moves with its leader.
    factor: f64,
}

/// Adds the entries of the next `N` rows by the degrees of freedom of one node, `arm` away from the frame that is read.
#[inline(always)]
fn add_rows<const N: usize, const GUARD: bool>(
    rows: &[f64],
    arm: Vec3<f64>,
    directions: &[Vec3<f64>],
    n_translations: usize,
    entries: &mut Entries,
    jacobian: &mut [f64],
) {
    let (mut forces, mut moments) = ([Vec3::zero(); N], [Vec3::zero(); N]);
    for ((force, moment), r) in forces.iter_mut().zip(&mut moments).zip(rows.chunks_exact(6)) {
        *force = Vec3::new(r[0], r[1], r[2]);
        *moment = arm.cross(*force) + Vec3::new(r[3], r[4], r[5]);
    }
    for (k, direction) in directions.iter().enumerate() {
        let wrenches = if k < n_translations { &forces } else { &moments };
        let column = &mut jacobian[entries.first + k * entries.by_dof..];
        if GUARD {
            for i in 0..N {
                column[i * entries.by_row] += entries.factor * direction.dot(wrenches[i]);
            }
        } else if let Some(column) = column.first_chunk_mut::<N>() {
            for i in 0..N {
                column[i] += entries.factor * direction.dot(wrenches[i]);
            }
        }
    }
    entries.first += N * entries.by_row;
}

/// Where the entries of a run and a node begin.
#[inline(always)]
fn entries<const GUARD: bool>(layout: &Layout, run: &Run, node: &Node) -> Entries {
    let dof = node.dof as usize;
    let (first, by_row, by_dof) = if GUARD {
        (run.first * layout.n_dofs + dof, layout.n_dofs, 1)
    } else {
        let span = layout.spans[dof];
        (span.start + run.first - span.first, 1, span.len)
    };
    match node.mimic {
        Some((multiplier, _)) => Entries { first, by_row, by_dof: 0, factor: multiplier },
        None => Entries { first, by_row, by_dof, factor: 1.0 },
    }
}

#[cfg(test)]
mod tests {
    use ikiru_rig::JointId;
    use ikiru_testkit::rigs::{Random, random_pose, random_rig};

    use super::*;
    use crate::objective::{Objective, Part, Reads, Rows, Unfit, View};
    use crate::problem::Problem;
    use crate::state::cases::Slide;
    use crate::words::Unit;

    /// Two parts of two rows each, which add up the degrees of freedom of two joints with factors of their own.
    #[derive(Clone, Debug)]
    struct Sums([JointId; 2]);

    /// The factor of a degree of freedom of one of the joints in a row.
    fn factor(row: usize, motion: usize, k: usize) -> f64 {
        (1 + row) as f64 + 10.0 * motion as f64 + 100.0 * k as f64
    }

    impl Objective for Sums {
        fn kind(&self) -> &'static str {
            "sums"
        }
        fn reads(&self, reads: &mut Reads<'_>) -> Result<(), Unfit> {
            self.0.iter().try_for_each(|joint| reads.motion(*joint))?;
            reads.part(Part::new(2, Unit::Radians))?;
            reads.part(Part::new(2, Unit::Radians))
        }
        fn check(&self) -> Result<(), Unfit> {
            Ok(())
        }
        fn evaluate(&self, _: &View<'_>, rows: &mut Rows<'_>) {
            for part in 0..2 {
                let first = rows.open(part, [1.0 + part as f64, 3.0]);
                if rows.wants_jacobian() {
                    for (row, motion) in [(first, 0), (first, 1), (first + 1, 0), (first + 1, 1)] {
                        let out = rows.by_motion(row, motion);
                        out.iter_mut().enumerate().for_each(|(k, out)| *out = factor(row, motion, k));
                    }
                }
            }
        }
    }

    /// A rig, and some of its joints that move.
    fn moving(number: u64) -> (Problem, Vec<JointId>) {
        let rig = random_rig(9, number);
        let problem = Problem::whole_body(&rig);
        let joints: Vec<JointId> = problem.active().collect();
        (problem, joints)
    }

    fn linearized(problem: &Problem, layout: &Layout, plain: bool) -> State {
        let mut state = State::new(layout);
        assert!(state.load(layout, &random_pose(problem.rig(), &mut Random::new(1))));
        state.evaluate(layout, problem);
        state.linearize(layout, problem, plain);
        state
    }

    #[test]
    fn rows_of_every_part_are_scaled_by_the_root_of_its_weight() {
        for number in 0..10 {
            let (mut problem, joints) = moving(number);
            // The second of two terms: its derivatives do not lie at the beginning.
            let pairs = [[joints[0], joints[1]], [joints[2], joints[joints.len() - 1]]];
            pairs.iter().for_each(|pair| _ = problem.add(9.0, Sums(*pair)));
            let layout = Layout::new(&problem).unwrap();
            for (plain, root) in [(false, 3.0), (true, 1.0)] {
                let state = linearized(&problem, &layout, plain);
                for (t, pair) in layout.terms.iter().zip(pairs) {
                    for part in &layout.parts[t.parts.clone()] {
                        for row in 0..2 {
                            let residual = state.residual[part.row + row];
                            assert_eq!(state.scaled[part.row + row], root * residual);
                            for (motion, joint) in pair.into_iter().enumerate() {
                                let m = layout.movers.iter().find(|m| m.joint == joint).unwrap();
                                for k in 0..m.n_dofs {
                                    let entry = state.entry(&layout, t, part, row, m.dof + k);
                                    assert_eq!(entry, root * factor(part.slot + row, motion, k));
                                }
                            }
                        }
                    }
                }
            }
        }
    }

    #[test]
    fn potentials_pull_by_half_their_slope_with_half_their_curvature() {
        for number in 0..10 {
            let (mut problem, joints) = moving(number);
            let (some, others) = joints.split_at(joints.len() / 2);
            let terms = [(0.5, some), (4.0, others)];
            terms
                .iter()
                .for_each(|(weight, joints)| _ = problem.add(*weight, Slide { joints: joints.to_vec() }));
            let layout = Layout::new(&problem).unwrap();
            let state = linearized(&problem, &layout, false);
            for (weight, joints) in terms {
                for (motion, joint) in joints.iter().enumerate() {
                    let m = layout.movers.iter().find(|m| m.joint == *joint).unwrap();
                    for dof in m.dof..m.dof + m.n_dofs {
                        let slope = 1.0 + motion as f64;
                        assert_eq!(state.own_gradient[dof], 0.5 * weight * slope);
                        assert_eq!(state.own_curvature[dof], 0.25 * weight * slope);
                    }
                }
            }
        }
    }
}
