//! Centre of mass: at a point, or over an area of the ground.

use glam::{DQuat, DVec2, DVec3};
use ikiru_rig::Segment;

use crate::objective::{Objective, Part, Reads, Rows, Unfit, UnfitReason, View};
use crate::objectives::position::{check_point, check_target};
use crate::words::Unit;

/// Where the centre of mass should be.
#[derive(Clone, Debug, PartialEq)]
enum Wanted {
    At(DVec3),
    Over(Area),
}

/// A convex area of the ground.
#[derive(Clone, Debug, PartialEq)]
struct Area {
    /// At the height of the world's origin, anticlockwise seen from above.
    corners: Vec<DVec3>,
    /// Of unit length.
    up: DVec3,
    margin: f64,
}

/// Brings the body's centre of mass to a point, or over an area of the ground and so far inside it as a margin says.
///
/// Residual: of a point, 3 rows in metres, the centre minus the point; of an area, 1 row in metres for each edge, which
/// wants to be at least 0: how far inside the edge the centre is, along the ground, less the margin.
#[derive(Clone, Debug, PartialEq)]
pub struct CenterOfMass {
    segments: Vec<Segment>,
    wanted: Wanted,
}

impl CenterOfMass {
    /// The centre of these segments at a point of the world (metres).
    #[must_use]
    pub fn at(segments: &[Segment], target: DVec3) -> Self {
        Self { segments: segments.to_vec(), wanted: Wanted::At(target) }
    }

    /// The centre of these segments over the convex hull of points of the world (metres), whatever their heights, and
    /// inside it by a margin of at least 0 (metres). `up` says what is height: a direction of the world, of any length
    /// but 0, in the library's own world [`DVec3::Y`].
    ///
    /// # Errors
    /// Points that are not finite or, seen from above, lie on a line; a margin that is not a number of at least 0 or leaves
    /// nothing of the area; an `up` without direction.
    pub fn over(segments: &[Segment], points: &[DVec3], up: DVec3, margin: f64) -> Result<Self, Unfit> {
        let Some(up) = up.try_normalize() else {
            return Err(UnfitReason::NoUp.into());
        };
        if !(margin.is_finite() && margin >= 0.0 && points.iter().all(|point| point.is_finite())) {
            return Err(UnfitReason::Area.into());
        }
        let area = Area { corners: hull(points, up), up, margin };
        if area.corners.len() < 3 {
            return Err(UnfitReason::NoArea.into());
        }
        if !area.has_room() {
            return Err(UnfitReason::NoRoom.into());
        }
        Ok(Self { segments: segments.to_vec(), wanted: Wanted::Over(area) })
    }

    /// The parts of the body that it counts.
    #[must_use]
    pub fn segments(&self) -> &[Segment] {
        &self.segments
    }

    /// The point that it aims at, if it aims at one.
    #[must_use]
    pub fn target(&self) -> Option<DVec3> {
        match self.wanted {
            Wanted::At(target) => Some(target),
            Wanted::Over(_) => None,
        }
    }

    /// Changes the point that it aims at; an area is given up for it.
    pub fn set_target(&mut self, target: DVec3) {
        self.wanted = Wanted::At(target);
    }

    /// The corners of the area that it wants to be over, if there is one, at the height of the world's origin; what is up;
    /// and the margin (metres).
    #[must_use]
    pub fn area(&self) -> Option<(&[DVec3], DVec3, f64)> {
        match &self.wanted {
            Wanted::At(_) => None,
            Wanted::Over(Area { corners, up, margin }) => Some((corners, *up, *margin)),
        }
    }

    /// Turns the point, or the area and what is up, about the world's origin: takes them to other axes of the world.
    pub fn turn(&mut self, rotation: DQuat) {
        match &mut self.wanted {
            Wanted::At(target) => *target = rotation * *target,
            Wanted::Over(area) => {
                area.corners.iter_mut().for_each(|corner| *corner = rotation * *corner);
                area.up = rotation * area.up;
            }
        }
    }
}

impl Area {
    /// The inner normal of each edge, along the ground, and a point on it.
    fn edges(&self) -> impl Iterator<Item = (DVec3, DVec3)> + '_ {
        let next = |i: usize| self.corners[(i + 1) % self.corners.len()];
        let edge = move |(i, corner): (usize, &DVec3)| (self.up.cross(next(i) - corner).normalize(), *corner);
        self.corners.iter().enumerate().map(edge)
    }

    /// Whether something is left inside all edges by the margin: the area cut by each edge in turn.
    fn has_room(&self) -> bool {
        let mut left = self.corners.clone();
        for (normal, on_edge) in self.edges() {
            let inside = |p: DVec3| normal.dot(p - on_edge) - self.margin;
            let mut cut = Vec::with_capacity(left.len() + 1);
            for (i, &p) in left.iter().enumerate() {
                let next = left[(i + 1) % left.len()];
                let (here, there) = (inside(p), inside(next));
                if here >= 0.0 {
                    cut.push(p);
                }
                if (here >= 0.0) != (there >= 0.0) {
                    cut.push(p + (next - p) * (here / (here - there)));
                }
            }
            left = cut;
        }
        !left.is_empty()
    }
}

