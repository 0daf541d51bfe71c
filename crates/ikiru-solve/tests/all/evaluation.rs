//! What users are told of a pose and of a trajectory: cost and rows again by central differences, and against solves.
#![allow(clippy::unwrap_used, reason = "a test that cannot go on fails")]

use glam::DVec3;
use ikiru_rig::{Clip, JointId, Pose};
use ikiru_solve::objectives::{Bound, Distance, PoseTarget, Position, RestPose};
use ikiru_solve::{
    EvaluatedRow, Evaluation, Invalid, InvalidPose, InvalidTerm, Loss, MotionEvaluation, MotionProblem,
    MotionWorkspace, PlannedMotion, Problem, Solver, Timeline, When,
};
use ikiru_testkit::rigs::{Random, random_pose, random_rig};

const STEP: f64 = 1e-6;

/// A problem with rows of every place: wishes, wishes that want to be at least something, separable ones, and hard ones.
fn problem(case: u64, random: &mut Random) -> Problem {
    let rig = random_rig(4 + random.below(8), case);
    let mut problem = Problem::whole_body(&rig);
    let [a, b] = [rig.n_joints() - 1, rig.n_joints() / 2].map(JointId::from_index);
    let reach = problem.add(0.7, Position::new(a, random.vector(1.0)));
    problem.term_mut(reach).loss = [Loss::Squared, Loss::Norm, Loss::Huber { width: 0.2 }][random.below(3)];
    problem.add(0.4, PoseTarget::new(b, random.vector(0.5), random.rotation()));
    problem.add(0.3, Distance::new([a, b], Bound::AtLeast(2.0)));
    problem.add_hard(Distance::new([a, b], Bound::Exactly(0.3)));
    let joints: Vec<JointId> = problem.active().collect();
    problem.add(0.1, RestPose::new(&joints, random_pose(&rig, random)));
    problem
}

/// Half the gradient that rows alone make: their weight times what they miss.
fn push(row: &EvaluatedRow) -> f64 {
    row.weight.map_or(0.0, |weight| weight * row.sense.missing(row.residual))
}

#[test]
fn derivatives_at_a_pose_are_central_differences() {
    let mut random = Random::new(1);
    let mut evaluation = Evaluation::default();
    for case in 0..40 {
        let problem = problem(case, &mut random);
        let pose = random_pose(problem.rig(), &mut random);
        let mut shifted = |k: usize, step: f64| {
            let mut tangent = vec![0.0; problem.rig().n_dofs()];
            tangent[k] = step;
            let mut pose = pose.clone();
            pose.retract(&tangent).unwrap();
            evaluation.at(&problem, &pose).unwrap();
            (evaluation.cost(), evaluation.rows().to_vec())
        };
        let n = problem.rig().n_dofs();
        let both: Vec<_> = (0..n).map(|k| (shifted(k, STEP), shifted(k, -STEP))).collect();
        evaluation.at(&problem, &pose).unwrap();
        let mut of_rows = vec![0.0; n];
        for (number, row) in evaluation.rows().iter().enumerate() {
            for k in 0..n {
                let ((_, ahead), (_, behind)) = &both[k];
                let numeric = (ahead[number].residual - behind[number].residual) / (2.0 * STEP);
                let exact = evaluation.jacobian(number)[k];
                // Half a turn is a corner of a rotation's distance.
                let is_near = (numeric - exact).abs() < 1e-5 * (1.0 + exact.abs());
                assert!(is_near || row.residual.abs() > 2.5, "case {case}: {numeric} is not {exact}");
                of_rows[k] += 2.0 * push(row) * exact;
            }
        }
        for (k, ((ahead, _), (behind, _))) in both.iter().enumerate() {
            let (numeric, exact) = ((ahead - behind) / (2.0 * STEP), evaluation.gradient()[k]);
            assert!(
                (numeric - exact).abs() < 1e-4 * (1.0 + exact.abs()),
                "case {case}: {numeric} is not {exact}"
            );
            assert!((of_rows[k] - exact).abs() < 1e-9 * (1.0 + exact.abs()), "case {case}: {}", of_rows[k]);
        }
        assert!(evaluation.moving().len() <= n && evaluation.jacobian(evaluation.rows().len()).is_empty());
    }
}

