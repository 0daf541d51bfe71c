//! The two tasks.

use std::path::Path;

use ikiru_scenario::{BUILTINS, Document, Scenario};

use crate::error::Error;

/// What a method has to do.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Task {
    /// The fingertip to a point: equation 16 alone.
    Simple,
    /// The fingertip to a point, while wrist, finger and upper arm point where a person's would: the paper's J(θ).
    Combined,
}

/// Success is a cost below this (equation 22).
pub(crate) const COST_BELOW: f64 = 0.005;

impl Task {
    /// Both, in the paper's order.
    pub const ALL: [Self; 2] = [Self::Simple, Self::Combined];

    /// `simple` or `combined`.
    #[must_use]
    pub fn name(self) -> &'static str {
        match self {
            Self::Simple => "simple",
            Self::Combined => "combined",
        }
    }

    /// The task of that name.
    ///
    /// # Errors
    /// An unknown name, which is answered with those that exist.
    pub fn from_name(name: &str) -> Result<Self, Error> {
        Self::ALL.into_iter().find(|t| t.name() == name).ok_or_else(|| Error::Unknown {
            what: "objective",
            name: name.to_owned(),
            known: "simple, combined".to_owned(),
        })
    }

    /// The task as it ships, on the reference human or on another rig that has joints of the same names.
    ///
    /// # Errors
    /// A rig that cannot be read, or lacks one of the task's joints.
    pub fn scenario(self, rig: Option<&Path>) -> Result<Scenario, Error> {
        let name = match self {
            Self::Simple => "paper_simple",
            Self::Combined => "paper_combined",
        };
        let Some(rig) = rig else { return Ok(Scenario::builtin(name)?) };
        let text = BUILTINS.iter().find(|(known, _)| *known == name).map_or("", |(_, text)| text);
        let mut document = Document::parse(text, &format!("{name}.toml"))?;
        document.rig = rig.display().to_string();
        Ok(Scenario::from_document(&document, "")?)
    }
}
