//! `relative_pose`: how one joint's frame lies in another's.

use glam::DVec3;
use ikiru_rig::Rig;
use ikiru_solve::objectives::RelativePose;
use serde::Serialize;
use serde_json::{Value as Json, json};

use crate::at::At;
use crate::axes::Axes;
use crate::error::{Error, ErrorKind};
use crate::key::{JOINT, Key};
use crate::keys::{EULER_DEG, RotationKeys, TARGET_ROTATION, TOLERANCE, TOLERANCE_DEG};
use crate::kind_keys::{Aim, Built, KindKeys};
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

const BASE: Key = Key::new("base", "the joint that it is seen from", "The joint in whose frame it lies.");
const POSITION: Key = Key::new(
    "position",
    "a point in the base's frame in metres, [x, y, z]",
    "Where the joint's origin should be.",
)
.or_as("anywhere, beside a rotation");
const TURNED: [Key; 2] = [
    TARGET_ROTATION
        .meaning("How its frame should be turned in the base's; of any length but 0.")
        .or_as("turned in any way, beside a position"),
    EULER_DEG.or_as("the same"),
];

impl KindKeys for RelativePoseKeys {
    const NAME: &'static str = "relative_pose";
    const ABOUT: &'static str =
        "How one joint lies in the frame of another, wherever both are: its place, its rotation, or both.";
    const KEYS: &'static [Key] = &[JOINT, BASE, POSITION, TURNED[0], TURNED[1], TOLERANCE, TOLERANCE_DEG];
    const EXAMPLE: &'static str = "\
kind = \"relative_pose\"
joint = \"leftHand\"
base = \"head\"
position = [0.15, 0.05, 0.15]
";
    type Objective = RelativePose;

    fn read(table: &Table<'_>) -> Result<Self, Error> {
        Ok(Self {
            joint: table.require(&JOINT)?.name()?,
            base: table.require(&BASE)?.name()?,
            position: table.get(&POSITION).map(|value| value.numbers()).transpose()?,
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
