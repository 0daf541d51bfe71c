//! The numbers that steer the loop of Levenberg–Marquardt where poses and trajectories differ.

/// What a step must do to be taken, corrected, or the last.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Rules {
    /// Damping is never smaller than this, relative to the largest curvature.
    pub(crate) least_damping: f64,
    /// A step that promises less than this part of the cost is not worth taking.
    pub(crate) least_gain: f64,
    /// A step that gains less than this part of what it promised is corrected.
    pub(crate) poor: f64,
    /// What is wanted is within its tolerances, and so many steps in a row promise less than this part of the cost: only what
    /// nobody asked for is left to gain. Never, where it is 0.
    pub(crate) little_gain: f64,
    pub(crate) n_little: usize,
}

impl Rules {
    /// Of poses: a step takes microseconds, so that a solve goes on to the last digit. Residuals bend little within a step;
    /// only what is hard is worth a correction.
    pub(crate) const POSE: Self = Self {
        least_damping: 1e-12,
        least_gain: 1e-12,
        poor: f64::NEG_INFINITY,
        little_gain: 0.0,
        n_little: usize::MAX,
    };

    /// Of trajectories whose steps are solved for exactly. A step is dear, and all samples together lead along curved
    /// valleys, where a correction gains what many short steps would. A first short step may be short for its
    /// damping alone.
    pub(crate) const TRAJECTORY: Self =
        Self { least_damping: 1e-10, least_gain: 1e-9, poor: 0.5, little_gain: 1e-6, n_little: 5 };
    /// The same solved for iteratively, to a few parts in a hundred, which takes the longer, the less damping there is.
    pub(crate) const TRAJECTORY_ITERATIVE: Self =
        Self { least_damping: 1e-6, least_gain: 1e-6, poor: 0.5, little_gain: 1e-2, n_little: 2 };

    /// The same where there are guards: what is missed after a step is what the next must make good.
    pub(crate) fn with_guards(self) -> Self {
        Self { poor: POOR_WITH_GUARDS, ..self }
    }
}

const POOR_WITH_GUARDS: f64 = 0.75;

/// How a single run of the loop begins and how exactly it is to end.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Effort {
    /// The damping to begin with, relative to the largest curvature; the last one is left here.
    pub(crate) damping: f64,
    /// It ends at a step that promises less than this part of the cost, where the [rules](Rules) do not want more.
    pub(crate) least_gain: f64,
}

impl Effort {
    /// First damping, of poses and trajectories.
    pub(crate) const FIRST_DAMPING: f64 = 0.05;
    /// To the end.
    pub(crate) const FULL: Self = Self { damping: Self::FIRST_DAMPING, least_gain: 0.0 };
}
