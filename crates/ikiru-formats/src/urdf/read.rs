//! A URDF document → a rig: every joint of the file is a joint, and so is its root link.

use std::borrow::Cow;
use std::collections::HashSet;

use glam::{DQuat, DVec3};
use ikiru_rig::{CollisionShape, Joint, JointId, JointMotion, Mimic, Range, RigBuilder, RigError, Segment};

use crate::error::{Error, Fault, Place};
use crate::loaded::Loaded;
use crate::urdf::document::{Document, JointElement};
use crate::urdf::element::{MimicElement, Owner};
use crate::urdf::kind::Kind;
use crate::urdf::names;
use crate::urdf::problem::UrdfProblem;
use crate::urdf::tree::Tree;
use crate::urdf::trouble::{Text, Trouble};
use crate::urdf::warning::UrdfWarning;
use crate::warning::{Warning, Warnings, short};

/// From URDF's axes to those of the library: x (forward) becomes z, y (left) becomes x, z (up) becomes y.
const WORLD_FROM_FILE: DQuat = DQuat::from_xyzw(-0.5, -0.5, -0.5, 0.5);

/// Reads a robot description.
pub(crate) fn read(bytes: &[u8], name: &str) -> Result<Loaded, Error> {
    load(bytes).map_err(|fault| fault.in_file(name))
}

fn load(bytes: &[u8]) -> Result<Loaded, Fault> {
    let text = std::str::from_utf8(bytes)
        .map_err(|error| Fault::new(Place::Byte(error.valid_up_to() as u64), UrdfProblem::Utf8.into()))?;
    let text = text.strip_prefix('\u{feff}').unwrap_or(text);
    load_text(text).map_err(|trouble| trouble.in_text(Text(text)))
}

fn load_text(text: &str) -> Result<Loaded, Trouble> {
    let mut warnings = Warnings::default();
    let document = Document::parse(text, &mut warnings)?;
    let leaders = leaders(&document)?;
    let tree = Tree::new(&document)?;
    let mut builder = RigBuilder::with_capacity(count(&document)?);
    let (root, ids) = add_joints(&document, &tree, &mut builder, &mut warnings);
    for (id, leader) in ids.iter().zip(leaders) {
        if let Some(Leader { joint, multiplier, offset }) = leader {
            let leader = ids[joint];
            builder.joints_mut()[id.index()].mimic = Some(Mimic { leader, multiplier, offset });
        }
    }
    let joint_of_link = |link: usize| ids.get(tree.above[link]).copied().unwrap_or(root);
    let collision_shapes = document.shapes.iter().map(|shape| CollisionShape {
        joint: joint_of_link(shape.link),
        position: shape.origin.translation,
        rotation: shape.origin.rotation,
        kind: shape.kind,
    });
    let collision_shapes = collision_shapes.collect();
    let segments = document.inertials.iter().map(|inertial| Segment {
        joint: joint_of_link(inertial.link),
        kg: inertial.kg,
        center: inertial.center,
    });
    let segments = segments.collect();
    drop(tree);
    for problem in builder.assign_roles().problems {
        warnings.push(|| Warning::Role(problem));
    }
    let rig = builder.build().map_err(|error| placed(&document, error))?;
    Ok(Loaded {
        warnings: warnings.into_vec(),
        world_from_file: WORLD_FROM_FILE,
        collision_shapes,
        segments,
        ..Loaded::from_rig(rig)
    })
}

/// How many joints the rig will have; too many are refused before any is made.
fn count(document: &Document<'_>) -> Result<usize, Trouble> {
    let (mut found, most) = (1, RigBuilder::MOST_JOINTS);
    let mut first_too_many = None;
    for joint in &document.joints {
        found += if joint.kind == Kind::Planar { 3 } else { 1 };
        if found > most {
            first_too_many.get_or_insert(joint);
        }
    }
    match first_too_many {
        None => Ok(found),
        Some(joint) => Err(Trouble::new(joint.at, "<joint>", RigError::TooMany { found, most })),
    }
}

/// Adds the root link and all joints to a builder; its id, and that of each joint of the document.
fn add_joints(
    document: &Document<'_>,
    tree: &Tree,
    builder: &mut RigBuilder,
    warnings: &mut Warnings,
) -> (JointId, Vec<JointId>) {
    let mut taken: HashSet<Cow<'_, str>> = document.joints.iter().map(|j| Cow::Borrowed(&*j.name)).collect();
    let link = &document.links[tree.root].name;
    let name = names::free(link.to_string(), &mut taken);
    if name != *link {
        warnings
            .push(|| Warning::Urdf(UrdfWarning::RootRenamed { link: short(link), renamed: short(&name) }));
    }
    let mut root = Joint::new(name, None);
    root.rest_rotation = WORLD_FROM_FILE;
    let root = builder.add(root);
    let mut ids = vec![root; document.joints.len()];
    for position in &tree.order {
        let element = &document.joints[*position];
        let above = tree.above[tree.parent[*position]];
        let mut parent = ids.get(above).copied().unwrap_or(root);
        let mut joint = Joint::new(&*element.name, None);
        joint.rest_rotation = element.origin.rotation;
        joint.rest_translation = element.origin.translation;
        if element.kind == Kind::Planar {
            // Two sliders in the plane carry the hinge; the first has the joint's place.
            for (axis, end) in plane(element.axis).into_iter().zip(["x", "y"]) {
                let mut slider =
                    Joint::new(names::free(format!("{}_{end}", element.name), &mut taken), Some(parent));
                slider.rest_rotation = std::mem::take(&mut joint.rest_rotation);
                slider.rest_translation = std::mem::take(&mut joint.rest_translation);
                slider.motion = JointMotion::Slider { axis, range: Range::UNLIMITED };
                parent = builder.add(slider);
            }
        }
        joint.parent = Some(parent);
        joint.motion = motion(element);
        ids[*position] = builder.add(joint);
    }
    // When all joints have their names: the sliders of a planar joint may take one that a link bears.
    for position in &tree.order {
        let element = &document.joints[*position];
        if element.child == element.name {
            continue;
        }
        if taken.contains(&element.child) {
            let hidden =
                || UrdfWarning::LinkHidden { link: short(&element.child), joint: short(&element.name) };
            warnings.push(|| Warning::Urdf(hidden()));
        } else {
            builder.joints_mut()[ids[*position].index()].aliases.push(element.child.to_string());
        }
    }
    (root, ids)
}

