//! Distances to a filled ellipse that is aligned with the axes: of points outside and inside.

use glam::DVec2;

use super::ANTIPODE;

/// The nearest point of the filled ellipse with the given half-widths to a point outside it.
pub(super) fn nearest_on_ellipse(point: DVec2, widths: DVec2) -> DVec2 {
    let (a, b) = (widths.x, widths.y);
    if a < ANTIPODE || b < ANTIPODE {
        return point.clamp(-widths, widths);
    }
    // The nearest point is x_i = w_i² p_i / (t + w_i²) for the root t ≥ 0 of
    // F(t) = Σ (w_i p_i / (t + w_i²))² − 1. F falls and is convex, so Newton's method from the left of the
    // root climbs towards it and never passes it.
    let (p, w2) = (point.abs(), widths * widths);
    let mut t = (widths * p - w2).max_element().max(0.0);
    for _ in 0..64 {
        let ratio = widths * p / (w2 + t);
        let value = ratio.length_squared() - 1.0;
        let slope = -2.0 * (ratio * ratio / (w2 + t)).element_sum();
        let step = value / slope;
        t -= step;
        if step.abs() <= 1e-16 * (t + w2.max_element()) {
            break;
        }
    }
    let nearest = w2 * p / (w2 + t);
    // Rounding may leave the point a hair outside; scaling it puts it on the ellipse.
    let length = (nearest / widths).length();
    (nearest / length.max(1.0)).copysign(point)
}

/// How far a point in an ellipse lies from its edge. Half-widths are above 0.
pub(super) fn distance_inside_ellipse(point: DVec2, widths: DVec2) -> f64 {
    // As for a point outside, but the root lies between −w² of the shorter axis and 0; it is counted from there,
    // since it may be very near. Exactly on the longer axis the nearest point leaves it, as it does a hair
    // beside it.
    let (p, w2) = (point.abs().max(widths * 1e-12), widths * widths);
    let beyond = w2 - w2.min_element();
    let mut t = (widths * p - beyond).max_element();
    for _ in 0..64 {
        // Newton's method on 1/|r|, which is almost straight even next to the pole at 0.
        let r = widths * p / (beyond + t);
        let length = r.length();
        let step = (length - 1.0) * length * length / (r * r / (beyond + t)).element_sum();
        t += step;
        if step.abs() <= 1e-15 * t {
            break;
        }
    }
    p.distance(w2 * p / (beyond + t))
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;
    use std::f64::consts::PI;

    proptest! {
        #[test]
        fn projected_swing_is_the_nearest_of_many(
            widths in prop::array::uniform2(0.01..3.0f64), p in prop::array::uniform2(-4.0..4.0f64)
        ) {
            let (p, w) = (DVec2::from(p), DVec2::from(widths));
            prop_assume!((p / w).length() > 1.0);
            let best = nearest_on_ellipse(p, w);
            prop_assert!((best / w).length() <= 1.0 + 1e-12);
            for i in 0..720 {
                let on = DVec2::from_angle(f64::from(i) * PI / 360.0) * w;
                prop_assert!(p.distance(best) <= p.distance(on) + 1e-9);
            }
        }
    }
}
