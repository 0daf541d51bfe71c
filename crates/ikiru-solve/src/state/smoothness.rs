//! Smoothness of orders 1 to 3 on the manifold (equation 25), for whatever joints do.
//!
//! The first difference of a joint is the tangent from one sample's value to the next (for balls the rotation vector
//! in the joint's own axes); the second and third are differences of those.

use glam::DVec3;
use ikiru_rig::{JointMotion, difference_joint, maths};

use crate::layout::Layout;

/// A step beside an end, and the one after it.
#[derive(Clone, Copy, Debug)]
struct End {
    step: usize,
    next: Option<usize>,
    bends_alone: bool,
}

/// Memory for differences over time: `n_samples × n_dofs` numbers each, sample by sample.
#[derive(Clone, Debug, Default)]
pub(crate) struct Smoothness {
    /// Weights of the three orders, for each degree of freedom.
    pub(crate) weights: Vec<[f64; 3]>,
    /// Whether the motion is at rest before its first and behind its last sample.
    pub(crate) at_rest: [bool; 2],
    first: Vec<f64>,
    second: Vec<f64>,
    third: Vec<f64>,
}

impl Smoothness {
    /// Takes over the weights of each degree of freedom, what is at rest, and how many samples there are.
    pub(crate) fn fit(
        &mut self,
        weights: impl Iterator<Item = [f64; 3]>,
        at_rest: [bool; 2],
        n_samples: usize,
    ) {
        self.weights.clear();
        self.weights.extend(weights);
        self.at_rest = at_rest;
        let n = self.weights.len() * n_samples;
        [&mut self.first, &mut self.second, &mut self.third].into_iter().for_each(|v| v.resize(n, 0.0));
    }

    /// The cost of each order, at the coordinates of all samples (`n_samples × n_coords`).
    pub(crate) fn cost(&mut self, layout: &Layout, coords: &[f64]) -> [f64; 3] {
        let (n, nc) = (layout.n_dofs, layout.n_coords);
        let n_samples = self.first.len().checked_div(n).unwrap_or(0);
        let mut cost = [0.0; 3];
        for t in 0..n_samples.saturating_sub(1) {
            let (from, to) = (&coords[t * nc..(t + 1) * nc], &coords[(t + 1) * nc..(t + 2) * nc]);
            let first = &mut self.first[t * n..(t + 1) * n];
            for m in &layout.movers {
                let c = m.coord..m.coord + m.n_coords;
                let tangent = &mut first[m.dof..m.dof + m.n_dofs];
                difference_joint(&m.motion, &from[c.clone()], &to[c], tangent);
            }
        }
        let differ = |from: &[f64], to: &mut [f64], count: usize| {
            for i in 0..count * n {
                to[i] = from[i + n] - from[i];
            }
        };
        differ(&self.first, &mut self.second, n_samples.saturating_sub(2));
        differ(&self.second, &mut self.third, n_samples.saturating_sub(3));
        for (order, values) in [&self.first, &self.second, &self.third].into_iter().enumerate() {
            for t in 0..n_samples.saturating_sub(order + 1) {
                for k in 0..n {
                    cost[order] += self.weights[k][order] * values[t * n + k] * values[t * n + k];
                }
            }
        }
        for end in self.ends(n, n_samples) {
            for (k, [_, acceleration, jerk]) in self.weights.iter().enumerate() {
                let (step, bend) = self.at_end(end, n, k);
                cost[1] += acceleration * step * step;
                cost[2] += jerk * (step * step + bend * bend);
            }
        }
        cost
    }

    /// The ends at which the motion is at rest.
    fn ends(&self, n: usize, n_samples: usize) -> impl Iterator<Item = End> + use<> {
        let last = n_samples.saturating_sub(2);
        // A single step between two ends at rest bends once.
        let bends_alone = last == 0 && self.at_rest == [true; 2];
        let first = End { step: 0, next: (last > 0).then_some(1), bends_alone };
        let other = End { step: last, next: last.checked_sub(1), bends_alone: false };
        let is_there = n > 0 && n_samples >= 2;
        [first, other]
            .into_iter()
            .zip(self.at_rest)
            .filter(move |(_, at)| is_there && *at)
            .map(|(end, _)| end)
    }

    /// The step beside an end at rest, and the third difference that reaches across it to the step after.
    fn at_end(&self, end: End, n: usize, k: usize) -> (f64, f64) {
        let step = self.first[end.step * n + k];
        let bend = match end.next {
            Some(next) => self.first[next * n + k] - 2.0 * step,
            None if end.bends_alone => -2.0 * step,
            None => 0.0,
        };
        (step, bend)
    }

    /// Adds half the gradient of what is at rest by the first differences, as of the last [`cost`](Self::cost).
    pub(crate) fn add_rest_pull(&self, pull: &mut [f64]) {
        let n = self.weights.len();
        let n_samples = self.first.len().checked_div(n).unwrap_or(0);
        for end in self.ends(n, n_samples) {
            for (k, [_, acceleration, jerk]) in self.weights.iter().enumerate() {
                let (step, bend) = self.at_end(end, n, k);
                pull[end.step * n + k] += (acceleration + jerk) * step - 2.0 * jerk * bend;
                if let Some(next) = end.next {
                    pull[next * n + k] += jerk * bend;
                }
            }
        }
    }

    /// The differences from sample to sample, as of the last [`cost`](Self::cost).
    pub(crate) fn first(&self) -> &[f64] {
        &self.first
    }

