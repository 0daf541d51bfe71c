//! What a cone cannot be made of.

/// What is wrong with the numbers of a [`Cone`](super::Cone).
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum ConeError {
    /// The axis has no direction.
    #[error("the axis must be a finite vector longer than zero, not {0:?}")]
    Axis([f64; 3]),
    /// A half-width is outside 0 to π.
    #[error("a swing half-width must lie between 0 and π rad (180°), not {0}")]
    Swing(f64),
    /// The twist range is not ordered or leaves −π to π.
    #[error("the twist range must be ordered and inside −π to π rad (±180°), not {0} to {1}")]
    Twist(f64, f64),
    /// A rotation of the centre has no direction.
    #[error("the centre's {0} must be a finite quaternion longer than zero, not {1:?}")]
    Centre(&'static str, [f64; 4]),
}
