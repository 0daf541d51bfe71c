//! One solve: a problem is made, told its options, solved and freed, with callbacks that no panic leaves.

use std::any::Any;
use std::cell::Cell;
use std::ffi::{CStr, c_int, c_void};
use std::panic::{AssertUnwindSafe, catch_unwind, resume_unwind};
use std::sync::{Mutex, PoisonError};

use crate::ffi;
use crate::{Bounds, Error, Function, Options, Status};

/// What Ipopt takes for no bound.
const NO_BOUND: f64 = 2e19;

/// Ipopt's linear solvers (MUMPS, and Fortran behind it) keep state in statics: one solve at a time.
static ONE_AT_A_TIME: Mutex<()> = Mutex::new(());

thread_local! {
    /// Whether this thread is inside a solve, where waiting for the next would be for ever.
    static IS_INSIDE: Cell<bool> = const { Cell::new(false) };
}

/// Improves `x` by Ipopt; afterwards it holds where Ipopt ended. Solves of one process wait for each other.
///
/// Same input, same bits: no clock is read, no option file either. A panic of the function ends the solve and
/// comes out here.
///
/// # Errors
/// When slices do not fit together, ranges are not ordered, the start is not finite, or a function calls this again.
pub fn minimise<F: Function>(
    function: &mut F,
    bounds: &Bounds<'_>,
    options: &Options,
    x: &mut [f64],
) -> Result<Status, Error> {
    check(bounds, x)?;
    check_options(options)?;
    if IS_INSIDE.get() {
        return Err(Error::Nested);
    }
    // Nothing is guarded but Ipopt's own state, which a panic cannot reach.
    let _guard = ONE_AT_A_TIME.lock().unwrap_or_else(PoisonError::into_inner);
    let _inside = Inside::enter();
    let problem = Problem::new::<F>(bounds)?;
    problem.set_options(options)?;
    let mut user = User { function, jacobian: bounds.jacobian, panic: None };
    let (no_output, user_data) = (std::ptr::null_mut(), (&raw mut user).cast::<c_void>());
    // SAFETY: `x` has the length that the problem was made with, and null stands for outputs that are not
    // wanted. `user` outlives the call, is not touched meanwhile but through the pointer, and is what the callbacks,
    // made for the same `F`, take it for.
    let code = unsafe {
        ffi::IpoptSolve(
            problem.0,
            x.as_mut_ptr(),
            no_output,
            no_output,
            no_output,
            no_output,
            no_output,
            user_data,
        )
    };
    if let Some(panic) = user.panic {
        drop(problem);
        resume_unwind(panic);
    }
    Ok(status(code))
}

fn check(bounds: &Bounds<'_>, x: &[f64]) -> Result<(), Error> {
    let n = x.len();
    if n == 0 {
        return Err(Error::NoVariable);
    }
    let m = bounds.constraint_lower.len();
    for (what, found, expected) in [
        ("lower", bounds.lower.len(), n),
        ("upper", bounds.upper.len(), n),
        ("constraint_upper", bounds.constraint_upper.len(), m),
    ] {
        if found != expected {
            return Err(Error::Length { what, found, expected });
        }
    }
    let ranges = [
        ("variable", bounds.lower, bounds.upper),
        ("constraint", bounds.constraint_lower, bounds.constraint_upper),
    ];
    for (what, lower, upper) in ranges {
        // Not a number is not ordered either.
        if let Some(idx) =
            lower.iter().zip(upper).position(|(low, up)| !matches!(low.partial_cmp(up), Some(o) if o.is_le()))
        {
            return Err(Error::Order { what, idx });
        }
    }
    if let Some(idx) = x.iter().position(|value| !value.is_finite()) {
        return Err(Error::Start(idx));
    }
    let is_outside = |(row, column): &(usize, usize)| *row >= m || *column >= n;
    bounds.jacobian.iter().position(is_outside).map_or(Ok(()), |idx| Err(Error::Jacobian(idx)))
}

