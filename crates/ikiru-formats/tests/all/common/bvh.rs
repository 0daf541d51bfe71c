//! BVH once more: a small parser for well-formed texts, and kinematics by 4×4 matrices.

use glam::{DMat4, DVec3};
use ikiru_rig::JointFrame;

use super::apart;

/// A joint of a text: its name (empty for an end site), parent, offset and channels with their places in a frame.
pub(crate) struct Joint {
    pub(crate) name: String,
    pub(crate) parent: Option<usize>,
    pub(crate) offset: DVec3,
    pub(crate) channels: Vec<(usize, String)>,
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
                    let is_joint = matches!(words[at - 2], "ROOT" | "JOINT");
                    let name = if is_joint { words[at - 1].to_owned() } else { String::new() };
                    joints.push(Joint { name, parent, offset: DVec3::ZERO, channels: Vec::new() });
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

/// Asserts that a text is what the strictest readers take, line by line: one `ROOT`; in each block an `OFFSET` and
/// `CHANNELS`, then joints or one `End Site`, never nothing; a name of one word that no other joint has; as many numbers
/// a frame as there are channels.
#[track_caller]
pub(crate) fn assert_strict(text: &str) {
    struct Lines<'t>(std::vec::IntoIter<Vec<&'t str>>);
    impl<'t> Lines<'t> {
        fn next(&mut self) -> Vec<&'t str> {
            self.0.next().expect("the text goes on")
        }
    }
    fn block(lines: &mut Lines<'_>, head: &[&str], names: &mut Vec<String>, n_channels: &mut usize) {
        let is_end = head == ["End", "Site"];
        if !is_end {
            let [_, name] = head else { panic!("a joint has one name, a single word: {head:?}") };
            assert!(!names.contains(&(*name).to_owned()), "{name} is there twice");
            names.push((*name).to_owned());
        }
        assert_eq!(lines.next(), ["{"]);
        let offset = lines.next();
        assert!(offset.len() == 4 && offset[0] == "OFFSET", "{offset:?}");
        assert!(offset[1..].iter().all(|n| n.parse::<f64>().unwrap().is_finite()));
        if is_end {
            assert_eq!(lines.next(), ["}"]);
            return;
        }
        let channels = lines.next();
        assert_eq!(channels[0], "CHANNELS");
        assert_eq!(channels[1].parse::<usize>().unwrap(), channels.len() - 2);
        assert!(channels.len() > 2);
        *n_channels += channels.len() - 2;
        let mut below: Vec<bool> = Vec::new();
        loop {
            let line = lines.next();
            if line == ["}"] {
                break;
            }
            assert!(matches!(line[0], "JOINT" | "End"), "{line:?}");
            below.push(line[0] == "JOINT");
            block(lines, &line, names, n_channels);
        }
        assert!(below == [false] || !below.is_empty() && below.iter().all(|b| *b), "{head:?}: {below:?}");
    }
    let words: Vec<Vec<&str>> = text.lines().map(|line| line.split_whitespace().collect()).collect();
    let mut lines = Lines(words.into_iter());
    assert_eq!(lines.next(), ["HIERARCHY"]);
    let root = lines.next();
    assert_eq!(root[0], "ROOT");
    let (mut names, mut n_channels) = (Vec::new(), 0);
    block(&mut lines, &root, &mut names, &mut n_channels);
    assert_eq!(lines.next(), ["MOTION"], "after one ROOT");
    let frames = lines.next();
    assert!(frames.len() == 2 && frames[0] == "Frames:", "{frames:?}");
    let time = lines.next();
    assert!(time.len() == 3 && time[..2] == ["Frame", "Time:"], "{time:?}");
    let rest: Vec<Vec<&str>> = lines.0.collect();
    assert_eq!(rest.len(), frames[1].parse::<usize>().unwrap());
    assert!(rest.iter().all(|frame| frame.len() == n_channels));
}

/// Asserts that both have the same world frames, within a tolerance in metres and radians.
pub(crate) fn assert_same_frames_to(a: &[JointFrame], b: &[JointFrame], tolerance: f64) {
    assert_eq!(a.len(), b.len());
    for (idx, (a, b)) in a.iter().zip(b).enumerate() {
        let (angle, distance) = apart(a, b);
        assert!(angle < tolerance && distance < tolerance, "joint {idx} is off by {angle} and {distance}");
    }
}
