//! Broken and hostile BVH: whatever comes in, there is an answer, with bounded work and memory.
#![allow(clippy::unwrap_used, reason = "a test fails by a panic")]

use crate::common::bounds::{self, MIB};
use ikiru_formats::{BvhOptions, Error, Loaded, read_bvh, write_bvh_clip, write_bvh_pose};
use ikiru_rig::Pose;
use ikiru_testkit::rigs::Random;

/// Reads, and asserts that work and memory are within what is promised.
#[track_caller]
fn bounded(text: &[u8]) -> Result<Loaded, Error> {
    // The bytes of the file itself count as well, where it is read from disk.
    bounds::bounded(text.len(), text.len(), || read_bvh(text, "hostile.bvh", &BvhOptions::default()))
}

fn motion(hierarchy: &str, n_frames: usize, frame: &str) -> String {
    format!("HIERARCHY {hierarchy} MOTION Frames: {n_frames} Frame Time: 0.01\n{}", frame.repeat(n_frames))
}

#[test]
fn deep_trees() {
    for (open, close) in [
        ("JOINT a{OFFSET 0 1 0 CHANNELS 3 Xrotation Yrotation Zrotation\n", "}"),
        ("End Site{OFFSET 0 1 0 ", "}"),
        ("JOINT{OFFSET 0 1 0 ", "}"),
        ("JOINT \u{fffd}a{OFFSET 0 1 0 CHANNELS 1 Xrotation End Site {OFFSET 0 0 0}", "}"),
    ] {
        let n = if open.contains("End Site {") { 49_990 } else { 99_990 };
        let hierarchy = format!("ROOT r{{OFFSET 0 0 0 {}}}{}", open.repeat(n), close.repeat(n));
        let loaded = bounded(motion(&hierarchy, 0, "").as_bytes()).unwrap();
        assert!(loaded.rig.n_joints() > n);
        let written = write_bvh_pose(&loaded, &loaded.rig.rest_pose()).unwrap();
        assert!(written.len() < 64 * MIB);
        let unclosed = format!("HIERARCHY ROOT r{{OFFSET 0 0 0 {}", open.repeat(n));
        assert!(bounded(unclosed.as_bytes()).is_err());
    }
}

#[test]
fn wide_trees_and_too_many_joints() {
    let joint = "JOINT a{OFFSET 0 0 0}";
    let wide = |n: usize| motion(&format!("ROOT r{{OFFSET 0 0 0 {}}}", joint.repeat(n)), 0, "");
    assert_eq!(bounded(wide(99_999).as_bytes()).unwrap().rig.n_joints(), 100_000);
    let message = bounded(wide(2_000_000).as_bytes()).unwrap_err().to_string();
    assert!(message.contains("more than 100000 elements"), "{message}");
    let roots = motion(&"ROOT r{OFFSET 0 0 0 CHANNELS 0}".repeat(100_000), 1, "");
    assert_eq!(bounded(roots.as_bytes()).unwrap().rig.n_joints(), 100_000);
    let full = "JOINT a{OFFSET 0 0 0 CHANNELS 6 Xposition Yposition Zposition Xrotation Yrotation Zrotation}";
    let text =
        motion(&format!("ROOT r{{OFFSET 0 0 0 {}}}", full.repeat(99_999)), 2, &"1 ".repeat(600_000 - 6));
    assert_eq!(bounded(text.as_bytes()).unwrap().clips[0].poses().len(), 2);
}

#[test]
fn long_names() {
    let name = "n".repeat(MIB);
    let joint = format!("JOINT {name}\n{{OFFSET 0 0 0 End Site{{OFFSET 0 0 0}}End Site{{OFFSET 0 0 0}}}}");
    let text = motion(&format!("ROOT {name}{{OFFSET 0 0 0 {}}}", joint.repeat(30)), 0, "");
    assert_eq!(bounded(text.as_bytes()).unwrap().rig.n_joints(), 91);
    let mut bytes = b"HIERARCHY ROOT ".to_vec();
    bytes.resize(20 * MIB, 0xff);
    bytes.extend(b"{OFFSET 0 0 0 } MOTION Frames: 0 Frame Time: 1");
    bounded(&bytes).unwrap();
}

