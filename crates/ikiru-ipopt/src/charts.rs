//! The variables of a pose as Ipopt varies them, one for each degree of freedom.
//!
//! Angles and offsets are their own, a range is a bound. A rotation without limits is `start · exp(v)`. One with a cone is its
//! swing and twist `(s₁, s₂, θ)`: the range of the twist is a bound, and `(s₁/a)² + (s₂/b)² ≤ 1` a constraint.

use std::f64::consts::TAU;

use glam::{DQuat, DVec3};
use ikiru_rig::{Cone, JointMotion, Pose, maths};

/// What does not have this much room (radians or metres) is held: an interior has to have room.
const LEAST_ROOM: f64 = 1e-9;

/// How variables make a rotation.
#[derive(Clone, Copy, Debug)]
enum Chart {
    /// `start · exp(v)`
    About(DQuat),
    /// `exp(s) · twist(θ)`, about the cone's centre
    SwingTwist(Cone),
}

/// A rotation: where its quaternion, its directions and its three variables lie.
#[derive(Clone, Copy, Debug)]
struct Turn {
    coord: usize,
    dof: usize,
    chart: Chart,
}

/// A swing's constraint: the first of its two variables, and the half-widths.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Ellipse {
    pub(crate) dof: usize,
    pub(crate) widths: [f64; 2],
}

/// The variables of a problem, one for each degree of freedom of the rig.
#[derive(Clone, Debug)]
pub(crate) struct Charts {
    turns: Vec<Turn>,
    pub(crate) ellipses: Vec<Ellipse>,
    /// The variables that have room, in order.
    pub(crate) free: Vec<usize>,
    /// The value and range of each.
    pub(crate) values: Vec<f64>,
    pub(crate) lower: Vec<f64>,
    pub(crate) upper: Vec<f64>,
    /// For each variable that is a coordinate, where it lies: (variable, coordinate).
    plain: Vec<(usize, usize)>,
}

impl Charts {
    /// Charts about a pose inside its limits, of the entries of its tangent that move.
    pub(crate) fn new(pose: &Pose, moving: &[usize]) -> Self {
        let (rig, coords) = (pose.rig(), pose.coords());
        let n = rig.n_dofs();
        let mut charts = Self {
            turns: Vec::new(),
            ellipses: Vec::new(),
            free: Vec::new(),
            values: vec![0.0; n],
            lower: vec![f64::NEG_INFINITY; n],
            upper: vec![f64::INFINITY; n],
            plain: Vec::new(),
        };
        let mut moves = vec![false; n];
        moving.iter().for_each(|dof| moves[*dof] = true);
        for joint in rig.ids() {
            let (dofs, coord) = (rig.dofs_of(joint), rig.coords_of(joint).start);
            let Some(motion) =
                rig.get(joint).map(|joint| joint.motion).filter(|_| dofs.clone().any(|k| moves[k]))
            else {
                continue;
            };
            for (dof, range) in dofs.clone().zip(motion.ranges()) {
                (charts.lower[dof], charts.upper[dof]) = (range.min, range.max);
            }
            let has_rotation = matches!(motion, JointMotion::Ball { .. } | JointMotion::Free { .. });
            let n_plain = if has_rotation { dofs.len() - 3 } else { dofs.len() };
            for k in 0..n_plain {
                charts.plain.push((dofs.start + k, coord + k));
                charts.values[dofs.start + k] = coords[coord + k];
            }
            if has_rotation {
                charts.push_turn(coord + n_plain, dofs.start + n_plain, motion.cone(), coords);
            }
        }
        let has_room = |k: &usize| moves[*k] && charts.upper[*k] - charts.lower[*k] > LEAST_ROOM;
        charts.free = (0..n).filter(has_room).collect();
        charts
    }

    fn push_turn(&mut self, coord: usize, dof: usize, cone: Option<&Cone>, coords: &[f64]) {
        let q = DQuat::from_slice(&coords[coord..coord + 4]);
        let Some(cone) = cone else {
            self.turns.push(Turn { coord, dof, chart: Chart::About(q) });
            return;
        };
        let (swing, twist) = cone.decompose(q);
        let (widths, range) = (cone.swing(), cone.twist());
        let whole_turn = range.max - range.min >= TAU;
        for k in 0..2 {
            self.values[dof + k] = swing[k];
            (self.lower[dof + k], self.upper[dof + k]) = (-widths[k], widths[k]);
        }
        self.values[dof + 2] = twist;
        if !whole_turn {
            (self.lower[dof + 2], self.upper[dof + 2]) = (range.min, range.max);
        }
        if widths.iter().all(|w| 2.0 * w > LEAST_ROOM) {
            self.ellipses.push(Ellipse { dof, widths });
        }
        self.turns.push(Turn { coord, dof, chart: Chart::SwingTwist(*cone) });
    }

