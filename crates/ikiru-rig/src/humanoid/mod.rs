//! The humanoid roles: the 55 bone names of VRM 1.0, by which one scenario serves every character.
//!
//! A file may say which joint is which bone, as VRM does. For all others [`assign`] goes by the joints' names:
//! a table of naming schemes (`schemes.txt`) and a few rules. [`RigBuilder::assign_roles`] writes that into a
//! rig, [`RigBuilder::set_roles`] and [`Rig::with_roles`] what a user knows better. By roles, [`transfer`] takes a clip from one rig to
//! another.
//!
//! ```
//! use ikiru_rig::{Joint, RigBuilder, Role, humanoid};
//!
//! let mut builder = RigBuilder::new();
//! let mut parent = builder.add(Joint::new("mixamorig:Hips", None));
//! # let hips = parent;
//! for name in ["Spine", "LeftShoulder", "LeftArm", "LeftForeArm", "LeftHand"] {
//!     parent = builder.add(Joint::new(format!("mixamorig:{name}"), Some(parent)));
//! }
//! # for name in ["LeftUpLeg", "LeftLeg", "LeftFoot"] {
//! #     builder.add(Joint::new(format!("mixamorig:{name}"), Some(hips)));
//! # }
//! // … and legs
//! assert_eq!(builder.assign_roles().scheme, Some("mixamo"));
//! builder.set_roles([(Role::LeftShoulder, "mixamorig:LeftShoulder")])?;
//! let rig = builder.build()?;
//! assert_eq!(rig.joint("leftUpperArm")?, rig.joint("mixamorig:LeftArm")?);
//! # Ok::<(), Box<dyn std::error::Error>>(())
//! ```
//!
//! [`RigBuilder::assign_roles`]: crate::RigBuilder::assign_roles
//! [`RigBuilder::set_roles`]: crate::RigBuilder::set_roles
//! [`Rig::with_roles`]: crate::Rig::with_roles

mod apply;
mod assign;
mod facing;
mod problem;
mod structure;
mod t_pose;
mod table;
mod transfer;
mod transfer_warning;
mod tree;
mod way;

pub use apply::RoleMapError;
pub use assign::{Assignment, assign};
pub use facing::facing;
pub use problem::RoleProblem;
pub use t_pose::{normalised, t_pose};
pub use transfer::{Reference, TransferError, Transferred, transfer};
pub use transfer_warning::TransferWarning;

use crate::name::{UnknownName, unknown};

macro_rules! roles {
    ($($variant:ident $name:literal),* $(,)?) => {
        /// A humanoid bone, as VRM 1.0 names them.
        #[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, PartialOrd, Ord)]
        pub enum Role {
            $(#[doc = concat!("`", $name, "`")] $variant,)*
        }

        impl Role {
            /// All roles, in the order of VRM's specification.
            pub const ALL: [Self; 55] = [$(Self::$variant),*];

            /// VRM's name: `leftUpperArm`.
            #[must_use]
            pub fn name(self) -> &'static str {
                match self { $(Self::$variant => $name),* }
            }

            /// The role of that exact name.
            #[must_use]
            pub fn from_name(name: &str) -> Option<Self> {
                match name { $($name => Some(Self::$variant),)* _ => None }
            }
        }
    };
}

roles! {
    Hips "hips", Spine "spine", Chest "chest", UpperChest "upperChest", Neck "neck",
    Head "head", LeftEye "leftEye", RightEye "rightEye", Jaw "jaw",
    LeftUpperLeg "leftUpperLeg", LeftLowerLeg "leftLowerLeg", LeftFoot "leftFoot", LeftToes "leftToes",
    RightUpperLeg "rightUpperLeg", RightLowerLeg "rightLowerLeg", RightFoot "rightFoot", RightToes "rightToes",
    LeftShoulder "leftShoulder", LeftUpperArm "leftUpperArm", LeftLowerArm "leftLowerArm", LeftHand "leftHand",
    RightShoulder "rightShoulder", RightUpperArm "rightUpperArm", RightLowerArm "rightLowerArm", RightHand "rightHand",
    LeftThumbMetacarpal "leftThumbMetacarpal", LeftThumbProximal "leftThumbProximal", LeftThumbDistal "leftThumbDistal",
    LeftIndexProximal "leftIndexProximal", LeftIndexIntermediate "leftIndexIntermediate", LeftIndexDistal "leftIndexDistal",
    LeftMiddleProximal "leftMiddleProximal", LeftMiddleIntermediate "leftMiddleIntermediate", LeftMiddleDistal "leftMiddleDistal",
    LeftRingProximal "leftRingProximal", LeftRingIntermediate "leftRingIntermediate", LeftRingDistal "leftRingDistal",
    LeftLittleProximal "leftLittleProximal", LeftLittleIntermediate "leftLittleIntermediate", LeftLittleDistal "leftLittleDistal",
    RightThumbMetacarpal "rightThumbMetacarpal", RightThumbProximal "rightThumbProximal", RightThumbDistal "rightThumbDistal",
    RightIndexProximal "rightIndexProximal", RightIndexIntermediate "rightIndexIntermediate", RightIndexDistal "rightIndexDistal",
    RightMiddleProximal "rightMiddleProximal", RightMiddleIntermediate "rightMiddleIntermediate", RightMiddleDistal "rightMiddleDistal",
    RightRingProximal "rightRingProximal", RightRingIntermediate "rightRingIntermediate", RightRingDistal "rightRingDistal",
    RightLittleProximal "rightLittleProximal", RightLittleIntermediate "rightLittleIntermediate", RightLittleDistal "rightLittleDistal",
}

