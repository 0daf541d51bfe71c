//! Hard limits: a range for an angle or offset, and a swing cone with a twist range for a ball.

use std::f64::consts::PI;

use crate::maths;

use glam::{DQuat, DVec2, DVec3};

/// A closed range of an angle (radians) or an offset (metres). An infinite end is no limit.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Range {
    /// Smallest value.
    pub min: f64,
    /// Largest value.
    pub max: f64,
}

impl Range {
    /// No limit on either side.
    pub const UNLIMITED: Self = Self { min: f64::NEG_INFINITY, max: f64::INFINITY };

    /// From `min` to `max`, both in radians or metres.
    #[must_use]
    pub const fn new(min: f64, max: f64) -> Self {
        Self { min, max }
    }

    /// From `min` to `max`, both in degrees.
    #[must_use]
    pub fn degrees(min: f64, max: f64) -> Self {
        Self { min: min.to_radians(), max: max.to_radians() }
    }

    /// Whether neither side is limited; an angle then wraps.
    #[must_use]
    pub fn is_unlimited(&self) -> bool {
        self.min == f64::NEG_INFINITY && self.max == f64::INFINITY
    }

    /// The nearest value inside.
    #[inline(always)]
    #[must_use]
    pub fn clamp(&self, value: f64) -> f64 {
        value.max(self.min).min(self.max)
    }

    /// How far outside a value lies; 0 inside.
    #[must_use]
    pub fn distance(&self, value: f64) -> f64 {
        (value - self.clamp(value)).abs()
    }

    /// The middle of a bounded range; the value nearest 0 of any other.
    #[must_use]
    pub fn middle(&self) -> f64 {
        if self.min.is_finite() && self.max.is_finite() {
            0.5 * (self.min + self.max)
        } else {
            self.clamp(0.0)
        }
    }

    /// How far inside a value lies: the distance to the nearer end, negative outside. Infinite where there is
    /// no end, and for a range without width that holds the value, since there is no way out to be measured.
    #[must_use]
    pub fn margin(&self, value: f64) -> f64 {
        let margin = (value - self.min).min(self.max - value);
        if self.max - self.min < 1e-12 && margin > -1e-9 { f64::INFINITY } else { margin }
    }

    /// [`margin`](Self::margin) of an angle for which a range of a whole turn is no limit.
    fn margin_around(&self, angle: f64) -> f64 {
        if self.max - self.min >= 2.0 * PI { f64::INFINITY } else { self.margin(angle) }
    }

    pub(crate) fn is_ordered(&self) -> bool {
        self.min <= self.max && self.min < f64::INFINITY && self.max > f64::NEG_INFINITY
    }
}

impl Default for Range {
    fn default() -> Self {
        Self::UNLIMITED
    }
}

/// An exact limit of a ball joint: an elliptic cone for the swing, a range for the twist, about one axis.
///
/// A rotation is taken apart as `q = swing · twist`: the twist turns about `axis`, the swing is
/// `exp(s)` with `s ⊥ axis`. Inside means `(s₁/a)² + (s₂/b)² ≤ 1` and `twist.min ≤ θ ≤ twist.max`.
/// `s₁` is measured about [`first_swing_axis`](Self::first_swing_axis). At a swing of π, where the
/// twist is not defined, it is 0 by rule.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Cone {
    axis: DVec3,
    first: DVec3,
    second: DVec3,
    swing: DVec2,
    twist: Range,
}

/// What is wrong with the numbers of a [`Cone`].
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum ConeError {
    /// The axis has no direction.
    #[error("the axis must be a finite vector longer than zero, not {0:?}")]
    Axis([f64; 3]),
    /// A half-width is outside 0 to π.
    #[error("a swing half-width must lie between 0 and π rad (180°), not {0}")]
    Swing(f64),
    /// The twist range is not ordered or leaves −π to π.
    #[error("the twist range must be ordered and inside −π to π rad (±180°), not {0} to {1}")]
    Twist(f64, f64),
}

/// A swing this close to π has no twist of its own.
const ANTIPODE: f64 = 1e-9;

