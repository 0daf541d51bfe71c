//! Angles without limits, continued from pose to pose instead of beginning anew after a turn.

use std::f64::consts::TAU;

use super::Clip;
use crate::joint::JointMotion;
use crate::maths::whole_turns;
use crate::rig::Rig;

impl Clip {
    /// This motion with angles that do not jump by whole turns: each angle without limits, of a hinge or an
    /// Euler joint, is within half a turn of the one before. What takes the numbers one by one, as tables and
    /// most players do, then goes the short way that [`sample`](Self::sample) goes.
    ///
    /// The first pose stays as it is. So do angles with limits, where another turn would be outside, and those of
    /// hinges that others follow, whose followers would turn by a part of it.
    #[must_use]
    pub fn unwrapped(mut self) -> Self {
        let coords = wrapping(self.rig());
        for idx in 1..self.poses.len() {
            let (before, rest) = self.poses.split_at_mut(idx);
            let (Some(before), Some(pose)) = (before.last(), rest.first_mut()) else { break };
            for at in &coords {
                let (previous, angle) = (before.coords()[*at], &mut pose.coords_mut()[*at]);
                let whole = whole_turns(*angle - previous);
                if whole != 0.0 {
                    *angle -= whole * TAU;
                }
            }
        }
        self
    }
}

/// The coordinates of a rig's poses that are angles without limits.
fn wrapping(rig: &Rig) -> Vec<usize> {
    let mut is_led = vec![false; rig.n_joints()];
    for mimic in rig.joints().iter().filter_map(|joint| joint.mimic) {
        is_led[mimic.leader.index()] = true;
    }
    let mut coords = Vec::new();
    for (id, joint) in rig.ids().zip(rig.joints()) {
        let turns = matches!(joint.motion, JointMotion::Hinge { .. } | JointMotion::Euler { .. });
        if turns && joint.mimic.is_none() && !is_led[id.index()] {
            let ranges = joint.motion.ranges().iter().zip(rig.coords_of(id));
            coords.extend(ranges.filter(|(range, _)| range.is_unlimited()).map(|(_, at)| at));
        }
    }
    coords
}

#[cfg(test)]
#[allow(clippy::unwrap_used, reason = "a test fails by a panic")]
mod tests {
    use super::*;
    use crate::joint::{EulerOrder, Joint, JointId};
    use crate::limit::Range;
    use crate::rig::RigBuilder;
    use glam::DVec3;

    fn turning(range: Range) -> Rig {
        let mut builder = RigBuilder::new();
        let mut hinge = Joint::new("hinge", None);
        hinge.motion = JointMotion::Hinge { axis: DVec3::Z, range };
        builder.add(hinge);
        let mut euler = Joint::new("euler", None);
        let ranges = [Range::UNLIMITED, Range::degrees(-400.0, 400.0), Range::UNLIMITED];
        euler.motion = JointMotion::Euler { order: EulerOrder::Zyx, ranges };
        builder.add(euler);
        builder.build().unwrap()
    }

    fn clip(rig: &Rig, degrees: &[f64]) -> Clip {
        let poses = degrees.iter().map(|degrees| {
            let mut pose = rig.rest_pose();
            pose.set_value(JointId::from_index(0), degrees.to_radians()).unwrap();
            pose.set_euler(JointId::from_index(1), [degrees.to_radians(); 3]).unwrap();
            pose
        });
        Clip::new("turn", (0u8..).map(f64::from).take(degrees.len()).collect(), poses.collect()).unwrap()
    }

    #[test]
    fn angles_without_limits_go_on_and_those_with_limits_stay() {
        let degrees = [700.0, -170.0, 170.0, -350.0, 0.0];
        let continued = [700.0, 550.0, 530.0, 370.0, 360.0];
        for (range, expected) in [(Range::UNLIMITED, continued), (Range::degrees(-720.0, 720.0), degrees)] {
            let before = clip(&turning(range), &degrees);
            let after = before.clone().unwrapped();
            for (idx, (a, b)) in before.poses().iter().zip(after.poses()).enumerate() {
                let hinge = b.value(JointId::from_index(0)).unwrap().to_degrees();
                assert!((hinge - expected[idx]).abs() < 1e-9, "{hinge}");
                let euler = b.euler(JointId::from_index(1)).unwrap().map(f64::to_degrees);
                let expected = [continued[idx], degrees[idx], continued[idx]];
                assert!((0..3).all(|i| (euler[i] - expected[i]).abs() < 1e-9), "{euler:?}");
                for (a, b) in a.kernel_frames().iter().zip(b.kernel_frames()) {
                    assert!(a.rotation.quaternion().dot(b.rotation.quaternion()).abs() > 1.0 - 1e-12);
                }
            }
        }
    }
}
