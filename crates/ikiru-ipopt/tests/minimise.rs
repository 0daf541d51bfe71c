//! Ipopt through the wrapper: known minima, every way to end, and each wrong input alone.
#![allow(clippy::unwrap_used, reason = "a test that cannot go on fails")]

use std::panic::{AssertUnwindSafe, catch_unwind};

use ikiru_ipopt::{Bounds, Error, Function, Options, Status, minimise};

/// Rosenbrock's valley, below a constraint on x² + y², with faults that tests can ask for.
#[derive(Default)]
struct Valley {
    stop_after: Option<usize>,
    panics_after: Option<usize>,
    no_value: bool,
    calls_itself: bool,
    nested: Option<Error>,
    n_iterations: usize,
    /// Every x at which the value was asked for.
    seen: Vec<[f64; 2]>,
}

impl Function for Valley {
    fn value(&mut self, x: &[f64]) -> Option<f64> {
        self.seen.push([x[0], x[1]]);
        assert!(self.panics_after.is_none_or(|n| self.seen.len() <= n), "asked for");
        if self.calls_itself {
            let bounds = Bounds { lower: &[0.0], upper: &[1.0], ..Bounds::default() };
            self.nested = minimise(&mut Self::default(), &bounds, &Options::default(), &mut [0.5]).err();
        }
        let value = (1.0 - x[0]).powi(2) + 100.0 * (x[1] - x[0] * x[0]).powi(2);
        (!self.no_value).then_some(value)
    }
    fn gradient(&mut self, x: &[f64], gradient: &mut [f64]) -> bool {
        let slope = 200.0 * (x[1] - x[0] * x[0]);
        gradient.copy_from_slice(&[-2.0 * (1.0 - x[0]) - 2.0 * slope * x[0], slope]);
        true
    }
    fn constraints(&mut self, x: &[f64], values: &mut [f64]) -> bool {
        values.fill(x[0] * x[0] + x[1] * x[1]);
        true
    }
    fn constraint_jacobian(&mut self, x: &[f64], values: &mut [f64]) -> bool {
        for (value, x) in values.iter_mut().zip(x) {
            *value = 2.0 * x;
        }
        true
    }
    fn goes_on(&mut self, n_iterations: usize) -> bool {
        self.n_iterations = n_iterations;
        self.stop_after.is_none_or(|n| n_iterations < n)
    }
}

const FREE: Bounds<'_> = Bounds {
    lower: &[f64::NEG_INFINITY; 2],
    upper: &[f64::INFINITY; 2],
    constraint_lower: &[],
    constraint_upper: &[],
    jacobian: &[],
};
const START: [f64; 2] = [-1.2, 1.0];

fn solve(valley: &mut Valley, bounds: &Bounds<'_>) -> (Result<Status, Error>, [f64; 2]) {
    let mut x = START;
    (minimise(valley, bounds, &Options::default(), &mut x), x)
}

#[test]
fn the_valleys_bottom_is_found() {
    let (status, x) = solve(&mut Valley::default(), &FREE);
    assert_eq!(status, Ok(Status::Solved));
    assert!((x[0] - 1.0).abs() < 1e-5 && (x[1] - 1.0).abs() < 1e-5, "{x:?}");
}

#[test]
fn bounds_are_never_left() {
    let bounds = Bounds { lower: &[-2.0, -1.0], upper: &[0.5, 2.0], ..FREE };
    let mut valley = Valley::default();
    let (status, x) = solve(&mut valley, &bounds);
    assert_eq!(status, Ok(Status::Solved));
    assert!((x[0] - 0.5).abs() < 1e-6 && (x[1] - 0.25).abs() < 1e-5, "{x:?}");
    assert!(valley.seen.iter().all(|x| x[0] <= 0.5 && (-1.0..=2.0).contains(&x[1])));
}

#[test]
fn a_constraint_holds_at_the_end() {
    let bounds = Bounds {
        constraint_lower: &[f64::NEG_INFINITY],
        constraint_upper: &[1.0],
        jacobian: &[(0, 0), (0, 1)],
        ..FREE
    };
    let (status, x) = solve(&mut Valley::default(), &bounds);
    assert_eq!(status, Ok(Status::Solved));
    // Known: the least value in the unit disc lies at (0.7864, 0.6177).
    assert!((x[0] - 0.786_415).abs() < 1e-4 && (x[1] - 0.617_698).abs() < 1e-4, "{x:?}");
}

