//! What guards do in a step, of a pose and of a motion: which of them act, by what force, and when that changes.
//!
//! A guard `c + a δ` that acts has a force `f`, and `c + a δ + e f = 0` at the step, `e` its compliance: `1 / w` for a wish of
//! weight `w`, next to nothing for a row that is hard. A guard that wants to be at least 0 can push and not pull: it acts while its
//! force is positive. The force of a hard row has an end too, where the row gives way and presses with that, so that rows which
//! contradict each other are missed by least in sum.

use crate::algebra::full_rows::Derivatives;
use crate::algebra::room::make_room;
use crate::state::guards::{Guard, Guards};
use crate::words::Sense;

/// The largest force of a hard row, in units of the largest curvature along one degree of freedom times a metre or radian.
const MOST_FORCE: f64 = 1e5;
/// The compliance of a hard row, relative to what answers its force.
const HARD_COMPLIANCE: f64 = 1e-9;
/// A hard row is taken to be moved by at least this part of the most that its force could move it.
const LEAST_MOVED: f64 = 1e-9;
/// A guard counts as missed beyond this (metres, radians), and a step and a multiplier as wrong, relative to the largest one.
pub(crate) const SLACK: f64 = 1e-12;

/// What one guard does.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(crate) enum Stance {
    /// It has no force.
    #[default]
    Rests,
    /// It has the force that it takes.
    Acts,
    /// Its force, of this sign, is the most that it may be.
    Presses(f64),
}

/// What all guards of a pose or a motion do.
#[derive(Clone, Debug)]
pub(crate) struct Acting {
    pub(crate) stances: Vec<Stance>,
    /// The force of each guard; 0 where it rests.
    pub(crate) force: Vec<f64>,
    /// The residuals that the step is solved for.
    pub(crate) aim: Vec<f64>,
    /// The largest force of a hard row; one that wants more gives way.
    pub(crate) most: f64,
    /// Memory over guards.
    along: Vec<f64>,
}

impl Default for Acting {
    fn default() -> Self {
        Self {
            stances: Vec::new(),
            force: Vec::new(),
            aim: Vec::new(),
            most: f64::INFINITY,
            along: Vec::new(),
        }
    }
}

impl Acting {
    /// So many guards, which rest.
    pub(crate) fn new(n_guards: usize) -> Self {
        Self {
            stances: vec![Stance::Rests; n_guards],
            force: vec![0.0; n_guards],
            aim: vec![0.0; n_guards],
            along: Vec::with_capacity(n_guards),
            ..Self::default()
        }
    }

    /// Makes room for so many guards.
    pub(crate) fn make_room(&mut self, n_guards: usize) {
        make_room(&mut self.stances, n_guards);
        make_room(&mut self.force, n_guards);
        make_room(&mut self.aim, n_guards);
        make_room(&mut self.along, n_guards);
    }

    /// Forgets what acted.
    pub(crate) fn forget(&mut self) {
        self.stances.fill(Stance::Rests);
        self.force.fill(0.0);
    }

    /// Bounds the force of hard rows by a largest curvature along one degree of freedom.
    pub(crate) fn bound_force(&mut self, scale: f64) {
        self.most = MOST_FORCE * scale;
    }

    /// Takes over a linearization: what is closed rests, and all others keep what they do.
    pub(crate) fn begin<D>(&mut self, guards: &Guards<D>) {
        self.stances.resize(guards.guards.len(), Stance::Rests);
        self.force.resize(guards.guards.len(), 0.0);
        for ((guard, stance), force) in guards.guards.iter().zip(&mut self.stances).zip(&mut self.force) {
            if !guard.is_open {
                (*stance, *force) = (Stance::Rests, 0.0);
            }
        }
    }

    /// Takes what the forces do off half a gradient.
    pub(crate) fn balance(&self, rows: &impl Derivatives, gradient: &mut [f64]) {
        rows.add_transposed_of(|row| -self.force[row], gradient);
    }

    /// The next step is to make good a share of what is missed, and to leave the room that there is where nothing is.
    pub(crate) fn aim<D: Derivatives>(&mut self, guards: &Guards<D>, share: f64) {
        let rows = guards.guards.iter().zip(guards.rows.residual());
        self.aim.clear();
        self.aim.extend(rows.map(|(guard, residual)| aim(guard.sense, *residual, share)));
    }

