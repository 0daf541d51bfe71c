//! Rule: what others made comes under a licence that `deny.toml` allows, in one version, and for our compiler.
//!
//! `cargo deny` looks at the first two more closely, where it is installed; these looks are taken everywhere.

use std::collections::{BTreeMap, BTreeSet};

use anyhow::{Context, Result};
use semver::{Version, VersionReq};
use serde::Deserialize;
use spdx::{Expression, ParseMode};

use super::{Finding, Project};
use crate::cargo::{self, Package};

const LIST: &str = "deny.toml";

/// What of `deny.toml` counts here.
#[derive(Deserialize)]
struct List {
    licenses: Licenses,
    bans: Bans,
}

#[derive(Deserialize)]
struct Licenses {
    allow: Vec<String>,
}

#[derive(Deserialize)]
struct Bans {
    skip: Vec<Skip>,
}

/// An older version that may stay beside a newer one.
#[derive(Deserialize)]
struct Skip {
    name: String,
    version: VersionReq,
}

pub(super) fn check(project: &Project) -> Result<Vec<Finding>> {
    // Without a lock file nothing is decided about versions: small projects in tests.
    if !project.files().iter().any(|file| file == "Cargo.lock") {
        return Ok(Vec::new());
    }
    let text = project.text(LIST)?;
    let list: List = toml::from_str(&text).with_context(|| LIST.to_owned())?;
    let packages = cargo::whole_metadata(&project.path(""))?.packages;
    let line_of = |words: &str| text.lines().position(|line| line.contains(words)).map_or(1, |idx| idx + 1);
    Ok(judge(&packages, &list)?
        .into_iter()
        .map(|(words, what, expected)| {
            Finding::new(LIST, words.map_or(1, |words| line_of(&words)), what, expected)
        })
        .collect())
}

/// Words of the line that is meant, if there is one; what is there; what was expected.
type Fault = (Option<String>, String, String);

fn judge(packages: &[Package], list: &List) -> Result<Vec<Fault>> {
    let mut faults = Vec::new();
    licences(packages, &list.licenses.allow, &mut faults);
    duplicates(packages, &list.bans.skip, &mut faults)?;
    compilers(packages, &mut faults)?;
    Ok(faults)
}

/// Every licence expression holds with what is allowed.
fn licences(packages: &[Package], allowed: &[String], faults: &mut Vec<Fault>) {
    for package in packages {
        let Package { name, version, license, .. } = package;
        let text = license.as_deref().unwrap_or_default();
        // Some still write `MIT/Apache-2.0`.
        let holds = Expression::parse_mode(text, ParseMode::LAX).is_ok_and(|expression| {
            expression.evaluate(|wanted| allowed.iter().any(|allowed| *allowed == wanted.to_string()))
        });
        if !holds {
            let what = format!("{name} {version} comes under `{text}`");
            faults.push((Some("allow =".into()), what, format!("one of {}", allowed.join(", "))));
        }
    }
}

/// Nothing comes in two versions but what is known to, and what is known to does.
fn duplicates(packages: &[Package], skips: &[Skip], faults: &mut Vec<Fault>) -> Result<()> {
    let mut versions: BTreeMap<&str, BTreeSet<Version>> = BTreeMap::new();
    for package in packages {
        versions.entry(&package.name).or_default().insert(version(&package.version)?);
    }
    let is_skipped = |name: &str, version: &Version| {
        skips.iter().any(|skip| skip.name == name && skip.version.matches(version))
    };
    for (name, versions) in &versions {
        let kept = versions.iter().filter(|version| !is_skipped(name, version)).count();
        if versions.len() > 1 && kept > 1 {
            let versions: Vec<String> = versions.iter().map(Version::to_string).collect();
            let what = format!("{name} comes in versions {}", versions.join(" and "));
            faults.push((Some("skip =".into()), what, "one, or the older in `skip` with a reason".into()));
        }
    }
    for Skip { name, version } in skips {
        let found = versions.get(name.as_str());
        if !found.is_some_and(|found| found.len() > 1 && found.iter().any(|found| version.matches(found))) {
            let what = format!("`skip` names {name} {version}, which is not there twice");
            faults.push((Some(format!("name = \"{name}\"")), what, "no such line".into()));
        }
    }
    Ok(())
}

