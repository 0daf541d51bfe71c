//! The linearization of a motion against differences of what it evaluates.

use super::*;
use crate::state::cases::{case, case_with_guards};

#[test]
fn the_gradient_of_the_whole_motion_is_that_of_its_cost() {
    for number in 0..40 {
        let mut case = case(number, number % 2 == 1);
        let (layout, motion) = (&case.layout, &case.motion);
        case.state.evaluate(layout, motion);
        case.state.linearize(layout, motion);
        let mut gradient = vec![0.0; case.state.gradient.len()];
        case.state.write_half_gradient(0.0, &mut gradient);
        let (n, nc, h) = (layout.n_dofs, layout.n_coords, 1e-6);
        let start = case.state.coords.clone();
        for t in 0..case.state.n_samples {
            for m in &layout.movers {
                for k in 0..m.n_dofs {
                    let mut cost_at = |way: f64| {
                        let mut tangent = [0.0; 6];
                        tangent[k] = way;
                        case.state.coords.copy_from_slice(&start);
                        let at = t * nc + m.coord;
                        let coords = &mut case.state.coords[at..at + m.n_coords];
                        retract_joint(&m.motion, coords, &tangent[..m.n_dofs]);
                        case.state.evaluate(layout, motion)
                    };
                    let numeric = (cost_at(h) - cost_at(-h)) / (4.0 * h);
                    let exact = gradient[t * n + m.dof + k];
                    let near = (numeric - exact).abs() < 2e-5 * (1.0 + exact.abs());
                    assert!(near, "case {number}, sample {t}: {numeric} is not {exact}");
                }
            }
        }
    }
}

#[test]
fn rows_are_what_residuals_change_by() {
    for number in 0..20 {
        let mut case = case(number, false);
        let (layout, motion) = (&case.layout, &case.motion);
        case.state.evaluate(layout, motion);
        case.state.linearize(layout, motion);
        let start = case.state.coords.clone();
        let size = case.state.gradient.len();
        let h = 1e-6;
        let tangent: Vec<f64> = (0..size).map(|idx| h * ((idx * 7 % 11) as f64 / 5.0 - 1.0)).collect();
        let mut change = vec![0.0; case.state.rows.n_rows()];
        case.state.rows.add_product(&tangent, &mut change);
        let mut residual_at = |sign: f64| {
            // Not `step`: limits must not hold the difference back.
            case.state.coords.copy_from_slice(&start);
            for t in 0..case.state.n_samples {
                for m in &layout.movers {
                    let at = t * layout.n_coords + m.coord;
                    let dofs = t * layout.n_dofs + m.dof;
                    let way: Vec<f64> = tangent[dofs..dofs + m.n_dofs].iter().map(|d| sign * d).collect();
                    retract_joint(&m.motion, &mut case.state.coords[at..at + m.n_coords], &way);
                }
            }
            case.state.evaluate(layout, motion);
            let mut residual = Vec::new();
            case.state.scaled_residuals(layout, motion, &mut residual, &mut Vec::new());
            residual
        };
        let (ahead, behind) = (residual_at(1.0), residual_at(-1.0));
        for ((a, b), change) in ahead.iter().zip(&behind).zip(&change) {
            let numeric = 0.5 * (a - b);
            assert!((numeric - change).abs() < 1e-3 * h, "case {number}: {numeric} is not {change}");
        }
    }
}
#[test]
fn the_rows_of_guards_are_what_residuals_change_by() {
    for number in 0..20 {
        let mut case = case_with_guards(number);
        let (layout, motion) = (&case.layout, &case.motion);
        case.state.evaluate(layout, motion);
        case.state.linearize(layout, motion);
        let (start, size, h) = (case.state.coords.clone(), case.state.gradient.len(), 1e-6);
        let tangent: Vec<f64> = (0..size).map(|idx| h * ((idx * 5 % 13) as f64 / 6.0 - 1.0)).collect();
        let mut change = vec![0.0; case.state.guards.rows.n_rows()];
        case.state.guards.rows.add_product(&tangent, &mut change);
        let mut residual_at = |sign: f64| {
            case.state.coords.copy_from_slice(&start);
            for t in 0..case.state.n_samples {
                for m in &layout.movers {
                    let at = t * layout.n_coords + m.coord;
                    let dofs = t * layout.n_dofs + m.dof;
                    let way: Vec<f64> = tangent[dofs..dofs + m.n_dofs].iter().map(|d| sign * d).collect();
                    retract_joint(&m.motion, &mut case.state.coords[at..at + m.n_coords], &way);
                }
            }
            case.state.evaluate(layout, motion);
            let (mut residual, mut guards) = (Vec::new(), Vec::new());
            case.state.scaled_residuals(layout, motion, &mut residual, &mut guards);
            assert_eq!(residual.len(), case.state.rows.n_rows());
            guards
        };
        let (ahead, behind) = (residual_at(1.0), residual_at(-1.0));
        assert_eq!(ahead.len(), change.len());
        for ((a, b), change) in ahead.iter().zip(&behind).zip(&change) {
            let numeric = 0.5 * (a - b);
            assert!((numeric - change).abs() < 1e-3 * h, "case {number}: {numeric} is not {change}");
        }
    }
}

