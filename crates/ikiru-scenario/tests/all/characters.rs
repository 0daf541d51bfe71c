//! Every character and hand that ships: 1,000 poses each for three effectors at once, inside ±45° Euler ranges
//! and inside 40° cones, judged by matrices made straight from the file.
#![allow(clippy::unwrap_used, reason = "a test that cannot go on fails")]

use std::collections::HashMap;
use std::fmt::Write as _;

use glam::{DAffine3, DMat3, DMat4, DQuat, DVec2, DVec3};
use ikiru_scenario::Scenario;
use ikiru_testkit::rigs::Random;
use serde_json::Value;

/// A node as the file has it.
struct Node {
    name: String,
    parent: Option<usize>,
    local: DMat4,
}

/// The nodes of a `.glb` or `.vrm`, parents first, read with nothing but a JSON parser.
fn nodes(bytes: &[u8]) -> Vec<Node> {
    let length = u32::from_le_bytes(bytes[12..16].try_into().unwrap()) as usize;
    let json: Value = serde_json::from_slice(&bytes[20..20 + length]).unwrap();
    let list = json["nodes"].as_array().unwrap();
    let numbers = |v: &Value| v.as_array().map(|a| a.iter().map(|x| x.as_f64().unwrap()).collect::<Vec<_>>());
    let mut order: Vec<(usize, Option<usize>)> = Vec::new();
    let mut stack: Vec<(usize, Option<usize>)> = json["scenes"][0]["nodes"]
        .as_array()
        .unwrap()
        .iter()
        .map(|n| (n.as_u64().unwrap() as usize, None))
        .collect();
    while let Some((node, parent)) = stack.pop() {
        order.push((node, parent));
        let at = order.len() - 1;
        for child in list[node]["children"].as_array().into_iter().flatten() {
            stack.push((child.as_u64().unwrap() as usize, Some(at)));
        }
    }
    order
        .into_iter()
        .map(|(node, parent)| {
            let node = &list[node];
            let or = |key: &str, default: &[f64]| numbers(&node[key]).unwrap_or(default.to_vec());
            let local = match numbers(&node["matrix"]) {
                Some(m) => DMat4::from_cols_slice(&m),
                None => DMat4::from_scale_rotation_translation(
                    DVec3::from_slice(&or("scale", &[1.0; 3])),
                    DQuat::from_slice(&or("rotation", &[0.0, 0.0, 0.0, 1.0])).normalize(),
                    DVec3::from_slice(&or("translation", &[0.0; 3])),
                ),
            };
            Node { name: node["name"].as_str().unwrap().to_owned(), parent, local }
        })
        .collect()
}

/// World matrices with every named node turned by a rotation on top of its own transform.
fn world(nodes: &[Node], motion: &HashMap<String, DQuat>) -> Vec<DMat4> {
    let mut world: Vec<DMat4> = Vec::new();
    for node in nodes {
        let turn = motion.get(&node.name).map_or(DMat4::IDENTITY, |q| DMat4::from_quat(*q));
        world.push(node.parent.map_or(DMat4::IDENTITY, |p| world[p]) * node.local * turn);
    }
    world
}

/// Position and rotation of a world matrix, whatever its scale.
fn place(m: &DMat4) -> (DVec3, DQuat) {
    let a = DAffine3::from_mat4(*m);
    let c = a.matrix3;
    let unit = DMat3::from_cols(c.x_axis.normalize(), c.y_axis.normalize(), c.z_axis.normalize());
    (a.translation, DQuat::from_mat3(&unit).normalize())
}

fn random_motion(cones: bool, random: &mut Random) -> DQuat {
    if cones {
        let reach = 40_f64.to_radians();
        let swing =
            DVec2::from_angle(random.between(0.0, std::f64::consts::TAU)) * (reach * random.unit().sqrt());
        DQuat::from_scaled_axis(DVec3::new(swing.x, 0.0, swing.y))
            * DQuat::from_rotation_y(random.between(-reach, reach))
    } else {
        let mut angle = || random.between(-45.0, 45.0_f64).to_radians();
        DQuat::from_rotation_z(angle()) * DQuat::from_rotation_y(angle()) * DQuat::from_rotation_x(angle())
    }
}

/// Whether a rotation is inside the limits, within 1e-9, by means of this test's own.
fn is_inside(q: DQuat, cones: bool) -> bool {
    if cones {
        let reach = 40_f64.to_radians() + 1e-9;
        let twist = 2.0 * (q.y / q.w).atan();
        let bone = q * DVec3::Y;
        twist.abs() <= reach && bone.x.hypot(bone.z).atan2(bone.y) <= reach
    } else {
        let reach = 45_f64.to_radians() + 1e-9;
        let m = DMat3::from_quat(q);
        let y = (-m.x_axis.z).asin();
        let (x, z) = (m.y_axis.z.atan2(m.z_axis.z), m.x_axis.y.atan2(m.x_axis.x));
        [x, y, z].iter().all(|a| a.abs() <= reach)
    }
}

