//! What a writer gives, and the formats that show a pose or a clip.

use std::path::Path;

use ikiru_rig::{Clip, Pose};

use crate::bvh;
use crate::error::Error;
use crate::gltf::{self, Container};
use crate::loaded::Loaded;
use crate::vrm;
use crate::warning::Warning;

/// A file, written.
#[derive(Clone, Debug, PartialEq)]
#[non_exhaustive]
pub struct Written {
    /// Its bytes, for [`save`](crate::save).
    pub bytes: Vec<u8>,
    /// What was left out, or is otherwise in the file than in the rig.
    pub warnings: Vec<Warning>,
}

/// A format that shows a pose or a clip.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
#[non_exhaustive]
pub enum Format {
    /// Binary glTF, of a rig that was read from a glTF or VRM file: that file, posed or animated.
    Glb,
    /// glTF as one text file, which holds all data, of a rig that was read from a glTF or VRM file.
    Gltf,
    /// Binary glTF of a VRM avatar (0.x or 1.0), which stays one: its VRM extension is kept.
    Vrm,
    /// A skeleton with frames, of any rig: see [`bvh`](crate::bvh).
    Bvh,
    /// A VRM animation, of any humanoid: see [`write_vrma`](crate::write_vrma). A pose becomes one of a single frame.
    Vrma,
}

impl Format {
    /// All of them, with the endings of their files.
    pub const ALL: [(Self, &'static str); 5] = [
        (Self::Glb, "glb"),
        (Self::Gltf, "gltf"),
        (Self::Vrm, "vrm"),
        (Self::Bvh, "bvh"),
        (Self::Vrma, "vrma"),
    ];

    /// The format that a file's name ends in, in upper or lower case.
    #[must_use]
    pub fn of(path: &Path) -> Option<Self> {
        let found = path.extension()?;
        Self::ALL.iter().find(|(_, ending)| found.eq_ignore_ascii_case(ending)).map(|(format, _)| *format)
    }
}

/// A pose as a file of a format, with what the format could not take as it is.
///
/// A glTF or VRM file comes back with its nodes in the pose, as [`write_posed_glb`](crate::write_posed_glb) says.
///
/// # Errors
/// When the pose has other joints than `loaded` or is not valid; for [`Format::Glb`], [`Format::Gltf`] and
/// [`Format::Vrm`] when the rig was not read from a glTF file, or a VRM avatar's; for [`Format::Vrma`] when the rig
/// lacks humanoid roles.
pub fn write_pose(loaded: &Loaded, pose: &Pose, format: Format) -> Result<Written, Error> {
    match format {
        Format::Glb => gltf::write::pose_file(loaded, pose, Container::Binary),
        Format::Gltf => gltf::write::pose_file(loaded, pose, Container::Text),
        Format::Vrm => gltf::write::pose_file(loaded, pose, Container::Vrm),
        Format::Bvh => bvh::write::pose_file(loaded, pose),
        Format::Vrma => vrm::animation::pose_file(pose),
    }
}

/// A clip as a file of a format, with what the format could not take as it is.
///
/// A glTF or VRM file comes back with the clip as its first animation, as
/// [`write_animated_glb`](crate::write_animated_glb) says.
///
/// # Errors
/// As [`write_pose`].
pub fn write_clip(loaded: &Loaded, clip: &Clip, format: Format) -> Result<Written, Error> {
    match format {
        Format::Glb => gltf::write_animation::clip_file(loaded, clip, Container::Binary),
        Format::Gltf => gltf::write_animation::clip_file(loaded, clip, Container::Text),
        Format::Vrm => gltf::write_animation::clip_file(loaded, clip, Container::Vrm),
        Format::Bvh => bvh::write::clip_file(loaded, clip),
        Format::Vrma => vrm::animation::clip_file(clip),
    }
}
