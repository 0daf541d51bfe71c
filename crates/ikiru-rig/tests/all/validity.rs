//! What a rig and a pose refuse: each wrong input alone.

use glam::{DAffine3, DMat3, DQuat, DVec3};
use ikiru_rig::{
    ChainError, ForeignJoint, Joint, JointId, JointMotion, Mimic, Pose, PoseError, Range, Rig, RigBuilder,
    RigError, RigidError, Role, decompose_affine,
};

fn hinge(range: Range) -> JointMotion {
    JointMotion::Hinge { axis: DVec3::Z, range }
}

/// hips – thigh (ball) – knee (hinge), and a tail beside it.
fn joints() -> Vec<Joint> {
    let mut hips = Joint::new("hips", None);
    hips.role = Some(Role::Hips);
    let mut thigh = Joint::new("thigh", Some(JointId::from_index(0)));
    thigh.motion = JointMotion::BALL;
    thigh.aliases = vec!["thigh_link".to_owned()];
    let mut knee = Joint::new("knee", Some(JointId::from_index(1)));
    knee.motion = hinge(Range::new(0.0, 2.0));
    knee.rest_translation = DVec3::new(0.0, -0.4, 0.0);
    let mut tail = Joint::new("tail", Some(JointId::from_index(0)));
    tail.motion = JointMotion::Slider { axis: DVec3::Y, range: Range::new(-0.1, 0.1) };
    vec![hips, thigh, knee, tail]
}

fn build(joints: Vec<Joint>) -> Result<Rig, RigError> {
    let mut builder = RigBuilder::new();
    for joint in joints {
        builder.add(joint);
    }
    builder.build()
}

fn broken(change: impl FnOnce(&mut Vec<Joint>)) -> RigError {
    let mut list = joints();
    change(&mut list);
    build(list).expect_err("should have been refused")
}

#[test]
fn a_rig_that_is_not_valid_does_not_exist() {
    assert!(build(joints()).is_ok());
    assert_eq!(build(vec![]).unwrap_err(), RigError::Empty);
    assert_eq!(broken(|j| j[1].name.clear()), RigError::Unnamed(1));
    assert_eq!(broken(|j| j[1].name = "hips".into()), RigError::DuplicateName("hips".into()));
    assert_eq!(
        broken(|j| j[3].aliases = vec!["thigh_link".into()]),
        RigError::DuplicateName("thigh_link".into())
    );
    assert_eq!(broken(|j| j[1].parent = Some(JointId::from_index(1))), RigError::Parent("thigh".into()));
    assert_eq!(broken(|j| j[1].parent = Some(JointId::from_index(9))), RigError::Parent("thigh".into()));
    assert_eq!(broken(|j| j[2].rest_translation.x = f64::NAN), RigError::Rest("knee".into()));
    assert_eq!(
        broken(|j| j[2].rest_rotation = DQuat::from_xyzw(0.0, 0.0, 0.0, 0.5)),
        RigError::Rest("knee".into())
    );
    assert!(matches!(broken(|j| j[2].motion = hinge(Range::new(1.0, 0.0))), RigError::Range { .. }));
    assert!(matches!(broken(|j| j[2].motion = hinge(Range::new(f64::NAN, 0.0))), RigError::Range { .. }));
    let long = JointMotion::Hinge { axis: DVec3::ONE, range: Range::UNLIMITED };
    assert!(matches!(broken(|j| j[2].motion = long), RigError::Axis(..)));
    assert!(matches!(broken(|j| j[3].role = Some(Role::Hips)), RigError::DuplicateRole(..)));
    let follow =
        |leader: usize| Some(Mimic { leader: JointId::from_index(leader), multiplier: 1.0, offset: 0.0 });
    assert!(matches!(broken(|j| j[3].mimic = follow(1)), RigError::Mimic { .. }));
    assert!(matches!(broken(|j| j[3].mimic = follow(3)), RigError::Mimic { .. }));
    assert!(matches!(broken(|j| j[3].mimic = follow(7)), RigError::Mimic { .. }));
    let endless = Some(Mimic { leader: JointId::from_index(2), multiplier: f64::INFINITY, offset: 0.0 });
    assert!(matches!(broken(|j| j[3].mimic = endless), RigError::Mimic { .. }));
}

#[test]
fn a_follower_follows_and_narrows_its_leader() {
    let mut list = joints();
    list[3].mimic = Some(Mimic { leader: JointId::from_index(2), multiplier: -0.1, offset: 0.05 });
    let rig = build(list).unwrap();
    let (knee, tail) = (rig.joint("knee").unwrap(), rig.joint("tail").unwrap());
    // The slider's −0.1..0.1 allows the knee −0.5..1.5, of which its own 0..2 leaves 0..1.5.
    let range = rig.get(knee).unwrap().motion.ranges()[0];
    assert!(range.min == 0.0 && (range.max - 1.5).abs() < 1e-12);
    assert_eq!(rig.n_dofs(), 4);
    let mut pose = rig.rest_pose();
    pose.set_value(knee, 0.5).unwrap();
    assert!(pose.value(tail).unwrap().abs() < 1e-15);
    assert!(matches!(pose.set_value(tail, 0.0), Err(PoseError::Kind { .. })));
    pose.set_value(knee, range.max).unwrap();
    assert!((pose.frame(tail).unwrap().position.y - -0.1).abs() < 1e-15);
}