fn check(path: &str, effectors: [&str; 3], cones: bool) {
    let full = format!("{}/../ikiru-formats/{path}", env!("CARGO_MANIFEST_DIR"));
    let bytes = std::fs::read(&full).unwrap();
    let nodes = nodes(&bytes);
    // The joints above the effectors may move, each inside its own limits.
    let mut moving: Vec<usize> = Vec::new();
    for effector in effectors {
        let mut at = nodes.iter().position(|n| n.name == effector);
        while let Some(idx) = at {
            if !moving.contains(&idx) {
                moving.push(idx);
            }
            at = nodes[idx].parent;
        }
    }
    let skinned = ikiru_formats::read(&full).unwrap().rig;
    moving.retain(|idx| skinned.joint(&nodes[*idx].name).is_ok_and(|j| skinned.get(j).unwrap().n_dofs() > 0));
    let names: Vec<&str> = moving.iter().map(|idx| nodes[*idx].name.as_str()).collect();
    let mut text = format!("version = 1\nrig = {full:?}\nactive = {names:?}\n");
    for name in &names {
        let limits = if cones {
            "axis = [0, 1, 0]\nswing_deg = [40, 40]\ntwist_deg = [-40, 40]"
        } else {
            "min_deg = [-45, -45, -45]\nmax_deg = [45, 45, 45]"
        };
        writeln!(text, "[limits.{name:?}]\n{limits}").unwrap();
    }
    for effector in effectors {
        writeln!(
            text,
            "[[objective]]\nkind = \"pose\"\njoint = {effector:?}\ntarget = [0, 0, 0]\n\
             target_rotation = [0, 0, 0, 1]\ntolerance = 0.001\ntolerance_deg = 0.1"
        )
        .unwrap();
    }
    let mut scenario = Scenario::parse(&text, "characters.toml", ".").unwrap();
    let mut workspace = scenario.workspace();
    let mut random = Random::new(42);
    let places = effectors.map(|e| nodes.iter().position(|n| n.name == e).unwrap());
    let mut reached = 0;
    let n = 1000;
    for _ in 0..n {
        let motion =
            names.iter().map(|name| ((*name).to_owned(), random_motion(cones, &mut random))).collect();
        let goal = world(&nodes, &motion);
        let wanted = places.map(|idx| place(&goal[idx]));
        for (idx, (position, rotation)) in wanted.into_iter().enumerate() {
            scenario.set_target(idx, position).unwrap();
            scenario.set_target_rotation(idx, rotation).unwrap();
        }
        let mut pose = scenario.start.clone();
        let success = scenario.solve(&mut pose, &mut workspace).success;
        let solved: HashMap<String, DQuat> = scenario
            .active
            .iter()
            .map(|j| (scenario.rig.get(*j).unwrap().name.clone(), pose.rotation(*j).unwrap()))
            .collect();
        assert!(solved.values().all(|q| is_inside(*q, cones)), "{path}: a limit does not hold");
        let found = world(&nodes, &solved);
        let near = places.into_iter().zip(wanted).all(|(idx, (position, rotation))| {
            let (p, r) = place(&found[idx]);
            p.distance(position) <= 1.0001e-3 && r.angle_between(rotation) <= 0.1001_f64.to_radians()
        });
        assert_eq!(near, success, "{path}: the report says otherwise than the file's own matrices");
        reached += usize::from(near);
    }
    assert!(reached * 1000 >= n * 999, "{path}, cones: {cones}: {reached} of {n}");
}

macro_rules! characters {
    ($($test:ident $path:literal $effectors:expr;)*) => {$(
        mod $test {
            #[test]
            fn euler_ranges() {
                super::check($path, $effectors, false);
            }
            #[test]
            fn cones() {
                super::check($path, $effectors, true);
            }
        }
    )*};
}

characters! {
    makehuman_default "tests/data/mh_female_default163.glb" ["wrist.L", "wrist.R", "head"];
    mixamo "tests/data/mh_female_mixamo.glb" ["mixamorig:LeftHand", "mixamorig:RightFoot", "mixamorig:Head"];
    vrm_female "assets/human.vrm" ["hand_l", "hand_r", "head"];
    vrm_male "tests/data/mh_male_vrm1.vrm" ["hand_l", "foot_r", "head"];
    game_engine "tests/data/mh_male_gameengine.glb" ["hand_l", "hand_r", "foot_l"];
    game_engine_low "tests/data/mh_male_gameengine_lod10pc.glb" ["hand_l", "index_03_r", "head"];
    left_hand "tests/data/webxr_generic_hand_left.glb" ["thumb-tip", "index-finger-tip", "pinky-finger-tip"];
    right_hand "tests/data/webxr_generic_hand_right.glb" ["thumb-tip", "middle-finger-tip", "pinky-finger-tip"];
}
