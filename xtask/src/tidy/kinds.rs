//! Rule: a kind of objective is two files of its own, and is named in two lists: that of the solver's objectives and that of
//! the scenario's kinds. Whatever else names one would have to learn every new one.

use std::collections::BTreeSet;

use anyhow::Result;
use proc_macro2::{TokenStream, TokenTree};
use syn::visit::{self, Visit};
use syn::{ItemFn, ItemMod, LitStr};

use super::code::{is_for_tests, sources};
use super::{Finding, Project};

const SOLVER: &str = "crates/ikiru-solve/src/objectives/";
const SCENARIO: &str = "crates/ikiru-scenario/src/kinds/";

/// Words that are kinds' names and mean something else where they stand. A line that is not needed any more is a finding.
const OTHER_WORDS: [(&str, &str); 4] = [
    ("crates/ikiru-cli/src/json.rs", "pose"), // the pose that was found
    ("crates/ikiru-cli/src/commands/inspect/json.rs", "position"), // of a joint at rest
    ("crates/ikiru-cli/src/commands/inspect/text.rs", "position"), // a column's head
    ("crates/ikiru-formats/src/vrm/animation.rs", "pose"), // a clip's name
];

const THIS: &str = "xtask/src/tidy/kinds.rs";

pub(super) fn check(project: &Project) -> Result<Vec<Finding>> {
    check_with(project, &OTHER_WORDS)
}

fn check_with(project: &Project, other_words: &[(&str, &str)]) -> Result<Vec<Finding>> {
    let mut findings = Vec::new();
    let kinds = files_of(project, SCENARIO, &["impl KindKeys for"])?;
    let objectives = files_of(project, SOLVER, &["impl Objective for", "impl Residual for"])?;
    for (kind, has, lacks) in kinds
        .difference(&objectives)
        .map(|kind| (kind, SCENARIO, SOLVER))
        .chain(objectives.difference(&kinds).map(|kind| (kind, SOLVER, SCENARIO)))
    {
        let what = format!("there is no {lacks}{kind}.rs");
        findings.push(Finding::new(
            &format!("{has}{kind}.rs"),
            1,
            what,
            "a file for the kind on either side",
        ));
    }
    for (folder, kinds) in [(SCENARIO, &kinds), (SOLVER, &objectives)] {
        check_list(project, folder, kinds, &mut findings)?;
    }
    let mut used = BTreeSet::new();
    let words: Vec<String> = kinds.iter().cloned().collect();
    for source in sources(project, &words)? {
        if source.file.starts_with(SCENARIO) || source.file.starts_with(SOLVER) {
            continue;
        }
        let mut names = Names { kinds: &kinds, found: Vec::new() };
        names.visit_file(&source.tree);
        for (line, kind) in names.found {
            if let Some(known) =
                other_words.iter().find(|known| **known == (source.file.as_str(), kind.as_str()))
            {
                used.insert(*known);
                continue;
            }
            let what = format!("names the kind `{kind}`");
            findings.push(Finding::new(
                &source.file,
                line,
                what,
                "what holds for every kind, or the kind's own file",
            ));
        }
    }
    // The list is this program's own: small projects in tests have none of it.
    if project.files().iter().any(|file| file == THIS) {
        for (file, word) in other_words.iter().filter(|known| !used.contains(*known)) {
            let what = format!("`{word}` is listed for {file}, which does not have it");
            findings.push(Finding::new(THIS, 1, what, "no such entry"));
        }
    }
    Ok(findings)
}

/// The files of a folder that hold one of some words, without their ending.
fn files_of(project: &Project, folder: &str, words: &[&str]) -> Result<BTreeSet<String>> {
    let mut names = BTreeSet::new();
    for file in project.files() {
        let name = file.strip_prefix(folder).and_then(|name| name.strip_suffix(".rs"));
        let Some(name) = name.filter(|name| *name != "mod" && !name.contains('/')) else { continue };
        let text = project.text(file)?;
        if words.iter().any(|words| text.contains(words)) {
            names.insert(name.to_owned());
        }
    }
    Ok(names)
}

