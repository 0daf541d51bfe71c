//! What can be wrong with a scenario: file, line and column, what was found and what was expected.

use ikiru_rig::{ConeError, ForeignJoint, RigError, Role, UnknownName};
use ikiru_solve::{MotionError, TargetPathError};

use crate::methods::methods;

/// Why a scenario cannot be used, with its place: file, line and column.
#[derive(Debug)]
pub struct Error(Box<Inner>);

#[derive(Debug)]
struct Inner {
    file: String,
    place: Option<(usize, usize)>,
    key: Option<String>,
    kind: ErrorKind,
}

/// What is wrong, with what was found and what was expected.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum ErrorKind {
    /// The file cannot be read.
    #[error("the scenario cannot be read")]
    Io(#[source] std::io::Error),
    /// The file is not text.
    #[error("the scenario is not UTF-8 text")]
    Utf8,
    /// There is no built-in scenario of that name.
    #[cfg(feature = "builtin")]
    #[error("there is no built-in scenario '{name}': expected {known}", known = list(.known))]
    Builtin {
        /// The name.
        name: String,
        /// All built-in scenarios.
        known: Vec<&'static str>,
    },
    /// Not TOML at all.
    #[error("not valid TOML: {0}")]
    Syntax(String),
    /// `version` is not one that is understood.
    #[error("version {0} is not understood: expected version = 1")]
    Version(String),
    /// A key that does not belong where it stands.
    #[error("{place} has no key '{name}'{guess}: expected {expected}", name = .unknown.name, guess = guess(.unknown), expected = list(.expected))]
    UnknownKey {
        /// Where it stands.
        place: String,
        /// The key, and the nearest right ones.
        unknown: UnknownName,
        /// All keys that can stand there.
        expected: Vec<&'static str>,
    },
    /// A key that must be there.
    #[error("{place} lacks '{key}': expected {expected}")]
    MissingKey {
        /// Where it should stand.
        place: String,
        /// The key.
        key: &'static str,
        /// What should be there.
        expected: &'static str,
    },
    /// A value of another type.
    #[error("'{key}' is {found}: expected {expected}")]
    Type {
        /// The key.
        key: String,
        /// What it is.
        found: &'static str,
        /// What it should be.
        expected: &'static str,
    },
    /// A list of another length.
    #[error("'{key}' has {found} entries: expected {expected}")]
    Length {
        /// The key.
        key: String,
        /// How many there are.
        found: usize,
        /// What it should be.
        expected: &'static str,
    },
    /// A number that is infinite or not a number.
    #[error("'{key}' is {found}: expected a finite number")]
    NotFinite {
        /// The key.
        key: String,
        /// What it is.
        found: String,
    },
    /// A number outside of what makes sense.
    #[error("'{key}' is {found}: expected {expected}")]
    OutOfRange {
        /// The key.
        key: String,
        /// What it is.
        found: f64,
        /// What it should be.
        expected: &'static str,
    },
    /// A word that is none of those expected.
    #[error("'{key}' is '{word}'{guess}: expected {expected}", word = .unknown.name, guess = guess(.unknown), expected = list(.expected))]
    Word {
        /// The key.
        key: &'static str,
        /// The word, and the nearest right ones.
        unknown: UnknownName,
        /// All words that can stand there.
        expected: Vec<&'static str>,
    },
    /// A method that exists, but not in this build.
    #[error(
        "method '{0}' is not in this build: build with the cargo feature '{0}' and the system's Ipopt \
         (Debian: coinor-libipopt-dev), or use {others}",
        others = list(&methods().map(|method| method.name()).collect::<Vec<_>>())
    )]
    NotAvailable(&'static str),
    /// A key that is understood, and asks for what no solver does yet.
    #[error("{what} not yet solved for: expected {expected}")]
    NotYet {
        /// What it asks for, with a verb.
        what: &'static str,
        /// What should be there.
        expected: &'static str,
    },
    /// A scale for a format that knows its unit.
    #[error("'scale' is {0}: glTF, VRM and URDF files are in metres, expected 1 or no scale at all")]
    Scale(f64),
    /// The rig cannot be read.
    #[error("the rig cannot be read")]
    Rig(#[source] ikiru_formats::Error),
    /// The limits do not make a rig.
    #[error("the limits do not fit the rig")]
    Limits(#[source] RigError),
    /// No joint can float as `root = "free"` wants it.
    #[error("the root of the rig cannot float")]
    Root(#[source] RigError),
    /// A role that is none.
    #[error(
        "there is no humanoid role '{name}'{guess}: expected one of the 55 bones of VRM 1.0, such as 'leftHand'",
        name = .0.name, guess = guess(.0)
    )]
    UnknownRole(UnknownName),
    /// A role for a joint that there is not.
    #[error(
        "the rig has no joint '{name}'{guess}: expected the name of the joint that is the {role}",
        name = .unknown.name, guess = guess(.unknown)
    )]
    RoleOfNone {
        /// The role.
        role: Role,
        /// The name, and the nearest right ones.
        unknown: UnknownName,
    },
    /// One joint for two roles.
    #[error("joint '{joint}' cannot be both {first} and {second}: expected each joint for one role")]
    TwoRoles {
        /// The joint.
        joint: String,
        /// The role that came first.
        first: Role,
        /// The other one.
        second: Role,
    },
    /// The roles do not make a rig.
    #[error("the roles do not fit the rig")]
    Roles(#[source] RigError),
    /// A name that no joint and no role of the rig has.
    #[error("the rig has no joint or humanoid role '{name}'{guess}", name = .0.name, guess = guess(.0))]
    UnknownJoint(UnknownName),
    /// The id of a joint that the rig does not have.
    #[error(transparent)]
    NoJoint(ForeignJoint),
    /// A joint that the file has fixed, as a glTF file has what no skin uses.
    #[error(
        "joint '{0}' does not move, it is fixed in the file: expected a joint that moves, or limits that make it move, [limits.{0}]"
    )]
    Immobile(String),
    /// A joint that moves only as another does.
    #[error("joint '{joint}' follows '{leader}' and does not move by itself: expected '{leader}'")]
    Follower {
        /// The joint.
        joint: String,
        /// The one that it follows.
        leader: String,
    },
    /// The file of a pose cannot be opened.
    #[error("the pose '{file}' cannot be read")]
    PoseIo {
        /// Its path.
        file: String,
        /// The reason.
        #[source]
        source: std::io::Error,
    },
    /// The file of a pose is not one, or does not fit the rig.
    #[error("the pose cannot be used")]
    PoseFile(#[source] ikiru_formats::Error),
    /// Two names that mean the same joint, where each joint can stand once.
    #[error("'{second}' is the same joint as '{first}', which {place} has already: expected it once")]
    Twice {
        /// Where they stand.
        place: String,
        /// The name that came first.
        first: String,
        /// The other one.
        second: String,
    },
    /// A range that runs backwards.
    #[error(
        "the smallest {what} is {min}, the largest {max}: expected the smallest not to be above the largest"
    )]
    Order {
        /// Which angle.
        what: &'static str,
        /// Lower end.
        min: f64,
        /// Upper end.
        max: f64,
    },
    /// A cone that cannot exist.
    #[error("the cone cannot exist")]
    Cone(#[source] ConeError),
    /// Keys of two alternatives at once, or of none.
    #[error("{place} has {found}: expected {expected}")]
    Alternatives {
        /// Where they stand.
        place: String,
        /// Which are there.
        found: String,
        /// What should be there.
        expected: &'static str,
    },
    /// Limits that do not go with how a joint moves.
    #[error("joint '{joint}' {reason}")]
    Unfit {
        /// The joint.
        joint: String,
        /// What does not go together, and what would.
        reason: String,
    },
    /// An objective whose keys make sense one by one, and not together or not on this rig.
    #[error("{place} {reason}")]
    Objective {
        /// Which objective.
        place: String,
        /// What does not fit, and the joint that it is about.
        reason: String,
    },
    /// A vector without direction.
    #[error("'{0}' has the length 0: expected {1}")]
    NoLength(String, &'static str),
    /// Something that is about time, in a scenario of a single pose.
    #[error("'{0}' is about time: expected a table [motion] in the scenario")]
    NeedsMotion(String),
    /// A scenario of a single pose where a motion is wanted.
    #[error("the scenario has no [motion]: expected one with 'duration_secs' or 'points'")]
    NoMotion,
    /// A motion that cannot be.
    #[error("the motion cannot be planned: {0}")]
    Motion(MotionError),
    /// A path that cannot be.
    #[error("{0}")]
    Path(TargetPathError),
    /// Nothing moves.
    #[error("no joint of the rig can move: expected limits that make one move, [limits.NAME]")]
    NothingMoves,
}

/// ` (did you mean 'a'?)` as it goes on after a name.
fn guess(unknown: &UnknownName) -> String {
    unknown.guess().map(|guess| format!(" ({guess})")).unwrap_or_default()
}

/// `'a', 'b' or 'c'`.
fn list(words: &[&str]) -> String {
    match words.split_last() {
        None => "none".to_owned(),
        Some((only, [])) => format!("'{only}'"),
        Some((last, others)) => format!("'{}' or '{last}'", others.join("', '")),
    }
}

impl Error {
    pub(crate) fn new(file: &str, place: Option<(usize, usize)>, kind: ErrorKind) -> Self {
        Self(Box::new(Inner { file: file.to_owned(), place, key: None, kind }))
    }

    /// This error, about the value to which these keys lead; none is the scenario as a whole.
    pub(crate) fn with_key(mut self, key: &str) -> Self {
        self.0.key = (!key.is_empty()).then(|| key.to_owned());
        self
    }

    /// This error, with more about the place of an unknown key.
    pub(crate) fn with_place_suffix(mut self, suffix: &str) -> Self {
        if let ErrorKind::UnknownKey { place, .. } = &mut self.0.kind {
            place.push_str(suffix);
        }
        self
    }

    /// The file, as it was named.
    #[must_use]
    pub fn file(&self) -> &str {
        &self.0.file
    }

    /// The line, counted from 1; `None` where the file as a whole is meant.
    #[must_use]
    pub fn line(&self) -> Option<usize> {
        self.0.place.map(|p| p.0)
    }

    /// The column in that line, in characters counted from 1.
    #[must_use]
    pub fn column(&self) -> Option<usize> {
        self.0.place.map(|p| p.1)
    }

    /// The keys that lead to what is wrong, `objective[0].target`, lists counted from 0; `None` where the scenario as a
    /// whole is meant. Of a document that no text stands behind, it is all that says where.
    #[must_use]
    pub fn key(&self) -> Option<&str> {
        self.0.key.as_deref()
    }

    /// What is wrong.
    #[must_use]
    pub fn kind(&self) -> &ErrorKind {
        &self.0.kind
    }
}

impl std::fmt::Display for Error {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        let Inner { file, place, key, kind } = &*self.0;
        match (place, key) {
            (Some((line, column)), _) => write!(f, "{file}:{line}:{column}: {kind}"),
            (None, Some(key)) => write!(f, "{file}: {key}: {kind}"),
            (None, None) => write!(f, "{file}: {kind}"),
        }
    }
}

impl std::error::Error for Error {
    fn source(&self) -> Option<&(dyn std::error::Error + 'static)> {
        std::error::Error::source(&self.0.kind)
    }
}
