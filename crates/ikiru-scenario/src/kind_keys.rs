//! What a scenario knows of every kind of objective: how its keys are read, what they build, what can be done with that.

use glam::{DQuat, DVec3};
use ikiru_rig::{JointId, Rig};
use ikiru_solve::{Objective, TargetPath};
use serde::Serialize;
use serde_json::Value as Json;

use crate::at::At;
use crate::axes::Axes;
use crate::error::Error;
use crate::key::Key;
use crate::keys::POINT;
use crate::scene::Scene;
use crate::table::Table;

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
    pub(crate) fn new(joint: impl Into<Option<JointId>>, objective: T) -> Self {
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

/// The point of `point` in a joint's frame; its origin where it is left out.
pub(crate) fn point(table: &Table<'_>) -> Result<[f64; 3], Error> {
    table.get(&POINT).map_or(Ok([0.0; 3]), |value| value.numbers())
}

/// `0.1, 0.2, 0.3`
pub(crate) fn vector_text(vector: DVec3, number: &dyn Fn(f64) -> String) -> String {
    vector.to_array().map(number).join(", ")
}
