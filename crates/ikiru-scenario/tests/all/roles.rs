//! One scenario in humanoid roles on every character and skeleton that ships, whatever its joints are called.
#![allow(clippy::unwrap_used, reason = "a test that cannot go on fails")]

use glam::DVec3;
use ikiru_rig::Role;
use ikiru_scenario::Scenario;
use ikiru_testkit::reference::world_matrices;

const CHARACTERS: [(&str, f64); 8] = [
    ("assets/human.vrm", 1.0),
    ("tests/data/mh_female_default163.glb", 1.0),
    ("tests/data/mh_female_mixamo.glb", 1.0),
    ("tests/data/mh_male_gameengine.glb", 1.0),
    ("tests/data/mh_male_gameengine_lod10pc.glb", 1.0),
    ("tests/data/mh_male_vrm1.vrm", 1.0),
    ("tests/data/mh_male_vrm0.vrm", 1.0),
    ("tests/data/mocap/cmu_01_01_30fps.bvh", 0.056_444),
];

/// Both hands to points, the head looking at a point, the hips free.
fn scenario(rig: &str, scale: f64, size: f64) -> Scenario {
    let at = |v: DVec3| format!("{:?}", (v * size).to_array());
    let text = format!(
        "version = 1\nrig = {rig:?}\nroot = \"free\"\nscale = {scale}\n\
         [[objective]]\nkind = \"position\"\njoint = \"leftHand\"\ntarget = {}\n\
         [[objective]]\nkind = \"position\"\njoint = \"rightHand\"\ntarget = {}\n\
         [[objective]]\nkind = \"look_at\"\njoint = \"head\"\naxis = [0, 0, 1]\ntarget = {}\nweight = 0.1\n\
         [[objective]]\nkind = \"rest_pose\"\nweight = 0.0001\n",
        at(DVec3::new(0.15, 0.75, 0.25)),
        at(DVec3::new(-0.12, 0.62, 0.22)),
        at(DVec3::new(0.3, 0.8, 1.2)),
    );
    Scenario::parse(&text, "roles.toml", ".").unwrap_or_else(|e| panic!("{e}"))
}

#[test]
fn both_hands_reach_and_the_head_looks_on_every_character() {
    for (file, scale) in CHARACTERS {
        let path = format!("{}/../ikiru-formats/{file}", env!("CARGO_MANIFEST_DIR"));
        // Targets grow with the body: its height at rest, from the feet to the head.
        let rest = scenario(&path, scale, 1.0).rig.rest_pose();
        let at = |role: Role| rest.frame(rest.rig().role(role).unwrap()).origin.value();
        let size = (at(Role::Head) - at(Role::LeftFoot)).y / 0.85;
        assert!((1.2..2.3).contains(&size), "{file}: {size}");
        let scenario = scenario(&path, scale, size);
        let mut pose = scenario.start.clone();
        let mut workspace = scenario.workspace();
        let report = scenario.solve(&mut pose, &mut workspace);
        assert!(report.success, "{file}: {:?}", report.terms);
        let world = world_matrices(&pose);
        let of = |role: Role| world[scenario.rig.role(role).unwrap().index()];
        let hand = |role: Role| of(role).w_axis.truncate() / size;
        assert!(hand(Role::LeftHand).distance(DVec3::new(0.15, 0.75, 0.25)) < 1.1e-3, "{file}");
        assert!(hand(Role::RightHand).distance(DVec3::new(-0.12, 0.62, 0.22)) < 1.1e-3, "{file}");
        let head = of(Role::Head);
        let gaze = head.transform_vector3(DVec3::Z);
        let wanted = DVec3::new(0.3, 0.8, 1.2) * size - head.w_axis.truncate();
        assert!(gaze.angle_between(wanted) < 0.6_f64.to_radians(), "{file}");
    }
}

#[test]
fn targets_in_the_files_own_world_are_the_same_wish() {
    let path = format!("{}/../ikiru-formats/tests/data/robots/panda.urdf", env!("CARGO_MANIFEST_DIR"));
    // x forward, y left, z up in the file; z forward, x left, y up here.
    let solve = |world: &str, target: [f64; 3]| {
        let text = format!(
            "version = 1\nrig = {path:?}\nworld = {world:?}\n[[objective]]\nkind = \"position\"\n\
             joint = \"panda_link8\"\ntarget = {target:?}\n"
        );
        let scenario = Scenario::parse(&text, "file.toml", ".").unwrap();
        let mut pose = scenario.start.clone();
        let mut workspace = scenario.workspace();
        assert!(scenario.solve(&mut pose, &mut workspace).success);
        assert_eq!(
            scenario.target_json(0)[0].as_f64().map(|x| (x * 1e9).round()),
            Some((target[0] * 1e9).round())
        );
        pose.coords().to_vec()
    };
    let (a, b) = (solve("file", [0.4, 0.1, 0.5]), solve("scene", [0.1, 0.5, 0.4]));
    assert!(a.iter().zip(&b).all(|(x, y)| (x - y).abs() < 1e-9), "{a:?} {b:?}");
}
