//! The guide's table of objectives: rows and units are those that each of them names, and a weight means what is said.
#![allow(clippy::unwrap_used, reason = "a test that cannot go on fails")]

use std::collections::BTreeSet;

use ikiru::solve::{Objective, Sense};
use ikiru::{
    Bound, CenterOfMass, Coupling, DQuat, DVec3, Direction, Distance, EulerOrder, JointAngles, JointMotion,
    KnownRotation, LookAt, Orientation, PoleVector, PoseTarget, Position, Problem, Range, RelativePose,
    RestPose, Rig, Segment, Solver, Unit, formats, scenario,
};

const TABLE: &str = include_str!("../../src/objectives.md");
/// Why what is asked for here is there.
const GOOD: &str = "a rig and objectives that fit";
const MM: f64 = 1e-3;
/// What a degree off costs with weight 1.
const DEGREE: f64 = 3.046_174e-4;
const MILLIMETRE: f64 = 1e-6;

/// The cells of the row of a type.
fn row(name: &str) -> Vec<&'static str> {
    let head = format!("| [`{name}`] |");
    let line = TABLE.lines().find(|line| line.starts_with(&head));
    line.unwrap_or_else(|| panic!("no row for {name}")).split('|').map(str::trim).collect()
}

/// Parts as the table words them, their rows counted for each of `per` things.
fn worded(problem: &Problem, per: usize) -> String {
    let parts = problem.reads(&problem.terms()[0]).expect(GOOD).parts;
    let worded = parts.iter().filter(|part| part.most_rows > 0).map(|part| {
        assert_eq!(part.most_rows % per, 0);
        let unit = if part.unit == Unit::Metres { "m" } else { "rad" };
        let bound = if part.sense == Sense::AtLeast { " ≥ 0" } else { "" };
        format!("{} {unit}{bound}", part.most_rows / per)
    });
    worded.collect::<Vec<_>>().join(" + ")
}

/// The rig of all checks: the elbow an Euler joint, at rest.
fn rig() -> Rig {
    let rig = formats::read("builtin:human").expect(GOOD).rig;
    let mut builder = rig.to_builder();
    let elbow = rig.joint("leftLowerArm").expect(GOOD);
    builder
        .set_motion(elbow, JointMotion::Euler { order: EulerOrder::Zyx, ranges: [Range::UNLIMITED; 3] })
        .unwrap();
    builder.build().expect(GOOD)
}

