//! The order of a document's nodes: the default scene's, parents first, children as the document lists them.

use crate::error::{ErrorKind, Fault};
use crate::gltf::document::{Document, Node};

/// No node.
pub(crate) const NONE: u32 = u32::MAX;

/// The tree of the default scene.
pub(crate) struct Tree {
    /// Nodes of the scene, parents before children.
    pub(crate) order: Vec<u32>,
    /// The parent of each node of the document, or [`NONE`].
    pub(crate) parent: Vec<u32>,
}

impl Tree {
    /// Checks that all nodes make trees, and orders those of the default scene.
    pub(crate) fn new(document: &Document<'_>) -> Result<Self, Fault> {
        if document.nodes.is_empty() {
            return Err(ErrorKind::NoNodes("document").into());
        }
        let parent = parents(&document.nodes)?;
        let top: Vec<u32> = (0..).zip(&parent).filter(|(_, p)| **p == NONE).map(|(node, _)| node).collect();
        // Each node has one parent at most, so what no root reaches lies on a cycle or below one.
        let all = walk(&document.nodes, &top);
        if all.len() < document.nodes.len() {
            let mut reached = vec![false; document.nodes.len()];
            for node in all {
                mark(&mut reached, node);
            }
            let lost = reached.iter().position(|r| !r).unwrap_or(0);
            let node = on_cycle(&parent, lost);
            return Err(Fault::at(format!("/nodes/{node}"), ErrorKind::Cycle { node }));
        }
        let Some(roots) = scene_roots(document, &parent)? else {
            return Ok(Self { order: all, parent });
        };
        let order = walk(&document.nodes, roots);
        if order.is_empty() {
            return Err(ErrorKind::NoNodes("default scene").into());
        }
        Ok(Self { order, parent })
    }
}

/// A node of the cycle that the ancestors of `node` end in.
fn on_cycle(parent: &[u32], node: usize) -> u32 {
    let above = |node: u32| parent.get(node as usize).copied().unwrap_or(NONE);
    let mut node = u32::try_from(node).unwrap_or(NONE);
    for _ in 0..parent.len() {
        node = above(node);
    }
    node
}

fn mark(flags: &mut [bool], node: u32) -> bool {
    flags.get_mut(node as usize).is_some_and(|flag| !std::mem::replace(flag, true))
}

fn parents(nodes: &[Node]) -> Result<Vec<u32>, Fault> {
    let mut parent = vec![NONE; nodes.len()];
    for (idx, node) in (0u32..).zip(nodes) {
        for (at, child) in node.children.iter().enumerate() {
            let pointer = || format!("/nodes/{idx}/children/{at}");
            let Some(slot) = parent.get_mut(*child as usize) else {
                return Err(out_of_range(pointer(), "node", *child, nodes.len()));
            };
            if *slot != NONE {
                let kind = ErrorKind::TwoParents { node: *child, first: *slot, second: idx };
                return Err(Fault::at(pointer(), kind));
            }
            *slot = idx;
        }
    }
    Ok(parent)
}

/// The error for an index beyond the end of its list.
pub(crate) fn out_of_range(pointer: String, what: &'static str, found: u32, count: usize) -> Fault {
    Fault::at(pointer, ErrorKind::OutOfRange { what, found: u64::from(found), count })
}

/// The roots of the default scene; `None` where the document has no scenes.
fn scene_roots<'d>(document: &'d Document<'_>, parent: &[u32]) -> Result<Option<&'d [u32]>, Fault> {
    let index = document.scene.unwrap_or(0);
    let Some(scene) = document.scenes.get(index as usize) else {
        return match document.scene {
            None => Ok(None),
            Some(index) => Err(out_of_range("/scene".to_owned(), "scene", index, document.scenes.len())),
        };
    };
    let mut listed = vec![false; parent.len()];
    for (at, node) in scene.nodes.iter().enumerate() {
        let pointer = || format!("/scenes/{index}/nodes/{at}");
        match parent.get(*node as usize) {
            None => return Err(out_of_range(pointer(), "node", *node, parent.len())),
            Some(&NONE) => {}
            Some(parent) => {
                let kind = ErrorKind::RootWithParent { node: *node, parent: *parent };
                return Err(Fault::at(pointer(), kind));
            }
        }
        if !mark(&mut listed, *node) {
            return Err(Fault::at(pointer(), ErrorKind::RootTwice { node: *node }));
        }
    }
    Ok(Some(&scene.nodes))
}

/// The roots and all below them, depth first; a list of its own in place of the stack, which has an end.
fn walk(nodes: &[Node], roots: &[u32]) -> Vec<u32> {
    let mut order = Vec::with_capacity(nodes.len());
    let mut open: Vec<u32> = roots.iter().rev().copied().collect();
    while let Some(idx) = open.pop() {
        order.push(idx);
        if let Some(node) = nodes.get(idx as usize) {
            open.extend(node.children.iter().rev());
        }
    }
    order
}
