//! The rig: an immutable, shared tree of joints that is valid because it exists.

use std::collections::HashMap;
use std::sync::Arc;

use glam::DQuat;

use crate::carrier::root_of;
use crate::foreign::ForeignJoint;
use crate::frame::Rotation;
use crate::humanoid::Role;
use crate::joint::{Joint, JointId, JointMotion};
use crate::limit::Range;
use crate::name::{self, UnknownName};
use crate::rig_error::RigError;

/// A tree of joints, parents first. Cheap to clone: the data is shared and never changes.
///
/// A `Rig` that exists is valid: parents precede children, names are unique, ranges are ordered, axes and
/// rotations have unit length, and everything is finite. See [`RigBuilder`].
#[derive(Clone)]
pub struct Rig(Arc<Data>);

struct Data {
    joints: Vec<Joint>,
    kernels: Vec<Kernel>,
    by_name: HashMap<String, JointId>,
    roles: [Option<JointId>; Role::ALL.len()],
    root: Option<JointId>,
    n_coords: usize,
    n_dofs: usize,
}

/// What forward kinematics needs of a joint, close together.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Kernel {
    /// Position of the parent, or `ROOT`.
    pub(crate) parent: u32,
    /// Where its coordinates start, or its leader's if it follows one.
    pub(crate) coord: u32,
    /// Where its degrees of freedom start.
    pub(crate) dof: u32,
    pub(crate) rest_is_translation: bool,
    /// `(multiplier, offset)` of a joint that follows another.
    pub(crate) mimic: Option<(f64, f64)>,
    /// Whether others follow it: a whole turn then changes them, so its angle does not wrap.
    pub(crate) leads: bool,
    pub(crate) rest_rotation: Rotation<f64>,
}

/// The parent of a root.
pub(crate) const ROOT: u32 = u32::MAX;

/// A chain was asked for between joints of which the first is not an ancestor of the second.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
#[non_exhaustive]
pub enum ChainError {
    /// One of the names is unknown.
    #[error(transparent)]
    Unknown(#[from] UnknownName),
    /// The joints do not lie on one line from the root.
    #[error("no chain leads from '{from}' to '{to}': '{to}' has the ancestors {ancestors}")]
    NotAnAncestor {
        /// Where the chain should start.
        from: String,
        /// Where it should end.
        to: String,
        /// What lies above `to`, nearest first.
        ancestors: String,
    },
}

impl Rig {
    /// All joints, parents first.
    #[must_use]
    pub fn joints(&self) -> &[Joint] {
        &self.0.joints
    }

    /// The joint's data; `None` for the id of another, larger rig.
    #[must_use]
    pub fn get(&self, joint: JointId) -> Option<&Joint> {
        self.0.joints.get(joint.index())
    }

    /// The joint's data, or the error for the id of another, larger rig.
    pub(crate) fn own(&self, joint: JointId) -> Result<&Joint, ForeignJoint> {
        self.get(joint).ok_or(ForeignJoint { joint: joint.index(), n_joints: self.n_joints() })
    }

    /// All ids, parents first.
    pub fn ids(&self) -> impl DoubleEndedIterator<Item = JointId> + ExactSizeIterator + use<> {
        (0..self.0.joints.len()).map(JointId::from_index)
    }

    /// How many joints there are.
    #[must_use]
    pub fn n_joints(&self) -> usize {
        self.0.joints.len()
    }

    /// How many numbers a pose has.
    #[must_use]
    pub fn n_coords(&self) -> usize {
        self.0.n_coords
    }

    /// How many degrees of freedom all joints have together: the size of a tangent.
    #[must_use]
    pub fn n_dofs(&self) -> usize {
        self.0.n_dofs
    }

