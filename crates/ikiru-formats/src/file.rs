//! Files on disk: which reader a name asks for, and saving without half-written files.

use std::fs;
use std::io::Write;
use std::path::{Path, PathBuf};

use crate::builtin::{PREFIX, builtin};
use crate::bvh::BvhOptions;
use crate::bvh::read::read_bvh;
use crate::error::{Error, ErrorKind, Place};
use crate::gltf;
use crate::loaded::Loaded;
use crate::urdf;

/// What an ending promises.
#[derive(Clone, Copy, PartialEq, Eq)]
enum Format {
    Glb,
    Gltf,
    Bvh,
    Urdf,
}

/// Reads a file, by its ending: `.glb`, `.gltf`, `.vrm`, `.vrma`, `.bvh` (of scale 1) or `.urdf`. The names of built-in rigs, such as
/// `builtin:human`, are understood as well.
///
/// # Errors
/// When the file cannot be read or is not valid; the error names the place in the file and the reason.
pub fn read(path: impl AsRef<Path>) -> Result<Loaded, Error> {
    read_scaled(path, 1.0)
}

/// As [`read`], with the length in metres of a unit of the file, for formats that do not say: BVH. The others
/// know theirs, and leave it alone.
///
/// # Errors
/// As [`read`], and when the scale is not a finite number above 0.
pub fn read_scaled(path: impl AsRef<Path>, scale: f64) -> Result<Loaded, Error> {
    let path = path.as_ref();
    if let Some(name) = path.to_str().filter(|name| name.starts_with(PREFIX)) {
        return builtin(name);
    }
    let name = path.display().to_string();
    let ending = path.extension().map(|e| e.to_string_lossy().to_ascii_lowercase()).unwrap_or_default();
    let format = match ending.as_str() {
        "glb" | "vrm" | "vrma" => Format::Glb,
        "gltf" => Format::Gltf,
        "bvh" => Format::Bvh,
        "urdf" => Format::Urdf,
        _ => {
            let found = if ending.is_empty() { String::new() } else { format!(".{ending}") };
            return Err(Error::new(name, Place::File, ErrorKind::Ending { found }));
        }
    };
    let bytes = fs::read(path).map_err(|source| {
        Error::new(&*name, Place::File, ErrorKind::Io { doing: "read the file", source })
    })?;
    let loaded = match format {
        Format::Bvh => read_bvh(&bytes, &name, &BvhOptions { scale, ..BvhOptions::default() })?,
        Format::Urdf => urdf::read::read(&bytes, &name)?,
        Format::Glb | Format::Gltf => {
            // A binary file under the other name is not worth an error.
            let in_container = format == Format::Glb || bytes.starts_with(gltf::MAGIC);
            let folder = path.parent().filter(|p| !p.as_os_str().is_empty()).unwrap_or(Path::new("."));
            gltf::read::read(bytes, in_container, Some(folder), &name)?
        }
    };
    Ok(Loaded { name: Some(name), ..loaded })
}

/// Whether the format of a file, by its ending, does not say how long its unit is, so that
/// [`read_scaled`] can be told: BVH's does not.
#[must_use]
pub fn lacks_unit(path: impl AsRef<Path>) -> bool {
    path.as_ref().extension().is_some_and(|ending| ending.eq_ignore_ascii_case("bvh"))
}

/// Reads a binary glTF or VRM file from memory; `name` stands in messages. Other files that it refers to are
/// not looked for.
///
/// # Errors
/// When the file is not valid.
pub fn read_glb(bytes: &[u8], name: &str) -> Result<Loaded, Error> {
    gltf::read::read(bytes.to_vec(), true, None, name)
}

/// Reads the text of a glTF file from memory; `name` stands in messages. Files that it refers to are looked
/// for in `folder` and below, and nowhere else.
///
/// # Errors
/// When the file is not valid.
pub fn read_gltf(bytes: &[u8], folder: Option<&Path>, name: &str) -> Result<Loaded, Error> {
    gltf::read::read(bytes.to_vec(), false, folder, name)
}

