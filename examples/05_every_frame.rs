//! Every frame: start from the last pose, keep a time budget, allocate nothing.
//!
//! `cargo run --release -p ikiru --example 05_every_frame`
#![allow(clippy::print_stdout, reason = "an example talks by printing")]

use std::time::{Duration, Instant};

use ikiru::{DVec3, Direction, Position, Problem, RestPose, Solver, SolverOptions, formats};

const FRAMES: usize = 1000;

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let loaded = formats::read("builtin:human")?;
    let rig = &loaded.rig;
    let hand = rig.joint("leftHand")?;
    let arm = rig.chain("leftShoulder", "leftHand")?;
    let mut problem = Problem::new(rig, arm.iter().copied())?;
    let reach = problem.add(1.0, Position::new(hand, DVec3::ZERO));
    problem.add(0.01, Direction::new(hand, DVec3::NEG_Y, DVec3::NEG_Y));
    problem.add(1e-5, RestPose::new(&arm, rig.rest_pose()));

    // Search::Local, the default: the answer stays near the last one, so nothing jumps.
    let budget = Duration::from_micros(500);
    let solver = Solver::new(SolverOptions { max_time: Some(budget), ..SolverOptions::default() });
    let mut workspace = solver.workspace(&problem);
    let mut pose = rig.rest_pose();
    let mut before = pose.clone();
    let (mut times, mut n_reached, mut largest_turn) = (Vec::with_capacity(FRAMES), 0, 0.0_f64);
    for frame in 0..FRAMES {
        let angle = frame as f64 / 90.0 * std::f64::consts::TAU; // 90 frames a round
        let begin = Instant::now();
        problem[reach].target = DVec3::new(0.3 + 0.1 * angle.cos(), 1.15 + 0.1 * angle.sin(), 0.3);
        let report = solver.solve(&problem, &mut pose, &mut workspace); // nothing allocates in here
        times.push(begin.elapsed());
        n_reached += usize::from(report.success);
        if frame > 0 {
            for &joint in &arm {
                let turn = pose.rotation(joint)?.angle_between(before.rotation(joint)?);
                largest_turn = largest_turn.max(turn);
            }
        }
        before.clone_from(&pose);
    }
    times.sort_unstable();
    let at = |part: f64| times[((FRAMES - 1) as f64 * part) as usize];
    println!("{n_reached} of {FRAMES} frames reached, none with more than {budget:?} to spend");
    println!("time of a frame: median {:?}, 99 % below {:?}, slowest {:?}", at(0.5), at(0.99), at(1.0));
    println!("largest turn of a joint between two frames: {:.2} degrees", largest_turn.to_degrees());
    Ok(())
}