impl Cone {
    /// A cone about `axis` (in the joint's frame, any length): half-widths `swing` of the ellipse and the
    /// range of the `twist`, all in radians.
    ///
    /// # Errors
    /// When the axis has no direction, a half-width is outside `[0, π]`, or the twist range is not ordered
    /// inside `[−π, π]`.
    pub fn new(axis: DVec3, swing: [f64; 2], twist: Range) -> Result<Self, ConeError> {
        let Some(unit) = axis.try_normalize().filter(|_| axis.is_finite()) else {
            return Err(ConeError::Axis(axis.to_array()));
        };
        if let Some(bad) = swing.into_iter().find(|w| !(0.0..=PI).contains(w)) {
            return Err(ConeError::Swing(bad));
        }
        if !(-PI <= twist.min && twist.min <= twist.max && twist.max <= PI) {
            return Err(ConeError::Twist(twist.min, twist.max));
        }
        let helper = if unit.x.abs() < 0.9 { DVec3::X } else { DVec3::Z };
        let first = helper.reject_from_normalized(unit).normalize();
        // At a swing of π the twist is 0 by rule: where 0 is forbidden, so is that swing.
        let largest = if twist.distance(0.0) > 0.0 { PI - 1e-6 } else { PI };
        let swing = DVec2::from(swing).min(DVec2::splat(largest));
        Ok(Self { axis: unit, first, second: unit.cross(first), swing, twist })
    }

    /// The twist axis, a unit vector in the joint's frame.
    #[must_use]
    pub fn axis(&self) -> DVec3 {
        self.axis
    }

    /// The axis of the first half-width: x made perpendicular to the twist axis (z where the twist axis is
    /// within 26° of x). The [second](Self::second_swing_axis) is `axis × first`.
    #[must_use]
    pub fn first_swing_axis(&self) -> DVec3 {
        self.first
    }

    /// The axis of the second half-width: `axis × first`.
    #[must_use]
    pub fn second_swing_axis(&self) -> DVec3 {
        self.second
    }

    /// The half-widths of the swing, in radians.
    #[must_use]
    pub fn swing(&self) -> [f64; 2] {
        self.swing.to_array()
    }

    /// The range of the twist, in radians.
    #[must_use]
    pub fn twist(&self) -> Range {
        self.twist
    }

    /// The swing vector (along the first and second swing axes) and the twist of a unit quaternion.
    #[must_use]
    pub fn decompose(&self, q: DQuat) -> ([f64; 2], f64) {
        let (swing, twist) = self.swing_twist(q);
        (swing.to_array(), twist)
    }

    fn swing_twist(&self, q: DQuat) -> (DVec2, f64) {
        let q = if q.w < 0.0 { -q } else { q };
        let v = q.xyz();
        let along = v.dot(self.axis);
        let half_cos = maths::hypot(q.w, along);
        if half_cos < 0.5 * ANTIPODE {
            let s = DVec2::new(v.dot(self.first), v.dot(self.second)).normalize_or(DVec2::X);
            return (s * PI, 0.0);
        }
        // v_swing = v_perpendicular turned back by half the twist, from swing = q · twist⁻¹.
        let (c, s) = (q.w / half_cos, along / half_cos);
        let (v1, v2) = (v.dot(self.first), v.dot(self.second));
        let swing = DVec2::new(c * v1 - s * v2, s * v1 + c * v2);
        let length = swing.length();
        let angle = 2.0 * maths::atan2(length, half_cos);
        let scaled = if length > 1e-150 { swing * (angle / length) } else { swing * 2.0 };
        (scaled, 2.0 * maths::atan2(along, q.w))
    }

    /// The unit quaternion of a swing vector and a twist.
    #[must_use]
    pub fn compose(&self, swing: [f64; 2], twist: f64) -> DQuat {
        let s = self.first * swing[0] + self.second * swing[1];
        (maths::turn_by(s) * maths::turn_about(self.axis, twist)).normalize()
    }

    /// The nearest rotation inside: the swing moves to the nearest point of the ellipse, then the twist is
    /// clamped. `None` where `q` is inside already.
    #[must_use]
    pub fn project(&self, q: DQuat) -> Option<DQuat> {
        let (swing, twist) = self.swing_twist(q);
        let inside = self.ellipse_excess(swing) <= 0.0;
        if inside && self.twist.distance(twist) == 0.0 {
            return None;
        }
        let swing = if inside { swing } else { nearest_on_ellipse(swing, self.swing) };
        Some(self.compose(swing.to_array(), self.clamp_twist(twist)))
    }