/// A list has each kind once: a line for its file, and one for what comes out of it.
fn check_list(
    project: &Project,
    folder: &str,
    kinds: &BTreeSet<String>,
    findings: &mut Vec<Finding>,
) -> Result<()> {
    if kinds.is_empty() {
        return Ok(());
    }
    let list = format!("{folder}mod.rs");
    let text = project.text(&list)?;
    let code = |line: &&str| !line.trim_start().starts_with("//");
    for kind in kinds {
        let (module, path) = (format!("mod {kind};"), format!("{kind}::"));
        let count =
            |is_it: &dyn Fn(&str) -> bool| text.lines().filter(code).filter(|line| is_it(line)).count();
        let modules = count(&|line| line.trim_end().ends_with(&module));
        let is_path = |line: &str| {
            line.match_indices(&path)
                .any(|(at, _)| !line[..at].ends_with(|c: char| c.is_alphanumeric() || c == '_'))
        };
        let lines = count(&is_path);
        if (modules, lines) != (1, 1) {
            let what =
                format!("`{kind}` stands in {modules} lines as a file and in {lines} lines of the list");
            findings.push(Finding::new(&list, 1, what, "one of each"));
        }
    }
    Ok(())
}

/// Looks for kinds' names in a file's code: as strings, and as modules.
struct Names<'a> {
    kinds: &'a BTreeSet<String>,
    found: Vec<(usize, String)>,
}

impl Names<'_> {
    fn look_at(&mut self, word: &str, line: usize) {
        if self.kinds.contains(word) {
            self.found.push((line, word.to_owned()));
        }
    }

    /// What a macro is given is not parsed: its strings are looked at all the same.
    fn look_into(&mut self, tokens: TokenStream) {
        for token in tokens {
            match token {
                TokenTree::Group(group) => self.look_into(group.stream()),
                TokenTree::Literal(literal) => {
                    let line = literal.span().start().line;
                    if let Ok(text) = syn::parse_str::<LitStr>(&literal.to_string()) {
                        self.look_at(&text.value(), line);
                    }
                }
                TokenTree::Ident(_) | TokenTree::Punct(_) => {}
            }
        }
    }
}

