//! Steps with guards against every way in which limits may hold and rows may act, by plain elimination.

use ikiru_rig::{JointId, retract_joint};
use ikiru_testkit::rigs::{Random, random_pose, random_rig};

use super::*;
use crate::algebra::rows::Dense;
use crate::objectives::Position;
use crate::state::cases::Inside;
use crate::state::guards::Guard;
use crate::words::Sense;

/// Degrees of freedom, and rows of the base.
const N: usize = 4;
const M: usize = 3;
const DAMPING: f64 = 0.3;
/// How exactly the conditions of the least value hold.
const NEAR: f64 = 1e-9;

/// A small problem, and its guards.
struct Case {
    /// The base's Jacobian, degree of freedom by degree of freedom, and its residuals.
    columns: Vec<f64>,
    residual: [f64; M],
    /// `D`, and the gradient beside rows.
    diagonal: [f64; N],
    own: [f64; N],
    room: [(f64, f64); N],
    free: [bool; N],
    guards: PoseGuards,
}

impl Case {
    fn new(random: &mut Random, rows: &[(Sense, Option<f64>)], most: f64) -> Self {
        let mut draw = |n: usize| (0..n).map(|_| random.between(-1.0, 1.0)).collect::<Vec<f64>>();
        let columns = draw(N * M);
        let (residual, own): ([f64; M], [f64; N]) =
            (draw(M).try_into().unwrap(), draw(N).try_into().unwrap());
        let mut guards = PoseGuards {
            acting: Acting::new(rows.len()),
            compliance: vec![0.0; rows.len()],
            press: vec![0.0; N],
            pressed: vec![0.0; N],
            answers: vec![0.0; N * rows.len()],
            matrix: vec![0.0; rows.len() * rows.len()],
            forces: vec![0.0; rows.len()],
            ..PoseGuards::default()
        };
        guards.guards.rows = FullRows::new(rows.len(), N);
        guards.guards.rows.jacobian = draw(N * rows.len());
        guards.acting.most = most;
        guards.acting.aim = draw(rows.len());
        for (row, &(sense, weight)) in rows.iter().enumerate() {
            guards.guards.guards.push(Guard { sense, weight, is_open: true });
            // Some acted in the step before.
            guards.acting.stances[row] = [Stance::Acts, Stance::Rests][random.below(2)];
        }
        let diagonal = [0; N].map(|_| DAMPING + [0.0, random.between(0.0, 2.0)][random.below(2)]);
        let room = [0; N].map(|_| match random.below(4) {
            0 => (f64::NEG_INFINITY, f64::INFINITY),
            1 => (0.0, random.between(0.0, 0.5)),
            2 => (-random.between(0.0, 0.5), 0.0),
            _ => (-random.between(0.0, 0.5), random.between(0.0, 0.5)),
        });
        // What a linearization holds at first, rightly or not.
        let free = room.map(|(down, up)| (down != 0.0 && up != 0.0) || random.below(2) == 0);
        Self { columns, residual, diagonal, own, room, free, guards }
    }

    /// The step as it is solved for.
    fn solve(&mut self) -> [f64; N] {
        let inverse = self.diagonal.map(|d| DAMPING / d);
        let mut base = Dense::<M>::new(&self.columns);
        StepSystem::clear(&mut base);
        let (mut open, mut residual) = (self.free, self.residual);
        let (mut y, mut delta) = ([0.0; M], [0.0; N]);
        for k in (0..N).filter(|k| open[*k]) {
            base.open(k, inverse[k]);
        }
        let mut held = Held {
            open: &mut open,
            room: &self.room,
            inverse: &inverse,
            own: Some(&self.own),
            damping: DAMPING,
            residual: &mut residual,
            y: &mut y,
            delta: &mut delta,
        };
        self.guards.solve(&mut base, &mut held).unwrap();
        delta
    }

    /// Half the gradient of the base at a step.
    fn gradient(&self, delta: &[f64]) -> [f64; N] {
        let mut rows = self.residual;
        for (column, d) in self.columns.chunks_exact(M).zip(delta) {
            rows.iter_mut().zip(column).for_each(|(row, j)| *row += j * d);
        }
        std::array::from_fn(|k| {
            let column = &self.columns[k * M..(k + 1) * M];
            self.own[k]
                + self.diagonal[k] * delta[k]
                + column.iter().zip(rows).map(|(j, r)| j * r).sum::<f64>()
        })
    }

    fn entries(&self, row: usize) -> &[f64] {
        self.guards.guards.rows.entries(row)
    }

    /// What a guard is at a step.
    fn then(&self, row: usize, delta: &[f64]) -> f64 {
        self.guards.acting.aim[row] + self.guards.guards.rows.along(row, delta)
    }

