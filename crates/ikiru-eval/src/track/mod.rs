//! Whole bodies that follow targets frame by frame: how fast, how near, how smoothly.
//!
//! A [`Course`] is a body with the frames that some of its joints are to have, at a rate; [`run`] follows it warm, each frame
//! from the pose of the frame before, and a [`Report`] shows the measured [`Row`]s. Every target was read off a pose inside the limits, so
//! that all can be met, but for those of a course that goes [away](Course::away).

mod clips;
mod course;
mod report;
mod run;
mod sines;

pub use clips::CLIPS;
pub use course::Course;
pub use report::Report;
pub use run::{Row, Settings, run};
