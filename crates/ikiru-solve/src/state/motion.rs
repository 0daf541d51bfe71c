//! The state of a motion while it is solved: the coordinates of all samples, and their linearization.

use ikiru_rig::{Pose, difference_joint, project_joint, retract_joint};

use crate::algebra::sample_rows::{Block, RowPart, SampleRows};
use crate::layout::{Layout, PartLayout, Place, TermLayout};
use crate::problem::Terms;
use crate::problem::motion::MotionProblem;
use crate::problem::sample_terms::SampleTerms;
use crate::problem::term::Term;
use crate::state::State;
use crate::state::guards::Guards;
use crate::state::most::Most;
use crate::state::rate_bounds::RateBounds;
use crate::state::smoothness::Smoothness;
use crate::state::spacing::Spacing;

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
    pub(crate) guards: Guards<SampleRows>,
    pub(crate) most: Most,
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
    /// The states of the samples of which a term wants something, in their order, as they were evaluated last.
    pub(crate) samples: Vec<State>,
    /// Any other sample, while it is looked at.
    other: State,
    /// The samples before one, the nearest first, as many as terms read.
    earlier: Vec<State>,
    /// The first objective that gave up, and why.
    pub(crate) failure: Option<(usize, &'static str)>,
}

impl MotionState {
    /// A state for a motion, whose samples are to be [loaded](Self::load).
    pub(crate) fn new(layout: &Layout, motion: &MotionProblem) -> Self {
        let mut state = Self {
            rows: SampleRows::new(layout),
            guards: Guards::of_motion(layout),
            other: State::new(layout),
            earlier: vec![State::new(layout); layout.n_earlier],
            ..Self::default()
        };
        state.fit(layout, motion);
        state
    }

    /// Takes over what a motion of the same layout wants, in memory that is there already as far as it reaches.
    pub(crate) fn fit(&mut self, layout: &Layout, motion: &MotionProblem) {
        let n_samples = motion.timeline().n_samples();
        let (n, n_terms) = (layout.n_dofs * n_samples, motion.tracks().len());
        let any = |of: &dyn Fn(usize) -> bool| (0..n_terms).any(of);
        let refill = |to: &mut Vec<usize>, of: &dyn Fn(usize) -> bool| {
            to.clear();
            to.extend((0..n_samples).filter(|t| of(*t)));
        };
        refill(&mut self.keyed, &|t| any(&|term| motion.wants(term, t)));
        refill(&mut self.settled, &|t| any(&|term| motion.settles(term, t)));
        refill(&mut self.off, &|t| any(&|term| motion.is_off_at(term, t)));
        self.n_samples = n_samples;
        self.coords.resize(layout.n_coords * n_samples, 0.0);
        self.is_given.clear();
        self.is_given.extend((0..n_samples).map(|t| motion.given(t).is_some()));
        for per_tangent in [&mut self.gradient, &mut self.curvature, &mut self.pull] {
            per_tangent.resize(n, 0.0);
        }
        let weights = layout.movers.iter().flat_map(|m| {
            let weights = motion.smoothness_of(m.joint);
            std::iter::repeat_n(weights, m.n_dofs)
        });
        self.smoothness.fit(weights, motion.at_rest(), n_samples);
        self.spacing.weight = motion.even_spacing();
        self.rate_bounds.fit(layout, motion);
        self.samples.resize_with(self.keyed.len(), || State::new(layout));
        self.failure = None;
        // The first linearization finds room for all.
        self.most.fit(layout, motion, &self.keyed, &self.rows);
        self.rows.make_room(self.most.rows);
        self.guards.make_room(self.most.guards);
    }

    /// Takes over what does not move, as all samples have it; false where its numbers are not usable.
    pub(crate) fn load_still(&mut self, layout: &Layout, pose: &Pose) -> bool {
        let mut states = self.samples.iter_mut().chain(&mut self.earlier).chain([&mut self.other]);
        states.all(|state| state.load(layout, pose))
    }

    /// Takes over the pose of one sample, inside its limits; the answer is whether it was not, `None` where its numbers are
    /// not usable.
    pub(crate) fn load(&mut self, layout: &Layout, t: usize, pose: &Pose) -> Option<bool> {
        self.load_as_is(layout, t, pose)?;
        let moved = !self.is_given[t] && self.other.project(layout);
        if moved {
            let nc = layout.n_coords;
            self.coords[t * nc..(t + 1) * nc].copy_from_slice(&self.other.coords[..nc]);
        }
        Some(moved)
    }

