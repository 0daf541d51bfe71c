//! Clips on other rigs: limbs point where they pointed, whatever the joints are called and however they rest.
#![allow(clippy::unwrap_used, reason = "a test fails by a panic")]

use crate::common::*;
use glam::{DQuat, DVec3};
use ikiru_formats::read;
use ikiru_rig::humanoid::{Reference, TransferError, normalised, t_pose, transfer};
use ikiru_rig::{Clip, EulerOrder, JointMotion, Pose, Range, Rig, Role};
use ikiru_testkit::rigs::{Random, random_pose};

fn rig(name: &str) -> Rig {
    read(path(name)).unwrap().rig
}

/// With hips that translate.
fn free(rig: &Rig) -> Rig {
    let mut builder = rig.to_builder();
    builder.set_motion(rig.role(Role::Hips).unwrap(), JointMotion::FREE).unwrap();
    builder.build().unwrap()
}

fn random_clip(rig: &Rig, seed: u64) -> Clip {
    let mut random = Random::new(seed);
    let poses = (0..4).map(|_| random_pose(rig, &mut random)).collect();
    Clip::new("random", vec![0.0, 0.25, 0.5, 1.0], poses).unwrap()
}

fn rotation(pose: &Pose, role: Role) -> DQuat {
    pose.frame(pose.rig().role(role).unwrap()).unwrap().rotation
}

fn at(pose: &Pose, role: Role) -> DVec3 {
    pose.frame(pose.rig().role(role).unwrap()).unwrap().position
}

/// Angle in radians between two rotations, without the rounding of arccos.
fn angle(a: DQuat, b: DQuat) -> f64 {
    let d = a.inverse() * b;
    2.0 * d.xyz().length().atan2(d.w.abs())
}

/// Bones with the role at their end.
const BONES: [(Role, Role); 8] = [
    (Role::LeftUpperArm, Role::LeftLowerArm),
    (Role::LeftLowerArm, Role::LeftHand),
    (Role::RightUpperArm, Role::RightLowerArm),
    (Role::RightLowerArm, Role::RightHand),
    (Role::LeftUpperLeg, Role::LeftLowerLeg),
    (Role::LeftLowerLeg, Role::LeftFoot),
    (Role::RightUpperLeg, Role::RightLowerLeg),
    (Role::RightLowerLeg, Role::RightFoot),
];

fn bone(pose: &Pose, (from, to): (Role, Role)) -> DVec3 {
    (at(pose, to) - at(pose, from)).normalize()
}

#[test]
fn on_the_same_rig_a_clip_is_the_same() {
    for name in ["mh_female_mixamo.glb", "mh_male_vrm1.vrm", "mh_male_vrm0.vrm", "builtin:reference"] {
        let rig = free(&rig(name));
        let clip = random_clip(&rig, 21);
        for reference in [Reference::Rest, Reference::TPose] {
            let again = transfer(&clip, &rig, reference).unwrap().clip;
            assert!(again.rig().is_same(&rig));
            assert_eq!((again.name(), again.times()), (clip.name(), clip.times()));
            for (a, b) in clip.poses().iter().zip(again.poses()) {
                for role in Role::ALL.into_iter().filter(|role| rig.role(*role).is_some()) {
                    // Joints without a role stand still, so compare what hangs at roles alone.
                    let joint = rig.get(rig.role(role).unwrap()).unwrap();
                    if role == Role::Hips || joint.parent.is_some_and(|p| rig.get(p).unwrap().role.is_some())
                    {
                        assert!(angle(rotation(a, role), rotation(b, role)) < 1e-7, "{name}: {role}");
                    }
                }
            }
        }
    }
}

