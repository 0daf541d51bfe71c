//! All tests of the crate in one program, which links once.

mod center_of_mass;
mod centred_cones;
mod characters;
mod coupling;
mod documents;
mod floating;
mod motion;
mod page;
mod paper;
mod random_document;
mod robots;
mod roles;
mod scales;
mod scenarios;
mod worlds;
mod wrong_input;
