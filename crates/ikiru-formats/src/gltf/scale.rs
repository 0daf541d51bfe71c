//! What is left of the nodes' transforms besides rigid frames: scales, exactly as the file multiplies them.
//!
//! With `G` the product of all node matrices down to a node, without translations, the node's joint has a rotation `R`
//! and a rest `D` such that `G = R · D`: offsets below the node are `D` times the file's. Where `D` is the same for all
//! axes, it commutes with every turn of the joints below, and a rig moves as the file does. Where it is not, only what
//! never turns may hang below: its places are exact as well.

use glam::{DMat3, DQuat, DVec3};

use crate::gltf::transform::{HalfTurn, LARGEST, Local};

/// How much the scales of the axes may differ, relative to the largest.
pub(crate) const UNIFORM: f64 = 1e-3;

/// What takes a node's unit, along its joint's axes, to metres.
#[derive(Clone, Debug, PartialEq)]
pub(crate) enum Scale {
    /// One factor for all axes; negative below a mirrored node.
    Uniform(f64),
    /// Any other.
    Other(Box<DMat3>),
}

impl Scale {
    pub(crate) const ONE: Self = Self::Uniform(1.0);

    fn of(matrix: DMat3) -> Self {
        let scale = matrix.x_axis.x;
        if matrix == DMat3::from_diagonal(DVec3::splat(scale)) {
            Self::Uniform(scale)
        } else {
            Self::Other(Box::new(matrix))
        }
    }

    pub(crate) fn matrix(&self) -> DMat3 {
        match self {
            Self::Uniform(scale) => DMat3::from_diagonal(DVec3::splat(*scale)),
            Self::Other(matrix) => **matrix,
        }
    }

    /// An offset in metres.
    pub(crate) fn to_metres(&self, offset: DVec3) -> DVec3 {
        match self {
            Self::Uniform(scale) => offset * *scale,
            Self::Other(matrix) => **matrix * offset,
        }
    }

    /// An offset in the node's unit.
    pub(crate) fn to_file(&self, metres: DVec3) -> DVec3 {
        match self {
            Self::Uniform(scale) => metres / *scale,
            Self::Other(matrix) => matrix.inverse() * metres,
        }
    }

    /// Whether it is the same for all axes, within [`UNIFORM`].
    pub(crate) fn is_uniform(&self) -> bool {
        let Self::Other(matrix) = self else { return true };
        let axes = [matrix.x_axis, matrix.y_axis, matrix.z_axis];
        let (on, off) = (0..3).fold((DVec3::ZERO, 0.0_f64), |(mut on, mut off), axis| {
            let mut column = axes[axis];
            on[axis] = std::mem::take(&mut column[axis]);
            off = off.max(column.abs().max_element());
            (on, off)
        });
        let most = UNIFORM * on.abs().max_element();
        on.max_element() - on.min_element() <= most && off <= most
    }

    /// Whether it can be computed with: neither so large nor so small that numbers get lost.
    fn is_sound(&self) -> bool {
        let matrix = self.matrix();
        let sizes = [matrix.x_axis, matrix.y_axis, matrix.z_axis].map(|axis| axis.abs().max_element());
        sizes.iter().all(|size| (1.0 / LARGEST..=LARGEST).contains(size))
    }
}

/// A node below some scale.
pub(crate) struct Below {
    /// Of its joint, in that of the joint above.
    pub(crate) rotation: DQuat,
    /// What its own rotation is followed by to give that; of no use below a scale that differs between the axes.
    pub(crate) half_turn: HalfTurn,
    /// What is below it.
    pub(crate) scale: Scale,
    /// Whether its axes are no longer perpendicular: the joint has the first of them, and the second's side of it.
    pub(crate) is_sheared: bool,
}

