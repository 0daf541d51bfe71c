//! Which of some joints carries others, and which one carries everything that moves: of a rig or of a builder, whose parents may be
//! wrong.

use crate::humanoid::Role;
use crate::joint::{Joint, JointId, JointMotion};
use crate::limit::Range;
use crate::rig_error::RigError;

/// The lowest joint at or above all of the given ones.
pub(crate) fn carrier(joints: &[Joint], is_given: &[bool]) -> Option<usize> {
    let n_given = is_given.iter().filter(|given| **given).count();
    let mut carries: Vec<usize> = is_given.iter().map(|given| usize::from(*given)).collect();
    // Children stand behind their parents: backwards, each has all of its own when it is added to its parent.
    for idx in (0..joints.len()).rev() {
        if carries[idx] == n_given {
            return (n_given > 0).then_some(idx);
        }
        if let Some(parent) = joints[idx].parent.filter(|parent| parent.index() < idx) {
            carries[parent.index()] += carries[idx];
        }
    }
    None
}

/// The joint that is to float.
pub(crate) fn root_of(joints: &[Joint]) -> Result<usize, RigError> {
    let mut is_given: Vec<bool> = joints.iter().map(|joint| joint.motion != JointMotion::Fixed).collect();
    if !is_given.contains(&true) {
        return Err(RigError::NoRoot);
    }
    if let Some(body) = body_of(joints) {
        // What moves above the body carries it without being a part of it.
        line(joints, body).skip(1).for_each(|joint| is_given[joint] = false);
        is_given[body] = true;
    }
    let Some(lowest) = carrier(joints, &is_given) else { return Err(apart(joints, &is_given)) };
    let fail = |joint: usize| {
        let Joint { name, motion, .. } = &joints[joint];
        RigError::CannotFloat { joint: name.clone(), motion: motion.name() }
    };
    let root = line(joints, lowest).find(|joint| !joints[*joint].motion.is_scalar());
    let root = root.ok_or_else(|| fail(lowest))?;
    match joints[root].motion {
        JointMotion::Euler { ranges, .. } if !ranges.iter().all(Range::is_unlimited) => Err(fail(root)),
        JointMotion::Fixed
        | JointMotion::Hinge { .. }
        | JointMotion::Slider { .. }
        | JointMotion::Euler { .. }
        | JointMotion::Ball { .. }
        | JointMotion::Free { .. } => Ok(root),
    }
}

/// What carries every bone of a humanoid: its hips, where the rig hangs together as a body does.
fn body_of(joints: &[Joint]) -> Option<usize> {
    let has_role: Vec<bool> = joints.iter().map(|joint| joint.role.is_some()).collect();
    joints.iter().any(|joint| joint.role == Some(Role::Hips)).then(|| carrier(joints, &has_role)).flatten()
}

/// Two joints that nothing carries together.
fn apart(joints: &[Joint], is_given: &[bool]) -> RigError {
    let top = |joint: usize| line(joints, joint).last();
    let mut given = (0..joints.len()).filter(|joint| is_given[*joint]);
    let first = given.next();
    let second = given.find(|joint| Some(top(*joint)) != first.map(top));
    let name = |joint: Option<usize>| joint.map_or_else(String::new, |joint| joints[joint].name.clone());
    RigError::NoCommonRoot { first: name(first), second: name(second) }
}

/// The joint itself, its parent, and so on up to the root; a builder's may be wrong, and no walk minds.
pub(crate) fn line(joints: &[Joint], joint: usize) -> impl Iterator<Item = usize> + '_ {
    let parent = |idx: &usize| joints[*idx].parent.map(JointId::index).filter(|parent| parent < idx);
    std::iter::successors(Some(joint), parent)
}
