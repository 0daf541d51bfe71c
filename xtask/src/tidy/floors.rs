//! Rule: inside the solver, folders stand on those above them in `lib.rs`, and none imports from one below itself. What is
//! compiled for tests alone may look at everything.

use anyhow::{Context, Result};

use super::paths::paths;
use super::{Finding, Project};

/// The crate whose modules are floors, in the order in which its `lib.rs` names them.
const CRATE: &str = "crates/ikiru-solve/src/";

pub(super) fn check(project: &Project) -> Result<Vec<Finding>> {
    let lib = format!("{CRATE}lib.rs");
    if !project.files().contains(&lib) {
        return Ok(Vec::new());
    }
    let text = project.text(&lib)?;
    let floors: Vec<&str> = text.lines().filter_map(module_of).collect();
    let floor_of = |name: &str| floors.iter().position(|floor| *floor == name);
    let mut findings = Vec::new();
    for file in project.files() {
        let Some(within) = file.strip_prefix(CRATE).filter(|within| within.ends_with(".rs")) else {
            continue;
        };
        let own = within.split(['/', '.']).next().unwrap_or_default();
        let Some(floor) = floor_of(own).filter(|_| !is_for_tests(within)) else { continue };
        let text = project.text(file)?;
        let of_code = paths(&text).with_context(|| file.clone())?;
        let of_code = of_code.iter().filter(|path| path.words[0] == "crate");
        let of_code = of_code.map(|path| (path.line, path.words[1].as_str()));
        for (line, used) in of_code.chain(in_comments(&text)) {
            if floor_of(used).is_some_and(|used| used > floor) {
                let what = format!("`{own}` uses `{used}`, which stands on it");
                findings.push(Finding::new(file, line, what, "only what lib.rs names before it"));
            }
        }
    }
    Ok(findings)
}

/// What comments name, each with its line.
fn in_comments(text: &str) -> impl Iterator<Item = (usize, &str)> {
    let code = text.lines().take_while(|line| line.trim() != "mod tests {");
    let comments = code.enumerate().filter(|(_, line)| line.trim_start().starts_with("//"));
    comments.flat_map(|(idx, line)| {
        let named = line.split("crate::").skip(1);
        let word = |rest: &'_ str| rest.find(|c: char| !c.is_alphanumeric() && c != '_');
        named.map(move |rest| (idx + 1, &rest[..word(rest).unwrap_or(rest.len())]))
    })
}

/// The module that a line of `lib.rs` declares.
fn module_of(line: &str) -> Option<&str> {
    let line = line.strip_prefix("pub ").unwrap_or(line);
    line.strip_prefix("mod ")?.strip_suffix(';')
}

/// Files of test code alone.
fn is_for_tests(within: &str) -> bool {
    within.ends_with("/tests.rs") || within.ends_with("/cases.rs")
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::tidy::Tree;

    #[test]
    fn what_stands_on_a_floor_is_not_used_by_it() {
        let lines = |file: &str, text: &str| -> Vec<usize> {
            let lib =
                ("crates/ikiru-solve/src/lib.rs", "//! A.\nmod words;\n\npub mod state;\n\nmod front;\n");
            let found = check(&Tree::new(&[lib, (file, text)]).open()).unwrap();
            found.iter().map(|finding| finding.line).collect()
        };
        let state = "crates/ikiru-solve/src/state/mod.rs";
        assert_eq!(lines(state, "//! A.\nuse crate::words::Unit;\nuse crate::front::Solver;\n"), [3]);
        let group = "//! A.\nuse crate::{\n    front::{Solver, Workspace},\n    words::Unit,\n};\n";
        assert_eq!(lines(state, group), [3, 3]);
        assert_eq!(lines(state, "//! A.\nuse crate::{words::Unit, front};\n"), [2]);
        assert_eq!(lines(state, "//! A.\n/// As [`Solver`](crate::front::Solver).\n"), [2]);
        assert_eq!(
            lines(state, "//! A.\n#[cfg(test)]\nmod tests {\n    use crate::front::Solver;\n}\n"),
            [0; 0]
        );
        assert_eq!(
            lines("crates/ikiru-solve/src/front/mod.rs", "//! A.\nuse crate::state::State;\n"),
            [0; 0]
        );
        assert_eq!(lines("crates/ikiru-solve/src/words.rs", "//! A.\nuse crate::state::State;\n"), [2]);
        assert_eq!(lines("crates/ikiru-eval/src/state/mod.rs", "//! A.\nuse crate::front::A;\n"), [0; 0]);
    }
}
