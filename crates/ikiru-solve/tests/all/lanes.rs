//! Residuals in lanes: what a lane holds is what its problem gives alone, to the bit, derivatives included.

use glam::DVec3;
use ikiru_rig::{Dual, Frame, JointId, LaneScalar, Lanes, Rotation, Scalar, Vec3};
use ikiru_solve::objectives::PoleVector;
use ikiru_solve::{LaneScratch, Residual};
use ikiru_testkit::allocations::count;
use ikiru_testkit::rigs::Random;

/// Two rows with a branch, in one lane after the other.
#[derive(Clone, Debug)]
struct Leash {
    joints: [JointId; 2],
    length: f64,
}

impl Residual for Leash {
    fn joints(&self) -> &[JointId] {
        &self.joints
    }
    fn n_rows(&self) -> usize {
        2
    }
    fn evaluate<S: Scalar>(&self, frames: &[Frame<S>], residual: &mut [S]) {
        leash(frames, S::from(self.length), residual);
    }
}

/// The same, all lanes at once.
#[derive(Clone, Debug)]
struct SideBySide(Leash);

impl Residual for SideBySide {
    fn joints(&self) -> &[JointId] {
        &self.0.joints
    }
    fn n_rows(&self) -> usize {
        2
    }
    fn evaluate<S: Scalar>(&self, frames: &[Frame<S>], residual: &mut [S]) {
        self.0.evaluate(frames, residual);
    }
    fn evaluate_lanes<S: LaneScalar<N>, const N: usize>(
        lanes: [&Self; N],
        frames: &[Frame<S>],
        residual: &mut [S],
        _: &mut LaneScratch<S::Lane>,
    ) {
        leash(frames, S::gather(lanes.map(|lane| lane.0.length)), residual);
    }
}

/// How far two joints are beyond a length, and the cosine between their y axes while they are within it.
fn leash<S: Scalar>(frames: &[Frame<S>], length: S, residual: &mut [S]) {
    let distance = frames[0].origin.distance(frames[1].origin);
    let is_tight = distance.gt(length);
    residual[0] = S::select(is_tight, distance - length, S::zero());
    residual[1] = S::select(!is_tight, frames[0].rotation.y.dot(frames[1].rotation.y), S::zero());
}

/// Random frames whose numbers also have random derivatives.
fn frames(n_frames: usize, random: &mut Random) -> Vec<Frame<Dual<6>>> {
    let frame = |random: &mut Random| Frame {
        rotation: Rotation::constant(random.rotation()),
        origin: Vec3::constant(random.vector(1.0)),
    };
    (0..n_frames)
        .map(|_| {
            frame(random).map(|number: Dual<6>| Dual {
                derivatives: [0; 6].map(|_| random.between(-1.0, 1.0)),
                ..number
            })
        })
        .collect()
}

/// Asks that the lanes of a residual hold what each of its own gives alone; says how many rows are 0 and are not.
fn assert_lanes_are_alone<R: Residual>(lanes: [&R; 3], random: &mut Random) -> [usize; 2] {
    let (n_frames, n_rows) = (lanes[0].joints().len(), lanes[0].n_rows());
    let alone = [0; 3].map(|_| frames(n_frames, random));
    let mut dual_frames = vec![Frame::<Dual<6, Lanes<3>>>::identity(); n_frames];
    for (lane, alone) in alone.iter().enumerate() {
        for (frame, alone) in dual_frames.iter_mut().zip(alone) {
            let r = &mut frame.rotation;
            for (column, alone) in [
                (&mut r.x, alone.rotation.x),
                (&mut r.y, alone.rotation.y),
                (&mut r.z, alone.rotation.z),
                (&mut frame.origin, alone.origin),
            ] {
                column.x.set_lane(lane, alone.x);
                column.y.set_lane(lane, alone.y);
                column.z.set_lane(lane, alone.z);
            }
        }
    }
    let plain_frames: Vec<_> = dual_frames.iter().map(|frame| frame.map(|number| number.value)).collect();
    // What was in the memory before may not matter.
    let mut residual = vec![Lanes([f64::NAN; 3]); n_rows];
    let mut dual_residual = vec![Dual::<6, Lanes<3>>::from(f64::NAN); n_rows];
    R::evaluate_lanes(lanes, &plain_frames, &mut residual, &mut LaneScratch::default());
    R::evaluate_lanes(lanes, &dual_frames, &mut dual_residual, &mut LaneScratch::default());
    let mut zeros = [0; 2];
    for (lane, alone) in alone.iter().enumerate() {
        let mut expected = vec![f64::NAN; n_rows];
        let plain: Vec<_> = alone.iter().map(|frame| frame.map(|number| number.value)).collect();
        Residual::evaluate(lanes[lane], &plain, &mut expected);
        let mut dual_expected = vec![Dual::from(f64::NAN); n_rows];
        Residual::evaluate(lanes[lane], alone, &mut dual_expected);
        for row in 0..n_rows {
            let dual = dual_residual[row].lane(lane);
            assert_eq!(residual[row].lane(lane).to_bits(), expected[row].to_bits());
            assert_eq!(dual.value.to_bits(), expected[row].to_bits());
            assert_eq!(dual.derivatives.map(f64::to_bits), dual_expected[row].derivatives.map(f64::to_bits));
            zeros[usize::from(expected[row] != 0.0)] += 1;
        }
    }
    zeros
}

