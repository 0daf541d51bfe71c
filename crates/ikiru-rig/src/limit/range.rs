//! A closed range of one number, with open ends where there is no limit.

use std::f64::consts::PI;

/// A closed range of an angle (radians) or an offset (metres). An infinite end is no limit.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Range {
    /// Smallest value.
    pub min: f64,
    /// Largest value.
    pub max: f64,
}

impl Range {
    /// No limit on either side.
    pub const UNLIMITED: Self = Self { min: f64::NEG_INFINITY, max: f64::INFINITY };

    /// From `min` to `max`, both in radians or metres.
    #[must_use]
    pub const fn new(min: f64, max: f64) -> Self {
        Self { min, max }
    }

    /// From `min` to `max`, both in degrees.
    #[must_use]
    pub fn degrees(min: f64, max: f64) -> Self {
        Self { min: min.to_radians(), max: max.to_radians() }
    }

    /// Whether neither side is limited; an angle then wraps.
    #[must_use]
    pub fn is_unlimited(&self) -> bool {
        self.min == f64::NEG_INFINITY && self.max == f64::INFINITY
    }

    /// The nearest value inside.
    #[inline(always)]
    #[must_use]
    pub fn clamp(&self, value: f64) -> f64 {
        value.max(self.min).min(self.max)
    }

    /// How far outside a value lies; 0 inside.
    #[must_use]
    pub fn distance(&self, value: f64) -> f64 {
        (value - self.clamp(value)).abs()
    }

    /// The middle of a bounded range; the value nearest 0 of any other.
    #[must_use]
    pub fn middle(&self) -> f64 {
        if self.min.is_finite() && self.max.is_finite() {
            0.5 * (self.min + self.max)
        } else {
            self.clamp(0.0)
        }
    }

    /// How far inside a value lies: the distance to the nearer end, negative outside. Infinite where there is
    /// no end, and for a range without width that holds the value, since there is no way out to be measured.
    #[must_use]
    pub fn margin(&self, value: f64) -> f64 {
        let margin = (value - self.min).min(self.max - value);
        if self.max - self.min < 1e-12 && margin > -1e-9 { f64::INFINITY } else { margin }
    }

    /// [`margin`](Self::margin) of an angle for which a range of a whole turn is no limit.
    pub(super) fn margin_around(&self, angle: f64) -> f64 {
        if self.max - self.min >= 2.0 * PI { f64::INFINITY } else { self.margin(angle) }
    }

    pub(crate) fn is_ordered(&self) -> bool {
        self.min <= self.max && self.min < f64::INFINITY && self.max > f64::NEG_INFINITY
    }
}

impl Default for Range {
    fn default() -> Self {
        Self::UNLIMITED
    }
}
