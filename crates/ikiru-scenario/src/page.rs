//! `docs/scenario.md`: the format as a page that people read, made of the tables by which texts are read.

use std::fmt::Write as _;

use crate::document;
use crate::key::{Key, LeftOut};
use crate::keys::{JointKeys, TOLERANCE, TOLERANCE_DEG};
use crate::kinds::Kind;
use crate::times::Times;
use crate::{limits, motion, objective, rate_limits, start, stop};

/// A part of the page: a head, prose, tables of keys, an example, more prose.
struct Section {
    head: &'static str,
    about: &'static str,
    /// Each with the line that leads to it, where there is one.
    tables: &'static [(&'static str, &'static [Key])],
    example: &'static str,
    after: &'static str,
}

const HEAD: &str = "\
<!-- Made of the tables in crates/ikiru-scenario/src by `cargo xtask page`: change it there. -->

# Scenario files

A scenario is a TOML file that says which rig to pose, which joints may move and how far, and what the pose or the motion should
achieve. The command (`ikiru solve`, `ikiru plan`) and every program that uses the library read the same files.

Lengths are metres, times seconds, and angles degrees in keys that end in `_deg`. Joints are named as in the file, or by their humanoid
role (`leftHand`). Which axes numbers count along is drawn in [axes.md](axes.md). What a text gets wrong is an error with line, column
and what was expected; a key that does not exist is one too.
";

