//! What the format says of its keys: texts are read by it, errors tell it, and `docs/scenario.md` is made of it.

/// A key of a table of a scenario.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[non_exhaustive]
pub struct Key {
    /// As texts have it.
    pub name: &'static str,
    /// What stands there, with its unit: what errors expect.
    pub takes: &'static str,
    /// What holds where it does not stand there.
    pub left_out: LeftOut,
    /// What it says: one sentence of Markdown, or a few.
    pub means: &'static str,
}

/// What holds where a key is left out.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[non_exhaustive]
pub enum LeftOut {
    /// It has to be there.
    Refused,
    /// It is one of several keys, of which exactly one has to be there.
    Another,
    /// What holds with this value, which is written as in a text.
    Value(&'static str),
    /// What these words say.
    Words(&'static str),
}

impl Key {
    /// A key that has to be there.
    pub(crate) const fn new(name: &'static str, takes: &'static str, means: &'static str) -> Self {
        Self { name, takes, left_out: LeftOut::Refused, means }
    }

    /// One of several.
    pub(crate) const fn one_of(self) -> Self {
        Self { left_out: LeftOut::Another, ..self }
    }

    /// With a default, as a text would have it.
    pub(crate) const fn or(self, value: &'static str) -> Self {
        Self { left_out: LeftOut::Value(value), ..self }
    }

    /// With a default in words.
    pub(crate) const fn or_as(self, words: &'static str) -> Self {
        Self { left_out: LeftOut::Words(words), ..self }
    }

    /// A key that several tables have, in the words of one of them.
    pub(crate) const fn meaning(self, means: &'static str) -> Self {
        Self { means, ..self }
    }
}

/// The joint that an objective is about.
pub(crate) const JOINT: Key =
    Key::new("joint", "the name of a joint, or a humanoid role", "The joint that it is about.");

/// The names of keys, as errors list them.
pub(crate) fn names(keys: &[Key]) -> Vec<&'static str> {
    keys.iter().map(|key| key.name).collect()
}