    /// The end of the twist range that is nearer around the circle.
    fn clamp_twist(&self, twist: f64) -> f64 {
        let around = |a: f64, b: f64| {
            let d = (a - b).abs();
            d.min(2.0 * PI - d)
        };
        if self.twist.distance(twist) == 0.0 {
            twist
        } else if around(twist, self.twist.min) <= around(twist, self.twist.max) {
            self.twist.min
        } else {
            self.twist.max
        }
    }

    /// How far outside a rotation lies, in radians: the distance of the swing to the ellipse, and that of
    /// the twist to its range; both 0 inside.
    #[must_use]
    pub fn distance(&self, q: DQuat) -> [f64; 2] {
        let (swing, twist) = self.swing_twist(q);
        let excess = if self.ellipse_excess(swing) > 0.0 {
            swing.distance(nearest_on_ellipse(swing, self.swing))
        } else {
            0.0
        };
        let clamped = self.clamp_twist(twist);
        let around = (twist - clamped).abs();
        [excess, around.min(2.0 * PI - around)]
    }

    /// How far inside a rotation lies, in radians: the distance of the swing vector to the ellipse, and that
    /// of the twist to the nearer end of its range. Negative outside, infinite where nothing limits; so it
    /// is for a direction without width that is held, since there is no way out to be measured.
    #[must_use]
    pub fn margin(&self, q: DQuat) -> [f64; 2] {
        let (swing, twist) = self.swing_twist(q);
        let [excess, beyond] = self.distance(q);
        let (a, b) = (self.swing.x, self.swing.y);
        let swing_margin = if excess > ANTIPODE {
            -excess
        } else if a.min(b) < ANTIPODE {
            let of = |width: f64, value: f64| {
                if width < ANTIPODE { f64::INFINITY } else { width - value.abs() }
            };
            of(a, swing.x).min(of(b, swing.y))
        } else if a.min(b) >= PI - 1e-6 {
            f64::INFINITY
        } else {
            distance_inside_ellipse(swing, self.swing)
        };
        let twist_margin = if beyond > ANTIPODE { -beyond } else { self.twist.margin_around(twist) };
        [swing_margin, twist_margin]
    }

    fn ellipse_excess(&self, s: DVec2) -> f64 {
        if self.swing.min_element() > 0.0 {
            (s / self.swing).length_squared() - 1.0
        } else {
            let (a, b) = (self.swing.x, self.swing.y);
            (s.x.abs() - a).max(s.y.abs() - b)
        }
    }

    /// The limits that hold `q` back, for a `q` on the boundary or outside: outward unit normals in the
    /// tangent space of `q` (the space of ω in `q · exp(ω)`), swing first.
    ///
    /// `margin` (radians) is how near to a limit counts as on it. A limit without width on either side
    /// holds both ways.
    #[must_use]
    pub fn normals(&self, q: DQuat, margin: f64) -> [Option<ConeNormal>; 3] {
        let (swing, twist) = self.swing_twist(q);
        let back = maths::turn_about(self.axis, -twist);
        let mut normals = [None; 3];
        let angle = swing.length();
        let u = if angle > 1e-12 { swing / angle } else { DVec2::X };
        let v = DVec2::new(-u.y, u.x);
        let (u3, v3) = (self.in_space(u), self.in_space(v));
        // A tangent ω, seen past the twist, changes the swing vector by (ω·u) u + (σ / sin σ)(ω·v) v; all is
        // scaled by sin σ / σ, which leaves a direction also at the antipode (σ = π).
        let sinc = if angle > 1e-6 { maths::sin(angle) / angle } else { 1.0 };
        let pull_back = |gradient: DVec2| {
            let n = u3 * (gradient.dot(u) * sinc) + v3 * gradient.dot(v);
            back * n.try_normalize().unwrap_or(u3)
        };
        let (a, b) = (self.swing.x, self.swing.y);
        if a < ANTIPODE || b < ANTIPODE {
            for (idx, (width, value, axis)) in
                [(a, swing.x, DVec2::X), (b, swing.y, DVec2::Y)].into_iter().enumerate()
            {
                let both_ways = width < ANTIPODE;
                if both_ways || value.abs() >= width - margin {
                    let direction = pull_back(if value < 0.0 { -axis } else { axis });
                    normals[idx] = Some(ConeNormal { direction, both_ways });
                }
            }
        } else if self.ellipse_excess(swing) >= -2.0 * margin / a.min(b) && !(a >= PI && b >= PI) {
            let gradient = swing / (self.swing * self.swing);
            normals[0] = Some(ConeNormal { direction: pull_back(gradient), both_ways: false });
        }
        let range = self.twist;
        let whole_turn = range.max - range.min >= 2.0 * PI;
        if !whole_turn && (twist >= range.max - margin || twist <= range.min + margin) {
            // dθ = ω · (axis + tan(σ/2) axis × u), scaled by cos(σ/2).
            let (s, c) = maths::sin_cos(0.5 * angle);
            let gradient = self.axis * c + self.axis.cross(u3) * s;
            let upper = (twist - range.max).abs() <= (twist - range.min).abs();
            let direction = back * if upper { gradient } else { -gradient };
            normals[2] = Some(ConeNormal { direction, both_ways: range.max - range.min < ANTIPODE });
        }
        normals
    }

