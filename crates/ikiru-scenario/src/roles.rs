//! `[roles]`: the rig of the file → the same with the roles that the scenario knows better.

use ikiru_rig::humanoid::RoleMapError;
use ikiru_rig::{Rig, Role};

use crate::error::{Error, ErrorKind};
use crate::table::Table;

/// The rig with the scenario's roles on top of those that it has.
pub(crate) fn with_roles(rig: &Rig, scenario: &Table<'_>) -> Result<Rig, Error> {
    let Some(table) = scenario.table("roles")? else { return Ok(rig.clone()) };
    let mut roles = Vec::new();
    for value in table.entries() {
        let role: Role = value.key.parse().map_err(|e| value.key_error(ErrorKind::UnknownRole(e)))?;
        let joint = value.text("the name of a joint")?;
        roles.push((role, joint, value));
    }
    let pairs = roles.iter().map(|(role, joint, _)| (*role, *joint));
    rig.with_roles(pairs).map_err(|error| {
        let (role, kind) = match error {
            RoleMapError::Unknown { role, source: unknown } => {
                (role, ErrorKind::RoleOfNone { role, unknown })
            }
            RoleMapError::Twice { joint, first, second } => {
                (second, ErrorKind::TwoRoles { joint, first, second })
            }
            RoleMapError::Rig(error) => return table.error(ErrorKind::Roles(error)),
        };
        match roles.iter().find(|(of, ..)| *of == role) {
            Some((.., value)) => value.error(kind),
            None => table.error(kind),
        }
    })
}
