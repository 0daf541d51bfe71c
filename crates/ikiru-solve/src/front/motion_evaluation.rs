//! What a motion problem costs over a whole trajectory, and how that changes with it.

use ikiru_rig::{Clip, Pose};

use crate::front::course::{Told, check_start};
use crate::front::evaluation::{EvaluatedRow, dofs_of};
use crate::front::motion_layout::MotionLayout;
use crate::layout::Place;
use crate::problem::motion::MotionProblem;
use crate::problem::{TermId, Terms, Timeline};
use crate::report::TermReport;
use crate::report::explain::explain;
use crate::report::force::Force;
use crate::report::invalid::{Invalid, InvalidPose};
use crate::report::subject::{MotionSubject, Subject};

/// Where a row's derivative lies.
#[derive(Clone, Copy, Debug)]
enum RowSource {
    /// A row of the step, and the root of the weight that scales it.
    Step(usize, f64),
    /// A row with a force, as it is.
    Force(usize),
    /// One that reads a single joint: its sample among those that are wanted, its term, part and number there.
    Own { sample: usize, term: usize, part: usize, row: usize },
}

/// A motion problem over all its samples: cost, rows, and their derivatives by the tangents of all samples.
///
/// The tangents of samples lie one behind the other, [`Rig::n_dofs`](ikiru_rig::Rig::n_dofs) entries each. What no plan can
/// change is left out: rows at samples that are given, and what they cost.
///
/// ```
/// use glam::DVec3;
/// use ikiru_rig::{Clip, Joint, JointMotion, Range, RigBuilder};
/// use ikiru_solve::objectives::Position;
/// use ikiru_solve::{MotionEvaluation, MotionProblem, Timeline, When};
///
/// let mut builder = RigBuilder::new();
/// let motion = JointMotion::Hinge { axis: DVec3::Z, range: Range::UNLIMITED };
/// let root = builder.add(Joint { motion, ..Joint::new("root", None) });
/// let tip = builder.add(Joint { rest_translation: DVec3::X, ..Joint::new("tip", Some(root)) });
/// let rig = builder.build()?;
/// let mut motion = MotionProblem::whole_body(&rig, Timeline::seconds(1.0, 4.0)?);
/// let reach = motion.add(2.0, When::End, Position::new(tip, DVec3::new(1.0, 0.5, 0.0)))?;
/// let mut evaluation = MotionEvaluation::default();
/// evaluation.at(&motion, &Clip::still(rig.rest_pose()))?;
/// assert_eq!(evaluation.cost(), 2.0 * 0.25);
/// let missed: Vec<f64> =
///     evaluation.rows_of(&motion, reach).map(|row| evaluation.rows()[row].residual).collect();
/// assert_eq!(missed, [0.0, -0.5, 0.0]);
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
#[derive(Clone, Debug, Default)]
pub struct MotionEvaluation {
    laid_out: MotionLayout,
    cost: f64,
    violation: f64,
    n_dofs: usize,
    rows: Vec<EvaluatedRow>,
    sources: Vec<RowSource>,
    gradient: Vec<f64>,
    of_layout: Vec<f64>,
    dofs: Vec<usize>,
    told: Told,
    smoothness: Vec<f64>,
}