#[derive(Default)]
struct Checked(BTreeSet<&'static str>);

impl Checked {
    /// An objective of the type: the table has its rows, counted for each of `per` things, and at rest, where it is a
    /// millimetre or a degree off, weight 2 costs twice what weight 1 is said to cost.
    fn check(
        &mut self,
        name: &str,
        objective: impl Objective + Clone,
        (rows, per): (&str, usize),
        cost: f64,
    ) {
        let rig = rig();
        // What moves has nothing to do with any of them.
        let mut problem = Problem::new(&rig, [rig.joint("rightFoot").expect(GOOD)]).expect(GOOD);
        let kind = objective.kind();
        problem.add(2.0, objective);
        assert_eq!(worded(&problem, per), rows, "{name}");
        let cell = row(name)[3];
        assert!(format!("; {cell}; ").contains(rows), "{name}: '{rows}' is not in '{cell}'");
        let solver = Solver::default();
        let (mut pose, mut workspace) = (rig.rest_pose(), solver.workspace(&problem));
        let found = solver.solve(&problem, &mut pose, &mut workspace).terms[0].cost;
        assert!((found - 2.0 * cost).abs() < 1e-5 * cost + 1e-15, "{name}: {found}, not twice {cost}");
        self.0.insert(kind);
    }
}

#[test]
fn rows_units_and_costs_are_those_of_the_table() {
    let rig = rig();
    let rest = rig.rest_pose();
    let id = |name: &str| rig.joint(name).unwrap();
    let [hand, elbow, arm, other] = ["leftHand", "leftLowerArm", "leftUpperArm", "rightHand"].map(id);
    let frame = rest.frame(hand).unwrap();
    let (origin, turned) = (frame.position, frame.rotation);
    let degree = 1_f64.to_radians();
    let off = origin + DVec3::new(MM, 0.0, 0.0);
    let tilt = DQuat::from_rotation_z(degree);
    let mut all = Checked::default();

    all.check("Position", Position::new(hand, off), ("3 m", 1), MILLIMETRE);
    all.check("Orientation", Orientation::new(hand, tilt * turned), ("3 rad", 1), DEGREE);
    all.check(
        "PoseTarget",
        PoseTarget::new(hand, off, tilt * turned),
        ("3 m + 3 rad", 1),
        MILLIMETRE + DEGREE,
    );
    let tilted = turned * tilt * DVec3::X;
    all.check("LookAt", LookAt::new(hand, DVec3::X, origin + 3.0 * tilted), ("2 rad", 1), DEGREE);
    all.check("Direction", Direction::new(hand, DVec3::X, tilted), ("2 rad", 1), DEGREE);

    let base = rest.frame(other).unwrap();
    let unturn = base.rotation.inverse();
    let beside = RelativePose::new(
        other,
        hand,
        Some(unturn * (origin - base.position) + DVec3::new(0.0, MM, 0.0)),
        Some(unturn * turned * tilt),
    );
    all.check("RelativePose", beside, ("3 m + 3 rad", 1), MILLIMETRE + DEGREE);

    let apart = origin.distance(base.position);
    let distance = |bound| Distance::new([hand, other], bound);
    all.check("Distance", distance(Bound::Exactly(apart - MM)), ("1 m", 1), MILLIMETRE);
    all.check("Distance", distance(Bound::AtLeast(apart + MM)), ("1 m ≥ 0", 1), MILLIMETRE);
    all.check("Distance", distance(Bound::AtLeast(apart - MM)), ("1 m ≥ 0", 1), 0.0);

    // The arm is stretched at rest, which has no side: shoulder, head and hand stand in for a limb.
    let head = id("head");
    let [root, middle] = [arm, head].map(|joint| rest.frame(joint).unwrap().position);
    let line = (origin - root).normalize();
    let side = (middle - root).reject_from(line);
    let target = root + DQuat::from_axis_angle(line, degree) * side * 9.0;
    all.check("PoleVector", PoleVector { joints: [arm, head, hand], target }, ("1 rad", 1), DEGREE);

    let turn = JointAngles::Rotation(tilt);
    let bend = JointAngles::Euler([Some(degree), Some(0.0), Some(0.0)]);
    all.check("KnownRotation", KnownRotation::new(&[(arm, turn), (elbow, bend)]), ("1 rad", 6), DEGREE);
    let mut pose = rest.clone();
    pose.set_rotation(arm, tilt).unwrap();
    pose.set_euler(elbow, [degree, 0.0, 0.0]).unwrap();
    all.check("RestPose", RestPose::new(&[arm, elbow], pose), ("1 rad", 6), DEGREE);

    let coupling = |bound| Coupling::new(&rig, &[(elbow, Some(DVec3::X), 1.0)], bound).unwrap();
    all.check("Coupling", coupling(Bound::Exactly(degree)), ("1 rad", 1), DEGREE);
    all.check("Coupling", coupling(Bound::AtMost(-degree)), ("1 rad ≥ 0", 1), DEGREE);

    let mass = [Segment { joint: hand, kg: 2.0, center: DVec3::ZERO }];
    all.check("CenterOfMass", CenterOfMass::at(&mass, off), ("3 m", 1), MILLIMETRE);
    // A millimetre outside of one of four edges.
    let corner = |x: f64, z: f64| origin + DVec3::new(x, 0.0, z);
    let area = [corner(MM, -1.0), corner(1.0, -1.0), corner(1.0, 1.0), corner(MM, 1.0)];
    let over = CenterOfMass::over(&mass, &area, DVec3::Y, 0.0).unwrap();
    all.check("CenterOfMass", over, ("1 m ≥ 0", 4), MILLIMETRE);

    let every: BTreeSet<&str> = scenario::kinds::Kind::NAMES.iter().copied().collect();
    assert_eq!(all.0, every, "a kind has no row in the guide, or none that is checked");
}

#[test]
fn what_weights_mean_is_what_the_guide_says() {
    assert!(TABLE.contains("*a millimetre off costs 1e-6* and *a degree off 3.0e-4*"));
    assert!((1_f64.to_radians().powi(2) - DEGREE).abs() < 1e-9);
    assert!((1_f64.to_radians() - 0.017_45).abs() < 1e-5, "a degree weighs as much as 17 mm");
}
