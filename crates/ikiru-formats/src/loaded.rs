//! What a reader gives: the rig, its clips, what was mended, and the document for writing.

use std::sync::Arc;

use glam::DQuat;
use ikiru_rig::{Clip, CollisionShape, Joint, JointId, JointMotion, Pose, PoseError, Rig, Segment};

use crate::bvh::Layout;
use crate::error::{Error, ErrorKind, Place};
use crate::gltf::Source;
use crate::gltf::animation::Needs;
use crate::gltf::clips::clips;
use crate::gltf::source::check_turns;
use crate::warning::{Warning, Warnings};

/// A file, read.
#[derive(Clone, Debug)]
pub struct Loaded {
    /// Its joints.
    pub rig: Rig,
    /// Its animations, as poses of that rig.
    pub clips: Vec<Clip>,
    /// What was mended or left out.
    pub warnings: Vec<Warning>,
    pub(crate) name: Option<String>,
    pub(crate) scale: f64,
    pub(crate) world_from_file: DQuat,
    pub(crate) joint_from_file: DQuat,
    pub(crate) source: Option<Arc<Source>>,
    pub(crate) layout: Option<Arc<Layout>>,
    pub(crate) collision_shapes: Vec<CollisionShape>,
    pub(crate) segments: Vec<Segment>,
}

impl Loaded {
    /// A rig made by other means than reading; it has no [`source`](Self::source).
    #[must_use]
    pub fn from_rig(rig: Rig) -> Self {
        Self {
            rig,
            clips: Vec::new(),
            warnings: Vec::new(),
            name: None,
            scale: 1.0,
            world_from_file: DQuat::IDENTITY,
            joint_from_file: DQuat::IDENTITY,
            source: None,
            layout: None,
            collision_shapes: Vec::new(),
            segments: Vec::new(),
        }
    }

    /// What it was read from: the path that was given, or the name of a built-in rig; `None` for what came from memory.
    #[must_use]
    pub fn name(&self) -> Option<&str> {
        self.name.as_deref()
    }

    /// The length in metres that a unit of the file was read as, in a format that does not say
    /// ([`read_scaled`](crate::read_scaled)); 1 in all others.
    #[must_use]
    pub fn scale(&self) -> f64 {
        self.scale
    }

    /// The document that the rig was read from: what writing needs besides the rig.
    #[must_use]
    pub fn source(&self) -> Option<&Source> {
        self.source.as_deref()
    }

    /// The rotation that a reader laid over the file's own axes to get the library's (y up, facing +z, the
    /// left at +x): a point `p` of the file lies at `world_from_file() * p`, and the inverse leads back.
    /// The identity where the file has the library's axes, as glTF does; half a turn about y for VRM 0.x, which
    /// faces −z. A mesh in the [`source`](Self::source) lies in the file's world, and files are written in it.
    #[must_use]
    pub fn world_from_file(&self) -> DQuat {
        self.world_from_file
    }

    /// The rotation that a reader laid over the axes of the file's joints: a direction `a` in the frame of a joint of the
    /// file is `joint_from_file() * a` in that of the rig's joint. It is [`world_from_file`](Self::world_from_file) for
    /// VRM 0.x, so that a joint whose axes lie along the world's at rest has them so in either world, as in VRM
    /// 1.0, and the identity for all else: a URDF joint keeps its axes.
    #[must_use]
    pub fn joint_from_file(&self) -> DQuat {
        self.joint_from_file
    }

    /// The spheres, capsules, cylinders and boxes that the file gives its joints for collisions, in the order of
    /// the file. Meshes are not among them.
    #[must_use]
    pub fn collision_shapes(&self) -> &[CollisionShape] {
        &self.collision_shapes
    }

    /// The parts of the body with their masses, as the file has them, in its order: the `<inertial>`s of a URDF. Empty for
    /// files that say nothing of masses.
    #[must_use]
    pub fn segments(&self) -> &[Segment] {
        &self.segments
    }

    /// This file without clips, and without what was said of them.
    pub(crate) fn without_clips(mut self) -> Self {
        self.clips.clear();
        self.warnings.retain(|warning| !warning.is_about_clips());
        self
    }

