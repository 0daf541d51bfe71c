//! A node's own transform, taken apart: rotation, translation and scale.

use glam::{DAffine3, DMat3, DQuat, DVec3};
use ikiru_rig::{RigidError, decompose_affine};

use crate::error::{ErrorKind, Fault};
use crate::gltf::document::Node;
use crate::warning::{Warning, Warnings, short};

/// The largest magnitude (and, inverted, the smallest scale) that is computed with.
pub(crate) const LARGEST: f64 = 1e100;

/// A half turn that a node's rotation is followed by, or a whole file turned by.
///
/// A scale with two negative signs is a half turn; one with an odd number of them is a negative scale, which
/// commutes with every rotation, times a half turn. So signs never stand in the way of a rigid rig.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub(crate) enum HalfTurn {
    #[default]
    None,
    X,
    Y,
    Z,
}

impl HalfTurn {
    pub(crate) fn quaternion(self) -> DQuat {
        match self {
            Self::None => DQuat::IDENTITY,
            Self::X => DQuat::from_xyzw(1.0, 0.0, 0.0, 0.0),
            Self::Y => DQuat::from_xyzw(0.0, 1.0, 0.0, 0.0),
            Self::Z => DQuat::from_xyzw(0.0, 0.0, 1.0, 0.0),
        }
    }

    pub(crate) fn of_signs(signs: DVec3) -> Self {
        // The axis whose sign is not that of the two others: the one that a half turn leaves alone.
        match (signs.x > 0.0, signs.y > 0.0, signs.z > 0.0) {
            (true, true, true) | (false, false, false) => Self::None,
            (x, y, z) if y == z && x != y => Self::X,
            (x, y, z) if x == z && y != x => Self::Y,
            _ => Self::Z,
        }
    }
}

/// A node's transform.
pub(crate) struct Local {
    /// Of unit length.
    pub(crate) rotation: DQuat,
    /// In the parent's unit.
    pub(crate) translation: DVec3,
    pub(crate) scale: DVec3,
}

/// A node's transform taken apart; `idx` is its position, for errors.
pub(crate) fn parts(node: &Node, idx: u32) -> Result<Local, Fault> {
    let parts = match &node.matrix {
        Some(matrix) => of_matrix(matrix, idx)?,
        None => Local {
            rotation: match node.rotation.as_deref() {
                Some(rotation) => unit(*rotation).ok_or_else(|| {
                    let kind = ErrorKind::Zero {
                        what: "the rotation",
                        found: rotation.to_vec(),
                        expected: "a unit quaternion",
                    };
                    Fault::at(format!("/nodes/{idx}/rotation"), kind)
                })?,
                None => DQuat::IDENTITY,
            },
            translation: node.translation.as_deref().map_or(DVec3::ZERO, |t| DVec3::from_array(*t)),
            scale: node.scale.as_deref().map_or(DVec3::ONE, |s| DVec3::from_array(*s)),
        },
    };
    let check = |member: &str, what, v: DVec3, smallest: f64| {
        let member = if node.matrix.is_some() { "matrix" } else { member };
        let pointer = || format!("/nodes/{idx}/{member}");
        let (small, found) = (v.abs().min_element() < smallest, v.to_array().to_vec());
        if small && v.min_element() > -smallest && v.abs().min_element() < 1e-30 {
            Err(Fault::at(pointer(), ErrorKind::Zero { what, found, expected: "a scale other than 0" }))
        } else if small || v.abs().max_element() > LARGEST || !v.is_finite() {
            Err(Fault::at(pointer(), ErrorKind::Magnitude { what, found }))
        } else {
            Ok(())
        }
    };
    check("translation", "the translation", parts.translation, 0.0)?;
    check("scale", "the scale", parts.scale, 1.0 / LARGEST)?;
    Ok(parts)
}

fn of_matrix(matrix: &[f64; 16], idx: u32) -> Result<Local, Fault> {
    let fail = |kind| Fault::at(format!("/nodes/{idx}/matrix"), kind);
    let found = || matrix.to_vec();
    let [ax, ay, az, aw, bx, by, bz, bw, cx, cy, cz, cw, tx, ty, tz, tw] = *matrix;
    if [aw, bw, cw, tw - 1.0].iter().any(|v| v.abs() > 1e-6) {
        return Err(fail(ErrorKind::NotAffine { found: found() }));
    }
    if matrix.iter().any(|v| v.abs() > LARGEST) {
        return Err(fail(ErrorKind::Magnitude { what: "the matrix", found: found() }));
    }
    let axes = DMat3::from_cols(DVec3::new(ax, ay, az), DVec3::new(bx, by, bz), DVec3::new(cx, cy, cz));
    let affine = DAffine3::from_mat3_translation(axes, DVec3::new(tx, ty, tz));
    let (rotation, translation, scale) = decompose_affine(&affine).map_err(|error| {
        fail(match error {
            RigidError::Shear => ErrorKind::Shear { found: found() },
            RigidError::Degenerate => {
                ErrorKind::Zero { what: "an axis of the matrix", found: found(), expected: "three axes" }
            }
            RigidError::NotFinite => ErrorKind::Magnitude { what: "the matrix", found: found() },
        })
    })?;
    Ok(Local { rotation, translation, scale })
}

/// A quaternion brought to unit length; `None` where it has none.
pub(crate) fn unit(q: [f64; 4]) -> Option<DQuat> {
    // Scaled first, so that huge and tiny numbers neither overflow nor vanish.
    let largest = q.into_iter().fold(0.0, |m: f64, c| m.max(c.abs()));
    if !largest.is_finite() || largest < 1e-30 {
        return None;
    }
    let q = DQuat::from_array(q.map(|c| c / largest)).normalize();
    q.is_finite().then_some(q)
}

/// A node's transform, with warnings about what is odd in it.
pub(crate) fn local(node: &Node, idx: u32, name: &str, warnings: &mut Warnings) -> Result<Local, Fault> {
    let local = parts(node, idx)?;
    let joint = || short(name);
    if node.matrix.is_some()
        && (node.translation.is_some() || node.rotation.is_some() || node.scale.is_some())
    {
        warnings.push(|| Warning::MatrixAndParts { joint: joint() });
    }
    if let (None, Some([x, y, z, w])) = (&node.matrix, node.rotation.as_deref()) {
        let length = x.hypot(*y).hypot(*z).hypot(*w);
        if (length - 1.0).abs() > 1e-3 {
            warnings.push(|| Warning::RotationLength { joint: joint(), length });
        }
    }
    if local.scale.signum().element_product() < 0.0 {
        warnings.push(|| Warning::Mirrored { joint: joint() });
    }
    Ok(local)
}

/// An offset, if it can be computed with.
pub(crate) fn sound(offset: DVec3) -> Option<DVec3> {
    (offset.is_finite() && offset.abs().max_element() <= LARGEST).then_some(offset)
}
