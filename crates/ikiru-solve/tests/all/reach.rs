//! How far a target is out of reach wherever the joints are, and what would help.
#![allow(clippy::unwrap_used, reason = "a test that cannot go on fails")]

use crate::common::place;
use crate::forces::{chain, force, near, solved};
use glam::DVec3;
use ikiru_rig::{Joint, JointId, JointMotion, Mimic, Pose, Range, Rig, RigBuilder};
use ikiru_solve::objectives::Position;
use ikiru_solve::{Force, ForceBy, Hint, Problem, Solver, Unit};
use ikiru_testkit::reference::world_matrices;
use ikiru_testkit::rigs::{Random, random_pose, random_rig};

#[test]
fn how_far_a_target_is_out_of_reach_is_known() {
    let reach = |rig: &Rig, active: &[JointId], tip: JointId, target: DVec3| {
        let mut problem = Problem::new(rig, active.iter().copied()).unwrap();
        problem.add(1.0, Position::new(tip, target));
        let (_, forces, _) = solved(&problem);
        let on = |force: &Force| force.on == Some(0) && force.by == (ForceBy::Reach { is_proven: true });
        forces.iter().copied().find(on)
    };
    let (rig, ids) = chain(&[(0.5, Range::UNLIMITED), (0.2, Range::UNLIMITED)]);
    // Beyond the links, within the hole that the shorter one leaves, and between the two.
    for (target, missing) in [(DVec3::new(0.0, 1.13, 0.0), 0.43), (DVec3::new(0.1, 0.0, 0.0), 0.2)] {
        let force = reach(&rig, &ids, ids[2], target).unwrap();
        assert!((force.amount - missing).abs() < 1e-12 && force.unit == Unit::Metres, "{force:?}");
        near(force.share, 1.0);
    }
    assert_eq!(
        reach(&rig, &ids, ids[2], DVec3::new(0.1, 0.1, 0.4)),
        None,
        "hinges turn in a plane: no proof"
    );
    // Out of the plane in which hinges turn a chain that could be bent: so it is from here.
    let mut problem = Problem::whole_body(&rig);
    problem.add(1.0, Position::new(ids[2], DVec3::new(0.4, 0.3, 0.4)));
    let force = force(&solved(&problem).1, 0, ForceBy::Reach { is_proven: false });
    near(force.share, 1.0);
    near(force.amount, 0.4);
    // What does not move is no link.
    let force = reach(&rig, &ids[1..], ids[2], DVec3::new(0.5, 0.9, 0.0)).unwrap();
    assert!((force.amount - 0.7).abs() < 1e-12, "{force:?}");
    let force = reach(&rig, &[], ids[2], DVec3::new(0.7, 0.9, 0.0)).unwrap();
    assert!((force.amount - 0.9).abs() < 1e-12 && force.share == 1.0, "{force:?}");
}

#[test]
fn sliders_are_links_that_grow() {
    let slider = |range: Range| JointMotion::Slider { axis: DVec3::X, range };
    // A rail at the world, a hinge on it, and a telescope on that; a finger follows the telescope.
    let mut builder = RigBuilder::new();
    let mut rail = Joint::new("rail", None);
    rail.motion = slider(Range::new(-0.5, 1.0));
    let rail = builder.add(rail);
    let mut hinge = Joint::new("hinge", Some(rail));
    hinge.motion = JointMotion::Hinge { axis: DVec3::Z, range: Range::UNLIMITED };
    let hinge = builder.add(hinge);
    let mut telescope = Joint::new("telescope", Some(hinge));
    telescope.rest_translation = DVec3::X * 0.2;
    telescope.motion = slider(Range::new(0.0, 0.3));
    let telescope = builder.add(telescope);
    let mut finger = Joint::new("finger", Some(telescope));
    finger.rest_translation = DVec3::X * 0.1;
    finger.motion = slider(Range::UNLIMITED);
    finger.mimic = Some(Mimic { leader: telescope, multiplier: 0.5, offset: 0.05 });
    let finger = builder.add(finger);
    let rig = builder.build().unwrap();
    // From the middle of the rail, 0.25: half of its length, then 0.2 + 0.3 + 0.1 + 0.2.
    for (target, missing) in [(DVec3::X * 3.0, 1.2), (DVec3::X * -3.0, 1.7)] {
        let mut problem = Problem::whole_body(&rig);
        problem.add(1.0, Position::new(finger, target));
        let (_, forces, pose) = solved(&problem);
        let reach = force(&forces, 0, ForceBy::Reach { is_proven: true });
        assert!((reach.amount - missing).abs() < 1e-12, "{reach:?}");
        if target.x > 0.0 {
            assert!((place(&pose, finger).distance(target) - missing).abs() < 1e-6, "and no nearer");
            near(reach.share, 1.0);
        }
    }
}

