//! The way of the hips onto another character, judged by where source and target have their hips in the world.
#![allow(clippy::unwrap_used, reason = "a test fails by a panic")]

use crate::common::*;
use glam::{DQuat, DVec3};
use ikiru_formats::{
    BvhOptions, Loaded, read, read_bvh, read_vrma, write_animated_glb, write_bvh_clip, write_vrma,
};
use ikiru_rig::humanoid::{Reference, TransferWarning, t_pose, transfer};
use ikiru_rig::{Clip, Joint, JointMotion, Pose, Rig, RigBuilder, RigError, Role};
use serde_json::Value;

const TARGETS: [&str; 4] = ["builtin:human", "mh_male_vrm1.vrm", "mh_male_vrm0.vrm", "mh_female_mixamo.glb"];

/// A walk of the CMU database, in metres: it rests with the hips at the origin.
fn walk() -> Clip {
    let bytes = std::fs::read(data("mocap/cmu_01_01_30fps.bvh")).unwrap();
    let options = BvhOptions { scale: 0.056444, ..BvhOptions::default() };
    read_bvh(&bytes, "walk.bvh", &options).unwrap().clips[0].clone()
}

fn at(pose: &Pose, role: Role) -> DVec3 {
    pose.frame(pose.rig().role(role).unwrap()).unwrap().position
}

/// Height of the hips over the lower ankle, legs straight.
fn legs(rig: &Rig) -> f64 {
    let stance = t_pose(rig);
    at(&stance, Role::Hips).y - at(&stance, Role::LeftFoot).y.min(at(&stance, Role::RightFoot).y)
}

/// Where the hips should be in each pose, for a source that moves over the ground.
fn expected(source: &Clip, target: &Rig) -> Vec<DVec3> {
    let scale = legs(target) / legs(source.rig());
    source.poses().iter().map(|pose| at(pose, Role::Hips) * scale).collect()
}

#[test]
fn a_walk_goes_as_far_as_the_legs_are_long_and_stays_on_the_ground() {
    let walk = walk();
    for name in TARGETS {
        let target = read(path(name)).unwrap().rig;
        let moved = transfer(&walk, &target, Reference::TPose).unwrap();
        assert_eq!(moved.warnings, [], "{name}");
        let hips: Vec<DVec3> = moved.clip.poses().iter().map(|pose| at(pose, Role::Hips)).collect();
        for (found, expected) in hips.iter().zip(expected(&walk, &target)) {
            assert!(found.distance(expected) < 1e-9, "{name}: {found} {expected}");
        }
        let way: f64 = hips.windows(2).map(|pair| pair[0].distance(pair[1])).sum();
        assert!(way > 5.0, "{name}: {way} m");
        // One foot is near the ground most of the time (it jumps and climbs in between).
        let low = |pose: &Pose| at(pose, Role::LeftFoot).y.min(at(pose, Role::RightFoot).y);
        let mut heights: Vec<f64> = moved.clip.poses().iter().map(low).collect();
        heights.sort_by(f64::total_cmp);
        assert!((0.0..0.2).contains(&heights[heights.len() / 4]), "{name}: {}", heights[heights.len() / 4]);
    }
}

/// Hips by the file's own nodes and channels, at every twentieth key.
fn hips_of_glb(bytes: &[u8], hips: &str) -> Vec<(usize, DVec3)> {
    let (mut document, bin) = open(bytes);
    let bin = bin.unwrap();
    let animation = document["animations"].as_array().unwrap().last().unwrap().clone();
    let numbers = |accessor: &Value, width: usize, key: usize, document: &Value| -> Vec<f64> {
        let accessor = &document["accessors"][accessor.as_u64().unwrap() as usize];
        let view = &document["bufferViews"][accessor["bufferView"].as_u64().unwrap() as usize];
        let from = view["byteOffset"].as_u64().unwrap() as usize + 4 * width * key;
        let one = |c: &[u8]| f64::from(f32::from_le_bytes(c.try_into().unwrap()));
        bin[from..from + 4 * width].chunks(4).map(one).collect()
    };
    let input = &animation["samplers"][0]["input"];
    let n_keys = document["accessors"][input.as_u64().unwrap() as usize]["count"].as_u64().unwrap() as usize;
    let mut found = Vec::new();
    for key in (0..n_keys).step_by(20) {
        for channel in animation["channels"].as_array().unwrap() {
            let sampler = &animation["samplers"][channel["sampler"].as_u64().unwrap() as usize];
            let (node, path) = (&channel["target"]["node"], channel["target"]["path"].as_str().unwrap());
            let width = if path == "rotation" { 4 } else { 3 };
            let value = numbers(&sampler["output"], width, key, &document);
            document["nodes"][node.as_u64().unwrap() as usize][path] = value.into();
        }
        let all = matrices(&document);
        let (_, matrix) = all.iter().find(|(name, _)| name == hips).unwrap();
        found.push((key, matrix.w_axis.truncate()));
    }
    found
}

