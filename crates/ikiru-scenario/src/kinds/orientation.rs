//! `orientation`: how a joint is turned in the world.

use ikiru_rig::Rig;
use ikiru_solve::objectives::Orientation;
use serde::Serialize;
use serde_json::{Value as Json, json};

use crate::at::At;
use crate::axes::Axes;
use crate::error::Error;
use crate::key::{JOINT, Key};
use crate::keys::{EULER_DEG, RotationKeys, TARGET_ROTATION, TOLERANCE_DEG};
use crate::kind_keys::{Aim, Built, KindKeys};
use crate::scene::Scene;
use crate::table::Table;

/// The keys of an `orientation`.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct OrientationKeys {
    /// The joint, by name or humanoid role.
    pub joint: String,
    /// How its frame should be turned in the world: `target_rotation` or `euler_deg`.
    #[serde(flatten)]
    pub rotation: RotationKeys,
}

impl KindKeys for OrientationKeys {
    const NAME: &'static str = "orientation";
    const ABOUT: &'static str =
        "How a joint is turned in the world: its whole rotation there, not that on top of rest.";
    const KEYS: &'static [Key] = &[JOINT, TARGET_ROTATION, EULER_DEG, TOLERANCE_DEG];
    const EXAMPLE: &'static str = "\
kind = \"orientation\"
joint = \"head\"
euler_deg = [0, 30, 0]
";
    type Objective = Orientation;

    fn read(table: &Table<'_>) -> Result<Self, Error> {
        let joint = table.require(&JOINT)?.name()?;
        Ok(Self { joint, rotation: RotationKeys::read(table)? })
    }

    fn build(&self, scene: &Scene<'_>, at: &At<'_>) -> Result<Built<Orientation>, Error> {
        let joint = scene.joint(&self.joint, at, "joint")?;
        Ok(Built::new(joint, Orientation { joint, target: self.rotation.quaternion(at)? }))
    }

    fn turn(objective: &mut Orientation, axes: Axes) {
        objective.target = axes.rotation(objective.target);
    }

    fn aim(objective: &mut Orientation, aim: Aim) -> bool {
        match aim {
            Aim::Rotation(rotation) => objective.target = rotation,
            Aim::Point(_) => return false,
        }
        true
    }

    fn target_json(objective: &Orientation, _: &Rig) -> Json {
        json!(objective.target.to_array())
    }

    fn target_text(_: &Orientation, _: &dyn Fn(f64) -> String) -> String {
        "a rotation".to_owned()
    }
}
