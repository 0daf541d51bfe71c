//! BVH is read as the text has it, and written such that it reads back the same.
#![allow(clippy::unwrap_used, reason = "a test fails by a panic")]

use crate::common::bvh::*;
use crate::common::*;
use glam::DVec3;
use ikiru_formats::{
    BvhOptions, Loaded, PositionChannels, Warning, read, read_bvh, write_bvh_clip, write_bvh_pose,
};
use ikiru_rig::{EulerOrder, JointMotion, Pose};
use ikiru_testkit::rigs::{Random, random_pose};

fn load(text: &str) -> Loaded {
    read_bvh(text.as_bytes(), "test.bvh", &BvhOptions::default()).unwrap()
}

fn written(loaded: &Loaded) -> String {
    String::from_utf8(write_bvh_clip(loaded, &loaded.clips[0]).unwrap()).unwrap()
}

/// All frames of the rig against 4×4 matrices straight from the text.
fn assert_matrices(text: &str, loaded: &Loaded, in_place: bool) {
    let reference = Reference::parse(text, in_place);
    assert_eq!(loaded.rig.n_joints(), reference.joints.len());
    let n_frames = reference.frames.len();
    assert_eq!(n_frames, loaded.clips.first().map_or(0, |c| c.poses().len()));
    for (idx, frame) in reference.frames.iter().enumerate() {
        let frames = loaded.clips[0].poses()[idx].frames();
        for (joint, (matrix, frame)) in reference.world(frame).iter().zip(&frames).enumerate() {
            let found = glam::DMat4::from(glam::DAffine3::from(*frame));
            assert!(matrix.abs_diff_eq(found, 1e-9), "frame {idx} joint {joint}: {matrix} {found}");
        }
    }
}

/// Numbers of two texts, word by word, the same within `tolerance`; other words exactly.
fn assert_same_words(a: &str, b: &str, tolerance: f64) {
    let (a, b): (Vec<_>, Vec<_>) = (a.split_whitespace().collect(), b.split_whitespace().collect());
    assert_eq!(a.len(), b.len());
    for (idx, (a, b)) in a.iter().zip(&b).enumerate() {
        match (a.parse::<f64>(), b.parse::<f64>()) {
            (Ok(x), Ok(y)) => assert!((x - y).abs() <= tolerance, "word {idx}: {a} and {b}"),
            _ => assert_eq!(a, b, "word {idx}"),
        }
    }
}

const CMU: &str = "mocap/cmu_01_01_30fps.bvh";

#[test]
fn a_motion_of_the_cmu_database_is_as_its_text_has_it() {
    let text = std::fs::read_to_string(data(CMU)).unwrap();
    let loaded = read(data(CMU)).unwrap();
    assert_eq!(loaded.rig.n_joints(), 38);
    assert_eq!(loaded.rig.root().unwrap().index(), 0);
    assert_eq!(loaded.rig.joints()[0].motion, JointMotion::FREE);
    let knee = loaded.rig.joint("LeftLeg").unwrap();
    assert!(matches!(
        loaded.rig.get(knee).unwrap().motion,
        JointMotion::Euler { order: EulerOrder::Zyx, .. }
    ));
    assert_eq!(loaded.clips.len(), 1);
    let clip = &loaded.clips[0];
    assert_eq!(clip.poses().len(), 688);
    assert!((clip.duration_secs() - 687.0 * 0.0333332).abs() < 1e-9);
    assert_matrices(&text, &loaded, false);
    match &loaded.warnings[..] {
        [Warning::Height { metres, scale: 1.0, likely: Some(likely) }] => {
            assert_eq!(*likely, 0.056444);
            assert!((1.4..1.8).contains(&(metres * likely)), "{metres}");
        }
        other => panic!("{other:?}"),
    }
    let options = BvhOptions { scale: 0.056444, ..BvhOptions::default() };
    let scaled = read_bvh(text.as_bytes(), "cmu", &options).unwrap();
    assert_eq!(scaled.warnings, []);
    let heights = [&loaded, &scaled].map(|l| l.clips[0].poses()[0].frames()[20].position);
    assert!((heights[0] * 0.056444).distance(heights[1]) < 1e-12);
}

