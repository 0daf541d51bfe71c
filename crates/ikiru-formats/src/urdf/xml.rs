//! The XML of a URDF file, tag by tag: every one with its place, and nothing but elements.

use std::borrow::Cow;

use quick_xml::Reader;
use quick_xml::escape::{EscapeError, resolve_predefined_entity, unescape};
use quick_xml::events::Event;
use quick_xml::events::attributes::{AttrError, Attributes};

use crate::urdf::problem::UrdfProblem;
use crate::urdf::trouble::{Text, Trouble};
use crate::warning::short;

/// The deepest nesting that is read; a robot needs five levels.
const MOST_LEVELS: usize = 256;

/// A start tag.
#[derive(Clone, Copy)]
pub(crate) struct Element<'t> {
    /// Its name, with the prefix.
    pub(crate) tag: &'t str,
    /// The byte of its `<`.
    pub(crate) at: usize,
    /// What stands between `<` and `>`.
    content: &'t str,
}

/// What comes next in a document.
pub(crate) enum Step<'t> {
    Open(Element<'t>),
    Close,
    /// The end of the document: all elements are closed, and there was one.
    End,
}

/// Walks through a document.
pub(crate) struct Scanner<'t> {
    pub(crate) text: Text<'t>,
    reader: Reader<&'t [u8]>,
    /// Where the open elements start.
    open: Vec<usize>,
    has_root: bool,
}

impl<'t> Scanner<'t> {
    pub(crate) fn new(text: &'t str) -> Self {
        let mut reader = Reader::from_str(text);
        reader.config_mut().expand_empty_elements = true;
        Self { text: Text(text), reader, open: Vec::new(), has_root: false }
    }

    /// How many elements are open.
    pub(crate) fn level(&self) -> usize {
        self.open.len()
    }

    /// The next start or end of an element.
    pub(crate) fn next(&mut self) -> Result<Step<'t>, Trouble> {
        loop {
            let at = byte(self.reader.buffer_position());
            let event = self.reader.read_event().map_err(|error| {
                let at = byte(self.reader.error_position());
                Trouble::new(at, "", UrdfProblem::Syntax { message: short(&error.to_string()) })
            })?;
            match event {
                Event::Start(start) => {
                    let content = self.text.0.get(at + 1..).and_then(|rest| rest.get(..start.len()));
                    let content = content.unwrap_or_default();
                    let tag = content.get(..start.name().0.len()).unwrap_or_default();
                    return self.enter(Element { tag, at, content }).map(Step::Open);
                }
                Event::End(_) => {
                    self.open.pop();
                    return Ok(Step::Close);
                }
                Event::Eof => return self.end(),
                Event::Text(text) => self.check_text(at, &text)?,
                Event::CData(text) => self.check_text(at, &text)?,
                Event::GeneralRef(entity) => {
                    let is_known = match entity.resolve_char_ref() {
                        Ok(None) => resolve_predefined_entity(&entity).is_some(),
                        Ok(Some(_)) => true,
                        Err(_) => false,
                    };
                    if !is_known {
                        return Err(Trouble::new(at, "", UrdfProblem::Entity { name: short(&entity) }));
                    }
                    self.check_text(at, "&")?;
                }
                // A document type could define entities; since none of them is looked up, it does no harm.
                Event::DocType(_) | Event::Comment(_) | Event::Decl(_) | Event::PI(_) | Event::Empty(_) => {}
            }
        }
    }

    /// Skips what is left of all elements deeper than a level.
    pub(crate) fn close_to(&mut self, level: usize) -> Result<(), Trouble> {
        while self.open.len() > level {
            self.next()?;
        }
        Ok(())
    }

    /// Calls `visit` for every child of the element that was opened last, up to its end; what `visit` does
    /// not read of a child is skipped.
    pub(crate) fn children(
        &mut self,
        mut visit: impl FnMut(&mut Self, Element<'t>) -> Result<(), Trouble>,
    ) -> Result<(), Trouble> {
        let level = self.level();
        while let Step::Open(child) = self.next()? {
            visit(self, child)?;
            self.close_to(level)?;
        }
        Ok(())
    }

    fn enter(&mut self, element: Element<'t>) -> Result<Element<'t>, Trouble> {
        let fault =
            |problem: UrdfProblem| Trouble::new(element.at, format!("<{}>", short(element.tag)), problem);
        if element.tag.starts_with("xacro:") {
            return Err(fault(UrdfProblem::Xacro { found: format!("<{}>", short(element.tag)) }));
        }
        if self.open.is_empty() && self.has_root {
            return Err(fault(UrdfProblem::SecondRoot));
        }
        if self.open.len() >= MOST_LEVELS {
            return Err(fault(UrdfProblem::Nesting { most: MOST_LEVELS }));
        }
        self.has_root = true;
        self.open.push(element.at);
        Ok(element)
    }

    fn end(&self) -> Result<Step<'t>, Trouble> {
        match self.open.last() {
            Some(at) => Err(Trouble::new(*at, "", UrdfProblem::Unclosed)),
            None if !self.has_root => Err(Trouble::new(self.text.0.len(), "", UrdfProblem::NoElement)),
            None => Ok(Step::End),
        }
    }

    /// Text says nothing in URDF, but beside the root element it shows that the file is something else. Some
    /// files end with zeros.
    fn check_text(&self, at: usize, text: &str) -> Result<(), Trouble> {
        let text = text.trim_matches(|c: char| c.is_whitespace() || c == '\0');
        if !self.open.is_empty() || text.is_empty() {
            return Ok(());
        }
        let found = text.chars().take(20).collect();
        Err(Trouble::new(at, "", UrdfProblem::TextOutside { found }))
    }
}

