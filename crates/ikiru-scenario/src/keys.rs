//! Keys that several places share: what the format says of them, and as data rotations, targets that stay or move, what a
//! joint does.

use glam::{DQuat, DVec3};
use ikiru_rig::{EulerOrder, JointId, JointMotion, Range, Rig};
use ikiru_solve::TargetPath;
use ikiru_solve::objectives::JointAngles;
use serde::{Serialize, Serializer};

use crate::at::At;
use crate::error::{Error, ErrorKind};
use crate::key::Key;
use crate::scene::Scene;
use crate::table::{Table, Value};
use crate::values::{name_of, quaternion, with_article};

/// Which point of it.
pub(crate) const POINT: Key = Key::new(
    "point",
    "a point in the joint's frame in metres, [x, y, z]",
    "Which point of the joint is meant.",
)
.or("[0, 0, 0]");
/// Which direction of it.
pub(crate) const AXIS: Key = Key::new(
    "axis",
    "a direction in the joint's frame, [x, y, z]",
    "Which direction of the joint is meant; of any length but 0.",
);
pub(crate) const TARGET: Key =
    Key::new("target", "a point of the world in metres, [x, y, z]", "Where it should be.");
pub(crate) const PATH: Key = Key::new(
    "path",
    "points at times, [[secs, x, y, z], …]",
    "A target that moves along a smooth curve through these points, beside a `[motion]`.",
);
pub(crate) const TARGET_ROTATION: Key = Key::new(
    "target_rotation",
    "a quaternion, [x, y, z, w]",
    "How its frame should be turned in the world; of any length but 0.",
)
.one_of();
pub(crate) const EULER_DEG: Key =
    Key::new("euler_deg", "three angles in degrees, [x, y, z]", "The same as angles of `Rz·Ry·Rx`.").one_of();
/// How near is near enough, of kinds with a part in metres.
pub(crate) const TOLERANCE: Key =
    Key::new("tolerance", "metres, at least 0", "How near is near enough.").or_as("0.001, hard 0.0001");
/// How near is near enough, of kinds with a part that is an angle.
pub(crate) const TOLERANCE_DEG: Key =
    Key::new("tolerance_deg", "degrees, at least 0", "How near is near enough.").or_as("0.5, hard 0.01");

/// What errors expect where the key is that of a list or a table.
pub(crate) const TABLE: &str = "a table";

/// A rotation of the world, or of another joint's frame.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
#[serde(rename_all = "snake_case")]
#[non_exhaustive]
pub enum RotationKeys {
    /// `target_rotation`: a quaternion (x, y, z, w) of any length but 0.
    TargetRotation([f64; 4]),
    /// `euler_deg`: degrees about x, y and z of `Rz·Ry·Rx`.
    EulerDeg([f64; 3]),
}

/// A target that stays, or moves in a scenario with `[motion]`.
#[derive(Clone, Debug, PartialEq, Serialize)]
#[serde(rename_all = "snake_case")]
#[non_exhaustive]
pub enum TargetKeys {
    /// `target`: a point of the world, metres.
    Target([f64; 3]),
    /// `path`: times (seconds) and points (metres), `[secs, x, y, z]`, with a smooth curve through them.
    Path(Vec<[f64; 4]>),
}

/// How a joint is turned or moved, as `[start]` and `known_rotation` say it.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
#[serde(rename_all = "snake_case")]
#[non_exhaustive]
pub enum JointKeys {
    /// `euler_deg`, of a ball, a free or an Euler joint: degrees about x, y and z.
    EulerDeg([f64; 3]),
    /// `rotation`, of the same: a quaternion (x, y, z, w) of any length but 0, on top of the joint's rest.
    Rotation([f64; 4]),
    /// `angle_deg`, of a hinge: degrees.
    AngleDeg(f64),
    /// `offset`, of a slider: metres.
    Offset(f64),
}

impl RotationKeys {
    pub(crate) const KEYS: [Key; 2] = [TARGET_ROTATION, EULER_DEG];
    const EXPECTED: &'static str =
        "either 'target_rotation' (a quaternion, [x, y, z, w]) or 'euler_deg' (angles x, y, z of Rz·Ry·Rx)";

