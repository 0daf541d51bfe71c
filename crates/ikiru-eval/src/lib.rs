//! The evaluation: the paper's tables and figures ([`paper`]), arms of robots by the protocol by which they are
//! compared ([`robots`]), whole bodies that follow targets ([`track`]), and how good planned motions are ([`motions`]).
//!
//! What the command `ikiru bench` does, as a library: sample or read targets, solve them with every method, and
//! make tables, rows for programs and figures of what came out. One thread; the clock runs around the solve alone.
//!
//! Features, both on by default: `sample` makes new target sets (k-means), `plot` draws figures.

#[cfg(feature = "plot")]
mod chart;
mod error;
#[cfg(feature = "plot")]
mod motion_figure;
mod statistics;
mod table;

pub mod motions;
pub mod paper;
pub mod robots;
pub mod track;

pub use error::Error;
#[cfg(feature = "plot")]
pub use motion_figure::write_motion_figure;
pub use statistics::Summary;
