//! Many targets: a thousand positions that cannot all be met, over one arm and over the whole human. One iteration of a single
//! start.
#![allow(
    missing_docs,
    clippy::expect_used,
    reason = "a bench: its macros make undocumented items, and a bench that cannot start ends"
)]

use std::time::{Duration, Instant};

use criterion::{Criterion, criterion_group, criterion_main};
use ikiru::glam::DVec3;
use ikiru::solve::objectives::Position;
use ikiru::solve::{Problem, Solver, SolverOptions};
use ikiru::{JointId, formats};

/// Numbers from 0 to 1 (the powers of the plastic number fill a cube evenly).
fn spread(idx: usize, axis: i32) -> f64 {
    (0.5 + (idx + 1) as f64 * 1.220_744_084_605_76_f64.powi(-axis - 1)).fract()
}

fn bench(c: &mut Criterion) {
    let rig = formats::read("builtin:human").expect("the rig is built in").rig;
    let arm = ["leftShoulder", "leftUpperArm", "leftLowerArm", "leftHand"];
    let arm: Vec<JointId> = arm.map(|name| rig.joint(name).expect("the human has all roles")).to_vec();
    for (name, active) in [("an arm, 12", arm), ("all of it, 159", rig.ids().collect())] {
        let mut problem = Problem::new(&rig, active).expect("joints of the rig");
        for idx in 0..1000 {
            let joint = JointId::from_index(2 + idx % (rig.n_joints() - 2));
            let target = DVec3::new(spread(idx, 0) - 0.5, 1.8 * spread(idx, 1), spread(idx, 2) - 0.4);
            problem.add(1.0, Position::new(joint, target));
        }
        let solver = Solver::new(SolverOptions { max_iterations: 10, ..SolverOptions::default() });
        let mut workspace = solver.workspace(&problem);
        c.bench_function(&format!("1000 positions, {name} degrees of freedom, one iteration"), |b| {
            b.iter_custom(|n| {
                let (mut spent, mut iterations) = (Duration::ZERO, 0);
                while iterations < n {
                    let mut pose = rig.rest_pose();
                    let start = Instant::now();
                    iterations += solver.solve(&problem, &mut pose, &mut workspace).iterations as u64;
                    spent += start.elapsed();
                }
                spent.mul_f64(n as f64 / iterations as f64)
            });
        });
    }
}

criterion_group!(benches, bench);
criterion_main!(benches);
