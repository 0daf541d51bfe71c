//! A motion whose duration is free: slowed down where limits on speed and acceleration ask for it.

use ikiru_rig::{Clip, RateExcess};

use crate::front::course::Told;
use crate::method::Budget;
use crate::method::limited::exceeded;
use crate::problem::motion::MotionProblem;
use crate::report::map_times;

/// By how much more than needed a motion is slowed down, and how many times as long it may become.
const SPARE: f64 = 1e-6;
const MOST_STRETCH: f64 = 1000.0;

/// Gives the poses of a clip later times, where limits on rates ask for it, and the times of what is told with them; the
/// answer is the limits that cannot be kept at any tempo. Where a budget is used up, it is slowed down as a whole: that is measured
/// before and after, and nothing else is.
pub(super) fn slow_down(
    motion: &MotionProblem,
    clip: &mut Clip,
    told: &mut Told,
    budget: &Budget<'_>,
) -> Vec<RateExcess> {
    let limits = motion.rate_limits();
    let excess = exceeded(motion, clip);
    if excess.is_empty() {
        return excess;
    }
    let may_go_on = || budget.stop().is_none();
    let retimed = if may_go_on() {
        clip.retime_while(limits, 1.0 / motion.timeline().step_secs(), may_go_on).ok()
    } else {
        None
    };
    let later = |secs: f64| retimed.as_ref().map_or(secs, |retimed| retimed.at(secs));
    // The curve through these poses is not quite the one that was slowed down. What is still exceeded, and what
    // could not be retimed, is slowed down as a whole, under which speeds and accelerations fall as they should.
    let mut stretch = 1.0;
    let slowed = |stretch: f64| {
        let times = clip.times().iter().map(|secs| stretch * later(*secs)).collect();
        Clip::new(clip.name(), times, clip.poses().to_vec()).unwrap_or_else(|_| clip.clone())
    };
    let mut slow = slowed(stretch);
    let mut left = if retimed.is_some() { exceeded(motion, &slow) } else { excess.clone() };
    if !left.is_empty() {
        stretch = left.iter().map(RateExcess::needed_stretch).fold(1.0, f64::max) * (1.0 + SPARE);
        if stretch < MOST_STRETCH {
            slow = slowed(stretch);
            left = exceeded(motion, &slow);
        }
    }
    if !left.is_empty() {
        // What a cone stops at once is stopped at once at any tempo.
        return excess;
    }
    map_times(&mut told.terms, &mut told.explainer.forces, |secs| stretch * later(secs));
    *clip = slow;
    left
}
