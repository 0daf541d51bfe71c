//! What a term says of itself in a report: every part, each in its unit, and what weight 0 means.
#![allow(clippy::unwrap_used, reason = "a test that cannot go on fails")]

use glam::{DQuat, DVec3};
use ikiru_rig::{Clip, Joint, JointId, JointMotion, Pose, Range, Rig, RigBuilder};
use ikiru_solve::objectives::{Bound, Coupling, Distance, JointAngles, KnownRotation, Position, RestPose};
use ikiru_solve::{
    Invalid, InvalidTerm, MOST_PARTS, MotionProblem, MotionWorkspace, Objective, Part, Problem, Reads, Rows,
    Search, Solver, SolverOptions, StopReason, Timeline, Unfit, UnfitReason, Unit, View, When,
};

/// One joint that moves, and a tip one metre along x.
fn one_joint(motion: JointMotion) -> (Rig, JointId, JointId) {
    let mut builder = RigBuilder::new();
    let mut joint = Joint::new("joint", None);
    joint.motion = motion;
    let joint = builder.add(joint);
    let mut tip = Joint::new("tip", Some(joint));
    tip.rest_translation = DVec3::X;
    let tip = builder.add(tip);
    (builder.build().unwrap(), joint, tip)
}

fn slider() -> (Rig, JointId, JointId) {
    one_joint(JointMotion::Slider { axis: DVec3::X, range: Range::new(0.0, 0.1) })
}

#[test]
fn an_offset_is_measured_in_metres() {
    let (rig, joint, _) = slider();
    let mut problem = Problem::whole_body(&rig);
    // 5 mm beyond the range: within half a degree if it were an angle, beyond the millimetre that an offset has.
    problem.add(1.0, KnownRotation::new(&[(joint, JointAngles::Value(0.105))]));
    let mut pose = rig.rest_pose();
    let mut workspace = Solver::default().workspace(&problem);
    let report = Solver::default().solve(&problem, &mut pose, &mut workspace);
    assert_eq!(report.terms[0].unit, Unit::Metres);
    assert!((report.terms[0].residual - 0.005).abs() < 1e-9);
    assert!(!report.success && report.stop == StopReason::Converged);
}

#[test]
fn the_two_units_of_a_free_root_are_two_parts() {
    let (rig, joint, _) = one_joint(JointMotion::Free { cone: None });
    let mut moved = rig.rest_pose();
    moved.set_rotation(joint, DQuat::from_rotation_y(0.3)).unwrap();
    moved.set_translation(joint, DVec3::new(0.0, 0.0, 0.4)).unwrap();
    let mut problem = Problem::new(&rig, []).unwrap();
    problem.add(1.0, RestPose::new(&[joint], rig.rest_pose()));
    let mut workspace = Solver::default().workspace(&problem);
    let report = Solver::default().solve(&problem, &mut moved, &mut workspace);
    let term = report.terms[0];
    assert_eq!((term.unit, term.others.len(), term.others[0].unit), (Unit::Radians, 1, Unit::Metres));
    assert!((term.residual - 0.3).abs() < 1e-12 && (term.others[0].residual - 0.4).abs() < 1e-12);
}

