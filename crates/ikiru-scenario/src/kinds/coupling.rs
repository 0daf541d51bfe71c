//! `coupling`: a sum of joint angles at most, at least or exactly something.

use glam::DVec3;
use ikiru_rig::{JointId, Rig};
use ikiru_solve::objectives::{Bound, Coupling};
use ikiru_solve::{UnfitReason, Unit};
use serde::{Serialize, Serializer};
use serde_json::{Value as Json, json};

use crate::at::At;
use crate::axes::Axes;
use crate::error::{Error, ErrorKind};
use crate::key::{JOINT, Key};
use crate::keys::{TOLERANCE, TOLERANCE_DEG};
use crate::kind_keys::{Aim, Built, KindKeys};
use crate::scene::Scene;
use crate::table::{Table, Value};
use crate::values::{degrees, direction};

/// The keys of a `coupling`.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct CouplingKeys {
    /// At least one angle; all of them are angles, or all are offsets of sliders.
    pub angles: Vec<AngleKeys>,
    /// What their sum should be.
    #[serde(flatten)]
    pub sum: SumKeys,
}

/// One angle of a sum.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct AngleKeys {
    /// The joint, by name or humanoid role.
    pub joint: String,
    /// Which of its angles. Left out for a hinge and a slider; `[1, 0, 0]`, `[0, 1, 0]` or `[0, 0, 1]` for an Euler joint; for
    /// a ball a direction in the frame of the joint's parent at rest, of any length but 0: about it the swing counts.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub axis: Option<[f64; 3]>,
    /// What it is multiplied by.
    pub factor: f64,
}

/// What a sum should be.
#[derive(Clone, Copy, Debug, PartialEq)]
#[non_exhaustive]
pub enum SumKeys {
    /// `exactly_deg`, `at_least_deg` or `at_most_deg`: degrees.
    Degrees(Bound),
    /// `exactly`, `at_least` or `at_most`, for offsets of sliders: metres.
    Metres(Bound),
}

/// What a key says with a number.
type Says = fn(f64) -> SumKeys;

const ANGLES: Key = Key::new(
    "angles",
    "angles of joints, [{ joint = NAME, axis = [x, y, z], factor = 1.0 }, …]",
    "At least one; all of them angles, or all offsets of sliders.",
);
const ANGLE_KEYS: [Key; 3] = [
    JOINT.meaning("Whose angle it is."),
    Key::new(
        "axis",
        "a direction, [x, y, z]",
        "Which angle: x, y or z of an Euler joint; of a ball its swing about a direction in the frame of the joint's parent.",
    )
    .or_as("the only one, of a hinge or slider"),
    Key::new("factor", "what the angle is multiplied by", "What it counts for."),
];
const SUM_KEYS: [Key; 6] = [
    Key::new("exactly_deg", "degrees", "What the sum should be.").one_of(),
    Key::new("at_least_deg", "degrees", "The same as a lower bound.").one_of(),
    Key::new("at_most_deg", "degrees", "The same as an upper bound.").one_of(),
    Key::new("exactly", "metres", "What a sum of sliders' offsets should be.").one_of(),
    Key::new("at_least", "metres", "The same as a lower bound.").one_of(),
    Key::new("at_most", "metres", "The same as an upper bound.").one_of(),
];
/// What each of them says.
const SUMS: [Says; 6] = [
    |sum| SumKeys::Degrees(Bound::Exactly(sum)),
    |sum| SumKeys::Degrees(Bound::AtLeast(sum)),
    |sum| SumKeys::Degrees(Bound::AtMost(sum)),
    |sum| SumKeys::Metres(Bound::Exactly(sum)),
    |sum| SumKeys::Metres(Bound::AtLeast(sum)),
    |sum| SumKeys::Metres(Bound::AtMost(sum)),
];

