//! What can be wrong with a file: its name, the place, what was found and what was expected.

use ikiru_rig::humanoid::TransferError;
use ikiru_rig::{RigError, ShapeDifference, UnknownName};

use crate::urdf::UrdfProblem;

/// Why a file could not be read or written.
///
/// Carries the file's name, the place in it and, as [`ErrorKind`], what was found and what was expected.
#[derive(Debug)]
pub struct Error(Box<Inner>);

#[derive(Debug)]
struct Inner {
    file: String,
    place: Place,
    kind: ErrorKind,
}

/// Where in a file something is wrong.
#[derive(Clone, Debug, PartialEq, Eq)]
#[non_exhaustive]
pub enum Place {
    /// The file as a whole.
    File,
    /// A byte of the file, counted from 0.
    Byte(u64),
    /// A line and column of the JSON text, both counted from 1, with the member that stands there, if known.
    Text {
        /// Line.
        line: usize,
        /// Column, in bytes.
        column: usize,
        /// JSON pointer to the member, empty if unknown.
        pointer: String,
    },
    /// A member of the JSON text, as a JSON pointer: `/nodes/17/rotation`.
    Pointer(String),
    /// A line and column of a text file, both counted from 1.
    Line {
        /// Line.
        line: usize,
        /// Column, in bytes.
        column: usize,
    },
    /// A line and column of an XML text, both counted from 1.
    Xml {
        /// Line.
        line: usize,
        /// Column, in bytes.
        column: usize,
        /// The element that stands there: `<axis> of joint 'elbow'`; empty if unknown.
        element: String,
    },
}

