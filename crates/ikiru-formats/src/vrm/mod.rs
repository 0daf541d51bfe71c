//! VRM: what it adds to glTF.

pub(crate) mod read;
