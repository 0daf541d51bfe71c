//! BVH: motion capture's text format, a skeleton of offsets with channels of angles, and a table of frames.
//!
//! # What becomes of a file
//! - Every `ROOT`, `JOINT` and `End Site` is a joint, in the order of the file. An end site without a name
//!   is called after its parent, `Head_end`, and does not move.
//! - Rotation channels turn a joint by their product from left to right: `Zrotation Xrotation Yrotation` is
//!   `Rz · Rx · Ry`. Three are [`JointMotion::Euler`](ikiru_rig::JointMotion::Euler) in that order, without ranges; two
//!   are the same with the range `[0, 0]` for the third angle; one is a hinge.
//! - A joint with position channels is [`JointMotion::Free`](ikiru_rig::JointMotion::Free): every root that has some,
//!   and every other joint whose positions change over the clip. (Many exporters give every joint six
//!   channels and repeat its offset in each frame: such a joint is what its rotations make it, its offset
//!   that of the frames.) With one rotation channel or none the cone of the free joint allows no more than
//!   that; a joint with one position channel alone is a slider. The translation comes before the rotation,
//!   in whatever order the channels stand.
//! - Whether positions come on top of a joint's `OFFSET` or stand in its place is not written in a file, and
//!   both kinds exist. [`PositionChannels`] says how it is found out.
//! - Lengths have no unit: [`BvhOptions::scale`] says how many metres one is.
//!
//! # What is written
//! A rig that was read from BVH is written with its own structure: names, offsets, channels in their order,
//! end sites, unit. Angles of Euler joints and hinges are written as the pose has them. Channels that could not hold
//! what a joint does are made complete.
//!
//! Any other rig is written as a body that the strictest readers take: one `ROOT`, joints, and an `End Site` wherever
//! a joint has nothing below it.
//! - Joints that move or have a role are written, with what lies between them and what hangs on them. The root is the
//!   lowest joint above all of these (for a hinge, the one above it), in its place in the world; what stands beside or
//!   above it does not move and is left out, as are nodes for meshes and cameras. Where no joint is above all, a root is
//!   made that holds them together and stays at 0.
//! - All are written in their own local frames: `OFFSET` is the rest translation and the channels carry
//!   rest times motion, so that world frames come back in every frame. BVH has no rest rotations: a viewer
//!   that shows the skeleton with all channels at zero shows it straightened. The root and joints that translate
//!   have six channels, whose positions are the whole translation, and the `OFFSET` 0, so that it does not
//!   matter how a reader combines the two; a hinge about a coordinate axis has one channel; all others have three,
//!   `Zrotation Xrotation Yrotation` or the order of the joint's own angles. Lengths are metres.
//! - A fixed joint at the end of a chain that is not turned at rest is an end site itself; another end of a chain gets
//!   one where its bone would end if it went on as far as it came.
//! - Names become single words, each of them once, with a [`Warning`](crate::Warning) that tells the new one.
//!
//! Every rotation can be written as three angles in many ways. The first frame has the middle one within ±90° and
//! the others within ±180°; each other frame those nearest to the frame before, so that what a player puts between two
//! frames goes the short way. Where a joint passes near gimbal lock, two of its angles have to turn fast all the same.

pub(crate) mod read;
pub(crate) mod write;

mod angles;
mod channel;
mod hierarchy;
mod motion;
mod names;
mod scan;
mod tree;
mod write_plan;

use channel::Channels;

/// How to read a BVH file.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct BvhOptions {
    /// Metres per unit of the file: 0.01 for centimetres. Multiplies offsets and positions. The default is 1.
    pub scale: f64,
    /// How positions go with offsets.
    pub positions: PositionChannels,
}

impl Default for BvhOptions {
    fn default() -> Self {
        Self { scale: 1.0, positions: PositionChannels::Detect }
    }
}

/// How a joint's position channels go with its `OFFSET`. It is one way for all joints of a file.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
#[non_exhaustive]
pub enum PositionChannels {
    /// What the frames suggest: each joint with both votes, by whether its mean position is nearer to the
    /// offset ([`InPlace`](Self::InPlace)) or to zero ([`OnTop`](Self::OnTop)) along the offset's direction;
    /// the majority decides, the first of them where votes are equal. On top where there are no frames.
    #[default]
    Detect,
    /// Positions are added to the offset.
    OnTop,
    /// Positions stand in place of the offset (that of axes with a channel).
    InPlace,
}

/// What a file says that a rig does not hold: needed to write the same structure again.
#[derive(Debug)]
pub(crate) struct Layout {
    /// One for each joint of the rig.
    joints: Vec<JointLayout>,
    /// Names as they stand in the file, of joints that are called otherwise in the rig, with the joints'
    /// positions in order; empty for none.
    names: Vec<(u32, Box<[u8]>)>,
    /// Metres per unit.
    scale: f64,
    /// Whether positions stand in place of offsets.
    in_place: bool,
    /// Seconds from frame to frame.
    frame_time: f64,
    /// The file's name.
    file: String,
}

impl Layout {
    /// A joint's name in the file, if it is another than in the rig.
    fn name(&self, joint: u32) -> Option<&[u8]> {
        let at = self.names.binary_search_by_key(&joint, |(idx, _)| *idx).ok()?;
        self.names.get(at).map(|(_, name)| &name[..])
    }
}

/// How one joint stands in a file.
#[derive(Clone, Copy, Debug)]
struct JointLayout {
    /// In the file's unit.
    offset: [f64; 3],
    channels: Channels,
    /// Where its numbers start in a frame.
    first_channel: u32,
    is_end_site: bool,
}

/// What joints with position channels suggest, given as offset, channels and mean position: whether most
/// positions stand in place of offsets.
fn are_in_place(joints: impl Iterator<Item = ([f64; 3], Channels, [f64; 3])>) -> bool {
    let (mut votes, mut first) = (0i64, None);
    for (mut offset, channels, mean) in joints {
        (0..3u8).zip(&mut offset).for_each(|(axis, offset)| {
            if !channels.contains(channel::Channel::position(axis)) {
                *offset = 0.0;
            }
        });
        let (offset, mean) = (glam::DVec3::from_array(offset), glam::DVec3::from_array(mean));
        if offset.length() < 1e-12 {
            continue;
        }
        let in_place = mean.dot(offset) > 0.5 * offset.length_squared();
        first.get_or_insert(in_place);
        votes += if in_place { 1 } else { -1 };
    }
    if votes == 0 { first.unwrap_or(false) } else { votes > 0 }
}
