//! The state of a motion while it is solved: the coordinates of all samples, and their linearization.

use ikiru_rig::{Pose, difference_joint, project_joint, retract_joint};

use crate::layout::{Layout, PartLayout, Place, TermLayout};
use crate::motion::guards::Guards;
use crate::motion::problem::MotionProblem;
use crate::motion::rate_bounds::RateBounds;
use crate::motion::rows::{Block, RowPart, SampleRows};
use crate::motion::sample_terms::SampleTerms;
use crate::motion::smoothness::Smoothness;
use crate::motion::spacing::Spacing;
use crate::problem::Terms;
use crate::state::State;
use crate::term::Term;

/// Everything that changes while a motion is solved.
#[derive(Clone, Debug, Default)]
pub(crate) struct MotionState {
    pub(crate) n_samples: usize,
    /// The coordinates of what moves, sample by sample.
    pub(crate) coords: Vec<f64>,
    /// Whether a sample is given.
    pub(crate) is_given: Vec<bool>,
    /// Samples of which a term wants something, in order.
    pub(crate) keyed: Vec<usize>,
    /// Samples at which terms hold that given samples settle.
    settled: Vec<usize>,
    /// Samples at which terms would hold that are switched off.
    off: Vec<usize>,
    pub(crate) rows: SampleRows,
    /// Rows with a force of their own.
    pub(crate) guards: Guards,
    /// By how much hard rows are missed, summed up over all samples (metres, radians).
    pub(crate) violation: f64,
    /// The squares of what they miss.
    pub(crate) hard_square: f64,
    /// Half the gradient of the joint rows, of smoothness, spacing and limits on rates, by the tangents of all samples.
    pub(crate) gradient: Vec<f64>,
    /// The curvature of the joint rows.
    pub(crate) curvature: Vec<f64>,
    /// What of the cost is not in rows: joint rows, smoothness, even spacing, and limits
    /// on speed and acceleration.
    pub(crate) cost_beside_rows: f64,
    pub(crate) smoothness: Smoothness,
    pub(crate) smoothness_cost: [f64; 3],
    pub(crate) spacing: Spacing,
    pub(crate) spacing_cost: f64,
    pub(crate) rate_bounds: RateBounds,
    /// Half the gradient of what reads the differences from sample to sample, by those.
    pull: Vec<f64>,
    pub(crate) sample: State,
    /// The samples before that one, the nearest first, as many as terms read.
    earlier: Vec<State>,
    /// The sample at which `sample` was evaluated last.
    evaluated: Option<usize>,
}

impl MotionState {
    pub(crate) fn new(layout: &Layout, motion: &MotionProblem) -> Self {
        let n_samples = motion.timeline().n_samples();
        let n = layout.n_dofs * n_samples;
        let weights =
            layout.movers.iter().flat_map(|m| vec![motion.smoothness_of(m.joint); m.n_dofs]).collect();
        let n_terms = motion.tracks().len();
        let keyed = (0..n_samples).filter(|t| (0..n_terms).any(|term| motion.wants(term, *t)));
        let settled = (0..n_samples).filter(|t| (0..n_terms).any(|term| motion.settles(term, *t)));
        let off = (0..n_samples).filter(|t| (0..n_terms).any(|term| motion.is_off_at(term, *t)));
        Self {
            n_samples,
            coords: vec![0.0; layout.n_coords * n_samples],
            is_given: (0..n_samples).map(|t| motion.given(t).is_some()).collect(),
            keyed: keyed.collect(),
            settled: settled.collect(),
            off: off.collect(),
            rows: SampleRows::new(layout),
            guards: Guards::new(layout),
            violation: 0.0,
            hard_square: 0.0,
            gradient: vec![0.0; n],
            curvature: vec![0.0; n],
            cost_beside_rows: 0.0,
            smoothness: Smoothness::new(weights, motion.at_rest(), n_samples),
            smoothness_cost: [0.0; 3],
            spacing: Spacing::new(motion.even_spacing()),
            spacing_cost: 0.0,
            rate_bounds: RateBounds::new(layout, motion),
            pull: vec![0.0; n],
            sample: State::new(layout),
            earlier: vec![State::new(layout); layout.n_earlier],
            evaluated: None,
        }
    }

    /// Takes over the pose of one sample, inside its limits; false where its numbers are not usable.
    pub(crate) fn load(&mut self, layout: &Layout, t: usize, pose: &Pose) -> bool {
        if !self.sample.load(layout, pose) {
            return false;
        }
        // What does not move stands where it does in all samples.
        for earlier in &mut self.earlier {
            earlier.load(layout, pose);
        }
        self.evaluated = None;
        if !self.is_given[t] {
            self.sample.project(layout);
        }
        let nc = layout.n_coords;
        self.coords[t * nc..(t + 1) * nc].copy_from_slice(&self.sample.coords[..nc]);
        true
    }

