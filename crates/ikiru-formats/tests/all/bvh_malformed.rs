//! Wrong BVH files, each in one way: the error names place, what was found and what was expected.
#![allow(clippy::unwrap_used, reason = "a test fails by a panic")]

use ikiru_formats::{BvhOptions, ErrorKind, Place, read_bvh};

const GOOD: &str = "HIERARCHY
ROOT hips
{
  OFFSET 0 1 0
  CHANNELS 3 Zrotation Xrotation Yrotation
  JOINT knee
  {
    OFFSET 0 -0.5 0
    CHANNELS 1 Xrotation
    End Site
    {
      OFFSET 0 -0.5 0
    }
  }
}
MOTION
Frames: 2
Frame Time: 0.1
1 2 3 4
5 6 7 8
";

fn message(text: &str) -> String {
    read_bvh(text.as_bytes(), "bad.bvh", &BvhOptions::default()).unwrap_err().to_string()
}

/// The message where one part of the good file is replaced.
#[track_caller]
fn of(part: &str, by: &str) -> String {
    assert_eq!(GOOD.matches(part).count(), 1, "{part}");
    message(&GOOD.replace(part, by))
}

#[test]
fn the_good_file_is_good() {
    let loaded = read_bvh(GOOD.as_bytes(), "good.bvh", &BvhOptions::default()).unwrap();
    assert_eq!((loaded.warnings.len(), loaded.clips[0].poses().len()), (0, 2));
}

#[test]
fn words_out_of_place() {
    let cases = [
        (
            "HIERARCHY",
            "SKELETON",
            "line 1 column 1: found 'SKELETON', expected HIERARCHY, with which a BVH file begins",
        ),
        ("ROOT", "JOINTS", "line 2 column 1: found 'JOINTS', expected ROOT"),
        ("hips\n{", "hips\n", "line 4 column 3: found 'OFFSET', expected { after the name"),
        ("MOTION", "JOINT", "line 16 column 1: found 'JOINT', expected ROOT or MOTION"),
        (
            "}\nMOTION",
            "MOTION",
            "line 15 column 1: found 'MOTION', expected OFFSET, CHANNELS, JOINT, End Site or }",
        ),
        ("}\nMOTION", "}}\nMOTION", "line 15 column 2: found '}', expected ROOT or MOTION"),
        (
            "  JOINT",
            "  ROOT",
            "line 6 column 3: found 'ROOT', expected OFFSET, CHANNELS, JOINT, End Site or }",
        ),
        ("Frames:", "Frame:", "line 17 column 1: found 'Frame', expected Frames:"),
        ("Frame Time", "Frame Rate", "line 18 column 7: found 'Rate', expected Frame Time:"),
    ];
    for (part, by, expected) in cases {
        assert_eq!(of(part, by), format!("bad.bvh, {expected}"));
    }
    assert_eq!(
        message(""),
        "bad.bvh, line 1 column 1: found the end of the file, expected HIERARCHY, with which a BVH file begins"
    );
    assert!(message("HIERARCHY MOTION").ends_with("column 11: found 'MOTION', expected ROOT"));
    assert!(message(&"x".repeat(5000)).len() < 400);
}

#[test]
fn channels() {
    let cases = [
        ("CHANNELS 3", "CHANNELS 4", "line 6 column 3: found 'JOINT', expected a channel: Xposition, "),
        ("CHANNELS 3", "CHANNELS 2", "line 5 column 34: found 'Yrotation', expected OFFSET, CHANNELS"),
        ("CHANNELS 3", "CHANNELS 7", "line 5 column 12: found '7', expected a number of channels, 0 to 6"),
        ("CHANNELS 3", "CHANNELS -1", "line 5 column 12: found '-1', expected a number of channels, 0 to 6"),
        (
            "CHANNELS 3 Z",
            "CHANNELS 3 W",
            "line 5 column 14: found 'Wrotation', expected a channel: Xposition",
        ),
        ("Yrotation", "Zrotation", "line 5 column 34: joint 'hips' has Zrotation twice, expected it once"),
        (
            "CHANNELS 1 Xrotation",
            "CHANNELS 1 Xrotation CHANNELS 0",
            "line 9 column 26: joint 'knee' has CHANNELS twice, expected it once",
        ),
    ];
    for (part, by, expected) in cases {
        let found = of(part, by);
        assert!(found.starts_with(&format!("bad.bvh, {expected}")), "{found}");
    }
}

