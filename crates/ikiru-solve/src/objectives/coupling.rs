//! Coupling: a sum of joint angles at most, at least or exactly something.

use glam::{DQuat, DVec3};
use ikiru_rig::{JointId, JointMotion, Rig, maths};

use crate::objective::{JointCoords, Objective, Reads, Rows, Unfit, UnfitReason, View};
use crate::objectives::angles::{check_axis, unit_axis};
use crate::objectives::bound::Bound;
use crate::words::Unit;

/// One angle of a joint.
#[derive(Clone, Copy, Debug, PartialEq)]
enum Angle {
    /// The value of a hinge or slider.
    Value,
    /// One angle of an Euler joint.
    Euler(usize),
    /// The component on `axis` of the rotation vector of a ball's swing away from `about`; both of unit length, in the
    /// joint's frame at rest.
    Swing { axis: DVec3, about: DVec3 },
}

/// Couples angles of joints: `Σ factor · angle` at most, at least or exactly something. A shoulder blade that goes along
/// with its arm, a hip that bends less when the knee is straight.
///
/// Residual: 1 row in radians (metres where all joints are sliders) that wants to be 0, the sum minus what it should be;
/// of a bound, one that wants to be at least 0, what is left to it.
///
/// The angle of a hinge or slider is its value; of an Euler joint, one of its three; of a ball, the component on an
/// axis of the rotation vector of its swing from rest, where its rotation is swing · twist, with the twist about the
/// axis of its cone, else towards its only child.
#[derive(Clone, Debug, PartialEq)]
pub struct Coupling {
    joints: Vec<JointId>,
    angles: Vec<(Angle, f64)>,
    unit: Unit,
    /// What the sum should be.
    pub bound: Bound,
}

impl Coupling {
    /// A sum of angles: joint, axis, factor. The axis is left out for a hinge and a slider; of an Euler joint it is one of
    /// x, y, z; of a ball it is an axis of the parent's frame at rest, of any length but 0.
    ///
    /// # Errors
    /// A joint that the rig does not have, that does not move or follows another, an axis that does not fit its motion,
    /// a ball without a cone that does not have exactly one child, angles together with offsets.
    pub fn new(rig: &Rig, angles: &[(JointId, Option<DVec3>, f64)], bound: Bound) -> Result<Self, Unfit> {
        let (mut joints, mut parts, mut units) = (Vec::new(), Vec::new(), Vec::new());
        for &(joint, axis, factor) in angles {
            let unfit = |reason: UnfitReason| Unfit::of_joint(reason, joint);
            let data = rig.get(joint).ok_or(unfit(UnfitReason::NoJoint))?;
            if data.mimic.is_some() {
                return Err(unfit(UnfitReason::CouplesFollower));
            }
            if let Some(axis) = axis {
                check_axis(axis).map_err(|unfit| Unfit { joint: Some(joint), ..unfit })?;
            }
            let (angle, unit) = match (&data.motion, axis) {
                (JointMotion::Hinge { .. }, None) => (Angle::Value, Unit::Radians),
                (JointMotion::Slider { .. }, None) => (Angle::Value, Unit::Metres),
                (JointMotion::Euler { .. }, Some(axis)) => {
                    let which = DVec3::AXES.iter().position(|a| a.distance(unit_axis(axis)) < 1e-9);
                    (Angle::Euler(which.ok_or(unfit(UnfitReason::CouplesEuler))?), Unit::Radians)
                }
                (JointMotion::Ball { cone } | JointMotion::Free { cone }, Some(axis)) => {
                    let about = match cone {
                        Some(cone) => cone.axis(),
                        None => towards_only_child(rig, joint).ok_or(unfit(UnfitReason::CouplesSwing))?,
                    };
                    let axis = data.rest_rotation.inverse() * unit_axis(axis);
                    (Angle::Swing { axis, about }, Unit::Radians)
                }
                (JointMotion::Fixed, _) => return Err(unfit(UnfitReason::CouplesFixed)),
                (JointMotion::Hinge { .. } | JointMotion::Slider { .. }, Some(_)) => {
                    return Err(unfit(UnfitReason::OwnAxis));
                }
                (_, None) => return Err(unfit(UnfitReason::NoAxis)),
            };
            joints.push(joint);
            parts.push((angle, factor));
            units.push(unit);
        }
        let Some(&unit) = units.first() else { return Err(UnfitReason::CouplesNothing.into()) };
        if units.iter().any(|other| *other != unit) {
            return Err(UnfitReason::CouplesUnits.into());
        }
        Ok(Self { joints, angles: parts, unit, bound })
    }

    /// What the sum is measured in: radians, or metres where all joints are sliders.
    #[must_use]
    pub fn unit(&self) -> Unit {
        self.unit
    }