    fn compliance(&self, row: usize) -> f64 {
        let weight = self.guards.guards.guards[row].weight;
        weight.map_or(self.guards.compliance[row], |weight| 1.0 / weight)
    }

    /// The step and the forces for one way in which limits hold (0: open, 1: below, 2: above) and rows act (0: not,
    /// 1: act, 2 and 3: pressed up and down); `None` where that is not the least.
    fn if_so(&self, holds: [usize; N], acts: &[usize]) -> Option<([f64; N], Vec<f64>)> {
        let (n_rows, size) = (acts.len(), N + acts.len());
        let mut system = vec![vec![0.0; size + 1]; size];
        let base = self.gradient(&[0.0; N]);
        for k in 0..N {
            if holds[k] > 0 {
                let bound = [0.0, self.room[k].0, self.room[k].1][holds[k]];
                (system[k][k], system[k][size]) = (1.0, bound);
                continue;
            }
            for l in 0..N {
                let unit: [f64; N] = std::array::from_fn(|i| f64::from(u8::from(i == l)));
                system[k][l] = self.gradient(&unit)[k] - base[k];
            }
            for row in 0..n_rows {
                system[k][N + row] = -self.entries(row)[k];
            }
            system[k][size] = -base[k];
        }
        for row in 0..n_rows {
            let equation = &mut system[N + row];
            if acts[row] == 1 {
                equation[..N].copy_from_slice(self.entries(row));
                (equation[N + row], equation[size]) = (self.compliance(row), -self.guards.acting.aim[row]);
            } else {
                let force = [0.0, 0.0, self.guards.acting.most, -self.guards.acting.most][acts[row]];
                (equation[N + row], equation[size]) = (1.0, force);
            }
        }
        let x = eliminate(system)?;
        let delta: [f64; N] = x[..N].try_into().unwrap();
        let gradient = self.gradient(&delta);
        for k in 0..N {
            let forces = x[N..].iter().enumerate();
            let pull = gradient[k] - forces.map(|(row, f)| f * self.entries(row)[k]).sum::<f64>();
            let is_right = match holds[k] {
                0 => (self.room[k].0 - NEAR..=self.room[k].1 + NEAR).contains(&delta[k]),
                1 => pull >= -NEAR,
                _ => pull <= NEAR,
            };
            if !is_right {
                return None;
            }
        }
        for row in 0..n_rows {
            let then = self.then(row, &delta);
            let Guard { sense, weight, .. } = self.guards.guards.guards[row];
            let most = if weight.is_none() { self.guards.acting.most } else { f64::INFINITY };
            let is_right = match acts[row] {
                0 => then >= -NEAR,
                1 => x[N + row].abs() <= most && (sense == Sense::Equal || x[N + row] >= -NEAR),
                2 => then <= NEAR,
                _ => then >= -NEAR,
            };
            if !is_right {
                return None;
            }
        }
        Some((delta, x[N..].to_vec()))
    }

    /// The step of least value, by looking at every way.
    fn enumerate(&self) -> ([f64; N], Vec<f64>) {
        let n_rows = self.guards.compliance.len();
        let ways = |row: usize| -> &[usize] {
            let row = &self.guards.guards.guards[row];
            match (row.sense, row.weight, self.guards.acting.most.is_finite()) {
                (Sense::Equal, None, true) => &[1, 2, 3],
                (Sense::Equal, ..) => &[1],
                (Sense::AtLeast, None, true) => &[0, 1, 2],
                (Sense::AtLeast, ..) => &[0, 1],
            }
        };
        let mut acts = vec![0; n_rows];
        for code in 0..3_usize.pow((N + n_rows) as u32) {
            let digit = |i: usize| code / 3_usize.pow(i as u32) % 3;
            let holds: [usize; N] = std::array::from_fn(digit);
            let bound = |k: usize| [0.0, self.room[k].0, self.room[k].1][holds[k]];
            let options = (0..n_rows).map(|row| ways(row).get(digit(N + row)));
            let Some(chosen) = options.collect::<Option<Vec<_>>>() else { continue };
            if (0..N).any(|k| bound(k).is_infinite()) {
                continue;
            }
            acts.iter_mut().zip(chosen).for_each(|(to, from)| *to = *from);
            if let Some(found) = self.if_so(holds, &acts) {
                return found;
            }
        }
        panic!("a convex problem has a least value");
    }
}

