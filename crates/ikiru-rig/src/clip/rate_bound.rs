//! What a joint's speed or acceleration cannot exceed between two poses, from how far apart the poses are: found in a
//! fraction of the time that measuring takes.

use std::ops::Range;

use super::Clip;
use super::rates::Rate;
use crate::joint::{JointId, JointMotion};
use crate::pose::difference_joint;

/// By how much the slope of a rotation vector can be longer than the angular velocity that it gives, for turns of at
/// most half a circle: `½θ / sin ½θ` at π.
const MOST_STRETCH: f64 = std::f64::consts::FRAC_PI_2;
/// Rounding of what is measured, relative to the bound.
const ROUNDING: f64 = 1e-6;

/// The bounds between each pose of a clip and the next.
pub(super) struct RateBounds<'c> {
    clip: &'c Clip,
    joint: JointId,
    dofs: &'c Range<usize>,
    rate: Rate,
    before: usize,
    /// Lengths of the ways from the pose before the left one, to the right one, and to the one after that; 0 where
    /// there is none.
    ways: [f64; 3],
}

impl<'c> RateBounds<'c> {
    pub(super) fn new(clip: &'c Clip, joint: JointId, dofs: &'c Range<usize>, rate: Rate) -> Self {
        let mut bounds = Self { clip, joint, dofs, rate, before: 0, ways: [0.0; 3] };
        bounds.ways = [0.0, bounds.way(0), bounds.way(1)];
        bounds
    }

    /// How far it is from one pose to the next, over the degrees of freedom that are meant.
    fn way(&self, before: usize) -> f64 {
        let poses = &self.clip.poses;
        let Some(next) = poses.get(before + 1) else { return 0.0 };
        let at = self.clip.rig().coords_of(self.joint);
        let (from, to) = (&poses[before].coords()[at.clone()], &next.coords()[at]);
        if from == to {
            return 0.0;
        }
        let mut way = [0.0; 6];
        difference_joint(&self.clip.rig().joints()[self.joint.index()].motion, from, to, &mut way);
        way[self.dofs.clone()].iter().map(|w| w * w).sum::<f64>().sqrt()
    }

    /// The bound between the current pose and the next.
    ///
    /// The slope of the way's cubic is a quadratic, which lies between its Bézier points: the slopes at both ends and
    /// `3 way − start − end` (`curve.rs`); its own slope is linear. Slopes are clipped to ranges, which only shortens
    /// them. A rotation turns no faster than its rotation vector changes, and accelerates by at most
    /// `‖φ″‖ + ½ ‖φ′‖²`.
    fn bound(&self) -> f64 {
        let (times, before) = (&self.clip.times, self.before);
        let motion = &self.clip.rig().joints()[self.joint.index()].motion;
        let [left, way, right] = self.ways;
        if self.ways == [0.0; 3] {
            return 0.0;
        }
        // A cone may stop a ball at once.
        if motion.cone().is_some() {
            return f64::INFINITY;
        }
        let secs = times[before + 1] - times[before];
        let stretch =
            if let JointMotion::Ball { .. } | JointMotion::Free { .. } = motion { MOST_STRETCH } else { 1.0 };
        // The velocity of the parabola through three poses, carried to the middle way's own time.
        let slope = |way_beside: f64, secs_beside: f64| {
            stretch * (way_beside * secs * secs / secs_beside + way * secs_beside) / (secs + secs_beside)
        };
        let start = (before > 0).then(|| slope(left, times[before] - times[before - 1]));
        let end = times.get(before + 2).map(|after| slope(right, after - times[before + 1]));
        let (start, end) = match (start, end) {
            (Some(start), Some(end)) => (start, end),
            (Some(start), None) => (start, 2.0 * way + start),
            (None, Some(end)) => (2.0 * way + end, end),
            (None, None) => (way, way),
        };
        let slope = 3.0 * way + start + end;
        let bound = match self.rate {
            Rate::Speed => slope / secs,
            Rate::Acceleration | Rate::Jerk => {
                let bend = 2.0 * (3.0 * way + 2.0 * (start + end));
                (bend + 0.5 * slope * slope + ROUNDING * slope) / (secs * secs)
            }
        };
        bound * (1.0 + ROUNDING)
    }
}

