//! Which joint is which humanoid bone, by the joints' names.

use std::collections::HashMap;

use crate::humanoid::Role;
use crate::humanoid::facing;
use crate::humanoid::problem::RoleProblem;
use crate::humanoid::structure;
use crate::humanoid::table::{Pick, Table, table};
use crate::humanoid::tree::{Found, Tree};
use crate::joint::{Joint, JointId};
use crate::rig::Rig;

/// The roles that a rig's names tell.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Assignment {
    /// Every role once and every joint once at most, in the order of [`Role::ALL`]. Empty for a rig that is no
    /// humanoid.
    pub roles: Vec<(Role, JointId)>,
    /// The naming scheme that explains the most of them: `mixamo`, `smpl-x`, …; `None` for no humanoid.
    pub scheme: Option<&'static str>,
    /// Where names and skeleton contradict each other, and what was made of it.
    pub problems: Vec<RoleProblem>,
}

impl Assignment {
    /// The roles that VRM requires of every humanoid and that no joint has.
    #[must_use]
    pub fn missing(&self) -> Vec<Role> {
        Role::REQUIRED.into_iter().filter(|role| self.roles.iter().all(|(found, _)| found != role)).collect()
    }
}

/// A scheme must explain so many of the required roles. A pair of legs or one hand is no humanoid.
const FEWEST: usize = 6;

/// Gives roles to the joints of a rig by their names.
///
/// Names are compared without case, separators and namespace, those of the table's schemes one scheme at a
/// time; the one that explains the most joints wins, the earlier one of two that explain as many. A joint
/// also counts under the other names that it answers to. A joint that does not hang below the joint of the
/// role above its own loses its role. Where legs and trunk hang side by side, what carries both is the hips,
/// whatever it is called. Left and right are checked by position at rest: a character whose front
/// (both feet, else the eyes, else the jaw) tells that its left side lies on the right is mirrored, and left
/// and right change places; without a front the names are believed.
#[must_use]
pub fn assign(rig: &Rig) -> Assignment {
    of_joints(rig.joints())
}

pub(super) fn of_joints(joints: &[Joint]) -> Assignment {
    let (table, tree) = (table(), Tree(joints));
    let hits = hits(table, joints);
    let mut best: Option<(usize, &'static str, Found, Vec<RoleProblem>)> = None;
    for (idx, scheme) in table.schemes.iter().enumerate() {
        let mut found: Found = [None; Role::ALL.len()];
        for (rule_idx, rule) in scheme.rules.iter().enumerate() {
            if let Some(hits) = hits.get(&(idx, rule_idx)) {
                deal(&rule.roles, rule.pick, hits, tree, &mut found);
            }
        }
        let required =
            |found: &Found| Role::REQUIRED.iter().filter(|r| found[**r as usize].is_some()).count();
        if required(&found) < FEWEST {
            continue;
        }
        let mut problems = Vec::from_iter(structure::hips(tree, &mut found));
        problems.extend(check_order(tree, &mut found));
        let count = found.iter().flatten().count();
        if required(&found) >= FEWEST && best.as_ref().is_none_or(|(most, ..)| count > *most) {
            best = Some((count, scheme.name, found, problems));
        }
    }
    let Some((_, scheme, mut found, mut problems)) = best else { return Assignment::default() };
    problems.extend(facing::check(tree, &mut found));
    let roles = Role::ALL
        .into_iter()
        .filter_map(|role| found[role as usize].map(|joint| (role, JointId::from_index(joint))))
        .collect();
    Assignment { roles, scheme: Some(scheme), problems }
}

/// The joints that bear names of each rule, as `(rank of the name, joint)`; of one name the first joint.
type Hits = HashMap<(usize, usize), Vec<(usize, usize)>>;

fn hits(table: &Table, joints: &[Joint]) -> Hits {
    let (mut hits, mut scratch) = (Hits::new(), String::new());
    for (idx, joint) in joints.iter().enumerate() {
        for name in std::iter::once(&joint.name).chain(&joint.aliases) {
            for entry in table.get(name, &mut scratch) {
                let of_rule = hits.entry((entry.scheme, entry.rule)).or_default();
                if of_rule.iter().all(|(rank, other)| *rank != entry.rank && *other != idx) {
                    of_rule.push((entry.rank, idx));
                }
            }
        }
    }
    hits
}

/// Gives the roles of one rule to joints that have none yet.
fn deal(roles: &[Role], pick: Pick, hits: &[(usize, usize)], tree: Tree<'_>, found: &mut Found) {
    let mut free: Vec<(usize, usize)> = hits.to_vec();
    free.retain(|(_, joint)| !found.contains(&Some(*joint)));
    free.sort_unstable();
    if roles.len() > 1 || pick != Pick::Named {
        // Stable: at the same depth the earlier name first.
        free.sort_by_cached_key(|(_, joint)| tree.depth(*joint));
    }
    let joints: Vec<usize> = free.into_iter().map(|(_, joint)| joint).collect();
    match pick {
        Pick::Lowest => found[roles[0] as usize] = joints.last().copied(),
        Pick::Spread if joints.len() > roles.len() => {
            // By number, not by length: the same bone for every body of a kind.
            let chosen = [joints[0], joints[joints.len() / 2], joints[joints.len() - 1]];
            for (role, joint) in roles.iter().zip(chosen) {
                found[*role as usize] = Some(joint);
            }
        }
        _ => {
            for (role, joint) in roles.iter().zip(joints) {
                found[*role as usize] = Some(joint);
            }
        }
    }
}

/// Takes roles away until every one hangs below those above it, the worst misfit first.
fn check_order(tree: Tree<'_>, found: &mut Found) -> Vec<RoleProblem> {
    let by_joint: HashMap<usize, Role> =
        Role::ALL.iter().filter_map(|role| found[*role as usize].map(|joint| (joint, *role))).collect();
    // For each role, the roles of the joints above its own, as bits.
    let mut above = [0u64; Role::ALL.len()];
    for (joint, role) in &by_joint {
        for ancestor in tree.line(*joint).skip(1).filter_map(|joint| by_joint.get(&joint)) {
            above[*role as usize] |= 1 << (*ancestor as usize);
        }
    }
    let mut problems = Vec::new();
    loop {
        let mut misfits: [Vec<Role>; Role::ALL.len()] = std::array::from_fn(|_| Vec::new());
        for role in Role::ALL.into_iter().filter(|role| found[*role as usize].is_some()) {
            for ancestor in role.ancestors().filter(|ancestor| found[*ancestor as usize].is_some()) {
                if above[role as usize] & (1 << (ancestor as usize)) == 0 {
                    misfits[role as usize].push(ancestor);
                    misfits[ancestor as usize].push(role);
                }
            }
        }
        // Of those as bad the last: the deeper bone.
        let Some(worst) = Role::ALL.into_iter().max_by_key(|role| misfits[*role as usize].len()) else {
            break;
        };
        let Some(other) = misfits[worst as usize].first().copied() else { break };
        let name = |role: Role| found[role as usize].map_or_else(String::new, |joint| tree.name(joint));
        problems.push(RoleProblem::Order {
            role: worst,
            joint: name(worst),
            other,
            other_joint: name(other),
        });
        found[worst as usize] = None;
    }
    problems
}
