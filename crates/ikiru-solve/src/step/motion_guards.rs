//! Guards among the rows that a step of a motion is solved over: they join these as long as they act.

use crate::algebra::room::make_room;
use crate::algebra::sample_rows::SampleRows;
use crate::state::guards::Guards;
use crate::step::acting::{Acting, SLACK, Stance};

/// Where steps are solved for iteratively, the stiffness of hard rows relative to the largest curvature: forces that are
/// kept from step to step make up for what it leaves.
const STIFFNESS: f64 = 1e4;

/// A stiff row is still missed by much at more than this part of what a step was to make good, and at so much (metres, radians);
/// for less, the forces that are kept are enough.
const STILL_MISSED: f64 = 0.5;
const LEAST_MISSED: f64 = 1e-4;

/// What the guards of a motion do in its steps.
#[derive(Clone, Debug, Default)]
pub(crate) struct MotionGuards {
    pub(crate) acting: Acting,
    /// What guards are at a step.
    then: Vec<f64>,
    is_iterative: bool,
    /// The compliance of hard rows where steps are solved for iteratively.
    compliance: f64,
}

impl MotionGuards {
    /// Makes room for so many guards.
    pub(crate) fn make_room(&mut self, n_guards: usize) {
        self.acting.make_room(n_guards);
        make_room(&mut self.then, n_guards);
    }

    /// Takes over a linearization of this largest curvature.
    pub(crate) fn begin(&mut self, guards: &Guards<SampleRows>, is_iterative: bool, scale: f64) {
        (self.is_iterative, self.compliance) = (is_iterative, 1.0 / (STIFFNESS * scale));
        self.acting.bound_force(scale);
        self.acting.begin(guards);
    }

    /// The compliance of a row: 0 for a hard one where steps are solved for exactly.
    fn compliance(&self, guards: &Guards<SampleRows>, row: usize) -> f64 {
        match guards.guards[row].weight {
            Some(weight) => 1.0 / weight,
            None if self.is_iterative => self.compliance,
            None => 0.0,
        }
    }

    /// Adds a guard that acts to the rows that a step is solved over.
    pub(crate) fn push_to(&self, guards: &Guards<SampleRows>, row: usize, rows: &mut SampleRows) {
        let compliance = self.compliance(guards, row);
        if self.is_iterative {
            rows.push_scaled(&guards.rows, row, self.residual(guards, row), 1.0 / compliance.sqrt(), 1.0);
        } else {
            rows.push_scaled(&guards.rows, row, self.residual(guards, row), 1.0, compliance);
        }
    }

    /// The residual of a guard among the rows that a step is solved over.
    pub(crate) fn residual(&self, guards: &Guards<SampleRows>, row: usize) -> f64 {
        let Acting { aim, force, .. } = &self.acting;
        if !self.is_iterative {
            return aim[row];
        }
        let compliance = self.compliance(guards, row);
        let kept = if guards.guards[row].weight.is_none() { compliance * force[row] } else { 0.0 };
        (aim[row] - kept) / compliance.sqrt()
    }

    /// Takes over the multiplier of a guard that acts among the rows that the step was solved over.
    pub(crate) fn set_force(&mut self, guards: &Guards<SampleRows>, row: usize, multiplier: f64) {
        let scale = if self.is_iterative { 1.0 / self.compliance(guards, row).sqrt() } else { 1.0 };
        self.acting.force[row] = -scale * multiplier;
    }

    /// Lets guards rest that would have to pull, and has those act that a step misses, or that gave way to less than they press by;
    /// says whether there was one.
    pub(crate) fn exchange(&mut self, guards: &Guards<SampleRows>, delta: &[f64]) -> bool {
        self.then.clone_from(&self.acting.aim);
        guards.rows.add_product(delta, &mut self.then);
        let mut changed = false;
        for (row, guard) in guards.guards.iter().enumerate() {
            // A force that is wrong by rounding is wrong too: there are few rounds.
            let next = self.acting.next(guard, row, 0.0, || (self.then[row], SLACK));
            if let Some(next) = next.filter(|next| !matches!(next, Stance::Presses(_))) {
                (changed, self.acting.stances[row]) = (true, next);
            }
        }
        changed
    }

