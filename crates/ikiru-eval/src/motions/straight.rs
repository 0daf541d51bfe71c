//! The straight way: every key solved as a single pose, and interpolation between them.

use std::collections::BTreeSet;
use std::ops::Range;

use ikiru_rig::{Clip, ClipError, Pose};
use ikiru_scenario::{MotionScenario, MotionSettings, ScenarioObjective};
use ikiru_solve::{Invalid, InvalidPose, Method, Problem, Solver, SolverOptions, Timeline, When, Workspace};

/// The keys of a motion, each as a problem of a single pose.
#[derive(Debug)]
pub(super) struct Straight {
    timeline: Timeline,
    /// The first pose, and the last where it is given.
    start: Pose,
    end: Option<Pose>,
    /// With `lm`, whatever the motion is planned with.
    solver: Solver,
    keys: Vec<Key>,
}

/// A time at which an objective holds that holds at no other.
#[derive(Debug)]
struct Key {
    sample: usize,
    problem: Problem,
}

impl Straight {
    /// What a motion asks for at each of its keys: the objectives of that time, and those over spans around it.
    pub(super) fn new(motion: &MotionScenario, settings: &MotionSettings) -> Self {
        let timeline = settings.timeline;
        let end_sample = timeline.n_samples() - 1;
        let is_free = |sample: &usize| {
            (*sample > 0 || !settings.fixed_start) && (*sample < end_sample || settings.end.is_none())
        };
        let samples = key_samples(&motion.objectives, &timeline);
        let keys = samples.into_iter().filter(is_free);
        Self {
            timeline,
            start: motion.start.clone(),
            end: settings.end.clone(),
            solver: Solver::new(SolverOptions { method: Method::Lm, ..*motion.solver.options() }),
            keys: keys.map(|sample| Key { sample, problem: motion.motion.at(sample) }).collect(),
        }
    }

    /// Memory for every key.
    pub(super) fn workspaces(&self) -> Vec<Workspace> {
        self.keys.iter().map(|key| self.solver.workspace(&key.problem)).collect()
    }

    /// The motion: from the start through the keys to the end, if that is given; else it stays at the last key.
    pub(super) fn clip(&self, workspaces: &mut [Workspace]) -> Result<Clip, Invalid> {
        let (mut samples, mut poses) = (vec![0], vec![self.start.clone()]);
        let mut pose = self.start.clone();
        for (key, workspace) in self.keys.iter().zip(workspaces) {
            let report = self.solver.solve(&key.problem, &mut pose, workspace);
            if let Some(invalid) = report.invalid {
                return Err(invalid);
            }
            if key.sample == 0 {
                // The start is free, and a key is there.
                poses[0] = pose.clone();
            } else {
                samples.push(key.sample);
                poses.push(pose.clone());
            }
        }
        let last = self.timeline.n_samples() - 1;
        if let Some(end) = self.end.as_ref().filter(|_| samples.last() != Some(&last)) {
            samples.push(last);
            poses.push(end.clone());
        }
        let through = samples.iter().map(|sample| self.timeline.time(*sample)).collect();
        // Samples increase, so that only rigs can differ.
        let between = |_: ClipError| Invalid::Pose(InvalidPose::OtherRig);
        let keys = Clip::new("straight", through, poses).map_err(between)?;
        let times = self.timeline.times();
        let poses = times.iter().map(|secs| keys.sample(*secs)).collect();
        Clip::new("straight", times, poses).map_err(between)
    }
}

/// The samples of the timeline at which an objective holds.
pub(super) fn samples_of(when: When, timeline: &Timeline) -> Range<usize> {
    // The scenario was read: its times are on the timeline.
    when.samples(timeline).unwrap_or_default()
}

/// The samples of objectives that hold at one time alone.
fn key_samples(objectives: &[ScenarioObjective], timeline: &Timeline) -> BTreeSet<usize> {
    let is_key = |o: &&ScenarioObjective| matches!(o.when, When::At(_) | When::End);
    objectives.iter().filter(is_key).map(|o| samples_of(o.when, timeline).start).collect()
}
