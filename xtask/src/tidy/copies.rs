//! Rule: a file lies in the project once: what is to be found in a second place is a link there, as no copy stays the same for long.

use std::collections::BTreeMap;

use anyhow::Result;

use super::{Finding, Project};

/// Files below this many bytes are alike by chance.
const SMALLEST: usize = 64;

pub(super) fn check(project: &Project) -> Result<Vec<Finding>> {
    let mut first: BTreeMap<Vec<u8>, &String> = BTreeMap::new();
    let mut findings = Vec::new();
    for file in project.files() {
        // Licences stand beside what they are of.
        if file.rsplit('/').next().is_some_and(|name| name.starts_with("LICENSE")) {
            continue;
        }
        let bytes = project.bytes(file)?;
        if bytes.len() < SMALLEST {
            continue;
        }
        match first.get(&bytes) {
            Some(other) => findings.push(Finding::new(file, 1, format!("a copy of {other}"), "a link to it")),
            None => {
                first.insert(bytes, file);
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
    fn a_copy_is_refused_and_a_licence_or_something_small_is_none() {
        let long = "as long as a file is that somebody wrote, and no other happens to be the same\n";
        let files =
            [("a/one.txt", long), ("b/two.json", long), ("c/LICENSE-MIT", long), ("d/e", ""), ("d/f", "")];
        let found = check(&Tree::new(&files).open()).unwrap();
        let told: Vec<(&str, &str)> =
            found.iter().map(|finding| (finding.file.as_str(), finding.what.as_str())).collect();
        assert_eq!(told, [("b/two.json", "a copy of a/one.txt")]);
    }
}
