//! The active set's rules for what limits hold, of a pose and of a motion: what blocks, what is crossed, what is let go of. Those
//! for guards are in `acting.rs`.

/// How near to a limit counts as on it in a step, in radians or metres. A report looks from further away (1e-7): steps end a
/// rounding short of a limit, and forces are asked for at the pose that comes back.
pub(crate) const ON_LIMIT: f64 = 1e-9;

/// How far something may move down (not positive) and up (not negative) before a limit stops it.
pub(crate) type Room = (f64, f64);

/// Whether a limit blocks what the cost pulls at by minus this half of its gradient.
#[inline(always)]
pub(crate) fn is_blocked((down, up): Room, gradient: f64) -> bool {
    (down >= -ON_LIMIT && (gradient > 0.0 || up <= ON_LIMIT)) || (up <= ON_LIMIT && gradient < 0.0)
}

/// A way cut off where a limit stops it.
#[inline(always)]
pub(crate) fn inside((down, up): Room, way: f64) -> f64 {
    way.max(down).min(up)
}

/// Whether a limit that holds something at the end of a way would have to pull: `gradient` is half that of the model there,
/// and what is below `slack` is rounding. What has no room at all stays where it is.
#[inline(always)]
pub(crate) fn would_pull((down, up): Room, way: f64, gradient: f64, slack: f64) -> bool {
    if up - down <= ON_LIMIT {
        return false;
    }
    // Half the gradient: what is held from below wants to go further down.
    if way - down <= up - way { gradient < -slack } else { gradient > slack }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn limits_block_what_pushes_against_them_and_nothing_else() {
        for (room, gradient, wanted) in [
            ((0.0, 1.0), 1.0, true),
            ((0.0, 1.0), -1.0, false),
            ((-1.0, 0.0), -1.0, true),
            ((-1.0, 0.0), 1.0, false),
            ((-1.0, 1.0), 5.0, false),
            ((-1.0, 1.0), -5.0, false),
            ((0.0, 0.0), 1.0, true),
            ((0.0, 0.0), -1.0, true),
            ((0.0, 0.0), 0.0, true),
            ((0.0, 1.0), 0.0, false),
            ((-1.0, 0.0), 0.0, false),
            ((-1e-8, 1.0), 1.0, false),
            ((-1e-10, 1.0), 1.0, true),
        ] {
            assert_eq!(is_blocked(room, gradient), wanted, "{room:?} {gradient}");
        }
    }

    #[test]
    fn what_is_held_is_let_go_of_where_its_limit_would_pull() {
        let room = (-0.2, 0.5);
        for (way, gradient, wanted) in
            [(-0.2, -1.0, true), (-0.2, 1.0, false), (0.5, 1.0, true), (0.5, -1.0, false), (0.5, 1e-9, false)]
        {
            assert_eq!(would_pull(room, way, gradient, 1e-6), wanted, "{way} {gradient}");
        }
        assert!(!would_pull((0.0, 0.0), 0.0, -1.0, 0.0) && !would_pull((0.0, 0.0), 0.0, 1.0, 0.0));
        assert_eq!([-1.0, 0.1, 1.0].map(|way| inside(room, way)), [-0.2, 0.1, 0.5]);
    }
}
