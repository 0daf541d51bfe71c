//! A file whose root floats: its clips, and what is written.
#![allow(clippy::unwrap_used, reason = "a test fails by a panic")]

use ikiru_formats::read;
use ikiru_rig::Clip;
use ikiru_testkit::rigs::{Random, random_pose};

#[test]
fn a_root_that_floats_does_what_the_joints_above_it_did_in_a_clip() {
    // The human's `Root` turns as well as the pelvis below it; where the pelvis floats, `Root` is fixed.
    let mut loaded = read("builtin:human").unwrap();
    let mut random = Random::new(41);
    let poses: Vec<_> = (0..3).map(|_| random_pose(&loaded.rig, &mut random)).collect();
    loaded.clips = vec![Clip::new("turns", vec![0.0, 0.5, 1.0], poses.clone()).unwrap()];
    let mut builder = loaded.rig.to_builder();
    let root = builder.free_root().unwrap();
    let free = loaded.clone().with_rig(builder.build().unwrap()).unwrap();
    assert_eq!(free.warnings, loaded.warnings);
    for (before, after) in poses.iter().zip(free.clips[0].poses()) {
        for id in free.rig.ids().filter(|id| free.rig.ancestors(*id).any(|joint| joint == root)) {
            let (a, b) = (before.frame(id).unwrap(), after.frame(id).unwrap());
            assert!(a.position.distance(b.position) < 1e-9);
            assert!(a.rotation.dot(b.rotation).abs() > 1.0 - 1e-12);
        }
    }
}
