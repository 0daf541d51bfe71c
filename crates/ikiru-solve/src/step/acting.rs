//! Which rows with a force act in a step of a motion. As in `step/forces.rs` each has a compliance, and acts while its force
//! says so; here they join the rows that the step is solved over, as long as they act.

use crate::algebra::sample_rows::SampleRows;
use crate::state::guards::Guards;
use crate::step::active::aim;
use crate::words::Sense;

/// A row that wants to be at least 0 counts as missed beyond this (metres, radians).
const SLACK: f64 = 1e-12;
/// Where steps are solved for iteratively, the stiffness of hard rows relative to the largest curvature: forces that are
/// kept from step to step make up for what it leaves.
const STIFFNESS: f64 = 1e4;

/// Which rows act in a step, and how.
#[derive(Clone, Debug, Default)]
pub(crate) struct Acting {
    acts: Vec<bool>,
    /// The force of each row; 0 where it does not act.
    force: Vec<f64>,
    /// The residuals that the step is solved for.
    aim: Vec<f64>,
    /// What the linear model says of each row.
    along: Vec<f64>,
    is_iterative: bool,
    /// The compliance of hard rows where steps are solved for iteratively.
    compliance: f64,
}

impl Acting {
    /// Forgets what acted.
    pub(crate) fn forget(&mut self) {
        self.acts.clear();
        self.force.clear();
    }

    /// Takes over a linearization of this largest curvature; what acted before, acts at first.
    pub(crate) fn begin(&mut self, guards: &Guards, is_iterative: bool, scale: f64) {
        (self.is_iterative, self.compliance) = (is_iterative, 1.0 / (STIFFNESS * scale));
        self.acts.resize(guards.guards.len(), false);
        self.force.resize(guards.guards.len(), 0.0);
        for ((guard, acts), force) in guards.guards.iter().zip(&mut self.acts).zip(&mut self.force) {
            if !guard.is_open {
                (*acts, *force) = (false, 0.0);
            }
        }
    }

    /// Takes what the forces do off half a gradient.
    pub(crate) fn balance(&self, guards: &Guards, gradient: &mut [f64]) {
        guards.rows.add_transposed_of(|row| -self.force[row], gradient);
    }

    /// The next step is to make good a share of what is missed.
    pub(crate) fn aim(&mut self, guards: &Guards, share: f64) {
        let rows = guards.guards.iter().zip(&guards.rows.residual);
        self.aim.clear();
        self.aim.extend(rows.map(|(guard, residual)| aim(guard.sense, *residual, share)));
    }

    /// The next step is from where the model begins, for the residuals at another motion near by, less what the linear
    /// model says of the way there.
    pub(crate) fn aim_from(&mut self, guards: &Guards, residual: &[f64], delta: &[f64]) {
        self.aim.clear();
        self.aim.extend_from_slice(residual);
        self.along.clear();
        self.along.resize(self.aim.len(), 0.0);
        guards.rows.add_product(delta, &mut self.along);
        self.aim.iter_mut().zip(&self.along).for_each(|(aim, along)| *aim -= along);
    }

    /// Begins a step: what must act, and what acted.
    pub(crate) fn open(&mut self, guards: &Guards) {
        for (acts, guard) in self.acts.iter_mut().zip(&guards.guards) {
            *acts = guard.is_open && (*acts || guard.sense == Sense::Equal);
        }
    }

    /// Whether a row acts.
    pub(crate) fn acts(&self, row: usize) -> bool {
        self.acts[row]
    }

    /// The compliance of a row: 0 for a hard one where steps are solved for exactly.
    fn compliance(&self, guards: &Guards, row: usize) -> f64 {
        match guards.guards[row].weight {
            Some(weight) => 1.0 / weight,
            None if self.is_iterative => self.compliance,
            None => 0.0,
        }
    }

    /// Adds a row that acts to those that a step is solved over.
    pub(crate) fn push_to(&self, guards: &Guards, row: usize, rows: &mut SampleRows) {
        let compliance = self.compliance(guards, row);
        if self.is_iterative {
            rows.push_scaled(&guards.rows, row, self.residual(guards, row), 1.0 / compliance.sqrt(), 1.0);
        } else {
            rows.push_scaled(&guards.rows, row, self.residual(guards, row), 1.0, compliance);
        }
    }

    /// The residual of a row among those that a step is solved over.
    pub(crate) fn residual(&self, guards: &Guards, row: usize) -> f64 {
        if !self.is_iterative {
            return self.aim[row];
        }
        let compliance = self.compliance(guards, row);
        let kept = if guards.guards[row].weight.is_none() { compliance * self.force[row] } else { 0.0 };
        (self.aim[row] - kept) / compliance.sqrt()
    }

    /// Takes over the multiplier of a row that acts among those that the step was solved over.
    pub(crate) fn set_force(&mut self, guards: &Guards, row: usize, multiplier: f64) {
        let scale = if self.is_iterative { 1.0 / self.compliance(guards, row).sqrt() } else { 1.0 };
        self.force[row] = -scale * multiplier;
    }

