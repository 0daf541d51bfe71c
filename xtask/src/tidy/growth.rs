//! Rule: a public enum of a library is `#[non_exhaustive]`, unless it is known to be closed: a variant more is then no break for
//! users who match over it.

use anyhow::Result;
use syn::{Item, ItemEnum, Visibility};

use super::code::{Source, is_for_tests, sources};
use super::{Finding, Project};

/// The libraries whose enums users match over.
const LIBRARIES: [&str; 4] = ["ikiru-rig", "ikiru-solve", "ikiru-formats", "ikiru-scenario"];

/// Enums that have all variants they will ever have, or whose new variant must be shown to whoever matches.
const CLOSED: [&str; 12] = [
    // How joints move, and what goes with each way: a new one is a new major version, see `JointMotion`.
    "JointMotion",
    "JointData",
    "JointAngles",
    // Made into errors of the readers', which say in each case where in the file that is.
    "RoleMapError",
    "RigidError",
    // All there are.
    "EulerOrder",
    "Rate",
    "RatePart",
    "Unit",
    "Sense",
    "Bound",
    // Turned into other axes of the world wherever it is matched: what is behind a `_` would not be.
    "Gaze",
];

const THIS: &str = "xtask/src/tidy/growth.rs";

pub(super) fn check(project: &Project) -> Result<Vec<Finding>> {
    check_with(project, &CLOSED)
}

fn check_with(project: &Project, closed: &[&str]) -> Result<Vec<Finding>> {
    let mut findings = Vec::new();
    let mut met = Vec::new();
    for Source { file, tree } in sources(project, &["pub enum ".to_owned()])? {
        if !LIBRARIES.iter().any(|name| file.split('/').nth(1) == Some(name)) {
            continue;
        }
        for item in enums(&tree.items) {
            let grows = item.attrs.iter().any(|attribute| attribute.path().is_ident("non_exhaustive"));
            let name = item.ident.to_string();
            if !grows && !closed.contains(&name.as_str()) {
                let line = item.ident.span().start().line;
                let what = format!("the public enum `{name}` cannot grow without a break");
                findings.push(Finding::new(&file, line, what, "#[non_exhaustive], or a place in `CLOSED`"));
            }
            if !grows {
                met.push(name);
            }
        }
    }
    // The list is this program's own: small projects in tests have none of it.
    if project.files().iter().any(|file| file == THIS) {
        for name in closed.iter().filter(|name| !met.iter().any(|met| met == *name)) {
            let what = format!("`{name}` is listed as closed, and there is no such enum");
            findings.push(Finding::new(THIS, 1, what, "no such entry"));
        }
    }
    Ok(findings)
}

/// The public enums among items and the modules in them.
fn enums(items: &[Item]) -> Vec<&ItemEnum> {
    let mut found = Vec::new();
    for item in items {
        match item {
            Item::Enum(item) if matches!(item.vis, Visibility::Public(_)) => found.push(item),
            Item::Mod(item) if !is_for_tests(&item.attrs) => {
                found.extend(item.content.iter().flat_map(|(_, items)| enums(items)));
            }
            _ => {}
        }
    }
    found
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::tidy::Tree;

    const FILE: &str = "crates/ikiru-solve/src/a.rs";

    fn lines(files: &[(&str, &str)], closed: &[&str]) -> Vec<(String, usize)> {
        let found = check_with(&Tree::new(files).open(), closed).unwrap();
        found.into_iter().map(|finding| (finding.file, finding.line)).collect()
    }

    #[test]
    fn a_public_enum_can_grow_or_is_known_to_be_closed() {
        let lone = [(FILE, "//! A.\n/// A.\n#[derive(Debug)]\npub enum A {\n    B,\n}\n")];
        assert_eq!(lines(&lone, &[]), [(FILE.to_owned(), 4)]);
        assert_eq!(lines(&lone, &["A"]), []);
        let inside = [(FILE, "//! A.\npub mod m {\n    pub enum A {}\n}\n")];
        assert_eq!(lines(&inside, &[]), [(FILE.to_owned(), 3)]);
        let mut closed = lone.to_vec();
        closed.push((THIS, ""));
        assert_eq!(lines(&closed, &["A", "C"]), [(THIS.to_owned(), 1)]);
    }

    #[test]
    fn what_can_grow_and_what_others_do_not_see_is_fine() {
        for text in [
            "//! A.\n#[non_exhaustive]\npub enum A {}\n",
            "//! A.\nenum A {}\npub(crate) enum B {}\n// pub enum C\n",
            "//! A.\n#[cfg(test)]\nmod tests {\n    pub enum A {}\n}\n",
        ] {
            assert_eq!(lines(&[(FILE, text)], &[]), [], "{text}");
        }
        assert_eq!(lines(&[("crates/ikiru-cli/src/a.rs", "//! A.\npub enum A {}\n")], &[]), []);
    }
}