#[test]
fn the_same_input_gives_the_same_bits() {
    let threads: Vec<_> =
        (0..4).map(|_| std::thread::spawn(|| solve(&mut Valley::default(), &FREE).1)).collect();
    let here = solve(&mut Valley::default(), &FREE).1.map(f64::to_bits);
    for thread in threads {
        assert_eq!(thread.join().unwrap().map(f64::to_bits), here);
    }
}

#[test]
fn every_end_has_its_status() {
    let mut stopped = Valley { stop_after: Some(3), ..Valley::default() };
    assert_eq!(solve(&mut stopped, &FREE).0, Ok(Status::Stopped));
    assert_eq!(stopped.n_iterations, 3);
    let few = Options { max_iterations: 2, ..Options::default() };
    assert_eq!(minimise(&mut Valley::default(), &FREE, &few, &mut START.clone()), Ok(Status::IterationLimit));
    let mut nowhere = Valley { no_value: true, ..Valley::default() };
    assert_eq!(solve(&mut nowhere, &FREE).0, Ok(Status::NoValue));
    let impossible = Bounds {
        constraint_lower: &[f64::NEG_INFINITY],
        constraint_upper: &[-1.0],
        jacobian: &[(0, 0), (0, 1)],
        ..FREE
    };
    assert!(matches!(solve(&mut Valley::default(), &impossible).0, Ok(Status::Infeasible | Status::Stuck)));
}

#[test]
fn a_panic_comes_out_and_leaves_ipopt_usable() {
    for panics_after in [0, 1, 5] {
        let mut valley = Valley { panics_after: Some(panics_after), ..Valley::default() };
        let panic = catch_unwind(AssertUnwindSafe(|| solve(&mut valley, &FREE))).unwrap_err();
        assert_eq!(panic.downcast_ref::<&str>(), Some(&"asked for"));
        assert_eq!(valley.seen.len(), panics_after + 1, "nothing is evaluated after the panic");
        assert_eq!(solve(&mut Valley::default(), &FREE).0, Ok(Status::Solved));
    }
}

#[test]
fn a_solve_inside_a_solve_is_refused() {
    let mut valley = Valley { calls_itself: true, ..Valley::default() };
    assert_eq!(solve(&mut valley, &FREE).0, Ok(Status::Solved));
    assert_eq!(valley.nested, Some(Error::Nested));
}

#[test]
fn wrong_input_is_refused_each_alone() {
    let refused = |bounds: &Bounds<'_>, x: &mut [f64]| {
        minimise(&mut Valley::default(), bounds, &Options::default(), x).unwrap_err()
    };
    let length = |what, found, expected| Error::Length { what, found, expected };
    assert_eq!(refused(&Bounds::default(), &mut []), Error::NoVariable);
    assert_eq!(refused(&Bounds { lower: &[0.0], ..FREE }, &mut START.clone()), length("lower", 1, 2));
    assert_eq!(refused(&Bounds { upper: &[0.0; 3], ..FREE }, &mut START.clone()), length("upper", 3, 2));
    let half = Bounds { constraint_lower: &[0.0], ..FREE };
    assert_eq!(refused(&half, &mut START.clone()), length("constraint_upper", 0, 1));
    for bad in [2.0, f64::NAN] {
        let bounds = Bounds { lower: &[0.0, bad], upper: &[1.0; 2], ..FREE };
        assert_eq!(refused(&bounds, &mut START.clone()), Error::Order { what: "variable", idx: 1 });
    }
    let bounds = Bounds { constraint_lower: &[1.0], constraint_upper: &[0.0], ..FREE };
    assert_eq!(refused(&bounds, &mut START.clone()), Error::Order { what: "constraint", idx: 0 });
    assert_eq!(refused(&FREE, &mut [0.0, f64::NAN]), Error::Start(1));
    for place in [(0, 2), (1, 0)] {
        let places = [(0, 0), place];
        let bounds = Bounds { constraint_lower: &[0.0], constraint_upper: &[1.0], jacobian: &places, ..FREE };
        assert_eq!(refused(&bounds, &mut START.clone()), Error::Jacobian(1));
    }
    let defaults = Options::default();
    for (options, name) in [
        (Options { tolerance: -1.0, ..defaults }, "tolerance"),
        (Options { bound_push: f64::NAN, ..defaults }, "bound_push"),
    ] {
        let error = minimise(&mut Valley::default(), &FREE, &options, &mut START.clone()).unwrap_err();
        assert_eq!(error, Error::Option(name));
    }
}