    /// Writes one sample into a pose.
    pub(crate) fn store(&mut self, layout: &Layout, t: usize, pose: &mut Pose) {
        self.enter(layout, t);
        self.sample.store(layout, pose);
    }

    fn enter(&mut self, layout: &Layout, t: usize) {
        let nc = layout.n_coords;
        self.sample.coords[..nc].copy_from_slice(&self.coords[t * nc..(t + 1) * nc]);
        self.sample.forget_constants();
        self.evaluated = None;
        for back in 0..layout.n_earlier.min(t) {
            let (earlier, at) = (&mut self.earlier[back], (t - 1 - back) * nc);
            earlier.coords[..nc].copy_from_slice(&self.coords[at..at + nc]);
            self.sample.set_earlier(layout, back, earlier);
        }
    }

    /// Evaluates what is wanted of one sample; the answer is its cost.
    fn evaluate_sample(&mut self, layout: &Layout, motion: &MotionProblem, t: usize) -> f64 {
        self.enter(layout, t);
        let cost = self.sample.evaluate(layout, &motion.wanted_at(t));
        self.evaluated = Some(t);
        cost
    }

    /// The cost of the terms that given samples settle. It is a constant of the motion, which [`evaluate`](Self::evaluate)
    /// leaves out: what no step can change must not say how much a step is worth.
    pub(crate) fn settled_cost(&mut self, layout: &Layout, motion: &MotionProblem) -> f64 {
        let mut cost = 0.0;
        for i in 0..self.settled.len() {
            let t = self.settled[i];
            self.enter(layout, t);
            cost += self.sample.evaluate(layout, &motion.settled_at(t));
        }
        cost
    }

