//! Rigs that come with the library.

use crate::error::{Error, ErrorKind, Place};
use crate::gltf;
use crate::loaded::Loaded;

/// What the name of a built-in rig begins with, where a file's could stand.
pub(crate) const PREFIX: &str = "builtin:";

/// The names of all built-in rigs: a skinned human with VRM's bones, and the bare skeleton that the
/// evaluation runs on.
pub const BUILTINS: [&str; 2] = ["human", "reference"];

/// Reads a built-in rig: `human` or `reference`, with or without `builtin:` before it.
///
/// # Errors
/// An unknown name answers with those that exist.
pub fn builtin(name: &str) -> Result<Loaded, Error> {
    let short = name.strip_prefix(PREFIX).unwrap_or(name);
    let bytes: &[u8] = match short {
        "human" => include_bytes!("../assets/human.vrm"),
        "reference" => include_bytes!("../assets/reference_human.glb"),
        _ => {
            let known = BUILTINS.map(|n| format!("{PREFIX}{n}")).join(", ");
            let kind = ErrorKind::Builtin { name: short.to_owned(), known };
            return Err(Error::new(format!("{PREFIX}{short}"), Place::File, kind));
        }
    };
    gltf::read::read(bytes.to_vec(), true, None, &format!("{PREFIX}{short}"))
}
