//! The tree of joints as lines begin with it.

use ikiru_rig::{JointId, Rig};

use crate::output;

/// Deeper branches are drawn at this depth: a chain of ten thousand joints stays readable.
const MOST_DEPTH: usize = 24;

/// Each joint with its branch of the tree, depth first.
pub(super) fn rows(rig: &Rig) -> Vec<(String, JointId)> {
    let mut children: Vec<Vec<JointId>> = vec![Vec::new(); rig.n_joints()];
    let mut roots = Vec::new();
    for (id, joint) in rig.ids().zip(rig.joints()) {
        match joint.parent {
            Some(parent) => children[parent.index()].push(id),
            None => roots.push(id),
        }
    }
    let mut rows = Vec::with_capacity(rig.n_joints());
    // A joint, what stands before its branch, and whether it has a branch and is the last of its siblings.
    let mut open: Vec<(JointId, String, Option<bool>, usize)> =
        roots.into_iter().rev().map(|id| (id, String::new(), None, 0)).collect();
    while let Some((id, before, branch, depth)) = open.pop() {
        let joint = rig.get(id).map_or("", |j| &j.name);
        let (own, below) = match branch {
            None => ("", ""),
            Some(true) => ("└─ ", "   "),
            Some(false) => ("├─ ", "│  "),
        };
        rows.push((format!("{before}{own}{}", output::printable(joint)), id));
        let inner = if depth < MOST_DEPTH { format!("{before}{below}") } else { before };
        let list = &children[id.index()];
        for (idx, child) in list.iter().enumerate().rev() {
            open.push((*child, inner.clone(), Some(idx + 1 == list.len()), depth + 1));
        }
    }
    rows
}
