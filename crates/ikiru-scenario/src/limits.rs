//! `[limits.NAME]` and `root`, as data; and with them the rig of the file, with its roles → the rig of the scenario.

use std::f64::consts::PI;

use ikiru_rig::{Cone, ConeCentre, EulerOrder, JointId, JointMotion, Range, Rig, RigBuilder, RigError};
use serde::Serialize;

use crate::at::At;
use crate::error::{Error, ErrorKind};
use crate::key::Key;
use crate::table::Table;
use crate::values::{direction, joint_of_key, name_of, number_that, quaternion, with_article};

/// The keys of ranges, which make an Euler joint.
pub(crate) const RANGES: [Key; 2] = [
    Key::new("min_deg", "three angles in degrees, [x, y, z]", "The least angles of `Rz·Ry·Rx`."),
    Key::new("max_deg", "three angles in degrees, [x, y, z]", "The largest."),
];
/// The keys of a cone, which make a ball.
pub(crate) const CONE: [Key; 5] = [
    Key::new(
        "axis",
        "the twist's axis in the joint's frame, [x, y, z]",
        "What the joint twists about; of any length but 0.",
    ),
    Key::new(
        "swing_deg",
        "two half-widths in degrees, [first, second]",
        "How far the axis may tilt either way, 0 to 180: the edge is an ellipse.",
    ),
    Key::new(
        "twist_deg",
        "two angles in degrees, [min, max]",
        "How far it may turn about the axis, -180 to 180.",
    )
    .or("[-180, 180]"),
    Key::new(
        "parent_rotation",
        "a quaternion, [x, y, z, w]",
        "P of another centre than the rest pose, of any length but 0.",
    )
    .or_as("the identity beside the other, else the rest pose"),
    Key::new("joint_rotation", "a quaternion, [x, y, z, w]", "K of that centre, of any length but 0.")
        .or_as("the same"),
];
const KEYS: [Key; 7] = [RANGES[0], RANGES[1], CONE[0], CONE[1], CONE[2], CONE[3], CONE[4]];

/// How far a joint may turn, which says how it moves: `[limits.NAME]`.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
#[serde(untagged)]
#[non_exhaustive]
pub enum LimitKeys {
    /// Ranges of three angles: an Euler joint.
    Ranges {
        /// `min_deg`: the least angles about x, y and z of `Rz·Ry·Rx`, degrees.
        min_deg: [f64; 3],
        /// `max_deg`: the largest.
        max_deg: [f64; 3],
    },
    /// A cone: a ball.
    Cone(ConeKeys),
}

/// The limits of a ball.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct ConeKeys {
    /// The twist's axis in the joint's frame, of any length but 0.
    pub axis: [f64; 3],
    /// Half-widths of the swing, degrees from 0 to 180.
    pub swing_deg: [f64; 2],
    /// Range of the twist, degrees from -180 to 180; left out, any.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub twist_deg: Option<[f64; 2]>,
    /// P of another centre than the rest pose: a quaternion (x, y, z, w) of any length but 0. The limit is then one of
    /// `P⁻¹ · (rest · q) · K`, with `rest · q` the joint's rotation in its parent. Left out beside the other, the identity.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub parent_rotation: Option<[f64; 4]>,
    /// K of another centre than the rest pose, in the same way.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub joint_rotation: Option<[f64; 4]>,
}