    /// Which derivatives of constraints there are: (constraint, variable of Ipopt's). Hard rows may have all.
    pub(crate) fn jacobian(&self, n_hard: usize) -> Vec<(usize, usize)> {
        let (n_cones, n_free) = (self.ellipses.len(), self.free.len());
        let mut entries = Vec::with_capacity(2 * n_cones + n_hard * n_free);
        for (row, ellipse) in self.ellipses.iter().enumerate() {
            // Both have room, so that they stand side by side.
            let column = self.free.partition_point(|dof| *dof < ellipse.dof);
            entries.extend([(row, column), (row, column + 1)]);
        }
        for row in n_cones..n_cones + n_hard {
            entries.extend((0..n_free).map(|column| (row, column)));
        }
        entries
    }

    /// Takes over what Ipopt varies.
    pub(crate) fn set(&mut self, x: &[f64]) {
        for (dof, x) in self.free.iter().zip(x) {
            self.values[*dof] = *x;
        }
    }

    /// Writes the coordinates that the variables stand for.
    pub(crate) fn write(&self, coords: &mut [f64]) {
        for (dof, coord) in &self.plain {
            coords[*coord] = self.values[*dof];
        }
        for turn in &self.turns {
            let [a, b, c] = self.variables(turn);
            let q = match &turn.chart {
                Chart::About(start) => (*start * maths::turn_by(DVec3::new(a, b, c))).normalize(),
                Chart::SwingTwist(cone) => cone.compose([a, b], c),
            };
            coords[turn.coord..turn.coord + 4].copy_from_slice(&q.to_array());
        }
    }

    fn variables(&self, turn: &Turn) -> [f64; 3] {
        [self.values[turn.dof], self.values[turn.dof + 1], self.values[turn.dof + 2]]
    }

    /// Turns a gradient by directions of motion into one by the variables.
    pub(crate) fn pull_back(&self, gradient: &mut [f64]) {
        for turn in &self.turns {
            let [a, b, c] = self.variables(turn);
            let to = &mut gradient[turn.dof..turn.dof + 3];
            let g = DVec3::from_slice(to);
            let by_variables = match &turn.chart {
                Chart::About(_) => right_jacobian_transposed(DVec3::new(a, b, c), g),
                Chart::SwingTwist(cone) => {
                    // Directions of the joint are turned by K against those of the cone.
                    let g = cone.centre().map_or(g, |centre| centre.joint_rotation.conjugate() * g);
                    // exp(s + ds) = exp(s) · exp(J ds), and exp(δ) · twist = twist · exp(twist⁻¹ δ).
                    let axes = [cone.first_swing_axis(), cone.second_swing_axis()];
                    let before_twist = maths::turn_about(cone.axis(), c) * g;
                    let s = right_jacobian_transposed(axes[0] * a + axes[1] * b, before_twist);
                    DVec3::new(s.dot(axes[0]), s.dot(axes[1]), g.dot(cone.axis()))
                }
            };
            to.copy_from_slice(&by_variables.to_array());
        }
    }
}

/// `Jᵀ g` for the right Jacobian of the rotations: `exp(v + dv) = exp(v) · exp(J dv)` to first order, with
/// `J = 1 − (1 − cos θ)/θ² [v]ₓ + (θ − sin θ)/θ³ [v]ₓ²` and θ the length of `v`.
fn right_jacobian_transposed(v: DVec3, g: DVec3) -> DVec3 {
    let square = v.length_squared();
    let angle = square.sqrt();
    let (a, b) = if angle < 1e-3 {
        (0.5 - square / 24.0, 1.0 / 6.0 - square / 120.0)
    } else {
        (2.0 * maths::sin(0.5 * angle).powi(2) / square, (angle - maths::sin(angle)) / (square * angle))
    };
    let turned = v.cross(g);
    g + a * turned + b * v.cross(turned)
}
