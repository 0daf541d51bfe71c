//! Rule: crates depend downwards only, and every dependency on foreign code says why it is there.

use anyhow::{Result, anyhow};
use toml::de::{DeTable, DeValue};

use super::{Finding, Project};

/// Each crate may depend on crates before it.
const ORDER: [&str; 8] = [
    "ikiru-rig",
    "ikiru-solve",
    "ikiru-ipopt",
    "ikiru-formats",
    "ikiru-scenario",
    "ikiru",
    "ikiru-eval",
    "ikiru-cli",
];

/// Crate and dependency that the order would allow, but that are strangers by design.
const STRANGERS: [(&str, &str); 1] = [("ikiru-formats", "ikiru-solve")];

/// For tests alone.
pub(super) const TESTKIT: &str = "ikiru-testkit";

pub(super) fn check(project: &Project) -> Result<Vec<Finding>> {
    let mut findings = Vec::new();
    for file in project.files() {
        let folders: Vec<&str> = file.split('/').collect();
        let is_member = matches!(folders[..], ["crates", _, "Cargo.toml"] | ["xtask", "Cargo.toml"]);
        if is_member || file == "Cargo.toml" {
            let text = project.text(file)?;
            let table = DeTable::parse(&text).map_err(|error| anyhow!("{file}: {error}"))?;
            let manifest = Manifest { file, text: &text, table: table.get_ref() };
            if is_member {
                manifest.check_order(&mut findings);
            }
            manifest.check_reasons(&mut findings);
        }
    }
    Ok(findings)
}

struct Manifest<'a> {
    file: &'a str,
    text: &'a str,
    table: &'a DeTable<'a>,
}

/// A dependency: the table that names it, its name there, its package, its place and what is said of it.
struct Dependency<'a> {
    table: String,
    key: &'a str,
    package: &'a str,
    start: usize,
    end: usize,
    value: &'a DeValue<'a>,
}

impl Manifest<'_> {
    fn check_order(&self, findings: &mut Vec<Finding>) {
        let package = table(self.table, "package").and_then(|package| package.get("name"));
        let name = package.and_then(|name| name.get_ref().as_str()).unwrap_or_default();
        let place = ORDER.iter().position(|crate_name| *crate_name == name);
        if place.is_none() && self.file.starts_with("crates/") && name != TESTKIT {
            let what = format!("crate `{name}` has no place in the order of dependency");
            findings.push(Finding::new(self.file, 1, what, "one in xtask/src/tidy/dependencies.rs"));
        }
        for Dependency { table, package, start, .. } in self.dependencies() {
            if table == "dev-dependencies" {
                continue;
            }
            let line = self.line(start);
            if package == TESTKIT {
                let what = format!("`{name}` has `{package}` in [{table}]");
                findings.push(Finding::new(self.file, line, what, "it in [dev-dependencies] only"));
                continue;
            }
            let (Some(place), true) = (place, package.starts_with("ikiru")) else { continue };
            let is_earlier = ORDER[..place].contains(&package);
            if !is_earlier || STRANGERS.contains(&(name, package)) {
                let allowed: Vec<&str> = ORDER[..place]
                    .iter()
                    .copied()
                    .filter(|other| !STRANGERS.contains(&(name, *other)))
                    .collect();
                let expected = match &allowed[..] {
                    [] => String::from("no crate of the project"),
                    allowed => format!("of the project's crates only {}", allowed.join(", ")),
                };
                findings.push(Finding::new(
                    self.file,
                    line,
                    format!("`{name}` depends on `{package}`"),
                    expected,
                ));
            }
        }
    }

    fn check_reasons(&self, findings: &mut Vec<Finding>) {
        for dependency in self.dependencies() {
            let names_a_version = match dependency.value {
                DeValue::Table(table) => !table.contains_key("path") && !table.contains_key("workspace"),
                _ => true,
            };
            if names_a_version && !self.has_comment(&dependency) {
                let Dependency { table, key, start, .. } = dependency;
                let what = format!("`{key}` in [{table}] has no reason");
                findings.push(Finding::new(
                    self.file,
                    self.line(start),
                    what,
                    "a comment with why it is there",
                ));
            }
        }
    }

    /// A comment behind it, or as the line before it.
    fn has_comment(&self, dependency: &Dependency<'_>) -> bool {
        let is_comment = |text: &str| text.trim().strip_prefix('#').is_some_and(|why| !why.trim().is_empty());
        let behind = self.text[dependency.end..].lines().next().unwrap_or_default();
        let start_of_line = self.text[..dependency.start].rfind('\n').unwrap_or(0);
        let line_before = self.text[..start_of_line].lines().next_back().unwrap_or_default();
        is_comment(behind) || is_comment(line_before)
    }

    fn line(&self, offset: usize) -> usize {
        self.text[..offset].matches('\n').count() + 1
    }

    /// All dependencies of all kinds: the crate's, the workspace's, and those of one platform alone.
    fn dependencies(&self) -> Vec<Dependency<'_>> {
        const TABLES: [&str; 3] = ["dependencies", "build-dependencies", "dev-dependencies"];
        let mut holders = vec![("", self.table)];
        holders.extend(table(self.table, "workspace").map(|workspace| ("workspace.", workspace)));
        for platform in table(self.table, "target").into_iter().flat_map(DeTable::values) {
            holders.extend(platform.get_ref().as_table().map(|holder| ("", holder)));
        }
        let mut dependencies = Vec::new();
        for (prefix, holder) in holders {
            for kind in TABLES {
                for (key, value) in table(holder, kind).into_iter().flatten() {
                    let renamed =
                        value.get_ref().get("package").and_then(|package| package.get_ref().as_str());
                    dependencies.push(Dependency {
                        table: format!("{prefix}{kind}"),
                        key: key.get_ref(),
                        package: renamed.unwrap_or(key.get_ref()),
                        start: key.span().start,
                        end: value.span().end,
                        value: value.get_ref(),
                    });
                }
            }
        }
        dependencies
    }
}

