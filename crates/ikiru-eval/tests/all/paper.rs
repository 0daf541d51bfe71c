//! The rows, sets, tables and figures of the paper's evaluation, recomputed by other means.
#![allow(clippy::unwrap_used, reason = "a test that cannot go on fails")]

use glam::{DMat4, DVec3};
use ikiru_eval::paper::{
    Angles, CONTENDERS, Contender, N_TARGETS, Report, Row, Settings, TargetSet, Task, csv, run,
    run_trajectories, sample, write_figures,
};
use ikiru_testkit::reference::world_matrices;

/// The head of a set that ships.
fn head(task: Task, n: usize) -> TargetSet {
    let mut set = TargetSet::of_task(task).unwrap();
    set.points.truncate(n);
    set
}

fn rows(task: Task, set: &TargetSet, contenders: &[Contender], settings: &Settings) -> Vec<Row> {
    let mut scenario = task.scenario(None).unwrap();
    let mut n_done = 0;
    let rows = run(task, &mut scenario, set, contenders, settings, || n_done += 1).unwrap();
    assert_eq!(n_done, set.points.len() * contenders.len() * settings.runs);
    rows
}

/// World matrices of the reference human in the pose of a row: collar, shoulder, elbow, wrist, each x y z.
fn posed(row: &Row) -> impl Fn(&str) -> DMat4 {
    let rig = Task::Simple.scenario(None).unwrap().rig;
    let mut pose = rig.rest_pose();
    let joints = ["left_collar", "left_shoulder", "left_elbow", "left_wrist"];
    assert_eq!(row.angles.last().len(), 12);
    for (name, angles) in joints.iter().zip(row.angles.last().as_chunks::<3>().0) {
        pose.set_euler(rig.joint(name).unwrap(), *angles).unwrap();
    }
    assert_eq!(pose.limit_violation(), 0.0);
    let world = world_matrices(&pose);
    move |name| world[rig.joint(name).unwrap().index()]
}

/// The paper's J of a row's pose (its last one), written out once more from its equations with matrices alone.
fn cost_of_pose(row: &Row, task: Task) -> f64 {
    let of = posed(row);
    let mut cost = of("left_index3_look").w_axis.truncate().distance(DVec3::from(row.target));
    if task == Task::Combined {
        for (joint, length, offset, weight) in [
            ("left_wrist", 0.0915, DVec3::Y, 0.1 / 3.0),
            ("left_index3_look", 0.1, DVec3::Z, 0.1 / 3.0),
            ("left_shoulder", 0.261, DVec3::NEG_Z, 0.0002 / 3.0),
        ] {
            let bone = of(joint).transform_vector3(DVec3::Y) * length;
            cost += weight * bone.angle_between(bone + offset).powi(2);
        }
    }
    cost
}

#[test]
fn costs_of_rows_are_the_papers() {
    let settings = Settings { runs: 2, warmup: 3, ..Settings::default() };
    for task in Task::ALL {
        let set = head(task, 30);
        let rows = rows(task, &set, CONTENDERS, &settings);
        assert_eq!(rows.len(), 2 * 27 * CONTENDERS.len());
        for row in &rows {
            let target = DVec3::from(row.target);
            assert!(set.points[3..].contains(&target) && row.points == 0 && row.objective == task.name());
            let cost = cost_of_pose(row, task);
            assert!((cost - row.cost).abs() < 1e-7, "{}: {cost} is not {}", row.method, row.cost);
            assert_eq!(row.success, row.cost < 0.005);
            assert!(row.time_us > 0.0 && row.iterations <= 500 * 401);
        }
        // Runs repeat themselves, but for the clock.
        let same = |a: &Row, b: &Row| (a.angles == b.angles) && a.iterations == b.iterations;
        let (first, second) = rows.split_at(rows.len() / 2);
        assert!(first.iter().zip(second).all(|(a, b)| same(a, b) && (a.run, b.run) == (0, 1)));
        assert!(rows.iter().filter(|r| r.method == "lm").all(|r| r.success));
    }
}

