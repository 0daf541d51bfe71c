//! Robot descriptions that were not made in good faith: whatever comes in, there is an answer, with bounded work and
//! memory, and it is a valid rig or an error.
#![allow(clippy::unwrap_used, reason = "a test fails by a panic")]

use crate::common::bounds::{self, MIB};
use crate::common::*;
use ikiru_formats::{Error, Loaded, read_urdf};
use ikiru_rig::RigBuilder;
use ikiru_testkit::rigs::Random;
use std::fmt::Write;

/// Reads within the work and memory that are promised for a text's size.
#[track_caller]
fn bounded(text: &str) -> Result<Loaded, Error> {
    // The bytes of the file itself count as well, where it is read from disk.
    bounds::bounded(text.len(), text.len(), || read_urdf(text.as_bytes(), "hostile.urdf"))
}

/// The message for a text, which may not be long.
#[track_caller]
fn message(text: &str) -> String {
    let message = bounded(text).unwrap_err().to_string();
    assert!(message.len() < 1500, "{}", message.len());
    message
}

#[test]
fn elements_inside_of_elements() {
    let deep = "<a>".repeat(100_000);
    let expected =
        "<a> (line 1 column 773): elements are nested deeper than 256 levels, the most that are read";
    assert_eq!(message(&format!("<robot>{deep}")), format!("hostile.urdf, {expected}"));
    let closed = format!("<robot>{deep}{}</robot>", "</a>".repeat(100_000));
    assert!(message(&closed).contains("deeper than 256 levels"));
    // As deep as is allowed, inside of what is skipped.
    let fine = format!("<robot><link name='a'>{}{}</link></robot>", "<b>".repeat(254), "</b>".repeat(254));
    assert_eq!(bounded(&fine).unwrap().rig.n_joints(), 1);
}

#[test]
fn entities_that_would_grow() {
    let mut laughs = String::from("<?xml version='1.0'?>\n<!DOCTYPE robot [<!ENTITY lol0 'lol'>\n");
    for n in 1..10 {
        let _ = writeln!(laughs, "<!ENTITY lol{n} '{}'>", format!("&lol{};", n - 1).repeat(10));
    }
    let by_text = format!("{laughs}]>\n<robot>&lol9;</robot>");
    assert!(message(&by_text).contains("line 13 column 8: the entity '&lol9;' is not known"));
    let by_attribute = format!("{laughs}]>\n<robot><link name='&lol9;'/></robot>");
    assert!(message(&by_attribute).contains("<link> (line 13 column 8): the entity '&lol9;' is not known"));
    // A document type by itself does no harm, however long; nor does one that refers to files.
    let long =
        format!("<!DOCTYPE robot [{}]><robot><link name='a'/></robot>", "<!ENTITY a 'b>'>".repeat(200_000));
    assert_eq!(bounded(&long).unwrap().rig.n_joints(), 1);
    let file =
        "<!DOCTYPE robot [<!ENTITY f SYSTEM 'file:///etc/hostname'>]><robot><link name='&f;'/></robot>";
    assert!(message(file).contains("the entity '&f;' is not known"));
}

#[test]
fn long_names_numbers_and_attributes() {
    let long = "x".repeat(10_000_000);
    let rig = bounded(&format!("<robot><link name='{long}'/></robot>")).unwrap().rig;
    assert_eq!(rig.joints()[0].name.len(), long.len());
    assert!(
        message(&format!("<robot><link name='{long}'/><link name='{long}'/></robot>"))
            .contains("exists already")
    );
    assert!(
        message(&format!("<robot><joint name='{long}' type='{long}'/></robot>")).contains("is not known")
    );
    assert!(message(&format!("<robot><link name='&{long};'/></robot>")).contains("is not known"));
    assert!(message(&format!("<robot><xacro:{long}/></robot>")).contains("run xacro"));
    assert!(message(&format!("<robot><{long}><link/></robot>")).contains("not valid XML"));
    assert!(message(&format!("<{long}/>")).contains("expected <robot>"));
    let origin = |xyz: &str| {
        message(&format!("<robot><joint name='{long}' type='fixed'><origin xyz='{xyz}'/></joint></robot>"))
    };
    assert!(origin(&long).contains("expected three numbers"));
    assert!(origin(&"1 ".repeat(5_000_000)).contains("expected three numbers"));
    assert!(origin(&"1".repeat(10_000_000)).contains("expected three numbers"));
    let links = format!(
        "<robot><link name='a'/><joint name='j' type='fixed'><parent link='{long}'/><child link='a'/></joint></robot>"
    );
    assert!(message(&links).contains("the parent link is unknown"));
    // One element with a million attributes, all the same or all different.
    let same = format!("<robot><link {}/></robot>", "a='' ".repeat(1_000_000));
    assert!(message(&same).contains("the attribute name is missing"));
    let mut text = String::from("<robot><link name='a' ");
    (0..1_000_000).for_each(|n| write!(text, "a{n}='' ").unwrap());
    assert_eq!(bounded(&(text + "/></robot>")).unwrap().rig.n_joints(), 1);
    // Line breaks without end, before each of many warnings.
    let collision = "<collision><geometry><sphere/></geometry></collision>\n".repeat(100_000);
    let loaded = bounded(&format!("<robot><link name='a'>{collision}</link></robot>")).unwrap();
    assert_eq!(loaded.warnings.len(), 101);
}

