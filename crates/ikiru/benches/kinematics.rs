//! Forward kinematics of the whole reference human (57 joints), into memory that is kept.
#![allow(
    missing_docs,
    clippy::expect_used,
    reason = "a bench: its macros make undocumented items, and a bench that cannot start ends"
)]

use criterion::{Criterion, criterion_group, criterion_main};
use ikiru::rig::{Frame, kinematics};
use ikiru::{formats, glam::DQuat};

fn bench(c: &mut Criterion) {
    let rig = formats::read("builtin:reference").expect("the rig is built in").rig;
    let mut pose = rig.rest_pose();
    for (idx, joint) in rig.ids().enumerate() {
        let angle = 0.1 + 0.01 * idx as f64;
        pose.set_rotation(joint, DQuat::from_rotation_x(angle) * DQuat::from_rotation_z(-angle))
            .expect("all are balls");
    }
    let mut frames = vec![Frame::identity(); rig.n_joints()];
    c.bench_function("forward kinematics, 57 joints", |b| {
        b.iter(|| {
            let pose = std::hint::black_box(&pose);
            kinematics::forward(pose.rig(), pose.coords(), &mut frames);
            std::hint::black_box(&mut frames);
        });
    });
}

criterion_group!(benches, bench);
criterion_main!(benches);
