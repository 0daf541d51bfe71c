//! Objectives of your own: residuals written once over any [`Scalar`], derivatives by dual numbers.

use std::fmt::Debug;

use ikiru_rig::{Dual, Frame, JointId, LaneScalar, Scalar, Vec3};

use crate::objective::lanes::LaneScratch;
use crate::objective::places::TermLayout;
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
                1 => scratch.one.differentiate(self, frames, first, rows),
                2 => scratch.two.differentiate(self, frames, first, rows),
                3 => scratch.three.differentiate(self, frames, first, rows),
                _ => scratch.four.differentiate(self, frames, first, rows),
            };
        }
        *rows.scratch() = scratch;
    }
}

/// Memory for derivatives of residuals, by one frame to four at once.
#[derive(Clone, Debug, Default)]
pub(crate) struct Scratch {
    one: Seeded<6>,
    two: Seeded<12>,
    three: Seeded<18>,
    four: Seeded<24>,
}

impl Scratch {
    /// Memory that suffices for the terms, whose derivatives all come by dual numbers.
    pub(crate) fn of<'a>(terms: impl Iterator<Item = &'a TermLayout>) -> Self {
        let mut scratch = Self::default();
        for term in terms {
            let (n_frames, n_rows) = (term.nodes.len(), term.n_slots);
            if n_frames >= 4 {
                scratch.four.reserve(n_frames, n_rows);
            }
            match n_frames % 4 {
                1 => scratch.one.reserve(n_frames, n_rows),
                2 => scratch.two.reserve(n_frames, n_rows),
                3 => scratch.three.reserve(n_frames, n_rows),
                _ => {}
            }
        }
        scratch
    }
}

/// The frames that a residual reads and its rows, with derivatives by `N` directions: six of each frame that is seeded.
#[derive(Clone, Debug, Default)]
struct Seeded<const N: usize> {
    frames: Vec<Frame<Dual<N>>>,
    residual: Vec<Dual<N>>,
}

impl<const N: usize> Seeded<N> {
    fn reserve(&mut self, n_frames: usize, n_rows: usize) {
        self.frames.reserve(n_frames);
        self.residual.reserve(n_rows);
    }

    /// Puts the derivative by `N / 6` frames from the `first` on into rows, and says how many frames that were.
    fn differentiate<R: Residual>(
        &mut self,
        of: &R,
        frames: &[Frame<f64>],
        first: usize,
        rows: &mut Rows<'_>,
    ) -> usize {
        let n_seeded = N / 6;
        self.frames.clear();
        self.frames.extend(frames.iter().map(Frame::constant));
        for (place, idx) in (first..first + n_seeded).enumerate() {
            seed(&mut self.frames[idx], &frames[idx], 6 * place);
        }
        self.residual.clear();
        self.residual.resize(of.n_rows(), Dual::from(0.0));
        of.evaluate(&self.frames, &mut self.residual);
        for (row, value) in self.residual.iter().enumerate() {
            for (place, idx) in (first..first + n_seeded).enumerate() {
                let derivatives = &value.derivatives[6 * place..6 * place + 6];
                rows.by_frame(row, idx).copy_from_slice(derivatives);
            }
        }
        n_seeded
    }
}

/// Gives a frame derivatives by its own six directions, three of its origin and three of its rotation, in the places from
/// `first` on.
fn seed<const N: usize>(seeded: &mut Frame<Dual<N>>, frame: &Frame<f64>, first: usize) {
    let axes = [Vec3::new(1.0, 0.0, 0.0), Vec3::new(0.0, 1.0, 0.0), Vec3::new(0.0, 0.0, 1.0)];
    let origin = &mut seeded.origin;
    for (k, number) in [&mut origin.x, &mut origin.y, &mut origin.z].into_iter().enumerate() {
        number.derivatives[first + k] = 1.0;
    }
    // A column turns with ω: its derivative in direction k is e_k × column.
    let turning = |dual: &mut Vec3<Dual<N>>, column: Vec3<f64>| {
        for (k, axis) in axes.into_iter().enumerate() {
            let change = axis.cross(column);
            dual.x.derivatives[first + 3 + k] = change.x;
            dual.y.derivatives[first + 3 + k] = change.y;
            dual.z.derivatives[first + 3 + k] = change.z;
        }
    };
    let (to, from) = (&mut seeded.rotation, &frame.rotation);
    turning(&mut to.x, from.x);
    turning(&mut to.y, from.y);
    turning(&mut to.z, from.z);
}
