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
        let at = |role: Role| rest.frame(rest.rig().role(role).unwrap()).unwrap().position;
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
    let path = format!("{}/../ikiru-formats/assets/robots/panda.urdf", env!("CARGO_MANIFEST_DIR"));
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

/// A body whose joints have names that say nothing, below a joint that turns all of it: hips, trunk and head, an arm and a leg.
const NAMELESS: &str = "HIERARCHY
ROOT top
{ OFFSET 0 0 0 CHANNELS 3 Zrotation Xrotation Yrotation
  JOINT j0
  { OFFSET 0 0 0 CHANNELS 3 Zrotation Xrotation Yrotation
    JOINT j1
    { OFFSET 0 0.3 0 CHANNELS 3 Zrotation Xrotation Yrotation
      JOINT j2
      { OFFSET 0 0.2 0 CHANNELS 3 Zrotation Xrotation Yrotation
        JOINT j3
        { OFFSET 0.2 0 0 CHANNELS 3 Zrotation Xrotation Yrotation
          JOINT j4 { OFFSET 0.3 0 0 CHANNELS 3 Zrotation Xrotation Yrotation End Site { OFFSET 0.1 0 0 } }
        }
      }
    }
    JOINT j5 { OFFSET 0.1 -0.1 0 CHANNELS 3 Zrotation Xrotation Yrotation End Site { OFFSET 0 -0.4 0 } }
  }
}
MOTION
Frames: 0
Frame Time: 0.0333
";

#[test]
fn roles_that_the_scenario_gives_are_names_for_every_key() {
    let folder = tempfile::tempdir().unwrap();
    std::fs::write(folder.path().join("body.bvh"), NAMELESS).unwrap();
    let scenario = |roles: &str| {
        let text = format!(
            "version = 1\nrig = \"body.bvh\"\nactive = [\"leftUpperArm\", \"leftLowerArm\", \"spine\"]\n{roles}\
             [limits.leftLowerArm]\nmin_deg = [0, -90, 0]\nmax_deg = [0, 5, 0]\n\
             [start]\nleftLowerArm = {{ euler_deg = [0, -10, 0] }}\n\
             [[objective]]\nkind = \"position\"\njoint = \"leftHand\"\ntarget = [0.25, 0.5, 0.3]\n\
             [[objective]]\nkind = \"known_rotation\"\nweight = 1e-4\nmandatory = false\n\
             joints = {{ spine = {{ euler_deg = [0, 0, 0] }} }}\n"
        );
        Scenario::parse(&text, "roles.toml", folder.path())
    };
    let unknown = scenario("").unwrap_err().to_string();
    assert!(unknown.contains("no joint or humanoid role 'leftLowerArm'"), "{unknown}");
    let given =
        [("hips", "j0"), ("spine", "j1"), ("leftUpperArm", "j2"), ("leftLowerArm", "j3"), ("leftHand", "j4")];
    let lines: Vec<String> = given.iter().map(|(role, joint)| format!("{role} = \"{joint}\"\n")).collect();
    let scenario = scenario(&format!("[roles]\n{}", lines.concat())).unwrap_or_else(|e| panic!("{e}"));
    let rig = &scenario.rig;
    for (role, joint) in given {
        assert_eq!(rig.joint(role).unwrap(), rig.joint(joint).unwrap());
        // What is read beside the rig has them too.
        assert_eq!(scenario.loaded.rig.role(role.parse().unwrap()), rig.joint(joint).ok());
    }
    let names: Vec<&str> = scenario.active.iter().map(|id| rig.joints()[id.index()].name.as_str()).collect();
    assert_eq!(names, ["j1", "j2", "j3"]);
    let mut pose = scenario.start.clone();
    assert_eq!(pose.euler(rig.joint("j3").unwrap()).unwrap()[1], (-10_f64).to_radians());
    assert!(scenario.solve(&mut pose, &mut scenario.workspace()).success);
    let hand = world_matrices(&pose)[rig.joint("j4").unwrap().index()].w_axis.truncate();
    assert!(hand.distance(DVec3::new(0.25, 0.5, 0.3)) < 1e-3, "{hand}");
}

#[test]
fn the_scenarios_roles_go_before_what_names_say() {
    let scenario = |roles: &str| {
        let text = format!(
            "version = 1\nrig = \"builtin:reference\"\n{roles}[[objective]]\nkind = \"position\"\n\
             joint = \"leftHand\"\ntarget = [0.2, 0.2, 0.3]\n"
        );
        Scenario::parse(&text, "roles.toml", ".").unwrap_or_else(|e| panic!("{e}"))
    };
    let name = |scenario: &Scenario, role: Role| {
        scenario.rig.role(role).map(|id| scenario.rig.joints()[id.index()].name.clone())
    };
    let as_named = scenario("");
    let changed = scenario("[roles]\nleftHand = \"left_elbow\"\n");
    assert_eq!(name(&as_named, Role::LeftHand).as_deref(), Some("left_wrist"));
    assert_eq!(name(&changed, Role::LeftHand).as_deref(), Some("left_elbow"));
    assert_eq!(changed.joint_name(0), Some("left_elbow"));
    // A joint has one role, a role one joint; all others stay as they were.
    assert_eq!(name(&changed, Role::LeftLowerArm), None);
    for role in Role::ALL.into_iter().filter(|role| ![Role::LeftHand, Role::LeftLowerArm].contains(role)) {
        assert_eq!(name(&changed, role), name(&as_named, role), "{role}");
    }
    let wrist = &changed.rig.joints()[changed.rig.joint("left_wrist").unwrap().index()];
    assert_eq!(wrist.role, None);
    let mut pose = changed.start.clone();
    assert!(changed.solve(&mut pose, &mut changed.workspace()).success);
    let elbow = world_matrices(&pose)[changed.rig.joint("left_elbow").unwrap().index()].w_axis.truncate();
    assert!(elbow.distance(DVec3::new(0.2, 0.2, 0.3)) < 1e-3, "{elbow}");
}

#[test]
fn the_root_that_floats_is_the_hips_of_the_scenarios_roles() {
    let folder = tempfile::tempdir().unwrap();
    std::fs::write(folder.path().join("body.bvh"), NAMELESS).unwrap();
    let root = |roles: &str| {
        let text = format!(
            "version = 1\nrig = \"body.bvh\"\nroot = \"free\"\n{roles}\
             [[objective]]\nkind = \"position\"\njoint = \"j4\"\ntarget = [0.25, 0.5, 0.3]\n"
        );
        let scenario = Scenario::parse(&text, "roles.toml", folder.path()).unwrap_or_else(|e| panic!("{e}"));
        let root = scenario.rig.floating_root().unwrap();
        scenario.rig.joints()[root.index()].name.clone()
    };
    assert_eq!(root(""), "top");
    assert_eq!(root("[roles]\nhips = \"j0\"\nspine = \"j1\"\nleftUpperLeg = \"j5\"\n"), "j0");
}
