//! Functions that give the same bits on every platform: what the standard library hands on to the platform's own
//! mathematics, here in plain arithmetic. Square roots and rounding are exact anywhere and not here.

use glam::{DQuat, DVec3};

use crate::trig;

/// `(sin x, cos x)` for `x` in radians, within two units in the last place of 1 up to a magnitude of 10⁶, and to the last
/// place beyond. NaN for what is not finite.
#[inline(always)]
#[must_use]
pub fn sin_cos(x: f64) -> (f64, f64) {
    trig::sin_cos(x)
}

/// The sine of an angle in radians.
#[inline]
#[must_use]
pub fn sin(x: f64) -> f64 {
    trig::sin_cos(x).0
}

/// The cosine of an angle in radians.
#[inline]
#[must_use]
pub fn cos(x: f64) -> f64 {
    trig::sin_cos(x).1
}

/// The tangent of an angle in radians.
#[inline]
#[must_use]
pub fn tan(x: f64) -> f64 {
    libm::tan(x)
}

/// The angle of the point `(x, y)` in radians, in `[-π, π]`; 0 or ±π, by the signs of zeros, at the origin.
#[inline]
#[must_use]
pub fn atan2(y: f64, x: f64) -> f64 {
    libm::atan2(y, x)
}

/// `√(x² + y²)`, for numbers whose squares neither overflow nor vanish: from 1e-150 to 1e150.
#[inline(always)]
#[must_use]
pub fn hypot(x: f64, y: f64) -> f64 {
    (x * x + y * y).sqrt()
}

/// The unit quaternion of one of any length; `None` where that is 0 or not finite.
pub(crate) fn unit_quaternion(q: DQuat) -> Option<DQuat> {
    // Scaled first, so that neither huge nor tiny numbers overflow on the way.
    let largest = q.to_array().into_iter().fold(0.0, |m: f64, c| m.max(c.abs()));
    (q.is_finite() && largest > 0.0).then(|| DQuat::from_array(q.to_array().map(|c| c / largest)).normalize())
}

/// How many whole turns an angle (radians) is away from the nearest within half a turn. Half a turn itself is none,
/// whatever rounding makes of it: both ways are as short.
#[must_use]
pub fn whole_turns(angle: f64) -> f64 {
    const ROUNDING: f64 = 1e-9;
    let turns = angle / std::f64::consts::TAU;
    (turns.abs() - 0.5 - ROUNDING).ceil().max(0.0).copysign(turns)
}

/// `eˣ`
#[inline]
#[must_use]
pub fn exp(x: f64) -> f64 {
    libm::exp(x)
}

/// The natural logarithm; NaN below 0.
#[inline]
#[must_use]
pub fn ln(x: f64) -> f64 {
    libm::log(x)
}

/// `xʸ`
#[inline]
#[must_use]
pub fn powf(x: f64, y: f64) -> f64 {
    libm::pow(x, y)
}

/// The rotation by an angle (radians) about a unit axis.
#[inline]
#[must_use]
pub fn turn_about(axis: DVec3, angle: f64) -> DQuat {
    let (s, c) = trig::sin_cos(0.5 * angle);
    let v = axis * s;
    DQuat::from_xyzw(v.x, v.y, v.z, c)
}

/// The rotation of a rotation vector (radians): `exp(ω)`, whose inverse is
/// [`rotation_vector`](crate::rotation_vector).
#[inline(always)]
#[must_use]
pub fn turn_by(omega: DVec3) -> DQuat {
    let angle2 = omega.length_squared();
    let (k, w) = if angle2 < 1e-8 {
        (0.5 - angle2 / 48.0, 1.0 - angle2 / 8.0)
    } else {
        let angle = angle2.sqrt();
        let (s, c) = trig::sin_cos(0.5 * angle);
        (s / angle, c)
    };
    DQuat::from_xyzw(omega.x * k, omega.y * k, omega.z * k, w)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn all_agree_with_the_standard_library() {
        let near = |a: f64, b: f64| a == b || (a - b).abs() <= 1e-15 * (1.0 + b.abs());
        for i in -400..400_i32 {
            let (x, y) = (f64::from(i) * 0.037, f64::from(i % 23) * 0.41 - 3.0);
            assert!(
                near(sin(x), x.sin()) && near(cos(x), x.cos()) && near(atan2(x, y), x.atan2(y)),
                "{x}, {y}"
            );
            assert!((tan(x) - x.tan()).abs() <= 1e-14 * (1.0 + x.tan().powi(2)), "{x}");
            assert!(near(hypot(x, y), x.hypot(y)) && (exp(y) - y.exp()).abs() <= 1e-15 * y.exp());
            assert!(
                near(ln(x.abs() + 0.1), (x.abs() + 0.1).ln())
                    && near(powf(x.abs() + 0.1, y * 0.1), (x.abs() + 0.1).powf(y * 0.1))
            );
            let axis = DVec3::new(x, y, 1.0).normalize();
            for q in [turn_about(axis, x), turn_by(axis * x)] {
                let other = DQuat::from_axis_angle(axis, x);
                assert!((q - other).length() < 1e-14 * (1.0 + x.abs()), "{x}");
            }
        }
        assert!((turn_by(DVec3::X * 1e-5) - DQuat::from_rotation_x(1e-5)).length() < 1e-16);
        assert_eq!([atan2(0.0, -1.0), atan2(-0.0, -1.0)], [std::f64::consts::PI, -std::f64::consts::PI]);
        assert!(sin(f64::NAN).is_nan() && cos(f64::INFINITY).is_nan() && ln(-1.0).is_nan());
    }
}