/// Solves a system whose last column is the right side, with pivots; `None` where it is singular.
fn eliminate(mut system: Vec<Vec<f64>>) -> Option<Vec<f64>> {
    let n = system.len();
    for k in 0..n {
        let pivot = (k..n).max_by(|a, b| system[*a][k].abs().total_cmp(&system[*b][k].abs()))?;
        system.swap(k, pivot);
        if system[k][k].abs() < 1e-14 {
            return None;
        }
        let row = system[k].clone();
        for other in system.iter_mut().skip(k + 1) {
            let factor = other[k] / row[k];
            other.iter_mut().zip(&row).for_each(|(a, b)| *a -= factor * b);
        }
    }
    let mut x = vec![0.0; n];
    for k in (0..n).rev() {
        let known: f64 = (k + 1..n).map(|l| system[k][l] * x[l]).sum();
        x[k] = (system[k][n] - known) / system[k][k];
    }
    Some(x)
}

/// Rows of every kind: hard and wished for, equal and at least.
fn random_rows(random: &mut Random) -> Vec<(Sense, Option<f64>)> {
    (0..1 + random.below(3))
        .map(|_| {
            let sense = [Sense::Equal, Sense::AtLeast][random.below(2)];
            (sense, [None, Some(random.between(0.1, 20.0))][random.below(2)])
        })
        .collect()
}

#[test]
fn a_step_with_guards_is_the_least_of_all_ways_to_hold_and_act() {
    let mut random = Random::new(1);
    let (mut n_held, mut n_idle, mut n_pressed, mut n_acting) = (0, 0, 0, 0);
    for number in 0..400 {
        let rows = random_rows(&mut random);
        let most = [f64::INFINITY, 3.0][random.below(2)];
        let mut case = Case::new(&mut random, &rows, most);
        let delta = case.solve();
        // Rows that never acted have any small compliance.
        case.guards.compliance.iter_mut().for_each(|compliance| *compliance = compliance.max(1e-12));
        let (wanted, forces) = case.enumerate();
        for k in 0..N {
            assert!((delta[k] - wanted[k]).abs() < 1e-6, "case {number}: {delta:?}, {wanted:?}");
            n_held += usize::from(delta[k] == case.room[k].0 || delta[k] == case.room[k].1);
        }
        for (row, wanted) in forces.into_iter().enumerate() {
            let found = case.guards.acting.force[row];
            // Where all that moves a row is held it pulls without end, or nearly.
            let is_near = (found - wanted).abs() < 1e-5 * (1.0 + wanted.abs());
            assert!(is_near || found.abs().min(wanted.abs()) > 1e6, "case {number}: {found} {wanted}");
            n_idle += usize::from(found == 0.0);
            n_pressed += usize::from(found.abs() == most);
            n_acting += usize::from(found != 0.0 && found.abs() != most);
        }
    }
    let counts = [n_held, n_idle, n_pressed, n_acting];
    assert!(counts.iter().all(|n| *n > 40), "{counts:?}");
}

#[test]
fn a_wish_yields_as_its_weight_says_and_a_hard_row_does_not() {
    let mut random = Random::new(2);
    for weight in [0.01, 1.0, 100.0, 1e6] {
        let mut case = Case::new(&mut random, &[(Sense::Equal, Some(weight))], f64::INFINITY);
        (case.room, case.free) = ([(f64::NEG_INFINITY, f64::INFINITY); N], [true; N]);
        let delta = case.solve();
        let (force, then) = (case.guards.acting.force[0], case.then(0, &delta));
        // `c + a δ + f / w = 0`: its force is its weight times what it misses.
        assert!((force + weight * then).abs() < 1e-6 * force.abs().max(1.0), "{weight}: {force} {then}");
        case.guards.guards.guards[0].weight = None;
        let delta = case.solve();
        assert!(case.then(0, &delta).abs() < 1e-8);
    }
}

/// Three hard equalities about one degree of freedom, wanting it at these places.
fn contradictory(wanted: [f64; 3], most: f64) -> Case {
    let mut case = Case::new(&mut Random::new(3), &[(Sense::Equal, None); 3], most);
    (case.columns, case.own) = (vec![0.0; N * M], [0.0; N]);
    (case.room, case.free) = ([(f64::NEG_INFINITY, f64::INFINITY); N], [true; N]);
    case.guards.guards.rows.jacobian = [1.0, 0.0, 0.0, 0.0].repeat(3);
    case.guards.acting.aim = wanted.map(|place| -place).to_vec();
    case
}

#[test]
fn contradictory_rows_miss_least_in_sum() {
    // The middle one of three places.
    for wanted in [[0.1, 0.2, 0.4], [0.4, 0.1, 0.2], [-0.3, 0.5, 0.0]] {
        let mut middle = wanted;
        middle.sort_by(f64::total_cmp);
        let delta = contradictory(wanted, 1e4).solve();
        assert!((delta[0] - middle[1]).abs() < 1e-6 && delta[1..] == [0.0; 3], "{wanted:?}: {delta:?}");
        // With forces without end they share what is missed.
        let delta = contradictory(wanted, f64::INFINITY).solve();
        assert!((delta[0] - wanted.iter().sum::<f64>() / 3.0).abs() < 1e-6, "{wanted:?}: {delta:?}");
    }
}