#[test]
fn it_says_what_a_report_says_and_what_a_solve_would_refuse() {
    let mut random = Random::new(2);
    let mut evaluation = Evaluation::default();
    for case in 0..20 {
        let mut problem = problem(case, &mut random);
        let mut pose = random_pose(problem.rig(), &mut random);
        let solver = Solver::default();
        let mut workspace = solver.workspace(&problem);
        let report = solver.solve(&problem, &mut pose, &mut workspace).into_owned();
        evaluation.at(&problem, &pose).unwrap();
        assert!((evaluation.cost() - report.cost).abs() <= 1e-12 * report.cost);
        assert_eq!(evaluation.terms(), &report.terms[..]);
        assert!(evaluation.gradient().len() == problem.rig().n_dofs() && evaluation.violation() >= 0.0);
        // A term that is off has no rows; the others keep theirs.
        let n_rows = evaluation.rows().len();
        problem.terms_mut()[0].is_on = false;
        evaluation.at(&problem, &pose).unwrap();
        assert_eq!(evaluation.rows().len(), n_rows - 3);
        problem.terms_mut()[0].is_on = true;
        let tip = JointId::from_index(0);
        let id = problem.add(1.0, Position::new(tip, DVec3::NAN));
        assert!(matches!(evaluation.at(&problem, &pose), Err(Invalid::Term(5, InvalidTerm::Unfit(_)))));
        problem[id].target = DVec3::ZERO;
        evaluation.at(&problem, &pose).unwrap();
        assert_eq!(evaluation.rows_of(&problem, id).len(), 3);
        problem.remove(id);
        assert!(evaluation.rows_of(&problem, id).is_empty());
    }
    let other = random_rig(3, 99).rest_pose();
    let problem = problem(1, &mut random);
    assert_eq!(evaluation.at(&problem, &other), Err(Invalid::Pose(InvalidPose::OtherRig)));
    // Nothing of the pose before is left.
    assert!(
        evaluation.cost() == f64::INFINITY && evaluation.rows().is_empty() && evaluation.terms().is_empty()
    );
    assert!(evaluation.gradient().is_empty() && evaluation.forces().is_empty());
}

#[test]
fn each_depth_gives_what_the_next_one_gives_and_no_more() {
    let mut random = Random::new(5);
    let [mut values, mut derivatives, mut all] = [(); 3].map(|()| Evaluation::default());
    for case in 0..20 {
        let problem = problem(case, &mut random);
        let pose = random_pose(problem.rig(), &mut random);
        values.values_at(&problem, &pose).unwrap();
        derivatives.derivatives_at(&problem, &pose).unwrap();
        all.at(&problem, &pose).unwrap();
        assert!(!all.rows().is_empty() && !all.terms().is_empty());
        for less in [&values, &derivatives] {
            assert_eq!(less.rows(), all.rows());
            assert_eq!((less.cost(), less.violation()), (all.cost(), all.violation()));
            assert!(less.terms().is_empty() && less.forces().is_empty());
        }
        assert_eq!(derivatives.gradient(), all.gradient());
        for row in 0..all.rows().len() {
            assert_eq!(derivatives.jacobian(row), all.jacobian(row));
        }
        assert!(values.gradient().is_empty() && values.jacobian(0).is_empty());
        // Nothing is left of more that was asked for before.
        derivatives.values_at(&problem, &pose).unwrap();
        assert!(derivatives.gradient().is_empty() && derivatives.jacobian(0).is_empty());
    }
}

#[test]
fn what_nothing_moves_is_told() {
    let rig = random_rig(6, 1);
    let mut problem = Problem::new(&rig, []).unwrap();
    problem.add_hard(Position::new(JointId::from_index(5), DVec3::ONE));
    let mut evaluation = Evaluation::default();
    evaluation.at(&problem, &rig.rest_pose()).unwrap();
    assert!(evaluation.rows().len() == 3 && evaluation.rows().iter().all(|row| row.is_constant));
    let mut problem = Problem::whole_body(&rig);
    problem.add_hard(Position::new(JointId::from_index(5), DVec3::ONE));
    evaluation.at(&problem, &rig.rest_pose()).unwrap();
    assert!(evaluation.rows().iter().all(|row| !row.is_constant));
}

