//! Scenarios that come with the library.

use crate::error::{Error, ErrorKind};
use crate::scenario::Scenario;

/// Name and text of every built-in scenario: `demo`, a reach of the built-in human, and the two tasks of the
/// paper's evaluation on the reference skeleton, `paper_simple` and `paper_combined`.
pub const BUILTINS: [(&str, &str); 3] = [
    ("demo", include_str!("../scenarios/demo.toml")),
    ("paper_simple", include_str!("../scenarios/paper_simple.toml")),
    ("paper_combined", include_str!("../scenarios/paper_combined.toml")),
];

impl Scenario {
    /// The scenario of that name among [`BUILTINS`].
    ///
    /// # Errors
    /// An unknown name, which is answered with those that exist.
    pub fn builtin(name: &str) -> Result<Self, Error> {
        match BUILTINS.iter().find(|(known, _)| *known == name) {
            Some((_, text)) => Self::parse(text, &format!("{name}.toml"), "."),
            None => {
                let kind =
                    ErrorKind::Builtin { name: name.to_owned(), known: BUILTINS.map(|b| b.0).to_vec() };
                Err(Error::new("built-in scenario", None, kind))
            }
        }
    }
}
