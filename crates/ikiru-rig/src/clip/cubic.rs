//! A clip as a smooth curve: sampling it anywhere, and how fast it moves there.

use std::ops::Range;

use super::Clip;
use super::curve::{Curve, Dofs};
use super::rate_bound::RateBounds;
use super::rates::{Peak, Rate, RatePart};
use crate::foreign::ForeignJoint;
use crate::joint::JointId;
use crate::pose::Pose;

impl Clip {
    /// The pose at a time (seconds) on a smooth curve through all poses; outside, and at a time that is not a
    /// number, the clip holds still as in [`sample`](Self::sample).
    ///
    /// At each pose the curve has the velocity of the parabola through it and its two neighbours, for any
    /// spacing of the times (Catmull and Rom's where they are even), and it is a parabola towards either
    /// end. Between two poses it is a cubic in the tangent space of the earlier one: `q(u) = q₀ · exp(φ(u))`.
    /// So velocity has no jumps, motion at constant velocity, a turn about one axis included, comes out
    /// exactly, and the sign of a quaternion does not matter.
    ///
    /// It keeps the limits: where two poses are inside a range, the way between them is. Where a ball's curve would
    /// leave its cone between two poses inside, it is projected into it, and its velocity may jump there.
    #[must_use]
    pub fn sample_cubic(&self, secs: f64) -> Pose {
        let mut pose = self.poses[0].clone();
        self.sample_cubic_into(secs, &mut pose);
        pose
    }

    /// [`sample_cubic`](Self::sample_cubic) into the caller's pose, which becomes one of this clip's rig. Does not
    /// allocate where it is one already.
    pub fn sample_cubic_into(&self, secs: f64, pose: &mut Pose) {
        let (before, u) = self.locate(secs);
        pose.clone_from(&self.poses[before]);
        if u > 0.0 {
            let rig = self.rig();
            for joint in self.moving() {
                let at = rig.coords_of(joint);
                let n_coords = at.len();
                let coords = Curve::new(self, joint, before).coords(u);
                pose.coords_mut()[at].copy_from_slice(&coords[..n_coords]);
            }
        }
    }

    /// The velocity on the curve of [`sample_cubic`](Self::sample_cubic) at a time (seconds): a tangent a second
    /// ([`Rig::n_dofs`](crate::Rig::n_dofs) entries, rad/s and m/s). From the first to the last time it is that of
    /// the curve, both included; zeros elsewhere.
    #[must_use]
    pub fn velocity_cubic(&self, secs: f64) -> Vec<f64> {
        let mut velocity = vec![0.0; self.rig().n_dofs()];
        let last = self.times.len() - 1;
        if last == 0 || !(self.times[0] <= secs && secs <= self.times[last]) {
            return velocity;
        }
        // The last pose is the right end of a curve.
        let (before, u) = if secs == self.times[last] { (last - 1, 1.0) } else { self.locate(secs) };
        for joint in self.moving() {
            let at = self.rig().dofs_of(joint);
            let n_dofs = at.len();
            velocity[at].copy_from_slice(&Curve::new(self, joint, before).velocity(u)[..n_dofs]);
        }
        velocity
    }

    /// The largest speed of a joint anywhere on the curve of [`sample_cubic`](Self::sample_cubic), between poses
    /// too, and when: the length of its velocity, in rad/s for its rotation (Euler: of the three angles'
    /// speeds) or m/s for its translation. 0 for a joint that has no such freedom of its own.
    ///
    /// Found by dense sampling and refinement, to about a millionth. Where a cone makes the ball leap, it is at
    /// least the mean speed over an eighth of the way between two poses.
    ///
    /// # Errors
    /// For a joint of another, larger rig.
    pub fn peak_speed(&self, joint: JointId, part: RatePart) -> Result<Peak, ForeignJoint> {
        self.peak(joint, part, Rate::Speed)
    }

    /// As [`peak_speed`](Self::peak_speed), the largest acceleration: rad/s² or m/s². On this curve the
    /// acceleration jumps at poses; both sides count. Where a cone holds a ball back, so that its velocity jumps,
    /// it is only known to be large: at least the mean over an eighth of the way between two poses.
    ///
    /// # Errors
    /// For a joint of another, larger rig.
    pub fn peak_acceleration(&self, joint: JointId, part: RatePart) -> Result<Peak, ForeignJoint> {
        self.peak(joint, part, Rate::Acceleration)
    }

