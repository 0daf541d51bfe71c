//! Centre of mass: at a point, or over an area of the ground.

use glam::{DVec2, DVec3};
use ikiru_rig::JointId;

use crate::objective::{Objective, Part, Reads, Rows, Unfit, View};
use crate::objectives::position::{check_point, check_target};
use crate::words::Unit;

/// A part of the body that goes with one joint.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Mass {
    /// The joint.
    pub joint: JointId,
    /// Its mass, kilograms, above 0.
    pub kg: f64,
    /// Its centre, in the joint's frame (metres).
    pub center: DVec3,
}

/// Where the centre of mass should be.
#[derive(Clone, Debug, PartialEq)]
enum Wanted {
    At(DVec3),
    /// Corners of a convex area in x and z, anticlockwise seen from the direction in which z × x looks up.
    Over {
        corners: Vec<DVec2>,
        margin: f64,
    },
}

/// Brings the body's centre of mass to a point, or over an area of the ground and so far inside it as a margin says.
///
/// Residual: of a point, 3 rows in metres, the centre minus the point; of an area, 1 row in metres for each edge, which
/// wants to be at least 0: how far inside the edge the centre is, along the ground, less the margin.
#[derive(Clone, Debug, PartialEq)]
pub struct CenterOfMass {
    masses: Vec<Mass>,
    wanted: Wanted,
}

impl CenterOfMass {
    /// The centre of these masses at a point of the world (metres).
    #[must_use]
    pub fn at(masses: &[Mass], target: DVec3) -> Self {
        Self { masses: masses.to_vec(), wanted: Wanted::At(target) }
    }

    /// The centre of these masses over the convex hull of points `[x, z]` of the ground (metres), and inside it by a
    /// margin of at least 0 (metres).
    ///
    /// # Errors
    /// Points that are not finite or lie on a line, a margin that leaves nothing of the area.
    pub fn over(masses: &[Mass], points: &[[f64; 2]], margin: f64) -> Result<Self, Unfit> {
        if !(margin.is_finite() && margin >= 0.0 && points.iter().flatten().all(|x| x.is_finite())) {
            return Err("has a margin or points that are not finite, or a margin below 0".into());
        }
        let corners = hull(points.iter().map(|point| DVec2::from(*point)).collect());
        if corners.len() < 3 {
            return Err("has an area without extent: three points that are not on one line are needed".into());
        }
        if !has_room(&corners, margin) {
            return Err("has a margin that leaves nothing of its area".into());
        }
        Ok(Self { masses: masses.to_vec(), wanted: Wanted::Over { corners, margin } })
    }

    /// The masses.
    #[must_use]
    pub fn masses(&self) -> &[Mass] {
        &self.masses
    }

    /// The point that it aims at, if it aims at one.
    #[must_use]
    pub fn target(&self) -> Option<DVec3> {
        match self.wanted {
            Wanted::At(target) => Some(target),
            Wanted::Over { .. } => None,
        }
    }

    /// Changes the point that it aims at; an area is given up for it.
    pub fn set_target(&mut self, target: DVec3) {
        self.wanted = Wanted::At(target);
    }

    fn edges(corners: &[DVec2]) -> impl Iterator<Item = (DVec2, DVec2)> + '_ {
        // The inner normal of an edge, and a point on it.
        let next = |i: usize| corners[(i + 1) % corners.len()];
        corners.iter().enumerate().map(move |(i, corner)| ((next(i) - corner).perp().normalize(), *corner))
    }
}

