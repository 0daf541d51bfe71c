//! The straight way: every key solved as a single pose, and interpolation between them.

use std::collections::BTreeSet;
use std::ops::Range;

use glam::DVec3;
use ikiru_rig::{Clip, ClipError, Pose};
use ikiru_scenario::{MotionSettings, Scenario, ScenarioObjective};
use ikiru_solve::{Invalid, Method, Solver, SolverOptions, Timeline, When, Workspace};
use toml::{Table, Value};

use super::source::MotionSource;
use crate::error::Error;

/// The keys of a motion, each as a scenario of a single pose.
#[derive(Debug)]
pub(super) struct Straight {
    timeline: Timeline,
    /// The first pose, and the last where it is given.
    start: Pose,
    end: Option<Pose>,
    keys: Vec<Key>,
}

/// A time at which an objective holds that holds at no other.
#[derive(Debug)]
struct Key {
    sample: usize,
    /// With `lm`, whatever the motion is planned with.
    solver: Solver,
    scenario: Scenario,
}

impl Straight {
    /// What a scenario with `[motion]` asks for at each of its keys: the objectives of that time, and those over
    /// spans around it.
    pub(super) fn new(
        source: &MotionSource,
        scenario: &Scenario,
        settings: &MotionSettings,
    ) -> Result<Self, Error> {
        let timeline = settings.timeline;
        let end_sample = timeline.n_samples() - 1;
        let is_free = |sample: &usize| {
            (*sample > 0 || !settings.fixed_start) && (*sample < end_sample || settings.end.is_none())
        };
        let mut keys = Vec::new();
        for sample in key_samples(&scenario.objectives, &timeline).into_iter().filter(is_free) {
            let text = at_sample(source, scenario, &timeline, sample)?;
            let scenario = Scenario::parse(&text, &source.file, &source.folder)?;
            let solver = Solver::new(SolverOptions { method: Method::Lm, ..*scenario.solver.options() });
            keys.push(Key { sample, solver, scenario });
        }
        Ok(Self { timeline, start: scenario.start.clone(), end: settings.end.clone(), keys })
    }

    /// Memory for every key.
    pub(super) fn workspaces(&self) -> Vec<Workspace> {
        self.keys.iter().map(|key| key.solver.workspace(&key.scenario.problem)).collect()
    }

    /// The motion: from the start through the keys to the end, if that is given; else it stays at the last key.
    pub(super) fn clip(&self, workspaces: &mut [Workspace]) -> Result<Clip, Invalid> {
        const DIFFERENT: Invalid = Invalid::Pose("does not fit the rig of a key");
        let (mut samples, mut poses) = (vec![0], vec![self.start.clone()]);
        let mut before = self.start.clone();
        for (key, workspace) in self.keys.iter().zip(workspaces) {
            // Each key has read the rig anew: its poses have the same numbers, but belong to another.
            let mut pose = Pose::from_coords(&key.scenario.rig, before.coords()).map_err(|_| DIFFERENT)?;
            let report = key.solver.solve(&key.scenario.problem, &mut pose, workspace);
            if let Some(invalid) = report.invalid {
                return Err(invalid);
            }
            before = Pose::from_coords(self.start.rig(), pose.coords()).map_err(|_| DIFFERENT)?;
            if key.sample == 0 {
                // The start is free, and a key is there.
                poses[0] = before.clone();
            } else {
                samples.push(key.sample);
                poses.push(before.clone());
            }
        }
        if let Some(end) = &self.end {
            samples.push(self.timeline.n_samples() - 1);
            poses.push(end.clone());
        }
        let through = samples.iter().map(|sample| self.timeline.time(*sample)).collect();
        let between = |_: ClipError| Invalid::Pose("is at the time of another");
        let keys = Clip::new("straight", through, poses).map_err(between)?;
        let times = self.timeline.times();
        let poses = times.iter().map(|secs| keys.sample(*secs)).collect();
        Clip::new("straight", times, poses).map_err(between)
    }
}

/// The samples at which an objective holds.
pub(super) fn samples_of(when: When, timeline: &Timeline) -> Range<usize> {
    // The scenario was read: its times are on the timeline.
    when.samples(timeline).unwrap_or_default()
}

/// The samples of objectives that hold at one time alone.
fn key_samples(objectives: &[ScenarioObjective], timeline: &Timeline) -> BTreeSet<usize> {
    let is_key = |o: &&ScenarioObjective| matches!(o.when, When::At(_) | When::End);
    objectives.iter().filter(is_key).map(|o| samples_of(o.when, timeline).start).collect()
}

/// The scenario of the pose at one sample: what one would write for `ikiru solve`.
fn at_sample(
    source: &MotionSource,
    scenario: &Scenario,
    timeline: &Timeline,
    sample: usize,
) -> Result<String, Error> {
    let odd = Error::Task("a scenario that was read cannot be taken apart");
    // Both were read from the same text, so that neither of these fails.
    let Ok(mut table) = source.text.parse::<Table>() else { return Err(odd) };
    table.remove("motion");
    let Some(Value::Array(all)) = table.remove("objective") else { return Err(odd) };
    let mut holding = Vec::new();
    for (mut value, objective) in all.into_iter().zip(&scenario.objectives) {
        if !samples_of(objective.when, timeline).contains(&sample) {
            continue;
        }
        if let Value::Table(entry) = &mut value {
            for key in ["at", "from", "to", "path"] {
                entry.remove(key);
            }
            if let Some(path) = &objective.path {
                let point = path.at(timeline.time(sample));
                entry.insert("target".to_owned(), vector(scenario.world_from_targets().inverse() * point));
            }
        }
        holding.push(value);
    }
    table.insert("objective".to_owned(), Value::Array(holding));
    toml::to_string(&table).map_err(|_| odd)
}

fn vector(point: DVec3) -> Value {
    Value::Array(point.to_array().map(Value::Float).to_vec())
}
