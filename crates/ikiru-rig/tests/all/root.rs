//! Which joint floats: the one that carries everything that moves, never merely the first that does.
#![allow(clippy::unwrap_used, reason = "a test fails by a panic")]

use glam::{DQuat, DVec3};
use ikiru_rig::{
    Cone, EulerOrder, Joint, JointId, JointMotion, PoseError, Range, Rig, RigBuilder, RigError, Role,
};
use ikiru_testkit::rigs::{Random, random_rig};

const HINGE: JointMotion = JointMotion::Hinge { axis: DVec3::Z, range: Range::UNLIMITED };

/// Joints by name, parent and motion.
fn builder(joints: &[(&str, Option<&str>, JointMotion)]) -> RigBuilder {
    let mut builder = RigBuilder::new();
    for (name, parent, motion) in joints {
        let at = |name: &str| joints.iter().position(|(other, ..)| *other == name).unwrap();
        let mut joint = Joint::new(*name, parent.map(|parent| JointId::from_index(at(parent))));
        joint.motion = *motion;
        joint.role = Role::from_name(name);
        joint.rest_translation = DVec3::new(0.1, 0.2, 0.3);
        builder.add(joint);
    }
    builder
}

/// The rig with its root floating, and that root's name.
fn floating(joints: &[(&str, Option<&str>, JointMotion)]) -> (Rig, String) {
    let mut builder = builder(joints);
    let root = builder.free_root().unwrap();
    let rig = builder.build().unwrap();
    assert_eq!((rig.root(), rig.floating_root()), (Some(root), Some(root)));
    let name = rig.get(root).unwrap().name.clone();
    (rig, name)
}

fn refused(joints: &[(&str, Option<&str>, JointMotion)]) -> RigError {
    let mut builder = builder(joints);
    let before = builder.joints().to_vec();
    let error = builder.free_root().unwrap_err();
    assert_eq!(builder.joints(), before, "what is refused changes nothing");
    error
}

#[test]
fn the_base_of_a_robot_floats_and_not_the_first_of_its_legs() {
    let (rig, root) = floating(&[
        ("base", None, JointMotion::Fixed),
        ("left hip", Some("base"), HINGE),
        ("left knee", Some("left hip"), HINGE),
        ("right hip", Some("base"), HINGE),
    ]);
    assert_eq!(root, "base");
    assert_eq!(rig.get(rig.joint("left hip").unwrap()).unwrap().motion, HINGE);
    // A single arm: its first hinge carries all that moves, but cannot do what a floating joint does.
    let arm = [("world", None, JointMotion::Fixed), ("link", Some("world"), JointMotion::Fixed)];
    let (_, root) = floating(&[arm[0], arm[1], ("shoulder", Some("link"), HINGE)]);
    assert_eq!(root, "link");
}

#[test]
fn the_hips_of_a_humanoid_float_and_what_moved_above_them_is_fixed() {
    let body = [
        ("armature", None, JointMotion::Fixed),
        ("root", Some("armature"), JointMotion::BALL),
        ("hips", Some("root"), JointMotion::BALL),
        ("spine", Some("hips"), JointMotion::BALL),
        ("leftUpperLeg", Some("hips"), JointMotion::BALL),
        ("tail", Some("hips"), JointMotion::BALL),
    ];
    let (rig, root) = floating(&body);
    assert_eq!(root, "hips");
    assert_eq!(rig.get(rig.joint("root").unwrap()).unwrap().motion, JointMotion::Fixed);
    // A cloak that hangs beside the hips must not stay behind.
    let mut with_cloak = body.to_vec();
    with_cloak.push(("cloak", Some("root"), JointMotion::BALL));
    let (rig, root) = floating(&with_cloak);
    assert_eq!(root, "root");
    assert_eq!(rig.get(rig.joint("hips").unwrap()).unwrap().motion, JointMotion::BALL);
    // Where legs and spine hang beside each other, what carries them.
    let (_, root) = floating(&[
        ("armature", None, JointMotion::Fixed),
        ("body", Some("armature"), JointMotion::BALL),
        ("hips", Some("body"), JointMotion::BALL),
        ("spine", Some("hips"), JointMotion::BALL),
        ("leftUpperLeg", Some("body"), JointMotion::BALL),
    ]);
    assert_eq!(root, "body");
}

