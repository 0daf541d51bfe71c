//! Each way in which a robot description can be wrong, alone: the message names file, line, element, what was
//! found and what was expected.
#![allow(clippy::unwrap_used, reason = "a test fails by a panic")]

use ikiru_formats::urdf::UrdfProblem;
use ikiru_formats::{ErrorKind, Place, read, read_urdf};

/// The message for a text.
fn of(text: &str) -> String {
    read_urdf(text.as_bytes(), "bad.urdf").unwrap_err().to_string()
}

/// The message for a robot of links `a` to `c`, with something from line 2 on.
fn of_robot(inside: &str) -> String {
    of(&format!("<robot name='r'><link name='a'/><link name='b'/><link name='c'/>\n{inside}</robot>"))
}

/// The message for a joint of a type with something inside, on line 3.
fn of_joint(kind: &str, inside: &str) -> String {
    of_robot(&format!(
        "<joint name='j' type='{kind}'><parent link='a'/><child link='b'/>\n  {inside}</joint>
         <joint name='k' type='fixed'><parent link='a'/><child link='c'/></joint>"
    ))
}

/// A joint between two links.
fn joint(name: &str, parent: &str, child: &str) -> String {
    format!("<joint name='{name}' type='fixed'><parent link='{parent}'/><child link='{child}'/></joint>\n")
}

#[test]
fn texts_that_are_not_xml() {
    assert_eq!(of(""), "bad.urdf, line 1 column 1: the file has no element, expected <robot>");
    assert_eq!(of("<!-- \n -->"), "bad.urdf, line 2 column 5: the file has no element, expected <robot>");
    let message = of("{\"a\": 1}");
    assert_eq!(
        message,
        r#"bad.urdf, line 1 column 1: the text "{\"a\": 1}" stands outside of the root element, expected <robot>"#
    );
    assert!(
        of("<robot><link name='a'/></robot> x").contains("line 1 column 32: the text \"x\" stands outside")
    );
    let message = of("<robot>\n<link name='a'>\n</robot>");
    assert_eq!(
        message,
        "bad.urdf, line 3 column 1: not valid XML: ill-formed document: expected `</link>`, but `</robot>` was found"
    );
    let message = of("<robot>\n <link name='a'>\n");
    assert!(
        message.contains("line 2 column 2: not valid XML: the file ends inside of this element"),
        "{message}"
    );
    assert!(of("<robot>\n<link name='a").contains("line 2 column 1: not valid XML: syntax error"));
    assert!(
        of("<robot>\n<!-- ").contains("line 2 column 1: not valid XML: syntax error: comment not closed")
    );
    assert!(of("<robot/><robot/>").contains("<robot> (line 1 column 9): a second root element"));
    assert!(of("</robot>").contains("not valid XML"));
}

#[test]
fn texts_in_another_encoding() {
    let error = read_urdf(b"<robot name='\xe9'/>", "bad.urdf").unwrap_err();
    assert_eq!(error.to_string(), "bad.urdf, byte 13: the text is not UTF-8");
    assert!(matches!((error.place(), error.kind()), (Place::Byte(13), ErrorKind::Urdf(UrdfProblem::Utf8))));
    let utf16: Vec<u8> = "\u{feff}<robot/>".encode_utf16().flat_map(u16::to_le_bytes).collect();
    assert!(read_urdf(&utf16, "bad.urdf").unwrap_err().to_string().contains("byte 0: the text is not UTF-8"));
}

#[test]
fn attributes_that_are_not() {
    let message = |attributes: &str| of(&format!("<robot>\n  <link {attributes}/></robot>"));
    assert_eq!(
        message("name"),
        "bad.urdf, <link> (line 2 column 13): not valid XML: an attribute without `=`"
    );
    assert!(message("name=").contains("an attribute without a value"));
    assert!(message("name=a").contains("an attribute whose value has no quotes"));
    let expected = "bad.urdf, <link> (line 2 column 3): ";
    assert_eq!(
        message("name='a' name='b'"),
        format!("{expected}the attribute name is there twice, expected it once")
    );
    assert_eq!(message(""), format!("{expected}the attribute name is missing, expected a unique name"));
    assert_eq!(message("name=' '"), format!("{expected}the attribute name is empty, expected a unique name"));
    assert!(message("name='&b;'").contains("the entity '&b;' is not known: expected &lt;"));
    assert!(message("name='&#xd800;'").contains("not valid XML"));
    assert!(message("name='&b'").contains("not valid XML"));
}