impl<'ast> Visit<'ast> for Names<'_> {
    fn visit_item_mod(&mut self, item: &'ast ItemMod) {
        if !is_for_tests(&item.attrs) {
            visit::visit_item_mod(self, item);
        }
    }

    fn visit_item_fn(&mut self, item: &'ast ItemFn) {
        if !is_for_tests(&item.attrs) {
            visit::visit_item_fn(self, item);
        }
    }

    fn visit_attribute(&mut self, _: &'ast syn::Attribute) {
        // Documentation may name what it likes.
    }

    fn visit_lit_str(&mut self, text: &'ast LitStr) {
        self.look_at(&text.value(), text.span().start().line);
    }

    fn visit_macro(&mut self, item: &'ast syn::Macro) {
        self.look_into(item.tokens.clone());
    }

    fn visit_path(&mut self, path: &'ast syn::Path) {
        let segments: Vec<&syn::Ident> = path.segments.iter().map(|segment| &segment.ident).collect();
        for pair in segments.windows(2) {
            if pair[0] == "objectives" || pair[0] == "kinds" {
                self.look_at(&pair[1].to_string(), pair[1].span().start().line);
            }
        }
        visit::visit_path(self, path);
    }

    fn visit_use_path(&mut self, item: &'ast syn::UsePath) {
        if let (true, syn::UseTree::Path(next)) =
            (item.ident == "objectives" || item.ident == "kinds", &*item.tree)
        {
            self.look_at(&next.ident.to_string(), next.ident.span().start().line);
        }
        visit::visit_use_path(self, item);
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::tidy::Tree;

    const KIND: &str = "//! A.\nimpl KindKeys for AKeys {}\nconst NAME: &str = \"gaze\";\n";
    const OBJECTIVE: &str = "//! A.\nimpl Objective for A {}\nfn kind() { \"gaze\" }\n";
    const KINDS: &str = "//! A.\nmod gaze;\nkinds! {\n    Gaze(gaze::GazeKeys),\n}\n";
    const OBJECTIVES: &str = "//! A.\nmod gaze;\nmod helper;\n\npub use gaze::Gaze;\n";

    /// A project with one kind, and more files, some of which may take the place of its own.
    fn found(more: &[(&str, &str)], other_words: &[(&str, &str)]) -> Vec<(String, usize)> {
        let own = [
            ("crates/ikiru-scenario/src/kinds/gaze.rs", KIND),
            ("crates/ikiru-scenario/src/kinds/mod.rs", KINDS),
            ("crates/ikiru-solve/src/objectives/gaze.rs", OBJECTIVE),
            ("crates/ikiru-solve/src/objectives/mod.rs", OBJECTIVES),
            ("crates/ikiru-solve/src/objectives/helper.rs", "//! A.\n"),
        ];
        let files: Vec<(&str, &str)> = own.iter().chain(more).copied().collect();
        let findings = check_with(&Tree::new(&files).open(), other_words).unwrap();
        findings.into_iter().map(|finding| (finding.file, finding.line)).collect()
    }

    const OTHER: &str = "crates/ikiru-cli/src/report.rs";

    #[test]
    fn two_files_and_two_lists_are_fine() {
        assert_eq!(found(&[], &[]), []);
        let nothing = "//! Has `gaze`.\n/// \"gaze\"\nconst A: &str = \"gazelle\"; // \"gaze\"\nuse objectives::Gaze;\n\
                       #[cfg(test)]\nmod tests {\n    const B: &str = \"gaze\";\n}\n";
        assert_eq!(
            found(&[(OTHER, nothing), ("crates/ikiru-cli/tests/all/a.rs", "const A: &str = \"gaze\";")], &[]),
            []
        );
    }

    #[test]
    fn who_else_names_a_kind_is_found() {
        for line in [
            "fn f() { match kind { \"gaze\" => 1, _ => 2 } }",
            "fn f() { matches!(kind, \"gaze\") }",
            "fn f() { json!({ \"a\": [\"gaze\"] }) }",
            "use ikiru_solve::objectives::gaze::Gaze;",
            "use ikiru_scenario::{kinds::gaze::GazeKeys, Error};",
            "fn f() { crate::objectives::gaze::helper() }",
        ] {
            assert_eq!(
                found(&[(OTHER, &format!("//! A.\n{line}\n"))], &[]),
                [(OTHER.to_owned(), 2)],
                "{line}"
            );
        }
    }

    #[test]
    fn a_kind_has_a_file_and_a_line_on_either_side() {
        let scenario = "crates/ikiru-scenario/src/kinds/nod.rs";
        let solver = "crates/ikiru-solve/src/objectives/nod.rs";
        let of = |file: &str| (file.to_owned(), 1);
        let lists = ["crates/ikiru-scenario/src/kinds/mod.rs", "crates/ikiru-solve/src/objectives/mod.rs"];
        assert_eq!(found(&[(scenario, KIND)], &[]), [of(scenario), of(lists[0])]);
        assert_eq!(found(&[(solver, OBJECTIVE)], &[]), [of(solver), of(lists[1])]);
        let both = [(scenario, KIND), (solver, OBJECTIVE)];
        assert_eq!(found(&both, &[]), [of(lists[0]), of(lists[1])]);
        let twice = KINDS.replace("Gaze(gaze::GazeKeys),", "Gaze(gaze::GazeKeys),\n    A(gaze::A),");
        assert_eq!(found(&[(lists[0], &twice)], &[]), [of(lists[0])]);
    }

    #[test]
    fn words_that_mean_something_else_are_known_by_file_and_have_to_be_needed() {
        let column = (OTHER, "//! A.\nconst HEAD: &str = \"gaze\";\n");
        assert_eq!(found(&[column, (THIS, "")], &[(OTHER, "gaze")]), []);
        assert_eq!(found(&[(THIS, "")], &[(OTHER, "gaze")]), [(THIS.to_owned(), 1)]);
    }
}