#[test]
fn names_aliases_roles_and_chains() {
    let rig = build(joints()).unwrap();
    assert_eq!(rig.joint("thigh_link").unwrap(), rig.joint("thigh").unwrap());
    assert_eq!(rig.joint("hips").unwrap().index(), 0);
    assert_eq!(rig.joint("nee").unwrap_err().nearest, ["knee"]);
    let names = |ids: Vec<JointId>| ids.iter().map(|i| rig.get(*i).unwrap().name.clone()).collect::<Vec<_>>();
    assert_eq!(names(rig.chain("thigh", "knee").unwrap()), ["thigh", "knee"]);
    assert_eq!(names(rig.chain("hips", "hips").unwrap()), ["hips"]);
    assert!(matches!(rig.chain("tail", "knee"), Err(ChainError::NotAnAncestor { .. })));
    assert!(matches!(rig.chain("tial", "knee"), Err(ChainError::Unknown(_))));
    assert_eq!(rig.root(), Some(JointId::from_index(0)));
}

#[test]
fn a_role_answers_only_where_no_joint_has_the_name() {
    let mut list = joints();
    list[0].role = None;
    list[1].role = Some(Role::Hips);
    let rig = build(list).unwrap();
    assert_eq!(rig.joint("hips").unwrap().index(), 0);
    assert_eq!(rig.role(Role::Hips).unwrap().index(), 1);
}

#[test]
fn poses_refuse_what_a_joint_does_not_have() {
    let rig = build(joints()).unwrap();
    let [hips, thigh, knee, tail] = [0, 1, 2, 3].map(JointId::from_index);
    let mut pose = rig.rest_pose();
    let before = pose.clone();
    assert!(matches!(pose.set_value(thigh, 1.0), Err(PoseError::Kind { .. })));
    assert!(matches!(pose.set_value(knee, f64::NAN), Err(PoseError::Value(_))));
    assert!(matches!(pose.set_euler(knee, [0.0; 3]), Err(PoseError::Kind { .. })));
    assert!(matches!(pose.set_rotation(hips, DQuat::IDENTITY), Err(PoseError::Kind { .. })));
    assert!(matches!(
        pose.set_rotation(thigh, DQuat::from_xyzw(0.0, 0.0, 0.0, 0.0)),
        Err(PoseError::Value(_))
    ));
    assert!(matches!(pose.set_translation(tail, DVec3::X), Err(PoseError::Kind { .. })));
    assert!(matches!(
        pose.set_value(JointId::from_index(77), 0.0),
        Err(PoseError::NoJoint(ForeignJoint { joint: 77, n_joints: 4 }))
    ));
    assert!(matches!(pose.retract(&[0.0]), Err(PoseError::Length { .. })));
    assert!(matches!(pose.retract(&[f64::NAN; 5]), Err(PoseError::Value(_))));
    assert!(matches!(Pose::from_coords(&rig, &[0.0]), Err(PoseError::Length { .. })));
    assert!(matches!(Pose::from_coords(&rig, &[0.0; 6]), Err(PoseError::Value(_))));
    assert_eq!(pose, before);
    pose.set_rotation(thigh, DQuat::from_xyzw(0.0, 0.0, 3e200, 3e200)).unwrap();
    assert!(pose.is_valid());
}

#[test]
fn transforms_come_apart_or_say_why_not() {
    let q = DQuat::from_axis_angle(DVec3::new(1.0, 2.0, 3.0).normalize(), 0.7);
    let t = DVec3::new(1.0, -2.0, 0.5);
    for scale in [DVec3::ONE, DVec3::splat(0.01), DVec3::new(-2.0, 2.0, 2.0), DVec3::new(1.0, 2.0, 3.0)] {
        let m = DAffine3::from_scale_rotation_translation(scale, q, t);
        let (rotation, translation, found) = decompose_affine(&m).unwrap();
        assert!(rotation.dot(q).abs() > 1.0 - 1e-12 && translation == t && found.abs_diff_eq(scale, 1e-12));
    }
    let mut sheared = DAffine3::IDENTITY;
    sheared.matrix3 = DMat3::from_cols(DVec3::X, DVec3::new(0.1, 1.0, 0.0), DVec3::Z);
    assert_eq!(decompose_affine(&sheared), Err(RigidError::Shear));
    assert_eq!(
        decompose_affine(&DAffine3::from_scale(DVec3::new(1.0, 0.0, 1.0))),
        Err(RigidError::Degenerate)
    );
    assert_eq!(
        decompose_affine(&DAffine3::from_scale(DVec3::splat(f64::INFINITY))),
        Err(RigidError::NotFinite)
    );
}
