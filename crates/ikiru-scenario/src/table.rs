//! TOML values with their place: every accessor answers with what was expected and where.

use ikiru_rig::unknown_name;
use toml::Spanned;
use toml::de::{DeTable, DeValue};

use crate::at::At;
use crate::error::{Error, ErrorKind};
use crate::key::{self, JOINT, Key};

/// A table of the text.
#[derive(Clone)]
pub(crate) struct Table<'a> {
    at: At<'a>,
    map: &'a DeTable<'a>,
    start: usize,
}

/// A value of the text, with its key.
#[derive(Clone)]
pub(crate) struct Value<'a> {
    at: At<'a>,
    pub(crate) key: String,
    /// What errors expect of it.
    takes: &'static str,
    /// Where the key starts.
    key_start: usize,
    value: &'a Spanned<DeValue<'a>>,
}

impl<'a> Table<'a> {
    pub(crate) fn root(at: At<'a>, map: &'a DeTable<'a>) -> Self {
        Self { at, map, start: 0 }
    }

    /// What messages call it.
    pub(crate) fn place(&self) -> String {
        self.at.place()
    }

    /// An error about the table as a whole.
    pub(crate) fn error(&self, kind: ErrorKind) -> Error {
        self.at.error_at(self.start, kind)
    }

    /// Refuses all other keys.
    pub(crate) fn only(&self, expected: &[Key]) -> Result<(), Error> {
        let expected = key::names(expected);
        match self.entries("a key's value").into_iter().find(|v| !expected.contains(&v.key.as_str())) {
            None => Ok(()),
            Some(value) => {
                let unknown = unknown_name(&value.key, expected.iter().copied());
                Err(value.key_error(ErrorKind::UnknownKey { place: self.place(), unknown, expected }))
            }
        }
    }

    /// All values, in the order of the text, of a table whose keys are names; `takes` is what errors expect of each.
    pub(crate) fn entries(&self, takes: &'static str) -> Vec<Value<'a>> {
        let mut entries: Vec<Value<'a>> = self
            .map
            .iter()
            .map(|(key, value)| Value {
                at: self.at.key(key.get_ref()),
                key: key.get_ref().to_string(),
                takes,
                key_start: key.span().start,
                value,
            })
            .collect();
        entries.sort_by_key(|v| v.key_start);
        entries
    }

    pub(crate) fn get(&self, key: &Key) -> Option<Value<'a>> {
        let &Key { name, takes, .. } = key;
        let (found, value) = self.map.get_key_value(name)?;
        let key_start = found.span().start;
        Some(Value { at: self.at.key(name), key: name.to_owned(), takes, key_start, value })
    }

    pub(crate) fn require(&self, key: &Key) -> Result<Value<'a>, Error> {
        self.get(key).ok_or_else(|| self.lacks(key))
    }

    /// An error about a key that must be there.
    pub(crate) fn lacks(&self, key: &Key) -> Error {
        self.error(ErrorKind::MissingKey { place: self.place(), key: key.name, expected: key.takes })
    }

    /// An error about keys of which others, fewer or more must be there.
    pub(crate) fn alternatives(&self, keys: &[Key], expected: &'static str) -> Error {
        let kind = ErrorKind::Alternatives { place: self.place(), found: self.present(keys), expected };
        self.error(kind)
    }

    /// A table inside this one, if it is there.
    pub(crate) fn table(&self, key: &Key) -> Result<Option<Self>, Error> {
        self.get(key).map(|value| value.table()).transpose()
    }

    /// `'a' and 'b'` for those of the keys that are there.
    pub(crate) fn present(&self, keys: &[Key]) -> String {
        let names = keys.iter().map(|key| key.name);
        let found: Vec<String> =
            names.filter(|name| self.map.contains_key(*name)).map(|name| format!("'{name}'")).collect();
        if found.is_empty() { "neither".to_owned() } else { found.join(" and ") }
    }
}

impl<'a> Value<'a> {
    /// An error at the value.
    pub(crate) fn error(&self, kind: ErrorKind) -> Error {
        self.at.error_at(self.value.span().start, kind)
    }

    /// An error at the key.
    pub(crate) fn key_error(&self, kind: ErrorKind) -> Error {
        self.at.error_at(self.key_start, kind)
    }

    /// An error about a list that has more or fewer entries than there must be.
    pub(crate) fn wrong_length(&self, found: usize) -> Error {
        self.error(ErrorKind::Length { key: self.key.clone(), found, expected: self.takes })
    }

    fn wrong_type(&self) -> Error {
        let found = match self.value.get_ref() {
            DeValue::String(_) => "a string",
            DeValue::Integer(_) | DeValue::Float(_) => "a number",
            DeValue::Boolean(_) => "true or false",
            DeValue::Datetime(_) => "a date",
            DeValue::Array(_) => "a list",
            DeValue::Table(_) => "a table",
        };
        self.error(ErrorKind::Type { key: self.key.clone(), found, expected: self.takes })
    }