    /// The limit as a box in the tangent space of `q` (the space of ω in `q · exp(ω)`): to first order, how far
    /// `q` may turn along three perpendicular axes, and how strongly the boundary bends.
    #[must_use]
    pub fn tangent_box(&self, q: DQuat) -> TangentBox {
        let (swing, twist) = self.swing_twist(q);
        let back = maths::turn_about(self.axis, -twist);
        let angle = swing.length();
        let u = if angle > 1e-12 { swing / angle } else { DVec2::X };
        let v = DVec2::new(-u.y, u.x);
        let (u3, v3) = (self.in_space(u), self.in_space(v));
        let sinc = if angle > 1e-6 { (maths::sin(angle) / angle).max(1e-6) } else { 1.0 };
        // As for the normals, but with the true length: by how much a function of the swing grows.
        let pull_back = |gradient: DVec2| u3 * gradient.dot(u) + v3 * (gradient.dot(v) / sinc);
        let (a, b) = (self.swing.x, self.swing.y);
        let free = (f64::NEG_INFINITY, f64::INFINITY);
        let (mut limits, mut curvature) = ([(DVec3::ZERO, free); 3], 0.0);
        if a < ANTIPODE || b < ANTIPODE {
            limits[0] = (pull_back(DVec2::X), (-a - swing.x, a - swing.x));
            limits[1] = (pull_back(DVec2::Y), (-b - swing.y, b - swing.y));
        } else if !(a >= PI && b >= PI) {
            let level = (swing / self.swing).length();
            let gradient =
                if level > 1e-9 { swing / (self.swing * self.swing) / level } else { u / self.swing };
            limits[0] = (pull_back(gradient), (f64::NEG_INFINITY, 1.0 - level));
            // Of the ellipse at the angle at which the swing lies.
            let on = (swing / self.swing).normalize_or(DVec2::X);
            curvature = a * b / DVec2::new(b * on.x, a * on.y).length().powi(3).max(1e-9);
            curvature = curvature.min(1e3);
        }
        if self.twist.max - self.twist.min < 2.0 * PI {
            let (s, c) = maths::sin_cos(0.5 * angle);
            let gradient = self.axis + self.axis.cross(u3) * (s / c.max(1e-6));
            limits[2] = (gradient, (self.twist.min - twist, self.twist.max - twist));
        }
        perpendicular_box(limits, curvature, back)
    }

    fn in_space(&self, v: DVec2) -> DVec3 {
        self.first * v.x + self.second * v.y
    }
}

/// A cone, seen from a rotation in its tangent space: to first order a box.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct TangentBox {
    /// Three perpendicular unit axes in the tangent space.
    pub axes: [DVec3; 3],
    /// How far along each axis the limits lie, behind (not positive inside) and ahead (not negative inside), in radians.
    pub room: [(f64, f64); 3],
    /// How strongly the swing boundary bends, per radian: along the other axes it falls back by half of
    /// this times the square of the way.
    pub curvature: f64,
}

/// Makes gradients with their ranges into perpendicular axes with room along each.
fn perpendicular_box(limits: [(DVec3, (f64, f64)); 3], curvature: f64, back: DQuat) -> TangentBox {
    let mut axes = [DVec3::ZERO; 3];
    let mut room = [(f64::NEG_INFINITY, f64::INFINITY); 3];
    let mut n = 0;
    for (gradient, (down, up)) in limits {
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
    TangentBox { axes: axes.map(|axis| back * axis), room, curvature }
}

/// A limit that a rotation lies on.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ConeNormal {
    /// Outward unit normal in the tangent space of the rotation.
    pub direction: DVec3,
    /// Whether the limit has no width, so that neither direction is free.
    pub both_ways: bool,
}

