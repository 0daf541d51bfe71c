//! The `HIERARCHY` of a file: a tree of blocks, read without recursion.

use ikiru_rig::RigBuilder;

use crate::bvh::channel::{Channel, Channels};
use crate::bvh::scan::{Scanner, Word};
use crate::error::{ErrorKind, Fault};
use crate::warning::short;

/// A block: a root, a joint or an end site.
#[derive(Clone, Debug)]
pub(super) struct Node<'t> {
    /// As it stands in the file; empty for none.
    pub(super) name: &'t [u8],
    pub(super) parent: Option<u32>,
    pub(super) is_end_site: bool,
    pub(super) offset: [f64; 3],
    pub(super) channels: Channels,
    /// Where its numbers start in a frame.
    pub(super) first_channel: u32,
}

/// All blocks, parents first, and how many numbers a frame has.
#[derive(Debug)]
pub(super) struct Hierarchy<'t> {
    pub(super) nodes: Vec<Node<'t>>,
    pub(super) n_channels: u32,
}

/// A block that is not closed yet.
struct Open {
    node: u32,
    /// Where its name stands, for messages.
    at: usize,
    has_offset: bool,
    has_channels: bool,
}

const IN_BLOCK: &str = "OFFSET, CHANNELS, JOINT, End Site or }";
const CHANNEL: &str = "a channel: Xposition, Yposition, Zposition, Xrotation, Yrotation or Zrotation";

/// Reads up to and with the word `MOTION`.
pub(super) fn parse<'t>(scanner: &mut Scanner<'t>) -> Result<Hierarchy<'t>, Fault> {
    let word = scanner.word();
    if !word.is("HIERARCHY") {
        return Err(scanner.unexpected(word, "HIERARCHY, with which a BVH file begins"));
    }
    let mut hierarchy = Hierarchy { nodes: Vec::new(), n_channels: 0 };
    let mut open: Vec<Open> = Vec::new();
    loop {
        let word = scanner.word();
        let Some(block) = open.last_mut() else {
            if word.is("ROOT") {
                open.push(hierarchy.open(scanner, word, None, false)?);
                continue;
            }
            if word.is("MOTION") && !hierarchy.nodes.is_empty() {
                return Ok(hierarchy);
            }
            let expected = if hierarchy.nodes.is_empty() { "ROOT" } else { "ROOT or MOTION" };
            return Err(scanner.unexpected(word, expected));
        };
        if word.is("OFFSET") {
            if std::mem::replace(&mut block.has_offset, true) {
                return Err(hierarchy.repeated(scanner, word, block, "an OFFSET"));
            }
            let offset = [scanner.number()?, scanner.number()?, scanner.number()?];
            hierarchy.set(block.node, |node| node.offset = offset);
        } else if word.is("CHANNELS") {
            if std::mem::replace(&mut block.has_channels, true) {
                return Err(hierarchy.repeated(scanner, word, block, "CHANNELS"));
            }
            hierarchy.channels(scanner, block)?;
        } else if word.is("JOINT") || word.is("End") {
            let parent = block.node;
            open.push(hierarchy.open(scanner, word, Some(parent), word.is("End"))?);
        } else if word.is("}") {
            if !block.has_offset {
                let joint = hierarchy.name(block.node);
                return Err(scanner.fault(block.at, ErrorKind::Missing { joint, what: "OFFSET" }));
            }
            open.pop();
        } else {
            return Err(scanner.unexpected(word, IN_BLOCK));
        }
    }
}

impl<'t> Hierarchy<'t> {
    /// The start of a block, up to its brace.
    fn open(
        &mut self,
        scanner: &mut Scanner<'t>,
        keyword: Word<'t>,
        parent: Option<u32>,
        is_end_site: bool,
    ) -> Result<Open, Fault> {
        if is_end_site && scanner.peek().is("Site") {
            scanner.word();
        }
        let name = scanner.name();
        let brace = scanner.word();
        if !brace.is("{") {
            return Err(scanner.unexpected(brace, "{ after the name"));
        }
        let most = RigBuilder::MOST_JOINTS;
        if self.nodes.len() >= most {
            return Err(scanner.fault(keyword.at, ErrorKind::TooMany { most }));
        }
        let node = self.nodes.len() as u32;
        let channels = Channels::NONE;
        let first_channel = self.n_channels;
        self.nodes.push(Node {
            name: name.text,
            parent,
            is_end_site,
            offset: [0.0; 3],
            channels,
            first_channel,
        });
        Ok(Open { node, at: keyword.at, has_offset: false, has_channels: false })
    }

    /// The count and names of a joint's channels.
    fn channels(&mut self, scanner: &mut Scanner<'t>, block: &Open) -> Result<(), Fault> {
        let word = scanner.word();
        let count = std::str::from_utf8(word.text).ok().and_then(|t| t.parse::<u8>().ok());
        let Some(count @ 0..=6) = count else {
            return Err(scanner.unexpected(word, "a number of channels, 0 to 6"));
        };
        let mut channels = Channels::NONE;
        for _ in 0..count {
            let word = scanner.word();
            let channel = Channel::from_word(word.text).ok_or_else(|| scanner.unexpected(word, CHANNEL))?;
            if !channels.push(channel) {
                return Err(self.repeated(scanner, word, block, channel.name()));
            }
        }
        let first_channel = self.n_channels;
        self.n_channels += u32::from(count);
        self.set(block.node, |node| (node.channels, node.first_channel) = (channels, first_channel));
        Ok(())
    }

    fn set(&mut self, node: u32, set: impl FnOnce(&mut Node<'t>)) {
        if let Some(node) = self.nodes.get_mut(node as usize) {
            set(node);
        }
    }

    fn repeated(&self, scanner: &Scanner<'t>, word: Word<'t>, block: &Open, what: &'static str) -> Fault {
        scanner.fault(word.at, ErrorKind::Repeated { joint: self.name(block.node), what })
    }

    /// A block's name for messages.
    fn name(&self, node: u32) -> String {
        let own = |node: u32| self.nodes.get(node as usize).map_or(&b""[..], |n| n.name);
        let parent = self.nodes.get(node as usize).filter(|n| n.is_end_site).and_then(|n| n.parent);
        match (own(node), parent.map(own)) {
            (b"", None | Some(b"")) => "without a name".to_owned(),
            (b"", Some(parent)) => format!("{}_end", short(&String::from_utf8_lossy(parent))),
            (own, _) => short(&String::from_utf8_lossy(own)),
        }
    }
}
