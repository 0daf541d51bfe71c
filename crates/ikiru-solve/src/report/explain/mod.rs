//! Why not: the forces that act at a pose, and how much of an unmet term's pull each of them bears.
//!
//! At a best pose the pull of a term, `f` (its gradient), is balanced by those of all else: other terms, constraints and
//! limits. Of each, with its force `v`, the share is `−f · v / ‖f‖²`. What is out of reach has no pull to be balanced, and
//! where the links prove how far it is, so much of what is missed is theirs.
//!
//! Constraints are held whatever wishes say. So wishes are explained by the forces that balance all wishes, and
//! constraints that are not met by those that balance what these miss, wishes aside.

use std::ops::Range;

use crate::layout::{Layout, TermLayout};
use crate::problem::Terms;
use crate::report::force::{Force, ForceBy};
use crate::report::here::Here;
use crate::state::State;
use crate::words::Unit;

mod balance;
mod hint;
mod pulls;
mod reach;
mod unmet;
mod why;

use balance::{Balance, dot, most_limits};
use hint::missed_distance;
pub(crate) use unmet::Unmet;
pub(crate) use why::{explain, is_free};

/// At most so many forces are told of one term, the strongest.
const MOST_FORCES: usize = 8;
/// Shares below this are not told.
const LEAST_SHARE: f64 = 0.01;
/// Shares that differ by less than this part are in the order of joints and terms: rounding has no say.
const ALIKE: f64 = 1e-6;
/// A term whose pull is below this part of what it would be if all that it misses could be moved is out of reach from here: at 0
/// altogether, and nothing else is in its way.
const LEAST_PULL: f64 = 0.05;
/// A force below this part of the largest curvature (that is, one that is gone so many radians or metres further on) does
/// not act.
const LEAST_WAY: f64 = balance::ON_LIMIT;

/// What a part of a term, or its potential, does to the degrees of freedom.
#[derive(Clone, Copy, Debug)]
struct Pull {
    /// The multiplier or slope, by `unit`.
    amount: f64,
    unit: Unit,
    /// The square of what pushes its rows, and of the longest of these.
    pushes: f64,
    longest: f64,
}

impl Pull {
    const NONE: Self = Self { amount: 0.0, unit: Unit::Radians, pushes: 0.0, longest: 0.0 };

    /// Adds a row: what pushes it, and the square of its length.
    fn add(&mut self, push: f64, square: f64) {
        self.pushes += push * push;
        self.longest = self.longest.max(square);
    }
}

/// Memory, and what was found.
#[derive(Clone, Debug, Default)]
pub(crate) struct Explainer {
    balance: Balance,
    /// Of each part, and then of each term's potential.
    pulls: Vec<Pull>,
    gradients: Vec<f64>,
    /// The gradient that is balanced, and that of one term.
    whole: Vec<f64>,
    of_term: Vec<f64>,
    /// Squares of the lengths of rows.
    squares: Vec<f64>,
    found: Vec<Force>,
    /// What is in nobody's way, so far.
    others: Vec<Force>,
    /// The forces, as the report has them.
    pub(crate) forces: Vec<Force>,
}

impl Explainer {
    pub(crate) fn new(layout: &Layout) -> Self {
        let (n, n_terms) = (layout.n_dofs, layout.terms.len());
        let has_potentials = layout.terms.iter().any(|t| t.has_potential);
        let n_pulls = layout.parts.len() + if has_potentials { n_terms } else { 0 };
        let n_found = most_limits(layout) + n_terms + 3;
        Self {
            balance: Balance::new(layout),
            pulls: vec![Pull::NONE; n_pulls],
            gradients: vec![0.0; n_pulls * n],
            whole: vec![0.0; n],
            of_term: vec![0.0; n],
            squares: vec![0.0; layout.n_all_rows()],
            found: Vec::with_capacity(n_found),
            others: Vec::with_capacity(n_found),
            forces: Vec::with_capacity(n_found + MOST_FORCES * n_terms),
        }
    }

