//! What `inspect` prints for people: the tree of joints as a table, then what its columns mean.

use std::fmt::Write as _;

use glam::{DQuat, DVec3};
use ikiru_rig::body::center_of_mass;
use ikiru_rig::{Cone, JointId, JointMotion, Mimic, Range, Rig, Role};

use super::facts::{Facts, LimitSource};
use super::tree;
use crate::numbers::{angle, hundredths, length, short};

const HEADER: [&str; 6] = ["joint", "role", "position", "axes", "bone", "motion and limits"];

/// What the columns mean, where there is something in them.
const MEANING: &str = "\
position: the joint's origin at rest, metres in the world
axes: where the joint's own x, y and z point at rest, in the world; its limits and turns go by them
bone: length in metres and direction from the joint to the next, in the joint's own axes";

/// Warnings, the table of joints, clips, and a line of totals.
pub(super) fn inspected(facts: &Facts) -> String {
    let mut text = String::new();
    // Writing to a String cannot fail, here and below.
    for warning in &facts.warnings {
        let _ = writeln!(text, "warning: {warning}");
    }
    if !facts.warnings.is_empty() {
        text.push('\n');
    }
    text += &table(facts);
    let _ = writeln!(text, "\n{MEANING}\n\n{}", stature(facts));
    text += &masses(facts);
    for clip in &facts.loaded.clips {
        let name = if clip.name().is_empty() { "(no name)" } else { clip.name() };
        let _ = writeln!(text, "clip {name}: {:.2} s, {} frames", clip.duration_secs(), clip.poses().len());
    }
    text + &totals(facts)
}

fn table(facts: &Facts) -> String {
    let rig = &facts.loaded.rig;
    let mut rows = vec![HEADER.map(str::to_owned)];
    rows.extend(tree::rows(rig).into_iter().map(|(head, id)| row(facts, head, id)));
    let widths: [usize; 6] =
        std::array::from_fn(|column| rows.iter().map(|row| row[column].chars().count()).max().unwrap_or(0));
    let mut text = String::new();
    for row in rows {
        let cells = row.iter().zip(widths).map(|(cell, width)| format!("{cell:<width$}"));
        let line = cells.collect::<Vec<_>>().join("  ");
        let _ = writeln!(text, "{}", line.trim_end());
    }
    text
}

fn row(facts: &Facts, head: String, id: JointId) -> [String; 6] {
    let rig = &facts.loaded.rig;
    let (Some(joint), Some(rest)) = (rig.get(id), facts.rest.get(id.index())) else {
        return [head, String::new(), String::new(), String::new(), String::new(), String::new()];
    };
    let position = rest.position.to_array().map(|metres| format!("{:>6}", length(metres))).join(" ");
    let bone = facts.bone(id).map_or(String::new(), |bone| {
        format!("{} {}", length(bone.length()), direction(bone.normalize_or_zero()))
    });
    let mut motion = match joint.mimic {
        Some(mimic) => format!("{}, {}", joint.motion.name(), follower(rig, &joint.motion, mimic)),
        None => motion(&joint.motion),
    };
    if facts.limits_from[id.index()] == Some(LimitSource::Scenario) {
        motion += " (of the scenario)";
    }
    let role = joint.role.map_or("", Role::name).to_owned();
    [head, role, position, axes(rest.rotation), bone, motion]
}

/// How high it is and where it faces.
fn stature(facts: &Facts) -> String {
    let facing = facts.facing.map_or(String::new(), |facing| format!(", faces {}", direction(facing)));
    format!("{} m from the lowest joint to the highest{facing}", length(facts.height))
}

/// How heavy it is and where that is at rest; nothing where the file does not know.
fn masses(facts: &Facts) -> String {
    let (rig, segments) = (&facts.loaded.rig, facts.loaded.segments());
    let Some(center) = center_of_mass(&rig.rest_pose(), segments) else { return String::new() };
    let kg: f64 = segments.iter().map(|segment| segment.kg).sum();
    let center = center.to_array().map(length).join(" ");
    format!("{} kg in {}, centre of mass at rest: {center}\n", length(kg), counted(segments.len(), "segment"))
}

fn totals(facts: &Facts) -> String {
    let rig = &facts.loaded.rig;
    let mut text = String::new();
    let n_roles = rig.joints().iter().filter(|j| j.role.is_some()).count();
    let missing: Vec<&str> =
        Role::REQUIRED.into_iter().filter(|r| rig.role(*r).is_none()).map(Role::name).collect();
    if n_roles > 0 && !missing.is_empty() {
        let _ = writeln!(text, "of the 15 roles that VRM requires, no joint is {}", missing.join(", "));
    }
    let n_moving = rig.joints().iter().filter(|j| j.n_dofs() > 0).count();
    let _ = writeln!(
        text,
        "{} joints, {n_moving} of them moving with {} degrees of freedom; {}; {}; {}",
        rig.n_joints(),
        rig.n_dofs(),
        counted(n_roles, "humanoid role"),
        counted(facts.loaded.clips.len(), "clip"),
        counted(facts.warnings.len(), "warning"),
    );
    text
}

