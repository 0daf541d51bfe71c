//! Documents by chance, that make sense: every key of every kind comes up.

use ikiru_scenario::kinds::{
    AngleKeys, ApartKeys, CenterKeys, CenterOfMassKeys, CouplingKeys, DirectionKeys, DistanceKeys, GazeKeys,
    Kind, KnownRotationKeys, LookAtKeys, MassKeys, OrientationKeys, PoleVectorKeys, PoseKeys, PositionKeys,
    RelativePoseKeys, RestPoseKeys, SumKeys,
};
use ikiru_scenario::{
    ConeKeys, Document, GivenPose, JointKeys, LengthKeys, LimitKeys, MotionKeys, ObjectiveEntry, RateKeys,
    RootKey, RotationKeys, StopKeys, TargetAxes, TargetKeys, Times,
};
use ikiru_solve::Loss;
use ikiru_solve::objectives::Bound;
use ikiru_testkit::rigs::Random;

/// Joints of the built-in human that lie in one another's reach.
const BODY: [&str; 9] = [
    "spine",
    "chest",
    "leftShoulder",
    "leftUpperArm",
    "leftLowerArm",
    "leftHand",
    "rightUpperArm",
    "rightLowerArm",
    "rightHand",
];
const HINGES: [&str; 4] = ["panda_joint1", "panda_joint2", "panda_joint4", "panda_joint6"];
const SLIDER: &str = "panda_finger_joint1";

/// A pose's file that a start or an end may name, by rig.
pub(crate) const POSES: [(&str, &str); 2] =
    [("builtin:human", "human.json"), ("builtin:panda", "panda.json")];

/// Seconds of a motion.
const DURATION: f64 = 0.5;

struct Draw {
    random: Random,
    is_robot: bool,
}

impl Draw {
    fn coin(&mut self) -> bool {
        self.random.below(2) == 0
    }

    fn maybe<T>(&mut self, make: impl FnOnce(&mut Self) -> T) -> Option<T> {
        if self.coin() { Some(make(self)) } else { None }
    }

    fn number(&mut self, low: f64, high: f64) -> f64 {
        match self.random.below(6) {
            // Whole ones, and zeros of both signs, have texts of their own.
            0 => self.random.between(low, high).round().clamp(low, high),
            _ => self.random.between(low, high),
        }
    }

    fn numbers<const N: usize>(&mut self, low: f64, high: f64) -> [f64; N] {
        std::array::from_fn(|_| self.number(low, high))
    }

    /// Of any length but 0.
    fn direction(&mut self) -> [f64; 3] {
        self.random.vector(2.0).to_array()
    }

    fn quaternion(&mut self) -> [f64; 4] {
        let length = self.random.between(0.1, 3.0);
        self.random.rotation().to_array().map(|c| c * length)
    }

    fn point(&mut self) -> [f64; 3] {
        if self.coin() { [0.0; 3] } else { self.numbers(-0.2, 0.2) }
    }

    fn target(&mut self) -> [f64; 3] {
        let [x, z] = self.numbers(-0.6, 0.6);
        [x, self.number(0.2, 1.4), z]
    }

    fn joint(&mut self) -> String {
        let names: &[&str] = if self.is_robot { &HINGES } else { &BODY };
        names[self.random.below(names.len())].to_owned()
    }

    /// Different ones.
    fn joints<const N: usize>(&mut self) -> [String; N] {
        let names: &[&str] = if self.is_robot { &HINGES } else { &BODY };
        let first = self.random.below(names.len());
        std::array::from_fn(|idx| names[(first + idx) % names.len()].to_owned())
    }

    fn joint_keys(&mut self, name: &str) -> JointKeys {
        match (self.is_robot, self.coin()) {
            (true, _) if name == SLIDER => JointKeys::Offset(self.number(0.0, 0.04)),
            (true, _) => JointKeys::AngleDeg(self.number(-60.0, 60.0)),
            (false, true) => JointKeys::EulerDeg(self.numbers(-40.0, 40.0)),
            (false, false) => JointKeys::Rotation(self.quaternion()),
        }
    }

    fn moved_joints(&mut self) -> Vec<(String, JointKeys)> {
        let mut names = self.joints::<2>().to_vec();
        if self.is_robot && self.coin() {
            names.push(SLIDER.to_owned());
        }
        names.into_iter().map(|name| (name.clone(), self.joint_keys(&name))).collect()
    }

    fn rotation(&mut self) -> RotationKeys {
        if self.coin() {
            RotationKeys::TargetRotation(self.quaternion())
        } else {
            RotationKeys::EulerDeg(self.numbers(-180.0, 180.0))
        }
    }

    fn moving_target(&mut self, moves: bool) -> TargetKeys {
        if !moves || self.coin() {
            return TargetKeys::Target(self.target());
        }
        let times = [0.1, self.random.between(0.2, 0.3), self.random.between(0.4, DURATION)];
        TargetKeys::Path(
            times
                .map(|secs| {
                    let [x, y, z] = self.target();
                    [secs, x, y, z]
                })
                .to_vec(),
        )
    }

