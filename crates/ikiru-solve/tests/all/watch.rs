//! Solves and plans that are watched: they say how they get on, and end when they are told to, or when their time is over.
#![allow(clippy::unwrap_used, reason = "a test that cannot go on fails")]

use std::ops::ControlFlow;
use std::sync::atomic::{AtomicBool, AtomicUsize, Ordering};
use std::sync::{Arc, Mutex};
use std::time::Duration;

use glam::DVec3;
use ikiru_rig::{Clip, JointId, Pose, Rate, RateLimit, RatePart, Rig};
use ikiru_solve::objectives::Position;
use ikiru_solve::{
    AdamOptions, Method, MotionProblem, MotionWorkspace, Objective, Part, Problem, Progress, Reads, Rows,
    Search, Settle, Solver, SolverOptions, StopReason, Timeline, Unfit, Unit, View, Watch, When, Workspace,
};
use ikiru_testkit::rigs::random_rig;

fn tip(rig: &Rig) -> JointId {
    JointId::from_index(rig.n_joints() - 1)
}

/// A rest pose inside its limits.
fn rest(rig: &Rig) -> Pose {
    let mut pose = rig.rest_pose();
    pose.project();
    pose
}

/// Ends a solve before its iteration number `most`, and keeps what it heard.
fn until(most: usize) -> (Watch, Arc<Mutex<Vec<Progress>>>) {
    let heard = Arc::new(Mutex::new(Vec::new()));
    let kept = Arc::clone(&heard);
    let watch = Watch::new().on_progress(move |progress| {
        kept.lock().expect("no thread panics").push(progress);
        if progress.iterations < most { ControlFlow::Continue(()) } else { ControlFlow::Break(()) }
    });
    (watch, heard)
}

/// Limits on the speed and acceleration of every joint that turns, tight enough to bind.
fn limits(rig: &Rig) -> Vec<RateLimit> {
    let part = RatePart::Rotation;
    let turning = rig.ids().filter(|joint| part.is_of(rig, *joint));
    let both = |joint| {
        [(Rate::Speed, 0.4), (Rate::Acceleration, 2.0)].map(|(rate, most)| RateLimit {
            joint,
            part,
            rate,
            most,
        })
    };
    turning.flat_map(both).collect()
}

#[test]
fn a_solve_ends_before_the_iteration_at_which_it_is_told_to() {
    let rig = random_rig(12, 3);
    let mut problem = Problem::whole_body(&rig);
    problem.add(1.0, Position::new(tip(&rig), DVec3::splat(9.0)));
    for method in [Method::Lm, Method::Adam(AdamOptions::DEFAULT), Method::Ccd, Method::Fabrik] {
        for search in [Search::Local, Search::Global { max_restarts: 6 }] {
            let solver = Solver::new(SolverOptions { method, search, ..SolverOptions::default() });
            let mut workspace = solver.workspace(&problem);
            let free = solver.solve(&problem, &mut rest(&rig), &mut workspace).iterations;
            for most in [0, 1, free / 2] {
                let (watch, heard) = until(most);
                workspace.watch(watch);
                let mut pose = rest(&rig);
                let report = solver.solve(&problem, &mut pose, &mut workspace);
                let name = method.name();
                // What is met is met, whoever ended it.
                let stop = if report.success { StopReason::Reached } else { StopReason::Cancelled };
                assert_eq!((report.stop, report.iterations), (stop, most), "{name}");
                assert!(report.cost.is_finite() && pose.limit_violation() < 1e-9);
                let heard = heard.lock().unwrap();
                // It is asked before every iteration, and nobody asks once the bar is met.
                let asked = most + usize::from(stop == StopReason::Cancelled);
                assert!(heard.len() == asked || (report.success && heard.len() == most + 1), "{name}");
                assert!(heard.iter().enumerate().all(|(n, heard)| heard.iterations == n));
                assert!(heard.iter().all(|heard| heard.cost.is_finite() && heard.cost >= report.cost));
            }
            workspace.watch(Watch::new());
            assert_eq!(solver.solve(&problem, &mut rest(&rig), &mut workspace).iterations, free);
        }
    }
}

