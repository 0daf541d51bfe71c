//! What is wrong with a document, and its place in the text.

use crate::error::{ErrorKind, Fault, Place};

/// The text of a file, to tell lines and columns by.
#[derive(Clone, Copy)]
pub(crate) struct Text<'t>(pub(crate) &'t str);

impl<'t> Text<'t> {
    /// The line of a byte, from 1.
    pub(crate) fn line(self, at: usize) -> usize {
        self.before(at).iter().filter(|b| **b == b'\n').count() + 1
    }

    fn before(self, at: usize) -> &'t [u8] {
        let bytes = self.0.as_bytes();
        bytes.get(..at).unwrap_or(bytes)
    }
}

/// What is wrong, and where, for as long as lines need not be counted: many a trouble ends as a warning or as
/// none.
#[derive(Debug)]
pub(crate) struct Trouble(Box<(Option<usize>, String, ErrorKind)>);

impl Trouble {
    /// A problem of the element that starts at a byte; `element` says which one it is.
    pub(crate) fn new(at: usize, element: impl Into<String>, kind: impl Into<ErrorKind>) -> Self {
        Self(Box::new((Some(at), element.into(), kind.into())))
    }

    /// A problem of the file as a whole.
    pub(crate) fn of_file(kind: impl Into<ErrorKind>) -> Self {
        Self(Box::new((None, String::new(), kind.into())))
    }

    pub(crate) fn kind(&self) -> &ErrorKind {
        &self.0.2
    }

    /// With its line and column.
    pub(crate) fn in_text(self, text: Text<'_>) -> Fault {
        let (at, element, kind) = *self.0;
        let Some(at) = at else { return kind.into() };
        let before = text.before(at);
        let start_of_line = before.iter().rposition(|b| *b == b'\n').map_or(0, |newline| newline + 1);
        let column = before.len() - start_of_line + 1;
        Fault::new(Place::Xml { line: text.line(at), column, element }, kind)
    }
}
