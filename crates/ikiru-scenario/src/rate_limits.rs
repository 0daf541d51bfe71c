//! Limits on speed and acceleration: those of `[motion]` for every active joint, and `[motion.limits.NAME]`.

use ikiru_rig::{JointId, Rate, RateLimit, RatePart, Rig};

use crate::error::{Error, ErrorKind};
use crate::table::{Table, Value};
use crate::values::{joint_of_key, name_of, with_article};

/// The keys, what they limit, and whether in degrees.
pub(crate) const KEYS: [&str; 4] = ["max_speed_deg", "max_acceleration_deg", "max_speed", "max_acceleration"];
const LIMITED: [(RatePart, Rate); 4] = [
    (RatePart::Rotation, Rate::Speed),
    (RatePart::Rotation, Rate::Acceleration),
    (RatePart::Translation, Rate::Speed),
    (RatePart::Translation, Rate::Acceleration),
];

/// Reads all limits of `[motion]`, which `active` joints obey; a joint's own take the place of those of all.
pub(crate) fn read(rig: &Rig, active: &[JointId], motion: &Table<'_>) -> Result<Vec<RateLimit>, Error> {
    let of_all = four(motion)?;
    let mut own: Vec<(JointId, Value<'_>, [Option<f64>; 4])> = Vec::new();
    for value in motion.table("limits")?.iter().flat_map(Table::entries) {
        let joint = joint_of_key(rig, &value.key, value.at())?;
        if let Some((_, first, _)) = own.iter().find(|(other, _, _)| *other == joint) {
            let (place, first, second) = ("[motion.limits]".to_owned(), first.key.clone(), value.key.clone());
            return Err(value.key_error(ErrorKind::Twice { place, first, second }));
        }
        let unfit = |at: &Value<'_>, reason: String| {
            at.key_error(ErrorKind::Unfit { joint: name_of(rig, joint).to_owned(), reason })
        };
        if rig.get(joint).is_some_and(|j| j.mimic.is_some()) {
            return Err(unfit(&value, "follows another joint: expected limits of its leader".to_owned()));
        }
        if !active.contains(&joint) {
            let reason = "is not active and does not move: expected a joint of 'active'".to_owned();
            return Err(unfit(&value, reason));
        }
        let table = value.table()?;
        table.only(&KEYS)?;
        let limits = four(&table)?;
        for (idx, (part, _)) in LIMITED.iter().enumerate() {
            if limits[idx].is_some() && !part.is_of(rig, joint) {
                let motion = rig.get(joint).map(|j| with_article(&j.motion)).unwrap_or_default();
                let reason = format!("is {motion} and has no speed that '{}' could limit", KEYS[idx]);
                let at = table.get(KEYS[idx]);
                return Err(unfit(at.as_ref().unwrap_or(&value), reason));
            }
        }
        own.push((joint, value, limits));
    }
    for (idx, (part, _)) in LIMITED.iter().enumerate() {
        if let (Some(value), false) = (motion.get(KEYS[idx]), active.iter().any(|j| part.is_of(rig, *j))) {
            let (place, found) = ("[motion]".to_owned(), format!("'{}'", KEYS[idx]));
            let expected = if *part == RatePart::Rotation {
                "an active joint that turns, or limits in metres, 'max_speed' and 'max_acceleration'"
            } else {
                "an active joint that slides, or limits in degrees, 'max_speed_deg' and 'max_acceleration_deg'"
            };
            return Err(value.key_error(ErrorKind::Alternatives { place, found, expected }));
        }
    }
    let mut limits = Vec::new();
    for joint in active {
        let of_joint = own.iter().find(|(other, _, _)| other == joint).map(|(_, _, limits)| limits);
        for (idx, (part, rate)) in LIMITED.into_iter().enumerate() {
            let most = of_joint.and_then(|limits| limits[idx]).or(of_all[idx]);
            if let (Some(most), true) = (most, part.is_of(rig, *joint)) {
                limits.push(RateLimit { joint: *joint, part, rate, most });
            }
        }
    }
    Ok(limits)
}

/// The four limits of a table, in radians and metres.
fn four(table: &Table<'_>) -> Result<[Option<f64>; 4], Error> {
    const EXPECTED: [&str; 4] = [
        "degrees a second, above 0",
        "degrees a second², above 0",
        "metres a second, above 0",
        "metres a second², above 0",
    ];
    let mut limits = [None; 4];
    for (idx, limit) in limits.iter_mut().enumerate() {
        if let Some(value) = table.get(KEYS[idx]) {
            // What is too small to stay above 0 in radians is none either.
            let most = value.number_that(|n| n > 1e-300, EXPECTED[idx])?;
            let (part, _) = LIMITED[idx];
            *limit = Some(if part == RatePart::Rotation { most.to_radians() } else { most });
        }
    }
    Ok(limits)
}
