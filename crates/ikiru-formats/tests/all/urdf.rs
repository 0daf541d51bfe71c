//! Robots are read as they are: types, limits, axes, names, followers, solids, and the world they stand in.
#![allow(clippy::unwrap_used, reason = "a test fails by a panic")]

use std::f64::consts::{FRAC_PI_2, PI};

use crate::common::*;
use glam::{DMat3, DQuat, DVec3};
use ikiru_formats::urdf::UrdfWarning;
use ikiru_formats::{Loaded, Warning, read, read_urdf};
use ikiru_rig::{Joint, JointMotion, Range, ShapeKind};

/// A robot of links `a` to `d` and whatever else stands in it.
fn robot(inside: &str) -> Loaded {
    let text = format!(
        r#"<robot name="r"><link name="a"/><link name="b"/><link name="c"/><link name="d"/>{inside}</robot>"#
    );
    read_urdf(text.as_bytes(), "r.urdf").unwrap()
}

fn joint<'l>(loaded: &'l Loaded, name: &str) -> &'l Joint {
    loaded.rig.get(loaded.rig.joint(name).unwrap()).unwrap()
}

/// A chain from `a` to `d`, with something inside its first joint.
fn chain(kind: &str, inside: &str) -> Loaded {
    robot(&format!(
        r#"<joint name="one" type="{kind}"><parent link="a"/><child link="b"/>{inside}</joint>
           <joint name="two" type="continuous"><parent link="b"/><child link="c"/></joint>
           <joint name="three" type="fixed"><parent link="c"/><child link="d"/></joint>"#
    ))
}

#[test]
fn every_robot_loads() {
    for (name, n_links, n_dofs) in ROBOTS {
        let loaded = read(robot_file(name)).unwrap();
        // Two joints more for a planar one.
        let n_joints = if name == "kinds" { n_links + 2 } else { n_links };
        assert_eq!((loaded.rig.n_joints(), loaded.rig.n_dofs()), (n_joints, n_dofs), "{name}");
        // Those that are y up in their own files lie on their sides, and are told so.
        let warnings: Vec<String> = loaded.warnings.iter().map(ToString::to_string).collect();
        assert_eq!(
            warnings.len(),
            usize::from(["deepmimic_humanoid", "human"].contains(&name)),
            "{name}: {warnings:?}"
        );
        assert!(warnings.iter().all(|w| w.contains("up")), "{warnings:?}");
        assert!(loaded.clips.is_empty() && loaded.source().is_none());
        // The root link, and every link by its own name or that of the joint above it.
        assert_eq!(
            (&loaded.rig.joints()[0].motion, loaded.rig.joints()[0].parent),
            (&JointMotion::Fixed, None)
        );
        assert!(loaded.rig.joints()[1..].iter().all(|j| j.parent.is_some()), "{name}");
    }
}

#[test]
fn the_limits_of_the_panda_are_those_of_its_data_sheet() {
    let panda = read(robot_file("panda")).unwrap();
    let ranges = [
        (-2.8973, 2.8973),
        (-1.7628, 1.7628),
        (-2.8973, 2.8973),
        (-3.0718, -0.0698),
        (-2.8973, 2.8973),
        (-0.0175, 3.7525),
        (-2.8973, 2.8973),
    ];
    for (number, (min, max)) in (1..).zip(ranges) {
        let hinge = JointMotion::Hinge { axis: DVec3::Z, range: Range::new(min, max) };
        assert_eq!(joint(&panda, &format!("panda_joint{number}")).motion, hinge, "{number}");
    }
    let finger = |name, axis| {
        assert_eq!(joint(&panda, name).motion, JointMotion::Slider { axis, range: Range::new(0.0, 0.04) });
    };
    finger("panda_finger_joint1", DVec3::Y);
    finger("panda_finger_joint2", DVec3::NEG_Y);
    // Rest is outside of the fourth joint's range: projected, it is at its nearest end.
    let mut pose = panda.rig.rest_pose();
    assert!((pose.limit_violation() - 0.0698).abs() < 1e-15);
    assert!(pose.project());
    assert_eq!(pose.value(panda.rig.joint("panda_joint4").unwrap()), Some(-0.0698));
    // The second finger follows the first.
    let fingers = ["panda_finger_joint1", "panda_finger_joint2"].map(|n| panda.rig.joint(n).unwrap());
    pose.set_value(fingers[0], 0.03).unwrap();
    assert_eq!(pose.value(fingers[1]), Some(0.03));
    assert_eq!(panda.rig.joint("panda_hand_tcp").unwrap(), panda.rig.joint("panda_hand_tcp_joint").unwrap());
}

