//! `[limits.NAME]` and `root`: the rig of the file, with its roles → the rig of the scenario.

use std::f64::consts::PI;

use ikiru_rig::{Cone, ConeCentre, EulerOrder, JointId, JointMotion, Range, Rig, RigBuilder, RigError};

use crate::error::{Error, ErrorKind};
use crate::table::{Table, Value};
use crate::values::{direction, joint_of_key, name_of, quaternion, with_article};

const EULER: [&str; 2] = ["min_deg", "max_deg"];
const CENTRE: [&str; 2] = ["parent_rotation", "joint_rotation"];
const CONE: [&str; 5] = ["axis", "swing_deg", "twist_deg", CENTRE[0], CENTRE[1]];
const KEYS: [&str; 7] = [EULER[0], EULER[1], CONE[0], CONE[1], CONE[2], CONE[3], CONE[4]];

/// The rig with the scenario's limits, its root free where the scenario says so; and the joints that it limits.
pub(crate) fn limited(rig: &Rig, scenario: &Table<'_>) -> Result<(Rig, Vec<JointId>), Error> {
    let mut builder = rig.to_builder();
    let mut seen: Vec<(JointId, Value<'_>)> = Vec::new();
    let limits = scenario.table("limits")?;
    for value in limits.iter().flat_map(Table::entries) {
        let joint = joint_of_key(rig, &value.key, value.at())?;
        if let Some((_, first)) = seen.iter().find(|(other, _)| *other == joint) {
            let (place, first, second) = ("[limits]".to_owned(), first.key.clone(), value.key.clone());
            return Err(value.key_error(ErrorKind::Twice { place, first, second }));
        }
        builder.set_motion(joint, motion(rig, joint, &value)?);
        seen.push((joint, value));
    }
    if let Some(root) = scenario.get("root") {
        root.word("root", &["free"])?;
        free_root(&mut builder, &root, &seen)?;
    }
    let is_changed = !seen.is_empty() || scenario.get("root").is_some();
    let built =
        if is_changed { builder.build().map_err(|e| place_of(e, scenario, &limits))? } else { rig.clone() };
    Ok((built, seen.into_iter().map(|(joint, _)| joint).collect()))
}

/// Lets the root of the body float, unless limits of its own or of joints above it forbid that.
fn free_root(
    builder: &mut RigBuilder,
    root: &Value<'_>,
    limits: &[(JointId, Value<'_>)],
) -> Result<(), Error> {
    let given = |joint: usize| limits.iter().find(|(id, _)| id.index() == joint).map(|(_, value)| value);
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
    let fixed = |(id, _): &&(JointId, Value<'_>)| builder.joints()[id.index()].motion == JointMotion::Fixed;
    if let Some((id, value)) = limits.iter().find(fixed) {
        let joint = before.joints()[id.index()].name.clone();
        let floating = &before.joints()[floating.index()].name;
        let reason = format!(
            "lies above the free root, '{floating}', and stays where it is: expected no limits for it"
        );
        return Err(value.key_error(ErrorKind::Unfit { joint, reason }));
    }
    Ok(())
}

fn place_of(error: RigError, scenario: &Table<'_>, limits: &Option<Table<'_>>) -> Error {
    limits.as_ref().unwrap_or(scenario).error(ErrorKind::Limits(error))
}

/// The motion of one joint under its limits.
fn motion(rig: &Rig, joint: JointId, value: &Value<'_>) -> Result<JointMotion, Error> {
    let table = value.table()?;
    table.only(&KEYS)?;
    let old = rig.get(joint).map_or(JointMotion::Fixed, |j| j.motion);
    if let JointMotion::Hinge { .. } | JointMotion::Slider { .. } = old {
        let reason = format!(
            "is {} of the file's own: expected limits of balls and Euler joints only",
            with_article(&old)
        );
        return Err(value.key_error(ErrorKind::Unfit { joint: name_of(rig, joint).to_owned(), reason }));
    }
    let has = |keys: &[&str]| keys.iter().any(|key| table.get(key).is_some());
    match (has(&EULER), has(&CONE)) {
        (true, false) => euler(&table),
        (false, true) => {
            let cone = Some(cone(&table)?);
            Ok(if let JointMotion::Free { .. } = old {
                JointMotion::Free { cone }
            } else {
                JointMotion::Ball { cone }
            })
        }
        (is_both, _) => {
            let expected = "either 'min_deg' and 'max_deg' (ranges of the angles x, y, z), \
                            or 'axis' and 'swing_deg' (a cone)";
            let found = if is_both { table.present(&KEYS) } else { "no limits".to_owned() };
            Err(table.error(ErrorKind::Alternatives { place: table.place(), found, expected }))
        }
    }
}

fn euler(table: &Table<'_>) -> Result<JointMotion, Error> {
    const EXPECTED: &str = "three angles in degrees, [x, y, z]";
    let min = table.require("min_deg", EXPECTED)?.numbers::<3>(EXPECTED)?;
    let largest = table.require("max_deg", EXPECTED)?;
    let max = largest.numbers::<3>(EXPECTED)?;
    for (axis, what) in ["angle about x", "angle about y", "angle about z"].into_iter().enumerate() {
        if min[axis] > max[axis] {
            return Err(largest.error(ErrorKind::Order { what, min: min[axis], max: max[axis] }));
        }
    }
    let ranges = [0, 1, 2].map(|axis| Range::degrees(min[axis], max[axis]));
    Ok(JointMotion::Euler { order: EulerOrder::Zyx, ranges })
}

fn cone(table: &Table<'_>) -> Result<Cone, Error> {
    let axis = table.require("axis", "the twist's axis in the joint's frame, [x, y, z]")?;
    let axis = direction(axis.vector()?, axis.at())?;
    let widths = table.require("swing_deg", "two half-widths in degrees, [first, second]")?;
    let mut swing = [0.0; 2];
    for (slot, width) in swing.iter_mut().zip(of_two(&widths, "two half-widths in degrees, [first, second]")?)
    {
        let inside = |n: f64| (0.0..=180.0).contains(&n);
        *slot = width.number_that(inside, "a half-width from 0 to 180 degrees")?.to_radians().min(PI);
    }
    let mut twist = Range::new(-PI, PI);
    if let Some(ends) = table.get("twist_deg") {
        let mut degrees = [0.0; 2];
        for (slot, end) in degrees.iter_mut().zip(of_two(&ends, "two angles in degrees, [min, max]")?) {
            *slot = end.number_that(|n| n.abs() <= 180.0, "an angle from -180 to 180 degrees")?;
        }
        let [min, max] = degrees;
        if min > max {
            return Err(ends.error(ErrorKind::Order { what: "twist", min, max }));
        }
        twist = Range::new(min.to_radians().max(-PI), max.to_radians().min(PI));
    }
    let cone = Cone::new(axis, swing, twist);
    let cone = match centre(table)? {
        None => cone,
        Some(centre) => cone.and_then(|cone| cone.with_centre(centre)),
    };
    cone.map_err(|e| table.error(ErrorKind::Cone(e)))
}

/// The centre of a cone, where it has one: of two rotations, the one left out is the identity.
fn centre(table: &Table<'_>) -> Result<Option<ConeCentre>, Error> {
    let rotation = |value: Value<'_>| quaternion(value.numbers("a quaternion, [x, y, z, w]")?, value.at());
    let [parent, joint] = CENTRE.map(|key| table.get(key).map(rotation).transpose());
    let (parent, joint) = (parent?, joint?);
    Ok((parent.is_some() || joint.is_some()).then(|| ConeCentre {
        parent_rotation: parent.unwrap_or_default(),
        joint_rotation: joint.unwrap_or_default(),
    }))
}

/// The two entries of a list, each with its own place.
fn of_two<'a>(value: &Value<'a>, expected: &'static str) -> Result<Vec<Value<'a>>, Error> {
    value.numbers::<2>(expected)?;
    value.list(expected)
}
