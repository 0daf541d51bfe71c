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

use glam::{DQuat, DVec3};
use ikiru_rig::{JointId, Rig};
use ikiru_solve::{Objective, TargetPath};
use serde::{Serialize, Serializer};
use serde_json::Value as Json;

use crate::at::At;
use crate::axes::Axes;
use crate::error::Error;
use crate::key::Key;
use crate::keys::POINT;
use crate::scene::Scene;
use crate::table::Table;
use crate::term::{AddedTerm, Adding};

/// What a scenario knows of one kind of objective. The struct that implements it has the kind's keys as its fields;
/// what it serializes to is what the text has.
pub(crate) trait KindKeys: Serialize + Sized {
    /// Its name in scenarios.
    const NAME: &'static str;
    /// What it wants, in a few lines of Markdown.
    const ABOUT: &'static str;
    /// Its keys, besides those that every objective has. `tolerance` (metres) and `tolerance_deg` are read for every
    /// kind: here they say which of them the kind has.
    const KEYS: &'static [Key];
    /// The keys of tables inside it, each behind what leads to them.
    const INNER: &'static [(&'static str, &'static [Key])] = &[];
    /// A small one of the built-in human: the table `[[objective]]` of a text.
    const EXAMPLE: &'static str;
    /// What reports call it as a constraint, where it is hard; kinds that are constraints by nature have a name of their own.
    const CONSTRAINT: &'static str = "objective";
    /// What the solver makes of it.
    type Objective: Objective + Clone;

    /// Reads the keys of a text; that there are no others was looked at before.
    fn read(table: &Table<'_>) -> Result<Self, Error>;

    /// The objective that the keys of the table `at` ask for, in the axes that the scenario gives targets in.
    fn build(&self, scene: &Scene<'_>, at: &At<'_>) -> Result<Built<Self::Objective>, Error>;

    /// Takes an objective from the axes that it is given in to others.
    fn turn(objective: &mut Self::Objective, axes: Axes);

    /// Gives it another target of the same sort; false where it has none to give.
    fn aim(objective: &mut Self::Objective, aim: Aim) -> bool;

    /// What it aims at, for programs; null for nothing.
    fn target_json(objective: &Self::Objective, rig: &Rig) -> Json;

    /// What it aims at, for people, in a few words; `number` writes a number.
    fn target_text(objective: &Self::Objective, number: &dyn Fn(f64) -> String) -> String;
}

/// What the format says of a kind: its constants, for whoever goes through all of them.
pub(crate) struct KindText {
    pub(crate) name: &'static str,
    pub(crate) about: &'static str,
    pub(crate) keys: &'static [Key],
    pub(crate) inner: &'static [(&'static str, &'static [Key])],
    pub(crate) example: &'static str,
}

/// An objective that keys ask for.
pub(crate) struct Built<T> {
    pub(crate) objective: T,
    /// The joint that it is about; `None` where it names several, or takes all.
    pub(crate) joint: Option<JointId>,
    /// What its target follows, for kinds that have the key `path`.
    pub(crate) path: Option<TargetPath>,
}

impl<T> Built<T> {
    /// An objective about a joint, with a target that stays.
    fn new(joint: impl Into<Option<JointId>>, objective: T) -> Self {
        Self { objective, joint: joint.into(), path: None }
    }
}

/// Another target, in the rig's world.
#[derive(Clone, Copy, Debug)]
pub(crate) enum Aim {
    /// A point, or the direction to it.
    Point(DVec3),
    Rotation(DQuat),
}

impl Aim {
    /// What errors call it.
    pub(crate) fn word(self) -> &'static str {
        match self {
            Self::Point(_) => "point",
            Self::Rotation(_) => "rotation",
        }
    }
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

/// The point of `point` in a joint's frame; its origin where it is left out.
fn point(table: &Table<'_>) -> Result<[f64; 3], Error> {
    table.get(&POINT).map_or(Ok([0.0; 3]), |value| value.numbers())
}

/// `0.1, 0.2, 0.3`
fn vector_text(vector: DVec3, number: &dyn Fn(f64) -> String) -> String {
    vector.to_array().map(number).join(", ")
}