#[test]
fn files_of_another_kind() {
    let message = of("<?xml version='1.0'?>\n<sdf version='1.6'><model/></sdf>");
    assert_eq!(message, "bad.urdf, line 2 column 1: the root element is <sdf>, expected <robot>");
    assert_eq!(of("<robot/>"), "bad.urdf: the robot has no links, expected at least one");
    let message = read("no_such_file.urdf").unwrap_err().to_string();
    assert!(message.starts_with("no_such_file.urdf: cannot read the file"), "{message}");
    let message = read("robot.xacro").unwrap_err().to_string();
    assert!(
        message.contains(
            "'.xacro' is not one that can be read: expected .glb, .gltf, .vrm, .vrma, .bvh or .urdf"
        ),
        "{message}"
    );
}

#[test]
fn xacro_markup() {
    let run = "has no value yet: run xacro first, `xacro FILE.xacro > FILE.urdf`, and read what it writes";
    let message = of("<robot>\n<xacro:property name='x' value='1'/></robot>");
    assert_eq!(
        message,
        format!("bad.urdf, <xacro:property> (line 2 column 1): the xacro markup <xacro:property> {run}")
    );
    let message = of("<robot><link name='${side}_arm'/></robot>");
    assert_eq!(message, format!("bad.urdf, <link> (line 1 column 8): the xacro markup ${{side}} {run}"));
    let message = of_joint("fixed", "<origin xyz='0 0 ${l/2}'/>");
    assert_eq!(
        message,
        format!("bad.urdf, <origin> of joint 'j' (line 3 column 3): the xacro markup ${{l/2}} {run}")
    );
    assert!(of("<robot><link name='$(arg side)'/></robot>").contains("the xacro markup $(arg side) has"));
    let radius = "<link name='d'><collision><geometry><sphere radius='${r}'/></geometry></collision></link>";
    assert!(of_robot(radius).contains("<sphere> of link 'd' (line 2 column 37): the xacro markup ${r}"));
}

#[test]
fn names_that_stand_twice() {
    assert_eq!(
        of("<robot><link name='a'/>\n<link name='b'/>\n<link name='a'/></robot>"),
        "bad.urdf, link 'a' (line 3 column 1): the link 'a' exists already, since line 1, expected names to be unique"
    );
    let message = of_robot(&[joint("j", "a", "b"), joint("j", "b", "c")].concat());
    assert!(
        message.contains("joint 'j' (line 3 column 1): the joint 'j' exists already, since line 2"),
        "{message}"
    );
}

#[test]
fn joints_without_what_they_need() {
    let message = of_robot("<joint name='j'/>");
    assert_eq!(
        message,
        "bad.urdf, joint 'j' (line 2 column 1): the attribute type is missing, expected revolute, continuous, \
         prismatic, fixed, floating, planar or spherical"
    );
    let message = of_robot("<joint name='j' type='Revolute'/>");
    assert!(message.contains("the joint type 'Revolute' is not known, expected revolute, cont"), "{message}");
    let message = of_robot("<joint type='fixed'/>");
    assert!(message.contains("<joint> (line 2 column 1): the attribute name is missing"), "{message}");
    let message = of_robot("<joint name='j' type='fixed'><child link='b'/></joint>");
    assert!(
        message.contains("joint 'j' (line 2 column 1): <parent> is missing, expected the link that"),
        "{message}"
    );
    let message = of_robot("<joint name='j' type='fixed'><parent link='b'/></joint>");
    assert!(message.contains("<child> is missing, expected the link that the joint moves"), "{message}");
    let message = of_robot("<joint name='j' type='fixed'><parent/><child link='b'/></joint>");
    assert!(
        message.contains("<parent> of joint 'j' (line 2 column 30): the attribute link is missing"),
        "{message}"
    );
}

