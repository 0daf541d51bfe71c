//! What an objective sees of a pose.

use ikiru_rig::{Frame, JointMotion};

use crate::objective::places::JointRead;

/// A joint's own motion, as an objective sees it.
#[derive(Clone, Copy, Debug)]
pub struct JointCoords<'a> {
    /// How it moves.
    pub motion: &'a JointMotion,
    /// Its coordinates: angles (radians), offsets (metres), a quaternion x, y, z, w; as in a pose.
    pub coords: &'a [f64],
}

/// What an objective sees when it is evaluated: what it [reads](crate::Objective::reads), in its order.
#[derive(Clone, Copy, Debug)]
pub struct View<'a> {
    pub(crate) frames: &'a [Frame<f64>],
    /// The frames at earlier samples, one after the other.
    pub(crate) earlier: &'a [Frame<f64>],
    pub(crate) motions: &'a [JointRead],
    pub(crate) coords: &'a [f64],
}

impl<'a> View<'a> {
    /// `world_from_joint` of one of its frames.
    ///
    /// # Panics
    /// When it does not read so many.
    #[inline(always)]
    #[must_use]
    pub fn frame(&self, idx: usize) -> &'a Frame<f64> {
        &self.frames[idx]
    }

    /// `world_from_joint` of one of its frames so many samples earlier, from 1.
    ///
    /// # Panics
    /// When it does not read so many frames or [earlier](crate::Reads::earlier) samples.
    #[inline]
    #[must_use]
    pub fn earlier(&self, back: usize, idx: usize) -> &'a Frame<f64> {
        &self.earlier[(back - 1) * self.frames.len() + idx]
    }

    /// `world_from_joint` of all its frames.
    #[inline(always)]
    #[must_use]
    pub fn frames(&self) -> &'a [Frame<f64>] {
        self.frames
    }

    /// How one of the joints is moved whose own motions it reads.
    ///
    /// # Panics
    /// When it does not read so many.
    #[inline(always)]
    #[must_use]
    pub fn motion(&self, idx: usize) -> JointCoords<'a> {
        let read = &self.motions[idx];
        JointCoords { motion: &read.motion, coords: &self.coords[read.coord..read.coord + read.n_coords] }
    }
}
