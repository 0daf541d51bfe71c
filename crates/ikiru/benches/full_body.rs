//! A full body: every joint of the built-in human a ball, the root free, eight objectives. One iteration,
//! and one warm frame of a moving target.
#![allow(
    missing_docs,
    clippy::expect_used,
    reason = "a bench: its macros make undocumented items, and a bench that cannot start ends"
)]

use std::time::{Duration, Instant};

use criterion::{Criterion, criterion_group, criterion_main};
use ikiru::glam::DVec3;
use ikiru::solve::objectives::{Direction, LookAt, Position, RestPose};
use ikiru::solve::{Problem, Solver, SolverOptions};
use ikiru::{JointId, formats};

fn bench(c: &mut Criterion) {
    let mut builder = formats::read("builtin:human").expect("the rig is built in").rig.to_builder();
    builder.free_root().expect("the rig moves");
    let rig = builder.build().expect("still a valid rig");
    let joint = |name: &str| rig.joint(name).expect("the human has all roles");
    let mut problem = Problem::whole_body(&rig);
    let rest = rig.rest_pose();
    let at = |name: &str| rest.frame(joint(name)).expect("a joint of the rig").position;
    let reach = problem.add(1.0, Position::new(joint("leftHand"), DVec3::new(0.3, 1.2, 0.3)));
    problem.add(1.0, Position::new(joint("rightHand"), DVec3::new(-0.25, 0.9, 0.3)));
    problem.add(1.0, Position::new(joint("leftFoot"), at("leftFoot")));
    problem.add(1.0, Position::new(joint("rightFoot"), at("rightFoot")));
    problem.add(0.1, Position::new(joint("hips"), at("hips") - DVec3::new(0.0, 0.1, 0.0)));
    problem.add(0.1, Direction::new(joint("leftHand"), DVec3::NEG_Y, DVec3::NEG_Y));
    problem.add(0.1, LookAt::new(joint("head"), DVec3::Z, DVec3::new(0.3, 1.2, 1.0)));
    let joints: Vec<JointId> = problem.active().collect();
    problem.add(0.01, RestPose::new(&joints, rest.clone()));

    let solver = Solver::new(SolverOptions::default());
    let mut workspace = solver.workspace(&problem);
    let mut pose = rest.clone();
    c.bench_function(&format!("full body, {} degrees of freedom, one iteration", rig.n_dofs()), |b| {
        b.iter_custom(|n| {
            let (mut spent, mut iterations) = (Duration::ZERO, 0);
            while iterations < n {
                pose.clone_from(&rest);
                let start = Instant::now();
                iterations += solver.solve(&problem, &mut pose, &mut workspace).iterations as u64;
                spent += start.elapsed();
            }
            spent.mul_f64(n as f64 / iterations as f64)
        });
    });

    let frame = Solver::new(SolverOptions { max_iterations: 4, ..SolverOptions::default() });
    let mut time = 0.0_f64;
    c.bench_function("full body, a frame of a hand moving at 1 m/s, at most 4 iterations", |b| {
        b.iter(|| {
            time += 1.0 / 90.0;
            problem[reach].target =
                DVec3::new(0.3 + 0.1 * (time * 10.0).cos(), 1.2 + 0.1 * (time * 10.0).sin(), 0.3);
            std::hint::black_box(frame.solve(&problem, &mut pose, &mut workspace).cost)
        });
    });
}

criterion_group!(benches, bench);
criterion_main!(benches);
