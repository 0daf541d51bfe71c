//! Problems are values: copies, terms taken out and switched off, other rigs, the problem of one sample.
#![allow(clippy::unwrap_used, reason = "a test that cannot go on fails")]

use glam::DVec3;
use ikiru_rig::{
    Clip, ClipError, Joint, JointId, JointMotion, Pose, Range, Rate, RateLimit, RatePart, Rig,
    ShapeDifference,
};
use ikiru_solve::objectives::{Direction, PoseTarget, Position, RestPose};
use ikiru_solve::{
    Loss, MotionError, MotionProblem, MotionWorkspace, Problem, Solver, SolverOptions, TermReport, Timeline,
    When,
};
use ikiru_testkit::rigs::{Random, random_pose, random_rig};

fn solve(problem: &Problem, start: &Pose) -> (Vec<f64>, Vec<TermReport>) {
    let solver = Solver::new(SolverOptions { max_iterations: 30, ..Default::default() });
    let mut pose = start.clone();
    let mut workspace = solver.workspace(problem);
    let terms = solver.solve(problem, &mut pose, &mut workspace).terms.to_vec();
    (pose.coords().to_vec(), terms)
}

/// A problem of a reach, a wish for a direction in the middle, and a rest pose; and where a solve starts.
struct Case {
    rig: Rig,
    problem: Problem,
    start: Pose,
}

impl Case {
    fn new(number: u64, with_wish: bool) -> Self {
        let rig = random_rig(8, number);
        let mut random = Random::new(number);
        let tip = JointId::from_index(7);
        let mut problem = Problem::whole_body(&rig);
        let reach = random_pose(&rig, &mut random).frame(tip).unwrap().position;
        problem.add(1.0, Position::new(tip, reach));
        let wish = Direction::new(JointId::from_index(5), random.vector(1.0), random.vector(1.0));
        if with_wish {
            problem.add(0.3, wish);
        }
        let joints: Vec<JointId> = problem.active().collect();
        problem.add(0.01, RestPose::new(&joints, rig.rest_pose()));
        let start = random_pose(&rig, &mut random);
        Self { rig, problem, start }
    }
}

#[test]
fn a_term_that_is_off_or_removed_is_as_good_as_not_there() {
    for number in 0..20 {
        let without = Case::new(number, false);
        let (expected, _) = solve(&without.problem, &without.start);
        let Case { mut problem, start, .. } = Case::new(number, true);
        let (with, all) = solve(&problem, &start);
        assert_ne!(with, expected, "case {number}: the wish must matter");
        problem.terms_mut()[1].is_on = false;
        let (coords, terms) = solve(&problem, &start);
        assert_eq!(coords, expected, "case {number}");
        assert!(terms[1].cost == 0.0 && !terms[1].mandatory, "{:?}", terms[1]);
        // Its residual is that of the pose all the same.
        let wish = problem.terms()[1].objective();
        assert_eq!(wish.kind(), "direction");
        let mut alone = Case::new(number, true).problem;
        alone.terms_mut()[0].is_on = false;
        alone.terms_mut()[2].is_on = false;
        let solver = Solver::new(SolverOptions { cost_below: Some(1e9), ..Default::default() });
        let mut pose = Pose::from_coords(alone.rig(), &coords).unwrap();
        let mut workspace = solver.workspace(&alone);
        let there = solver.solve(&alone, &mut pose, &mut workspace).terms[1];
        assert!((there.residual - terms[1].residual).abs() < 1e-12 && there.satisfied == terms[1].satisfied);
        problem.terms_mut()[1].is_on = true;
        assert_eq!(solve(&problem, &start), (with, all), "case {number}: on again");
    }
}

#[test]
fn ids_outlive_the_terms_beside_them() {
    let Case { rig, mut problem, start } = Case::new(3, true);
    let tip = JointId::from_index(7);
    let first = problem.add(0.2, Position::new(tip, DVec3::X));
    let second = problem.add(0.4, Position::new(tip, DVec3::Y));
    let mut copy = problem.clone();
    assert_eq!(problem.remove(first), Some(Position::new(tip, DVec3::X)));
    assert_eq!((problem.position(first), problem.remove(first)), (None, None));
    assert!(problem.get(first).is_none());
    assert_eq!((problem.position(second), problem[second].target), (Some(3), DVec3::Y));
    assert_eq!(problem.term(second).weight, 0.4);
    // A term that comes later never takes the id of one that went.
    let third = problem.add(0.6, Position::new(tip, DVec3::Z));
    assert!(problem.get(first).is_none() && problem[third].target == DVec3::Z);
    // The copy has terms of its own.
    copy[second].target = DVec3::NEG_Y;
    copy.term_mut(second).loss = Loss::Norm;
    assert_eq!((problem[second].target, problem.term(second).loss), (DVec3::Y, Loss::Squared));
    assert_eq!((copy.position(first), copy.terms().len()), (Some(3), 5));
    let again = copy.clone();
    assert_eq!(solve(&copy, &start), solve(&again, &start));
    assert_eq!(again.rig().n_joints(), rig.n_joints());
}