#[test]
fn robots_stand_upright_in_the_world() {
    let loaded = robot(
        r#"<joint name="front" type="fixed"><parent link="a"/><child link="b"/><origin xyz="1 0 0"/></joint>
           <joint name="left" type="fixed"><parent link="a"/><child link="c"/><origin xyz="0 1 0"/></joint>
           <joint name="top" type="fixed"><parent link="a"/><child link="d"/><origin xyz="0 0 1"/></joint>"#,
    );
    let pose = loaded.rig.rest_pose();
    let at = |name| pose.frame(loaded.rig.joint(name).unwrap()).unwrap().position;
    assert_eq!((at("front"), at("left"), at("top")), (DVec3::Z, DVec3::X, DVec3::Y));
    let world_from_file = loaded.world_from_file();
    assert_eq!(world_from_file * DVec3::new(1.0, 2.0, 3.0), DVec3::new(2.0, 3.0, 1.0));
    assert_eq!(DMat3::from_quat(world_from_file).determinant(), 1.0);
    assert_eq!(read("builtin:reference").unwrap().world_from_file(), DQuat::IDENTITY);
    // A robot with a head has it on top, and its left hand at +x.
    let g1 = read(robot_file("g1_29dof_with_hand_rev_1_0")).unwrap();
    let frame = |name| g1.rig.rest_pose().frame(g1.rig.joint(name).unwrap()).unwrap().position;
    assert!(frame("d435_link").y > 0.4 && frame("left_ankle_roll_link").y < -0.7);
    assert!(frame("left_wrist_yaw_link").x > 0.1 && frame("right_wrist_yaw_link").x < -0.1);
    assert!(frame("left_hand_palm_link").z > 0.2);
}

#[test]
fn changes_of_the_rig_keep_the_world_the_solids_and_the_masses() {
    let loaded = read(robot_file("kinds")).unwrap();
    let (world, n_shapes) = (loaded.world_from_file(), loaded.collision_shapes().len());
    let rig = loaded.rig.to_builder().build().unwrap();
    let loaded = loaded.with_rig(rig).unwrap();
    assert_eq!((loaded.world_from_file(), loaded.collision_shapes().len()), (world, n_shapes));
    assert_eq!(n_shapes, 1);
    let g1 = read("builtin:g1").unwrap();
    let segments = g1.segments().to_vec();
    assert_eq!(segments.len(), 35);
    let mut builder = g1.rig.to_builder();
    builder.free_root().unwrap();
    let floating = g1.with_rig(builder.build().unwrap()).unwrap();
    assert_eq!(floating.segments(), segments);
    assert_eq!(floating.carrying_clips().unwrap().segments(), segments);
}

