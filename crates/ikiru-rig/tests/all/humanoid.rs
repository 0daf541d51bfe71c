//! Roles by name, from lists of names alone: one rig a scheme; and roles that a user gives.
#![allow(clippy::unwrap_used, reason = "a test fails by a panic")]

use glam::DVec3;
use ikiru_rig::humanoid::{Assignment, RoleMapError, RoleProblem, assign};
use ikiru_rig::{Joint, JointId, JointMotion, Rig, RigBuilder, Role};

/// A rig from `name parent x y z` a line, `-` for no parent; the offset may be left out.
fn rig(text: &str) -> Rig {
    let mut builder = RigBuilder::new();
    let mut names: Vec<&str> = Vec::new();
    for line in text.lines().filter(|line| !line.trim().is_empty()) {
        let words: Vec<&str> = line.split_whitespace().collect();
        let parent = (words[1] != "-").then(|| {
            let idx = names.iter().position(|name| *name == words[1]);
            JointId::from_index(idx.unwrap_or_else(|| panic!("{} before {}", words[1], words[0])))
        });
        let mut joint = Joint::new(words[0], parent);
        if let [_, _, x, y, z] = words[..] {
            joint.rest_translation = DVec3::new(x.parse().unwrap(), y.parse().unwrap(), z.parse().unwrap());
        }
        builder.add(joint);
        names.push(words[0]);
    }
    builder.build().unwrap()
}

/// A name list in which `SIDE` stands for both sides.
fn both_sides(text: &str, sides: [&str; 2]) -> Rig {
    let mut lines = String::new();
    for line in text.lines() {
        if line.contains("SIDE") {
            for side in sides {
                lines.push_str(&line.replace("SIDE", side));
                lines.push('\n');
            }
        } else {
            lines.push_str(line);
            lines.push('\n');
        }
    }
    rig(&lines)
}

fn named<'r>(rig: &'r Rig, assignment: &Assignment, role: Role) -> Option<&'r str> {
    let found = assignment.roles.iter().find(|(found, _)| *found == role);
    found.map(|(_, joint)| rig.get(*joint).unwrap().name.as_str())
}

/// All that a rig's names tell, `role=name` a word.
fn told(rig: &Rig, scheme: &str) -> Vec<String> {
    let assignment = assign(rig);
    assert_eq!(assignment.scheme, Some(scheme));
    assert_eq!(assignment.problems, []);
    assert_eq!(assignment.missing(), []);
    Role::ALL
        .into_iter()
        .filter_map(|role| named(rig, &assignment, role).map(|name| format!("{role}={name}")))
        .collect()
}

fn assert_told(rig: &Rig, scheme: &str, expected: &str) {
    let mut expected: Vec<&str> = expected.split_whitespace().collect();
    let mut found = told(rig, scheme);
    expected.sort_unstable();
    found.sort_unstable();
    assert_eq!(found, expected);
}

const RIGIFY: &str = "
spine - 0 1 0
spine.001 spine 0 0.1 0
spine.002 spine.001 0 0.1 0
spine.003 spine.002 0 0.1 0
spine.004 spine.003 0 0.2 0
spine.005 spine.004 0 0.05 0
spine.006 spine.005 0 0.05 0
shoulder.SIDE spine.003
upper_arm.SIDE shoulder.SIDE
forearm.SIDE upper_arm.SIDE
hand.SIDE forearm.SIDE
palm.01.SIDE hand.SIDE
f_index.01.SIDE palm.01.SIDE
f_index.02.SIDE f_index.01.SIDE
f_index.03.SIDE f_index.02.SIDE
thumb.01.SIDE palm.01.SIDE
thumb.02.SIDE thumb.01.SIDE
thumb.03.SIDE thumb.02.SIDE
pelvis.SIDE spine
thigh.SIDE spine
shin.SIDE thigh.SIDE
foot.SIDE shin.SIDE
toe.SIDE foot.SIDE
heel.02.SIDE foot.SIDE
";