#[test]
fn every_format_holds_the_way_of_the_hips() {
    let walk = walk();
    for name in TARGETS {
        let target = read(path(name)).unwrap();
        let moved = transfer(&walk, &target.rig, Reference::TPose).unwrap().clip;
        let expected = expected(&walk, &target.rig);
        let hips = &target.rig.get(target.rig.role(Role::Hips).unwrap()).unwrap().name;

        let file_from_world = target.world_from_file().inverse();
        for (key, found) in hips_of_glb(&write_animated_glb(&target, &moved).unwrap(), hips) {
            let expected = file_from_world * expected[key];
            assert!(found.distance(expected) < 1e-5, "{name} .glb {key}: {found} {expected}");
        }

        let bvh = write_bvh_clip(&target, &moved).unwrap();
        let again = read_bvh(&bvh, "again.bvh", &BvhOptions::default()).unwrap();
        let joint = again.rig.joint(hips).unwrap();
        for (pose, expected) in again.clips[0].poses().iter().zip(&expected) {
            assert!(pose.frame(joint).unwrap().position.distance(*expected) < 1e-6, "{name} .bvh");
        }

        let vrma = read_vrma(&write_vrma(&moved).unwrap(), "walk.vrma").unwrap();
        for (pose, expected) in vrma.clips[0].poses().iter().zip(&expected) {
            assert!(at(pose, Role::Hips).distance(*expected) < 1e-5, "{name} .vrma");
        }
    }
}

#[test]
fn through_a_vrm_animation_the_walk_is_the_same() {
    let walk = walk();
    let file = read_vrma(&write_vrma(&walk).unwrap(), "walk.vrma").unwrap();
    // Players measure by the height of the hips at rest, which must not be 0.
    let legs = legs(walk.rig());
    assert!((at(&file.rig.rest_pose(), Role::Hips).y - legs).abs() < 1e-6);
    let target = read(path("mh_female_mixamo.glb")).unwrap().rig;
    let through = transfer(&file.clips[0], &target, Reference::TPose).unwrap().clip;
    let direct = transfer(&walk, &target, Reference::TPose).unwrap().clip;
    let starts = [&direct, &through].map(|clip| at(&clip.poses()[0], Role::Hips));
    for (a, b) in direct.poses().iter().zip(through.poses()) {
        let steps = [at(a, Role::Hips) - starts[0], at(b, Role::Hips) - starts[1]];
        assert!(steps[0].distance(steps[1]) < 1e-4, "{} {}", steps[0], steps[1]);
    }
    assert!(starts[0].distance(starts[1]) < 0.1, "{starts:?}");
}

#[test]
fn onto_the_same_rig_nothing_is_lost() {
    // What a floating human does, through a motion file, on the human as it is read.
    let human = read("builtin:human").unwrap();
    let mut builder = human.rig.to_builder();
    builder.free_root().unwrap();
    let free = human.clone().with_rig(builder.build().unwrap()).unwrap();
    let mut pose = free.rig.rest_pose();
    pose.set_root_translation(DVec3::new(0.7, -0.1, 0.3)).unwrap();
    pose.set_rotation(free.rig.joint("hips").unwrap(), DQuat::from_rotation_y(1.0)).unwrap();
    let clip = Clip::new("step", vec![0.0, 1.0], vec![free.rig.rest_pose(), pose.clone()]).unwrap();
    let file = read_bvh(&write_bvh_clip(&free, &clip).unwrap(), "step.bvh", &BvhOptions::default()).unwrap();
    let moved = transfer(&file.clips[0], &human.rig, Reference::TPose).unwrap().clip;
    for role in [Role::Hips, Role::LeftHand, Role::RightFoot, Role::Head] {
        assert!(at(&moved.poses()[1], role).distance(at(&pose, role)) < 1e-6, "{role}");
    }
}

#[test]
fn a_way_that_cannot_be_taken_is_told() {
    let walk = walk();
    // Beside the character, another skeleton that moves: nothing carries both.
    let mut builder: RigBuilder = read("builtin:human").unwrap().rig.to_builder();
    let mut dog = Joint::new("dog", None);
    dog.motion = JointMotion::BALL;
    builder.add(dog);
    let target = builder.build().unwrap();
    let moved = transfer(&walk, &target, Reference::TPose).unwrap();
    let [TransferWarning::HipsStay { metres, reason: RigError::NoCommonRoot { .. } }] = &moved.warnings[..]
    else {
        panic!("{:?}", moved.warnings)
    };
    assert!(*metres > 1.0, "{metres}");
    assert!(moved.warnings[0].to_string().contains("'dog' hang on different roots"));
    assert!(moved.clip.rig().is_same(&target));
    // Without hips, nobody knows whose way it is.
    let mut builder = read("builtin:human").unwrap().rig.to_builder();
    builder.joints_mut().iter_mut().filter(|j| j.role == Some(Role::Hips)).for_each(|j| j.role = None);
    let warnings = transfer(&walk, &builder.build().unwrap(), Reference::TPose).unwrap().warnings;
    assert_eq!(warnings, [TransferWarning::NoHips { rig: "the target" }]);
    // A clip that stays in place needs nothing that floats.
    let still = Clip::still(Loaded::from_rig(target.clone()).rig.rest_pose());
    let moved = transfer(&still, &target, Reference::TPose).unwrap();
    assert!(moved.warnings.is_empty() && moved.clip.rig().is_same(&target));
}
