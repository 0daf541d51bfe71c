//! `cargo deny` where it is installed. What it looks at first, licences and duplicates, `tidy` looks at everywhere.

use std::path::Path;

use anyhow::Result;

use crate::cargo;

/// Checks `deny.toml`; without the program says how to get it.
pub(crate) fn run(root: &Path) -> Result<()> {
    if cargo::has(root, "deny")? {
        // Advisories come over the network, and change without a change here: they are no part of a test.
        return cargo::run(root, &["deny", "--all-features", "check", "bans", "licenses", "sources"]);
    }
    println!(
        "LEFT OUT: cargo deny, which is not installed: `cargo install --locked cargo-deny`. \
         Licences, duplicates and compilers were checked by tidy"
    );
    Ok(())
}