    /// The joints, in the order of the angles.
    #[must_use]
    pub fn joints(&self) -> &[JointId] {
        &self.joints
    }
}

fn towards_only_child(rig: &Rig, joint: JointId) -> Option<DVec3> {
    let mut children = rig.joints().iter().filter(|child| child.parent == Some(joint));
    let (child, others) = (children.next()?, children.next());
    others.is_none().then(|| child.rest_translation.try_normalize()).flatten()
}

impl Objective for Coupling {
    fn kind(&self) -> &'static str {
        "coupling"
    }

    fn reads(&self, reads: &mut Reads<'_>) -> Result<(), Unfit> {
        for (joint, (angle, _)) in self.joints.iter().zip(&self.angles) {
            reads.motion(*joint)?;
            let fits = matches!(
                (angle, reads.rig().joints()[joint.index()].motion),
                (Angle::Value, JointMotion::Hinge { .. } | JointMotion::Slider { .. })
                    | (Angle::Euler(_), JointMotion::Euler { .. })
                    | (Angle::Swing { .. }, JointMotion::Ball { .. } | JointMotion::Free { .. })
            );
            if !fits {
                return Err(Unfit::of_joint(UnfitReason::CouplesOtherRig, *joint));
            }
        }
        reads.part(self.bound.part(1, self.unit))
    }

    fn check(&self) -> Result<(), Unfit> {
        let is_finite = self.bound.value().is_finite() && self.angles.iter().all(|(_, f)| f.is_finite());
        if is_finite { Ok(()) } else { Err(UnfitReason::Factor.into()) }
    }

    fn evaluate(&self, view: &View<'_>, rows: &mut Rows<'_>) {
        let value_of = |idx: usize, angle: &Angle| {
            let JointCoords { coords, .. } = view.motion(idx);
            match angle {
                Angle::Value => (coords[0], DVec3::X),
                Angle::Euler(axis) => (coords[*axis], DVec3::AXES[*axis]),
                Angle::Swing { axis, about } => {
                    swing_along(DQuat::from_slice(&coords[coords.len() - 4..]), *about, *axis)
                }
            }
        };
        let angles = || self.angles.iter().enumerate();
        let sum = angles().map(|(idx, (angle, factor))| factor * value_of(idx, angle).0).sum();
        let (residual, sign) = self.bound.residual(sum);
        let row = rows.open(0, [residual]);
        if rows.wants_jacobian() {
            for (idx, (angle, factor)) in angles() {
                let slope = (value_of(idx, angle).1 * (sign * factor)).to_array();
                let out = rows.by_motion(row, idx);
                let n = out.len();
                // A free joint slides before it turns.
                let at = if let Angle::Value = angle { 0 } else { n - 3 };
                out[at..].copy_from_slice(&slope[..n - at]);
            }
        }
    }
}

/// The component on `axis` of the rotation vector of the swing of `q` away from `about`, and its slope by a turn of
/// the joint. Where the swing is half a turn, its direction is not defined: the slope is then 0.
fn swing_along(q: DQuat, about: DVec3, axis: DVec3) -> (f64, DVec3) {
    let swung = q * about;
    let (cross, cos) = (about.cross(swung), about.dot(swung));
    let sin = cross.length();
    let angle = maths::atan2(sin, cos);
    if sin < 1e-9 && cos < 0.0 {
        return (0.0, DVec3::ZERO);
    }
    // The rotation vector is cross · θ / sin θ; the slope of that factor by cos θ is −(sin θ − θ cos θ) / sin³ θ.
    let (factor, slope) = if sin < 1e-4 {
        (1.0 + angle * angle / 6.0, -1.0 / 3.0 - 2.0 * angle * angle / 15.0)
    } else {
        (angle / sin, -(sin - angle * cos) / (sin * sin * sin))
    };
    let along = axis.dot(cross);
    let back = q.inverse();
    let by_cross = about.cross(back * axis.cross(about));
    let by_cos = about.cross(back * about);
    (factor * along, by_cross * factor + by_cos * (slope * along))
}

#[cfg(test)]
mod tests {
    use ikiru_rig::Mimic;

    use super::*;
    use crate::front::check::check_on_whole_rigs;

