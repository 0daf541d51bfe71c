//! What came of each term: filled in sample by sample; a pose is one sample.

use crate::layout::{Layout, TermLayout};
use crate::problem::motion::MotionProblem;
use crate::problem::term::Term;
use crate::problem::{Problem, Terms};
use crate::report::{PartReport, PartReports, TermReport, TermTimes};
use crate::state::State;
use crate::state::motion::MotionState;
use crate::words::Unit;

/// Writes what came of the terms of a pose, as its state holds it: evaluated last.
pub(crate) fn report_pose(
    layout: &Layout,
    problem: &Problem,
    state: &mut State,
    reports: &mut Vec<TermReport>,
) {
    let has_warned = state.memory.warning.take().is_some();
    reports.clear();
    reports.extend(layout.terms.iter().map(|t| {
        let mut report = begin(layout, &problem.terms()[t.term], t, None);
        add(&mut report, layout, problem, state, t, has_warned, None);
        report
    }));
}

/// Writes what came of the terms of a motion, as its state holds it: evaluated last.
pub(crate) fn report_motion(
    layout: &Layout,
    motion: &MotionProblem,
    state: &mut MotionState,
    reports: &mut Vec<TermReport>,
) {
    let timeline = motion.timeline();
    reports.clear();
    reports.extend(layout.terms.iter().map(|t| {
        let samples = &motion.tracks()[t.term].samples;
        let (from_secs, to_secs) = (timeline.time(samples.start), timeline.time(samples.end - 1));
        let times = TermTimes { from_secs, to_secs, worst_secs: from_secs };
        begin(layout, &motion.terms().terms()[t.term], t, Some(times))
    }));
    state.visit_held(layout, motion, |state, terms, sample| {
        let has_warned = state.memory.warning.take().is_some();
        for (t, report) in layout.terms.iter().zip(&mut *reports).filter(|(t, _)| terms.is_on(t.term)) {
            add(report, layout, terms, state, t, has_warned, Some(timeline.time(sample)));
        }
    });
}

/// The report of a term of which no sample was seen yet.
fn begin(layout: &Layout, term: &Term, t: &TermLayout, times: Option<TermTimes>) -> TermReport {
    let mut units = layout.reported_parts(t).map(|part| layout.parts[part].unit);
    let unit = units.next().unwrap_or(Unit::Metres);
    let mut others = PartReports::NONE;
    units.for_each(|unit| others.push(PartReport { unit, ..PartReport::ZERO }));
    TermReport {
        key: term.key,
        kind: term.objective.kind(),
        joint: t.joint,
        weight: term.weight,
        residual: 0.0,
        unit,
        least: None,
        others,
        cost: 0.0,
        satisfied: true,
        mandatory: term.counts(),
        hard: term.hard,
        times,
        warning: None,
    }
}

/// Adds what a term misses and costs at one sample, which is at this time. The state was evaluated there, with the terms
/// that are on; `has_warned` says that one of them found something odd on the way.
fn add(
    report: &mut TermReport,
    layout: &Layout,
    terms: &impl Terms,
    state: &mut State,
    t: &TermLayout,
    has_warned: bool,
    secs: Option<f64>,
) {
    let term = terms.term(t.term);
    // Which one it was, and whether that is so now, is asked only where something was.
    if !term.is_on || has_warned {
        let failure = state.memory.failure;
        state.measure::<false>(layout, terms.objective(t.term), t);
        report.warning = report.warning.or(state.memory.warning.take());
        // Nothing is solved any more that could fail.
        state.memory.failure = failure;
    }
    let costs = term.is_on && !term.hard;
    for (idx, part) in layout.reported_parts(t).enumerate() {
        let (square, here) = (state.squares[part], state.least(layout, part));
        let length = square.sqrt();
        if costs {
            report.cost += term.weight * term.loss.cost(square);
        }
        report.satisfied &= length <= term.tolerance.of(layout.parts[part].unit);
        let (residual, least) = match idx.checked_sub(1).map(|other| &mut report.others[other]) {
            Some(other) => (&mut other.residual, &mut other.least),
            None => (&mut report.residual, &mut report.least),
        };
        let is_least = here.is_some_and(|here| least.is_none_or(|least| here < least));
        if is_least {
            *least = here;
        }
        // A bound that is kept at all samples is worst where the least is left of it.
        if length > *residual || (is_least && *residual == 0.0) {
            *residual = length;
            if idx == 0
                && let (Some(times), Some(secs)) = (&mut report.times, secs)
            {
                times.worst_secs = secs;
            }
        }
    }
    if costs && t.has_potential {
        report.cost += term.weight * state.values[t.term];
    }
}
