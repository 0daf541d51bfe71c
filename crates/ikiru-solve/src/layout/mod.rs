//! The layout of a problem: the tree reduced to what moves and what is read, and where everything lies.
//!
//! Joints between two nodes of the reduced tree are folded into one fixed link, rows are ordered so that
//! those below a joint are neighbours, and each degree of freedom knows the rows that it can move.

use std::ops::Range;

use ikiru_rig::{JointId, JointMotion, Rig, project_joint, retract_joint};

use crate::objective::{TermReads, Unfit};
use crate::problem::Problem;
use crate::words::Sense;

mod paths;
mod signature;
mod tree;

pub(crate) use crate::objective::places::{JointRead, PartLayout, Place, Run, TermLayout};
use paths::work_over_rows;
pub(crate) use paths::{Paths, Span};
pub(crate) use signature::Signature;
use tree::depth_first;

/// No parent in the reduced tree.
pub(crate) const NONE: u32 = u32::MAX;

/// Up to here, loops over rows of a known number beat leaving out the rows that a joint cannot move.
const MOST_DENSE_ROWS: usize = 12;

/// Up to so many frames of one term, walking from each to its root beats one pass over the whole tree.
const MOST_WALKED: usize = 3;

/// A joint of the reduced tree: one that moves, or whose frame is read.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Node {
    pub(crate) parent: u32,
    /// `Fixed` where the joint does not move in this problem.
    pub(crate) motion: JointMotion,
    /// Where its coordinates (or its leader's) lie.
    pub(crate) coord: u32,
    /// Where its directions lie, and how many there are.
    pub(crate) screw: u32,
    pub(crate) n_screws: u32,
    /// The degree of freedom of its first direction.
    pub(crate) dof: u32,
    /// `(multiplier, offset)` of a joint that follows another.
    pub(crate) mimic: Option<(f64, f64)>,
}

/// A joint with degrees of freedom of its own that moves in this problem.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Mover {
    pub(crate) joint: JointId,
    pub(crate) motion: JointMotion,
    pub(crate) coord: usize,
    pub(crate) n_coords: usize,
    pub(crate) dof: usize,
    pub(crate) n_dofs: usize,
    /// Where its coordinates lie in the pose.
    pub(crate) pose_coord: usize,
}

impl Mover {
    /// Whether its `k`-th degree of freedom moves along an axis rather than turning about it.
    pub(crate) fn is_translation(&self, k: usize) -> bool {
        k < self.motion.n_translations()
    }
}

#[derive(Clone, Debug, Default)]
pub(crate) struct Layout {
    pub(crate) nodes: Vec<Node>,
    /// For each node, the joints of its link in [`link_joints`](Self::link_joints), from the top.
    pub(crate) links: Vec<Range<usize>>,
    pub(crate) link_joints: Vec<JointId>,
    /// Where in the pose the coordinates lie that the links are made from.
    pub(crate) link_coords: Vec<usize>,
    pub(crate) movers: Vec<Mover>,
    pub(crate) terms: Vec<TermLayout>,
    pub(crate) parts: Vec<PartLayout>,
    /// For each degree of freedom, the first and past-the-last row that it can move, and where they are stored.
    pub(crate) spans: Vec<Span>,
    /// The range of each degree of freedom; unlimited for those of balls.
    pub(crate) lower: Vec<f64>,
    pub(crate) upper: Vec<f64>,
    /// Where the coordinate of each ranged degree of freedom lies (anywhere for those of balls).
    pub(crate) coord_of_dof: Vec<usize>,
    /// Whether every degree of freedom is one coordinate: no balls.
    pub(crate) is_flat: bool,
    /// Coordinates that are read but do not move: (where they are kept, where they lie in the pose, how many).
    pub(crate) held: Vec<(usize, usize, usize)>,
    pub(crate) n_coords: usize,
    pub(crate) n_dofs: usize,
    pub(crate) n_screws: usize,
    /// Rows of the step; then come the guards, then the separable ones.
    pub(crate) n_rows: usize,
    pub(crate) n_guards: usize,
    pub(crate) n_own_rows: usize,
    /// How many entries there are in the derivatives of all terms by what they read.
    pub(crate) n_by_frame: usize,
    pub(crate) n_by_motion: usize,
    pub(crate) n_slope: usize,
    pub(crate) n_jacobian: usize,
    /// How many rows there are (3, 6, 9 or 12, the last ones empty) where they are so few that all are kept
    /// for every degree of freedom.
    pub(crate) dense_rows: Option<usize>,
    /// Which degrees of freedom steps couple, where they are solved for over these, since that is less work than over rows.
    pub(crate) paths: Option<Paths>,
    /// Whether there is gradient or curvature beside rows.
    pub(crate) has_own: bool,
    pub(crate) has_cones: bool,
    /// The most earlier samples that a term reads.
    pub(crate) n_earlier: usize,
    pub(crate) signature: Signature,
}

