//! Left and right by position: which way a humanoid stands and faces at rest, and whether it is mirrored.

use std::f64::consts::{FRAC_PI_2, FRAC_PI_4};

use glam::DVec3;

use crate::humanoid::Role;
use crate::humanoid::problem::RoleProblem;
use crate::humanoid::tree::{Found, Tree};
use crate::joint::JointId;
use crate::maths;
use crate::rig::Rig;

/// How far the heading or the vertical may be off, radians.
const MOST_OFF: f64 = FRAC_PI_4;

/// Compares the sides that names tell with the rest pose. Exchanges left and right where the body is mirrored.
pub(super) fn check(tree: Tree<'_>, found: &mut Found) -> Vec<RoleProblem> {
    let mut problems = Vec::new();
    let body = Body { tree, found: *found };
    let (Some(up), Some(mut left)) = (body.up(), body.left()) else { return problems };
    if body.is_mirrored(up, left) {
        let first = [Role::LeftUpperLeg, Role::LeftUpperArm].into_iter().find_map(|r| found[r as usize]);
        problems.push(RoleProblem::Mirrored { left_hip: first.map_or_else(String::new, |j| tree.name(j)) });
        for role in Role::ALL.into_iter().filter(|role| role.name().starts_with("left")) {
            found.swap(role as usize, role.mirrored() as usize);
        }
        left = -left;
    }
    if up.y < maths::cos(MOST_OFF) {
        problems.push(RoleProblem::NotUpright { up: up.to_array() });
        return problems;
    }
    let facing = left.cross(up);
    let heading = maths::atan2(facing.x, facing.z);
    if heading.abs() > MOST_OFF {
        problems.push(RoleProblem::Facing { degrees: heading.to_degrees() });
    }
    problems
}

/// Which way a rig with humanoid roles faces at rest: a unit vector of the world, level, square to the line through
/// both hips and both shoulders. `None` where no pair of them has its roles.
///
/// ```
/// # use ikiru_rig::{Joint, RigBuilder, Role, humanoid};
/// # use glam::DVec3;
/// let mut builder = RigBuilder::new();
/// for (name, x) in [("LeftUpLeg", 0.1), ("RightUpLeg", -0.1)] {
///     let id = builder.add(Joint { rest_translation: DVec3::new(x, 0.9, 0.0), ..Joint::new(name, None) });
///     builder.joints_mut()[id.index()].role = Some(if x > 0.0 { Role::LeftUpperLeg } else { Role::RightUpperLeg });
/// }
/// assert_eq!(humanoid::facing(&builder.build()?), Some(DVec3::Z));
/// # Ok::<(), ikiru_rig::RigError>(())
/// ```
#[must_use]
pub fn facing(rig: &Rig) -> Option<DVec3> {
    let mut found: Found = [None; Role::ALL.len()];
    for role in Role::ALL {
        found[role as usize] = rig.role(role).map(JointId::index);
    }
    Body { tree: Tree(rig.joints()), found }.left()?.cross(DVec3::Y).try_normalize()
}

/// The angle about +y from +z that a rig with roles faces, in whole quarter turns; 0 where nothing tells.
pub(super) fn heading(rig: &Rig) -> f64 {
    let facing = facing(rig).unwrap_or(DVec3::Z);
    (maths::atan2(facing.x, facing.z) / FRAC_PI_2).round() * FRAC_PI_2
}

struct Body<'j> {
    tree: Tree<'j>,
    found: Found,
}

impl Body<'_> {
    fn at(&self, role: Role) -> Option<DVec3> {
        self.found[role as usize].map(|joint| self.tree.position(joint))
    }

    /// From the hips to the highest bone of the spine, of unit length.
    fn up(&self) -> Option<DVec3> {
        let top = [Role::Head, Role::Neck, Role::UpperChest, Role::Chest, Role::Spine];
        let top = top.into_iter().find_map(|role| self.at(role))?;
        (top - self.at(Role::Hips)?).try_normalize()
    }

    /// From the right to the left of hips and shoulders, of unit length: what limbs do does not change it.
    fn left(&self) -> Option<DVec3> {
        let apart = |left: Role| Some(self.at(left)? - self.at(left.mirrored())?);
        let pairs = [Role::LeftUpperLeg, Role::LeftUpperArm];
        pairs.into_iter().filter_map(apart).sum::<DVec3>().try_normalize()
    }

    /// Whether everything that tells the front says that `left` is the character's right: both feet, or else
    /// both eyes, or else the jaw.
    fn is_mirrored(&self, up: DVec3, left: DVec3) -> bool {
        use Role::{Head, Jaw, LeftEye, LeftFoot, LeftToes, RightEye, RightFoot, RightToes};
        let facing = left.cross(up);
        let least = 1e-3 * self.height();
        // How far it points where `left` has the front: 1 there, −1 backwards, `None` where nothing tells.
        let forth = |from: Role, to: Role| {
            let forth = self.at(to)? - self.at(from)?;
            let level = forth - up * forth.dot(up);
            (level.length() > least).then(|| level.normalize().dot(facing))
        };
        let feet = [forth(LeftFoot, LeftToes), forth(RightFoot, RightToes)];
        let eyes = [forth(Head, LeftEye), forth(Head, RightEye)];
        for told in [feet, eyes, [forth(Head, Jaw), None]] {
            if told.iter().any(Option::is_some) {
                return told.into_iter().flatten().all(|forth| forth < -0.5);
            }
        }
        false
    }

    /// About the distance from the hips to the head, in whatever unit the rig has.
    fn height(&self) -> f64 {
        let hips = self.at(Role::Hips).unwrap_or_default();
        Role::ALL.iter().filter_map(|role| self.at(*role)).map(|p| p.distance(hips)).fold(0.0, f64::max)
    }
}