/// The convex hull of points seen from above, anticlockwise (Andrew's monotone chain).
fn hull(points: &[DVec3], up: DVec3) -> Vec<DVec3> {
    let first = up.any_orthonormal_vector();
    let second = up.cross(first);
    let mut points: Vec<(DVec2, DVec3)> = points
        .iter()
        .map(|point| (DVec2::new(first.dot(*point), second.dot(*point)), point.reject_from_normalized(up)))
        .collect();
    points.sort_by(|(a, _), (b, _)| a.x.total_cmp(&b.x).then(a.y.total_cmp(&b.y)));
    points.dedup_by_key(|(seen, _)| *seen);
    let half = |points: &mut dyn Iterator<Item = (DVec2, DVec3)>| {
        let mut chain: Vec<(DVec2, DVec3)> = Vec::new();
        for point in points {
            while let [.., (a, _), (b, _)] = chain[..]
                && (b - a).perp_dot(point.0 - b) <= 1e-12 * (b - a).length() * (point.0 - b).length()
            {
                chain.pop();
            }
            chain.push(point);
        }
        chain.pop();
        chain
    };
    let mut corners = half(&mut points.iter().copied());
    corners.extend(half(&mut points.iter().rev().copied()));
    corners.into_iter().map(|(_, corner)| corner).collect()
}

