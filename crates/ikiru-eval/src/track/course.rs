//! A body, and the frames that some of its joints are to have, one after the other.

use ikiru_rig::{JointFrame, JointId, JointMotion, Pose, Rig};

use crate::error::Error;

/// How far targets go from the first one, relative to how far they were, where a course goes away.
const AWAY: f64 = 1.15;

/// What a course is made of.
pub(super) struct Source {
    pub(super) name: String,
    pub(super) rate_hz: f64,
    pub(super) n_frames: usize,
    /// The joints that are led, and whether by their rotation too.
    pub(super) targets: Vec<(JointId, bool)>,
    pub(super) rest: Pose,
}

/// A body that is to be where some of its joints were in poses inside its limits, frame by frame.
#[derive(Clone, Debug)]
pub struct Course {
    /// What it is called in tables.
    pub name: String,
    /// Frames a second.
    pub rate_hz: f64,
    /// The joints that are led, and whether by their rotation too.
    pub targets: Vec<(JointId, bool)>,
    /// What each of them is to have, frame by frame.
    pub frames: Vec<Vec<JointFrame>>,
    /// Whether the targets of a frame can be met.
    pub can_be_met: Vec<bool>,
    /// The pose of the first frame.
    pub start: Pose,
    /// The pose that settles what the targets leave open.
    pub rest: Pose,
    /// The largest turn of a joint from one frame to the next, radians, in the motion that the targets were read off; the
    /// root of the body aside.
    pub own_turn: f64,
}

impl Course {
    pub(super) fn new(
        source: &Source,
        rig: &Rig,
        pose: impl Fn(f64) -> Result<Pose, Error>,
    ) -> Result<Self, Error> {
        let refused = |reason: String| Err(Error::Course { reason });
        if !source.rate_hz.is_finite() || source.rate_hz <= 0.0 {
            return refused(format!(
                "{}: a rate of {} frames a second, where a finite number above 0 is expected",
                source.name, source.rate_hz
            ));
        }
        if source.targets.is_empty() {
            return refused(format!("{}: no joint is led, where at least one is expected", source.name));
        }
        let poses: Vec<Pose> =
            (0..source.n_frames.max(1)).map(|n| pose(n as f64 / source.rate_hz)).collect::<Result<_, _>>()?;
        let frames_of = |pose: &Pose| {
            let frame = |(joint, _): &(JointId, bool)| pose.frame(*joint).map_err(Error::course);
            source.targets.iter().map(frame).collect::<Result<Vec<_>, Error>>()
        };
        let frames = poses.iter().map(frames_of).collect::<Result<Vec<_>, _>>()?;
        let mut own_turn: f64 = 0.0;
        for pair in poses.windows(2) {
            own_turn = own_turn.max(largest_turn(rig, &pair[0], &pair[1])?);
        }
        Ok(Self {
            name: source.name.clone(),
            rate_hz: source.rate_hz,
            targets: source.targets.clone(),
            can_be_met: vec![true; frames.len()],
            frames,
            start: poses[0].clone(),
            rest: source.rest.clone(),
            own_turn,
        })
    }

    /// This course with targets that jump out of reach each other second, 1.15 times as far from the first target as they were, and
    /// jump back.
    #[must_use]
    pub fn away(mut self) -> Self {
        self.name += ", away and back";
        for (number, frame) in self.frames.iter_mut().enumerate() {
            let second = number as f64 / self.rate_hz;
            if second.floor() % 2.0 == 1.0 {
                // Targets are a field that anybody may empty.
                let Some(root) = frame.first().map(|first| first.position) else { continue };
                self.can_be_met[number] = false;
                frame.iter_mut().for_each(|to| to.position = root + AWAY * (to.position - root));
            }
        }
        self
    }
}

/// The largest turn of a joint between two poses, radians; the root of the body aside.
pub(super) fn largest_turn(rig: &Rig, from: &Pose, to: &Pose) -> Result<f64, Error> {
    let difference = from.difference(to).map_err(Error::course)?;
    let turn = |joint: JointId| {
        let dofs = &difference[rig.dofs_of(joint)];
        match rig.get(joint).map(|joint| joint.motion) {
            Some(JointMotion::Hinge { .. }) => dofs[0].abs(),
            Some(JointMotion::Euler { .. } | JointMotion::Ball { .. }) => {
                dofs.iter().map(|d| d * d).sum::<f64>().sqrt()
            }
            None | Some(JointMotion::Fixed | JointMotion::Slider { .. } | JointMotion::Free { .. }) => 0.0,
        }
    };
    Ok(rig.ids().map(turn).fold(0.0, f64::max))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_course_without_targets_or_with_a_rate_that_is_none_is_refused() {
        let rig = ikiru_formats::read("builtin:panda").unwrap().rig;
        let joint = JointId::from_index(rig.n_joints() - 1);
        let course = |rate_hz: f64, targets: &[(JointId, bool)]| {
            let (targets, rest) = (targets.to_vec(), rig.rest_pose());
            let source = Source { name: "arm".to_owned(), rate_hz, n_frames: 3, targets, rest };
            Course::new(&source, &rig, |_| Ok(rig.rest_pose()))
        };
        assert_eq!(course(2.0, &[(joint, true)]).unwrap().away().can_be_met, [true, true, false]);
        for (rate_hz, targets, why) in [
            (2.0, &[][..], "arm: no joint is led"),
            (0.0, &[(joint, true)], "arm: a rate of 0 frames a second"),
            (-30.0, &[(joint, true)], "arm: a rate of -30"),
            (f64::NAN, &[(joint, true)], "arm: a rate of NaN"),
            (f64::INFINITY, &[(joint, true)], "arm: a rate of inf"),
        ] {
            let error = course(rate_hz, targets).unwrap_err();
            assert!(matches!(error, Error::Course { .. }) && error.to_string().contains(why), "{error}");
        }
    }
}
