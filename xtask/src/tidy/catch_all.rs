//! Rule: a `match` over how joints move, or over kinds of objectives, has an arm for each. Whoever adds one is then shown by the
//! compiler every place that has to learn it; behind a `_` it would silently be treated as something else.

use anyhow::Result;
use syn::visit::{self, Visit};
use syn::{Expr, ExprMatch, ItemFn, ItemImpl, ItemMod, Pat, Type};

use super::code::{is_for_tests, sources};
use super::{Finding, Project};

/// The enums, and the crates in which the name means them.
const ENUMS: [(&str, &[&str]); 2] = [
    (
        "JointMotion",
        &[
            "ikiru-rig",
            "ikiru-solve",
            "ikiru-formats",
            "ikiru-scenario",
            "ikiru",
            "ikiru-eval",
            "ikiru-cli",
            "ikiru-testkit",
        ],
    ),
    ("Kind", &["ikiru-scenario", "ikiru", "ikiru-eval", "ikiru-cli"]),
];

pub(super) fn check(project: &Project) -> Result<Vec<Finding>> {
    let mut findings = Vec::new();
    let words: Vec<String> = ENUMS.iter().map(|(name, _)| (*name).to_owned()).collect();
    for source in sources(project, &words)? {
        let krate = source.file.split('/').nth(1).unwrap_or_default();
        let enums = ENUMS.iter().filter(|(_, crates)| crates.contains(&krate)).map(|(name, _)| *name);
        let mut matches =
            Matches { file: &source.file, enums: enums.collect(), own: None, findings: &mut findings };
        matches.visit_file(&source.tree);
    }
    Ok(findings)
}

/// Looks at every `match` of a file.
struct Matches<'a> {
    file: &'a str,
    enums: Vec<&'static str>,
    /// What `Self` is, inside the methods of one of the enums.
    own: Option<&'static str>,
    findings: &'a mut Vec<Finding>,
}

impl Matches<'_> {
    /// The enum of which a pattern names a variant.
    fn enum_in(&self, pattern: &Pat) -> Option<&'static str> {
        let mut paths = Paths { matches: self, found: None };
        paths.visit_pat(pattern);
        paths.found
    }
}

impl<'ast> Visit<'ast> for Matches<'_> {
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

    fn visit_item_impl(&mut self, item: &'ast ItemImpl) {
        let outer = self.own;
        if let Type::Path(path) = &*item.self_ty {
            self.own = self.enums.iter().find(|name| path.path.is_ident(**name)).copied();
        }
        visit::visit_item_impl(self, item);
        self.own = outer;
    }

    fn visit_expr_match(&mut self, item: &'ast ExprMatch) {
        if let Some(name) = item.arms.iter().find_map(|arm| self.enum_in(&arm.pat)) {
            for arm in item.arms.iter().filter(|arm| takes_everything(&arm.pat)) {
                let line = arm.fat_arrow_token.spans[0].start().line;
                let what = format!("an arm takes what is left of a match over `{name}`");
                self.findings.push(Finding::new(self.file, line, what, "an arm for each variant"));
            }
        }
        visit::visit_expr_match(self, item);
    }
}

/// Looks for a variant of one of the enums in a pattern.
struct Paths<'a, 'b> {
    matches: &'a Matches<'b>,
    found: Option<&'static str>,
}

impl<'ast> Visit<'ast> for Paths<'_, '_> {
    fn visit_path(&mut self, path: &'ast syn::Path) {
        let before_last = path.segments.iter().rev().nth(1);
        if let Some(segment) = before_last {
            let own = self.matches.own.filter(|_| segment.ident == "Self");
            let named = self.matches.enums.iter().find(|name| segment.ident == **name).copied();
            self.found = self.found.or(named).or(own);
        }
    }

    fn visit_expr(&mut self, _: &'ast Expr) {
        // Constants in patterns are no variants.
    }
}