    /// Whether nothing can act at a sample where all terms are met.
    fn is_free<T>(&mut self, here: &Here<'_, T>) -> bool {
        self.balance.begin(here.layout, here.state);
        self.balance.limits.is_empty() && here.layout.n_guards == 0
    }

    /// Tells what is in the way of one term, the strongest first; `stays` stays the first unless another one is clearly
    /// stronger. The answer is the first.
    pub(crate) fn explain(
        &mut self,
        here: &Here<'_, impl Terms>,
        term: usize,
        stays: Option<ForceBy>,
    ) -> Option<ForceBy> {
        let Here { layout, state, secs, .. } = *here;
        let t = layout.terms.get(term).filter(|t| here.terms.is_on(t.term))?;
        let n = layout.n_dofs;
        self.of_term.fill(0.0);
        // What the pull would be if all that is missed could be moved as well as what moves best.
        let longest = pulls_of(layout, t).map(|idx| self.pulls[idx].longest).fold(0.0, f64::max);
        let mut most = 0.0;
        for idx in pulls_of(layout, t) {
            self.of_term.iter_mut().zip(&self.gradients[idx * n..]).for_each(|(f, g)| *f += g);
            let Pull { pushes, longest: own, .. } = self.pulls[idx];
            most += pushes * if own > 0.0 { own } else { longest };
        }
        let length = dot(&self.of_term, &self.of_term).sqrt();
        let missing = missed_distance(here, t);
        let (missed, unit) = missed(layout, state, t);
        let from_here = if most > 0.0 { (1.0 - length / most.sqrt() / LEAST_PULL).max(0.0) } else { 1.0 };
        let proven = if missing > 0.0 { (missing / missed).min(1.0) } else { 0.0 };
        let by_reach = proven.max(from_here);
        self.find(here, Some(term));
        let sum: f64 = self.found.iter().map(|force| force.share).sum();
        let scale = (1.0 - by_reach) / sum.max(1.0);
        self.found.iter_mut().for_each(|force| force.share *= scale);
        let is_proven = missing > 0.0;
        let amount = if is_proven { missing } else { missed };
        let by = ForceBy::Reach { is_proven };
        self.found.push(Force { on: Some(term), by, share: by_reach, amount, unit, secs });
        self.found.retain(|force| force.share >= LEAST_SHARE);
        strongest_first(&mut self.found);
        self.found.truncate(MOST_FORCES);
        if let Some(at) = stays.and_then(|by| self.found.iter().position(|force| force.by == by))
            && unmet::STAYS * self.found[at].share >= self.found[0].share
        {
            self.found[..=at].rotate_right(1);
        }
        self.forces.extend_from_slice(&self.found);
        self.found.first().map(|force| force.by)
    }

    /// Takes over the limits and constraints that act at one sample and are in nobody's way, but for forces that are no
    /// larger than `least`. Those that act at several samples count where they are the strongest.
    fn add_others(&mut self, here: &Here<'_, impl Terms>, least: f64) {
        self.of_term.copy_from_slice(&self.whole);
        self.find(here, None);
        let told = &self.forces;
        let length = dot(&self.whole, &self.whole).sqrt();
        self.found.retain(|force| {
            let is_strong = force.share.sqrt() * length > least;
            is_strong && !told.iter().any(|other| other.by == force.by)
        });
        let sum: f64 = self.found.iter().map(|force| force.share).sum();
        self.found.iter_mut().for_each(|force| force.share /= sum.max(1.0));
        for force in &self.found {
            match self.others.iter_mut().find(|other| other.by == force.by) {
                Some(other) if other.amount >= force.amount => {}
                Some(other) => *other = *force,
                None => self.others.push(*force),
            }
        }
    }

    /// Tells those, the strongest first.
    fn tell_others(&mut self) {
        strongest_first(&mut self.others);
        self.forces.append(&mut self.others);
    }

