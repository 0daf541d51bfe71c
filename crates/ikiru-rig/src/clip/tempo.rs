//! The fastest tempo along the way of a clip at which limits hold, never faster than the clip itself.
//!
//! Let `τ` be the time of the clip, `t` that of its slowed copy, `σ = dτ/dt` the tempo, `x = σ²` and `u = dσ/dt`. Then a
//! joint's velocity is `q' σ` and its acceleration `q'' x + q' u`, and over `τ` the slope of `x` is `2u`. In `(x, u)`
//! every limit is a convex set around 0, so that two passes find the largest `x` everywhere: one from the end, which
//! says from where the rest can still be done, and one from the start, as fast as that allows (Pham and Pham, *A new
//! approach to time-optimal path parameterization based on reachability analysis*, 2018).

use super::Clip;
use super::curve::{Curve, Dofs};
use super::rate_limit::RateLimit;
use super::rates::Rate;

/// In how many steps of the slowed clip the tempo may at most fall from that of the original to a stop: where only
/// speeds are limited, nothing else would keep it from changing at once, which the steps could not follow.
const STOP_STEPS: f64 = 8.0;

/// How many cells there are a step of the slowed clip, at the original's tempo.
const CELLS_PER_STEP: f64 = 2.0;

/// An acceleration's limit in one place, as a share of what it may be: `‖p x + q u‖ ≤ 1`.
#[derive(Clone, Copy)]
struct Bound {
    pp: f64,
    pq: f64,
    qq: f64,
}

impl Bound {
    fn new(p: &[f64], q: &[f64], most: f64) -> Self {
        let dot = |a: &[f64], b: &[f64]| a.iter().zip(b).map(|(a, b)| (a / most) * (b / most)).sum();
        Self { pp: dot(p, p), pq: dot(p, q), qq: dot(q, q) }
    }

    /// From where to where `u` may go at some `x`, where `share` of the limit may be used; `None` where nowhere.
    fn room(&self, x: f64, share: f64) -> Option<[f64; 2]> {
        // qq u² + 2 b u + c ≤ 0
        let (b, c) = (self.pq * x, self.pp * x * x - share * share);
        if self.qq < f64::MIN_POSITIVE {
            return (c <= 0.0).then_some([f64::NEG_INFINITY, f64::INFINITY]);
        }
        let quarter = b * b - self.qq * c;
        if quarter.is_nan() || quarter < 0.0 {
            return None;
        }
        // The root that does not lose digits, and the other by the product of both.
        let sum = -(b + quarter.sqrt().copysign(b));
        let (one, other) = (sum / self.qq, if sum == 0.0 { 0.0 } else { c / sum });
        Some([one.min(other), one.max(other)])
    }
}

/// How much of what limits allow is used, from above 0 to 1.
#[derive(Clone, Copy, Debug)]
pub(super) struct Share {
    pub(super) speed: f64,
    pub(super) acceleration: f64,
}

impl Share {
    /// All of it.
    pub(super) const FULL: Self = Self { speed: 1.0, acceleration: 1.0 };
}

/// The way of a clip in small cells, with what limits mean in each.
pub(super) struct Way {
    /// Where cells meet, in seconds of the clip.
    secs: Vec<f64>,
    /// The largest `x` in each cell by the limits of speed, at most 1.
    most: Vec<f64>,
    /// Limits of acceleration, cell after cell.
    bounds: Vec<Bound>,
    n_bounds: usize,
    /// The largest `|u|`.
    steepest: f64,
}