/// The compiler that we state is new enough for all that we bring.
fn compilers(packages: &[Package], faults: &mut Vec<Fault>) -> Result<()> {
    let ours = packages.iter().find(|package| package.name == "ikiru");
    let Some(ours) = ours.and_then(|package| package.rust_version.as_deref()) else { return Ok(()) };
    for Package { name, version: v, rust_version, .. } in packages {
        let Some(theirs) = rust_version.as_deref() else { continue };
        if version(theirs)? > version(ours)? {
            let what = format!("{name} {v} wants Rust {theirs}");
            faults.push((None, what, format!("at most our own `rust-version`, {ours}")));
        }
    }
    Ok(())
}

/// A version, of which minor and patch may be left out.
fn version(text: &str) -> Result<Version> {
    let n_dots = text.split(['-', '+']).next().unwrap_or_default().matches('.').count();
    let whole = match n_dots {
        0 => format!("{text}.0.0"),
        1 => format!("{text}.0"),
        _ => text.to_owned(),
    };
    Version::parse(&whole).with_context(|| format!("`{text}` is no version"))
}

#[cfg(test)]
mod tests {
    use super::*;

    fn package(name: &str, version: &str, license: &str, rust_version: &str) -> Package {
        Package {
            name: name.into(),
            version: version.into(),
            publish: None,
            targets: Vec::new(),
            license: (!license.is_empty()).then(|| license.into()),
            rust_version: (!rust_version.is_empty()).then(|| rust_version.into()),
        }
    }

    fn faults(packages: &[Package], skip: &str) -> Vec<String> {
        let text = format!("licenses.allow = [\"MIT\", \"Apache-2.0\"]\nbans.skip = [{skip}]\n");
        let faults = judge(packages, &toml::from_str(&text).unwrap()).unwrap();
        faults.into_iter().map(|(_, what, _)| what).collect()
    }

    #[test]
    fn a_licence_holds_by_what_is_allowed() {
        let licensed = |license: &str| faults(&[package("a", "1.0.0", license, "")], "").len();
        for fine in ["MIT", "MIT OR GPL-3.0-only", "Unlicense/MIT", "(MIT OR BSL-1.0) AND Apache-2.0"] {
            assert_eq!(licensed(fine), 0, "{fine}");
        }
        for wrong in
            ["GPL-3.0-only", "MIT AND GPL-3.0-only", "", "nonsense", "Apache-2.0 WITH LLVM-exception"]
        {
            assert_eq!(licensed(wrong), 1, "{wrong}");
        }
    }

    #[test]
    fn a_second_version_has_to_be_known_and_needed() {
        let versions = |versions: &[&str]| -> Vec<Package> {
            versions.iter().map(|version| package("a", version, "MIT", "")).collect()
        };
        let twice = versions(&["1.2.3", "0.9.1"]);
        let skip = "{ name = \"a\", version = \"0.9\" }";
        assert_eq!(faults(&twice, ""), ["a comes in versions 0.9.1 and 1.2.3"]);
        assert_eq!(faults(&twice, skip), [""; 0]);
        assert_eq!(
            faults(&versions(&["1.2.3", "0.9.1", "2.0.0"]), skip),
            ["a comes in versions 0.9.1 and 1.2.3 and 2.0.0"]
        );
        let unneeded = "`skip` names a ^0.9, which is not there twice";
        assert_eq!(faults(&twice[..1], skip), [unneeded]);
        assert_eq!(faults(&twice[1..], skip), [unneeded]);
    }

    #[test]
    fn a_dependency_for_a_newer_compiler_is_refused() {
        let with = |theirs: &str| {
            faults(&[package("ikiru", "0.1.0", "MIT", "1.89"), package("a", "1.0.0", "MIT", theirs)], "")
        };
        for fine in ["", "1.9", "1.89", "1.89.0"] {
            assert_eq!(with(fine), [""; 0], "{fine}");
        }
        assert_eq!(with("1.90"), ["a 1.0.0 wants Rust 1.90"]);
    }
}
