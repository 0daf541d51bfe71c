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
//! [`page`] gives it as a page, with every key, its default and an example of each kind; `docs/scenario.md` of the repository is that
//! page, and `docs/axes.md` draws which axes numbers count along. [`Kind::keys_of`](kinds::Kind::keys_of) has the keys as data.
//! A scenario with a `[motion]` becomes ready to plan by [`Scenario::into_motion`].

mod at;
mod axes;
#[cfg(feature = "builtin")]
mod builtin;
mod document;
mod error;
mod key;
mod keys;
mod kind_keys;
pub mod kinds;
mod limits;
mod methods;
mod motion;
mod motion_scenario;
mod objective;
mod page;
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

#[cfg(feature = "builtin")]
pub use builtin::BUILTINS;
pub use document::{Document, RootKey, TargetAxes};
pub use error::{Error, ErrorKind};
pub use key::{Key, LeftOut};
pub use keys::{JointKeys, RotationKeys, TargetKeys};
pub use limits::{ConeKeys, LimitKeys};
pub use methods::{method_named, methods};
pub use motion::{LengthKeys, MotionKeys, MotionSettings};
pub use motion_scenario::MotionScenario;
pub use objective::{ObjectiveEntry, ScenarioObjective};
pub use page::page;
pub use planned::PlannedScenario;
pub use rate_limits::RateKeys;
pub use refusal::refusal;
pub use scenario::{Scenario, TargetError};
pub use start::GivenPose;
pub use stop::StopKeys;
pub use times::Times;
pub use warning::{ScenarioPose, Warning};