#[test]
fn limbs_turn_in_the_world_as_they_did_from_rest() {
    let (source, target) = (rig("mh_female_mixamo.glb"), rig("mh_male_vrm1.vrm"));
    let clip = random_clip(&source, 22);
    let moved = transfer(&clip, &target, Reference::Rest).unwrap().clip;
    let (source_rest, target_rest) = (source.rest_pose(), target.rest_pose());
    for (a, b) in clip.poses().iter().zip(moved.poses()) {
        for role in Role::ALL.into_iter().filter(|r| source.role(*r).is_some() && target.role(*r).is_some()) {
            let of_source = rotation(a, role) * rotation(&source_rest, role).inverse();
            let of_target = rotation(b, role) * rotation(&target_rest, role).inverse();
            assert!(angle(of_source, of_target) < 1e-7, "{role}");
        }
        for limb in BONES {
            // The same by positions: the way from the rest direction to the direction is the source's.
            let turn = rotation(a, limb.0) * rotation(&source_rest, limb.0).inverse();
            assert!(bone(b, limb).distance(turn * bone(&target_rest, limb)) < 1e-7, "{limb:?}");
        }
    }
}

#[test]
fn in_t_pose_limbs_point_sideways_and_down_and_feet_stand_flat() {
    for (name, ..) in FILES.into_iter().filter(|(name, ..)| !name.starts_with("webxr")) {
        let rig = rig(name);
        let pose = t_pose(&rig);
        for limb in BONES {
            let expected = match limb.0.name() {
                name if name.ends_with("Leg") => DVec3::NEG_Y,
                name if name.starts_with("left") => DVec3::X,
                _ => DVec3::NEG_X,
            };
            assert!(bone(&pose, limb).distance(expected) < 1e-7, "{name}: {limb:?}");
        }
        for foot in [Role::LeftFoot, Role::RightFoot] {
            assert!(angle(rotation(&pose, foot), rotation(&rig.rest_pose(), foot)) < 1e-7, "{name}");
        }
        assert_eq!(rotation(&pose, Role::Head), rotation(&rig.rest_pose(), Role::Head), "{name}");
    }
}

#[test]
fn by_the_t_pose_limbs_of_rigs_that_rest_otherwise_point_the_same_way() {
    // The target rests with its arms hanging: 60 degrees down.
    let (source, target) = (rig("builtin:reference"), rig("mh_male_vrm1.vrm"));
    let mut builder = target.to_builder();
    for (role, sign) in [(Role::LeftUpperArm, -1.0_f64), (Role::RightUpperArm, 1.0)] {
        let joint = &mut builder.joints_mut()[target.role(role).unwrap().index()];
        joint.rest_rotation *= DQuat::from_rotation_z(sign * 60_f64.to_radians());
    }
    let target = builder.build().unwrap();
    let clip = random_clip(&source, 23);
    let moved = transfer(&clip, &target, Reference::TPose).unwrap().clip;
    for (a, b) in clip.poses().iter().zip(moved.poses()) {
        for limb in BONES {
            assert!(bone(a, limb).distance(bone(b, limb)) < 1e-7, "{limb:?}");
        }
    }
}

#[test]
fn the_way_of_the_hips_is_scaled_by_their_height() {
    let source = free(&rig("mh_female_mixamo.glb"));
    let target = free(&rig("mh_male_gameengine.glb"));
    let mut pose = source.rest_pose();
    let way = DVec3::new(0.3, -0.2, 1.5);
    let hips = source.role(Role::Hips).unwrap();
    pose.set_translation(hips, pose.frame(hips).unwrap().rotation.inverse() * way).unwrap();
    let clip = Clip::still(pose.clone()).with_name("walk");
    let moved = transfer(&clip, &target, Reference::Rest).unwrap().clip;
    let height = |rig: &Rig| at(&rig.rest_pose(), Role::Hips).y - at(&rig.rest_pose(), Role::LeftFoot).y;
    let found = at(&moved.poses()[0], Role::Hips) - at(&target.rest_pose(), Role::Hips);
    let expected = way * height(&target) / height(&source);
    assert!(found.distance(expected) < 2e-3, "{found} {expected}");
    // A target without a joint that translates gets one: its root floats.
    let fixed = rig("mh_male_gameengine.glb");
    let moved = transfer(&clip, &fixed, Reference::Rest).unwrap();
    assert_eq!(moved.warnings, []);
    let found = at(&moved.clip.poses()[0], Role::Hips) - at(&fixed.rest_pose(), Role::Hips);
    assert!(found.distance(expected) < 2e-3, "{found} {expected}");
}

