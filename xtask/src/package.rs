//! Packages every crate as it would be published, then builds the library code from the packages alone.
//!
//! Cargo's own verification goes through a temporary registry whose unpacked sources it keeps per version: after
//! a change inside one version it checks the old text. So the packages are unpacked here, as a workspace of their own.

use std::fmt::Write as _;
use std::fs::{self, File};
use std::path::Path;

use anyhow::{Context, Result, ensure};

use crate::cargo::{self, Metadata, Package};

/// What crates.io accepts.
const MAX_PACKAGE_BYTES: u64 = 10 * 1024 * 1024;

/// What lies in the project's root and in every package, word for word.
const PAPERS: [&str; 3] = ["LICENSE-MIT", "LICENSE-APACHE", "README.md"];

/// Packages all publishable crates and checks that each one builds from what its package holds.
pub(crate) fn run(root: &Path) -> Result<()> {
    let metadata = cargo::metadata(root)?;
    package_into(root, &metadata, &metadata.target_directory)
}

fn package_into(root: &Path, metadata: &Metadata, shared_target: &Path) -> Result<()> {
    let target = &shared_target.join("xtask-package");
    let (publishable, kept): (Vec<&Package>, Vec<&Package>) =
        metadata.packages.iter().partition(|package| package.is_publishable());

    let packages = target.join("package");
    let unpacked = target.join("unpacked");
    for folder in [&packages, &unpacked] {
        if folder.exists() {
            fs::remove_dir_all(folder).with_context(|| folder.display().to_string())?;
        }
    }

    let mut command = cargo::command(root);
    command.args(["package", "--workspace", "--allow-dirty", "--no-verify", "--offline", "--target-dir"]);
    command.arg(target);
    for package in &kept {
        command.args(["--exclude", &package.name]);
    }
    cargo::finish(&mut command)?;

    for package in &publishable {
        let file = packages.join(format!("{}-{}.crate", package.name, package.version));
        let n_bytes = fs::metadata(&file).with_context(|| file.display().to_string())?.len();
        ensure!(n_bytes <= MAX_PACKAGE_BYTES, "{}: {n_bytes} bytes, expected at most 10 MiB", file.display());
        unpack(&file, &unpacked)?;
        has_its_papers(&unpacked.join(format!("{}-{}", package.name, package.version)), root)?;
    }
    let profiles = profiles(root, &kept)?;
    fs::write(unpacked.join("Cargo.toml"), workspace_manifest(&publishable, &profiles))?;
    fs::copy(root.join("Cargo.lock"), unpacked.join("Cargo.lock")).context("Cargo.lock cannot be copied")?;
    let mut command = cargo::command(&unpacked);
    // In the workspace's own folder: what others made has been checked there already.
    command.args(["check", "--workspace", "--offline", "--target-dir"]).arg(shared_target);
    cargo::finish(&mut command)
}

/// Every package brings the licences' texts and a readme: whoever unpacks it has nothing else.
fn has_its_papers(package: &Path, root: &Path) -> Result<()> {
    for name in PAPERS {
        let (here, there) = (root.join(name), package.join(name));
        let ours = fs::read(&here).with_context(|| here.display().to_string())?;
        let packed = fs::read(&there).with_context(|| format!("{} is not packed", there.display()))?;
        ensure!(ours == packed, "{}: another text than {}", there.display(), here.display());
    }
    Ok(())
}

/// The workspace's own profiles, but for packages that are not there: with others, all dependencies would be checked
/// again.
fn profiles(root: &Path, absent: &[&Package]) -> Result<String> {
    let text = fs::read_to_string(root.join("Cargo.toml")).context("Cargo.toml cannot be read")?;
    let manifest: toml::Table = text.parse().context("Cargo.toml")?;
    let mut profiles = manifest.into_iter().filter(|(key, _)| key == "profile").collect::<toml::Table>();
    let tables = profiles.iter_mut().filter_map(|(_, all)| all.as_table_mut());
    for (_, profile) in tables.flat_map(toml::Table::iter_mut) {
        if let Some(overrides) = profile.get_mut("package").and_then(toml::Value::as_table_mut) {
            overrides.retain(|name, _| absent.iter().all(|package| package.name != *name));
        }
    }
    Ok(profiles.to_string())
}

/// Unpacks a `.crate` file: it holds one folder, `name-version`.
fn unpack(file: &Path, into: &Path) -> Result<()> {
    let packed = File::open(file).with_context(|| file.display().to_string())?;
    let mut archive = tar::Archive::new(flate2::read::GzDecoder::new(packed));
    // All packages carry one and the same old time: with it, cargo would take a changed file for the one it knows.
    archive.set_preserve_mtime(false);
    archive.unpack(into).with_context(|| format!("{}: cannot be unpacked", file.display()))
}

