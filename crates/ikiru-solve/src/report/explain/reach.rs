//! How far a target is out of reach, wherever the joints are: a bound by the lengths of links alone.

use glam::DVec3;
use ikiru_rig::JointMotion;

use crate::layout::{Layout, NONE};
use crate::state::State;

/// Less than this, relative to the distances at hand, is rounding.
const ROUNDING: f64 = 1e-9;

/// A chain of links as a point at its end sees it: a centre that no joint of the chain moves, and how long the links are.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Chain {
    /// World, metres.
    pub(crate) centre: DVec3,
    /// The lengths of all links together, each at its longest.
    pub(crate) longest: f64,
    /// Shortest and longest of the link for which their sum is the largest.
    widest: f64,
}

impl Chain {
    /// The joints between a point (joint's frame) of a node and another node above it, or the world, whose frame stays.
    /// `None` where one of them translates without end.
    pub(crate) fn above(layout: &Layout, state: &State, node: u32, point: DVec3, end: u32) -> Option<Self> {
        let mut chain = Self {
            centre: state.frames()[node as usize].point(point.into()).value(),
            longest: 0.0,
            widest: 0.0,
        };
        // Half of the way that sliders move the centre along: of the first one, and the length of all others.
        let (mut along, mut around) = (DVec3::ZERO, 0.0);
        let mut at = node;
        while at != end && at != NONE {
            let joint = &layout.nodes[at as usize];
            match joint.motion {
                JointMotion::Fixed => {}
                JointMotion::Free { .. } => return None,
                JointMotion::Slider { .. } => {
                    let (factor, offset) = joint.mimic.unwrap_or((1.0, 0.0));
                    let dof = joint.dof as usize;
                    let ends = [layout.lower[dof], layout.upper[dof]].map(|end| factor * end + offset);
                    if !(ends[0] - ends[1]).is_finite() {
                        return None;
                    }
                    let now = factor * state.coords[joint.coord as usize] + offset;
                    let axis = state.directions(joint)[0].value();
                    chain.centre += axis * (0.5 * (ends[0] + ends[1]) - now);
                    let half = axis * (0.5 * (ends[1] - ends[0]));
                    if along == DVec3::ZERO {
                        along = half;
                    } else {
                        around += half.length();
                    }
                }
                JointMotion::Hinge { .. } | JointMotion::Euler { .. } | JointMotion::Ball { .. } => {
                    let pivot = state.frames()[at as usize].origin.value();
                    chain.add(chain.centre - pivot, along, around);
                    (chain.centre, along, around) = (pivot, DVec3::ZERO, 0.0);
                }
            }
            at = joint.parent;
        }
        chain.add(DVec3::ZERO, along, around);
        Some(chain)
    }

    /// Adds a link: a vector give or take `along`, and `around` in any direction.
    fn add(&mut self, link: DVec3, along: DVec3, around: f64) {
        let longest = (link + along).length().max((link - along).length()) + around;
        let part = if along == DVec3::ZERO { 0.0 } else { link.dot(along) / along.length_squared() };
        let shortest = ((link - along * part.clamp(-1.0, 1.0)).length() - around).max(0.0);
        self.longest += longest;
        self.widest = self.widest.max(shortest + longest);
    }

    /// By how much a point is further away than the links reach, or nearer than they fold; 0 where that does not say
    /// that it is out of reach.
    pub(crate) fn misses(&self, target: DVec3) -> f64 {
        let distance = self.centre.distance(target);
        let (beyond, within) = (distance - self.longest, self.widest - self.longest - distance);
        let missing = beyond.max(within);
        if missing > ROUNDING * (distance + self.longest) { missing } else { 0.0 }
    }
}

/// The nearest node at or above both.
pub(crate) fn common(layout: &Layout, a: u32, b: u32) -> u32 {
    let above = |node: u32| {
        std::iter::successors((node != NONE).then_some(node), |at| {
            let parent = layout.nodes[*at as usize].parent;
            (parent != NONE).then_some(parent)
        })
    };
    above(a).find(|at| above(b).any(|other| other == *at)).unwrap_or(NONE)
}
