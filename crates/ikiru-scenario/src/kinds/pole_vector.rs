//! `pole_vector`: to which side a limb of two bones is bent.

use glam::DVec3;
use ikiru_rig::Rig;
use ikiru_solve::objectives::PoleVector;
use serde::Serialize;
use serde_json::{Value as Json, json};

use crate::at::At;
use crate::axes::Axes;
use crate::error::Error;
use crate::kinds::{Aim, Built, KindKeys, TARGET, vector_text};
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

impl KindKeys for PoleVectorKeys {
    const NAME: &'static str = "pole_vector";
    const KEYS: &'static [&'static str] = &["joints", "target", "tolerance_deg"];
    type Objective = PoleVector;

    fn read(table: &Table<'_>) -> Result<Self, Error> {
        const LIMB: &str = "three joints: root, middle and end of the limb";
        let joints = table.require("joints", LIMB)?.names(LIMB)?;
        Ok(Self { joints, target: table.require("target", TARGET)?.vector()? })
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
