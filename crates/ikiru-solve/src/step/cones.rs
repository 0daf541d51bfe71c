//! Cones of balls in the step of a motion: an edge that holds a ball back is one row along its normal, at its sample.
//!
//! In the tangent space of a ball its cone is a box along axes of its own, which differ from sample to sample, so that what
//! it holds is no degree of freedom over time. A hard row does the same, `n·δ = way`, for as long as its force holds the ball
//! back. Where the cost pushes against the edge of a swing, sliding along it falls back inside: the edge's bend times the
//! push is curvature along the other axes (`step/ball.rs`), one row each.

use glam::DVec3;
use ikiru_rig::TangentBox;

use crate::algebra::room::{MostRows, make_room};
use crate::algebra::sample_rows::SampleRows;
use crate::layout::Layout;
use crate::state::motion::MotionState;
use crate::step::active::{inside, would_pull};
use crate::step::ball::{Ball, Blocked};
use crate::step::system::MOST_DIRECT_ROWS;

/// A ball at one sample.
#[derive(Clone, Copy, Debug)]
struct BallAtSample {
    ball: usize,
    sample: usize,
    limits: TangentBox,
    /// What cannot move in this iteration.
    blocked: Blocked,
    /// How far each axis goes that is held in the current round.
    held: [Option<f64>; 3],
}

impl BallAtSample {
    fn along(&self, n: usize, balls: &[Ball], delta: &[f64]) -> [f64; 3] {
        let at = self.sample * n + balls[self.ball].dof;
        let turn = DVec3::from_slice(&delta[at..at + 3]);
        self.limits.readers.map(|reader| reader.dot(turn))
    }
}

/// An axis of a place, as a row.
#[derive(Clone, Copy, Debug)]
pub(crate) struct HeldAxis {
    place: usize,
    axis: usize,
    /// The residual of its row.
    pub(crate) residual: f64,
}

/// All balls with cones at all samples that are planned.
#[derive(Clone, Debug, Default)]
pub(crate) struct Cones {
    n_dofs: usize,
    balls: Vec<Ball>,
    /// The row of the layout that the rows of each ball are.
    row_of_ball: Vec<usize>,
    /// Sample by sample.
    places: Vec<BallAtSample>,
    /// Samples in the order in which their rows are taken in, as long as there is room for them: those at which
    /// something is wanted first.
    by_need: Vec<usize>,
    has_room: Vec<bool>,
    /// How many rows each sample has.
    needed: Vec<usize>,
}

impl Cones {
    pub(crate) fn new(layout: &Layout, rows: &mut SampleRows) -> Self {
        let balls: Vec<Ball> = Ball::all(layout).collect();
        let row_of_ball = balls.iter().map(|ball| rows.add_support(ball.dof..ball.dof + 3)).collect();
        Self { n_dofs: layout.n_dofs, balls, row_of_ball, ..Self::default() }
    }

    /// Takes over the samples of a motion.
    pub(crate) fn fit(&mut self, state: &MotionState) {
        let is_keyed = |t: &usize| state.keyed.binary_search(t).is_ok();
        self.by_need.clear();
        self.by_need.extend(state.keyed.iter().copied());
        self.by_need.extend((0..state.n_samples).filter(|t| !is_keyed(t)));
        self.has_room.clear();
        self.has_room.resize(state.n_samples, true);
        self.needed.resize(state.n_samples, 0);
    }

    /// Makes room for all balls at all samples that are planned, beside so many rows of other things; the answer is the
    /// most rows that they may have.
    pub(crate) fn make_room(&mut self, state: &MotionState, n_others: usize) -> MostRows {
        let n_planned = state.is_given.iter().filter(|given| !**given).count();
        let room = MOST_DIRECT_ROWS.saturating_sub(n_others);
        let n_places = if n_others > MOST_DIRECT_ROWS { 0 } else { n_planned * self.balls.len() };
        make_room(&mut self.places, n_places);
        let rows = room.min(3 * n_places);
        MostRows { rows, entries: 3 * rows, parts: 0, blocks: rows.min(n_planned) }
    }

    /// Finds the limits at the coordinates of the state, and which of them block for half a gradient. Where the system
    /// is solved iteratively there are none, and cones hold by projection alone.
    pub(crate) fn begin(
        &mut self,
        layout: &Layout,
        state: &MotionState,
        is_iterative: bool,
        gradient: &[f64],
    ) {
        self.places.clear();
        if is_iterative {
            return;
        }
        let (n, nc) = (layout.n_dofs, layout.n_coords);
        for sample in (0..state.n_samples).filter(|t| !state.is_given[*t]) {
            for (ball, b) in self.balls.iter().enumerate() {
                let limits = b.limits(&state.coords[sample * nc..(sample + 1) * nc]);
                let at = sample * n + b.dof;
                let pull = DVec3::from_slice(&gradient[at..at + 3]);
                let mut blocked = Blocked::of(&limits, limits.axes.map(|axis| axis.dot(pull)));
                // One bound for both: with that of each axis, a motion of `tests/all/motion_cones.rs` ends too far above its optimum.
                let most = blocked.bends.into_iter().fold(0.0, f64::max);
                blocked.bends = [0.0, most, most];
                self.places.push(BallAtSample { ball, sample, limits, blocked, held: [None; 3] });
            }
        }
    }