/// What is wrong, with what was found and what was expected.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum ErrorKind {
    /// The operating system refused.
    #[error("cannot {doing}: {source}")]
    Io {
        /// What was tried.
        doing: &'static str,
        /// The reason.
        source: std::io::Error,
    },
    /// The file's name does not end in a format that can be read.
    #[error(
        "the ending '{found}' is not one that can be read: expected .glb, .gltf, .vrm, .vrma, .bvh or .urdf"
    )]
    Ending {
        /// The ending.
        found: String,
    },
    /// There is no built-in rig of that name.
    #[error("there is no built-in rig '{name}': expected one of {known}")]
    Builtin {
        /// What was asked for.
        name: String,
        /// Those that exist.
        known: String,
    },
    /// The library was built without its rigs.
    #[error("this build has no built-in rigs, and so no '{name}': expected the feature `builtin`")]
    NoBuiltins {
        /// What was asked for.
        name: String,
    },
    /// The file ends too early.
    #[error("the file is cut short: {what} needs {expected} bytes, {found} are there")]
    Truncated {
        /// What is incomplete.
        what: &'static str,
        /// Bytes that are there.
        found: u64,
        /// Bytes that should be.
        expected: u64,
    },
    /// The first four bytes are not `glTF`.
    #[error("not a binary glTF file: it begins with \"{}\", expected \"glTF\"", found.escape_ascii())]
    Magic {
        /// The bytes found.
        found: Vec<u8>,
    },
    /// Another version than 2.
    #[error("glTF version {found} cannot be read, expected version 2.0")]
    Version {
        /// The version found.
        found: String,
    },
    /// A length in the file's header or a chunk's that is not true.
    #[error("{what} claims {claimed} bytes, where {available} are available")]
    Length {
        /// Whose length.
        what: &'static str,
        /// What it says.
        claimed: u64,
        /// What it could be at most.
        available: u64,
    },
    /// The first chunk is not JSON.
    #[error("the first chunk is of type {found:#010x}, expected JSON ({:#010x})", crate::gltf::JSON_CHUNK)]
    FirstChunk {
        /// The type found.
        found: u32,
    },
    /// The JSON text is not UTF-8.
    #[error("the JSON text is not UTF-8")]
    Utf8,
    /// Not JSON at all.
    #[error("not valid JSON: {message}")]
    Syntax {
        /// What the parser found and expected.
        message: String,
    },
    /// Valid JSON, but a member has the wrong type or is missing.
    #[error("not as glTF has it: {message}")]
    Shape {
        /// What was found and what was expected.
        message: String,
    },
    /// Valid JSON, but neither a pose nor a motion: a member has the wrong type or is missing.
    #[error("not as a pose or motion has it: {message}")]
    MotionShape {
        /// What was found and what was expected.
        message: String,
    },
    /// A list of a motion that does not have one entry a frame.
    #[error("found {found} entries, expected {expected}: one for each of \"times\"")]
    FrameCount {
        /// How many entries there are.
        found: usize,
        /// How many frames the motion has.
        expected: usize,
    },
    /// A joint of a motion that the rig does not have.
    #[error(transparent)]
    UnknownJoint(#[from] UnknownName),
    /// A joint that cannot move as a motion says.
    #[error("joint '{joint}' is {motion}: found {found:?}, expected {expected}")]
    CannotMove {
        /// Name of the joint.
        joint: String,
        /// How it moves.
        motion: &'static str,
        /// What it should do.
        found: Vec<f64>,
        /// What it could do.
        expected: &'static str,
    },
    /// A list that is longer than any real file's.
    #[error("more than {most} elements, the most that are read")]
    TooMany {
        /// How many may be.
        most: usize,
    },
    /// There is nothing to make a rig of.
    #[error("the {0} has no nodes, expected at least one")]
    NoNodes(&'static str),
    /// An index beyond the end of its list.
    #[error("{what} {found} does not exist: there {}", counted(*.count))]
    OutOfRange {
        /// What kind of thing it refers to.
        what: &'static str,
        /// The index.
        found: u64,
        /// How many there are.
        count: usize,
    },
    /// A node that two nodes (or one node twice) call their child.
    #[error("node {node} is a child of node {first} and again of node {second}: expected one parent")]
    TwoParents {
        /// The child.
        node: u32,
        /// Its first parent.
        first: u32,
        /// Its second.
        second: u32,
    },
    /// Nodes that are their own ancestors.
    #[error("node {node} is its own ancestor: expected a tree")]
    Cycle {
        /// One of them.
        node: u32,
    },
    /// A scene's root that is not one.
    #[error("node {node} is listed as a root but is a child of node {parent}")]
    RootWithParent {
        /// The node.
        node: u32,
        /// Its parent.
        parent: u32,
    },
    /// A scene that lists a root twice.
    #[error("node {node} is listed as a root twice")]
    RootTwice {
        /// The node.
        node: u32,
    },
    /// A rotation or scale of no length.
    #[error("{what} {found:?} has the length 0: expected {expected}")]
    Zero {
        /// Rotation, scale or matrix.
        what: &'static str,
        /// Its numbers.
        found: Vec<f64>,
        /// What should be there.
        expected: &'static str,
    },
    /// A number too large to compute with.
    #[error("{what} {found:?} is too large or too small to compute with, expected magnitudes up to 1e100")]
    Magnitude {
        /// Whose number.
        what: &'static str,
        /// The numbers.
        found: Vec<f64>,
    },
    /// A number too large for the 32 bits that a format has for it.
    #[error(
        "{what} {found:?} is too large for the format's 32-bit numbers, expected magnitudes up to 3.4e38"
    )]
    Magnitude32 {
        /// Whose number.
        what: &'static str,
        /// The numbers.
        found: Vec<f64>,
    },
    /// A matrix with a shear.
    #[error("the matrix {found:?} has a shear: expected perpendicular axes")]
    Shear {
        /// Its numbers, column by column.
        found: Vec<f64>,
    },
    /// A joint that turns below a node whose scale differs between the axes: it would be sheared, which a rig cannot be.
    #[error(
        "'{node}' has the scale {scale:?}, and '{joint}' turns below it: expected one scale for all axes (within a \
         thousandth) above what turns; apply the scale in the program that made the file"
    )]
    TurnsBelowScale {
        /// Name of the node.
        node: String,
        /// Its scale along each axis, without signs.
        scale: [f64; 3],
        /// The joint that turns.
        joint: String,
    },
    /// A matrix whose last row is not 0, 0, 0, 1.
    #[error("the matrix {found:?} is no affine transform: expected the last row 0, 0, 0, 1")]
    NotAffine {
        /// Its numbers, column by column.
        found: Vec<f64>,
    },
    /// A reference to a file outside the folder of this one.
    #[error("the reference '{uri}' {reason}: expected a file in the folder of this one, or below it")]
    Uri {
        /// The reference.
        uri: String,
        /// Why it is refused.
        reason: &'static str,
    },
    /// A robot description that is not as URDF has it.
    #[error(transparent)]
    Urdf(#[from] UrdfProblem),
    /// The joints do not make a rig.
    #[error(transparent)]
    Rig(#[from] RigError),
    /// A rig that was not read from a glTF file.
    #[error(
        "a .glb file is written with the mesh, skin and nodes of the file that the rig was read from: expected a rig that was \
         read from a .glb, .gltf or .vrm file"
    )]
    NoSource,
    /// A file that is no avatar's, and should be written as one.
    #[error(
        "the file has no VRM extension that tells its bones: expected a VRM avatar's for .vrm; .glb can be written"
    )]
    NotVrm,
    /// A file that should be a VRM animation and is not.
    #[error("not a VRM animation: the document has no extension VRMC_vrm_animation")]
    NotVrma,
    /// A clip whose rig lacks humanoid bones that a VRM animation must have.
    #[error("a VRM animation needs joints with the humanoid roles {missing}, which the clip's rig lacks")]
    RolesMissing {
        /// The roles, with commas.
        missing: String,
    },
    /// A clip that cannot be put on the skeleton of the file.
    #[error(transparent)]
    Transfer(#[from] TransferError),
    /// A pose or rig with other joints than the file's.
    #[error("{what} does not fit the file: {difference}")]
    OtherRig {
        /// Pose, clip or rig.
        what: &'static str,
        /// The first difference.
        difference: ShapeDifference,
    },
    /// A pose with numbers that are not finite, or a quaternion without unit length.
    #[error("{what} has numbers that are not finite or a quaternion not of unit length")]
    InvalidPose {
        /// Pose or clip.
        what: &'static str,
    },
    /// A buffer that the written file needs and that could not be read.
    #[error("buffer {index} cannot be embedded: {reason}")]
    Buffer {
        /// Its position.
        index: usize,
        /// Why it is not there.
        reason: String,
    },
    /// A word that does not belong where it stands.
    #[error("found {found}, expected {expected}")]
    Unexpected {
        /// The word, in quotes, or what stands for it.
        found: String,
        /// What may stand there.
        expected: &'static str,
    },
    /// Something that a joint may have once.
    #[error("joint '{joint}' has {what} twice, expected it once")]
    Repeated {
        /// Name of the joint.
        joint: String,
        /// What it has twice.
        what: &'static str,
    },
    /// Something that a joint must have.
    #[error("joint '{joint}' has no {what}, expected one")]
    Missing {
        /// Name of the joint.
        joint: String,
        /// What it lacks.
        what: &'static str,
    },
    /// A motion that ends before all its frames are there.
    #[error("frame {frame} of {frames} has {found} of {expected} numbers when the file ends")]
    FewNumbers {
        /// The frame that is incomplete, counted from 1.
        frame: u64,
        /// How many frames the file claims.
        frames: u64,
        /// Numbers that are there.
        found: usize,
        /// Numbers that a frame has.
        expected: usize,
    },
    /// A motion that would take much more memory than its text.
    #[error(
        "{frames} frames would take {bytes} bytes of memory, more than the {most} that a file of this size may"
    )]
    LongMotion {
        /// How many frames there are.
        frames: u64,
        /// Bytes that they would take.
        bytes: u64,
        /// Bytes that they may.
        most: u64,
    },
    /// A scale that is no length of a unit.
    #[error("the scale {found} cannot be used, expected metres per unit of the file, from 1e-9 to 1e9")]
    Scale {
        /// What was given.
        found: f64,
    },
    /// A file beyond the 4 GiB that its format allows.
    #[error("the file would have {bytes} bytes, more than the 4 GiB that .glb allows")]
    TooLarge {
        /// Its size.
        bytes: u64,
    },
}

