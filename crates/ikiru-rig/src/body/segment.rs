//! A part of the body that goes with one joint: how heavy it is, and where.

use glam::DVec3;

use crate::joint::JointId;
use crate::pose::Pose;

/// A part of the body that goes with one joint.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Segment {
    /// The joint; one may have several.
    pub joint: JointId,
    /// Its mass, kilograms, above 0.
    pub kg: f64,
    /// Where its centre of mass is, in the joint's frame (metres).
    pub center: DVec3,
}

/// The centre of mass of some segments in a pose: a point of the world, metres. `None` where they weigh nothing, and for
/// joints of another, larger rig.
///
/// ```
/// use glam::DVec3;
/// use ikiru_rig::body::{Segment, center_of_mass};
/// use ikiru_rig::{Joint, JointMotion, Range, RigBuilder};
///
/// let mut builder = RigBuilder::new();
/// let base = builder.add(Joint::new("base", None));
/// let mut arm = Joint::new("arm", Some(base));
/// arm.motion = JointMotion::Hinge { axis: DVec3::Z, range: Range::UNLIMITED };
/// let arm = builder.add(arm);
/// let mut pose = builder.build()?.rest_pose();
/// let segments = [
///     Segment { joint: base, kg: 3.0, center: DVec3::ZERO },
///     Segment { joint: arm, kg: 1.0, center: DVec3::new(0.4, 0.0, 0.0) },
/// ];
/// pose.set_value(arm, 90_f64.to_radians())?;
/// let center = center_of_mass(&pose, &segments).expect("they weigh something");
/// assert!(center.distance(DVec3::new(0.0, 0.1, 0.0)) < 1e-12);
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
#[must_use]
pub fn center_of_mass(pose: &Pose, segments: &[Segment]) -> Option<DVec3> {
    let frames = pose.kernel_frames();
    let (mut moment, mut kg) = (DVec3::ZERO, 0.0);
    for segment in segments {
        let frame = frames.get(segment.joint.index())?;
        moment += frame.point(segment.center.into()).value() * segment.kg;
        kg += segment.kg;
    }
    (kg > 0.0).then(|| moment / kg)
}