    /// Whether there is no ball to hold: the rows of the state are all that there are.
    pub(crate) fn is_idle(&self) -> bool {
        self.places.is_empty()
    }

    /// Holds what is blocked, and nothing else.
    pub(crate) fn open(&mut self) {
        for place in &mut self.places {
            place.held = place.blocked.axes.map(|blocked| blocked.then_some(0.0));
        }
    }

    /// Adds the rows of one sample to those that a step is solved over: what is held, and bends. For each, `source` hears
    /// what it is.
    pub(crate) fn push_to(&self, sample: usize, rows: &mut SampleRows, mut source: impl FnMut(HeldAxis)) {
        if !self.has_room[sample] {
            return;
        }
        let first = self.places.partition_point(|place| place.sample < sample);
        for (idx, place) in self.places.iter().enumerate().skip(first) {
            if place.sample > sample {
                break;
            }
            let (dof, row) = (self.balls[place.ball].dof, self.row_of_ball[place.ball]);
            for axis in 0..3 {
                let (factor, way, compliance) = match place.held[axis] {
                    Some(way) => (1.0, way, 0.0),
                    None if place.blocked.bends[axis] > 0.0 => (place.blocked.bends[axis].sqrt(), 0.0, 1.0),
                    None => continue,
                };
                let normal = place.limits.readers[axis].to_array();
                rows.push(row, -factor * way, |_, k| factor * normal[k - dof]);
                if let Some(last) = rows.compliance.last_mut() {
                    *last = compliance;
                }
                source(HeldAxis { place: idx, axis, residual: -factor * way });
            }
        }
    }

    /// Finds the samples whose rows there is room for.
    pub(crate) fn find_room(&mut self, n_rows: usize, state: &MotionState) {
        let mut needed = std::mem::take(&mut self.needed);
        needed.clear();
        needed.resize(state.n_samples, 0);
        for place in &self.places {
            let has_row = |axis: &usize| place.held[*axis].is_some() || place.blocked.bends[*axis] > 0.0;
            needed[place.sample] += (0..3).filter(has_row).count();
        }
        let mut room = MOST_DIRECT_ROWS.saturating_sub(n_rows);
        for &sample in &self.by_need {
            self.has_room[sample] = needed[sample] <= room;
            if self.has_room[sample] {
                room -= needed[sample];
            }
        }
        self.needed = needed;
    }

    /// Holds what a step takes across a limit at that limit; says whether there was something.
    pub(crate) fn hold_crossed(&mut self, delta: &[f64]) -> bool {
        let mut crossed = false;
        for place in &mut self.places {
            let along = place.along(self.n_dofs, &self.balls, delta);
            for ((held, along), room) in place.held.iter_mut().zip(along).zip(place.limits.room) {
                let inside = inside(room, along);
                if held.is_none() && inside != along {
                    (crossed, *held) = (true, Some(inside));
                }
            }
        }
        crossed
    }

    /// Lets go of an axis whose multiplier says that its limit would have to pull; says whether it was so.
    pub(crate) fn let_go(&mut self, held: HeldAxis, multiplier: f64) -> bool {
        let place = &mut self.places[held.place];
        let Some(way) = place.held[held.axis] else { return false };
        let pulls = would_pull(place.limits.room[held.axis], way, -multiplier, 0.0);
        if pulls {
            (place.held[held.axis], place.blocked.axes[held.axis]) = (None, false);
        }
        pulls
    }

    /// Cuts off what is still beyond a limit.
    pub(crate) fn clamp(&self, delta: &mut [f64]) {
        for place in &self.places {
            let along = place.along(self.n_dofs, &self.balls, delta);
            let mut turn = DVec3::ZERO;
            for axis in 0..3 {
                let way =
                    if place.blocked.axes[axis] { 0.0 } else { inside(place.limits.room[axis], along[axis]) };
                turn += way * place.limits.axes[axis];
            }
            let at = place.sample * self.n_dofs + self.balls[place.ball].dof;
            delta[at..at + 3].copy_from_slice(&turn.to_array());
        }
    }

    /// What edges add to the curvature along a step.
    pub(crate) fn bend_of(&self, delta: &[f64]) -> f64 {
        let bent = self.places.iter().filter(|place| place.blocked.bends != [0.0; 3]);
        bent.map(|place| {
            let along = place.along(self.n_dofs, &self.balls, delta);
            place.blocked.bends.iter().zip(along).map(|(bend, way)| bend * way * way).sum::<f64>()
        })
        .sum()
    }
}
