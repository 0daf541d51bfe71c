//! How the rotation `exp(φ)` turns while `φ` changes: the derivative of the exponential map.

use glam::DVec3;

/// Squared angle (rad²) below which series are used: quotients would lose digits there.
const SMALL: f64 = 1e-3;

/// The angular velocity, in the turned frame, of `exp(φ)` while the rotation vector `φ` changes at `rate`: the right
/// Jacobian of SO(3) times `rate` (Chirikjian, *Stochastic Models, Information Theory, and Lie Groups* 2, 10.86).
pub(super) fn velocity_of_exp(phi: DVec3, rate: DVec3) -> DVec3 {
    let angle2 = phi.length_squared();
    let (a, b) = if angle2 < SMALL {
        (0.5 - angle2 * (1.0 / 24.0 - angle2 / 720.0), 1.0 / 6.0 - angle2 * (1.0 / 120.0 - angle2 / 5_040.0))
    } else {
        let angle = angle2.sqrt();
        let (sin, cos) = crate::trig::sin_cos(angle);
        ((1.0 - cos) / angle2, (angle - sin) / (angle2 * angle))
    };
    let across = phi.cross(rate);
    rate - across * a + phi.cross(across) * b
}

/// The inverse of [`velocity_of_exp`]: the rate of `φ` that gives an angular velocity. For angles below 2π.
pub(super) fn rate_of_log(phi: DVec3, velocity: DVec3) -> DVec3 {
    let angle2 = phi.length_squared();
    let c = if angle2 < SMALL {
        1.0 / 12.0 + angle2 * (1.0 / 720.0 + angle2 / 30_240.0)
    } else {
        let (sin, cos) = crate::trig::sin_cos(0.5 * angle2.sqrt());
        (1.0 - 0.5 * angle2.sqrt() * cos / sin) / angle2
    };
    let across = phi.cross(velocity);
    velocity + across * 0.5 + phi.cross(across) * c
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::maths::turn_by as exp;
    use crate::pose::rotation_vector;
    use proptest::prelude::*;

    proptest! {
        #[test]
        fn it_is_the_derivative_and_its_inverse(
            axis in prop::array::uniform3(-1.0..1.0f64), angle in prop_oneof![0.0..0.1f64, 0.0..3.2f64],
            rate in prop::array::uniform3(-2.0..2.0f64),
        ) {
            prop_assume!(DVec3::from(axis).length() > 0.1);
            let (phi, rate) = (DVec3::from(axis).normalize() * angle, DVec3::from(rate));
            let velocity = velocity_of_exp(phi, rate);
            let step = rate * 1e-5;
            let numeric = rotation_vector(exp(phi - step).inverse() * exp(phi + step)) / 2e-5;
            prop_assert!((velocity - numeric).length() < 1e-8);
            prop_assert!((rate_of_log(phi, velocity) - rate).length() < 1e-11);
        }
    }
}
