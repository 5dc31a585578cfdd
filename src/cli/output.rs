//! Standard output, whose closing by the reader is no error, and progress on standard error.

use std::{
    io::{self, Write},
    path::{Path, PathBuf},
};

use indicatif::{ProgressBar, ProgressStyle};

use super::Failure;

/// Prints a line of results.
pub(crate) fn line(text: impl std::fmt::Display) -> Result<(), Failure> {
    match writeln!(io::stdout().lock(), "{text}") {
        Err(error) if error.kind() == io::ErrorKind::BrokenPipe => Ok(()),
        other => Ok(other?),
    }
}

/// Prints a value as JSON.
pub(crate) fn json(value: &impl serde::Serialize) -> Result<(), Failure> {
    line(serde_json::to_string_pretty(value)?)
}

/// Tells the user something that is no result.
pub(crate) fn note(text: impl std::fmt::Display) {
    eprintln!("{text}");
}

/// A bar on standard error; nothing if that is no terminal.
pub(crate) fn bar(length: usize, what: &'static str) -> ProgressBar {
    let style = ProgressStyle::with_template("{msg} [{bar:32}] {pos}/{len} {eta}")
        .unwrap_or(ProgressStyle::default_bar());
    ProgressBar::new(length as u64)
        .with_style(style.progress_chars("=> "))
        .with_message(what)
}

/// The folder for results, made if it is absent.
pub(crate) fn folder(path: &Path) -> Result<PathBuf, Failure> {
    std::fs::create_dir_all(path).map_err(|error| {
        let what =
            anyhow::Error::new(error).context(format!("cannot make the folder {}", path.display()));
        Failure::with_hint(what, "choose another place with --output")
    })?;
    Ok(path.to_owned())
}
