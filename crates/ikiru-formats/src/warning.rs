//! What a reader mended or left out, for the user to know.

use std::mem::discriminant;

use ikiru_rig::humanoid::RoleProblem;

use crate::gltf::DataProblem;
use crate::urdf::UrdfWarning;

/// Something in a file that was mended or left out. The rig that came of it is valid.
#[derive(Clone, Debug, PartialEq)]
#[non_exhaustive]
pub enum Warning {
    /// The file does not say which version of glTF it is; version 2.0 was assumed.
    NoVersion,
    /// The file goes on after its end.
    TrailingBytes {
        /// How many bytes were left unread.
        count: u64,
    },
    /// Nodes without a name, which were called `node_0`, … after their position.
    Unnamed {
        /// How many.
        count: usize,
        /// What the first is called now.
        first: String,
    },
    /// A name that another node bears already.
    Renamed {
        /// Position of the node in the file.
        node: u32,
        /// Its name in the file.
        name: String,
        /// Its name in the rig.
        renamed: String,
    },
    /// A rotation more than 1e-3 off unit length, which was normalised.
    RotationLength {
        /// Name of the joint.
        joint: String,
        /// The quaternion's length.
        length: f64,
    },
    /// A joint that does not turn, below scales that differ between the axes: its place is exact, but its axes are not
    /// perpendicular in the file. The joint has the first of them.
    Sheared {
        /// Name of the joint.
        joint: String,
    },
    /// A mirrored node: what lies below is where it should be, but its frames are turned by a rotation alone.
    Mirrored {
        /// Name of the joint.
        joint: String,
    },
    /// A node with a matrix and a translation, rotation or scale besides; the matrix was used.
    MatrixAndParts {
        /// Name of the joint.
        joint: String,
    },
    /// A humanoid bone of a VRM file that could not be used.
    HumanoidBone {
        /// VRM's name of the bone.
        bone: String,
        /// Why.
        reason: BoneProblem,
    },
    /// The humanoid bones of a VRM file could not be read.
    HumanoidMap {
        /// What was found and expected.
        reason: String,
    },
    /// The file does not say which joints are humanoid bones, their names do, and something about them is odd.
    Role(RoleProblem),
    /// The list of animations could not be read; the rig has no clips.
    Animations {
        /// JSON pointer to what is wrong.
        place: String,
        /// Why.
        problem: DataProblem,
    },
    /// An animation that could not be read.
    ClipDropped {
        /// Its name.
        clip: String,
        /// JSON pointer to what is wrong.
        place: String,
        /// Why.
        problem: DataProblem,
    },
    /// A clip that does not fit a changed rig.
    ClipUnfit {
        /// Its name.
        clip: String,
        /// The joint that cannot take its motion any more.
        joint: String,
    },
    /// An animation with the name of another, which its clip was called otherwise for.
    ClipRenamed {
        /// Its name in the file.
        clip: String,
        /// The clip's name.
        renamed: String,
    },
    /// An animation that a written file has no more, since the new one has its name.
    ClipReplaced {
        /// That name.
        clip: String,
    },
    /// Animations that a file in a pose has no more: a viewer that starts one would not show the pose.
    ClipsLeftOut {
        /// How many.
        count: usize,
    },
    /// Channels of an animation that change what a rig does not have.
    ChannelsIgnored {
        /// Name of the clip.
        clip: String,
        /// `translation`, `rotation`, `scale`, `weights` or another target.
        path: String,
        /// How many.
        count: usize,
        /// The joint or node of the first.
        first: String,
    },
    /// Bytes in a name that are not UTF-8; each was replaced by a question mark.
    NameBytes {
        /// The name, as it was mended.
        name: String,
    },
    /// A motion file that goes on after its last frame.
    ExtraNumbers {
        /// How many numbers or words were left unread.
        count: u64,
        /// How many frames the file claims.
        frames: u64,
        /// How many numbers a frame has.
        per_frame: usize,
    },
    /// A standing figure that is no human's height: the file is probably not in metres.
    Height {
        /// Its height, with the scale that was used, in metres.
        metres: f64,
        /// The scale that was used.
        scale: f64,
        /// A scale that would make it as high as a human.
        likely: Option<f64>,
    },
    /// A bone of a written VRM animation that does not end where the clip has it, since joints without a role between
    /// its ends bring it there, or its length changes.
    BoneOff {
        /// The humanoid role of the bone that is farthest off.
        bone: String,
        /// How far, in metres.
        metres: f64,
    },
    /// A joint that a written file calls otherwise, since its name would not be one word there, or be another's.
    NameWritten {
        /// Its name in the rig.
        joint: String,
        /// Its name in the file.
        written: String,
    },
    /// Something in a robot description.
    Urdf(UrdfWarning),
    /// More warnings of the kinds before.
    More {
        /// How many were left out.
        count: usize,
    },
}