#[test]
fn two_skeletons_float_together_or_not_at_all() {
    let two = [("first", Some("scene"), JointMotion::BALL), ("second", Some("scene"), JointMotion::BALL)];
    let (_, root) = floating(&[("scene", None, JointMotion::Fixed), two[0], two[1]]);
    assert_eq!(root, "scene");
    let apart = [("first", None, JointMotion::BALL), ("arm", Some("first"), HINGE), ("second", None, HINGE)];
    let error = refused(&apart);
    assert_eq!(error, RigError::NoCommonRoot { first: "first".into(), second: "second".into() });
    let rig = builder(&apart).build().unwrap();
    assert_eq!((rig.root(), rig.floating_root()), (None, None));
    assert_eq!(rig.rest_pose().set_root_translation(DVec3::X), Err(PoseError::NoFloatingRoot));
}

#[test]
fn what_a_floating_joint_cannot_do_does_not_float() {
    let euler = |range| JointMotion::Euler { order: EulerOrder::Zxy, ranges: [range; 3] };
    let limited = refused(&[("hips", None, euler(Range::degrees(-10.0, 10.0)))]);
    assert_eq!(limited, RigError::CannotFloat { joint: "hips".into(), motion: "euler" });
    assert_eq!(
        refused(&[("rail", None, HINGE)]),
        RigError::CannotFloat { joint: "rail".into(), motion: "hinge" }
    );
    assert_eq!(refused(&[("stone", None, JointMotion::Fixed)]), RigError::NoRoot);
    // Three angles without ranges are any rotation, and a cone stays.
    let (rig, _) = floating(&[("hips", None, euler(Range::UNLIMITED))]);
    assert_eq!(rig.joints()[0].motion, JointMotion::FREE);
    let cone = Cone::new(DVec3::Y, [0.5, 0.5], Range::new(-0.1, 0.1)).ok();
    let (rig, _) = floating(&[("hips", None, JointMotion::Ball { cone })]);
    assert_eq!(rig.joints()[0].motion, JointMotion::Free { cone });
}

#[test]
fn of_any_rig_the_floating_root_carries_all_that_moves() {
    let mut n_floating = 0;
    for seed in 0..300 {
        let rig = random_rig(1 + seed as usize % 12, seed);
        let moving: Vec<JointId> =
            rig.ids().filter(|id| rig.joints()[id.index()].motion != JointMotion::Fixed).collect();
        let mut builder = rig.to_builder();
        match (builder.free_root(), rig.carrier(&moving)) {
            (Ok(root), Some(carrier)) => {
                let rig = builder.build().unwrap();
                assert!(rig.ancestors(carrier).any(|joint| joint == root));
                assert!(moving.iter().all(|id| rig.ancestors(*id).any(|joint| joint == root)));
                n_floating += 1;
            }
            (Err(RigError::NoCommonRoot { .. } | RigError::NoRoot), None) => {}
            (Err(RigError::CannotFloat { .. }), Some(_)) => {}
            other => panic!("{other:?}"),
        }
    }
    assert!(n_floating > 50, "{n_floating}");
}

#[test]
fn a_root_below_a_turned_armature_moves_along_the_axes_of_the_world() {
    let mut builder = builder(&[
        ("armature", None, JointMotion::Fixed),
        ("hips", Some("armature"), JointMotion::BALL),
        ("spine", Some("hips"), JointMotion::BALL),
    ]);
    let mut random = Random::new(3);
    for joint in builder.joints_mut() {
        joint.rest_rotation = random.rotation();
    }
    builder.free_root().unwrap();
    let rig = builder.build().unwrap();
    let hips = rig.joint("hips").unwrap();
    let at_rest = rig.rest_pose().frame(hips).unwrap().position;
    let mut pose = rig.rest_pose();
    pose.set_rotation(hips, random.rotation()).unwrap();
    let way = DVec3::new(1.0, -2.0, 0.5);
    pose.set_root_translation(way).unwrap();
    assert!((pose.frame(hips).unwrap().position - at_rest).distance(way) < 1e-14);
    assert!(pose.root_translation().distance(way) < 1e-14);
    assert!(pose.set_root_translation(DVec3::NAN).is_err());
    assert_eq!(DQuat::IDENTITY, rig.rest_pose().rotation(hips).unwrap());
}
