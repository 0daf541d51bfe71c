//! The table of naming schemes, `schemes.txt`, as a map from names to what they may mean.

use std::collections::HashMap;
use std::sync::OnceLock;

use crate::humanoid::Role;

/// A convention of names.
pub(super) struct Scheme {
    pub(super) name: &'static str,
    pub(super) rules: Vec<Rule>,
}

/// A line of the table: names, and the role or roles that they stand for.
#[derive(Debug, PartialEq)]
pub(super) struct Rule {
    pub(super) roles: Vec<Role>,
    pub(super) pick: Pick,
}

/// Which of the joints that bear the names of a rule get its roles.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Pick {
    /// The one of the first name; for several roles, highest first.
    Named,
    /// The one nearest to the root.
    Highest,
    /// The one furthest from it.
    Lowest,
    /// As for several roles, but first, middle and last where there are more joints.
    Spread,
}

/// Where a name stands in the table.
#[derive(Clone, Copy)]
pub(super) struct Entry {
    pub(super) scheme: usize,
    pub(super) rule: usize,
    /// Position among the rule's names.
    pub(super) rank: usize,
}

#[derive(Default)]
pub(super) struct Table {
    pub(super) schemes: Vec<Scheme>,
    /// By normalised name.
    names: HashMap<String, Vec<Entry>>,
}

/// No name of the table is longer, normalised.
const LONGEST: usize = 64;

/// The table that comes with the library. That it can be read is tested.
pub(super) fn table() -> &'static Table {
    static TABLE: OnceLock<Table> = OnceLock::new();
    TABLE.get_or_init(|| Table::parse(include_str!("schemes.txt")).unwrap_or_default())
}

impl Table {
    /// What a name may mean; `scratch` saves an allocation for each name.
    pub(super) fn get(&self, name: &str, scratch: &mut String) -> &[Entry] {
        normalise(name, scratch);
        self.names.get(scratch.as_str()).map_or(&[], Vec::as_slice)
    }

    fn parse(text: &'static str) -> Result<Self, String> {
        let mut table = Self::default();
        let (mut prefixes, mut suffixes) = (vec![""], vec![""]);
        for (line, text) in text.lines().enumerate() {
            let fail = |what: &str| format!("line {}: {what}", line + 1);
            let words: Vec<&'static str> = text.split_whitespace().collect();
            match words.as_slice() {
                [] => {}
                [comment, ..] if comment.starts_with('#') => {}
                ["scheme", name] => {
                    table.schemes.push(Scheme { name, rules: Vec::new() });
                    (prefixes, suffixes) = (vec![""], vec![""]);
                }
                ["prefix", words @ ..] => prefixes.extend(words),
                ["suffix", words @ ..] => suffixes.extend(words),
                words => {
                    let (at, pick) = operator(words).ok_or_else(|| fail("no =, <, > or ~"))?;
                    let (roles, names) = (&words[..at], &words[at + 1..]);
                    if table.schemes.is_empty() || roles.is_empty() || names.is_empty() {
                        return Err(fail("expected a scheme before it, roles and names in it"));
                    }
                    let sided = roles[0].starts_with('*');
                    for side in if sided { &["left", "right"][..] } else { &[""] } {
                        let roles: Option<Vec<Role>> =
                            roles.iter().map(|role| Role::from_name(&role.replace('*', side))).collect();
                        let roles = roles.ok_or_else(|| fail("an unknown role"))?;
                        table.add(Rule { roles, pick }, side, names, &prefixes, &suffixes);
                    }
                }
            }
        }
        Ok(table)
    }

    fn add(&mut self, rule: Rule, side: &str, names: &[&str], prefixes: &[&str], suffixes: &[&str]) {
        let scheme = self.schemes.len() - 1;
        let rules = &mut self.schemes[scheme].rules;
        let entry = |rank| Entry { scheme, rule: rules.len(), rank };
        let mut key = String::new();
        for (rank, name) in names.iter().enumerate() {
            for name in sided(name, side) {
                for (prefix, suffix) in prefixes.iter().flat_map(|p| suffixes.iter().map(move |s| (p, s))) {
                    normalise(&format!("{prefix}{name}{suffix}"), &mut key);
                    self.names.entry(key.clone()).or_default().push(entry(rank));
                }
            }
        }
        rules.push(rule);
    }
}

fn operator(words: &[&str]) -> Option<(usize, Pick)> {
    words.iter().enumerate().find_map(|(at, word)| {
        let pick = match *word {
            "=" => Pick::Named,
            "<" => Pick::Highest,
            ">" => Pick::Lowest,
            "~" => Pick::Spread,
            _ => return None,
        };
        Some((at, pick))
    })
}

/// A name of the table for one side: every way to write it.
fn sided(name: &str, side: &str) -> Vec<String> {
    let letter = side.get(..1).unwrap_or_default();
    if side.is_empty() {
        vec![name.to_owned()]
    } else if name.contains(['*', '?']) {
        vec![name.replace('*', side).replace('?', letter)]
    } else {
        vec![
            format!("{side}{name}"),
            format!("{name}{side}"),
            format!("{letter}{name}"),
            format!("{name}{letter}"),
        ]
    }
}

/// A name without namespace, case and separators; empty where it is too long to stand in the table.
fn normalise(name: &str, out: &mut String) {
    out.clear();
    let name = name.rsplit([':', '|']).next().unwrap_or_default();
    for c in name.chars().filter(|c| c.is_alphanumeric()).flat_map(char::to_lowercase) {
        if out.len() >= LONGEST {
            out.clear();
            return;
        }
        out.push(c);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_table_can_be_read_and_no_scheme_gives_a_role_two_lines() {
        let table = Table::parse(include_str!("schemes.txt")).unwrap();
        assert_eq!(table.schemes.len(), 12);
        for scheme in &table.schemes {
            let mut roles: Vec<Role> = scheme.rules.iter().flat_map(|r| r.roles.iter().copied()).collect();
            let n_roles = roles.len();
            roles.sort();
            roles.dedup();
            assert_eq!(roles.len(), n_roles, "{}", scheme.name);
            for role in Role::REQUIRED {
                assert!(roles.contains(&role), "{} does not know {role}", scheme.name);
            }
        }
        assert!(table.names.keys().all(|name| !name.is_empty() && name.len() < LONGEST));
    }

    #[test]
    fn mistakes_in_a_table_are_found() {
        let message = |text| Table::parse(text).err().unwrap();
        assert_eq!(message("scheme a\nhips pelvis"), "line 2: no =, <, > or ~");
        assert_eq!(message("scheme a\ntail = tail"), "line 2: an unknown role");
        assert!(message("hips = pelvis").starts_with("line 1: expected a scheme"));
    }

    #[test]
    fn case_separators_and_namespaces_do_not_matter() {
        let of = |name| {
            let mut out = String::new();
            normalise(name, &mut out);
            out
        };
        for name in ["mixamorig1:LeftUpLeg", "left_up_leg", "Armature|Left UpLeg", "LEFT-UP.LEG"] {
            assert_eq!(of(name), "leftupleg");
        }
        assert_eq!(of(&"x".repeat(100)), "");
    }
}
