//! The command `ikiru`.

fn main() {}
