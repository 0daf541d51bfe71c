//! The system's Ipopt, which the method `ipopt` links: installed where that can be done, else said what is missing.

use std::path::Path;
use std::process::{Command, Stdio};

use anyhow::Result;

/// What holds the library and what finds it, on Debian.
const PACKAGES: [&str; 2] = ["coinor-libipopt-dev", "pkg-config"];

/// With this the crate `ikiru-ipopt` can be checked, but not linked, without the library.
const CHECK_ONLY: &str = "IKIRU_IPOPT_CHECK_ONLY";

/// What can be done about the library.
#[derive(Debug, PartialEq)]
enum Means {
    /// It is there.
    None,
    /// apt-get can install it.
    Install,
    /// A person has to; the line says what.
    Person(String),
}

/// Installs the library where it is missing and can be installed. Where it cannot be, the tests that need it are
/// left out: it is a peer to compare with, and no one's build asks for it unless told to.
pub(crate) fn provide(_: &Path) -> Result<()> {
    match means(is_there(), succeeds("apt-get", &["--version"]), is_root()) {
        Means::None => println!("Ipopt is there"),
        Means::Install => {
            if !install() && succeeds_aloud("apt-get", &["update"]) {
                install();
            }
            if !is_there() {
                println!("{}", left_out("apt-get could not install it"));
            }
        }
        Means::Person(line) => println!("{line}"),
    }
    Ok(())
}

fn means(is_there: bool, has_apt: bool, is_root: bool) -> Means {
    match (is_there, has_apt, is_root) {
        (true, ..) => Means::None,
        (_, true, true) => Means::Install,
        (_, true, false) => {
            let why = format!("install it by `sudo apt-get install {}`", PACKAGES.join(" "));
            Means::Person(left_out(&why))
        }
        (_, false, _) => {
            Means::Person(left_out("install Ipopt 3.11 or newer (brew: `ipopt`) and pkg-config"))
        }
    }
}

fn left_out(why: &str) -> String {
    format!("LEFT OUT: the tests of the method ipopt, since pkg-config finds no library `ipopt`: {why}")
}

/// What is built and tested in one go: every feature, or without the library every one that does not link it.
pub(crate) fn features() -> &'static [&'static str] {
    if is_there() {
        &["--all-features"]
    } else {
        &["--features", "ikiru-cli/bench,ikiru-cli/plot,ikiru/serde"]
    }
}

/// Every feature for a command that looks at types alone (lints, documentation): that takes no library.
pub(crate) fn check_all(command: &mut Command) -> &mut Command {
    if !is_there() {
        command.env(CHECK_ONLY, "1");
    }
    command.arg("--all-features")
}

fn is_there() -> bool {
    succeeds("pkg-config", &["--exists", "ipopt >= 3.11"])
}

fn is_root() -> bool {
    let id = Command::new("id").arg("-u").output();
    id.is_ok_and(|output| output.stdout.trim_ascii() == b"0")
}

fn install() -> bool {
    let mut args = vec!["install", "--yes", "--no-install-recommends"];
    args.extend(PACKAGES);
    succeeds_aloud("apt-get", &args)
}

fn succeeds(program: &str, args: &[&str]) -> bool {
    let mut command = Command::new(program);
    command.args(args).stdout(Stdio::null()).stderr(Stdio::null());
    command.status().is_ok_and(|status| status.success())
}

fn succeeds_aloud(program: &str, args: &[&str]) -> bool {
    println!("$ {program} {}", args.join(" "));
    let status = Command::new(program).args(args).env("DEBIAN_FRONTEND", "noninteractive").status();
    status.is_ok_and(|status| status.success())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn it_is_installed_only_where_it_is_missing_and_can_be() {
        assert_eq!(means(true, true, true), Means::None);
        assert_eq!(means(true, false, false), Means::None);
        assert_eq!(means(false, true, true), Means::Install);
    }

    #[test]
    fn a_person_is_told_what_to_install() {
        let line = |has_apt, is_root| match means(false, has_apt, is_root) {
            Means::Person(line) => line,
            other => panic!("{other:?}"),
        };
        assert!(line(true, false).contains("`sudo apt-get install coinor-libipopt-dev pkg-config`"));
        assert!(line(false, true).contains("brew: `ipopt`"));
    }
}