impl Objective for CenterOfMass {
    fn kind(&self) -> &'static str {
        "center_of_mass"
    }

    fn reads(&self, reads: &mut Reads<'_>) -> Result<(), Unfit> {
        self.segments.iter().try_for_each(|segment| reads.frame(segment.joint))?;
        reads.part(match &self.wanted {
            Wanted::At(_) => Part::new(3, Unit::Metres),
            Wanted::Over(area) => Part::at_least(area.corners.len(), Unit::Metres),
        })
    }

    fn check(&self) -> Result<(), Unfit> {
        if self.segments.is_empty() {
            return Err(UnfitReason::NoMasses.into());
        }
        for Segment { joint, kg, center } in &self.segments {
            check_point(*center).map_err(|unfit| Unfit { joint: Some(*joint), ..unfit })?;
            if !(kg.is_finite() && *kg > 0.0) {
                return Err(Unfit::of_joint(UnfitReason::Mass, *joint));
            }
        }
        self.target().map_or(Ok(()), check_target)
    }

    fn evaluate(&self, view: &View<'_>, rows: &mut Rows<'_>) {
        let arm = |idx: usize| view.frame(idx).rotation.apply_constant(self.segments[idx].center).value();
        let total: f64 = self.segments.iter().map(|segment| segment.kg).sum();
        let mut center = DVec3::ZERO;
        for (idx, segment) in self.segments.iter().enumerate() {
            center += (view.frame(idx).origin.value() + arm(idx)) * (segment.kg / total);
        }
        // A row whose residual grows along a direction of the world.
        let pull = |rows: &mut Rows<'_>, row: usize, along: DVec3| {
            for (idx, segment) in self.segments.iter().enumerate() {
                let along = along * (segment.kg / total);
                let out = rows.by_frame(row, idx);
                out[..3].copy_from_slice(&along.to_array());
                out[3..].copy_from_slice(&arm(idx).cross(along).to_array());
            }
        };
        match &self.wanted {
            Wanted::At(target) => {
                let first = rows.open(0, (center - target).to_array());
                if rows.wants_jacobian() {
                    DVec3::AXES.iter().enumerate().for_each(|(i, axis)| pull(rows, first + i, *axis));
                }
            }
            Wanted::Over(area) => {
                for (normal, on_edge) in area.edges() {
                    let row = rows.open(0, [normal.dot(center - on_edge) - area.margin]);
                    if rows.wants_jacobian() {
                        pull(rows, row, normal);
                    }
                }
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::front::check::{check_on_whole_rigs, residual_at};
    use ikiru_rig::{Frame, JointId};
    use ikiru_testkit::rigs::Random;

    fn segments(n: usize, random: &mut Random) -> Vec<Segment> {
        let segment = |idx| Segment {
            joint: JointId::from_index(idx),
            kg: random.between(0.1, 9.0),
            center: random.vector(0.2),
        };
        (0..n).map(segment).collect()
    }

    #[test]
    fn derivatives() {
        check_on_whole_rigs(|rig, random| {
            let segments = segments(rig.n_joints(), random);
            if random.below(2) == 0 {
                return CenterOfMass::at(&segments, random.vector(1.0));
            }
            let points: Vec<DVec3> = (0..7).map(|_| random.vector(1.0)).collect();
            CenterOfMass::over(&segments, &points, random.vector(1.0), 0.01).unwrap()
        });
    }

    /// Two segments whose centre is (0.75, 0, 1).
    fn pair() -> ([Segment; 2], [Frame; 2]) {
        let joints = [0, 1].map(JointId::from_index);
        let segments = [
            Segment { joint: joints[0], kg: 3.0, center: DVec3::X },
            Segment { joint: joints[1], kg: 1.0, center: DVec3::ZERO },
        ];
        let mut away = Frame::identity();
        away.origin.z = 4.0;
        (segments, [Frame::identity(), away])
    }

    fn sorted(mut numbers: Vec<f64>) -> Vec<f64> {
        numbers.sort_by(f64::total_cmp);
        numbers
    }

    #[track_caller]
    fn near(found: &[f64], expected: &[f64]) {
        assert_eq!(found.len(), expected.len(), "{found:?}");
        for (a, b) in found.iter().zip(expected) {
            assert!((a - b).abs() < 1e-12, "{found:?}");
        }
    }

    #[test]
    fn the_center_is_the_weighted_mean() {
        let (segments, frames) = pair();
        assert_eq!(residual_at(&CenterOfMass::at(&segments, DVec3::Y), &frames), [0.75, -1.0, 1.0]);
        // Over a square from 0 to 2 in any order of its corners and at any height.
        let square = [[0.0, 0.0], [2.0, 2.0], [2.0, 0.0], [0.0, 2.0], [1.0, 1.0]];
        let square = square.map(|[x, z]| DVec3::new(x, 9.0 * z - x, z));
        let over = CenterOfMass::over(&segments, &square, 3.0 * DVec3::Y, 0.1).unwrap();
        near(&sorted(residual_at(&over, &frames)), &[0.65, 0.9, 0.9, 1.15]);
        let (corners, up, margin) = over.area().unwrap();
        assert_eq!((corners.len(), up, margin), (4, DVec3::Y, 0.1));
        assert!(corners.iter().all(|corner| corner.y == 0.0));
    }

    #[test]
    fn what_is_up_says_what_is_ground() {
        // Forward and left of the same body, where z is up: 0.75 and 0.
        let (segments, frames) = pair();
        let area = [[0.5, -1.0], [1.0, -1.0], [1.0, 1.0], [0.5, 1.0]].map(|[x, y]| DVec3::new(x, y, 7.0));
        let over = CenterOfMass::over(&segments, &area, DVec3::Z, 0.0).unwrap();
        near(&sorted(residual_at(&over, &frames)), &[0.25, 0.25, 1.0, 1.0]);
    }

    #[test]
    fn a_turned_world_is_the_same_wish() {
        let mut random = Random::new(3);
        for _ in 0..20 {
            let segments = segments(1, &mut random);
            let points: Vec<DVec3> = (0..7).map(|_| random.vector(1.0)).collect();
            let mut over = CenterOfMass::over(&segments, &points, random.vector(1.0), 0.01).unwrap();
            let (turn, place) = (random.rotation(), random.vector(1.0));
            let before = residual_at(&over, &[Frame::new(DQuat::IDENTITY, place)]);
            over.turn(turn);
            near(&residual_at(&over, &[Frame::new(turn, turn * place)]), &before);
            let mut at = CenterOfMass::at(&segments, place);
            at.turn(turn);
            assert!(at.target().unwrap().distance(turn * place) < 1e-12);
        }
    }

    #[test]
    fn areas_without_room_are_refused() {
        let segments = segments(1, &mut Random::new(1));
        let over = |points: &[DVec3], margin| CenterOfMass::over(&segments, points, DVec3::Y, margin);
        let triangle = [DVec3::ZERO, DVec3::X, DVec3::Z];
        // Its inner circle has the radius 0.2929.
        assert!(over(&triangle, 0.29).is_ok() && over(&triangle, 0.295).is_err());
        assert!(over(&[DVec3::ZERO, DVec3::ONE, 2.0 * DVec3::ONE], 0.0).is_err());
        // One above the other.
        assert!(over(&[DVec3::ZERO, DVec3::X, DVec3::Y], 0.0).is_err());
        assert!(over(&triangle, -0.1).is_err() && over(&[DVec3::NAN; 3], 0.0).is_err());
        assert!(CenterOfMass::over(&segments, &triangle, DVec3::ZERO, 0.0).is_err());
        assert!(CenterOfMass::at(&[], DVec3::ZERO).check().is_err());
        assert!(CenterOfMass::at(&[Segment { kg: 0.0, ..segments[0] }], DVec3::ZERO).check().is_err());
    }
}
