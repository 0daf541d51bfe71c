//! `distance`: points of two joints a given way apart, at least, or at most.

use glam::DVec3;
use ikiru_rig::Rig;
use ikiru_solve::objectives::{Bound, Distance};
use serde::Serialize;
use serde_json::{Value as Json, json};

use crate::at::At;
use crate::axes::Axes;
use crate::error::Error;
use crate::key::Key;
use crate::keys::{TOLERANCE, is_zero};
use crate::kind_keys::{Aim, Built, KindKeys};
use crate::scene::Scene;
use crate::table::Table;
use crate::values::number_that;

/// The keys of a `distance`.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct DistanceKeys {
    /// The two joints, by name or humanoid role.
    pub joints: [String; 2],
    /// A point of each, in its frame, metres; their origins by default.
    #[serde(skip_serializing_if = "are_origins")]
    pub points: [[f64; 3]; 2],
    /// How far apart.
    #[serde(flatten)]
    pub apart: ApartKeys,
}

/// How far apart two points should be, metres of at least 0.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
#[serde(rename_all = "snake_case")]
#[non_exhaustive]
pub enum ApartKeys {
    /// `exactly`
    Exactly(f64),
    /// `at_least`
    AtLeast(f64),
    /// `at_most`
    AtMost(f64),
}

const JOINTS: Key = Key::new("joints", "two joints", "Both by name or humanoid role, [NAME, NAME].");
const POINTS: Key = Key::new(
    "points",
    "two points, each in its joint's frame, [[x, y, z], [x, y, z]]",
    "Which points of the joints are meant, metres.",
)
.or("[[0, 0, 0], [0, 0, 0]]");
const BOUNDS: [Key; 3] = [
    Key::new("exactly", METRES, "How far apart.").one_of(),
    Key::new("at_least", METRES, "The same as a lower bound.").one_of(),
    Key::new("at_most", METRES, "The same as an upper bound.").one_of(),
];
const METRES: &str = "metres, at least 0";

impl KindKeys for DistanceKeys {
    const NAME: &'static str = "distance";
    const ABOUT: &'static str = "Points of two joints so far apart, exactly, at least, or at most.";
    const KEYS: &'static [Key] = &[JOINTS, POINTS, BOUNDS[0], BOUNDS[1], BOUNDS[2], TOLERANCE];
    const EXAMPLE: &'static str = "\
kind = \"distance\"
joints = [\"leftHand\", \"rightHand\"]
exactly = 0.4
";
    type Objective = Distance;

    fn read(table: &Table<'_>) -> Result<Self, Error> {
        let joints = table.require(&JOINTS)?.names()?;
        let apart = match BOUNDS.map(|key| table.get(&key)) {
            [Some(metres), None, None] => ApartKeys::Exactly(metres.number()?),
            [None, Some(metres), None] => ApartKeys::AtLeast(metres.number()?),
            [None, None, Some(metres)] => ApartKeys::AtMost(metres.number()?),
            _ => {
                let expected = "one of 'exactly', 'at_least' or 'at_most' (metres)";
                return Err(table.alternatives(&BOUNDS, expected));
            }
        };
        let mut points = [[0.0; 3]; 2];
        if let Some(given) = table.get(&POINTS) {
            let list = given.list("a point in the joint's frame in metres, [x, y, z]")?;
            let [a, b] = &list[..] else {
                return Err(given.wrong_length(list.len()));
            };
            points = [a.numbers()?, b.numbers()?];
        }
        Ok(Self { joints, points, apart })
    }

    fn build(&self, scene: &Scene<'_>, at: &At<'_>) -> Result<Built<Distance>, Error> {
        let joints = scene.joints(&self.joints, at)?;
        let metres = |d: f64, key: &str| number_that(d, &at.key(key), |d| d >= 0.0, METRES);
        let bound = match self.apart {
            ApartKeys::Exactly(d) => Bound::Exactly(metres(d, "exactly")?),
            ApartKeys::AtLeast(d) => Bound::AtLeast(metres(d, "at_least")?),
            ApartKeys::AtMost(d) => Bound::AtMost(metres(d, "at_most")?),
        };
        let points = self.points.map(DVec3::from_array);
        Ok(Built::new(None, Distance { joints, points, bound }))
    }

    fn turn(_: &mut Distance, _: Axes) {
        // It is about joints alone.
    }

    fn aim(_: &mut Distance, _: Aim) -> bool {
        false
    }

    fn target_json(objective: &Distance, _: &Rig) -> Json {
        match objective.bound {
            Bound::Exactly(d) => json!({ "exactly": d }),
            Bound::AtLeast(d) => json!({ "at_least": d }),
            Bound::AtMost(d) => json!({ "at_most": d }),
        }
    }

    fn target_text(objective: &Distance, number: &dyn Fn(f64) -> String) -> String {
        match objective.bound {
            Bound::Exactly(d) => format!("{} m apart", number(d)),
            Bound::AtLeast(d) => format!("at least {} m apart", number(d)),
            Bound::AtMost(d) => format!("at most {} m apart", number(d)),
        }
    }
}

fn are_origins(points: &[[f64; 3]; 2]) -> bool {
    points.iter().all(is_zero)
}
