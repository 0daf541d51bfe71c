//! Roles written into a rig under construction: those that names tell, and those that a user gives.

use crate::humanoid::Role;
use crate::humanoid::assign::{Assignment, of_joints};
use crate::name::{UnknownName, unknown};
use crate::rig::{Rig, RigBuilder};
use crate::rig_error::RigError;

// Not `non_exhaustive`: scenarios say where in the file each case is, and the compiler shows them a new one.
/// Why roles that a user gave could not be applied.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum RoleMapError {
    /// There is no joint of that name.
    #[error("{role}: {source}")]
    Unknown {
        /// The role that it was to have.
        role: Role,
        /// The name, with the nearest ones.
        source: UnknownName,
    },
    /// One joint for two roles.
    #[error("joint '{joint}' cannot be both {first} and {second}")]
    Twice {
        /// The joint.
        joint: String,
        /// Its first role.
        first: Role,
        /// Its second.
        second: Role,
    },
    /// The rig that comes of it cannot exist; that of a valid rig can.
    #[error(transparent)]
    Rig(#[from] RigError),
}

impl Rig {
    /// This rig with roles given to joints by name, on top of those that it has, as
    /// [`RigBuilder::set_roles`] does. What depends on roles, as the [root](Rig::root) does, follows.
    ///
    /// ```
    /// use ikiru_rig::{Joint, RigBuilder, Role};
    ///
    /// let mut builder = RigBuilder::new();
    /// let arm = builder.add(Joint::new("Bip01_L_Forearm", None));
    /// builder.add(Joint::new("Bip01_L_Hand", Some(arm)));
    /// let rig = builder.build()?.with_roles([(Role::LeftHand, "Bip01_L_Hand")])?;
    /// assert_eq!(rig.joint("leftHand")?, rig.joint("Bip01_L_Hand")?);
    /// # Ok::<(), Box<dyn std::error::Error>>(())
    /// ```
    ///
    /// # Errors
    /// An unknown joint answers with the nearest names; a joint cannot have two of the given roles.
    pub fn with_roles<'n>(
        &self,
        roles: impl IntoIterator<Item = (Role, &'n str)>,
    ) -> Result<Self, RoleMapError> {
        let mut builder = self.to_builder();
        builder.set_roles(roles)?;
        Ok(builder.build()?)
    }
}

impl RigBuilder {
    /// Replaces all roles by those that the joints' names tell (see [`assign`](crate::humanoid::assign)). Of a skeleton that is no
    /// humanoid, no joint has a role then.
    pub fn assign_roles(&mut self) -> Assignment {
        let assignment = of_joints(self.joints());
        for joint in self.joints_mut() {
            joint.role = None;
        }
        for (role, joint) in &assignment.roles {
            if let Some(joint) = self.joints_mut().get_mut(joint.index()) {
                joint.role = Some(*role);
            }
        }
        assignment
    }

    /// Gives roles to joints by name, on top of those that are there: a user's word counts more. The joint that
    /// had the role before loses it.
    ///
    /// # Errors
    /// An unknown joint answers with the nearest names; a joint cannot have two of the given roles. Nothing is
    /// changed then.
    pub fn set_roles<'n>(
        &mut self,
        roles: impl IntoIterator<Item = (Role, &'n str)>,
    ) -> Result<(), RoleMapError> {
        let mut chosen: Vec<(Role, usize)> = Vec::new();
        for (role, name) in roles {
            let joints = self.joints();
            let by_name = joints.iter().position(|j| j.name == name);
            let by_alias = || joints.iter().position(|j| j.aliases.iter().any(|alias| alias == name));
            let Some(joint) = by_name.or_else(by_alias) else {
                let names = joints.iter().flat_map(|j| std::iter::once(&j.name).chain(&j.aliases));
                let source = unknown(name, names.map(String::as_str));
                return Err(RoleMapError::Unknown { role, source });
            };
            if let Some((first, _)) = chosen.iter().find(|(other, taken)| *taken == joint && *other != role) {
                let joint = joints[joint].name.clone();
                return Err(RoleMapError::Twice { joint, first: *first, second: role });
            }
            chosen.push((role, joint));
        }
        for (role, joint) in chosen {
            for other in self.joints_mut() {
                if other.role == Some(role) {
                    other.role = None;
                }
            }
            self.joints_mut()[joint].role = Some(role);
        }
        Ok(())
    }
}
