//! Reach: load a character, bring its hand to a point, save it posed and skinned.
//!
//! `cargo run --release -p ikiru --example 01_reach [character.glb [out.glb]]`
#![allow(clippy::print_stdout, reason = "an example talks by printing")]

use ikiru::{DVec3, Position, Problem, Solver, formats};

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let args: Vec<String> = std::env::args().collect();
    let out = args.get(2).map_or_else(|| std::env::temp_dir().join("ikiru-reach.glb"), Into::into);

    let loaded = formats::read(args.get(1).map_or("builtin:human", String::as_str))?;
    let rig = &loaded.rig;
    let hand = rig.joint("leftHand")?;
    let mut problem = Problem::new(rig, rig.chain("leftShoulder", "leftHand")?)?;
    let reach = problem.add(1.0, Position::new(hand, DVec3::new(0.35, 1.1, 0.35)));

    let solver = Solver::default();
    let mut workspace = solver.workspace(&problem);
    let mut pose = rig.rest_pose();
    let report = solver.solve(&problem, &mut pose, &mut workspace);
    let mm = report[reach].residual * 1e3;
    println!("{} after {} iterations, {mm:.4} mm from the target", report.stop.name(), report.iterations);

    formats::save(&out, &formats::write_posed_glb(&loaded, &pose)?)?;
    println!("wrote {}", out.display());
    Ok(())
}
