//! Forward kinematics of robots agrees with Pinocchio's: 20 configurations of each, all links, to 1e-9. So do centres of
//! mass, over its frames and what a plain search in the text finds of masses.
//! `data/robots/make_fk.py` made the numbers.
#![allow(clippy::unwrap_used, reason = "a test fails by a panic")]

use crate::common::*;
use glam::{DQuat, DVec3};
use ikiru_formats::{Loaded, read};
use ikiru_rig::body::center_of_mass;
use ikiru_rig::{JointFrame, JointMotion, Pose, Rig};
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
fn file_from_link(rig: &Rig, frames: &[JointFrame], link: &str, file_from_world: DQuat) -> JointFrame {
    // A joint's own name comes before that of another's link.
    let of_link = rig.joints().iter().position(|j| j.aliases.iter().any(|alias| alias == link));
    let joint = of_link.unwrap_or_else(|| rig.joint(link).unwrap().index());
    let JointFrame { position, rotation } = frames[joint];
    JointFrame { position: file_from_world * position, rotation: file_from_world * rotation }
}

/// The frames that another program has for the links of a robot, by name, and the pose in which that is.
fn each_configuration(name: &str, mut look: impl FnMut(&Loaded, &Pose, &[(String, JointFrame)])) {
    let loaded = read(robot_file(name)).unwrap();
    let text = std::fs::read(data(&format!("robots/fk/{name}.json"))).unwrap();
    let expected: Value = serde_json::from_slice(&text).unwrap();
    for configuration in expected["configurations"].as_array().unwrap() {
        let mut pose = loaded.rig.rest_pose();
        let joints = configuration["joints"].as_object().unwrap();
        assert_eq!(joints.values().map(|v| v.as_array().unwrap().len()).sum::<usize>(), pose.coords().len());
        for (joint, values) in joints {
            set(&mut pose, joint, &numbers(values));
        }
        // What the other program's script takes for the limits lies inside of ours.
        assert!(pose.limit_violation() < 1e-9, "{name}: {}", pose.limit_violation());
        let links = expected["links"].as_array().unwrap();
        let frames = configuration["frames"].as_array().unwrap();
        let frame_of = |(link, frame): (&Value, &Value)| {
            let frame = numbers(frame);
            let rotation = DQuat::from_slice(&frame[3..]).normalize();
            (link.as_str().unwrap().to_owned(), JointFrame { position: DVec3::from_slice(&frame), rotation })
        };
        look(&loaded, &pose, &links.iter().zip(frames).map(frame_of).collect::<Vec<_>>());
    }
}

#[test]
fn frames_of_all_links_are_those_of_another_program() {
    let mut n_frames = 0;
    for (name, ..) in ROBOTS {
        each_configuration(name, |loaded, pose, links| {
            let (frames, file_from_world) = (pose.frames(), loaded.world_from_file().inverse());
            for (link, wanted) in links {
                let found = file_from_link(&loaded.rig, &frames, link, file_from_world);
                let (angle, distance) = apart(&found, wanted);
                assert!(angle < 1e-9 && distance < 1e-9, "{name}, {link}: off by {distance} m, {angle} rad");
                n_frames += 1;
            }
        });
    }
    assert_eq!(n_frames, 20 * ROBOTS.iter().map(|(_, n_links, _)| n_links).sum::<usize>());
}

/// What stands in a text between two words, as often as that is there.
fn between<'t>(text: &'t str, begin: &str, end: &str) -> Vec<&'t str> {
    text.split(begin).skip(1).filter_map(|rest| Some(rest.split_once(end)?.0)).collect()
}

/// The value of an attribute.
fn attribute(element: &str, name: &str) -> Option<String> {
    let spaced =
        element.split_whitespace().collect::<Vec<_>>().join(" ").replace(" =", "=").replace("= ", "=");
    spaced.split_once(&format!("{name}=\""))?.1.split_once('"').map(|(value, _)| value.to_owned())
}

/// Link, mass and centre of all links that have a mass, found without a parser.
fn masses(name: &str) -> Vec<(String, f64, DVec3)> {
    let text = std::fs::read_to_string(robot_file(name)).unwrap();
    let comments: Vec<String> =
        between(&text, "<!--", "-->").iter().map(|comment| format!("<!--{comment}-->")).collect();
    let text = comments.iter().fold(text.clone(), |text, comment| text.replace(comment, ""));
    let mut masses = Vec::new();
    for link in between(&text, "<link", "</link>") {
        for inertial in between(link, "<inertial", "</inertial>") {
            let mass = between(inertial, "<mass", ">").first().and_then(|mass| attribute(mass, "value"));
            let kg: f64 = mass.unwrap().parse().unwrap();
            let center = between(inertial, "<origin", ">").first().and_then(|o| attribute(o, "xyz"));
            let center: Vec<f64> = center
                .map(|xyz| xyz.split_whitespace().map(|n| n.parse().unwrap()).collect())
                .unwrap_or(vec![0.0; 3]);
            if kg != 0.0 {
                masses.push((attribute(link, "name").unwrap(), kg, DVec3::from_slice(&center)));
            }
        }
    }
    masses
}

#[test]
fn centres_of_mass_are_those_over_the_frames_of_another_program() {
    let (mut n_heavy, mut n_massless) = (0, 0);
    for (name, ..) in ROBOTS {
        let masses = masses(name);
        let total: f64 = masses.iter().map(|(_, kg, _)| kg).sum();
        (n_heavy, n_massless) =
            if masses.is_empty() { (n_heavy, n_massless + 1) } else { (n_heavy + 1, n_massless) };
        each_configuration(name, |loaded, pose, links| {
            let segments = loaded.segments();
            assert_eq!(segments.len(), masses.len(), "{name}");
            assert!((segments.iter().map(|s| s.kg).sum::<f64>() - total).abs() < 1e-9 * total.max(1.0));
            let Some(found) = center_of_mass(pose, segments) else {
                assert!(masses.is_empty(), "{name}");
                return;
            };
            let moment = |(link, kg, center): &(String, f64, DVec3)| {
                let (_, frame) = links.iter().find(|(name, _)| name == link).unwrap();
                frame.point(*center) * *kg
            };
            let expected = masses.iter().map(moment).sum::<DVec3>() / total;
            let found = loaded.world_from_file().inverse() * found;
            assert!(found.distance(expected) < 1e-9, "{name}: {found}, expected {expected}");
        });
    }
    // The one without masses has every type of joint.
    assert_eq!((n_heavy, n_massless), (9, 1));
}
