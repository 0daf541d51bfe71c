//! How a run ends: an exit status, or a failure with one.

use std::process::ExitCode;

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

    pub(crate) fn error(&self) -> &anyhow::Error {
        match self {
            Self::Input(error) | Self::Write(error) => error,
        }
    }
}