impl Layout {
    /// Lays out a problem.
    ///
    /// # Errors
    /// The first term that is not usable, and why.
    pub(crate) fn new(problem: &Problem) -> Result<Self, (usize, Unfit)> {
        let layout = Self::with(problem, &[])?;
        layout.signature.check_pose()?;
        Ok(layout)
    }

    /// Lays out the terms of a motion, where some joints matter that no term reads.
    pub(crate) fn with(problem: &Problem, others: &[JointId]) -> Result<Self, (usize, Unfit)> {
        let rig = problem.rig();
        let signature = Signature::of(problem, others)?;
        let reads: Vec<&TermReads> = signature.terms.iter().map(|(reads, _)| reads).collect();
        let mut layout = Self::default();
        let order = depth_first(rig);
        let moves = layout.place_movers(problem, &reads, others, &order);
        let node_of = layout.place_nodes(rig, &reads, &order, &moves);
        layout.place_terms(rig, &signature, &node_of);
        layout.place_rows();
        layout.signature = signature;
        Ok(layout)
    }

    /// Decides which joints move, and lays out their coordinates. The answer holds, for each joint, the mover that
    /// drives it.
    fn place_movers(
        &mut self,
        problem: &Problem,
        reads: &[&TermReads],
        others: &[JointId],
        order: &[JointId],
    ) -> Vec<Option<usize>> {
        let rig = problem.rig();
        // A joint matters if a frame below it is read, or its own motion is, or a follower of it matters.
        let mut matters = vec![false; rig.n_joints()];
        others.iter().for_each(|joint| matters[joint.index()] = true);
        for joint in reads.iter().flat_map(|reads| &reads.frames) {
            for ancestor in rig.ancestors(*joint) {
                if std::mem::replace(&mut matters[ancestor.index()], true) {
                    break;
                }
            }
        }
        for id in rig.ids() {
            if let Some(mimic) = rig.joints()[id.index()].mimic
                && matters[id.index()]
            {
                matters[mimic.leader.index()] = true;
            }
        }
        for joint in reads.iter().flat_map(|reads| &reads.motions) {
            matters[joint.index()] = true;
        }
        self.is_flat = true;
        let mut driver = vec![None; rig.n_joints()];
        for &joint in order {
            let data = &rig.joints()[joint.index()];
            if !problem.is_active(joint) || !matters[joint.index()] || data.n_dofs() == 0 {
                continue;
            }
            driver[joint.index()] = Some(self.movers.len());
            self.movers.push(Mover {
                joint,
                motion: data.motion,
                coord: self.n_coords,
                n_coords: data.n_coords(),
                dof: self.n_dofs,
                n_dofs: data.n_dofs(),
                pose_coord: rig.coords_of(joint).start,
            });
            self.has_cones |= data.motion.cone().is_some();
            let ranges = data.motion.ranges();
            for k in 0..data.n_dofs() {
                let range = ranges.get(k).copied().unwrap_or_default();
                self.lower.push(range.min);
                self.upper.push(range.max);
                self.coord_of_dof.push(self.n_coords + k.min(data.n_coords() - 1));
            }
            self.n_coords += data.n_coords();
            self.n_dofs += data.n_dofs();
            self.is_flat &= data.n_coords() == data.n_dofs();
        }
        for id in rig.ids() {
            if let Some(mimic) = rig.joints()[id.index()].mimic {
                driver[id.index()] = driver[mimic.leader.index()];
            }
        }
        driver
    }

