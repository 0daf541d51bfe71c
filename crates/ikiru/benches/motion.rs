//! Planning a full body: seconds of motion at 60 frames a second with ten key targets, the root free. Time should grow
//! with the number of frames and no faster.
#![allow(
    missing_docs,
    clippy::expect_used,
    reason = "a bench: its macros make undocumented items, and a bench that cannot start ends"
)]

use criterion::{BenchmarkId, Criterion, Throughput, criterion_group, criterion_main};
use ikiru::glam::DVec3;
use ikiru::rig::Clip;
use ikiru::{MotionProblem, MotionWorkspace, Position, Solver, SolverOptions, Timeline, When, formats};

fn bench(c: &mut Criterion) {
    let mut builder = formats::read("builtin:human").expect("the rig is built in").rig.to_builder();
    builder.free_root().expect("the rig moves");
    let rig = builder.build().expect("still a valid rig");
    let hands = ["leftHand", "rightHand"].map(|name| rig.joint(name).expect("the human has all roles"));
    let rest = rig.rest_pose();
    let still = Clip::new("still", vec![0.0], vec![rest.clone()]).expect("one pose");
    let solver = Solver::new(SolverOptions { max_iterations: 100, ..SolverOptions::default() });
    let mut group = c.benchmark_group("full body, ten key targets, 60 frames a second");
    group.sample_size(10);
    for secs in [1, 2, 5, 10, 30, 60_u32] {
        let timeline = Timeline::seconds(f64::from(secs), 60.0).expect("a timeline");
        let mut motion = MotionProblem::new(&rig, rig.ids(), timeline);
        motion.set_smoothness([1e-4, 1e-3, 1e-3]).expect("weights");
        motion.fix_start(&rest).expect("a pose of the rig");
        for key in 1..=10_usize {
            let hand = hands[key % 2];
            let home = rest.frame(hand).origin.value();
            let at = home + DVec3::new(-0.2 * home.x.signum(), -0.1, 0.25 + 0.02 * key as f64);
            let when = When::At(f64::from(secs) * key as f64 / 10.0);
            motion.add(10.0, when, Position::new(hand, at)).expect("on the timeline");
        }
        group.throughput(Throughput::Elements(timeline.n_frames() as u64));
        group.bench_function(BenchmarkId::from_parameter(format!("{secs} s")), |b| {
            let mut workspace = MotionWorkspace::default();
            b.iter(|| {
                let planned = solver.plan(&motion, &still, &mut workspace);
                assert!(planned.report.success, "every key is reached");
            });
        });
    }
    group.finish();
}

criterion_group!(benches, bench);
criterion_main!(benches);