fn motion(element: &JointElement<'_>) -> JointMotion {
    let (axis, range) = (element.axis, element.range);
    match element.kind {
        Kind::Fixed => JointMotion::Fixed,
        Kind::Revolute | Kind::Continuous | Kind::Planar => JointMotion::Hinge { axis, range },
        Kind::Prismatic => JointMotion::Slider { axis, range },
        Kind::Floating => JointMotion::FREE,
        Kind::Spherical => JointMotion::BALL,
    }
}

/// Two axes perpendicular to a unit axis and to each other, right-handed with it: x and y for z, y and z for
/// x, z and x for y.
fn plane(axis: DVec3) -> [DVec3; 2] {
    let size = axis.abs();
    let helper = if size.z >= size.x && size.z >= size.y {
        DVec3::X
    } else if size.x >= size.y {
        DVec3::Y
    } else {
        DVec3::Z
    };
    let first = helper.reject_from_normalized(axis).normalize();
    [first, axis.cross(first)]
}

/// Whom a joint follows in the end: a joint of the document that moves by itself.
#[derive(Clone, Copy)]
struct Leader {
    joint: usize,
    multiplier: f64,
    offset: f64,
}

/// The leader of each joint. One that follows another passes on whom it follows itself.
fn leaders(document: &Document<'_>) -> Result<Vec<Option<Leader>>, Trouble> {
    let joints = &document.joints;
    let index = names::index(document.text, "joint", joints.iter().map(|joint| (&joint.name, joint.at)))?;
    let mut direct: Vec<Option<Leader>> = Vec::with_capacity(joints.len());
    for follower in joints {
        let Some(mimic) = &follower.mimic else {
            direct.push(None);
            continue;
        };
        let unknown =
            || UrdfProblem::UnknownLeader(names::unknown(&mimic.leader, joints.iter().map(|j| &*j.name)));
        let joint = *index.get(&*mimic.leader).ok_or_else(|| of_mimic(follower, mimic, unknown()))?;
        let kind = joints[joint].kind;
        if !kind.is_scalar() {
            let problem = UrdfProblem::LeaderKind { leader: short(&mimic.leader), kind: kind.name() };
            return Err(of_mimic(follower, mimic, problem));
        }
        direct.push(Some(Leader { joint, multiplier: mimic.multiplier, offset: mimic.offset }));
    }
    // Up to the first that is settled, then back down; whoever is met twice on the way up follows itself.
    let mut is_settled: Vec<bool> = direct.iter().map(Option::is_none).collect();
    let mut is_open = vec![false; joints.len()];
    let mut path = Vec::new();
    for start in 0..joints.len() {
        let mut at = start;
        while let Some(leader) = direct[at].filter(|_| !is_settled[at]) {
            if let Some(mimic) = joints[at].mimic.as_ref().filter(|_| is_open[at]) {
                let problem = UrdfProblem::MimicCycle { leader: short(&mimic.leader) };
                return Err(of_mimic(&joints[at], mimic, problem));
            }
            is_open[at] = true;
            path.push(at);
            at = leader.joint;
        }
        while let Some(follower) = path.pop() {
            is_settled[follower] = true;
            if let Some(own) = direct[follower]
                && let Some(above) = direct[own.joint]
            {
                direct[follower] = Some(Leader {
                    joint: above.joint,
                    multiplier: own.multiplier * above.multiplier,
                    offset: own.multiplier * above.offset + own.offset,
                });
            }
        }
    }
    Ok(direct)
}

fn of_mimic(follower: &JointElement<'_>, mimic: &MimicElement<'_>, problem: UrdfProblem) -> Trouble {
    let owner = Owner { what: "joint", name: &follower.name };
    Trouble::new(mimic.at, format!("<mimic> of {owner}"), problem)
}

/// A refusal of the rig's builder with its place: that of the joint which it names.
fn placed(document: &Document<'_>, error: RigError) -> Trouble {
    let (RigError::Mimic { joint: name, .. } | RigError::Range { joint: name, .. }) = &error else {
        return Trouble::of_file(error);
    };
    match document.joints.iter().find(|joint| joint.name == *name) {
        Some(joint) => Trouble::new(joint.at, "<joint>", error),
        None => Trouble::of_file(error),
    }
}
