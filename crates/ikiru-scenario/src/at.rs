//! Where something stands in a scenario: its keys from the root, and line and column where there is a text.

use toml::Spanned;
use toml::de::{DeTable, DeValue};

use crate::error::{Error, ErrorKind};

/// What a scenario came from: its name for messages, and its text, where it was not made by a program.
#[derive(Clone, Copy)]
pub(crate) struct Source<'a> {
    pub(crate) name: &'a str,
    pub(crate) text: Option<&'a str>,
}

/// The keys that lead to a value, so that whoever finds it wrong can say where it stands.
#[derive(Clone)]
pub(crate) struct At<'a> {
    source: Source<'a>,
    path: Vec<Step>,
}

#[derive(Clone)]
enum Step {
    Key(String),
    Entry(usize),
}

/// Where a key and its value begin, in bytes.
#[derive(Clone, Copy)]
struct Spot {
    key: usize,
    value: usize,
}

impl Source<'_> {
    /// Line and column of a byte, from 1.
    pub(crate) fn position(&self, at: usize) -> Option<(usize, usize)> {
        let text = self.text?;
        let before = text.get(..at.min(text.len())).unwrap_or(text);
        let line = before.matches('\n').count() + 1;
        let column = before.rsplit('\n').next().unwrap_or_default().chars().count() + 1;
        Some((line, column))
    }
}

impl<'a> At<'a> {
    /// The scenario as a whole.
    pub(crate) fn root(source: Source<'a>) -> Self {
        Self { source, path: Vec::new() }
    }

    /// A key of the table here.
    pub(crate) fn key(&self, key: &str) -> Self {
        self.then(Step::Key(key.to_owned()))
    }

    /// An entry of the list here.
    pub(crate) fn entry(&self, idx: usize) -> Self {
        self.then(Step::Entry(idx))
    }

    fn then(&self, step: Step) -> Self {
        let mut path = Vec::with_capacity(self.path.len() + 1);
        path.extend_from_slice(&self.path);
        path.push(step);
        Self { source: self.source, path }
    }

    /// The key that messages name: an entry's is that of its list.
    pub(crate) fn name(&self) -> &str {
        let named = self.path.iter().rev().find_map(|step| match step {
            Step::Key(key) => Some(key.as_str()),
            Step::Entry(_) => None,
        });
        named.unwrap_or_default()
    }

    /// What messages call the table here: `[limits.head]`, `objective 2`, `objective 2, 'joints',`.
    pub(crate) fn place(&self) -> String {
        match &self.path[..] {
            [] => "the scenario".to_owned(),
            [Step::Key(list), Step::Entry(idx)] if list == "objective" => format!("objective {}", idx + 1),
            [Step::Key(list), Step::Entry(idx), rest @ ..] if list == "objective" => {
                format!("objective {}, '{}',", idx + 1, joined(rest))
            }
            path => format!("[{}]", joined(path)),
        }
    }

    /// An error about the value here.
    pub(crate) fn error(&self, kind: ErrorKind) -> Error {
        let position = self.spot().and_then(|spot| self.source.position(spot.value));
        self.located(position, kind)
    }

    /// An error about the key here.
    pub(crate) fn key_error(&self, kind: ErrorKind) -> Error {
        let position = self.spot().and_then(|spot| self.source.position(spot.key));
        self.located(position, kind)
    }

    /// An error about what begins at a byte of the text.
    pub(crate) fn error_at(&self, byte: usize, kind: ErrorKind) -> Error {
        self.located(self.source.position(byte), kind)
    }

    fn located(&self, position: Option<(usize, usize)>, kind: ErrorKind) -> Error {
        Error::new(self.source.name, position, kind).with_key(&joined(&self.path))
    }

