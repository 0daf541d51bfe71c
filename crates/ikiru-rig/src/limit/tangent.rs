//! A cone seen from a rotation: normals of the edges that it lies on, and a box of the room around it.

use std::f64::consts::PI;

use glam::{DQuat, DVec2, DVec3};

use super::{ANTIPODE, Cone};
use crate::maths;

/// Near the antipode, sin σ / σ and cos σ/2 count as this.
const LEAST_SINC: f64 = 1e-6;
/// How near two limits count as a corner, in radians.
const NEAR: f64 = 1e-2;
/// The strongest bend of an edge that is told.
const MOST_BEND: f64 = 1e3;

/// A cone, seen from a rotation in its tangent space: to first order a box.
///
/// Where the rotation is near to one limit, the box is exact for that limit: the other two axes slide along it. Where it is near
/// to the edge of the swing and to an end of the twist, it is exact for both.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct TangentBox {
    /// Three unit axes in the tangent space, the nearest limit's first. They are perpendicular, but for the first one near two
    /// limits: moving along it changes the first and leaves the second.
    pub axes: [DVec3; 3],
    /// What the way along each axis is read by: `ω = Σ axes[i] (readers[i] · ω)`. The axes themselves where these are
    /// perpendicular.
    pub readers: [DVec3; 3],
    /// How far along each axis the limits lie, behind (not positive inside) and ahead (not negative inside), in radians.
    pub room: [(f64, f64); 3],
    /// How strongly the limit of the first axis bends along each of the others, per radian: it falls back by half
    /// of this times the square of the way. Only the edge of a swing bends, and only along itself; one that opens counts as
    /// straight.
    pub bends: [f64; 3],
}

/// A limit that a rotation lies on.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ConeNormal {
    /// Outward unit normal in the tangent space of the rotation.
    pub direction: DVec3,
    /// By how many radians the twist, or the swing straight out of its edge, grows for each radian along it; at least 1.
    pub rate: f64,
    /// Whether the limit has no width, so that neither direction is free.
    pub both_ways: bool,
}

impl Cone {
    /// The limits that hold `q` back, for a `q` on the boundary or outside: outward unit normals in the
    /// tangent space of `q` (the space of ω in `q · exp(ω)`), swing first.
    ///
    /// `margin` (radians) is how near to a limit counts as on it. A limit without width on either side
    /// holds both ways.
    #[must_use]
    pub fn normals(&self, q: DQuat, margin: f64) -> [Option<ConeNormal>; 3] {
        let (swing, twist) = self.swing_twist(q);
        let back = self.back_from_twist(twist);
        let mut normals = [None; 3];
        let angle = swing.length();
        let u = if angle > 1e-12 { swing / angle } else { DVec2::X };
        let v = DVec2::new(-u.y, u.x);
        let (u3, v3) = (self.in_space(u), self.in_space(v));
        // A tangent ω, seen past the twist, changes the swing vector by (ω·u) u + (σ / sin σ)(ω·v) v; all is
        // scaled by sin σ / σ, which leaves a direction also at the antipode (σ = π).
        let sinc = if angle > 1e-6 { maths::sin(angle) / angle } else { 1.0 };
        // `gradient` is a unit vector.
        let pull_back = |gradient: DVec2, both_ways: bool| {
            let n = u3 * (gradient.dot(u) * sinc) + v3 * gradient.dot(v);
            let direction = back * n.try_normalize().unwrap_or(u3);
            ConeNormal { direction, rate: n.length() / sinc.max(LEAST_SINC), both_ways }
        };
        let (a, b) = (self.swing.x, self.swing.y);
        if a < ANTIPODE || b < ANTIPODE {
            for (idx, (width, value, axis)) in
                [(a, swing.x, DVec2::X), (b, swing.y, DVec2::Y)].into_iter().enumerate()
            {
                let both_ways = width < ANTIPODE;
                if both_ways || value.abs() >= width - margin {
                    normals[idx] = Some(pull_back(if value < 0.0 { -axis } else { axis }, both_ways));
                }
            }
        } else if self.ellipse_excess(swing) >= -2.0 * margin / a.min(b) && !(a >= PI && b >= PI) {
            let gradient = swing / (self.swing * self.swing);
            normals[0] = Some(pull_back(gradient.normalize_or(u), false));
        }
        let range = self.twist;
        let whole_turn = range.max - range.min >= 2.0 * PI;
        if !whole_turn && (twist >= range.max - margin || twist <= range.min + margin) {
            // dθ = ω · (axis + tan(σ/2) axis × u), scaled by cos(σ/2).
            let (s, c) = maths::sin_cos(0.5 * angle);
            let gradient = self.axis * c + self.axis.cross(u3) * s;
            let upper = (twist - range.max).abs() <= (twist - range.min).abs();
            let direction = back * if upper { gradient } else { -gradient };
            let both_ways = range.max - range.min < ANTIPODE;
            normals[2] = Some(ConeNormal { direction, rate: 1.0 / c.max(LEAST_SINC), both_ways });
        }
        normals
    }