    /// Builds the reduced tree: every joint above a frame that is read, and that moves or is read itself.
    fn place_nodes(
        &mut self,
        rig: &Rig,
        reads: &[&TermReads],
        order: &[JointId],
        driver: &[Option<usize>],
    ) -> Vec<u32> {
        let mut read = vec![false; rig.n_joints()];
        let mut above = vec![false; rig.n_joints()];
        for joint in reads.iter().flat_map(|reads| &reads.frames) {
            read[joint.index()] = true;
            for ancestor in rig.ancestors(*joint) {
                if std::mem::replace(&mut above[ancestor.index()], true) {
                    break;
                }
            }
        }
        let mut node_of = vec![NONE; rig.n_joints()];
        for &joint in order {
            let idx = joint.index();
            let moves = above[idx] && driver[idx].is_some();
            if !read[idx] && !moves {
                continue;
            }
            let data = &rig.joints()[idx];
            let mut link: Vec<JointId> =
                rig.ancestors(joint).take_while(|j| *j == joint || node_of[j.index()] == NONE).collect();
            let top = link.last().copied().unwrap_or(joint);
            let parent = rig.joints()[top.index()].parent.map_or(NONE, |p| node_of[p.index()]);
            link.reverse();
            let mut node = Node {
                parent,
                motion: JointMotion::Fixed,
                coord: 0,
                screw: u32_of(self.n_screws),
                n_screws: 0,
                dof: 0,
                mimic: None,
            };
            if let Some(mover) = driver[idx].map(|m| &self.movers[m]) {
                node.motion = data.motion;
                node.coord = u32_of(mover.coord);
                node.dof = u32_of(mover.dof);
                node.n_screws = u32_of(data.motion.n_dofs());
                node.mimic = data.mimic.map(|m| (m.multiplier, m.offset));
                self.n_screws += data.motion.n_dofs();
            }
            node_of[idx] = u32_of(self.nodes.len());
            for &held in link.iter().filter(|j| driver[j.index()].is_none()) {
                let leader = rig.joints()[held.index()].mimic.map_or(held, |m| m.leader);
                self.link_coords.extend(rig.coords_of(leader));
            }
            self.links.push(self.link_joints.len()..self.link_joints.len() + link.len());
            self.link_joints.extend(link);
            self.nodes.push(node);
        }
        node_of
    }

