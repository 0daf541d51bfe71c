//! VRM: what it adds to glTF.

pub(crate) mod animation;
mod fold;
pub(crate) mod read;
