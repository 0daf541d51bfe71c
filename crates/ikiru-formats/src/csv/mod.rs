//! Motions as tables (CSV): for spreadsheets, notebooks and plots.

mod write;

pub use write::motion_csv;
