//! One file a command: its arguments → library calls → what is printed and written.

#[cfg(feature = "bench")]
pub(crate) mod bench;
pub(crate) mod convert;
pub(crate) mod demo;
pub(crate) mod inspect;
pub(crate) mod plan;
pub(crate) mod solve;
