//! Names for joints: the nodes' own, made unique.

use std::collections::HashMap;

use crate::gltf::document::Node;
use crate::names::Namer;
use crate::warning::{Warning, Warnings, short};

/// The names of the nodes in `order` that cannot keep their own: the unnamed become `node_i`, repeats get
/// `_2`, `_3`, … and no new name is one that a node bears.
pub(crate) fn new_names(nodes: &[Node], order: &[u32], warnings: &mut Warnings) -> HashMap<u32, String> {
    let name = |node: u32| nodes.get(node as usize).map_or("", |n| n.name.as_str());
    let mut first: HashMap<&str, u32> = HashMap::with_capacity(order.len());
    for node in order {
        first.entry(name(*node)).or_insert(*node);
    }
    let mut namer = Namer::new(&first);
    let mut names = HashMap::new();
    let mut unnamed: Option<(usize, String)> = None;
    for node in order.iter().filter(|n| name(**n).is_empty()) {
        let given = namer.give(&format!("node_{node}"), true);
        unnamed = Some(unnamed.map_or_else(|| (1, given.clone()), |(count, first)| (count + 1, first)));
        names.insert(*node, given);
    }
    if let Some((count, first)) = unnamed {
        warnings.push(|| Warning::Unnamed { count, first });
    }
    for node in order {
        let own = name(*node);
        if !own.is_empty() && first.get(own) != Some(node) {
            let renamed = namer.give(own, false);
            warnings.push(|| Warning::Renamed { node: *node, name: short(own), renamed: short(&renamed) });
            names.insert(*node, renamed);
        }
    }
    names
}