impl MotionEvaluation {
    /// Evaluates a motion problem at the poses of a clip, which is read at the samples of the timeline and held still beyond
    /// its ends. Given samples take their place in it.
    ///
    /// # Errors
    /// What a plan would refuse: a term that does not fit or gives no finite residual, a clip of another rig or with numbers
    /// that are not finite. There are then no rows, terms and forces, and the cost is infinite.
    pub fn at(&mut self, motion: &MotionProblem, clip: &Clip) -> Result<(), Invalid> {
        (self.cost, self.violation) = (f64::INFINITY, 0.0);
        self.rows.clear();
        self.sources.clear();
        self.told.clear();
        self.gradient.fill(0.0);
        if self.laid_out.fit(motion)? {
            self.dofs = dofs_of(&self.laid_out.layout, motion.rig());
            self.told = Told::new(&self.laid_out.layout);
        }
        self.n_dofs = motion.rig().n_dofs();
        self.load(motion, clip)?;
        let MotionLayout { layout, state, .. } = &mut self.laid_out;
        let Told { terms, explainer, unmet } = &mut self.told;
        let cost = state.differentiate(layout, motion);
        // What given samples settle is left out.
        let subject =
            &mut MotionSubject { layout, motion, state, settled_cost: 0.0, smoothness: &mut self.smoothness };
        check_start(subject, cost)?;
        subject.report_terms(terms);
        let success = terms.iter().all(|t| t.satisfied || !t.mandatory);
        unmet.fit(subject.coords().len());
        unmet.forget();
        // Linearizes.
        explain(subject, terms, (explainer, unmet), success, true);
        (self.cost, self.violation) = (cost, state.violation);
        self.of_layout.resize(state.gradient.len(), 0.0);
        state.write_half_gradient(0.0, &mut self.of_layout);
        self.gradient.clear();
        self.gradient.resize(self.n_dofs * state.n_samples, 0.0);
        for t in (0..state.n_samples).filter(|t| !state.is_given[*t]) {
            for (k, dof) in self.dofs.iter().enumerate() {
                self.gradient[t * self.n_dofs + dof] = 2.0 * self.of_layout[t * layout.n_dofs + k];
            }
        }
        self.find_rows(motion);
        Ok(())
    }

    fn load(&mut self, motion: &MotionProblem, clip: &Clip) -> Result<(), Invalid> {
        if !clip.rig().is_same(motion.rig()) {
            return Err(Invalid::Pose(InvalidPose::OtherRig));
        }
        let timeline: &Timeline = motion.timeline();
        let MotionLayout { layout, state, .. } = &mut self.laid_out;
        let still = motion.first_given().map_or_else(|| clip.sample(clip.times()[0]), Pose::clone);
        for t in 0..timeline.n_samples() {
            let pose = motion.given(t).map_or_else(|| clip.sample(timeline.time(t)), Pose::clone);
            // Limits have no say in what is looked at.
            if state.load_as_is(layout, t, &pose).is_none() {
                return Err(Invalid::Pose(InvalidPose::NotFinite));
            }
        }
        state.load_still(layout, &still);
        Ok(())
    }

    /// Finds the rows that are open, in the order in which they were linearized.
    fn find_rows(&mut self, motion: &MotionProblem) {
        let Self { laid_out: MotionLayout { layout, state, .. }, rows, sources, .. } = self;
        let (mut of_step, mut of_force) = (0, 0);
        for (i, t) in state.keyed.iter().enumerate() {
            let (terms, sample) = (motion.wanted_at(*t), &state.samples[i]);
            for (term, of) in layout.terms.iter().enumerate().filter(|(_, of)| terms.is_on(of.term)) {
                let data = terms.term(of.term);
                for (number, idx) in of.parts.clone().enumerate() {
                    let part = &layout.parts[idx];
                    let weight = data.weight * data.loss.weight(sample.squares[idx]);
                    for row in 0..part.n_rows {
                        let source = match part.place {
                            Place::Step => RowSource::Step(of_step + row, sample.weights[idx].sqrt()),
                            Place::Guard { .. } => RowSource::Force(of_force + row),
                            Place::Own { .. } => RowSource::Own { sample: i, term, part: idx, row },
                        };
                        if row < sample.n_open[idx] {
                            rows.push(EvaluatedRow {
                                term: of.term,
                                sample: *t,
                                part: number,
                                residual: sample.residual[part.row + row],
                                unit: part.unit,
                                sense: part.sense,
                                weight: (!data.hard).then_some(weight),
                                is_constant: of.is_constant,
                            });
                            sources.push(source);
                        }
                    }
                    match part.place {
                        Place::Step => of_step += part.n_rows,
                        Place::Guard { .. } => of_force += part.n_rows,
                        Place::Own { .. } => {}
                    }
                }
            }
        }
    }