    /// What is there of them; both is an error, none is not.
    pub(crate) fn read_if_there(table: &Table<'_>) -> Result<Option<Self>, Error> {
        match (table.get(&TARGET_ROTATION), table.get(&EULER_DEG)) {
            (None, None) => Ok(None),
            (Some(quaternion), None) => Ok(Some(Self::TargetRotation(quaternion.numbers()?))),
            (None, Some(angles)) => Ok(Some(Self::EulerDeg(angles.numbers()?))),
            (Some(_), Some(_)) => Err(table.alternatives(&Self::KEYS, Self::EXPECTED)),
        }
    }

    pub(crate) fn read(table: &Table<'_>) -> Result<Self, Error> {
        Self::read_if_there(table)?.ok_or_else(|| table.alternatives(&Self::KEYS, Self::EXPECTED))
    }

    /// `at` is the table that has the key.
    pub(crate) fn quaternion(&self, at: &At<'_>) -> Result<DQuat, Error> {
        match *self {
            Self::TargetRotation(numbers) => quaternion(numbers, &at.key("target_rotation")),
            Self::EulerDeg(degrees) => Ok(EulerOrder::Zyx.quaternion(degrees.map(f64::to_radians))),
        }
    }
}

impl TargetKeys {
    /// What is there of them; both is an error, none is not.
    pub(crate) fn read_if_there(table: &Table<'_>) -> Result<Option<Self>, Error> {
        match (table.get(&TARGET), table.get(&PATH)) {
            (None, None) => Ok(None),
            (Some(target), None) => Ok(Some(Self::Target(target.numbers()?))),
            (None, Some(path)) => {
                let points = path.list("a time in seconds and a point, [secs, x, y, z]")?;
                let points = points.iter().map(Value::numbers);
                Ok(Some(Self::Path(points.collect::<Result<_, _>>()?)))
            }
            (Some(_), Some(_)) => Err(table.alternatives(
                &[TARGET, PATH],
                "either 'target' (a point of the world in metres, [x, y, z]) or 'path' (points at times)",
            )),
        }
    }

    /// Where it is, or begins, and the way that it goes. `at` is the table that has the key.
    pub(crate) fn point(&self, scene: &Scene<'_>, at: &At<'_>) -> Result<(DVec3, Option<TargetPath>), Error> {
        match self {
            Self::Target(point) => Ok((DVec3::from_array(*point), None)),
            Self::Path(points) => {
                let path = scene.path(points, &at.key("path"))?;
                Ok((path.at(path.span().0), Some(path)))
            }
        }
    }
}

impl JointKeys {
    pub(crate) const KEYS: [Key; 4] = [
        EULER_DEG.meaning("Of a ball, an Euler joint or a free root: angles of `Rz·Ry·Rx`."),
        Key::new("rotation", "a quaternion, [x, y, z, w]", "Of the same; of any length but 0.").one_of(),
        Key::new("angle_deg", "an angle in degrees", "Of a hinge.").one_of(),
        Key::new("offset", "metres", "Of a slider.").one_of(),
    ];
    /// What errors expect of the value of a joint's name.
    pub(crate) const TAKES: &'static str =
        "a table with one of 'euler_deg', 'rotation', 'angle_deg' or 'offset'";

    /// `{ euler_deg = [..] }` and so on: one of them.
    pub(crate) fn read(value: &Value<'_>) -> Result<Self, Error> {
        let table = value.table()?;
        table.only(&Self::KEYS)?;
        match Self::KEYS.map(|key| table.get(&key)) {
            [Some(angles), None, None, None] => Ok(Self::EulerDeg(angles.numbers()?)),
            [None, Some(rotation), None, None] => Ok(Self::Rotation(rotation.numbers()?)),
            [None, None, Some(angle), None] => Ok(Self::AngleDeg(angle.number()?)),
            [None, None, None, Some(offset)] => Ok(Self::Offset(offset.number()?)),
            _ => {
                let found = table.present(&Self::KEYS).replace("neither", "no value");
                let expected = "one of 'euler_deg', 'rotation', 'angle_deg' or 'offset'";
                Err(table.error(ErrorKind::Alternatives { place: table.place(), found, expected }))
            }
        }
    }

