//! The bits of a thousand solves of each method of our own, as one number: the same in every build, on every machine.
//!
//! Whoever changes arithmetic on purpose renews the numbers in that commit, and says why. The tests print what they
//! found.
#![allow(clippy::unwrap_used, reason = "a test that cannot go on fails")]

use glam::{DQuat, DVec3};
use ikiru_rig::{JointId, Pose, Rig};
use ikiru_solve::objectives::{
    Bound, Direction, Distance, JointAngles, KnownRotation, LookAt, Orientation, PoleVector, PoseTarget,
    Position, RelativePose, RestPose,
};
use ikiru_solve::{AdamOptions, Loss, Method, Problem, Search, Settle, Solver, SolverOptions};
use ikiru_testkit::cones::without_centres;
use ikiru_testkit::rigs::{Random, random_pose, random_rig};

/// What the solves of each method come to.
pub(crate) const BITS: [(Method, Settle, u64); 5] = [
    (Method::Lm, Settle::Fully, 0x9264_C856_CE5A_8086),
    (Method::Lm, Settle::Tolerances, 0x7011_FEDB_AE63_13EB),
    (Method::Adam(AdamOptions::DEFAULT), Settle::Tolerances, 0x4910_81FA_D31C_DB9E),
    (Method::Ccd, Settle::Tolerances, 0xD608_035D_0826_1817),
    (Method::Fabrik, Settle::Tolerances, 0x6987_9777_3764_54DE),
];

/// How many problems, and solves of each: from the rest pose, then from where the last one ended.
const N_PROBLEMS: usize = 250;
const N_SOLVES: usize = 4;

/// FNV-1a over 64-bit words.
#[derive(Clone, Copy)]
struct Hash(u64);

impl Hash {
    fn add(&mut self, bits: u64) {
        for byte in bits.to_le_bytes() {
            self.0 = (self.0 ^ u64::from(byte)).wrapping_mul(0x0100_0000_01B3);
        }
    }
}

/// A problem with some of all objectives, whose targets can mostly be met.
fn problem(rig: &Rig, random: &mut Random, target: &Pose) -> Problem {
    let mut problem = Problem::whole_body(rig);
    let end = JointId::from_index(rig.n_joints() - 1);
    let [a, b, c] = [0, 1, 2].map(|_| JointId::from_index(random.below(rig.n_joints())));
    let frame = target.frame(end).unwrap();
    let (position, rotation) = (frame.position, frame.rotation);
    let loss = [Loss::Squared, Loss::Norm, Loss::Huber { width: 0.1 }][random.below(3)];
    let reach = problem.add(1.0, Position::new(end, position));
    problem.term_mut(reach).loss = loss;
    for _ in 0..random.below(4) {
        match random.below(10) {
            0 => drop(problem.add(0.3, Orientation::new(end, rotation))),
            1 => drop(problem.add(0.2, PoseTarget::new(a, position, rotation))),
            2 => drop(problem.add(0.1, LookAt::new(b, DVec3::Z, position))),
            3 => drop(problem.add(0.1, Direction::new(b, DVec3::Y, DVec3::X))),
            4 => drop(problem.add(0.1, Distance::new([a, b], Bound::AtLeast(0.3)))),
            5 => drop(problem.add(0.1, RelativePose::new(a, b, Some(DVec3::ZERO), Some(DQuat::IDENTITY)))),
            6 => drop(problem.add(0.1, PoleVector { joints: [a, b, c], target: DVec3::Y })),
            7 => {
                let leads = rig.get(a).is_some_and(|joint| joint.mimic.is_none());
                if let Some(value) = rig.rest_pose().value(a).filter(|_| leads) {
                    problem.add(0.1, KnownRotation::new(&[(a, JointAngles::Value(value + 0.2))]));
                }
            }
            _ => {
                let joints: Vec<JointId> = problem.active().collect();
                problem.add(0.001, RestPose::new(&joints, rig.rest_pose()));
            }
        }
    }
    problem
}

/// What the solves of a method come to.
pub(crate) fn bits_of(method: Method, settle: Settle) -> u64 {
    let mut random = Random::new(17);
    let mut hash = Hash(0xCBF2_9CE4_8422_2325);
    for case in 0..N_PROBLEMS {
        let rig = without_centres(&random_rig(2 + random.below(12), case as u64));
        let target = random_pose(&rig, &mut random);
        let problem = problem(&rig, &mut random, &target);
        let search = if case % 2 == 0 { Search::Local } else { Search::Global { max_restarts: 2 } };
        let options =
            SolverOptions { method, search, settle, max_iterations: 20, ..SolverOptions::default() };
        let solver = Solver::new(options);
        let mut workspace = solver.workspace(&problem);
        let mut pose = rig.rest_pose();
        for solve in 0..N_SOLVES {
            if solve == 2 {
                pose = random_pose(&rig, &mut random);
            }
            let report = solver.solve(&problem, &mut pose, &mut workspace);
            assert!(report.invalid.is_none(), "case {case}: {:?}", report.invalid);
            assert!(report.cost.is_finite());
            hash.add(report.cost.to_bits());
            pose.coords().iter().for_each(|coord| hash.add(coord.to_bits()));
        }
    }
    hash.0
}

#[test]
fn a_thousand_solves_give_the_bits_that_they_always_gave() {
    let found = BITS.map(|(method, settle, _)| (method.name(), bits_of(method, settle)));
    let wanted = BITS.map(|(method, _, bits)| (method.name(), bits));
    assert_eq!(found, wanted, "found {found:#018x?}");
}
