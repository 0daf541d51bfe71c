//! Steps of motions: inside all limits, as the model promises, and held by nothing that would have to pull.

use super::*;
use crate::state::cases::{case, case_with_guards};

#[test]
fn a_step_stays_inside_all_limits_and_falls() {
    let mut n_held = 0;
    for number in 0..60 {
        let mut case = case(number, number % 3 == 1);
        let (layout, motion) = (&case.layout, &case.motion);
        let cost = case.state.evaluate(layout, motion);
        case.state.linearize(layout, motion);
        let mut step = MotionStep::new(layout);
        step.fit(layout, &case.state);
        assert!(step.begin(layout, &case.state) > 0.0);
        for part in [1e-4, 0.05, 10.0] {
            let damping = part * step.scale(&case.state);
            step.solve(layout, &case.state, damping).unwrap();
            let predicted = step.predicted(&case.state).0;
            assert!(predicted < cost * (1.0 + 1e-12), "case {number}: {predicted} from {cost}");
            let slope: f64 = step.gradient.iter().zip(&step.delta).map(|(g, d)| g * d).sum();
            assert!(slope < 0.0, "case {number}: {slope}");
            for t in 0..case.state.n_samples {
                for k in 0..layout.n_dofs {
                    let (delta, idx) = (step.delta[t * layout.n_dofs + k], t * layout.n_dofs + k);
                    assert!(!case.state.is_given[t] || delta == 0.0);
                    let x = case.state.coords[t * layout.n_coords + layout.coord_of_dof[k]];
                    let inside = delta.max(layout.lower[k] - x).min(layout.upper[k] - x);
                    assert!((delta - inside).abs() < 1e-12, "case {number}: {delta} at {x}");
                    n_held += usize::from(!step.open[idx] && !case.state.is_given[t]);
                }
            }
            // Cones are boxes in the tangent spaces of their balls, each at its own sample.
            for m in layout.movers.iter().filter(|m| m.motion.cone().is_some()) {
                let cone = m.motion.cone().unwrap();
                for t in (0..case.state.n_samples).filter(|t| !case.state.is_given[*t]) {
                    let at = t * layout.n_coords + m.coord + m.n_coords - 4;
                    let q = glam::DQuat::from_slice(&case.state.coords[at..at + 4]);
                    let limits = cone.tangent_box(q);
                    let dof = t * layout.n_dofs + m.dof + m.n_dofs - 3;
                    let turn = glam::DVec3::from_slice(&step.delta[dof..dof + 3]);
                    for (reader, (down, up)) in limits.readers.iter().zip(limits.room) {
                        let along = reader.dot(turn);
                        assert!(along >= down - 1e-9 && along <= up + 1e-9, "case {number}: {along}");
                    }
                }
            }
        }
    }
    assert!(n_held > 20, "{n_held}");
}

#[test]
fn small_steps_gain_what_the_model_promises() {
    for number in 0..30 {
        let mut case = case(number, false);
        let (layout, motion) = (&case.layout, &case.motion);
        let cost = case.state.evaluate(layout, motion);
        case.state.linearize(layout, motion);
        let mut step = MotionStep::new(layout);
        step.fit(layout, &case.state);
        step.begin(layout, &case.state);
        let damping = 1e5 * step.scale(&case.state);
        step.solve(layout, &case.state, damping).unwrap();
        let promised = cost - step.predicted(&case.state).0;
        let from = case.state.coords.clone();
        case.state.step(layout, &from, &step.delta);
        let gained = cost - case.state.evaluate(layout, motion);
        assert!((gained - promised).abs() < 0.02 * promised, "case {number}: {gained} of {promised}");
    }
}
#[test]
fn steps_are_solved_for_iteratively_beyond_the_most_rows_and_not_with_as_many() {
    let mut case = case(1, false);
    let step = MotionStep::new(&case.layout);
    for (n_rows, n_guards, wanted) in
        [(MOST_DIRECT_ROWS, 0, false), (MOST_DIRECT_ROWS + 1, 0, true), (1, MOST_DIRECT_ROWS, true)]
    {
        case.state.rows.residual.resize(n_rows, 0.0);
        case.state.guards.rows.residual.resize(n_guards, 0.0);
        assert_eq!(step.is_iterative(&case.state), wanted, "{n_rows} {n_guards}");
    }
}

#[test]
fn a_step_of_nothing_promises_the_cost_that_there_is() {
    for number in 0..30 {
        let mut case = case_with_guards(number);
        let cost = case.state.evaluate(&case.layout, &case.motion);
        case.state.linearize(&case.layout, &case.motion);
        let mut step = MotionStep::new(&case.layout);
        step.fit(&case.layout, &case.state);
        step.begin(&case.layout, &case.state);
        step.delta.fill(0.0);
        let (promised, violation) = step.predicted(&case.state);
        assert!((promised - cost).abs() < 1e-9 * cost, "case {number}: {promised} is not {cost}");
        assert!((violation - case.state.violation).abs() < 1e-12, "case {number}: {violation}");
    }
}

