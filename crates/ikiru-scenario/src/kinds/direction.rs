//! `direction`: an axis of a joint along a direction of the world.

use ikiru_rig::Rig;
use ikiru_solve::objectives::Direction;
use serde::Serialize;
use serde_json::{Value as Json, json};

use crate::at::At;
use crate::axes::Axes;
use crate::error::Error;
use crate::key::{JOINT, Key};
use crate::keys::{AXIS, TOLERANCE_DEG};
use crate::kind_keys::{Aim, Built, KindKeys, vector_text};
use crate::scene::Scene;
use crate::table::Table;
use crate::values::direction;

/// The keys of a `direction`.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct DirectionKeys {
    /// The joint, by name or humanoid role.
    pub joint: String,
    /// What points: a direction in the joint's frame, of any length but 0.
    pub axis: [f64; 3],
    /// Where it should point: a direction of the world, of any length but 0.
    pub target: [f64; 3],
}

const DIRECTION: Key =
    Key::new("target", "a direction of the world, [x, y, z]", "Where it should point; of any length but 0.");

impl KindKeys for DirectionKeys {
    const NAME: &'static str = "direction";
    const ABOUT: &'static str =
        "An axis of a joint along a direction of the world: a palm that faces down, a back that is upright.";
    const KEYS: &'static [Key] = &[JOINT, AXIS, DIRECTION, TOLERANCE_DEG];
    const EXAMPLE: &'static str = "\
kind = \"direction\"
joint = \"leftHand\"
axis = [0, -1, 0]
target = [0, -1, 0]
";
    type Objective = Direction;

    fn read(table: &Table<'_>) -> Result<Self, Error> {
        Ok(Self {
            joint: table.require(&JOINT)?.name()?,
            axis: table.require(&AXIS)?.numbers()?,
            target: table.require(&DIRECTION)?.numbers()?,
        })
    }

    fn build(&self, scene: &Scene<'_>, at: &At<'_>) -> Result<Built<Direction>, Error> {
        let joint = scene.joint(&self.joint, at, "joint")?;
        let axis = direction(self.axis, &at.key("axis"))?;
        let target = direction(self.target, &at.key("target"))?;
        Ok(Built::new(joint, Direction { joint, axis, target }))
    }

    fn turn(objective: &mut Direction, axes: Axes) {
        objective.target = axes.vector(objective.target);
    }

    fn aim(objective: &mut Direction, aim: Aim) -> bool {
        match aim {
            Aim::Point(direction) => objective.target = direction,
            Aim::Rotation(_) => return false,
        }
        true
    }

    fn target_json(objective: &Direction, _: &Rig) -> Json {
        json!(objective.target.to_array())
    }

    fn target_text(objective: &Direction, number: &dyn Fn(f64) -> String) -> String {
        format!("along {}", vector_text(objective.target, number))
    }
}
