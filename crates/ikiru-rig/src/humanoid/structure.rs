//! The hips by structure: where legs and trunk hang side by side, what carries both, whatever its name is.

use crate::humanoid::Role;
use crate::humanoid::problem::RoleProblem;
use crate::humanoid::tree::{Found, Tree};

/// Bones of the trunk, lowest first.
const TRUNK: [Role; 5] = [Role::Spine, Role::Chest, Role::UpperChest, Role::Neck, Role::Head];
const THIGHS: [Role; 2] = [Role::LeftUpperLeg, Role::RightUpperLeg];

/// How far from the middle of the thighs the hips may be, of a leg's length: what lies farther is no part of the body, but the
/// ground that it stands on.
const FARTHEST: f64 = 0.5;

/// Gives the role of the hips to what carries legs and trunk, where the joint of that name carries no legs, or there is
/// none. Such a joint is the trunk's first, and the spine where no other is.
pub(super) fn hips(tree: Tree<'_>, found: &mut Found) -> Option<RoleProblem> {
    let [left, right] = THIGHS.map(|role| found[role as usize]);
    let (left, right) = (left?, right?);
    let carries = |above: usize, joint: usize| tree.line(joint).any(|other| other == above);
    let named = found[Role::Hips as usize];
    if named.is_some_and(|hips| carries(hips, left) || carries(hips, right)) {
        return None;
    }
    let trunk = named.or_else(|| TRUNK.iter().find_map(|role| found[*role as usize]))?;
    let hips = tree.line(left).find(|joint| carries(*joint, right) && carries(*joint, trunk))?;
    if hips == trunk || found.contains(&Some(hips)) || !is_near(tree, found, hips, [left, right]) {
        return None;
    }
    found[Role::Hips as usize] = Some(hips);
    if let (Some(first), None) = (named, found[Role::Spine as usize]) {
        found[Role::Spine as usize] = Some(first);
    }
    Some(RoleProblem::HipsByStructure { joint: tree.name(hips), named: named.map(|joint| tree.name(joint)) })
}

/// Whether a joint is about where a body has its hips, as far as the legs tell.
fn is_near(tree: Tree<'_>, found: &Found, joint: usize, thighs: [usize; 2]) -> bool {
    let at = |joint: usize| tree.position(joint);
    let ends = [Role::LeftFoot, Role::RightFoot, Role::LeftLowerLeg, Role::RightLowerLeg];
    let leg = ends.iter().find_map(|end| {
        let thigh = thighs[usize::from(end.name().starts_with("right"))];
        found[*end as usize].map(|end| at(end).distance(at(thigh)))
    });
    let middle = (at(thighs[0]) + at(thighs[1])) / 2.0;
    leg.is_none_or(|leg| leg == 0.0 || at(joint).distance(middle) <= FARTHEST * leg)
}