fn table<'a>(table: &'a DeTable<'a>, key: &str) -> Option<&'a DeTable<'a>> {
    table.get(key)?.get_ref().as_table()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::tidy::Tree;

    fn findings(name: &str, rest: &str) -> Vec<(usize, String)> {
        let manifest = format!("[package]\nname = \"{name}\"\n{rest}");
        let tree = Tree::new(&[(&format!("crates/{name}/Cargo.toml"), &manifest)]);
        check(&tree.open()).unwrap().into_iter().map(|finding| (finding.line, finding.what)).collect()
    }

    fn depends(line: usize, name: &str, package: &str) -> Vec<(usize, String)> {
        vec![(line, format!("`{name}` depends on `{package}`"))]
    }

    #[test]
    fn order_is_held_for_every_pair() {
        for (idx, name) in ORDER.iter().enumerate() {
            for (other, package) in ORDER.iter().enumerate() {
                let strangers = [("ikiru-formats", "ikiru-solve"), ("ikiru-solve", "ikiru-formats")];
                let allowed = other < idx && !strangers.contains(&(*name, *package));
                let found = findings(name, &format!("[dependencies]\n{package}.workspace = true\n"));
                assert_eq!(
                    found,
                    if allowed { vec![] } else { depends(4, name, package) },
                    "{name} {package}"
                );
            }
        }
    }

    #[test]
    fn order_is_held_in_every_table_but_that_of_tests() {
        let upward = |table: &str| findings("ikiru-rig", &format!("[{table}]\nikiru-cli.workspace = true\n"));
        assert_eq!(upward("build-dependencies"), depends(4, "ikiru-rig", "ikiru-cli"));
        assert_eq!(upward("target.'cfg(unix)'.dependencies"), depends(4, "ikiru-rig", "ikiru-cli"));
        assert_eq!(upward("target.'cfg(unix)'.build-dependencies"), depends(4, "ikiru-rig", "ikiru-cli"));
        assert_eq!(upward("dev-dependencies"), []);
    }

    #[test]
    fn renaming_hides_nothing() {
        let renamed = "[dependencies]\nother = { path = \"../x\", package = \"ikiru-cli\" }\n";
        assert_eq!(findings("ikiru-rig", renamed), depends(4, "ikiru-rig", "ikiru-cli"));
    }

    #[test]
    fn testkit_is_for_tests_alone() {
        let uses =
            |table: &str| findings("ikiru-cli", &format!("[{table}]\nikiru-testkit.workspace = true\n"));
        assert_eq!(uses("dev-dependencies"), []);
        for table in ["dependencies", "build-dependencies"] {
            assert_eq!(uses(table), [(4, format!("`ikiru-cli` has `ikiru-testkit` in [{table}]"))]);
        }
        assert_eq!(findings(TESTKIT, "[dependencies]\nikiru-solve.workspace = true\n"), []);
    }

    #[test]
    fn new_crate_needs_a_place() {
        let what = "crate `ikiru-new` has no place in the order of dependency";
        assert_eq!(findings("ikiru-new", ""), [(1, String::from(what))]);
    }

    #[test]
    fn foreign_dependency_needs_a_reason() {
        let lines = |text: &str| {
            let tree = Tree::new(&[("Cargo.toml", text)]);
            check(&tree.open()).unwrap().into_iter().map(|finding| finding.line).collect::<Vec<usize>>()
        };
        let head = "[workspace.dependencies]\n";
        let no_lines: [usize; 0] = [];
        assert_eq!(lines(&format!("{head}glam = \"0.34\" # vectors\n")), no_lines);
        assert_eq!(lines(&format!("{head}# vectors\nglam = \"0.34\"\n")), no_lines);
        assert_eq!(
            lines(&format!("{head}glam = {{ version = \"1\", features = [\"#a\"] }}  # vectors\n")),
            no_lines
        );
        assert_eq!(
            lines(&format!("{head}own = {{ path = \"crates/own\", version = \"0.1.0\" }}\n")),
            no_lines
        );
        assert_eq!(lines(&format!("{head}a = \"1\" # why\nglam = \"0.34\"\n")), [3]);
        assert_eq!(lines(&format!("{head}glam = {{ version = \"1\", features = [\"# a\"] }}\n")), [2]);
        assert_eq!(lines(&format!("{head}glam = \"0.34\" #\n")), [2]);
        assert_eq!(lines(&format!("{head}glam = \"0.34\"\n# of the next\nb = \"1\"\n")), [2]);
        assert_eq!(lines("[workspace.dependencies.glam]\nversion = \"1\"\n"), [1]);
    }

    #[test]
    fn version_in_a_crate_needs_a_reason_too() {
        let what = String::from("`glam` in [dependencies] has no reason");
        assert_eq!(findings("ikiru-rig", "[dependencies]\nglam = \"0.34\"\n"), [(4, what)]);
        assert_eq!(findings("ikiru-rig", "[dependencies]\nglam = \"0.34\" # vectors\n"), []);
        assert_eq!(findings("ikiru-rig", "[dependencies]\nglam.workspace = true\n"), []);
    }
}
