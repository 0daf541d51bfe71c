//! A ball in its cone, in a step of a pose and of a motion: where it lies, the box that its cone is to first order, and what that
//! does to a gradient.

use glam::DQuat;
use ikiru_rig::{Cone, TangentBox};

use crate::layout::Layout;
use crate::step::active::is_blocked;

/// A ball with a cone.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Ball {
    cone: Cone,
    /// Where its three turning degrees of freedom and its quaternion lie.
    pub(crate) dof: usize,
    coord: usize,
}

impl Ball {
    /// All of a layout, from the top of the tree.
    pub(crate) fn all(layout: &Layout) -> impl Iterator<Item = Self> + '_ {
        layout.movers.iter().filter_map(|m| {
            let cone = *m.motion.cone()?;
            Some(Self { cone, dof: m.dof + m.n_dofs - 3, coord: m.coord + m.n_coords - 4 })
        })
    }

    /// Its limits at the coordinates of a pose.
    #[inline]
    pub(crate) fn limits(&self, coords: &[f64]) -> TangentBox {
        self.cone.tangent_box(DQuat::from_slice(&coords[self.coord..self.coord + 4]))
    }
}

/// What the limits of a ball do to a gradient.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Blocked {
    /// Which axes of the box cannot move.
    pub(crate) axes: [bool; 3],
    /// Curvature along the axes. Where the cost pushes against the edge of a swing, sliding along it falls back inside: the
    /// edge's bend times the push.
    pub(crate) bends: [f64; 3],
}

impl Blocked {
    /// For half a gradient by the axes of the box.
    #[inline(always)]
    pub(crate) fn of(limits: &TangentBox, gradient: [f64; 3]) -> Self {
        let axes = [0, 1, 2].map(|axis| is_blocked(limits.room[axis], gradient[axis]));
        let push = if axes[0] { gradient[0].abs() } else { 0.0 };
        Self { axes, bends: limits.bends.map(|bend| bend * push) }
    }
}

#[cfg(test)]
mod tests {
    use glam::DVec3;

    use super::*;

    #[test]
    fn an_edge_that_is_pushed_against_blocks_and_bends_and_no_other_does() {
        let inf = f64::INFINITY;
        let axes = [DVec3::X, DVec3::Y, DVec3::Z];
        let room = [(-inf, 0.0), (0.0, 1.0), (-inf, inf)];
        let limits = TangentBox { axes, readers: axes, room, bends: [0.0, 0.5, 2.0] };
        for (gradient, axes, bends) in [
            // Minus the gradient leads on.
            ([-3.0, -1.0, 1.0], [true, false, false], [0.0, 1.5, 6.0]),
            ([-3.0, 1.0, 1.0], [true, true, false], [0.0, 1.5, 6.0]),
            // The end of a twist does not bend, however hard it is pushed against.
            ([3.0, 9.0, 1.0], [false, true, false], [0.0; 3]),
            ([0.0, -9.0, 1.0], [false; 3], [0.0; 3]),
        ] {
            assert_eq!(Blocked::of(&limits, gradient), Blocked { axes, bends }, "{gradient:?}");
        }
    }
}