#[test]
fn dense_frames() {
    let joint = |channels: &str| format!("ROOT r{{OFFSET 0 1 0 CHANNELS {channels}}}");
    // One number a frame: a pose is much more than its text, and refused where there are many.
    let hinge = joint("1 Xrotation");
    assert!(bounded(motion(&hinge, 10_000, "1\n").as_bytes()).is_ok());
    assert!(bounded(motion(&hinge, 5_000_000, "1\n").as_bytes()).unwrap_err().to_string().contains("memory"));
    // Seven numbers of a free joint for three in the text.
    let free = joint("3 Xposition Yposition Zposition");
    for n in [1_000, 100_000, 3_000_000] {
        let _ = bounded(motion(&free, n, "1 2 3\n").as_bytes());
    }
    let many = motion(&free.repeat(50), 100_000, &"1 2 3 ".repeat(50));
    let _ = bounded(many.as_bytes());
    // What real files are like.
    let real = motion(
        &joint("6 Xposition Yposition Zposition Zrotation Xrotation Yrotation"),
        200_000,
        "12.345678 90.123456 -3.456789 -170.123456 12.345678 90.123456\n",
    );
    assert_eq!(bounded(real.as_bytes()).unwrap().clips[0].poses().len(), 200_000);
    let _ = bounded(motion(&joint("0"), 10_000_000, "").as_bytes());
    let _ = bounded(motion("ROOT a{OFFSET 0 0 0}", 0, "").replace("0 Frame", "99999999999 Frame").as_bytes());
}

#[test]
fn long_words_and_nothing_but_spaces() {
    let digits = "9".repeat(20 * MIB);
    assert!(bounded(motion("ROOT r{OFFSET 0 0 0 CHANNELS 1 Xrotation}", 1, &digits).as_bytes()).is_err());
    assert!(bounded(digits.as_bytes()).is_err());
    assert!(bounded(&vec![b' '; 20 * MIB]).is_err());
    assert!(bounded(&vec![b'{'; 20 * MIB]).is_err());
    assert!(bounded(&vec![0; 20 * MIB]).is_err());
    let trailing = motion("ROOT r{OFFSET 0 0 0}", 0, "") + &"{".repeat(10 * MIB);
    assert_eq!(bounded(trailing.as_bytes()).unwrap().warnings.len(), 1);
}

const SAMPLE: &str = "HIERARCHY
ROOT hips
{
\tOFFSET 0 0.9 0
\tCHANNELS 6 Xposition Yposition Zposition Zrotation Xrotation Yrotation
\tJOINT left knee
\t{
\t\tOFFSET 0.1 -0.4 0
\t\tCHANNELS 1 Xrotation
\t\tEnd Site
\t\t{
\t\t\tOFFSET 0 -0.4 0
\t\t}
\t}
\tJOINT spine
\t{
\t\tOFFSET 0 0.3 0
\t\tCHANNELS 4 Xposition Yrotation Zposition Zrotation
\t\tEnd Site
\t\t{
\t\t\tOFFSET 0 0.4 0
\t\t}
\t}
}
ROOT prop
{
\tOFFSET 0 0 0
\tCHANNELS 1 Yposition
}
MOTION
Frames: 3
Frame Time: 0.0333
0 0.9 0 10 -20 30 45 0 90 0 -45 1
0.1 0.9 0 20 -90 30 55 0 190 0.1 -45 1.5
0.2 0.9 0 30 -100 30 65 0 180 0 -45 1e-3
";