fn counted(count: usize) -> String {
    match count {
        0 => "are none".to_owned(),
        1 => "is only number 0".to_owned(),
        n => format!("are numbers 0 to {}", n - 1),
    }
}

impl Error {
    pub(crate) fn new(file: impl Into<String>, place: Place, kind: ErrorKind) -> Self {
        Self(Box::new(Inner { file: file.into(), place, kind }))
    }

    /// The file's name, as it was given.
    #[must_use]
    pub fn file(&self) -> &str {
        &self.0.file
    }

    /// Where in the file.
    #[must_use]
    pub fn place(&self) -> &Place {
        &self.0.place
    }

    /// What is wrong.
    #[must_use]
    pub fn kind(&self) -> &ErrorKind {
        &self.0.kind
    }
}

impl std::fmt::Display for Error {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        match &self.0.place {
            Place::File => write!(f, "{}: {}", self.0.file, self.0.kind),
            place => write!(f, "{}, {place}: {}", self.0.file, self.0.kind),
        }
    }
}

impl std::error::Error for Error {
    fn source(&self) -> Option<&(dyn std::error::Error + 'static)> {
        std::error::Error::source(&self.0.kind)
    }
}

impl std::fmt::Display for Place {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        match self {
            Self::File => f.write_str("the file"),
            Self::Byte(byte) => write!(f, "byte {byte}"),
            Self::Text { line, column, pointer } if pointer.is_empty() => {
                write!(f, "line {line} column {column} of the JSON text")
            }
            Self::Text { line, column, pointer } => {
                write!(f, "{pointer} (line {line} column {column} of the JSON text)")
            }
            Self::Pointer(pointer) => f.write_str(pointer),
            Self::Line { line, column } => write!(f, "line {line} column {column}"),
            Self::Xml { line, column, element } if element.is_empty() => {
                write!(f, "line {line} column {column}")
            }
            Self::Xml { line, column, element } => write!(f, "{element} (line {line} column {column})"),
        }
    }
}

/// An error whose file is not known yet.
#[derive(Debug)]
pub(crate) struct Fault(Box<(Place, ErrorKind)>);

impl Fault {
    pub(crate) fn new(place: Place, kind: ErrorKind) -> Self {
        Self(Box::new((place, kind)))
    }

    pub(crate) fn at(pointer: impl Into<String>, kind: ErrorKind) -> Self {
        Self::new(Place::Pointer(pointer.into()), kind)
    }

    /// This fault in the file of a pose, which was read as a motion with one frame: its angles stand with its joints.
    pub(crate) fn of_pose(mut self) -> Self {
        if let Place::Pointer(pointer) = &mut self.0.0 {
            let joints =
                pointer.replacen("/angles/", "/joints/", 1).replacen("/translations/", "/joints/", 1);
            *pointer = joints.trim_end_matches("/0").to_owned();
        }
        self
    }

    pub(crate) fn in_file(self, file: &str) -> Error {
        let (place, kind) = *self.0;
        Error::new(file, place, kind)
    }
}

impl From<ErrorKind> for Fault {
    fn from(kind: ErrorKind) -> Self {
        Self::new(Place::File, kind)
    }
}
