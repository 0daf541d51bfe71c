//! Random motions for the unit tests of this folder: every joint motion, terms of every form, all that is beside rows.

use glam::DVec3;
use ikiru_rig::{JointId, Pose, Rate, RateLimit, RatePart};
use ikiru_testkit::rigs::{Random, random_pose, random_rig};

use crate::layout::Layout;
use crate::objective::{Objective, Part, Reads, Rows, Unfit, View};
use crate::objectives::{PoseTarget, Position, RestPose};
use crate::problem::Timeline;
use crate::problem::When;
use crate::problem::motion::MotionProblem;
use crate::state::motion::MotionState;
use crate::words::{Loss, Unit};

/// A point of a joint that does not move from sample to sample, or moves at a steady speed: its first or second difference.
#[derive(Clone, Debug)]
pub(crate) struct Drift {
    pub(crate) joint: JointId,
    pub(crate) point: DVec3,
    pub(crate) n_earlier: usize,
}

impl Objective for Drift {
    fn kind(&self) -> &'static str {
        "drift"
    }
    fn reads(&self, reads: &mut Reads<'_>) -> Result<(), Unfit> {
        reads.frame(self.joint)?;
        reads.earlier(self.n_earlier)?;
        reads.part(Part::new(3, Unit::Metres))
    }
    fn check(&self) -> Result<(), Unfit> {
        Ok(())
    }
    fn evaluate(&self, view: &View<'_>, rows: &mut Rows<'_>) {
        let factors: &[f64] = if self.n_earlier == 1 { &[1.0, -1.0] } else { &[1.0, -2.0, 1.0] };
        let frame = |back: usize| if back == 0 { view.frame(0) } else { view.earlier(back, 0) };
        let arm = |back: usize| frame(back).rotation.apply_constant(self.point).value();
        let at = |(back, factor): (usize, &f64)| *factor * (frame(back).origin.value() + arm(back));
        let drift: DVec3 = factors.iter().enumerate().map(at).sum();
        let first = rows.open(0, drift.to_array());
        if rows.wants_jacobian() {
            for (back, factor) in factors.iter().enumerate() {
                for (i, axis) in DVec3::AXES.into_iter().enumerate() {
                    let out = rows.by_earlier_frame(first + i, back, 0);
                    out[..3].copy_from_slice(&(*factor * axis).to_array());
                    out[3..].copy_from_slice(&(*factor * arm(back).cross(axis)).to_array());
                }
            }
        }
    }
}

/// A joint's origin is inside a cube about the world's origin: three bounds below and three above, of which those of the last
/// axis are closed.
#[derive(Clone, Debug)]
pub(crate) struct Inside {
    pub(crate) joint: JointId,
    pub(crate) reach: f64,
}

impl Objective for Inside {
    fn kind(&self) -> &'static str {
        "inside"
    }
    fn reads(&self, reads: &mut Reads<'_>) -> Result<(), Unfit> {
        reads.frame(self.joint)?;
        reads.part(Part::at_least(3, Unit::Metres))?;
        reads.part(Part::at_least(3, Unit::Metres))
    }
    fn check(&self) -> Result<(), Unfit> {
        Ok(())
    }
    fn evaluate(&self, view: &View<'_>, rows: &mut Rows<'_>) {
        let at = view.frame(0).origin.value();
        for (part, sign) in [(0, 1.0), (1, -1.0)] {
            let first = rows.open(part, [0, 1].map(|axis| self.reach + sign * at[axis]));
            if rows.wants_jacobian() {
                (0..2).for_each(|axis| rows.by_frame(first + axis, 0)[axis] = sign);
            }
        }
    }
}

/// A potential that pulls some joints along their own degrees of freedom, by as much as the number of each says, bent by half
/// of that.
#[derive(Clone, Debug)]
pub(crate) struct Slide {
    pub(crate) joints: Vec<JointId>,
}

impl Objective for Slide {
    fn kind(&self) -> &'static str {
        "slide"
    }
    fn reads(&self, reads: &mut Reads<'_>) -> Result<(), Unfit> {
        self.joints.iter().try_for_each(|joint| reads.motion(*joint))?;
        reads.potential();
        Ok(())
    }
    fn check(&self) -> Result<(), Unfit> {
        Ok(())
    }
    fn evaluate(&self, _: &View<'_>, rows: &mut Rows<'_>) {
        rows.add_value(2.0);
        for motion in 0..self.joints.len() {
            let (slope, curvature) = rows.slope(motion);
            slope.fill(1.0 + motion as f64);
            curvature.fill(0.5 + 0.5 * motion as f64);
        }
    }
}

/// A motion problem, laid out, with a state that holds some motion inside its limits.
pub(crate) struct Case {
    pub(crate) motion: MotionProblem,
    pub(crate) layout: Layout,
    pub(crate) state: MotionState,
}

/// A case by number. With `rates`, speeds and accelerations of its joints are limited to less than they are.
pub(crate) fn case(number: u64, rates: bool) -> Case {
    case_with(number, rates, |_, _| {})
}