    fn place_terms(&mut self, rig: &Rig, signature: &Signature, node_of: &[u32]) {
        let mut n_coords = self.n_coords;
        for (idx, (reads, is_hard)) in signature.terms.iter().enumerate() {
            let mut n_motion_dofs = 0;
            let joint_reads: Vec<JointRead> = reads
                .motions
                .iter()
                .map(|&joint| {
                    let data = &rig.joints()[joint.index()];
                    let (n_coords_of, n_dofs) = (data.n_coords(), data.n_dofs());
                    let mover = self.movers.iter().find(|m| m.joint == joint);
                    let coord = mover.map_or_else(
                        || {
                            self.held.push((n_coords, rig.coords_of(joint).start, n_coords_of));
                            n_coords += n_coords_of;
                            n_coords - n_coords_of
                        },
                        |m| m.coord,
                    );
                    let dof = mover.map(|m| m.dof);
                    let at = n_motion_dofs;
                    n_motion_dofs += n_dofs;
                    JointRead { motion: data.motion, coord, n_coords: n_coords_of, n_dofs, at, dof }
                })
                .collect();
            let (first_part, first_own) = (self.parts.len(), self.n_own_rows);
            let mut slot = 0;
            for part in &reads.parts {
                let place = if *is_hard || part.sense == Sense::AtLeast {
                    self.n_guards += part.most_rows;
                    Place::Guard { first: self.n_guards - part.most_rows }
                } else if part.is_separable {
                    self.n_own_rows += part.most_rows;
                    Place::Own { first: self.n_own_rows - part.most_rows }
                } else {
                    Place::Step
                };
                let (n_rows, unit, sense) = (part.most_rows, part.unit, part.sense);
                self.parts.push(PartLayout { n_rows, unit, sense, place, row: 0, slot });
                slot += n_rows;
            }
            let has_own = self.n_own_rows > first_own || reads.has_potential;
            self.has_own |= has_own;
            self.n_earlier = self.n_earlier.max(reads.n_earlier);
            let is_own = |part: &PartLayout| matches!(part.place, Place::Own { .. });
            let couples = !self.parts[first_part..].iter().all(is_own);
            let next = |n: &mut usize, more: usize| {
                *n += more;
                *n - more..*n
            };
            self.terms.push(TermLayout {
                term: idx,
                nodes: reads.frames.iter().map(|j| node_of[j.index()]).collect(),
                rows: 0..0,
                parts: first_part..self.parts.len(),
                n_slots: slot,
                runs: Vec::new(),
                n_motion_dofs,
                by_frame: next(&mut self.n_by_frame, (1 + reads.n_earlier) * reads.frames.len() * slot * 6),
                by_motion: next(&mut self.n_by_motion, if couples { slot * n_motion_dofs } else { 0 }),
                slope: next(&mut self.n_slope, if reads.has_potential { n_motion_dofs } else { 0 }),
                joint_reads,
                own_rows: first_own..self.n_own_rows,
                has_potential: reads.has_potential,
                is_hard: *is_hard,
                is_by_duals: reads.is_by_duals,
                is_constant: false,
                sums_up: reads.frames.len() > MOST_WALKED,
                n_earlier: reads.n_earlier,
                joint: reads.frames.first().or(reads.motions.first()).copied(),
            });
        }
    }

    /// Gives rows to the terms in the order of the tree, and to each degree of freedom the span of rows that
    /// it can move. Below a joint lies one run of nodes, so that the spans are tight.
    fn place_rows(&mut self) {
        let mut by_tree: Vec<usize> = (0..self.terms.len()).collect();
        for idx in 0..self.terms.len() {
            let term = &self.terms[idx];
            let moves = term.nodes.iter().any(|node| self.is_moved(*node))
                || term.joint_reads.iter().any(|read| read.dof.is_some());
            self.terms[idx].is_constant = !moves;
        }
        // What nothing moves stands first, where no span has to reach over it.
        by_tree.sort_by_key(|t| {
            let term = &self.terms[*t];
            (!term.is_constant, term.nodes.first().copied().unwrap_or(NONE))
        });
        for t in by_tree {
            let first = self.n_rows;
            for part in &mut self.parts[self.terms[t].parts.clone()] {
                if part.place == Place::Step {
                    part.row = self.n_rows;
                    self.n_rows += part.n_rows;
                }
            }
            self.terms[t].rows = first..self.n_rows;
        }
        let mut ends = vec![(usize::MAX, 0usize); self.n_dofs];
        let mut coupled = Vec::new();
        for term in self.terms.iter().filter(|t| !t.rows.is_empty()) {
            let mut reached = Vec::new();
            let mut reach = |dofs: Range<usize>| {
                reached.extend(dofs.clone());
                for end in &mut ends[dofs] {
                    *end = (end.0.min(term.rows.start), end.1.max(term.rows.end));
                }
            };
            for &read in &term.nodes {
                let mut at = read;
                while let Some(node) = self.nodes.get(at as usize) {
                    let n_dofs = if node.mimic.is_some() { node.n_screws.min(1) } else { node.n_screws };
                    reach(node.dof as usize..(node.dof + n_dofs) as usize);
                    at = node.parent;
                }
            }
            for read in term.joint_reads.iter().filter(|_| !term.by_motion.is_empty()) {
                read.dof.into_iter().for_each(|dof| reach(dof..dof + read.n_dofs));
            }
            coupled.push(reached);
        }
        if self.n_rows <= MOST_DENSE_ROWS {
            self.n_rows = self.n_rows.next_multiple_of(3).max(3);
            self.dense_rows = Some(self.n_rows);
            ends.fill((0, self.n_rows));
        }
        // The degrees of freedom of one joint share their span.
        for (first, last) in ends {
            let len = last.saturating_sub(first);
            self.spans.push(Span { first: if len == 0 { 0 } else { first }, len, start: self.n_jacobian });
            self.n_jacobian += len;
        }
        if self.dense_rows.is_none() {
            let paths = Paths::new(self.n_dofs, &coupled);
            self.paths =
                (paths.work(&self.spans) < work_over_rows(self.n_rows, &self.spans)).then_some(paths);
        }
        let (guards, own) = (self.n_rows, self.n_rows + self.n_guards);
        for part in &mut self.parts {
            match part.place {
                Place::Step => {}
                Place::Guard { first } => part.row = guards + first,
                Place::Own { first } => part.row = own + first,
            }
        }
        for t in &mut self.terms {
            for part in &self.parts[t.parts.clone()] {
                let (first, is_guard) = match part.place {
                    Place::Step => (part.row, false),
                    Place::Guard { first } => (first, true),
                    Place::Own { .. } => continue,
                };
                let end = part.slot + part.n_rows;
                match t.runs.last_mut() {
                    Some(run) if run.slots.end == part.slot && run.is_guard == is_guard => {
                        run.slots.end = end;
                    }
                    _ => t.runs.push(Run { slots: part.slot..end, first, is_guard }),
                }
            }
        }
    }

