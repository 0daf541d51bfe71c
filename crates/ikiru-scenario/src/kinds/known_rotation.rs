//! `known_rotation`: joints at given angles or rotations.

use ikiru_rig::{JointId, JointMotion, Rig};
use ikiru_solve::objectives::{JointAngles, KnownRotation};
use serde::Serialize;
use serde_json::{Map, Value as Json, json};

use crate::at::At;
use crate::axes::Axes;
use crate::error::Error;
use crate::key::Key;
use crate::keys::{JointKeys, TOLERANCE, TOLERANCE_DEG, as_table};
use crate::kind_keys::{Aim, Built, KindKeys};
use crate::scene::{Scene, none_of_them, twice};
use crate::table::Table;
use crate::values::{degrees, joint_of_key, name_of};

/// The keys of a `known_rotation`.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct KnownRotationKeys {
    /// At least one joint, by name or humanoid role, and what it should do; in this order.
    #[serde(serialize_with = "as_table")]
    pub joints: Vec<(String, JointKeys)>,
}

const JOINTS: Key = Key::new(
    "joints",
    "a table of joints, { NAME = { euler_deg = [x, y, z] } }",
    "At least one, by name or humanoid role, and what it should do: a motion on top of rest, as in `[start]`.",
);

impl KindKeys for KnownRotationKeys {
    const NAME: &'static str = "known_rotation";
    const ABOUT: &'static str = "Joints at given angles, rotations or offsets.";
    const KEYS: &'static [Key] =
        &[JOINTS, TOLERANCE.meaning("Of sliders: how near is near enough."), TOLERANCE_DEG];
    const EXAMPLE: &'static str = "\
kind = \"known_rotation\"
joints = { leftUpperArm = { euler_deg = [0, 0, -45] }, leftLowerArm = { euler_deg = [0, -20, 0] } }
";
    type Objective = KnownRotation;

    fn read(table: &Table<'_>) -> Result<Self, Error> {
        let given = table.require(&JOINTS)?;
        let joints = given.table()?.entries(JointKeys::TAKES);
        let joints = joints.iter().map(|value| Ok((value.key.clone(), JointKeys::read(value)?)));
        Ok(Self { joints: joints.collect::<Result<_, _>>()? })
    }

    fn build(&self, scene: &Scene<'_>, at: &At<'_>) -> Result<Built<KnownRotation>, Error> {
        let at = at.key("joints");
        let mut targets: Vec<(JointId, JointAngles)> = Vec::with_capacity(self.joints.len());
        for (name, keys) in &self.joints {
            let at_name = at.key(name);
            let joint = joint_of_key(scene.rig, name, &at_name)?;
            if targets.iter().any(|(other, _)| *other == joint) {
                return Err(at_name.key_error(twice(scene.rig, joint, name, at.place())));
            }
            targets.push((joint, keys.angles(scene.rig, joint, &at_name)?));
        }
        let joint = match targets[..] {
            [] => return Err(none_of_them(&at)),
            [(only, _)] => Some(only),
            [..] => None,
        };
        Ok(Built::new(joint, KnownRotation::new(&targets)))
    }

    fn turn(_: &mut KnownRotation, _: Axes) {
        // It is about joints alone.
    }

    fn aim(_: &mut KnownRotation, _: Aim) -> bool {
        false
    }

    fn target_json(objective: &KnownRotation, rig: &Rig) -> Json {
        let joints: Map<String, Json> = objective
            .targets()
            .map(|(joint, angles)| (name_of(rig, joint).to_owned(), angles_json(rig, joint, &angles)))
            .collect();
        Json::Object(joints)
    }

    fn target_text(_: &KnownRotation, _: &dyn Fn(f64) -> String) -> String {
        "given angles".to_owned()
    }
}

fn angles_json(rig: &Rig, joint: JointId, angles: &JointAngles) -> Json {
    let is_slider = matches!(rig.get(joint).map(|j| j.motion), Some(JointMotion::Slider { .. }));
    match angles {
        JointAngles::Rotation(q) => json!({ "rotation": q.to_array() }),
        JointAngles::Euler(a) => json!({ "euler_deg": a.map(|a| a.map(degrees)) }),
        JointAngles::Value(v) if is_slider => json!({ "offset": v }),
        JointAngles::Value(v) => json!({ "angle_deg": degrees(*v) }),
    }
}
