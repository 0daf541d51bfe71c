//! The humanoid bones of a VRM file (1.0, 0.x, or an animation) as roles of joints.

use std::fmt;
use std::marker::PhantomData;

use ikiru_rig::Role;
use serde::Deserialize;
use serde::de::{Deserializer, MapAccess, SeqAccess, Visitor};
use serde_json::value::RawValue;

use crate::gltf::document::parse_part;
use crate::warning::{BoneProblem, Warning, Warnings, short};

/// What a document says of a humanoid.
pub(crate) struct Humanoid {
    pub(crate) version: Version,
    /// Joint and role, each of them once at most.
    pub(crate) roles: Vec<(usize, Role)>,
}

/// The extension that tells the bones.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Version {
    /// No extension does.
    None,
    /// `VRM`: VRM 0.x.
    Old,
    /// `VRMC_vrm`: VRM 1.0.
    One,
    /// `VRMC_vrm_animation`: the skeleton of a motion, in T-pose.
    Animation,
}

#[derive(Default, Deserialize)]
#[serde(expecting = "an extensions object")]
struct Extensions<'a> {
    #[serde(borrow, rename = "VRMC_vrm")]
    vrm: Option<&'a RawValue>,
    #[serde(borrow, rename = "VRM")]
    old_vrm: Option<&'a RawValue>,
    #[serde(borrow, rename = "VRMC_vrm_animation")]
    animation: Option<&'a RawValue>,
}

/// Either extension, by the shape of its bones.
#[derive(Deserialize)]
#[serde(expecting = "a VRM object", bound(deserialize = "Bones<S>: Deserialize<'de>"))]
struct Vrm<S> {
    humanoid: HumanoidEntry<S>,
}

#[derive(Deserialize)]
#[serde(rename_all = "camelCase")]
#[serde(expecting = "a humanoid object", bound(deserialize = "Bones<S>: Deserialize<'de>"))]
struct HumanoidEntry<S> {
    human_bones: Bones<S>,
}

/// Name and node of each bone, as far as there can be any.
struct Bones<S>(Vec<(String, u64)>, PhantomData<S>);

/// Bones by name, as VRM 1.0 has them.
struct Named;

/// Bones in a list, as VRM 0.x has them.
struct Listed;

/// Twice the bones that exist: enough to warn about those that do not.
const MOST: usize = 2 * Role::ALL.len();

#[derive(Deserialize)]
#[serde(expecting = "a bone object")]
struct Bone {
    node: u64,
}

impl<'de> Deserialize<'de> for Bones<Named> {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        struct Map;
        impl<'de> Visitor<'de> for Map {
            type Value = Bones<Named>;
            fn expecting(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
                f.write_str("a map of bones")
            }
            fn visit_map<A: MapAccess<'de>>(self, mut map: A) -> Result<Self::Value, A::Error> {
                let mut bones = Vec::new();
                while let Some((name, bone)) = map.next_entry::<String, Bone>()? {
                    if bones.len() < MOST {
                        bones.push((name, bone.node));
                    }
                }
                Ok(Bones(bones, PhantomData))
            }
        }
        deserializer.deserialize_map(Map)
    }
}

#[derive(Deserialize)]
#[serde(expecting = "a bone object")]
struct OldBone {
    bone: String,
    /// Below 0 for a bone that the model lacks.
    node: i64,
}

impl<'de> Deserialize<'de> for Bones<Listed> {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        struct List;
        impl<'de> Visitor<'de> for List {
            type Value = Bones<Listed>;
            fn expecting(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
                f.write_str("a list of bones")
            }
            fn visit_seq<A: SeqAccess<'de>>(self, mut list: A) -> Result<Self::Value, A::Error> {
                let mut bones = Vec::new();
                while let Some(OldBone { bone, node }) = list.next_element()? {
                    if let (Ok(node), true) = (u64::try_from(node), bones.len() < MOST) {
                        bones.push((new_name(bone), node));
                    }
                }
                Ok(Bones(bones, PhantomData))
            }
        }
        deserializer.deserialize_seq(List)
    }
}

/// VRM 1.0's name of a bone of VRM 0.x: the bones of the thumb have moved up by one.
fn new_name(old: String) -> String {
    match old.as_str() {
        "leftThumbProximal" => "leftThumbMetacarpal".to_owned(),
        "leftThumbIntermediate" => "leftThumbProximal".to_owned(),
        "rightThumbProximal" => "rightThumbMetacarpal".to_owned(),
        "rightThumbIntermediate" => "rightThumbProximal".to_owned(),
        _ => old,
    }
}

/// The roles that the document's extensions give to joints.
///
/// `joint_of_node` says which joint a node is: `None` beyond the last node, `Some(None)` outside the scene.
/// `name` is a joint's. Whatever is wrong becomes a warning.
pub(crate) fn humanoid(
    extensions: Option<&RawValue>,
    joint_of_node: impl Fn(u64) -> Option<Option<usize>>,
    name: impl Fn(usize) -> String,
    warnings: &mut Warnings,
) -> Humanoid {
    let (version, bones) = bones(extensions, warnings);
    let mut roles: Vec<(usize, Role)> = Vec::new();
    for (bone, node) in bones {
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
    Humanoid { version, roles }
}

fn bones(extensions: Option<&RawValue>, warnings: &mut Warnings) -> (Version, Vec<(String, u64)>) {
    let mut or_warning = |read: Result<Vec<(String, u64)>, (String, String)>| {
        read.unwrap_or_else(|(place, reason)| {
            warnings.push(|| Warning::HumanoidMap { reason: format!("{place}: {reason}") });
            Vec::new()
        })
    };
    let Some(text) = extensions else { return (Version::None, Vec::new()) };
    let extensions: Extensions<'_> = match parse_part(text.get(), "/extensions") {
        Ok(extensions) => extensions,
        Err(fault) => return (Version::None, or_warning(Err(fault))),
    };
    match extensions {
        Extensions { vrm: Some(vrm), .. } => {
            let read = parse_part::<Vrm<Named>>(vrm.get(), "/extensions/VRMC_vrm");
            (Version::One, or_warning(read.map(|vrm| vrm.humanoid.human_bones.0)))
        }
        Extensions { old_vrm: Some(vrm), .. } => {
            let read = parse_part::<Vrm<Listed>>(vrm.get(), "/extensions/VRM");
            (Version::Old, or_warning(read.map(|vrm| vrm.humanoid.human_bones.0)))
        }
        Extensions { animation: Some(animation), .. } => {
            let read = parse_part::<Vrm<Named>>(animation.get(), "/extensions/VRMC_vrm_animation");
            (Version::Animation, or_warning(read.map(|vrm| vrm.humanoid.human_bones.0)))
        }
        _ => (Version::None, Vec::new()),
    }
}
