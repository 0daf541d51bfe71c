//! Rule: what ARCHITECTURE.md names exists. It reads paths in inline code and drawn trees, both from the root.

use anyhow::Result;

use super::{Finding, Project};

const MAP: &str = "ARCHITECTURE.md";

pub(super) fn check(project: &Project) -> Result<Vec<Finding>> {
    if !project.path(MAP).is_file() {
        return Ok(vec![Finding::new(MAP, 1, "is missing", "the map of the project")]);
    }
    let mut findings = Vec::new();
    for (line, path) in paths_named(project, &project.text(MAP)?) {
        let found = project.path(&path);
        if path.ends_with('/') && !found.is_dir() {
            findings.push(Finding::new(MAP, line, format!("names `{path}`"), "a folder that exists"));
        } else if !found.exists() {
            findings.push(Finding::new(MAP, line, format!("names `{path}`"), "a file that exists"));
        }
    }
    Ok(findings)
}

/// Every path in a text, with its line.
fn paths_named(project: &Project, text: &str) -> Vec<(usize, String)> {
    let mut paths = Vec::new();
    let mut in_fence = false;
    let mut tree = Tree::default();
    for (idx, line) in text.lines().enumerate() {
        if line.trim_start().starts_with("```") {
            in_fence = !in_fence;
            tree = Tree::default();
        } else if in_fence {
            paths.extend(tree.entry(line).filter(|path| is_literal(path)).map(|path| (idx + 1, path)));
        } else {
            let spans = line.split('`').skip(1).step_by(2);
            paths.extend(
                spans.filter(|span| is_path(project, span)).map(|span| (idx + 1, String::from(span))),
            );
        }
    }
    paths
}

/// Whether inline code is a path from the root: it ends like a folder or a file, or begins with what exists.
fn is_path(project: &Project, span: &str) -> bool {
    let (Some(first), Some(last)) = (span.split('/').next(), span.split('/').next_back()) else {
        return false;
    };
    let extension = last.rsplit_once('.').map(|(_, extension)| extension);
    let ends_like_a_file = extension.is_some_and(|extension| {
        !extension.is_empty() && extension.bytes().all(|byte| byte.is_ascii_lowercase())
    });
    span.contains('/')
        && !matches!(first, "" | "." | "..")
        && is_literal(span)
        && (last.is_empty() || ends_like_a_file || project.path(first).exists())
}

/// Whether a path stands for itself: no pattern, and no `NAME` in the place of a name.
fn is_literal(path: &str) -> bool {
    let plain = |byte: u8| byte.is_ascii_alphanumeric() || b"_-./".contains(&byte);
    path.bytes().all(plain) && !path.split(['/', '.']).any(|part| part == "NAME")
}

/// A tree drawn with `├──` and `└──`: the open folders, each with the column of its branch.
#[derive(Default)]
struct Tree {
    open: Vec<(usize, String)>,
}

impl Tree {
    /// The path that a line adds, if it has a branch.
    fn entry(&mut self, line: &str) -> Option<String> {
        let column = line.chars().position(|c| matches!(c, '├' | '└'))?;
        let name = line.split_once("─ ")?.1.split_whitespace().next()?;
        while self.open.pop_if(|(open, _)| *open >= column).is_some() {}
        let parent = self.open.last().map_or("", |(_, path)| path);
        let path = format!("{parent}{name}");
        self.open.push((column, format!("{}/", path.trim_end_matches('/'))));
        Some(path)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::tidy::Tree as Sample;

    fn missing(map: &str) -> Vec<(usize, String)> {
        let tree = Sample::new(&[
            (MAP, map),
            ("crates/ikiru-rig/src/joint.rs", ""),
            ("examples/01_reach.rs", ""),
            (".ci/run", ""),
        ]);
        let findings = check(&tree.open()).unwrap();
        findings.into_iter().map(|finding| (finding.line, finding.what)).collect()
    }

    fn named(line: usize, path: &str) -> (usize, String) {
        (line, format!("names `{path}`"))
    }

    #[test]
    fn missing_map_is_a_finding() {
        assert_eq!(check(&Sample::new(&[]).open()).unwrap()[0].what, "is missing");
    }

    #[test]
    fn inline_paths_must_exist() {
        assert_eq!(missing("See `crates/ikiru-rig/`, `crates/ikiru-rig/src/joint.rs`, `.ci/run`.\n"), []);
        assert_eq!(missing("\nSee `crates/gone/`.\n"), [named(2, "crates/gone/")]);
        assert_eq!(missing("`gone/`, `gone/x.rs`\n"), [named(1, "gone/"), named(1, "gone/x.rs")]);
        assert_eq!(missing("`crates/gone`\n"), [named(1, "crates/gone")]);
    }

    #[test]
    fn folder_must_not_be_a_file() {
        let tree = Sample::new(&[(MAP, "`.ci/run/`\n"), (".ci/run", "")]);
        let finding = Finding::new(MAP, 1, "names `.ci/run/`", "a folder that exists");
        assert_eq!(check(&tree.open()).unwrap(), [finding]);
    }

    #[test]
    fn other_code_is_no_path() {
        assert_eq!(
            missing("`m/s`, `a::b`, `cost / 2`, `crates/*/gone/`, `crates/NAME/x.rs`, `1/0.5`, `./x.glb`"),
            []
        );
    }

    #[test]
    fn drawn_tree_must_exist() {
        let map = "\
```text
ikiru/
├── crates/             in order:
│   ├── ikiru-rig/      skeleton
│   │   └── src/
│   │       └── joint.rs
│   └── gone/           what
├── lost/
└── examples/           01_reach.rs
```
";
        assert_eq!(missing(map), [named(7, "crates/gone/"), named(8, "lost/")]);
    }

    #[test]
    fn code_block_without_branches_is_no_tree() {
        assert_eq!(missing("```rust\nlet a = `gone/`;\n```\n`gone/`\n"), [named(4, "gone/")]);
    }
}
