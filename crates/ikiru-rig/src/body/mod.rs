//! What a rig's joints carry, as data: the parts of the body, how heavy they are, and what takes up room.

mod collision_shape;
mod segment;

pub use collision_shape::{CollisionShape, ShapeKind};
pub use segment::{Segment, center_of_mass};