    /// This file with a rig that can do all that its clips do, and the clips with all that they do.
    ///
    /// The joints of a glTF rig turn where a skin uses them, and do not translate. Animations do translate some,
    /// most often the hips or a root above them: that is the way of a walk. Here each of these joints, and
    /// each that carries them, is [free](JointMotion::Free) where an animation translates it, and a
    /// [ball](JointMotion::Ball) where one turns it. Rest transforms stay as they are, and so does what BVH and URDF say
    /// of their joints.
    ///
    /// # Errors
    /// When the rig cannot be built; that of a reader can.
    pub fn carrying_clips(mut self) -> Result<Self, Error> {
        let Some(source) = self.source.clone() else { return Ok(self) };
        let mut needs = Needs::none(&self.rig);
        clips(&source, &self.rig, &mut Warnings::default(), Some(&mut needs));
        let mut carries: Vec<bool> = self.rig.joints().iter().map(|joint| joint.n_dofs() > 0).collect();
        for id in self.rig.ids().rev() {
            if let (true, Some(parent)) = (carries[id.index()], self.rig.get(id).and_then(|j| j.parent)) {
                carries[parent.index()] = true;
            }
        }
        let mut builder = self.rig.to_builder();
        // Below a scale that differs between the axes, nothing may turn that did not before.
        let can_turn = |idx: usize| source.bindings.get(idx).is_none_or(|b| b.above.is_uniform());
        let moving = |(idx, _): &(usize, &mut Joint)| carries[*idx] && can_turn(*idx);
        for (idx, joint) in builder.joints_mut().iter_mut().enumerate().filter(moving) {
            joint.motion = match joint.motion {
                JointMotion::Ball { cone } if needs.translates[idx] => JointMotion::Free { cone },
                JointMotion::Fixed if needs.translates[idx] => JointMotion::FREE,
                JointMotion::Fixed if needs.turns[idx] => JointMotion::BALL,
                motion @ (JointMotion::Fixed
                | JointMotion::Hinge { .. }
                | JointMotion::Slider { .. }
                | JointMotion::Euler { .. }
                | JointMotion::Ball { .. }
                | JointMotion::Free { .. }) => motion,
            };
        }
        let rig = builder.build().map_err(|error| Error::new(source.name(), Place::File, error.into()))?;
        let mut warnings = Warnings::default();
        self.clips = clips(&source, &rig, &mut warnings, None);
        self.rig = rig;
        self.warnings.retain(|warning| !warning.is_about_clips());
        self.warnings.extend(warnings.into_vec());
        Ok(self)
    }

    /// This file with a changed rig: the same joints in the same order, with other motions or limits.
    ///
    /// Clips come along where the changed joints can move as they do: rotations become Euler angles where a
    /// joint is Euler now; a root that floats now takes over what joints above it did, if those are fixed; any
    /// other joint that turns in the clip but cannot turn any more drops the clip with a warning. Poses are not
    /// projected into limits.
    ///
    /// # Errors
    /// When the rig has other joints, or other rest transforms; when a joint turns that a glTF file has below a scale
    /// which differs between the axes.
    pub fn with_rig(mut self, rig: Rig) -> Result<Self, Error> {
        if let Some(difference) = self.rig.shape_difference(&rig) {
            let file = self.source().map_or("rig", Source::name).to_owned();
            let kind = ErrorKind::OtherRig { what: "the rig", difference };
            return Err(Error::new(file, Place::File, kind));
        }
        if let Some(source) = &self.source {
            check_turns(rig.joints(), &source.bindings).map_err(|fault| fault.in_file(source.name()))?;
        }
        for clip in std::mem::take(&mut self.clips) {
            match moved(&clip, &rig) {
                Ok(clip) => self.clips.push(clip),
                Err(joint) => {
                    self.warnings.push(Warning::ClipUnfit { clip: clip.name().to_owned(), joint });
                }
            }
        }
        self.rig = rig;
        Ok(self)
    }
}

