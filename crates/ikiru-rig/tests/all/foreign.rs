//! The id of a joint that a rig does not have: an error wherever a number, a frame or a change is asked for.
#![allow(clippy::unwrap_used, reason = "a test that cannot go on fails")]

use glam::{DQuat, DVec3};
use ikiru_rig::{
    Clip, ClipError, ForeignJoint, Joint, JointId, JointMotion, PoseError, Range, Rate, RateLimit, RatePart,
    Rig, RigBuilder, RigError,
};

/// A floating hip, a ball, a hinge.
fn rig() -> Rig {
    let mut builder = RigBuilder::new();
    let mut parent = None;
    let hinge = JointMotion::Hinge { axis: DVec3::X, range: Range::degrees(-90.0, 90.0) };
    for (name, motion) in [("hip", JointMotion::FREE), ("thigh", JointMotion::BALL), ("knee", hinge)] {
        let mut joint = Joint::new(name, parent);
        (joint.motion, joint.rest_translation) = (motion, DVec3::new(0.0, -0.4, 0.0));
        parent = Some(builder.add(joint));
    }
    builder.build().unwrap()
}

const FOREIGN: ForeignJoint = ForeignJoint { joint: 3, n_joints: 3 };

#[test]
fn what_is_asked_of_a_foreign_joint_is_an_error() {
    let rig = rig();
    let (pose, foreign) = (rig.rest_pose(), JointId::from_index(3));
    assert_eq!(pose.frame(foreign), Err(FOREIGN));
    assert_eq!(pose.rotation(foreign), Err(FOREIGN));
    assert_eq!(pose.translation(foreign), Err(FOREIGN));
    assert_eq!(pose.limit_violation_of(foreign), Err(FOREIGN));
    assert_eq!(pose.limit_margin_of(foreign), Err(FOREIGN));
    let clip = Clip::new("", vec![0.0, 1.0, 2.0], vec![pose.clone(), pose.clone(), pose]).unwrap();
    for part in [RatePart::Rotation, RatePart::Translation] {
        assert_eq!(clip.peak_speed(foreign, part), Err(FOREIGN));
        assert_eq!(clip.peak_acceleration(foreign, part), Err(FOREIGN));
        let rates = clip.rates(Rate::Speed);
        assert_eq!(rates.of_joint(foreign, part).map(drop), Err(FOREIGN));
        assert_eq!(rates.summary(&[JointId::from_index(0), foreign], part), Err(FOREIGN));
    }
    assert_eq!(clip.path_length(foreign), Err(FOREIGN));
    let limit = RateLimit { joint: foreign, part: RatePart::Rotation, rate: Rate::Speed, most: 1.0 };
    assert_eq!(limit.check(&rig), Err(ClipError::NoJoint(FOREIGN)));
    assert_eq!(
        FOREIGN.to_string(),
        "there is no joint 3 among the 3 of this rig: expected an id that comes from it"
    );
}

#[test]
fn a_foreign_joint_changes_nothing() {
    let rig = rig();
    let (mut pose, foreign) = (rig.rest_pose(), JointId::from_index(3));
    let no = Err(PoseError::NoJoint(FOREIGN));
    assert_eq!(pose.set_value(foreign, 0.1), no);
    assert_eq!(pose.set_euler(foreign, [0.1; 3]), no);
    assert_eq!(pose.set_rotation(foreign, DQuat::from_rotation_x(0.1)), no);
    assert_eq!(pose.set_translation(foreign, DVec3::X), no);
    assert_eq!(pose, rig.rest_pose());
    let mut builder = rig.to_builder();
    assert_eq!(builder.set_motion(foreign, JointMotion::BALL).map(drop), Err(FOREIGN));
    assert_eq!(builder.joints(), rig.joints());
    assert_eq!(RigError::from(FOREIGN), RigError::NoJoint(FOREIGN));
}

#[test]
fn what_a_foreign_joint_has_none_of_is_empty() {
    let rig = rig();
    let (pose, foreign) = (rig.rest_pose(), JointId::from_index(3));
    assert!(rig.get(foreign).is_none() && pose.value(foreign).is_none() && pose.euler(foreign).is_none());
    assert!(rig.coords_of(foreign).is_empty() && rig.dofs_of(foreign).is_empty());
    assert!(rig.ancestors(foreign).next().is_none() && rig.carrier(&[foreign]).is_none());
    assert!(!RatePart::Rotation.is_of(&rig, foreign));
}

#[test]
fn a_joint_that_does_not_move_so_has_a_true_zero() {
    let rig = rig();
    let pose = rig.rest_pose();
    for joint in rig.ids().skip(1) {
        assert_eq!(pose.translation(joint), Ok(DVec3::ZERO));
        assert_eq!(Clip::still(pose.clone()).peak_speed(joint, RatePart::Translation).unwrap().value, 0.0);
    }
}