    /// The same, wherever its limits are.
    pub(crate) fn load_as_is(&mut self, layout: &Layout, t: usize, pose: &Pose) -> Option<()> {
        if !self.other.load(layout, pose) {
            return None;
        }
        let nc = layout.n_coords;
        self.coords[t * nc..(t + 1) * nc].copy_from_slice(&self.other.coords[..nc]);
        Some(())
    }

    /// Writes one sample into the coordinates of a pose.
    pub(crate) fn store(&self, layout: &Layout, t: usize, coords: &mut [f64]) {
        let nc = layout.n_coords;
        layout.store(&self.coords[t * nc..(t + 1) * nc], coords);
    }

    /// The state of a sample of which a term wants something.
    pub(crate) fn wanted(&self, t: usize) -> Option<&State> {
        self.keyed.binary_search(&t).ok().map(|i| &self.samples[i])
    }

    /// A state with the coordinates of a sample: as it was evaluated last where a term wants something of it.
    pub(crate) fn stand_at(&mut self, layout: &Layout, t: usize) -> &State {
        match self.keyed.binary_search(&t) {
            Ok(i) => &self.samples[i],
            Err(_) => {
                copy_sample(layout, &self.coords, t, &mut self.other);
                &self.other
            }
        }
    }

    /// The cost of the terms that given samples settle. It is a constant of the motion, which [`evaluate`](Self::evaluate)
    /// leaves out: what no step can change must not say how much a step is worth.
    pub(crate) fn settled_cost(&mut self, layout: &Layout, motion: &MotionProblem) -> f64 {
        let mut cost = 0.0;
        for i in 0..self.settled.len() {
            let t = self.settled[i];
            enter(layout, &self.coords, &mut self.earlier, t, &mut self.other);
            // Another sample has other targets.
            self.other.forget_constants();
            cost += self.other.evaluate(layout, &motion.settled_at(t));
        }
        self.failure = self.failure.or(self.other.memory.failure.take());
        cost
    }

