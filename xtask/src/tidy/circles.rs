//! Rule: files do not stand on each other in a circle: each can be read with only those that it names.
//!
//! What a file shows to others of those below it (`pub use`) is no use of them, and a name is the file's that has it, not that of
//! the one which shows it. What is compiled for tests alone may look at everything.

use std::collections::{BTreeMap, BTreeSet};

use anyhow::{Context, Result};

use super::paths::{CodePath, paths};
use super::{Finding, Project};

pub(super) fn check(project: &Project) -> Result<Vec<Finding>> {
    let mut findings = Vec::new();
    let name = |file: &String| match file.split('/').collect::<Vec<_>>()[..] {
        ["crates", name, "src", ..] => Some(name.to_owned()),
        _ => None,
    };
    let crates: BTreeSet<String> = project.files().iter().filter_map(name).collect();
    for name in crates {
        let files = CrateFiles::read(project, &format!("crates/{name}/src/"))?;
        let uses = files.uses();
        for circle in circles(&uses) {
            let way = circle.iter().map(|file| file.strip_prefix(&files.folder).unwrap_or(file));
            let way = way.collect::<Vec<_>>().join(" → ");
            let line = uses[circle[0]][circle[1]];
            let what = format!("files stand on each other: {way}");
            findings.push(Finding::new(circle[0], line, what, "no way back"));
        }
    }
    Ok(findings)
}

/// The files of a crate by the words of their modules, with the paths in them.
struct CrateFiles {
    folder: String,
    files: BTreeMap<Vec<String>, (String, Vec<CodePath>)>,
}

impl CrateFiles {
    fn read(project: &Project, folder: &str) -> Result<Self> {
        let mut files = BTreeMap::new();
        for file in project.files() {
            let Some(within) = file.strip_prefix(folder).and_then(|within| within.strip_suffix(".rs")) else {
                continue;
            };
            if within.ends_with("/tests") || within.ends_with("/cases") {
                continue;
            }
            let mut words: Vec<String> = within.split('/').map(str::to_owned).collect();
            if matches!(words.last().map(String::as_str), Some("mod" | "lib" | "main")) {
                words.pop();
            }
            let of_file = paths(&project.text(file)?).with_context(|| file.clone())?;
            files.insert(words, (file.clone(), of_file));
        }
        Ok(Self { folder: folder.to_owned(), files })
    }

    /// For each file those that it uses, with the line of the first use.
    fn uses(&self) -> BTreeMap<&str, BTreeMap<&str, usize>> {
        let mut uses = BTreeMap::new();
        for (module, (file, of_file)) in &self.files {
            let mut used = BTreeMap::new();
            for path in of_file.iter().filter(|path| path.shown_as.is_none()) {
                let Some(target) = self.file_of(module, &path.words, 0) else { continue };
                // The root only shows what the files have.
                if target != file && !target.ends_with("src/lib.rs") {
                    used.entry(target).or_insert(path.line);
                }
            }
            uses.insert(file.as_str(), used);
        }
        uses
    }

    /// The file that has what a path of a module leads to; `None` where that is none of the crate's.
    fn file_of(&self, module: &[String], words: &[String], depth: usize) -> Option<&str> {
        let (mut at, mut rest) = match words.first()?.as_str() {
            "crate" => (Vec::new(), &words[1..]),
            "self" => (module.to_vec(), &words[1..]),
            "super" => (module[..module.len().checked_sub(1)?].to_vec(), &words[1..]),
            own => {
                let inside: Vec<String> = module.iter().cloned().chain([own.to_owned()]).collect();
                self.files.get(&inside)?;
                (inside, &words[1..])
            }
        };
        while let Some(word) = rest.first() {
            if word == "super" {
                at.pop()?;
            } else {
                let inside: Vec<String> = at.iter().cloned().chain([word.clone()]).collect();
                if !self.files.contains_key(&inside) {
                    break;
                }
                at = inside;
            }
            rest = &rest[1..];
        }
        let (file, of_file) = self.files.get(&at)?;
        let shown = rest.first().and_then(|name| {
            let shown = of_file.iter().find(|path| path.shown_as.as_ref() == Some(name))?;
            (depth < 8).then(|| self.file_of(&at, &shown.words, depth + 1)).flatten()
        });
        Some(shown.unwrap_or(file))
    }
}

/// One circle for each knot of files that all lead to each other: its files in order, the first once more at the end.
fn circles<'a>(uses: &BTreeMap<&'a str, BTreeMap<&'a str, usize>>) -> Vec<Vec<&'a str>> {
    let mut circles = Vec::new();
    let mut told: BTreeSet<&str> = BTreeSet::new();
    for &start in uses.keys() {
        if told.contains(start) {
            continue;
        }
        if let Some(circle) = way_back(uses, start) {
            // The knot is told of once: all that this file leads to and that lead back to it.
            let knot = uses.keys().filter(|file| leads(uses, start, file) && leads(uses, file, start));
            told.extend(knot);
            circles.push(circle);
        }
    }
    circles
}

