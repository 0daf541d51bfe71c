//! What can be wrong with the numbers of an animation.

/// Why numbers of an animation cannot be read.
#[derive(Clone, Debug, PartialEq)]
#[non_exhaustive]
pub enum DataProblem {
    /// A member has the wrong type, or is missing.
    Shape(String),
    /// An index beyond the end of its list.
    OutOfRange {
        /// What kind of thing it refers to.
        what: &'static str,
        /// The index.
        found: u32,
        /// How many there are.
        count: usize,
    },
    /// The accessor does not have the type that is needed.
    Type {
        /// Component type and type found.
        found: String,
        /// What can be read.
        expected: &'static str,
    },
    /// Not as many elements as needed.
    Count {
        /// How many there are.
        found: u64,
        /// How many should be.
        expected: u64,
    },
    /// The elements do not fit what holds them.
    Bounds {
        /// Bytes that the elements need.
        needed: u64,
        /// Bytes that are there.
        available: u64,
    },
    /// The buffer is not there.
    Buffer {
        /// Its position.
        index: u32,
        /// Why.
        reason: String,
    },
    /// A stride shorter than an element.
    Stride(u64),
    /// Sparse indices that do not increase.
    SparseOrder,
    /// A time that is not finite, or not later than the one before.
    Time {
        /// Its position.
        at: usize,
        /// What it is.
        secs: f64,
    },
    /// A rotation that is not finite, or of length 0.
    Rotation {
        /// Its position.
        at: usize,
    },
    /// A translation that is not finite.
    Translation {
        /// Its position.
        at: usize,
    },
    /// Two channels for the same thing.
    Repeated,
    /// No channel moves a joint.
    Still,
    /// The poses would need more memory than such a file may take.
    Size {
        /// How many poses there would be.
        poses: usize,
    },
    /// More elements than the file could hold.
    Claims(u64),
}

impl std::fmt::Display for DataProblem {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        match self {
            Self::Shape(message) => f.write_str(message),
            Self::OutOfRange { what, found, count } => {
                write!(f, "{what} {found} does not exist, there are {count}")
            }
            Self::Type { found, expected } => write!(f, "found {found}, expected {expected}"),
            Self::Count { found, expected } => write!(f, "found {found} elements, expected {expected}"),
            Self::Bounds { needed, available } => {
                write!(f, "the elements need {needed} bytes, {available} are there")
            }
            Self::Buffer { index, reason } => write!(f, "buffer {index} is missing: {reason}"),
            Self::Stride(stride) => write!(f, "a stride of {stride} bytes is shorter than an element"),
            Self::SparseOrder => f.write_str("sparse indices must increase and exist"),
            Self::Time { at, secs } => {
                write!(f, "time {at} must be finite and later than the one before it, not {secs} s")
            }
            Self::Rotation { at } => write!(f, "rotation {at} is not finite or has the length 0"),
            Self::Translation { at } => write!(f, "translation {at} is not finite"),
            Self::Repeated => f.write_str("an earlier channel has the same target"),
            Self::Still => f.write_str("no channel moves a joint of the rig"),
            Self::Size { poses } => {
                write!(f, "{poses} poses of this rig are too many for a file of this size")
            }
            Self::Claims(count) => write!(f, "it claims {count} elements, more than the file can hold"),
        }
    }
}
