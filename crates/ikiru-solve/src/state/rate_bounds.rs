//! Limits on speed and acceleration while a motion is planned: an augmented Lagrangian (Hestenes 1969, Powell 1969;
//! for inequalities Rockafellar 1973).
//!
//! Between two samples a clip is a cubic whose velocities and accelerations are combinations of the differences from sample
//! to sample. The speed is never above the longest of the three points of Bézier's form of its velocity, the
//! acceleration never above that at its two ends, so that to bound those bounds the curve everywhere. Each is one
//! constraint `c = ‖x‖ / most − 1 ≤ 0`, whose cost is `max(0, λ + μ c)² / 2μ` with its multiplier λ.

use std::ops::Range;

use ikiru_rig::{Rate, RateLimit, RatePart};

use crate::algebra::banded::BandedLines;
use crate::layout::Layout;
use crate::problem::motion::MotionProblem;

/// By how much less is allowed, relative to a limit, than the limit: what a plan leaves over stays inside it.
const MARGIN: f64 = 1e-3;
/// From which part of its most on a point has curvature though nothing pushes it yet: a step sees the limit come.
const NEAR: f64 = 0.8;
/// Most points that bound a curve between two samples.
const MOST_POINTS: usize = 3;

/// All limits of a motion, and what they add to cost and curvature.
#[derive(Clone, Debug, Default)]
pub(crate) struct RateBounds {
    n_samples: usize,
    is_given: Vec<bool>,
    bounds: Vec<RateBound>,
    /// λ of each limit, interval and point.
    multipliers: Vec<f64>,
    new_multipliers: Vec<f64>,
    /// μ; at 0 the limits are out of the way.
    penalty: f64,
    /// Half the curvature, of each degree of freedom over time.
    pub(crate) curvature: BandedLines,
    /// Which degrees of freedom have some.
    pub(crate) is_bent: Vec<bool>,
}

/// One limit, where it bounds what moves.
#[derive(Clone, Debug)]
struct RateBound {
    limit: RateLimit,
    dofs: Range<usize>,
    /// The most, by steps instead of seconds.
    most: f64,
    /// What part of it is allowed: a little less than all, so that what is left over stays inside.
    part: f64,
}

/// The points that bound the curve between two samples: by how much the differences before, here and after count.
type Points = ([[f64; 3]; MOST_POINTS], usize);

fn points(rate: Rate, interval: usize, n_intervals: usize) -> Points {
    const NONE: [f64; 3] = [0.0; 3];
    let (is_first, is_last) = (interval == 0, interval + 1 == n_intervals);
    match (rate, is_first, is_last) {
        (Rate::Speed, true, true) => ([[0.0, 1.0, 0.0], NONE, NONE], 1),
        (Rate::Speed, true, false) => ([[0.0, 1.5, -0.5], [0.0, 1.0, 0.0], NONE], 2),
        (Rate::Speed, false, true) => ([[0.5, 0.5, 0.0], [0.0, 1.0, 0.0], [-0.5, 1.5, 0.0]], 3),
        (Rate::Speed, false, false) => ([[0.5, 0.5, 0.0], [-0.5, 2.0, -0.5], NONE], 2),
        (_, true, true) => ([NONE; MOST_POINTS], 0),
        (_, true, false) => ([[0.0, -1.0, 1.0], NONE, NONE], 1),
        (_, false, true) => ([[-1.0, 1.0, 0.0], NONE, NONE], 1),
        (_, false, false) => ([[-2.0, 3.0, -1.0], [1.0, -3.0, 2.0], NONE], 2),
    }
}

/// The same by the samples around instead of the differences between them.
fn by_samples([before, here, after]: [f64; 3]) -> [f64; 4] {
    [-before, before - here, here - after, after]
}

/// A limit at one point of one interval.
struct BoundPoint {
    multiplier: usize,
    interval: usize,
    /// By how much the differences before, here and after count.
    weights: [f64; 3],
    /// What is bounded, its length, and the most.
    x: [f64; 6],
    length: f64,
    most: f64,
}

impl RateBounds {
    /// Takes over the limits of a motion; they are out of the way until they [begin](Self::begin).
    pub(crate) fn fit(&mut self, layout: &Layout, motion: &MotionProblem) {
        let (n_samples, step) = (motion.timeline().n_samples(), motion.timeline().step_secs());
        let bound = |limit: &RateLimit| {
            let m = layout.movers.iter().find(|m| m.joint == limit.joint)?;
            let is_meant = |k: &usize| m.is_translation(*k) == (limit.part == RatePart::Translation);
            let (first, last) = ((0..m.n_dofs).find(is_meant)?, (0..m.n_dofs).rfind(is_meant)?);
            let most = limit.most * if limit.rate == Rate::Speed { step } else { step * step };
            Some(RateBound { limit: *limit, dofs: m.dof + first..m.dof + last + 1, most, part: 1.0 - MARGIN })
        };
        self.bounds.clear();
        self.bounds.extend(motion.rate_limits().iter().filter_map(bound));
        self.n_samples = n_samples;
        self.is_given.clear();
        self.is_given.extend((0..n_samples).map(|t| motion.given(t).is_some()));
        self.multipliers.resize(self.bounds.len() * n_samples * MOST_POINTS, 0.0);
        self.is_bent.resize(layout.n_dofs, false);
        self.begin(0.0);
    }

