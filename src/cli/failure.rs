//! Failures as a user sees them: what happened, why, and what to do about it.

use std::process::ExitCode;

/// A check that was asked for found something.
const CHECK_FAILED: u8 = 1;
/// Bad input or usage.
const BAD_INPUT: u8 = 2;
/// Stopped by the user.
const INTERRUPTED: u8 = 130;

/// Why a command ended early.
#[derive(Debug)]
pub(crate) enum Failure {
    /// Something could not be done.
    Error {
        /// What, with its causes.
        error: anyhow::Error,
        /// What the user may try.
        hint: Option<String>,
    },
    /// A check found something, as the command has said.
    Check,
    /// The user interrupted; what was done is kept, as the command has said.
    Interrupted,
}

impl Failure {
    /// A failure with advice.
    pub(crate) fn with_hint(error: impl Into<anyhow::Error>, hint: impl Into<String>) -> Self {
        Self::Error {
            error: error.into(),
            hint: Some(hint.into()),
        }
    }

    /// Prints itself; the exit code of the process.
    pub(crate) fn report(self) -> ExitCode {
        match self {
            Self::Error { error, hint } => {
                eprintln!("error: {error}");
                for cause in error.chain().skip(1) {
                    eprintln!("  caused by: {cause}");
                }
                if let Some(hint) = hint {
                    eprintln!("  hint: {hint}");
                }
                ExitCode::from(BAD_INPUT)
            }
            Self::Check => ExitCode::from(CHECK_FAILED),
            Self::Interrupted => ExitCode::from(INTERRUPTED),
        }
    }
}

impl<E: Into<anyhow::Error>> From<E> for Failure {
    fn from(error: E) -> Self {
        Self::Error {
            error: error.into(),
            hint: None,
        }
    }
}
