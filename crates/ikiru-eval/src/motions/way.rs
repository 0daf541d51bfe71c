//! The ways to get a motion that are compared.

use ikiru_rig::{Clip, JointId, Rate, RateLimit, RatePart};
use ikiru_scenario::MotionScenario;
use ikiru_solve::{AdamOptions, Method, Search, Solver, SolverOptions};

use crate::error::Error;

/// How a motion is got.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Way {
    /// Every key solved as a single pose, from that of the key before, and the straight way between them.
    Straight,
    /// The whole motion by the paper's method with the paper's settings: cautious Adam, 500 iterations, one start,
    /// smoothness of each order with weight 0.001.
    Paper,
    /// The whole motion by `lm`, with the smoothness of [`Paper`](Self::Paper).
    PaperByLm,
    /// The scenario as it is.
    Plan,
    /// The scenario with a limit on every active joint's speed, 0.7 times the peak of [`Plan`](Self::Plan).
    SpeedLimited,
    /// The scenario with the limit of [`SpeedLimited`](Self::SpeedLimited), and as much time as it takes.
    TimeFree,
}

/// What the paper's authors give each order of smoothness.
const PAPER_SMOOTHNESS: [f64; 3] = [0.001; 3];
const PAPER_ITERATIONS: usize = 500;

/// The part of a plan's peak speed that limited plans are allowed.
const ALLOWED: f64 = 0.7;

impl Way {
    /// All, in the order of the table.
    pub const ALL: [Self; 6] =
        [Self::Straight, Self::Paper, Self::PaperByLm, Self::Plan, Self::SpeedLimited, Self::TimeFree];

    /// What rows call it.
    #[must_use]
    pub fn name(self) -> &'static str {
        match self {
            Self::Straight => "straight",
            Self::Paper => "paper",
            Self::PaperByLm => "lm_paper_smoothness",
            Self::Plan => "plan",
            Self::SpeedLimited => "plan_speed_limited",
            Self::TimeFree => "plan_time_free",
        }
    }

    /// What tables call it.
    pub(super) fn title(self) -> &'static str {
        match self {
            Self::Straight => "straight",
            Self::Paper => "paper",
            Self::PaperByLm => "lm, paper's smoothness",
            Self::Plan => "plan",
            Self::SpeedLimited => "plan, speed limited",
            Self::TimeFree => "plan, time free",
        }
    }

    /// Sets a scenario up for this way. `own` are its own smoothness, limits on rates and freedom of duration, and
    /// `limits` those of the limited ways.
    pub(super) fn set(
        self,
        motion: &mut MotionScenario,
        own: &Own,
        limits: &[RateLimit],
    ) -> Result<(), Error> {
        let of_paper = matches!(self, Self::Paper | Self::PaperByLm);
        let (rate_limits, free) = match self {
            // The paper knows no limits on rates.
            Self::Straight | Self::Paper | Self::PaperByLm => (&[][..], false),
            Self::Plan => (&own.rate_limits[..], own.free_duration),
            Self::SpeedLimited => (limits, false),
            Self::TimeFree => (limits, true),
        };
        let problem = &mut motion.motion;
        problem
            .set_smoothness(if of_paper { PAPER_SMOOTHNESS } else { own.smoothness })
            .map_err(Error::Motion)?;
        problem.set_rate_limits(rate_limits).map_err(Error::Motion)?;
        problem.set_free_duration(free);
        motion.solver = Solver::new(match self {
            Self::Paper => SolverOptions {
                method: Method::Adam(AdamOptions::DEFAULT),
                search: Search::Local,
                max_iterations: PAPER_ITERATIONS,
                ..own.options
            },
            Self::PaperByLm => SolverOptions { method: Method::Lm, ..own.options },
            _ => own.options,
        });
        Ok(())
    }
}

/// What a scenario says itself.
pub(super) struct Own {
    pub(super) smoothness: [f64; 3],
    pub(super) rate_limits: Vec<RateLimit>,
    pub(super) free_duration: bool,
    pub(super) options: SolverOptions,
}

/// The limits of the limited ways: those that the scenario has, and on every active joint the speed that the fastest
/// may have.
pub(super) fn limits(plan: &Clip, active: &[JointId], own: &[RateLimit]) -> Vec<RateLimit> {
    let mut limits = own.to_vec();
    for part in [RatePart::Rotation, RatePart::Translation] {
        let most = ALLOWED * peak_speed(plan, active, part);
        let joints = active.iter().filter(|joint| most > 0.0 && part.is_of(plan.rig(), **joint));
        limits.extend(joints.map(|joint| RateLimit { joint: *joint, part, rate: Rate::Speed, most }));
    }
    limits
}

/// The speed of the fastest of some joints on the curve of [`Clip::sample_cubic`], in rad/s or m/s.
pub(super) fn peak_speed(clip: &Clip, joints: &[JointId], part: RatePart) -> f64 {
    let peaks = joints.iter().filter_map(|joint| clip.peak_speed(*joint, part).ok());
    peaks.map(|peak| peak.value).fold(0.0, f64::max)
}