    /// Where a joint's coordinates lie in [`Pose::coords`](crate::Pose::coords); empty for one that follows another,
    /// and for the id of another, larger rig.
    #[must_use]
    pub fn coords_of(&self, joint: JointId) -> std::ops::Range<usize> {
        let (Some(data), Some(kernel)) = (self.get(joint), self.0.kernels.get(joint.index())) else {
            return 0..0;
        };
        let start = kernel.coord as usize;
        start..start + data.n_coords()
    }

    /// Where a joint's degrees of freedom lie in a tangent; empty for one that follows another, and
    /// for the id of another, larger rig.
    #[must_use]
    pub fn dofs_of(&self, joint: JointId) -> std::ops::Range<usize> {
        let (Some(data), Some(kernel)) = (self.get(joint), self.0.kernels.get(joint.index())) else {
            return 0..0;
        };
        let start = kernel.dof as usize;
        start..start + data.n_dofs()
    }

    /// The joint of a name: an exact joint name, else another name that a joint answers to, else a humanoid
    /// role.
    ///
    /// # Errors
    /// A name that nothing answers to comes back with the nearest ones.
    pub fn joint(&self, name: &str) -> Result<JointId, UnknownName> {
        self.0
            .by_name
            .get(name)
            .copied()
            .or_else(|| Role::from_name(name).and_then(|role| self.role(role)))
            .ok_or_else(|| self.unknown(name))
    }

    fn unknown(&self, name: &str) -> UnknownName {
        let roles = Role::ALL.iter().filter(|r| self.role(**r).is_some()).map(|r| r.name());
        name::unknown(name, self.0.by_name.keys().map(String::as_str).chain(roles))
    }

    /// The joint that is a humanoid bone.
    #[must_use]
    pub fn role(&self, role: Role) -> Option<JointId> {
        self.0.roles[role as usize]
    }

    /// The joints from `from` down to `to`, both included.
    ///
    /// # Errors
    /// When a name is unknown, or `from` is not an ancestor of `to`.
    pub fn chain(&self, from: &str, to: &str) -> Result<Vec<JointId>, ChainError> {
        let (first, last) = (self.joint(from)?, self.joint(to)?);
        let mut chain: Vec<JointId> = self.ancestors(last).collect();
        let Some(length) = chain.iter().position(|j| *j == first) else {
            let names: Vec<_> =
                chain.iter().skip(1).map(|j| format!("'{}'", self.0.joints[j.index()].name)).collect();
            let ancestors = if names.is_empty() { "none".to_owned() } else { names.join(", ") };
            return Err(ChainError::NotAnAncestor { from: from.to_owned(), to: to.to_owned(), ancestors });
        };
        chain.truncate(length + 1);
        chain.reverse();
        Ok(chain)
    }

    /// The joint itself, its parent, and so on up to the root; nothing for the id of another, larger rig.
    pub fn ancestors(&self, joint: JointId) -> impl Iterator<Item = JointId> + '_ {
        let start = self.get(joint).map(|_| joint);
        std::iter::successors(start, |j| self.0.joints[j.index()].parent)
    }

    /// The root of the body, which carries everything that moves: the joint that [`RigBuilder::free_root`]
    /// lets float, by the rules that stand there. `None` where no joint moves, or none could float.
    #[must_use]
    pub fn root(&self) -> Option<JointId> {
        self.0.root
    }

    /// Whether both are the same rig (not only equal ones).
    #[must_use]
    pub fn is_same(&self, other: &Self) -> bool {
        Arc::ptr_eq(&self.0, &other.0)
    }

    /// A builder that starts from this rig, to change motions or limits.
    #[must_use]
    pub fn to_builder(&self) -> RigBuilder {
        RigBuilder { joints: self.0.joints.clone() }
    }

    pub(crate) fn kernels(&self) -> &[Kernel] {
        &self.0.kernels
    }
}

impl std::fmt::Debug for Rig {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.debug_struct("Rig")
            .field("n_joints", &self.n_joints())
            .field("n_dofs", &self.n_dofs())
            .finish_non_exhaustive()
    }
}