/// The nearest point of the filled ellipse with the given half-widths to a point outside it.
fn nearest_on_ellipse(point: DVec2, widths: DVec2) -> DVec2 {
    let (a, b) = (widths.x, widths.y);
    if a < ANTIPODE || b < ANTIPODE {
        return point.clamp(-widths, widths);
    }
    // The nearest point is x_i = w_i² p_i / (t + w_i²) for the root t ≥ 0 of
    // F(t) = Σ (w_i p_i / (t + w_i²))² − 1. F falls and is convex, so Newton's method from the left of the
    // root climbs towards it and never passes it.
    let (p, w2) = (point.abs(), widths * widths);
    let mut t = (widths * p - w2).max_element().max(0.0);
    for _ in 0..64 {
        let ratio = widths * p / (w2 + t);
        let value = ratio.length_squared() - 1.0;
        let slope = -2.0 * (ratio * ratio / (w2 + t)).element_sum();
        let step = value / slope;
        t -= step;
        if step.abs() <= 1e-16 * (t + w2.max_element()) {
            break;
        }
    }
    let nearest = w2 * p / (w2 + t);
    // Rounding may leave the point a hair outside; scaling it puts it on the ellipse.
    let length = (nearest / widths).length();
    (nearest / length.max(1.0)).copysign(point)
}