#[test]
fn what_is_left_of_a_bound_is_told_and_what_is_missed() {
    let (rig, joint, tip) = one_joint(JointMotion::Hinge { axis: DVec3::Z, range: Range::UNLIMITED });
    let mut problem = Problem::new(&rig, []).unwrap();
    for (bound, _) in BOUNDS {
        problem.add_hard(Coupling::new(&rig, &[(joint, None, 2.0)], bound).unwrap());
    }
    problem.add(1.0, Distance::new([joint, tip], Bound::AtMost(1.25)));
    problem.add(1.0, Position::new(tip, DVec3::X));
    let mut pose = rig.rest_pose();
    pose.set_value(joint, 0.25).unwrap();
    let mut workspace = Solver::default().workspace(&problem);
    let report = Solver::default().solve(&problem, &mut pose, &mut workspace);
    let near = |found: Option<f64>, expected: Option<f64>| match (found, expected) {
        (Some(found), Some(expected)) => (found - expected).abs() < 1e-12,
        (found, expected) => found == expected,
    };
    for (term, (bound, least)) in report.terms.iter().zip(BOUNDS) {
        assert!(near(term.least, least), "{bound:?}: {:?}", term.least);
        let missed = least.map_or(0.25, |least| (-least).max(0.0));
        assert!((term.residual - missed).abs() < 1e-12, "{bound:?}: {}", term.residual);
        assert_eq!(
            term.parts().map(|part| (part.residual, part.least)).collect::<Vec<_>>(),
            [(term.residual, term.least)]
        );
    }
    assert!(near(report.terms[4].least, Some(0.25)) && near(report.terms[5].least, None));
}

/// Bounds of twice an angle of 0.25, and what is left.
const BOUNDS: [(Bound, Option<f64>); 4] = [
    (Bound::AtMost(0.6), Some(0.1)),
    (Bound::AtMost(0.4), Some(-0.1)),
    (Bound::AtLeast(0.2), Some(0.3)),
    (Bound::Exactly(0.25), None),
];

#[test]
fn of_a_motion_the_least_that_is_left_is_told() {
    let (rig, joint, _) = one_joint(JointMotion::Hinge { axis: DVec3::Z, range: Range::UNLIMITED });
    let timeline = Timeline::seconds(1.0, 10.0).unwrap();
    let mut motion = MotionProblem::new(&rig, [joint], timeline).unwrap();
    let turn = |value| KnownRotation::new(&[(joint, JointAngles::Value(value))]);
    motion.add(1e6, When::At(0.0), turn(0.5)).unwrap();
    motion.add(1e6, When::At(0.5), turn(1.0)).unwrap();
    motion.add(1e6, When::At(1.0), turn(0.25)).unwrap();
    motion
        .add(
            1.0,
            When::Span { from: 0.1, to: 1.0 },
            Coupling::new(&rig, &[(joint, None, 1.0)], Bound::AtLeast(0.0)).unwrap(),
        )
        .unwrap();
    let still = Clip::still(rig.rest_pose());
    let planned = Solver::default().plan(&motion, &still, &mut MotionWorkspace::default()).into_owned();
    let term = planned.report.terms[3];
    let lowest =
        planned.clip.poses().iter().map(|pose| pose.value(joint).unwrap()).fold(f64::INFINITY, f64::min);
    assert!((lowest - 0.25).abs() < 1e-3, "{lowest}");
    assert!(
        (term.least.unwrap() - lowest).abs() < 1e-12 && term.times.unwrap().worst_secs == 1.0,
        "{term:?}"
    );
    assert_eq!((term.residual, planned.report.terms[0].least), (0.0, None));
}

#[test]
fn angles_that_do_not_fit_a_joint_are_refused_with_the_reason() {
    let (rig, joint, tip) = one_joint(JointMotion::Ball { cone: None });
    let refused = |problem: &Problem| {
        let mut pose = rig.rest_pose();
        let mut workspace = Solver::default().workspace(problem);
        let report = Solver::default().solve(problem, &mut pose, &mut workspace);
        assert_eq!((report.stop, pose), (StopReason::InvalidInput, rig.rest_pose()));
        let Some(Invalid::Term(0, InvalidTerm::Unfit(unfit))) = report.invalid else {
            panic!("{:?}", report.invalid)
        };
        unfit
    };
    let cases = [
        (joint, JointAngles::Value(0.1), UnfitReason::TakesRotation),
        (tip, JointAngles::Rotation(DQuat::IDENTITY), UnfitReason::GivesToFixed),
    ];
    for (misfit, angles, reason) in cases {
        let mut problem = Problem::whole_body(&rig);
        problem.add(1.0, KnownRotation::new(&[(misfit, angles)]));
        let unfit = refused(&problem);
        assert!(unfit.to_string().starts_with("gives"), "{unfit}");
        assert_eq!((unfit.reason, unfit.joint), (reason, Some(misfit)));
    }
    let (other, ..) = slider();
    let mut problem = Problem::whole_body(&rig);
    problem.add(1.0, RestPose::new(&[joint], other.rest_pose()));
    assert_eq!(refused(&problem).reason, UnfitReason::PoseOfOtherRig);
}