    /// Whether nothing is limited, or nothing is asked to hold limits now.
    pub(crate) fn is_off(&self) -> bool {
        self.penalty == 0.0 || self.bounds.is_empty()
    }

    /// The weight of what is beyond a limit; 0 lets all limits be. Multipliers, and what is allowed, begin anew.
    pub(crate) fn begin(&mut self, penalty: f64) {
        self.penalty = penalty;
        self.bounds.iter_mut().for_each(|bound| bound.part = 1.0 - MARGIN);
        self.multipliers.fill(0.0);
        self.is_bent.fill(false);
    }

    pub(crate) fn penalty(&self) -> f64 {
        self.penalty
    }

    /// Another weight of what is beyond a limit, multipliers as they are.
    pub(crate) fn set_penalty(&mut self, penalty: f64) {
        self.penalty = penalty;
    }

    /// Allows less of a limit: what is measured on the curve is more than the bounds say by this factor.
    pub(crate) fn tighten(&mut self, limit: &RateLimit, factor: f64) {
        for bound in self.bounds.iter_mut().filter(|b| b.limit == *limit) {
            bound.part /= factor;
        }
    }

    /// Shows every point of every limit, for differences from sample to sample.
    fn visit(&self, n: usize, first: &[f64], mut show: impl FnMut(&RateBound, &BoundPoint)) {
        let n_intervals = self.n_samples.saturating_sub(1);
        for (idx, bound) in self.bounds.iter().enumerate() {
            for interval in 0..n_intervals {
                let (points, n_points) = points(bound.limit.rate, interval, n_intervals);
                for (point, weights) in points.into_iter().enumerate().take(n_points) {
                    let samples = (0..4).filter(|i| by_samples(weights)[*i] != 0.0);
                    if samples.map(|i| interval + i - 1).all(|t| self.is_given[t]) {
                        // What was given is not to be changed.
                        continue;
                    }
                    let mut x = [0.0; 6];
                    for (i, w) in weights.iter().enumerate().filter(|(_, w)| **w != 0.0) {
                        let at = (interval + i - 1) * n;
                        for (x, k) in x.iter_mut().zip(bound.dofs.clone()) {
                            *x += w * first[at + k];
                        }
                    }
                    let length = x.iter().map(|x| x * x).sum::<f64>().sqrt();
                    let multiplier = (idx * self.n_samples + interval) * MOST_POINTS + point;
                    let most = bound.most * bound.part;
                    show(bound, &BoundPoint { multiplier, interval, weights, x, length, most });
                }
            }
        }
    }

    /// The push of a limit, 0 where it is kept with room to spare.
    fn push(&self, place: &BoundPoint) -> f64 {
        (self.multipliers[place.multiplier] + self.penalty * (place.length / place.most - 1.0)).max(0.0)
    }

    /// What the limits add to the cost.
    pub(crate) fn cost(&self, n: usize, first: &[f64]) -> f64 {
        let mut cost = 0.0;
        if !self.is_off() {
            self.visit(n, first, |_, place| {
                cost += self.push(place).powi(2) / (2.0 * self.penalty);
            });
        }
        cost
    }

    /// Fills the curvature and adds half the gradient by the differences from sample to sample.
    pub(crate) fn linearize(&mut self, n: usize, first: &[f64], pull: &mut [f64]) {
        if self.is_off() {
            return;
        }
        let (mut curvature, mut is_bent) =
            (std::mem::take(&mut self.curvature), std::mem::take(&mut self.is_bent));
        is_bent.fill(false);
        curvature.clear(n, self.n_samples);
        self.visit(n, first, |bound, place| {
            let push = self.push(place);
            if place.length == 0.0 || (push == 0.0 && place.length < NEAR * place.most) {
                return;
            }
            let along = 0.5 * push / (place.most * place.length);
            for (i, w) in place.weights.iter().enumerate().filter(|(_, w)| **w != 0.0) {
                let at = (place.interval + i - 1) * n;
                for (x, k) in place.x.iter().zip(bound.dofs.clone()) {
                    pull[at + k] += w * along * x;
                }
            }
            let of_samples = by_samples(place.weights);
            // Straight on μ counts, `x̂ x̂ᵀ`, which is at most the diagonal of `|x̂ₖ| Σ |x̂|`; sideways the push itself.
            let straight = 0.5 * self.penalty / (place.most * place.length).powi(2);
            let sum: f64 = place.x.iter().map(|x| x.abs()).sum();
            for (x, k) in place.x.iter().zip(bound.dofs.clone()) {
                let bend = straight * x.abs() * sum + along;
                is_bent[k] = true;
                for (i, a) in of_samples.iter().enumerate().filter(|(_, a)| **a != 0.0) {
                    for (j, b) in of_samples.iter().enumerate().skip(i) {
                        curvature.add(place.interval + i - 1, j - i, k, bend * a * b);
                    }
                }
            }
        });
        (self.curvature, self.is_bent) = (curvature, is_bent);
    }