    /// Line and column of each entry of the list here, from 1, as far as there is a text.
    pub(crate) fn positions_of_entries(&self) -> Vec<Option<(usize, usize)>> {
        let look = |value: &DeValue<'_>| {
            let entries = value.as_array().into_iter().flatten();
            entries.map(|entry| self.source.position(entry.span().start)).collect()
        };
        self.look(|_, value| look(value)).unwrap_or_default()
    }

    /// Places are looked up in the text when something is wrong: until then, nobody needs them.
    fn spot(&self) -> Option<Spot> {
        self.look(|spot, _| spot)
    }

    /// What is seen of the value here in the text; of the table that lacks it, where it is left out.
    fn look<T>(&self, see: impl FnOnce(Spot, &DeValue<'_>) -> T) -> Option<T> {
        let map = DeTable::parse(self.source.text?).ok()?;
        let root = Spanned::new(0..0, DeValue::Table(map.into_inner()));
        let (mut spot, mut value) = (Spot { key: 0, value: 0 }, &root);
        for step in &self.path {
            let found = match step {
                Step::Key(key) => value.get_ref().as_table().and_then(|table| {
                    let (key, value) = table.get_key_value(key.as_str())?;
                    Some((key.span().start, value))
                }),
                Step::Entry(idx) => value
                    .get_ref()
                    .as_array()
                    .and_then(|list| list.get(*idx))
                    .map(|value| (value.span().start, value)),
            };
            let Some((key, next)) = found else { break };
            // A table of dotted keys has no place of its own but theirs.
            let start = if next.span().is_empty() { key } else { next.span().start };
            (spot, value) = (Spot { key, value: start }, next);
        }
        Some(see(spot, value.get_ref()))
    }
}

/// `limits.head`, `objective[0].target`.
fn joined(path: &[Step]) -> String {
    let mut text = String::new();
    for step in path {
        match step {
            Step::Entry(idx) => text += &format!("[{idx}]"),
            Step::Key(key) if text.is_empty() => text += key,
            Step::Key(key) => text += &format!(".{key}"),
        }
    }
    text
}

#[cfg(test)]
mod tests {
    use super::*;

    const TEXT: &str = "a = 1\nb.c = [2, 3]\n[limits.head]\nx = 4\n[[objective]]\na = 5\n[[objective]]\nj = { \"ö\" = 1, k = [6] }\n";

    #[test]
    fn places_are_those_of_the_text() {
        let root = At::root(Source { name: "t.toml", text: Some(TEXT) });
        let head = root.key("limits").key("head");
        let second = root.key("objective").entry(1);
        let deep = second.key("j").key("k");
        for (at, key, value) in [
            (root.key("a"), "1:1", "1:5"),
            (root.key("b").key("c").entry(1), "2:11", "2:11"),
            (head.key("x"), "4:1", "4:5"),
            (second.clone(), "7:1", "7:1"),
            (deep.entry(0), "8:21", "8:21"),
            // What is left out stands where its table does.
            (second.key("gone"), "7:1", "7:1"),
        ] {
            let said = |error: Error| format!("{}:{}", error.line().unwrap(), error.column().unwrap());
            assert_eq!(said(at.error(ErrorKind::Utf8)), value, "{}", at.place());
            assert_eq!(said(at.key_error(ErrorKind::Utf8)), key, "{}", at.place());
        }
        assert_eq!(root.key("objective").positions_of_entries(), [Some((5, 1)), Some((7, 1))]);
        assert_eq!((head.place(), second.place()), ("[limits.head]".into(), "objective 2".into()));
        assert_eq!((deep.place(), deep.entry(0).name()), ("objective 2, 'j.k',".into(), "k"));
    }

    #[test]
    fn without_a_text_the_keys_say_where() {
        let root = At::root(Source { name: "a document", text: None });
        let error = root.key("objective").entry(0).key("weight").error(ErrorKind::Utf8);
        assert_eq!((error.line(), error.key()), (None, Some("objective[0].weight")));
        assert!(error.to_string().starts_with("a document: objective[0].weight: "));
    }
}
