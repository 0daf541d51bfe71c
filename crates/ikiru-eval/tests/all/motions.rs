//! Rows of motions, recomputed by other means: differences by hand, matrices, and a problem of one's own.
#![allow(clippy::unwrap_used, reason = "a test that cannot go on fails")]

use std::path::Path;

use glam::{DQuat, DVec3};
use ikiru_eval::motions::{MotionSource, Outcome, Report, Settings, Way, run};
use ikiru_rig::{JointId, JointMotion, Pose, Range};
use ikiru_scenario::MotionScenario;
use ikiru_solve::objectives::{Direction, Position};
use ikiru_solve::{Problem, Search, Solver, SolverOptions, Tolerance};
use ikiru_testkit::reference::world_matrices;

const ONCE: Settings = Settings { runs: 1 };

/// The motions of a scenario that ships, from one start alone: where limits cannot be kept, others cost a minute.
fn shipped(name: &str) -> (Vec<Outcome>, MotionScenario) {
    let mut source = MotionSource::find(Path::new(name)).unwrap();
    source.text = source.text.replace("max_restarts = 16", "max_restarts = 0");
    (run(&source, &ONCE, || {}).unwrap(), source.motion().unwrap())
}

fn of(outcomes: &[Outcome], way: Way) -> &Outcome {
    outcomes.iter().find(|outcome| outcome.way == way).unwrap()
}

/// The way of a joint that turns from one pose to another, in radians.
fn step(from: &Pose, to: &Pose, joint: JointId) -> DVec3 {
    let at = from.rig().coords_of(joint);
    let (a, b) = (&from.coords()[at.clone()], &to.coords()[at]);
    match from.rig().get(joint).unwrap().motion {
        JointMotion::Hinge { .. } => DVec3::new(b[0] - a[0], 0.0, 0.0),
        JointMotion::Euler { .. } => DVec3::new(b[0] - a[0], b[1] - a[1], b[2] - a[2]),
        JointMotion::Ball { .. } => {
            let turn = DQuat::from_slice(a).inverse() * DQuat::from_slice(b);
            let turn = if turn.w < 0.0 { -turn } else { turn };
            let (sine, cosine) = (turn.xyz().length(), turn.w);
            turn.xyz().normalize_or_zero() * (2.0 * sine.atan2(cosine))
        }
        ref other => panic!("{other:?} is none of these scenarios'"),
    }
}

/// Values and their times, and how long each stands for.
type Series = Vec<(DVec3, f64, f64)>;

/// Speed, acceleration or jerk (`order` 1 to 3): n! times the n-th divided difference.
fn rate(outcome: &Outcome, joint: JointId, order: usize) -> Series {
    let (times, poses) = (outcome.clip.times(), outcome.clip.poses());
    let mut values: Vec<DVec3> =
        (1..times.len()).map(|i| step(&poses[i - 1], &poses[i], joint) / (times[i] - times[i - 1])).collect();
    for n in 2..=order {
        values = (0..values.len() - 1)
            .map(|i| (values[i + 1] - values[i]) * n as f64 / (times[i + n] - times[i]))
            .collect();
    }
    let span = |i: usize| (times[i + order] - times[i]) / order as f64;
    values.iter().enumerate().map(|(i, v)| (*v, times[i], span(i))).collect()
}

fn near(found: f64, expected: f64, part: f64, what: &str) {
    assert!((found - expected).abs() <= part * expected.abs().max(1e-6), "{what}: {found}, not {expected}");
}

