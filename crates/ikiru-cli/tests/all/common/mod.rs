//! Runs the built command.
#![allow(dead_code, reason = "each test file uses a part of it")]

use std::io::{Seek as _, Write as _};
use std::path::{Path, PathBuf};
use std::process::Command;

use serde_json::Value;

/// What a run of the command left behind.
pub(crate) struct Run {
    pub(crate) code: i32,
    pub(crate) stdout: String,
    pub(crate) stderr: String,
}

impl Run {
    /// The one JSON object on stdout.
    #[track_caller]
    pub(crate) fn json(&self) -> Value {
        serde_json::from_str(&self.stdout)
            .unwrap_or_else(|error| panic!("{error} in: {}\n{}", self.stdout, self.stderr))
    }

    /// Checks the exit status and what stderr says.
    #[track_caller]
    pub(crate) fn fails(&self, code: i32, words: &[&str]) {
        assert_eq!(self.code, code, "{}{}", self.stdout, self.stderr);
        assert!(self.stderr.starts_with("error: "), "{}", self.stderr);
        for word in words {
            assert!(self.stderr.contains(word), "'{word}' is missing in: {}", self.stderr);
        }
        for debug in ["Error {", "Some(", "Inner", "panicked", "RUST_BACKTRACE"] {
            assert!(!self.stderr.contains(debug), "{}", self.stderr);
        }
    }
}

/// Runs `ikiru` in a folder.
pub(crate) fn ikiru_in(folder: &Path, args: &[&str]) -> Run {
    ikiru_fed(folder, args, "")
}

/// Runs `ikiru` in a folder with a text on its standard input.
pub(crate) fn ikiru_fed(folder: &Path, args: &[&str], text: &str) -> Run {
    let mut input = tempfile::tempfile().expect("a file");
    input.write_all(text.as_bytes()).and_then(|()| input.rewind()).expect("it can be written");
    let output = Command::new(env!("CARGO_BIN_EXE_ikiru"))
        .args(args)
        .current_dir(folder)
        .stdin(input)
        .output()
        .expect("it starts");
    Run {
        code: output.status.code().expect("it ended by itself"),
        stdout: String::from_utf8(output.stdout).expect("text"),
        stderr: String::from_utf8(output.stderr).expect("text"),
    }
}

/// Runs `ikiru` in the project's root.
pub(crate) fn ikiru(args: &[&str]) -> Run {
    ikiru_in(&root(), args)
}

pub(crate) fn root() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("../..")
}
