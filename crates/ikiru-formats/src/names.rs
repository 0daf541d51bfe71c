//! New names for joints that cannot keep their own: `NAME_2`, `NAME_3`, …

use std::collections::{HashMap, HashSet};

/// Gives names that nobody bears.
#[derive(Debug)]
pub(crate) struct Namer<'n> {
    own: &'n HashMap<&'n str, u32>,
    given: HashSet<String>,
    /// The number to try next after each name, so that many repeats do not cost the square.
    next: HashMap<String, u32>,
}

impl<'n> Namer<'n> {
    /// For joints of which some keep the names in `own`.
    pub(crate) fn new(own: &'n HashMap<&'n str, u32>) -> Self {
        Self { own, given: HashSet::new(), next: HashMap::new() }
    }

    /// A name that is free: `base` itself if that is allowed to stay `plain`, else with a number.
    pub(crate) fn give(&mut self, base: &str, plain: bool) -> String {
        let is_free = |name: &str| !self.own.contains_key(name) && !self.given.contains(name);
        let mut name = base.to_owned();
        if !(plain && is_free(&name)) {
            let next = self.next.entry(base.to_owned()).or_insert(2);
            loop {
                name = format!("{base}_{next}");
                *next = next.saturating_add(1);
                if is_free(&name) {
                    break;
                }
            }
        }
        self.given.insert(name.clone());
        name
    }
}
