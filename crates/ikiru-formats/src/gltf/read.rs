//! A glTF document → a rig with its clips: every node of the default scene is a joint.

use std::path::Path;
use std::sync::Arc;

use ikiru_rig::{Joint, JointId, JointMotion, RigBuilder, Role};

use crate::error::{Error, ErrorKind, Fault, Place};
use crate::gltf::buffer;
use crate::gltf::clips::clips;
use crate::gltf::container::{self, Parts};
use crate::gltf::document::{Document, Node, Skin};
use crate::gltf::names::new_names;
use crate::gltf::scale::{Scale, below};
use crate::gltf::source::{Binding, Source, check_turns};
use crate::gltf::transform::{HalfTurn, local, sound};
use crate::gltf::tree::{NONE, Tree, out_of_range};
use crate::loaded::Loaded;
use crate::vrm;
use crate::vrm::read::{Humanoid, Version};
use crate::warning::{Warning, Warnings, short};

/// Reads a document, in a container or as text. Files that it refers to are looked for in `folder`.
pub(crate) fn read(
    file: Vec<u8>,
    in_container: bool,
    folder: Option<&Path>,
    name: &str,
) -> Result<Loaded, Error> {
    load(file, in_container, folder, name).map(|(loaded, _)| loaded).map_err(|fault| fault.in_file(name))
}

/// Reads a document, as [`read`] does, and says which extension tells its humanoid bones.
pub(crate) fn load(
    file: Vec<u8>,
    in_container: bool,
    folder: Option<&Path>,
    name: &str,
) -> Result<(Loaded, Version), Fault> {
    let mut warnings = Warnings::default();
    let parts = if in_container {
        container::split(&file)?
    } else {
        // A byte order mark is against the rules, and common.
        let start = if file.starts_with(b"\xef\xbb\xbf") { 3 } else { 0 };
        Parts { json: start..file.len(), ..Parts::default() }
    };
    if parts.trailing > 0 {
        warnings.push(|| Warning::TrailingBytes { count: parts.trailing as u64 });
    }
    let text = std::str::from_utf8(file.get(parts.json.clone()).unwrap_or_default()).map_err(|error| {
        let byte = parts.json.start.saturating_add(error.valid_up_to());
        Fault::new(Place::Byte(byte as u64), ErrorKind::Utf8)
    })?;
    let mut document = Document::parse(text)?;
    check_version(&document, &mut warnings)?;
    let tree = Tree::new(&document)?;
    let skinned = skinned(&document.skins, document.nodes.len())?;
    // Taken out, so that their memory is free before the rig is built.
    let nodes = std::mem::take(&mut document.nodes.0);
    let joint_of_node = joint_of_node(&tree, nodes.len());
    let (mut builder, mut bindings) = joints(nodes, &tree, &skinned, &joint_of_node, &mut warnings)?;
    drop((tree, skinned));
    let humanoid = humanoid(&document, &builder, &joint_of_node, &mut warnings);
    let around = match humanoid.version {
        // Its characters face −z.
        Version::Old => HalfTurn::Y,
        _ => HalfTurn::None,
    };
    turn(&mut builder, &mut bindings, around);
    add_roles(&humanoid, &mut builder, &mut warnings);
    check_turns(builder.joints(), &bindings)?;
    let rig = builder.build().map_err(ErrorKind::from)?;

    let buffers = buffer::resolve(&document.buffers, parts.bin.clone(), folder)?;
    drop(document);
    let source = Source {
        name: name.to_owned(),
        folder: folder.map(Path::to_owned),
        file,
        json: parts.json,
        bin: parts.bin,
        others: parts.others,
        buffers,
        bindings,
        version: humanoid.version,
    };
    let clips = clips(&source, &rig, &mut warnings, None);
    let loaded = Loaded {
        clips,
        warnings: warnings.into_vec(),
        world_from_file: around.quaternion(),
        joint_from_file: around.quaternion(),
        source: Some(Arc::new(source)),
        ..Loaded::from_rig(rig)
    };
    Ok((loaded, humanoid.version))
}

fn check_version(document: &Document<'_>, warnings: &mut Warnings) -> Result<(), Fault> {
    let (version, minimum) = match &document.asset {
        Some(asset) => (asset.version.as_deref(), asset.min_version.as_deref()),
        None => (None, None),
    };
    let refuse = |pointer: &str, found: &str| {
        Err(Fault::at(pointer, ErrorKind::Version { found: found.chars().take(20).collect() }))
    };
    match version {
        None => warnings.push(|| Warning::NoVersion),
        Some(version) if version == "2" || version.starts_with("2.") => {}
        Some(version) => return refuse("/asset/version", version),
    }
    match minimum {
        None | Some("2.0" | "2") => Ok(()),
        Some(minimum) => refuse("/asset/minVersion", minimum),
    }
}