/// Collects joints and validates them all at once.
#[derive(Clone, Debug, Default)]
pub struct RigBuilder {
    joints: Vec<Joint>,
}

impl RigBuilder {
    /// The most joints that a rig may have.
    pub const MOST_JOINTS: usize = 100_000;

    /// A builder without joints.
    #[must_use]
    pub fn new() -> Self {
        Self::default()
    }

    /// A builder without joints, with room for as many as will come: what is known to be large is not moved
    /// while it grows. More may be added all the same.
    ///
    /// ```
    /// use ikiru_rig::{Joint, RigBuilder};
    ///
    /// let mut builder = RigBuilder::with_capacity(2);
    /// let hip = builder.add(Joint::new("hip", None));
    /// builder.add(Joint::new("knee", Some(hip)));
    /// assert_eq!(builder.build()?.n_joints(), 2);
    /// # Ok::<(), ikiru_rig::RigError>(())
    /// ```
    #[must_use]
    pub fn with_capacity(n_joints: usize) -> Self {
        Self { joints: Vec::with_capacity(n_joints) }
    }

    /// Appends a joint.
    pub fn add(&mut self, joint: Joint) -> JointId {
        self.joints.push(joint);
        JointId::from_index(self.joints.len() - 1)
    }

    /// The joints so far.
    #[must_use]
    pub fn joints(&self) -> &[Joint] {
        &self.joints
    }

    /// The joints so far, to change them.
    pub fn joints_mut(&mut self) -> &mut [Joint] {
        &mut self.joints
    }

    /// Changes how a joint moves, and with it its limits.
    ///
    /// # Errors
    /// An id that the builder does not hold; nothing is changed then.
    pub fn set_motion(&mut self, joint: JointId, motion: JointMotion) -> Result<&mut Self, ForeignJoint> {
        let n_joints = self.joints.len();
        let of = self.joints.get_mut(joint.index());
        of.ok_or(ForeignJoint { joint: joint.index(), n_joints })?.motion = motion;
        Ok(self)
    }

    /// Validates everything once.
    ///
    /// # Errors
    /// The first thing that is wrong, with the joint's name.
    pub fn build(mut self) -> Result<Rig, RigError> {
        let found = self.joints.len();
        if found == 0 {
            return Err(RigError::Empty);
        }
        if found > Self::MOST_JOINTS {
            return Err(RigError::TooMany { found, most: Self::MOST_JOINTS });
        }
        for (idx, joint) in self.joints.iter().enumerate() {
            check_joint(idx, joint)?;
        }
        for joint in &mut self.joints {
            joint.motion = joint.motion.at_rest(joint.rest_rotation);
        }
        self.link_mimics()?;
        let mut by_name = HashMap::with_capacity(found);
        let mut roles: [Option<JointId>; Role::ALL.len()] = [None; Role::ALL.len()];
        for (idx, joint) in self.joints.iter().enumerate() {
            let id = JointId::from_index(idx);
            if by_name.insert(joint.name.clone(), id).is_some() {
                return Err(RigError::DuplicateName(joint.name.clone()));
            }
            if let Some(role) = joint.role
                && let Some(other) = roles[role as usize].replace(id)
            {
                let other = self.joints[other.index()].name.clone();
                return Err(RigError::DuplicateRole(other, joint.name.clone(), role));
            }
        }
        for (idx, joint) in self.joints.iter().enumerate() {
            for alias in &joint.aliases {
                let id = JointId::from_index(idx);
                // A joint's own name wins over what another answers to.
                if by_name
                    .get(alias)
                    .is_some_and(|other| self.joints[other.index()].aliases.contains(alias) && *other != id)
                {
                    return Err(RigError::DuplicateName(alias.clone()));
                }
                by_name.entry(alias.clone()).or_insert(id);
            }
        }
        let (mut n_coords, mut n_dofs) = (0, 0);
        let mut kernels: Vec<Kernel> = Vec::with_capacity(found);
        for joint in &self.joints {
            kernels.push(Kernel {
                parent: joint.parent.map_or(ROOT, |p| p.0),
                coord: u32::try_from(n_coords).unwrap_or(u32::MAX),
                dof: u32::try_from(n_dofs).unwrap_or(u32::MAX),
                rest_is_translation: joint.rest_rotation == DQuat::IDENTITY,
                mimic: joint.mimic.map(|m| (m.multiplier, m.offset)),
                leads: false,
                rest_rotation: Rotation::constant(joint.rest_rotation),
            });
            n_coords += joint.n_coords();
            n_dofs += joint.n_dofs();
        }
        for (idx, joint) in self.joints.iter().enumerate() {
            if let Some(mimic) = joint.mimic {
                kernels[idx].coord = kernels[mimic.leader.index()].coord;
                kernels[idx].dof = kernels[mimic.leader.index()].dof;
                kernels[mimic.leader.index()].leads = true;
            }
        }
        let root = root_of(&self.joints).ok().map(JointId::from_index);
        Ok(Rig(Arc::new(Data { joints: self.joints, kernels, by_name, roles, root, n_coords, n_dofs })))
    }