use Role::{
    Chest, Head, Hips, Jaw, LeftEye, LeftFoot, LeftHand, LeftIndexDistal, LeftIndexIntermediate,
    LeftIndexProximal, LeftLittleDistal, LeftLittleIntermediate, LeftLittleProximal, LeftLowerArm,
    LeftLowerLeg, LeftMiddleDistal, LeftMiddleIntermediate, LeftMiddleProximal, LeftRingDistal,
    LeftRingIntermediate, LeftRingProximal, LeftShoulder, LeftThumbDistal, LeftThumbMetacarpal,
    LeftThumbProximal, LeftToes, LeftUpperArm, LeftUpperLeg, Neck, RightFoot, RightHand, RightLowerArm,
    RightLowerLeg, RightUpperArm, RightUpperLeg, Spine, UpperChest,
};

impl Role {
    /// The roles that every humanoid of VRM has.
    pub const REQUIRED: [Self; 15] = [
        Hips,
        Spine,
        Head,
        LeftUpperLeg,
        LeftLowerLeg,
        LeftFoot,
        RightUpperLeg,
        RightLowerLeg,
        RightFoot,
        LeftUpperArm,
        LeftLowerArm,
        LeftHand,
        RightUpperArm,
        RightLowerArm,
        RightHand,
    ];

    /// This bone's counterpart on the other side; itself for one in the middle.
    #[must_use]
    pub fn mirrored(self) -> Self {
        let name = self.name();
        let other = match (name.strip_prefix("left"), name.strip_prefix("right")) {
            (Some(bone), _) => format!("right{bone}"),
            (_, Some(bone)) => format!("left{bone}"),
            _ => return self,
        };
        Self::from_name(&other).unwrap_or(self)
    }

    /// The role above, as VRM 1.0 has it; where a rig lacks it, the next one above that. `None` for the hips.
    #[must_use]
    pub fn parent(self) -> Option<Self> {
        Some(match self {
            Hips => return None,
            Spine | LeftUpperLeg => Hips,
            Chest => Spine,
            UpperChest => Chest,
            Neck | LeftShoulder => UpperChest,
            Head => Neck,
            LeftEye | Jaw => Head,
            LeftLowerLeg => LeftUpperLeg,
            LeftFoot => LeftLowerLeg,
            LeftToes => LeftFoot,
            LeftUpperArm => LeftShoulder,
            LeftLowerArm => LeftUpperArm,
            LeftHand => LeftLowerArm,
            LeftThumbMetacarpal | LeftIndexProximal | LeftMiddleProximal | LeftRingProximal
            | LeftLittleProximal => LeftHand,
            LeftThumbProximal => LeftThumbMetacarpal,
            LeftThumbDistal => LeftThumbProximal,
            LeftIndexIntermediate => LeftIndexProximal,
            LeftIndexDistal => LeftIndexIntermediate,
            LeftMiddleIntermediate => LeftMiddleProximal,
            LeftMiddleDistal => LeftMiddleIntermediate,
            LeftRingIntermediate => LeftRingProximal,
            LeftRingDistal => LeftRingIntermediate,
            LeftLittleIntermediate => LeftLittleProximal,
            LeftLittleDistal => LeftLittleIntermediate,
            right => return right.mirrored().parent().map(Self::mirrored),
        })
    }

    /// All roles above, the nearest first.
    pub fn ancestors(self) -> impl Iterator<Item = Self> {
        std::iter::successors(self.parent(), |role| role.parent())
    }
}

/// By VRM's name; an unknown one answers with the nearest.
impl std::str::FromStr for Role {
    type Err = UnknownName;
    fn from_str(name: &str) -> Result<Self, UnknownName> {
        Self::from_name(name).ok_or_else(|| unknown(name, Self::ALL.iter().map(|role| role.name())))
    }
}

impl std::fmt::Display for Role {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.write_str(self.name())
    }
}

#[cfg(test)]
mod tests {
    use super::Role;

    #[test]
    fn names_are_unique_and_lead_back() {
        for role in Role::ALL {
            assert_eq!(Role::from_name(role.name()), Some(role));
        }
        assert_eq!(Role::from_name("tail"), None);
        let error = "leftUperArm".parse::<Role>().unwrap_err();
        assert_eq!(error.nearest[0], "leftUpperArm");
    }

    #[test]
    fn every_role_hangs_below_the_hips_and_mirrors_to_one_of_the_same_depth() {
        for role in Role::ALL {
            assert_eq!(role.ancestors().last().unwrap_or(role), Role::Hips, "{role}");
            assert_eq!(role.mirrored().mirrored(), role);
            assert_eq!(role.mirrored().ancestors().count(), role.ancestors().count());
            assert_eq!(
                role.mirrored() == role,
                !role.name().contains("eft") && !role.name().contains("ight")
            );
        }
    }
}
