//! The kinds of objectives, one a file: their keys as data.
//!
//! An objective of a document has a [`Kind`], whose keys are the fields of a struct of that kind:
//!
//! ```
//! use ikiru_scenario::kinds::{Kind, PositionKeys};
//! use ikiru_scenario::{ObjectiveEntry, TargetKeys};
//!
//! let target = TargetKeys::Target([0.3, 1.2, 0.4]);
//! let mut reach = ObjectiveEntry::new(PositionKeys { joint: "leftHand".to_owned(), point: [0.0; 3], target });
//! if let Kind::Position(keys) = &mut reach.kind {
//!     keys.point = [0.0, 0.05, 0.0];
//! }
//! assert_eq!(reach.kind.name(), "position");
//! ```
// A new kind is a file beside these and two lines here, its `mod` and its place in the list: nothing else names it.

mod center_of_mass;
mod coupling;
mod direction;
mod distance;
mod known_rotation;
mod look_at;
mod orientation;
mod pole_vector;
mod pose;
mod position;
mod relative_pose;
mod rest_pose;

use serde::{Serialize, Serializer};

use crate::at::At;
use crate::error::Error;
use crate::key::Key;
use crate::kind_keys::KindKeys;
use crate::table::Table;
use crate::term::{AddedTerm, Adding};

/// What the format says of a kind: its constants, for whoever goes through all of them.
pub(crate) struct KindText {
    pub(crate) name: &'static str,
    pub(crate) about: &'static str,
    pub(crate) keys: &'static [Key],
    pub(crate) inner: &'static [(&'static str, &'static [Key])],
    pub(crate) example: &'static str,
}

/// Turns the list of kinds, `Variant(file::Keys, other public types of the file)`, into [`Kind`] and what is asked of one
/// whose kind is not known beforehand.
macro_rules! kinds {
    ($($variant:ident($module:ident::$keys:ident $(, $more:ident)*),)*) => {
        $(pub use $module::{$keys $(, $more)*};)*

        /// What an objective wants: one of the kinds, with its keys as the text has them.
        #[derive(Clone, Debug, PartialEq)]
        #[non_exhaustive]
        pub enum Kind {
            $(#[doc = concat!("An objective of kind `", stringify!($module), "`.")] $variant($keys),)*
        }

        $(impl From<$keys> for Kind {
            fn from(keys: $keys) -> Self {
                Self::$variant(keys)
            }
        })*

        impl Kind {
            /// The names of all kinds, as scenarios have them.
            pub const NAMES: &[&'static str] = &[$($keys::NAME,)*];

            /// Its name in scenarios.
            #[must_use]
            pub fn name(&self) -> &'static str {
                match self {
                    $(Self::$variant(_) => $keys::NAME,)*
                }
            }

            /// What reports call it as a constraint.
            pub(crate) fn constraint(&self) -> &'static str {
                match self {
                    $(Self::$variant(_) => $keys::CONSTRAINT,)*
                }
            }

            /// The keys of the kind of that name, besides those that every objective has; none of a name that is no kind's.
            #[must_use]
            pub fn keys_of(name: &str) -> &'static [Key] {
                $(if name == $keys::NAME {
                    return $keys::KEYS;
                })*
                &[]
            }

            /// What the format says of every kind, in the order of [`NAMES`](Self::NAMES).
            pub(crate) const TEXTS: &[KindText] = &[$(KindText {
                name: $keys::NAME,
                about: $keys::ABOUT,
                keys: $keys::KEYS,
                inner: $keys::INNER,
                example: $keys::EXAMPLE,
            },)*];

            /// Reads the keys of the kind of that name; `None` for a name that is no kind's.
            pub(crate) fn read(name: &str, table: &Table<'_>) -> Result<Option<Self>, Error> {
                $(if name == $keys::NAME {
                    return Ok(Some(Self::$variant($keys::read(table)?)));
                })*
                Ok(None)
            }

            /// Adds the objective that it asks for to a problem.
            pub(crate) fn add(&self, adding: Adding<'_>, at: &At<'_>) -> Result<AddedTerm, Error> {
                match self {
                    $(Self::$variant(keys) => adding.term(keys, at),)*
                }
            }
        }

        impl Serialize for Kind {
            fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
                match self {
                    $(Self::$variant(keys) => Named { kind: $keys::NAME, keys }.serialize(serializer),)*
                }
            }
        }
    };
}

/// A kind's keys behind its name.
#[derive(Serialize)]
struct Named<'a, K> {
    kind: &'static str,
    #[serde(flatten)]
    keys: &'a K,
}

kinds! {
    Position(position::PositionKeys),
    Orientation(orientation::OrientationKeys),
    Pose(pose::PoseKeys),
    LookAt(look_at::LookAtKeys, GazeKeys),
    Direction(direction::DirectionKeys),
    RelativePose(relative_pose::RelativePoseKeys),
    Distance(distance::DistanceKeys, ApartKeys),
    PoleVector(pole_vector::PoleVectorKeys),
    KnownRotation(known_rotation::KnownRotationKeys),
    RestPose(rest_pose::RestPoseKeys),
    Coupling(coupling::CouplingKeys, AngleKeys, SumKeys),
    CenterOfMass(center_of_mass::CenterOfMassKeys, CenterKeys, MassKeys),
}
