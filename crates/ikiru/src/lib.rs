//! Real-time inverse kinematics for virtual humans and any other rig.
//!
//! A *rig* is a tree of joints with hard limits. *Objectives* are wishes about it: a hand at a point, a head that
//! looks somewhere, a palm that faces down. A *problem* weighs objectives and says which joints may move; a
//! *solver* improves a *pose* until the wishes are met, and reports what came of it. Limits hold at every step,
//! not converging is a result with a reason, and a solve that is repeated does not allocate.
//!
//! # Reach
//!
//! ```
//! use ikiru::{DVec3, Position, Problem, Solver, formats};
//!
//! # fn main() -> Result<(), Box<dyn std::error::Error>> {
//! let loaded = formats::read("builtin:human")?; // or the path of a .glb, .gltf or .vrm file
//! let rig = &loaded.rig;
//! let mut problem = Problem::new(rig, rig.chain("leftShoulder", "leftHand")?)?; // joints that may move
//! let hand = rig.joint("leftHand")?; // a joint's own name, or its humanoid role
//! let reach = problem.add(1.0, Position::new(hand, DVec3::new(0.35, 1.1, 0.35)));
//!
//! let solver = Solver::default();
//! let mut workspace = solver.workspace(&problem);
//! let mut pose = rig.rest_pose();
//! let report = solver.solve(&problem, &mut pose, &mut workspace);
//! assert!(report.success && report[reach].residual < 0.001); // metres
//!
//! let posed = formats::write_posed_glb(&loaded, &pose)?; // the same file, skinned, in that pose
//! formats::save(std::env::temp_dir().join("ikiru-reach.glb"), &posed)?;
//! # Ok(())
//! # }
//! ```
//!
//! # Every frame
//!
//! Keep problem, pose and workspace, and change the target through the typed id that [`Problem::add`] gave. Starting
//! from the last pose, a frame takes microseconds, and nothing is allocated. [`SolverOptions::max_time`] bounds it. A frame ends
//! once all that is mandatory is well within its tolerance: [`Settle::Tolerances`], which turns joints less from frame to frame
//! than going on to the last digit would, [`Settle::Fully`].
//!
//! ```
//! use ikiru::{DVec3, Position, Problem, Solver, formats};
//!
//! # fn main() -> Result<(), Box<dyn std::error::Error>> {
//! # let loaded = formats::read("builtin:human")?;
//! # let rig = &loaded.rig;
//! let mut problem = Problem::new(rig, rig.chain("leftShoulder", "leftHand")?)?;
//! let reach = problem.add(1.0, Position::new(rig.joint("leftHand")?, DVec3::ZERO));
//! let solver = Solver::default();
//! let (mut pose, mut workspace) = (rig.rest_pose(), solver.workspace(&problem));
//! for frame in 0..90 {
//!     let angle = f64::from(frame) / 90.0 * std::f64::consts::TAU;
//!     problem[reach].target = DVec3::new(0.3 + 0.1 * angle.cos(), 1.1 + 0.1 * angle.sin(), 0.3);
//!     assert!(solver.solve(&problem, &mut pose, &mut workspace).success);
//! }
//! # Ok(())
//! # }
//! ```
//!
//! # Limits
//!
//! A rig is immutable; [`Rig::to_builder`] makes another one with other motions and limits. The poses that a solver
//! gives never leave them.
//!
//! ```
//! use ikiru::{Cone, DVec3, EulerOrder, JointMotion, Range, formats};
//!
//! # fn main() -> Result<(), Box<dyn std::error::Error>> {
//! let loaded = formats::read("builtin:human")?;
//! let mut builder = loaded.rig.to_builder();
//! let cone = Cone::new(DVec3::X, [100_f64.to_radians(), 90_f64.to_radians()], Range::degrees(-60.0, 60.0))?;
//! builder.set_motion(loaded.rig.joint("leftUpperArm")?, JointMotion::Ball { cone: Some(cone) })?;
//! let elbow = [Range::degrees(-80.0, 80.0), Range::degrees(-145.0, 0.0), Range::degrees(0.0, 0.0)];
//! builder.set_motion(loaded.rig.joint("leftLowerArm")?, JointMotion::Euler { order: EulerOrder::Zyx, ranges: elbow })?;
//! let loaded = loaded.with_rig(builder.build()?)?; // so that its poses can be written
//! assert_eq!(loaded.rig.rest_pose().limit_violation(), 0.0);
//! # Ok(())
//! # }
//! ```
//!
#![doc = include_str!("objectives.md")]
//!
//! # Motions
//!
//! Objectives hold at times of a timeline too: a [`MotionProblem`] is solved as a whole, smooth in speed, acceleration and
//! jerk, and gives a [`Clip`]. Limits on speed and acceleration are hard, anywhere on its curve.
//!
//! ```
//! use ikiru::{
//!     Clip, DVec3, MotionEvaluation, MotionProblem, MotionWorkspace, Position, Rate, RateLimit, RatePart, Solver, Timeline, When, formats,
//! };
//!
//! # fn main() -> Result<(), Box<dyn std::error::Error>> {
//! # let loaded = formats::read("builtin:human")?;
//! # let rig = &loaded.rig;
//! let (elbow, hand) = (rig.joint("leftLowerArm")?, rig.joint("leftHand")?);
//! let timeline = Timeline::seconds(2.0, 30.0)?; // 61 samples
//! let mut motion = MotionProblem::new(rig, rig.chain("leftShoulder", "leftHand")?, timeline)?;
//! motion.set_smoothness([0.0, 0.01, 0.1])?;
//! motion.set_at_rest(true, true);
//! motion.fix_start(&rig.rest_pose())?;
//! motion.add(10.0, When::At(1.0), Position::new(hand, DVec3::new(0.45, 1.35, 0.35)))?;
//! motion.add(10.0, When::End, Position::new(hand, DVec3::new(0.20, 1.20, 0.40)))?;
//! let most = 240_f64.to_radians(); // a second
//! motion.set_rate_limits(&[RateLimit { joint: elbow, part: RatePart::Rotation, rate: Rate::Speed, most }])?;
//!
//! let still = Clip::still(rig.rest_pose());
//! let planned = Solver::default().plan(&motion, &still, &mut MotionWorkspace::default()).into_owned();
//! assert!(planned.report.success && planned.clip.peak_speed(elbow, RatePart::Rotation)?.value <= most);
//! # Ok(())
//! # }
//! ```
//!
//! # Scenarios
//!
//! All of it can stand in a TOML file, which the command `ikiru solve` and every other front end read as well:
//! see [`scenario`]. A program makes, changes and writes such files as a [`Document`](scenario::Document).
//!
//! # Objectives of your own
//!
//! Write the residual once, over any [`Scalar`]; derivatives come by themselves. In the place of a branch, a comparison
//! gives a mask, and [`Scalar::select`] takes one of two numbers by it.
//!
//! ```
//! use ikiru::solve::check_jacobian;
//! use ikiru::{Frame, JointId, Problem, Residual, Scalar, formats};
//!
//! /// Keeps a joint at least so high (metres): the height that is missing, 0 above.
//! #[derive(Clone, Debug)]
//! struct StayAbove {
//!     joint: JointId,
//!     height: f64,
//! }
//!
//! impl Residual for StayAbove {
//!     fn joints(&self) -> &[JointId] {
//!         std::slice::from_ref(&self.joint)
//!     }
//!     fn evaluate<S: Scalar>(&self, frames: &[Frame<S>], residual: &mut [S]) {
//!         let above = frames[0].origin.y - self.height;
//!         residual[0] = S::select(above.lt(0.0), above, S::zero());
//!     }
//! }
//!
//! # fn main() -> Result<(), Box<dyn std::error::Error>> {
//! # let loaded = formats::read("builtin:human")?;
//! # let rig = &loaded.rig;
//! let mut problem = Problem::new(rig, rig.chain("leftShoulder", "leftHand")?)?;
//! problem.add(1.0, StayAbove { joint: rig.joint("leftHand")?, height: 1.6 });
//! check_jacobian(&problem, &rig.rest_pose(), 1e-6)?; // worth a line in your tests
//! # Ok(())
//! # }
//! ```
//!
//! # Features
//!
//! | feature | brings | on |
//! |---|---|---|
//! | `formats` | [`formats`]: readers and writers of files | yes |
//! | `scenario` | [`scenario`]: scenario files; with `formats` | yes |
//! | `builtin` | the rigs and scenarios that come with the library, such as `builtin:human`; with `formats` | yes |
//! | `serde` | `Serialize` for [`Pose`], [`Clip`] and [`Report`], and data to read the first two back from ([`rig::PoseData`]) | no |
//! | `ipopt` | the method `ipopt::IPOPT`, through the system's Ipopt | no |
//!
//! Without any, rigs are built by [`RigBuilder`], and nothing is compiled but what solves.
//!
//! # Conventions
//!
//! Metres, radians and seconds; right-handed, y up, a character faces +z with its left at +x. Numbers are `f64`,
//! vectors those of [`glam`]. Examples, one idea each, lie in the folder `examples` of the repository.