/// Parts of one row each, all with the same residual but for their number, and a row that one joint has.
#[derive(Clone, Debug)]
struct Parts {
    joint: JointId,
    units: Vec<Unit>,
    /// Whether there is a row of the joint's own motion, which is never opened.
    own_row: bool,
}

impl Objective for Parts {
    fn kind(&self) -> &'static str {
        "parts"
    }
    fn reads(&self, reads: &mut Reads<'_>) -> Result<(), Unfit> {
        reads.frame(self.joint)?;
        reads.motion(self.joint)?;
        self.units.iter().try_for_each(|unit| reads.part(Part::new(1, *unit)))?;
        if self.own_row { reads.part(Part::separable(1, Unit::Metres)) } else { Ok(()) }
    }
    fn check(&self) -> Result<(), Unfit> {
        Ok(())
    }
    fn evaluate(&self, _: &View<'_>, rows: &mut Rows<'_>) {
        for part in 0..self.units.len() {
            let row = rows.open(part, [0.1 * (part + 1) as f64]);
            assert_eq!(row, part);
        }
    }
}

#[test]
fn every_part_is_reported_and_has_its_say() {
    let (rig, joint, _) = slider();
    let units = vec![Unit::Metres, Unit::Radians, Unit::Metres];
    let mut problem = Problem::whole_body(&rig);
    let id = problem.add(1.0, Parts { joint, units, own_row: false });
    let mut workspace = Solver::default().workspace(&problem);
    let mut tolerance = ikiru_solve::Tolerance { metres: 0.35, radians: 0.25 };
    let solve = |problem: &Problem, workspace: &mut _| {
        let report = Solver::default().solve(problem, &mut rig.rest_pose(), workspace);
        (report.terms[0], report.success)
    };
    problem.term_mut(id).tolerance = tolerance;
    let (term, success) = solve(&problem, &mut workspace);
    assert!(success && (term.residual - 0.1).abs() < 1e-15);
    let others: Vec<_> = term.others.iter().map(|part| (part.residual, part.unit)).collect();
    assert_eq!(others.len(), 2);
    assert!((others[0].0 - 0.2).abs() < 1e-15 && others[0].1 == Unit::Radians);
    assert!((others[1].0 - 0.3).abs() < 1e-15 && others[1].1 == Unit::Metres);
    // The third part alone decides.
    tolerance.metres = 0.25;
    problem.term_mut(id).tolerance = tolerance;
    assert!(!solve(&problem, &mut workspace).1);
}

#[test]
fn more_parts_than_reports_have_room_for_are_refused() {
    let (rig, joint, _) = slider();
    for (n_parts, own_row, fits) in
        [(MOST_PARTS, false, true), (MOST_PARTS + 1, false, false), (3, true, true), (4, true, false)]
    {
        let mut problem = Problem::whole_body(&rig);
        problem.add(1.0, Parts { joint, units: vec![Unit::Metres; n_parts], own_row });
        let mut workspace = Solver::default().workspace(&problem);
        let report = Solver::default().solve(&problem, &mut rig.rest_pose(), &mut workspace);
        assert_eq!(report.stop != StopReason::InvalidInput, fits, "{n_parts} parts");
    }
}

