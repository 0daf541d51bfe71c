//! Humanoid roles of every character that ships, by the names of its joints, and what the body says to them.
#![allow(clippy::unwrap_used, reason = "a test fails by a panic")]

use crate::common::*;
use glam::{DQuat, DVec3};
use ikiru_formats::{Warning, read, read_glb};
use ikiru_rig::humanoid::{RoleProblem, assign};
use ikiru_rig::{Rig, Role};
use serde_json::{Value, json};

/// The characters, the scheme of their names, and the roles that they have no bone for.
const CHARACTERS: [(&str, &str, &[Role]); 7] = [
    ("builtin:human", "unreal", &[Role::LeftEye, Role::RightEye, Role::Jaw]),
    ("builtin:reference", "smpl-x", &[]),
    ("mh_female_default163.glb", "makehuman", &[]),
    ("mh_female_mixamo.glb", "mixamo", &[Role::LeftEye, Role::RightEye, Role::Jaw]),
    ("mh_male_gameengine.glb", "unreal", &[Role::LeftEye, Role::RightEye, Role::Jaw]),
    ("mh_male_gameengine_lod10pc.glb", "unreal", &[Role::LeftEye, Role::RightEye, Role::Jaw]),
    ("mh_male_vrm1.vrm", "unreal", &[Role::LeftEye, Role::RightEye, Role::Jaw]),
];

fn at(rig: &Rig, role: Role) -> DVec3 {
    rig.rest_pose().frame(rig.role(role).unwrap()).unwrap().position
}

fn name(rig: &Rig, role: Role) -> &str {
    &rig.get(rig.role(role).unwrap()).unwrap().name
}

#[test]
fn every_character_has_every_role_that_it_has_a_bone_for() {
    for (file, scheme, without) in CHARACTERS {
        let loaded = read(path(file)).unwrap();
        assert_eq!(loaded.warnings, [], "{file}");
        let rig = &loaded.rig;
        for role in Role::ALL {
            assert_eq!(rig.role(role).is_none(), without.contains(&role), "{file}: {role}");
        }
        // By names alone as well, where the file tells the roles: both say the same.
        let assignment = assign(rig);
        assert_eq!(assignment.scheme, Some(scheme), "{file}");
        assert_eq!(assignment.problems, [], "{file}");
        assert_eq!(assignment.missing(), []);
        for (role, joint) in assignment.roles {
            assert_eq!(rig.role(role), Some(joint), "{file}: {role}");
        }
    }
}

#[test]
fn roles_lie_where_the_body_has_them() {
    for (file, _, without) in CHARACTERS {
        let rig = read(path(file)).unwrap().rig;
        for role in Role::ALL.into_iter().filter(|role| !without.contains(role)) {
            let p = at(&rig, role);
            if role.name().starts_with("left") {
                assert!(p.x > at(&rig, role.mirrored()).x + 0.01, "{file}: {role} is at +x");
            }
            // Below the nearest role above it in the tree.
            let above = role.ancestors().find_map(|role| rig.role(role));
            let joint = rig.role(role).unwrap();
            assert!(
                above.is_none_or(|above| rig.ancestors(joint).skip(1).any(|j| j == above)),
                "{file}: {role}"
            );
        }
        let heights = [Role::LeftFoot, Role::LeftLowerLeg, Role::Hips, Role::Spine, Role::Chest]
            .into_iter()
            .chain([Role::UpperChest, Role::Neck, Role::Head])
            .map(|role| at(&rig, role).y);
        let heights: Vec<f64> = heights.collect();
        // MakeHuman's lowest spine bone starts where the hips' bone ends, the reference's a little below.
        assert!(heights.windows(2).all(|pair| pair[0] < pair[1] + 0.03), "{file}: {heights:?}");
        assert!(at(&rig, Role::LeftToes).z > at(&rig, Role::LeftFoot).z, "{file}: it faces +z");
    }
}

#[test]
fn five_spine_bones_and_three_neck_bones_are_shared_out() {
    let rig = read(path("mh_female_default163.glb")).unwrap().rig;
    let names =
        [Role::Hips, Role::Spine, Role::Chest, Role::UpperChest, Role::Neck].map(|role| name(&rig, role));
    assert_eq!(names, ["root", "spine05", "spine03", "spine01", "neck01"]);
    assert_eq!(name(&rig, Role::LeftThumbMetacarpal), "finger1-1.L");
    assert_eq!(name(&rig, Role::RightLittleDistal), "finger5-3.R");
}