fn counted(count: usize, what: &str) -> String {
    match count {
        0 => format!("no {what}s"),
        1 => format!("1 {what}"),
        n => format!("{n} {what}s"),
    }
}

/// Where the three axes of a frame point in the world, roughly: `+x +z -y`; an axis between two of the world's has both.
fn axes(rotation: DQuat) -> String {
    [DVec3::X, DVec3::Y, DVec3::Z].map(|axis| rough(rotation * axis)).join(" ")
}

/// The axes along which a unit vector mostly goes: those that it is less than 67.5° from.
fn rough(v: DVec3) -> String {
    const LEAST: f64 = 0.382_683_432; // sin 22.5°
    let letters = v.to_array().into_iter().zip(["x", "y", "z"]);
    let signed = |(part, letter): (f64, &str)| format!("{}{letter}", if part < 0.0 { "-" } else { "+" });
    letters.filter(|(part, _)| part.abs() > LEAST).map(signed).collect()
}

/// A unit vector: an axis where it goes along one, else its numbers.
fn direction(v: DVec3) -> String {
    const ALONG: f64 = 0.999_4; // within 2°
    let letters = v.to_array().into_iter().zip(["x", "y", "z"]);
    match letters.into_iter().find(|(part, _)| part.abs() > ALONG) {
        Some((part, letter)) => format!("{}{letter}", if part < 0.0 { "-" } else { "+" }),
        None => format!("({})", v.to_array().map(hundredths).join(", ")),
    }
}

/// How a joint moves, its degrees of freedom and its limits.
fn motion(motion: &JointMotion) -> String {
    let limits = match motion {
        JointMotion::Fixed => return "fixed".to_owned(),
        JointMotion::Slider { axis, range } => {
            format!("along {}, {}", direction(*axis), range_of(range, metres))
        }
        JointMotion::Hinge { axis, range } => {
            format!("about {}, {}", direction(*axis), range_of(range, angle))
        }
        JointMotion::Euler { ranges, .. } if ranges.iter().all(Range::is_unlimited) => "no limits".to_owned(),
        JointMotion::Euler { ranges, .. } => {
            let named = ["x", "y", "z"].iter().zip(ranges);
            named
                .map(|(axis, range)| format!("{axis} {}", range_of(range, angle)))
                .collect::<Vec<_>>()
                .join(", ")
        }
        JointMotion::Ball { cone } | JointMotion::Free { cone } => {
            cone.as_ref().map_or("no limits".to_owned(), cone_of)
        }
    };
    let n_dofs = motion.n_dofs();
    format!("{}, {n_dofs} DoF, {limits}", motion.name())
}

/// `follows LEADER`, and how where it is not as the leader does.
fn follower(rig: &Rig, motion: &JointMotion, mimic: Mimic) -> String {
    let leader = rig.get(mimic.leader).map_or("", |j| &j.name);
    let mut text = format!("follows {leader}");
    if mimic.multiplier != 1.0 {
        let _ = write!(text, " times {}", short(mimic.multiplier));
    }
    if mimic.offset != 0.0 {
        let is_slider = matches!(motion, JointMotion::Slider { .. });
        let offset = if is_slider { metres(mimic.offset) } else { angle(mimic.offset) };
        let _ = write!(text, " plus {offset}");
    }
    text
}

fn metres(value: f64) -> String {
    format!("{} m", length(value))
}

fn range_of(range: &Range, text: fn(f64) -> String) -> String {
    match (range.min.is_finite(), range.max.is_finite()) {
        (true, true) => format!("{} to {}", text(range.min), text(range.max)),
        (true, false) => format!("from {}", text(range.min)),
        (false, true) => format!("up to {}", text(range.max)),
        (false, false) => "no limits".to_owned(),
    }
}

/// The half-widths stand with the axes that they are about: the cone's own, which are the joint's where it is about the rest
/// pose.
fn cone_of(cone: &Cone) -> String {
    let [first, second] = cone.swing().map(angle);
    let (about_first, about_second) = (cone.first_swing_axis(), cone.second_swing_axis());
    let mut text = format!(
        "cone about {}, swing {first} about {} and {second} about {}, twist {}",
        direction(cone.axis()),
        direction(about_first),
        direction(about_second),
        range_of(&cone.twist(), angle)
    );
    if let Some(centre) = cone.centre() {
        let rotation = |q: DQuat| q.to_array().map(short).join(", ");
        let (parent, joint) = (rotation(centre.parent_rotation), rotation(centre.joint_rotation));
        let _ = write!(text, ", parent_rotation [{parent}], joint_rotation [{joint}]");
    }
    text
}