#[test]
fn rigify_meta_rig_and_deform_bones() {
    let meta = both_sides(RIGIFY, ["L", "R"]);
    let mut expected = String::from(
        "hips=spine spine=spine.001 chest=spine.002 upperChest=spine.003 neck=spine.004 head=spine.006 ",
    );
    for (side, letter) in [("left", "L"), ("right", "R")] {
        for (role, bone) in [
            ("Shoulder", "shoulder"),
            ("UpperArm", "upper_arm"),
            ("LowerArm", "forearm"),
            ("Hand", "hand"),
            ("IndexProximal", "f_index.01"),
            ("IndexIntermediate", "f_index.02"),
            ("IndexDistal", "f_index.03"),
            ("ThumbMetacarpal", "thumb.01"),
            ("ThumbProximal", "thumb.02"),
            ("ThumbDistal", "thumb.03"),
            ("UpperLeg", "thigh"),
            ("LowerLeg", "shin"),
            ("Foot", "foot"),
            ("Toes", "toe"),
        ] {
            expected.push_str(&format!("{side}{role}={bone}.{letter} "));
        }
    }
    assert_told(&meta, "rigify", &expected);

    // What Rigify generates: the same with DEF- before it, and controls with the plain names beside them.
    let mut deform = String::from("root -\nhead root\nneck root\nhand_fk.L root\n");
    for line in RIGIFY.lines().filter(|line| !line.is_empty()) {
        let words: Vec<&str> = line.split_whitespace().collect();
        let parent = if words[1] == "-" { "root".to_owned() } else { format!("DEF-{}", words[1]) };
        deform.push_str(&format!("DEF-{} {parent} {}\n", words[0], words[2..].join(" ")));
    }
    let expected: Vec<String> = expected.split_whitespace().map(|word| word.replace('=', "=DEF-")).collect();
    assert_told(&both_sides(&deform, ["L", "R"]), "rigify", &expected.join(" "));
}

/// The skeleton of the CMU motion-capture clips, in their unit.
const CMU: &str = "
Hips - 0 0 0
LHipJoint Hips 0 0 0
LeftUpLeg LHipJoint 1.36306 -1.79463 0.83929
LeftLeg LeftUpLeg 2.44811 -6.72613 0
LeftFoot LeftLeg 2.56220 -7.03959 0
LeftToeBase LeftFoot 0.15764 -0.43311 2.32255
RHipJoint Hips 0 0 0
RightUpLeg RHipJoint -1.30552 -1.79463 0.83929
RightLeg RightUpLeg -2.54253 -6.98555 0
RightFoot RightLeg -2.56826 -7.05623 0
RightToeBase RightFoot -0.16473 -0.45259 2.36315
LowerBack Hips 0 0 0
Spine LowerBack 0.02827 2.03559 -0.19338
Spine1 Spine 0.05672 2.04885 -0.04275
Neck Spine1 0 0 0
Neck1 Neck -0.05417 1.74624 0.17202
Head Neck1 0.10407 1.76136 -0.12397
LeftShoulder Spine1 0 0 0
LeftArm LeftShoulder 3.36241 1.20089 -0.31121
LeftForeArm LeftArm 4.98300 0 0
LeftHand LeftForeArm 3.48356 0 0
LeftFingerBase LeftHand 0 0 0
LFingers LeftFingerBase 0.71526 0 0
LThumb LeftHand 0 0 0
RightShoulder Spine1 0 0 0
RightArm RightShoulder -3.13660 1.37405 -0.40465
RightForeArm RightArm -5.24190 0 0
RightHand RightForeArm -3.44417 0 0
RightFingerBase RightHand 0 0 0
RFingers RightFingerBase -0.62253 0 0
RThumb RightHand 0 0 0
";

#[test]
fn cmu_motion_capture() {
    let expected = "hips=Hips spine=LowerBack chest=Spine upperChest=Spine1 neck=Neck head=Head \
        leftShoulder=LeftShoulder leftUpperArm=LeftArm leftLowerArm=LeftForeArm leftHand=LeftHand \
        leftThumbMetacarpal=LThumb leftMiddleProximal=LFingers \
        leftUpperLeg=LeftUpLeg leftLowerLeg=LeftLeg leftFoot=LeftFoot leftToes=LeftToeBase \
        rightShoulder=RightShoulder rightUpperArm=RightArm rightLowerArm=RightForeArm rightHand=RightHand \
        rightThumbMetacarpal=RThumb rightMiddleProximal=RFingers \
        rightUpperLeg=RightUpLeg rightLowerLeg=RightLeg rightFoot=RightFoot rightToes=RightToeBase";
    assert_told(&rig(CMU), "cmu", expected);
}