#[test]
fn a_motion_of_the_cmu_database_round_trips() {
    let text = std::fs::read_to_string(data(CMU)).unwrap();
    for scale in [1.0, 0.056444] {
        let loaded =
            read_bvh(text.as_bytes(), "cmu", &BvhOptions { scale, ..BvhOptions::default() }).unwrap();
        let again = written(&loaded);
        let (before, after) = (Reference::parse(&text, false), Reference::parse(&again, false));
        assert_eq!(before.header, after.header);
        let mut n_canonical = 0;
        for (before, after) in before.frames.iter().zip(&after.frames) {
            // The root's middle angle leaves ±90° in some frames; it is then written as its equal.
            let root_is_canonical = before[4].abs() <= 90.0 && before[3].abs().max(before[5].abs()) <= 180.0;
            n_canonical += usize::from(root_is_canonical);
            for (idx, (a, b)) in before.iter().zip(after).enumerate() {
                if root_is_canonical || !(3..6).contains(&idx) {
                    assert!((a - b).abs() < 1e-6, "{a} {b}");
                }
            }
        }
        assert!(n_canonical > 100, "{n_canonical}");
        let options = BvhOptions { scale, ..BvhOptions::default() };
        let reread = read_bvh(again.as_bytes(), "again", &options).unwrap();
        for (a, b) in loaded.clips[0].poses().iter().zip(reread.clips[0].poses()) {
            assert_same_frames_to(&a.frames(), &b.frames(), 1e-9);
        }
        assert_eq!(written(&reread), again, "what was written once is written the same again");
    }
}

/// Every kind of joint that a file can have.
const ZOO: &str = "HIERARCHY
ROOT first
{
  OFFSET 0.5 1 0.25
  CHANNELS 6 Yrotation Zposition Xrotation Xposition Zrotation Yposition
  JOINT one
  {
    OFFSET 0.1 0.2 0.3
    CHANNELS 1 Zrotation
    JOINT two
    {
      OFFSET 0 -0.5 0
      CHANNELS 2 Yrotation Xrotation
      End Site
      {
        OFFSET 0 0.25 0
      }
      End Site
      {
        OFFSET 0 0.125 0
      }
    }
  }
  JOINT slider
  {
    OFFSET 0 0.5 0
    CHANNELS 1 Yposition
    JOINT none
    {
      OFFSET 0.5 0 0
      CHANNELS 0
      JOINT free
      {
        OFFSET 0.25 0.5 0.125
        CHANNELS 3 Xposition Zposition Zrotation
      }
    }
  }
}
ROOT second
{
  OFFSET 0 0 0
  CHANNELS 3 Xrotation Zrotation Yrotation
}
MOTION
Frames: 3
Frame Time: 0.5
10 0.5 20 -0.25 30 0.125  40 400 -120 0.25 0.01 0.02 90 1 2 3
-10 0 45 0 60 0  -190 90 90 -0.25 0 0.25 -90 179 -80 -179
0 0 0 0 0 0  0 0 0 0 0 0 0 0 0 0
";

#[test]
fn every_kind_of_joint() {
    let loaded = load(ZOO);
    assert_eq!(loaded.warnings, []);
    let kinds: Vec<_> =
        loaded.rig.joints().iter().map(|j| format!("{} {}", j.name, j.motion.name())).collect();
    let expected = [
        "first free",
        "one hinge",
        "two euler",
        "two_end fixed",
        "two_end_2 fixed",
        "slider slider",
        "none fixed",
        "free free",
        "second euler",
    ];
    assert_eq!(kinds, expected);
    assert!(loaded.clips[0].poses().iter().all(|p| p.limit_violation() < 1e-12));
    let JointMotion::Euler { order, ranges } = loaded.rig.joints()[2].motion else { panic!() };
    assert_eq!(order, EulerOrder::Yxz);
    assert_eq!((ranges[2].min, ranges[2].max), (0.0, 0.0));
    assert_matrices(ZOO, &loaded, false);
    assert_same_words(ZOO, &written(&loaded), 1e-9);
}

