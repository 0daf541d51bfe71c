//! How a run ends: an exit status, or a failure with one.

use std::process::ExitCode;

use ikiru_formats::Place;
use serde_json::{Value, json};

/// How a run that got to its end came out.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Outcome {
    /// The bar was met, or there was none.
    Reached,
    /// The best pose found does not meet the bar.
    BestEffort,
}

/// Why a run did not get to its end.
#[derive(Debug)]
pub(crate) enum Failure {
    /// What came in is not usable.
    Input(anyhow::Error),
    /// What should go out cannot be written.
    Write(anyhow::Error),
}

impl Outcome {
    pub(crate) fn exit_code(self) -> ExitCode {
        match self {
            Self::Reached => ExitCode::SUCCESS,
            Self::BestEffort => ExitCode::from(1),
        }
    }
}

impl Failure {
    pub(crate) fn input(error: impl Into<anyhow::Error>) -> Self {
        Self::Input(error.into())
    }

    pub(crate) fn write(error: impl Into<anyhow::Error>) -> Self {
        Self::Write(error.into())
    }

    pub(crate) fn exit_code(&self) -> ExitCode {
        match self {
            Self::Input(_) => ExitCode::from(2),
            Self::Write(_) => ExitCode::from(3),
        }
    }

    /// The error and its causes, each once: some errors quote their cause already.
    pub(crate) fn texts(&self) -> Vec<String> {
        let (Self::Input(error) | Self::Write(error)) = self;
        let mut texts: Vec<String> = Vec::new();
        for cause in error.chain() {
            let text = cause.to_string();
            if !texts.iter().any(|said| said.contains(&text)) {
                texts.push(text);
            }
        }
        texts
    }

    /// What `--json` prints in the place of a report: `{"error": {"message", "file", "line", "column"}}`.
    pub(crate) fn json(&self) -> Value {
        let (Self::Input(error) | Self::Write(error)) = self;
        let Spot { file, line, column } = error.chain().find_map(Spot::of).unwrap_or_default();
        let message = self.texts().join(": ");
        json!({ "error": { "message": message, "file": file, "line": line, "column": column } })
    }
}

/// What `--json` prints where the command line itself is wrong.
pub(crate) fn misuse(error: &clap::Error) -> Value {
    let text = error.to_string();
    let message = text.trim().trim_start_matches("error: ");
    json!({ "error": { "message": message, "file": null, "line": null, "column": null } })
}

/// An error about the input that no library knows: which file it is about, where in it, and what is wrong.
#[derive(Debug)]
pub(crate) struct InFile {
    pub(crate) file: String,
    /// Line and column, both from 1.
    pub(crate) place: Option<(usize, usize)>,
    pub(crate) what: String,
}

impl std::fmt::Display for InFile {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        match self.place {
            Some((line, column)) => write!(f, "{}:{line}:{column}: {}", self.file, self.what),
            None => write!(f, "{}: {}", self.file, self.what),
        }
    }
}

impl std::error::Error for InFile {}

/// Where in a file something is wrong, as far as that is known.
#[derive(Default)]
struct Spot {
    file: Option<String>,
    line: Option<usize>,
    column: Option<usize>,
}

impl Spot {
    /// The place that an error of ours carries.
    fn of(error: &(dyn std::error::Error + 'static)) -> Option<Self> {
        if let Some(error) = error.downcast_ref::<ikiru_scenario::Error>() {
            let file = Some(error.file().to_owned());
            return Some(Self { file, line: error.line(), column: error.column() });
        }
        if let Some(InFile { file, place, .. }) = error.downcast_ref::<InFile>() {
            let (line, column) = (place.map(|place| place.0), place.map(|place| place.1));
            return Some(Self { file: Some(file.clone()), line, column });
        }
        let error = error.downcast_ref::<ikiru_formats::Error>()?;
        let (line, column) = match error.place() {
            Place::Text { line, column, .. }
            | Place::Line { line, column }
            | Place::Xml { line, column, .. } => (Some(*line), Some(*column)),
            _ => (None, None),
        };
        Some(Self { file: Some(error.file().to_owned()), line, column })
    }
}