pub use glam;
#[cfg(feature = "formats")]
pub use ikiru_formats as formats;
#[cfg(feature = "ipopt")]
pub use ikiru_ipopt as ipopt;
pub use ikiru_rig as rig;
#[cfg(feature = "scenario")]
pub use ikiru_scenario as scenario;
pub use ikiru_solve as solve;

pub use glam::{DQuat, DVec3};
#[cfg(feature = "formats")]
pub use ikiru_formats::Loaded;
pub use ikiru_rig::{
    Clip, Cone, ConeCentre, EulerOrder, ForeignJoint, Frame, Joint, JointFrame, JointId, JointMotion, Pose,
    Range, Rate, RateLimit, RatePart, Rig, RigBuilder, Role, Scalar, Segment,
};
#[cfg(feature = "scenario")]
pub use ikiru_scenario::Scenario;
pub use ikiru_solve::objectives::*;
pub use ikiru_solve::{
    AdamOptions, EvaluatedRow, Evaluation, Force, ForceBy, Hint, Invalid, InvalidOptions, InvalidPose,
    InvalidTerm, LimitKind, Loss, Method, MotionError, MotionEvaluation, MotionProblem, MotionWorkspace,
    Objective, Part, PartReport, PlannedMotion, PoseMethod, Problem, Progress, Reads, Report, Residual, Rows,
    Search, Sense, Settle, Solver, SolverOptions, Start, StopReason, TargetPath, Term, TermId, TermReport,
    TermTimes, TermWarning, Timeline, Tolerance, Unfit, UnfitReason, Unit, View, Watch, When, Workspace,
};

/// The program in the project's README, compiled and run as a test.
#[cfg(all(doctest, feature = "builtin"))]
#[doc = include_str!("../../../README.md")]
struct Readme;