#[test]
fn a_step_is_shortened_to_where_its_model_is_least_and_never_made_longer() {
    for number in 0..20 {
        let mut case = case(number, false);
        case.state.evaluate(&case.layout, &case.motion);
        case.state.linearize(&case.layout, &case.motion);
        let mut step = MotionStep::new(&case.layout);
        step.fit(&case.layout, &case.state);
        step.begin(&case.layout, &case.state);
        let damping = step.scale(&case.state);
        step.solve(&case.layout, &case.state, damping).unwrap();
        let whole = step.delta.clone();
        for factor in [0.01, 1e4] {
            step.delta.iter_mut().zip(&whole).for_each(|(d, w)| *d = factor * w);
            step.shorten(&case.state);
            let mut along = vec![0.0; case.state.rows.n_rows()];
            case.state.rows.add_product(&step.delta, &mut along);
            let bend = along.iter().map(|a| a * a).sum::<f64>() + step.bend_beside_rows(&case.state);
            let slope: f64 = step.gradient.iter().zip(&step.delta).map(|(g, d)| g * d).sum();
            if factor < 1.0 {
                let is_same = step.delta.iter().zip(&whole).all(|(d, w)| *d == factor * w);
                assert!(is_same && bend < -slope, "case {number}");
            } else {
                assert!((slope + bend).abs() < 1e-9 * bend && bend > 0.0, "case {number}: {slope} {bend}");
            }
        }
    }
}

#[test]
fn with_guards_ranges_hold_only_what_pushes_against_them() {
    let (mut n_held, mut n_wrong, mut n_acting) = (0, 0, 0);
    let (mut n_pressing, mut n_unsettled) = (0, 0);
    for number in 0..60 {
        let mut case = case_with_guards(number);
        let layout = &case.layout;
        case.state.evaluate(layout, &case.motion);
        case.state.linearize(layout, &case.motion);
        let state = &case.state;
        let mut step = MotionStep::new(layout);
        step.fit(layout, state);
        step.begin(layout, state);
        let damping = 0.05 * step.scale(state);
        step.guards.acting.aim(&state.guards, 1.0);
        step.solve(layout, state, damping).unwrap();
        // Half the gradient of the model at the step, less what forces do.
        let mut rows = state.rows.residual.clone();
        state.rows.add_product(&step.delta, &mut rows);
        let mut pull = state.gradient.clone();
        state.rows.add_transposed(&rows, &mut pull);
        step.system.add_product_beside_rows(state, damping, &step.delta, &mut pull);
        step.guards.acting.balance(&state.guards.rows, &mut pull);
        n_acting += (0..state.guards.guards.len()).filter(|row| step.guards.acting.acts(*row)).count();
        let size = pull.iter().fold(1.0, |a: f64, p| a.max(p.abs()));
        let presses = (0..state.guards.guards.len()).any(|row| step.guards.acting.pressing(row) != 0.0);
        let mut n_wrong_here = 0;
        for t in (0..state.n_samples).filter(|t| !state.is_given[*t]) {
            for m in &layout.movers {
                let has_cone = m.motion.cone().is_some();
                for k in m.dof..m.dof + m.n_dofs {
                    let ((down, up), idx) = (room(layout, state, t, k), t * layout.n_dofs + k);
                    if up - down < 1e-6 || (has_cone && k >= m.dof + m.n_dofs - 3) {
                        continue;
                    }
                    let (way, slack) = (step.delta[idx], 1e-6 * size);
                    let is_right = if way <= down + 1e-12 {
                        pull[idx] >= -slack
                    } else if way >= up - 1e-12 {
                        pull[idx] <= slack
                    } else {
                        pull[idx].abs() <= slack
                    };
                    n_held += usize::from(way <= down + 1e-12 || way >= up - 1e-12);
                    n_wrong_here += usize::from(!is_right);
                }
            }
        }
        n_pressing += usize::from(presses);
        // Where hard rows give way, or all that moves one is held so that it pulls without end, rounds may end first.
        if n_wrong_here > 0 && (presses || size > 1e9) {
            n_unsettled += 1;
        } else {
            n_wrong += n_wrong_here;
        }
    }
    let counts = [n_held, n_wrong, n_acting, n_pressing, n_unsettled];
    let is_right = n_held > 100 && n_acting > 100 && n_pressing > 10 && n_wrong == 0;
    assert!(is_right && n_unsettled < 5, "{counts:?}");
}