/// A clip as poses of another rig with the same joints; the joint that cannot take its motion otherwise.
fn moved(clip: &Clip, rig: &Rig) -> Result<Clip, String> {
    let mut poses: Vec<Pose> = Vec::with_capacity(clip.poses().len());
    let carried = carried_away(clip.rig(), rig);
    for from in clip.poses() {
        let mut pose = rig.rest_pose();
        if let Some((root, _)) = &carried {
            place(&mut pose, *root, from).map_err(|_| String::new())?;
        }
        for (id, joint) in rig.ids().zip(rig.joints()) {
            if carried.as_ref().is_some_and(|(root, above)| id == *root || above.contains(&id)) {
                continue;
            }
            take_motion(&mut pose, from, id, &joint.motion, poses.last())
                .ok_or_else(|| joint.name.clone())?;
        }
        poses.push(pose);
    }
    Clip::new(clip.name(), clip.times().to_vec(), poses).map_err(|_| String::new())
}

/// A floating root that has to do what joints above it did in another rig, and those joints.
fn carried_away(before: &Rig, rig: &Rig) -> Option<(JointId, Vec<JointId>)> {
    let root = rig.floating_root()?;
    let moves = |rig: &Rig, id: JointId| rig.get(id).is_some_and(|joint| joint.motion != JointMotion::Fixed);
    let above: Vec<JointId> =
        rig.ancestors(root).skip(1).filter(|id| moves(before, *id) && !moves(rig, *id)).collect();
    (!above.is_empty()).then_some((root, above))
}

/// Moves a free joint of a pose whose joints above are at rest to where it is in another.
fn place(pose: &mut Pose, joint: JointId, from: &Pose) -> Result<(), PoseError> {
    let (at_rest, frame) = (pose.frame(joint)?, from.frame(joint)?);
    let from_world = at_rest.rotation.inverse();
    pose.set_translation(joint, from_world * (frame.position - at_rest.position))?;
    pose.set_rotation(joint, from_world * frame.rotation)
}

/// Lets one joint move as in another rig's pose; `None` if it cannot.
fn take_motion(
    pose: &mut Pose,
    from: &Pose,
    id: JointId,
    to: &JointMotion,
    before: Option<&Pose>,
) -> Option<()> {
    let old = from.rig().get(id)?.motion;
    match (old, to) {
        (JointMotion::Hinge { axis: a, .. }, JointMotion::Hinge { axis: b, .. })
        | (JointMotion::Slider { axis: a, .. }, JointMotion::Slider { axis: b, .. })
            if a == *b =>
        {
            // A follower has no value of its own to set.
            return match pose.rig().get(id)?.mimic {
                None => pose.set_value(id, from.value(id)?).ok(),
                Some(_) => Some(()),
            };
        }
        (JointMotion::Euler { order: a, .. }, JointMotion::Euler { order: b, .. }) if a == *b => {
            return pose.set_euler(id, from.euler(id)?).ok();
        }
        // By the turn and the way that come of it.
        (
            JointMotion::Fixed
            | JointMotion::Hinge { .. }
            | JointMotion::Slider { .. }
            | JointMotion::Euler { .. }
            | JointMotion::Ball { .. }
            | JointMotion::Free { .. },
            _,
        ) => {}
    }
    let (rotation, translation) = (from.rotation(id).ok()?, from.translation(id).ok()?);
    if let JointMotion::Free { .. } = to {
        pose.set_translation(id, translation).ok()?;
    } else if translation.length() > 1e-9 {
        return None;
    }
    match to {
        JointMotion::Ball { .. } | JointMotion::Free { .. } => pose.set_rotation(id, rotation).ok(),
        JointMotion::Euler { order, .. } => {
            let previous = before.and_then(|b| b.euler(id)).unwrap_or_default();
            pose.set_euler(id, order.angles_near(rotation, previous)).ok()
        }
        JointMotion::Fixed | JointMotion::Hinge { .. } | JointMotion::Slider { .. } => {
            (rotation.w.abs() > 1.0 - 1e-12).then_some(())
        }
    }
}