/// Ipopt would print what it thinks of a bad option.
fn check_options(options: &Options) -> Result<(), Error> {
    for (name, value) in [("tolerance", options.tolerance), ("bound_push", options.bound_push)] {
        if !(value.is_finite() && value > 0.0) {
            return Err(Error::Option(name));
        }
    }
    Ok(())
}

fn status(code: c_int) -> Status {
    match code {
        0 | 6 => Status::Solved,
        1 => Status::Acceptable,
        2 => Status::Infeasible,
        3 | 4 | -2 | -3 => Status::Stuck,
        5 => Status::Stopped,
        -1 => Status::IterationLimit,
        -13 => Status::NoValue,
        code => Status::Other(code),
    }
}

/// Notes that this thread is inside a solve.
struct Inside;

impl Inside {
    fn enter() -> Self {
        IS_INSIDE.set(true);
        Self
    }
}

impl Drop for Inside {
    fn drop(&mut self) {
        IS_INSIDE.set(false);
    }
}

/// A problem that is freed when it goes. Never null.
struct Problem(*mut ffi::ProblemInfo);

impl Problem {
    fn new<F: Function>(bounds: &Bounds<'_>) -> Result<Self, Error> {
        let finite =
            |values: &[f64]| -> Vec<f64> { values.iter().map(|v| v.clamp(-NO_BOUND, NO_BOUND)).collect() };
        let (mut x_lower, mut x_upper) = (finite(bounds.lower), finite(bounds.upper));
        let (mut g_lower, mut g_upper) = (finite(bounds.constraint_lower), finite(bounds.constraint_upper));
        let count = |n: usize| ffi::Index::try_from(n).map_err(|_| Error::Refused);
        let (n, m) = (count(x_lower.len())?, count(g_lower.len())?);
        let n_jacobian = count(bounds.jacobian.len())?;
        // SAFETY: the arrays have the lengths that are given with them and are copied before the call returns.
        // The callbacks keep the contract of Ipopt's header and are called by `minimise` alone.
        let problem = unsafe {
            ffi::CreateIpoptProblem(
                n,
                x_lower.as_mut_ptr(),
                x_upper.as_mut_ptr(),
                m,
                g_lower.as_mut_ptr(),
                g_upper.as_mut_ptr(),
                n_jacobian,
                0,
                0,
                value::<F>,
                constraints::<F>,
                gradient::<F>,
                constraint_jacobian::<F>,
                hessian,
            )
        };
        if problem.is_null() {
            return Err(Error::Refused);
        }
        let problem = Self(problem);
        // SAFETY: the problem exists.
        if unsafe { ffi::SetIntermediateCallback(problem.0, intermediate::<F>) } == 0 {
            return Err(Error::Refused);
        }
        Ok(problem)
    }

    fn set_options(&self, options: &Options) -> Result<(), Error> {
        self.set_text(c"hessian_approximation", c"limited-memory")?;
        // Limits are hard: by default they would be widened by 1e-8.
        self.set_number(c"bound_relax_factor", 0.0)?;
        // Silent, and not changed by a file that happens to lie in the current folder.
        self.set_whole(c"print_level", 0)?;
        self.set_text(c"sb", c"yes")?;
        self.set_text(c"option_file_name", c"")?;
        self.set_number(c"tol", options.tolerance)?;
        self.set_number(c"bound_push", options.bound_push)?;
        self.set_number(c"bound_frac", options.bound_push.min(0.5))?;
        self.set_number(c"slack_bound_push", options.bound_push)?;
        self.set_number(c"slack_bound_frac", options.bound_push.min(0.5))?;
        let history = c_int::try_from(options.history).unwrap_or(c_int::MAX);
        self.set_whole(c"limited_memory_max_history", history)?;
        self.set_whole(c"max_iter", c_int::try_from(options.max_iterations).unwrap_or(c_int::MAX))
    }

    fn set_text(&self, keyword: &'static CStr, value: &CStr) -> Result<(), Error> {
        // SAFETY: the problem exists, both texts end in zero and are only read.
        outcome(keyword, unsafe { ffi::AddIpoptStrOption(self.0, keyword.as_ptr(), value.as_ptr()) })
    }

