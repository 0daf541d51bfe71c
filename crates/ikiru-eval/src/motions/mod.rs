//! Motions: what planning a whole motion at once gains over solving its keys one by one, and what limits on speed cost.
//!
//! A [`MotionSource`] is a scenario with `[motion]`, [`run`] gets its motion in every [`Way`], and a [`Report`] shows
//! the measured [`Row`]s.

mod judge;
mod report;
mod row;
mod run;
mod source;
mod straight;
mod way;

pub use judge::Unmet;
pub use report::Report;
pub use row::Row;
pub use run::{Outcome, Settings, run};
pub use source::MotionSource;
pub use way::Way;
