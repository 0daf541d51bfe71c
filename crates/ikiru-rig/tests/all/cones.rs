//! Cones, with a centre and without, judged by the shortest arc of their axis and what remains of the rotation.
#![allow(clippy::unwrap_used, reason = "a test that cannot go on fails")]

use std::f64::consts::PI;

use glam::{DQuat, DVec2, DVec3};
use ikiru_rig::{Cone, ConeCentre, ConeError, Joint, JointId, JointMotion, Pose, Range, Rig, RigBuilder};
use ikiru_testkit::cones::{cone_excess, largest_cone_excess, limited_rotation, swing_and_twist};
use ikiru_testkit::reference::world_matrices;
use ikiru_testkit::rigs::Random;

const N_CASES: usize = 2000;

/// A cone without corners at π, with a centre in three of four cases.
fn random_cone(random: &mut Random) -> Cone {
    let swing = [random.between(0.1, 3.0), random.between(0.1, 3.0)];
    let twist = Range::new(random.between(-3.0, -0.1), random.between(0.1, 3.0));
    let cone = Cone::new(random.rotation() * DVec3::Y, swing, twist).unwrap();
    let centre = match random.below(4) {
        0 => return cone,
        1 => ConeCentre { parent_rotation: random.rotation(), ..ConeCentre::default() },
        2 => ConeCentre { joint_rotation: random.rotation(), ..ConeCentre::default() },
        _ => ConeCentre { parent_rotation: random.rotation(), joint_rotation: random.rotation() },
    };
    cone.with_centre(centre).unwrap()
}

fn ball(rest: DQuat, cone: Cone) -> Rig {
    let mut builder = RigBuilder::new();
    let mut joint = Joint::new("ball", None);
    (joint.rest_rotation, joint.motion) = (rest, JointMotion::Ball { cone: Some(cone) });
    builder.add(joint);
    builder.build().unwrap()
}

fn pose_of(rig: &Rig, q: DQuat) -> Pose {
    let mut pose = rig.rest_pose();
    pose.set_rotation(JointId::from_index(0), q).unwrap();
    pose
}

/// The cone as the rig has it, with the joint's rest rotation.
fn cone_of(rig: &Rig) -> Cone {
    *rig.joints()[0].motion.cone().unwrap()
}

#[test]
fn what_is_inside_stays_and_what_is_outside_goes_to_the_nearest_of_the_edge() {
    let mut random = Random::new(1);
    let (mut n_inside, mut n_outside) = (0, 0);
    for case in 0..N_CASES {
        let (cone, rest, q) = (random_cone(&mut random), random.rotation(), random.rotation());
        let rig = ball(rest, cone);
        let before = pose_of(&rig, q);
        let mut after = before.clone();
        let moved = after.project();
        let read = |pose: &Pose| {
            swing_and_twist(
                &cone,
                limited_rotation(&cone, rest, pose.rotation(JointId::from_index(0)).unwrap()),
            )
        };
        let ((swing, twist), (swing_after, twist_after)) = (read(&before), read(&after));
        let (widths, range) = (DVec2::from(cone.swing()), cone.twist());
        let (swings_out, twists_out) = ((swing / widths).length() > 1.0, range.distance(twist) > 0.0);
        assert_eq!(moved, swings_out || twists_out, "case {case}");
        assert!(largest_cone_excess(&after) < 1e-9, "case {case}: {}", largest_cone_excess(&after));
        if !moved {
            assert_eq!(before, after, "case {case}");
            n_inside += 1;
            continue;
        }
        n_outside += 1;
        if swings_out {
            assert!(((swing_after / widths).length() - 1.0).abs() < 1e-9, "case {case}");
            let nearest = (0..720).map(|i| DVec2::from_angle(f64::from(i) * PI / 360.0) * widths);
            let nearest = nearest.map(|edge| edge.distance(swing)).fold(f64::INFINITY, f64::min);
            assert!(swing.distance(swing_after) <= nearest + 1e-9, "case {case}");
        } else {
            assert!(swing.distance(swing_after) < 1e-9, "case {case}");
        }
        let around = |a: f64, b: f64| (a - b).abs().min(2.0 * PI - (a - b).abs());
        let ends = [range.min, range.max];
        let wanted = if around(twist, ends[0]) <= around(twist, ends[1]) { ends[0] } else { ends[1] };
        let wanted = if twists_out { wanted } else { twist };
        assert!(around(twist_after, wanted) < 1e-8, "case {case}: {twist_after}, not {wanted}");
    }
    assert!(n_inside > 100 && n_outside > 100, "{n_inside} inside, {n_outside} outside");
}