    /// The keys of a kind; `moves` where there is a motion.
    fn kind(&mut self, name: &str, moves: bool) -> Kind {
        let joint = self.joint();
        match name {
            "position" => {
                PositionKeys { joint, point: self.point(), target: self.moving_target(moves) }.into()
            }
            "orientation" => OrientationKeys { joint, rotation: self.rotation() }.into(),
            "pose" => {
                let (point, target, rotation) = (self.point(), self.target(), self.rotation());
                PoseKeys { joint, point, target, rotation }.into()
            }
            "look_at" => {
                let (length, offset_from_tip) = (self.number(0.0, 0.3), self.numbers(-1.0, 1.0));
                let beside = GazeKeys::BesideTip { length, offset_from_tip };
                let gaze = if self.coin() { GazeKeys::At(self.moving_target(moves)) } else { beside };
                LookAtKeys { joint, axis: self.direction(), gaze }.into()
            }
            "direction" => DirectionKeys { joint, axis: self.direction(), target: self.direction() }.into(),
            "relative_pose" => {
                let [joint, base] = self.joints();
                let position = self.maybe(Self::point);
                let rotation = self.maybe(Self::rotation);
                let rotation = if position.is_none() { Some(self.rotation()) } else { rotation };
                RelativePoseKeys { joint, base, position, rotation }.into()
            }
            "distance" => {
                let metres = self.number(0.0, 0.8);
                let apart =
                    [ApartKeys::Exactly(metres), ApartKeys::AtLeast(metres), ApartKeys::AtMost(metres)];
                let points = [self.point(), self.point()];
                DistanceKeys { joints: self.joints(), points, apart: apart[self.random.below(3)] }.into()
            }
            "pole_vector" => PoleVectorKeys { joints: self.joints(), target: self.target() }.into(),
            "known_rotation" => KnownRotationKeys { joints: self.moved_joints() }.into(),
            "coupling" => self.coupling().into(),
            "center_of_mass" => self.center_of_mass().into(),
            "rest_pose" => RestPoseKeys { joints: self.maybe(|draw| draw.joints::<3>().to_vec()) }.into(),
            other => panic!("say here how a '{other}' is drawn"),
        }
    }