#[test]
fn derivatives_over_a_trajectory_are_central_differences() {
    let mut random = Random::new(3);
    let mut evaluation = MotionEvaluation::default();
    for case in 0..12 {
        let base = problem(case, &mut random);
        let rig = base.rig().clone();
        let timeline = Timeline::seconds(1.0, 4.0).unwrap();
        let when = [When::End, When::At(0.5), When::Throughout, When::Throughout, When::Throughout];
        let mut motion = MotionProblem::from_problem(base, timeline, &when).unwrap();
        motion.set_even_spacing(0.1).unwrap();
        if case % 2 == 0 {
            motion.fix_start(&rig.rest_pose()).unwrap();
        }
        let mut pose = rig.rest_pose();
        let poses: Vec<Pose> = (0..timeline.n_samples())
            .map(|_| {
                let step: Vec<f64> = (0..rig.n_dofs()).map(|_| random.between(-0.3, 0.3)).collect();
                pose.retract(&step).unwrap();
                pose.clone()
            })
            .collect();
        let n = rig.n_dofs();
        let at = |t: usize, k: usize, step: f64, evaluation: &mut MotionEvaluation| {
            let mut poses = poses.clone();
            let mut tangent = vec![0.0; n];
            tangent[k] = step;
            poses[t].retract(&tangent).unwrap();
            evaluation.at(&motion, &Clip::new("", timeline.times(), poses).unwrap()).unwrap();
            (evaluation.cost(), evaluation.rows().to_vec())
        };
        let first = usize::from(case % 2 == 0);
        for t in first..timeline.n_samples() {
            for k in 0..n {
                let (ahead, behind) = (at(t, k, STEP, &mut evaluation), at(t, k, -STEP, &mut evaluation));
                at(t, k, 0.0, &mut evaluation);
                let (numeric, exact) =
                    ((ahead.0 - behind.0) / (2.0 * STEP), evaluation.gradient()[t * n + k]);
                assert!(
                    (numeric - exact).abs() < 1e-4 * (1.0 + exact.abs()),
                    "case {case}: {numeric}, {exact}"
                );
                for number in 0..evaluation.rows().len() {
                    let numeric = (ahead.1[number].residual - behind.1[number].residual) / (2.0 * STEP);
                    let mut exact = 0.0;
                    evaluation.jacobian(number, |sample, dof, entry| {
                        exact += if (sample, dof) == (t, k) { entry } else { 0.0 };
                    });
                    let is_near = (numeric - exact).abs() < 1e-5 * (1.0 + exact.abs());
                    let row = evaluation.rows()[number];
                    assert!(
                        is_near || row.residual.abs() > 2.5,
                        "case {case}, {row:?}: {numeric} is not {exact}"
                    );
                }
            }
        }
        let given: f64 = evaluation.gradient()[..first * n].iter().map(|g| g.abs()).sum();
        assert!(given == 0.0 && evaluation.smoothness().iter().all(|cost| *cost > 0.0));
        assert!(evaluation.spacing() > 0.0 && evaluation.terms().len() == 5);
    }
}

/// A motion of that problem, and how it is planned.
fn planned(case: u64, random: &mut Random) -> (MotionProblem, PlannedMotion<'static>) {
    let base = problem(case, random);
    let rig = base.rig().clone();
    let when = [When::End, When::At(0.5), When::Throughout, When::Throughout, When::Throughout];
    let timeline = Timeline::seconds(1.0, 4.0).unwrap();
    let mut motion = MotionProblem::from_problem(base, timeline, &when).unwrap();
    motion.fix_start(&rig.rest_pose()).unwrap();
    let guess = Clip::still(rig.rest_pose());
    let planned = Solver::default().plan(&motion, &guess, &mut MotionWorkspace::default()).into_owned();
    (motion, planned)
}