#[test]
fn distances_and_margins_are_those_of_swing_and_twist() {
    let mut random = Random::new(2);
    for case in 0..N_CASES {
        let (cone, rest) = (random_cone(&mut random), random.rotation());
        let rig = ball(rest, cone);
        let pose = pose_of(&rig, random.rotation());
        let joint = JointId::from_index(0);
        let (violation, excess) = (pose.limit_violation(), cone_excess(&pose, joint));
        // The way along the ray is no shorter than the shortest, and at most so many times as long.
        let [a, b] = cone.swing();
        let ratio = a.max(b) / a.min(b);
        assert!(violation <= excess + 1e-9 && excess <= ratio * violation + 1e-9, "case {case}");
        let q = pose.rotation(joint).unwrap();
        let (swing, twist) = swing_and_twist(&cone, limited_rotation(&cone, rest, q));
        let [swing_margin, twist_margin] = cone_of(&rig).margin(q);
        assert_eq!(swing_margin < 0.0, (swing / DVec2::new(a, b)).length() > 1.0, "case {case}");
        let inside = (twist - cone.twist().min).min(cone.twist().max - twist);
        assert!(inside < 0.0 || (twist_margin - inside).abs() < 1e-7, "case {case}: {twist_margin} {inside}");
    }
}

#[test]
fn swings_and_twists_are_composed_to_the_rotation_that_has_them() {
    let mut random = Random::new(3);
    for case in 0..N_CASES {
        let (cone, rest) = (random_cone(&mut random), random.rotation());
        let of_rig = cone_of(&ball(rest, cone));
        let swing = DVec2::from_angle(random.between(0.0, 2.0 * PI)) * random.between(0.0, 3.0);
        let twist = random.between(-3.0, 3.0);
        let q = of_rig.compose(swing.to_array(), twist);
        let (found, found_twist) = swing_and_twist(&cone, limited_rotation(&cone, rest, q));
        assert!(found.distance(swing) < 1e-9 && (found_twist - twist).abs() < 1e-9, "case {case}");
        let (found, found_twist) = of_rig.decompose(q);
        assert!(DVec2::from(found).distance(swing) < 1e-9 && (found_twist - twist).abs() < 1e-9);
    }
}

/// A cone at one of its rotations, read by what shares no code with it.
struct At {
    cone: Cone,
    rest: DQuat,
    q: DQuat,
}

impl At {
    const STEP: f64 = 1e-4;

    /// The level of the swing (1 at its edge) and the twist, a turn away.
    fn read(&self, turn: DVec3) -> [f64; 2] {
        let turned = self.q * DQuat::from_scaled_axis(turn);
        let l = limited_rotation(&self.cone, self.rest, turned);
        let (swing, twist) = swing_and_twist(&self.cone, l);
        [(swing / DVec2::from(self.cone.swing())).length(), twist]
    }

    /// How fast both grow along an axis, and how fast that growth does.
    fn slopes(&self, axis: DVec3) -> [[f64; 2]; 2] {
        let [behind, here, ahead] = [-1.0, 0.0, 1.0].map(|side| self.read(axis * side * Self::STEP));
        [
            [0, 1].map(|i| (ahead[i] - behind[i]) / (2.0 * Self::STEP)),
            [0, 1].map(|i| (ahead[i] - 2.0 * here[i] + behind[i]) / Self::STEP.powi(2)),
        ]
    }

    /// The gradients of level and twist.
    fn gradients(&self) -> [DVec3; 2] {
        let slopes = DVec3::AXES.map(|axis| self.slopes(axis)[0]);
        [0, 1].map(|i| DVec3::from(slopes.map(|slope| slope[i])))
    }
}