    /// The parts of a term that have rows.
    pub(crate) fn reported_parts(&self, t: &TermLayout) -> impl Iterator<Item = usize> + Clone {
        t.parts.clone().filter(|part| self.parts[*part].n_rows > 0)
    }

    /// How many rows there are of any kind.
    pub(crate) fn n_all_rows(&self) -> usize {
        self.n_rows + self.n_guards + self.n_own_rows
    }

    /// Whether a degree of freedom moves a node.
    fn is_moved(&self, node: u32) -> bool {
        let mut at = node;
        while let Some(node) = self.nodes.get(at as usize) {
            if node.n_screws > 0 {
                return true;
            }
            at = node.parent;
        }
        false
    }

    /// How many coordinates are kept: those that move, and those that are only read.
    pub(crate) fn n_kept_coords(&self) -> usize {
        self.n_coords + self.held.iter().map(|h| h.2).sum::<usize>()
    }

    /// `coords := project(coords ⊕ tangent)` of what moves.
    #[inline]
    pub(crate) fn move_by(&self, coords: &mut [f64], tangent: &[f64]) {
        for m in &self.movers {
            let coords = &mut coords[m.coord..m.coord + m.n_coords];
            retract_joint(&m.motion, coords, &tangent[m.dof..m.dof + m.n_dofs]);
            project_joint(&m.motion, coords);
        }
    }

    /// Reads the coordinates of what moves from those of a pose.
    pub(crate) fn load(&self, from: &[f64], coords: &mut [f64]) {
        for m in &self.movers {
            coords[m.coord..m.coord + m.n_coords]
                .copy_from_slice(&from[m.pose_coord..m.pose_coord + m.n_coords]);
        }
    }

    /// Writes the coordinates of what moves into those of a pose.
    pub(crate) fn store(&self, coords: &[f64], to: &mut [f64]) {
        for m in &self.movers {
            to[m.pose_coord..m.pose_coord + m.n_coords]
                .copy_from_slice(&coords[m.coord..m.coord + m.n_coords]);
        }
    }
}

/// A rig has at most 100,000 joints of at most 6 degrees of freedom, so that this never saturates.
fn u32_of(n: usize) -> u32 {
    u32::try_from(n).unwrap_or(u32::MAX)
}
