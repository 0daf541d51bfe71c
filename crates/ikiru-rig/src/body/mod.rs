//! What a rig's joints carry, as data: the parts of the body and how heavy they are.

mod segment;

pub use segment::{Segment, center_of_mass};