#[test]
fn costs_of_trajectories_are_those_of_equation_26() {
    let settings = Settings { runs: 1, warmup: 2, ..Settings::default() };
    let planners: Vec<Contender> = CONTENDERS.iter().filter(|c| c.plans()).copied().collect();
    for (task, points) in [(Task::Simple, 5), (Task::Combined, 10)] {
        let mut set = TargetSet::of_points(points).unwrap();
        set.points.truncate(12);
        let mut n_done = 0;
        let rows = run_trajectories(task, points, &set, &planners, &settings, || n_done += 1).unwrap();
        assert_eq!((rows.len(), n_done), (10 * planners.len(), 12 * planners.len()));
        for row in &rows {
            let Angles::Frames(frames) = &row.angles else { panic!("a trajectory has frames") };
            assert_eq!(frames.len(), points + 2);
            assert!(frames[0].iter().all(|a| *a == 0.0), "the first frame is held at the rest pose");
            let mut cost = cost_of_pose(row, task);
            let mut differences = frames.clone();
            for _ in 0..3 {
                differences = differences
                    .windows(2)
                    .map(|w| w[1].iter().zip(&w[0]).map(|(a, b)| a - b).collect())
                    .collect();
                cost += 0.001 * differences.iter().flatten().map(|d| d * d).sum::<f64>();
            }
            assert!((cost - row.cost).abs() < 1e-7, "{}: {cost} is not {}", row.method, row.cost);
            assert_eq!(row.success, row.cost < 0.005);
        }
        assert!(rows.iter().filter(|r| r.method == "lm").all(|r| r.success));
    }
    let ccd = [Contender::from_name("ccd").unwrap()];
    let set = TargetSet::of_points(5).unwrap();
    let refused = run_trajectories(Task::Simple, 5, &set, &ccd, &settings, || {}).unwrap_err().to_string();
    assert!(refused.contains("'ccd' plans no trajectories"), "{refused}");
}

#[test]
fn restarts_are_for_lm_alone() {
    let contender = |name| Contender::from_name(name).unwrap();
    let is_global = |c: &Contender| c.options(400).search != ikiru_solve::Search::Local;
    let global: Vec<&str> = CONTENDERS.iter().filter(|c| is_global(c)).map(|c| c.name).collect();
    assert_eq!(global, ["lm"]);
    assert_eq!(contender("lm").options(0), contender("lm-local").options(400));
    let error = Contender::from_name("sqp").unwrap_err().to_string();
    assert!(error.contains("'sqp'") && error.contains("lm, lm-local, adam, ccd, fabrik"), "{error}");
}

#[test]
fn a_sampled_set_follows_the_protocol() {
    let task = Task::Simple;
    let mut scenario = task.scenario(None).unwrap();
    // Few restarts: points out of reach take all of them.
    let mut make = |n, seed| sample(task, &mut scenario, n, seed, 3, || {});
    let set = make(5000, 3).unwrap();
    assert_eq!(set.points.len(), N_TARGETS);
    let middle = DVec3::new(0.15, 0.0, 0.35);
    assert!(set.points.iter().all(|p| (*p - middle).abs().max_element() <= 0.5));
    let mut distinct: Vec<[u64; 3]> = set.points.iter().map(|p| p.to_array().map(f64::to_bits)).collect();
    distinct.sort_unstable();
    distinct.dedup();
    assert_eq!(distinct.len(), N_TARGETS);
    assert_eq!(make(5000, 3).unwrap(), set, "the same seed gives the same set");
    let error = make(300, 3).unwrap_err().to_string();
    assert!(error.contains("of 300 sampled points only") && error.contains("sample about"), "{error}");
    // Every target can be solved: that is what the filter is for.
    let settings = Settings { runs: 1, warmup: 0, ..Settings::default() };
    let lm = [Contender::from_name("lm").unwrap()];
    assert!(rows(task, &set, &lm, &settings).iter().all(|r| r.success));
    // Spread evenly: thinning leaves no two targets on top of each other as chance would.
    let nearest = |p: &DVec3| {
        set.points.iter().filter(|q| *q != p).map(|q| q.distance(*p)).fold(f64::INFINITY, f64::min)
    };
    let close = set.points.iter().filter(|p| nearest(p) < 0.01).count();
    assert!(close < N_TARGETS / 20, "{close} targets have another within 1 cm");
}