    fn coupling(&mut self) -> CouplingKeys {
        let number = self.number(-90.0, 90.0);
        let bounds = [Bound::Exactly(number), Bound::AtLeast(number), Bound::AtMost(number)];
        let bound = bounds[self.random.below(3)];
        let slides = self.is_robot && self.random.below(3) > 0;
        let names = match (slides, self.is_robot) {
            (true, _) => vec![SLIDER.to_owned()],
            (false, true) => self.joints::<2>().to_vec(),
            // Balls with one child each, about which they twist.
            (false, false) => {
                BODY[2 + self.random.below(2)..][..2].iter().map(|&name| name.to_owned()).collect()
            }
        };
        let angle = |joint| AngleKeys {
            joint,
            // Along an axis, so that it is one of an Euler joint too.
            axis: (!self.is_robot)
                .then(|| [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]][self.random.below(3)]),
            factor: self.number(-2.0, 2.0),
        };
        let angles = names.into_iter().map(angle).collect();
        CouplingKeys { angles, sum: if slides { SumKeys::Metres(bound) } else { SumKeys::Degrees(bound) } }
    }

    fn center_of_mass(&mut self) -> CenterOfMassKeys {
        let place = if self.coin() {
            CenterKeys::At { target: self.target() }
        } else {
            let (x, z, size) =
                (self.number(-0.1, 0.1), self.number(-0.1, 0.1), self.random.between(0.1, 0.3));
            let inside = vec![[x, z], [x + size, z], [x, z + size], [x + size / 4.0, z + size / 4.0]];
            CenterKeys::Over {
                inside,
                margin: if self.coin() { 0.0 } else { self.random.between(0.0, 0.02) },
            }
        };
        let mass = |(draw, name): (&mut Self, String)| {
            (name, MassKeys { kg: draw.random.between(0.1, 20.0), center: draw.point() })
        };
        // The robot has its own.
        let given = !self.is_robot || self.coin();
        let masses =
            given.then(|| self.joints::<3>().into_iter().map(|name| mass((&mut *self, name))).collect());
        CenterOfMassKeys { place, masses }
    }

    fn objective(&mut self, name: &str, moves: bool) -> ObjectiveEntry {
        let mut entry = ObjectiveEntry::new(self.kind(name, moves));
        let has = |key: &str| Kind::keys_of(name).iter().any(|known| known.name == key);
        entry.weight = self.maybe(|draw| draw.number(0.0, 3.0));
        entry.loss = [Loss::Squared, Loss::Norm, Loss::Huber { width: self.random.between(0.01, 1.0) }]
            [self.random.below(3)];
        entry.mandatory = self.maybe(Self::coin);
        entry.hard = self.random.below(4) == 0;
        entry.tolerance = self.maybe(|draw| draw.number(0.0, 0.1)).filter(|_| has("tolerance"));
        entry.tolerance_deg = self.maybe(|draw| draw.number(0.0, 5.0)).filter(|_| has("tolerance_deg"));
        if moves {
            entry.times = self.maybe(|draw| {
                let (at, to) = (draw.random.between(0.0, 0.2), draw.random.between(0.3, DURATION));
                if draw.coin() { Times::At { at } } else { Times::Span { from: at, to } }
            });
        }
        entry
    }

    fn limits(&mut self) -> Vec<(String, LimitKeys)> {
        if self.is_robot {
            return Vec::new();
        }
        let names = self.joints::<3>();
        let draw = |name: String| {
            let keys = if self.coin() {
                LimitKeys::Ranges { min_deg: self.numbers(-120.0, 0.0), max_deg: self.numbers(1.0, 120.0) }
            } else {
                let twist_deg = self.maybe(|draw| [draw.number(-170.0, 0.0), draw.number(1.0, 170.0)]);
                LimitKeys::Cone(ConeKeys {
                    axis: self.direction(),
                    swing_deg: self.numbers(5.0, 180.0),
                    twist_deg,
                    parent_rotation: self.maybe(Self::quaternion),
                    joint_rotation: self.maybe(Self::quaternion),
                })
            };
            (name, keys)
        };
        names.map(draw).to_vec()
    }

    fn pose(&mut self, rig: &str, floats: bool) -> GivenPose {
        if self.random.below(4) == 0 {
            let (_, file) = POSES[usize::from(rig == POSES[1].0)];
            return GivenPose::File(file.to_owned());
        }
        let root_translation = if floats { self.maybe(|draw| draw.numbers(-0.2, 0.2)) } else { None };
        GivenPose::Joints { root_translation, joints: self.moved_joints() }
    }

    fn rates(&mut self) -> RateKeys {
        RateKeys {
            max_speed_deg: self.maybe(|draw| draw.number(50.0, 400.0)),
            max_acceleration_deg: self.maybe(|draw| draw.number(500.0, 9000.0)),
            ..RateKeys::default()
        }
    }

    fn motion(&mut self, rig: &str, floats: bool) -> MotionKeys {
        let rate = if self.coin() { 30.0 } else { self.random.between(12.0, 20.0) };
        let mut motion = MotionKeys::new(LengthKeys::Seconds { duration_secs: DURATION, rate });
        if self.coin() {
            motion.smoothness = self.numbers(0.0, 0.01);
        }
        if self.coin() {
            motion.even_spacing = self.number(0.0, 0.1);
        }
        (motion.start_at_rest, motion.end_at_rest) = (self.coin(), self.coin());
        motion.fixed_start = self.coin();
        motion.rates = self.rates();
        if self.is_robot {
            // The fingers alone slide.
            motion.rates.max_speed = self.maybe(|draw| draw.random.between(0.1, 1.0));
            motion.rates.max_acceleration = self.maybe(|draw| draw.random.between(1.0, 9.0));
        }
        let names = self.joints::<2>();
        motion.limits = names.map(|name| (name, self.rates())).to_vec();
        motion.free_duration = motion.rates.max_speed_deg.is_some() && self.coin();
        motion.end = self.maybe(|draw| draw.pose(rig, floats));
        motion
    }
}

/// A document in which every kind has its turn as the seed goes on.
pub(crate) fn random_document(seed: u64) -> Document {
    let mut draw = Draw { random: Random::new(seed), is_robot: seed.is_multiple_of(3) };
    let (rig, _) = POSES[usize::from(draw.is_robot)];
    let mut document = Document::new(rig);
    let floats = draw.coin();
    if floats {
        document.root = RootKey::Free;
    }
    if draw.coin() {
        document.world = TargetAxes::File;
    }
    if !draw.is_robot && draw.coin() {
        document.roles.push(("leftHand".to_owned(), "hand_l".to_owned()));
    }
    document.limits = draw.limits();
    if !draw.is_robot {
        document.active = draw.maybe(|_| BODY.map(str::to_owned).to_vec());
    }
    document.start = draw.maybe(|draw| draw.pose(rig, floats));
    let moves = seed % 4 == 1;
    // Of motions, `adam` refuses some limits.
    document.method = if moves { "lm" } else { ["lm", "adam"][draw.random.below(2)] }.to_owned();
    if moves {
        document.motion = Some(draw.motion(rig, floats));
    }
    // Two have their turn, two come by chance.
    let n_kinds = Kind::NAMES.len();
    // Shifted from round to round: what else goes by the seed then meets every kind.
    let turn = seed as usize + seed as usize / n_kinds;
    let turns = [0, 1].map(|idx| (turn + 3 * idx) % n_kinds);
    for idx in [turns[0], turns[1], draw.random.below(n_kinds), draw.random.below(n_kinds)] {
        let name = Kind::NAMES[idx];
        document.objectives.push(draw.objective(name, moves));
    }
    document.stop = StopKeys {
        cost_below: draw.maybe(|draw| draw.random.between(1e-6, 1e-2)),
        max_iterations: draw.maybe(|draw| 1 + draw.random.below(30) as u32),
        max_restarts: Some(draw.random.below(3) as u32),
        // A clock would make two solves differ.
        max_time_ms: draw.maybe(|_| 86_400_000.0),
    };
    document
}
