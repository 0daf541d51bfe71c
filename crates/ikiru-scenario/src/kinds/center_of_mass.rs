//! `center_of_mass`: the body's centre of mass at a point, or over an area of the ground.

use glam::DVec3;
use ikiru_rig::{Rig, Segment};
use ikiru_solve::objectives::CenterOfMass;
use serde::{Serialize, Serializer};
use serde_json::{Value as Json, json};

use crate::at::At;
use crate::axes::Axes;
use crate::error::{Error, ErrorKind};
use crate::key::Key;
use crate::keys::{TARGET, TOLERANCE, as_table, is_plain_zero, is_zero};
use crate::kind_keys::{Aim, Built, KindKeys, vector_text};
use crate::scene::{Scene, none_of_them, twice};
use crate::table::{Table, Value};
use crate::values::{joint_of_key, number_that};

/// The keys of a `center_of_mass`.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct CenterOfMassKeys {
    /// Where it should be.
    #[serde(flatten)]
    pub place: CenterKeys,
    /// The parts of the body that count, at least one, by the name or humanoid role of their joints. Left out, the body's own,
    /// which a file must know then: a URDF's `<inertial>`s.
    #[serde(skip_serializing_if = "Option::is_none", serialize_with = "as_optional_table")]
    pub masses: Option<Vec<(String, MassKeys)>>,
}

/// Where a centre of mass should be.
#[derive(Clone, Debug, PartialEq, Serialize)]
#[serde(untagged)]
#[non_exhaustive]
pub enum CenterKeys {
    /// At a point.
    At {
        /// A point of the world, metres.
        target: [f64; 3],
    },
    /// Over an area.
    Over {
        /// Points of the ground, metres, at least three that are not on one line: the area is their convex hull. Along the two
        /// axes of the world that are not up, `[x, z]`; with `world = "file"` and z up, `[x, y]`.
        inside: Vec<[f64; 2]>,
        /// How far inside the area, metres, at least 0; 0 by default.
        #[serde(skip_serializing_if = "is_plain_zero")]
        margin: f64,
    },
}

/// A part of the body that goes with a joint.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct MassKeys {
    /// Kilograms, above 0.
    pub kg: f64,
    /// Where its centre is in the joint's frame, metres; its origin by default.
    #[serde(skip_serializing_if = "is_zero")]
    pub center: [f64; 3],
}

const PLACE: [Key; 3] = [
    TARGET.one_of(),
    Key::new(
        "inside",
        "points of the ground, [[x, z], …]",
        "At least three, metres, not on one line: the area is their convex hull. With `world = \"file\"` and z up they are `[x, y]`.",
    )
    .one_of(),
    Key::new("margin", "metres, at least 0", "How far inside the area, beside `inside`.").or("0"),
];
const MASSES: Key = Key::new(
    "masses",
    "a table of masses of joints, { NAME = { kg = 1.0, center = [x, y, z] } }",
    "What counts, at least one, by joint.",
)
.or_as("a URDF's own, else an error");
const MASS_KEYS: [Key; 2] = [
    Key::new("kg", "kilograms, above 0", "How heavy it is."),
    Key::new("center", "a point in the joint's frame in metres, [x, y, z]", "Where its centre is.")
        .or("[0, 0, 0]"),
];

impl KindKeys for CenterOfMassKeys {
    const NAME: &'static str = "center_of_mass";
    const ABOUT: &'static str = "The body's centre of mass at a point, or over an area of the ground: a body that does not fall over.";
    const KEYS: &'static [Key] = &[PLACE[0], PLACE[1], PLACE[2], MASSES, TOLERANCE];
    const INNER: &'static [(&'static str, &'static [Key])] = &[("each of `masses`", &MASS_KEYS)];
    const EXAMPLE: &'static str = "\
kind = \"center_of_mass\"
inside = [[-0.1, -0.1], [0.1, -0.1], [0.1, 0.15], [-0.1, 0.15]]
masses = { hips = { kg = 30 }, chest = { kg = 30, center = [0, 0.1, 0] } }
";
    type Objective = CenterOfMass;

    fn read(table: &Table<'_>) -> Result<Self, Error> {
        let masses = table.get(&MASSES).map(|masses| -> Result<_, Error> {
            let masses = masses.table()?.entries("a table, { kg = 1.0, center = [x, y, z] }");
            masses.iter().map(|mass| Ok((mass.key.clone(), MassKeys::read(mass)?))).collect()
        });
        Ok(Self { place: CenterKeys::read(table)?, masses: masses.transpose()? })
    }

    fn build(&self, scene: &Scene<'_>, at: &At<'_>) -> Result<Built<CenterOfMass>, Error> {
        let segments = self.segments(scene, at)?;
        let objective = match &self.place {
            CenterKeys::At { target } => CenterOfMass::at(&segments, DVec3::from_array(*target)),
            CenterKeys::Over { inside, margin } => {
                let margin = number_that(*margin, &at.key("margin"), |margin| margin >= 0.0, PLACE[2].takes)?;
                let [first, second] = ground(scene.up);
                let points: Vec<DVec3> = inside.iter().map(|[a, b]| first * *a + second * *b).collect();
                CenterOfMass::over(&segments, &points, scene.up, margin)
                    .map_err(|unfit| scene.unfit(unfit, at, &at.key("inside")))?
            }
        };
        Ok(Built::new(None, objective))
    }