    /// The limit as a box in the tangent space of `q` (the space of ω in `q · exp(ω)`): to first order, how far
    /// `q` may turn along three axes, and how strongly the edge bends.
    #[must_use]
    pub fn tangent_box(&self, q: DQuat) -> TangentBox {
        let (swing, twist) = self.swing_twist(q);
        let back = self.back_from_twist(twist);
        let angle = swing.length();
        let u = if angle > 1e-12 { swing / angle } else { DVec2::X };
        let v = DVec2::new(-u.y, u.x);
        let (u3, v3) = (self.in_space(u), self.in_space(v));
        let sinc = if angle > 1e-6 { (maths::sin(angle) / angle).max(LEAST_SINC) } else { 1.0 };
        // As for the normals, but with the true length: by how much a function of the swing grows.
        let pull_back = |gradient: DVec2| u3 * gradient.dot(u) + v3 * (gradient.dot(v) / sinc);
        let (a, b) = (self.swing.x, self.swing.y);
        let of_twist = (self.twist.max - self.twist.min < 2.0 * PI).then(|| {
            let (s, c) = maths::sin_cos(0.5 * angle);
            let gradient = self.axis + self.axis.cross(u3) * (s / c.max(1e-6));
            Edge { gradient, room: (self.twist.min - twist, self.twist.max - twist) }
        });
        let mut found = if a < ANTIPODE || b < ANTIPODE {
            let along = |axis: DVec2, width: f64| {
                let at = swing.dot(axis);
                Some(Edge { gradient: pull_back(axis), room: (-width - at, width - at) })
            };
            perpendicular_box([along(DVec2::X, a), along(DVec2::Y, b), of_twist])
        } else if a >= PI && b >= PI {
            perpendicular_box([of_twist, None, None])
        } else {
            let level = (swing / self.swing).length();
            let gradient =
                if level > 1e-9 { swing / (self.swing * self.swing) / level } else { u / self.swing };
            let edge = Edge { gradient: pull_back(gradient), room: (f64::NEG_INFINITY, 1.0 - level) };
            self.box_of_both(edge, of_twist, self.bend(u, angle))
        };
        for axis in found.axes.iter_mut().chain(&mut found.readers) {
            *axis = back * *axis;
        }
        found
    }

    /// The box of the edge of a swing and the range of a twist, seen past the twist.
    fn box_of_both(&self, swing: Edge, twist: Option<Edge>, bend: f64) -> TangentBox {
        let twist_is_near = twist.as_ref().is_some_and(Edge::is_near);
        if twist_is_near && !swing.is_near() {
            return perpendicular_box([twist, Some(swing), None]);
        }
        let outward = swing.gradient.try_normalize().unwrap_or(self.first);
        let along = self.axis.cross(outward);
        // The twist axis leaves the swing as it is.
        let beside =
            twist.map(|edge| if twist_is_near { edge } else { Edge { gradient: self.axis, ..edge } });
        let mut found = perpendicular_box([Some(swing), beside, None]);
        if let Some(edge) = beside.filter(|_| twist_is_near) {
            found.lean(edge.gradient);
        }
        for axis in 1..3 {
            found.bends[axis] = bend * found.axes[axis].dot(along).powi(2);
        }
        found
    }

    /// How strongly the edge of the swing bends in the direction `u`, at the angle σ: the curvature on the sphere of the curve
    /// on which the level `h = σ f(φ)` is what it is there, in the frame of ∂σ and ∂φ / sin σ.
    fn bend(&self, u: DVec2, angle: f64) -> f64 {
        let (sin, cos) = maths::sin_cos(angle);
        let sin = sin.max(1e-6);
        // f² = (cos φ / a)² + (sin φ / b)²
        let [p, r] = (self.swing * self.swing).to_array().map(|square| 1.0 / square);
        let f = (u.x * u.x * p + u.y * u.y * r).sqrt();
        let f1 = (r - p) * u.x * u.y / f;
        let f2 = ((r - p) * (u.x * u.x - u.y * u.y) - f1 * f1) / f;
        let slope = DVec2::new(f, f1 * angle / sin);
        let length = slope.length();
        let along = DVec2::new(-slope.y, slope.x) / length;
        // The second covariant derivatives of h; that by σ twice is 0.
        let mixed = f1 * (1.0 - angle * cos / sin) / sin;
        let twice = (angle * f2 / sin + cos * f) / sin;
        let bend = (2.0 * mixed * along.x + twice * along.y) * along.y / length;
        bend.clamp(0.0, MOST_BEND)
    }
}

/// A function that a limit keeps in a range: by how much it grows, and what is left of the range.
#[derive(Clone, Copy, Debug)]
struct Edge {
    gradient: DVec3,
    room: (f64, f64),
}

impl Edge {
    fn is_near(&self) -> bool {
        let (down, up) = self.room;
        up.min(-down) <= NEAR * self.gradient.length()
    }
}

