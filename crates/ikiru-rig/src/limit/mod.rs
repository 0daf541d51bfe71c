//! Hard limits: a range for an angle or offset, and a swing cone with a twist range for a ball.

mod centre;
mod cone;
mod cone_error;
mod ellipse;
mod range;
mod tangent;

pub use centre::ConeCentre;
pub use cone::Cone;
pub use cone_error::ConeError;
pub use range::Range;
pub use tangent::{ConeNormal, TangentBox};

/// A swing this close to π has no twist of its own.
const ANTIPODE: f64 = 1e-9;
