//! A motion by Levenberg–Marquardt: as if nothing limited speed and acceleration, and inside limits on those in a fixed
//! duration, by rounds of the augmented Lagrangian.

use ikiru_rig::{Clip, RateExcess, RateLimit, difference_joint};

use crate::method::lm::Lm;
use crate::method::{Bar, Budget, HELD, Outcome};
use crate::model::{Effort, Model, Trajectory};
use crate::problem::motion::MotionProblem;
use crate::words::StopReason;

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
/// By how much more a round is damped than the one before ended.
const MORE_DAMPING: f64 = 10.0;
/// Most rounds; users read this number at `SolverOptions::max_iterations`, which holds for each.
const MOST_ROUNDS: usize = 40;
/// What is allowed after a peak was measured beyond its limit, relative to what that asks for.
const TIGHTER: f64 = 1.0005;
/// The most of that at once: a cone that stops a ball makes peaks that no tightening helps.
const MOST_TIGHTER: f64 = 1.2;
/// Halvings on the way back to a motion that keeps all limits.
const HALVINGS: usize = 12;

/// How exactly a motion is solved without even spacing before it is with it.
const LEAST_GAIN_UNSPACED: f64 = 1e-4;

/// Improves a motion, whose cost is `cost` and which was evaluated last, as if nothing limited
/// speed and acceleration.
///
/// Even spacing begins from the motion as it is without: its curvature is only bounded, loosely along steps that all
/// grow together, so that a motion which has still everything to reach would hardly get away.
pub(crate) fn run_unlimited(
    model: &mut Trajectory<'_>,
    lm: &mut Lm,
    cost: f64,
    bar: &Bar,
    budget: &mut Budget<'_>,
) -> Outcome {
    let (mut cost, weight) = (cost, model.state.spacing.weight);
    if weight > 0.0 {
        model.state.spacing.weight = 0.0;
        let to_the_end = Bar { cost_below: None, ..*bar };
        let mut effort = Effort { least_gain: LEAST_GAIN_UNSPACED, ..Effort::FULL };
        let first = lm.run(model, cost, &to_the_end, budget, &mut effort);
        model.state.spacing.weight = weight;
        cost = model.evaluate();
        if first.stop.is_final() {
            return Outcome::new(cost, model.violation(), first.stop, true);
        }
        budget.next_start();
    }
    lm.run(model, cost, bar, budget, &mut { Effort::FULL })
}

/// The limits that a clip does not keep where it was planned.
pub(crate) fn exceeded(motion: &MotionProblem, clip: &Clip) -> Vec<RateExcess> {
    exceeded_while(motion, clip, &|| true).unwrap_or_default()
}

/// The limits that a clip does not keep where it was planned, as long as it may go on; `None` where it was stopped.
fn exceeded_while(
    motion: &MotionProblem,
    clip: &Clip,
    may_go_on: &dyn Fn() -> bool,
) -> Option<Vec<RateExcess>> {
    // The limits were checked when they were set.
    let mut excess = clip.exceeded_while(motion.rate_limits(), may_go_on).unwrap_or_default()?;
    // What was executed is not judged: only its last two samples lie beside what is planned.
    let from = motion.n_history().saturating_sub(2);
    let planned = |excess: &RateExcess| excess.peak.secs >= clip.times()[from];
    if !excess.iter().all(planned) {
        let limits: Vec<RateLimit> = excess.iter().filter(|e| !planned(e)).map(|e| e.limit).collect();
        excess.retain(planned);
        let (times, poses) = (clip.times()[from..].to_vec(), clip.poses()[from..].to_vec());
        let behind = Clip::new("", times, poses).and_then(|clip| clip.exceeded_while(&limits, may_go_on));
        excess.extend(behind.unwrap_or_default()?);
    }
    Some(excess)
}

/// Whether the motion as it is keeps all limits on rates, and which it does not keep; `None` where the time for finding out is
/// over.
fn exceeded_now(model: &mut Trajectory<'_>, budget: &Budget<'_>) -> Option<Vec<RateExcess>> {
    model.write_clip();
    exceeded_while(model.motion, model.clip, &|| budget.stop().is_none())
}

/// What is known of the limits on rates that the motion as it is does not keep, without measuring it; `None` where that is
/// nothing.
pub(crate) fn known_excess<'a>(model: &'a Trajectory<'_>) -> Option<&'a [RateExcess]> {
    let (memory, coords) = (&model.memory, &model.state.coords);
    if memory.good == *coords {
        return Some(&[]);
    }
    memory.safe_excess.as_deref().filter(|_| memory.safe == *coords)
}

/// Finds out, once a plan, whether the straight way between what is given, or standing still, keeps the limits: it is what
/// comes back where there is no time for more, and unmeasured where there is none for this either. The motion stays as it is.
fn find_safe(model: &mut Trajectory<'_>, budget: &Budget<'_>) {
    if model.memory.safe_excess.is_some() {
        return;
    }
    model.memory.reached.clone_from(&model.state.coords);
    model.go_straight();
    model.memory.safe.clone_from(&model.state.coords);
    model.memory.safe_excess = exceeded_now(model, budget);
    model.state.coords.copy_from_slice(&model.memory.reached);
}