#[test]
fn a_flag_ends_a_plan_at_most_one_iteration_later_also_inside_limits_on_rates() {
    let rig = random_rig(10, 4);
    let timeline = Timeline::seconds(1.0, 10.0).unwrap();
    for (method, rates, free_duration) in [
        (Method::Lm, false, false),
        (Method::Adam(AdamOptions::DEFAULT), false, false),
        (Method::Lm, true, false),
        (Method::Lm, true, true),
    ] {
        let mut motion = MotionProblem::whole_body(&rig, timeline);
        motion.add(1.0, When::End, Position::new(tip(&rig), DVec3::new(0.3, -0.4, 0.2))).unwrap();
        motion.fix_start(&rest(&rig)).unwrap();
        motion.set_rate_limits(&if rates { limits(&rig) } else { Vec::new() }).unwrap();
        motion.set_free_duration(free_duration);
        let search = Search::Global { max_restarts: 3 };
        let solver = Solver::new(SolverOptions { method, search, ..SolverOptions::default() });
        let guess = Clip::still(rest(&rig));
        let mut workspace = MotionWorkspace::default();
        let free = solver.plan(&motion, &guess, &mut workspace).report.iterations;
        for most in [0, free / 3, free - 2] {
            let (flag, n) = (Arc::new(AtomicBool::new(false)), Arc::new(AtomicUsize::new(0)));
            let (set, count) = (Arc::clone(&flag), Arc::clone(&n));
            let watch = Watch::new().cancelled_by(flag).on_progress(move |progress| {
                count.store(progress.iterations, Ordering::Relaxed);
                // Set in the middle of an iteration, as far as the plan knows.
                set.store(progress.iterations >= most, Ordering::Relaxed);
                ControlFlow::Continue(())
            });
            workspace.watch(watch);
            let planned = solver.plan(&motion, &guess, &mut workspace);
            let report = &planned.report;
            let case = format!("{}, {rates}, {free_duration}, {most} of {free}", method.name());
            let stop = if report.success { StopReason::Reached } else { StopReason::Cancelled };
            assert_eq!(report.stop, stop, "{case}");
            assert!(report.iterations <= most + 1, "{case}: {}", report.iterations);
            assert_eq!(n.load(Ordering::Relaxed), most, "{case}");
            assert!(planned.clip.poses().iter().all(|pose| pose.limit_violation() < 1e-9), "{case}");
            // What was to be kept is kept, or told.
            let exceeded = planned.clip.exceeded(motion.rate_limits()).unwrap();
            assert_eq!(exceeded.is_empty(), report.exceeded.is_empty(), "{case}");
        }
    }
}

#[test]
fn who_cancels_hears_what_is_in_the_way_and_not_what_else_acts() {
    let (mut n_told, mut n_others) = ([0; 2], [0; 2]);
    for seed in 0..24 {
        let rig = random_rig(10, seed);
        let far = Position::new(tip(&rig), DVec3::splat(9.0));
        let mut problem = Problem::whole_body(&rig);
        problem.add(1.0, far);
        let mut motion = MotionProblem::whole_body(&rig, Timeline::seconds(1.0, 10.0).unwrap());
        motion.add(1.0, When::End, far).unwrap();
        motion.fix_start(&rest(&rig)).unwrap();
        let told = |most: usize, watch: &Watch| {
            let options = SolverOptions {
                max_iterations: most,
                search: Search::Local,
                settle: Settle::Fully,
                ..SolverOptions::default()
            };
            let (solver, mut of_poses, mut of_motions) =
                (Solver::new(options), Workspace::default(), MotionWorkspace::default());
            of_poses.watch(watch.clone());
            of_motions.watch(watch.clone());
            let solved = solver.solve(&problem, &mut rest(&rig), &mut of_poses).into_owned();
            let planned = solver.plan(&motion, &Clip::still(rest(&rig)), &mut of_motions).into_owned();
            [solved, planned.report]
        };
        let most = 1;
        let whole = told(most, &Watch::new());
        for (idx, (cut, whole)) in told(100, &until(most).0).iter().zip(&whole).enumerate() {
            if whole.stop == StopReason::Converged {
                continue;
            }
            // The same pose or motion, told with and without.
            assert_eq!((cut.stop, whole.stop), (StopReason::Cancelled, StopReason::IterationLimit));
            assert_eq!((cut.iterations, cut.cost), (most, whole.cost));
            let (in_the_way, others): (Vec<_>, Vec<_>) =
                whole.forces.iter().copied().partition(|force| force.on.is_some());
            assert_eq!(cut.forces[..], in_the_way[..]);
            n_told[idx] += in_the_way.len();
            n_others[idx] += others.len();
        }
    }
    assert!(n_told.iter().chain(&n_others).all(|n| *n > 0), "{n_told:?}, {n_others:?}");
}