#[test]
fn links_that_are_not_there() {
    let message = of(
        "<robot><link name='base'/>\n<joint name='j' type='fixed'><parent link='bse'/><child link='x'/></joint></robot>",
    );
    assert_eq!(
        message,
        "bad.urdf, joint 'j' (line 2 column 1): the parent link is unknown: there is no 'bse'; did you mean 'base'?"
    );
    let message = of_robot(&joint("j", "a", "elbow"));
    assert!(message.contains("the child link is unknown: there is no 'elbow'"), "{message}");
}

#[test]
fn links_that_make_no_tree() {
    let message = of_robot(&joint("j", "a", "b"));
    assert_eq!(
        message,
        "bad.urdf, link 'c' (line 1 column 49): no joint has this link as its child, and none has 'a' (line 1) \
         either, expected a single root link"
    );
    let message = of_robot(&[joint("j", "a", "c"), joint("k", "b", "c")].concat());
    assert_eq!(
        message,
        "bad.urdf, joint 'k' (line 3 column 1): the link 'c' is the child of joint 'j' (line 2) already, expected \
         one parent"
    );
    let message = of_robot(&[joint("j", "a", "b"), joint("k", "b", "c"), joint("l", "c", "a")].concat());
    assert!(
        message.contains("the links 'b' under 'a' under 'c' under 'b' go round in a circle"),
        "{message}"
    );
    let message = of_robot(&[joint("j", "b", "c"), joint("k", "c", "b")].concat());
    assert_eq!(
        message,
        "bad.urdf, joint 'j' (line 2 column 1): the links 'c' under 'b' under 'c' go round in a circle, expected a tree"
    );
    let message = of_robot(&[joint("j", "a", "b"), joint("k", "c", "c")].concat());
    assert!(message.contains("joint 'k' (line 3 column 1): the links 'c' under 'c' go round"), "{message}");
}

#[test]
fn numbers_that_cannot_be_read() {
    let start = "bad.urdf, <origin> of joint 'j' (line 3 column 3): ";
    let message = |xyz: &str| of_joint("fixed", &format!("<origin xyz='{xyz}'/>"));
    for bad in ["0 0", "0 0 0 0", "", "0 0 zero", "0,0,0", "0 0 nan", "0x1 0 0"] {
        assert_eq!(
            message(bad),
            format!("{start}xyz=\"{bad}\" cannot be read, expected three numbers separated by spaces")
        );
    }
    assert_eq!(
        message("0 1e101 0"),
        format!(
            "{start}xyz {:?} is too large or too small to compute with, expected magnitudes up to 1e100",
            [0.0, 1e101, 0.0]
        )
    );
    assert!(message("0 0 inf").contains("too large"));
    let message = of_joint("fixed", "<origin rpy='0 0'/>");
    assert!(message.contains("rpy=\"0 0\" cannot be read, expected three numbers"), "{message}");
    let message = of_joint("revolute", "<limit lower='-1' upper='pi'/>");
    assert_eq!(
        message,
        "bad.urdf, <limit> of joint 'j' (line 3 column 3): upper=\"pi\" cannot be read, expected a number"
    );
    let message = of_joint("revolute", "<limit lower='NaN' upper='1'/>");
    assert!(message.contains("lower=\"NaN\" cannot be read"), "{message}");
}

#[test]
fn axes_without_a_direction() {
    for axis in ["0 0 0", "-0 0 0e5"] {
        assert_eq!(
            of_joint("continuous", &format!("<axis xyz='{axis}'/>")),
            "bad.urdf, <axis> of joint 'j' (line 3 column 3): the axis has the length 0, expected a direction"
        );
    }
    assert!(of_joint("planar", "<axis xyz='0 0 0'/>").contains("the axis has the length 0"));
}

