//! One residual in many lanes: memory to go through them one by one.

use ikiru_rig::{Frame, LaneScalar, Scalar};

/// Memory in which one lane at a time is evaluated, of numbers `S`; it grows to what it needs once, and is kept by the
/// caller. See [`Residual::evaluate_lanes`](crate::Residual::evaluate_lanes).
#[derive(Clone, Debug)]
pub struct LaneScratch<S> {
    frames: Vec<Frame<S>>,
    residual: Vec<S>,
}

impl<S> Default for LaneScratch<S> {
    fn default() -> Self {
        Self { frames: Vec::new(), residual: Vec::new() }
    }
}

impl<S: Scalar> LaneScratch<S> {
    /// Calls a function for each lane with its number, its frames and its residual (zeros), and puts what that holds
    /// then back into the lane.
    pub fn lane_by_lane<L: LaneScalar<N, Lane = S>, const N: usize>(
        &mut self,
        frames: &[Frame<L>],
        residual: &mut [L],
        mut evaluate: impl FnMut(usize, &[Frame<S>], &mut [S]),
    ) {
        for lane in 0..N {
            self.frames.clear();
            self.frames.extend(frames.iter().map(|frame| frame.map(|number| number.lane(lane))));
            self.residual.clear();
            self.residual.resize(residual.len(), S::zero());
            evaluate(lane, &self.frames, &mut self.residual);
            for (row, value) in residual.iter_mut().zip(&self.residual) {
                row.set_lane(lane, *value);
            }
        }
    }
}
