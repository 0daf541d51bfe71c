//! What came of the terms of a motion.

use crate::layout::Layout;
use crate::problem::Terms;
use crate::problem::motion::MotionProblem;
use crate::problem::sample_terms::SampleTerms;
use crate::report::{PartReport, PartReports, TermReport, TermTimes};
use crate::state::State;
use crate::state::motion::MotionState;
use crate::words::Unit;

/// What came of the terms of a motion, as its state holds it: evaluated last.
pub(crate) fn report_terms(
    layout: &Layout,
    motion: &MotionProblem,
    state: &mut MotionState,
    reports: &mut Vec<TermReport>,
) {
    let timeline = motion.timeline();
    reports.clear();
    reports.extend(layout.terms.iter().map(|t| {
        let (term, samples) = (&motion.terms().terms()[t.term], &motion.tracks()[t.term].samples);
        let mut units = layout.reported_parts(t).map(|part| layout.parts[part].unit);
        let unit = units.next().unwrap_or(Unit::Metres);
        let mut others = PartReports::NONE;
        units.for_each(|unit| others.push(PartReport { unit, ..PartReport::ZERO }));
        let (from_secs, to_secs) = (timeline.time(samples.start), timeline.time(samples.end - 1));
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
            times: Some(TermTimes { from_secs, to_secs, worst_secs: from_secs }),
            warning: None,
        }
    }));
    let mut add = |state: &State, terms: &SampleTerms<'_>, sample: usize| {
        for (t, report) in layout.terms.iter().zip(&mut *reports).filter(|(t, _)| terms.is_on(t.term)) {
            let loss = terms.term(t.term).loss;
            if t.has_potential && terms.term(t.term).is_on && !t.is_hard {
                report.cost += report.weight * state.values[t.term];
            }
            for (idx, part) in layout.reported_parts(t).enumerate() {
                let length = state.squares[part].sqrt();
                if terms.term(t.term).is_on && !t.is_hard {
                    report.cost += report.weight * loss.cost(state.squares[part]);
                }
                let tolerance = motion.terms().terms()[t.term].tolerance.of(layout.parts[part].unit);
                report.satisfied &= length <= tolerance;
                let least = if idx > 0 { &mut report.others[idx - 1].least } else { &mut report.least };
                let here = state.least(layout, part);
                let is_worst = here.is_some_and(|here| least.is_none_or(|least| here < least));
                if is_worst {
                    *least = here;
                }
                if idx > 0 {
                    let other = &mut report.others[idx - 1].residual;
                    *other = other.max(length);
                } else if length > report.residual || (is_worst && report.residual == 0.0) {
                    report.residual = length;
                    if let Some(times) = &mut report.times {
                        times.worst_secs = timeline.time(sample);
                    }
                }
            }
        }
        true
    };
    state.visit_wanted(motion, &mut add);
    state.visit_settled(layout, motion, &mut add);
    state.visit_off(layout, motion, &mut add);
}
