//! `relative_pose`: how one joint's frame lies in another's.

use glam::DVec3;
use ikiru_rig::Rig;
use ikiru_solve::objectives::RelativePose;
use serde::Serialize;
use serde_json::{Value as Json, json};

use crate::at::At;
use crate::axes::Axes;
use crate::error::{Error, ErrorKind};
use crate::keys::RotationKeys;
use crate::kinds::{Aim, Built, JOINT, KindKeys};
use crate::scene::Scene;
use crate::table::Table;

/// The keys of a `relative_pose`: a position, a rotation, or both.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct RelativePoseKeys {
    /// The joint to hold, by name or humanoid role.
    pub joint: String,
    /// The joint from whose frame it is seen.
    pub base: String,
    /// Where the joint's origin should be in the base's frame, metres.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub position: Option<[f64; 3]>,
    /// How its frame should be turned in the base's: `target_rotation` or `euler_deg`.
    #[serde(flatten)]
    pub rotation: Option<RotationKeys>,
}

impl KindKeys for RelativePoseKeys {
    const NAME: &'static str = "relative_pose";
    const KEYS: &'static [&'static str] =
        &["joint", "base", "position", "target_rotation", "euler_deg", "tolerance", "tolerance_deg"];
    type Objective = RelativePose;

    fn read(table: &Table<'_>) -> Result<Self, Error> {
        Ok(Self {
            joint: table.require("joint", JOINT)?.name()?,
            base: table.require("base", "the joint that it is seen from")?.name()?,
            position: table.get("position").map(|value| value.vector()).transpose()?,
            rotation: RotationKeys::read_if_there(table)?,
        })
    }

    fn build(&self, scene: &Scene<'_>, at: &At<'_>) -> Result<Built<RelativePose>, Error> {
        let joint = scene.joint(&self.joint, at, "joint")?;
        let base = scene.joint(&self.base, at, "base")?;
        let position = self.position.map(DVec3::from_array);
        let rotation = self.rotation.map(|rotation| rotation.quaternion(at)).transpose()?;
        if position.is_none() && rotation.is_none() {
            let (place, found) = (at.place(), "neither".to_owned());
            let expected = "a 'position' in the base's frame (metres), a rotation, or both";
            return Err(at.error(ErrorKind::Alternatives { place, found, expected }));
        }
        Ok(Built::new(joint, RelativePose::new(base, joint, position, rotation)))
    }

    fn turn(_: &mut RelativePose, _: Axes) {
        // It is about joints alone.
    }

    fn aim(_: &mut RelativePose, _: Aim) -> bool {
        false
    }

    fn target_json(objective: &RelativePose, _: &Rig) -> Json {
        let RelativePose { position, rotation, .. } = objective;
        json!({ "position": position.map(|p| p.to_array()), "rotation": rotation.map(|q| q.to_array()) })
    }

    fn target_text(_: &RelativePose, _: &dyn Fn(f64) -> String) -> String {
        "a place beside a joint".to_owned()
    }
}
