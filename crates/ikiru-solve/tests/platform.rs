//! The same bits where the platform's own mathematics gives other ones: here it gives nothing at all. Alone in its
//! program, since it stands in for functions of the whole process.
#![cfg(target_os = "linux")]
#![allow(
    unsafe_code,
    reason = "the attribute that gives a function a name of the platform's; no line is unsafe"
)]

use std::hint::black_box;

#[path = "all/bits.rs"]
mod bits;

macro_rules! not_a_number {
    ($($name:ident($($argument:ident),+);)*) => {
        $(
            /// Takes the place of the platform's function.
            #[unsafe(no_mangle)]
            extern "C" fn $name($($argument: f64),+) -> f64 {
                let _ = ($($argument),+);
                f64::NAN
            }
        )*
    };
}

not_a_number! {
    sin(x); cos(x); tan(x); asin(x); acos(x); atan(x); atan2(y, x);
    sinh(x); cosh(x); tanh(x); asinh(x); acosh(x); atanh(x);
    exp(x); exp2(x); expm1(x); log(x); log2(x); log10(x); log1p(x); pow(x, y); hypot(x, y); cbrt(x);
}

/// What compilers make of a sine and a cosine of one angle.
#[unsafe(no_mangle)]
extern "C" fn sincos(_: f64, sin: &mut f64, cos: &mut f64) {
    (*sin, *cos) = (f64::NAN, f64::NAN);
}

#[test]
fn the_platforms_functions_are_not_asked() {
    let x = black_box(0.5_f64);
    let of_platform = [x.sin(), x.cos(), x.tan(), x.atan2(0.3), x.exp(), x.ln(), x.powf(0.3), x.hypot(0.3)];
    assert!(of_platform.iter().all(|value| value.is_nan()), "they are stood in for: {of_platform:?}");
    for (method, settle, wanted) in bits::BITS {
        assert_eq!(bits::bits_of(method, settle), wanted, "{}", method.name());
    }
}
