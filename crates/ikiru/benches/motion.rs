//! Planning a full body, the root free: seconds of motion at 60 frames a second, with ten key targets or with six targets
//! at every frame. Time should grow with the number of frames and no faster.
#![allow(
    missing_docs,
    clippy::expect_used,
    reason = "a bench: its macros make undocumented items, and a bench that cannot start ends"
)]

use criterion::measurement::WallTime;
use criterion::{BenchmarkGroup, BenchmarkId, Criterion, Throughput, criterion_group, criterion_main};
use ikiru::glam::DVec3;
use ikiru::rig::{Clip, Rig};
use ikiru::{MotionProblem, MotionWorkspace, Position, Solver, SolverOptions, Timeline, When, formats};

/// The human with a free root.
fn body() -> Rig {
    let mut builder = formats::read("builtin:human").expect("the rig is built in").rig.to_builder();
    builder.free_root().expect("the rig moves");
    builder.build().expect("still a valid rig")
}

fn keys(c: &mut Criterion) {
    let rig = body();
    let hands = ["leftHand", "rightHand"].map(|name| rig.joint(name).expect("the human has all roles"));
    let rest = rig.rest_pose();
    let mut group = c.benchmark_group("full body, ten key targets, 60 frames a second");
    group.sample_size(10);
    for secs in [1, 2, 5, 10, 30, 60_u32] {
        let mut motion = motion(&rig, secs);
        for key in 1..=10_usize {
            let hand = hands[key % 2];
            let home = rest.frame(hand).expect("a joint of the rig").position;
            let at = home + DVec3::new(-0.2 * home.x.signum(), -0.1, 0.25 + 0.02 * key as f64);
            let when = When::At(f64::from(secs) * key as f64 / 10.0);
            motion.add(10.0, when, Position::new(hand, at)).expect("on the timeline");
        }
        measure(&mut group, &motion, secs);
    }
    group.finish();
}

fn tracking(c: &mut Criterion) {
    let rig = body();
    let rest = rig.rest_pose();
    // A pose that sways in every joint, so that what it shows can be followed.
    let swaying = |secs: f64| {
        let way = |k: usize| 0.12 * ((1.3 * secs + k as f64).sin() - (k as f64).sin());
        let mut pose = rest.clone();
        pose.retract(&(0..rig.n_dofs()).map(way).collect::<Vec<_>>()).expect("a tangent of the rig");
        pose
    };
    let mut group = c.benchmark_group("full body, six targets at every frame, 60 frames a second");
    group.sample_size(10);
    for secs in [1, 2, 5, 10, 30, 60_u32] {
        let mut motion = motion(&rig, secs);
        for name in ["leftHand", "rightHand", "leftFoot", "rightFoot", "head", "hips"] {
            let joint = rig.joint(name).expect("the human has all roles");
            let at = |secs: f64| {
                Position::new(joint, swaying(secs).frame(joint).expect("a joint of the rig").position)
            };
            motion.add_moving(1.0, When::Throughout, at).expect("on the timeline");
        }
        measure(&mut group, &motion, secs);
    }
    group.finish();
}

fn motion(rig: &Rig, secs: u32) -> MotionProblem {
    let timeline = Timeline::seconds(f64::from(secs), 60.0).expect("a timeline");
    let mut motion = MotionProblem::whole_body(rig, timeline);
    motion.set_smoothness([1e-4, 1e-3, 1e-3]).expect("weights");
    motion.fix_start(&rig.rest_pose()).expect("a pose of the rig");
    motion
}

/// From standing still, memory at hand.
fn measure(group: &mut BenchmarkGroup<'_, WallTime>, motion: &MotionProblem, secs: u32) {
    let still = Clip::still(motion.rig().rest_pose());
    let solver = Solver::new(SolverOptions { max_iterations: 100, ..SolverOptions::default() });
    group.throughput(Throughput::Elements(motion.timeline().n_samples() as u64));
    group.bench_function(BenchmarkId::from_parameter(format!("{secs} s")), |b| {
        let mut workspace = MotionWorkspace::default();
        b.iter(|| {
            let planned = solver.plan(motion, &still, &mut workspace);
            assert!(planned.report.success, "every target is reached");
        });
    });
}

criterion_group!(benches, keys, tracking);
criterion_main!(benches);