#[test]
fn offsets() {
    let cases = [
        (
            "OFFSET 0 1 0",
            "OFFSET 0 1",
            "line 5 column 3: found 'CHANNELS', expected a number between -1e100 and 1e100",
        ),
        ("OFFSET 0 1 0", "OFFSET 0 1,5 0", "line 4 column 12: found '1,5', expected a number between"),
        ("OFFSET 0 1 0", "OFFSET 0 nan 0", "line 4 column 12: found 'nan', expected a number between"),
        ("OFFSET 0 1 0", "OFFSET 0 -inf 0", "line 4 column 12: found '-inf', expected a number between"),
        ("OFFSET 0 1 0", "OFFSET 0 1e300 0", "line 4 column 12: found '1e300', expected a number between"),
        ("OFFSET 0 1 0", "", "line 2 column 1: joint 'hips' has no OFFSET, expected one"),
        ("      OFFSET 0 -0.5 0", "", "line 10 column 5: joint 'knee_end' has no OFFSET, expected one"),
        (
            "OFFSET 0 1 0",
            "OFFSET 0 1 0 OFFSET 0 1 0",
            "line 4 column 16: joint 'hips' has an OFFSET twice, expected it once",
        ),
    ];
    for (part, by, expected) in cases {
        let found = of(part, by);
        assert!(found.starts_with(&format!("bad.bvh, {expected}")), "{found}");
    }
}

#[test]
fn header_of_the_motion() {
    for bad in ["-1", "2.5", "many", "nan", "1e30"] {
        assert_eq!(
            of("Frames: 2", &format!("Frames: {bad}")),
            format!("bad.bvh, line 17 column 9: found '{bad}', expected a number of frames, 0 or more")
        );
    }
    for bad in ["0", "-0.1", "nan", "inf", "0.0", "fast"] {
        assert_eq!(
            of("Time: 0.1", &format!("Time: {bad}")),
            format!(
                "bad.bvh, line 18 column 13: found '{bad}', expected seconds from frame to frame, more than 0"
            )
        );
    }
}

#[test]
fn frames() {
    assert_eq!(
        of("7 8\n", "7"),
        "bad.bvh, line 20 column 6: frame 2 of 2 has 3 of 4 numbers when the file ends"
    );
    assert_eq!(
        of("Frames: 2", "Frames: 999999999"),
        "bad.bvh, line 21 column 1: frame 3 of 999999999 has 0 of 4 numbers when the file ends"
    );
    assert_eq!(
        of("7 8", "7 x"),
        "bad.bvh, line 20 column 7: found 'x', expected a number between -1e100 and 1e100"
    );
    let text = "HIERARCHY ROOT a { OFFSET 0 1 0 } MOTION Frames: 999999999 Frame Time: 1";
    let error = read_bvh(text.as_bytes(), "bad.bvh", &BvhOptions::default()).unwrap_err();
    assert!(matches!(error.kind(), ErrorKind::LongMotion { frames: 999_999_999, .. }), "{error}");
}

#[test]
fn places_count_all_kinds_of_line_ends() {
    for end in ["\n", "\r\n", "\r"] {
        let text = GOOD.replace("7 8", "7 x").replace('\n', end);
        let error = read_bvh(text.as_bytes(), "bad.bvh", &BvhOptions::default()).unwrap_err();
        assert_eq!(*error.place(), Place::Line { line: 20, column: 7 });
    }
}

#[test]
fn scales() {
    for scale in [0.0, -1.0, f64::NAN, f64::INFINITY, 1e-10, 1e10] {
        let options = BvhOptions { scale, ..BvhOptions::default() };
        let error = read_bvh(GOOD.as_bytes(), "bad.bvh", &options).unwrap_err();
        assert!(matches!(error.kind(), ErrorKind::Scale { .. }), "{error}");
    }
}