#[test]
fn a_lane_is_its_problem_alone_to_the_bit() {
    let mut random = Random::new(3);
    let joints = [0, 1, 2].map(JointId::from_index);
    let mut zeros = [0; 2];
    for _ in 0..200 {
        let leashes =
            [0; 3].map(|_| Leash { joints: [joints[0], joints[1]], length: random.between(0.1, 2.0) });
        let seen = assert_lanes_are_alone(leashes.each_ref(), &mut random);
        zeros = [zeros[0] + seen[0], zeros[1] + seen[1]];
        let together = leashes.map(SideBySide);
        assert_lanes_are_alone(together.each_ref(), &mut random);
        let poles = [0; 3].map(|_| PoleVector { joints, target: random.vector(2.0) });
        assert_lanes_are_alone(poles.each_ref(), &mut random);
        // The same one in all lanes: many poses of one problem.
        assert_lanes_are_alone([&poles[0]; 3], &mut random);
    }
    assert!(zeros[0] > 200 && zeros[1] > 200, "{zeros:?}");
}

#[test]
fn a_limb_without_a_side_does_not_touch_the_lanes_beside_it() {
    let joints = [0, 1, 2].map(JointId::from_index);
    let at = |points: [DVec3; 3]| points.map(|p| Frame { origin: p.into(), ..Frame::identity() });
    let bent = at([DVec3::ZERO, DVec3::new(0.3, 0.1, 0.0), DVec3::new(0.6, 0.0, 0.0)]);
    let folded = at([DVec3::ZERO; 3]);
    let pole = PoleVector { joints, target: DVec3::new(0.1, 0.4, 0.7) };
    let frames = [0, 1, 2].map(|i| Frame {
        origin: Vec3 {
            x: Lanes([bent[i].origin.x, folded[i].origin.x]),
            y: Lanes([bent[i].origin.y, folded[i].origin.y]),
            z: Lanes([bent[i].origin.z, folded[i].origin.z]),
        },
        ..Frame::identity()
    });
    let (mut lanes, mut alone) = ([Lanes::zero()], [0.0]);
    // The source itself over lanes, whose second divides by a length of 0.
    Residual::evaluate(&pole, &frames, &mut lanes);
    Residual::evaluate(&pole, &bent, &mut alone);
    assert!(alone[0].abs() > 0.1);
    assert_eq!(lanes[0].0, [alone[0], 0.0]);
}

#[test]
fn warm_lanes_do_not_allocate() {
    let mut random = Random::new(5);
    let leash = Leash { joints: [0, 1].map(JointId::from_index), length: 0.5 };
    let frames: Vec<Frame<Lanes<4>>> =
        frames(2, &mut random).iter().map(|frame| frame.map(|number| Lanes([number.value; 4]))).collect();
    let (mut residual, mut scratch) = ([Lanes::zero(); 2], LaneScratch::default());
    let mut evaluate = || Residual::evaluate_lanes([&leash; 4], &frames, &mut residual, &mut scratch);
    assert!(count(&mut evaluate) > 0, "nothing is counted");
    assert_eq!(count(&mut evaluate), 0);
}
