//! Small and random rigs.

use std::f64::consts::PI;

use glam::{DQuat, DVec3};
use ikiru_rig::{
    Clip, Cone, ConeCentre, EulerOrder, Joint, JointId, JointMotion, Mimic, Pose, Range, Rig, RigBuilder,
};
use proptest::prelude::*;

/// A small deterministic generator (splitmix64), for tests that need many numbers rather than shrinking.
#[derive(Clone, Debug)]
pub struct Random(u64);

impl Random {
    /// A generator that always gives the same numbers for the same seed.
    #[must_use]
    pub fn new(seed: u64) -> Self {
        Self(seed)
    }

    /// The next 64 bits.
    pub fn bits(&mut self) -> u64 {
        self.0 = self.0.wrapping_add(0x9E37_79B9_7F4A_7C15);
        let mut z = self.0;
        z = (z ^ (z >> 30)).wrapping_mul(0xBF58_476D_1CE4_E5B9);
        z = (z ^ (z >> 27)).wrapping_mul(0x94D0_49BB_1331_11EB);
        z ^ (z >> 31)
    }

    /// Uniform in `[0, 1)`.
    pub fn unit(&mut self) -> f64 {
        (self.bits() >> 11) as f64 / (1u64 << 53) as f64
    }

    /// Uniform between two numbers.
    pub fn between(&mut self, low: f64, high: f64) -> f64 {
        low + (high - low) * self.unit()
    }

    /// Uniform below `n`.
    pub fn below(&mut self, n: usize) -> usize {
        (self.bits() % n.max(1) as u64) as usize
    }

    /// Each component uniform in `[-size, size)`.
    pub fn vector(&mut self, size: f64) -> DVec3 {
        DVec3::new(self.between(-size, size), self.between(-size, size), self.between(-size, size))
    }

    /// A uniform rotation.
    pub fn rotation(&mut self) -> DQuat {
        loop {
            let q = DQuat::from_xyzw(
                self.between(-1.0, 1.0),
                self.between(-1.0, 1.0),
                self.between(-1.0, 1.0),
                self.between(-1.0, 1.0),
            );
            if (0.01..1.0).contains(&q.length_squared()) {
                return q.normalize();
            }
        }
    }
}

/// A random tree of `n_joints` joints with every kind of motion and limit in turn, mimic joints included. Half of the
/// cones have a centre of their own.
#[must_use]
pub fn random_rig(n_joints: usize, seed: u64) -> Rig {
    let mut random = Random::new(seed);
    // Numbers of their own, so that all else is as it is without them.
    let mut of_centres = Random::new(!seed);
    let mut builder = RigBuilder::new();
    let mut scalars: Vec<JointId> = Vec::new();
    for idx in 0..n_joints.max(1) {
        let parent = (idx > 0 && random.unit() > 0.05)
            .then(|| JointId::from_index(if random.unit() < 0.7 { idx - 1 } else { random.below(idx) }));
        let mut joint = Joint::new(format!("joint_{idx}"), parent);
        joint.rest_translation = random.vector(0.4);
        if random.unit() < 0.6 {
            joint.rest_rotation = random.rotation();
        }
        let axis = if random.unit() < 0.5 {
            [DVec3::X, DVec3::Y, DVec3::Z][random.below(3)]
        } else {
            random.rotation() * DVec3::X
        };
        joint.motion = match (idx + random.below(2)) % 7 {
            0 => JointMotion::Fixed,
            1 => JointMotion::Hinge { axis, range: random_range(&mut random) },
            2 => JointMotion::Slider { axis, range: Range::new(-0.2, random.between(0.0, 0.3)) },
            3 => JointMotion::Euler {
                order: EulerOrder::ALL[random.below(6)],
                ranges: [random_range(&mut random), random_range(&mut random), random_range(&mut random)],
            },
            4 => JointMotion::Ball { cone: random_cone(&mut random, &mut of_centres) },
            5 => JointMotion::Free { cone: random_cone(&mut random, &mut of_centres) },
            _ => JointMotion::BALL,
        };
        if matches!(joint.motion, JointMotion::Hinge { .. } | JointMotion::Slider { .. }) {
            if !scalars.is_empty() && random.unit() < 0.3 {
                let leader = scalars[random.below(scalars.len())];
                let multiplier = random.between(-1.5, 1.5);
                joint.mimic = Some(Mimic { leader, multiplier, offset: random.between(-0.2, 0.2) });
                if let JointMotion::Hinge { range, .. } | JointMotion::Slider { range, .. } =
                    &mut joint.motion
                {
                    *range = Range::UNLIMITED;
                }
            } else {
                scalars.push(JointId::from_index(idx));
            }
        }
        builder.add(joint);
    }
    #[expect(clippy::expect_used, reason = "a generator that fails is a defect of the test kit")]
    builder.build().expect("the random rig is valid")
}

