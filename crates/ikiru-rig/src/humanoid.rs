//! The humanoid roles: the 55 bone names of VRM 1.0, by which one scenario serves every character.

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
    }
}
