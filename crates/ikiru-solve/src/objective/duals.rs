//! Memory in which residuals are differentiated by dual numbers, by one frame to four at once.

use ikiru_rig::{Dual, Frame, Vec3};

use crate::objective::places::TermLayout;

/// The directions of one frame: three of its origin, three of its rotation.
pub(crate) const N_DIRECTIONS: usize = 6;

/// Memory for each number of frames.
#[derive(Clone, Debug, Default)]
pub(crate) struct Scratch {
    pub(crate) one: Seeded<6>,
    pub(crate) two: Seeded<12>,
    pub(crate) three: Seeded<18>,
    pub(crate) four: Seeded<24>,
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
pub(crate) struct Seeded<const N: usize> {
    frames: Vec<Frame<Dual<N>>>,
    residual: Vec<Dual<N>>,
}

impl<const N: usize> Seeded<N> {
    fn reserve(&mut self, n_frames: usize, n_rows: usize) {
        self.frames.reserve(n_frames);
        self.residual.reserve(n_rows);
    }

    /// The frames with derivatives by those from the `first` on, and room for the rows.
    pub(crate) fn seed(
        &mut self,
        frames: &[Frame<f64>],
        first: usize,
        n_rows: usize,
    ) -> (&[Frame<Dual<N>>], &mut [Dual<N>]) {
        self.frames.clear();
        self.frames.extend(frames.iter().map(Frame::constant));
        let seeded = self.frames[first..].iter_mut().zip(&frames[first..]);
        for (place, (seeded, frame)) in seeded.take(N / N_DIRECTIONS).enumerate() {
            seed(seeded, frame, N_DIRECTIONS * place);
        }
        self.residual.clear();
        self.residual.resize(n_rows, Dual::from(0.0));
        (&self.frames, &mut self.residual)
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
