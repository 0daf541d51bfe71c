//! `pole_vector`: to which side a limb of two bones is bent.

use glam::DVec3;
use ikiru_rig::Rig;
use ikiru_solve::objectives::PoleVector;
use serde::Serialize;
use serde_json::{Value as Json, json};

use crate::at::At;
use crate::axes::Axes;
use crate::error::Error;
use crate::key::Key;
use crate::keys::{TARGET, TOLERANCE_DEG};
use crate::kind_keys::{Aim, Built, KindKeys, vector_text};
use crate::scene::Scene;
use crate::table::Table;

/// The keys of a `pole_vector`.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct PoleVectorKeys {
    /// Root, middle and end of the limb, by name or humanoid role.
    pub joints: [String; 3],
    /// The point of the world to whose side the middle is bent, metres.
    pub target: [f64; 3],
}

const JOINTS: Key = Key::new(
    "joints",
    "three joints: root, middle and end of the limb",
    "By name or humanoid role, [NAME, NAME, NAME].",
);
const POLE: Key = TARGET.meaning("To whose side the middle is bent.");

impl KindKeys for PoleVectorKeys {
    const NAME: &'static str = "pole_vector";
    const ABOUT: &'static str = "To which side a limb of two bones is bent: elbow or knee lies in the half plane from the limb's line to the target.";
    const KEYS: &'static [Key] = &[JOINTS, POLE, TOLERANCE_DEG];
    const EXAMPLE: &'static str = "\
kind = \"pole_vector\"
joints = [\"leftUpperArm\", \"leftLowerArm\", \"leftHand\"]
target = [0.6, 0.5, -0.5]
";
    type Objective = PoleVector;

    fn read(table: &Table<'_>) -> Result<Self, Error> {
        let joints = table.require(&JOINTS)?.names()?;
        Ok(Self { joints, target: table.require(&POLE)?.numbers()? })
    }

    fn build(&self, scene: &Scene<'_>, at: &At<'_>) -> Result<Built<PoleVector>, Error> {
        let joints = scene.joints(&self.joints, at)?;
        Ok(Built::new(joints[1], PoleVector { joints, target: DVec3::from_array(self.target) }))
    }

    fn turn(objective: &mut PoleVector, axes: Axes) {
        objective.target = axes.vector(objective.target);
    }

    fn aim(objective: &mut PoleVector, aim: Aim) -> bool {
        match aim {
            Aim::Point(point) => objective.target = point,
            Aim::Rotation(_) => return false,
        }
        true
    }

    fn target_json(objective: &PoleVector, _: &Rig) -> Json {
        json!(objective.target.to_array())
    }

    fn target_text(objective: &PoleVector, number: &dyn Fn(f64) -> String) -> String {
        format!("bent to {}", vector_text(objective.target, number))
    }
}
