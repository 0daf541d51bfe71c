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
                let root = frame[0].position;
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