/// Why a humanoid bone could not be used.
#[derive(Clone, Debug, PartialEq, Eq)]
#[non_exhaustive]
pub enum BoneProblem {
    /// VRM has no bone of that name.
    UnknownBone,
    /// The node does not exist.
    NoNode(u64),
    /// The node is not in the default scene.
    NotInScene(u64),
    /// The joint is another bone already.
    Taken {
        /// The joint.
        joint: String,
        /// The bone that it is.
        bone: &'static str,
    },
    /// Another joint is this bone already.
    Repeated,
}

impl Warning {
    /// Whether it is about clips alone: who uses none of the file's need not know.
    #[must_use]
    pub fn is_about_clips(&self) -> bool {
        matches!(
            self,
            Self::Animations { .. }
                | Self::ClipDropped { .. }
                | Self::ClipUnfit { .. }
                | Self::ClipRenamed { .. }
                | Self::ChannelsIgnored { .. }
                | Self::ExtraNumbers { .. }
        )
    }

    /// Whether both say the same, of different places: many of one kind can be counted instead of repeated.
    #[must_use]
    pub fn is_alike(&self, other: &Self) -> bool {
        match (self, other) {
            (Self::Urdf(a), Self::Urdf(b)) => discriminant(a) == discriminant(b),
            (Self::Role(a), Self::Role(b)) => discriminant(a) == discriminant(b),
            (a, b) => discriminant(a) == discriminant(b),
        }
    }
}

