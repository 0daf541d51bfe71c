//! Forward kinematics of robots agrees with Pinocchio's: 20 configurations of each, all links, to 1e-9.
//! `data/robots/make_fk.py` made the numbers.
#![allow(clippy::unwrap_used, reason = "a test fails by a panic")]

use crate::common::*;
use glam::{DQuat, DVec3};
use ikiru_formats::read;
use ikiru_rig::{Frame, JointMotion, Pose, Rig};
use serde_json::Value;

fn numbers(value: &Value) -> Vec<f64> {
    value.as_array().unwrap().iter().map(|n| n.as_f64().unwrap()).collect()
}

/// Sets one joint of a file: an angle or offset; x, y and an angle; a quaternion; or a translation and a
/// quaternion.
fn set(pose: &mut Pose, name: &str, values: &[f64]) {
    let rig = pose.rig().clone();
    let joint = rig.joint(name).unwrap();
    match (rig.get(joint).unwrap().motion, values) {
        (JointMotion::Hinge { .. } | JointMotion::Slider { .. }, [value]) => {
            pose.set_value(joint, *value).unwrap();
        }
        (JointMotion::Hinge { .. }, [x, y, angle]) => {
            pose.set_value(rig.joint(&format!("{name}_x")).unwrap(), *x).unwrap();
            pose.set_value(rig.joint(&format!("{name}_y")).unwrap(), *y).unwrap();
            pose.set_value(joint, *angle).unwrap();
        }
        (JointMotion::Ball { .. }, q) => pose.set_rotation(joint, DQuat::from_slice(q)).unwrap(),
        (JointMotion::Free { .. }, both) => {
            pose.set_translation(joint, DVec3::from_slice(both)).unwrap();
            pose.set_rotation(joint, DQuat::from_slice(&both[3..])).unwrap();
        }
        (motion, _) => panic!("{name} is {motion:?}"),
    }
}

/// The frame that a link has in the world of the file.
fn file_from_link(rig: &Rig, frames: &[Frame], link: &str, file_from_world: DQuat) -> Frame {
    // A joint's own name comes before that of another's link.
    let of_link = rig.joints().iter().position(|j| j.aliases.iter().any(|alias| alias == link));
    let joint = of_link.unwrap_or_else(|| rig.joint(link).unwrap().index());
    Frame::new(file_from_world, DVec3::ZERO).compose(&frames[joint])
}

#[test]
fn frames_of_all_links_are_those_of_another_program() {
    let mut n_frames = 0;
    for (name, ..) in ROBOTS {
        let loaded = read(data(&format!("robots/{name}.urdf"))).unwrap();
        let file_from_world = loaded.world_from_file().inverse();
        let text = std::fs::read(data(&format!("robots/fk/{name}.json"))).unwrap();
        let expected: Value = serde_json::from_slice(&text).unwrap();
        for configuration in expected["configurations"].as_array().unwrap() {
            let mut pose = loaded.rig.rest_pose();
            let joints = configuration["joints"].as_object().unwrap();
            assert_eq!(
                joints.values().map(|v| v.as_array().unwrap().len()).sum::<usize>(),
                pose.coords().len()
            );
            for (joint, values) in joints {
                set(&mut pose, joint, &numbers(values));
            }
            // What the other program's script takes for the limits lies inside of ours.
            assert!(pose.limit_violation() < 1e-9, "{name}: {}", pose.limit_violation());
            let frames = pose.frames();
            let links = expected["links"].as_array().unwrap();
            for (link, frame) in links.iter().zip(configuration["frames"].as_array().unwrap()) {
                let link = link.as_str().unwrap();
                let found = file_from_link(&loaded.rig, &frames, link, file_from_world);
                let frame = numbers(frame);
                let wanted =
                    Frame::new(DQuat::from_slice(&frame[3..]).normalize(), DVec3::from_slice(&frame));
                let (angle, distance) = apart(&found, &wanted);
                assert!(angle < 1e-9 && distance < 1e-9, "{name}, {link}: off by {distance} m, {angle} rad");
                n_frames += 1;
            }
        }
    }
    assert_eq!(n_frames, 20 * ROBOTS.iter().map(|(_, n_links, _)| n_links).sum::<usize>());
}