const WORDS: [&[u8]; 30] = [
    b"HIERARCHY",
    b"ROOT",
    b"JOINT x",
    b"End Site",
    b"OFFSET",
    b"OFFSET 0 1 0",
    b"CHANNELS",
    b"CHANNELS 0",
    b"MOTION",
    b"Frames:",
    b"Frame Time:",
    b"{",
    b"}",
    b"{ OFFSET 1 1 1 }",
    b"0",
    b"-1",
    b"6",
    b"1e99",
    b"-1e-99",
    b"1e101",
    b"nan",
    b"999999999",
    b"Xrotation",
    b"Yposition",
    b"\r",
    b"\0",
    b"\xff\xfe",
    b":",
    b"hips",
    b"",
];

/// Reads, and writes what could be read.
fn exercise(text: &[u8], counts: &mut [usize; 2]) {
    match read_bvh(text, "mutated.bvh", &BvhOptions::default()) {
        Ok(loaded) => {
            counts[0] += 1;
            let poses = loaded.clips.first().map_or(&[][..], |c| c.poses());
            assert!(poses.iter().all(Pose::is_valid));
            assert!(loaded.rig.rest_pose().frames().iter().all(|f| f.position.is_finite()));
            let Some(clip) = loaded.clips.first() else { return };
            let written = write_bvh_clip(&loaded, clip).unwrap();
            let again = read_bvh(&written, "again.bvh", &BvhOptions::default()).unwrap();
            let rest = loaded.rig.rest_pose().frames();
            for (a, b) in poses.iter().zip(again.clips[0].poses()) {
                let (a, b) = (a.frames(), b.frames());
                let all = a.iter().chain(&b).chain(&rest);
                let size = all.fold(1e-3, |m: f64, f| m.max(f.position.length()));
                for (a, b) in a.iter().zip(&b) {
                    assert!(a.position.distance(b.position) <= 1e-6 * size, "{}", text.escape_ascii());
                }
            }
        }
        Err(error) => {
            counts[1] += 1;
            assert!(error.to_string().starts_with("mutated.bvh, line "), "{error}");
        }
    }
}

#[test]
fn words_replaced_repeated_and_left_out() {
    let (mut random, mut counts) = (Random::new(17), [0; 2]);
    let words: Vec<&[u8]> = SAMPLE.split_inclusive(char::is_whitespace).map(str::as_bytes).collect();
    for _ in 0..20_000 {
        let mut words = words.clone();
        for _ in 0..=random.below(2) {
            let at = random.below(words.len());
            match random.below(5) {
                0 => _ = words.remove(at),
                1 => words.insert(at, words[random.below(words.len())]),
                2 => words[at] = words[random.below(words.len())],
                3 => words.insert(at, WORDS[random.below(WORDS.len())]),
                _ => words[at] = WORDS[random.below(WORDS.len())],
            }
        }
        exercise(&words.join(&b" "[..]), &mut counts);
    }
    assert!(counts.iter().all(|n| *n > 1000), "{counts:?}");
}

#[test]
fn bytes_changed_cut_and_repeated() {
    let (mut random, mut counts) = (Random::new(19), [0; 2]);
    for _ in 0..20_000 {
        let mut bytes = SAMPLE.as_bytes().to_vec();
        for _ in 0..=random.below(3) {
            let at = random.below(bytes.len());
            match random.below(5) {
                0 => bytes.truncate(at + 1),
                1 => bytes[at] ^= 1 << random.below(8),
                2 => bytes[at] = random.bits() as u8,
                3 => bytes[at] = b"0123456789-.e {}\n\r:XYZ"[random.below(22)],
                _ => {
                    let end = (at + random.below(60)).min(bytes.len());
                    let part = bytes[at..end].to_vec();
                    let to = random.below(bytes.len());
                    bytes.splice(to..to, part);
                }
            }
        }
        exercise(&bytes, &mut counts);
    }
    assert!(counts.iter().all(|n| *n > 1000), "{counts:?}");
}