    /// The same for the residuals of some guards somewhere near by, less what the linear model says of the way there, so that the
    /// step is from where the model begins.
    pub(crate) fn aim_from(
        &mut self,
        rows: &impl Derivatives,
        residuals: impl Iterator<Item = (usize, f64)>,
        delta: &[f64],
    ) {
        self.along.clear();
        self.along.resize(self.force.len(), 0.0);
        rows.add_product(delta, &mut self.along);
        self.aim.resize(self.force.len(), 0.0);
        residuals.for_each(|(row, residual)| self.aim[row] = residual - self.along[row]);
    }

    /// Begins a solve: what must act does so, and what acted or pressed at the last one.
    pub(crate) fn open<D>(&mut self, guards: &Guards<D>) {
        for (stance, guard) in self.stances.iter_mut().zip(&guards.guards) {
            if !guard.is_open {
                *stance = Stance::Rests;
            } else if *stance == Stance::Rests && guard.sense == Sense::Equal {
                *stance = Stance::Acts;
            }
        }
    }

    /// Whether a guard acts.
    #[inline(always)]
    pub(crate) fn acts(&self, row: usize) -> bool {
        self.stances[row] == Stance::Acts
    }

    /// Sets the forces of what does not act; says whether a guard presses.
    pub(crate) fn press(&mut self) -> bool {
        let mut presses = false;
        for (stance, force) in self.stances.iter().zip(&mut self.force) {
            match stance {
                Stance::Rests => *force = 0.0,
                Stance::Acts => {}
                Stance::Presses(sign) => (presses, *force) = (true, sign * self.most),
            }
        }
        presses
    }

    /// What presses, and by which force.
    pub(crate) fn pressing(&self, row: usize) -> f64 {
        if matches!(self.stances[row], Stance::Presses(_)) { self.force[row] } else { 0.0 }
    }

    /// What a guard should do where it is wrong about that: `then` is its residual at the step, and what of it is rounding; what
    /// of forces is rounding is `slack`.
    #[inline(always)]
    pub(crate) fn next(
        &self,
        guard: &Guard,
        row: usize,
        slack: f64,
        then: impl FnOnce() -> (f64, f64),
    ) -> Option<Stance> {
        if !guard.is_open {
            return None;
        }
        match self.stances[row] {
            Stance::Acts => {
                let force = self.force[row];
                let most = if guard.weight.is_none() { self.most } else { f64::INFINITY };
                if guard.sense == Sense::AtLeast && force < -slack {
                    Some(Stance::Rests)
                } else if force.abs() > most {
                    Some(Stance::Presses(force.signum()))
                } else {
                    None
                }
            }
            Stance::Rests => {
                let (then, slack) = then();
                (then < -slack).then_some(Stance::Acts)
            }
            // A row that gave way does so no longer where it is kept with less than it presses by.
            Stance::Presses(sign) => {
                let (then, slack) = then();
                (then * sign > slack).then_some(Stance::Acts)
            }
        }
    }

    /// The largest force of a hard row.
    pub(crate) fn largest_hard<D>(&self, guards: &Guards<D>) -> f64 {
        let hard = guards.guards.iter().zip(&self.force).filter(|(guard, _)| guard.weight.is_none());
        hard.map(|(_, force)| force.abs()).fold(0.0, f64::max)
    }
}

/// The residual that a step is to make good of a row: a share of what is missed, and the room that is left where nothing is.
#[inline(always)]
fn aim(sense: Sense, residual: f64, share: f64) -> f64 {
    let missed = sense.missing(residual);
    if missed == 0.0 { residual } else { share * missed }
}

/// The compliance of a hard row whose force moves it by so much, and by so much at most if nothing were held and nothing else
/// wanted. Where all that moves it is held, its force grows large, but not without end, so that what is held is let go of;
/// a row that nothing moves gives way to any force: it has no say.
pub(crate) fn hard_compliance(moved: f64, at_most: f64) -> f64 {
    if at_most > 0.0 { HARD_COMPLIANCE * moved.max(LEAST_MOVED * at_most) } else { f64::MAX.sqrt() }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_share_of_what_is_missed_is_made_good() {
        assert_eq!(aim(Sense::Equal, -0.4, 0.5), -0.2);
        assert_eq!(aim(Sense::AtLeast, -0.4, 0.5), -0.2);
        // What is left stays as it is.
        assert_eq!(aim(Sense::AtLeast, 0.4, 0.5), 0.4);
    }
}