#[test]
fn rows_that_are_not_opened_are_zero_whatever_was_in_memory() {
    let (rig, joint, _) = slider();
    let mut problem = Problem::new(&rig, []).unwrap();
    problem.add(1.0, KnownRotation::new(&[(joint, JointAngles::Value(0.7))]));
    problem.add(1.0, Parts { joint, units: Vec::new(), own_row: true });
    let mut workspace = Solver::default().workspace(&problem);
    let report = Solver::default().solve(&problem, &mut rig.rest_pose(), &mut workspace);
    assert!((report.terms[0].residual - 0.7).abs() < 1e-15);
    assert_eq!(report.terms[1].residual, 0.0);
}

fn reach(rig: &Rig, tip: JointId, weights: [f64; 2]) -> (bool, StopReason, Pose) {
    let options = SolverOptions { search: Search::Global { max_restarts: 4 }, ..SolverOptions::default() };
    let solver = Solver::new(options);
    let mut problem = Problem::whole_body(rig);
    // Both in reach, not at once.
    problem.add(weights[0], Position::new(tip, DVec3::X * 1.05));
    problem.add(weights[1], Position::new(tip, DVec3::X * 1.02));
    let mut pose = rig.rest_pose();
    let mut workspace = solver.workspace(&problem);
    let report = solver.solve(&problem, &mut pose, &mut workspace);
    let (success, stop) = (report.success, report.stop);
    if success {
        assert!(report.forces.iter().all(|force| force.on.is_none()));
    }
    (success, stop, pose)
}

#[test]
fn a_term_of_weight_0_is_as_good_as_not_there() {
    let (rig, joint, tip) = slider();
    let (success, stop, pose) = reach(&rig, tip, [1.0, 0.0]);
    assert!(success && stop == StopReason::Reached);
    assert!((pose.value(joint).unwrap() - 0.05).abs() < 1e-9);
    assert!(reach(&rig, tip, [0.0, 0.0]).0, "where nothing counts, nothing is unmet");
}

#[test]
fn tiny_weights_are_still_weights() {
    let (rig, joint, tip) = slider();
    for weight in [1e-20, 1e-26, 1e-100] {
        let (success, stop, pose) = reach(&rig, tip, [weight, 0.0]);
        assert!(success && stop == StopReason::Reached, "{weight}: {stop:?}");
        assert!((pose.value(joint).unwrap() - 0.05).abs() < 1e-6, "{weight}");
        // Beside a term of weight 1 they are not met, and no one says that they were.
        let (success, stop, _) = reach(&rig, tip, [1.0, weight]);
        assert!(!success && stop != StopReason::Reached, "{weight}: {stop:?}");
    }
}

#[cfg(feature = "serde")]
#[test]
fn a_report_is_data() {
    let (rig, _, tip) = one_joint(JointMotion::Ball { cone: None });
    let mut problem = Problem::whole_body(&rig);
    problem.add(1.0, Position::new(tip, DVec3::new(0.0, 9.0, 0.0)));
    let solver = Solver::default();
    let mut workspace = solver.workspace(&problem);
    let report = solver.solve(&problem, &mut rig.rest_pose(), &mut workspace);
    let data = serde_json::to_value(&report).unwrap();
    assert_eq!(data["stop"], report.stop.name());
    assert_eq!(data["success"], false);
    assert_eq!(data["terms"][0]["residual"], report.terms[0].residual);
    assert_eq!(data["terms"][0]["unit"], "metres");
    assert_eq!(data["terms"][0]["joint"], tip.index());
    assert_eq!(data["forces"][0]["by"]["reach"]["is_proven"], true);
    assert!(data["invalid"].is_null() && data["terms"][0].get("key").is_none());
    problem.add(1.0, Position::new(tip, DVec3::NAN));
    let report = solver.solve(&problem, &mut rig.rest_pose(), &mut workspace);
    let data = serde_json::to_value(&report).unwrap();
    assert_eq!(data["invalid"], "the objective at position 1 has a target that is not finite");
}
