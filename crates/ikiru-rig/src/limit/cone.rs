//! The limit of a ball: an elliptic cone for the swing, a range for the twist.

use std::f64::consts::PI;

use glam::{DQuat, DVec2, DVec3};

use super::centre::{ConeCentre, Folded};
use super::cone_error::ConeError;
use super::ellipse::{distance_inside_ellipse, nearest_on_ellipse};
use super::{ANTIPODE, Range};
use crate::maths;

/// An exact limit of a ball joint: an elliptic cone for the swing, a range for the twist, about one axis.
///
/// A rotation is taken apart as `q = swing · twist`: the twist turns about `axis`, the swing is
/// `exp(s)` with `s ⊥ axis`. Inside means `(s₁/a)² + (s₂/b)² ≤ 1` and `twist.min ≤ θ ≤ twist.max`.
/// `s₁` is measured about [`first_swing_axis`](Self::first_swing_axis). At a swing of π, where the
/// twist is not defined, it is 0 by rule.
///
/// `q` is the rotation of the joint's motion, so that the cone is about the rest pose; with a
/// [centre](Self::with_centre) the same holds for another rotation in its place.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Cone {
    pub(super) axis: DVec3,
    pub(super) first: DVec3,
    pub(super) second: DVec3,
    pub(super) swing: DVec2,
    pub(super) twist: Range,
    centre: Option<Folded>,
}

impl Cone {
    /// A cone about the rest pose and about `axis` (in the joint's frame, any length): half-widths `swing` of the ellipse and the
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
        Ok(Self { axis: unit, first, second: unit.cross(first), swing, twist, centre: None })
    }

    /// This cone about another centre than the rest pose: its axes, and swing and twist about them, are then those of
    /// `L = P⁻¹ · (rest · q) · K`. The quaternions may have any length.
    ///
    /// `rest` is the identity until a joint has the cone: [`RigBuilder::build`](crate::RigBuilder::build) gives every cone the
    /// rest rotation of its joint.
    ///
    /// ```
    /// use glam::{DQuat, DVec3};
    /// use ikiru_rig::{Cone, ConeCentre, Range};
    ///
    /// // An upper arm along +x at rest, whose middle is 30° further down and 40° further forward.
    /// let middle = DQuat::from_rotation_y(-40_f64.to_radians()) * DQuat::from_rotation_z(-30_f64.to_radians());
    /// let cone = Cone::new(DVec3::X, [1.9, 1.5], Range::degrees(-110.0, 75.0))?;
    /// let cone = cone.with_centre(ConeCentre { parent_rotation: middle, ..ConeCentre::default() })?;
    /// let ([about_y, about_z], twist) = cone.decompose(middle);
    /// assert!(about_y.abs() < 1e-9 && about_z.abs() < 1e-9 && twist.abs() < 1e-9);
    /// # Ok::<(), ikiru_rig::ConeError>(())
    /// ```
    ///
    /// # Errors
    /// When a rotation is not finite or has the length 0.
    pub fn with_centre(self, centre: ConeCentre) -> Result<Self, ConeError> {
        Ok(Self { centre: Some(Folded::new(&centre)?), ..self })
    }

    /// This cone about the rest pose.
    #[must_use]
    pub fn without_centre(self) -> Self {
        Self { centre: None, ..self }
    }

    /// This cone for a joint of that rest rotation (a unit quaternion), whatever the cone was told before.
    pub(crate) fn at_rest(self, rest: DQuat) -> Self {
        Self { centre: self.centre.map(|folded| Folded::of(folded.centre, rest)), ..self }
    }

    /// The centre, with unit quaternions; `None` for a cone about the rest pose.
    #[must_use]
    pub fn centre(&self) -> Option<ConeCentre> {
        self.centre.map(|folded| folded.centre)
    }

    /// The twist axis, a unit vector; in the joint's frame, with a [centre](Self::with_centre) in the cone's own.
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

    pub(super) fn swing_twist(&self, q: DQuat) -> (DVec2, f64) {
        let q = self.centre.as_ref().map_or(q, |centre| centre.enter(q));
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
        let l = (maths::turn_by(s) * maths::turn_about(self.axis, twist)).normalize();
        self.centre.as_ref().map_or(l, |centre| centre.leave(l))
    }

    /// What a tangent is turned by that was seen past a twist: into the tangent space of the rotation as a whole.
    pub(super) fn back_from_twist(&self, twist: f64) -> DQuat {
        let back = maths::turn_about(self.axis, -twist);
        self.centre.as_ref().map_or(back, |centre| centre.tangent_from_cone() * back)
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

    pub(super) fn ellipse_excess(&self, s: DVec2) -> f64 {
        if self.swing.min_element() > 0.0 {
            (s / self.swing).length_squared() - 1.0
        } else {
            let (a, b) = (self.swing.x, self.swing.y);
            (s.x.abs() - a).max(s.y.abs() - b)
        }
    }

    pub(super) fn in_space(&self, v: DVec2) -> DVec3 {
        self.first * v.x + self.second * v.y
    }
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