#[test]
fn rows_hold_what_their_motions_give() {
    for name in ["three_points", "panda_arc"] {
        let (outcomes, motion) = shipped(name);
        assert_eq!(outcomes.iter().map(|o| o.way).collect::<Vec<_>>(), Way::ALL);
        for outcome in &outcomes {
            let (row, clip) = (&outcome.row, &outcome.clip);
            let what = format!("{name}, {}", row.way);
            assert_eq!((row.scenario.as_str(), row.frames), (name, clip.poses().len()));
            near(row.duration_secs, clip.times()[row.frames - 1], 1e-12, &what);
            // Differences of poses, written by hand.
            let rates = |order| motion.active.iter().map(move |joint| rate(outcome, *joint, order));
            let largest = |order| rates(order).flatten().map(|r| r.0.length()).fold(0.0, f64::max);
            near(row.peak_acceleration_deg, largest(2).to_degrees(), 1e-6, &what);
            near(row.peak_jerk_deg, largest(3).to_degrees(), 1e-6, &what);
            let total: f64 = rates(3).flatten().map(|(jerk, _, secs)| jerk.length_squared() * secs).sum();
            near(row.total_jerk, total, 1e-6, &what);
            let ends = rates(1).flat_map(|s| [s[0].0.length(), s[s.len() - 1].0.length()]);
            near(row.end_speed_deg, ends.fold(0.0, f64::max).to_degrees(), 1e-6, &what);
            // The curve, looked at densely: the path by matrices, speeds and margins by small steps.
            let tip = motion.rig.joint(row.path_joint.as_ref().unwrap()).unwrap();
            let n = 20 * (row.frames - 1);
            let secs = |i: usize| row.duration_secs * i as f64 / n as f64;
            let (mut path, mut peak, mut place) = (0.0, 0.0_f64, None);
            let mut margin = f64::INFINITY;
            for i in 0..=n {
                let pose = clip.sample_cubic(secs(i));
                let now = world_matrices(&pose)[tip.index()].w_axis.truncate();
                path += place.map_or(0.0, |before: DVec3| before.distance(now));
                place = Some(now);
                let after = clip.sample_cubic(secs(i) + 1e-5);
                for joint in &motion.active {
                    peak = peak.max(step(&pose, &after, *joint).length() / 1e-5);
                    let data = &motion.rig.get(*joint).unwrap().motion;
                    let values = &pose.coords()[motion.rig.coords_of(*joint)];
                    for (range, value) in data.ranges().iter().zip(values).filter(|(r, _)| r.max > r.min) {
                        margin = margin.min(value - range.min).min(range.max - value);
                    }
                }
            }
            near(row.path_length.unwrap(), path, 1e-3, &what);
            near(row.peak_speed_deg, peak.to_degrees(), 1e-2, &what);
            // Here no cone is nearer than the ranges are. Where a range is touched, it is so between two looks at it.
            let found = row.limit_margin_deg.unwrap().to_radians();
            assert!((found - margin).abs() <= 1e-6 + 1e-3 * margin.abs(), "{what}: {found}, not {margin}");
        }
    }
}

#[test]
fn what_is_met_is_met_by_matrices_too() {
    for (name, joint, keys) in [
        (
            "three_points",
            "leftHand",
            &[(1.0, [0.45, 1.30, 0.25]), (2.0, [0.15, 1.45, 0.35]), (3.0, [0.35, 1.05, 0.40])][..],
        ),
        ("panda_arc", "panda_link8", &[(1.0, [0.45, 0.30, 0.40]), (2.0, [0.45, -0.30, 0.40])][..]),
    ] {
        let (outcomes, motion) = shipped(name);
        let joint = motion.rig.joint(joint).unwrap();
        let world = if name == "panda_arc" { motion.loaded.world_from_file() } else { DQuat::IDENTITY };
        for outcome in &outcomes {
            let mut misses = Vec::new();
            for (secs, target) in keys {
                let frame = (secs * 30.0_f64).round() as usize;
                let found = world_matrices(&outcome.clip.poses()[frame])[joint.index()].w_axis.truncate();
                let miss = found.distance(world * DVec3::from(*target));
                // Limited motions come later where their time is free.
                misses.extend((miss > 1e-3).then_some((outcome.clip.times()[frame], miss)));
            }
            match (&outcome.row.unmet, misses.first()) {
                (None, None) => {}
                (Some(unmet), Some((secs, miss))) => {
                    assert_eq!((unmet.kind, unmet.unit, outcome.row.met), ("position", "m", false));
                    near(unmet.at_secs, *secs, 1e-9, name);
                    near(unmet.residual, *miss, 1e-6, name);
                }
                (unmet, misses) => panic!("{name}, {}: {unmet:?}, but {misses:?}", outcome.row.way),
            }
        }
        // Every key of the straight way is met; and between keys it goes straight.
        let straight = &of(&outcomes, Way::Straight);
        assert!(straight.row.met, "{:?}", straight.row.unmet);
        let poses = straight.clip.poses();
        for half in [15, 45] {
            let middle = poses[half - 15].interpolate(&poses[half + 15], 0.5).unwrap();
            assert!(middle.difference(&poses[half]).unwrap().iter().all(|d| d.abs() < 1e-9));
        }
        assert_eq!(poses[0].coords(), motion.start.coords());
    }
}