#[test]
fn all_orders_of_channels() {
    for order in EulerOrder::ALL {
        let words = order.axes().map(|a| ["Xrotation", "Yrotation", "Zrotation"][a]);
        let text = format!(
            "HIERARCHY ROOT a {{ OFFSET 0 0 0 CHANNELS 6 Xposition Yposition Zposition {0} {1} {2}
            JOINT b {{ OFFSET 0 1 0 CHANNELS 3 {0} {1} {2} End Site {{ OFFSET 0.5 0.25 0 }} }} }}
            MOTION Frames: 3 Frame Time: 0.1
            1 2 3 10 20 30 40 50 60
            1 2 3 -170 89 170 720 -91 -181
            1 2 3 0 90 30 10 -90 0",
            words[0], words[1], words[2]
        );
        let loaded = load(&text);
        assert_matrices(&text, &loaded, false);
        let again = load(&written(&loaded));
        for (a, b) in loaded.clips[0].poses().iter().zip(again.clips[0].poses()) {
            assert_same_frames_to(&a.frames(), &b.frames(), 1e-9);
        }
        let numbers = Reference::parse(&written(&loaded), false);
        let (first, second) = (&numbers.frames[0], &numbers.frames[1]);
        for (found, wanted) in first.iter().chain(second).zip([
            1.0, 2.0, 3.0, 10.0, 20.0, 30.0, 40.0, 50.0, 60.0, //
            // The root's -170, 89, 170 is the same rotation as what is nearer to the frame before.
            1.0, 2.0, 3.0, 10.0, 91.0, -10.0, 720.0, -91.0, -181.0,
        ]) {
            assert!((found - wanted).abs() < 1e-6, "{found} {wanted}");
        }
    }
}

#[test]
fn positions_on_top_of_offsets_or_in_their_place() {
    let text = |root: &str, numbers: &str| {
        format!(
            "HIERARCHY ROOT hips {{ OFFSET {root} CHANNELS 6 Xposition Yposition Zposition Zrotation
            Xrotation Yrotation JOINT spine {{ OFFSET 0 0.5 0 CHANNELS 6 Xposition Yposition Zposition
            Zrotation Xrotation Yrotation End Site {{ OFFSET 0 0.4 0 }} }} }} MOTION Frames: 2
            Frame Time: 0.1 {numbers}"
        )
    };
    let in_place = text("0 0.9 0", "5 0.85 7 0 10 0 0 0.5 0 0 20 0   6 0.95 7 0 10 0 0 0.5 0 0 20 0");
    let on_top = text("0 0.9 0", "5 -0.05 7 0 10 0 0 0 0 0 20 0   6 0.05 7 0 10 0 0 0 0 0 20 0");
    let frames = [(&in_place, true), (&on_top, false)].map(|(text, is_in_place)| {
        let loaded = load(text);
        assert_matrices(text, &loaded, is_in_place);
        // A joint that does not translate in any frame is what its rotations make it.
        assert_eq!(loaded.rig.joints()[1].motion.name(), "euler");
        assert_eq!(loaded.rig.joints()[1].rest_translation, DVec3::new(0.0, 0.5, 0.0));
        assert_eq!(loaded.rig.joints()[0].rest_translation, DVec3::new(0.0, 0.9, 0.0));
        assert_same_words(text, &written(&loaded), 1e-9);
        loaded.clips[0].poses()[1].frames()
    });
    assert_same_frames_to(&frames[0], &frames[1], 1e-12);
    // Said rather than found out.
    let options = BvhOptions { positions: PositionChannels::OnTop, ..BvhOptions::default() };
    let other = read_bvh(in_place.as_bytes(), "test.bvh", &options).unwrap();
    assert_matrices(&in_place, &other, false);
    let again = load(&written(&other));
    let last = |l: &Loaded| l.clips[0].poses()[1].frames();
    assert_same_frames_to(&last(&other), &last(&again), 1e-9);
    // Moved to where the other reading would be nearer: offsets give way, world frames hold.
    let mut moved = load(&on_top);
    let mut pose: Pose = moved.clips[0].poses()[0].clone();
    pose.set_translation(moved.rig.root().unwrap(), DVec3::new(0.0, 0.8, 0.0)).unwrap();
    let bytes = write_bvh_pose(&moved, &pose).unwrap();
    let again = read_bvh(&bytes, "again", &BvhOptions::default()).unwrap();
    assert_same_frames_to(&pose.frames(), &again.clips[0].poses()[0].frames(), 1e-9);
    assert!(String::from_utf8(bytes).unwrap().contains("OFFSET 0 0 0"));
    // A joint whose positions change translates.
    moved = load(&on_top.replacen("6 0.05 7 0 10 0 0 0", "6 0.05 7 0 10 0 0 0.1", 1));
    assert_eq!(moved.rig.joints()[1].motion, JointMotion::FREE);
}

