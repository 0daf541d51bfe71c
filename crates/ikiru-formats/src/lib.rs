//! Readers and writers of the Ikiru inverse-kinematics library: glTF, BVH, URDF, poses and motions as
//! JSON, motions as CSV, built-in rigs.
//!
//! [`read`] takes a `.glb`, `.gltf`, `.vrm`, `.vrma`, `.bvh` or `.urdf` file, or the name of a rig that comes with the library, and
//! gives a valid rig, its clips, and typed [`Warning`]s about what was mended. [`write_posed_glb`] and
//! [`write_animated_glb`] give the same file back, mesh, skin and materials included, in a pose or with a
//! motion; [`write_bvh_pose`] and [`write_bvh_clip`] write any rig's motion as BVH. [`write_pose`] and [`write_clip`]
//! write each [`Format`], and tell what it could not take.
//! [`read_vrma`] and [`write_vrma`] are for motions that fit every avatar; [`motion_json`], which
//! [`read_motion_json`] reads, and [`motion_csv`] for other programs.
//!
//! ```
//! use ikiru_rig::Role;
//!
//! let loaded = ikiru_formats::read("builtin:human")?;
//! let mut pose = loaded.rig.rest_pose();
//! let elbow = loaded.rig.joint(Role::LeftLowerArm.name())?;
//! pose.set_rotation(elbow, glam::DQuat::from_rotation_y(-1.0))?;
//! let bytes = ikiru_formats::write_posed_glb(&loaded, &pose)?;
//! let again = ikiru_formats::read_glb(&bytes, "posed.glb")?;
//! let (wanted, found) = (pose.frame(elbow)?, again.rig.rest_pose().frame(elbow)?);
//! assert!(wanted.position.distance(found.position) < 1e-9);
//! # Ok::<(), Box<dyn std::error::Error>>(())
//! ```
//!
//! # What is promised
//! A file either yields a valid rig or an [`Error`] that names file, place and reason; nothing panics. For
//! any input, reading takes less memory than 64 MiB and eight times the file's size, and no reference
//! leads out of the file's folder.

pub mod bvh;
pub mod gltf;
pub mod urdf;

mod builtin;
mod csv;
mod error;
mod file;
mod json;
mod loaded;
mod motion;
mod names;
mod vrm;
mod warning;
mod written;

#[cfg(feature = "builtin")]
pub use builtin::{BUILTINS, builtin};
pub use bvh::read::read_bvh;
pub use bvh::write::{write_bvh_clip, write_bvh_pose};
pub use bvh::{BvhOptions, PositionChannels};
pub use csv::motion_csv;
pub use error::{Error, ErrorKind, Place};
pub use file::{lacks_unit, read, read_glb, read_gltf, read_scaled, read_urdf, save};
pub use gltf::write::write_posed_glb;
pub use gltf::write_animation::write_animated_glb;
pub use json::{
    MotionRig, motion_json, motion_rig, name_motion_rig, pose_json, read_motion, read_motion_json,
    read_pose_json,
};
pub use loaded::Loaded;
pub use vrm::animation::{read_vrma, write_vrma};
pub use warning::{BoneProblem, Warning};
pub use written::{Format, Written, write_clip, write_pose};