#[test]
fn the_tangent_box_slides_along_the_limits_that_are_near() {
    let mut random = Random::new(4);
    let (mut n_checked, mut n_bent) = (0, 0);
    for case in 0..N_CASES {
        let (cone, rest) = (random_cone(&mut random), random.rotation());
        let rig = ball(rest, cone);
        let of_rig = cone_of(&rig);
        let (widths, range) = (DVec2::from(cone.swing()), cone.twist());
        let edge = DVec2::from_angle(random.between(0.0, 2.0 * PI)) * widths;
        if edge.length() > 2.8 || range.max - range.min < 0.2 {
            continue;
        }
        let inside = range.min + (range.max - range.min) * random.between(0.2, 0.8);
        for (swing, twist) in [(edge, inside), (edge * 0.5, range.max), (edge, range.min)] {
            let (near_swing, near_twist) = (swing == edge, twist != inside);
            let q = of_rig.compose(swing.to_array(), twist);
            let at = At { cone, rest, q };
            let (found, [of_level, of_twist]) = (of_rig.tangent_box(q), at.gradients());
            for (i, reader) in found.readers.iter().enumerate() {
                assert!((found.axes[i].length() - 1.0).abs() < 1e-12, "case {case}");
                for (j, axis) in found.axes.iter().enumerate() {
                    assert!((reader.dot(*axis) - f64::from(u8::from(i == j))).abs() < 1e-12, "case {case}");
                }
            }
            // Each axis but that of a limit leaves the limit, and there it begins.
            let is_flat = |gradient: DVec3, axis: usize| {
                gradient.dot(found.axes[axis]).abs() < 1e-5 * gradient.length()
            };
            let ends = |axis: usize, gradient: DVec3, [down, up]: [f64; 2]| {
                let rate = gradient.dot(found.axes[axis]);
                let [down, up] = [down / rate, up / rate];
                let (found_down, found_up) = found.room[axis];
                let same = |a: f64, b: f64| a == b || (a - b).abs() < 1e-5 * (1.0 + b.abs());
                assert!(
                    same(found_down, down) && same(found_up, up),
                    "case {case}: {:?} {down} {up}",
                    found.room
                );
            };
            let twist_room = [range.min - twist, range.max - twist];
            let (swing_axis, twist_axis) = if near_swing { (0, 1) } else { (1, 0) };
            if near_swing {
                assert!(is_flat(of_level, 1) && is_flat(of_level, 2), "case {case}");
                ends(0, of_level, [f64::NEG_INFINITY, 0.0]);
            }
            if near_twist {
                assert!(is_flat(of_twist, swing_axis) && is_flat(of_twist, 2), "case {case}");
            }
            ends(twist_axis, of_twist, twist_room);
            // Along the edge it falls back.
            for axis in 0..3 {
                let bend = at.slopes(found.axes[axis])[1][0] / of_level.length();
                let wanted = if near_swing && !near_twist && axis > 0 {
                    bend.clamp(0.0, 1e3)
                } else {
                    found.bends[axis]
                };
                assert!(
                    (found.bends[axis] - wanted).abs() < 1e-3 * (1.0 + wanted),
                    "case {case}: {:?} {wanted}",
                    found.bends
                );
                n_bent += usize::from(wanted > 0.01);
            }
            assert!(near_swing || found.bends == [0.0; 3]);
            // The normals are the gradients, outward.
            let normals = of_rig.normals(q, 1e-7);
            let outward = if twist == range.min { -of_twist } else { of_twist };
            // Straight out of the edge the level grows by the length of its slope in the plane of the swing.
            let straight = (swing / (widths * widths)).length();
            for (normal, outward, rate, is_near) in [
                (normals[0], of_level, of_level.length() / straight, near_swing),
                (normals[2], outward, of_twist.length(), near_twist),
            ] {
                assert_eq!(normal.is_some(), is_near, "case {case}");
                let Some(normal) = normal else { continue };
                assert!(
                    normal.direction.distance(outward.normalize()) < 1e-5 && !normal.both_ways,
                    "case {case}"
                );
                assert!((normal.rate - rate).abs() < 1e-5 * rate, "case {case}: {} {rate}", normal.rate);
            }
        }
        n_checked += 1;
    }
    assert!(n_checked > N_CASES / 3 && n_bent > n_checked, "{n_checked}, {n_bent}");
}

