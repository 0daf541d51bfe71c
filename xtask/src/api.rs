//! What the published crates show to users, one item a line, in `docs/api/CRATE.txt`: a change of it shows in a diff, and
//! not by accident. `cargo xtask api` writes the files, `cargo xtask test` compares.
//!
//! The items come from rustdoc's JSON, which is not stable yet: its form belongs to one compiler. So each file names the
//! one that it was made with, and with another it is not compared.

use std::collections::BTreeSet;
use std::ffi::OsStr;
use std::fmt::Write as _;
use std::fs;
use std::path::{Path, PathBuf};
use std::process::{Command, ExitCode};

use anyhow::{Context, Result, ensure};

use crate::cargo::{self, Metadata, Package};
use crate::ipopt;

/// Set where this program stands in for rustdoc; the value is the real one.
pub(crate) const STANDS_IN_FOR: &str = "IKIRU_XTASK_RUSTDOC";

/// How many lines of a difference are shown.
const MOST_SHOWN: usize = 40;

/// What a file's first line begins with; the compiler's version follows.
const MADE_WITH: &str = "# Made by `cargo xtask api` with ";

/// Compares the interface of every published crate with its file.
pub(crate) fn check(root: &Path) -> Result<()> {
    let (metadata, compiler) = (cargo::metadata(root)?, compiler()?);
    let files: Vec<(&Package, PathBuf)> =
        libraries(&metadata).map(|package| (package, file_of(root, package))).collect();
    let mut known = Vec::new();
    for (package, file) in &files {
        let text = fs::read_to_string(file)
            .with_context(|| format!("{}: run `cargo xtask api` to make it", file.display()))?;
        let (made_with, items) = parse(&text)
            .with_context(|| format!("{}: expected a first line `{MADE_WITH}…`", file.display()))?;
        if made_with != compiler {
            println!(
                "LEFT OUT: the interfaces in docs/api were written with {made_with}, this is {compiler}"
            );
            return Ok(());
        }
        known.push((*package, file, items));
    }
    document(root, &metadata)?;
    let mut report = String::new();
    for (package, file, known) in known {
        let found = items(&metadata, package)?;
        if let Some(difference) = difference(&known, &found) {
            let _ = write!(report, "\n{}:\n{difference}", file.display());
        }
    }
    ensure!(
        report.is_empty(),
        "what users see has changed. Where that is meant, name it in CHANGELOG.md and run `cargo xtask api`:{report}"
    );
    println!("{} interfaces are as docs/api has them", files.len());
    Ok(())
}

/// Writes the interface of every published crate into its file.
pub(crate) fn renew(root: &Path) -> Result<()> {
    let (metadata, compiler) = (cargo::metadata(root)?, compiler()?);
    document(root, &metadata)?;
    for package in libraries(&metadata) {
        let file = file_of(root, package);
        let mut text = format!("{MADE_WITH}{compiler}\n");
        for item in items(&metadata, package)? {
            let _ = writeln!(text, "{item}");
        }
        fs::create_dir_all(file.parent().unwrap_or(root)).context("docs/api cannot be made")?;
        fs::write(&file, text).with_context(|| file.display().to_string())?;
        println!("wrote {}", file.display());
    }
    Ok(())
}

/// Runs the real rustdoc, and lets it use what is not stable. Were that said to cargo instead, the build scripts of
/// dependencies that ask for it would all run anew.
pub(crate) fn stand_in(rustdoc: &OsStr) -> ExitCode {
    let status = Command::new(rustdoc).args(std::env::args_os().skip(1)).env("RUSTC_BOOTSTRAP", "1").status();
    match status {
        Ok(status) if status.success() => ExitCode::SUCCESS,
        Ok(_) => ExitCode::FAILURE,
        Err(error) => {
            eprintln!("xtask: {} could not be started: {error}", Path::new(rustdoc).display());
            ExitCode::FAILURE
        }
    }
}

/// The packages with a library that others may depend on.
fn libraries(metadata: &Metadata) -> impl Iterator<Item = &Package> {
    let has_library = |package: &&Package| package.targets.iter().any(|target| target.kind == ["lib"]);
    metadata.packages.iter().filter(|package| package.is_publishable()).filter(has_library)
}

