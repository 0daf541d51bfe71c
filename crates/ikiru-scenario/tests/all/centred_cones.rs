//! `parent_rotation` and `joint_rotation` of `[limits.NAME]`: cones about other centres than the rest pose, judged by the
//! rotations of matrices that are made straight from the solved pose.
#![allow(clippy::unwrap_used, reason = "a test that cannot go on fails")]

use std::f64::consts::PI;

use glam::{DMat4, DQuat, DVec2, DVec3};
use ikiru_rig::{Pose, Role};
use ikiru_scenario::Scenario;
use ikiru_testkit::cones::largest_cone_excess;
use ikiru_testkit::reference::world_matrices;
use ikiru_testkit::rigs::Random;

/// Arms that rest in a T-pose and lower, with joints' axes of many kinds.
const CHARACTERS: [&str; 4] = [
    "assets/human.vrm",
    "tests/data/mh_female_mixamo.glb",
    "tests/data/mh_male_gameengine.glb",
    "tests/data/mh_male_vrm0.vrm",
];

fn path(file: &str) -> String {
    format!("{}/../ikiru-formats/{file}", env!("CARGO_MANIFEST_DIR"))
}

fn rotation(m: &DMat4) -> DQuat {
    m.to_scale_rotation_translation().1
}

/// A joint's rotation in its parent, that at rest included.
fn in_parent(pose: &Pose, role: Role) -> DQuat {
    let rig = pose.rig();
    let (joint, world) = (rig.role(role).unwrap(), world_matrices(pose));
    let parent = rig.joints()[joint.index()].parent.unwrap();
    rotation(&world[parent.index()]).inverse() * rotation(&world[joint.index()])
}

fn written(q: DQuat, length: f64) -> String {
    format!("{:?}", q.to_array().map(|number| number * length))
}

/// The swing about +z and −y and the twist about +x, which is the axis of the cones here.
fn about_x(l: DQuat) -> (DVec2, f64) {
    let arc = DQuat::from_rotation_arc(DVec3::X, l * DVec3::X);
    let (swing, twist) = (arc.to_scaled_axis(), arc.inverse() * l);
    (DVec2::new(swing.z, -swing.y), 2.0 * (twist.x / twist.w).atan())
}

#[test]
fn solved_arms_are_inside_cones_that_are_about_the_world_whatever_the_rest_pose_is() {
    let mut random = Random::new(1);
    for file in CHARACTERS {
        let bare = format!("version = 1\nrig = {:?}\n", path(file));
        let head = "[[objective]]\nkind = \"position\"\njoint = \"leftHand\"\ntarget = [0, 0, 0]\n";
        let rest = Scenario::parse(&format!("{bare}{head}"), "rest.toml", ".").unwrap().rig.rest_pose();
        let (rig, world) = (rest.rig().clone(), world_matrices(&rest));
        let of = |role: Role| world[rig.role(role).unwrap().index()];
        let shoulder = of(Role::LeftUpperArm).w_axis.truncate();
        let bone = of(Role::LeftLowerArm).w_axis.truncate() - shoulder;
        let reach = bone.length()
            + of(Role::LeftHand).w_axis.truncate().distance(of(Role::LeftLowerArm).w_axis.truncate());
        // The cone's +x is the bone, which in the middle goes down, sideways and forward, with no twist from the world's axes.
        let joint = rig.role(Role::LeftUpperArm).unwrap();
        let parent = rig.joints()[joint.index()].parent.unwrap();
        let (world_from_parent, world_from_joint) =
            (rotation(&world[parent.index()]), rotation(&of(Role::LeftUpperArm)));
        let middle = DQuat::from_rotation_arc(DVec3::X, DVec3::new(0.6, -0.6, 0.5).normalize());
        let at_rest = DQuat::from_rotation_arc(DVec3::X, bone.normalize());
        let (p, k) = (world_from_parent.inverse() * middle, world_from_joint.inverse() * at_rest);
        let limits = format!(
            "[limits.leftUpperArm]\naxis = [1, 0, 0]\nswing_deg = [40, 25]\ntwist_deg = [-30, 20]\n\
             parent_rotation = {}\njoint_rotation = {}\n",
            written(p, 3.0),
            written(k, -0.01)
        );
        let mut n_at_edges = 0;
        for _ in 0..20 {
            let target = shoulder + random.rotation() * DVec3::X * (reach * random.between(0.5, 1.0));
            let wish = format!(
                "[[objective]]\nkind = \"position\"\njoint = \"leftHand\"\ntarget = {:?}\n",
                target.to_array()
            );
            let text = format!("{bare}active = [\"leftUpperArm\", \"leftLowerArm\"]\n{limits}{wish}");
            let scenario = Scenario::parse(&text, "arm.toml", ".").unwrap_or_else(|error| panic!("{error}"));
            let mut pose = scenario.start.clone();
            scenario.solve(&mut pose, &mut scenario.workspace());
            let (swing, twist) = about_x(p.inverse() * in_parent(&pose, Role::LeftUpperArm) * k);
            let level = (swing / DVec2::new(40.0, 25.0) * (180.0 / PI)).length();
            assert!(level < 1.0 + 1e-7, "{file}: {level}");
            assert!((-30.0 - 1e-6..20.0 + 1e-6).contains(&twist.to_degrees()), "{file}: {twist}");
            assert!(largest_cone_excess(&pose) < 1e-9);
            n_at_edges += usize::from(level > 1.0 - 1e-6);
        }
        assert!(n_at_edges > 5, "{file}: {n_at_edges}");
    }
}

#[test]
fn a_rotation_left_out_is_the_identity_and_both_left_out_are_the_rest_pose() {
    let rig = path("tests/data/mh_female_mixamo.glb");
    let centre = |keys: &str| {
        let text = format!(
            "version = 1\nrig = {rig:?}\n[limits.leftUpperArm]\naxis = [1, 0, 0]\nswing_deg = [40, 25]\n{keys}\
             [[objective]]\nkind = \"position\"\njoint = \"leftHand\"\ntarget = [0, 0, 0]\n"
        );
        let scenario = Scenario::parse(&text, "arm.toml", ".").unwrap_or_else(|error| panic!("{error}"));
        let joint = scenario.rig.role(Role::LeftUpperArm).unwrap();
        scenario.rig.joints()[joint.index()].motion.cone().unwrap().centre()
    };
    assert_eq!(centre(""), None);
    let turn = DQuat::from_xyzw(0.0, 0.6, 0.0, 0.8);
    let found = centre("parent_rotation = [0, 6, 0, 8]\n").unwrap();
    assert!(found.parent_rotation.abs_diff_eq(turn, 1e-15));
    assert_eq!(found.joint_rotation, DQuat::IDENTITY);
    let found = centre("joint_rotation = [0, 6e200, 0, 8e200]\n").unwrap();
    assert!(found.joint_rotation.abs_diff_eq(turn, 1e-15));
    assert_eq!(found.parent_rotation, DQuat::IDENTITY);
}

#[test]
fn the_centre_that_the_documents_draw_is_half_way_down() {
    let text = std::fs::read_to_string(concat!(env!("CARGO_MANIFEST_DIR"), "/../../docs/axes.md")).unwrap();
    let numbers = "[0, 0, -0.3827, 0.9239], 45° about -z";
    assert!(text.contains(numbers));
    let p = DQuat::from_xyzw(0.0, 0.0, -0.3827, 0.9239).normalize();
    let down = DVec3::new(1.0, -1.0, 0.0).normalize();
    assert!((p * DVec3::X).distance(down) < 1e-4);
}