/// The Mixamo character under another root, and with changed nodes.
fn changed(root: Value, change: impl Fn(&mut Value)) -> ikiru_formats::Loaded {
    let (mut document, bin) = open(&std::fs::read(data("mh_female_mixamo.glb")).unwrap());
    let tops = document["scenes"][0]["nodes"].take();
    let nodes = document["nodes"].as_array_mut().unwrap();
    nodes.iter_mut().for_each(change);
    let mut root = root;
    root["children"] = tops;
    root["name"] = json!("top");
    nodes.push(root);
    let top = nodes.len() - 1;
    document["scenes"][0]["nodes"] = json!([top]);
    read_glb(&glb(&document, bin.as_deref()), "changed.glb").unwrap()
}

#[test]
fn a_copy_that_faces_backwards_keeps_its_roles_with_a_warning() {
    let original = read(path("mh_female_mixamo.glb")).unwrap().rig;
    for degrees in [180.0_f64, 90.0, -90.0] {
        let turn = DQuat::from_rotation_y(degrees.to_radians());
        let loaded = changed(json!({ "rotation": turn.to_array() }), |_| ());
        let [Warning::Role(RoleProblem::Facing { degrees: found })] = loaded.warnings[..] else {
            panic!("{:?}", loaded.warnings);
        };
        assert!((found.abs() - degrees.abs()).abs() < 1.0, "{found}");
        assert!(degrees.abs() > 179.0 || found * degrees > 0.0);
        for role in Role::ALL.into_iter().filter(|role| original.role(*role).is_some()) {
            assert_eq!(name(&loaded.rig, role), name(&original, role));
        }
    }
}

#[test]
fn a_character_on_its_back_keeps_its_roles_with_a_warning() {
    let turn = DQuat::from_rotation_x(-std::f64::consts::FRAC_PI_2);
    let loaded = changed(json!({ "rotation": turn.to_array() }), |_| ());
    let [Warning::Role(RoleProblem::NotUpright { up })] = &loaded.warnings[..] else {
        panic!("{:?}", loaded.warnings);
    };
    assert!(up[2] < -0.95);
    assert_eq!(name(&loaded.rig, Role::LeftHand), "mixamorig:LeftHand");
}

#[test]
fn in_a_mirrored_copy_left_is_where_the_body_has_it() {
    // Mirrored at the plane x = 0, node by node: the toes still point to +z.
    let loaded = changed(json!({}), |node| {
        for (member, signs) in
            [("translation", &[-1.0, 1.0, 1.0][..]), ("rotation", &[1.0, -1.0, -1.0, 1.0][..])]
        {
            for (i, value) in node[member].as_array_mut().into_iter().flatten().enumerate() {
                *value = json!(value.as_f64().unwrap() * signs[i]);
            }
        }
    });
    let left_hip = "mixamorig:LeftUpLeg".to_owned();
    assert_eq!(loaded.warnings, [Warning::Role(RoleProblem::Mirrored { left_hip })]);
    assert_eq!(name(&loaded.rig, Role::LeftHand), "mixamorig:RightHand");
    assert!(at(&loaded.rig, Role::LeftHand).x > 0.2);
}

#[test]
fn a_bone_in_the_wrong_place_has_no_role() {
    let loaded = changed(json!({}), |node| {
        if node["name"] == "mixamorig:LeftForeArm" {
            node["name"] = json!("spare");
        } else if node["name"] == "mixamorig:RightHandThumb3" {
            node["name"] = json!("mixamorig:LeftForeArm");
        }
    });
    assert_eq!(loaded.rig.role(Role::LeftLowerArm), None);
    assert_eq!(name(&loaded.rig, Role::LeftHand), "mixamorig:LeftHand");
    let text = loaded.warnings[0].to_string();
    assert!(text.contains("'mixamorig:LeftForeArm' has the name of the leftLowerArm"), "{text}");
    assert_eq!(loaded.warnings.len(), 1);
}

#[test]
fn what_is_no_humanoid_has_no_roles_and_no_warnings() {
    for file in ["webxr_generic_hand_left.glb", "webxr_generic_hand_right.glb"] {
        let loaded = read(path(file)).unwrap();
        assert_eq!(loaded.warnings, []);
        assert!(Role::ALL.iter().all(|role| loaded.rig.role(*role).is_none()), "{file}");
    }
}
