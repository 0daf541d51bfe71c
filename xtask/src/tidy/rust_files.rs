//! Rule: a Rust file says in its first line what it is, and stays of a size that one can hold in mind.

use anyhow::Result;

use super::{Finding, Project};

/// More lines than this, tests not counted, are a warning.
const WARNING_LINES: usize = 500;
/// More lines than this, tests not counted, fail.
const MAX_LINES: usize = 800;

pub(super) fn check(project: &Project) -> Result<Vec<Finding>> {
    let mut findings = Vec::new();
    for file in project.files().iter().filter(|file| file.ends_with(".rs")) {
        let text = project.text(file)?;
        if !text.starts_with("//!") {
            let what = format!("begins with `{}`", text.lines().next().unwrap_or_default().trim_end());
            findings.push(Finding::new(file, 1, what, "a `//!` line that says what the file is"));
        }
        let n_lines = lines_without_tests(&text);
        let what = format!("{n_lines} lines without its tests");
        if n_lines > MAX_LINES {
            findings.push(Finding::new(
                file,
                n_lines,
                what,
                format!("at most {MAX_LINES}: split it by idea"),
            ));
        } else if n_lines > WARNING_LINES {
            findings.push(Finding::new(file, n_lines, what, format!("at most {WARNING_LINES}")).warning());
        }
    }
    Ok(findings)
}

/// Counts lines, leaving out each `#[cfg(test)] mod tests { … }`. It ends at the first line that is `}` alone,
/// unindented: the formatter puts it there.
fn lines_without_tests(text: &str) -> usize {
    let lines: Vec<&str> = text.lines().collect();
    let mut n_lines = 0;
    let mut idx = 0;
    while idx < lines.len() {
        let opens = lines[idx] == "#[cfg(test)]"
            && lines[idx + 1..]
                .iter()
                .find(|line| !line.starts_with("#["))
                .is_some_and(|line| line.starts_with("mod tests {"));
        if opens {
            let end = lines[idx..].iter().position(|line| *line == "}");
            idx = end.map_or(lines.len(), |end| idx + end + 1);
        } else {
            n_lines += 1;
            idx += 1;
        }
    }
    n_lines
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::tidy::Tree;

    fn findings(text: &str) -> Vec<Finding> {
        check(&Tree::new(&[("crates/a/src/lib.rs", text)]).open()).unwrap()
    }

    fn sized(n_lines: usize) -> String {
        format!("//! Head.\n{}", "fn f() {}\n".repeat(n_lines - 1))
    }

    #[test]
    fn head_is_demanded() {
        assert_eq!(findings("//! A file.\n"), []);
        for text in ["use a;\n//! Late.\n", "// Plain.\n", "/// Item.\n", "\n//! Second line.\n", ""] {
            let found = findings(text);
            assert_eq!(found.len(), 1, "{text:?}");
            assert_eq!((found[0].line, found[0].fails), (1, true), "{text:?}");
        }
    }

    #[test]
    fn other_files_need_no_head() {
        assert_eq!(check(&Tree::new(&[("README.md", "# Title\n")]).open()).unwrap(), []);
    }

    #[test]
    fn long_is_a_warning_and_longer_fails() {
        assert_eq!(findings(&sized(500)), []);
        let outcomes =
            |n_lines| findings(&sized(n_lines)).iter().map(|found| found.fails).collect::<Vec<_>>();
        assert_eq!(outcomes(501), [false]);
        assert_eq!(outcomes(800), [false]);
        assert_eq!(outcomes(801), [true]);
    }

    #[test]
    fn tests_are_not_counted_and_what_follows_them_is() {
        let tests = format!("\n#[cfg(test)]\n#[allow(x)]\nmod tests {{\n{}}}\n", "    f();\n".repeat(900));
        assert_eq!(findings(&(sized(400) + &tests)), []);
        assert_eq!(findings(&(sized(400) + &tests + &sized(300))).len(), 1);
        // A test helper outside of `mod tests` counts.
        assert_eq!(lines_without_tests("#[cfg(test)]\nfn helper() {\n}\n"), 3);
    }
}