impl<'t> Element<'t> {
    /// The values of some attributes, as many as are there.
    pub(crate) fn attributes<const N: usize>(
        &self,
        element: &dyn Fn() -> String,
        names: [&'static str; N],
    ) -> Result<[Option<Cow<'t, str>>; N], Trouble> {
        let mut values = [const { None }; N];
        let fault = |problem: UrdfProblem| Trouble::new(self.at, element(), problem);
        // The library's own check for repeats compares each with all others.
        for attribute in Attributes::new(self.content, self.tag.len()).with_checks(false) {
            let attribute = attribute.map_err(|error| self.malformed(element(), &error))?;
            let Some(idx) = names.iter().position(|name| *name == attribute.key.0) else { continue };
            let (Some(slot), Some(name)) = (values.get_mut(idx), names.get(idx)) else { continue };
            if slot.is_some() {
                return Err(fault(UrdfProblem::AttributeTwice { name }));
            }
            let value = unescaped(attribute.value).map_err(&fault)?;
            if let Some(found) = xacro_markup(&value) {
                return Err(fault(UrdfProblem::Xacro { found }));
            }
            *slot = Some(value);
        }
        Ok(values)
    }

    fn malformed(&self, element: String, error: &AttrError) -> Trouble {
        let (AttrError::ExpectedEq(offset)
        | AttrError::ExpectedValue(offset)
        | AttrError::UnquotedValue(offset)
        | AttrError::ExpectedQuote(offset, _)
        | AttrError::Duplicated(offset, _)) = error;
        let at = self.at.saturating_add(1).saturating_add(*offset);
        let message = match error {
            AttrError::ExpectedEq(_) => "an attribute without `=`",
            AttrError::ExpectedValue(_) => "an attribute without a value",
            AttrError::UnquotedValue(_) => "an attribute whose value has no quotes",
            AttrError::ExpectedQuote(..) => "an attribute whose closing quote is missing",
            AttrError::Duplicated(..) => "an attribute that is there twice",
        };
        Trouble::new(at, element, UrdfProblem::Syntax { message: message.to_owned() })
    }
}

fn unescaped(raw: Cow<'_, str>) -> Result<Cow<'_, str>, UrdfProblem> {
    if !raw.contains('&') {
        return Ok(raw);
    }
    match unescape(&raw) {
        Ok(value) => Ok(Cow::Owned(value.into_owned())),
        Err(EscapeError::UnrecognizedEntity(_, name)) => Err(UrdfProblem::Entity { name: short(&name) }),
        Err(other) => Err(UrdfProblem::Syntax { message: short(&other.to_string()) }),
    }
}

/// What only xacro understands: `${…}` and `$(…)`.
fn xacro_markup(value: &str) -> Option<String> {
    let start = value.find("${").or_else(|| value.find("$("))?;
    let rest = value.get(start..)?;
    let end = rest.find(['}', ')']).map_or(rest.len(), |end| end + 1);
    Some(short(rest.get(..end)?))
}

fn byte(position: u64) -> usize {
    usize::try_from(position).unwrap_or(usize::MAX)
}
