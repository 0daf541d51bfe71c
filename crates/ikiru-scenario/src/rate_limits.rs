//! Limits on speed and acceleration: those of `[motion]` for every active joint, and `[motion.limits.NAME]`.

use ikiru_rig::{JointId, Rate, RateLimit, RatePart, Rig};
use serde::Serialize;

use crate::at::At;
use crate::error::{Error, ErrorKind};
use crate::key::Key;
use crate::table::Table;
use crate::values::{joint_of_key, name_of, number_that, with_article};

/// The most that speeds and accelerations may be.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize)]
pub struct RateKeys {
    /// Of what turns, degrees a second.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub max_speed_deg: Option<f64>,
    /// Of what turns, degrees a second².
    #[serde(skip_serializing_if = "Option::is_none")]
    pub max_acceleration_deg: Option<f64>,
    /// Of what slides, metres a second.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub max_speed: Option<f64>,
    /// Of what slides, metres a second².
    #[serde(skip_serializing_if = "Option::is_none")]
    pub max_acceleration: Option<f64>,
}

/// The keys, and below what each limits.
pub(crate) const KEYS: [Key; 4] = [
    Key::new("max_speed_deg", "degrees a second, above 0", "Of what turns.").or_as("no limit"),
    Key::new("max_acceleration_deg", "degrees a second², above 0", "Of what turns.").or_as("no limit"),
    Key::new("max_speed", "metres a second, above 0", "Of what slides.").or_as("no limit"),
    Key::new("max_acceleration", "metres a second², above 0", "Of what slides.").or_as("no limit"),
];
const LIMITED: [(RatePart, Rate); 4] = [
    (RatePart::Rotation, Rate::Speed),
    (RatePart::Rotation, Rate::Acceleration),
    (RatePart::Translation, Rate::Speed),
    (RatePart::Translation, Rate::Acceleration),
];

impl RateKeys {
    pub(crate) fn read(table: &Table<'_>) -> Result<Self, Error> {
        let number = |key: Key| table.get(&key).map(|value| value.number()).transpose();
        let [speed_deg, acceleration_deg, speed, acceleration] = KEYS.map(number);
        Ok(Self {
            max_speed_deg: speed_deg?,
            max_acceleration_deg: acceleration_deg?,
            max_speed: speed?,
            max_acceleration: acceleration?,
        })
    }

    /// In the order of the keys, in radians and metres. `at` is the table that has them.
    fn limits(&self, at: &At<'_>) -> Result<[Option<f64>; 4], Error> {
        let mut limits =
            [self.max_speed_deg, self.max_acceleration_deg, self.max_speed, self.max_acceleration];
        for (idx, limit) in limits.iter_mut().enumerate() {
            if let Some(most) = limit {
                // What is too small to stay above 0 in radians is none either.
                let Key { name, takes, .. } = KEYS[idx];
                number_that(*most, &at.key(name), |n| n > 1e-300, takes)?;
                let (part, _) = LIMITED[idx];
                *limit = Some(if part == RatePart::Rotation { most.to_radians() } else { *most });
            }
        }
        Ok(limits)
    }
}

/// All limits of `[motion]`, which `active` joints obey; a joint's own take the place of those of all. `at` is the table
/// `[motion]`.
pub(crate) fn rate_limits(
    rig: &Rig,
    active: &[JointId],
    all: &RateKeys,
    by_joint: &[(String, RateKeys)],
    at: &At<'_>,
) -> Result<Vec<RateLimit>, Error> {
    let of_all = all.limits(at)?;
    let mut own: Vec<(JointId, &str, [Option<f64>; 4])> = Vec::new();
    for (name, keys) in by_joint {
        let at = at.key("limits").key(name);
        let joint = joint_of_key(rig, name, &at)?;
        if let Some((_, first, _)) = own.iter().find(|(other, _, _)| *other == joint) {
            let (place, first, second) = ("[motion.limits]".to_owned(), (*first).to_owned(), name.clone());
            return Err(at.key_error(ErrorKind::Twice { place, first, second }));
        }
        let unfit = |at: &At<'_>, reason: String| {
            at.key_error(ErrorKind::Unfit { joint: name_of(rig, joint).to_owned(), reason })
        };
        if rig.get(joint).is_some_and(|j| j.mimic.is_some()) {
            return Err(unfit(&at, "follows another joint: expected limits of its leader".to_owned()));
        }
        if !active.contains(&joint) {
            let reason = "is not active and does not move: expected a joint of 'active'".to_owned();
            return Err(unfit(&at, reason));
        }
        let limits = keys.limits(&at)?;
        for (idx, (part, _)) in LIMITED.iter().enumerate() {
            if limits[idx].is_some() && !part.is_of(rig, joint) {
                let motion = rig.get(joint).map(|j| with_article(&j.motion)).unwrap_or_default();
                let reason = format!("is {motion} and has no speed that '{}' could limit", KEYS[idx].name);
                return Err(unfit(&at.key(KEYS[idx].name), reason));
            }
        }
        own.push((joint, name, limits));
    }
    for (idx, (part, _)) in LIMITED.iter().enumerate() {
        if of_all[idx].is_some() && !active.iter().any(|j| part.is_of(rig, *j)) {
            let (place, found) = ("[motion]".to_owned(), format!("'{}'", KEYS[idx].name));
            let expected = if *part == RatePart::Rotation {
                "an active joint that turns, or limits in metres, 'max_speed' and 'max_acceleration'"
            } else {
                "an active joint that slides, or limits in degrees, 'max_speed_deg' and 'max_acceleration_deg'"
            };
            return Err(at.key(KEYS[idx].name).key_error(ErrorKind::Alternatives { place, found, expected }));
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