#[test]
fn rows_that_nothing_answers_have_no_say() {
    let mut random = Random::new(4);
    for number in 0..50 {
        let mut case = Case::new(&mut random, &[(Sense::AtLeast, None), (Sense::Equal, None)], 1e4);
        let alone = {
            let mut alone = Case { guards: case.guards.clone(), columns: case.columns.clone(), ..case };
            alone.guards.guards.guards[1].is_open = false;
            alone.solve()
        };
        case.guards.guards.rows.jacobian[N..].fill(0.0);
        assert_eq!(case.solve(), alone, "case {number}");
    }
}

/// A problem with a hard place, bounds that are hard and bounds that are wished for, of which the last axes are closed.
fn bounded(number: u64) -> Problem {
    let mut random = Random::new(number);
    let rig = random_rig(8, number);
    let mut problem = Problem::whole_body(&rig);
    let joint = |random: &mut Random| JointId::from_index(random.below(rig.n_joints()));
    problem.add(0.7, Position::new(joint(&mut random), random.vector(1.0)));
    problem.add_hard(Position::new(joint(&mut random), random.vector(1.0)));
    problem.add_hard(Inside { joint: joint(&mut random), reach: 0.3 });
    problem.add(3.0, Inside { joint: joint(&mut random), reach: 0.2 });
    problem
}

#[test]
fn what_is_taken_over_of_a_state_foretells_what_short_steps_lead_to() {
    let (mut n_violated, mut n_wished, mut n_closed) = (0, 0, 0);
    for number in 0..40 {
        let mut random = Random::new(number);
        let problem = bounded(number);
        let layout = Layout::new(&problem).unwrap();
        let mut state = State::new(&layout);
        assert!(state.load(&layout, &random_pose(problem.rig(), &mut random)));
        state.evaluate(&layout, &problem);
        state.linearize(&layout, &problem, false);
        let mut guards = PoseGuards::new(&layout);
        guards.acting.force.fill(1.0);
        guards.begin(&layout, &state, &problem);
        let wanted_of = |state: &State| {
            let mut residuals = vec![0.0; layout.n_guards];
            let (mut is_open, mut wishes) = (vec![false; layout.n_guards], 0.0);
            for t in &layout.terms {
                let term = &problem.terms()[t.term];
                for idx in t.parts.clone() {
                    let part = &layout.parts[idx];
                    let Place::Guard { first } = part.place else { continue };
                    for i in 0..part.n_rows {
                        residuals[first + i] = state.residual[part.row + i];
                        is_open[first + i] = part.sense == Sense::Equal || i < 2;
                    }
                    wishes += if t.is_hard { 0.0 } else { term.weight * state.squares[idx] };
                }
            }
            (residuals, is_open, wishes)
        };
        let (before, is_open, _) = wanted_of(&state);
        assert_eq!(guards.guards.guards.len(), layout.n_guards);
        for (row, data) in guards.guards.guards.iter().enumerate() {
            let residual = guards.guards.rows.residual[row];
            assert_eq!((residual, data.is_open), (before[row], is_open[row]), "case {number}, row {row}");
            // What is closed has no force.
            assert_eq!(guards.acting.force[row], f64::from(u8::from(is_open[row])));
            n_closed += usize::from(!is_open[row]);
        }
        let short = 1e-5;
        let delta: Vec<f64> = (0..layout.n_dofs).map(|_| random.between(-short, short)).collect();
        for m in &layout.movers {
            let coords = &mut state.coords[m.coord..m.coord + m.n_coords];
            retract_joint(&m.motion, coords, &delta[m.dof..m.dof + m.n_dofs]);
        }
        state.evaluate(&layout, &problem);
        let (cost, violation) = guards.guards.predicted(&delta, &mut Vec::new());
        let (_, _, wishes) = wanted_of(&state);
        assert!((violation - state.violation).abs() < 1e-3 * short, "case {number}: {violation}");
        assert!((cost - wishes).abs() < 1e-3 * short, "case {number}: {cost} {wishes}");
        n_violated += usize::from(violation > 0.0);
        n_wished += usize::from(cost > 0.0);
        // Aimed from there, the step is from where the model begins.
        guards.aim_from(&layout, &state, &delta);
        for row in (0..before.len()).filter(|row| is_open[*row]) {
            assert!((guards.acting.aim[row] - before[row]).abs() < 1e-3 * short, "case {number}, row {row}");
        }
    }
    assert!([n_violated, n_wished, n_closed].iter().all(|n| *n > 10), "{n_violated} {n_wished} {n_closed}");
}