/// A tree of balls in centred cones.
fn tree(random: &mut Random) -> Rig {
    let mut builder = RigBuilder::new();
    for idx in 0..6 {
        let parent = (idx > 0).then(|| JointId::from_index(random.below(idx)));
        let mut joint = Joint::new(format!("ball_{idx}"), parent);
        joint.rest_translation = random.vector(0.4);
        joint.rest_rotation = random.rotation();
        let centre = ConeCentre { parent_rotation: random.rotation(), joint_rotation: random.rotation() };
        let cone = random_cone(random).with_centre(centre).unwrap();
        joint.motion = if idx == 0 {
            JointMotion::Free { cone: Some(cone) }
        } else {
            JointMotion::Ball { cone: Some(cone) }
        };
        builder.add(joint);
    }
    builder.build().unwrap()
}

fn centre_mut(joint: &mut Joint, change: impl FnOnce(ConeCentre) -> ConeCentre) {
    if let JointMotion::Ball { cone: Some(cone) } | JointMotion::Free { cone: Some(cone) } = &mut joint.motion
    {
        *cone = cone.with_centre(change(cone.centre().unwrap())).unwrap();
    }
}

#[track_caller]
fn same_place(a: &Pose, b: &Pose, turned: &[DQuat]) {
    for ((a, b), turn) in world_matrices(a).into_iter().zip(world_matrices(b)).zip(turned) {
        let b = b * glam::DMat4::from_quat(turn.inverse());
        assert!(a.abs_diff_eq(b, 1e-9), "{a} {b}");
    }
}

#[test]
fn rerolled_axes_leave_the_poses_that_are_allowed() {
    let mut random = Random::new(5);
    let mut n_moved = 0;
    for _ in 0..100 {
        let rig = tree(&mut random);
        // Each joint's own axes are turned, and P and K with them.
        let turns: Vec<DQuat> = (0..rig.n_joints()).map(|_| random.rotation()).collect();
        let mut builder = rig.to_builder();
        for (joint, turn) in builder.joints_mut().iter_mut().zip(&turns) {
            let above = joint.parent.map_or(DQuat::IDENTITY, |parent| turns[parent.index()]).inverse();
            joint.rest_rotation = above * joint.rest_rotation * *turn;
            joint.rest_translation = above * joint.rest_translation;
            centre_mut(joint, |centre| ConeCentre {
                parent_rotation: above * centre.parent_rotation,
                joint_rotation: turn.inverse() * centre.joint_rotation,
            });
        }
        let rerolled = builder.build().unwrap();
        let (mut a, mut b) = (rig.rest_pose(), rerolled.rest_pose());
        for (joint, turn) in rig.ids().zip(&turns) {
            let q = random.rotation();
            a.set_rotation(joint, q).unwrap();
            b.set_rotation(joint, turn.inverse() * q * *turn).unwrap();
        }
        same_place(&a, &b, &turns);
        for joint in rig.ids() {
            assert!(
                (a.limit_violation_of(joint).unwrap() - b.limit_violation_of(joint).unwrap()).abs() < 1e-9
            );
        }
        let moved = (a.project(), b.project());
        assert_eq!(moved.0, moved.1);
        n_moved += usize::from(moved.0);
        same_place(&a, &b, &turns);
        for (joint, turn) in rig.ids().zip(&turns) {
            let of = |rig: &Rig, pose: &Pose| {
                rig.joints()[joint.index()].motion.cone().unwrap().tangent_box(pose.rotation(joint).unwrap())
            };
            let (ours, theirs) = (of(&rig, &a), of(&rerolled, &b));
            for axis in 0..3 {
                assert!((turn.inverse() * ours.axes[axis]).distance(theirs.axes[axis]) < 1e-6);
            }
            for (ours, theirs) in ours.bends.into_iter().zip(theirs.bends) {
                assert!((ours - theirs).abs() < 1e-6 * (1.0 + ours));
            }
        }
    }
    assert!(n_moved > 50, "{n_moved}");
}