#[test]
fn limits_that_are_missing_or_turned_round() {
    assert_eq!(
        of_joint("revolute", ""),
        "bad.urdf, joint 'j' (line 2 column 1): a revolute joint needs limits, and <limit> is missing, expected lower \
         and upper (or the type continuous)"
    );
    assert!(of_joint("prismatic", "").ends_with("<limit> is missing, expected lower and upper"));
    assert_eq!(
        of_joint("revolute", "<limit lower='1' upper='-1'/>"),
        "bad.urdf, <limit> of joint 'j' (line 3 column 3): the limits go from 1 to -1, expected lower <= upper"
    );
    // The default of the missing end is 0.
    assert!(of_joint("revolute", "<limit lower='1'/>").contains("from 1 to 0"));
    assert!(of_joint("prismatic", "<limit lower='inf' upper='inf'/>").contains("from inf to inf"));
}

#[test]
fn followers_that_cannot_follow() {
    let start = "bad.urdf, <mimic> of joint 'j' (line 3 column 3): ";
    let message = |inside: &str| of_joint("continuous", inside);
    assert_eq!(
        message("<mimic/>"),
        format!("{start}the attribute joint is missing, expected the name of the joint to follow")
    );
    assert_eq!(
        message("<mimic joint='elbow'/>"),
        format!("{start}the joint to follow is unknown: there is no 'elbow'")
    );
    assert_eq!(
        message("<mimic joint='k'/>"),
        format!("{start}joint 'k' is fixed, expected a revolute, continuous or prismatic joint to follow")
    );
    assert!(message("<mimic joint='k' multiplier='x'/>").contains("multiplier=\"x\" cannot be read"));
    assert_eq!(
        message("<mimic joint='j'/>"),
        format!(
            "{start}the joint follows itself, by way of 'j', expected a joint that moves by itself in the end"
        )
    );
    let follower = |name, child, of| {
        format!(
            "<joint name='{name}' type='continuous'><parent link='a'/><child link='{child}'/><mimic joint='{of}'/></joint>"
        )
    };
    let message = of_robot(&[follower("j", "b", "k"), follower("k", "c", "j")].concat());
    assert!(message.contains("the joint follows itself, by way of 'k'"), "{message}");
    let range = |name, child, range, rest| {
        format!(
            "<joint name='{name}' type='prismatic'><parent link='a'/><child link='{child}'/><limit {range}/>{rest}</joint>\n"
        )
    };
    let follows = "<mimic joint='j' multiplier='-1'/>";
    let message = of_robot(
        &[range("j", "b", "lower='1' upper='2'", ""), range("k", "c", "lower='1' upper='2'", follows)]
            .concat(),
    );
    assert!(
        message.contains("<joint> (line 3 column 1): joint 'k' cannot follow another: its own range"),
        "{message}"
    );
}

#[test]
fn errors_can_be_taken_apart() {
    let error = read_urdf(b"<robot>\n  <link/>", "bad.urdf").unwrap_err();
    assert_eq!(error.file(), "bad.urdf");
    assert_eq!(*error.place(), Place::Xml { line: 2, column: 3, element: "<link>".to_owned() });
    let expected = UrdfProblem::NoAttribute { name: "name", expected: "a unique name" };
    assert!(matches!(error.kind(), ErrorKind::Urdf(problem) if *problem == expected));
}

#[test]
fn masses_that_cannot_be() {
    let message = |inside: &str| {
        of(&format!("<robot>\n<link name='a'><inertial>\n  {inside}</inertial></link></robot>"))
    };
    let start = "bad.urdf, <mass> of link 'a' (line 3 column 3): ";
    let expected = "expected a mass in kilograms, at least 0";
    let negative = message("<mass value='-1'/>");
    assert_eq!(negative, format!("{start}value=\"-1\" cannot be read, {expected}"));
    assert_eq!(message("<mass/>"), format!("{start}the attribute value is missing, {expected}"));
    for (found, words) in
        [("x", "cannot be read"), ("nan", "cannot be read"), ("inf", "value"), ("1e200", "value")]
    {
        let message = message(&format!("<mass value='{found}'/>"));
        assert!(message.starts_with(start) && message.contains(words), "{message}");
    }
    let origin = message("<origin xyz='0 0'/><mass value='1'/>");
    assert!(
        origin.contains("<origin> of link 'a' (line 3 column 3): xyz=\"0 0\" cannot be read"),
        "{origin}"
    );
}
