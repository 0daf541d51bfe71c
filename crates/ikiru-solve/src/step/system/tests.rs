//! The system of a motion against plain elimination.

use super::*;
use crate::state::cases::{Case, case, eliminate};
use ikiru_testkit::rigs::Random;

/// The step of a case by elimination: what is not open keeps its `delta`.
fn reference(case: &Case, system: &System, open: &[bool], damping: f64, delta: &[f64]) -> Vec<f64> {
    let size = delta.len();
    let is_open: Vec<usize> = (0..size).filter(|idx| open[*idx]).collect();
    let product = |x: &[f64]| {
        let mut out = vec![0.0; size];
        let memory = &mut Vec::new();
        system.add_model_product(&case.state, &case.state.rows, damping, x, memory, &mut out);
        out
    };
    let column = |idx: usize| {
        let mut unit = vec![0.0; size];
        unit[idx] = 1.0;
        product(&unit)
    };
    let columns: Vec<Vec<f64>> = is_open.iter().map(|idx| column(*idx)).collect();
    let matrix: Vec<Vec<f64>> =
        is_open.iter().map(|row| columns.iter().map(|column| column[*row]).collect()).collect();
    let held: Vec<f64> = (0..size).map(|idx| if open[idx] { 0.0 } else { delta[idx] }).collect();
    let mut gradient = product(&held);
    case.state.rows.add_transposed(&case.state.rows.residual, &mut gradient);
    let right = is_open.iter().map(|idx| -(gradient[*idx] + case.state.gradient[*idx])).collect();
    let solution = eliminate(matrix, right);
    let mut step = held;
    is_open.iter().zip(solution).for_each(|(idx, value)| step[*idx] = value);
    step
}

#[test]
fn over_rows_and_by_iterations_it_is_the_step_that_elimination_takes() {
    let mut random = Random::new(6);
    for number in 0..24 {
        let mut case = case(number, number % 2 == 1);
        case.state.evaluate(&case.layout, &case.motion);
        case.state.linearize(&case.layout, &case.motion);
        let size = case.state.gradient.len();
        let n = case.layout.n_dofs;
        // Given samples never open; of the others some are held, at a way of their own.
        let open: Vec<bool> =
            (0..size).map(|idx| !case.state.is_given[idx / n] && random.unit() < 0.8).collect();
        let held: Vec<f64> = (0..size)
            .map(
                |idx| {
                    if open[idx] || case.state.is_given[idx / n] { 0.0 } else { random.between(-0.1, 0.1) }
                },
            )
            .collect();
        let mut system = System::new(&case.layout);
        system.fit(&case.state);
        let damping = 0.05 * system.scale(&case.state);
        let wanted = reference(&case, &system, &open, damping, &held);
        let (rows, state) = (&case.state.rows, &case.state);
        assert!(rows.n_rows() > 0);
        let mut direct = held.clone();
        system.factor(state, rows, &open, damping).unwrap();
        system.solve(state, &state.gradient, rows, &open, damping, &rows.residual, &mut direct);
        let length = dot(&wanted, &wanted).sqrt();
        let apart = |step: &[f64]| -> f64 {
            step.iter().zip(&wanted).map(|(a, b)| (a - b).powi(2)).sum::<f64>().sqrt()
        };
        assert!(apart(&direct) < 1e-8 * length, "case {number}: {} of {length}", apart(&direct));
        system.most_direct_rows = 0;
        let mut iterative = held.clone();
        system.factor(state, rows, &open, damping).unwrap();
        system.solve(state, &state.gradient, rows, &open, damping, &rows.residual, &mut iterative);
        // Conjugate gradients stop early: what counts is how much of the model's gain they have.
        let model = |step: &[f64]| {
            let mut product = vec![0.0; size];
            system.add_model_product(state, rows, damping, step, &mut Vec::new(), &mut product);
            let mut gradient = state.gradient.clone();
            rows.add_transposed(&rows.residual, &mut gradient);
            dot(&product, step) + 2.0 * dot(&gradient, step)
        };
        let [best, found, before] = [&direct, &iterative, &held].map(|step| model(step));
        let part = (before - found) / (before - best);
        assert!(part > 0.99 && part < 1.0 + 1e-9, "case {number}: {part} of the gain");
        for idx in (0..size).filter(|idx| !open[*idx]) {
            assert!(direct[idx] == held[idx] && iterative[idx] == held[idx]);
        }
    }
}