    fn key(&self) -> &'static str {
        match self {
            Self::EulerDeg(_) => "euler_deg",
            Self::Rotation(_) => "rotation",
            Self::AngleDeg(_) => "angle_deg",
            Self::Offset(_) => "offset",
        }
    }

    /// The joint's own motion, as that joint can take it. `at` is the table that has the key.
    pub(crate) fn angles(&self, rig: &Rig, joint: JointId, at: &At<'_>) -> Result<JointAngles, Error> {
        let at = at.key(self.key());
        let data = rig.get(joint);
        let follows = data.is_some_and(|j| j.mimic.is_some());
        let motion = data.map_or(JointMotion::Fixed, |j| j.motion);
        let radians = |degrees: [f64; 3]| degrees.map(f64::to_radians);
        let expected = match (&motion, *self) {
            _ if follows => "nothing, since it follows another joint",
            (JointMotion::Ball { .. } | JointMotion::Free { .. }, Self::EulerDeg(degrees)) => {
                return Ok(JointAngles::Rotation(EulerOrder::Zyx.quaternion(radians(degrees))));
            }
            (JointMotion::Ball { .. } | JointMotion::Free { .. }, Self::Rotation(numbers)) => {
                return Ok(JointAngles::Rotation(quaternion(numbers, &at)?));
            }
            (JointMotion::Euler { .. }, Self::EulerDeg(degrees)) => {
                return Ok(JointAngles::Euler(radians(degrees).map(Some)));
            }
            (JointMotion::Euler { order, ranges }, Self::Rotation(numbers)) => {
                let angles = angles_inside(*order, ranges, quaternion(numbers, &at)?);
                return Ok(JointAngles::Euler(angles.map(Some)));
            }
            (JointMotion::Hinge { .. }, Self::AngleDeg(degrees)) => {
                return Ok(JointAngles::Value(degrees.to_radians()));
            }
            (JointMotion::Slider { .. }, Self::Offset(metres)) => return Ok(JointAngles::Value(metres)),
            (JointMotion::Ball { .. } | JointMotion::Free { .. } | JointMotion::Euler { .. }, _) => {
                "'euler_deg' or 'rotation'"
            }
            (JointMotion::Hinge { .. }, _) => "'angle_deg'",
            (JointMotion::Slider { .. }, _) => "'offset'",
            (JointMotion::Fixed, _) => "nothing, since it does not move",
        };
        let reason =
            format!("is {} and cannot take '{}': expected {expected}", with_article(&motion), self.key());
        Err(at.key_error(ErrorKind::Unfit { joint: name_of(rig, joint).to_owned(), reason }))
    }
}

/// Of the two sets of angles that give a rotation, the one that lies nearer to its ranges.
fn angles_inside(order: EulerOrder, ranges: &[Range; 3], q: DQuat) -> [f64; 3] {
    use std::f64::consts::PI;
    let [_, middle, _] = order.axes();
    let first = order.angles(q);
    let mut second = first;
    for (axis, angle) in second.iter_mut().enumerate() {
        *angle = if axis == middle { PI.copysign(*angle) - *angle } else { *angle - PI.copysign(*angle) };
    }
    let outside = |a: &[f64; 3]| ranges.iter().zip(a).map(|(r, a)| r.distance(*a)).sum::<f64>();
    if outside(&second) < outside(&first) { second } else { first }
}

// What is left out of a text where that is the default. A zero with a sign is written: no bit of the data is lost.

pub(crate) fn is_zero(vector: &[f64; 3]) -> bool {
    vector.iter().all(is_plain_zero)
}

pub(crate) fn is_plain_zero(number: &f64) -> bool {
    number.to_bits() == 0
}

pub(crate) fn is_true(truth: &bool) -> bool {
    *truth
}

pub(crate) fn is_false(truth: &bool) -> bool {
    !*truth
}

/// Entries by name, in their order, as a table.
pub(crate) fn as_table<T: Serialize, S: Serializer>(
    entries: &[(String, T)],
    serializer: S,
) -> Result<S::Ok, S::Error> {
    serializer.collect_map(entries.iter().map(|(name, value)| (name, value)))
}
