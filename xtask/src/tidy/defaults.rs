//! Rule: the trait of objectives answers nothing by default but what is listed. What an objective does not say is then missing
//! where it is compiled, instead of being silently nothing where it is solved.

use anyhow::Result;
use syn::{Item, TraitItem};

use super::code::sources;
use super::{Finding, Project};

/// The trait, where it is, and the functions that may have a body.
const TRAIT: &str = "Objective";
const CRATE: &str = "crates/ikiru-solve/src/";
const LISTED: [&str; 2] = ["mandatory", "reach"];

pub(super) fn check(project: &Project) -> Result<Vec<Finding>> {
    let mut findings = Vec::new();
    for source in sources(project, &[format!("trait {TRAIT}")])? {
        if !source.file.starts_with(CRATE) {
            continue;
        }
        for item in &source.tree.items {
            let Item::Trait(item) = item else { continue };
            if item.ident != TRAIT {
                continue;
            }
            for function in &item.items {
                let TraitItem::Fn(function) = function else { continue };
                let name = &function.sig.ident;
                if function.default.is_some() && !LISTED.iter().any(|listed| name == listed) {
                    let line = name.span().start().line;
                    let what = format!("`{TRAIT}::{name}` has a body");
                    findings.push(Finding::new(
                        &source.file,
                        line,
                        what,
                        "none, or a place in the rule's list",
                    ));
                }
            }
        }
    }
    Ok(findings)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::tidy::Tree;

    #[test]
    fn only_what_is_listed_has_a_body() {
        let text = "//! A.\npub trait Objective {\n    fn kind(&self) -> u8;\n    fn mandatory(&self) -> bool {\n        true\n    }\n    fn rows(&self) -> u8 {\n        0\n    }\n}\n";
        let lines = |file: &str, text: &str| -> Vec<usize> {
            let found = check(&Tree::new(&[(file, text)]).open()).unwrap();
            found.iter().map(|finding| finding.line).collect()
        };
        assert_eq!(lines("crates/ikiru-solve/src/objective/mod.rs", text), [7]);
        assert_eq!(lines("crates/ikiru-eval/src/a.rs", text), [0; 0]);
        let other = text.replace("trait Objective ", "trait Other ");
        assert_eq!(lines("crates/ikiru-solve/src/objective/mod.rs", &other), [0; 0]);
    }
}