fn random_range(random: &mut Random) -> Range {
    if random.unit() < 0.2 {
        return Range::UNLIMITED;
    }
    let low = random.between(-2.5, 0.5);
    Range::new(low, low + random.between(0.05, 3.0))
}

fn random_cone(random: &mut Random, of_centres: &mut Random) -> Option<Cone> {
    let axis = random.rotation() * DVec3::Y;
    let swing = [random.between(0.2, PI), random.between(0.2, PI)];
    let twist = Range::new(random.between(-PI, 0.0), random.between(0.0, PI));
    let cone = Cone::new(axis, swing, twist).ok().filter(|_| random.unit() < 0.7)?;
    if of_centres.unit() < 0.5 {
        return Some(cone);
    }
    let centre = ConeCentre { parent_rotation: of_centres.rotation(), joint_rotation: of_centres.rotation() };
    cone.with_centre(centre).ok()
}

/// A random pose inside the limits. Unlimited angles lie within ±π, translations within half a metre.
#[must_use]
pub fn random_pose(rig: &Rig, random: &mut Random) -> Pose {
    let mut pose = rig.rest_pose();
    for id in rig.ids() {
        let joint = &rig.joints()[id.index()];
        if joint.mimic.is_some() {
            continue;
        }
        let mut draw = |range: &Range| random.between(range.min.max(-PI), range.max.min(PI));
        // Setting what a joint has, to finite numbers, cannot fail.
        let _ = match &joint.motion {
            JointMotion::Fixed => Ok(()),
            JointMotion::Hinge { range, .. } | JointMotion::Slider { range, .. } => {
                pose.set_value(id, draw(range))
            }
            JointMotion::Euler { ranges, .. } => {
                let angles = [draw(&ranges[0]), draw(&ranges[1]), draw(&ranges[2])];
                pose.set_euler(id, angles)
            }
            JointMotion::Ball { .. } => pose.set_rotation(id, random.rotation()),
            JointMotion::Free { .. } => {
                let translation = random.vector(0.5);
                pose.set_rotation(id, random.rotation()).and_then(|()| pose.set_translation(id, translation))
            }
        };
    }
    pose.project();
    pose
}

/// Random rigs of up to `most` joints, each with a seed for more random numbers.
pub fn rigs(most: usize) -> impl Strategy<Value = (Rig, u64)> {
    (1..=most, any::<u64>()).prop_map(|(n, seed)| (random_rig(n, seed), seed ^ 0x5555))
}

/// A clip of poses at uneven times, each near the one before, so that no turn is ambiguous.
#[must_use]
#[expect(clippy::expect_used, reason = "a generator that fails is a defect of the test kit")]
pub fn random_walk(rig: &Rig, n: usize, seed: u64) -> Clip {
    let mut random = Random::new(seed);
    let (mut time, mut pose) = (random.between(-1.0, 1.0), random_pose(rig, &mut random));
    let (mut times, mut poses) = (vec![], vec![]);
    for _ in 0..n {
        times.push(time);
        poses.push(pose.clone());
        time += random.between(0.05, 0.4);
        let step: Vec<f64> = (0..rig.n_dofs()).map(|_| random.between(-0.4, 0.4)).collect();
        pose.retract(&step).expect("a tangent of the rig");
        pose.project();
    }
    Clip::new("walk", times, poses).expect("times increase")
}
