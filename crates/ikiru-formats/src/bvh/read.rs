//! A BVH file → a rig, and its frames as a clip.

use std::sync::Arc;

use glam::DVec3;
use ikiru_rig::{Clip, Cone, Joint, JointId, JointMotion, Pose, Range, Rig, RigBuilder};

use crate::bvh::channel::Channels;
use crate::bvh::hierarchy::{self, Hierarchy, Node};
use crate::bvh::motion::{self, Header, Positions, Survey};
use crate::bvh::names::{kept, names};
use crate::bvh::scan::Scanner;
use crate::bvh::{BvhOptions, JointLayout, Layout, PositionChannels};
use crate::error::{Error, ErrorKind, Fault};
use crate::loaded::Loaded;
use crate::warning::{Warning, Warnings};

/// Reads a BVH file from memory; `name` stands in messages. The [module](crate::bvh) says what becomes of it.
///
/// The frames are a clip without a name, at the times 0, `Frame Time`, 2 · `Frame Time`, …; a file of 0
/// frames has none. A height outside 0.3 to 3 m (of the rest pose or the first frame, whichever is higher)
/// gives a warning that suggests a scale.
///
/// # Errors
/// When the file is not valid: the error names line and column, what was found and what was expected. When
/// the scale is not between 1e-9 and 1e9.
pub fn read_bvh(bytes: &[u8], name: &str, options: &BvhOptions) -> Result<Loaded, Error> {
    load(bytes, name, options).map_err(|fault| fault.in_file(name))
}

fn load(bytes: &[u8], name: &str, options: &BvhOptions) -> Result<Loaded, Fault> {
    if !(1e-9..=1e9).contains(&options.scale) {
        return Err(ErrorKind::Scale { found: options.scale }.into());
    }
    let mut warnings = Warnings::default();
    let mut scanner = Scanner::new(bytes);
    let hierarchy = hierarchy::parse(&mut scanner)?;
    let header = motion::header(&mut scanner)?;
    let survey = motion::survey(scanner.clone(), &hierarchy, &header)?;
    if survey.n_extra > 0 {
        let per_frame = hierarchy.n_channels as usize;
        let (count, frames) = (survey.n_extra, header.n_frames);
        warnings.push(|| Warning::ExtraNumbers { count, frames, per_frame });
    }
    let in_place = match options.positions {
        PositionChannels::Detect => are_in_place(&hierarchy, &survey, &header),
        PositionChannels::OnTop => false,
        PositionChannels::InPlace => true,
    };
    let names = names(&hierarchy.nodes, &mut warnings);
    let layout = Layout {
        joints: hierarchy.nodes.iter().map(joint_layout).collect(),
        names: kept(&hierarchy.nodes, &names),
        scale: options.scale,
        in_place,
        frame_time: header.frame_time,
        file: name.to_owned(),
    };
    let n_channels = hierarchy.n_channels as usize;
    // What is no longer needed is given up on the way: a rig of many joints is larger than its text.
    let mut builder = joints(hierarchy, survey, &header, &layout, names);
    for problem in builder.assign_roles().problems {
        warnings.push(|| Warning::Role(problem));
    }
    let rig = builder.build().map_err(ErrorKind::from)?;
    let clip = clip(scanner, n_channels, &header, &layout, &rig, bytes.len())?;
    check_height(&rig, clip.as_ref(), options.scale, &mut warnings);
    let warnings = warnings.into_vec();
    let clips = clip.into_iter().collect();
    let (scale, layout) = (options.scale, Some(Arc::new(layout)));
    Ok(Loaded { clips, warnings, scale, layout, ..Loaded::from_rig(rig) })
}

fn joint_layout(node: &Node<'_>) -> JointLayout {
    JointLayout {
        offset: node.offset,
        channels: node.channels,
        first_channel: node.first_channel,
        is_end_site: node.is_end_site,
    }
}

/// Whether most joints' positions stay near their offsets, rather than near zero.
fn are_in_place(hierarchy: &Hierarchy<'_>, survey: &Survey, header: &Header) -> bool {
    if header.n_frames == 0 {
        return false;
    }
    let moving = hierarchy.nodes.iter().filter(|n| n.channels.has_positions());
    super::are_in_place(moving.zip(&survey.positions).map(|(node, p)| (node.offset, node.channels, p.mean)))
}

