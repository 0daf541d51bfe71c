//! `pose`: position and orientation of a joint together.

use glam::DVec3;
use ikiru_rig::Rig;
use ikiru_solve::objectives::PoseTarget;
use serde::Serialize;
use serde_json::{Value as Json, json};

use crate::at::At;
use crate::axes::Axes;
use crate::error::Error;
use crate::key::{JOINT, Key};
use crate::keys::{
    EULER_DEG, POINT, RotationKeys, TARGET, TARGET_ROTATION, TOLERANCE, TOLERANCE_DEG, is_zero,
};
use crate::kind_keys::{Aim, Built, KindKeys, point, vector_text};
use crate::scene::Scene;
use crate::table::Table;

/// The keys of a `pose`.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct PoseKeys {
    /// The joint, by name or humanoid role.
    pub joint: String,
    /// The point in the joint's frame, metres; its origin by default.
    #[serde(skip_serializing_if = "is_zero")]
    pub point: [f64; 3],
    /// Where it should be: a point of the world, metres.
    pub target: [f64; 3],
    /// How the joint's frame should be turned in the world: `target_rotation` or `euler_deg`.
    #[serde(flatten)]
    pub rotation: RotationKeys,
}

impl KindKeys for PoseKeys {
    const NAME: &'static str = "pose";
    const ABOUT: &'static str = "`position` and `orientation` of a joint together.";
    const KEYS: &'static [Key] =
        &[JOINT, POINT, TARGET, TARGET_ROTATION, EULER_DEG, TOLERANCE, TOLERANCE_DEG];
    const EXAMPLE: &'static str = "\
kind = \"pose\"
joint = \"leftHand\"
target = [0.35, 1.1, 0.35]
euler_deg = [0, -60, 0]
";
    type Objective = PoseTarget;

    fn read(table: &Table<'_>) -> Result<Self, Error> {
        Ok(Self {
            joint: table.require(&JOINT)?.name()?,
            point: point(table)?,
            target: table.require(&TARGET)?.numbers()?,
            rotation: RotationKeys::read(table)?,
        })
    }

    fn build(&self, scene: &Scene<'_>, at: &At<'_>) -> Result<Built<PoseTarget>, Error> {
        let joint = scene.joint(&self.joint, at, "joint")?;
        let [point, position] = [self.point, self.target].map(DVec3::from_array);
        Ok(Built::new(joint, PoseTarget { joint, point, position, rotation: self.rotation.quaternion(at)? }))
    }

    fn turn(objective: &mut PoseTarget, axes: Axes) {
        objective.position = axes.vector(objective.position);
        objective.rotation = axes.rotation(objective.rotation);
    }

    fn aim(objective: &mut PoseTarget, aim: Aim) -> bool {
        match aim {
            Aim::Point(point) => objective.position = point,
            Aim::Rotation(rotation) => objective.rotation = rotation,
        }
        true
    }

    fn target_json(objective: &PoseTarget, _: &Rig) -> Json {
        json!(objective.position.to_array())
    }

    fn target_text(objective: &PoseTarget, number: &dyn Fn(f64) -> String) -> String {
        format!("{}, turned", vector_text(objective.position, number))
    }
}
