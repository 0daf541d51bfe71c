//! Taking a matrix apart into what a rest transform may have: a rotation, a translation, a scale.

use glam::{DAffine3, DMat3, DQuat, DVec3};

// Not `non_exhaustive`: readers turn each case into an error of their own, and no other is left.
/// Why a matrix is not the rest transform of a joint.
#[derive(Clone, Copy, Debug, PartialEq, Eq, thiserror::Error)]
pub enum RigidError {
    /// Not all numbers are finite.
    #[error("the matrix has numbers that are not finite")]
    NotFinite,
    /// Its axes are not perpendicular.
    #[error("the matrix has a shear: its axes are not perpendicular")]
    Shear,
    /// An axis has no length.
    #[error("the matrix has no inverse: one of its axes has the length 0")]
    Degenerate,
}

/// Takes a transform apart into rotation, translation and the scale of each axis; a mirrored one has a
/// negative first scale.
///
/// # Errors
/// When it is not finite, has a shear (axes more than 1e-3 rad off perpendicular), or an axis of length 0.
pub fn decompose_affine(m: &DAffine3) -> Result<(DQuat, DVec3, DVec3), RigidError> {
    if !m.is_finite() {
        return Err(RigidError::NotFinite);
    }
    let a = m.matrix3;
    let mut scale = DVec3::new(a.x_axis.length(), a.y_axis.length(), a.z_axis.length());
    if scale.min_element() < 1e-30 {
        return Err(RigidError::Degenerate);
    }
    if a.determinant() < 0.0 {
        scale.x = -scale.x;
    }
    let unit = DMat3::from_cols(a.x_axis / scale.x, a.y_axis / scale.y, a.z_axis / scale.z);
    let skew = [unit.x_axis.dot(unit.y_axis), unit.y_axis.dot(unit.z_axis), unit.z_axis.dot(unit.x_axis)];
    if skew.iter().any(|s| s.abs() > 1e-3) {
        return Err(RigidError::Shear);
    }
    Ok((DQuat::from_mat3(&unit).normalize(), m.translation, scale))
}