    /// Adds half the gradient by the tangents of all samples, as of the last [`cost`](Self::cost); `beside` is half that
    /// of everything else by the first differences, [rest at the ends](Self::add_rest_pull) among it.
    pub(crate) fn add_half_gradient(&mut self, layout: &Layout, beside: &[f64], gradient: &mut [f64]) {
        let n = layout.n_dofs;
        let n_samples = self.first.len().checked_div(n).unwrap_or(0);
        if n_samples < 2 {
            return;
        }
        // Half the gradient by the first differences, which takes the place of the weighted differences.
        let w = &self.weights;
        for i in 0..n_samples.saturating_sub(3) * n {
            self.third[i] *= w[i % n][2];
        }
        for t in 0..n_samples.saturating_sub(2) {
            for k in 0..n {
                let i = t * n + k;
                let after = if t + 3 < n_samples { self.third[i] } else { 0.0 };
                let before = if t > 0 { self.third[i - n] } else { 0.0 };
                self.second[i] = w[k][1] * self.second[i] + before - after;
            }
        }
        for t in 0..n_samples - 1 {
            for m in &layout.movers {
                let mut pull = [0.0; 6];
                for j in 0..m.n_dofs {
                    let (k, i) = (m.dof + j, t * n + m.dof + j);
                    let after = if t + 2 < n_samples { self.second[i] } else { 0.0 };
                    let before = if t > 0 { self.second[i - n] } else { 0.0 };
                    pull[j] = w[k][0] * self.first[i] + before - after + beside[i];
                }
                let v = &self.first[t * n + m.dof..t * n + m.dof + m.n_dofs];
                let (mut from, mut to) = (pull, pull);
                if let JointMotion::Ball { .. } | JointMotion::Free { .. } = m.motion {
                    let at = m.n_dofs - 3;
                    let (v, p) = (DVec3::from_slice(&v[at..]), DVec3::from_slice(&pull[at..]));
                    // The end of a rotation vector moves by Jr⁻¹ of its joint's tangent, the beginning by −Jl⁻¹; the
                    // gradients by both are those of the transposes.
                    to[at..at + 3].copy_from_slice(&inverse_right_jacobian(-v, p).to_array());
                    from[at..at + 3].copy_from_slice(&inverse_right_jacobian(v, p).to_array());
                }
                for j in 0..m.n_dofs {
                    gradient[t * n + m.dof + j] -= from[j];
                    gradient[(t + 1) * n + m.dof + j] += to[j];
                }
            }
        }
    }
}

/// `Jr⁻¹(v) x`: by how much a rotation vector changes when `x` is turned behind it. Its transpose is that of `−v`.
fn inverse_right_jacobian(v: DVec3, x: DVec3) -> DVec3 {
    let square = v.length_squared();
    let factor = if square < 1e-8 {
        1.0 / 12.0 + square / 720.0
    } else {
        let angle = square.sqrt();
        1.0 / square - 1.0 / (2.0 * angle * maths::tan(0.5 * angle))
    };
    let once = v.cross(x);
    x + 0.5 * once + factor * v.cross(once)
}

#[cfg(test)]
mod tests {
    use super::*;
    use ikiru_rig::retract_joint;
    use ikiru_testkit::rigs::{Random, random_pose, random_rig};

    use crate::objectives::RestPose;
    use crate::problem::Problem;

    #[test]
    fn the_gradient_is_that_of_central_differences() {
        let mut random = Random::new(4);
        for case in 0..20 {
            let rig = random_rig(8, case);
            let mut problem = Problem::whole_body(&rig);
            let joints: Vec<_> = problem.active().collect();
            problem.add(1.0, RestPose::new(&joints, rig.rest_pose()));
            let layout = Layout::new(&problem).unwrap();
            let n_samples = 2 + random.below(5);
            let (n, nc) = (layout.n_dofs, layout.n_coords);
            let weights: Vec<[f64; 3]> = (0..n).map(|_| [0.0; 3].map(|_| random.between(0.1, 1.0))).collect();
            let mut coords = Vec::new();
            for _ in 0..n_samples {
                let pose = random_pose(&rig, &mut random);
                for m in &layout.movers {
                    coords.extend_from_slice(&pose.coords()[m.pose_coord..m.pose_coord + m.n_coords]);
                }
            }
            let at_rest = [random.below(2) == 0, random.below(2) == 0];
            let mut smoothness = Smoothness::default();
            smoothness.fit(weights.into_iter(), at_rest, n_samples);
            smoothness.cost(&layout, &coords);
            let mut gradient = vec![0.0; n * n_samples];
            let mut beside = vec![0.0; n * n_samples];
            smoothness.add_rest_pull(&mut beside);
            smoothness.add_half_gradient(&layout, &beside, &mut gradient);
            for t in 0..n_samples {
                for m in &layout.movers {
                    for j in 0..m.n_dofs {
                        let mut at = |h: f64| {
                            let mut moved = coords.clone();
                            let mut tangent = [0.0; 6];
                            tangent[j] = h;
                            let from = t * nc + m.coord;
                            retract_joint(
                                &m.motion,
                                &mut moved[from..from + m.n_coords],
                                &tangent[..m.n_dofs],
                            );
                            smoothness.cost(&layout, &moved).iter().sum::<f64>()
                        };
                        let h = 1e-6;
                        let numeric = (at(h) - at(-h)) / (4.0 * h);
                        let exact = gradient[t * n + m.dof + j];
                        // Half a turn between samples is a corner of the distance: random poses come near it.
                        let near = (numeric - exact).abs() < 1e-5 * (1.0 + exact.abs());
                        assert!(near, "case {case}: {numeric} is not {exact}");
                    }
                }
            }
        }
    }
}
