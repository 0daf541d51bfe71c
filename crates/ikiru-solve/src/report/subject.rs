//! What a report is about: a pose, or a motion. A motion has many samples, a pose is one.

use crate::layout::Layout;
use crate::problem::motion::MotionProblem;
use crate::problem::sample_terms::SampleTerms;
use crate::problem::{Problem, Terms};
use crate::report::TermReport;
use crate::report::here::{Beside, Here, Of};
use crate::report::invalid::{Invalid, InvalidPose, InvalidTerm};
use crate::report::terms::{report_motion, report_pose};
use crate::state::State;
use crate::state::motion::MotionState;

/// What is solved, as its beginning and its end see it.
pub(crate) trait Subject {
    /// The terms of one sample.
    type Terms: Terms;

    /// The coordinates of what moves, at all samples.
    fn coords(&self) -> &[f64];

    /// What it costs, evaluated anew.
    fn evaluate(&mut self) -> f64;

    /// What of the cost no step changes, and methods are not told.
    fn settled_cost(&self) -> f64;

    /// By how much hard rows are missed, summed up (metres, radians), as of the last evaluation.
    fn violation(&self) -> f64;

    /// The first term that gave up, and why; it is forgotten.
    fn take_failure(&mut self) -> Option<(usize, &'static str)>;

    /// What is not finite, where the cost is not.
    fn not_finite(&mut self) -> Invalid;

    /// Writes what came of the terms, as of the last evaluation.
    fn report_terms(&mut self, reports: &mut Vec<TermReport>);

    /// Linearizes where it was evaluated last.
    fn linearize(&mut self);

    /// The largest curvature along one degree of freedom, as of the last linearization.
    fn largest_curvature(&self) -> f64;

    fn n_samples(&self) -> usize;

    /// Whether a sample stays as it is.
    fn is_given(&self, sample: usize) -> bool;

    /// The sample at which a term misses the most.
    fn worst_sample(&self, report: &TermReport) -> usize;

    /// One sample, to be asked whose forces are balanced there.
    fn at(&mut self, sample: usize, of: Of) -> Here<'_, Self::Terms>;
}

/// A pose.
pub(crate) struct PoseSubject<'a> {
    pub(crate) layout: &'a Layout,
    pub(crate) problem: &'a Problem,
    pub(crate) state: &'a mut State,
}

impl<'a> Subject for PoseSubject<'a> {
    type Terms = &'a Problem;

    fn coords(&self) -> &[f64] {
        &self.state.coords[..self.layout.n_coords]
    }

    fn evaluate(&mut self) -> f64 {
        self.state.evaluate(self.layout, self.problem)
    }

    fn settled_cost(&self) -> f64 {
        0.0
    }

    fn violation(&self) -> f64 {
        self.state.violation
    }

    fn take_failure(&mut self) -> Option<(usize, &'static str)> {
        self.state.memory.failure.take()
    }

    fn not_finite(&mut self) -> Invalid {
        let is_bad = |part: usize| !self.state.squares[part].is_finite();
        match self.layout.terms.iter().find(|t| t.parts.clone().any(is_bad)) {
            Some(t) => Invalid::Term(t.term, InvalidTerm::NotFinite),
            None => Invalid::Pose(InvalidPose::Cost),
        }
    }

    fn report_terms(&mut self, reports: &mut Vec<TermReport>) {
        report_pose(self.layout, self.problem, self.state, reports);
    }

    fn linearize(&mut self) {
        self.state.linearize(self.layout, self.problem, false);
    }

    fn largest_curvature(&self) -> f64 {
        self.state.largest_curvature(self.layout)
    }

    fn n_samples(&self) -> usize {
        1
    }

    fn is_given(&self, _: usize) -> bool {
        false
    }

    fn worst_sample(&self, _: &TermReport) -> usize {
        0
    }

    fn at(&mut self, _: usize, _: Of) -> Here<'_, &'a Problem> {
        let Self { layout, problem, state } = self;
        Here { layout, rig: problem.rig(), state, terms: problem, beside: None, secs: None }
    }
}

/// A motion.
pub(crate) struct MotionSubject<'a> {
    pub(crate) layout: &'a Layout,
    pub(crate) motion: &'a MotionProblem,
    pub(crate) state: &'a mut MotionState,
    pub(crate) settled_cost: f64,
    /// Memory for the gradient of smoothness.
    pub(crate) smoothness: &'a mut Vec<f64>,
}

/// The curvature of a squared first, second and third difference along one of its samples that is inside.
const CURVATURES: [f64; 3] = [2.0, 6.0, 20.0];

impl<'a> Subject for MotionSubject<'a> {
    type Terms = SampleTerms<'a>;

    fn coords(&self) -> &[f64] {
        &self.state.coords
    }

    fn evaluate(&mut self) -> f64 {
        self.settled_cost + self.state.evaluate(self.layout, self.motion)
    }

    fn settled_cost(&self) -> f64 {
        self.settled_cost
    }

    fn violation(&self) -> f64 {
        self.state.violation
    }

    fn take_failure(&mut self) -> Option<(usize, &'static str)> {
        self.state.failure.take()
    }

    fn not_finite(&mut self) -> Invalid {
        match self.state.not_finite(self.layout, self.motion) {
            Some(term) => Invalid::Term(term, InvalidTerm::NotFiniteAtSample),
            None => Invalid::Pose(InvalidPose::Cost),
        }
    }

    fn report_terms(&mut self, reports: &mut Vec<TermReport>) {
        report_motion(self.layout, self.motion, self.state, reports);
    }

    fn linearize(&mut self) {
        self.state.linearize(self.layout, self.motion);
    }

    fn largest_curvature(&self) -> f64 {
        let of_terms = self.state.samples.iter().map(|sample| sample.largest_curvature(self.layout));
        let smooth = |weights: &[f64; 3]| weights.iter().zip(CURVATURES).map(|(w, c)| w * c).sum();
        of_terms.chain(self.state.smoothness.weights.iter().map(smooth)).fold(0.0, f64::max)
    }

    fn n_samples(&self) -> usize {
        self.state.n_samples
    }

    fn is_given(&self, sample: usize) -> bool {
        self.state.is_given[sample]
    }

    fn worst_sample(&self, report: &TermReport) -> usize {
        // The times of the reports are still those of the timeline.
        report.times.map_or(0, |times| self.motion.timeline().sample_at(times.worst_secs).unwrap_or(0))
    }

    /// What terms pull at samples before their own is left aside.
    fn at(&mut self, sample: usize, of: Of) -> Here<'_, SampleTerms<'a>> {
        let Self { layout, motion, .. } = *self;
        self.smoothness.resize(layout.n_dofs, 0.0);
        self.state.gradient_beside(layout, sample, self.smoothness);
        let beside = Beside { smoothness: self.smoothness, holds_rates: motion.holds_rates() };
        Here {
            layout,
            rig: motion.rig(),
            state: self.state.stand_at(layout, sample),
            terms: motion.wanted_at(sample),
            beside: (of == Of::Wishes).then_some(beside),
            secs: Some(motion.timeline().time(sample)),
        }
    }
}
