//! Rigs that come with the library, where the feature `builtin` is on.

use crate::error::{Error, ErrorKind, Place};
use crate::loaded::Loaded;
#[cfg(feature = "builtin")]
use crate::{gltf, urdf};

/// What the name of a built-in rig begins with, where a file's could stand.
pub(crate) const PREFIX: &str = "builtin:";

/// The names of all built-in rigs: a skinned human with VRM's bones, the bare skeleton that the evaluation runs
/// on, and four robots (Franka Emika Panda, Universal Robots UR5, UFACTORY xArm 7, Unitree G1).
#[cfg(feature = "builtin")]
pub const BUILTINS: [&str; 6] = ["human", "reference", "panda", "ur5", "xarm7", "g1"];

/// Reads a built-in rig by its name in [`BUILTINS`], with or without `builtin:` before it.
///
/// # Errors
/// An unknown name answers with those that exist.
#[cfg(feature = "builtin")]
pub fn builtin(name: &str) -> Result<Loaded, Error> {
    let short = name.strip_prefix(PREFIX).unwrap_or(name);
    let full = format!("{PREFIX}{short}");
    let glb = |bytes: &[u8]| gltf::read::read(bytes.to_vec(), true, None, &full);
    let urdf = |bytes: &[u8]| urdf::read::read(bytes, &full);
    let loaded = match short {
        "human" => glb(include_bytes!("../assets/human.vrm")),
        "reference" => glb(include_bytes!("../assets/reference_human.glb")),
        "panda" => urdf(include_bytes!("../assets/robots/panda.urdf")),
        "ur5" => urdf(include_bytes!("../assets/robots/ur5_robot.urdf")),
        "xarm7" => urdf(include_bytes!("../assets/robots/xarm7.urdf")),
        "g1" => urdf(include_bytes!("../assets/robots/g1_29dof_rev_1_0.urdf")),
        _ => {
            let known = BUILTINS.map(|n| format!("{PREFIX}{n}")).join(", ");
            let kind = ErrorKind::Builtin { name: short.to_owned(), known };
            return Err(Error::new(full, Place::File, kind));
        }
    };
    Ok(Loaded { name: Some(full.clone()), ..loaded? })
}

/// There are none in this build.
#[cfg(not(feature = "builtin"))]
pub(crate) fn builtin(name: &str) -> Result<Loaded, Error> {
    let short = name.strip_prefix(PREFIX).unwrap_or(name).to_owned();
    Err(Error::new(name, Place::File, ErrorKind::NoBuiltins { name: short }))
}

#[cfg(all(test, not(feature = "builtin")))]
mod tests {
    #[test]
    fn rigs_that_were_left_out_say_so() {
        let error = crate::read("builtin:human").unwrap_err().to_string();
        assert_eq!(
            error,
            "builtin:human: this build has no built-in rigs, and so no 'human': expected the feature `builtin`"
        );
    }
}