/// The joint of a node below some scale, and the scale below it; `None` where that is too large or too small.
pub(crate) fn below(above: &Scale, local: &Local) -> Option<Below> {
    let (sizes, half_turn) = (local.scale.abs(), HalfTurn::of_signs(local.scale.signum()));
    // Three signs that a half turn does not explain are one for all axes.
    let sign = local.scale.signum().element_product();
    let below = if above.is_uniform() {
        let rotation = match half_turn {
            HalfTurn::None => local.rotation,
            half_turn => (local.rotation * half_turn.quaternion()).normalize(),
        };
        let own = DMat3::from_diagonal(sizes * sign);
        let scale = match above {
            Scale::Uniform(above) => Scale::of(own * *above),
            Scale::Other(above) => {
                let turn = DMat3::from_quat(rotation);
                Scale::of(turn.transpose() * **above * turn * own)
            }
        };
        Below { rotation, half_turn, scale, is_sheared: false }
    } else {
        let full = above.matrix() * DMat3::from_quat(local.rotation) * DMat3::from_diagonal(local.scale);
        let sign = full.determinant().signum();
        let axes = [full.x_axis, full.y_axis, full.z_axis].map(|axis| axis.try_normalize().map(|a| a * sign));
        let [Some(x), Some(y), Some(z)] = axes else { return None };
        let skew = x.dot(y).abs().max(y.dot(z).abs()).max(z.dot(x).abs());
        let side = (y - x * x.dot(y)).try_normalize()?;
        let turn = DMat3::from_cols(x, side, x.cross(side));
        let scale = Scale::of(turn.transpose() * full);
        let rotation = DQuat::from_mat3(&turn).normalize();
        Below { rotation, half_turn, scale, is_sheared: skew > UNIFORM }
    };
    below.scale.is_sound().then_some(below)
}

#[cfg(test)]
#[allow(clippy::unwrap_used, reason = "a test fails by a panic")]
mod tests {
    use super::*;

    fn local(rotation: DQuat, scale: [f64; 3]) -> Local {
        Local { rotation, translation: DVec3::ZERO, scale: DVec3::from_array(scale) }
    }

    /// Rotation times scale is the product of the matrices, whatever stands above.
    #[test]
    fn the_product_of_the_matrices_is_kept() {
        let q = DQuat::from_axis_angle(DVec3::new(1.0, 2.0, 3.0).normalize(), 0.7);
        let scales =
            [[2.0, 2.0, 2.0], [1.0, 3.0, 0.5], [-1.0, 1.0, 1.0], [1.0, -2.0, -1.0], [-3.0, -3.0, -3.0]];
        for first in scales {
            for second in scales {
                let upper = below(&Scale::ONE, &local(q, first)).unwrap();
                let lower = below(&upper.scale, &local(q, second)).unwrap();
                let rotation = DMat3::from_quat(upper.rotation * lower.rotation);
                let expected = DMat3::from_quat(q)
                    * DMat3::from_diagonal(DVec3::from_array(first))
                    * DMat3::from_quat(q)
                    * DMat3::from_diagonal(DVec3::from_array(second));
                assert!(
                    (rotation * lower.scale.matrix()).abs_diff_eq(expected, 1e-12),
                    "{first:?} {second:?}"
                );
                assert_eq!(lower.is_sheared, first == [1.0, 3.0, 0.5] || first == [1.0, -2.0, -1.0]);
            }
        }
    }

    #[test]
    fn scales_that_undo_each_other_are_none() {
        let turn = DQuat::from_rotation_z(std::f64::consts::FRAC_PI_2);
        let upper = below(&Scale::ONE, &local(DQuat::IDENTITY, [1.0, 4.0, 2.0])).unwrap();
        assert!(!upper.scale.is_uniform());
        let lower = below(&upper.scale, &local(turn, [0.25, 1.0, 0.5])).unwrap();
        assert!(lower.scale.is_uniform() && !lower.is_sheared);
        assert!(lower.rotation.dot(turn).abs() > 1.0 - 1e-15);
        assert!(lower.scale.to_metres(DVec3::ONE).distance(DVec3::ONE) < 1e-15);
    }

    #[test]
    fn a_thousandth_is_uniform_and_products_of_thousandths_are_not() {
        let once = below(&Scale::ONE, &local(DQuat::IDENTITY, [1.0, 1.0, 1.0009])).unwrap();
        assert!(once.scale.is_uniform());
        let twice = below(&once.scale, &local(DQuat::IDENTITY, [1.0, 1.0, 1.0009])).unwrap();
        assert!(!twice.scale.is_uniform());
        assert!(below(&Scale::Uniform(1e90), &local(DQuat::IDENTITY, [1e20; 3])).is_none());
    }
}