impl Iterator for RateBounds<'_> {
    type Item = f64;

    fn next(&mut self) -> Option<f64> {
        if self.before + 1 >= self.clip.poses.len() {
            return None;
        }
        let bound = self.bound();
        self.before += 1;
        self.ways = [self.ways[1], self.ways[2], self.way(self.before + 1)];
        Some(bound)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::clip::RatePart;
    use crate::joint::{EulerOrder, Joint};
    use crate::limit::Cone;
    use crate::limit::Range as Limits;
    use crate::rig::{Rig, RigBuilder};
    use glam::DVec3;

    /// A joint of every motion, side by side.
    fn every_motion() -> Rig {
        let axis = DVec3::new(0.6, 0.0, 0.8);
        let cone = Cone::new(DVec3::Y, [0.7, 0.4], Limits::new(-0.5, 0.6)).unwrap();
        let mut builder = RigBuilder::new();
        for (idx, motion) in [
            JointMotion::Hinge { axis, range: Limits::new(-1.0, 2.0) },
            JointMotion::Hinge { axis, range: Limits::UNLIMITED },
            JointMotion::Slider { axis, range: Limits::new(-0.2, 0.3) },
            JointMotion::Euler { order: EulerOrder::Zyx, ranges: [Limits::new(-1.0, 1.5); 3] },
            JointMotion::Ball { cone: None },
            JointMotion::Ball { cone: Some(cone) },
            JointMotion::Free { cone: None },
        ]
        .into_iter()
        .enumerate()
        {
            let mut joint = Joint::new(format!("joint{idx}"), None);
            joint.motion = motion;
            builder.add(joint);
        }
        builder.build().unwrap()
    }

    #[test]
    fn no_measured_peak_is_above_its_bound() {
        // A small generator of numbers from -1 to 1 (Knuth's constants).
        let mut seed = 3_u64;
        let mut random = move || {
            seed = seed.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
            (seed >> 11) as f64 / (1_u64 << 52) as f64 - 1.0
        };
        let rig = every_motion();
        let mut n_bounds = 0;
        for case in 0..200 {
            let n_poses = 1 + case % 7;
            let (mut times, mut poses) = (vec![0.0], vec![rig.rest_pose()]);
            for _ in 1..n_poses {
                times.push(times[times.len() - 1] + 0.5 + 0.49 * random());
                let mut pose = poses[poses.len() - 1].clone();
                // Standing still, nearby, and anywhere.
                let far = [0.0, 0.1, 2.5][(2.99 * random().abs()) as usize];
                let step: Vec<f64> = (0..rig.n_dofs()).map(|_| far * random()).collect();
                pose.retract(&step).unwrap();
                pose.project();
                poses.push(pose);
            }
            let clip = Clip::new("", times, poses).unwrap();
            for joint in clip.moving() {
                for part in [RatePart::Rotation, RatePart::Translation] {
                    let dofs = part.dofs(&rig, joint);
                    for rate in [Rate::Speed, Rate::Acceleration] {
                        let mut largest = 0.0_f64;
                        for (before, bound) in RateBounds::new(&clip, joint, &dofs, rate).enumerate() {
                            let peak = clip.peak_between(joint, &dofs, rate, before, 0.0).value;
                            if bound == 0.0 {
                                assert!(peak < 1e-12, "{peak} is more than rounding where nothing moves");
                                continue;
                            }
                            assert!(peak <= bound, "case {case}, {rate:?}: {peak} is above {bound}");
                            largest = largest.max(peak);
                            n_bounds += usize::from(bound.is_finite() && bound > 0.0);
                        }
                        let has_cone = rig.joints()[joint.index()].motion.cone().is_some();
                        if largest < 1e-9 || has_cone {
                            // A steady motion has no acceleration but rounding; and where a cone stops a ball at once,
                            // how large it is depends on how closely one looks.
                            continue;
                        }
                        // What bounds leave out changes no peak, above any floor.
                        for floor in [0.0, 0.5 * largest, 0.999 * largest] {
                            let peak = clip.peak_above(joint, part, rate, floor);
                            assert_eq!(peak.map(|peak| peak.value), (largest > floor).then_some(largest));
                        }
                        assert!(clip.peak_above(joint, part, rate, 1.001 * largest).is_none());
                    }
                }
            }
        }
        assert!(n_bounds > 1000, "{n_bounds}");
    }
}
