//! What objectives are about: the rig, the joints that may move, the timeline; and the names of both.

use glam::DVec3;
use ikiru_rig::{JointId, Rig, Segment};
use ikiru_solve::{TargetPath, Timeline, Unfit};

use crate::at::At;
use crate::error::{Error, ErrorKind};
use crate::values::{joint, name_of};

/// What the keys of objectives are looked up in.
#[derive(Clone, Copy)]
pub(crate) struct Scene<'a> {
    pub(crate) rig: &'a Rig,
    /// The joints that may move, parents first.
    pub(crate) active: &'a [JointId],
    /// In a scenario with `[motion]`.
    pub(crate) timeline: Option<&'a Timeline>,
    /// The body's own parts, as far as their masses are known.
    pub(crate) segments: &'a [Segment],
    /// The axis of the world that points up, in the axes that targets are given in.
    pub(crate) up: DVec3,
}

impl Scene<'_> {
    /// The joint that a key of the table `at` names.
    pub(crate) fn joint(&self, name: &str, at: &At<'_>, key: &str) -> Result<JointId, Error> {
        joint(self.rig, name, &at.key(key))
    }

    /// The joints that `joints` of the table `at` names, so many.
    pub(crate) fn joints<const N: usize>(
        &self,
        names: &[String; N],
        at: &At<'_>,
    ) -> Result<[JointId; N], Error> {
        let mut joints = [JointId::from_index(0); N];
        for (idx, slot) in joints.iter_mut().enumerate() {
            *slot = joint(self.rig, &names[idx], &at.key("joints").entry(idx))?;
        }
        Ok(joints)
    }

    /// What a library's objective says of the keys of the table `objective`, at the value that it is about.
    pub(crate) fn unfit(&self, unfit: Unfit, objective: &At<'_>, at: &At<'_>) -> Error {
        let (place, reason) = (objective.place(), unfit_text(self.rig, unfit));
        at.error(ErrorKind::Objective { place, reason })
    }

    /// The path through points at times, `[secs, x, y, z]`.
    pub(crate) fn path(&self, points: &[[f64; 4]], at: &At<'_>) -> Result<TargetPath, Error> {
        let timeline = self.timeline.ok_or_else(|| needs_motion(at))?;
        let times: Vec<f64> = points.iter().map(|p| p[0]).collect();
        for (idx, secs) in times.iter().enumerate() {
            timeline.sample_at(*secs).map_err(|e| at.entry(idx).error(ErrorKind::Motion(e.into())))?;
        }
        let points = points.iter().map(|[_, x, y, z]| DVec3::new(*x, *y, *z)).collect();
        TargetPath::new(times, points).map_err(|e| at.error(ErrorKind::Path(e)))
    }
}

/// A key about time, where there is none.
pub(crate) fn needs_motion(at: &At<'_>) -> Error {
    at.key_error(ErrorKind::NeedsMotion(at.name().to_owned()))
}

/// The joints of a list, each of which moves by itself and stands there once.
pub(crate) fn joint_list(rig: &Rig, names: &[String], at: &At<'_>) -> Result<Vec<JointId>, Error> {
    let mut joints: Vec<JointId> = Vec::with_capacity(names.len());
    for (idx, name) in names.iter().enumerate() {
        let at_name = at.entry(idx);
        let id = joint(rig, name, &at_name)?;
        if joints.contains(&id) {
            return Err(at_name.key_error(twice(rig, id, name, format!("'{}'", at.name()))));
        }
        if rig.get(id).is_none_or(|j| j.n_dofs() == 0) {
            return Err(at_name.error(immobile(rig, id)));
        }
        joints.push(id);
    }
    if joints.is_empty() {
        return Err(none_of_them(at));
    }
    Ok(joints)
}

/// No joint at all, where there must be one.
pub(crate) fn none_of_them(at: &At<'_>) -> Error {
    at.error(ErrorKind::Length { key: at.name().to_owned(), found: 0, expected: "at least one joint" })
}

/// A name of a joint that stands there already, under its own name or another.
pub(crate) fn twice(rig: &Rig, joint: JointId, name: &str, place: String) -> ErrorKind {
    ErrorKind::Twice { place, first: name_of(rig, joint).to_owned(), second: name.to_owned() }
}

/// Why a joint has no degrees of freedom of its own.
fn immobile(rig: &Rig, joint: JointId) -> ErrorKind {
    let name = name_of(rig, joint).to_owned();
    if let Some(mimic) = rig.get(joint).and_then(|j| j.mimic) {
        return ErrorKind::Follower { joint: name, leader: name_of(rig, mimic.leader).to_owned() };
    }
    match rig.floating_root().filter(|root| rig.ancestors(*root).any(|above| above == joint)) {
        Some(root) => {
            let root = name_of(rig, root);
            let reason =
                format!("lies above the free root, '{root}', and stays where it is: expected '{root}'");
            ErrorKind::Unfit { joint: name, reason }
        }
        None => ErrorKind::Immobile(name),
    }
}

/// What ends the sentence "the objective …", with the joint that it is about.
pub(crate) fn unfit_text(rig: &Rig, unfit: Unfit) -> String {
    match unfit.joint.map(|joint| name_of(rig, joint)) {
        Some(joint) => format!("{unfit}: joint '{joint}'"),
        None => unfit.to_string(),
    }
}
