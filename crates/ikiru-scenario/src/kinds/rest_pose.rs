//! `rest_pose`: a gentle pull of joints towards how they are at rest.

use ikiru_rig::Rig;
use ikiru_solve::objectives::RestPose;
use serde::Serialize;
use serde_json::Value as Json;

use crate::at::At;
use crate::axes::Axes;
use crate::error::Error;
use crate::kinds::{Aim, Built, KindKeys};
use crate::scene::{Scene, joint_list};
use crate::table::Table;

/// The keys of a `rest_pose`.
#[derive(Clone, Debug, Default, PartialEq, Serialize)]
pub struct RestPoseKeys {
    /// The joints that it pulls, by name or humanoid role; left out, all active ones.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub joints: Option<Vec<String>>,
}

impl KindKeys for RestPoseKeys {
    const NAME: &'static str = "rest_pose";
    const KEYS: &'static [&'static str] = &["joints", "tolerance", "tolerance_deg"];
    type Objective = RestPose;

    fn read(table: &Table<'_>) -> Result<Self, Error> {
        Ok(Self { joints: table.get("joints").map(|value| value.name_list()).transpose()? })
    }

    fn build(&self, scene: &Scene<'_>, at: &At<'_>) -> Result<Built<RestPose>, Error> {
        let joints = match &self.joints {
            None => scene.active.to_vec(),
            Some(names) => joint_list(scene.rig, names, &at.key("joints"))?,
        };
        let joint = if let [only] = joints[..] { Some(only) } else { None };
        Ok(Built::new(joint, RestPose::new(&joints, scene.rig.rest_pose())))
    }

    fn turn(_: &mut RestPose, _: Axes) {
        // It is about joints alone.
    }

    fn aim(_: &mut RestPose, _: Aim) -> bool {
        false
    }

    fn target_json(_: &RestPose, _: &Rig) -> Json {
        Json::Null
    }

    fn target_text(_: &RestPose, _: &dyn Fn(f64) -> String) -> String {
        "the rest pose".to_owned()
    }
}