#[test]
fn limited_motions_keep_their_limit() {
    for name in ["reach_palm_down", "panda_arc"] {
        let (outcomes, motion) = shipped(name);
        let plan = &of(&outcomes, Way::Plan).row;
        for way in [Way::SpeedLimited, Way::TimeFree] {
            let limited = of(&outcomes, way);
            let row = &limited.row;
            near(row.speed_limit_deg.unwrap(), 0.7 * plan.peak_speed_deg, 1e-9, name);
            assert!(row.part_of_limit.unwrap() <= 1.0 + 1e-9, "{name}: {row:?}");
            near(row.part_of_limit.unwrap(), row.peak_speed_deg / row.speed_limit_deg.unwrap(), 1e-9, name);
            // Looked at densely, by differences over a part of a frame.
            let secs = |i: usize| row.duration_secs * i as f64 / 2000.0;
            for i in 0..2000 {
                let pose = limited.clip.sample_cubic(secs(i));
                let after = limited.clip.sample_cubic(secs(i + 1));
                for joint in &motion.active {
                    let speed = step(&pose, &after, *joint).length() / (secs(i + 1) - secs(i));
                    assert!(
                        speed.to_degrees() <= row.speed_limit_deg.unwrap() * (1.0 + 1e-6),
                        "{name}: {speed}"
                    );
                }
            }
        }
        near(of(&outcomes, Way::SpeedLimited).row.duration_secs, plan.duration_secs, 1e-12, name);
        assert!(of(&outcomes, Way::TimeFree).row.duration_secs > plan.duration_secs);
        for way in [Way::Straight, Way::Paper, Way::PaperByLm, Way::Plan] {
            assert_eq!(of(&outcomes, way).row.part_of_limit, None);
        }
    }
}

/// The limited arm misses its first key because it is too far: with the start and a second at that speed, many starts
/// find no pose that meets it. With the speed of the unlimited plan, the first does.
#[test]
fn a_key_that_is_missed_is_too_far_for_its_limit() {
    let (outcomes, motion) = shipped("panda_arc");
    let (plan, limited) = (&of(&outcomes, Way::Plan).row, &of(&outcomes, Way::SpeedLimited).row);
    assert_eq!(limited.unmet.as_ref().map(|unmet| (unmet.objective, unmet.at_secs)), Some((1, 1.0)));
    let reaches = |turn: f64, max_restarts: usize| {
        let mut builder = motion.rig.to_builder();
        for joint in &motion.active {
            let value = motion.start.value(*joint).unwrap();
            let JointMotion::Hinge { axis, .. } = motion.rig.get(*joint).unwrap().motion else { panic!() };
            let range = Range { min: value - turn, max: value + turn };
            builder.set_motion(*joint, JointMotion::Hinge { axis, range }).unwrap();
        }
        let rig = builder.build().unwrap();
        let (tip, world) = (rig.joint("panda_link8").unwrap(), motion.loaded.world_from_file());
        let mut problem = Problem::new(&rig, motion.active.iter().copied()).unwrap();
        problem.add(10.0, Position::new(tip, world * DVec3::new(0.45, 0.30, 0.40)));
        let down = problem.add(1.0, Direction::new(tip, DVec3::Z, world * DVec3::NEG_Z));
        problem.term_mut(down).tolerance = Tolerance { radians: 2_f64.to_radians(), ..Tolerance::default() };
        let search = Search::Global { max_restarts };
        let solver = Solver::new(SolverOptions { search, ..SolverOptions::default() });
        let mut pose = Pose::from_coords(&rig, motion.start.coords()).unwrap();
        solver.solve(&problem, &mut pose, &mut solver.workspace(&problem)).success
    };
    assert!(reaches(plan.peak_speed_deg.to_radians(), 0));
    assert!(!reaches(limited.speed_limit_deg.unwrap().to_radians(), 5000));
}

