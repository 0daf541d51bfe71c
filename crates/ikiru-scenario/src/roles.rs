//! `[roles]`: the rig of the file → the same with the roles that the scenario knows better.

use ikiru_rig::humanoid::RoleMapError;
use ikiru_rig::{Rig, Role};

use crate::at::At;
use crate::error::{Error, ErrorKind};

/// The rig with the scenario's roles on top of those that it has: role and joint. `at` is the table `[roles]`.
pub(crate) fn with_roles(rig: &Rig, roles: &[(String, String)], at: &At<'_>) -> Result<Rig, Error> {
    if roles.is_empty() {
        return Ok(rig.clone());
    }
    let mut pairs: Vec<(Role, &str)> = Vec::with_capacity(roles.len());
    for (role, joint) in roles {
        let role = role.parse().map_err(|e| at.key(role).key_error(ErrorKind::UnknownRole(e)))?;
        pairs.push((role, joint));
    }
    rig.with_roles(pairs).map_err(|error| match error {
        RoleMapError::Unknown { role, source: unknown } => {
            at.key(role.name()).error(ErrorKind::RoleOfNone { role, unknown })
        }
        RoleMapError::Twice { joint, first, second } => {
            at.key(second.name()).error(ErrorKind::TwoRoles { joint, first, second })
        }
        RoleMapError::Rig(error) => at.error(ErrorKind::Roles(error)),
    })
}
