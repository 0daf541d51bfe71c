//! A course by sines: the G1, every hinge to and fro inside its range, the body about where it stands.

use ikiru_rig::{JointId, JointMotion, Pose, Rig};
use rand::{Rng, SeedableRng};
use rand_xoshiro::Xoshiro256PlusPlus;

use crate::error::Error;
use crate::track::course::{Course, Source};

/// The links of the G1 that have pose targets.
const LED: [&str; 6] = [
    "pelvis",
    "torso_link",
    "left_wrist_yaw_link",
    "right_wrist_yaw_link",
    "left_ankle_roll_link",
    "right_ankle_roll_link",
];
/// How far, as a part of a range or of `BASE`: at most this, at least 0.3 of it.
const AMPLITUDE: f64 = 0.3;
/// How far the base goes along and about each axis, metres and radians.
const BASE: f64 = 0.2;
/// Radians a second.
const SPEEDS: (f64, f64) = (1.0, 5.0);
/// What a range is taken to be that has no ends, radians to either side.
const UNLIMITED: f64 = 1.0;

/// One degree of freedom: middle, amplitude, radians a second, phase.
#[derive(Clone, Copy, Debug)]
struct Sine {
    middle: f64,
    amplitude: f64,
    speed: f64,
    phase: f64,
}

impl Sine {
    fn new(middle: f64, most: f64, random: &mut Xoshiro256PlusPlus) -> Self {
        let amplitude = most * random.gen_range(0.3..1.0);
        let speed = random.gen_range(SPEEDS.0..SPEEDS.1);
        Self { middle, amplitude, speed, phase: random.gen_range(0.0..std::f64::consts::TAU) }
    }

    fn at(&self, secs: f64) -> f64 {
        self.middle + self.amplitude * (self.speed * secs + self.phase).sin()
    }
}

impl Course {
    /// The Unitree G1 with a floating base: 29 hinges, six pose targets, a pull to the middle of the sines. With some seeds the
    /// arms, which the wrists' poses leave one degree of freedom each, are led against their limits and stay behind for a while.
    ///
    /// # Errors
    /// Nothing that should happen with the rig that ships.
    pub fn g1(seed: u64, rate_hz: f64, n_frames: usize) -> Result<Self, Error> {
        let fixed = ikiru_formats::read("builtin:g1")?.rig;
        let mut builder = fixed.to_builder();
        let root = builder.free_root().map_err(Error::course)?;
        let rig = builder.build().map_err(Error::course)?;
        let mut random = Xoshiro256PlusPlus::seed_from_u64(seed);
        let base: Vec<Sine> = (0..6).map(|_| Sine::new(0.0, BASE, &mut random)).collect();
        let hinges: Vec<(JointId, Sine)> =
            rig.ids().filter_map(|joint| sine(&rig, joint, &mut random)).collect();
        let targets = LED.map(|name| rig.joint(name).map(|joint| (joint, true)).map_err(Error::course));
        let targets = targets.into_iter().collect::<Result<_, _>>()?;
        let mut rest = rig.rest_pose();
        for (joint, sine) in &hinges {
            rest.set_value(*joint, sine.middle).map_err(Error::course)?;
        }
        let pose = |secs: f64| {
            let mut pose = rig.rest_pose();
            let mut tangent = vec![0.0; rig.n_dofs()];
            for (dof, sine) in rig.dofs_of(root).zip(&base) {
                tangent[dof] = sine.at(secs);
            }
            pose.retract(&tangent).map_err(Error::course)?;
            for (joint, sine) in &hinges {
                pose.set_value(*joint, sine.at(secs)).map_err(Error::course)?;
            }
            Ok::<Pose, Error>(pose)
        };
        Self::new(&Source { name: "G1, sines".to_owned(), rate_hz, n_frames, targets, rest }, &rig, pose)
    }
}

/// How a hinge goes; nothing for other joints.
fn sine(rig: &Rig, joint: JointId, random: &mut Xoshiro256PlusPlus) -> Option<(JointId, Sine)> {
    let JointMotion::Hinge { range, .. } = rig.get(joint)?.motion else { return None };
    let (min, max) = if range.min.is_finite() && range.max.is_finite() {
        (range.min, range.max)
    } else {
        (-UNLIMITED, UNLIMITED)
    };
    let most = AMPLITUDE * (max - min);
    Some((joint, Sine::new(0.5 * (min + max), most, random)))
}