/// The shortest way from a file back to itself.
fn way_back<'a>(uses: &BTreeMap<&'a str, BTreeMap<&'a str, usize>>, start: &'a str) -> Option<Vec<&'a str>> {
    let mut ways = vec![vec![start]];
    let mut seen = BTreeSet::new();
    while !ways.is_empty() {
        let mut longer = Vec::new();
        for way in ways {
            for &next in uses.get(way[way.len() - 1])?.keys() {
                let mut way = way.clone();
                way.push(next);
                if next == start {
                    return Some(way);
                }
                if seen.insert(next) {
                    longer.push(way);
                }
            }
        }
        ways = longer;
    }
    None
}

/// Whether a file uses another, through others or not.
fn leads(uses: &BTreeMap<&str, BTreeMap<&str, usize>>, from: &str, to: &str) -> bool {
    let (mut seen, mut open) = (BTreeSet::new(), vec![from]);
    while let Some(file) = open.pop() {
        for &next in uses.get(file).into_iter().flat_map(BTreeMap::keys) {
            if next == to {
                return true;
            }
            if seen.insert(next) {
                open.push(next);
            }
        }
    }
    false
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::tidy::Tree;

    fn findings(files: &[(&str, &str)]) -> Vec<(String, usize, String)> {
        let named: Vec<(String, &str)> =
            files.iter().map(|(file, text)| (format!("crates/ikiru-scenario/src/{file}"), *text)).collect();
        let named: Vec<(&str, &str)> = named.iter().map(|(file, text)| (file.as_str(), *text)).collect();
        let found = check(&Tree::new(&named).open()).unwrap();
        found.into_iter().map(|finding| (finding.file, finding.line, finding.what)).collect()
    }

    fn circle(file: &str, line: usize, way: &str) -> (String, usize, String) {
        (format!("crates/ikiru-scenario/src/{file}"), line, format!("files stand on each other: {way}"))
    }

    #[test]
    fn a_circle_is_told_once_with_its_way() {
        let files = [
            ("a.rs", "//! A.\nuse std::fmt;\nuse crate::b::B;\n"),
            ("b.rs", "//! B.\nuse crate::{c::C, d::D};\n"),
            ("c.rs", "//! C.\nfn f() -> crate::a::A { todo!() }\n"),
            ("d.rs", "//! D.\n"),
        ];
        assert_eq!(findings(&files), [circle("a.rs", 3, "a.rs → b.rs → c.rs → a.rs")]);
        assert_eq!(findings(&files[..2]), []);
    }

    #[test]
    fn a_name_is_the_files_that_has_it() {
        let lib = ("lib.rs", "mod a;\nmod k;\npub use k::x::X;\n");
        // The folder shows `X`, which its file has: nothing is used of the folder's own file, which uses `y`.
        let folder = ("k/mod.rs", "mod x;\nmod y;\npub(crate) use x::{X as Z};\nuse y::Y;\npub struct K;\n");
        let y = ("k/y.rs", "use crate::k::Z;\nuse super::x::X;\nuse crate::X as W;\n");
        assert_eq!(findings(&[lib, folder, ("k/x.rs", "struct X;\n"), y]), []);
        let y = ("k/y.rs", "use super::K;\n");
        let expected = [circle("k/mod.rs", 4, "k/mod.rs → k/y.rs → k/mod.rs")];
        assert_eq!(findings(&[lib, folder, ("k/x.rs", ""), y]), expected);
    }

    #[test]
    fn every_crate_is_looked_at_by_itself() {
        let (a, b) = ("use crate::b::B;\n", "use crate::a::A;\n");
        for name in ["ikiru-rig", "ikiru-formats", "new"] {
            let [of_a, of_b] = ["a", "b"].map(|file| format!("crates/{name}/src/{file}.rs"));
            let found = check(&Tree::new(&[(&of_a, a), (&of_b, b)]).open()).unwrap();
            assert_eq!(found.iter().map(|finding| &finding.file).collect::<Vec<_>>(), [&of_a], "{name}");
        }
        let found = check(&Tree::new(&[("crates/x/src/a.rs", a), ("crates/y/src/b.rs", b)]).open()).unwrap();
        assert_eq!(found.len(), 0);
    }

    #[test]
    fn tests_and_comments_may_look_at_everything() {
        let files = [
            ("a.rs", "//! [`B`](crate::b::B)\n#[cfg(test)]\nmod tests {\n    use crate::b::B;\n}\n"),
            ("b.rs", "use crate::a::A;\n"),
            ("b/tests.rs", "use crate::b::B;\nuse crate::a::A;\n"),
        ];
        assert_eq!(findings(&files), []);
    }
}