#[test]
fn of_the_hinges_of_a_robots_hip_the_thigh_starts_at_the_first() {
    let g1 = both_sides(
        "
pelvis - 0 0.8 0
SIDE_hip_pitch_joint pelvis
SIDE_hip_roll_joint SIDE_hip_pitch_joint
SIDE_hip_yaw_joint SIDE_hip_roll_joint
SIDE_knee_joint SIDE_hip_yaw_joint
SIDE_ankle_pitch_joint SIDE_knee_joint
SIDE_ankle_roll_joint SIDE_ankle_pitch_joint
waist_yaw_joint pelvis
waist_roll_joint waist_yaw_joint 0 0.1 0
waist_pitch_joint waist_roll_joint
head_joint waist_pitch_joint
SIDE_shoulder_pitch_joint waist_pitch_joint
SIDE_shoulder_roll_joint SIDE_shoulder_pitch_joint
SIDE_shoulder_yaw_joint SIDE_shoulder_roll_joint
SIDE_elbow_joint SIDE_shoulder_yaw_joint
SIDE_wrist_roll_joint SIDE_elbow_joint
SIDE_wrist_pitch_joint SIDE_wrist_roll_joint
SIDE_wrist_yaw_joint SIDE_wrist_pitch_joint
",
        ["left", "right"],
    );
    let mut expected = String::from(
        "hips=pelvis spine=waist_yaw_joint chest=waist_roll_joint upperChest=waist_pitch_joint head=head_joint ",
    );
    for side in ["left", "right"] {
        expected.push_str(&format!(
            "{side}UpperLeg={side}_hip_pitch_joint {side}LowerLeg={side}_knee_joint \
             {side}Foot={side}_ankle_roll_joint {side}UpperArm={side}_shoulder_pitch_joint \
             {side}LowerArm={side}_elbow_joint {side}Hand={side}_wrist_yaw_joint "
        ));
    }
    assert_told(&g1, "robot", &expected);

    let talos = both_sides(
        "
base_link - 0 1 0
torso_1_joint base_link 0 0.1 0
torso_2_joint torso_1_joint
head_1_joint torso_2_joint 0 0.3 0
head_2_joint head_1_joint
arm_SIDE_1_joint torso_2_joint
arm_SIDE_2_joint arm_SIDE_1_joint
arm_SIDE_3_joint arm_SIDE_2_joint
arm_SIDE_4_joint arm_SIDE_3_joint
arm_SIDE_5_joint arm_SIDE_4_joint
arm_SIDE_6_joint arm_SIDE_5_joint
arm_SIDE_7_joint arm_SIDE_6_joint
leg_SIDE_1_joint base_link
leg_SIDE_2_joint leg_SIDE_1_joint
leg_SIDE_3_joint leg_SIDE_2_joint
leg_SIDE_4_joint leg_SIDE_3_joint
leg_SIDE_5_joint leg_SIDE_4_joint
leg_SIDE_6_joint leg_SIDE_5_joint
",
        ["left", "right"],
    );
    let mut expected = String::from(
        "hips=base_link spine=torso_1_joint chest=torso_2_joint neck=head_1_joint head=head_2_joint ",
    );
    for side in ["left", "right"] {
        expected.push_str(&format!(
            "{side}UpperLeg=leg_{side}_1_joint {side}LowerLeg=leg_{side}_4_joint \
             {side}Foot=leg_{side}_6_joint {side}Shoulder=arm_{side}_1_joint \
             {side}UpperArm=arm_{side}_2_joint {side}LowerArm=arm_{side}_4_joint {side}Hand=arm_{side}_7_joint "
        ));
    }
    assert_told(&talos, "robot", &expected);
}

#[test]
fn other_names_of_a_joint_count_too() {
    let mut builder = both_sides(RIGIFY, ["L", "R"]).to_builder();
    for (idx, joint) in builder.joints_mut().iter_mut().enumerate() {
        joint.aliases = vec![std::mem::replace(&mut joint.name, format!("joint {idx}"))];
    }
    assert_eq!(told(&builder.build().unwrap(), "rigify").len(), 34);
}

#[test]
fn vrm_names_in_any_spelling_are_told_as_they_are() {
    // A spine without a chest, but with an upper chest: exact names count more than places.
    let mut text = String::new();
    for role in Role::ALL.into_iter().filter(|role| *role != Role::Chest) {
        let parent = role.ancestors().find(|role| *role != Role::Chest);
        let parent = parent.map_or("-".to_owned(), |parent| parent.name().to_uppercase());
        text.push_str(&format!("{} {parent}\n", role.name().to_uppercase()));
    }
    let found = told(&rig(&text), "vrm");
    assert_eq!(found.len(), 54);
    assert!(found.contains(&"upperChest=UPPERCHEST".to_owned()));
}

#[test]
fn too_few_bones_are_no_humanoid() {
    let legs = rig("Hips -\nLeftUpLeg Hips\nLeftLeg LeftUpLeg\nRightUpLeg Hips\nRightLeg RightUpLeg");
    assert_eq!(assign(&legs), Assignment::default());
}