/// A point that takes its time to be laid out, and none to be evaluated.
#[derive(Clone, Debug)]
struct Slow(JointId);

const LAYING_OUT: Duration = Duration::from_millis(30);

impl Objective for Slow {
    fn kind(&self) -> &'static str {
        "slow"
    }
    fn reads(&self, reads: &mut Reads<'_>) -> Result<(), Unfit> {
        std::thread::sleep(LAYING_OUT);
        reads.frame(self.0)?;
        reads.part(Part::new(1, Unit::Metres))
    }
    fn check(&self) -> Result<(), Unfit> {
        Ok(())
    }
    fn evaluate(&self, view: &View<'_>, rows: &mut Rows<'_>) {
        let first = rows.open(0, [view.frame(0).origin.value().x - 9.0]);
        if rows.wants_jacobian() {
            rows.by_frame(first, 0)[0] = 1.0;
        }
    }
}

#[test]
fn laying_out_is_part_of_a_time_budget_and_the_answer_is_explained_after_it() {
    let rig = random_rig(6, 3);
    let mut problem = Problem::whole_body(&rig);
    problem.add(1.0, Slow(tip(&rig)));
    let mut motion = MotionProblem::whole_body(&rig, Timeline::seconds(1.0, 5.0).unwrap());
    motion.add(1.0, When::End, Slow(tip(&rig))).unwrap();
    for (max_time, is_late) in [(Some(LAYING_OUT / 2), true), (None, false)] {
        let solver = Solver::new(SolverOptions { max_time, ..SolverOptions::default() });
        let mut workspace = Workspace::default();
        let solved = solver.solve(&problem, &mut rest(&rig), &mut workspace);
        let mut workspace = MotionWorkspace::default();
        let planned = solver.plan(&motion, &Clip::still(rest(&rig)), &mut workspace);
        for report in [&solved, &planned.report] {
            assert_eq!(report.stop == StopReason::TimeBudget, is_late, "{report:?}");
            assert_eq!(report.iterations == 0, is_late);
            assert!(!is_late || report.forces.iter().any(|force| force.on == Some(0)), "{report:?}");
        }
    }
}

#[test]
#[ignore = "a measurement"]
#[allow(clippy::print_stderr, reason = "a measurement prints what it finds")]
fn how_late_a_plan_inside_many_limits_on_rates_is() {
    use ikiru_rig::{Joint, JointMotion, RigBuilder};
    use std::time::Instant;

    let mut builder = RigBuilder::new();
    let mut last = None;
    for i in 0..60 {
        let (motion, rest_translation) = (JointMotion::Ball { cone: None }, DVec3::new(0.0, 0.05, 0.0));
        last = Some(builder.add(Joint { motion, rest_translation, ..Joint::new(format!("j{i}"), last) }));
    }
    let last = last.unwrap();
    let rig = builder.build().unwrap();
    let mut motion = MotionProblem::whole_body(&rig, Timeline::seconds(2.0, 30.0).unwrap());
    motion.add(1.0, When::At(1.0), Position::new(last, DVec3::new(1.0, 0.5, 0.3))).unwrap();
    motion.add(1.0, When::End, Position::new(last, DVec3::new(-1.0, 0.5, 0.3))).unwrap();
    motion.fix_start(&rig.rest_pose()).unwrap();
    motion.set_rate_limits(&limits(&rig)).unwrap();
    let mut workspace = MotionWorkspace::default();
    for budget in [None, Some(20), Some(20), Some(50), Some(100)] {
        let max_time = budget.map(Duration::from_millis);
        let solver = Solver::new(SolverOptions { max_time, ..SolverOptions::default() });
        let begin = Instant::now();
        let planned = solver.plan(&motion, &Clip::still(rig.rest_pose()), &mut workspace);
        let (stop, n) = (planned.report.stop, planned.report.iterations);
        let took = begin.elapsed();
        eprintln!(
            "{budget:?} ms: {took:?}, {stop:?}, {n} iterations, {} exceeded",
            planned.report.exceeded.len()
        );
    }
}
