//! The project's own chores: `cargo xtask test`, `cargo xtask tidy`.

fn main() {}
