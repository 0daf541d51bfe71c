//! BVH once more: a small parser for well-formed texts, and kinematics by 4×4 matrices.

use glam::{DMat4, DVec3};
use ikiru_rig::Frame;

use super::apart;

/// A joint of a text: its parent, offset and channels with their places in a frame.
pub(crate) struct Joint {
    parent: Option<usize>,
    offset: DVec3,
    channels: Vec<(usize, String)>,
}

/// A text, taken apart.
pub(crate) struct Reference {
    pub(crate) joints: Vec<Joint>,
    pub(crate) frames: Vec<Vec<f64>>,
    /// Words up to the first frame, numbers brought to one form.
    pub(crate) header: Vec<String>,
    in_place: bool,
}

impl Reference {
    pub(crate) fn parse(text: &str, in_place: bool) -> Self {
        let words: Vec<&str> = text.split_whitespace().collect();
        let number = |at: usize| words[at].parse::<f64>().unwrap();
        let (mut joints, mut open) = (Vec::<Joint>::new(), Vec::new());
        let (mut at, mut n_channels) = (0, 0);
        while words[at] != "MOTION" {
            match words[at] {
                "{" => {
                    let parent = open.last().copied();
                    open.push(joints.len());
                    joints.push(Joint { parent, offset: DVec3::ZERO, channels: Vec::new() });
                }
                "}" => _ = open.pop(),
                "OFFSET" => {
                    let joint = joints.last_mut().unwrap();
                    joint.offset = DVec3::new(number(at + 1), number(at + 2), number(at + 3));
                    at += 3;
                }
                "CHANNELS" => {
                    let count = words[at + 1].parse::<usize>().unwrap();
                    let names = &words[at + 2..at + 2 + count];
                    joints.last_mut().unwrap().channels =
                        names.iter().enumerate().map(|(i, n)| (n_channels + i, (*n).to_owned())).collect();
                    n_channels += count;
                    at += 1 + count;
                }
                _ => {}
            }
            at += 1;
        }
        assert_eq!((words[at + 1], words[at + 3], words[at + 4]), ("Frames:", "Frame", "Time:"));
        let n_frames = number(at + 2) as usize;
        let first = at + 6;
        let frames: Vec<Vec<f64>> = (0..n_frames)
            .map(|f| (0..n_channels).map(|c| number(first + f * n_channels + c)).collect())
            .collect();
        assert_eq!(words.len(), first + n_frames * n_channels);
        let plain = |word: &&str| word.parse::<f64>().map_or((*word).to_owned(), |n| (n + 0.0).to_string());
        let header = words[..first].iter().map(plain).collect();
        Self { joints, frames, header, in_place }
    }

    /// World matrices of all joints in a frame.
    pub(crate) fn world(&self, frame: &[f64]) -> Vec<DMat4> {
        let mut world: Vec<DMat4> = Vec::new();
        for joint in &self.joints {
            let (mut translation, mut rotation) = (joint.offset, DMat4::IDENTITY);
            for (at, name) in &joint.channels {
                let (value, axis) = (frame[*at], "XYZ".find(&name[..1]).unwrap());
                match (&name[1..], axis) {
                    ("position", _) if self.in_place => translation[axis] = value,
                    ("position", _) => translation[axis] += value,
                    (_, 0) => rotation *= DMat4::from_rotation_x(value.to_radians()),
                    (_, 1) => rotation *= DMat4::from_rotation_y(value.to_radians()),
                    _ => rotation *= DMat4::from_rotation_z(value.to_radians()),
                }
            }
            let parent = joint.parent.map_or(DMat4::IDENTITY, |p| world[p]);
            world.push(parent * DMat4::from_translation(translation) * rotation);
        }
        world
    }
}

/// Asserts that both have the same world frames, within a tolerance in metres and radians.
pub(crate) fn assert_same_frames_to(a: &[Frame], b: &[Frame], tolerance: f64) {
    assert_eq!(a.len(), b.len());
    for (idx, (a, b)) in a.iter().zip(b).enumerate() {
        let (angle, distance) = apart(a, b);
        assert!(angle < tolerance && distance < tolerance, "joint {idx} is off by {angle} and {distance}");
    }
}
