//! Names for joints: the file's own, made readable and unique.

use std::borrow::Cow;
use std::collections::HashMap;

use crate::bvh::hierarchy::Node;
use crate::names::Namer;
use crate::warning::{Warning, Warnings, short};

/// A name that is built from another is not built from one that is longer: names built from names would
/// otherwise grow without bounds.
const LONGEST_BASE: usize = 200;

/// A name for each node: its own where it can keep it; `PARENT_end` for an end site; `joint_i` for others
/// without a name; repeats get `_2`, `_3`, …
pub(super) fn names(nodes: &[Node<'_>], warnings: &mut Warnings) -> Vec<String> {
    let own: Vec<Cow<'_, str>> = nodes.iter().map(|node| readable(node.name, warnings)).collect();
    let mut first: HashMap<&str, u32> = HashMap::with_capacity(nodes.len());
    for (idx, name) in (0u32..).zip(&own).filter(|(_, name)| !name.is_empty()) {
        first.entry(name.as_ref()).or_insert(idx);
    }
    let mut namer = Namer::new(&first);
    let mut names: Vec<String> = Vec::with_capacity(nodes.len());
    let mut unnamed: Option<(usize, String)> = None;
    for (idx, (node, name)) in (0u32..).zip(nodes.iter().zip(&own)) {
        let new = if name.is_empty() {
            let parent = node.parent.and_then(|p| names.get(p as usize));
            if let Some(parent) = parent.filter(|p| node.is_end_site && p.len() < LONGEST_BASE) {
                namer.give(&format!("{parent}_end"), true)
            } else {
                let given = namer.give(&format!("joint_{idx}"), true);
                if !node.is_end_site {
                    unnamed.get_or_insert_with(|| (0, given.clone())).0 += 1;
                }
                given
            }
        } else if first.get(name.as_ref()) == Some(&idx) {
            name.to_string()
        } else {
            let renamed = namer.give(name, false);
            warnings.push(|| Warning::Renamed { node: idx, name: short(name), renamed: short(&renamed) });
            renamed
        };
        names.push(new);
    }
    if let Some((count, first)) = unnamed {
        warnings.push(|| Warning::Unnamed { count, first });
    }
    names
}

/// A name as text: each byte that is not UTF-8 becomes a question mark.
fn readable<'t>(name: &'t [u8], warnings: &mut Warnings) -> Cow<'t, str> {
    if let Ok(name) = std::str::from_utf8(name) {
        return Cow::Borrowed(name);
    }
    let mut mended = String::with_capacity(name.len());
    for chunk in name.utf8_chunks() {
        mended.push_str(chunk.valid());
        mended.extend(chunk.invalid().iter().map(|_| '?'));
    }
    warnings.push(|| Warning::NameBytes { name: short(&mended) });
    Cow::Owned(mended)
}

/// Names as they stand in the file, of joints that are called otherwise in the rig.
pub(super) fn kept(nodes: &[Node<'_>], names: &[String]) -> Vec<(u32, Box<[u8]>)> {
    (0u32..)
        .zip(nodes.iter().zip(names))
        // An end site without a name is one again.
        .filter(|(_, (node, _))| !(node.is_end_site && node.name.is_empty()))
        .filter(|(_, (node, name))| node.is_end_site || node.name != name.as_bytes())
        .map(|(idx, (node, _))| (idx, Box::from(node.name)))
        .collect()
}