/// How far a point in an ellipse lies from its edge. Half-widths are above 0.
fn distance_inside_ellipse(point: DVec2, widths: DVec2) -> f64 {
    // As for a point outside, but the root lies between −w² of the shorter axis and 0; it is counted from there,
    // since it may be very near. Exactly on the longer axis the nearest point leaves it, as it does a hair
    // beside it.
    let (p, w2) = (point.abs().max(widths * 1e-12), widths * widths);
    let beyond = w2 - w2.min_element();
    let mut t = (widths * p - beyond).max_element();
    for _ in 0..64 {
        // Newton's method on 1/|r|, which is almost straight even next to the pole at 0.
        let r = widths * p / (beyond + t);
        let length = r.length();
        let step = (length - 1.0) * length * length / (r * r / (beyond + t)).element_sum();
        t += step;
        if step.abs() <= 1e-15 * t {
            break;
        }
    }
    p.distance(w2 * p / (beyond + t))
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    fn quaternions() -> impl Strategy<Value = DQuat> {
        prop::array::uniform4(-1.0..1.0f64).prop_filter_map("not zero", |a| {
            let q = DQuat::from_array(a);
            (q.length() > 0.05).then(|| q.normalize())
        })
    }

    fn cones() -> impl Strategy<Value = Cone> {
        let widths = prop::array::uniform2(prop_oneof![Just(0.0), Just(PI), 0.0..PI]);
        (prop::array::uniform3(-1.0..1.0f64), widths, -PI..PI, 0.0..2.0 * PI).prop_filter_map(
            "an axis",
            |(axis, widths, lo, span)| {
                Cone::new(DVec3::from(axis), widths, Range::new(lo, (lo + span).min(PI))).ok()
            },
        )
    }

    proptest! {
        #[test]
        fn decompose_and_compose_are_inverse(cone in cones(), q in quaternions()) {
            let (swing, twist) = cone.decompose(q);
            prop_assert!(cone.compose(swing, twist).dot(q).abs() > 1.0 - 1e-14);
            prop_assert!(DVec2::from(swing).length() <= PI + 1e-12 && twist.abs() <= PI + 1e-12);
        }

        #[test]
        fn projection_ends_inside_and_stays(cone in cones(), q in quaternions()) {
            let p = cone.project(q).unwrap_or(q);
            prop_assert!(cone.distance(p).iter().all(|d| *d < 1e-9), "{:?} {:?}", cone.distance(p), cone.decompose(p));
            let again = cone.project(p).unwrap_or(p);
            prop_assert!(again.dot(p).abs() > 1.0 - 1e-12);
        }

        #[test]
        fn projected_swing_is_the_nearest_of_many(
            widths in prop::array::uniform2(0.01..3.0f64), p in prop::array::uniform2(-4.0..4.0f64)
        ) {
            let (p, w) = (DVec2::from(p), DVec2::from(widths));
            prop_assume!((p / w).length() > 1.0);
            let best = nearest_on_ellipse(p, w);
            prop_assert!((best / w).length() <= 1.0 + 1e-12);
            for i in 0..720 {
                let on = DVec2::from_angle(f64::from(i) * PI / 360.0) * w;
                prop_assert!(p.distance(best) <= p.distance(on) + 1e-9);
            }
        }

        #[test]
        fn margins_are_distances_to_the_edge(
            axis in prop::array::uniform3(-1.0..1.0f64), widths in prop::array::uniform2(0.05..3.1f64),
            at in 0.0..0.999f64, direction in 0.0..6.3f64, on_axis in 0..3usize, twist in -1.5..1.5f64,
        ) {
            prop_assume!(DVec3::from(axis).length() > 0.1);
            let widths = DVec2::from(widths);
            let cone = Cone::new(DVec3::from(axis), widths.to_array(), Range::new(-2.0, 1.6)).unwrap();
            let unit = [DVec2::from_angle(direction), DVec2::X, DVec2::Y][on_axis];
            let swing = unit * widths * at;
            let [swing_margin, twist_margin] = cone.margin(cone.compose(swing.to_array(), twist));
            prop_assert!((twist_margin - (twist + 2.0).min(1.6 - twist)).abs() < 1e-9);
            // The nearest of many points of the edge, then of many around that one.
            let far = |angle: f64| swing.distance(DVec2::from_angle(angle) * widths);
            let nearest_of = |around: f64, step: f64| {
                let angles = (-200..=200).map(|i| around + f64::from(i) * step);
                angles.min_by(|a, b| far(*a).total_cmp(&far(*b))).unwrap()
            };
            let nearest = far(nearest_of(nearest_of(0.0, PI / 200.0), PI / 200.0 / 200.0));
            prop_assert!(swing_margin <= nearest + 1e-9 && swing_margin > nearest - 1e-4, "{} {}", swing_margin, nearest);
            // Outside it is how far outside, negative.
            let out = cone.compose((unit * widths * 1.01).to_array(), 1.7);
            let [swing_out, twist_out] = cone.margin(out);
            prop_assert!(swing_out <= 0.0 || (unit * widths * 1.01).length() > PI);
            prop_assert!(twist_out < 0.0 || (unit * widths * 1.01).length() > PI);
        }

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

    #[test]
    fn antipode_has_no_twist_and_finite_normals() {
        let cone = Cone::new(DVec3::Y, [1.0, 0.5], Range::new(-0.5, 0.5)).unwrap();
        for i in 0..16 {
            let u = DVec3::new((f64::from(i) * 0.4).cos(), 0.0, (f64::from(i) * 0.4).sin());
            let q = DQuat::from_axis_angle(u, PI);
            let (swing, twist) = cone.decompose(q);
            assert!((DVec2::from(swing).length() - PI).abs() < 1e-9 && twist.abs() < 1e-6);
            for n in cone.normals(q, 1e-9).into_iter().flatten() {
                assert!((n.direction.length() - 1.0).abs() < 1e-9);
            }
            let p = cone.project(q).unwrap();
            assert!(cone.distance(p).iter().all(|d| *d < 1e-9));
        }
    }

    #[test]
    fn bad_numbers_are_refused_each_alone() {
        let full = Range::new(-PI, PI);
        assert!(matches!(Cone::new(DVec3::ZERO, [1.0, 1.0], full), Err(ConeError::Axis(_))));
        assert!(matches!(Cone::new(DVec3::NAN, [1.0, 1.0], full), Err(ConeError::Axis(_))));
        assert!(matches!(Cone::new(DVec3::Y, [4.0, 1.0], full), Err(ConeError::Swing(_))));
        assert!(matches!(Cone::new(DVec3::Y, [1.0, f64::NAN], full), Err(ConeError::Swing(_))));
        assert!(matches!(Cone::new(DVec3::Y, [1.0, 1.0], Range::new(1.0, -1.0)), Err(ConeError::Twist(..))));
        assert!(matches!(Cone::new(DVec3::Y, [1.0, 1.0], Range::UNLIMITED), Err(ConeError::Twist(..))));
    }
}