    /// Shows the samples of which terms want something, as they were evaluated last, each with those. Ends early where
    /// `see` says false.
    pub(crate) fn visit_wanted(
        &self,
        motion: &MotionProblem,
        mut see: impl FnMut(&State, &SampleTerms<'_>, usize) -> bool,
    ) {
        for (t, sample) in self.keyed.iter().zip(&self.samples) {
            if !see(sample, &motion.wanted_at(*t), *t) {
                return;
            }
        }
    }

    /// Evaluates and shows samples at which terms hold that given samples settle.
    pub(crate) fn visit_settled(
        &mut self,
        layout: &Layout,
        motion: &MotionProblem,
        mut see: impl FnMut(&mut State, &SampleTerms<'_>, usize) -> bool,
    ) {
        let Self { settled, coords, earlier, other, .. } = self;
        for &t in &*settled {
            let terms = motion.settled_at(t);
            enter(layout, coords, earlier, t, other);
            // Another sample has other targets.
            other.forget_constants();
            other.evaluate(layout, &terms);
            if !see(other, &terms, t) {
                return;
            }
        }
    }

    /// Shows every sample at which terms hold, with those: the ones that are wanted, as they were evaluated last; the ones
    /// that given samples settle; and the ones that are switched off, of which nothing is measured.
    pub(crate) fn visit_held(
        &mut self,
        layout: &Layout,
        motion: &MotionProblem,
        mut see: impl FnMut(&mut State, &SampleTerms<'_>, usize),
    ) {
        for (t, sample) in self.keyed.iter().zip(&mut self.samples) {
            see(sample, &motion.wanted_at(*t), *t);
        }
        self.visit_settled(layout, motion, |state, terms, t| {
            see(state, terms, t);
            true
        });
        for &t in &self.off {
            enter(layout, &self.coords, &mut self.earlier, t, &mut self.other);
            self.other.forward(layout);
            see(&mut self.other, &motion.off_at(t), t);
        }
    }

    /// The cost of the whole motion but for what is [settled](Self::settled_cost), with that of limits on rates while
    /// they are [on](RateBounds::begin); infinite where it is not a number.
    pub(crate) fn evaluate(&mut self, layout: &Layout, motion: &MotionProblem) -> f64 {
        self.evaluate_with::<false>(layout, motion)
    }

    /// The same with the derivatives of all residuals.
    pub(crate) fn differentiate(&mut self, layout: &Layout, motion: &MotionProblem) -> f64 {
        self.evaluate_with::<true>(layout, motion)
    }

    fn evaluate_with<const DERIVATIVES: bool>(&mut self, layout: &Layout, motion: &MotionProblem) -> f64 {
        let mut cost = 0.0;
        (self.violation, self.hard_square) = (0.0, 0.0);
        for (t, sample) in self.keyed.iter().zip(&mut self.samples) {
            enter(layout, &self.coords, &mut self.earlier, *t, sample);
            let terms = motion.wanted_at(*t);
            cost += if DERIVATIVES {
                sample.differentiate(layout, &terms)
            } else {
                sample.evaluate(layout, &terms)
            };
            self.failure = self.failure.or(sample.memory.failure.take());
            if layout.n_guards > 0 {
                self.violation += sample.violation;
                self.hard_square += sample.hard_square(layout, &terms);
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
            let terms = motion.wanted_at(t);
            let sample = &mut self.samples[i];
            sample.linearize(layout, &terms, false);
            self.failure = self.failure.or(sample.memory.failure.take());
            for back in 1..=layout.n_earlier.min(t) {
                let earlier = &mut self.earlier[back - 1];
                copy_sample(layout, &self.coords, t - back, earlier);
                earlier.forward(layout);
                earlier.carry_back(layout, &terms, &sample.memory, back);
            }
            for k in 0..n {
                self.gradient[t * n + k] += sample.own_gradient[k];
                self.curvature[t * n + k] += sample.own_curvature[k];
            }
            self.push_rows(layout, &terms, i);
        }
    }

    /// Writes half the gradient of the cost by the tangents of all samples, given ones among them, with `hard` times the squares
    /// of what hard rows miss, as of the last [linearization](Self::linearize).
    pub(crate) fn write_half_gradient(&self, hard: f64, gradient: &mut [f64]) {
        gradient.copy_from_slice(&self.gradient);
        self.rows.add_transposed(&self.rows.residual, gradient);
        self.guards.add_half_gradient(hard, gradient);
    }

    /// The gradient by one sample of smoothness, spacing and limits on rates, as of the last [linearization](Self::linearize).
    pub(crate) fn gradient_beside(&self, layout: &Layout, t: usize, beside: &mut [f64]) {
        let n = layout.n_dofs;
        let own = self.wanted(t).map_or(&[][..], |sample| &sample.own_gradient);
        for (k, beside) in beside.iter_mut().enumerate() {
            *beside = 2.0 * (self.gradient[t * n + k] - own.get(k).copied().unwrap_or(0.0));
        }
    }

    /// Copies the rows of a sample that was linearized.
    fn push_rows(&mut self, layout: &Layout, terms: &impl Terms, i: usize) {
        let (t, sample) = (self.keyed[i], &self.samples[i]);
        let (first_of_sample, first_guard) = (self.rows.n_rows(), self.guards.rows.n_rows());
        for term in layout.terms.iter().filter(|term| terms.is_on(term.term)) {
            let (weight, loss) = (terms.term(term.term).weight, terms.term(term.term).loss);
            if term.has_potential && !term.is_hard {
                self.cost_beside_rows += weight * sample.values[term.term];
            }
            for part in term.parts.clone() {
                let scale = sample.weights[part];
                let PartLayout { n_rows, row, place, .. } = layout.parts[part];
                match place {
                    Place::Step => {}
                    Place::Guard { .. } => {
                        let data = terms.term(term.term);
                        self.guards.push(layout, sample, &self.earlier, term, data, part);
                        continue;
                    }
                    Place::Own { .. } => {
                        self.cost_beside_rows += weight * loss.cost(sample.squares[part]);
                        continue;
                    }
                }
                let first = self.rows.n_rows();
                self.rows.parts.push(RowPart { first, n_rows, term_weight: weight, loss, weight: scale });
                for r in row..row + n_rows {
                    self.rows.push(r, sample.scaled[r], |back, k| {
                        let state = if back == 0 { sample } else { &self.earlier[back - 1] };
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

    /// The residuals as they were evaluated last, scaled as the rows of the last linearization are, and those of guards
    /// as they are.
    pub(crate) fn scaled_residuals(
        &self,
        layout: &Layout,
        motion: &MotionProblem,
        residual: &mut Vec<f64>,
        guards: &mut Vec<f64>,
    ) {
        residual.clear();
        guards.clear();
        let mut part_idx = 0;
        self.visit_wanted(motion, |sample, terms, _| {
            for term in layout.terms.iter().filter(|term| terms.is_on(term.term)) {
                for part in &layout.parts[term.parts.clone()] {
                    let rows = &sample.residual[part.row..part.row + part.n_rows];
                    match part.place {
                        Place::Own { .. } => {}
                        Place::Guard { .. } => guards.extend_from_slice(rows),
                        Place::Step => {
                            let scale = self.rows.parts[part_idx].weight.sqrt();
                            residual.extend(rows.iter().map(|r| r * scale));
                            part_idx += 1;
                        }
                    }
                }
            }
            true
        });
    }

    /// `coords := project(from ⊕ tangents)` for all samples that are not given.
    pub(crate) fn step(&mut self, layout: &Layout, from: &[f64], tangents: &[f64]) {
        let (n, nc) = (layout.n_dofs, layout.n_coords);
        self.coords.copy_from_slice(from);
        for t in (0..self.n_samples).filter(|t| !self.is_given[*t]) {
            layout.move_by(&mut self.coords[t * nc..(t + 1) * nc], &tangents[t * n..(t + 1) * n]);
        }
    }

    /// Sets the samples between two others on the way from one to the other, at even distances.
    pub(crate) fn interpolate(&mut self, layout: &Layout, from: usize, to: usize) {
        let nc = layout.n_coords;
        for t in (from + 1..to).filter(|t| !self.is_given[*t]) {
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
    }

    /// Whether all terms that count are within a part of their tolerances at each of the samples of which they want something, as of the
    /// last evaluation.
    pub(crate) fn is_within(
        &self,
        layout: &Layout,
        motion: &MotionProblem,
        part: f64,
        counts: impl Fn(&Term) -> bool,
    ) -> bool {
        let mut unmet = None;
        self.visit_wanted(motion, |sample, terms, _| {
            unmet = unmet_at(layout, motion, sample, terms, part, &counts);
            unmet.is_none()
        });
        unmet.is_none()
    }

    /// The first mandatory term that given samples settle and do not meet.
    pub(crate) fn conflict(&mut self, layout: &Layout, motion: &MotionProblem) -> Option<usize> {
        let mut unmet = None;
        self.visit_settled(layout, motion, |sample, terms, _| {
            unmet = unmet_at(layout, motion, sample, terms, 1.0, Term::counts);
            unmet.is_none()
        });
        unmet
    }

    /// The first term whose residual was not finite at one of its samples.
    pub(crate) fn not_finite(&mut self, layout: &Layout, motion: &MotionProblem) -> Option<usize> {
        let mut bad = None;
        let mut look = |sample: &State, terms: &SampleTerms<'_>, _: usize| {
            let mut on = layout.terms.iter().filter(|t| terms.is_on(t.term));
            let is_bad = |t: &&TermLayout| t.parts.clone().any(|part| !sample.squares[part].is_finite());
            bad = bad.or(on.find(is_bad).map(|t| t.term));
            bad.is_none()
        };
        self.visit_wanted(motion, &mut look);
        self.visit_settled(layout, motion, |sample, terms, t| look(sample, terms, t));
        bad
    }
}

/// Copies the coordinates of a sample into a state.
fn copy_sample(layout: &Layout, coords: &[f64], t: usize, state: &mut State) {
    let nc = layout.n_coords;
    state.coords[..nc].copy_from_slice(&coords[t * nc..(t + 1) * nc]);
}

/// Has a state stand at a sample, with those before it that terms read.
fn enter(layout: &Layout, coords: &[f64], earlier: &mut [State], t: usize, state: &mut State) {
    copy_sample(layout, coords, t, state);
    for (back, earlier) in earlier.iter_mut().enumerate().take(t) {
        copy_sample(layout, coords, t - 1 - back, earlier);
        state.set_earlier(layout, back, earlier);
    }
}

/// The first term of one sample that counts and is not within a part of its tolerance there.
fn unmet_at(
    layout: &Layout,
    motion: &MotionProblem,
    sample: &State,
    terms: &SampleTerms<'_>,
    part: f64,
    counts: impl Fn(&Term) -> bool,
) -> Option<usize> {
    let mut on = layout.terms.iter().filter(|t| terms.is_on(t.term));
    let unmet = on.find(|t| {
        let data = &motion.terms().terms()[t.term];
        counts(data) && !sample.is_within(layout, t, &data.tolerance.times(part))
    });
    unmet.map(|t| t.term)
}

#[cfg(test)]
mod tests;
