//! What can be wrong with a robot description.

use ikiru_rig::UnknownName;

/// What is wrong with a URDF file, with what was found and what was expected.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum UrdfProblem {
    /// The text is not UTF-8.
    #[error("the text is not UTF-8")]
    Utf8,
    /// Not XML.
    #[error("not valid XML: {message}")]
    Syntax {
        /// What the parser found and expected.
        message: String,
    },
    /// An element that never ends.
    #[error("not valid XML: the file ends inside of this element, expected its end tag")]
    Unclosed,
    /// Nothing but text and comments.
    #[error("the file has no element, expected <robot>")]
    NoElement,
    /// Text before or behind the root element.
    #[error("the text \"{}\" stands outside of the root element, expected <robot>", found.escape_debug())]
    TextOutside {
        /// Its beginning.
        found: String,
    },
    /// Another element behind the first.
    #[error("a second root element, expected the end of the file")]
    SecondRoot,
    /// Elements inside of elements inside of elements.
    #[error("elements are nested deeper than {most} levels, the most that are read")]
    Nesting {
        /// How deep they may be.
        most: usize,
    },
    /// An entity that XML does not know by itself.
    #[error(
        "the entity '&{name};' is not known: expected &lt; &gt; &amp; &quot; &apos; or a character's number"
    )]
    Entity {
        /// Its name.
        name: String,
    },
    /// A file that xacro has not been run over.
    #[error(
        "the xacro markup {found} has no value yet: run xacro first, `xacro FILE.xacro > FILE.urdf`, and read what it writes"
    )]
    Xacro {
        /// The element or expression.
        found: String,
    },
    /// The root element is not `<robot>`.
    #[error("the root element is <{found}>, expected <robot>")]
    RootElement {
        /// Its name.
        found: String,
    },
    /// An attribute that has to be there.
    #[error("the attribute {name} is missing, expected {expected}")]
    NoAttribute {
        /// Its name.
        name: &'static str,
        /// What it should hold.
        expected: &'static str,
    },
    /// An attribute given twice.
    #[error("the attribute {name} is there twice, expected it once")]
    AttributeTwice {
        /// Its name.
        name: &'static str,
    },
    /// A name without letters.
    #[error("the attribute {name} is empty, expected {expected}")]
    EmptyName {
        /// Of which attribute.
        name: &'static str,
        /// What it should hold.
        expected: &'static str,
    },
    /// Numbers that are not.
    #[error("{name}=\"{found}\" cannot be read, expected {expected}")]
    Numbers {
        /// Of which attribute.
        name: &'static str,
        /// What stands there.
        found: String,
        /// What should.
        expected: &'static str,
    },
    /// An element that has to be there.
    #[error("<{name}> is missing, expected {expected}")]
    NoElementOf {
        /// Its name.
        name: &'static str,
        /// What it should hold.
        expected: &'static str,
    },
    /// A type of joint that does not exist.
    #[error("the joint type '{found}' is not known, expected {expected}")]
    JointType {
        /// What stands there.
        found: String,
        /// Those that are.
        expected: &'static str,
    },
    /// An axis of no length.
    #[error("the axis has the length 0, expected a direction")]
    ZeroAxis,
    /// A revolute or prismatic joint without limits.
    #[error("a {kind} joint needs limits, and <limit> is missing, expected lower and upper{}", if *kind == "revolute" { " (or the type continuous)" } else { "" })]
    NoLimit {
        /// The type of the joint.
        kind: &'static str,
    },
    /// Limits in the wrong order.
    #[error("the limits go from {lower} to {upper}, expected lower <= upper")]
    Limits {
        /// Lower end.
        lower: f64,
        /// Upper end.
        upper: f64,
    },
    /// Two links or two joints of one name.
    #[error("the {what} '{name}' exists already, since line {first}, expected names to be unique")]
    Duplicate {
        /// Link or joint.
        what: &'static str,
        /// The name.
        name: String,
        /// The line of the first.
        first: usize,
    },
    /// There is no link.
    #[error("the robot has no links, expected at least one")]
    NoLinks,
    /// A joint that names a link that is not there.
    #[error("the {end} link is unknown: {name}")]
    UnknownLink {
        /// Parent or child.
        end: &'static str,
        /// The name, with the nearest.
        name: UnknownName,
    },
    /// A link below two joints.
    #[error(
        "the link '{link}' is the child of joint '{first}' (line {first_line}) already, expected one parent"
    )]
    TwoParents {
        /// The link.
        link: String,
        /// The joint above it.
        first: String,
        /// Its line.
        first_line: usize,
    },
    /// Several links that are nobody's child.
    #[error(
        "no joint has this link as its child, and none has '{first}' (line {first_line}) either, expected a single root link"
    )]
    TwoRoots {
        /// The first root.
        first: String,
        /// Its line.
        first_line: usize,
    },
    /// Links that are below themselves.
    #[error("the links {links} go round in a circle, expected a tree")]
    Cycle {
        /// Their names, from one to itself.
        links: String,
    },
    /// A leader that is not there.
    #[error("the joint to follow is unknown: {0}")]
    UnknownLeader(UnknownName),
    /// A leader without a value.
    #[error("joint '{leader}' is {kind}, expected a revolute, continuous or prismatic joint to follow")]
    LeaderKind {
        /// The leader.
        leader: String,
        /// Its type.
        kind: &'static str,
    },
    /// Joints that follow each other.
    #[error(
        "the joint follows itself, by way of '{leader}', expected a joint that moves by itself in the end"
    )]
    MimicCycle {
        /// Whom it follows.
        leader: String,
    },
}
