//! A motion of fixed duration inside limits on speed and acceleration: rounds of the augmented Lagrangian.

use ikiru_rig::{Clip, RateExcess, RateLimit, difference_joint};

use crate::motion::lm::FIRST_DAMPING;
use crate::motion::planner::{Outcome, Run};
use crate::report::StopReason;
use crate::solvers::search::{Bar, HELD};

/// The first weight of what is beyond a limit is the cost of the motion as if there were none, but at least this part of
/// the guess's: soft enough that steps see limits come.
const LEAST_PENALTY: f64 = 1e-6;
/// By how much that weight grows when a round has not brought the worst down to half.
const GROWTH: f64 = 4.0;
/// Most of it, relative to the first.
const MOST_GROWTH: f64 = 1e10;
/// How far beyond what is allowed, relative to it, counts as kept by a round: less than the margin that is kept to limits.
const SLACK: f64 = 5e-4;
/// A round that changes the cost by less than this part of it was the last.
const LEAST_CHANGE: f64 = 1e-2;
/// How exactly a round is solved.
const LEAST_GAIN_OF_ROUND: f64 = 1e-4;
/// Most rounds.
const MOST_ROUNDS: usize = 40;
/// What is allowed after a peak was measured beyond its limit, relative to what that asks for.
const TIGHTER: f64 = 1.0005;
/// The most of that at once: a cone that stops a ball makes peaks that no tightening helps.
const MOST_TIGHTER: f64 = 1.2;
/// Halvings on the way back to a motion that keeps all limits.
const HALVINGS: usize = 12;