#[test]
fn tables_rows_and_figures_say_what_was_measured() {
    let task = Task::Simple;
    let set = head(task, 25);
    let settings = Settings { runs: 1, warmup: 5, ..Settings::default() };
    let contenders = ["lm", "ccd"].map(|name| Contender::from_name(name).unwrap());
    let rows = rows(task, &set, &contenders, &settings);
    let report = Report::new(task, &rows);
    let successes = rows.iter().filter(|r| r.method == "ccd" && r.success).count();
    let markdown = report.markdown();
    let line = markdown.lines().find(|l| l.starts_with("| ccd")).unwrap();
    let cells: Vec<&str> = line.split('|').map(str::trim).collect();
    let percent = if successes == 20 { "100".to_owned() } else { format!("{:.2}", 5.0 * successes as f64) };
    assert_eq!(cells[6], percent, "{line}");
    // The paper's table 2, row CCD without the custom objective.
    assert_eq!(cells[7..12], ["CCD", "25.4 ± 62.6", "53.6 ± 139", "0.69 ± 0.27", "91.2"]);
    assert!(report.for_terminal().contains("20 targets, 1 runs"));

    let text = String::from_utf8(csv(&rows).unwrap()).unwrap();
    assert_eq!(text.lines().count(), 1 + rows.len());
    let first: Vec<&str> = text.lines().nth(1).unwrap().split(',').collect();
    assert_eq!(first[..3], ["simple_box", "lm", "simple"]);
    assert_eq!(first.len(), 12 + 12);
    assert_eq!(first[9].parse::<f64>().unwrap(), rows[0].cost);

    let folder = tempfile::tempdir().unwrap();
    let mut scenario = task.scenario(None).unwrap();
    let written = write_figures(task, &mut scenario, &set, &contenders, &rows, folder.path()).unwrap();
    assert_eq!(written.len(), 6);
    for path in written {
        let bytes = std::fs::read(&path).unwrap();
        if path.extension().unwrap() == "svg" {
            let text = String::from_utf8(bytes).unwrap();
            assert!(
                text.contains("ccd") && text.contains("simple objective on simple_box"),
                "{}",
                path.display()
            );
        } else {
            assert!(bytes.starts_with(b"\x89PNG") && bytes.len() > 5_000, "{}", path.display());
        }
    }
    let nowhere = folder.path().join("none");
    let error =
        write_figures(task, &mut scenario, &set, &contenders, &rows, &nowhere).unwrap_err().to_string();
    assert!(error.contains("cannot be written"), "{error}");
}

#[test]
fn a_set_that_is_all_warm_up_is_refused() {
    let task = Task::Simple;
    let set = head(task, 10);
    let mut scenario = task.scenario(None).unwrap();
    let refused = run(task, &mut scenario, &set, CONTENDERS, &Settings::default(), || {});
    assert!(refused.unwrap_err().to_string().contains("nothing to measure"));
}

#[test]
fn another_rig_must_have_the_tasks_joints() {
    let rig = |file: &str| format!("{}/../ikiru-formats/{file}", env!("CARGO_MANIFEST_DIR"));
    let same = rig("assets/reference_human.glb");
    let scenario = Task::Combined.scenario(Some(same.as_ref())).unwrap();
    assert_eq!(scenario.active.len(), 4);
    let other = rig("assets/human.vrm");
    let error = Task::Combined.scenario(Some(other.as_ref())).unwrap_err().to_string();
    assert!(error.contains("left_collar"), "{error}");
}