    /// Takes over the push of each limit as its multiplier; the answer is by how much the worst is exceeded,
    /// relative to its most.
    pub(crate) fn update(&mut self, n: usize, first: &[f64]) -> f64 {
        let mut multipliers = std::mem::take(&mut self.new_multipliers);
        multipliers.clone_from(&self.multipliers);
        let mut worst = 0.0_f64;
        self.visit(n, first, |_, place| {
            multipliers[place.multiplier] = self.push(place);
            worst = worst.max(place.length / place.most - 1.0);
        });
        self.new_multipliers = std::mem::replace(&mut self.multipliers, multipliers);
        worst
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::state::cases::case;
    use ikiru_rig::Clip;

    #[test]
    fn the_gradient_is_that_of_central_differences() {
        for number in 0..20 {
            let mut case = case(number, true);
            case.state.evaluate(&case.layout, &case.motion);
            let n = case.layout.n_dofs;
            let mut first = case.state.smoothness.first().to_vec();
            let bounds = &mut case.state.rate_bounds;
            // Multipliers that are not all 0.
            bounds.update(n, &first);
            let mut pull = vec![0.0; first.len()];
            bounds.linearize(n, &first, &mut pull);
            assert!(pull.iter().any(|p| *p != 0.0) && bounds.is_bent.iter().any(|bent| *bent));
            for i in 0..n * (bounds.n_samples - 1) {
                let (x, h) = (first[i], 1e-7);
                let mut cost_at = |x: f64| {
                    first[i] = x;
                    bounds.cost(n, &first)
                };
                let numeric = (cost_at(x + h) - cost_at(x - h)) / (4.0 * h);
                first[i] = x;
                assert!(
                    (numeric - pull[i]).abs() < 1e-5 * (1.0 + pull[i].abs()),
                    "{numeric} is not {}",
                    pull[i]
                );
            }
        }
    }

    #[test]
    fn what_keeps_the_bounds_keeps_the_limits_on_the_curve() {
        let mut n_kept = 0;
        for number in 0..30 {
            let mut case = case(number, true);
            case.state.evaluate(&case.layout, &case.motion);
            let rig = case.motion.rig().clone();
            let n_samples = case.state.n_samples;
            let timeline = *case.motion.timeline();
            let poses = (0..n_samples).map(|t| {
                let mut pose = rig.rest_pose();
                case.state.store(&case.layout, t, pose.coords_mut());
                pose
            });
            let clip = Clip::new("", timeline.times(), poses.collect()).unwrap();
            let first = case.state.smoothness.first().to_vec();
            let mut longest = std::collections::HashMap::<usize, f64>::new();
            let bounds = &case.state.rate_bounds;
            bounds.visit(case.layout.n_dofs, &first, |bound, place| {
                let idx = bounds.bounds.iter().position(|b| b.limit == bound.limit).unwrap();
                let ratio = longest.entry(idx).or_default();
                *ratio = ratio.max(place.length / bound.most);
            });
            for (idx, bound) in bounds.bounds.iter().enumerate() {
                let joint = rig.get(bound.limit.joint).unwrap();
                // Slopes are clipped to ranges and cones on the curve, which only the exact measuring sees; samples that
                // are given count for nobody.
                let is_plain = joint.motion.cone().is_none()
                    && joint.motion.ranges().iter().all(ikiru_rig::Range::is_unlimited);
                if !is_plain || case.state.is_given.contains(&true) {
                    continue;
                }
                let limit = RateLimit { most: bound.limit.most * longest[&idx] * 1.05, ..bound.limit };
                // A turn accelerates a little beside its rotation vector: by less than a twentieth here.
                let most = clip.exceeded(&[limit]).unwrap();
                assert!(most.is_empty(), "case {number}: {:?}", most[0]);
                n_kept += 1;
            }
        }
        assert!(n_kept > 20, "{n_kept}");
    }
}
