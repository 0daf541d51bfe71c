//! The order of joints in which a layout goes through a rig.

use ikiru_rig::{JointId, Rig};

/// All joints, each with everything below it in one run.
pub(super) fn depth_first(rig: &Rig) -> Vec<JointId> {
    let n = rig.n_joints();
    // Children as linked lists, filled from the back so that they come out in order.
    let (mut first_child, mut next_sibling) = (vec![None; n], vec![None; n]);
    let mut first_root = None;
    for id in rig.ids().rev() {
        let head = match rig.joints()[id.index()].parent {
            Some(parent) => &mut first_child[parent.index()],
            None => &mut first_root,
        };
        next_sibling[id.index()] = head.replace(id);
    }
    let mut order = Vec::with_capacity(n);
    let mut stack = Vec::from_iter(first_root);
    while let Some(id) = stack.pop() {
        order.push(id);
        stack.extend(next_sibling[id.index()]);
        stack.extend(first_child[id.index()]);
    }
    order
}
