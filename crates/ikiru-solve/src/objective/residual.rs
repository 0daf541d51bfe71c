//! Objectives of your own: residuals written once over any [`Scalar`], derivatives by dual numbers.

use std::fmt::Debug;

use ikiru_rig::{Frame, JointId, LaneScalar, Scalar};

use crate::objective::duals::{N_DIRECTIONS, Seeded};
use crate::objective::lanes::LaneScratch;
use crate::objective::{Objective, Part, Reads, Rows, Unfit, View};
use crate::words::{Sense, Unit};

/// An objective of your own, differentiated automatically and exactly.
///
/// The residual is computed once with plain numbers, and once for each four frames that it reads with dual numbers
/// seeded on six directions of each: no tape, no compile step, and a cost that does not grow with the
/// number of joints above.
///
/// ```
/// use ikiru_rig::{Frame, JointId, Scalar};
/// use ikiru_solve::Residual;
///
/// /// Keeps two joints a given distance (metres) apart.
/// #[derive(Clone, Debug)]
/// struct KeepApart {
///     joints: [JointId; 2],
///     distance: f64,
/// }
///
/// impl Residual for KeepApart {
///     fn joints(&self) -> &[JointId] {
///         &self.joints
///     }
///     fn evaluate<S: Scalar>(&self, frames: &[Frame<S>], residual: &mut [S]) {
///         residual[0] = frames[0].origin.distance(frames[1].origin) - S::from(self.distance);
///     }
/// }
/// ```
pub trait Residual: Debug + Send + Sync + 'static {
    /// The joints whose world frames it reads.
    fn joints(&self) -> &[JointId];

    /// Computes the residual: `frames` are those of [`joints`](Self::joints), `residual` has
    /// [`n_rows`](Self::n_rows) entries in metres or radians, each of which is to be set.
    ///
    /// Numbers have no order to branch on: comparisons give masks, and [`Scalar::select`] takes one of two numbers by
    /// them. A division that may be by zero is computed and then not selected.
    fn evaluate<S: Scalar>(&self, frames: &[Frame<S>], residual: &mut [S]);

    /// Computes the residuals of `N` problems at once, each in a lane: `lanes` holds one of this kind for each problem,
    /// with numbers of its own, and all of them read as many joints and have as many rows. `frames` and `residual` are as
    /// in [`evaluate`](Self::evaluate), the lanes of each number side by side, plain or with derivatives.
    ///
    /// Goes lane by lane unless said otherwise. What is written here instead gives every lane the bits that
    /// [`evaluate`](Self::evaluate) gives it alone; that is so where it is the same source, with what differs from lane to
    /// lane [gathered](LaneScalar::gather). Solvers take one problem at a time so far, and do not call it yet.
    ///
    /// ```
    /// # use ikiru_rig::{Frame, JointId, LaneScalar, Scalar};
    /// # use ikiru_solve::{LaneScratch, Residual};
    /// # #[derive(Clone, Debug)]
    /// # struct KeepApart {
    /// #     joints: [JointId; 2],
    /// #     distance: f64,
    /// # }
    /// fn keep_apart<S: Scalar>(frames: &[Frame<S>], distance: S, residual: &mut [S]) {
    ///     residual[0] = frames[0].origin.distance(frames[1].origin) - distance;
    /// }
    ///
    /// impl Residual for KeepApart {
    /// #     fn joints(&self) -> &[JointId] {
    /// #         &self.joints
    /// #     }
    ///     // …
    ///     fn evaluate<S: Scalar>(&self, frames: &[Frame<S>], residual: &mut [S]) {
    ///         keep_apart(frames, S::from(self.distance), residual);
    ///     }
    ///     fn evaluate_lanes<S: LaneScalar<N>, const N: usize>(
    ///         lanes: [&Self; N],
    ///         frames: &[Frame<S>],
    ///         residual: &mut [S],
    ///         _: &mut LaneScratch<S::Lane>,
    ///     ) {
    ///         keep_apart(frames, S::gather(lanes.map(|lane| lane.distance)), residual);
    ///     }
    /// }
    /// ```
    fn evaluate_lanes<S: LaneScalar<N>, const N: usize>(
        lanes: [&Self; N],
        frames: &[Frame<S>],
        residual: &mut [S],
        scratch: &mut LaneScratch<S::Lane>,
    ) {
        scratch
            .lane_by_lane(frames, residual, |lane, frames, residual| lanes[lane].evaluate(frames, residual));
    }

    /// How many rows the residual has; 1 unless said otherwise. It must not change between solves without
    /// need: memory is laid out by it.
    fn n_rows(&self) -> usize {
        1
    }

    /// What the residual is measured in; metres unless said otherwise.
    fn unit(&self) -> Unit {
        Unit::Metres
    }

    /// What each row wants: to be 0 unless said otherwise.
    fn sense(&self) -> Sense {
        Sense::Equal
    }

    /// What is wrong with its numbers; nothing unless said otherwise.
    ///
    /// # Errors
    /// What is not usable, as in `Err("has a width that is not finite".into())`.
    fn check(&self) -> Result<(), Unfit> {
        Ok(())
    }

    /// A name for reports.
    fn kind(&self) -> &'static str {
        "custom"
    }

    /// Whether success asks for it; yes unless said otherwise.
    fn mandatory(&self) -> bool {
        true
    }
}

impl<R: Residual> Objective for R {
    fn kind(&self) -> &'static str {
        Residual::kind(self)
    }

    fn reads(&self, reads: &mut Reads<'_>) -> Result<(), Unfit> {
        reads.frames(self.joints())?;
        reads.by_duals();
        reads.part(Part { sense: self.sense(), ..Part::new(self.n_rows(), self.unit()) })
    }

    fn check(&self) -> Result<(), Unfit> {
        Residual::check(self)
    }

    fn mandatory(&self) -> bool {
        Residual::mandatory(self)
    }

    fn evaluate(&self, view: &View<'_>, rows: &mut Rows<'_>) {
        Residual::evaluate(self, view.frames(), rows.open_all(0));
        if !rows.wants_jacobian() {
            return;
        }
        let mut scratch = std::mem::take(rows.scratch());
        let frames = view.frames();
        let mut first = 0;
        while first < frames.len() {
            first += match frames.len() - first {
                1 => differentiate(self, &mut scratch.one, frames, first, rows),
                2 => differentiate(self, &mut scratch.two, frames, first, rows),
                3 => differentiate(self, &mut scratch.three, frames, first, rows),
                _ => differentiate(self, &mut scratch.four, frames, first, rows),
            };
        }
        *rows.scratch() = scratch;
    }
}

/// Puts the derivative of a residual by as many frames as are seeded at once, from the `first` on, into rows, and says how many
/// frames that were.
fn differentiate<R: Residual, const N: usize>(
    residual: &R,
    seeded: &mut Seeded<N>,
    frames: &[Frame<f64>],
    first: usize,
    rows: &mut Rows<'_>,
) -> usize {
    let (seeded, values) = seeded.seed(frames, first, residual.n_rows());
    Residual::evaluate(residual, seeded, values);
    for (row, value) in values.iter().enumerate() {
        for (place, derivatives) in value.derivatives.chunks_exact(N_DIRECTIONS).enumerate() {
            rows.by_frame(row, first + place).copy_from_slice(derivatives);
        }
    }
    N / N_DIRECTIONS
}
