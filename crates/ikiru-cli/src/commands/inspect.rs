//! `ikiru inspect RIG`: what a rig has, as a tree.

use std::fmt::Write as _;

use anyhow::anyhow;
use ikiru_formats::Loaded;
use ikiru_rig::{Cone, JointId, Motion, Range, Rig, Role};

use crate::args::{InspectArgs, has_ending};
use crate::failure::{Failure, Outcome};
use crate::report::short;
use crate::roles::read_with_roles;
use crate::{json, output};

/// Deeper branches are drawn at this depth: a chain of ten thousand joints stays readable.
const MOST_DEPTH: usize = 24;

pub(crate) fn run(args: &InspectArgs) -> Result<Outcome, Failure> {
    if has_ending(&args.rig, &["toml"]) {
        let path = args.rig.display();
        return Err(Failure::input(anyhow!(
            "{path} is a scenario, not a rig: expected a .glb, .gltf, .vrm, .bvh or .urdf file; 'ikiru solve {path}' solves it"
        )));
    }
    let loaded = read_with_roles(&args.rig, args.roles.as_deref())?;
    if args.json {
        output::print(&format!("{}\n", json::inspected(&loaded)))?;
    } else {
        output::print(&output::printable(&text(&loaded)))?;
    }
    Ok(Outcome::Reached)
}

/// Warnings, the tree of joints, clips, and a line of totals.
fn text(loaded: &Loaded) -> String {
    let mut text = String::new();
    // Writing to a String cannot fail, here and below.
    for warning in &loaded.warnings {
        let _ = writeln!(text, "warning: {warning}");
    }
    if !loaded.warnings.is_empty() {
        text.push('\n');
    }
    let rig = &loaded.rig;
    let rows = tree(rig);
    let width = rows.iter().map(|(head, _)| head.chars().count()).max().unwrap_or(0);
    let role_width = rig.joints().iter().filter_map(|j| j.role).map(|r| r.name().len()).max().unwrap_or(0);
    for (head, id) in &rows {
        let Some(joint) = rig.get(*id) else { continue };
        let pad = width.saturating_sub(head.chars().count());
        let role = joint.role.map_or("", Role::name);
        let mut motion = motion_text(&joint.motion);
        if let Some(mimic) = joint.mimic {
            let leader = rig.get(mimic.leader).map_or("", |j| &j.name);
            motion = format!("{} follows {leader}", joint.motion.name());
        }
        let line = format!("{head}{:pad$}  {role:<role_width$}  {motion}", "");
        let _ = writeln!(text, "{}", line.trim_end());
    }
    if !loaded.clips.is_empty() {
        text.push('\n');
    }
    for clip in &loaded.clips {
        let name = if clip.name().is_empty() { "(no name)" } else { clip.name() };
        let _ = writeln!(text, "clip {name}: {:.2} s, {} frames", clip.duration_secs(), clip.poses().len());
    }
    let n_roles = rig.joints().iter().filter(|j| j.role.is_some()).count();
    let missing: Vec<&str> =
        Role::REQUIRED.into_iter().filter(|r| rig.role(*r).is_none()).map(Role::name).collect();
    if n_roles > 0 && !missing.is_empty() {
        let _ = writeln!(text, "\nof the 15 roles that VRM requires, no joint is {}", missing.join(", "));
    }
    let n_moving = rig.joints().iter().filter(|j| j.n_dofs() > 0).count();
    let _ = writeln!(
        text,
        "\n{} joints, {n_moving} of them moving with {} degrees of freedom; {}; {}; {}",
        rig.n_joints(),
        rig.n_dofs(),
        counted(n_roles, "humanoid role"),
        counted(loaded.clips.len(), "clip"),
        counted(loaded.warnings.len(), "warning"),
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

/// Each joint with its branch of the tree, depth first.
fn tree(rig: &Rig) -> Vec<(String, JointId)> {
    let mut children: Vec<Vec<JointId>> = vec![Vec::new(); rig.n_joints()];
    let mut roots = Vec::new();
    for (id, joint) in rig.ids().zip(rig.joints()) {
        match joint.parent {
            Some(parent) => children[parent.index()].push(id),
            None => roots.push(id),
        }
    }
    let mut rows = Vec::with_capacity(rig.n_joints());
    // A joint, what stands before its branch, and whether it has a branch and is the last of its siblings.
    let mut open: Vec<(JointId, String, Option<bool>, usize)> =
        roots.into_iter().rev().map(|id| (id, String::new(), None, 0)).collect();
    while let Some((id, before, branch, depth)) = open.pop() {
        let joint = rig.get(id).map_or("", |j| &j.name);
        let (own, below) = match branch {
            None => ("", ""),
            Some(true) => ("└─ ", "   "),
            Some(false) => ("├─ ", "│  "),
        };
        rows.push((format!("{before}{own}{}", output::printable(joint)), id));
        let inner = if depth < MOST_DEPTH { format!("{before}{below}") } else { before };
        let list = &children[id.index()];
        for (idx, child) in list.iter().enumerate().rev() {
            open.push((*child, inner.clone(), Some(idx + 1 == list.len()), depth + 1));
        }
    }
    rows
}

/// How a joint moves, its degrees of freedom and its limits.
fn motion_text(motion: &Motion) -> String {
    let limits = match motion {
        Motion::Fixed => return "fixed".to_owned(),
        Motion::Slider { range, .. } => range_text(range, " m", |v| v),
        Motion::Hinge { range, .. } => range_text(range, "°", f64::to_degrees),
        Motion::Euler { ranges, .. } => {
            let named = ["x", "y", "z"].iter().zip(ranges);
            let texts: Vec<String> = named
                .map(|(axis, range)| format!("{axis} {}", range_text(range, "°", f64::to_degrees)))
                .collect();
            texts.join(", ")
        }
        Motion::Ball { cone } | Motion::Free { cone } => {
            cone.as_ref().map_or("no limits".to_owned(), cone_text)
        }
    };
    let n_dofs = motion.n_dofs();
    format!("{}, {n_dofs} DoF, {limits}", motion.name())
}

fn range_text(range: &Range, unit: &str, convert: fn(f64) -> f64) -> String {
    let end = |value: f64| format!("{}{unit}", short(convert(value)));
    match (range.min.is_finite(), range.max.is_finite()) {
        (true, true) => format!("{} to {}", end(range.min), end(range.max)),
        (true, false) => format!("from {}", end(range.min)),
        (false, true) => format!("up to {}", end(range.max)),
        (false, false) => "no limits".to_owned(),
    }
}

fn cone_text(cone: &Cone) -> String {
    let axis = cone.axis().to_array().map(short).join(", ");
    let [first, second] = cone.swing().map(|s| short(s.to_degrees()));
    format!(
        "cone about ({axis}), swing {first}° and {second}°, twist {}",
        range_text(&cone.twist(), "°", f64::to_degrees)
    )
}
