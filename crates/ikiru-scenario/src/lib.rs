//! Scenario files of the Ikiru inverse-kinematics library: text ⇄ document → rig, problem and solver.
//!
//! A scenario is a TOML file that says which rig to pose, which joints may move and how far, and what the pose
//! should achieve. The command, the viewer and every binding read the same files through this crate.
//!
//! ```
//! use ikiru_scenario::Scenario;
//!
//! let text = r#"
//! version = 1
//! rig = "builtin:human"
//! active = ["leftShoulder", "leftUpperArm", "leftLowerArm", "leftHand"]
//!
//! [[objective]]
//! kind = "position"
//! joint = "leftHand"
//! target = [0.35, 1.1, 0.35]
//! "#;
//! let mut scenario = Scenario::parse(text, "reach.toml", ".")?;
//! let mut workspace = scenario.workspace();
//! let mut pose = scenario.start.clone();
//! assert!(scenario.solve(&mut pose, &mut workspace).success);
//!
//! scenario.set_target(0, [0.3, 1.2, 0.3].into())?; // the same problem again, for another target
//! assert!(scenario.solve(&mut pose, &mut workspace).success);
//! # Ok::<(), Box<dyn std::error::Error>>(())
//! ```
//!
//! To look at a scenario, change it and write it back, read it as a [`Document`]: the same as plain data.
//!
//! # The format
//!
//! | key | means | left out |
//! |---|---|---|
//! | `version` | 1 | an error |
//! | `rig` | a built-in rig, `"builtin:NAME"` with `human`, `reference`, `panda`, `ur5`, `xarm7` or `g1`, or a path, from the scenario's folder | an error |
//! | `method` | `"lm"`, `"adam"`, `"ccd"`, `"fabrik"`, or `"ipopt"` where the build has it | `"lm"` |
//! | `active` | joints that may move, by name or humanoid role | all that can move |
//! | `root` | `"free"`: the root of the body floats: what carries everything that moves, a humanoid's hips, a robot's base; what moved above it is fixed | it does not |
//! | `scale` | metres in a unit of the file, for formats that do not say; BVH | 1 |
//! | `world` | `"scene"` or `"file"`: whose axes targets are in: y up and facing +z, or those of a URDF or VRM 0.x file | `"scene"` |
//! | `[roles]` | `ROLE = "JOINT"`: which joint is which humanoid bone, before what the file, names and structure say; a joint that had the role loses it | as the rig has it |
//! | `[limits.NAME]` | `min_deg`, `max_deg`: ranges of the angles (x, y, z) of `Rz·Ry·Rx`; or `axis`, `swing_deg`, `twist_deg`: a cone, twist ±180 unless given | as the rig has it |
//! | …, of a cone | `parent_rotation`, `joint_rotation` (x, y, z, w; any length): P and K of another centre than the rest pose; the limit is then one of `P⁻¹ · (rest · q) · K`, with `rest · q` the joint's rotation in its parent | both: about the rest pose; one: the identity |
//! | `[start]` | the name of a pose's file, `start = "pose.json"`, as `ikiru solve` writes it; or `NAME = { euler_deg \| rotation \| angle_deg \| offset = … }`, `root_translation = [x, y, z]`: how far the floating root is from where it is at rest, metres along the axes of `world` | the rest pose |
//! | `[[objective]]` | `kind` and its keys, below | an error |
//! | `[motion]` | for planning: `duration_secs` and `rate` (30), or `points`; `smoothness = [speed, acceleration, jerk]` (0.001 each), `even_spacing` (0), `start_at_rest`, `end_at_rest` (false), `fixed_start` (true), `[motion.end]` or `end` as `[start]` | a single pose |
//! | …, of active joints | `max_speed_deg`, `max_acceleration_deg` (what turns), `max_speed`, `max_acceleration` (what slides, metres), `[motion.limits.NAME]` with the same keys; `free_duration = true`: take longer where they ask for it | no limits; the time as given |
//! | `[stop]` | `cost_below`, `max_iterations` (500), `max_restarts` (64), `max_time_ms` | as in brackets |
//!
//! | `kind` | keys | success asks for it |
//! |---|---|---|
//! | `position` | `joint`, `point`, `target` or `path`, `tolerance` | yes |
//! | `orientation` | `joint`, `target_rotation` (x, y, z, w) or `euler_deg`, `tolerance_deg` | yes |
//! | `pose` | those of both | yes |
//! | `look_at` | `joint`, `axis`, `target`, `path`, or `length` and `offset_from_tip`, `tolerance_deg` | yes |
//! | `direction` | `joint`, `axis`, `target` (a direction of the world), `tolerance_deg` | yes |
//! | `relative_pose` | `joint`, `base`, `position`, `target_rotation` or `euler_deg`, one of them or both, `tolerance`, `tolerance_deg` | yes |
//! | `distance` | `joints` (two), `points`, one of `exactly`, `at_least`, `at_most`, `tolerance` | yes |
//! | `pole_vector` | `joints` (root, middle and end of a limb), `target`, `tolerance_deg` | yes |
//! | `known_rotation` | `joints = { NAME = … }` with values as in `[start]`, `tolerance` (of sliders), `tolerance_deg` | yes |
//! | `rest_pose` | `joints`; left out: all active ones; `tolerance` (of sliders), `tolerance_deg` | no |
//! | `center_of_mass` | `target`, or `inside = [[x, z], …]` (points of the ground, which is x and y where z is up in `world`) with a `margin` (metres, 0); `masses = { NAME = { kg, center } }` (in the joint's frame), left out: those of a URDF; `tolerance` | yes |
//! | `coupling` | `angles = [{ joint, axis, factor }, …]`, one of `at_most_deg`, `at_least_deg`, `exactly_deg` for their sum, `tolerance_deg`; of sliders `at_most`, `at_least`, `exactly` (metres), `tolerance` | yes |
//!
//! Beside a `[motion]`, every objective takes `at`, or `from` and `to`, in seconds: when it holds; at the last sample
//! otherwise. `path = [[secs, x, y, z], …]` is a target that moves along a smooth curve, for as long as it goes on unless
//! times are given. [`Scenario::into_motion`] makes it ready to plan.
//!
//! In a motion, targets compete with smoothness: a fixed weight misses them by as much as length and speed of the motion ask
//! for. An objective without `weight` is wanted within its tolerance there: its weight begins at 1 and is raised tenfold as long as
//! it is missed and that helps (with `lm`, and where `cost_below` does not say what is enough). What limits, reach or other
//! objectives forbid is missed all the same, and reported. A `weight` that is written stays what it is, and so much of the
//! target is met. Which axes numbers count along is drawn in `docs/axes.md`.
//!
//! The first sample is the start, so that what holds from 0 s on holds from the second sample on: a target or path that begins
//! there and is elsewhere leaves one sample to get to it, which is a warning.
//!
//! Every objective takes `weight` (1, in a motion as above), `mandatory = true | false`, and `loss`: `"squared"`, `"norm"` or
//! `{ huber = width }`. Tolerances are 0.001 m and 0.5° unless given. Metres, degrees in keys that end in `_deg`, y up.
//!
//! `hard = true` makes a constraint of an objective of any kind: it holds at the end within its tolerance, 0.0001 m and 0.01° unless
//! given, whatever that costs, or the report names it. `weight`, `loss` and `mandatory` then say nothing. The key `level` (1) is there
//! for ranks of wishes: levels beyond 1 are refused for now.

mod at;
mod axes;
mod builtin;
mod document;
mod error;
mod keys;
pub mod kinds;
mod limits;
mod motion;
mod objective;
mod planned;
mod rate_limits;
mod refusal;
mod roles;
mod scenario;
mod scene;
mod start;
mod stop;
mod table;
mod term;
mod times;
mod values;
mod warning;
mod weights;
mod write;

pub use builtin::BUILTINS;
pub use document::{Document, RootKey, TargetAxes};
pub use error::{Error, ErrorKind};
pub use keys::{JointKeys, RotationKeys, TargetKeys};
pub use limits::{ConeKeys, LimitKeys};
pub use motion::{LengthKeys, MotionKeys, MotionScenario, MotionSettings};
pub use objective::{ObjectiveEntry, ScenarioObjective};
pub use planned::PlannedScenario;
pub use rate_limits::RateKeys;
pub use refusal::refusal;
pub use scenario::{Scenario, TargetError};
pub use start::GivenPose;
pub use stop::StopKeys;
pub use times::Times;
pub use warning::{ScenarioPose, Warning};