const SECTIONS: [Section; 5] = [
    Section {
        head: "Keys at the top",
        about: "",
        tables: &[("", &document::KEYS)],
        example: "\
version = 1
rig = \"builtin:human\"
active = [\"leftShoulder\", \"leftUpperArm\", \"leftLowerArm\", \"leftHand\"]

[[objective]]
kind = \"position\"
joint = \"leftHand\"
target = [0.35, 1.1, 0.35]
",
        after: "\
Built in are `builtin:human`, `builtin:reference` (the skeleton of the paper's evaluation) and the robots `builtin:panda`,
`builtin:ur5`, `builtin:xarm7` and `builtin:g1`.
",
    },
    Section {
        head: "`[roles]`",
        about: "\
Which joint is which humanoid bone, one of VRM's 55: `ROLE = \"JOINT\"`. It goes before what the file, names and structure say; a joint
that had the role loses it. `ikiru inspect RIG` prints the roles that a rig has.
",
        tables: &[],
        example: "\
[roles]
leftHand = \"hand_l\"
",
        after: "",
    },
    Section {
        head: "`[limits.NAME]`",
        about: "\
How far a joint may turn, at every step and not only at the end. Either ranges of three angles, which make an Euler joint of it, or a
cone, which makes a ball of it. Hinges and sliders keep the limits of their file.
",
        tables: &[("Ranges:", &limits::RANGES), ("A cone:", &limits::CONE)],
        example: "\
[limits.leftLowerArm]
min_deg = [-80, -145, 0]
max_deg = [80, 0, 0]

[limits.leftUpperArm]
axis = [1, 0, 0]
swing_deg = [110, 90]
twist_deg = [-70, 60]
",
        after: "\
A cone lies about the rest pose, unless it has a centre of its own: with P and K it limits `P⁻¹ · (rest · q) · K`, where `rest · q` is the
joint's rotation in its parent.
",
    },
    Section {
        head: "`[start]`",
        about: "\
Where a solve starts, and what the first sample of a motion is. Joints by name, each with one of the keys below: its motion on top of
rest. What is not named is at rest, what lies outside of limits is moved to the nearest pose inside, with a warning. Or the name of a
file in its place, `start = \"pose.json\"`, as `ikiru solve --out pose.json` writes it.
",
        tables: &[("", &[start::TRANSLATION]), ("Of each joint:", &JointKeys::KEYS)],
        example: "\
[start]
leftUpperArm = { euler_deg = [0, 0, -45] }
",
        after: "",
    },
    Section {
        head: "`[stop]`",
        about: "When a solve ends.\n",
        tables: &[("", &stop::KEYS)],
        example: "\
[stop]
max_restarts = 16
max_time_ms = 50
",
        after: "",
    },
];

const OBJECTIVE: Section = Section {
    head: "`[[objective]]`",
    about: "\
What the pose or the motion should achieve: one table an objective, its `kind` and the keys of that kind, which are listed below, and
the keys that all of them have.
",
    tables: &[
        ("", &objective::COMMON),
        ("Kinds with a part in metres have the first of these, kinds with an angle the second, some both:", &[TOLERANCE, TOLERANCE_DEG]),
        ("Beside a `[motion]`, when it holds:", &Times::KEYS),
    ],
    example: "\
[[objective]]
kind = \"distance\"
joints = [\"leftHand\", \"head\"]
at_least = 0.3
hard = true
",
    after: "\
A solve succeeds where every mandatory objective is within its tolerance and every hard one holds. Objectives that are not hard are
wishes: they compete, each with the cost `weight · loss(residual)`. A constraint does not: it holds at the end within its tolerance
whatever that costs, or the report names it, and its `weight`, `loss` and `mandatory` say nothing. Feet that stay, a distance to keep and
a body that does not fall over are `hard`; where a hand should be is a wish.

With `norm`, the paper's unsquared distance, no far miss outweighs all near ones. The `width` of a Huber loss is in the residual's own
unit, metres or radians.
",
};

const MOTION: Section = Section {
    head: "`[motion]`",
    about: "\
Makes a motion of the scenario (`ikiru plan`): the same objectives at their times, all samples planned at once, smooth in speed,
acceleration and jerk. Either `duration_secs` or `points` says how long it is.
",
    tables: &[
        ("", &motion::KEYS),
        ("Limits on speed and acceleration hold anywhere on the clip's curve, for every active joint:", &rate_limits::KEYS),
    ],
    example: "\
[[objective]]
kind = \"position\"
joint = \"leftHand\"
target = [0.45, 1.3, 0.25]
at = 1

[[objective]]
kind = \"position\"
joint = \"leftHand\"
path = [[2, 0.4, 1.2, 0.3], [3, 0.3, 1.3, 0.35]]

[motion]
duration_secs = 4
smoothness = [0, 0.01, 0.1]
start_at_rest = true
end_at_rest = true
max_speed_deg = 180
free_duration = true

[motion.limits.leftLowerArm]
max_speed_deg = 120

[motion.end]
leftUpperArm = { euler_deg = [0, 0, -60] }
",
    after: "\
Targets compete with smoothness: a fixed weight misses them by as much as length and speed of the motion ask for. So an objective
without `weight` is wanted within its tolerance: its weight begins at 1 and is raised tenfold as long as it is missed and that helps
(with `lm`, and without `cost_below`). What limits, reach or other objectives forbid is missed all the same, and reported. A `weight`
that is written stays what it is, and so much of the target is met.

The first sample is the start, so that what holds from 0 s on holds from the second sample on. A target that begins there and is
elsewhere leaves one sample to get to it, which is a warning.

Smoothness counts differences from sample to sample: another `rate` wants other weights.
",
};

/// The page `docs/scenario.md`: all keys, what they take, what holds where they are left out, and an example of each part.
///
/// ```
/// let page = ikiru_scenario::page();
/// assert!(page.contains("\n### `look_at`\n"));
/// ```
#[must_use]
pub fn page() -> String {
    let mut page = HEAD.to_owned();
    for section in SECTIONS.iter().chain([&MOTION, &OBJECTIVE]) {
        add_section(&mut page, section);
    }
    for kind in Kind::TEXTS {
        let _ = write!(page, "\n### `{}`\n\n{}\n", kind.name, kind.about);
        add_table(&mut page, "", kind.keys);
        for (place, keys) in kind.inner {
            let mut place = place.to_string();
            // A line begins with a capital letter.
            place[..1].make_ascii_uppercase();
            add_table(&mut page, &format!("{place}:"), keys);
        }
        add_example(&mut page, &format!("[[objective]]\n{}", kind.example));
    }
    page
}

// Writing to a String cannot fail.

fn add_section(page: &mut String, section: &Section) {
    let _ = write!(page, "\n## {}\n", section.head);
    add_prose(page, section.about);
    for (line, keys) in section.tables {
        add_table(page, line, keys);
    }
    add_example(page, section.example);
    add_prose(page, section.after);
}

fn add_prose(page: &mut String, prose: &str) {
    if !prose.is_empty() {
        let _ = write!(page, "\n{prose}");
    }
}

fn add_example(page: &mut String, example: &str) {
    let _ = write!(page, "\n```toml\n{example}```\n");
}

fn add_table(page: &mut String, line: &str, keys: &[Key]) {
    if !line.is_empty() {
        let _ = write!(page, "\n{line}\n");
    }
    *page += "\n| key | takes | left out | says |\n|---|---|---|---|\n";
    for Key { name, takes, left_out, means } in keys {
        let left_out = match left_out {
            LeftOut::Refused => "an error".to_owned(),
            LeftOut::Another => "another in its place".to_owned(),
            LeftOut::Value(value) => format!("`{value}`"),
            LeftOut::Words(words) => (*words).to_owned(),
        };
        let _ = writeln!(page, "| `{name}` | {takes} | {left_out} | {means} |");
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::Scenario;

    const TOP: &str = "version = 1\nrig = \"builtin:human\"\n";
    const REACH: &str =
        "[[objective]]\nkind = \"position\"\njoint = \"leftHand\"\ntarget = [0.35, 1.1, 0.35]\n";

    /// What a text comes to, as far as a key could change it.
    fn outcome(text: &str) -> String {
        let scenario = Scenario::parse(text, "test.toml", ".").unwrap_or_else(|e| panic!("{e}\n{text}"));
        let limits: Vec<_> = scenario.rig.joints().iter().map(|joint| joint.motion).collect();
        let axes = scenario.world_from_targets();
        format!(
            "{:?} {:?} {:?} {limits:?} {axes:?} {:?}",
            scenario.problem.terms(),
            scenario.solver.options(),
            scenario.motion,
            scenario.start.coords()
        )
    }

    /// Writing a default changes nothing: `text` with and without each, put after `head`.
    fn defaults_hold(text: &str, head: &str, keys: &[Key]) -> usize {
        let mut n_defaults = 0;
        for Key { name, left_out, .. } in keys {
            let LeftOut::Value(value) = left_out else { continue };
            assert!(!text.contains(&format!("\n{name} = ")), "{name} is written already");
            let written = text.replacen(head, &format!("{head}{name} = {value}\n"), 1);
            assert_ne!(written, text);
            assert_eq!(outcome(&written), outcome(text), "{written}");
            n_defaults += 1;
        }
        n_defaults
    }

    #[test]
    fn a_default_that_is_written_changes_nothing() {
        let plain = format!("{TOP}{REACH}");
        let motion = format!("{plain}[motion]\nduration_secs = 1\nmax_speed_deg = 9000\n");
        let cone = format!("{plain}[limits.leftHand]\naxis = [1, 0, 0]\nswing_deg = [90, 90]\n");
        let floating = format!("{TOP}root = \"free\"\n{REACH}[start]\n");
        let mut n_defaults = 0;
        for (text, head, keys) in [
            (&plain, "rig = \"builtin:human\"\n", &document::KEYS[..]),
            (&plain, "[[objective]]\n", &objective::COMMON),
            (&format!("{plain}[stop]\n"), "[stop]\n", &stop::KEYS),
            (&motion, "[motion]\n", &motion::KEYS),
            (&cone, "swing_deg = [90, 90]\n", &limits::CONE),
            (&floating, "[start]\n", &[start::TRANSLATION]),
        ] {
            let found = defaults_hold(text, head, keys);
            assert!(found > 0, "{head}");
            n_defaults += found;
        }
        for kind in Kind::TEXTS {
            n_defaults +=
                defaults_hold(&format!("{TOP}[[objective]]\n{}", kind.example), "[[objective]]\n", kind.keys);
        }
        assert!(n_defaults >= 20, "{n_defaults}");
    }
}
