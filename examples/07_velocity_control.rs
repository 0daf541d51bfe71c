//! A method of one's own: an arm led by velocities, each tick a small quadratic program over what `Evaluation` says.
//!
//! `cargo run --release -p ikiru --example 07_velocity_control`
#![allow(clippy::print_stdout, reason = "an example talks by printing")]

use ikiru::{DVec3, Evaluation, Orientation, Position, Problem, formats};

/// Seconds a tick.
const TICK: f64 = 0.01;
/// The joints' largest speed, radians a second.
const MOST_SPEED: f64 = 1.0;
/// How much of what is missed is to be made good a second.
const GAIN: f64 = 10.0;
/// What keeps joints slow where the hand does not need them.
const DAMPING: f64 = 1e-4;

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let rig = formats::read("builtin:panda")?.rig;
    let hand = rig.joint("panda_hand")?;
    let mut pose = rig.rest_pose();
    pose.project();
    let mut problem = Problem::whole_body(&rig);
    let start = pose.frame(hand)?;
    let reach = problem.add(1.0, Position::new(hand, start.position));
    problem.add(0.1, Orientation::new(hand, start.rotation));
    let mut evaluation = Evaluation::default();
    let (n, mut velocity) = (rig.n_dofs(), vec![0.0; rig.n_dofs()]);
    for tick in 0..=600 {
        let angle = f64::from(tick) * TICK;
        problem[reach].target = start.position + 0.1 * DVec3::new(angle.cos() - 1.0, angle.sin(), 0.0);
        evaluation.at(&problem, &pose)?;
        // Least of Σ w (J v + gain r)² + damping v², every v within its speed and what its limit leaves of it: one v after
        // the other, each to its best value (Gauss and Seidel), until nothing changes.
        for _ in 0..200 {
            for &k in evaluation.moving() {
                let (mut slope, mut bend) = (DAMPING * velocity[k], DAMPING);
                for (number, row) in evaluation.rows().iter().enumerate() {
                    let (j, weight) = (evaluation.jacobian(number), row.weight.unwrap_or(0.0));
                    let along: f64 = (0..n).map(|l| j[l] * velocity[l]).sum();
                    slope += weight * j[k] * (along + GAIN * row.residual);
                    bend += weight * j[k] * j[k];
                }
                velocity[k] = (velocity[k] - slope / bend).clamp(-MOST_SPEED, MOST_SPEED);
            }
        }
        let step: Vec<f64> = velocity.iter().map(|v| v * TICK).collect();
        pose.retract(&step)?;
        pose.project(); // what a limit stops, it stops
        if tick % 100 == 0 {
            let off = evaluation.terms()[0].residual * 1e3;
            let fastest = velocity.iter().fold(0.0_f64, |a, v| a.max(v.abs()));
            println!(
                "{:.1} s: {off:5.1} mm behind, fastest joint {fastest:.2} rad/s",
                f64::from(tick) * TICK
            );
        }
    }
    Ok(())
}