impl KindKeys for CouplingKeys {
    const NAME: &'static str = "coupling";
    const ABOUT: &'static str = "A sum of joint angles, each times its factor: how a knee follows a hip, how far thumb and finger bend together. Of sliders it is a \
                                 sum of offsets.";
    const KEYS: &'static [Key] = &[
        ANGLES,
        SUM_KEYS[0],
        SUM_KEYS[1],
        SUM_KEYS[2],
        SUM_KEYS[3],
        SUM_KEYS[4],
        SUM_KEYS[5],
        TOLERANCE.meaning("Of sliders: how near is near enough."),
        TOLERANCE_DEG,
    ];
    const INNER: &'static [(&'static str, &'static [Key])] = &[("each of `angles`", &ANGLE_KEYS)];
    const EXAMPLE: &'static str = "\
kind = \"coupling\"
angles = [
   { joint = \"leftUpperLeg\", axis = [1, 0, 0], factor = 1 },
   { joint = \"leftLowerLeg\", axis = [1, 0, 0], factor = -0.4 },
]
at_most_deg = 90
";
    const CONSTRAINT: &'static str = "coupling";
    type Objective = Coupling;

    fn read(table: &Table<'_>) -> Result<Self, Error> {
        let angles =
            table.require(&ANGLES)?.list("a table, { joint = NAME, axis = [x, y, z], factor = 1.0 }")?;
        let angles = angles.iter().map(AngleKeys::read).collect::<Result<_, _>>()?;
        Ok(Self { angles, sum: SumKeys::read(table)? })
    }

    fn build(&self, scene: &Scene<'_>, at: &At<'_>) -> Result<Built<Coupling>, Error> {
        let (at_angles, bound) = (at.key("angles"), self.sum.bound());
        let mut angles: Vec<(JointId, Option<DVec3>, f64)> = Vec::with_capacity(self.angles.len());
        let mut built = Err(scene.unfit(UnfitReason::CouplesNothing.into(), at, &at_angles));
        for (idx, keys) in self.angles.iter().enumerate() {
            let at_angle = at_angles.entry(idx);
            let joint = scene.joint(&keys.joint, &at_angle, "joint")?;
            let axis = keys.axis.map(|axis| direction(axis, &at_angle.key("axis"))).transpose()?;
            angles.push((joint, axis, keys.factor));
            // Of the angles so far, so that what does not fit is this one.
            built = Ok(Coupling::new(scene.rig, &angles, bound).map_err(|e| scene.unfit(e, at, &at_angle))?);
        }
        let coupling = built?;
        if coupling.unit() != self.sum.unit() {
            let (place, found) = (at.place(), format!("'{}'", self.sum.key()));
            let expected = match coupling.unit() {
                Unit::Radians => "'at_most_deg', 'at_least_deg' or 'exactly_deg' for a sum of angles",
                Unit::Metres => "'at_most', 'at_least' or 'exactly' (metres) for a sum of sliders' offsets",
            };
            return Err(at.key(self.sum.key()).key_error(ErrorKind::Alternatives { place, found, expected }));
        }
        let joint = if let [(only, ..)] = angles[..] { Some(only) } else { None };
        Ok(Built::new(joint, coupling))
    }

    fn turn(_: &mut Coupling, _: Axes) {
        // It is about joints alone.
    }

    fn aim(_: &mut Coupling, _: Aim) -> bool {
        false
    }

    fn target_json(objective: &Coupling, _: &Rig) -> Json {
        let sum = SumKeys::of(objective);
        json!({ (sum.key()): sum.value() })
    }

    fn target_text(objective: &Coupling, number: &dyn Fn(f64) -> String) -> String {
        let sum = SumKeys::of(objective);
        let words = match objective.bound {
            Bound::Exactly(_) => "exactly",
            Bound::AtLeast(_) => "at least",
            Bound::AtMost(_) => "at most",
        };
        let unit = match sum.unit() {
            Unit::Radians => "°",
            Unit::Metres => " m",
        };
        format!("{words} {}{unit}", number(sum.value()))
    }
}

impl AngleKeys {
    fn read(value: &Value<'_>) -> Result<Self, Error> {
        let table = value.table()?;
        table.only(&ANGLE_KEYS)?;
        let [joint, axis, factor] = &ANGLE_KEYS;
        Ok(Self {
            joint: table.require(joint)?.name()?,
            axis: table.get(axis).map(|axis| axis.numbers()).transpose()?,
            factor: table.require(factor)?.number()?,
        })
    }
}

impl SumKeys {
    fn read(table: &Table<'_>) -> Result<Self, Error> {
        let mut given = SUM_KEYS.iter().zip(SUMS).filter_map(|(key, says)| Some((table.get(key)?, says)));
        if let (Some((value, says)), None) = (given.next(), given.next()) {
            return Ok(says(value.number()?));
        }
        let expected = "one of 'at_most_deg', 'at_least_deg' or 'exactly_deg'; \
                        of a sum of sliders 'at_most', 'at_least' or 'exactly' (metres)";
        Err(table.alternatives(&SUM_KEYS, expected))
    }

    /// What a coupling's sum should be, as the text would have it.
    fn of(objective: &Coupling) -> Self {
        match objective.unit() {
            Unit::Radians => Self::Degrees(converted(objective.bound, degrees)),
            Unit::Metres => Self::Metres(objective.bound),
        }
    }

    /// In radians, or metres.
    fn bound(self) -> Bound {
        match self {
            Self::Degrees(bound) => converted(bound, f64::to_radians),
            Self::Metres(bound) => bound,
        }
    }

    fn unit(self) -> Unit {
        match self {
            Self::Degrees(_) => Unit::Radians,
            Self::Metres(_) => Unit::Metres,
        }
    }

    /// Its number, as the text has it.
    fn value(self) -> f64 {
        let (Self::Degrees(bound) | Self::Metres(bound)) = self;
        bound.value()
    }

    fn key(self) -> &'static str {
        let without_number = match self {
            Self::Degrees(bound) => Self::Degrees(converted(bound, |_| 0.0)),
            Self::Metres(bound) => Self::Metres(converted(bound, |_| 0.0)),
        };
        SUMS.iter().position(|says| says(0.0) == without_number).map_or("", |idx| SUM_KEYS[idx].name)
    }
}

impl Serialize for SumKeys {
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        serializer.collect_map([(self.key(), self.value())])
    }
}

fn converted(bound: Bound, unit: fn(f64) -> f64) -> Bound {
    match bound {
        Bound::Exactly(value) => Bound::Exactly(unit(value)),
        Bound::AtLeast(value) => Bound::AtLeast(unit(value)),
        Bound::AtMost(value) => Bound::AtMost(unit(value)),
    }
}