#[test]
fn motions_are_the_same_every_time_and_tables_show_them() {
    let source = MotionSource::find(Path::new("panda_arc")).unwrap();
    let mut n_done = 0;
    let twice = run(&source, &Settings { runs: 2 }, || n_done += 1).unwrap();
    assert_eq!(n_done, 2 * Way::ALL.len());
    let again = run(&source, &ONCE, || {}).unwrap();
    for (a, b) in twice.iter().zip(&again) {
        assert_eq!(a.clip, again_on(&b.clip, &a.clip), "{}", a.row.way);
    }
    let report = Report::new(twice.iter().map(|outcome| &outcome.row));
    let (terminal, markdown) = (report.for_terminal(), report.markdown());
    for unit in ["°/s²", "°/s³", "rad²/s⁵", "ms"] {
        assert!(terminal.contains(unit) && markdown.contains(unit), "{terminal}{markdown}");
    }
    assert!(markdown.contains("### panda_arc, path of panda_joint8"), "{markdown}");
    assert_eq!(markdown.lines().filter(|l| l.starts_with("| plan")).count(), 3, "{markdown}");
    assert!(terminal.contains("plan, time free") && terminal.contains("off by"), "{terminal}");
}

/// A clip on the rig of another: runs read their rigs anew.
fn again_on(clip: &ikiru_rig::Clip, other: &ikiru_rig::Clip) -> ikiru_rig::Clip {
    let poses = clip.poses().iter().map(|p| Pose::from_coords(other.rig(), p.coords()).unwrap()).collect();
    ikiru_rig::Clip::new(clip.name(), clip.times().to_vec(), poses).unwrap()
}

#[test]
fn moving_targets_and_keys_in_spans_are_seen() {
    // A target that moves, and one that holds for a while: only the key in the middle is a key.
    let text = "version = 1\nrig = \"builtin:panda\"\n[[objective]]\nkind = \"position\"\njoint = \"panda_link8\"\n\
        path = [[0.5, 0.5, 0.5, 0.1], [1.5, 0.4, 0.5, 0.3]]\n[[objective]]\nkind = \"position\"\n\
        joint = \"panda_link8\"\npoint = [0, 0, 0.01]\ntarget = [0.45, 0.5, 0.2]\nmandatory = false\nweight = 0.001\n\
        at = 1.0\n[motion]\nduration_secs = 2\nrate = 20\n";
    let source =
        MotionSource { name: "path".into(), text: text.into(), file: "path.toml".into(), folder: "".into() };
    let outcomes = run(&source, &ONCE, || {}).unwrap();
    // Standing still, then straight to the key: at 0.5 s it is far from where the target begins.
    let unmet = of(&outcomes, Way::Straight).row.unmet.clone().unwrap();
    assert_eq!((unmet.objective, unmet.at_secs), (1, 0.5));
    let plan = of(&outcomes, Way::Plan);
    assert!(plan.row.met, "{:?}", plan.row.unmet);
    let tip = plan.clip.rig().joint("panda_link8").unwrap();
    let place =
        |o: &Outcome, frame: usize| world_matrices(&o.clip.poses()[frame])[tip.index()].w_axis.truncate();
    // Half of the way at half of the time; there the straight way has its key.
    let middle = DVec3::new(0.45, 0.5, 0.2);
    assert!(
        place(plan, 20).distance(middle) < 1e-3
            && place(of(&outcomes, Way::Straight), 20).distance(middle) < 2e-3
    );
}

#[test]
fn what_is_no_motion_says_why() {
    let wrong = |text: &str| {
        let source =
            MotionSource { name: "m".into(), text: text.into(), file: "m.toml".into(), folder: "".into() };
        run(&source, &ONCE, || {}).unwrap_err().to_string()
    };
    let reach = "version = 1\nrig = \"builtin:panda\"\n[[objective]]\nkind = \"position\"\njoint = \"panda_link8\"\n\
        target = [0.4, 0.5, 0.1]\n";
    let still = wrong(reach);
    assert!(still.contains("m.toml") && still.contains("no [motion]"), "{still}");
    let misspelt = wrong(&reach.replace("panda_link8", "panda_link9"));
    assert!(misspelt.contains("m.toml:5:9"), "{misspelt}");
    let other = wrong(&format!("method = \"ccd\"\n{reach}[motion]\nduration_secs = 1\n"));
    assert!(other.contains("plan motions by lm or adam"), "{other}");
    let settled = wrong(&format!("{reach}at = 0\n[motion]\nduration_secs = 1\n"));
    assert!(settled.contains("m.toml: ") && settled.contains("objective 1 (position)"), "{settled}");
}