    /// What opposes the gradient in `of_term`, with its share: everything for a term, else limits and constraints.
    fn find(&mut self, here: &Here<'_, impl Terms>, on: Option<usize>) {
        let Here { layout, secs, .. } = *here;
        let n = layout.n_dofs;
        let f = &self.of_term;
        let square = dot(f, f);
        self.found.clear();
        if square == 0.0 {
            return;
        }
        for limit in &self.balance.limits {
            let share = -limit.pull(f) / square;
            let by = ForceBy::Limit { joint: limit.joint, kind: limit.kind };
            add(&mut self.found, Force { on, by, share, amount: limit.amount(), unit: limit.unit, secs });
        }
        for t in layout.terms.iter().filter(|t| if on.is_some() { on != Some(t.term) } else { t.is_hard }) {
            let mut share = 0.0;
            let mut strongest = (0.0, 0);
            for idx in pulls_of(layout, t) {
                let own = -dot(f, &self.gradients[idx * n..(idx + 1) * n]) / square;
                share += own;
                if own > strongest.0 {
                    strongest = (own, idx);
                }
            }
            if share <= 0.0 {
                continue;
            }
            let Pull { amount, unit, .. } = self.pulls[strongest.1];
            add(&mut self.found, Force { on, by: ForceBy::Term(t.term), share, amount, unit, secs });
        }
        if let Some(beside) = here.beside.filter(|_| on.is_some()) {
            let mut tell = |by, gradient: &[f64], sign: f64| {
                let (share, amount) = (-sign * dot(f, gradient) / square, dot(gradient, gradient).sqrt());
                add(&mut self.found, Force { on, by, share, amount, unit: Unit::Radians, secs });
            };
            tell(ForceBy::Smoothness, beside.smoothness, 1.0);
            if beside.holds_rates {
                tell(ForceBy::RateLimits, &self.balance.rest, -1.0);
            }
        }
    }
}

/// Where the pulls of a term lie.
fn pulls_of(layout: &Layout, t: &TermLayout) -> impl Iterator<Item = usize> + use<> {
    let potential = layout.parts.len() + t.term;
    let parts: Range<usize> = t.parts.clone();
    parts.chain(t.has_potential.then_some(potential))
}

/// Adds a force that opposes; those of one joint's limit that has several edges are one.
fn add(found: &mut Vec<Force>, force: Force) {
    if force.share <= 0.0 || force.share.is_nan() {
        return;
    }
    match found.last_mut().filter(|last| last.by == force.by) {
        Some(last) => (last.share, last.amount) = (last.share + force.share, last.amount.max(force.amount)),
        None => found.push(force),
    }
}

/// Sorts by share; those that are alike stay in their order.
fn strongest_first(forces: &mut [Force]) {
    for end in 1..forces.len() {
        let mut at = end;
        while at > 0 && forces[at].share > forces[at - 1].share * (1.0 + ALIKE) {
            forces.swap(at, at - 1);
            at -= 1;
        }
    }
}

/// What a term misses, by its first part.
fn missed(layout: &Layout, state: &State, t: &TermLayout) -> (f64, Unit) {
    let first = layout.reported_parts(t).next();
    first.map_or((0.0, Unit::Radians), |part| (state.squares[part].sqrt(), layout.parts[part].unit))
}

#[cfg(test)]
mod tests {
    use ikiru_rig::{JointId, Pose};
    use ikiru_testkit::rigs::{Random, random_pose, random_rig};

    use super::*;
    use crate::objectives::{Bound, Distance, JointAngles, KnownRotation, PoseTarget, Position, RestPose};
    use crate::report::here::Of;
    use crate::report::subject::{PoseSubject, Subject};
    use crate::state::gradient::whole_gradient;
    use crate::{Problem, Settle, Solver, SolverOptions, StopReason};

