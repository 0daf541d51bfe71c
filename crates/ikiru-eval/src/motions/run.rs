//! Gets a scenario's motion in every way, and measures it.

use std::time::{Duration, Instant};

use ikiru_rig::{Clip, JointId};
use ikiru_scenario::{MotionScenario, refusal};
use ikiru_solve::{Invalid, MotionWorkspace};

use super::judge::Judge;
use super::row::Row;
use super::source::MotionSource;
use super::straight::Straight;
use super::way::{Own, Way, limits};
use crate::error::Error;

/// A plan is not repeated any more after this much time: what takes so long needs no median.
const ENOUGH: Duration = Duration::from_secs(10);

/// What is left open.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Settings {
    /// How often each motion is planned, unless that takes more than 10 s in all; the median time counts. 5 by default.
    pub runs: usize,
}

impl Default for Settings {
    fn default() -> Self {
        Self { runs: 5 }
    }
}

/// A motion and its numbers.
#[derive(Clone, Debug)]
pub struct Outcome {
    /// How it was got.
    pub way: Way,
    /// The motion, a pose for each frame of the scenario's timeline.
    pub clip: Clip,
    /// The motion in numbers.
    pub row: Row,
}

/// Gets the motion of a scenario in every way, in the order of [`Way::ALL`]. `done` is called after each plan. The clock
/// runs around planning alone (solving and interpolating, for [`Way::Straight`]), on one thread.
///
/// # Errors
/// A scenario that is not as expected, has no `[motion]`, or cannot be planned by its method.
pub fn run(
    source: &MotionSource,
    settings: &Settings,
    mut done: impl FnMut(),
) -> Result<Vec<Outcome>, Error> {
    let scenario = source.scenario()?;
    let asked = scenario.motion.clone();
    let mut motion = scenario.into_motion()?;
    let Some(asked) = asked else { return Err(Error::Task("it has no [motion]")) };
    let straight = Straight::new(&motion, &asked);
    let mut judge = Judge::new(source.scenario()?)?;
    let own = Own {
        smoothness: asked.smoothness,
        rate_limits: asked.rate_limits,
        free_duration: asked.free_duration,
        options: *motion.solver.options(),
    };
    let path_of = motion.objectives.iter().find_map(|o| o.joint);
    let mut outcomes: Vec<Outcome> = Vec::with_capacity(Way::ALL.len());
    for way in Way::ALL {
        let plan = outcomes.iter().find(|outcome| outcome.way == Way::Plan).map(|outcome| &outcome.clip);
        let limits = plan.map_or(Vec::new(), |plan| limits(plan, &motion.active, &own.rate_limits));
        way.set(&mut motion, &own, &limits)?;
        let got = if way == Way::Straight {
            let mut workspaces = straight.workspaces();
            timed(settings.runs, &mut done, || straight.clip(&mut workspaces))
        } else {
            let mut workspace = MotionWorkspace::default();
            timed(settings.runs, &mut done, || plan_once(&motion, &mut workspace))
        };
        let refused = |invalid| {
            let reason = refusal(&motion.rig, &motion.objectives, invalid);
            Error::Plan { file: source.file.clone(), way: way.name(), reason }
        };
        let (clip, time) = got.map_err(refused)?;
        let unmet = judge.first_unmet(&clip)?;
        let (active, limits): (&[JointId], _) = (&motion.active, motion.motion.rate_limits());
        let row = Row::new(&source.name, way, &clip, active, limits, path_of, unmet, time);
        outcomes.push(Outcome { way, clip, row });
    }
    Ok(outcomes)
}

/// The samples of the timeline, whenever they come: a judge looks at those.
fn plan_once(motion: &MotionScenario, workspace: &mut MotionWorkspace) -> Result<Clip, Invalid> {
    let planned = motion.solver.plan(&motion.motion, &motion.still(), workspace);
    planned.report.invalid.map_or(Ok(planned.clip.into_owned()), Err)
}

/// What comes of a plan, the same every time, and the median of its times.
fn timed(
    runs: usize,
    done: &mut impl FnMut(),
    mut plan: impl FnMut() -> Result<Clip, Invalid>,
) -> Result<(Clip, Duration), Invalid> {
    let mut times = Vec::with_capacity(runs.max(1));
    loop {
        let begin = Instant::now();
        let clip = plan()?;
        times.push(begin.elapsed());
        done();
        if times.len() >= runs || times.iter().sum::<Duration>() > ENOUGH {
            (times.len()..runs).for_each(|_| done());
            times.sort_unstable();
            return Ok((clip, times[times.len() / 2]));
        }
    }
}
