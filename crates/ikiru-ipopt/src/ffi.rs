//! The part of Ipopt's C interface (`IpStdCInterface.h`) that is used, so declared that it fits 3.11 and 3.14.
//!
//! `Bool` is `int` up to 3.13 and C's `bool` since. What a function returns is read as its low byte, which both
//! have in the same place and fill with 0 or 1. Callbacks return 0 or 1 as an `int`, whose low byte is such a
//! `bool`. Of a `Bool` that comes in nothing but the low byte would be reliable: it is not looked at.

use std::ffi::{c_char, c_int, c_void};

/// What Ipopt knows of a problem; opaque.
#[repr(C)]
pub(crate) struct ProblemInfo {
    _private: [u8; 0],
}

pub(crate) type Number = f64;
pub(crate) type Index = c_int;
/// What comes in where the header says `Bool`.
pub(crate) type BoolIn = c_int;
/// What a callback returns where the header says `Bool`.
pub(crate) type BoolOut = c_int;
/// What a function returns where the header says `Bool`.
pub(crate) type BoolResult = u8;

pub(crate) type EvalF = unsafe extern "C" fn(Index, *mut Number, BoolIn, *mut Number, *mut c_void) -> BoolOut;
pub(crate) type EvalGradF =
    unsafe extern "C" fn(Index, *mut Number, BoolIn, *mut Number, *mut c_void) -> BoolOut;
pub(crate) type EvalG =
    unsafe extern "C" fn(Index, *mut Number, BoolIn, Index, *mut Number, *mut c_void) -> BoolOut;
pub(crate) type EvalJacG = unsafe extern "C" fn(
    Index,
    *mut Number,
    BoolIn,
    Index,
    Index,
    *mut Index,
    *mut Index,
    *mut Number,
    *mut c_void,
) -> BoolOut;
pub(crate) type EvalH = unsafe extern "C" fn(
    Index,
    *mut Number,
    BoolIn,
    Number,
    Index,
    *mut Number,
    BoolIn,
    Index,
    *mut Index,
    *mut Index,
    *mut Number,
    *mut c_void,
) -> BoolOut;
pub(crate) type Intermediate = unsafe extern "C" fn(
    Index,
    Index,
    Number,
    Number,
    Number,
    Number,
    Number,
    Number,
    Number,
    Number,
    Index,
    *mut c_void,
) -> BoolOut;

// SAFETY: these are the declarations of Ipopt's header, `Bool` excepted, of which the module's head speaks.
unsafe extern "C" {
    pub(crate) fn CreateIpoptProblem(
        n: Index,
        x_lower: *mut Number,
        x_upper: *mut Number,
        m: Index,
        g_lower: *mut Number,
        g_upper: *mut Number,
        n_jacobian: Index,
        n_hessian: Index,
        index_style: Index,
        eval_f: EvalF,
        eval_g: EvalG,
        eval_grad_f: EvalGradF,
        eval_jac_g: EvalJacG,
        eval_h: EvalH,
    ) -> *mut ProblemInfo;
    pub(crate) fn FreeIpoptProblem(problem: *mut ProblemInfo);
    // The header lacks `const` before 3.14; the text is only read.
    pub(crate) fn AddIpoptStrOption(
        problem: *mut ProblemInfo,
        keyword: *const c_char,
        value: *const c_char,
    ) -> BoolResult;
    pub(crate) fn AddIpoptNumOption(
        problem: *mut ProblemInfo,
        keyword: *const c_char,
        value: Number,
    ) -> BoolResult;
    pub(crate) fn AddIpoptIntOption(
        problem: *mut ProblemInfo,
        keyword: *const c_char,
        value: Index,
    ) -> BoolResult;
    pub(crate) fn SetIntermediateCallback(problem: *mut ProblemInfo, callback: Intermediate) -> BoolResult;
    pub(crate) fn IpoptSolve(
        problem: *mut ProblemInfo,
        x: *mut Number,
        g: *mut Number,
        value: *mut Number,
        g_multipliers: *mut Number,
        lower_multipliers: *mut Number,
        upper_multipliers: *mut Number,
        user_data: *mut c_void,
    ) -> c_int;
}