#[test]
fn samples_with_rows_have_a_block_of_them_each_and_others_none() {
    for number in 0..20 {
        let mut case = case_with_guards(number);
        case.state.evaluate(&case.layout, &case.motion);
        case.state.linearize(&case.layout, &case.motion);
        for rows in [&case.state.rows, &case.state.guards.rows] {
            let (mut next, mut before) = (0, None);
            for Block { sample, first, n_rows } in &rows.blocks {
                assert!(*first == next && *n_rows > 0 && before.is_none_or(|b| b < *sample));
                (next, before) = (first + n_rows, Some(*sample));
            }
            assert_eq!(next, rows.n_rows(), "case {number}");
        }
    }
    // A single hard row at one sample leaves all others without a block.
    let mut case = case(0, false);
    case.motion.terms_mut().iter_mut().for_each(|term| term.is_on = false);
    case.state.evaluate(&case.layout, &case.motion);
    case.state.linearize(&case.layout, &case.motion);
    assert!(case.state.rows.blocks.is_empty() && case.state.guards.rows.blocks.is_empty());
}

#[test]
fn between_two_samples_the_way_is_even_and_what_is_given_stays() {
    for number in 0..30 {
        let mut case = case(number, false);
        let (layout, state) = (&case.layout, &mut case.state);
        let (from, to) = (1, state.n_samples - 1);
        assert!(to > from + 2);
        let given = from + 2;
        state.is_given[given] = true;
        let before = state.coords.clone();
        state.interpolate(layout, from, to);
        let nc = layout.n_coords;
        for t in (0..=from).chain([given]).chain(to..state.n_samples) {
            assert_eq!(state.coords[t * nc..(t + 1) * nc], before[t * nc..(t + 1) * nc], "sample {t}");
        }
        for t in (from + 1..to).filter(|t| *t != given) {
            let part = (t - from) as f64 / (to - from) as f64;
            // Cones are not as wide everywhere: there the way may be cut off.
            for m in layout.movers.iter().filter(|m| m.motion.cone().is_none()) {
                let of = |t: usize| &state.coords[t * nc + m.coord..t * nc + m.coord + m.n_coords];
                let way = |t: usize| {
                    let mut way = [0.0; 6];
                    difference_joint(&m.motion, of(from), of(t), &mut way[..m.n_dofs]);
                    way
                };
                for (so_far, whole) in way(t).into_iter().zip(way(to)) {
                    assert!((so_far - part * whole).abs() < 1e-9, "case {number}, sample {t}");
                }
            }
        }
    }
}