    fn peak(&self, joint: JointId, part: RatePart, rate: Rate) -> Result<Peak, ForeignJoint> {
        self.rig().own(joint)?;
        let still = Peak { value: 0.0, secs: self.times[0] };
        Ok(self.peak_above(joint, part, rate, 0.0).unwrap_or(still))
    }

    /// The largest speed or acceleration of a joint, where that is above `floor`.
    pub(super) fn peak_above(&self, joint: JointId, part: RatePart, rate: Rate, floor: f64) -> Option<Peak> {
        let dofs = part.dofs(self.rig(), joint);
        let mut peak: Option<Peak> = None;
        if dofs.is_empty() {
            return peak;
        }
        let bounds = RateBounds::new(self, joint, &dofs, rate);
        for (before, bound) in bounds.enumerate() {
            let known = peak.map_or(0.0, |peak| peak.value);
            // What cannot win is not measured.
            if bound <= known.max(floor) {
                continue;
            }
            let here = self.peak_between(joint, &dofs, rate, before, known);
            if here.value > known.max(floor) {
                peak = Some(here);
            }
        }
        peak
    }

    /// The largest speed or acceleration of some of a joint's degrees of freedom between pose number `before` and the
    /// next, which must exist. Where it is well below `floor`, it is only known to be that.
    pub(super) fn peak_between(
        &self,
        joint: JointId,
        dofs: &Range<usize>,
        rate: Rate,
        before: usize,
        floor: f64,
    ) -> Peak {
        const PARTS: u32 = 8;
        let curve = Curve::new(self, joint, before);
        let all = |u: f64| if rate == Rate::Speed { curve.velocity(u) } else { curve.acceleration(u) };
        let length = |all: Dofs| all[dofs.clone()].iter().map(|v| v * v).sum::<f64>().sqrt();
        let at = |u: f64| length(all(u));
        let mut best = (0.0, at(0.0));
        for i in 1..=PARTS {
            let u = f64::from(i) / f64::from(PARTS);
            let value = at(u);
            if value > best.1 {
                best = (u, value);
            }
            if curve.is_in_cone {
                // What a cone does at once lies between such points; the mean over each part sees it.
                let part = [f64::from(i - 1) / f64::from(PARTS), u];
                let mean = length(if rate == Rate::Speed {
                    curve.mean_velocity(part)
                } else {
                    curve.mean_acceleration(part)
                });
                if mean > best.1 {
                    best = (0.5 * (part[0] + part[1]), mean);
                }
            }
        }
        // What cannot win by refinement is not refined.
        if best.1 * 1.1 > floor {
            let reach = 1.0 / f64::from(PARTS);
            let refined = largest(&at, (best.0 - reach).max(0.0), (best.0 + reach).min(1.0));
            if refined.1 > best.1 {
                best = refined;
            }
        }
        Peak { value: best.1, secs: self.times[before] + best.0 * curve.secs }
    }

    /// Joints with degrees of freedom of their own.
    pub(super) fn moving(&self) -> impl Iterator<Item = JointId> + '_ {
        let rig = self.rig();
        rig.ids().filter(|joint| rig.joints()[joint.index()].n_dofs() > 0)
    }
}

/// The largest value of a function with one peak between `a` and `b`, and where: golden section search.
fn largest(of: &dyn Fn(f64) -> f64, mut a: f64, mut b: f64) -> (f64, f64) {
    const RATIO: f64 = 0.618_033_988_749_894_8;
    let (mut c, mut d) = (b - RATIO * (b - a), a + RATIO * (b - a));
    let (mut at_c, mut at_d) = (of(c), of(d));
    for _ in 0..20 {
        if at_c > at_d {
            (b, d, at_d) = (d, c, at_c);
            c = b - RATIO * (b - a);
            at_c = of(c);
        } else {
            (a, c, at_c) = (c, d, at_d);
            d = a + RATIO * (b - a);
            at_d = of(d);
        }
    }
    if at_c > at_d { (c, at_c) } else { (d, at_d) }
}