fn joints(
    hierarchy: Hierarchy<'_>,
    survey: Survey,
    header: &Header,
    layout: &Layout,
    names: Vec<String>,
) -> RigBuilder {
    let mut builder = RigBuilder::with_capacity(hierarchy.nodes.len());
    let mut positions = survey.positions.iter();
    for (node, name) in hierarchy.nodes.into_iter().zip(names) {
        let positions = if node.channels.has_positions() { positions.next() } else { None };
        let mut joint = Joint::new(name, node.parent.map(|p| JointId::from_index(p as usize)));
        let mut offset = node.offset;
        // A root is there to be moved, whether this clip does it or not.
        let translates = positions.is_some_and(|p| node.parent.is_none() || changes(p, node.channels));
        if let Some(positions) = positions.filter(|_| !translates && header.n_frames > 0) {
            for channel in node.channels.as_slice().iter().filter(|c| c.is_position) {
                let axis = channel.axis();
                let base = if layout.in_place { 0.0 } else { offset[axis] };
                offset[axis] = base + positions.min[axis];
            }
        }
        joint.rest_translation = DVec3::from_array(offset) * layout.scale;
        joint.motion = motion(node.channels, translates);
        builder.add(joint);
    }
    builder
}

/// Whether a position is not the same in all frames.
fn changes(positions: &Positions, channels: Channels) -> bool {
    channels.as_slice().iter().filter(|c| c.is_position).any(|channel| {
        let (min, max) = (positions.min[channel.axis()], positions.max[channel.axis()]);
        max - min > 1e-9 * max.abs().max(min.abs())
    })
}

/// How a joint with some channels moves.
fn motion(channels: Channels, translates: bool) -> JointMotion {
    const AXES: [DVec3; 3] = [DVec3::X, DVec3::Y, DVec3::Z];
    let (turns_about, slides_along) = (channels.first_axis(false), channels.first_axis(true));
    let order = channels.order();
    match (translates, channels.n_rotations(), turns_about, slides_along) {
        (true, 0, _, Some(axis)) if channels.n_positions() == 1 => {
            JointMotion::Slider { axis: AXES[axis], range: Range::UNLIMITED }
        }
        (true, 0, ..) => JointMotion::Free { cone: cone(DVec3::Y, 0.0) },
        (true, 1, Some(axis), _) => JointMotion::Free { cone: cone(AXES[axis], std::f64::consts::PI) },
        (true, ..) => JointMotion::FREE,
        (false, 1, Some(axis), _) => JointMotion::Hinge { axis: AXES[axis], range: Range::UNLIMITED },
        (false, 0, ..) => JointMotion::Fixed,
        (false, n, ..) => {
            let mut ranges = [Range::UNLIMITED; 3];
            if n == 2 {
                let [_, _, missing] = order.axes();
                ranges[missing] = Range::new(0.0, 0.0);
            }
            JointMotion::Euler { order, ranges }
        }
    }
}

/// A cone that leaves a twist alone.
fn cone(axis: DVec3, twist: f64) -> Option<Cone> {
    Cone::new(axis, [0.0; 2], Range::new(-twist, twist)).ok()
}

/// The frames as poses. `scanner` stands before the first.
fn clip(
    mut scanner: Scanner<'_>,
    n_channels: usize,
    header: &Header,
    layout: &Layout,
    rig: &Rig,
    n_bytes: usize,
) -> Result<Option<Clip>, Fault> {
    if header.n_frames == 0 {
        return Ok(None);
    }
    check_memory(header.n_frames, rig, n_bytes)?;
    let (mut times, mut poses) =
        (Vec::with_capacity(header.n_frames as usize), Vec::with_capacity(header.n_frames as usize));
    let mut frame = vec![0.0; n_channels];
    for idx in 0..header.n_frames {
        motion::read_frame(&mut scanner, &mut frame).map_err(|stop| stop.fault(&scanner, idx, header))?;
        let mut pose = rig.rest_pose();
        for (id, joint) in rig.ids().zip(&layout.joints) {
            let numbers = frame.get(joint.first_channel as usize..).unwrap_or_default();
            take_numbers(&mut pose, id, joint, numbers, layout);
        }
        times.push(idx as f64 * header.frame_time);
        poses.push(pose);
    }
    // Frame times that can be told apart were checked with the header.
    Ok(Clip::new("", times, poses).ok())
}