#[test]
fn another_rest_pose_leaves_the_poses_that_are_allowed() {
    let mut random = Random::new(6);
    for _ in 0..100 {
        let rig = tree(&mut random);
        // As an A-pose beside a T-pose: the same body, whose numbers count from elsewhere. The builder folds anew.
        let turns: Vec<DQuat> = (0..rig.n_joints()).map(|_| random.rotation()).collect();
        let mut builder = rig.to_builder();
        for (joint, turn) in builder.joints_mut().iter_mut().zip(&turns) {
            joint.rest_rotation *= *turn;
        }
        let other = builder.build().unwrap();
        let (mut a, mut b) = (rig.rest_pose(), other.rest_pose());
        for (joint, turn) in rig.ids().zip(&turns) {
            let q = random.rotation();
            a.set_rotation(joint, q).unwrap();
            b.set_rotation(joint, turn.inverse() * q).unwrap();
        }
        let stay = vec![DQuat::IDENTITY; rig.n_joints()];
        assert_eq!(a.project(), b.project());
        same_place(&a, &b, &stay);
    }
}

#[test]
fn the_rest_rotation_and_the_identity_are_the_centre_of_a_cone_without_one() {
    let mut random = Random::new(7);
    for _ in 0..200 {
        let rest = random.rotation();
        let bare = Cone::new(random.rotation() * DVec3::Y, [0.8, 0.4], Range::new(-0.5, 0.3)).unwrap();
        let centred =
            bare.with_centre(ConeCentre { parent_rotation: rest, ..ConeCentre::default() }).unwrap();
        assert_eq!(
            (bare.centre(), centred.centre().map(|c| c.joint_rotation)),
            (None, Some(DQuat::IDENTITY))
        );
        let q = random.rotation();
        let [mut a, mut b] = [bare, centred].map(|cone| pose_of(&ball(rest, cone), q));
        assert_eq!(a.project(), b.project());
        let joint = JointId::from_index(0);
        assert!(a.rotation(joint).unwrap().dot(b.rotation(joint).unwrap()).abs() > 1.0 - 1e-12);
    }
}

#[test]
fn a_floating_root_keeps_the_centre_of_its_cone() {
    let mut random = Random::new(8);
    let centre = ConeCentre { parent_rotation: random.rotation(), joint_rotation: random.rotation() };
    let cone = Cone::new(DVec3::Y, [0.8, 0.4], Range::new(-0.5, 0.3)).unwrap().with_centre(centre).unwrap();
    let mut builder = ball(random.rotation(), cone).to_builder();
    builder.free_root().unwrap();
    let floating = builder.build().unwrap();
    assert_eq!(cone_of(&floating).centre(), cone.centre());
    for _ in 0..100 {
        let mut pose = pose_of(&floating, random.rotation());
        pose.project();
        assert!(largest_cone_excess(&pose) < 1e-9);
    }
}

#[test]
fn a_centre_has_any_length_but_none_that_is_0_or_not_finite() {
    let cone = Cone::new(DVec3::Y, [0.8, 0.4], Range::new(-0.5, 0.3)).unwrap();
    let unit = DQuat::from_xyzw(0.5, -0.5, 0.5, 0.5);
    for length in [1e-200, 0.3, 1.0, 1e200] {
        let centre = ConeCentre { parent_rotation: unit * length, joint_rotation: unit * -length };
        let found = cone.with_centre(centre).unwrap().centre().unwrap();
        assert!(
            found.parent_rotation.abs_diff_eq(unit, 1e-15) && found.joint_rotation.abs_diff_eq(-unit, 1e-15)
        );
    }
    for bad in [DQuat::from_xyzw(0.0, 0.0, 0.0, 0.0), DQuat::from_xyzw(f64::NAN, 0.0, 0.0, 1.0)] {
        let parent = ConeCentre { parent_rotation: bad, ..ConeCentre::default() };
        let joint = ConeCentre { joint_rotation: bad, ..ConeCentre::default() };
        assert!(matches!(cone.with_centre(parent), Err(ConeError::Centre("parent_rotation", _))));
        assert!(matches!(cone.with_centre(joint), Err(ConeError::Centre("joint_rotation", _))));
    }
}