impl std::fmt::Display for Warning {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        match self {
            Self::NoVersion => f.write_str("the file does not say its glTF version, 2.0 was assumed"),
            Self::TrailingBytes { count } => {
                write!(f, "{count} bytes after the end of the file's contents were left unread")
            }
            Self::Unnamed { count: 1, first } => {
                write!(f, "a node has no name, it is called '{first}'")
            }
            Self::Unnamed { count, first } => {
                write!(f, "{count} nodes have no name, they are called '{first}' and so on")
            }
            Self::Renamed { node, name, renamed } => {
                write!(f, "node {node}: the name '{name}' is taken, it is called '{renamed}'")
            }
            Self::RotationLength { joint, length } => {
                write!(f, "joint '{joint}': the rotation has the length {length}, it was normalised")
            }
            Self::Sheared { joint } => write!(
                f,
                "joint '{joint}' is sheared by the scales above it: its place holds, of its axes the first"
            ),
            Self::Mirrored { joint } => write!(
                f,
                "joint '{joint}' is mirrored: positions below it hold, but its axes are those of a rotation"
            ),
            Self::MatrixAndParts { joint } => write!(
                f,
                "joint '{joint}' has a matrix and a translation, rotation or scale besides: the matrix is used"
            ),
            Self::HumanoidBone { bone, reason } => write!(f, "humanoid bone '{bone}': {reason}"),
            Self::HumanoidMap { reason } => {
                write!(f, "the humanoid bones of the VRM file cannot be read: {reason}")
            }
            Self::Role(problem) => write!(f, "humanoid roles by name: {problem}"),
            Self::Animations { place, problem } => {
                write!(f, "the animations cannot be read, {place}: {problem}")
            }
            Self::ClipDropped { clip, place, problem } => {
                write!(f, "animation '{clip}' was left out, {place}: {problem}")
            }
            Self::ClipUnfit { clip, joint } => {
                write!(f, "clip '{clip}' was left out: joint '{joint}' cannot move as it does")
            }
            Self::ClipRenamed { clip, renamed } => {
                write!(f, "another animation is called '{clip}': this one's clip is called '{renamed}'")
            }
            Self::ClipReplaced { clip } => {
                write!(f, "the file's own animation '{clip}' gave way to the new one of that name")
            }
            Self::ClipsLeftOut { count } => {
                let (s, them) = if *count == 1 { ("", "it") } else { ("s", "one") };
                write!(
                    f,
                    "{count} animation{s} of the file left out: a viewer that starts {them} would hide the pose"
                )
            }
            Self::ChannelsIgnored { clip, path, count, first } => {
                let were = if *count == 1 { " was" } else { "s were" };
                write!(
                    f,
                    "animation '{clip}': {count} {path} channel{were} ignored, the first of '{first}': "
                )?;
                f.write_str(match path.as_str() {
                    "translation" => "joints turn, and translate only where that is asked for",
                    "rotation" => "no skin and no humanoid bone moves with it",
                    "scale" => "joints have no scale that changes",
                    _ => "it moves no joint",
                })
            }
            Self::NameBytes { name } => {
                write!(f, "the name '{name}' is not UTF-8 in the file, what could not be read became '?'")
            }
            Self::ExtraNumbers { count, frames, per_frame } => write!(
                f,
                "after {frames} frames of {per_frame} numbers the file goes on with {count} more, \
                 which were left unread"
            ),
            Self::Height { metres, scale, likely } => {
                write!(f, "the figure is {metres:.4} m high with scale {scale}, expected 0.3 to 3 m")?;
                match likely {
                    Some(likely) => write!(f, ": a likely scale is {likely}"),
                    None => f.write_str(": another scale may be meant"),
                }
            }
            Self::BoneOff { bone, metres } => write!(
                f,
                "'{bone}' is up to {metres:.3} m off in the VRM animation: joints without a humanoid role move it, \
                 and the format has none"
            ),
            Self::NameWritten { joint, written } => {
                write!(
                    f,
                    "joint '{joint}' is called '{written}' in the written file: its names are single words"
                )
            }
            Self::Urdf(warning) => warning.fmt(f),
            Self::More { count } => write!(f, "{count} more warnings"),
        }
    }
}

impl std::fmt::Display for BoneProblem {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        match self {
            Self::UnknownBone => f.write_str("VRM has no bone of that name"),
            Self::NoNode(node) => write!(f, "node {node} does not exist"),
            Self::NotInScene(node) => write!(f, "node {node} is not in the default scene"),
            Self::Taken { joint, bone } => write!(f, "joint '{joint}' is the bone '{bone}' already"),
            Self::Repeated => f.write_str("another joint is this bone already"),
        }
    }
}

/// A name or message from a file as it stands in a warning: one of a megabyte would not help.
pub(crate) fn short(text: &str) -> String {
    const MOST: usize = 200;
    match text.char_indices().nth(MOST) {
        Some((end, _)) => format!("{}...", text.get(..end).unwrap_or_default()),
        None => text.to_owned(),
    }
}

/// Collects warnings, of which no file yields more than a reader wants to see.
#[derive(Debug, Default)]
pub(crate) struct Warnings {
    list: Vec<Warning>,
    left_out: usize,
}

impl Warnings {
    const MOST: usize = 100;

    /// Adds one. It is not even made when there are too many.
    pub(crate) fn push(&mut self, warning: impl FnOnce() -> Warning) {
        if self.list.len() < Self::MOST {
            self.list.push(warning());
        } else {
            self.left_out = self.left_out.saturating_add(1);
        }
    }

    pub(crate) fn into_vec(mut self) -> Vec<Warning> {
        if self.left_out > 0 {
            self.list.push(Warning::More { count: self.left_out });
        }
        self.list
    }
}