impl Way {
    /// The way of a clip with at least two poses that is to have `rate_hz` poses a second once it is slowed.
    pub(super) fn new(clip: &Clip, limits: &[RateLimit], rate_hz: f64) -> Self {
        let mut way = Self {
            secs: vec![clip.times[0]],
            most: Vec::new(),
            bounds: Vec::new(),
            n_bounds: 3 * limits.iter().filter(|limit| limit.rate == Rate::Acceleration).count(),
            steepest: rate_hz / STOP_STEPS,
        };
        for before in 0..clip.times.len() - 1 {
            let curves: Vec<(&RateLimit, Curve<'_>)> =
                limits.iter().map(|limit| (limit, Curve::new(clip, limit.joint, before))).collect();
            let (start, end) = (clip.times[before], clip.times[before + 1]);
            let n_cells = n_cells(end - start, rate_hz);
            for cell in 0..n_cells as usize {
                let (from, to) = (cell as f64 / n_cells, (cell + 1) as f64 / n_cells);
                let secs = if to < 1.0 { start + (end - start) * to } else { end };
                way.secs.push(secs);
                way.push_cell(clip, &curves, [from, to]);
            }
        }
        way
    }

    /// How many numbers a way keeps at most.
    pub(super) fn n_numbers(clip: &Clip, limits: &[RateLimit], rate_hz: f64) -> f64 {
        let cells: f64 = clip.times.windows(2).map(|times| n_cells(times[1] - times[0], rate_hz)).sum();
        cells * (9.0 * limits.len() as f64 + 8.0)
    }

    fn push_cell(&mut self, clip: &Clip, curves: &[(&RateLimit, Curve<'_>)], [from, to]: [f64; 2]) {
        let mut most = 1.0_f64;
        for (limit, curve) in curves {
            let dofs = limit.part.dofs(clip.rig(), limit.joint);
            let own = |all: Dofs| -> Vec<f64> { all[dofs.clone()].to_vec() };
            let at = [from, 0.5 * (from + to), to];
            let velocities = at.map(|u| own(curve.velocity(u)));
            if limit.rate == Rate::Speed {
                for velocity in &velocities {
                    let share = limit.most / velocity.iter().map(|v| v * v).sum::<f64>().sqrt();
                    // No speed at all is no limit of the tempo.
                    most = if share < 1.0 { most.min(share * share) } else { most };
                }
                continue;
            }
            let secs = (to - from) * curve.secs;
            let [a, _, b] = &velocities;
            let combined = |of: &dyn Fn(f64, f64) -> f64| -> Vec<f64> {
                a.iter().zip(b).map(|(a, b)| of(*a, *b)).collect()
            };
            // At the start; at the end, where x is 2 u · secs larger; and on average, which sees what happens at
            // once inside.
            let start = own(curve.acceleration(from));
            let end = own(curve.acceleration(to));
            let end_slope: Vec<f64> = b.iter().zip(&end).map(|(v, a)| v + 2.0 * secs * a).collect();
            let mean = combined(&|a, b| (b - a) / secs);
            let mean_slope = combined(&|a, b| 0.5 * (a + b) + (b - a));
            self.bounds.push(Bound::new(&start, a, limit.most));
            self.bounds.push(Bound::new(&end, &end_slope, limit.most));
            self.bounds.push(Bound::new(&mean, &mean_slope, limit.most));
        }
        self.most.push(most);
    }

    /// Where cells meet, in seconds of the clip.
    pub(super) fn secs(&self) -> &[f64] {
        &self.secs
    }

    /// How many cells there are.
    pub(super) fn n_cells(&self) -> usize {
        self.most.len()
    }

    /// The square of the tempo wherever cells meet, the largest at which `shares` of the limits (one a cell) hold.
    pub(super) fn squared_tempo(&self, shares: &[Share]) -> Vec<f64> {
        let n_cells = self.n_cells();
        let cap = |cell: usize| self.most[cell] * shares[cell].speed.powi(2);
        // From the end: the largest x from which the rest can be done.
        let mut most = vec![cap(n_cells - 1); n_cells + 1];
        for cell in (0..n_cells).rev() {
            let cap = if cell > 0 { cap(cell).min(cap(cell - 1)) } else { cap(cell) };
            most[cell] = self.largest(cell, cap, most[cell + 1].min(self.most[cell]), shares[cell]);
        }
        // From the start: as fast as that allows.
        for cell in 0..n_cells {
            let (x, next) = (most[cell], most[cell + 1]);
            let fastest = match self.room(cell, x, next, shares[cell].acceleration) {
                Some([_, u]) => x + 2.0 * u * self.length(cell),
                // Only rounding can leave no room; as if nothing changed.
                None => x,
            };
            most[cell + 1] = fastest.clamp(0.0, next);
        }
        most
    }

    /// The largest `x` up to `cap` at the start of a cell from which its end can be reached with at most `next`.
    fn largest(&self, cell: usize, cap: f64, next: f64, share: Share) -> f64 {
        let is_possible = |x: f64| self.room(cell, x, next, share.acceleration).is_some();
        if is_possible(cap) {
            return cap;
        }
        // An even tempo is possible where it is slow enough.
        let even = self.bounds(cell).iter().map(|bound| share.acceleration / bound.pp.sqrt());
        let (mut low, mut high) = (even.fold(cap.min(next), f64::min), cap);
        // To the last digits of a number as small as `low` may be.
        for _ in 0..60 {
            let middle = 0.5 * (low + high);
            if is_possible(middle) {
                low = middle;
            } else {
                high = middle;
            }
            if high - low <= 1e-14 * low {
                break;
            }
        }
        low
    }

    /// From where to where `u` may go in a cell that is entered with `x` and left with `next` at most.
    fn room(&self, cell: usize, x: f64, next: f64, share: f64) -> Option<[f64; 2]> {
        let twice = 2.0 * self.length(cell);
        let mut room = [(-x / twice).max(-self.steepest), ((next - x) / twice).min(self.steepest)];
        for bound in self.bounds(cell) {
            let [low, high] = bound.room(x, share)?;
            room = [room[0].max(low), room[1].min(high)];
        }
        (room[0] <= room[1]).then_some(room)
    }

    fn bounds(&self, cell: usize) -> &[Bound] {
        &self.bounds[cell * self.n_bounds..(cell + 1) * self.n_bounds]
    }

    fn length(&self, cell: usize) -> f64 {
        self.secs[cell + 1] - self.secs[cell]
    }
}

/// Into how many cells the way between two poses is cut.
fn n_cells(secs: f64, rate_hz: f64) -> f64 {
    (secs * rate_hz * CELLS_PER_STEP).ceil().max(2.0)
}
