//! Rotation vectors and directions: what several objectives share.

use glam::{DMat3, DVec3};
use ikiru_rig::{Frame, maths};

use crate::objective::{Rows, Unfit, UnfitReason};

/// The inverse of the right Jacobian of SO(3): `log(exp(φ) exp(ω)) ≈ φ + J⁻¹ ω`, for ‖φ‖ ≤ π.
///
/// `J⁻¹ = I + ½[φ]× + c [φ]×²` with `c = 1/θ² − cot(θ/2)/(2θ)` (Solà et al., *A micro Lie theory*, eq. 144).
#[inline]
pub(crate) fn inverse_right_jacobian(phi: DVec3) -> DMat3 {
    let square = phi.length_squared();
    let c = if square < 1e-6 {
        1.0 / 12.0 + square / 720.0
    } else {
        let theta = square.sqrt();
        let (s, cos) = maths::sin_cos(0.5 * theta);
        1.0 / square - cos / (2.0 * theta * s)
    };
    let skew = DMat3::from_cols(
        DVec3::new(0.0, phi.z, -phi.y),
        DVec3::new(-phi.z, 0.0, phi.x),
        DVec3::new(phi.y, -phi.x, 0.0),
    );
    DMat3::IDENTITY + skew * 0.5 + skew * skew * c
}

/// Two unit vectors perpendicular to a unit axis and to each other, the same ones for the same axis.
#[inline(always)]
pub(crate) fn perpendiculars(axis: DVec3) -> (DVec3, DVec3) {
    let helper = if axis.x.abs() < 0.9 { DVec3::X } else { DVec3::Z };
    let first = helper.cross(axis).normalize();
    (first, axis.cross(first))
}

/// How a direction of the world changes with the frame that is turned towards it.
pub(crate) struct DirectionChange {
    /// The world direction itself (any length but 0).
    pub(crate) direction: DVec3,
    /// It changes by `origin_factor · v` with a velocity of the origin …
    pub(crate) origin_factor: f64,
    /// … and by `ω × arm` with a turn of the frame.
    pub(crate) arm: DVec3,
}

/// Two rows of part 0: the angle from a joint's axis to a direction of the world, as a vector in the joint's frame
/// perpendicular to the axis (the logarithm map of the sphere). Its length is the angle, by atan2; at 0 it is 0 and
/// smooth, at π a fixed perpendicular decides, and a direction without length gives 0.
#[inline(always)]
pub(crate) fn evaluate_direction(
    frame: &Frame<f64>,
    axis: DVec3,
    change: &DirectionChange,
    rows: &mut Rows<'_>,
) {
    let length = change.direction.length();
    if length < 1e-12 {
        rows.open(0, [0.0; 2]);
        return;
    }
    let (e1, e2) = perpendiculars(axis);
    let unit = change.direction / length;
    let seen = frame.rotation.apply_inverse(unit.into()).value();
    let (c, u1, u2) = (seen.dot(axis), seen.dot(e1), seen.dot(e2));
    let sine = maths::hypot(u1, u2);
    let angle = maths::atan2(sine, c);
    // û, the direction to turn in; where it is not defined, e1 decides.
    let (n1, n2, angle_by_sine) = if sine > 1e-9 {
        (u1 / sine, u2 / sine, angle / sine)
    } else {
        (1.0, 0.0, if c > 0.0 { 1.0 } else { 0.0 })
    };
    let is_small = c > 0.0 && sine <= 1e-9;
    let first = rows.open(0, if is_small { [u1, u2] } else { [angle * n1, angle * n2] });
    if !rows.wants_jacobian() {
        return;
    }
    let (w1, w2) = (frame.rotation.apply_constant(e1).value(), frame.rotation.apply_constant(e2).value());
    let axis_in_world = frame.rotation.apply_constant(axis).value();
    // The unit direction moves along the sphere by δ; radially (along û) the angle grows by δ·(û cos − axis sin),
    // across (along t̂) the vector grows by (angle / sine) δ·t̂.
    let radial = (w1 * n1 + w2 * n2) * c - axis_in_world * sine;
    let across = (w2 * n1 - w1 * n2) * angle_by_sine;
    for (row, (a, b)) in [(n1, -n2), (n2, n1)].into_iter().enumerate() {
        let gradient = radial * a + across * b;
        // δ = (direction's change, tangential) / length − ω × unit.
        let tangential = (gradient - unit * gradient.dot(unit)) / length;
        let by_turn = change.arm.cross(tangential) - unit.cross(gradient);
        let out = rows.by_frame(first + row, 0);
        out[..3].copy_from_slice(&(tangential * change.origin_factor).to_array());
        out[3..].copy_from_slice(&by_turn.to_array());
    }
}

/// The unit vector of an axis that [`check_axis`] accepts.
#[inline(always)]
pub(crate) fn unit_axis(axis: DVec3) -> DVec3 {
    axis.normalize_or(DVec3::Y)
}

pub(crate) fn check_axis(axis: DVec3) -> Result<(), Unfit> {
    let length = axis.length();
    if length.is_finite() && length > 1e-100 { Ok(()) } else { Err(UnfitReason::Axis.into()) }
}

#[cfg(test)]
mod tests {
    use super::*;
    use ikiru_testkit::rigs::Random;

    #[test]
    fn perpendiculars_are_unit_vectors_across_the_axis_and_each_other() {
        let mut random = Random::new(1);
        let some = (0..50).map(|_| random.vector(1.0).normalize());
        // Near the axes, where one of the vectors that they are made from has no part across.
        for axis in
            DVec3::AXES.into_iter().flat_map(|a| [a, -a, (a + 0.01 * DVec3::ONE).normalize()]).chain(some)
        {
            let (first, second) = perpendiculars(axis);
            for size in [
                first.length() - 1.0,
                second.length() - 1.0,
                first.dot(axis),
                second.dot(axis),
                first.dot(second),
            ] {
                assert!(size.abs() < 1e-12, "{axis}: {first} {second}");
            }
        }
    }

    #[test]
    fn an_axis_has_a_length() {
        for axis in [DVec3::ZERO, DVec3::NAN, DVec3::INFINITY] {
            assert!(check_axis(axis).is_err(), "{axis}");
        }
        assert!(check_axis(DVec3::X * 1e-90).is_ok());
    }
}