/// Whether a pattern refuses nothing: `_`, a name, or tuples and references of such.
fn takes_everything(pattern: &Pat) -> bool {
    match pattern {
        Pat::Wild(_) => true,
        Pat::Ident(name) => {
            // A constant is written in capitals, as are variants that were imported.
            let is_binding = name.ident.to_string().starts_with(|c: char| c.is_lowercase() || c == '_');
            is_binding && name.subpat.as_ref().is_none_or(|(_, inner)| takes_everything(inner))
        }
        Pat::Tuple(tuple) => tuple.elems.iter().all(takes_everything),
        Pat::Reference(reference) => takes_everything(&reference.pat),
        Pat::Paren(inner) => takes_everything(&inner.pat),
        _ => false,
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::tidy::Tree;

    fn lines(file: &str, body: &str) -> Vec<usize> {
        let text = format!("//! A.\nfn f() {{\n    match x {{\n{body}    }}\n}}\n");
        let found = check(&Tree::new(&[(file, &text)]).open()).unwrap();
        found.iter().map(|finding| finding.line).collect()
    }

    const SOLVE: &str = "crates/ikiru-solve/src/a.rs";

    #[test]
    fn what_takes_the_rest_is_refused() {
        for rest in ["_", "other", "(_, _)", "&_", "_all", "(a, b)", "x @ _"] {
            let body = format!("        JointMotion::Fixed => 1,\n        {rest} => 2,\n");
            assert_eq!(lines(SOLVE, &body), [5], "{rest}");
        }
        for first in [
            "Some(JointMotion::Ball { .. })",
            "(JointMotion::Fixed, 1)",
            "ikiru_rig::JointMotion::Fixed | _x",
        ] {
            let body = format!("        {first} => 1,\n        None => 3,\n        _ => 2,\n");
            assert_eq!(lines(SOLVE, &body), [6], "{first}");
        }
    }

    #[test]
    fn what_names_each_or_asks_before_is_fine() {
        for rest in ["_ if y", "JointMotion::Ball { .. }", "(JointMotion::Ball { .. }, _)", "OTHER", "None"] {
            let body = format!("        JointMotion::Fixed => 1,\n        {rest} => 2,\n");
            assert_eq!(lines(SOLVE, &body), [0; 0], "{rest}");
        }
        // Another enum may have a rest, whatever its arms do.
        assert_eq!(
            lines(SOLVE, "        Other::Fixed => JointMotion::Fixed,\n        _ => JointMotion::BALL,\n"),
            [0; 0]
        );
    }

    #[test]
    fn kinds_are_meant_where_scenarios_are_known() {
        let body = "        Kind::Position(_) => 1,\n        _ => 2,\n";
        assert_eq!(lines("crates/ikiru-cli/src/a.rs", body), [5]);
        assert_eq!(lines("crates/ikiru-scenario/src/kinds/a.rs", body), [5]);
        assert_eq!(lines("crates/ikiru-formats/src/a.rs", body), [0; 0]);
        assert_eq!(lines("crates/ikiru-cli/tests/all/a.rs", body), [0; 0]);
    }

    #[test]
    fn methods_of_the_enum_itself_are_looked_at_and_tests_are_not() {
        let text = "//! JointMotion.\nimpl JointMotion {\n    fn f(self) {\n        match self {\n            \
                    Self::Fixed => 1,\n            _ => 2,\n        };\n    }\n}\nimpl Other {\n    fn f(self) {\n        \
                    match self {\n            Self::Fixed => 1,\n            _ => 2,\n        };\n    }\n}\n\
                    #[cfg(test)]\nmod tests {\n    fn f() {\n        match x {\n            JointMotion::Fixed => 1,\n            \
                    _ => 2,\n        }\n    }\n}\n";
        let found = check(&Tree::new(&[("crates/ikiru-rig/src/joint.rs", text)]).open()).unwrap();
        assert_eq!(found.iter().map(|finding| finding.line).collect::<Vec<_>>(), [6]);
    }
}