    /// Checks the joints that follow others, and narrows each leader's range to what its followers can do.
    fn link_mimics(&mut self) -> Result<(), RigError> {
        for idx in 0..self.joints.len() {
            let Some(mimic) = self.joints[idx].mimic else { continue };
            let refuse = |reason| RigError::Mimic { joint: self.joints[idx].name.clone(), reason };
            let leader =
                self.joints.get(mimic.leader.index()).ok_or_else(|| refuse("its leader does not exist"))?;
            if leader.mimic.is_some() {
                return Err(refuse("its leader follows another joint itself"));
            }
            if !leader.motion.is_scalar() || !self.joints[idx].motion.is_scalar() {
                return Err(refuse("only hinges and sliders can lead and follow"));
            }
            if !mimic.multiplier.is_finite() || !mimic.offset.is_finite() {
                return Err(refuse("multiplier and offset must be finite"));
            }
            let own = self.joints[idx].motion.ranges()[0];
            if mimic.multiplier == 0.0 || own.is_unlimited() {
                continue;
            }
            let ends = [own.min, own.max].map(|end| (end - mimic.offset) / mimic.multiplier);
            let (low, high) = (ends[0].min(ends[1]), ends[0].max(ends[1]));
            if let JointMotion::Hinge { range, .. } | JointMotion::Slider { range, .. } =
                &mut self.joints[mimic.leader.index()].motion
            {
                let narrowed = Range::new(range.min.max(low), range.max.min(high));
                if !narrowed.is_ordered() {
                    let reason = "its own range and its leader's have no value in common";
                    return Err(RigError::Mimic { joint: self.joints[idx].name.clone(), reason });
                }
                *range = narrowed;
            }
        }
        Ok(())
    }
}

fn check_joint(idx: usize, joint: &Joint) -> Result<(), RigError> {
    let name = || joint.name.clone();
    if joint.name.is_empty() {
        return Err(RigError::Unnamed(idx));
    }
    if joint.parent.is_some_and(|p| p.index() >= idx) {
        return Err(RigError::Parent(name()));
    }
    if !joint.rest_translation.is_finite()
        || !joint.rest_rotation.is_finite()
        || (joint.rest_rotation.length() - 1.0).abs() > 1e-6
    {
        return Err(RigError::Rest(name()));
    }
    if let JointMotion::Hinge { axis, .. } | JointMotion::Slider { axis, .. } = joint.motion
        && (!axis.is_finite() || (axis.length() - 1.0).abs() > 1e-6)
    {
        return Err(RigError::Axis(name(), axis.to_array()));
    }
    if let Some(bad) = joint.motion.ranges().iter().find(|r| !r.is_ordered()) {
        return Err(RigError::Range { joint: name(), min: bad.min, max: bad.max });
    }
    Ok(())
}