impl LimitKeys {
    pub(crate) fn read(table: &Table<'_>) -> Result<Self, Error> {
        table.only(&KEYS)?;
        let has = |keys: &[Key]| keys.iter().any(|key| table.get(key).is_some());
        let [min_deg, max_deg] = &RANGES;
        let [axis, swing_deg, twist_deg, parent_rotation, joint_rotation] = &CONE;
        let rotation = |key| table.get(key).map(|value| value.numbers()).transpose();
        match (has(&RANGES), has(&CONE)) {
            (true, false) => Ok(Self::Ranges {
                min_deg: table.require(min_deg)?.numbers()?,
                max_deg: table.require(max_deg)?.numbers()?,
            }),
            (false, true) => Ok(Self::Cone(ConeKeys {
                axis: table.require(axis)?.numbers()?,
                swing_deg: table.require(swing_deg)?.numbers()?,
                twist_deg: table.get(twist_deg).map(|ends| ends.numbers()).transpose()?,
                parent_rotation: rotation(parent_rotation)?,
                joint_rotation: rotation(joint_rotation)?,
            })),
            (is_both, _) => {
                let expected = "either 'min_deg' and 'max_deg' (ranges of the angles x, y, z), \
                                or 'axis' and 'swing_deg' (a cone)";
                let found = if is_both { table.present(&KEYS) } else { "no limits".to_owned() };
                Err(table.error(ErrorKind::Alternatives { place: table.place(), found, expected }))
            }
        }
    }

    /// The motion of a joint under them.
    fn motion(&self, rig: &Rig, joint: JointId, at: &At<'_>) -> Result<JointMotion, Error> {
        let old = rig.get(joint).map_or(JointMotion::Fixed, |j| j.motion);
        if let JointMotion::Hinge { .. } | JointMotion::Slider { .. } = old {
            let reason = format!(
                "is {} of the file's own: expected limits of balls and Euler joints only",
                with_article(&old)
            );
            return Err(at.key_error(ErrorKind::Unfit { joint: name_of(rig, joint).to_owned(), reason }));
        }
        match self {
            Self::Ranges { min_deg, max_deg } => {
                let axes = ["angle about x", "angle about y", "angle about z"];
                for ((what, min), max) in axes.into_iter().zip(*min_deg).zip(*max_deg) {
                    if min > max {
                        return Err(at.key("max_deg").error(ErrorKind::Order { what, min, max }));
                    }
                }
                let ranges = [0, 1, 2].map(|axis| Range::degrees(min_deg[axis], max_deg[axis]));
                Ok(JointMotion::Euler { order: EulerOrder::Zyx, ranges })
            }
            Self::Cone(keys) => {
                let cone = Some(keys.cone(at)?);
                Ok(if let JointMotion::Free { .. } = old {
                    JointMotion::Free { cone }
                } else {
                    JointMotion::Ball { cone }
                })
            }
        }
    }
}

impl ConeKeys {
    fn cone(&self, at: &At<'_>) -> Result<Cone, Error> {
        let axis = direction(self.axis, &at.key("axis"))?;
        let mut swing = [0.0; 2];
        for (idx, width) in self.swing_deg.into_iter().enumerate() {
            let inside = |n: f64| (0.0..=180.0).contains(&n);
            let at_width = at.key("swing_deg").entry(idx);
            let width = number_that(width, &at_width, inside, "a half-width from 0 to 180 degrees")?;
            swing[idx] = width.to_radians().min(PI);
        }
        let mut twist = Range::new(-PI, PI);
        if let Some(ends) = self.twist_deg {
            let at = at.key("twist_deg");
            for (idx, end) in ends.into_iter().enumerate() {
                let inside = |n: f64| n.abs() <= 180.0;
                number_that(end, &at.entry(idx), inside, "an angle from -180 to 180 degrees")?;
            }
            let [min, max] = ends;
            if min > max {
                return Err(at.error(ErrorKind::Order { what: "twist", min, max }));
            }
            twist = Range::new(min.to_radians().max(-PI), max.to_radians().min(PI));
        }
        let cone = Cone::new(axis, swing, twist);
        let cone = match self.centre(at)? {
            None => cone,
            Some(centre) => cone.and_then(|cone| cone.with_centre(centre)),
        };
        cone.map_err(|e| at.error(ErrorKind::Cone(e)))
    }