#[test]
fn of_a_motion_it_says_what_a_report_says() {
    let mut random = Random::new(4);
    let mut evaluation = MotionEvaluation::default();
    let (mut n_forces, mut n_others, mut n_missed) = (0, 0, 0);
    for case in 0..40 {
        let (motion, planned) = planned(case, &mut random);
        let report = &planned.report;
        assert!(report.invalid.is_none(), "{:?}", report.invalid);
        evaluation.at(&motion, &planned.clip).unwrap();
        assert!((evaluation.cost() - report.cost).abs() <= 1e-9 * report.cost, "case {case}");
        assert_eq!(evaluation.terms(), &report.terms[..]);
        assert_eq!(evaluation.forces().len(), report.forces.len(), "case {case}");
        for (a, b) in evaluation.forces().iter().zip(&*report.forces) {
            assert_eq!((a.on, a.by, a.secs), (b.on, b.by, b.secs), "case {case}");
            assert!(
                (a.share - b.share).abs() < 1e-6 && (a.amount - b.amount).abs() < 1e-6 * (1.0 + b.amount)
            );
            n_others += usize::from(a.on.is_none());
        }
        n_forces += report.forces.len();
        // What hard rows miss, over all samples.
        let hard = evaluation.rows().iter().filter(|row| row.weight.is_none() && !row.is_constant);
        let missed: f64 = hard.map(|row| row.sense.missing(row.residual).abs()).sum();
        assert!((evaluation.violation() - missed).abs() <= 1e-12 * missed, "case {case}");
        n_missed += usize::from(missed > 1e-3);
    }
    assert!(n_forces > 100 && n_others > 5 && n_missed > 3, "{n_forces} {n_others} {n_missed}");
    // Nothing of it is left after what a plan would refuse.
    let (mut motion, planned) = planned(2, &mut random);
    motion.add(1.0, When::End, Position::new(JointId::from_index(0), DVec3::NAN)).unwrap();
    assert!(matches!(evaluation.at(&motion, &planned.clip), Err(Invalid::Term(5, InvalidTerm::Unfit(_)))));
    assert!(evaluation.forces().is_empty() && evaluation.terms().is_empty());
    assert_eq!((evaluation.cost(), evaluation.violation()), (f64::INFINITY, 0.0));
}

#[test]
fn the_rows_of_a_term_are_found_at_all_its_samples_and_what_moves_is_named() {
    let mut random = Random::new(5);
    let mut evaluation = MotionEvaluation::default();
    for case in 0..20 {
        let rig = random_rig(8, case);
        let mut motion = MotionProblem::whole_body(&rig, Timeline::seconds(1.0, 4.0).unwrap());
        motion.fix_start(&rig.rest_pose()).unwrap();
        let [tip, other] = [7, 4].map(JointId::from_index);
        let end = motion.add(1.0, When::End, Position::new(tip, DVec3::ONE)).unwrap();
        let all = motion.add(0.5, When::Throughout, Position::new(other, DVec3::Y)).unwrap();
        let held = motion.add(1.0, When::At(0.0), Position::new(tip, DVec3::X)).unwrap();
        let off = motion.add(1.0, When::End, Position::new(tip, DVec3::X)).unwrap();
        motion.term_mut(off).is_on = false;
        let clip = Clip::still(random_pose(&rig, &mut random));
        evaluation.at(&motion, &clip).unwrap();
        let rows = |id| -> Vec<usize> { evaluation.rows_of(&motion, id).collect() };
        let at = |rows: &[usize]| -> Vec<usize> {
            rows.iter().map(|row| evaluation.rows()[*row].sample).collect()
        };
        assert_eq!(at(&rows(end)), [4; 3]);
        assert_eq!(at(&rows(all)), [1, 1, 1, 2, 2, 2, 3, 3, 3, 4, 4, 4]);
        assert!(rows(held).is_empty() && rows(off).is_empty());
        let mut both = [rows(end), rows(all)].concat();
        both.sort_unstable();
        assert_eq!(both, (0..evaluation.rows().len()).collect::<Vec<_>>());
        let is_of = |row: &usize, term: usize| evaluation.rows()[*row].term == term;
        assert!(rows(end).iter().all(|row| is_of(row, 0)) && rows(all).iter().all(|row| is_of(row, 1)));
        // What moves is what rows have derivatives by, at each sample as at all others.
        let mut by_rows = vec![false; rig.n_dofs()];
        for row in 0..evaluation.rows().len() {
            evaluation.jacobian(row, |_, dof, entry| by_rows[dof] |= entry != 0.0);
        }
        let moves = |dof: usize| evaluation.moving().contains(&dof);
        assert!((0..rig.n_dofs()).all(|dof| moves(dof) || !by_rows[dof]), "case {case}");
        let mut of_pose = Evaluation::default();
        of_pose.at(motion.terms(), &rig.rest_pose()).unwrap();
        assert_eq!(evaluation.moving(), of_pose.moving(), "case {case}");
        motion.remove(end);
        assert_eq!(evaluation.rows_of(&motion, end).count(), 0);
    }
}
