//! Other poses to start from: a fixed low-discrepancy sequence over the limits.

use std::f64::consts::{PI, TAU};

use glam::DQuat;
use ikiru_rig::{Cone, JointMotion, Range, maths};

use crate::layout::Layout;

/// Kronecker's sequence with the generalised golden ratio: in `n` dimensions, the powers of the root of
/// `xⁿ⁺¹ = x + 1` fill the cube evenly (Roberts, 2018).
#[derive(Clone, Debug, Default)]
pub(crate) struct Seeds {
    steps: Vec<f64>,
}

impl Seeds {
    pub(crate) fn new(layout: &Layout) -> Self {
        let n = layout.n_dofs;
        let mut root = 1.5_f64;
        for _ in 0..64 {
            root = maths::powf(1.0 + root, 1.0 / (n as f64 + 1.0));
        }
        let mut power = 1.0;
        let steps = (0..n).map(|_| {
            power /= root;
            power
        });
        Self { steps: steps.collect() }
    }

    /// Writes the `idx`-th pose of the sequence into the coordinates of the movers. A floating root stays where it is
    /// in `start`.
    pub(crate) fn write(&self, layout: &Layout, idx: usize, start: &[f64], coords: &mut [f64]) {
        let unit = |dof: usize| (0.5 + (idx + 1) as f64 * self.steps[dof]).fract();
        for m in &layout.movers {
            let to = &mut coords[m.coord..m.coord + m.n_coords];
            match &m.motion {
                JointMotion::Fixed => {}
                JointMotion::Free { .. } => to.copy_from_slice(&start[m.coord..m.coord + m.n_coords]),
                JointMotion::Ball { cone } => {
                    let u = [unit(m.dof), unit(m.dof + 1), unit(m.dof + 2)];
                    let q = cone.as_ref().map_or_else(|| uniform_rotation(u), |cone| inside_cone(cone, u));
                    to.copy_from_slice(&q.to_array());
                }
                motion @ (JointMotion::Hinge { .. }
                | JointMotion::Slider { .. }
                | JointMotion::Euler { .. }) => {
                    for (i, range) in motion.ranges().iter().enumerate() {
                        to[i] = inside_range(range, start[m.coord + i], unit(m.dof + i), motion);
                    }
                }
            }
        }
    }
}

/// A value of a range; an unlimited side reaches half a turn (half a metre) from the start or the other side.
fn inside_range(range: &Range, start: f64, u: f64, motion: &JointMotion) -> f64 {
    let reach = if let JointMotion::Slider { .. } = motion { 0.5 } else { PI };
    let (min, max) = match (range.min.is_finite(), range.max.is_finite()) {
        (true, true) => (range.min, range.max),
        (true, false) => (range.min, range.min + 2.0 * reach),
        (false, true) => (range.max - 2.0 * reach, range.max),
        (false, false) => (start - reach, start + reach),
    };
    range.clamp(min + (max - min) * u)
}

/// Shoemake's uniform rotation of three uniform numbers.
fn uniform_rotation([a, b, c]: [f64; 3]) -> DQuat {
    let (s, t) = ((1.0 - a).sqrt(), a.sqrt());
    let (sin1, cos1) = maths::sin_cos(TAU * b);
    let (sin2, cos2) = maths::sin_cos(TAU * c);
    DQuat::from_xyzw(s * sin1, s * cos1, t * sin2, t * cos2).normalize()
}

fn inside_cone(cone: &Cone, [a, b, c]: [f64; 3]) -> DQuat {
    let (sin, cos) = maths::sin_cos(TAU * b);
    let [first, second] = cone.swing();
    let twist = cone.twist();
    let q = cone
        .compose([a.sqrt() * cos * first, a.sqrt() * sin * second], twist.min + (twist.max - twist.min) * c);
    cone.project(q).unwrap_or(q)
}