    fn turn(objective: &mut CenterOfMass, axes: Axes) {
        objective.turn(axes.world);
    }

    fn aim(objective: &mut CenterOfMass, aim: Aim) -> bool {
        match aim {
            // Of a wish to be over an area, a point would make another wish.
            Aim::Point(point) if objective.target().is_some() => objective.set_target(point),
            Aim::Point(_) | Aim::Rotation(_) => return false,
        }
        true
    }

    fn target_json(objective: &CenterOfMass, _: &Rig) -> Json {
        match (objective.target(), objective.area()) {
            (Some(target), _) => json!(target.to_array()),
            (None, Some((corners, up, margin))) => {
                let axes = ground(up);
                let inside: Vec<[f64; 2]> =
                    corners.iter().map(|corner| axes.map(|axis| corner.dot(axis))).collect();
                json!({ "inside": inside, "margin": margin })
            }
            (None, None) => Json::Null,
        }
    }

    fn target_text(objective: &CenterOfMass, number: &dyn Fn(f64) -> String) -> String {
        match (objective.target(), objective.area()) {
            (Some(target), _) => vector_text(target, number),
            (None, Some((corners, _, margin))) if margin > 0.0 => {
                format!("over {} corners, {} m inside", corners.len(), number(margin))
            }
            (None, area) => format!("over {} corners", area.map_or(0, |(corners, ..)| corners.len())),
        }
    }
}

impl CenterOfMassKeys {
    /// The parts of the body: those of the keys, else the body's own.
    fn segments(&self, scene: &Scene<'_>, objective: &At<'_>) -> Result<Vec<Segment>, Error> {
        let at = objective.key("masses");
        let Some(masses) = &self.masses else {
            if scene.segments.is_empty() {
                let expected = "masses of joints, { NAME = { kg = 1.0, center = [x, y, z] } }, since \
                                the rig's file has none, as a URDF has them in <inertial>";
                let kind = ErrorKind::MissingKey { place: objective.place(), key: "masses", expected };
                return Err(objective.error(kind));
            }
            return Ok(scene.segments.to_vec());
        };
        let mut segments: Vec<Segment> = Vec::with_capacity(masses.len());
        for (name, MassKeys { kg, center }) in masses {
            let at_name = at.key(name);
            let joint = joint_of_key(scene.rig, name, &at_name)?;
            if segments.iter().any(|other| other.joint == joint) {
                return Err(at_name.key_error(twice(scene.rig, joint, name, at.place())));
            }
            let kg = number_that(*kg, &at_name.key("kg"), |kg| kg > 0.0, MASS_KEYS[0].takes)?;
            segments.push(Segment { joint, kg, center: DVec3::from_array(*center) });
        }
        if segments.is_empty() { Err(none_of_them(&at)) } else { Ok(segments) }
    }
}

impl CenterKeys {
    fn read(table: &Table<'_>) -> Result<Self, Error> {
        match PLACE.map(|key| table.get(&key)) {
            [Some(target), None, None] => Ok(Self::At { target: target.numbers()? }),
            [None, Some(inside), margin] => {
                let inside = inside.list("a point of the ground, [x, z]")?;
                let inside = inside.iter().map(Value::numbers);
                let margin = margin.map_or(Ok(0.0), |margin| margin.number())?;
                Ok(Self::Over { inside: inside.collect::<Result<_, _>>()?, margin })
            }
            _ => {
                let expected = "either 'target' (a point of the world) or 'inside' (points of the ground), with a 'margin' or without";
                Err(table.alternatives(&PLACE, expected))
            }
        }
    }
}

impl MassKeys {
    fn read(value: &Value<'_>) -> Result<Self, Error> {
        let table = value.table()?;
        table.only(&MASS_KEYS)?;
        let [kg, center] = &MASS_KEYS;
        Ok(Self {
            kg: table.require(kg)?.number()?,
            center: table.get(center).map_or(Ok([0.0; 3]), |center| center.numbers())?,
        })
    }
}

/// The two axes of the world along which the ground lies, in their order.
fn ground(up: DVec3) -> [DVec3; 2] {
    let is_up = |axis: DVec3| axis.dot(up).abs() > 0.5;
    match DVec3::AXES {
        [_, y, z] if is_up(DVec3::X) => [y, z],
        [x, _, z] if is_up(DVec3::Y) => [x, z],
        [x, y, _] => [x, y],
    }
}

fn as_optional_table<S: Serializer>(
    masses: &Option<Vec<(String, MassKeys)>>,
    serializer: S,
) -> Result<S::Ok, S::Error> {
    as_table(masses.as_deref().unwrap_or_default(), serializer)
}