/// Makes limits into perpendicular axes with room along each. The first one's is exact.
fn perpendicular_box(limits: [Option<Edge>; 3]) -> TangentBox {
    let mut axes = [DVec3::ZERO; 3];
    let mut room = [(f64::NEG_INFINITY, f64::INFINITY); 3];
    let mut n = 0;
    for Edge { gradient, room: (down, up) } in limits.into_iter().flatten() {
        let mut rest = gradient;
        for axis in &axes[..n] {
            rest -= *axis * rest.dot(*axis);
        }
        let length = rest.length();
        if length > 1e-9 * gradient.length() && length > 0.0 {
            axes[n] = rest / length;
            room[n] = (down / length, up / length);
            n += 1;
        }
    }
    match n {
        0 => axes = [DVec3::X, DVec3::Y, DVec3::Z],
        1 => {
            axes[1] = axes[0].any_orthonormal_vector();
            axes[2] = axes[0].cross(axes[1]);
        }
        2 => axes[2] = axes[0].cross(axes[1]),
        _ => {}
    }
    TangentBox { axes, readers: axes, room, bends: [0.0; 3] }
}

impl TangentBox {
    /// Leans the first axis, so that moving along it leaves what the second was made from.
    fn lean(&mut self, gradient: DVec3) {
        let [first, second, _] = self.axes;
        let across = gradient.dot(second);
        if across == 0.0 {
            return;
        }
        let lean = gradient.dot(first) / across;
        let length = (1.0 + lean * lean).sqrt();
        self.axes[0] = (first - lean * second) / length;
        self.readers[0] = first * length;
        self.readers[1] = second + lean * first;
        let (down, up) = self.room[0];
        self.room[0] = (down * length, up * length);
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::limit::Range;
    use proptest::prelude::*;

    proptest! {
        #[test]
        fn normals_are_the_gradients_of_swing_and_twist(
            axis in prop::array::uniform3(-1.0..1.0f64), widths in prop::array::uniform2(0.2..3.0f64),
            direction in 0.0..6.0f64, twist in -3.0..3.0f64, omega in prop::array::uniform3(-1.0..1.0f64)
        ) {
            prop_assume!(DVec3::from(axis).length() > 0.1);
            let cone = Cone::new(DVec3::from(axis), widths, Range::new(-PI, twist)).unwrap();
            let swing = DVec2::from_angle(direction) * DVec2::from(widths);
            prop_assume!(swing.length() < PI - 0.05);
            let q = cone.compose(swing.to_array(), twist);
            let normals = cone.normals(q, 1e-9);
            let moved = |sign: f64| {
                let (s, t) = cone.decompose(q * DQuat::from_scaled_axis(DVec3::from(omega) * (sign * 1e-6)));
                (cone.ellipse_excess(DVec2::from(s)), t)
            };
            let (ahead, behind) = (moved(1.0), moved(-1.0));
            // The normals are unit vectors: compare directions through the ratio over three basis tangents.
            let n_swing = normals[0].unwrap().direction;
            let n_twist = normals[2].unwrap().direction;
            let gradient = |f: &dyn Fn(DVec3) -> f64| {
                DVec3::new(f(DVec3::X), f(DVec3::Y), f(DVec3::Z)).normalize()
            };
            let difference = |pick: &dyn Fn(DQuat) -> f64, w: DVec3| {
                pick(q * DQuat::from_scaled_axis(w * 1e-6)) - pick(q * DQuat::from_scaled_axis(w * -1e-6))
            };
            let by_swing = gradient(&|w| difference(&|q| cone.ellipse_excess(cone.swing_twist(q).0), w));
            let by_twist = gradient(&|w| difference(&|q| cone.swing_twist(q).1, w));
            prop_assert!(by_swing.dot(n_swing) > 1.0 - 1e-5, "{by_swing} {n_swing}");
            prop_assert!(by_twist.dot(n_twist) > 1.0 - 1e-5, "{by_twist} {n_twist}");
            prop_assert!(ahead.0.is_finite() && behind.1.is_finite());
        }
    }

    #[test]
    fn a_tangent_box_ends_where_the_cone_does() {
        let cone = Cone::new(DVec3::new(0.2, 1.0, -0.3), [0.9, 0.9], Range::new(-0.7, 0.4)).unwrap();
        for i in 0..200 {
            let i = f64::from(i);
            let swing = DVec2::from_angle(i * 0.7) * (0.9 * (i * 0.37).fract());
            let q = cone.compose(swing.to_array(), -0.7 + 1.1 * (i * 0.61).fract());
            let limits = cone.tangent_box(q);
            for (axis, (down, up)) in limits.axes.into_iter().zip(limits.room) {
                assert!((axis.length() - 1.0).abs() < 1e-12 && down <= 1e-12 && up >= -1e-12);
                for room in [down, up] {
                    if room.is_finite() && room.abs() < 0.02 {
                        // So near to the boundary the box is exact to second order.
                        let moved = q * DQuat::from_scaled_axis(axis * room);
                        let (s, t) = cone.decompose(moved);
                        let to_swing = (DVec2::from(s).length() - 0.9).abs();
                        let to_twist = (t - 0.4).abs().min((t + 0.7).abs());
                        assert!(
                            to_swing.min(to_twist) < 2.0 * room * room + 1e-9,
                            "{to_swing} {to_twist} {room}"
                        );
                    }
                }
            }
        }
    }
}