#[test]
fn masses_are_those_of_the_joint_above_their_link() {
    // A fixed link's goes with what carries it; the root link has a joint too.
    let heavy =
        |name: &str, inside: &str| format!(r#"<link name="{name}"><inertial>{inside}</inertial></link>"#);
    let text = format!(
        r#"<robot>{}{}{}{}{}
           <joint name="turn" type="continuous"><parent link="a"/><child link="b"/></joint>
           <joint name="stay" type="fixed"><parent link="b"/><child link="c"/><origin xyz="0 0 1"/></joint>
           <joint name="flat" type="planar"><parent link="a"/><child link="d"/></joint>
           <joint name="end" type="fixed"><parent link="a"/><child link="e"/></joint></robot>"#,
        heavy("a", r#"<mass value="2"/>"#),
        heavy("b", r#"<inertia ixx="no number"/><mass value=" 1e-1 "/><origin xyz="0.1 0 0" rpy="1 2 3"/>"#),
        heavy("c", r#"<origin xyz="0 0.2 0"/><mass value="0.5"/>"#),
        heavy("d", r#"<origin xyz="0 0 0.3"/><mass value="3"/>"#),
        // Massless, in two ways.
        r#"<link name="e"><inertial><mass value="0"/></inertial></link><link name="f"><inertial/></link>
           <joint name="last" type="fixed"><parent link="e"/><child link="f"/></joint>"#,
    );
    let loaded = read_urdf(text.as_bytes(), "r.urdf").unwrap();
    let name = |id| loaded.rig.get(id).unwrap().name.as_str();
    let found: Vec<_> = loaded.segments().iter().map(|s| (name(s.joint), s.kg, s.center)).collect();
    let expected = [
        ("a", 2.0, DVec3::ZERO),
        ("turn", 0.1, DVec3::new(0.1, 0.0, 0.0)),
        ("stay", 0.5, DVec3::new(0.0, 0.2, 0.0)),
        ("flat", 3.0, DVec3::new(0.0, 0.0, 0.3)),
    ];
    assert_eq!(found, expected);
    assert!(loaded.warnings.is_empty(), "{:?}", loaded.warnings);
    let twice = r#"<robot><link name="a"><inertial><mass value="1"/><mass value="2"/></inertial>
                   <inertial><mass value="-1"/></inertial></link></robot>"#;
    let loaded = read_urdf(twice.as_bytes(), "r.urdf").unwrap();
    assert_eq!(loaded.segments().iter().map(|s| s.kg).collect::<Vec<_>>(), [1.0]);
    let warnings: Vec<String> = loaded.warnings.iter().map(ToString::to_string).collect();
    let said = [
        "link 'a' has another <mass> in line 1, the first was used",
        "link 'a' has another <inertial> in line 2, the first was used",
    ];
    assert_eq!(warnings, said);
    assert!(read("builtin:human").unwrap().segments().is_empty());
}

#[test]
fn types_become_motions() {
    let limit = r#"<limit lower="-0.5" upper="1"/>"#;
    let (axis, range) = (DVec3::X, Range::new(-0.5, 1.0));
    let of = |kind, inside| joint(&chain(kind, inside), "one").motion;
    assert_eq!(of("revolute", limit), JointMotion::Hinge { axis, range });
    assert_eq!(of("prismatic", limit), JointMotion::Slider { axis, range });
    assert_eq!(of("continuous", limit), JointMotion::Hinge { axis, range: Range::UNLIMITED });
    assert_eq!(of("fixed", limit), JointMotion::Fixed);
    assert_eq!(of("floating", ""), JointMotion::FREE);
    assert_eq!(of("spherical", ""), JointMotion::BALL);
    // One end alone leaves the other at 0; an infinite end is none.
    let range_of = |limit| of("revolute", limit).ranges()[0];
    assert_eq!(range_of(r#"<limit upper="2" effort="1"/>"#), Range::new(0.0, 2.0));
    assert_eq!(range_of(r#"<limit lower="-2"/>"#), Range::new(-2.0, 0.0));
    assert_eq!(range_of(r#"<limit lower="-inf" upper=" 3e0 "/>"#), Range::new(f64::NEG_INFINITY, 3.0));
    assert!(range_of(r#"<limit lower="-inf" upper="inf"/>"#).is_unlimited());
}

#[test]
fn leftovers_in_joints_that_cannot_have_them_do_no_harm() {
    let leftovers = r#"<axis xyz="0 0 0"/><limit lower="2" upper="x"/><mimic joint="nobody"/>"#;
    for (kind, motion) in [("fixed", JointMotion::Fixed), ("floating", JointMotion::FREE)] {
        let loaded = chain(kind, leftovers);
        assert_eq!(joint(&loaded, "one").motion, motion);
        assert_eq!(
            loaded.warnings,
            [Warning::Urdf(UrdfWarning::MimicIgnored { joint: "one".to_owned(), kind })]
        );
    }
}

#[test]
fn a_limit_without_ends_means_zero_and_is_told() {
    let loaded = chain("revolute", r#"<limit effort="1" velocity="1"/>"#);
    assert_eq!(joint(&loaded, "one").motion.ranges(), [Range::new(0.0, 0.0)]);
    assert_eq!(loaded.warnings, [Warning::Urdf(UrdfWarning::NoRange { joint: "one".to_owned() })]);
    assert!(loaded.warnings[0].to_string().contains("'one': its limit has neither lower nor upper"));
}

#[test]
fn axes_have_unit_length() {
    let axis = |xyz: &str| match joint(&chain("continuous", &format!(r#"<axis xyz="{xyz}"/>"#)), "one").motion
    {
        JointMotion::Hinge { axis, .. } => axis,
        other => panic!("{other:?}"),
    };
    assert!(axis("0 -3 4").distance(DVec3::new(0.0, -0.6, 0.8)) < 1e-15);
    assert_eq!(axis("\t0\n 0  1e-300 "), DVec3::Z);
    assert_eq!(axis("+0. -1e99 .0"), DVec3::NEG_Y);
    assert_eq!(
        joint(&chain("continuous", "<axis/>"), "one").motion,
        JointMotion::Hinge { axis: DVec3::X, range: Range::UNLIMITED }
    );
}

#[test]
fn origins_turn_about_fixed_axes() {
    let one = |origin: &str| joint(&chain("fixed", origin), "one").clone();
    let (roll, pitch, yaw) = (0.3, -0.8, 2.1);
    let found = one(&format!(r#"<origin xyz="1 2 3" rpy="{roll} {pitch} {yaw}"/>"#));
    let matrix = DMat3::from_rotation_z(yaw) * DMat3::from_rotation_y(pitch) * DMat3::from_rotation_x(roll);
    assert!(found.rest_rotation.angle_between(DQuat::from_mat3(&matrix)) < 1e-7);
    assert_eq!(found.rest_translation, DVec3::new(1.0, 2.0, 3.0));
    assert_eq!(one(r#"<origin xyz="1 0 0"/>"#).rest_rotation, DQuat::IDENTITY);
    assert_eq!(one(r#"<origin rpy="0 0 1"/>"#).rest_translation, DVec3::ZERO);
    assert_eq!(one("").rest_rotation, DQuat::IDENTITY);
}

#[test]
fn planar_joints_are_two_sliders_and_a_hinge() {
    for (axis, x, y) in [
        ("0 0 1", DVec3::X, DVec3::Y),
        ("1 0 0", DVec3::Y, DVec3::Z),
        ("0 1 0", DVec3::Z, DVec3::X),
        ("0 0 -1", DVec3::X, DVec3::NEG_Y),
    ] {
        let loaded = chain("planar", &format!(r#"<axis xyz="{axis}"/><origin xyz="0 0 5" rpy="0 0 1"/>"#));
        let slider = |axis| JointMotion::Slider { axis, range: Range::UNLIMITED };
        let [first, second, hinge] = ["one_x", "one_y", "one"].map(|name| joint(&loaded, name));
        assert_eq!((first.motion, second.motion), (slider(x), slider(y)));
        assert!(matches!(hinge.motion, JointMotion::Hinge { range, .. } if range.is_unlimited()));
        assert_eq!(first.rest_translation, DVec3::new(0.0, 0.0, 5.0));
        assert_eq!(second.rest_translation, DVec3::ZERO);
        assert_eq!(hinge.aliases, ["b"]);
    }
    // Names that are taken.
    let loaded = robot(
        r#"<joint name="one" type="planar"><parent link="a"/><child link="b"/></joint>
           <joint name="one_x" type="fixed"><parent link="b"/><child link="c"/></joint>
           <joint name="one_y" type="fixed"><parent link="c"/><child link="d"/></joint>"#,
    );
    let names: Vec<&str> = loaded.rig.joints().iter().map(|j| j.name.as_str()).collect();
    assert_eq!(names, ["a", "one_x_2", "one_y_2", "one", "one_x", "one_y"]);
}

#[test]
fn names_of_links_give_way_to_those_of_joints() {
    let loaded = robot(
        r#"<joint name="b" type="fixed"><parent link="a"/><child link="b"/></joint>
           <joint name="d" type="fixed"><parent link="b"/><child link="c"/></joint>
           <joint name="a" type="fixed"><parent link="c"/><child link="d"/></joint>"#,
    );
    let found: Vec<_> = loaded.rig.joints().iter().map(|j| (j.name.as_str(), j.aliases.join(" "))).collect();
    let none = String::new;
    assert_eq!(found, [("a_2", none()), ("b", none()), ("d", "c".to_owned()), ("a", none())]);
    let owned = |name: &str| name.to_owned();
    assert_eq!(
        loaded.warnings,
        [
            Warning::Urdf(UrdfWarning::RootRenamed { link: owned("a"), renamed: owned("a_2") }),
            Warning::Urdf(UrdfWarning::LinkHidden { link: owned("d"), joint: owned("a") })
        ]
    );
}

#[test]
fn names_of_links_give_way_to_those_of_sliders() {
    let text = r#"<robot><link name="a"/><link name="plane_x"/><link name="b"/>
        <joint name="first" type="fixed"><parent link="a"/><child link="plane_x"/></joint>
        <joint name="plane" type="planar"><parent link="plane_x"/><child link="b"/></joint></robot>"#;
    let loaded = read_urdf(text.as_bytes(), "r.urdf").unwrap();
    let rig = &loaded.rig;
    assert!(matches!(rig.get(rig.joint("plane_x").unwrap()).unwrap().motion, JointMotion::Slider { .. }));
    assert!(joint(&loaded, "first").aliases.is_empty());
    let (link, joint) = ("plane_x".to_owned(), "first".to_owned());
    assert_eq!(loaded.warnings, [Warning::Urdf(UrdfWarning::LinkHidden { link, joint })]);
}

#[test]
fn followers_of_followers_follow_the_first_leader() {
    let follower = |name, link, of, how| {
        format!(
            r#"<joint name="{name}" type="revolute"><parent link="a"/><child link="{link}"/><limit lower="-2" upper="2"/>
               <mimic joint="{of}" {how}/></joint>"#
        )
    };
    // The leader stands last, and its followers in the wrong order.
    let loaded = robot(
        &[
            follower("two", "c", "one", r#"multiplier="-3" offset="0.5""#),
            follower("one", "b", "lead", r#"multiplier="2" offset="0.25""#),
            r#"<joint name="lead" type="continuous"><parent link="c"/><child link="d"/></joint>"#.to_owned(),
        ]
        .concat(),
    );
    let mut pose = loaded.rig.rest_pose();
    pose.set_value(loaded.rig.joint("lead").unwrap(), 0.1).unwrap();
    let value = |name| pose.value(loaded.rig.joint(name).unwrap()).unwrap();
    assert!((value("one") - 0.45).abs() < 1e-15);
    assert!((value("two") - (0.5 - 3.0 * 0.45)).abs() < 1e-15);
    // |0.5 - 3 (2 v + 0.25)| <= 2 is the narrower of the two.
    let range = joint(&loaded, "lead").motion.ranges()[0];
    assert!((range.min + 2.25 / 6.0).abs() < 1e-15 && (range.max - 1.75 / 6.0).abs() < 1e-15, "{range:?}");
    // Without ends of its own, a follower goes as far as its leader.
    let loaded = robot(
        r#"<joint name="lead" type="prismatic"><parent link="a"/><child link="b"/><limit lower="0" upper="1"/></joint>
           <joint name="one" type="prismatic"><parent link="b"/><child link="c"/><limit effort="1"/><mimic joint="lead"/></joint>
           <joint name="three" type="fixed"><parent link="c"/><child link="d"/></joint>"#,
    );
    assert_eq!((joint(&loaded, "lead").motion.ranges()[0], loaded.warnings.len()), (Range::new(0.0, 1.0), 0));
}

#[test]
fn solids_are_kept_with_their_joint() {
    let humanoid = read(robot_file("deepmimic_humanoid")).unwrap();
    let shape = |link| {
        let joint = humanoid.rig.joint(link).unwrap();
        *humanoid.collision_shapes().iter().find(|s| s.joint == joint).unwrap()
    };
    assert_eq!(humanoid.collision_shapes().len(), 15);
    assert_eq!(shape("chest").kind, ShapeKind::Sphere { radius: 0.44 });
    assert_eq!(shape("right_ankle").kind, ShapeKind::Box { size: [0.708, 0.22, 0.36] });
    let hip = shape("right_hip");
    assert_eq!(hip.kind, ShapeKind::Capsule { radius: 0.22, length: 1.2 });
    // It lies along the thigh: from the hip down to the knee.
    assert!((hip.position + hip.rotation * DVec3::Z).distance(DVec3::new(0.0, 0.16, 0.0)) < 1e-6);
    // 8 spheres, 4 cylinders; meshes are left out without a word.
    let g1 = read(robot_file("g1_29dof_rev_1_0")).unwrap();
    let cylinders =
        g1.collision_shapes().iter().filter(|s| matches!(s.kind, ShapeKind::Cylinder { .. })).count();
    assert_eq!((g1.collision_shapes().len(), cylinders), (12, 4));
    let kinds = read(robot_file("kinds")).unwrap();
    let [cart] = kinds.collision_shapes() else { panic!() };
    assert_eq!(kinds.rig.get(cart.joint).unwrap().name, "cart");
    assert_eq!(cart.position, DVec3::new(0.1, 0.2, 0.3));
}

#[test]
fn a_solid_that_cannot_be_read_is_left_out() {
    let collision = |inside: &str| {
        let text = format!(r#"<robot><link name="a">{}<collision>{inside}</collision></link></robot>"#, "\n");
        let loaded = read_urdf(text.as_bytes(), "r.urdf").unwrap();
        assert!(loaded.collision_shapes().is_empty());
        loaded.warnings.iter().map(ToString::to_string).collect::<Vec<_>>().join("; ")
    };
    let start = "a collision shape of link 'a' (line 2) was left out: ";
    let message = collision(r#"<geometry><sphere radius="-1"/></geometry>"#);
    assert_eq!(message, format!(r#"{start}radius="-1" cannot be read, expected a length in metres"#));
    let message = collision(r#"<geometry><cylinder radius="1"/></geometry>"#);
    assert_eq!(message, format!("{start}the attribute length is missing, expected a length in metres"));
    let message = collision(r#"<geometry><box size="1 2"/></geometry>"#);
    assert!(message.contains(r#"size="1 2" cannot be read, expected three"#), "{message}");
    let message = collision(r#"<origin xyz="x"/><geometry><sphere radius="1"/></geometry>"#);
    assert!(message.contains(r#"xyz="x" cannot be read"#), "{message}");
    assert_eq!(collision(r#"<geometry><mesh filename="a.stl"/></geometry>"#), "");
    assert_eq!(collision(""), "");
}

#[test]
fn what_has_no_bearing_on_kinematics_is_skipped() {
    let loaded = robot(
        r#"<material name="m"><color rgba="x"/></material>
           <transmission name="t"><joint name="one"><parent link="no"/></joint><link name="a"/></transmission>
           <gazebo reference="a"><link name="a"/><joint name="j" type="?"/></gazebo>
           <?php robot ?> <![CDATA[<link name="a"/>]]> text &amp; &#65; more
           <joint name="one" type="revolute">
             <parent link="a"/><child link="b"/><limit lower="0" upper="1"/>
             <safety_controller soft_lower_limit="x"/><dynamics damping="y"/><calibration/><unknown><axis xyz="0"/></unknown>
           </joint>
           <joint name="two" type="fixed"><parent link="a"/><child link="c"/></joint>
           <joint name="three" type="fixed"><parent link="a"/><child link="d"/></joint>"#,
    );
    assert_eq!((loaded.rig.n_joints(), loaded.rig.n_dofs(), loaded.warnings.len()), (4, 1, 0));
}

#[test]
fn files_may_be_untidy() {
    let text = "\u{feff}<?xml version='1.0' encoding='ISO-8859-1'?>\r\n<!DOCTYPE robot [<!ELEMENT robot ANY>]>\r\n\
        <!-- a -- b --><robot name = 'r' ><link\n name\t=\t\"it&apos;s &#x41;\" /></robot >\r\n<!-- end -->\n\0\0";
    let loaded = read_urdf(text.as_bytes(), "r.urdf").unwrap();
    assert_eq!(loaded.rig.joints()[0].name, "it's A");
    let loaded = chain("continuous", r#"<axis xyz="0 0 1"/><axis xyz="0 1 0"/>"#);
    assert!(matches!(joint(&loaded, "one").motion, JointMotion::Hinge { axis: DVec3::Z, .. }));
    assert_eq!(
        loaded.warnings[0].to_string(),
        "joint 'one' has another <axis> in line 1, the first was used"
    );
}

#[test]
fn euler_angles_of_the_data_are_radians() {
    let ur5 = read(robot_file("ur5_robot")).unwrap();
    let lift = joint(&ur5, "shoulder_lift_joint");
    assert!((lift.rest_rotation.to_axis_angle().1 - FRAC_PI_2).abs() < 1e-6);
    assert!((lift.motion.ranges()[0].max - 2.0 * PI).abs() < 1e-4);
}
