//! A document as TOML: sections where a person would write them, everything else in one line.

use std::fmt::Write as _;

use toml::{Table, Value};

/// Longer lists are broken into lines of at most so many characters.
const LINE: usize = 120;

/// The text of a table that has the keys of a scenario.
pub(crate) fn written(table: &Table) -> String {
    let mut text = String::new();
    section(&mut text, &[], table);
    text
}

/// What a value is to be: a section of its own, several, or nothing but a value.
enum Form {
    Section,
    /// A table that only has sections.
    Group,
    /// A list of sections.
    List,
    Inline,
}

fn form(path: &[&str], value: &Value) -> Form {
    match (path, value) {
        (["limits"] | ["motion", "limits"], Value::Table(_)) => Form::Group,
        (
            ["limits", _]
            | ["motion", "limits", _]
            | ["roles" | "start" | "motion" | "stop"]
            | ["motion", "end"],
            Value::Table(_),
        ) => Form::Section,
        (["objective"], Value::Array(list)) if !list.is_empty() && list.iter().all(Value::is_table) => {
            Form::List
        }
        _ => Form::Inline,
    }
}

/// The keys of a table, then the sections inside it: what follows the head of a section belongs to that.
fn section(text: &mut String, path: &[&str], table: &Table) {
    let inner: Vec<(Vec<&str>, &Value)> = table
        .iter()
        .map(|(key, value)| (path.iter().copied().chain([key.as_str()]).collect(), value))
        .collect();
    for (path, value) in &inner {
        if let (Form::Inline, Some(name)) = (form(path, value), path.last()) {
            entry(text, name, value);
        }
    }
    for (path, value) in &inner {
        match (form(path, value), value) {
            (Form::Section, Value::Table(table)) => {
                head(text, path, ["[", "]"]);
                section(text, path, table);
            }
            (Form::Group, Value::Table(table)) => section(text, path, table),
            (Form::List, Value::Array(list)) => {
                for table in list.iter().filter_map(Value::as_table) {
                    head(text, path, ["[[", "]]"]);
                    section(text, path, table);
                }
            }
            (Form::Section | Form::Group | Form::List | Form::Inline, _) => {}
        }
    }
}

fn head(text: &mut String, path: &[&str], [open, close]: [&str; 2]) {
    let keys: Vec<String> = path.iter().map(|name| key(name)).collect();
    // Writing to a String cannot fail.
    let _ = writeln!(text, "\n{open}{}{close}", keys.join("."));
}

fn entry(text: &mut String, name: &str, value: &Value) {
    let value = plain(value);
    let line = format!("{} = {value}\n", key(name));
    match &value {
        Value::Array(list) if line.chars().count() > LINE => {
            let _ = writeln!(text, "{} = [", key(name));
            let mut line = String::new();
            for item in list.iter().map(Value::to_string) {
                if !line.is_empty() && line.chars().count() + item.chars().count() + 6 > LINE {
                    let _ = writeln!(text, "   {line}");
                    line.clear();
                }
                let _ = write!(line, " {item},");
            }
            let _ = writeln!(text, "   {line}\n]");
        }
        _ => *text += &line,
    }
}

/// A key as TOML has it: bare where it can be.
fn key(name: &str) -> String {
    let alone = Table::from_iter([(name.to_owned(), Value::Boolean(true))]).to_string();
    alone.trim_end().trim_end_matches("true").trim_end().trim_end_matches('=').trim_end().to_owned()
}

/// A value with whole numbers as people write them: `30`, not `30.0`; they are read back to the same bit.
fn plain(value: &Value) -> Value {
    const MOST: f64 = 1e15;
    match value {
        Value::Float(n) if n.fract() == 0.0 && n.abs() < MOST && (*n != 0.0 || n.is_sign_positive()) => {
            Value::Integer(*n as i64)
        }
        Value::Array(list) => Value::Array(list.iter().map(plain).collect()),
        Value::Table(table) => {
            Value::Table(table.iter().map(|(key, value)| (key.clone(), plain(value))).collect())
        }
        Value::String(_) | Value::Integer(_) | Value::Float(_) | Value::Boolean(_) | Value::Datetime(_) => {
            value.clone()
        }
    }
}