    fn set_number(&self, keyword: &'static CStr, value: f64) -> Result<(), Error> {
        // SAFETY: the problem exists, the text ends in zero and is only read.
        outcome(keyword, unsafe { ffi::AddIpoptNumOption(self.0, keyword.as_ptr(), value) })
    }

    fn set_whole(&self, keyword: &'static CStr, value: c_int) -> Result<(), Error> {
        // SAFETY: the problem exists, the text ends in zero and is only read.
        outcome(keyword, unsafe { ffi::AddIpoptIntOption(self.0, keyword.as_ptr(), value) })
    }
}

fn outcome(keyword: &'static CStr, result: ffi::BoolResult) -> Result<(), Error> {
    if result == 0 { Err(Error::Option(keyword.to_str().unwrap_or_default())) } else { Ok(()) }
}

impl Drop for Problem {
    fn drop(&mut self) {
        // SAFETY: the problem exists, and nothing uses it afterwards.
        unsafe { ffi::FreeIpoptProblem(self.0) }
    }
}

/// What the callbacks get by pointer.
struct User<'a, F> {
    function: &'a mut F,
    jacobian: &'a [(usize, usize)],
    panic: Option<Box<dyn Any + Send>>,
}

/// Runs a callback's body. A panic must not unwind into C: it is kept, and from then on every callback fails.
///
/// # Safety
/// `user` is the pointer that `minimise::<F>` handed to Ipopt.
unsafe fn call<F: Function>(user: *mut c_void, body: impl FnOnce(&mut User<'_, F>) -> bool) -> ffi::BoolOut {
    // SAFETY: by the caller's word it points to a `User<F>` that lives for the whole solve; Ipopt runs one callback
    // at a time, so that nothing else refers to it now.
    let user = unsafe { &mut *user.cast::<User<'_, F>>() };
    if user.panic.is_some() {
        return 0;
    }
    match catch_unwind(AssertUnwindSafe(|| body(user))) {
        Ok(goes_on) => ffi::BoolOut::from(goes_on),
        Err(panic) => {
            user.panic = Some(panic);
            0
        }
    }
}

/// An array of Ipopt's as a slice.
///
/// # Safety
/// `array` holds `n` numbers that nothing else changes while the slice lives, or `n` is not positive.
unsafe fn slice<'a>(array: *const f64, n: ffi::Index) -> &'a [f64] {
    match usize::try_from(n) {
        // SAFETY: the caller's word.
        Ok(n) if n > 0 && !array.is_null() => unsafe { std::slice::from_raw_parts(array, n) },
        _ => &[],
    }
}

/// An array of Ipopt's to write to.
///
/// # Safety
/// `array` holds `n` initialised numbers that nothing else refers to while the slice lives, or `n` is not positive.
unsafe fn slice_mut<'a>(array: *mut f64, n: ffi::Index) -> &'a mut [f64] {
    match usize::try_from(n) {
        // SAFETY: the caller's word.
        Ok(n) if n > 0 && !array.is_null() => unsafe { std::slice::from_raw_parts_mut(array, n) },
        _ => &mut [],
    }
}

/// Fills an array of Ipopt's with zeros and hands it out: it may come as it was allocated, and whatever a function
/// leaves out is then 0.
///
/// # Safety
/// As for [`slice_mut`], but the numbers need not be initialised.
unsafe fn zeros<'a>(array: *mut f64, n: ffi::Index) -> &'a mut [f64] {
    if let (Ok(n), false) = (usize::try_from(n), array.is_null()) {
        // SAFETY: the caller's word; all bits 0 are the number 0.
        unsafe { std::ptr::write_bytes(array, 0, n) };
    }
    // SAFETY: the caller's word, and the numbers are initialised now.
    unsafe { slice_mut(array, n) }
}

unsafe extern "C" fn value<F: Function>(
    n: ffi::Index,
    x: *mut f64,
    _new_x: ffi::BoolIn,
    result: *mut f64,
    user: *mut c_void,
) -> ffi::BoolOut {
    // SAFETY: Ipopt hands over `n` numbers in `x`, room for one in `result`, and the pointer that it was given.
    unsafe {
        let x = slice(x, n);
        call::<F>(user, |user| {
            let value = user.function.value(x).filter(|value| value.is_finite());
            if let Some(value) = value {
                result.write(value);
            }
            value.is_some()
        })
    }
}

unsafe extern "C" fn gradient<F: Function>(
    n: ffi::Index,
    x: *mut f64,
    _new_x: ffi::BoolIn,
    result: *mut f64,
    user: *mut c_void,
) -> ffi::BoolOut {
    // SAFETY: Ipopt hands over `n` numbers in `x`, room for as many in `result`, and the pointer that it was given.
    unsafe {
        let (x, result) = (slice(x, n), zeros(result, n));
        call::<F>(user, |user| {
            user.function.gradient(x, result) && result.iter().all(|entry| entry.is_finite())
        })
    }
}

unsafe extern "C" fn constraints<F: Function>(
    n: ffi::Index,
    x: *mut f64,
    _new_x: ffi::BoolIn,
    m: ffi::Index,
    result: *mut f64,
    user: *mut c_void,
) -> ffi::BoolOut {
    // SAFETY: Ipopt hands over `n` numbers in `x`, room for `m` in `result`, and the pointer that it was given.
    unsafe {
        let (x, result) = (slice(x, n), zeros(result, m));
        call::<F>(user, |user| {
            user.function.constraints(x, result) && result.iter().all(|entry| entry.is_finite())
        })
    }
}

unsafe extern "C" fn constraint_jacobian<F: Function>(
    n: ffi::Index,
    x: *mut f64,
    _new_x: ffi::BoolIn,
    _m: ffi::Index,
    n_entries: ffi::Index,
    rows: *mut ffi::Index,
    columns: *mut ffi::Index,
    result: *mut f64,
    user: *mut c_void,
) -> ffi::BoolOut {
    // SAFETY: Ipopt hands over the pointer that it was given and, as its header says, either room for the entries'
    // places (then `result` is null, and so may `x` be) or `n` numbers in `x` and room for the entries in `result`.
    unsafe {
        if result.is_null() {
            return call::<F>(user, |user| {
                for (idx, (row, column)) in user.jacobian.iter().enumerate() {
                    // Both are below numbers that fit.
                    rows.add(idx).write(ffi::Index::try_from(*row).unwrap_or_default());
                    columns.add(idx).write(ffi::Index::try_from(*column).unwrap_or_default());
                }
                true
            });
        }
        let (x, result) = (slice(x, n), zeros(result, n_entries));
        call::<F>(user, |user| {
            user.function.constraint_jacobian(x, result) && result.iter().all(|entry| entry.is_finite())
        })
    }
}

/// There is no exact Hessian: Ipopt keeps its own, limited in memory, and never calls this.
unsafe extern "C" fn hessian(
    _n: ffi::Index,
    _x: *mut f64,
    _new_x: ffi::BoolIn,
    _factor: f64,
    _m: ffi::Index,
    _multipliers: *mut f64,
    _new_multipliers: ffi::BoolIn,
    _n_entries: ffi::Index,
    _rows: *mut ffi::Index,
    _columns: *mut ffi::Index,
    _values: *mut f64,
    _user: *mut c_void,
) -> ffi::BoolOut {
    0
}

unsafe extern "C" fn intermediate<F: Function>(
    _mode: ffi::Index,
    n_iterations: ffi::Index,
    _value: f64,
    _infeasibility: f64,
    _dual_infeasibility: f64,
    _barrier: f64,
    _step: f64,
    _regularization: f64,
    _dual_step: f64,
    _primal_step: f64,
    _n_trials: ffi::Index,
    user: *mut c_void,
) -> ffi::BoolOut {
    // SAFETY: Ipopt hands over the pointer that it was given.
    unsafe {
        call::<F>(user, |user| user.function.goes_on(usize::try_from(n_iterations).unwrap_or_default()))
    }
}
