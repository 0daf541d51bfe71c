//! Limits in code: a cone for the upper arm, angle ranges for the elbow. They hold at every step of a solve.
//!
//! `cargo run --release -p ikiru --example 04_limits`
#![allow(clippy::print_stdout, reason = "an example talks by printing")]

use ikiru::{
    Cone, DVec3, EulerOrder, JointMotion, Position, Problem, Range, Search, Solver, SolverOptions, formats,
};

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let loaded = formats::read("builtin:human")?;
    let free = &loaded.rig;
    let (upper_arm, elbow) = (free.joint("leftUpperArm")?, free.joint("leftLowerArm")?);

    // A rig never changes: a builder makes another one of it.
    let mut builder = free.to_builder();
    let swing = [100_f64.to_radians(), 90_f64.to_radians()];
    let cone = Cone::new(DVec3::X, swing, Range::degrees(-60.0, 60.0))?;
    builder.set_motion(upper_arm, JointMotion::Ball { cone: Some(cone) })?;
    // This elbow bends forward about -y; it turns the forearm about x and bends nowhere else.
    let ranges = [Range::degrees(-80.0, 80.0), Range::degrees(-145.0, 0.0), Range::degrees(0.0, 0.0)];
    builder.set_motion(elbow, JointMotion::Euler { order: EulerOrder::Zyx, ranges })?;
    let limited = builder.build()?;

    let search = Search::Global { max_restarts: 32 };
    let solver = Solver::new(SolverOptions { search, ..SolverOptions::default() });
    let targets = [DVec3::new(0.3, 1.2, 0.4), DVec3::new(0.35, 1.25, -0.35)]; // in front, and behind the back
    for (name, rig) in [("without limits", free), ("with limits", &limited)] {
        let hand = rig.joint("leftHand")?;
        let mut problem = Problem::new(rig, [upper_arm, elbow])?;
        let reach = problem.add(1.0, Position::new(hand, DVec3::ZERO));
        let mut workspace = solver.workspace(&problem);
        for target in targets {
            problem[reach].target = target;
            let mut pose = rig.rest_pose();
            let report = solver.solve(&problem, &mut pose, &mut workspace);
            let mm = report[reach].residual * 1e3;
            let [x, y, z] =
                EulerOrder::Zyx.angles(pose.rotation(elbow)?).map(|a| a.to_degrees().round() + 0.0);
            let target = target.to_string();
            println!("{name:<14} {target:<20} {mm:6.2} mm away, elbow at {x}, {y}, {z} degrees");
            assert!(pose.limit_violation() < 1e-9);
        }
    }
    Ok(())
}