    /// Wishes that cannot all be met, and constraints that can.
    fn problem(case: u64, random: &mut Random) -> Problem {
        let rig = random_rig(3 + random.below(14), case);
        let joint = |random: &mut Random| JointId::from_index(random.below(rig.n_joints()));
        let mut problem = Problem::whole_body(&rig);
        problem.add(1.0, PoseTarget::new(joint(random), random.vector(1.0), random.rotation()));
        problem.add(0.3, Position::new(joint(random), random.vector(0.6)));
        let joints: Vec<JointId> = problem.active().collect();
        problem.add(0.02, RestPose::new(&joints, rig.rest_pose()));
        let scalar = |joint: &&JointId| rig.get(**joint).is_some_and(|joint| joint.n_coords() == 1);
        let given: Vec<_> =
            joints.iter().filter(scalar).map(|joint| (*joint, JointAngles::Value(0.2))).collect();
        if !given.is_empty() {
            problem.add(0.05, KnownRotation::new(&given));
        }
        let held: Pose = random_pose(&rig, random);
        for _ in 0..random.below(4) {
            let pair = [joint(random), joint(random)];
            let frames = pair.map(|joint| held.frame(joint).unwrap().position);
            let apart = frames[0].distance(frames[1]);
            if pair[0] != pair[1] {
                let bounds = [Bound::AtMost(apart), Bound::Exactly(apart), Bound::AtLeast(apart)];
                problem.add_hard(Distance::new(pair, bounds[random.below(3)]));
            }
        }
        let soft = Distance::new([joint(random), JointId::from_index(0)], Bound::AtLeast(0.8));
        if soft.joints[0] != soft.joints[1] {
            problem.add(0.2, soft);
        }
        problem
    }

    #[test]
    fn the_forces_balance_the_gradient_where_a_solve_converged() {
        let mut random = Random::new(21);
        let (mut n_cases, mut n_left, mut n_limits, mut n_rows) = (0, 0, 0, 0);
        for case in 0..400 {
            let problem = problem(case, &mut random);
            let solver = Solver::new(SolverOptions { settle: Settle::Fully, ..SolverOptions::default() });
            let mut workspace = solver.workspace(&problem);
            let mut pose = random_pose(problem.rig(), &mut random);
            let report = solver.solve(&problem, &mut pose, &mut workspace);
            if report.stop != StopReason::Converged || report.terms.iter().any(|t| t.hard && !t.satisfied) {
                continue;
            }
            let layout = &Layout::new(&problem).unwrap();
            let state = &mut State::new(layout);
            assert!(state.load(layout, &pose));
            state.evaluate(layout, &problem);
            state.linearize(layout, &problem, false);
            let mut explainer = Explainer::new(layout);
            let mut subject = PoseSubject { layout, problem: &problem, state };
            explainer.read(&subject.at(0, Of::Wishes), Of::Wishes);
            // The pulls are those of the cost.
            let mut gradient = vec![0.0; layout.n_dofs];
            whole_gradient(layout, state, 0.0, &mut gradient);
            let size = dot(&gradient, &gradient).sqrt();
            let near = |(a, b): (&f64, &f64)| (a - b).abs() <= 1e-12 * (1.0 + size);
            assert!(gradient.iter().zip(&explainer.whole).all(near), "case {case}");
            // And forces of the right sign balance them; what is left is a way on which the cost really falls, that fast, and
            // on which limits and constraints hold.
            assert!(explainer.balance.has_signs(), "case {case}: {:?}", explainer.balance);
            let rest = dot(&explainer.balance.rest, &explainer.balance.rest).sqrt();
            if rest > 1e-4 * (size + state.largest_curvature(layout)) {
                let from = state.coords.clone();
                let way: Vec<f64> = explainer.balance.rest.iter().map(|r| -1e-6 * r / rest).collect();
                let (cost, missed) = (state.evaluate(layout, &problem), state.violation);
                state.step(layout, &from, &way);
                let saved = cost - state.evaluate(layout, &problem);
                assert!((saved - 1e-6 * rest).abs() < 0.1 * 1e-6 * rest, "case {case}: {saved} {rest}");
                assert!(state.violation <= missed + 1e-9, "case {case}: {}", state.violation);
                n_left += 1;
            }
            n_cases += 1;
            n_limits += explainer.balance.limits.iter().filter(|limit| limit.push != 0.0).count();
            n_rows += explainer.balance.rows.iter().filter(|row| row.force != 0.0).count();
        }
        assert!(n_cases > 250 && n_limits > 300 && n_rows > 200, "{n_cases} {n_limits} {n_rows}");
        assert!(n_left < n_cases / 4, "{n_left} of {n_cases}");
    }
}
