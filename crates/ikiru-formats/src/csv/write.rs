//! A motion → a table with one row a frame.

use ikiru_rig::{Clip, JointId, JointMotion, Pose, Rig};

use crate::error::{Error, ErrorKind, Fault};
use crate::motion::aligned_rotations;

/// A clip as a table, in UTF-8 with commas: a line of names, then one row a frame.
///
/// | columns | hold |
/// |---|---|
/// | `time_secs` | the frame's time |
/// | `root_translation.x`, `.y`, `.z` | how far the root of the body is from where it is at rest, in metres along the world's axes; zeros where it does not float |
/// | `NAME.x`, `.y`, `.z`, `.w` | rotation of a ball or free joint on top of its rest rotation; rows next to each other on the same side |
/// | `NAME.translation.x`, `.y`, `.z` | translation of a free joint that is not the root, likewise |
/// | `NAME.x_deg`, `.y_deg`, `.z_deg` | angles of an Euler joint |
/// | `NAME.angle_deg` | angle of a hinge |
/// | `NAME.offset` | offset of a slider, in metres |
///
/// Joints stand in the order of `joints`; fixed ones, and ids that the rig does not have, have no column.
/// Numbers have as many digits as bring back the same bits. Angles without limits go on from row to row and may be
/// more than a turn ([`Clip::unwrapped`]).
///
/// ```
/// use ikiru_rig::Clip;
///
/// let rig = ikiru_formats::builtin("human")?.rig;
/// let clip = Clip::still(rig.rest_pose());
/// let table = ikiru_formats::motion_csv(&clip, &[rig.joint("leftHand")?])?;
/// assert_eq!(
///     String::from_utf8(table)?,
///     "time_secs,root_translation.x,root_translation.y,root_translation.z,\
///      hand_l.x,hand_l.y,hand_l.z,hand_l.w\n0,0,0,0,0,0,0,1\n"
/// );
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
///
/// # Errors
/// When the clip has numbers that are not finite or quaternions not of unit length.
pub fn motion_csv(clip: &Clip, joints: &[JointId]) -> Result<Vec<u8>, Error> {
    let name = if clip.name().is_empty() { "clip" } else { clip.name() };
    write(clip, joints).map_err(|fault| fault.in_file(name))
}

fn write(clip: &Clip, joints: &[JointId]) -> Result<Vec<u8>, Fault> {
    if !clip.poses().iter().all(Pose::is_valid) {
        return Err(ErrorKind::InvalidPose { what: "the clip" }.into());
    }
    let columns = columns(&clip.clone().unwrapped(), joints);
    let mut table = csv::Writer::from_writer(Vec::new());
    let failed = |error: csv::Error| ErrorKind::Io { doing: "write the table", source: error.into() };
    table.write_record(columns.iter().map(|column| &column.name)).map_err(failed)?;
    for frame in 0..clip.times().len() {
        // A column has one number a frame.
        let row =
            columns.iter().map(|column| column.numbers.get(frame).map_or_else(String::new, f64::to_string));
        table.write_record(row).map_err(failed)?;
    }
    table
        .into_inner()
        .map_err(|error| ErrorKind::Io { doing: "write the table", source: error.into_error() }.into())
}

struct Column {
    name: String,
    numbers: Vec<f64>,
}

fn columns(clip: &Clip, joints: &[JointId]) -> Vec<Column> {
    let rig = clip.rig();
    let root = rig.floating_root();
    let mut columns = vec![Column { name: "time_secs".to_owned(), numbers: clip.times().to_vec() }];
    let of_root = clip.poses().iter().map(|pose| pose.root_translation().to_array());
    several(&mut columns, "root_translation", ["x", "y", "z"], of_root);
    for id in joints {
        joint(&mut columns, clip, rig, *id, root);
    }
    columns
}

fn joint(columns: &mut Vec<Column>, clip: &Clip, rig: &Rig, id: JointId, root: Option<JointId>) {
    let Some(joint) = rig.get(id) else { return };
    let name = &joint.name;
    let value = |pose: &Pose| pose.value(id).unwrap_or_default();
    match joint.motion {
        JointMotion::Fixed => {}
        JointMotion::Hinge { .. } => {
            let numbers = clip.poses().iter().map(|pose| value(pose).to_degrees()).collect();
            columns.push(Column { name: format!("{name}.angle_deg"), numbers });
        }
        JointMotion::Slider { .. } => {
            let numbers = clip.poses().iter().map(value).collect();
            columns.push(Column { name: format!("{name}.offset"), numbers });
        }
        JointMotion::Euler { .. } => {
            let angles =
                clip.poses().iter().map(|pose| pose.euler(id).unwrap_or_default().map(f64::to_degrees));
            several(columns, name, ["x_deg", "y_deg", "z_deg"], angles);
        }
        JointMotion::Ball { .. } | JointMotion::Free { .. } => {
            let rotations = aligned_rotations(clip, id).map(|q| q.to_array());
            several(columns, name, ["x", "y", "z", "w"], rotations);
            if matches!(joint.motion, JointMotion::Free { .. }) && Some(id) != root {
                let translations =
                    clip.poses().iter().map(|pose| pose.translation(id).unwrap_or_default().to_array());
                several(columns, &format!("{name}.translation"), ["x", "y", "z"], translations);
            }
        }
    }
}

/// A column for each of the numbers that belong together.
fn several<const N: usize>(
    columns: &mut Vec<Column>,
    name: &str,
    parts: [&str; N],
    rows: impl Iterator<Item = [f64; N]>,
) {
    let mut added = parts.map(|part| Column { name: format!("{name}.{part}"), numbers: Vec::new() });
    for row in rows {
        for (column, number) in added.iter_mut().zip(row) {
            column.numbers.push(number);
        }
    }
    columns.extend(added);
}
