//! The humanoid bones of a VRM 1.0 file, as roles of joints.

use std::fmt;

use ikiru_rig::Role;
use serde::Deserialize;
use serde::de::{Deserializer, MapAccess, Visitor};
use serde_json::value::RawValue;

use crate::gltf::document::parse_part;
use crate::warning::{BoneProblem, Warning, Warnings, short};

#[derive(Deserialize)]
#[serde(expecting = "an extensions object")]
struct Extensions<'a> {
    #[serde(borrow, rename = "VRMC_vrm")]
    vrm: Option<&'a RawValue>,
    #[serde(borrow, rename = "VRM")]
    old_vrm: Option<&'a RawValue>,
}

#[derive(Deserialize)]
#[serde(expecting = "a VRMC_vrm object")]
struct Vrm {
    humanoid: Humanoid,
}

#[derive(Deserialize)]
#[serde(rename_all = "camelCase")]
#[serde(expecting = "a humanoid object")]
struct Humanoid {
    human_bones: Bones,
}

#[derive(Deserialize)]
#[serde(expecting = "a bone object")]
struct Bone {
    node: u64,
}

/// Name and node of each bone, as far as there can be any.
struct Bones(Vec<(String, u64)>);

impl<'de> Deserialize<'de> for Bones {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        struct Map;
        impl<'de> Visitor<'de> for Map {
            type Value = Bones;
            fn expecting(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
                f.write_str("a map of bones")
            }
            fn visit_map<A: MapAccess<'de>>(self, mut map: A) -> Result<Bones, A::Error> {
                let mut bones = Vec::new();
                while let Some((name, bone)) = map.next_entry::<String, Bone>()? {
                    // Twice the bones that exist: enough to warn about those that do not.
                    if bones.len() < 2 * Role::ALL.len() {
                        bones.push((name, bone.node));
                    }
                }
                Ok(Bones(bones))
            }
        }
        deserializer.deserialize_map(Map)
    }
}

/// The roles that the document's extensions give to joints, each joint and each role once at most.
///
/// `joint_of_node` says which joint a node is: `None` beyond the last node, `Some(None)` outside the scene.
/// `name` is a joint's. Whatever is wrong becomes a warning.
pub(crate) fn roles(
    extensions: Option<&RawValue>,
    joint_of_node: impl Fn(u64) -> Option<Option<usize>>,
    name: impl Fn(usize) -> String,
    warnings: &mut Warnings,
) -> Vec<(usize, Role)> {
    let mut roles: Vec<(usize, Role)> = Vec::new();
    for (bone, node) in bones(extensions, warnings) {
        let problem = match (Role::from_name(&bone), joint_of_node(node)) {
            (None, _) => BoneProblem::UnknownBone,
            (_, None) => BoneProblem::NoNode(node),
            (_, Some(None)) => BoneProblem::NotInScene(node),
            (Some(role), Some(Some(joint))) => {
                if let Some((_, other)) = roles.iter().find(|(taken, _)| *taken == joint) {
                    BoneProblem::Taken { joint: short(&name(joint)), bone: other.name() }
                } else if roles.iter().any(|(_, other)| *other == role) {
                    BoneProblem::Repeated
                } else {
                    roles.push((joint, role));
                    continue;
                }
            }
        };
        warnings.push(|| Warning::HumanoidBone { bone: short(&bone), reason: problem });
    }
    roles
}

fn bones(extensions: Option<&RawValue>, warnings: &mut Warnings) -> Vec<(String, u64)> {
    let Some(extensions) = extensions else { return Vec::new() };
    let unreadable =
        |(place, reason): (String, String)| Warning::HumanoidMap { reason: format!("{place}: {reason}") };
    let extensions: Extensions<'_> = match parse_part(extensions.get(), "/extensions") {
        Ok(extensions) => extensions,
        Err(fault) => {
            warnings.push(|| unreadable(fault));
            return Vec::new();
        }
    };
    let Some(vrm) = extensions.vrm else {
        if extensions.old_vrm.is_some() {
            warnings.push(|| Warning::OldVrm);
        }
        return Vec::new();
    };
    match parse_part::<Vrm>(vrm.get(), "/extensions/VRMC_vrm") {
        Ok(vrm) => vrm.humanoid.human_bones.0,
        Err(fault) => {
            warnings.push(|| unreadable(fault));
            Vec::new()
        }
    }
}
