//! Follows a course and measures.

use std::time::Instant;

use glam::DVec3;
use ikiru_rig::{JointId, Pose};
use ikiru_solve::objectives::{PoseTarget, Position, RestPose};
use ikiru_solve::{Problem, Solver, SolverOptions, TermId};
use serde::Serialize;

use crate::error::Error;
use crate::track::course::{Course, largest_turn};

/// How near a position must be, metres, and a rotation, radians.
const BAR: (f64, f64) = (1e-3, 0.5 * std::f64::consts::PI / 180.0);
/// How far outside a limit still counts as inside (radians).
const LIMIT_SLACK: f64 = 1e-9;
/// Weight of the pull to the rest pose, by which what the targets leave open is settled.
const REST: f64 = 1e-4;

/// What a run leaves open.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Settings {
    /// How often each course is followed; the least time of a frame counts. 1 by default.
    pub runs: usize,
    /// The solver's options; its defaults by default.
    pub options: SolverOptions,
}

impl Default for Settings {
    fn default() -> Self {
        Self { runs: 1, options: SolverOptions::default() }
    }
}

/// One frame.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Row {
    /// The course.
    pub course: String,
    /// Frames a second.
    pub rate_hz: f64,
    /// Which frame, from 0.
    pub frame: usize,
    /// Whether its targets can be met.
    pub can_be_met: bool,
    /// Whether every target is met within 1 mm and 0.5°, and all limits hold; recomputed from the pose.
    pub success: bool,
    /// The largest distance from a target, metres.
    pub position_error: f64,
    /// The largest angle from a target, radians.
    pub rotation_error: f64,
    /// Iterations.
    pub iterations: usize,
    /// The solve alone, microseconds.
    pub time_us: f64,
    /// The largest turn of a joint since the frame before, radians, the root of the body aside.
    pub turn: f64,
    /// The largest such turn in the motion that the targets were read off, in all of it.
    pub own_turn: f64,
}

/// One target of a problem.
#[derive(Clone, Copy, Debug)]
enum Target {
    Pose(TermId<PoseTarget>),
    Position(TermId<Position>),
}

/// Follows a course from the pose of its first frame, each frame from the pose before. `done` is called after each.
///
/// # Errors
/// A course whose frames do not fit its rig.
pub fn run(course: &Course, settings: &Settings, mut done: impl FnMut()) -> Result<Vec<Row>, Error> {
    let rig = course.start.rig();
    let mut problem = Problem::whole_body(rig);
    let targets: Vec<Target> =
        course.targets.iter().map(|(joint, turns)| add(&mut problem, *joint, *turns)).collect();
    let joints: Vec<JointId> = problem.active().filter(|joint| Some(*joint) != rig.floating_root()).collect();
    let rest = problem.add(REST, RestPose::new(&joints, course.rest.clone()));
    problem.term_mut(rest).mandatory = false;
    let solver = Solver::new(settings.options);
    let mut rows: Vec<Row> = Vec::with_capacity(course.frames.len());
    for number in 0..settings.runs.max(1) {
        let mut workspace = solver.workspace(&problem);
        let (mut pose, mut before) = (course.start.clone(), course.start.clone());
        for (frame, wanted) in course.frames.iter().enumerate() {
            for (target, to) in targets.iter().zip(wanted) {
                match target {
                    Target::Pose(id) => {
                        let target = &mut problem[*id];
                        (target.position, target.rotation) = (to.position, to.rotation);
                    }
                    Target::Position(id) => problem[*id].target = to.position,
                }
            }
            let begin = Instant::now();
            let iterations = solver.solve(&problem, &mut pose, &mut workspace).iterations;
            let time_us = begin.elapsed().as_secs_f64() * 1e6;
            if number > 0 {
                rows[frame].time_us = rows[frame].time_us.min(time_us);
            } else {
                let judged = judge(course, frame, &pose)?;
                let turn = largest_turn(rig, &before, &pose)?;
                rows.push(Row { iterations, time_us, turn, ..judged });
            }
            before.clone_from(&pose);
            done();
        }
    }
    Ok(rows)
}

fn add(problem: &mut Problem, joint: JointId, turns: bool) -> Target {
    if turns {
        Target::Pose(problem.add(1.0, PoseTarget::new(joint, DVec3::ZERO, glam::DQuat::IDENTITY)))
    } else {
        Target::Position(problem.add(1.0, Position::new(joint, DVec3::ZERO)))
    }
}

fn judge(course: &Course, frame: usize, pose: &Pose) -> Result<Row, Error> {
    let (mut position_error, mut rotation_error) = (0.0_f64, 0.0_f64);
    for ((joint, turns), to) in course.targets.iter().zip(&course.frames[frame]) {
        let found = pose.frame(*joint).map_err(Error::course)?;
        position_error = position_error.max(found.position.distance(to.position));
        if *turns {
            let turn = found.rotation.inverse() * to.rotation;
            rotation_error = rotation_error.max(2.0 * turn.xyz().length().atan2(turn.w.abs()));
        }
    }
    let within = position_error <= BAR.0 && rotation_error <= BAR.1;
    Ok(Row {
        course: course.name.clone(),
        rate_hz: course.rate_hz,
        frame,
        can_be_met: course.can_be_met[frame],
        success: within && pose.limit_violation() <= LIMIT_SLACK,
        position_error,
        rotation_error,
        iterations: 0,
        time_us: 0.0,
        turn: 0.0,
        own_turn: course.own_turn,
    })
}
