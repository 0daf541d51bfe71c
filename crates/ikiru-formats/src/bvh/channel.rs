//! Channels: which numbers of a frame move a joint, and in which order.

use ikiru_rig::EulerOrder;

/// One number of a joint in each frame: a coordinate of its position, or an angle in degrees.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) struct Channel {
    /// 0 is x.
    pub(super) axis: u8,
    pub(super) is_position: bool,
}

impl Channel {
    const ALL: [(Self, &'static str); 6] = [
        (Self::position(0), "Xposition"),
        (Self::position(1), "Yposition"),
        (Self::position(2), "Zposition"),
        (Self::rotation(0), "Xrotation"),
        (Self::rotation(1), "Yrotation"),
        (Self::rotation(2), "Zrotation"),
    ];

    pub(super) const fn position(axis: u8) -> Self {
        Self { axis, is_position: true }
    }

    pub(super) const fn rotation(axis: u8) -> Self {
        Self { axis, is_position: false }
    }

    /// The channel of a word, in any case.
    pub(super) fn from_word(word: &[u8]) -> Option<Self> {
        Self::ALL.iter().find(|(_, name)| word.eq_ignore_ascii_case(name.as_bytes())).map(|(c, _)| *c)
    }

    pub(super) fn name(self) -> &'static str {
        Self::ALL.iter().find(|(channel, _)| *channel == self).map_or("", |(_, name)| name)
    }

    pub(super) fn axis(self) -> usize {
        usize::from(self.axis)
    }
}

/// The channels of a joint in their order, none of them twice.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) struct Channels {
    list: [Channel; 6],
    len: u8,
}

impl Channels {
    pub(super) const NONE: Self = Self { list: [Channel::position(0); 6], len: 0 };

    /// Adds a channel; says whether it was not there yet.
    pub(super) fn push(&mut self, channel: Channel) -> bool {
        if self.contains(channel) {
            return false;
        }
        if let Some(slot) = self.list.get_mut(usize::from(self.len)) {
            *slot = channel;
            self.len += 1;
        }
        true
    }

    /// Three rotations in an order, behind three positions if wanted.
    pub(super) fn complete(order: EulerOrder, with_positions: bool) -> Self {
        let mut channels = Self::NONE;
        if with_positions {
            (0..3).for_each(|axis| _ = channels.push(Channel::position(axis)));
        }
        order.axes().into_iter().for_each(|axis| _ = channels.push(Channel::rotation(axis as u8)));
        channels
    }

    /// These channels, with positions before the rotations if any was missing.
    pub(super) fn with_all_positions(self) -> Self {
        if self.n_positions() == 3 {
            return self;
        }
        let mut channels = Self::NONE;
        (0..3).for_each(|axis| _ = channels.push(Channel::position(axis)));
        self.as_slice().iter().for_each(|channel| _ = channels.push(*channel));
        channels
    }

    /// These channels, with rotations that were missing behind, in the order of which theirs is the start.
    pub(super) fn with_all_rotations(mut self, order: EulerOrder) -> Self {
        order.axes().into_iter().for_each(|axis| _ = self.push(Channel::rotation(axis as u8)));
        self
    }

    pub(super) fn one(channel: Channel) -> Self {
        let mut channels = Self::NONE;
        channels.push(channel);
        channels
    }

    pub(super) fn as_slice(&self) -> &[Channel] {
        self.list.get(..self.len()).unwrap_or_default()
    }

    pub(super) fn len(&self) -> usize {
        usize::from(self.len)
    }

    pub(super) fn contains(&self, channel: Channel) -> bool {
        self.as_slice().contains(&channel)
    }

    pub(super) fn has_positions(&self) -> bool {
        self.n_positions() > 0
    }

    pub(super) fn n_positions(&self) -> usize {
        self.as_slice().iter().filter(|c| c.is_position).count()
    }

    pub(super) fn n_rotations(&self) -> usize {
        self.len() - self.n_positions()
    }

    /// The axis of the first position, the first rotation.
    pub(super) fn first_axis(&self, is_position: bool) -> Option<usize> {
        self.as_slice().iter().find(|c| c.is_position == is_position).map(|c| c.axis())
    }

    /// The order of the rotations; axes without a channel come last.
    pub(super) fn order(&self) -> EulerOrder {
        let mut axes: Vec<usize> =
            self.as_slice().iter().filter(|c| !c.is_position).map(|c| c.axis()).collect();
        if axes.is_empty() {
            return DEFAULT_ORDER;
        }
        let missing: Vec<usize> = (0..3).filter(|axis| !axes.contains(axis)).collect();
        axes.extend(missing);
        EulerOrder::ALL.into_iter().find(|order| order.axes()[..] == axes[..]).unwrap_or(DEFAULT_ORDER)
    }
}

/// The order that is written where a rig has none: the one that most files have.
pub(super) const DEFAULT_ORDER: EulerOrder = EulerOrder::Zxy;
