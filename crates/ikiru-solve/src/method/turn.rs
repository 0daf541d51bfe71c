//! One degree of freedom against points: how far to turn or move so that points come nearest to places.

use ikiru_rig::{Vec3, maths, project_joint, retract_joint};

use crate::layout::{Layout, Mover};

/// What points say about one degree of freedom. A turn by θ about a unit axis makes of
/// `Σ w ‖R(θ) u − v‖²` a constant minus `2 (along · cos θ + across · sin θ)`; a shift by d along it a constant
/// plus `weight · d² − 2 shift · d`.
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct AxisFit {
    along: f64,
    across: f64,
    shift: f64,
    weight: f64,
}

impl AxisFit {
    /// Adds a point and the place where it should be, both seen from a point on the axis (metres, world axes).
    #[inline]
    pub(crate) fn add(&mut self, weight: f64, axis: Vec3<f64>, point: Vec3<f64>, place: Vec3<f64>) {
        self.along += weight * (point.dot(place) - axis.dot(point) * axis.dot(place));
        self.across += weight * axis.dot(point.cross(place));
        self.shift += weight * axis.dot(place - point);
        self.weight += weight;
    }

    /// The best angle (radians) in `down..=up`, where `down ≤ 0 ≤ up`: the smallest, where several are as good; 0
    /// where all are.
    pub(crate) fn best_turn(&self, (down, up): (f64, f64)) -> f64 {
        if maths::hypot(self.along, self.across) < 1e-15 * self.weight {
            return 0.0;
        }
        let best = maths::atan2(self.across, self.along);
        let other = best - std::f64::consts::TAU.copysign(best);
        if let Some(inside) = [best, other].into_iter().find(|a| (down..=up).contains(a)) {
            return inside;
        }
        // The sum is a cosine of the angle, so that on a range without its top the better end is the best.
        let gain = |angle: f64| {
            let (sin, cos) = maths::sin_cos(angle);
            self.along * cos + self.across * sin
        };
        if gain(up) > gain(down) { up } else { down }
    }

    /// The best shift (metres) in `down..=up`.
    pub(crate) fn best_shift(&self, (down, up): (f64, f64)) -> f64 {
        if self.weight > 0.0 { (self.shift / self.weight).max(down).min(up) } else { 0.0 }
    }
}

/// `coords := project(coords ⊕ delta)` along the `k`-th direction of a joint alone.
pub(crate) fn nudge(m: &Mover, k: usize, delta: f64, coords: &mut [f64]) {
    let mut tangent = [0.0; 6];
    tangent[k] = delta;
    let coords = &mut coords[m.coord..m.coord + m.n_coords];
    retract_joint(&m.motion, coords, &tangent[..m.n_dofs]);
    project_joint(&m.motion, coords);
}

/// How far a degree of freedom may move down and up. Half a turn for those of balls, whose cones say the rest.
pub(crate) fn room(layout: &Layout, m: &Mover, k: usize, coords: &[f64]) -> (f64, f64) {
    if m.n_coords == m.n_dofs {
        let (x, dof) = (coords[m.coord + k], m.dof + k);
        ((layout.lower[dof] - x).min(0.0), (layout.upper[dof] - x).max(0.0))
    } else if m.is_translation(k) {
        (f64::NEG_INFINITY, f64::INFINITY)
    } else {
        (-std::f64::consts::PI, std::f64::consts::PI)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use ikiru_rig::Rotation;
    use ikiru_testkit::rigs::Random;

    /// The sum of squares that a fit is made for, recomputed by turning the points.
    fn sum(axis: glam::DVec3, points: &[(f64, Vec3<f64>, Vec3<f64>)], angle: f64) -> f64 {
        let turn = Rotation::about(axis, angle);
        points.iter().map(|(w, u, v)| w * (turn.apply(*u) - *v).length().powi(2)).sum()
    }

    #[test]
    fn no_angle_or_shift_of_a_range_is_better() {
        let mut random = Random::new(5);
        for _ in 0..300 {
            let axis = random.vector(1.0).normalize();
            let mut vector = || Vec3::constant(random.vector(1.0));
            let points = [(0.5, vector(), vector()), (2.0, vector(), vector())];
            let range = (-3.0 * random.between(0.0, 1.0), 3.0 * random.between(0.0, 1.0));
            let mut fit = AxisFit::default();
            for (w, u, v) in &points {
                fit.add(*w, Vec3::constant(axis), *u, *v);
            }
            let (turn, shift) = (fit.best_turn(range), fit.best_shift(range));
            assert!((range.0..=range.1).contains(&turn) && (range.0..=range.1).contains(&shift));
            let shifted = |d: f64| {
                let moved = |u: &Vec3<f64>| *u + Vec3::constant(axis) * d;
                points.iter().map(|(w, u, v)| w * (moved(u) - *v).length().powi(2)).sum::<f64>()
            };
            for i in 0..=40 {
                let other = range.0 + (range.1 - range.0) * f64::from(i) / 40.0;
                assert!(sum(axis, &points, turn) <= sum(axis, &points, other) + 1e-12);
                assert!(shifted(shift) <= shifted(other) + 1e-12);
            }
        }
    }

    #[test]
    fn nothing_to_reach_for_is_no_turn() {
        let range = (-1.0, 1.0);
        assert_eq!(AxisFit::default().best_turn(range), 0.0);
        assert_eq!(AxisFit::default().best_shift(range), 0.0);
        let mut on_axis = AxisFit::default();
        let z = Vec3::new(0.0, 0.0, 1.0);
        on_axis.add(1.0, z, z, Vec3::new(1.0, 0.0, 0.0));
        assert_eq!(on_axis.best_turn(range), 0.0);
    }
}