#[test]
fn a_problem_moves_to_a_rig_of_the_same_shape() {
    let Case { rig, problem, start } = Case::new(5, true);
    let mut builder = rig.to_builder();
    let joints = builder.joints_mut();
    let hinge = joints.iter().position(|j| matches!(j.motion, JointMotion::Hinge { .. })).unwrap();
    if let JointMotion::Hinge { range, .. } = &mut joints[hinge].motion {
        *range = Range { min: 0.2, max: 0.3 };
    }
    let narrow = builder.build().unwrap();
    let moved = problem.with_rig(&narrow).unwrap();
    assert_eq!((moved.terms().len(), moved.rig().is_same(&narrow)), (3, true));
    let mut pose = Pose::from_coords(&narrow, start.coords()).unwrap();
    let solver = Solver::default();
    let mut workspace = solver.workspace(&moved);
    let report = solver.solve(&moved, &mut pose, &mut workspace);
    assert!(report.invalid.is_none());
    let angle = pose.coords()[narrow.coords_of(JointId::from_index(hinge)).start];
    assert!((0.2 - 1e-9..=0.3 + 1e-9).contains(&angle), "{angle}");
    let other = random_rig(9, 5);
    assert!(problem.with_rig(&other).is_err());
}

#[test]
fn a_motion_gives_the_problem_of_each_sample() {
    let rig = random_rig(8, 11);
    let tip = JointId::from_index(7);
    let timeline = Timeline::seconds(1.0, 4.0).unwrap();
    let mut motion = MotionProblem::whole_body(&rig, timeline);
    let still = motion.add(0.5, When::Span { from: 0.5, to: 1.0 }, Position::new(tip, DVec3::X)).unwrap();
    let going = motion
        .add_moving(2.0, When::Span { from: 0.25, to: 0.75 }, |secs| Position::new(tip, DVec3::Y * secs))
        .unwrap();
    motion.term_mut(going).loss = Loss::Norm;
    let expected: [(usize, Option<f64>); 6] =
        [(0, None), (1, Some(0.25)), (2, Some(0.5)), (2, Some(0.75)), (1, None), (0, None)];
    for (sample, (n_terms, height)) in expected.into_iter().enumerate() {
        let problem = motion.at(sample);
        assert_eq!(problem.terms().len(), n_terms, "sample {sample}");
        assert_eq!(problem.get(going).map(|p| p.target.y), height);
        assert_eq!(problem.get(still).is_some(), (2..=4).contains(&sample));
        if height.is_some() {
            assert_eq!((problem.term(going).weight, problem.term(going).loss), (2.0, Loss::Norm));
        }
    }
    // What is taken out of a motion leaves the others where they are.
    assert!(motion.remove(still).is_some() && motion.remove(still).is_none());
    assert_eq!(motion.at(2)[going].target, DVec3::Y * 0.5);
}

#[test]
fn a_term_of_a_motion_that_is_off_costs_nothing_and_is_still_reported() {
    let rig = random_rig(6, 2);
    let mut random = Random::new(4);
    let tip = JointId::from_index(5);
    let target = random_pose(&rig, &mut random).frame(tip).unwrap().position;
    let plan = |add: bool, is_on: bool| {
        let mut motion = MotionProblem::whole_body(&rig, Timeline::seconds(1.0, 5.0).unwrap());
        motion.fix_start(&rig.rest_pose()).unwrap();
        motion.add(1.0, When::End, Position::new(tip, target)).unwrap();
        if add {
            let away = PoseTarget::new(tip, DVec3::ONE * 5.0, glam::DQuat::IDENTITY);
            let id = motion.add(1.0, When::Throughout, away).unwrap();
            motion.term_mut(id).is_on = is_on;
        }
        let guess = Clip::still(rig.rest_pose());
        Solver::default().plan(&motion, &guess, &mut MotionWorkspace::default()).into_owned()
    };
    let (without, off, on) = (plan(false, false), plan(true, false), plan(true, true));
    let coords = |plan: &ikiru_solve::PlannedMotion| -> Vec<f64> {
        plan.clip.poses().iter().flat_map(|pose| pose.coords().to_vec()).collect()
    };
    assert_eq!(coords(&without), coords(&off));
    assert_ne!(coords(&off), coords(&on));
    let report = &off.report.terms[1];
    assert!(report.cost == 0.0 && !report.mandatory && !report.satisfied, "{report:?}");
    assert!(report.residual > 1.0 && off.report.success, "{report:?}");
}