    /// The cost of the whole motion, smoothness and even spacing included; limits on rates have no part in it.
    #[must_use]
    pub fn cost(&self) -> f64 {
        self.cost
    }

    /// By how much constraints are missed that something moves, summed up over their rows and samples (metres, radians).
    #[must_use]
    pub fn violation(&self) -> f64 {
        self.violation
    }

    /// What of it is smoothness: velocity, acceleration, jerk.
    #[must_use]
    pub fn smoothness(&self) -> [f64; 3] {
        self.laid_out.state.smoothness_cost
    }

    /// What of it is even spacing.
    #[must_use]
    pub fn spacing(&self) -> f64 {
        self.laid_out.state.spacing_cost
    }

    /// The gradient of the cost by the tangents of all samples; 0 at given ones.
    #[must_use]
    pub fn gradient(&self) -> &[f64] {
        &self.gradient
    }

    /// The rows that are open, sample by sample, constraints among them.
    #[must_use]
    pub fn rows(&self) -> &[EvaluatedRow] {
        &self.rows
    }

    /// The numbers of a term's rows among all [rows](Self::rows), sample by sample; none where it is off, has none open, or holds
    /// at given samples alone.
    pub fn rows_of<T>(
        &self,
        motion: &MotionProblem,
        id: TermId<T>,
    ) -> impl Iterator<Item = usize> + use<'_, T> {
        let term = motion.terms().position(id);
        let is_own = move |(number, row): (usize, &EvaluatedRow)| (Some(row.term) == term).then_some(number);
        self.rows.iter().enumerate().filter_map(is_own)
    }

    /// Shows the derivative of a row's residual by what moves it: the sample, the entry of its tangent, the derivative.
    /// Nothing where there is no such row.
    pub fn jacobian(&self, row: usize, mut show: impl FnMut(usize, usize, f64)) {
        let (Some(EvaluatedRow { sample, .. }), Some(source)) = (self.rows.get(row), self.sources.get(row))
        else {
            return;
        };
        let (rows, row, scale) = match *source {
            RowSource::Step(row, root) if root > 0.0 => (&self.laid_out.state.rows, row, 1.0 / root),
            // A term of weight 0 has no say, and no derivative is kept of it.
            RowSource::Step(..) => return,
            RowSource::Force(row) => (&self.laid_out.state.guards.rows, row, 1.0),
            RowSource::Own { sample: i, term, part, row } => {
                let (state, layout) = (&self.laid_out.state.samples[i], &self.laid_out.layout);
                let (t, part) = (&layout.terms[term], &layout.parts[part]);
                for (k, dof) in self.dofs.iter().enumerate() {
                    let entry = state.entry(layout, t, part, row, k);
                    if entry != 0.0 {
                        show(*sample, *dof, entry);
                    }
                }
                return;
            }
        };
        for (run, entries) in rows.runs(row) {
            for (k, entry) in run.dofs.clone().zip(entries) {
                show(*sample - run.back, self.dofs[k], scale * entry);
            }
        }
    }

    /// The entries of each sample's tangent that may move and that something reads, in the order in which a plan has them.
    #[must_use]
    pub fn moving(&self) -> &[usize] {
        &self.dofs
    }

    /// Every term over all its samples, as a report would have it.
    #[must_use]
    pub fn terms(&self) -> &[TermReport] {
        &self.told.terms
    }

    /// The forces that act on this motion, as a [report](crate::Report::forces) would have them. They balance each other where
    /// a plan converged; elsewhere they say what limits and constraints hold back.
    #[must_use]
    pub fn forces(&self) -> &[Force] {
        &self.told.explainer.forces
    }
}
