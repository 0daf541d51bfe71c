//! `position`: a point of a joint at a point of the world.

use glam::DVec3;
use ikiru_rig::Rig;
use ikiru_solve::objectives::Position;
use serde::Serialize;
use serde_json::{Value as Json, json};

use crate::at::At;
use crate::axes::Axes;
use crate::error::Error;
use crate::key::{JOINT, Key};
use crate::keys::{PATH, POINT, TARGET, TOLERANCE, TargetKeys, is_zero};
use crate::kind_keys::{Aim, Built, KindKeys, point, vector_text};
use crate::scene::Scene;
use crate::table::Table;

/// The keys of a `position`.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct PositionKeys {
    /// The joint, by name or humanoid role.
    pub joint: String,
    /// The point in the joint's frame, metres; its origin by default.
    #[serde(skip_serializing_if = "is_zero")]
    pub point: [f64; 3],
    /// Where it should be: `target` or `path`.
    #[serde(flatten)]
    pub target: TargetKeys,
}

impl KindKeys for PositionKeys {
    const NAME: &'static str = "position";
    const ABOUT: &'static str = "A point of a joint at a point of the world.";
    const KEYS: &'static [Key] = &[JOINT, POINT, TARGET.one_of(), PATH.one_of(), TOLERANCE];
    const EXAMPLE: &'static str = "\
kind = \"position\"
joint = \"leftHand\"
target = [0.35, 1.1, 0.35]
";
    type Objective = Position;

    fn read(table: &Table<'_>) -> Result<Self, Error> {
        let joint = table.require(&JOINT)?.name()?;
        let target = TargetKeys::read_if_there(table)?.ok_or_else(|| table.lacks(&TARGET))?;
        Ok(Self { joint, point: point(table)?, target })
    }

    fn build(&self, scene: &Scene<'_>, at: &At<'_>) -> Result<Built<Position>, Error> {
        let joint = scene.joint(&self.joint, at, "joint")?;
        let (target, path) = self.target.point(scene, at)?;
        let objective = Position { joint, point: DVec3::from_array(self.point), target };
        Ok(Built { path, ..Built::new(joint, objective) })
    }

    fn turn(objective: &mut Position, axes: Axes) {
        objective.target = axes.vector(objective.target);
    }

    fn aim(objective: &mut Position, aim: Aim) -> bool {
        match aim {
            Aim::Point(point) => objective.target = point,
            Aim::Rotation(_) => return false,
        }
        true
    }

    fn target_json(objective: &Position, _: &Rig) -> Json {
        json!(objective.target.to_array())
    }

    fn target_text(objective: &Position, number: &dyn Fn(f64) -> String) -> String {
        vector_text(objective.target, number)
    }
}
