//! The path of a target: points at times, and a smooth curve through them.

use glam::{DQuat, DVec3};

/// Points at increasing times, which a target runs through; see [`MotionProblem::add_moving`](crate::MotionProblem::add_moving).
#[derive(Clone, Debug, PartialEq)]
pub struct TargetPath {
    times: Vec<f64>,
    points: Vec<DVec3>,
}

/// The shortest time between two points, seconds.
const LEAST_STEP: f64 = 1e-9;
/// The furthest a point may be.
const FURTHEST: f64 = 1e100;

/// Why a path cannot exist.
#[derive(Clone, Copy, Debug, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum TargetPathError {
    /// No point, or another number of times than of points.
    #[error("a path has as many times as points and at least one, not {times} times and {points} points")]
    Count {
        /// How many times.
        times: usize,
        /// How many points.
        points: usize,
    },
    /// A time that is not finite, or not at least a nanosecond later than the one before.
    #[error("time {idx} of a path must be finite and later than the one before it, not {secs} s")]
    Time {
        /// Its position.
        idx: usize,
        /// What it was.
        secs: f64,
    },
    /// A point that is not finite, or further away than 10¹⁰⁰ m.
    #[error("point {0} of a path has a number that is not finite, or beyond 1e100")]
    Point(usize),
}

impl TargetPath {
    /// A path through points (metres, in the world) at times (seconds).
    ///
    /// # Errors
    /// No point, other times than points, times that do not increase, numbers that are not finite.
    pub fn new(times: Vec<f64>, points: Vec<DVec3>) -> Result<Self, TargetPathError> {
        if times.is_empty() || times.len() != points.len() {
            return Err(TargetPathError::Count { times: times.len(), points: points.len() });
        }
        let is_wrong = |idx: &usize| {
            let secs = times[*idx];
            !secs.is_finite() || (*idx > 0 && secs - times[*idx - 1] < LEAST_STEP)
        };
        if let Some(idx) = (0..times.len()).find(is_wrong) {
            return Err(TargetPathError::Time { idx, secs: times[idx] });
        }
        if let Some(idx) = points.iter().position(|p| !p.is_finite() || p.abs().max_element() > FURTHEST) {
            return Err(TargetPathError::Point(idx));
        }
        Ok(Self { times, points })
    }

    /// The path, turned about the world's origin.
    #[must_use]
    pub fn turned(mut self, turn: DQuat) -> Self {
        self.points.iter_mut().for_each(|p| *p = turn * *p);
        self
    }

    /// Its times (seconds) and points.
    pub fn points(&self) -> impl ExactSizeIterator<Item = (f64, DVec3)> + '_ {
        self.times.iter().copied().zip(self.points.iter().copied())
    }

    /// When it begins and ends, seconds.
    #[must_use]
    pub fn span(&self) -> (f64, f64) {
        (self.times[0], self.times[self.times.len() - 1])
    }

    /// The point at a time (seconds): on a cubic through all points whose velocity at each is that of the parabola through
    /// it and its neighbours (straight between two points). Before the first and after the last, and for a time
    /// that is not a number, it stays at that end.
    #[must_use]
    pub fn at(&self, secs: f64) -> DVec3 {
        let after = self.times.partition_point(|t| *t <= secs);
        if after == 0 || after == self.times.len() {
            return self.points[after.saturating_sub(1)];
        }
        let before = after - 1;
        let (p, q) = (self.points[before], self.points[after]);
        let width = self.times[after] - self.times[before];
        let u = (secs - self.times[before]) / width;
        let chord = q - p;
        // Slopes by u; at either end of the path the curve is a parabola.
        let (start, end) = match (self.velocity(before), self.velocity(after)) {
            (Some(a), Some(b)) => (a * width, b * width),
            (Some(a), None) => (a * width, 2.0 * chord - a * width),
            (None, Some(b)) => (2.0 * chord - b * width, b * width),
            (None, None) => (chord, chord),
        };
        p + u * (start + u * ((3.0 * chord - 2.0 * start - end) + u * (start + end - 2.0 * chord)))
    }

    /// The velocity at a point between two others.
    fn velocity(&self, idx: usize) -> Option<DVec3> {
        if idx == 0 || idx + 1 == self.times.len() {
            return None;
        }
        let (h0, h1) = (self.times[idx] - self.times[idx - 1], self.times[idx + 1] - self.times[idx]);
        let before = (self.points[idx] - self.points[idx - 1]) / h0;
        let after = (self.points[idx + 1] - self.points[idx]) / h1;
        Some((before * h1 + after * h0) / (h0 + h1))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn it_runs_through_its_points_and_along_parabolas() {
        let times = vec![0.0, 0.3, 1.0, 1.2];
        let parabola = |t: f64| DVec3::new(1.0 + 2.0 * t, 3.0 * t * t, -t + 0.5 * t * t);
        let path = TargetPath::new(times.clone(), times.iter().map(|t| parabola(*t)).collect()).unwrap();
        for t in [0.0, 0.1, 0.3, 0.77, 1.0, 1.13, 1.2] {
            assert!(path.at(t).distance(parabola(t)) < 1e-12, "{t}");
        }
        assert_eq!((path.at(-5.0), path.at(9.0)), (parabola(0.0), parabola(1.2)));
        assert_eq!(path.span(), (0.0, 1.2));
        let two = TargetPath::new(vec![1.0, 2.0], vec![DVec3::ZERO, DVec3::X]).unwrap();
        assert!(two.at(1.25).distance(0.25 * DVec3::X) < 1e-15);
        assert_eq!(TargetPath::new(vec![1.0], vec![DVec3::Y]).unwrap().at(0.0), DVec3::Y);
    }

    #[test]
    fn what_is_no_path_says_why() {
        let new = |times: &[f64], points: &[DVec3]| TargetPath::new(times.to_vec(), points.to_vec());
        assert_eq!(new(&[], &[]), Err(TargetPathError::Count { times: 0, points: 0 }));
        assert_eq!(new(&[0.0], &[]), Err(TargetPathError::Count { times: 1, points: 0 }));
        assert_eq!(new(&[0.0, 0.0], &[DVec3::ZERO; 2]), Err(TargetPathError::Time { idx: 1, secs: 0.0 }));
        assert!(matches!(new(&[f64::NAN], &[DVec3::ZERO]), Err(TargetPathError::Time { idx: 0, .. })));
        assert_eq!(new(&[0.0], &[DVec3::splat(1e308)]), Err(TargetPathError::Point(0)));
        assert!(matches!(new(&[0.0, 1e-310], &[DVec3::ZERO; 2]), Err(TargetPathError::Time { idx: 1, .. })));
        assert_eq!(new(&[0.0], &[DVec3::NAN]), Err(TargetPathError::Point(0)));
    }
}
