//! What leaves the program: text on stdout and stderr, files.

use std::borrow::Cow;
use std::fmt::Display;
use std::io::{ErrorKind, Write, stderr, stdout};
use std::path::Path;

use ikiru_formats::{Warning, pose_json, save, write_pose};
use ikiru_rig::Pose;
use ikiru_scenario::Scenario;

use crate::args::{Out, OutFormat};
use crate::failure::Failure;

/// Prints on stdout. Whoever reads may stop reading (`| head -1`): that is no failure.
pub(crate) fn print(text: &str) -> Result<(), Failure> {
    let mut out = stdout().lock();
    match out.write_all(text.as_bytes()).and_then(|()| out.flush()) {
        Err(error) if error.kind() != ErrorKind::BrokenPipe => {
            Err(Failure::write(anyhow::Error::new(error).context("the result cannot be printed")))
        }
        _ => Ok(()),
    }
}

/// A line on stderr. If nobody can read it, nothing can be done.
pub(crate) fn note(text: impl Display) {
    let _ = writeln!(stderr(), "{}", printable(&text.to_string()));
}

/// An error with its causes, one a line; for programs as one object on stdout besides, where nothing else went there.
pub(crate) fn error(failure: &Failure, as_json: bool) {
    for (idx, text) in failure.texts().into_iter().enumerate() {
        note(format!("{}: {text}", if idx == 0 { "error" } else { "  because" }));
    }
    if let (true, Failure::Input(_)) = (as_json, failure) {
        // The exit status tells of the failure, whether or not this can be printed.
        let _ = print(&format!("{}\n", failure.json()));
    }
}

/// Names come from files: what a terminal would take as a command is shown as a replacement character.
pub(crate) fn printable(text: &str) -> Cow<'_, str> {
    let is_control = |c: char| c.is_control() && c != '\n' && c != '\t';
    if text.contains(is_control) {
        Cow::Owned(text.replace(is_control, "\u{fffd}"))
    } else {
        Cow::Borrowed(text)
    }
}

/// Writes a pose, as the file's ending asks for.
pub(crate) fn write_posed(scenario: &Scenario, pose: &Pose, out: &Out) -> Result<(), Failure> {
    let bytes = match out.format {
        OutFormat::Body(format) => {
            let written = write_pose(&scenario.loaded, pose, format).map_err(Failure::write)?;
            warn(&written.warnings);
            written.bytes
        }
        OutFormat::Json => {
            let mut text =
                serde_json::to_vec_pretty(&pose_json(pose, &scenario.active)).map_err(Failure::write)?;
            text.push(b'\n');
            text
        }
    };
    write(&out.path, &bytes)
}

/// Tells what a reader or writer could not take as it was.
pub(crate) fn warn(warnings: &[Warning]) {
    for warning in warnings {
        note(format!("warning: {warning}"));
    }
}

/// Writes a file.
pub(crate) fn write(path: &Path, bytes: &[u8]) -> Result<(), Failure> {
    save(path, bytes).map_err(|e| {
        let advice = format!("the result cannot be written to {}", path.display());
        Failure::write(anyhow::Error::new(e).context(advice))
    })
}
