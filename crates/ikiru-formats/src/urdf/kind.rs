//! The types that a URDF joint can have.

/// The type of a joint.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Kind {
    Revolute,
    Continuous,
    Prismatic,
    Fixed,
    Floating,
    Planar,
    /// An extension of Bullet's.
    Spherical,
}

impl Kind {
    /// All of them.
    pub(crate) const ALL: [Self; 7] = [
        Self::Revolute,
        Self::Continuous,
        Self::Prismatic,
        Self::Fixed,
        Self::Floating,
        Self::Planar,
        Self::Spherical,
    ];
    /// Their names, for a message.
    pub(crate) const NAMES: &str = "revolute, continuous, prismatic, fixed, floating, planar or spherical";

    pub(crate) fn name(self) -> &'static str {
        match self {
            Self::Revolute => "revolute",
            Self::Continuous => "continuous",
            Self::Prismatic => "prismatic",
            Self::Fixed => "fixed",
            Self::Floating => "floating",
            Self::Planar => "planar",
            Self::Spherical => "spherical",
        }
    }

    /// Whether it turns about or moves along an axis.
    pub(crate) fn has_axis(self) -> bool {
        self.is_scalar() || self == Self::Planar
    }

    /// Whether it has to have limits.
    pub(crate) fn has_limits(self) -> bool {
        matches!(self, Self::Revolute | Self::Prismatic)
    }

    /// Whether one angle or offset says where it is, so that it can follow and be followed.
    pub(crate) fn is_scalar(self) -> bool {
        matches!(self, Self::Revolute | Self::Continuous | Self::Prismatic)
    }
}