    /// Lets rows go that would have to pull, and has those act that a step misses; says whether there was one.
    pub(crate) fn exchange(&mut self, guards: &Guards, delta: &[f64]) -> bool {
        self.along.clone_from(&self.aim);
        guards.rows.add_product(delta, &mut self.along);
        let mut changed = false;
        for (row, guard) in guards.guards.iter().enumerate() {
            if guard.sense == Sense::Equal || !guard.is_open {
                continue;
            }
            let is_wrong = if self.acts[row] { self.force[row] < 0.0 } else { self.along[row] < -SLACK };
            if is_wrong {
                (changed, self.acts[row]) = (true, !self.acts[row]);
            }
            if !self.acts[row] {
                self.force[row] = 0.0;
            }
        }
        changed
    }

    /// The largest force of a hard row.
    pub(crate) fn largest_hard(&self, guards: &Guards) -> f64 {
        let hard = guards.guards.iter().zip(&self.force).filter(|(guard, _)| guard.weight.is_none());
        hard.map(|(_, force)| force.abs()).fold(0.0, f64::max)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::algebra::sample_rows::Block;
    use crate::state::guards::Guard;

    /// The residuals of four rows, and their derivatives by the two degrees of freedom of the second of two samples.
    const RESIDUAL: [f64; 4] = [-0.4, 0.3, -0.2, 0.1];
    const JACOBIAN: [[f64; 2]; 4] = [[1.0, 2.0], [-1.0, 0.5], [0.3, 0.0], [0.0, -2.0]];
    const DELTA: [f64; 4] = [7.0, 7.0, 0.3, -0.1];

    /// A hard equality, a hard bound, a wished bound of weight 4, and a hard bound that is closed.
    fn guards() -> Guards {
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
    fn acting(guards: &Guards, is_iterative: bool) -> Acting {
        let mut acting = Acting::default();
        acting.begin(guards, is_iterative, 2.0);
        acting.acts.fill(true);
        acting.open(guards);
        acting.aim(guards, 1.0);
        acting
    }

    fn near(a: f64, b: f64) -> bool {
        (a - b).abs() < 1e-9 * (1.0 + b.abs())
    }

    #[test]
    fn equalities_act_at_first_and_what_is_closed_never_does() {
        let guards = guards();
        let mut at_first = Acting::default();
        at_first.begin(&guards, false, 1.0);
        at_first.open(&guards);
        assert_eq!(at_first.acts, [true, false, false, false]);
        assert_eq!(acting(&guards, false).acts, [true, true, true, false]);
    }

    #[test]
    fn what_is_closed_forgets_its_force_and_the_others_keep_theirs() {
        let guards = guards();
        let mut acting = acting(&guards, false);
        (0..4).for_each(|row| acting.set_force(&guards, row, -1.0));
        acting.begin(&guards, false, 1.0);
        assert_eq!(acting.force, [1.0, 1.0, 1.0, 0.0]);
        let mut gradient = [0.0; 4];
        acting.balance(&guards, &mut gradient);
        let pulled = [0, 1].map(|k| (0..3).map(|row| JACOBIAN[row][k]).sum::<f64>());
        assert_eq!(gradient, [0.0, 0.0, -pulled[0], -pulled[1]]);
        acting.forget();
        assert_eq!(acting.largest_hard(&guards), 0.0);
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
        assert_eq!(acting.force, [-3.0, 0.0, 5.0, 0.0]);
        // That of a wish is none of a hard row.
        assert_eq!(acting.largest_hard(&guards), 3.0);
    }

    #[test]
    fn solved_for_iteratively_what_is_missed_is_added_to_the_force_that_was_kept() {
        let guards = guards();
        // 10⁴ times as stiff as the largest curvature.
        let stiffness = 2e4;
        for kept in [0.0, 700.0] {
            let mut acting = acting(&guards, true);
            acting.force[..3].fill(kept);
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
                assert!(near(acting.force[row], wanted), "{row}: {} {wanted}", acting.force[row]);
            }
        }
    }

    #[test]
    fn a_correction_aims_from_where_the_model_begins() {
        let guards = guards();
        let mut acting = acting(&guards, false);
        let found = [0.5, -0.25, 0.125, 1.0];
        acting.aim_from(&guards, &found, &DELTA);
        for (row, found) in found.into_iter().enumerate() {
            assert!(near(acting.aim[row], found - along(row)), "{row}");
        }
    }

    #[test]
    fn bounds_that_pull_are_let_go_of_and_bounds_that_are_missed_act() {
        let guards = guards();
        let missed = RESIDUAL[2] + along(2);
        assert!(missed < -SLACK && RESIDUAL[1] + along(1) < -SLACK && RESIDUAL[3] + along(3) > 0.0);
        // Neither the equality nor the closed row is exchanged, whatever its force.
        let mut acting = acting(&guards, false);
        acting.force.copy_from_slice(&[-1.0, -1.0, 1.0, 0.0]);
        assert!(acting.exchange(&guards, &DELTA));
        assert_eq!(
            (&acting.acts[..], &acting.force[..]),
            (&[true, false, true, false][..], &[-1.0, 0.0, 1.0, 0.0][..])
        );
        // The step still misses the one that was let go of.
        assert!(acting.exchange(&guards, &DELTA));
        assert_eq!(acting.acts, [true, true, true, false]);
        // With no force at all it may stay, so that this ends.
        assert!(!acting.exchange(&guards, &DELTA));
        // What has room does not begin to act, nor does what is missed by rounding.
        for room in [0.2, 0.0, -0.5 * SLACK] {
            acting.acts[1] = false;
            acting.aim[1] = room - along(1);
            assert!(!acting.exchange(&guards, &DELTA) && !acting.acts(1), "{room}");
        }
    }
}