#[test]
fn whitespace_case_and_line_ends_do_not_matter() {
    let plain = load(ZOO);
    let words: Vec<&str> = ZOO.split_whitespace().collect();
    let by_line = words.join("\n").replace("End\nSite", "End Site");
    let variants = [
        by_line.clone(),
        by_line.replace('\n', "\r"),
        ZOO.replace('\n', "\r\n"),
        ZOO.replace("  ", "\t \t"),
        ZOO.trim_end().to_owned(),
        format!("\u{feff}{ZOO}\n\n \t\r\n\u{1a}"),
        ZOO.replace("\n", "\n\n \n"),
        ZOO.replace("OFFSET", "Offset").replace("CHANNELS", "channels").replace("JOINT", "Joint"),
        ZOO.replace("rotation", "ROTATION").replace("HIERARCHY", "hierarchy").replace("MOTION", "Motion"),
        ZOO.replace("Frames: 3", "FRAMES:3").replace("Frame Time: 0.5", "frame time :.5"),
        ZOO.replace("{", " { ").replace("one\n  {", "one{"),
        ZOO.replace("End Site", "end site"),
    ];
    for text in variants {
        let loaded = load(&text);
        assert_eq!(loaded.warnings, [], "{text}");
        assert_eq!(loaded.rig.joints(), plain.rig.joints(), "{text}");
        let (a, b) = (&loaded.clips[0], &plain.clips[0]);
        assert_eq!(a.times(), b.times());
        assert!(a.poses().iter().zip(b.poses()).all(|(a, b)| a.coords() == b.coords()));
    }
}

fn tree(inner: &str) -> String {
    format!("HIERARCHY\nROOT hips\n{{ OFFSET 0 1 0\n{inner} }}\nMOTION\nFrames: 0\nFrame Time: 0.1")
}

#[test]
fn names_of_every_kind() {
    let joint = |name: &str| format!("JOINT {name}\n{{ OFFSET 0 0.5 0 End Site\n{{ OFFSET 0 0 0 }} }}\n");
    let inner: String =
        ["Left Arm", "mixamorig:Hips", "hips", "hips", "", "hips_2", "", "右手", "Left Arm_end"]
            .map(joint)
            .concat();
    let text = tree(&inner);
    let loaded = load(&text);
    let names: Vec<_> = loaded.rig.joints().iter().map(|j| j.name.as_str()).collect();
    let expected = [
        "hips",
        "Left Arm",
        // Taken by a joint further down.
        "Left Arm_end_2",
        "mixamorig:Hips",
        "mixamorig:Hips_end",
        "hips_3",
        "hips_3_end",
        "hips_4",
        "hips_4_end",
        "joint_9",
        "joint_9_end",
        "hips_2",
        "hips_2_end",
        "joint_13",
        "joint_13_end",
        "右手",
        "右手_end",
        "Left Arm_end",
        "Left Arm_end_end",
    ];
    assert_eq!(names, expected);
    let messages: Vec<_> = loaded.warnings.iter().map(ToString::to_string).collect();
    let expected = [
        "node 5: the name 'hips' is taken, it is called 'hips_3'",
        "node 7: the name 'hips' is taken, it is called 'hips_4'",
        "2 nodes have no name, they are called 'joint_9' and so on",
    ];
    assert_eq!(messages, expected);
    // The file's own names are written again.
    let again = String::from_utf8(write_bvh_pose(&loaded, &loaded.rig.rest_pose()).unwrap()).unwrap();
    let lines = |text: &str| -> Vec<String> {
        text.lines().map(str::trim).filter(|l| l.starts_with("JOINT")).map(str::to_owned).collect()
    };
    assert_eq!(lines(&again), lines(&text));

    let bytes =
        [b"HIERARCHY ROOT h\xe9\xe9 { OFFSET 0 1 0 } MOTION Frames: 0 Frame Time: 1".as_slice()].concat();
    let loaded = read_bvh(&bytes, "test.bvh", &BvhOptions::default()).unwrap();
    assert_eq!(loaded.rig.joints()[0].name, "h??");
    assert!(matches!(&loaded.warnings[0], Warning::NameBytes { name } if name == "h??"));
    let again = write_bvh_pose(&loaded, &loaded.rig.rest_pose()).unwrap();
    assert!(again.windows(4).any(|w| w == b" h\xe9\xe9"));
}

