//! Names in a robot description: those that are not there, those that stand twice, and new ones.

use std::borrow::Cow;
use std::collections::{HashMap, HashSet};

use ikiru_rig::{UnknownName, unknown_name};

use crate::urdf::element::Owner;
use crate::urdf::problem::UrdfProblem;
use crate::urdf::trouble::{Text, Trouble};
use crate::warning::short;

/// The positions of names, each of which may stand once.
pub(crate) fn index<'n>(
    text: Text<'_>,
    what: &'static str,
    names: impl ExactSizeIterator<Item = (&'n Cow<'n, str>, usize)> + Clone,
) -> Result<HashMap<&'n str, usize>, Trouble> {
    let mut index = HashMap::with_capacity(names.len());
    for (position, (name, at)) in names.clone().enumerate() {
        if let Some(first) = index.insert(&**name, position) {
            let first = names.clone().nth(first).map_or(0, |(_, at)| text.line(at));
            let owner = Owner { what, name };
            return Err(owner.fault(at, UrdfProblem::Duplicate { what, name: short(name), first }));
        }
    }
    Ok(index)
}

/// A name that is not there, with the nearest ones: of not too many, nor too long ones.
pub(crate) fn unknown<'n>(name: &str, candidates: impl Iterator<Item = &'n str>) -> UnknownName {
    const LONGEST: usize = 100;
    const MOST: usize = 10_000;
    if name.len() > LONGEST {
        return UnknownName { name: short(name), nearest: Vec::new() };
    }
    unknown_name(name, candidates.filter(|c| c.len() <= LONGEST).take(MOST))
}

/// A name like `wanted` that is not taken, which is it from then on.
pub(crate) fn free(wanted: String, taken: &mut HashSet<Cow<'_, str>>) -> String {
    let mut name = wanted.clone();
    let mut number = 2usize;
    while taken.contains(&*name) {
        name = format!("{wanted}_{number}");
        number = number.saturating_add(1);
    }
    taken.insert(Cow::Owned(name.clone()));
    name
}
