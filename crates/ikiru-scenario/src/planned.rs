//! A scenario's motion as it was planned: at the rate that was asked for, whatever time it took.

use ikiru_rig::{Clip, RateExcess, RateLimit};
use ikiru_solve::{MotionWorkspace, PlannedMotion, Report};

use crate::motion_scenario::MotionScenario;

/// How often a motion is slowed down further, where even samples are above a limit that the planned ones keep.
const MOST_ROUNDS: usize = 16;
/// By how much more than needed it is slowed down.
const SPARE: f64 = 1e-6;

/// What came of planning a scenario with `[motion]`.
#[derive(Clone, Debug)]
#[non_exhaustive]
pub struct PlannedScenario {
    /// The poses over time, at the scenario's rate.
    pub clip: Clip,
    /// What came of it, with all times on the clip's clock.
    pub report: Report<'static>,
    /// When the samples of the timeline are in the scenario and in the clip; empty where both are the same.
    clock: Vec<(f64, f64)>,
}

impl PlannedScenario {
    /// When something is in the clip that the scenario has at a time (seconds): later where a free duration took more.
    #[must_use]
    pub fn at(&self, secs: f64) -> f64 {
        let (Some(first), Some(last)) = (self.clock.first(), self.clock.last()) else { return secs };
        let after = self.clock.partition_point(|(in_scenario, _)| *in_scenario <= secs);
        match (after.checked_sub(1).and_then(|before| self.clock.get(before)), self.clock.get(after)) {
            (Some((a, x)), Some((b, y))) => x + (y - x) * (secs - a) / (b - a),
            (None, _) => first.1 + (secs - first.0),
            (_, None) => last.1 + (secs - last.0),
        }
    }
}

impl MotionScenario {
    /// Plans from standing still at the start.
    ///
    /// An objective without a weight of the text's own is wanted within its tolerance: with [`Method::Lm`], where the bar is
    /// not a cost, its weight begins at 1 and is raised as long as that helps. Each call begins anew.
    ///
    /// Where the duration is free and limits on speed and acceleration ask for more of it, the samples of the timeline come
    /// at later and uneven times; the clip has the curve through them at as many samples a second as the scenario asks
    /// for, and keeps the limits between those as well. Where no even samples do, it has the samples themselves.
    ///
    /// [`Method::Lm`]: ikiru_solve::Method::Lm
    pub fn plan(&mut self, workspace: &mut MotionWorkspace) -> PlannedScenario {
        let PlannedMotion { clip, report, .. } = self.plan_samples(workspace);
        let clip = clip.into_owned();
        let timeline = self.motion.timeline();
        if !self.motion.has_free_duration() || clip.times() == timeline.times() || report.invalid.is_some() {
            return PlannedScenario { clip, report, clock: Vec::new() };
        }
        let rate_hz = 1.0 / timeline.step_secs();
        let (even, stretch) =
            evenly(&clip, rate_hz, self.motion.rate_limits()).unwrap_or_else(|| (clip.clone(), 1.0));
        let clock =
            timeline.times().into_iter().zip(clip.times().iter().map(|secs| stretch * secs)).collect();
        let mut report = report;
        report.map_times(|secs| stretch * secs);
        PlannedScenario { clip: even, report, clock }
    }
}

/// The clip at even samples, its last on one of them, and how many times as long it is. It keeps its limits, if it can.
fn evenly(clip: &Clip, rate_hz: f64, limits: &[RateLimit]) -> Option<(Clip, f64)> {
    let duration = clip.duration_secs();
    let mut stretch = 1.0;
    for _ in 0..MOST_ROUNDS {
        // What rounding adds to a whole number of steps is no step.
        let n_steps = (stretch * duration * rate_hz - SPARE).ceil().max(1.0);
        stretch = n_steps / rate_hz / duration;
        let times = clip.times().iter().map(|secs| stretch * secs).collect();
        let slow = Clip::new(clip.name(), times, clip.poses().to_vec()).ok()?;
        let even = slow.resample(rate_hz).ok()?;
        let exceeded = even.exceeded(limits).ok()?;
        if exceeded.is_empty() {
            return Some((even, stretch));
        }
        stretch *= exceeded.iter().map(RateExcess::needed_stretch).fold(1.0, f64::max) * (1.0 + SPARE);
    }
    None
}