fn file_of(root: &Path, package: &Package) -> PathBuf {
    root.join("docs/api").join(format!("{}.txt", package.name))
}

/// As it names itself: `rustc 1.95.0 (59807616e 2026-04-14)`.
fn compiler() -> Result<String> {
    let output = Command::new("rustc").arg("--version").output().context("rustc could not be started")?;
    ensure!(output.status.success(), "`rustc --version` failed ({})", output.status);
    Ok(String::from_utf8_lossy(&output.stdout).trim().to_owned())
}

/// Has rustdoc write the JSON of all libraries, with every feature.
fn document(root: &Path, metadata: &Metadata) -> Result<()> {
    let rustdoc = std::env::var_os("RUSTDOC").unwrap_or_else(|| "rustdoc".into());
    let own = std::env::current_exe().context("this program cannot be found")?;
    let mut command = cargo::command(root);
    command.args(["doc", "--no-deps", "--lib"]);
    for package in libraries(metadata) {
        command.args(["--package", &package.name]);
    }
    command.env("RUSTDOC", own).env(STANDS_IN_FOR, rustdoc);
    command.env("RUSTDOCFLAGS", "-Z unstable-options --output-format json");
    cargo::finish(ipopt::check_all(&mut command))
}

/// The public items of a documented package, by their paths.
fn items(metadata: &Metadata, package: &Package) -> Result<Vec<String>> {
    let json = format!("{}.json", package.name.replace('-', "_"));
    let json = metadata.target_directory.join("doc").join(json);
    let api = public_api::Builder::from_rustdoc_json(&json)
        .omit_blanket_impls(true)
        .omit_auto_trait_impls(true)
        .build()
        .with_context(|| format!("{} cannot be read", json.display()))?;
    Ok(api.items().map(ToString::to_string).collect())
}

/// The compiler that a file was made with, and its items.
fn parse(text: &str) -> Option<(&str, Vec<String>)> {
    let (first, items) = text.split_once('\n')?;
    Some((first.strip_prefix(MADE_WITH)?.trim_end(), items.lines().map(str::to_owned).collect()))
}

/// What is gone and what is new, a line each; `None` where all is as it was.
fn difference(known: &[String], found: &[String]) -> Option<String> {
    let [was, is] = [known, found].map(|items| items.iter().map(String::as_str).collect::<BTreeSet<_>>());
    let gone = was.difference(&is).map(|item| format!("- {item}\n"));
    let new = is.difference(&was).map(|item| format!("+ {item}\n"));
    let lines: Vec<String> = gone.chain(new).collect();
    let mut shown: String = lines.iter().take(MOST_SHOWN).map(String::as_str).collect();
    if lines.len() > MOST_SHOWN {
        let _ = writeln!(shown, "… and {} more", lines.len() - MOST_SHOWN);
    }
    (!lines.is_empty()).then_some(shown)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn items(items: &[&str]) -> Vec<String> {
        items.iter().map(|item| (*item).to_owned()).collect()
    }

    #[test]
    fn what_is_gone_and_what_is_new_is_told() {
        let (was, is) = (items(&["pub fn a()", "pub fn b()"]), items(&["pub fn a()", "pub fn b(f64)"]));
        assert_eq!(difference(&was, &is).unwrap(), "- pub fn b()\n+ pub fn b(f64)\n");
        assert_eq!(difference(&was, &was), None);
    }

    #[test]
    fn of_many_differences_the_first_are_shown() {
        let new: Vec<String> = (0..50).map(|i| format!("pub fn f{i:02}()")).collect();
        let shown = difference(&[], &new).unwrap();
        assert!(shown.starts_with("+ pub fn f00()\n") && shown.ends_with("+ pub fn f39()\n… and 10 more\n"));
    }

    #[test]
    fn a_file_names_its_compiler() {
        let text = format!("{MADE_WITH}rustc 1.95.0 (abc 2026-04-14)\npub mod a\npub fn a::b()\n");
        let (compiler, found) = parse(&text).unwrap();
        assert_eq!(
            (compiler, found),
            ("rustc 1.95.0 (abc 2026-04-14)", items(&["pub mod a", "pub fn a::b()"]))
        );
        assert_eq!(parse("pub mod a\n"), None);
    }
}
