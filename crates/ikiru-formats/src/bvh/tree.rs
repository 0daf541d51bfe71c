//! Which joints of a rig a file has, and in which order: one tree, with an end site at every leaf.

use glam::{DQuat, DVec3};
use ikiru_rig::{JointId, JointMotion, Rig};

/// What stands in a file's hierarchy, in its order.
#[derive(Debug)]
pub(super) struct Tree {
    pub(super) entries: Vec<Entry>,
    /// From the world to the parent of the first entry: what stands above it in the rig, none of which moves.
    pub(super) world_from_top: (DQuat, DVec3),
}

/// One block of the hierarchy.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Entry {
    pub(super) kind: Kind,
    pub(super) depth: usize,
}

#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) enum Kind {
    /// A joint of the rig.
    Joint(JointId),
    /// A joint of the rig that a file tells only the place of.
    EndSite(JointId),
    /// The root over several trees, which the rig does not have.
    Join,
    /// The tip of a joint that has nothing below it.
    Tip(JointId),
}

impl Tree {
    /// All joints of a rig, as the file that it was read from has them.
    pub(super) fn of_file(rig: &Rig) -> Self {
        let tops: Vec<JointId> = rig.ids().filter(|id| parent(rig, *id).is_none()).collect();
        let mut tree = Self::empty();
        tree.walk(&tops, &children(rig, |_| true), 0, Kind::Joint, false);
        tree
    }

    /// The joints of a rig that is to be written as a body: those that `matter` (they move, or have a role), what
    /// lies between and above them, and what hangs on them.
    ///
    /// The root is the lowest joint above all that matter, and what is above it is left out: nothing there moves.
    /// A hinge keeps the joint above it for a root, since a root has channels for all that a body does. Where no
    /// joint is above all of them, a root is made that the rig does not have.
    /// `is_thing` says which joints are none of a skeleton: where nothing but such hangs below, they are left out.
    pub(super) fn of_body(
        rig: &Rig,
        matters: impl Fn(JointId) -> bool,
        is_thing: impl Fn(JointId) -> bool,
    ) -> Self {
        let mut matters: Vec<bool> = rig.ids().map(matters).collect();
        if !matters.contains(&true) {
            matters.fill(true);
        }
        let n_matter = matters.iter().filter(|matters| **matters).count();
        let mut n_below: Vec<usize> = matters.iter().map(|matters| usize::from(*matters)).collect();
        let mut has_skeleton: Vec<bool> = rig.ids().map(|id| matters[id.index()] || !is_thing(id)).collect();
        for id in rig.ids().rev() {
            if let Some(parent) = parent(rig, id) {
                n_below[parent.index()] += n_below[id.index()];
                has_skeleton[parent.index()] |= has_skeleton[id.index()];
            }
        }
        // Parents precede children: the last joint with all of them below is the lowest.
        let lowest = rig.ids().rev().find(|id| n_below[id.index()] == n_matter);
        let top = lowest.map(|lowest| match (rig.get(lowest).map(|j| j.motion), parent(rig, lowest)) {
            (Some(JointMotion::Hinge { .. } | JointMotion::Slider { .. }), Some(above)) => above,
            (Some(JointMotion::Hinge { .. } | JointMotion::Slider { .. }), None)
            | (
                Some(
                    JointMotion::Fixed
                    | JointMotion::Euler { .. }
                    | JointMotion::Ball { .. }
                    | JointMotion::Free { .. },
                )
                | None,
                _,
            ) => lowest,
        });
        let mut is_written = vec![false; rig.n_joints()];
        for id in rig.ids() {
            let hangs =
                parent(rig, id).is_some_and(|parent| is_written[parent.index()] && matters[parent.index()]);
            is_written[id.index()] = n_below[id.index()] > 0 || (hangs && has_skeleton[id.index()]);
            // What hangs on what hangs is written too.
            matters[id.index()] |= hangs;
        }
        let children = children(rig, |id| is_written[id.index()]);
        let kind = |id: JointId| {
            let is_only = parent(rig, id).is_some_and(|parent| children[parent.index()].len() == 1);
            let is_bare =
                rig.get(id).is_some_and(|j| j.motion == JointMotion::Fixed && !is_turned(j.rest_rotation));
            let is_leaf = children[id.index()].is_empty();
            if is_only && is_bare && is_leaf && Some(id) != top { Kind::EndSite(id) } else { Kind::Joint(id) }
        };
        let mut tree = Self::empty();
        if let Some(top) = top {
            tree.world_from_top = world_from_parent(rig, top);
            tree.walk(&[top], &children, 0, kind, true);
        } else {
            tree.entries.push(Entry { kind: Kind::Join, depth: 0 });
            let tops = rig.ids().filter(|id| parent(rig, *id).is_none() && is_written[id.index()]);
            tree.walk(&tops.collect::<Vec<_>>(), &children, 1, kind, true);
        }
        tree
    }

    fn empty() -> Self {
        Self { entries: Vec::new(), world_from_top: (DQuat::IDENTITY, DVec3::ZERO) }
    }

    /// Adds trees, depth first; without recursion, for rigs of any depth.
    fn walk(
        &mut self,
        tops: &[JointId],
        children: &[Vec<JointId>],
        depth: usize,
        kind: impl Fn(JointId) -> Kind,
        with_tips: bool,
    ) {
        let mut open: Vec<(JointId, usize)> = tops.iter().rev().map(|top| (*top, depth)).collect();
        while let Some((id, depth)) = open.pop() {
            let kind = kind(id);
            self.entries.push(Entry { kind, depth });
            let below = children.get(id.index()).map_or(&[][..], Vec::as_slice);
            open.extend(below.iter().rev().map(|child| (*child, depth + 1)));
            if with_tips && below.is_empty() && matches!(kind, Kind::Joint(_)) {
                self.entries.push(Entry { kind: Kind::Tip(id), depth: depth + 1 });
            }
        }
    }
}

fn parent(rig: &Rig, id: JointId) -> Option<JointId> {
    rig.get(id).and_then(|joint| joint.parent)
}

fn children(rig: &Rig, is_written: impl Fn(JointId) -> bool) -> Vec<Vec<JointId>> {
    let mut children: Vec<Vec<JointId>> = vec![Vec::new(); rig.n_joints()];
    for id in rig.ids().filter(|id| is_written(*id)) {
        if let Some(parent) = parent(rig, id) {
            children[parent.index()].push(id);
        }
    }
    children
}

/// Whether a rest rotation is one.
pub(super) fn is_turned(rotation: DQuat) -> bool {
    rotation.xyz().length() > 1e-12
}

/// What stands above a joint, at rest.
fn world_from_parent(rig: &Rig, id: JointId) -> (DQuat, DVec3) {
    let above = rig.ancestors(id).skip(1).filter_map(|id| rig.get(id));
    above.fold((DQuat::IDENTITY, DVec3::ZERO), |(rotation, translation), joint| {
        let turned = joint.rest_rotation * translation + joint.rest_translation;
        ((joint.rest_rotation * rotation).normalize(), turned)
    })
}
