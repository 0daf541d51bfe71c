//! Changing a few members of a JSON text, and keeping all others as they stand there.

use std::borrow::Cow;
use std::fmt;

use serde::de::{Deserialize, Deserializer, MapAccess, Visitor};
use serde_json::value::RawValue;

/// The members of an object in their order, each value as its text.
pub(crate) struct Members<'t>(Vec<(String, Cow<'t, str>)>);

impl<'de> Deserialize<'de> for Members<'de> {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        struct Object;
        impl<'de> Visitor<'de> for Object {
            type Value = Members<'de>;
            fn expecting(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
                f.write_str("an object")
            }
            fn visit_map<A: MapAccess<'de>>(self, mut map: A) -> Result<Self::Value, A::Error> {
                let mut members = Vec::new();
                while let Some((key, value)) = map.next_entry::<String, &'de RawValue>()? {
                    members.push((key, Cow::Borrowed(value.get())));
                }
                Ok(Members(members))
            }
        }
        deserializer.deserialize_map(Object)
    }
}

impl<'t> Members<'t> {
    pub(crate) fn parse(text: &'t str) -> serde_json::Result<Self> {
        serde_json::from_str(text)
    }

    pub(crate) fn get(&self, key: &str) -> Option<&str> {
        self.0.iter().find(|(k, _)| k == key).map(|(_, value)| &**value)
    }

    /// Replaces a member's value where it stands, or appends it.
    pub(crate) fn set(&mut self, key: &str, value: impl Into<Cow<'t, str>>) {
        let value = value.into();
        match self.0.iter_mut().find(|(k, _)| k == key) {
            Some(member) => member.1 = value,
            None => self.0.push((key.to_owned(), value)),
        }
    }

    pub(crate) fn remove(&mut self, key: &str) {
        self.0.retain(|(k, _)| k != key);
    }

    /// The elements of a list among the members; none where it is missing.
    pub(crate) fn list(&self, key: &str) -> serde_json::Result<Vec<String>> {
        let Some(text) = self.get(key) else { return Ok(Vec::new()) };
        let elements: Vec<&RawValue> = serde_json::from_str(text)?;
        Ok(elements.into_iter().map(|e| e.get().to_owned()).collect())
    }

    pub(crate) fn set_list(&mut self, key: &str, elements: &[String]) {
        self.set(key, list(elements));
    }

    pub(crate) fn text(&self) -> String {
        let mut text = String::from("{");
        for (key, value) in &self.0 {
            if text.len() > 1 {
                text.push(',');
            }
            text.push_str(&string(key));
            text.push(':');
            text.push_str(value);
        }
        text.push('}');
        text
    }
}

/// A JSON list of texts.
pub(crate) fn list(elements: &[String]) -> String {
    format!("[{}]", elements.join(","))
}

/// A JSON string.
pub(crate) fn string(text: &str) -> String {
    serde_json::Value::from(text).to_string()
}

/// A JSON list of numbers.
pub(crate) fn numbers(values: &[f64]) -> String {
    list(&values.iter().map(|v| serde_json::Value::from(*v).to_string()).collect::<Vec<_>>())
}