/// Poses of few or short numbers take more memory than their text, up to some thirty times: such files are
/// refused when large. Real ones have six characters and more a number.
fn check_memory(frames: u64, rig: &Rig, n_bytes: usize) -> Result<(), Fault> {
    const ALLOCATION: u64 = 24;
    let pose = (size_of::<Pose>() + size_of::<f64>()) as u64 + ALLOCATION;
    let bytes = frames.saturating_mul(pose + size_of::<f64>() as u64 * rig.n_coords() as u64);
    // What a rig of the most joints takes besides is left for it.
    let for_rig = 400 * rig.n_joints() as u64;
    let most = (40u64 << 20).saturating_sub(for_rig).saturating_add(6 * n_bytes as u64);
    if bytes > most {
        return Err(ErrorKind::LongMotion { frames, bytes, most }.into());
    }
    Ok(())
}

/// Sets a joint's coordinates by its numbers in a frame.
fn take_numbers(pose: &mut Pose, id: JointId, joint: &JointLayout, numbers: &[f64], layout: &Layout) {
    let Some(motion) = pose.rig().get(id).map(|joint| joint.motion) else { return };
    let (mut position, mut angles) = ([0.0; 3], [0.0; 3]);
    for (channel, number) in joint.channels.as_slice().iter().zip(numbers) {
        let axis = channel.axis();
        if channel.is_position {
            let base = if layout.in_place { joint.offset[axis] } else { 0.0 };
            position[axis] = (number - base) * layout.scale;
        } else {
            angles[axis] = number.to_radians();
        }
    }
    let position = DVec3::from_array(position);
    // Finite numbers for what the joint has: setting them cannot fail.
    let _ = match motion {
        JointMotion::Fixed => Ok(()),
        JointMotion::Hinge { axis, .. } => pose.set_value(id, DVec3::from_array(angles).dot(axis)),
        JointMotion::Slider { axis, .. } => pose.set_value(id, position.dot(axis)),
        JointMotion::Euler { .. } => pose.set_euler(id, angles),
        JointMotion::Ball { .. } | JointMotion::Free { .. } => {
            let rotation = joint.channels.order().quaternion(angles);
            pose.set_rotation(id, rotation).and_then(|()| pose.set_translation(id, position))
        }
    };
}

/// What has more is no figure with a height.
const MOST_JOINTS_OF_A_FIGURE: usize = 10_000;

/// Warns where a figure is not as high as a human may be.
fn check_height(rig: &Rig, clip: Option<&Clip>, scale: f64, warnings: &mut Warnings) {
    if rig.n_joints() > MOST_JOINTS_OF_A_FIGURE {
        return;
    }
    let first = clip.and_then(|clip| clip.poses().first());
    let metres = height(&rig.rest_pose()).max(first.map_or(0.0, height));
    if metres > 0.0 && !(0.3..=3.0).contains(&metres) {
        warnings.push(|| Warning::Height { metres, scale, likely: likely_scale(metres / scale) });
    }
}

fn height(pose: &Pose) -> f64 {
    let heights = pose.frames().into_iter().map(|f| f.position.y);
    let (min, max) = heights.fold((f64::INFINITY, f64::NEG_INFINITY), |(a, b), y| (a.min(y), b.max(y)));
    max - min
}

/// The usual unit in which a figure would be nearest to 1.65 m, the height of a human's topmost joint.
fn likely_scale(height: f64) -> Option<f64> {
    // Metres, decimetres, centimetres, millimetres, inches, feet, and the unit of the CMU motions (1/0.45 inch).
    const UNITS: [f64; 7] = [1.0, 0.1, 0.01, 0.001, 0.0254, 0.3048, 0.056444];
    let apart = |unit: f64| (unit * height / 1.65).ln().abs();
    UNITS.into_iter().min_by(|a, b| apart(*a).total_cmp(&apart(*b))).filter(|unit| apart(*unit) < 0.5)
}
