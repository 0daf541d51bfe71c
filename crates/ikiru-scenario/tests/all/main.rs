//! All tests of the crate in one program, which links once.

mod characters;
mod floating;
mod motion;
mod paper;
mod robots;
mod roles;
mod scenarios;
mod wrong_input;
