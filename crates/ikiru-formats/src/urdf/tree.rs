//! The tree that joints make of links: one root, and one joint above every other link.

use std::collections::HashMap;

use crate::urdf::document::{Document, JointElement};
use crate::urdf::element::Owner;
use crate::urdf::names;
use crate::urdf::problem::UrdfProblem;
use crate::urdf::trouble::Trouble;
use crate::warning::short;

/// The links and joints of a document, parents first. All positions are those in the document's lists.
pub(crate) struct Tree {
    /// The link without a parent.
    pub(crate) root: usize,
    /// The joints, each one after the joint above its parent link.
    pub(crate) order: Vec<usize>,
    /// The joint above each link; [`NONE`] for the root.
    pub(crate) above: Vec<usize>,
    /// The parent link of each joint.
    pub(crate) parent: Vec<usize>,
}

/// No joint.
pub(crate) const NONE: usize = usize::MAX;

impl Tree {
    /// Checks that all links hang together as one tree.
    pub(crate) fn new(document: &Document<'_>) -> Result<Self, Trouble> {
        let (text, links, joints) = (document.text, &document.links, &document.joints);
        let index = names::index(text, "link", links.iter().map(|link| (&link.name, link.at)))?;
        let (mut parent, mut child) = (Vec::with_capacity(joints.len()), Vec::with_capacity(joints.len()));
        let mut above = vec![NONE; links.len()];
        for (position, joint) in joints.iter().enumerate() {
            parent.push(find(document, &index, joint, "parent", &joint.parent)?);
            let link = find(document, &index, joint, "child", &joint.child)?;
            if let Some(first) = joints.get(above[link]) {
                let (first, first_line) = (short(&first.name), text.line(first.at));
                let problem = UrdfProblem::TwoParents { link: short(&joint.child), first, first_line };
                return Err(owner(joint).fault(joint.at, problem));
            }
            above[link] = position;
            child.push(link);
        }
        let root = root(document, &above, &parent)?;
        let order = walk(root, &parent, &child, links.len());
        // Each link has one parent at most, so what the root does not reach lies on a circle or below one.
        if order.len() < joints.len() {
            let mut is_reached = vec![false; joints.len()];
            for joint in order {
                is_reached[joint] = true;
            }
            let lost = is_reached.iter().position(|reached| !reached).unwrap_or(0);
            return Err(cycle(document, &above, &parent, lost));
        }
        Ok(Self { root, order, above, parent })
    }
}

/// The joints below a link, depth first and in the order of the document; a list of its own in place of the
/// stack, which has an end.
fn walk(root: usize, parent: &[usize], child: &[usize], n_links: usize) -> Vec<usize> {
    // Linked lists of the joints below each link, made from the back so that the first comes first.
    let (mut first_below, mut next) = (vec![NONE; n_links], vec![NONE; parent.len()]);
    for (joint, link) in parent.iter().enumerate().rev() {
        next[joint] = std::mem::replace(&mut first_below[*link], joint);
    }
    let mut order = Vec::with_capacity(parent.len());
    let mut open = vec![first_below[root]];
    while let Some(joint) = open.pop() {
        if joint != NONE {
            order.push(joint);
            open.push(next[joint]);
            open.push(first_below[child[joint]]);
        }
    }
    order
}

fn owner<'d>(joint: &'d JointElement<'_>) -> Owner<'d> {
    Owner { what: "joint", name: &joint.name }
}

fn find(
    document: &Document<'_>,
    index: &HashMap<&str, usize>,
    joint: &JointElement<'_>,
    end: &'static str,
    name: &str,
) -> Result<usize, Trouble> {
    index.get(name).copied().ok_or_else(|| {
        let name = names::unknown(name, document.links.iter().map(|link| &*link.name));
        owner(joint).fault(joint.at, UrdfProblem::UnknownLink { end, name })
    })
}

/// The only link that is nobody's child.
fn root(document: &Document<'_>, above: &[usize], parent: &[usize]) -> Result<usize, Trouble> {
    let mut roots = above.iter().enumerate().filter(|(_, joint)| **joint == NONE).map(|(link, _)| link);
    match (roots.next(), roots.next()) {
        (Some(root), None) => Ok(root),
        (None, _) if document.links.is_empty() => Err(Trouble::of_file(UrdfProblem::NoLinks)),
        (None, _) => Err(cycle(document, above, parent, 0)),
        (Some(first), Some(second)) => {
            let (first, second) = (&document.links[first], &document.links[second]);
            let owner = Owner { what: "link", name: &second.name };
            let (first, first_line) = (short(&first.name), document.text.line(first.at));
            Err(owner.fault(second.at, UrdfProblem::TwoRoots { first, first_line }))
        }
    }
}

/// The error for the circle that the ancestors of a joint end in.
fn cycle(document: &Document<'_>, above: &[usize], parent: &[usize], joint: usize) -> Trouble {
    const MOST_NAMES: usize = 8;
    let up = |joint: usize| above[parent[joint]];
    let on_it = (0..parent.len()).fold(joint, |joint, _| up(joint));
    let start = &document.joints[on_it];
    let mut links = format!("'{}'", short(&start.child));
    let mut joint = on_it;
    for n_names in 1.. {
        if n_names == MOST_NAMES {
            links.push_str(" under ...");
            break;
        }
        links.push_str(&format!(" under '{}'", short(&document.joints[joint].parent)));
        joint = up(joint);
        if joint == on_it {
            break;
        }
    }
    owner(start).fault(start.at, UrdfProblem::Cycle { links })
}