#[test]
fn a_user_may_say_which_joint_is_what() {
    let mut builder = rig(CMU).to_builder();
    assert_eq!(builder.assign_roles().scheme, Some("cmu"));
    let pairs =
        [(Role::LeftHand, "LFingers"), (Role::LeftMiddleProximal, "LThumb"), (Role::Jaw, "LHipJoint")];
    builder.set_roles(pairs).unwrap();
    let rig = builder.clone().build().unwrap();
    let name = |role: Role| rig.role(role).map(|joint| rig.get(joint).unwrap().name.as_str());
    assert_eq!(name(Role::LeftHand), Some("LFingers"));
    assert_eq!(name(Role::LeftMiddleProximal), Some("LThumb"));
    assert_eq!(name(Role::LeftThumbMetacarpal), None);
    assert_eq!(name(Role::Jaw), Some("LHipJoint"));
    assert_eq!(name(Role::Hips), Some("Hips"));

    let error = builder.set_roles([(Role::LeftHand, "LeftHnad")]).unwrap_err();
    assert!(
        error.to_string().starts_with("leftHand: there is no 'LeftHnad'; did you mean 'LeftHand'"),
        "{error}"
    );
    let error = builder.set_roles([(Role::LeftHand, "Hips"), (Role::Head, "Hips")]).unwrap_err();
    assert_eq!(error.to_string(), "joint 'Hips' cannot be both leftHand and head");
    assert!(matches!(error, RoleMapError::Twice { .. }));
    assert_eq!(builder.build().unwrap().role(Role::LeftHand), rig.role(Role::LeftHand), "nothing changed");
}

/// Legs and trunk side by side under one joint, in the shape of a popular pack.
const SIDE_BY_SIDE: &str = "
    Root - 0 0 0
    Body Root 0 0.8 0
    Hips Body 0 0.05 0
    Abdomen Hips 0 0.1 0
    Torso Abdomen 0 0.1 0
    Neck Torso 0 0.3 0
    Head Neck 0 0.1 0
    Shoulder.SIDE Torso SIGN0.1 0.25 0
    UpperArm.SIDE Shoulder.SIDE SIGN0.1 0 0
    LowerArm.SIDE UpperArm.SIDE SIGN0.25 0 0
    Hand.SIDE LowerArm.SIDE SIGN0.25 0 0
    UpperLeg.SIDE Body SIGN0.1 -0.05 0
    LowerLeg.SIDE UpperLeg.SIDE 0 -0.35 0
    Foot.SIDE LowerLeg.SIDE 0 -0.35 0";

fn side_by_side(change: impl Fn(String) -> String) -> Rig {
    let mut lines = String::new();
    for line in change(SIDE_BY_SIDE.to_owned()).lines() {
        let of = |side: &str, sign: &str| line.replace("SIDE", side).replace("SIGN", sign) + "\n";
        lines += &of("L", "");
        if line.contains("SIDE") {
            lines += &of("R", "-");
        }
    }
    rig(&lines)
}

#[test]
fn what_carries_legs_and_trunk_side_by_side_is_the_hips() {
    let skeleton = side_by_side(|text| text);
    let assignment = assign(&skeleton);
    let problem = RoleProblem::HipsByStructure { joint: "Body".into(), named: Some("Hips".into()) };
    assert_eq!(assignment.problems, std::slice::from_ref(&problem));
    let text = problem.to_string();
    assert!(text.contains("'Body' is the hips") && text.contains("'Hips' carries no legs"), "{text}");
    assert_eq!(assignment.missing(), []);
    for (role, name) in [(Role::Hips, "Body"), (Role::Spine, "Abdomen"), (Role::LeftUpperLeg, "UpperLeg.L")] {
        assert_eq!(named(&skeleton, &assignment, role), Some(name));
    }
    // It is what floats, and takes legs and trunk along.
    let mut builder = skeleton.to_builder();
    for joint in builder.joints_mut() {
        joint.motion = JointMotion::BALL;
    }
    builder.assign_roles();
    let root = builder.free_root().unwrap();
    assert_eq!(builder.joints()[root.index()].name, "Body");

    // The joint that is called the hips is the spine where nothing else is.
    let short = side_by_side(|text| {
        let text = text.replace("Abdomen Hips", "Middle Hips").replace("Torso Abdomen", "Trunk Middle");
        text.replace(" Torso ", " Trunk ")
    });
    let assignment = assign(&short);
    assert_eq!(named(&short, &assignment, Role::Spine), Some("Hips"));
    assert_eq!(named(&short, &assignment, Role::Hips), Some("Body"));
    // Without a joint of that name at all.
    let unnamed = side_by_side(|text| text.replace("Hips", "Belly"));
    let assignment = assign(&unnamed);
    let problem = RoleProblem::HipsByStructure { joint: "Body".into(), named: None };
    assert_eq!(assignment.problems, [problem]);
    assert_eq!(assignment.missing(), []);
}

#[test]
fn what_carries_legs_and_trunk_from_the_ground_is_no_hips() {
    // The node of the scene carries everything too, but stands where the feet are.
    let loose = side_by_side(|text| {
        text.replace("UpperLeg.SIDE Body SIGN0.1 -0.05 0", "UpperLeg.SIDE Root SIGN0.1 0.75 0")
    });
    let assignment = assign(&loose);
    assert_eq!(named(&loose, &assignment, Role::Hips), None);
    assert!(matches!(&assignment.problems[..], [RoleProblem::Order { role: Role::Hips, .. }]));
}
