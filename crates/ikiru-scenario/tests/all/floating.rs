//! `root = "free"`: what carries everything that moves floats, and everything goes with it.
#![allow(clippy::unwrap_used, reason = "a test fails by a panic")]

use glam::DVec3;
use ikiru_rig::{JointMotion, Pose};
use ikiru_scenario::{Error, Scenario};

fn solved(text: &str) -> (Scenario, Pose) {
    let scenario = Scenario::parse(text, "test.toml", "").unwrap();
    let (mut pose, mut workspace) = (scenario.start.clone(), scenario.workspace());
    let success = scenario.solve(&mut pose, &mut workspace).success;
    assert!(success, "{text}");
    (scenario, pose)
}

fn at(pose: &Pose, joint: &str) -> DVec3 {
    pose.frame(pose.rig().joint(joint).unwrap()).unwrap().position
}

/// The error with what caused it.
fn whole(error: &Error) -> String {
    let causes = std::iter::successors(Some(error as &dyn std::error::Error), |e| e.source());
    causes.map(ToString::to_string).collect::<Vec<_>>().join(": ")
}

fn reach(rig: &str, joint: &str, target: [f64; 3]) -> String {
    format!(
        "version = 1\nrig = \"{rig}\"\nroot = \"free\"\n\
         [[objective]]\nkind = \"position\"\njoint = \"{joint}\"\ntarget = {target:?}\n"
    )
}

#[test]
fn a_robot_goes_with_its_pelvis_whatever_is_pulled() {
    for joint in ["left_ankle_roll_joint", "left_rubber_hand", "pelvis"] {
        let (scenario, pose) = solved(&reach("builtin:g1", joint, [3.0, 3.0, 3.0]));
        let rig = &scenario.rig;
        let root = rig.floating_root().unwrap();
        assert_eq!(root, rig.joint("pelvis").unwrap(), "{joint}");
        assert!(at(&pose, joint).distance(DVec3::splat(3.0)) < 1.1e-3, "{joint}");
        // A joint lies as far from its parent as at rest: nothing was torn off.
        let rest = rig.rest_pose();
        for id in rig.ids().filter(|id| *id != root) {
            let parent = rig.get(id).unwrap().parent.unwrap_or(root);
            let apart =
                |pose: &Pose| pose.frame(id).unwrap().position.distance(pose.frame(parent).unwrap().position);
            assert!((apart(&pose) - apart(&rest)).abs() < 1e-9);
        }
    }
}

/// Two chains of two joints, as one glTF text: roots of the scene, or below one node.
fn two_skeletons(is_joined: bool) -> String {
    let scene = if is_joined { "[4]" } else { "[0, 2]" };
    format!(
        r#"{{"asset": {{"version": "2.0"}}, "scene": 0, "scenes": [{{"nodes": {scene}}}],
        "nodes": [
            {{"name": "a", "children": [1]}}, {{"name": "a tip", "translation": [0, 1, 0]}},
            {{"name": "b", "children": [3], "translation": [1, 0, 0]}},
            {{"name": "b tip", "translation": [0, 1, 0]}}{}],
        "skins": [{{"joints": [0, 1]}}, {{"joints": [2, 3]}}]}}"#,
        if is_joined { r#", {"name": "both", "children": [0, 2]}"# } else { "" }
    )
}

#[test]
fn two_skeletons_float_by_what_carries_both_or_are_refused() {
    let folder = tempfile::tempdir().unwrap();
    let parse = |is_joined: bool| -> Result<Scenario, Error> {
        std::fs::write(folder.path().join("two.gltf"), two_skeletons(is_joined)).unwrap();
        Scenario::parse(&reach("two.gltf", "a tip", [3.0, 3.0, 3.0]), "test.toml", folder.path())
    };
    let scenario = parse(true).unwrap();
    assert_eq!(scenario.rig.floating_root(), scenario.rig.joint("both").ok());
    let (mut pose, mut workspace) = (scenario.start.clone(), scenario.workspace());
    assert!(scenario.solve(&mut pose, &mut workspace).success);
    assert!((at(&pose, "b") - at(&pose, "a")).length() - 1.0 < 1e-9);
    let error = parse(false).unwrap_err();
    let text = whole(&error);
    for words in ["test.toml:3:8", "cannot float", "'a' and 'b' hang on different roots"] {
        assert!(text.contains(words), "{text}");
    }
}

#[test]
fn a_motion_file_whose_root_only_turns_floats_all_the_same() {
    let folder = tempfile::tempdir().unwrap();
    let bvh = "HIERARCHY\nROOT b0\n{\nOFFSET 0 0 0\nCHANNELS 3 Zrotation Xrotation Yrotation\nJOINT b1\n{\n\
               OFFSET 0 1 0\nCHANNELS 3 Zrotation Xrotation Yrotation\nEnd Site\n{\nOFFSET 0 1 0\n}\n}\n}\n\
               MOTION\nFrames: 1\nFrame Time: 0.1\n0 0 0 0 0 0\n";
    std::fs::write(folder.path().join("turns.bvh"), bvh).unwrap();
    let text = reach("turns.bvh", "b1_end", [3.0, 3.0, 3.0]);
    let scenario = Scenario::parse(&text, "test.toml", folder.path()).unwrap();
    assert_eq!(scenario.rig.joints()[0].motion, JointMotion::FREE);
    let (mut pose, mut workspace) = (scenario.start.clone(), scenario.workspace());
    assert!(scenario.solve(&mut pose, &mut workspace).success);
}

#[test]
fn joints_above_the_root_that_floats_are_refused() {
    let text = reach("builtin:human", "leftHand", [0.3, 1.2, 0.4])
        + "[limits.Root]\naxis = [0, 1, 0]\nswing_deg = [10, 10]\n";
    let error = Scenario::parse(&text, "test.toml", "").unwrap_err();
    let text = whole(&error);
    for words in ["test.toml:8:9", "'Root'", "above the free root, 'pelvis'", "no limits"] {
        assert!(text.contains(words), "{text}");
    }
    let text = reach("builtin:human", "leftHand", [0.3, 1.2, 0.4])
        .replace("root =", "active = [\"Root\", \"leftHand\"]\nroot =");
    let text = whole(&Scenario::parse(&text, "test.toml", "").unwrap_err());
    for words in ["test.toml:3:11", "'Root' lies above the free root", "expected 'pelvis'"] {
        assert!(text.contains(words), "{text}");
    }
}

#[test]
fn a_root_translates_along_the_axes_in_which_targets_are_given() {
    for (rig, turned) in [("builtin:human", false), ("builtin:g1", false), ("builtin:g1", true)] {
        let world = if turned { "world = \"file\"\n" } else { "" };
        let text = format!(
            "version = 1\nrig = \"{rig}\"\nroot = \"free\"\n{world}[start]\nroot_translation = [1, 2, 3]\n"
        ) + "[[objective]]\nkind = \"rest_pose\"\n";
        let scenario = Scenario::parse(&text, "test.toml", "").unwrap();
        let root = scenario.rig.floating_root().unwrap();
        let moved = scenario.start.frame(root).unwrap().position
            - scenario.rig.rest_pose().frame(root).unwrap().position;
        let expected = scenario.world_from_targets() * DVec3::new(1.0, 2.0, 3.0);
        assert!(moved.distance(expected) < 1e-12, "{rig} {turned}: {moved}");
    }
}