    /// Has hard rows press that want more force than they may have, the strongest of each sample: the others may then have enough.
    /// Follows an [`exchange`](Self::exchange); says whether there was one.
    pub(crate) fn give_way(&mut self, guards: &Guards<SampleRows>) -> bool {
        let mut changed = false;
        for block in &guards.rows.blocks {
            let mut strongest: Option<(usize, f64)> = None;
            for row in block.first..block.first + block.n_rows {
                if !self.acting.acts(row) || guards.guards[row].weight.is_some() {
                    continue;
                }
                let (force, wanted) = (self.acting.force[row], self.wanted_force(guards, row));
                if wanted.abs() > self.acting.most {
                    // Of those that want force without end the one that misses most.
                    let strength = if self.is_iterative { self.then[row].abs() } else { force.abs() };
                    if strongest.is_none_or(|(_, most)| strength > most) {
                        strongest = Some((row, strength));
                    }
                } else if wanted != force {
                    (changed, self.acting.force[row]) = (true, wanted);
                }
            }
            if let Some((row, _)) = strongest {
                (changed, self.acting.stances[row]) =
                    (true, Stance::Presses(self.acting.force[row].signum()));
            }
        }
        changed
    }

    /// The force that a hard row wants. Solved for exactly it has that; a stiff one that is still missed by much goes on to want
    /// more, as much as it takes if what the force did so far is a measure.
    fn wanted_force(&self, guards: &Guards<SampleRows>, row: usize) -> f64 {
        let (force, sense) = (self.acting.force[row], guards.guards[row].sense);
        let [aim, then] = [self.acting.aim[row], self.then[row]].map(|residual| sense.missing(residual));
        if !self.is_iterative || then.abs() <= STILL_MISSED * aim.abs().max(LEAST_MISSED) {
            return force;
        }
        let part_made_good = (aim - then) / aim;
        if part_made_good > 0.0 { force / part_made_good } else { force.signum() * f64::INFINITY }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::algebra::sample_rows::Block;
    use crate::state::guards::Guard;
    use crate::words::Sense;

    /// The residuals of four rows, and their derivatives by the two degrees of freedom of the second of two samples.
    const RESIDUAL: [f64; 4] = [-0.4, 0.3, -0.2, 0.1];
    const JACOBIAN: [[f64; 2]; 4] = [[1.0, 2.0], [-1.0, 0.5], [0.3, 0.0], [0.0, -2.0]];
    const DELTA: [f64; 4] = [7.0, 7.0, 0.3, -0.1];

    /// A hard equality, a hard bound, a wished bound of weight 4, and a hard bound that is closed.
    fn guards() -> Guards<SampleRows> {
        let mut guards = Guards::default();
        guards.rows = SampleRows::dense(2, RESIDUAL.len());
        for (row, entries) in JACOBIAN.iter().enumerate() {
            guards.rows.push(row, RESIDUAL[row], |_, k| entries[k]);
        }
        guards.rows.blocks.push(Block { sample: 1, first: 0, n_rows: RESIDUAL.len() });
        let guard = |sense, weight, is_open| Guard { sense, weight, is_open };
        guards.guards = vec![
            guard(Sense::Equal, None, true),
            guard(Sense::AtLeast, None, true),
            guard(Sense::AtLeast, Some(4.0), true),
            guard(Sense::AtLeast, None, false),
        ];
        guards
    }

    /// What a row changes by along the step.
    fn along(row: usize) -> f64 {
        JACOBIAN[row][0] * DELTA[2] + JACOBIAN[row][1] * DELTA[3]
    }

    /// Every open row acts, of a linearization whose largest curvature is 2.
    fn acting(guards: &Guards<SampleRows>, is_iterative: bool) -> MotionGuards {
        let mut acting = MotionGuards::default();
        acting.begin(guards, is_iterative, 2.0);
        acting.acting.stances.fill(Stance::Acts);
        acting.acting.open(guards);
        acting.acting.aim(guards, 1.0);
        acting
    }

    fn acts(guards: &MotionGuards) -> [bool; 4] {
        [0, 1, 2, 3].map(|row| guards.acting.acts(row))
    }

    fn near(a: f64, b: f64) -> bool {
        (a - b).abs() < 1e-9 * (1.0 + b.abs())
    }

    #[test]
    fn equalities_act_at_first_and_what_is_closed_never_does() {
        let guards = guards();
        let mut at_first = MotionGuards::default();
        at_first.begin(&guards, false, 1.0);
        at_first.acting.open(&guards);
        assert_eq!(acts(&at_first), [true, false, false, false]);
        assert_eq!(acts(&acting(&guards, false)), [true, true, true, false]);
    }

    #[test]
    fn what_is_closed_forgets_its_force_and_the_others_keep_theirs() {
        let guards = guards();
        let mut acting = acting(&guards, false);
        (0..4).for_each(|row| acting.set_force(&guards, row, -1.0));
        acting.begin(&guards, false, 1.0);
        assert_eq!(acting.acting.force, [1.0, 1.0, 1.0, 0.0]);
        let mut gradient = [0.0; 4];
        acting.acting.balance(&guards.rows, &mut gradient);
        let pulled = [0, 1].map(|k| (0..3).map(|row| JACOBIAN[row][k]).sum::<f64>());
        assert_eq!(gradient, [0.0, 0.0, -pulled[0], -pulled[1]]);
        acting.acting.forget();
        assert_eq!(acting.acting.largest_hard(&guards), 0.0);
    }

    #[test]
    fn solved_for_exactly_a_row_gives_way_by_its_weight_and_a_hard_one_not_at_all() {
        let guards = guards();
        let mut acting = acting(&guards, false);
        let mut rows = SampleRows::dense(2, RESIDUAL.len());
        (0..3).for_each(|row| acting.push_to(&guards, row, &mut rows));
        assert_eq!(rows.compliance, [0.0, 0.0, 0.25]);
        assert_eq!(rows.residual, RESIDUAL[..3]);
        assert_eq!(acting.residual(&guards, 2), RESIDUAL[2]);
        acting.set_force(&guards, 0, 3.0);
        acting.set_force(&guards, 2, -5.0);
        assert_eq!(acting.acting.force, [-3.0, 0.0, 5.0, 0.0]);
        // That of a wish is none of a hard row.
        assert_eq!(acting.acting.largest_hard(&guards), 3.0);
    }

    #[test]
    fn solved_for_iteratively_what_is_missed_is_added_to_the_force_that_was_kept() {
        let guards = guards();
        // 10⁴ times as stiff as the largest curvature.
        let stiffness = 2e4;
        for kept in [0.0, 700.0] {
            let mut acting = acting(&guards, true);
            acting.acting.force[..3].fill(kept);
            let mut rows = SampleRows::dense(2, RESIDUAL.len());
            (0..3).for_each(|row| acting.push_to(&guards, row, &mut rows));
            assert_eq!(rows.compliance, [1.0; 3]);
            for row in 0..3 {
                assert!(near(rows.residual[row], acting.residual(&guards, row)), "{row}");
                // A row of compliance 1 has for its multiplier what it misses at the step.
                let multiplier = rows.residual[row] + rows.dot_own(row, &DELTA[2..]);
                let missed = RESIDUAL[row] + along(row);
                let wanted = if row == 2 { -4.0 * missed } else { kept - stiffness * missed };
                acting.set_force(&guards, row, multiplier);
                assert!(
                    near(acting.acting.force[row], wanted),
                    "{row}: {} {wanted}",
                    acting.acting.force[row]
                );
            }
        }
    }

    #[test]
    fn a_correction_aims_from_where_the_model_begins() {
        let guards = guards();
        let mut acting = acting(&guards, false);
        let found = [0.5, -0.25, 0.125, 1.0];
        acting.acting.aim_from(&guards.rows, found.into_iter().enumerate(), &DELTA);
        for (row, found) in found.into_iter().enumerate() {
            assert!(near(acting.acting.aim[row], found - along(row)), "{row}");
        }
    }

    #[test]
    fn bounds_that_pull_are_let_go_of_and_bounds_that_are_missed_act() {
        let guards = guards();
        let missed = RESIDUAL[2] + along(2);
        assert!(missed < -SLACK && RESIDUAL[1] + along(1) < -SLACK && RESIDUAL[3] + along(3) > 0.0);
        // Neither the equality nor the closed row is exchanged, whatever its force.
        let mut acting = acting(&guards, false);
        acting.acting.force.copy_from_slice(&[-1.0, -1.0, 1.0, 0.0]);
        assert!(acting.exchange(&guards, &DELTA));
        assert_eq!(acts(&acting), [true, false, true, false]);
        assert!(!acting.acting.press() && acting.acting.force == [-1.0, 0.0, 1.0, 0.0]);
        // The step still misses the one that was let go of.
        assert!(acting.exchange(&guards, &DELTA));
        assert_eq!(acts(&acting), [true, true, true, false]);
        // With no force at all it may stay, so that this ends.
        assert!(!acting.exchange(&guards, &DELTA));
        // What has room does not begin to act, nor does what is missed by rounding.
        for room in [0.2, 0.0, -0.5 * SLACK] {
            acting.acting.stances[1] = Stance::Rests;
            acting.acting.aim[1] = room - along(1);
            assert!(!acting.exchange(&guards, &DELTA) && !acting.acting.acts(1), "{room}");
        }
    }

    #[test]
    fn of_what_wants_too_much_the_strongest_presses_and_a_stiff_row_goes_on_to_want_more() {
        let guards = guards();
        // Solved for exactly: the largest force beyond the most; a wish may have any.
        let mut acting = acting(&guards, false);
        acting.acting.most = 10.0;
        acting.then = RESIDUAL.to_vec();
        acting.acting.force.copy_from_slice(&[-11.0, 12.0, 50.0, 0.0]);
        assert!(acting.give_way(&guards));
        assert_eq!(acting.acting.stances[..3], [Stance::Acts, Stance::Presses(1.0), Stance::Acts]);
        assert!(acting.acting.press() && acting.acting.force[1] == 10.0);
        assert_eq!([0, 1, 2].map(|row| acting.acting.pressing(row)), [0.0, 10.0, 0.0]);
        // It acts again where it is kept with less, and not as long as it is missed.
        acting.acting.aim[1] = -0.1 - along(1);
        acting.exchange(&guards, &DELTA);
        assert_eq!(acting.acting.stances[1], Stance::Presses(1.0));
        acting.acting.aim[1] = 0.1 - along(1);
        assert!(acting.exchange(&guards, &DELTA) && acting.acting.acts(1));
        // Stiff: a quarter made good wants four times the force, what is missed as before wants one without end.
        for (part, most, wanted, presses) in [
            (0.25, 100.0, 12.0, false),
            (0.25, 10.0, 3.0, true),
            (0.0, 100.0, 3.0, true),
            (0.75, 100.0, 3.0, false),
        ] {
            let mut acting = self::acting(&guards, true);
            acting.acting.stances[1] = Stance::Rests;
            (acting.acting.most, acting.acting.force[0]) = (most, 3.0);
            acting.then = vec![(1.0 - part) * RESIDUAL[0], 0.0, 0.0, 0.0];
            assert_eq!(acting.give_way(&guards), presses || wanted != 3.0, "{part} {most}");
            assert!(near(acting.acting.force[0], wanted), "{part} {most}");
            assert_eq!(acting.acting.stances[0] == Stance::Presses(1.0), presses, "{part} {most}");
        }
    }
}
