//! VRM: what it adds to glTF.

pub(crate) mod animation;
pub(crate) mod read;