/// Reads a robot description (URDF) from memory; `name` stands in messages.
///
/// Every joint of the file is a joint, fixed ones included, and answers to its child link's name as well. The
/// root link is a fixed joint of its own, which carries the rotation from URDF's axes (x forward, y left, z up) to the
/// library's; see [`Loaded::world_from_file`].
///
/// | type | becomes |
/// |---|---|
/// | `revolute` | a hinge with the range of its `<limit>`, which must be there; `lower` and `upper` default to 0 |
/// | `continuous` | a hinge without a range; a `<limit>` does not change that |
/// | `prismatic` | a slider, with a range as for `revolute` |
/// | `fixed`, `floating` | a fixed and a free joint |
/// | `planar` | three joints: sliders `NAME_x` and `NAME_y` in the plane, then the hinge `NAME` about the axis; for the axis z, they are those along x and y |
/// | `spherical` | a ball: not URDF's own, but Bullet's and widely used |
///
/// `<mimic>` makes a follower, whose range narrows its leader's; without `lower` and `upper` it has none of its own.
/// Followers of followers follow the first leader. A link's `<inertial>` gives its mass and where that is to the joint above the
/// link ([`Loaded::segments`]); links without one, without a `<mass>` in it, or of 0 kg are massless. What has no bearing on
/// kinematics is skipped: visuals, moments of inertia, `<safety_controller>`, `<transmission>`, `<gazebo>` and all elements that
/// URDF does not know.
///
/// Robots whose makers put y up all the same (some of Bullet's) lie on their backs: URDF has no way to say so.
///
/// # Errors
/// When the file is not valid; the error names line, column and element. Links that make no tree, a missing
/// `<limit>`, an axis of length 0, a mass below 0, and xacro markup are errors.
pub fn read_urdf(bytes: &[u8], name: &str) -> Result<Loaded, Error> {
    urdf::read::read(bytes, name)
}

/// The file that a path leads to through links, be it there or not, so that a link stays one.
fn behind_links(path: &Path) -> PathBuf {
    /// As many as Linux follows; more are a circle, which the system then refuses.
    const MOST: usize = 40;
    let mut target = path.to_owned();
    for _ in 0..MOST {
        let Ok(next) = fs::read_link(&target) else { break };
        // A relative link begins in its own folder.
        target = target.parent().map_or_else(|| next.clone(), |folder| folder.join(&next));
    }
    target
}

/// Writes a file as a whole: it is written beside its place and then moved there, so that no reader sees a
/// half of it and a failure leaves an older file as it was. A link stays one, and the file that it leads to is written,
/// be it there or not. What is not a plain file is written directly.
///
/// # Errors
/// When the system refuses; the error says which file and what was tried.
pub fn save(path: impl AsRef<Path>, bytes: &[u8]) -> Result<(), Error> {
    let path = path.as_ref();
    let fail = |doing| {
        move |source| Error::new(path.display().to_string(), Place::File, ErrorKind::Io { doing, source })
    };
    let target = behind_links(path);
    let older = fs::metadata(&target).ok();
    if older.as_ref().is_some_and(|m| !m.is_file()) {
        return fs::write(&target, bytes).map_err(fail("write the file"));
    }
    let name = target.file_name().unwrap_or_default().to_string_lossy().into_owned();
    let beside = target.with_file_name(format!(".{name}.{}.tmp", std::process::id()));
    let written = fs::File::create(&beside)
        .and_then(|mut file| file.write_all(bytes).and_then(|()| file.sync_all()))
        .map_err(fail("write a file beside it"))
        .and_then(|()| match older {
            Some(older) => fs::set_permissions(&beside, older.permissions())
                .map_err(fail("give it the permissions of the older file")),
            None => Ok(()),
        })
        .and_then(|()| fs::rename(&beside, &target).map_err(fail("move the new file to its place")));
    if written.is_err() {
        // Nothing more can be done if this fails too.
        let _ = fs::remove_file(&beside);
    }
    written
}