#[test]
fn a_target_that_faces_elsewhere_moves_in_its_own_directions() {
    let source = free(&rig("mh_female_mixamo.glb"));
    let turn = DQuat::from_rotation_y(std::f64::consts::PI);
    let mut builder = source.to_builder();
    for joint in builder.joints_mut().iter_mut().filter(|joint| joint.parent.is_none()) {
        joint.rest_rotation = turn * joint.rest_rotation;
        joint.rest_translation = turn * joint.rest_translation;
    }
    let target = builder.build().unwrap();
    let clip = random_clip(&source, 24);
    let moved = transfer(&clip, &target, Reference::TPose).unwrap().clip;
    for (a, b) in clip.poses().iter().zip(moved.poses()) {
        for role in Role::ALL.into_iter().filter(|role| source.role(*role).is_some()) {
            assert!((turn * at(a, role)).distance(at(b, role)) < 1e-7, "{role}");
        }
    }
}

#[test]
fn bones_that_only_one_rig_has_do_no_harm() {
    // The source has neither chest nor shoulders; all below turns in the world as it did.
    let target = rig("mh_male_vrm1.vrm");
    let mut builder = normalised(&target).unwrap().to_builder();
    for joint in builder.joints_mut() {
        if matches!(joint.role, Some(Role::Chest | Role::LeftShoulder)) {
            joint.role = None;
        }
    }
    let source = builder.build().unwrap();
    for (from, to) in [(&source, &target), (&target, &source)] {
        let clip = random_clip(from, 25);
        let moved = transfer(&clip, to, Reference::TPose).unwrap().clip;
        for (a, b) in clip.poses().iter().zip(moved.poses()) {
            for limb in BONES {
                assert!(bone(a, limb).distance(bone(b, limb)) < 1e-7, "{limb:?}");
            }
        }
    }
}

#[test]
fn euler_joints_go_the_short_way_and_hinges_as_far_as_they_can() {
    let source = rig("builtin:reference");
    let mut builder = source.to_builder();
    let (shoulder, elbow) = (source.joint("left_shoulder").unwrap(), source.joint("left_elbow").unwrap());
    builder
        .set_motion(shoulder, JointMotion::Euler { order: EulerOrder::Zyx, ranges: [Range::UNLIMITED; 3] })
        .unwrap();
    builder.set_motion(elbow, JointMotion::Hinge { axis: DVec3::Y, range: Range::UNLIMITED }).unwrap();
    let target = builder.build().unwrap();
    let poses: Vec<Pose> = (0..40)
        .map(|i| {
            let mut pose = source.rest_pose();
            pose.set_rotation(shoulder, DQuat::from_rotation_z(0.2 * f64::from(i))).unwrap();
            let turn = DQuat::from_rotation_y(-0.05 * f64::from(i)) * DQuat::from_rotation_x(0.3);
            pose.set_rotation(elbow, turn).unwrap();
            pose
        })
        .collect();
    let clip = Clip::new("turns", (0..40).map(f64::from).collect(), poses).unwrap();
    let moved = transfer(&clip, &target, Reference::Rest).unwrap().clip;
    for (i, pose) in moved.poses().iter().enumerate() {
        assert!((pose.euler(shoulder).unwrap()[2] - 0.2 * i as f64).abs() < 1e-7, "{i}");
        assert!((pose.value(elbow).unwrap() + 0.05 * i as f64).abs() < 1e-7, "{i}");
    }
}

#[test]
fn what_cannot_be_transferred_says_why() {
    let (human, hand) = (rig("builtin:human"), rig("webxr_generic_hand_left.glb"));
    let of = |from: &Rig, to: &Rig| {
        let clip = Clip::still(from.rest_pose()).with_name("rest");
        transfer(&clip, to, Reference::TPose)
    };
    assert_eq!(of(&hand, &human).unwrap_err(), TransferError::NoRoles("the clip's rig"));
    let error = of(&human, &hand).unwrap_err();
    assert_eq!(error.to_string(), "the target has no humanoid roles, by which its joints could be found");
    let mut pose = human.rest_pose();
    pose.coords_mut().fill(f64::NAN);
    let clip = Clip::still(pose).with_name("broken");
    assert!(matches!(transfer(&clip, &human, Reference::Rest), Err(TransferError::Pose(_))));
}
