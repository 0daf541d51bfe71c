//! `rest_pose`: a gentle pull of joints towards how they are at rest.

use ikiru_rig::Rig;
use ikiru_solve::objectives::RestPose;
use serde::Serialize;
use serde_json::Value as Json;

use crate::at::At;
use crate::axes::Axes;
use crate::error::Error;
use crate::key::Key;
use crate::keys::{TOLERANCE, TOLERANCE_DEG};
use crate::kind_keys::{Aim, Built, KindKeys};
use crate::scene::{Scene, joint_list};
use crate::table::Table;

/// The keys of a `rest_pose`.
#[derive(Clone, Debug, Default, PartialEq, Serialize)]
pub struct RestPoseKeys {
    /// The joints that it pulls, by name or humanoid role; left out, all active ones.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub joints: Option<Vec<String>>,
}

const JOINTS: Key =
    Key::new("joints", "a list of joints, by name or humanoid role", "The joints that it pulls.")
        .or_as("all active ones");

impl KindKeys for RestPoseKeys {
    const NAME: &'static str = "rest_pose";
    const ABOUT: &'static str = "A gentle pull of joints towards how they are at rest: give it a small weight. \
                                 Success does not ask for it unless it is `mandatory`.";
    const KEYS: &'static [Key] =
        &[JOINTS, TOLERANCE.meaning("Of sliders: how near is near enough."), TOLERANCE_DEG];
    const EXAMPLE: &'static str = "\
kind = \"rest_pose\"
weight = 0.001
";
    type Objective = RestPose;

    fn read(table: &Table<'_>) -> Result<Self, Error> {
        Ok(Self { joints: table.get(&JOINTS).map(|value| value.name_list()).transpose()? })
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