    #[test]
    fn derivatives() {
        check_on_whole_rigs(|rig, random| {
            let mut angles = Vec::new();
            for joint in rig.ids().filter(|joint| rig.get(*joint).is_some_and(|j| j.mimic.is_none())) {
                let factor = random.between(-1.0, 1.0);
                let axis = match rig.get(joint).unwrap().motion {
                    JointMotion::Fixed | JointMotion::Slider { .. } => continue,
                    JointMotion::Hinge { .. } => None,
                    JointMotion::Euler { .. } => Some(DVec3::AXES[random.below(3)]),
                    JointMotion::Ball { .. } | JointMotion::Free { .. } => Some(random.vector(1.0)),
                };
                if Coupling::new(rig, &[(joint, axis, factor)], Bound::Exactly(0.0)).is_ok() {
                    angles.push((joint, axis, factor));
                }
            }
            let bound = [Bound::Exactly(0.2), Bound::AtLeast(9.0), Bound::AtMost(0.1)][random.below(3)];
            match Coupling::new(rig, &angles, bound) {
                Ok(coupling) => coupling,
                // A rig without a joint that turns: nothing is coupled.
                Err(_) => Coupling { joints: vec![], angles: vec![], unit: Unit::Radians, bound },
            }
        });
    }

    #[test]
    fn the_swing_of_a_ball_is_measured_along_the_axis() {
        let (about, axis) = (DVec3::Y, DVec3::X);
        for (swing, twist) in [(0.3, 0.0), (-0.7, 1.2), (2.9, -0.4), (1e-6, 0.3)] {
            let q = DQuat::from_axis_angle(axis, swing) * DQuat::from_axis_angle(about, twist);
            assert!((swing_along(q, about, axis).0 - swing).abs() < 1e-12, "{swing}, {twist}");
            assert!(swing_along(q, about, DVec3::Z).0.abs() < 1e-12);
        }
    }

    #[test]
    fn about_its_axis_a_swing_changes_as_fast_as_its_ball_turns() {
        let (about, axis) = (DVec3::Y, DVec3::X);
        // Around 10⁻⁴ the angle is a series on one side, and a quotient on the other.
        for swing in [0.0, 1e-9, 0.5e-4, 0.999e-4, 1.001e-4, 2e-4, 0.1, 1.5, 3.0] {
            let (value, slope) = swing_along(DQuat::from_axis_angle(axis, swing), about, axis);
            assert!((value - swing).abs() <= 1e-11 * swing, "{swing}: {value}");
            assert!((slope.dot(axis) - 1.0).abs() < 1e-11, "{swing}: {slope}");
        }
        // Half a turn has no direction.
        assert_eq!(swing_along(DQuat::from_xyzw(1.0, 0.0, 0.0, 0.0), about, axis), (0.0, DVec3::ZERO));
    }

    #[test]
    fn numbers_that_are_not_finite_are_refused() {
        let rig = ikiru_testkit::rigs::random_rig(14, 3);
        let is_hinge = |j: &JointId| matches!(rig.joints()[j.index()].motion, JointMotion::Hinge { .. });
        let hinge = rig.ids().find(is_hinge).unwrap();
        let with = |factor, bound| Coupling::new(&rig, &[(hinge, None, factor)], bound).unwrap();
        assert_eq!(with(1.0, Bound::AtMost(1.0)).kind(), "coupling");
        assert!(with(1.0, Bound::AtMost(1.0)).check().is_ok());
        for bad in [with(f64::NAN, Bound::AtMost(1.0)), with(1.0, Bound::AtLeast(f64::INFINITY))] {
            assert_eq!(bad.check(), Err(UnfitReason::Factor.into()), "{bad:?}");
        }
    }

    #[test]
    fn what_does_not_fit_is_named() {
        let rig = ikiru_testkit::rigs::random_rig(14, 3);
        let bound = Bound::AtMost(1.0);
        let mut seen = 0;
        for joint in rig.ids() {
            let wrong = match rig.get(joint).unwrap().motion {
                JointMotion::Hinge { .. } | JointMotion::Slider { .. } => Some(DVec3::X),
                JointMotion::Euler { .. } => Some(DVec3::ONE),
                JointMotion::Fixed | JointMotion::Ball { .. } | JointMotion::Free { .. } => None,
            };
            let unfit = Coupling::new(&rig, &[(joint, wrong, 1.0)], bound).unwrap_err();
            assert_eq!(unfit.joint, Some(joint), "{unfit}");
            seen += 1;
        }
        assert!(seen == 14 && Coupling::new(&rig, &[], bound).is_err());
        let mut builder = rig.to_builder();
        let hinges: Vec<JointId> = rig
            .ids()
            .filter(|j| matches!(rig.joints()[j.index()].motion, JointMotion::Hinge { .. }))
            .collect();
        let [leader, follower, ..] = hinges[..] else { panic!("{hinges:?}") };
        builder.joints_mut()[follower.index()].mimic = Some(Mimic { leader, multiplier: 1.0, offset: 0.0 });
        let unfit = Coupling::new(&builder.build().unwrap(), &[(follower, None, 1.0)], bound).unwrap_err();
        assert_eq!(unfit, Unfit::of_joint(UnfitReason::CouplesFollower, follower));
    }
}
