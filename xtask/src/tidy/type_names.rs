//! Rule: one public type, one name: whoever reads one knows which.

use std::collections::BTreeMap;

use anyhow::Result;

use super::{Finding, Project};

/// Names of several types, each one in its crate or module, by which it is then called. The files are those that may
/// have one; a line that is not needed any more is a finding.
const SHARED: [(&str, &[&str]); 6] = [
    // One for each library, as is usual.
    (
        "Error",
        &[
            "ikiru-eval/src/error.rs",
            "ikiru-formats/src/error.rs",
            "ikiru-ipopt/src/lib.rs",
            "ikiru-scenario/src/error.rs",
        ],
    ),
    ("ErrorKind", &["ikiru-formats/src/error.rs", "ikiru-scenario/src/error.rs"]),
    ("Warning", &["ikiru-formats/src/warning.rs", "ikiru-scenario/src/warning.rs"]),
    // One for each evaluation: `paper::Row`, `robots::Row`, `motions::Row`. And a solver's report.
    (
        "Report",
        &[
            "ikiru-eval/src/motions/report.rs",
            "ikiru-eval/src/paper/report.rs",
            "ikiru-eval/src/robots.rs",
            "ikiru-eval/src/track/report.rs",
            "ikiru-solve/src/report/mod.rs",
        ],
    ),
    (
        "Row",
        &[
            "ikiru-eval/src/motions/row.rs",
            "ikiru-eval/src/paper/run.rs",
            "ikiru-eval/src/robots.rs",
            "ikiru-eval/src/track/run.rs",
        ],
    ),
    (
        "Settings",
        &[
            "ikiru-eval/src/motions/run.rs",
            "ikiru-eval/src/paper/run.rs",
            "ikiru-eval/src/robots.rs",
            "ikiru-eval/src/track/run.rs",
        ],
    ),
];

const THIS: &str = "xtask/src/tidy/type_names.rs";

pub(super) fn check(project: &Project) -> Result<Vec<Finding>> {
    check_with(project, &SHARED)
}

fn check_with(project: &Project, shared: &[(&str, &[&str])]) -> Result<Vec<Finding>> {
    let types = public_types(project)?;
    let mut findings = Vec::new();
    for (name, places) in &types {
        let allowed = shared.iter().find(|(shared, _)| shared == name).map_or(&[][..], |(_, files)| files);
        let is_known = |file: &str| allowed.iter().any(|known| file.strip_prefix("crates/") == Some(known));
        let (first, _) = &places[0];
        for (file, line) in places.iter().skip(1).filter(|(file, _)| !is_known(file)) {
            let what = format!("a second public type `{name}`, beside that of {first}");
            findings.push(Finding::new(file, *line, what, "a name of its own"));
        }
    }
    // The list is this program's own: small projects in tests have none of it.
    if project.files().iter().any(|file| file == THIS) {
        for (name, files) in shared {
            let places = types.get(*name).map_or(&[][..], Vec::as_slice);
            let is_there =
                |known: &&str| places.iter().any(|(file, _)| file.strip_prefix("crates/") == Some(known));
            if let Some(gone) = files.iter().find(|known| files.len() < 2 || !is_there(known)) {
                let what = format!("`{name}` is listed for {gone}, which has none to tell apart");
                findings.push(Finding::new(THIS, 1, what, "no such entry"));
            }
        }
    }
    Ok(findings)
}

/// The public types of crates that are published, by name, each with its file and line.
fn public_types(project: &Project) -> Result<BTreeMap<String, Vec<(String, usize)>>> {
    let mut types: BTreeMap<String, Vec<(String, usize)>> = BTreeMap::new();
    for file in project.files() {
        let ["crates", name, "src", ..] = file.split('/').collect::<Vec<_>>()[..] else { continue };
        if !file.ends_with(".rs") || name == super::dependencies::TESTKIT {
            continue;
        }
        for (idx, line) in project.text(file)?.lines().enumerate() {
            if let Some(name) = public_type(line) {
                types.entry(name.to_owned()).or_default().push((file.clone(), idx + 1));
            }
        }
    }
    Ok(types)
}

/// The name that a line declares. What is public inside a module that is not shown is no type for others, but then the
/// compiler's lint `unreachable_pub` asks for `pub(crate)`.
fn public_type(line: &str) -> Option<&str> {
    let rest = line.trim_start().strip_prefix("pub ")?;
    let rest = rest.strip_prefix("unsafe ").unwrap_or(rest);
    let kinds = ["struct ", "enum ", "trait ", "union ", "type "];
    let name = kinds.iter().find_map(|kind| rest.strip_prefix(kind))?;
    name.split(|c: char| !c.is_alphanumeric() && c != '_').next().filter(|name| !name.is_empty())
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::tidy::Tree;

    const ROW: &str = "//! A.\npub struct Row<T>(T);\n";

    fn findings(files: &[(&str, &str)], shared: &[(&str, &[&str])]) -> Vec<(String, usize)> {
        let found = check_with(&Tree::new(files).open(), shared).unwrap();
        found.into_iter().map(|finding| (finding.file, finding.line)).collect()
    }

    #[test]
    fn a_second_public_type_of_a_name_is_refused() {
        for second in
            ["pub enum Row {", "    pub trait Row {", "pub type Row = u8;", "pub unsafe trait Row {}"]
        {
            let files = [
                ("crates/a/src/lib.rs", ROW),
                ("crates/b/src/deep/row.rs", &format!("//! B.\n\n{second}\n")),
            ];
            assert_eq!(findings(&files, &[]), [("crates/b/src/deep/row.rs".to_owned(), 3)], "{second}");
        }
    }

    #[test]
    fn what_others_do_not_see_may_be_called_anything() {
        for second in [
            "pub(crate) struct Row;",
            "struct Row;",
            "pub struct Rows;",
            "pub fn Row() {}",
            "pub use a::Row;",
        ] {
            let files = [("crates/a/src/lib.rs", ROW), ("crates/b/src/lib.rs", second)];
            assert_eq!(findings(&files, &[]), [], "{second}");
        }
        for file in ["crates/ikiru-testkit/src/lib.rs", "crates/b/tests/all/row.rs", "xtask/src/row.rs"] {
            assert_eq!(findings(&[("crates/a/src/lib.rs", ROW), (file, ROW)], &[]), [], "{file}");
        }
    }

    #[test]
    fn known_names_are_known_by_file_and_have_to_be_needed() {
        let (a, b, c) =
            (("crates/a/src/lib.rs", ROW), ("crates/b/src/lib.rs", ROW), ("crates/c/src/lib.rs", ROW));
        let known: [(&str, &[&str]); 1] = [("Row", &["a/src/lib.rs", "b/src/lib.rs"])];
        assert_eq!(findings(&[a, b, (THIS, "")], &known), []);
        assert_eq!(findings(&[a, b, c, (THIS, "")], &known), [("crates/c/src/lib.rs".to_owned(), 1 + 1)]);
        assert_eq!(findings(&[a, (THIS, "")], &known), [(THIS.to_owned(), 1)]);
    }
}