impl Run<'_> {
    /// Whether limits on rates are to be held by the plan itself.
    pub(super) fn holds_rates(&self) -> bool {
        self.motion.holds_rates()
    }

    /// The limits that a clip does not keep where it was planned.
    pub(super) fn exceeded(&self, clip: &Clip) -> Vec<RateExcess> {
        // The limits were checked when they were set.
        let mut excess = clip.exceeded(self.motion.rate_limits()).unwrap_or_default();
        // What was executed is not judged: only its last two samples lie beside what is planned.
        let from = self.motion.n_history().saturating_sub(2);
        let planned = |excess: &RateExcess| excess.peak.secs >= clip.times()[from];
        if !excess.iter().all(planned) {
            let limits: Vec<RateLimit> = excess.iter().filter(|e| !planned(e)).map(|e| e.limit).collect();
            excess.retain(planned);
            let (times, poses) = (clip.times()[from..].to_vec(), clip.poses()[from..].to_vec());
            let behind = Clip::new("", times, poses).and_then(|clip| clip.exceeded(&limits));
            excess.extend(behind.unwrap_or_default());
        }
        excess
    }

    fn exceeded_now(&mut self) -> Vec<RateExcess> {
        let clip = self.clip();
        self.exceeded(&clip)
    }

    /// The motion in the state, inside its limits on rates; as if there were none where it keeps them anyway.
    pub(super) fn run_limited(&mut self, cost: f64, bar: &Bar) -> Outcome {
        let mut outcome = self.run_unlimited(cost, bar);
        if self.exceeded_now().is_empty() {
            return Outcome { keeps_rates: true, ..outcome };
        }
        if outcome.stop.is_final() {
            // No time to be led within the limits: what is known to keep them comes back.
            let keeps = self.retreat();
            return self.end_limited(keeps, outcome.stop, false);
        }
        let is_rate_bound = self.succeeded(&outcome);
        let weights: f64 = self.motion.terms().terms().iter().map(|term| term.weight).sum();
        let first = outcome.cost.max(LEAST_PENALTY * cost.max(weights));
        let n = self.layout.n_dofs;
        let to_the_end = Bar { cost_below: None, impatient: false, ..*bar };
        self.state.rate_bounds.begin(first);
        let mut damping = FIRST_DAMPING;
        let (mut worst, mut before) = (f64::INFINITY, f64::INFINITY);
        // The cheapest motion that was seen to keep all limits.
        let mut kept: Option<((f64, f64), Vec<f64>)> = None;
        for _ in 0..MOST_ROUNDS {
            let cost = self.state.evaluate(&self.layout, self.motion);
            self.budget.next_start();
            damping = (10.0 * damping).min(FIRST_DAMPING);
            outcome = self.run_lm_from(cost, &to_the_end, LEAST_GAIN_OF_ROUND, &mut damping);
            let cost = self.state.evaluate(&self.layout, self.motion);
            let first_differences = self.state.smoothness.first();
            let plain = cost - self.state.rate_bounds.cost(n, first_differences);
            let now = self.state.rate_bounds.update(n, first_differences);
            if outcome.stop.is_final() {
                break;
            }
            if now <= SLACK {
                let exceeded = self.exceeded_now();
                // What is hard comes first.
                let rank = (self.state.violation.max(HELD), plain);
                if exceeded.is_empty() && kept.as_ref().is_none_or(|(least, _)| rank < *least) {
                    kept = Some((rank, self.state.coords.clone()));
                }
                if exceeded.is_empty() && (plain - before).abs() <= LEAST_CHANGE * plain {
                    break;
                }
                for excess in exceeded {
                    let factor = (TIGHTER * excess.ratio()).min(MOST_TIGHTER);
                    self.state.rate_bounds.tighten(&excess.limit, factor);
                }
            } else if now > 0.5 * worst {
                let penalty = self.state.rate_bounds.penalty();
                self.state.rate_bounds.set_penalty((penalty * GROWTH).min(first * MOST_GROWTH));
            }
            (worst, before) = (now, plain);
        }
        self.state.rate_bounds.begin(0.0);
        let keeps = match kept {
            Some((_, coords)) => {
                self.state.coords.copy_from_slice(&coords);
                true
            }
            None => self.exceeded_now().is_empty() || self.retreat(),
        };
        self.end_limited(keeps, outcome.stop, is_rate_bound)
    }

    fn end_limited(&mut self, keeps: bool, stop: StopReason, is_rate_bound: bool) -> Outcome {
        let cost = self.state.evaluate(&self.layout, self.motion);
        let cost = if keeps { cost } else { f64::INFINITY };
        let violation = self.state.violation;
        Outcome { cost, violation, stop, is_rate_bound, keeps_rates: keeps }
    }

    /// Goes back, as little as it takes, towards a motion that is known to keep the limits on rates: the straight
    /// way between what is given, or standing still. False where that does not keep them either; the motion is
    /// then left alone. A budget that has run out leaves no time to look for the least way back.
    fn retreat(&mut self) -> bool {
        let reached = self.state.coords.clone();
        self.go_straight();
        if !self.exceeded_now().is_empty() {
            self.state.coords.copy_from_slice(&reached);
            return false;
        }
        let safe = self.state.coords.clone();
        if self.budget.is_late() {
            return true;
        }
        let (mut kept, mut part) = (0.0, 0.5);
        for halving in 0..HALVINGS {
            if self.budget.is_late() {
                break;
            }
            self.set_between(&safe, &reached, part);
            let width = 0.5_f64.powi(halving as i32 + 2);
            if self.exceeded_now().is_empty() {
                kept = part;
                part += width;
            } else {
                part -= width;
            }
        }
        self.set_between(&safe, &reached, kept);
        true
    }

    /// The straight way at constant speed from the last sample of the history to a given end, or standing still.
    fn go_straight(&mut self) {
        let nc = self.layout.n_coords;
        let last = self.state.n_samples - 1;
        self.state.coords.copy_from_slice(&self.workspace.start);
        let is_given = self.state.is_given.clone();
        let from = is_given[..last].iter().rposition(|given| *given);
        match (from, is_given[last]) {
            (Some(from), true) => self.state.interpolate(&self.layout, from, last),
            (from, end_is_given) => {
                let from = from.unwrap_or(if end_is_given { last } else { 0 });
                for t in (0..=last).filter(|t| !is_given[*t]) {
                    self.state.coords.copy_within(from * nc..(from + 1) * nc, t * nc);
                }
            }
        }
    }

    /// The motion a part of the way from one to another.
    fn set_between(&mut self, from: &[f64], to: &[f64], part: f64) {
        let (n, nc) = (self.layout.n_dofs, self.layout.n_coords);
        let mut way = vec![0.0; n * self.state.n_samples];
        for t in 0..self.state.n_samples {
            for m in &self.layout.movers {
                let coords = t * nc + m.coord..t * nc + m.coord + m.n_coords;
                let way = &mut way[t * n + m.dof..t * n + m.dof + m.n_dofs];
                difference_joint(&m.motion, &from[coords.clone()], &to[coords], way);
                way.iter_mut().for_each(|w| *w *= part);
            }
        }
        self.state.step(&self.layout, from, &way);
    }
}
