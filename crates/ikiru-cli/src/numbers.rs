//! Numbers as people read them: in few digits, and without what rounding left over.

use std::time::Duration;

use ikiru_solve::Unit;

/// A number in few digits.
pub(crate) fn short(number: f64) -> String {
    if number != 0.0 && number.abs() < 1e-3 {
        return format!("{number:.2e}");
    }
    trimmed(format!("{number:.4}"))
}

/// An angle in radians as degrees, to a hundredth.
pub(crate) fn angle(radians: f64) -> String {
    format!("{}°", hundredths(radians.to_degrees()))
}

/// A length in metres, to a millimetre, without a unit.
pub(crate) fn length(metres: f64) -> String {
    trimmed(format!("{metres:.3}"))
}

/// A number to a hundredth.
pub(crate) fn hundredths(number: f64) -> String {
    trimmed(format!("{number:.2}"))
}

/// A residual in the unit that suits its size.
pub(crate) fn residual(residual: f64, unit: Unit) -> String {
    match unit {
        Unit::Metres => format!("{:.2} mm", residual * 1e3),
        Unit::Radians => format!("{:.2}°", residual.to_degrees()),
    }
}

/// A cost, which may be far below 1.
pub(crate) fn cost(cost: f64) -> String {
    if cost != 0.0 && cost < 1e-3 { format!("{cost:.2e}") } else { format!("{cost:.5}") }
}

/// A duration in the unit that suits it.
pub(crate) fn time(time: Duration) -> String {
    let us = time.as_secs_f64() * 1e6;
    match us {
        _ if us < 1e3 => format!("{us:.1} µs"),
        _ if us < 1e6 => format!("{:.2} ms", us / 1e3),
        _ => format!("{:.2} s", us / 1e6),
    }
}

/// Without zeros at the end of its fraction, and without the sign of a zero.
fn trimmed(number: String) -> String {
    let text = number.trim_end_matches('0').trim_end_matches('.');
    if text == "-0" { "0".to_owned() } else { text.to_owned() }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_rounding_left_over_is_zero() {
        assert_eq!(angle(-4.12e-6_f64.to_radians()), "0°");
        assert_eq!(angle(-145.0_f64.to_radians()), "-145°");
        assert_eq!(angle(12.3456_f64.to_radians()), "12.35°");
        assert_eq!((length(-1e-17), length(1.5), length(100.0)), ("0".into(), "1.5".into(), "100".into()));
        assert_eq!((short(0.0), short(1e-4), short(10.0)), ("0".into(), "1.00e-4".into(), "10".into()));
    }
}