/// The convex hull, anticlockwise (Andrew's monotone chain).
fn hull(mut points: Vec<DVec2>) -> Vec<DVec2> {
    points.sort_by(|a, b| a.x.total_cmp(&b.x).then(a.y.total_cmp(&b.y)));
    points.dedup();
    let half = |points: &mut dyn Iterator<Item = DVec2>| {
        let mut chain: Vec<DVec2> = Vec::new();
        for point in points {
            while let [.., a, b] = chain[..]
                && (b - a).perp_dot(point - b) <= 1e-12 * (b - a).length() * (point - b).length()
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
    corners
}

/// Whether something is left of a convex area inside all its edges by a margin: the area cut by each edge in turn.
fn has_room(corners: &[DVec2], margin: f64) -> bool {
    let mut left = corners.to_vec();
    for (normal, on_edge) in CenterOfMass::edges(corners) {
        let inside = |p: DVec2| normal.dot(p - on_edge) - margin;
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

impl Objective for CenterOfMass {
    fn kind(&self) -> &'static str {
        "center_of_mass"
    }

    fn reads(&self, reads: &mut Reads<'_>) -> Result<(), Unfit> {
        self.masses.iter().try_for_each(|mass| reads.frame(mass.joint))?;
        reads.part(match &self.wanted {
            Wanted::At(_) => Part::new(3, Unit::Metres),
            Wanted::Over { corners, .. } => Part::at_least(corners.len(), Unit::Metres),
        })
    }

    fn check(&self) -> Result<(), Unfit> {
        if self.masses.is_empty() {
            return Err("has no masses".into());
        }
        for mass in &self.masses {
            check_point(mass.center).map_err(|unfit| Unfit { joint: Some(mass.joint), ..unfit })?;
            if !(mass.kg.is_finite() && mass.kg > 0.0) {
                let reason = "has a mass that is not a finite number above 0";
                return Err(Unfit { reason, joint: Some(mass.joint) });
            }
        }
        self.target().map_or(Ok(()), check_target)
    }

    fn evaluate(&self, view: &View<'_>, rows: &mut Rows<'_>) {
        let arm = |idx: usize| view.frame(idx).rotation.apply_constant(self.masses[idx].center).value();
        let total: f64 = self.masses.iter().map(|mass| mass.kg).sum();
        let mut center = DVec3::ZERO;
        for (idx, mass) in self.masses.iter().enumerate() {
            center += (view.frame(idx).origin.value() + arm(idx)) * (mass.kg / total);
        }
        // A row whose residual grows along a direction of the world.
        let pull = |rows: &mut Rows<'_>, row: usize, along: DVec3| {
            for (idx, mass) in self.masses.iter().enumerate() {
                let along = along * (mass.kg / total);
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
            Wanted::Over { corners, margin } => {
                let ground = DVec2::new(center.x, center.z);
                for (normal, on_edge) in Self::edges(corners) {
                    let row = rows.open(0, [normal.dot(ground - on_edge) - margin]);
                    if rows.wants_jacobian() {
                        pull(rows, row, DVec3::new(normal.x, 0.0, normal.y));
                    }
                }
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::check::{check_on_whole_rigs, residual_at};
    use ikiru_rig::Frame;
    use ikiru_testkit::rigs::Random;

    fn masses(n: usize, random: &mut Random) -> Vec<Mass> {
        let mass = |idx| Mass {
            joint: JointId::from_index(idx),
            kg: random.between(0.1, 9.0),
            center: random.vector(0.2),
        };
        (0..n).map(mass).collect()
    }

    #[test]
    fn derivatives() {
        check_on_whole_rigs(|rig, random| {
            let masses = masses(rig.n_joints(), random);
            if random.below(2) == 0 {
                return CenterOfMass::at(&masses, random.vector(1.0));
            }
            let points: Vec<[f64; 2]> =
                (0..7).map(|_| [random.between(-1.0, 1.0), random.between(-1.0, 1.0)]).collect();
            CenterOfMass::over(&masses, &points, 0.01).unwrap()
        });
    }

    #[test]
    fn the_center_is_the_weighted_mean() {
        let joints = [0, 1].map(JointId::from_index);
        let masses = [
            Mass { joint: joints[0], kg: 3.0, center: DVec3::X },
            Mass { joint: joints[1], kg: 1.0, center: DVec3::ZERO },
        ];
        let mut away = Frame::identity();
        away.origin.z = 4.0;
        let frames = [Frame::identity(), away];
        let at = CenterOfMass::at(&masses, DVec3::Y);
        assert_eq!(residual_at(&at, &frames), [0.75, -1.0, 1.0]);
        // Over a square from 0 to 2 in any order of its corners, in which the centre (0.75, 1) lies.
        let square = [[0.0, 0.0], [2.0, 2.0], [2.0, 0.0], [0.0, 2.0], [1.0, 1.0]];
        let mut inside = residual_at(&CenterOfMass::over(&masses, &square, 0.1).unwrap(), &frames);
        inside.sort_by(f64::total_cmp);
        for (found, expected) in inside.iter().zip([0.65, 0.9, 0.9, 1.15]) {
            assert!((found - expected).abs() < 1e-12, "{inside:?}");
        }
    }

    #[test]
    fn areas_without_room_are_refused() {
        let masses = masses(1, &mut Random::new(1));
        let over = |points: &[[f64; 2]], margin| CenterOfMass::over(&masses, points, margin);
        let triangle = [[0.0, 0.0], [1.0, 0.0], [0.0, 1.0]];
        // Its inner circle has the radius 0.2929.
        assert!(over(&triangle, 0.29).is_ok() && over(&triangle, 0.295).is_err());
        assert!(over(&[[0.0, 0.0], [1.0, 1.0], [2.0, 2.0]], 0.0).is_err());
        assert!(over(&triangle, -0.1).is_err() && over(&[[f64::NAN, 0.0]; 3], 0.0).is_err());
        assert!(CenterOfMass::at(&[], DVec3::ZERO).check().is_err());
        assert!(CenterOfMass::at(&[Mass { kg: 0.0, ..masses[0] }], DVec3::ZERO).check().is_err());
    }
}