#[test]
fn no_pose_is_nearer_than_what_is_proven() {
    let mut random = Random::new(31);
    let mut n_proven = 0;
    for case in 0..300 {
        let rig = random_rig(2 + random.below(12), case);
        let joint = JointId::from_index(rig.n_joints() - 1);
        let mut problem = Problem::new(&rig, rig.ids().filter(|_| random.unit() < 0.8)).unwrap();
        let (point, target) = (random.vector(0.2), random.vector(1.5));
        problem.add(1.0, Position { joint, point, target });
        let (_, forces, found) = solved(&problem);
        let Some(force) = forces.iter().find(|force| force.by == (ForceBy::Reach { is_proven: true })) else {
            continue;
        };
        n_proven += 1;
        let mut poses: Vec<Pose> = (0..200).map(|_| random_pose(&rig, &mut random)).collect();
        poses.push(found.clone());
        for mut pose in poses {
            for id in rig.ids().filter(|id| !problem.is_active(*id)) {
                let at = rig.coords_of(id);
                pose.coords_mut()[at.clone()].copy_from_slice(&found.coords()[at]);
            }
            let frame = world_matrices(&pose)[joint.index()];
            let distance = frame.transform_point3(point).distance(target);
            assert!(distance >= force.amount - 1e-9, "case {case}: {distance} is below {}", force.amount);
        }
    }
    assert!(n_proven > 50, "{n_proven}");
}

#[test]
fn a_root_that_could_float_is_a_hint_where_it_would_do() {
    let mut builder = RigBuilder::new();
    let mut add = |name: &str, parent: Option<JointId>, at: DVec3| {
        let mut joint = Joint::new(name, parent);
        (joint.rest_translation, joint.motion) = (at, JointMotion::BALL);
        builder.add(joint)
    };
    let hips = add("hips", None, DVec3::Y);
    let shoulder = add("shoulder", Some(hips), DVec3::Y * 0.5);
    let hand = add("hand", Some(shoulder), DVec3::X * 0.6);
    let thigh = add("thigh", Some(hips), DVec3::NEG_Y * 0.1);
    let foot = add("foot", Some(thigh), DVec3::NEG_Y * 0.9);
    let rig = builder.build().unwrap();
    let hint = |rig: &Rig, active: &[JointId], foot_at: Option<DVec3>| {
        let mut problem = Problem::new(rig, active.iter().copied()).unwrap();
        problem.add(1.0, Position::new(hand, DVec3::new(3.0, 1.5, 0.0)));
        if let Some(at) = foot_at {
            problem.add(1.0, Position::new(foot, at));
        }
        let solver = Solver::default();
        let mut workspace = solver.workspace(&problem);
        solver.solve(&problem, &mut rig.rest_pose(), &mut workspace).hint
    };
    let all = [hips, shoulder, hand, thigh, foot];
    assert_eq!(hint(&rig, &all, None), Some(Hint::FreeRoot(hips)));
    // The foot stays: with legs and trunk the hand is 0.6 + 0.5 + 0.1 + 0.9 away from it at most.
    assert_eq!(hint(&rig, &all, Some(DVec3::X * 1.6)), Some(Hint::FreeRoot(hips)));
    assert_eq!(hint(&rig, &all, Some(DVec3::ZERO)), None);
    let mut builder = rig.to_builder();
    builder.free_root().unwrap();
    let free = builder.build().unwrap();
    assert_eq!(hint(&free, &all, None), None, "nothing is out of reach");
    assert_eq!(hint(&free, &all[1..], None), Some(Hint::MoveRoot(hips)));
}
