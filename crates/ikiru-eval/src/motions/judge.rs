//! Whether a motion does what its scenario asks for: every way is judged alike, frame by frame.

use ikiru_rig::{Clip, Pose};
use ikiru_scenario::Scenario;
use ikiru_solve::{Search, Solver, SolverOptions, Unit, Workspace};
use serde::Serialize;

use super::straight::samples_of;
use crate::error::Error;

/// The first mandatory objective that a motion does not meet.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Unmet {
    /// Its position in the scenario, from 1.
    pub objective: usize,
    /// Its kind, as the scenario has it.
    pub kind: &'static str,
    /// The joint that it is about; none where it names several.
    pub joint: Option<String>,
    /// The first frame at which it fails, in seconds of the motion.
    pub at_secs: f64,
    /// By how much, in `unit`.
    pub residual: f64,
    /// `m` or `rad`.
    pub unit: &'static str,
    /// How far its second part is off, for objectives that have two.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub second_residual: Option<f64>,
    /// `m` or `rad`.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub second_unit: Option<&'static str>,
}

/// A scenario, to look at poses with.
#[derive(Debug)]
pub(super) struct Judge {
    scenario: Scenario,
    /// Of each objective, whether it is judged at a frame.
    holds: Vec<Vec<bool>>,
    solver: Solver,
    workspace: Workspace,
}

impl Judge {
    /// The scenario must have a `[motion]`.
    pub(super) fn new(scenario: Scenario) -> Result<Self, Error> {
        let Some(settings) = &scenario.motion else { return Err(Error::Task("it has no [motion]")) };
        let timeline = settings.timeline;
        let n = timeline.n_samples();
        let is_given =
            |frame: usize| (frame == 0 && settings.fixed_start) || (frame + 1 == n && settings.end.is_some());
        let holds = scenario.objectives.iter().map(|objective| {
            let frames = samples_of(objective.when, &timeline);
            // As in planning: of frames that are given nobody asks more than they are, unless there is no other.
            let is_settled = frames.clone().all(is_given);
            (0..n).map(|frame| frames.contains(&frame) && (is_settled || !is_given(frame))).collect()
        });
        // Not one iteration: the report is of the pose that came in.
        let solver = Solver::new(SolverOptions {
            search: Search::Local,
            max_iterations: 0,
            ..SolverOptions::default()
        });
        Ok(Self { holds: holds.collect(), solver, workspace: scenario.workspace(), scenario })
    }

    /// The first mandatory objective that a motion, of as many frames as the timeline, does not meet. Where a pose
    /// is outside its limits, the nearest one inside is judged.
    pub(super) fn first_unmet(&mut self, clip: &Clip) -> Result<Option<Unmet>, Error> {
        let odd = Error::Task("a motion that does not fit its scenario");
        let Some(timeline) = self.scenario.motion.as_ref().map(|m| m.timeline) else { return Err(odd) };
        if clip.poses().len() != timeline.n_samples() {
            return Err(odd);
        }
        for (frame, (pose, secs)) in clip.poses().iter().zip(clip.times()).enumerate() {
            if !self.holds.iter().any(|holds| holds[frame]) {
                continue;
            }
            self.aim(timeline.time(frame))?;
            let Ok(mut pose) = Pose::from_coords(&self.scenario.rig, pose.coords()) else { return Err(odd) };
            let report = self.solver.solve(&self.scenario.problem, &mut pose, &mut self.workspace);
            if report.invalid.is_some() {
                return Err(odd);
            }
            let unmet = report
                .terms
                .iter()
                .enumerate()
                .find(|(idx, term)| self.holds[*idx][frame] && term.mandatory && !term.satisfied);
            if let Some((idx, term)) = unmet {
                return Ok(Some(Unmet {
                    objective: idx + 1,
                    kind: self.scenario.objectives[idx].kind,
                    joint: self.scenario.joint_name(idx).map(str::to_owned),
                    at_secs: *secs,
                    residual: term.residual,
                    unit: term.unit.symbol(),
                    second_residual: term.others.first().map(|part| part.residual),
                    second_unit: term.others.first().map(|part| part.unit.symbol()),
                }));
            }
        }
        Ok(None)
    }

    /// Brings targets that move to where they are at a time.
    fn aim(&mut self, secs: f64) -> Result<(), Error> {
        let targets_from_world = self.scenario.world_from_targets().inverse();
        for idx in 0..self.scenario.objectives.len() {
            if let Some(path) = &self.scenario.objectives[idx].path {
                let target = targets_from_world * path.at(secs);
                let set = self.scenario.set_target(idx, target);
                set.map_err(|_| Error::Task("a path of an objective that has no target"))?;
            }
        }
        Ok(())
    }
}

impl Unmet {
    /// `position of hand_l`, and below it `off by 12.0 mm at 1.00 s`
    pub(super) fn text(&self) -> String {
        let joint = self.joint.as_ref().map_or(String::new(), |joint| format!(" of {joint}"));
        let first = length(self.residual, self.unit);
        let second = self.second_residual.zip(self.second_unit).map(|(r, unit)| length(r, unit));
        let second = second.map_or(String::new(), |second| format!(" and {second}"));
        format!("{}{joint}\noff by {first}{second} at {:.2} s", self.kind, self.at_secs)
    }
}

fn length(residual: f64, unit: &str) -> String {
    if unit == Unit::Metres.symbol() {
        format!("{:.1} mm", 1e3 * residual)
    } else {
        format!("{:.1}°", residual.to_degrees())
    }
}
