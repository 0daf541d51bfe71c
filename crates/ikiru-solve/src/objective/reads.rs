//! What an objective reads of a rig, and the rows that it may open.

use ikiru_rig::{JointId, Rig};

use crate::objective::{MOST_EARLIER, MOST_PARTS, MOST_ROWS, Unfit, UnfitReason};
use crate::words::{Sense, Unit};

/// Some rows of an objective that belong together: the loss is applied to their length, and a tolerance holds for it.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Part {
    /// The most rows that may be opened at once.
    pub most_rows: usize,
    /// What they are measured in.
    pub unit: Unit,
    /// What each of them wants.
    pub sense: Sense,
    /// Whether each row reads the own motion of one joint and nothing else.
    pub is_separable: bool,
}

impl Part {
    /// Rows that want to be 0.
    #[must_use]
    pub const fn new(most_rows: usize, unit: Unit) -> Self {
        Self { most_rows, unit, sense: Sense::Equal, is_separable: false }
    }

    /// Rows that want to be at least 0.
    #[must_use]
    pub const fn at_least(most_rows: usize, unit: Unit) -> Self {
        Self { sense: Sense::AtLeast, ..Self::new(most_rows, unit) }
    }

    /// Rows that want to be 0, each of which reads the own motion of one joint and nothing else: a step needs only their
    /// gradient and a bound on their curvature, so that there may be many.
    #[must_use]
    pub const fn separable(most_rows: usize, unit: Unit) -> Self {
        Self { is_separable: true, ..Self::new(most_rows, unit) }
    }
}

/// What a term reads, and the rows that it may open, as [`Objective::reads`](crate::Objective::reads) named them.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
#[non_exhaustive]
pub struct TermReads {
    /// The joints whose world frames it reads, in its order.
    pub frames: Vec<JointId>,
    /// The joints whose own motions it reads, in its order.
    pub motions: Vec<JointId>,
    /// Its parts.
    pub parts: Vec<Part>,
    /// Whether it has a potential.
    pub has_potential: bool,
    /// At how many earlier samples of a motion it reads the same frames.
    pub n_earlier: usize,
    /// Whether its derivatives come by dual numbers, which need memory.
    pub(crate) is_by_duals: bool,
}

impl TermReads {
    pub(crate) fn clear(&mut self) {
        self.frames.clear();
        self.motions.clear();
        self.parts.clear();
        self.has_potential = false;
        self.n_earlier = 0;
        self.is_by_duals = false;
    }
}

/// Where an objective names what it reads.
#[derive(Debug)]
pub struct Reads<'a> {
    rig: &'a Rig,
    of: &'a mut TermReads,
}

impl<'a> Reads<'a> {
    /// Nothing is named yet.
    pub(crate) fn new(rig: &'a Rig, of: &'a mut TermReads) -> Self {
        of.clear();
        Self { rig, of }
    }

    /// The rig that the objective has to fit.
    #[must_use]
    pub fn rig(&self) -> &Rig {
        self.rig
    }

    /// Reads the world frame of a joint: the next [frame](crate::View::frame) of the view.
    ///
    /// # Errors
    /// A joint that the rig does not have.
    #[inline]
    pub fn frame(&mut self, joint: JointId) -> Result<(), Unfit> {
        self.check(joint)?;
        self.of.frames.push(joint);
        Ok(())
    }

    /// Reads the world frames of several joints, in this order.
    ///
    /// # Errors
    /// A joint that the rig does not have.
    pub fn frames(&mut self, joints: &[JointId]) -> Result<(), Unfit> {
        joints.iter().try_for_each(|joint| self.frame(*joint))
    }

    /// Reads the own motion of a joint, wherever the body is: the next [motion](crate::View::motion) of the view.
    ///
    /// # Errors
    /// A joint that the rig does not have, or that follows another.
    #[inline]
    pub fn motion(&mut self, joint: JointId) -> Result<(), Unfit> {
        self.check(joint)?;
        if self.rig.joints()[joint.index()].mimic.is_some() {
            return Err(Unfit::of_joint(UnfitReason::ReadsFollower, joint));
        }
        self.of.motions.push(joint);
        Ok(())
    }

    /// Adds a part; they count from 0, in this order.
    ///
    /// # Errors
    /// More than [`MOST_PARTS`], or a part of too many rows.
    #[inline]
    pub fn part(&mut self, part: Part) -> Result<(), Unfit> {
        if self.of.parts.len() == MOST_PARTS {
            return Err(UnfitReason::Parts.into());
        }
        if part.most_rows > MOST_ROWS && !part.is_separable {
            return Err(UnfitReason::Rows.into());
        }
        self.of.parts.push(part);
        Ok(())
    }

    /// Has a potential by the motions that it reads: a value that no rows make up. See [`Rows::add_value`](crate::Rows::add_value).
    pub fn potential(&mut self) {
        self.of.has_potential = true;
    }

    /// Reads the same frames at so many samples before, too: at most [`MOST_EARLIER`]. It then belongs in a motion, where
    /// it holds from the first sample on that has as many before it.
    ///
    /// # Errors
    /// More of them.
    pub fn earlier(&mut self, n_samples: usize) -> Result<(), Unfit> {
        if n_samples > MOST_EARLIER {
            return Err(UnfitReason::Earlier.into());
        }
        self.of.n_earlier = n_samples;
        Ok(())
    }

    /// Has derivatives by dual numbers.
    pub(crate) fn by_duals(&mut self) {
        self.of.is_by_duals = true;
    }

    #[inline]
    fn check(&self, joint: JointId) -> Result<(), Unfit> {
        if joint.index() < self.rig.n_joints() {
            Ok(())
        } else {
            Err(Unfit::of_joint(UnfitReason::NoJoint, joint))
        }
    }
}