    /// The centre, where there is one: of two rotations, the one left out is the identity.
    fn centre(&self, at: &At<'_>) -> Result<Option<ConeCentre>, Error> {
        let rotation = |numbers: Option<[f64; 4]>, key| {
            numbers.map(|numbers| quaternion(numbers, &at.key(key))).transpose()
        };
        let parent = rotation(self.parent_rotation, "parent_rotation")?;
        let joint = rotation(self.joint_rotation, "joint_rotation")?;
        Ok((parent.is_some() || joint.is_some()).then(|| ConeCentre {
            parent_rotation: parent.unwrap_or_default(),
            joint_rotation: joint.unwrap_or_default(),
        }))
    }
}

/// A joint with limits of the scenario's own, and where they stand.
type Limited<'a> = (JointId, At<'a>);

/// The rig with a scenario's limits, its root free where that is asked for; and the joints that it limits.
pub(crate) fn limited(
    rig: &Rig,
    limits: &[(String, LimitKeys)],
    free_root: bool,
    scenario: &At<'_>,
) -> Result<(Rig, Vec<JointId>), Error> {
    let at = scenario.key("limits");
    let mut builder = rig.to_builder();
    let mut seen: Vec<(Limited<'_>, &str)> = Vec::new();
    for (name, keys) in limits {
        let at = at.key(name);
        let joint = joint_of_key(rig, name, &at)?;
        if let Some((_, first)) = seen.iter().find(|((other, _), _)| *other == joint) {
            let (place, first, second) = ("[limits]".to_owned(), (*first).to_owned(), name.clone());
            return Err(at.key_error(ErrorKind::Twice { place, first, second }));
        }
        let motion = keys.motion(rig, joint, &at)?;
        builder.set_motion(joint, motion).map_err(|e| at.error(ErrorKind::Limits(e.into())))?;
        seen.push(((joint, at), name));
    }
    let seen: Vec<Limited<'_>> = seen.into_iter().map(|(limited, _)| limited).collect();
    if free_root {
        float_root(&mut builder, &scenario.key("root"), &seen)?;
    }
    let built = if free_root || !seen.is_empty() {
        builder.build().map_err(|e| at.error(ErrorKind::Limits(e)))?
    } else {
        rig.clone()
    };
    Ok((built, seen.into_iter().map(|(joint, _)| joint).collect()))
}

/// Lets the root of the body float, unless limits of its own or of joints above it forbid that.
fn float_root(builder: &mut RigBuilder, root: &At<'_>, limits: &[Limited<'_>]) -> Result<(), Error> {
    let given = |joint: usize| limits.iter().find(|(id, _)| id.index() == joint).map(|(_, at)| at);
    let before = builder.clone();
    let named = |name: &str| before.joints().iter().position(|joint| joint.name == name);
    let floating = match builder.free_root() {
        Ok(floating) => floating,
        Err(RigError::NoRoot) => return Err(root.error(ErrorKind::NothingMoves)),
        Err(RigError::CannotFloat { joint, motion: "euler" }) => {
            let Some(at) = named(&joint).and_then(given) else {
                return Err(root.error(ErrorKind::Root(RigError::CannotFloat { joint, motion: "euler" })));
            };
            let reason = "is the free root, which angle ranges cannot limit: expected a cone, \
                          'axis', 'swing_deg' and 'twist_deg', or no limits";
            return Err(at.key_error(ErrorKind::Unfit { joint, reason: reason.to_owned() }));
        }
        Err(error) => return Err(root.error(ErrorKind::Root(error))),
    };
    let fixed = |(id, _): &&Limited<'_>| builder.joints()[id.index()].motion == JointMotion::Fixed;
    if let Some((id, at)) = limits.iter().find(fixed) {
        let joint = before.joints()[id.index()].name.clone();
        let floating = &before.joints()[floating.index()].name;
        let reason = format!(
            "lies above the free root, '{floating}', and stays where it is: expected no limits for it"
        );
        return Err(at.key_error(ErrorKind::Unfit { joint, reason }));
    }
    Ok(())
}
