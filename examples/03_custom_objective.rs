//! An objective of your own: the residual is written once, its derivatives come by themselves.
//!
//! `cargo run --release -p ikiru --example 03_custom_objective`
#![allow(clippy::print_stdout, reason = "an example talks by printing")]

use ikiru::solve::check_jacobian;
use ikiru::{DVec3, Frame, JointId, Position, Problem, Residual, Scalar, Solver, formats};

/// Keeps two joints a given distance (metres) apart.
#[derive(Clone, Debug)]
struct KeepApart {
    joints: [JointId; 2],
    distance: f64,
}

impl Residual for KeepApart {
    fn joints(&self) -> &[JointId] {
        &self.joints
    }

    fn evaluate<S: Scalar>(&self, frames: &[Frame<S>], residual: &mut [S]) {
        residual[0] = frames[0].origin.distance(frames[1].origin) - S::from(self.distance);
    }

    fn kind(&self) -> &'static str {
        "keep_apart"
    }
}

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let loaded = formats::read("builtin:human")?;
    let rig = &loaded.rig;
    let (left, right) = (rig.joint("leftHand")?, rig.joint("rightHand")?);
    let mut joints = rig.chain("leftShoulder", "leftHand")?;
    joints.extend(rig.chain("rightShoulder", "rightHand")?);

    // The left hand moves; the right one follows at an arm's width, as if both held one box.
    let mut problem = Problem::new(rig, joints)?;
    let lead = problem.add(1.0, Position::new(left, DVec3::ZERO));
    let apart = problem.add(1.0, KeepApart { joints: [left, right], distance: 0.3 });
    check_jacobian(&problem, &rig.rest_pose(), 1e-6)?; // worth a line in your tests

    let solver = Solver::default();
    let mut workspace = solver.workspace(&problem);
    let mut pose = rig.rest_pose();
    for width in [0.5, 0.3, 0.1] {
        problem[lead].target = DVec3::new(0.5 * width, 1.1, 0.4);
        problem[apart].distance = width;
        let report = solver.solve(&problem, &mut pose, &mut workspace);
        let found = pose.frame(left)?.position.distance(pose.frame(right)?.position);
        println!(
            "{width} m apart: {} at {found:.4} m after {} iterations",
            report.stop.name(),
            report.iterations
        );
    }
    Ok(())
}
