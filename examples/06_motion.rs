//! A motion: the hand passes a point after one second and ends at another, in one smooth movement.
//!
//! `cargo run --release -p ikiru --example 06_motion`
#![allow(clippy::print_stdout, reason = "an example talks by printing")]

use ikiru::{
    Clip, DVec3, MotionProblem, MotionWorkspace, Position, Solver, SolverOptions, Timeline, When, formats,
};

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let loaded = formats::read("builtin:human")?;
    let rig = &loaded.rig;
    let hand = rig.joint("leftHand")?;
    // Two seconds at 30 samples a second. Differences between samples cost: speed, acceleration, jerk.
    let mut motion =
        MotionProblem::new(rig, rig.chain("leftShoulder", "leftHand")?, Timeline::seconds(2.0, 30.0)?)?;
    motion.set_smoothness([0.001, 0.01, 0.01])?;
    motion.fix_start(&rig.rest_pose())?;
    motion.set_at_rest(true, true);
    motion.add(10.0, When::At(1.0), Position::new(hand, DVec3::new(0.45, 1.35, 0.35)))?;
    let end = motion.add(10.0, When::End, Position::new(hand, DVec3::new(0.20, 1.20, 0.40)))?;

    let solver = Solver::new(SolverOptions { max_iterations: 100, ..SolverOptions::default() });
    let mut workspace = MotionWorkspace::default();
    let still = Clip::still(rig.rest_pose()).with_name("reach");
    let planned = solver.plan(&motion, &still, &mut workspace).into_owned(); // the workspace is needed again
    println!(
        "{}: {} samples, cost {:.2e}, {} iterations, the hand travels {:.2} m",
        planned.report.stop.name(),
        planned.clip.poses().len(),
        planned.report.cost,
        planned.report.iterations,
        planned.clip.path_length(hand)?,
    );

    // The target moves: the motion at hand is a warm start.
    motion[end].target.y += 0.05;
    let again = solver.plan(&motion, &planned.clip, &mut workspace);
    println!("{}: replanned in {} iterations", again.report.stop.name(), again.report.iterations);

    let path = std::env::temp_dir().join("ikiru-motion.glb");
    formats::save(&path, &formats::write_animated_glb(&loaded, &again.clip)?)?;
    println!("wrote {}", path.display());
    Ok(())
}
