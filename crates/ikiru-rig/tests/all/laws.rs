//! Laws of poses and forward kinematics, over random rigs with every joint motion.

use glam::{DMat4, DVec3};
use ikiru_rig::{Clip, ClipError, Dual, Frame, JointFrame, JointId, LaneScalar, Lanes, Pose, kinematics};
use ikiru_testkit::reference::world_matrices;
use ikiru_testkit::rigs::{Random, random_pose, rigs};
use proptest::prelude::*;

fn matrix(frame: &JointFrame) -> DMat4 {
    DMat4::from(glam::DAffine3::from(*frame))
}

fn tangent(n: usize, size: f64, random: &mut Random) -> Vec<f64> {
    (0..n).map(|_| random.between(-size, size)).collect()
}

proptest! {
    #[test]
    fn forward_kinematics_agrees_with_matrices((rig, seed) in rigs(40)) {
        let pose = random_pose(&rig, &mut Random::new(seed));
        let frames = pose.frames();
        for (joint, expected) in rig.ids().zip(world_matrices(&pose)) {
            prop_assert!(matrix(&frames[joint.index()]).abs_diff_eq(expected, 1e-12));
            prop_assert!(matrix(&pose.frame(joint).unwrap()).abs_diff_eq(expected, 1e-12));
        }
    }

    #[test]
    fn some_frames_are_the_same_frames((rig, seed) in rigs(40)) {
        let mut random = Random::new(seed);
        let pose = random_pose(&rig, &mut random);
        let wanted = [JointId::from_index(random.below(rig.n_joints())), JointId::from_index(random.below(rig.n_joints()))];
        let order = kinematics::with_ancestors(&rig, &wanted);
        let mut frames = vec![Frame::identity(); rig.n_joints()];
        kinematics::forward_some(&rig, &order, pose.coords(), &mut frames);
        let all = pose.frames();
        for joint in wanted {
            prop_assert_eq!(JointFrame::from(frames[joint.index()]), all[joint.index()]);
        }
    }

    #[test]
    fn retract_and_difference_are_inverse((rig, seed) in rigs(30)) {
        let mut random = Random::new(seed);
        let (a, b) = (random_pose(&rig, &mut random), random_pose(&rig, &mut random));
        let mut c = a.clone();
        c.retract(&a.difference(&b).unwrap()).unwrap();
        for (x, y) in c.frames().iter().zip(b.frames()) {
            prop_assert!(matrix(x).abs_diff_eq(matrix(&y), 1e-9));
        }
        let small = tangent(rig.n_dofs(), 0.5, &mut random);
        let mut moved = a.clone();
        moved.retract(&small).unwrap();
        for (x, y) in a.difference(&moved).unwrap().iter().zip(&small) {
            prop_assert!((x - y).abs() < 1e-12);
        }
        prop_assert!(a.difference(&a).unwrap().iter().all(|d| d.abs() < 1e-12));
    }

    #[test]
    fn projection_holds_every_limit_and_leaves_what_is_inside((rig, seed) in rigs(30)) {
        let mut random = Random::new(seed);
        let mut pose = random_pose(&rig, &mut random);
        prop_assert!(pose.limit_violation() < 1e-9);
        let inside = pose.clone();
        pose.project();
        for (x, y) in pose.coords().iter().zip(inside.coords()) {
            prop_assert!((x - y).abs() < 1e-9);
        }
        pose.retract(&tangent(rig.n_dofs(), 4.0, &mut random)).unwrap();
        pose.project();
        prop_assert!(pose.limit_violation() < 1e-9, "{}", pose.limit_violation());
        prop_assert!(pose.is_valid());
    }

    #[test]
    fn dual_numbers_differentiate_forward_kinematics((rig, seed) in rigs(20)) {
        let mut random = Random::new(seed);
        let pose = random_pose(&rig, &mut random);
        if rig.n_coords() == 0 {
            return Ok(());
        }
        let at = random.below(rig.n_coords());
        let coords: Vec<Dual<1>> = pose.coords().iter().enumerate()
            .map(|(i, c)| if i == at { Dual::variable(*c, 0) } else { Dual::from(*c) }).collect();
        let mut frames = vec![Frame::<Dual<1>>::identity(); rig.n_joints()];
        kinematics::forward(&rig, &coords, &mut frames);
        let shifted = |step: f64| {
            let mut coords = pose.coords().to_vec();
            coords[at] += step;
            let mut frames = vec![Frame::<f64>::identity(); rig.n_joints()];
            kinematics::forward(&rig, &coords, &mut frames);
            frames
        };
        let (ahead, behind) = (shifted(1e-6), shifted(-1e-6));
        for i in 0..rig.n_joints() {
            let numeric = (ahead[i].origin.value() - behind[i].origin.value()) / 2e-6;
            let o = frames[i].origin;
            let exact = DVec3::new(o.x.derivatives[0], o.y.derivatives[0], o.z.derivatives[0]);
            prop_assert!((numeric - exact).length() < 1e-6 * (1.0 + exact.length()));
        }
    }

    #[test]
    fn poses_in_lanes_have_the_frames_that_they_have_alone((rig, seed) in rigs(20)) {
        let mut random = Random::new(seed);
        let poses: [Pose; 3] = std::array::from_fn(|_| random_pose(&rig, &mut random));
        let coords: Vec<Lanes<3>> =
            (0..rig.n_coords()).map(|i| Lanes(poses.each_ref().map(|pose| pose.coords()[i]))).collect();
        let mut frames = vec![Frame::<Lanes<3>>::identity(); rig.n_joints()];
        kinematics::forward(&rig, &coords, &mut frames);
        for (lane, pose) in poses.iter().enumerate() {
            for (frame, alone) in frames.iter().zip(pose.frames()) {
                prop_assert_eq!(JointFrame::from(frame.map(|number| number.lane(lane))), alone);
            }
        }
    }

    #[test]
    fn a_clip_is_its_poses_at_their_times_and_between_them_in_between((rig, seed) in rigs(12)) {
        let mut random = Random::new(seed);
        let poses: Vec<Pose> = (0..4).map(|_| random_pose(&rig, &mut random)).collect();
        let clip = Clip::new("walk", vec![0.0, 0.5, 0.75, 2.0], poses.clone()).unwrap();
        prop_assert_eq!(clip.duration_secs(), 2.0);
        for (time, pose) in clip.times().iter().zip(&poses) {
            for (x, y) in clip.sample(*time).frames().iter().zip(pose.frames()) {
                prop_assert!(matrix(x).abs_diff_eq(matrix(&y), 1e-9));
            }
        }
        let half = clip.sample(0.25);
        let (before, after) = (half.difference(&poses[0]).unwrap(), half.difference(&poses[1]).unwrap());
        for (x, y) in before.iter().zip(&after) {
            prop_assert!((x + y).abs() < 1e-9, "{} {}", x, y);
        }
        prop_assert_eq!(clip.sample(-1.0), poses[0].clone());
        prop_assert_eq!(clip.sample(f64::NAN), poses[0].clone());
        prop_assert_eq!(clip.sample(9.0), poses[3].clone());
    }
}

#[test]
fn clips_refuse_what_is_not_a_motion() {
    let rig = ikiru_testkit::rigs::random_rig(5, 1);
    let other = ikiru_testkit::rigs::random_rig(5, 1);
    let pose = rig.rest_pose();
    assert_eq!(Clip::new("", vec![], vec![]), Err(ClipError::Empty));
    assert!(matches!(
        Clip::new("", vec![0.0], vec![pose.clone(), pose.clone()]),
        Err(ClipError::Count { .. })
    ));
    assert!(matches!(
        Clip::new("", vec![0.0, 0.0], vec![pose.clone(), pose.clone()]),
        Err(ClipError::Time { .. })
    ));
    assert!(matches!(Clip::new("", vec![f64::NAN], vec![pose.clone()]), Err(ClipError::Time { .. })));
    assert!(matches!(Clip::new("", vec![0.0, 1.0], vec![pose, other.rest_pose()]), Err(ClipError::Rig(1))));
}
