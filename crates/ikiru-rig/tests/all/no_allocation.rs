//! Proof that a clip's smooth curve is sampled without a single allocation.
#![allow(clippy::unwrap_used, reason = "a test fails by a panic")]

use ikiru_rig::{Clip, Pose};
use ikiru_testkit::allocations::count;
use ikiru_testkit::rigs::{Random, random_pose, random_rig};

#[test]
fn sampling_into_a_pose_of_the_rig_does_not_allocate() {
    let rig = random_rig(40, 11);
    let mut random = Random::new(5);
    let poses: Vec<Pose> = (0..5).map(|_| random_pose(&rig, &mut random)).collect();
    let clip = Clip::new("", vec![0.0, 0.1, 0.3, 0.4, 1.0], poses).unwrap();
    let mut pose = rig.rest_pose();
    assert_eq!(
        count(|| (0..=120).for_each(|i| clip.sample_cubic_into(f64::from(i) / 100.0 - 0.1, &mut pose))),
        0
    );
    // The counter counts.
    assert!(count(|| drop(clip.sample_cubic(0.2))) > 0);
}