/// A chain of fixed joints.
fn chain(n_joints: usize) -> String {
    let mut text = String::from("<robot><link name='l0'/>");
    for n in 1..=n_joints {
        let above = n - 1;
        let _ = write!(
            text,
            "\n<link name='l{n}'/><joint name='j{n}' type='fixed'><parent link='l{above}'/><child link='l{n}'/></joint>"
        );
    }
    text + "</robot>"
}

#[test]
fn more_joints_than_a_rig_may_have() {
    let most = RigBuilder::MOST_JOINTS;
    assert_eq!(bounded(&chain(most - 1)).unwrap().rig.n_joints(), most);
    assert!(message(&chain(1_000_000)).contains("<link> (line 100001 column 1): more than 100000 elements"));
    // Every planar joint is three.
    let planar = chain(most / 2).replace("fixed", "planar");
    assert_eq!(
        message(&planar),
        "hostile.urdf, <joint> (line 33335 column 22): 150001 joints are more than the 100000 that a rig may have"
    );
    let planar = chain(most - 1).replace("fixed", "planar");
    assert!(message(&planar).contains("299998 joints are more than the 100000 that a rig may have"));
    // As small as joints and links can be, and as large as what becomes of them can be.
    let planar = chain((most - 1) / 3).replace("fixed", "planar");
    assert_eq!(bounded(&planar).unwrap().rig.n_joints(), most);
    let followers = chain(most - 1).replace("'j1' type='fixed'>", "'j1' type='continuous'>").replace(
        "type='fixed'>",
        "type='prismatic'><axis xyz='1 2 3'/><origin xyz='1 2 3'/><limit upper='1'/><mimic joint='j1'/>",
    );
    assert_eq!(bounded(&followers).unwrap().rig.n_dofs(), 1);
    // The shortest way to say so.
    let mut short = String::from("<robot><link name='0'/>");
    for n in 1..most {
        let _ = write!(
            short,
            "<link name='{n}'/><joint name='{n}' type='fixed'><parent link='0'/><child link='{n}'/></joint>"
        );
    }
    assert_eq!(bounded(&(short + "</robot>")).unwrap().rig.n_joints(), most);
}

#[test]
fn long_names_of_joints_and_links() {
    let long = "x".repeat(5 * MIB);
    for (kind, n_joints) in [("fixed", 2), ("planar", 4)] {
        let text = format!(
            "<robot><link name='a'/><link name='{long}l'/><joint name='{long}j' type='{kind}'><parent link='a'/>\
             <child link='{long}l'/></joint></robot>"
        );
        assert_eq!(bounded(&text).unwrap().rig.n_joints(), n_joints);
    }
    // Entities are shorter than what stands for them.
    let escaped = "&lt;".repeat(5 * MIB);
    assert_eq!(bounded(&format!("<robot><link name='{escaped}'/></robot>")).unwrap().rig.n_joints(), 1);
    let mut many = String::from("<robot><link name='0'/>");
    for n in 1..1000 {
        let _ = write!(
            many,
            "<link name='{n}'/><joint name='{}{n}' type='planar'><parent link='0'/><child link='{n}'/></joint>",
            "x".repeat(20_000)
        );
    }
    assert_eq!(bounded(&(many + "</robot>")).unwrap().rig.n_joints(), 2998);
}

#[test]
fn many_collision_shapes_and_warnings() {
    let solid = "<collision><geometry><box size='1 1 1'/></geometry></collision>";
    let robot = |inside: &str| format!("<robot><link name='a'>{inside}</link></robot>");
    assert_eq!(bounded(&robot(&solid.repeat(300_000))).unwrap().collision_shapes().len(), 300_000);
    // Right before and right after a list of them has grown.
    for n in [(1 << 18) - 1, (1 << 18) + 1] {
        assert_eq!(bounded(&robot(&solid.repeat(n))).unwrap().collision_shapes().len(), n);
    }
    let empty = "<collision/>".repeat(1_000_000);
    assert_eq!(bounded(&robot(&empty)).unwrap().collision_shapes().len(), 0);
    // Far from the start of the file, each with a line to be counted and a long name.
    let far = format!("<!--{}-->", "\n".repeat(10 * MIB));
    let bad = "<collision><geometry><sphere/></geometry></collision>".repeat(200);
    let name = "x".repeat(MIB);
    let loaded = bounded(&format!("<robot>{far}<link name='{name}'>{bad}</link></robot>")).unwrap();
    assert!(loaded.warnings.iter().all(|warning| warning.to_string().len() < 1500));
    assert_eq!(loaded.warnings.len(), 101);
}