    /// Evaluates one sample after the other of which terms want something, and shows each with those. Ends early where
    /// `see` says false.
    pub(crate) fn visit_wanted(
        &mut self,
        layout: &Layout,
        motion: &MotionProblem,
        mut see: impl FnMut(&State, &SampleTerms<'_>, usize) -> bool,
    ) {
        for i in 0..self.keyed.len() {
            let t = self.keyed[i];
            self.evaluate_sample(layout, motion, t);
            if !see(&self.sample, &motion.wanted_at(t), t) {
                return;
            }
        }
    }

    /// The same of samples at which terms hold that given samples settle.
    pub(crate) fn visit_settled(
        &mut self,
        layout: &Layout,
        motion: &MotionProblem,
        see: impl FnMut(&State, &SampleTerms<'_>, usize) -> bool,
    ) {
        let samples = std::mem::take(&mut self.settled);
        self.visit(layout, samples.iter().map(|t| (*t, motion.settled_at(*t))), see);
        self.settled = samples;
    }

    /// The same of samples at which terms would hold that are switched off.
    pub(crate) fn visit_off(
        &mut self,
        layout: &Layout,
        motion: &MotionProblem,
        see: impl FnMut(&State, &SampleTerms<'_>, usize) -> bool,
    ) {
        let samples = std::mem::take(&mut self.off);
        self.visit(layout, samples.iter().map(|t| (*t, motion.off_at(*t))), see);
        self.off = samples;
    }

    fn visit<'a>(
        &mut self,
        layout: &Layout,
        samples: impl Iterator<Item = (usize, SampleTerms<'a>)>,
        mut see: impl FnMut(&State, &SampleTerms<'_>, usize) -> bool,
    ) {
        for (t, terms) in samples {
            self.enter(layout, t);
            self.sample.evaluate(layout, &terms);
            if !see(&self.sample, &terms, t) {
                return;
            }
        }
    }

    /// The cost of the whole motion but for what is [settled](Self::settled_cost), with that of limits on rates while
    /// they are [on](RateBounds::begin); infinite where it is not a number.
    pub(crate) fn evaluate(&mut self, layout: &Layout, motion: &MotionProblem) -> f64 {
        let mut cost = 0.0;
        (self.violation, self.hard_square) = (0.0, 0.0);
        for i in 0..self.keyed.len() {
            cost += self.evaluate_sample(layout, motion, self.keyed[i]);
            if layout.n_force_rows > 0 {
                self.violation += self.sample.violation;
                self.hard_square += self.sample.hard_square(layout, &motion.wanted_at(self.keyed[i]));
            }
        }
        self.smoothness_cost = self.smoothness.cost(layout, &self.coords);
        cost += self.smoothness_cost.iter().sum::<f64>();
        let (n, first) = (layout.n_dofs, self.smoothness.first());
        self.spacing_cost = self.spacing.cost(n, first, self.n_samples);
        cost += self.spacing_cost + self.rate_bounds.cost(n, first);
        if cost.is_nan() { f64::INFINITY } else { cost }
    }

    /// Rows, gradients and curvatures at the coordinates that were [evaluated](Self::evaluate) last.
    pub(crate) fn linearize(&mut self, layout: &Layout, motion: &MotionProblem) {
        let n = layout.n_dofs;
        self.rows.clear();
        self.guards.clear();
        self.gradient.fill(0.0);
        self.curvature.fill(0.0);
        self.cost_beside_rows = self.smoothness_cost.iter().sum();
        let first = self.smoothness.first();
        self.cost_beside_rows += self.spacing_cost + self.rate_bounds.cost(n, first);
        self.pull.fill(0.0);
        self.smoothness.add_rest_pull(&mut self.pull);
        self.spacing.add_pull(n, first, &mut self.pull);
        self.rate_bounds.linearize(n, first, &mut self.pull);
        self.smoothness.add_half_gradient(layout, &self.pull, &mut self.gradient);
        for i in 0..self.keyed.len() {
            let t = self.keyed[i];
            // One key alone is still what was evaluated.
            let terms = motion.wanted_at(t);
            if self.evaluated != Some(t) {
                self.enter(layout, t);
                self.sample.differentiate(layout, &terms);
                self.evaluated = Some(t);
            }
            self.sample.linearize(layout, &terms, false);
            for back in 1..=layout.n_earlier.min(t) {
                self.earlier[back - 1].carry_back(layout, &terms, &self.sample.memory, back);
            }
            for k in 0..n {
                self.gradient[t * n + k] += self.sample.own_gradient[k];
                self.curvature[t * n + k] += self.sample.own_curvature[k];
            }
            self.push_rows(layout, &terms, t);
        }
    }

    /// Linearizes one sample alone, and gives the gradient by it of smoothness, spacing and limits on rates, as of the last
    /// [linearization](Self::linearize).
    pub(crate) fn linearize_sample(
        &mut self,
        layout: &Layout,
        motion: &MotionProblem,
        t: usize,
        beside: &mut [f64],
    ) {
        let terms = motion.wanted_at(t);
        self.enter(layout, t);
        self.sample.differentiate(layout, &terms);
        self.sample.linearize(layout, &terms, false);
        let n = layout.n_dofs;
        for ((beside, all), own) in
            beside.iter_mut().zip(&self.gradient[t * n..]).zip(&self.sample.own_gradient)
        {
            *beside = 2.0 * (all - own);
        }
    }

    /// Copies the rows of the sample that was linearized.
    fn push_rows(&mut self, layout: &Layout, terms: &impl Terms, t: usize) {
        let (first_of_sample, first_guard) = (self.rows.n_rows(), self.guards.rows.n_rows());
        for term in layout.terms.iter().filter(|term| terms.is_on(term.term)) {
            let (weight, loss) = (terms.term(term.term).weight, terms.term(term.term).loss);
            if term.has_potential && !term.is_hard {
                self.cost_beside_rows += weight * self.sample.values[term.term];
            }
            for part in term.parts.clone() {
                let scale = self.sample.weights[part];
                let PartLayout { n_rows, row, place, .. } = layout.parts[part];
                match place {
                    Place::Step => {}
                    Place::Force { .. } => {
                        let data = terms.term(term.term);
                        self.guards.push(layout, &self.sample, &self.earlier, term, data, part);
                        continue;
                    }
                    Place::Own { .. } => {
                        self.cost_beside_rows += weight * loss.cost(self.sample.squares[part]);
                        continue;
                    }
                }
                let first = self.rows.n_rows();
                self.rows.parts.push(RowPart { first, n_rows, term_weight: weight, loss, weight: scale });
                for r in row..row + n_rows {
                    self.rows.push(r, self.sample.scaled[r], |back, k| {
                        let state = if back == 0 { &self.sample } else { &self.earlier[back - 1] };
                        let span = &layout.spans[k];
                        state.jacobian[span.start + r - span.first]
                    });
                }
            }
        }
        let n_rows = self.rows.n_rows() - first_of_sample;
        if n_rows > 0 {
            self.rows.blocks.push(Block { sample: t, first: first_of_sample, n_rows });
        }
        let n_guards = self.guards.rows.n_rows() - first_guard;
        if n_guards > 0 {
            self.guards.rows.blocks.push(Block { sample: t, first: first_guard, n_rows: n_guards });
        }
    }

    /// The residuals at the current coordinates, scaled as the rows of the last linearization are, and those of rows
    /// with a force as they are.
    pub(crate) fn scaled_residuals(
        &mut self,
        layout: &Layout,
        motion: &MotionProblem,
        residual: &mut Vec<f64>,
        guards: &mut Vec<f64>,
    ) {
        residual.clear();
        guards.clear();
        let mut part_idx = 0;
        for i in 0..self.keyed.len() {
            let t = self.keyed[i];
            if self.evaluated != Some(t) {
                self.evaluate_sample(layout, motion, t);
            }
            let terms = motion.wanted_at(t);
            for term in layout.terms.iter().filter(|term| terms.is_on(term.term)) {
                for part in &layout.parts[term.parts.clone()] {
                    let rows = &self.sample.residual[part.row..part.row + part.n_rows];
                    match part.place {
                        Place::Own { .. } => {}
                        Place::Force { .. } => guards.extend_from_slice(rows),
                        Place::Step => {
                            let scale = self.rows.parts[part_idx].weight.sqrt();
                            residual.extend(rows.iter().map(|r| r * scale));
                            part_idx += 1;
                        }
                    }
                }
            }
        }
    }

    /// `coords := project(from ⊕ tangents)` for all samples that are not given.
    pub(crate) fn step(&mut self, layout: &Layout, from: &[f64], tangents: &[f64]) {
        let (n, nc) = (layout.n_dofs, layout.n_coords);
        self.evaluated = None;
        for t in 0..self.n_samples {
            let coords = &mut self.coords[t * nc..(t + 1) * nc];
            coords.copy_from_slice(&from[t * nc..(t + 1) * nc]);
            if self.is_given[t] {
                continue;
            }
            let tangent = &tangents[t * n..(t + 1) * n];
            for m in &layout.movers {
                let coords = &mut coords[m.coord..m.coord + m.n_coords];
                retract_joint(&m.motion, coords, &tangent[m.dof..m.dof + m.n_dofs]);
                project_joint(&m.motion, coords);
            }
        }
    }

    /// Sets the samples between two others on the way from one to the other, at even distances.
    pub(crate) fn interpolate(&mut self, layout: &Layout, from: usize, to: usize) {
        let nc = layout.n_coords;
        for t in from + 1..to {
            if self.is_given[t] {
                continue;
            }
            let part = (t - from) as f64 / (to - from) as f64;
            for m in &layout.movers {
                let of = |sample: usize| sample * nc + m.coord..sample * nc + m.coord + m.n_coords;
                let mut way = [0.0; 6];
                let way = &mut way[..m.n_dofs];
                difference_joint(&m.motion, &self.coords[of(from)], &self.coords[of(to)], way);
                way.iter_mut().for_each(|w| *w *= part);
                self.coords.copy_within(of(from), of(t).start);
                let coords = &mut self.coords[of(t)];
                retract_joint(&m.motion, coords, way);
                project_joint(&m.motion, coords);
            }
        }
        self.evaluated = None;
    }

    /// Whether every hard term is within its tolerance at each of the samples of which it wants something.
    pub(crate) fn holds(&mut self, layout: &Layout, motion: &MotionProblem) -> bool {
        if layout.n_force_rows == 0 {
            return true;
        }
        let mut unmet = None;
        self.visit_wanted(layout, motion, |sample, terms, _| {
            unmet = unmet_at(layout, motion, sample, terms, |term| term.hard);
            unmet.is_none()
        });
        unmet.is_none()
    }

    /// Whether every mandatory term is within its tolerance at each of the samples of which it wants something.
    pub(crate) fn is_satisfied(&mut self, layout: &Layout, motion: &MotionProblem) -> bool {
        let mut unmet = None;
        self.visit_wanted(layout, motion, |sample, terms, _| {
            unmet = unmet_at(layout, motion, sample, terms, Term::counts);
            unmet.is_none()
        });
        unmet.is_none()
    }

    /// The first mandatory term that given samples settle and do not meet.
    pub(crate) fn conflict(&mut self, layout: &Layout, motion: &MotionProblem) -> Option<usize> {
        let mut unmet = None;
        self.visit_settled(layout, motion, |sample, terms, _| {
            unmet = unmet_at(layout, motion, sample, terms, Term::counts);
            unmet.is_none()
        });
        unmet
    }

    /// The first term whose residual is not finite at one of its samples.
    pub(crate) fn not_finite(&mut self, layout: &Layout, motion: &MotionProblem) -> Option<usize> {
        let mut bad = None;
        let mut look = |sample: &State, terms: &SampleTerms<'_>, _: usize| {
            let mut on = layout.terms.iter().filter(|t| terms.is_on(t.term));
            let is_bad = |t: &&TermLayout| t.parts.clone().any(|part| !sample.squares[part].is_finite());
            bad = bad.or(on.find(is_bad).map(|t| t.term));
            bad.is_none()
        };
        self.visit_wanted(layout, motion, &mut look);
        self.visit_settled(layout, motion, &mut look);
        bad
    }
}

/// The first term of one sample that counts and is not within its tolerance there.
fn unmet_at(
    layout: &Layout,
    motion: &MotionProblem,
    sample: &State,
    terms: &SampleTerms<'_>,
    counts: impl Fn(&Term) -> bool,
) -> Option<usize> {
    let mut on = layout.terms.iter().filter(|t| terms.is_on(t.term));
    let unmet = on.find(|t| {
        let data = &motion.terms().terms()[t.term];
        counts(data) && !sample.is_within(layout, t, &data.tolerance)
    });
    unmet.map(|t| t.term)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::motion::cases::case;

    #[test]
    fn the_gradient_of_the_whole_motion_is_that_of_its_cost() {
        for number in 0..40 {
            let mut case = case(number, number % 2 == 1);
            let (layout, motion) = (&case.layout, &case.motion);
            case.state.evaluate(layout, motion);
            case.state.linearize(layout, motion);
            let mut gradient = case.state.gradient.clone();
            case.state.rows.add_transposed(&case.state.rows.residual, &mut gradient);
            case.state.guards.add_half_gradient(0.0, &mut gradient);
            let (n, nc, h) = (layout.n_dofs, layout.n_coords, 1e-6);
            let start = case.state.coords.clone();
            for t in 0..case.state.n_samples {
                for m in &layout.movers {
                    for k in 0..m.n_dofs {
                        let mut cost_at = |way: f64| {
                            let mut tangent = [0.0; 6];
                            tangent[k] = way;
                            case.state.coords.copy_from_slice(&start);
                            let at = t * nc + m.coord;
                            let coords = &mut case.state.coords[at..at + m.n_coords];
                            retract_joint(&m.motion, coords, &tangent[..m.n_dofs]);
                            case.state.evaluate(layout, motion)
                        };
                        let numeric = (cost_at(h) - cost_at(-h)) / (4.0 * h);
                        let exact = gradient[t * n + m.dof + k];
                        let near = (numeric - exact).abs() < 2e-5 * (1.0 + exact.abs());
                        assert!(near, "case {number}, sample {t}: {numeric} is not {exact}");
                    }
                }
            }
        }
    }

    #[test]
    fn rows_are_what_residuals_change_by() {
        for number in 0..20 {
            let mut case = case(number, false);
            let (layout, motion) = (&case.layout, &case.motion);
            case.state.evaluate(layout, motion);
            case.state.linearize(layout, motion);
            let start = case.state.coords.clone();
            let size = case.state.gradient.len();
            let h = 1e-6;
            let tangent: Vec<f64> = (0..size).map(|idx| h * ((idx * 7 % 11) as f64 / 5.0 - 1.0)).collect();
            let mut change = vec![0.0; case.state.rows.n_rows()];
            case.state.rows.add_product(&tangent, &mut change);
            let mut residual_at = |sign: f64| {
                // Not `step`: limits must not hold the difference back.
                case.state.coords.copy_from_slice(&start);
                for t in 0..case.state.n_samples {
                    for m in &layout.movers {
                        let at = t * layout.n_coords + m.coord;
                        let dofs = t * layout.n_dofs + m.dof;
                        let way: Vec<f64> = tangent[dofs..dofs + m.n_dofs].iter().map(|d| sign * d).collect();
                        retract_joint(&m.motion, &mut case.state.coords[at..at + m.n_coords], &way);
                    }
                }
                case.state.evaluate(layout, motion);
                let mut residual = Vec::new();
                case.state.scaled_residuals(layout, motion, &mut residual, &mut Vec::new());
                residual
            };
            let (ahead, behind) = (residual_at(1.0), residual_at(-1.0));
            for ((a, b), change) in ahead.iter().zip(&behind).zip(&change) {
                let numeric = 0.5 * (a - b);
                assert!((numeric - change).abs() < 1e-3 * h, "case {number}: {numeric} is not {change}");
            }
        }
    }
}