/// A workspace of the unpacked packages, each one standing in for its published self.
fn workspace_manifest(packages: &[&Package], profiles: &str) -> String {
    let mut manifest =
        format!("[workspace]\nresolver = \"3\"\nmembers = [\"*\"]\n\n{profiles}\n[patch.crates-io]\n");
    for Package { name, version, .. } in packages {
        // Writing to a String cannot fail.
        let _ = writeln!(manifest, "{name} = {{ path = \"{name}-{version}\" }}");
    }
    manifest
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::tidy::Tree;

    const LIB: &str = "crates/upper/src/lib.rs";

    /// Two crates, one on top of the other, and a third that is not published.
    fn workspace(lower: &str, upper: &str) -> Tree {
        let head = |name: &str| {
            format!(
                "[package]\nname = \"xtask-{name}\"\nversion = \"0.1.0\"\nedition = \"2024\"\nlicense = \"MIT\"\ndescription = \"A\"\nreadme = \"../../README.md\"\n"
            )
        };
        let below = "[dependencies]\nxtask-lower = { path = \"../lower\", version = \"0.1.0\" }\n";
        let kit = "[dev-dependencies]\nxtask-kit = { path = \"../kit\" }\n";
        Tree::new(&[
            ("Cargo.toml", "[workspace]\nresolver = \"3\"\nmembers = [\"crates/*\"]\n"),
            ("Cargo.lock", "version = 4\n"),
            ("README.md", "text"),
            ("LICENSE-MIT", "MIT"),
            ("LICENSE-APACHE", "Apache"),
            ("crates/lower/LICENSE-MIT", "MIT"),
            ("crates/lower/LICENSE-APACHE", "Apache"),
            ("crates/upper/LICENSE-MIT", "MIT"),
            ("crates/upper/LICENSE-APACHE", "Apache"),
            ("crates/lower/Cargo.toml", &head("lower")),
            ("crates/lower/src/lib.rs", lower),
            ("crates/upper/Cargo.toml", &(head("upper") + below + kit)),
            (LIB, upper),
            ("crates/kit/Cargo.toml", &(head("kit") + "publish = false\n")),
            ("crates/kit/src/lib.rs", ""),
        ])
    }

    fn package(tree: &Tree) -> Result<()> {
        let root = tree.root();
        package_into(root, &cargo::metadata(root)?, &root.join("target"))
    }

    #[test]
    fn change_inside_a_version_is_seen() {
        let tree = workspace("pub fn a() {}", "pub fn b() { xtask_lower::a() }");
        package(&tree).unwrap();
        fs::write(tree.root().join("crates/lower/src/lib.rs"), "pub fn c() {}").unwrap();
        assert!(package(&tree).is_err(), "the function that is gone was still found");
        fs::write(tree.root().join(LIB), "pub fn b() { xtask_lower::c() }").unwrap();
        package(&tree).unwrap();
    }

    #[test]
    fn profiles_are_the_workspaces_for_packages_that_are_there() {
        let profile = "[profile.dev]\nopt-level = 2\n[profile.dev.package]\nxtask-kit = { opt-level = 1 }\n\
                       xtask-lower = { opt-level = 0 }\n";
        let tree = workspace("", "");
        let manifest = tree.root().join("Cargo.toml");
        let text = fs::read_to_string(&manifest).unwrap();
        fs::write(&manifest, text + profile).unwrap();
        let metadata = cargo::metadata(tree.root()).unwrap();
        let absent: Vec<&Package> = metadata.packages.iter().filter(|p| p.name == "xtask-kit").collect();
        let profiles: toml::Table = profiles(tree.root(), &absent).unwrap().parse().unwrap();
        let dev = &profiles["profile"]["dev"];
        assert_eq!(dev["opt-level"].as_integer(), Some(2));
        assert_eq!(dev["package"].as_table().unwrap().keys().collect::<Vec<_>>(), ["xtask-lower"]);
    }

    #[test]
    fn package_without_a_licence_is_refused() {
        let tree = workspace("", "");
        let licence = tree.root().join("crates/upper/LICENSE-MIT");
        fs::write(&licence, "another").unwrap();
        assert!(package(&tree).unwrap_err().to_string().contains("another text than"));
        fs::remove_file(licence).unwrap();
        assert!(package(&tree).unwrap_err().to_string().contains("LICENSE-MIT is not packed"));
    }

    #[test]
    fn file_outside_of_a_package_is_missed() {
        let with = |path| workspace("", &format!("pub const TEXT: &str = include_str!(\"{path}\");"));
        package(&with("../README.md")).unwrap();
        let error = package(&with("../../../README.md")).unwrap_err();
        assert!(error.to_string().starts_with("`cargo check"), "{error:#}");
    }
}