/// A case by number with hard terms, bounds of which some count and some are closed, and a potential.
pub(crate) fn case_with_guards(number: u64) -> Case {
    case_with(number, false, |motion, random| {
        let joints: Vec<JointId> = motion.terms().rig().ids().collect();
        let joint = |random: &mut Random| joints[random.below(joints.len())];
        let place = Position::new(joint(random), random.vector(0.5));
        let place = motion.add(1.0, When::At(0.75), place).unwrap();
        motion.term_mut(place).hard = true;
        let reach = random.between(0.2, 0.8);
        let inside = Inside { joint: joint(random), reach };
        let inside = motion.add(1.0, When::Span { from: 0.5, to: 1.0 }, inside).unwrap();
        motion.term_mut(inside).hard = random.below(2) == 0;
        let wish = Inside { joint: joint(random), reach: 0.3 };
        motion.add(3.0, When::Throughout, wish).unwrap();
        let moving: Vec<JointId> = motion.terms().active().collect();
        motion.add(0.2, When::At(0.25), Slide { joints: moving }).unwrap();
    })
}

fn case_with(number: u64, rates: bool, add: impl Fn(&mut MotionProblem, &mut Random)) -> Case {
    let mut random = Random::new(number);
    let rig = random_rig(3 + random.below(6), number);
    let timeline = Timeline::seconds(1.0, 4.0 + random.below(6) as f64).unwrap();
    let mut motion = MotionProblem::whole_body(&rig, timeline);
    motion.set_smoothness([0, 1, 2].map(|_| random.between(0.0, 0.2))).unwrap();
    motion.set_joint_smoothness(JointId::from_index(1), [0.3, 0.0, 0.1]).unwrap();
    motion.set_at_rest(random.below(2) == 0, random.below(2) == 0);
    if random.below(2) == 0 {
        motion.set_even_spacing(0.2).unwrap();
    }
    let joint = |random: &mut Random| JointId::from_index(random.below(rig.n_joints()));
    let loss = [Loss::Squared, Loss::Norm, Loss::Huber { width: 0.2 }][random.below(3)];
    let reach = Position::new(joint(&mut random), random.vector(1.0));
    let reach = motion.add(0.7, When::End, reach).unwrap();
    motion.term_mut(reach).loss = loss;
    let (target, tilt) = (random.vector(0.5), random.rotation());
    motion.add(0.4, When::At(0.5), PoseTarget::new(joint(&mut random), target, tilt)).unwrap();
    let way = random.vector(0.5);
    let led = joint(&mut random);
    motion.add_moving(0.3, When::Throughout, |secs| Position::new(led, target + way * secs)).unwrap();
    if number.is_multiple_of(3) {
        let point = random.vector(0.3);
        let drift = Drift { joint: joint(&mut random), point, n_earlier: 1 + random.below(2) };
        motion.add(0.5, When::Span { from: 0.25, to: 1.0 }, drift).unwrap();
    }
    let joints: Vec<JointId> = motion.terms().active().collect();
    motion.add(0.05, When::Throughout, RestPose::new(&joints, random_pose(&rig, &mut random))).unwrap();
    add(&mut motion, &mut Random::new(number));
    // Samples near each other, as in a motion: half a turn from sample to sample is a corner of the distance.
    let mut poses = vec![random_pose(&rig, &mut random)];
    for t in 1..timeline.n_samples() {
        let mut pose = poses[t - 1].clone();
        let step: Vec<f64> = (0..rig.n_dofs()).map(|_| random.between(-0.3, 0.3)).collect();
        pose.retract(&step).unwrap();
        pose.project();
        poses.push(pose);
    }
    if random.below(2) == 0 {
        motion.fix_start(&poses[0]).unwrap();
    }
    if rates {
        let mut limits = Vec::new();
        for joint in joints {
            for part in
                [RatePart::Rotation, RatePart::Translation].into_iter().filter(|part| part.is_of(&rig, joint))
            {
                limits.push(RateLimit { joint, part, rate: Rate::Speed, most: random.between(0.5, 2.0) });
                limits.push(RateLimit {
                    joint,
                    part,
                    rate: Rate::Acceleration,
                    most: random.between(2.0, 9.0),
                });
            }
        }
        motion.set_rate_limits(&limits).unwrap();
    }
    let mut led = Vec::new();
    motion.led(&mut led);
    let layout = Layout::with(motion.terms(), &led).unwrap();
    let mut state = MotionState::new(&layout, &motion);
    load(&mut state, &layout, &poses);
    if rates {
        state.rate_bounds.begin(0.3);
    }
    Case { motion, layout, state }
}

fn load(state: &mut MotionState, layout: &Layout, poses: &[Pose]) {
    assert!(state.load_still(layout, &poses[0]));
    for (t, pose) in poses.iter().enumerate() {
        assert!(state.load(layout, t, pose).is_some());
    }
}

/// The solution of a dense system, by elimination with pivots: slow, and nothing that the solver uses.
pub(crate) fn eliminate(mut a: Vec<Vec<f64>>, mut b: Vec<f64>) -> Vec<f64> {
    let n = b.len();
    for i in 0..n {
        let pivot = (i..n).max_by(|p, q| a[*p][i].abs().total_cmp(&a[*q][i].abs())).unwrap();
        a.swap(i, pivot);
        b.swap(i, pivot);
        for row in i + 1..n {
            let factor = a[row][i] / a[i][i];
            for column in i..n {
                a[row][column] -= factor * a[i][column];
            }
            b[row] -= factor * b[i];
        }
    }
    for i in (0..n).rev() {
        let known: f64 = (i + 1..n).map(|k| a[i][k] * b[k]).sum();
        b[i] = (b[i] - known) / a[i][i];
    }
    b
}