    pub(crate) fn is_text(&self) -> bool {
        self.value.get_ref().is_str()
    }

    pub(crate) fn is_table(&self) -> bool {
        self.value.get_ref().is_table()
    }

    pub(crate) fn table(&self) -> Result<Table<'a>, Error> {
        let map = self.value.get_ref().as_table().ok_or_else(|| self.wrong_type())?;
        // The place of a dotted key's table is that of its key.
        let start = if self.value.span().is_empty() { self.key_start } else { self.value.span().start };
        Ok(Table { at: self.at.clone(), map, start })
    }

    pub(crate) fn text(&self) -> Result<&'a str, Error> {
        self.value.get_ref().as_str().ok_or_else(|| self.wrong_type())
    }

    /// The name of a joint.
    pub(crate) fn name(&self) -> Result<String, Error> {
        Ok(self.text()?.to_owned())
    }

    /// Names of joints.
    pub(crate) fn name_list(&self) -> Result<Vec<String>, Error> {
        self.list(JOINT.takes)?.iter().map(Self::name).collect()
    }

    /// So many names of joints.
    pub(crate) fn names<const N: usize>(&self) -> Result<[String; N], Error> {
        let names = self.name_list()?;
        let found = names.len();
        names.try_into().map_err(|_| self.wrong_length(found))
    }

    /// One of several words.
    pub(crate) fn word(&self, key: &'static str, expected: &[&'static str]) -> Result<&'static str, Error> {
        let found = self.text()?;
        expected.iter().find(|word| **word == found).copied().ok_or_else(|| {
            let unknown = unknown_name(found, expected.iter().copied());
            self.error(ErrorKind::Word { key, unknown, expected: expected.to_vec() })
        })
    }

    pub(crate) fn truth(&self) -> Result<bool, Error> {
        self.value.get_ref().as_bool().ok_or_else(|| self.wrong_type())
    }

    /// The entries of a list; `takes` is what errors expect of each.
    pub(crate) fn list(&self, takes: &'static str) -> Result<Vec<Value<'a>>, Error> {
        let list = self.value.get_ref().as_array().ok_or_else(|| self.wrong_type())?;
        let entry = |(idx, value): (usize, &'a Spanned<DeValue<'a>>)| Value {
            at: self.at.entry(idx),
            key: self.key.clone(),
            takes,
            key_start: value.span().start,
            value,
        };
        Ok(list.iter().enumerate().map(entry).collect())
    }

    /// A finite number.
    pub(crate) fn number(&self) -> Result<f64, Error> {
        let text = match self.value.get_ref() {
            DeValue::Float(float) => float.as_str(),
            // A whole number in base 16, 8 or 2 is one as well.
            DeValue::Integer(whole) if whole.radix() != 10 => {
                let parsed = i64::from_str_radix(whole.as_str(), whole.radix());
                return parsed.map(|n| n as f64).map_err(|_| self.wrong_type());
            }
            DeValue::Integer(whole) => whole.as_str(),
            _ => return Err(self.wrong_type()),
        };
        match text.parse::<f64>() {
            Ok(number) if number.is_finite() => Ok(number),
            _ => {
                let kind = ErrorKind::NotFinite { key: self.key.clone(), found: text.to_owned() };
                Err(self.error(kind))
            }
        }
    }

    /// A whole number of at least 0.
    pub(crate) fn count(&self) -> Result<u32, Error> {
        let DeValue::Integer(_) = self.value.get_ref() else { return Err(self.wrong_type()) };
        let found = self.number()?;
        if (0.0..=f64::from(u32::MAX)).contains(&found) {
            return Ok(found as u32);
        }
        Err(self.error(ErrorKind::OutOfRange { key: self.key.clone(), found, expected: self.takes }))
    }

    /// The number of a version, which can be anything that is written there.
    pub(crate) fn version(&self) -> Result<(), Error> {
        match self.value.get_ref() {
            DeValue::Integer(number) if number.as_str() == "1" && number.radix() == 10 => Ok(()),
            DeValue::Integer(number) => Err(self.error(ErrorKind::Version(number.to_string()))),
            DeValue::Float(number) => Err(self.error(ErrorKind::Version(number.to_string()))),
            _ => Err(self.wrong_type()),
        }
    }

    /// A list of so many finite numbers.
    pub(crate) fn numbers<const N: usize>(&self) -> Result<[f64; N], Error> {
        let list = self.list("a number")?;
        let mut numbers = [0.0; N];
        if list.len() != N {
            return Err(self.wrong_length(list.len()));
        }
        for (slot, value) in numbers.iter_mut().zip(&list) {
            *slot = value.number()?;
        }
        Ok(numbers)
    }
}
