//! The many ways to write one rotation as three angles, and the one that goes on best from frame to frame.

use std::f64::consts::{PI, TAU};

use glam::DQuat;
use ikiru_rig::EulerOrder;
use ikiru_rig::maths::whole_turns;

/// Degrees that are no rotation.
pub(super) const TINY_DEG: f64 = 1e-9;

/// The angles (x, y, z, radians) of a rotation in an order: those nearest to the angles `before`, or else with the
/// middle one within ±π/2 and the others within ±π.
///
/// Every rotation has two triples of angles within a turn, and whole turns may be added to each angle. An axis
/// that is not `present` has no channel: where one of the triples leaves its angle at 0, that one is taken.
pub(super) fn nearest(order: EulerOrder, q: DQuat, present: [bool; 3], before: Option<[f64; 3]>) -> [f64; 3] {
    // In gimbal lock the last angle may have to stay 0.
    let canonical = canonical(order, q, before.filter(|_| present == [true; 3]));
    let [_, middle, _] = order.axes();
    let mut flipped = canonical.map(|angle| angle + PI);
    flipped[middle] = PI - canonical[middle];
    let [canonical, flipped] = [canonical, flipped].map(|angles| Candidate::new(angles, present, before));
    let take_flipped = match (canonical.fits, flipped.fits) {
        (true, true) => before.is_some() && flipped.distance < canonical.distance,
        (fits, other_fits) => !fits && other_fits,
    };
    if take_flipped { flipped.angles } else { canonical.angles }
}

/// One of the two triples, with the whole turns that bring it nearest.
struct Candidate {
    angles: [f64; 3],
    /// Whether axes without a channel are at 0.
    fits: bool,
    /// Squared, to the angles before.
    distance: f64,
}

impl Candidate {
    fn new(mut angles: [f64; 3], present: [bool; 3], before: Option<[f64; 3]>) -> Self {
        let (mut fits, mut distance) = (true, 0.0);
        for axis in 0..3 {
            let near = before.filter(|_| present[axis]).map_or(0.0, |before| before[axis]);
            angles[axis] -= TAU * whole_turns(angles[axis] - near);
            distance += (angles[axis] - near).powi(2);
            fits &= present[axis] || angles[axis].abs().to_degrees() <= TINY_DEG;
        }
        Self { angles, fits, distance }
    }
}

/// The middle angle within ±π/2, the others within ±π. The last is computed from what the others leave, so
/// that the product is exact also near gimbal lock. In the lock, where first and last turn about one axis, the first
/// stays as it was `before`.
fn canonical(order: EulerOrder, q: DQuat, before: Option<[f64; 3]>) -> [f64; 3] {
    let mut angles = order.angles(q);
    let [first, middle, last] = order.axes();
    if let (Some(before), true) = (before, angles[middle].cos() < 1e-9) {
        angles[first] = before[first];
    }
    angles[last] = 0.0;
    let left = order.quaternion(angles).inverse() * q;
    let along = left.to_array()[last];
    angles[last] = 2.0 * if left.w < 0.0 { (-along).atan2(-left.w) } else { along.atan2(left.w) };
    angles
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    const ALL: [bool; 3] = [true; 3];

    proptest! {
        #[test]
        fn the_angles_give_the_rotation_and_are_at_most_as_far_as_those_that_made_it(
            made in prop::array::uniform3(-9.0..9.0f64), apart in prop::array::uniform3(-0.5..0.5f64),
        ) {
            for order in EulerOrder::ALL {
                let q = order.quaternion(made);
                let before: [f64; 3] = std::array::from_fn(|axis| made[axis] + apart[axis]);
                let found = nearest(order, q, ALL, Some(before));
                prop_assert!(order.quaternion(found).dot(q).abs() > 1.0 - 1e-12);
                let far = |angles: [f64; 3]| (0..3).map(|i| (angles[i] - before[i]).powi(2)).sum::<f64>();
                prop_assert!(far(found) <= far(made) + 1e-9);
                let [first, middle, last] = order.axes();
                let alone = nearest(order, q, ALL, None);
                prop_assert!(alone[middle].abs() <= PI / 2.0 + 1e-9);
                prop_assert!(alone[first].abs().max(alone[last].abs()) <= PI + 1e-9);
            }
        }

        #[test]
        fn in_gimbal_lock_the_first_angle_waits(a in -3.0..3.0f64, b in -3.0..3.0f64, up in any::<bool>()) {
            for order in EulerOrder::ALL {
                let [first, middle, last] = order.axes();
                let mut angles = [0.0; 3];
                (angles[first], angles[last]) = (a, b);
                angles[middle] = if up { PI / 2.0 } else { -PI / 2.0 };
                let q = order.quaternion(angles);
                let found = nearest(order, q, ALL, Some(angles));
                prop_assert!(order.quaternion(found).dot(q).abs() > 1.0 - 1e-12);
                prop_assert!((0..3).all(|axis| (found[axis] - angles[axis]).abs() < 1e-6), "{found:?} {angles:?}");
            }
        }
    }

    #[test]
    fn half_a_turn_leaves_the_angle_as_it_is() {
        let order = EulerOrder::Zxy;
        for apart in [0.0, 1e-14, -1e-14] {
            for (from, to) in [(PI / 2.0, -PI / 2.0), (-PI / 2.0, PI / 2.0)] {
                let q = order.quaternion([0.0, 0.0, to + apart]);
                let found = nearest(order, q, [false, false, true], Some([0.0, 0.0, from]));
                assert!((found[2] - to).abs() < 1e-9, "{found:?}");
            }
        }
    }

    #[test]
    fn an_axis_without_a_channel_stays_at_0() {
        let order = EulerOrder::Zxy;
        let [first, middle, last] = order.axes();
        let mut present = ALL;
        present[last] = false;
        // Beyond ±π/2, the canonical triple needs the last angle.
        let mut angles = [0.0; 3];
        (angles[first], angles[middle]) = (0.3, 2.5);
        let found = nearest(order, order.quaternion(angles), present, None);
        assert!((0..3).all(|axis| (found[axis] - angles[axis]).abs() < 1e-12), "{found:?}");
    }
}