#[test]
fn end_sites_of_odd_kinds() {
    let text = tree(
        "End Site { OFFSET 0 1 0 End Site { OFFSET 0 0 1 } } End Tip { OFFSET 1 0 0 }
         End Site { OFFSET 0 2 0 CHANNELS 3 Xrotation Yrotation Zrotation JOINT more { OFFSET 0 0 0 } }",
    );
    let loaded = load(&text);
    let names: Vec<_> = loaded.rig.joints().iter().map(|j| j.name.as_str()).collect();
    assert_eq!(names, ["hips", "hips_end", "hips_end_end", "Tip", "hips_end_2", "more"]);
    let again =
        read_bvh(&write_bvh_pose(&loaded, &loaded.rig.rest_pose()).unwrap(), "x", &BvhOptions::default())
            .unwrap();
    assert_eq!(again.rig.joints(), loaded.rig.joints());
}

#[test]
fn a_file_without_frames_is_a_rig() {
    let loaded = load(&tree("CHANNELS 3 Xposition Yposition Zposition"));
    assert!(loaded.clips.is_empty());
    assert_eq!(loaded.rig.joints()[0].motion.name(), "free");
    // Positions alone: the cone leaves no rotation.
    let mut pose = loaded.rig.rest_pose();
    pose.set_rotation(loaded.rig.root().unwrap(), glam::DQuat::from_rotation_x(1.0)).unwrap();
    pose.project();
    assert!(pose.rotation(loaded.rig.root().unwrap()).unwrap().w > 1.0 - 1e-12);
}

#[test]
fn numbers_behind_the_last_frame_give_a_warning() {
    let loaded = load(&format!("{ZOO}1 2 x\n"));
    let message = loaded.warnings[0].to_string();
    assert_eq!(message, "after 3 frames of 16 numbers the file goes on with 3 more, which were left unread");
    assert_eq!(loaded.clips[0].poses().len(), 3);
}

#[test]
fn heights_that_no_human_has_suggest_a_scale() {
    for (height, likely) in [
        (170.0, Some(0.01)),
        (1700.0, Some(0.001)),
        (65.0, Some(0.0254)),
        (30.0, Some(0.056444)),
        (1e6, None),
    ] {
        let text = tree("End Site { OFFSET 0 170 0 }").replace("170", &height.to_string());
        let loaded = load(&text);
        assert_eq!(loaded.warnings, [Warning::Height { metres: height, scale: 1.0, likely }]);
    }
    let text = tree("End Site { OFFSET 0 170 0 }");
    let options = BvhOptions { scale: 0.01, ..BvhOptions::default() };
    assert_eq!(read_bvh(text.as_bytes(), "x", &options).unwrap().warnings, []);
}

#[test]
fn poses_of_a_file_that_its_channels_cannot_hold() {
    let loaded = load(ZOO);
    // Every joint moves in every way.
    let mut builder = loaded.rig.to_builder();
    for id in loaded.rig.ids() {
        builder.set_motion(id, JointMotion::FREE).unwrap();
    }
    let rig = builder.build().unwrap();
    let loaded = loaded.with_rig(rig.clone()).unwrap();
    let mut random = Random::new(5);
    let poses: Vec<Pose> = (0..4).map(|_| random_pose(&rig, &mut random)).collect();
    let clip = ikiru_rig::Clip::new("", vec![0.0, 0.1, 0.2, 0.3], poses.clone()).unwrap();
    let bytes = write_bvh_clip(&loaded, &clip).unwrap();
    let again = read_bvh(&bytes, "again", &BvhOptions::default()).unwrap();
    for (a, b) in poses.iter().zip(again.clips[0].poses()) {
        assert_same_frames_to(&a.frames(), &b.frames(), 1e-9);
    }
}