/// A rig with one hinge, and the same with another range, another axis and another bone.
fn rig_and_others() -> (Rig, usize, [Rig; 3]) {
    let rig = random_rig(8, 5);
    let is_hinge = |j: &Joint| matches!(j.motion, JointMotion::Hinge { .. });
    let hinge = rig.joints().iter().position(is_hinge).unwrap();
    let changed = |change: &dyn Fn(&mut Joint)| {
        let mut builder = rig.to_builder();
        change(&mut builder.joints_mut()[hinge]);
        builder.build().unwrap()
    };
    let JointMotion::Hinge { axis, .. } = rig.joints()[hinge].motion else { unreachable!() };
    let narrow = Range { min: 0.2, max: 0.3 };
    let others = [
        changed(&|joint| joint.motion = JointMotion::Hinge { axis, range: narrow }),
        changed(&|joint| joint.motion = JointMotion::Hinge { axis: -axis, range: narrow }),
        changed(&|joint| joint.rest_translation += DVec3::X),
    ];
    (rig, hinge, others)
}

#[test]
fn a_motion_moves_to_a_rig_of_the_same_shape() {
    let (rig, hinge, [narrow, turned, longer]) = rig_and_others();
    let (tip, hinge) = (JointId::from_index(7), JointId::from_index(hinge));
    let mut motion = MotionProblem::whole_body(&rig, Timeline::points(3).unwrap());
    let reach = motion.add(1.0, When::End, Position::new(tip, DVec3::X)).unwrap();
    motion.add_hard(When::Throughout, Position::new(JointId::from_index(0), DVec3::ZERO)).unwrap();
    let limit = RateLimit { joint: hinge, part: RatePart::Rotation, rate: Rate::Speed, most: 1e3 };
    motion.set_rate_limits(&[limit]).unwrap();
    motion.set_joint_smoothness(hinge, [0.5; 3]).unwrap();
    // Nothing is given: another axis is another way to move, and that is all.
    assert!(motion.with_rig(&turned).unwrap().rig().is_same(&turned));
    let shape = motion.with_rig(&longer).map(drop).unwrap_err();
    let name = &rig.joints()[hinge.index()].name;
    assert_eq!(shape, MotionError::Shape(ShapeDifference::Rest(name.clone())));
    let mut stiff = rig.to_builder();
    stiff.joints_mut()[hinge.index()].motion = JointMotion::Fixed;
    let stiff = motion.with_rig(&stiff.build().unwrap()).map(drop).unwrap_err();
    assert!(matches!(stiff, MotionError::RateLimit(ClipError::RateLimitPart { .. })), "{stiff}");

    let mut start = rig.rest_pose();
    start.set_value(hinge, 0.25).unwrap();
    motion.fix_start(&start).unwrap();
    let moved = motion.with_rig(&narrow).unwrap();
    assert_eq!(
        (moved.terms().terms().len(), moved.term(reach).weight, moved[reach].target),
        (2, 1.0, DVec3::X)
    );
    assert_eq!((moved.rate_limits(), *moved.timeline()), (&[limit][..], *motion.timeline()));
    let guess = Clip::still(narrow.rest_pose());
    let plan = Solver::default().plan(&moved, &guess, &mut MotionWorkspace::default()).into_owned();
    assert!(plan.report.invalid.is_none(), "{:?}", plan.report.invalid);
    let poses = plan.clip.poses();
    assert_eq!(poses[0].coords(), start.coords());
    for pose in poses {
        let angle = pose.value(hinge).unwrap();
        assert!((0.2 - 1e-9..=0.3 + 1e-9).contains(&angle), "{angle}");
    }
    // The numbers of what is given would mean another turn.
    let refused = motion.with_rig(&turned).map(drop);
    assert_eq!(refused, Err(MotionError::GivenMoves { joint: name.clone() }));
}

#[test]
fn a_motion_answers_for_its_ids_as_a_problem_does() {
    let rig = random_rig(8, 5);
    let (tip, still) = (JointId::from_index(7), JointId::from_index(1));
    let active: Vec<JointId> = rig.ids().filter(|joint| *joint != still).collect();
    let problem = Problem::new(&rig, active.clone()).unwrap();
    let mut motion = MotionProblem::new(&rig, active, Timeline::points(3).unwrap()).unwrap();
    assert!(motion.active().eq(problem.active()) && !motion.is_active(still) && motion.is_active(tip));
    let first = motion.add(0.5, When::End, Position::new(tip, DVec3::X)).unwrap();
    let second = motion.add(0.7, When::End, Position::new(tip, DVec3::Y)).unwrap();
    assert_eq!((motion.position(second), motion.term(second).weight), (Some(1), 0.7));
    assert_eq!(motion.reads(motion.term(first)).unwrap().frames, [tip]);
    motion.get_mut(second).unwrap().target = DVec3::Z;
    assert_eq!(motion.get(second).map(|p| p.target), Some(DVec3::Z));
    motion.remove(first).unwrap();
    assert!(motion.get(first).is_none() && motion.get_mut(first).is_none());
    assert_eq!((motion.position(first), motion.position(second)), (None, Some(0)));
}
