//! `look_at`: an axis of a joint towards a point.

use glam::DVec3;
use ikiru_rig::Rig;
use ikiru_solve::objectives::{Gaze, LookAt};
use serde::Serialize;
use serde_json::{Value as Json, json};

use crate::at::At;
use crate::axes::Axes;
use crate::error::Error;
use crate::key::{JOINT, Key};
use crate::keys::{AXIS, PATH, TARGET, TOLERANCE_DEG, TargetKeys};
use crate::kind_keys::{Aim, Built, KindKeys, vector_text};
use crate::scene::Scene;
use crate::table::Table;
use crate::values::direction;

/// The keys of a `look_at`.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct LookAtKeys {
    /// The joint, by name or humanoid role.
    pub joint: String,
    /// What looks: a direction in the joint's frame, of any length but 0.
    pub axis: [f64; 3],
    /// What it looks at.
    #[serde(flatten)]
    pub gaze: GazeKeys,
}

/// What a `look_at` looks at.
#[derive(Clone, Debug, PartialEq, Serialize)]
#[serde(untagged)]
#[non_exhaustive]
pub enum GazeKeys {
    /// `target` or `path`: a point of the world.
    At(TargetKeys),
    /// `length` and `offset_from_tip`: a point beside the bone's tip.
    BesideTip {
        /// The tip is at `axis · length`, metres.
        length: f64,
        /// From the tip, along the axes of the world, metres.
        offset_from_tip: [f64; 3],
    },
}

const KEYS: [Key; 4] = [
    TARGET.meaning("What it looks at.").one_of(),
    PATH.one_of(),
    Key::new("length", "metres", "With `offset_from_tip`: the bone's tip is at `axis · length`.").one_of(),
    Key::new(
        "offset_from_tip",
        "a way in metres along the axes of the world, [x, y, z]",
        "With `length`: it looks from the tip that way, as the paper's authors have it.",
    )
    .one_of(),
];

impl KindKeys for LookAtKeys {
    const NAME: &'static str = "look_at";
    const ABOUT: &'static str =
        "An axis of a joint towards a point: of the world, or beside the tip of the joint's own bone.";
    const KEYS: &'static [Key] = &[JOINT, AXIS, KEYS[0], KEYS[1], KEYS[2], KEYS[3], TOLERANCE_DEG];
    const EXAMPLE: &'static str = "\
kind = \"look_at\"
joint = \"head\"
axis = [0, 0, 1]
target = [0.5, 1.5, 1]
";
    type Objective = LookAt;

    fn read(table: &Table<'_>) -> Result<Self, Error> {
        let joint = table.require(&JOINT)?.name()?;
        let axis = table.require(&AXIS)?.numbers()?;
        let gaze = match KEYS.map(|key| table.get(&key)) {
            [None, None, Some(length), Some(offset)] => {
                GazeKeys::BesideTip { length: length.number()?, offset_from_tip: offset.numbers()? }
            }
            [_, _, None, None] => match TargetKeys::read_if_there(table)? {
                Some(target) => GazeKeys::At(target),
                None => return Err(no_gaze(table)),
            },
            _ => return Err(no_gaze(table)),
        };
        Ok(Self { joint, axis, gaze })
    }

    fn build(&self, scene: &Scene<'_>, at: &At<'_>) -> Result<Built<LookAt>, Error> {
        let joint = scene.joint(&self.joint, at, "joint")?;
        let axis = direction(self.axis, &at.key("axis"))?;
        let (gaze, path) = match &self.gaze {
            GazeKeys::At(target) => {
                let (point, path) = target.point(scene, at)?;
                (Gaze::Point(point), path)
            }
            GazeKeys::BesideTip { length, offset_from_tip } => {
                let offset = DVec3::from_array(*offset_from_tip);
                (Gaze::OffsetFromTip { length: *length, offset }, None)
            }
        };
        Ok(Built { path, ..Built::new(joint, LookAt { joint, axis, gaze }) })
    }

    fn turn(objective: &mut LookAt, axes: Axes) {
        match &mut objective.gaze {
            Gaze::Point(at) => *at = axes.vector(*at),
            Gaze::OffsetFromTip { offset, .. } => *offset = axes.vector(*offset),
        }
    }

    fn aim(objective: &mut LookAt, aim: Aim) -> bool {
        match aim {
            Aim::Point(point) => objective.gaze = Gaze::Point(point),
            Aim::Rotation(_) => return false,
        }
        true
    }

    fn target_json(objective: &LookAt, _: &Rig) -> Json {
        match objective.gaze {
            Gaze::Point(at) => json!(at.to_array()),
            Gaze::OffsetFromTip { length, offset } => {
                json!({ "length": length, "offset_from_tip": offset.to_array() })
            }
        }
    }

    fn target_text(objective: &LookAt, number: &dyn Fn(f64) -> String) -> String {
        match objective.gaze {
            Gaze::Point(point) => vector_text(point, number),
            Gaze::OffsetFromTip { offset, .. } => format!("tip + {}", vector_text(offset, number)),
        }
    }
}

fn no_gaze(table: &Table<'_>) -> Error {
    table.alternatives(
        &KEYS,
        "one of 'target' (a point of the world), 'path' (points at times), or 'length' and 'offset_from_tip' (a point beside the bone's tip)",
    )
}