/// Which nodes a skin uses.
fn skinned(skins: &[Skin], n_nodes: usize) -> Result<Vec<bool>, Fault> {
    let mut skinned = vec![false; n_nodes];
    for (idx, skin) in skins.iter().enumerate() {
        for (at, node) in skin.joints.iter().enumerate() {
            match skinned.get_mut(*node as usize) {
                Some(flag) => *flag = true,
                None => {
                    return Err(out_of_range(format!("/skins/{idx}/joints/{at}"), "node", *node, n_nodes));
                }
            }
        }
    }
    Ok(skinned)
}

/// The joint of each node; [`NONE`] outside the scene.
fn joint_of_node(tree: &Tree, n_nodes: usize) -> Vec<u32> {
    let mut joints = vec![NONE; n_nodes];
    for (joint, node) in (0u32..).zip(&tree.order) {
        if let Some(slot) = joints.get_mut(*node as usize) {
            *slot = joint;
        }
    }
    joints
}

/// One joint a node, with the scales of what is above baked into its offset.
fn joints(
    mut nodes: Vec<Node>,
    tree: &Tree,
    skinned: &[bool],
    joint_of_node: &[u32],
    warnings: &mut Warnings,
) -> Result<(RigBuilder, Vec<Binding>), Fault> {
    let mut new_names = new_names(&nodes, &tree.order, warnings);
    let mut builder = RigBuilder::with_capacity(tree.order.len());
    let mut bindings: Vec<Binding> = Vec::with_capacity(tree.order.len());
    let mut scales: Vec<Scale> = Vec::with_capacity(tree.order.len());
    for idx in &tree.order {
        let Some(mut node) = nodes.get_mut(*idx as usize).map(std::mem::take) else { continue };
        let own = |table: &[u32]| table.get(*idx as usize).copied().unwrap_or(NONE);
        let parent = joint_of_node.get(own(&tree.parent) as usize).map(|joint| *joint as usize);
        let above = parent.and_then(|p| scales.get(p)).cloned().unwrap_or(Scale::ONE);
        let name = new_names.remove(idx).unwrap_or_else(|| std::mem::take(&mut node.name));
        let local = local(&node, *idx, &name, warnings)?;
        let magnitude =
            |what, found| Fault::at(format!("/nodes/{idx}"), ErrorKind::Magnitude { what, found });
        let Some(offset) = sound(above.to_metres(local.translation)) else {
            let found = local.translation.to_array().to_vec();
            return Err(magnitude("with the scale of its parents, the translation", found));
        };
        let Some(below) = below(&above, &local) else {
            let found = local.scale.to_array().to_vec();
            return Err(magnitude("with the scale of its parents, the scale", found));
        };
        if below.is_sheared {
            warnings.push(|| Warning::Sheared { joint: short(&name) });
        }
        let mut joint = Joint::new(name, parent.map(JointId::from_index));
        joint.rest_rotation = below.rotation;
        joint.rest_translation = offset;
        if skinned.get(*idx as usize) == Some(&true) {
            joint.motion = JointMotion::BALL;
        }
        builder.add(joint);
        scales.push(below.scale);
        let (half_turn, scale) = (below.half_turn, local.scale.abs());
        bindings.push(Binding { node: *idx, turn: HalfTurn::None, half_turn, above, scale });
    }
    Ok((builder, bindings))
}

/// What the file tells of a humanoid.
fn humanoid(
    document: &Document<'_>,
    builder: &RigBuilder,
    joint_of_node: &[u32],
    warnings: &mut Warnings,
) -> Humanoid {
    let joint = |node: u64| {
        let joint = usize::try_from(node).ok().and_then(|node| joint_of_node.get(node));
        joint.map(|joint| (*joint != NONE).then_some(*joint as usize))
    };
    let name = |joint: usize| builder.joints().get(joint).map_or_else(String::new, |j| j.name.clone());
    vrm::read::humanoid(document.extensions, joint, name, warnings)
}

/// Roles as the file tells them, or else the joints' names.
fn add_roles(humanoid: &Humanoid, builder: &mut RigBuilder, warnings: &mut Warnings) {
    if humanoid.roles.is_empty() {
        for problem in builder.assign_roles().problems {
            warnings.push(|| Warning::Role(problem));
        }
    }
    for (joint, role) in &humanoid.roles {
        if let Some(joint) = builder.joints_mut().get_mut(*joint) {
            joint.role = Some(*role);
            if humanoid.version == Version::Animation {
                // Its nodes have no skin that would tell what moves.
                joint.motion = if *role == Role::Hips { JointMotion::FREE } else { JointMotion::BALL };
            }
        }
    }
}

/// Turns the whole file about its origin, and every joint's axes with it.
fn turn(builder: &mut RigBuilder, bindings: &mut [Binding], turn: HalfTurn) {
    if turn == HalfTurn::None {
        return;
    }
    let q = turn.quaternion();
    for (joint, binding) in builder.joints_mut().iter_mut().zip(bindings) {
        joint.rest_rotation = q * joint.rest_rotation * q.inverse();
        joint.rest_translation = q * joint.rest_translation;
        binding.turn = turn;
    }
}