/// Improves a motion inside its limits on rates; as if there were none where it keeps them anyway.
pub(crate) fn run_limited(
    model: &mut Trajectory<'_>,
    lm: &mut Lm,
    cost: f64,
    bar: &Bar,
    budget: &mut Budget<'_>,
) -> Outcome {
    find_safe(model, budget);
    let mut outcome = run_unlimited(model, lm, cost, bar, budget);
    let found = if outcome.stop.is_final() { None } else { exceeded_now(model, budget) };
    let Some(excess) = found else {
        // No time to be led within the limits: what is known to keep them comes back.
        let stop = budget.stop().unwrap_or(outcome.stop);
        let keeps = retreat(model, budget);
        return end(model, keeps, stop);
    };
    if excess.is_empty() {
        keep(model);
        return outcome;
    }
    if !outcome.is_evaluated {
        model.evaluate();
    }
    model.is_rate_bound = match bar.cost_below {
        Some(bar) => outcome.cost < bar && model.holds(),
        None => model.is_satisfied(1.0),
    };
    let weights: f64 = model.motion.terms().terms().iter().map(|term| term.weight).sum();
    let first = outcome.cost.max(LEAST_PENALTY * cost.max(weights));
    let n = model.layout.n_dofs;
    let to_the_end = Bar { cost_below: None, impatient: false, ..*bar };
    model.state.rate_bounds.begin(first);
    let mut damping = Effort::FIRST_DAMPING;
    let (mut worst, mut before) = (f64::INFINITY, f64::INFINITY);
    // The cheapest motion that was seen to keep all limits.
    let mut kept: Option<(f64, f64)> = None;
    for _ in 0..MOST_ROUNDS {
        let cost = model.evaluate();
        budget.next_start();
        damping = (MORE_DAMPING * damping).min(Effort::FIRST_DAMPING);
        let mut effort = Effort { damping, least_gain: LEAST_GAIN_OF_ROUND };
        outcome = lm.run(model, cost, &to_the_end, budget, &mut effort);
        damping = effort.damping;
        if outcome.stop.is_final() {
            break;
        }
        let cost = model.evaluate();
        let first_differences = model.state.smoothness.first();
        let plain = cost - model.state.rate_bounds.cost(n, first_differences);
        let now = model.state.rate_bounds.update(n, first_differences);
        if now <= SLACK {
            let Some(exceeded) = exceeded_now(model, budget) else {
                outcome.stop = budget.stop().unwrap_or(outcome.stop);
                break;
            };
            // What is hard comes first.
            let rank = (model.state.violation.max(HELD), plain);
            if exceeded.is_empty() && kept.is_none_or(|least| rank < least) {
                kept = Some(rank);
                model.memory.kept.clone_from(&model.state.coords);
            }
            if exceeded.is_empty() && (plain - before).abs() <= LEAST_CHANGE * plain {
                break;
            }
            for excess in exceeded {
                let factor = (TIGHTER * excess.ratio()).min(MOST_TIGHTER);
                model.state.rate_bounds.tighten(&excess.limit, factor);
            }
        } else if now > 0.5 * worst {
            let penalty = model.state.rate_bounds.penalty();
            model.state.rate_bounds.set_penalty((penalty * GROWTH).min(first * MOST_GROWTH));
        }
        (worst, before) = (now, plain);
    }
    model.state.rate_bounds.begin(0.0);
    let keeps = if kept.is_some() {
        model.state.coords.copy_from_slice(&model.memory.kept);
        true
    } else {
        let is_over = outcome.stop.is_final();
        let keeps = !is_over && exceeded_now(model, budget).is_some_and(|excess| excess.is_empty());
        keeps || retreat(model, budget)
    };
    end(model, keeps, outcome.stop)
}

/// Remembers that the motion as it is was seen to keep all limits on rates.
fn keep(model: &mut Trajectory<'_>) {
    model.memory.good.clone_from(&model.state.coords);
}

fn end(model: &mut Trajectory<'_>, keeps: bool, stop: StopReason) -> Outcome {
    if keeps {
        keep(model);
    }
    let cost = model.evaluate();
    Outcome::new(if keeps { cost } else { f64::INFINITY }, model.state.violation, stop, true)
}

/// Goes back, as little as it takes, towards a motion that is known to keep the limits on rates. False where there is none:
/// the motion is then left alone, or is the straight way where that was not measured to the end. A budget that has run out
/// leaves no time to look for the least way back.
fn retreat(model: &mut Trajectory<'_>, budget: &Budget<'_>) -> bool {
    let is_over = budget.stop().is_some();
    match &model.memory.safe_excess {
        Some(excess) if excess.is_empty() => {}
        Some(_) => return false,
        None => {
            model.state.coords.copy_from_slice(&model.memory.safe);
            return false;
        }
    }
    model.memory.reached.clone_from(&model.state.coords);
    let (mut kept, mut part) = (0.0, 0.5);
    let mut width = 0.25;
    for _ in 0..HALVINGS {
        if is_over {
            break;
        }
        set_between(model, part);
        let Some(excess) = exceeded_now(model, budget) else { break };
        if excess.is_empty() {
            kept = part;
            part += width;
        } else {
            part -= width;
        }
        width *= 0.5;
    }
    if kept > 0.0 {
        set_between(model, kept);
    } else {
        model.state.coords.copy_from_slice(&model.memory.safe);
    }
    true
}

/// The motion a part of the way from what is safe to what was reached.
fn set_between(model: &mut Trajectory<'_>, part: f64) {
    let (layout, state, memory) = (model.layout, &mut *model.state, &mut *model.memory);
    let (n, nc) = (layout.n_dofs, layout.n_coords);
    memory.way.resize(n * state.n_samples, 0.0);
    for t in 0..state.n_samples {
        for m in &layout.movers {
            let coords = t * nc + m.coord..t * nc + m.coord + m.n_coords;
            let way = &mut memory.way[t * n + m.dof..t * n + m.dof + m.n_dofs];
            difference_joint(&m.motion, &memory.safe[coords.clone()], &memory.reached[coords], way);
            way.iter_mut().for_each(|w| *w *= part);
        }
    }
    state.step(layout, &memory.safe, &memory.way);
}