#[test]
fn long_ways_to_an_error() {
    let n_joints = 90_000;
    let circle = chain(n_joints).replace("<parent link='l0'/>", &format!("<parent link='l{n_joints}'/>"));
    // The link l0 is alone then, and the root.
    assert!(message(&circle).contains("go round in a circle"));
    let star = chain(n_joints).replace("<parent link='l0'/>", "<parent link='nobody'/>");
    assert!(message(&star).contains("the parent link is unknown"));
    // Each one follows the next; and then the last follows the first.
    let mut text = String::from("<robot><link name='l0'/>");
    for n in 1..n_joints {
        let (above, next) = (n - 1, n + 1);
        let _ = write!(
            text,
            "<link name='l{n}'/><joint name='j{n}' type='continuous'><parent link='l{above}'/><child link='l{n}'/>\
             <mimic joint='j{next}'/></joint>"
        );
    }
    let last = |rest: &str| {
        let above = n_joints - 1;
        format!(
            "{text}<link name='l{n_joints}'/><joint name='j{n_joints}' type='continuous'><parent link='l{above}'/>\
             <child link='l{n_joints}'/>{rest}</joint></robot>"
        )
    };
    assert_eq!(bounded(&last("")).unwrap().rig.n_dofs(), 1);
    assert!(message(&last("<mimic joint='j1'/>")).contains("the joint follows itself"));
}

#[test]
fn bytes_and_tags_changed_cut_and_repeated() {
    let words: [&[u8]; 24] = [
        b"<",
        b">",
        b"/>",
        b"</",
        b"'",
        b"\"",
        b"=",
        b"&",
        b"&lt;",
        b"&#0;",
        b"<!--",
        b"-->",
        b"<![CDATA[",
        b"<!DOCTYPE",
        b"<?",
        b"nan",
        b"-1e999",
        b"0",
        b"name",
        b"<mimic joint='turn'/>",
        b"<axis xyz='0 0 1e-320'/>",
        b"planar",
        b"<link name='tip'/>",
        b"\xc3",
    ];
    let (mut random, mut counts) = (Random::new(17), [0; 2]);
    for name in ["kinds", "panda", "ur5_robot", "deepmimic_humanoid"] {
        let sample = std::fs::read(robot_file(name)).unwrap();
        // Places where something is said, so that most changes matter.
        let places: Vec<usize> = (0..sample.len()).filter(|i| b"<>\"='".contains(&sample[*i])).collect();
        for _ in 0..3000 {
            let mut bytes = sample.clone();
            for _ in 0..=random.below(3) {
                let near = places[random.below(places.len())] + random.below(3);
                let at = near.min(bytes.len().saturating_sub(1));
                match random.below(8) {
                    0 => bytes.truncate(at),
                    1 if at < bytes.len() => bytes[at] ^= 1 << random.below(8),
                    2 if at < bytes.len() => bytes[at] = random.bits() as u8,
                    3 | 4 => {
                        bytes.splice(at..at, words[random.below(words.len())].iter().copied());
                    }
                    5 => {
                        let end = (at + random.below(12)).min(bytes.len());
                        bytes.drain(at..end);
                    }
                    _ => {
                        let end = (at + random.below(400)).min(bytes.len());
                        let part = bytes[at..end].to_vec();
                        let to = places[random.below(places.len())].min(bytes.len());
                        bytes.splice(to..to, part);
                    }
                }
            }
            match read_urdf(&bytes, "mutated.urdf") {
                Ok(loaded) => {
                    counts[0] += 1;
                    let frames = loaded.rig.rest_pose().frames();
                    assert!(frames.iter().all(|f| f.position.is_finite()));
                    assert!(
                        loaded.collision_shapes().iter().all(|s| s.joint.index() < loaded.rig.n_joints())
                    );
                    for segment in loaded.segments() {
                        assert!(segment.joint.index() < loaded.rig.n_joints());
                        assert!(segment.kg > 0.0 && segment.kg.is_finite() && segment.center.is_finite());
                    }
                }
                Err(error) => {
                    counts[1] += 1;
                    assert!(error.to_string().starts_with("mutated.urdf"));
                }
            }
        }
    }
    assert!(counts.iter().all(|n| *n > 1000), "{counts:?}");
}
