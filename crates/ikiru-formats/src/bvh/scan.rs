//! Words of a BVH text, with their places.

use crate::error::{ErrorKind, Fault, Place};
use crate::warning::short;

/// A place in the text from which words are read.
#[derive(Clone, Debug)]
pub(super) struct Scanner<'t> {
    text: &'t [u8],
    at: usize,
}

/// A word and where it starts.
#[derive(Clone, Copy, Debug)]
pub(super) struct Word<'t> {
    /// Empty at the end of the file.
    pub(super) text: &'t [u8],
    pub(super) at: usize,
}

impl Word<'_> {
    pub(super) fn is(&self, keyword: &str) -> bool {
        self.text.eq_ignore_ascii_case(keyword.as_bytes())
    }

    fn quoted(&self) -> String {
        if self.text.is_empty() {
            "the end of the file".to_owned()
        } else {
            format!("'{}'", short(&String::from_utf8_lossy(self.text)))
        }
    }
}

/// The largest number that is computed with.
const LARGEST: f64 = 1e100;

pub(super) const NUMBER: &str = "a number between -1e100 and 1e100";

fn is_space(byte: u8) -> bool {
    // A zero or Ctrl-Z ends files of old programs.
    byte.is_ascii_whitespace() || matches!(byte, 0x0b | 0 | 0x1a)
}

fn is_brace(byte: u8) -> bool {
    matches!(byte, b'{' | b'}')
}

impl<'t> Scanner<'t> {
    pub(super) fn new(text: &'t [u8]) -> Self {
        let at = if text.starts_with(b"\xef\xbb\xbf") { 3 } else { 0 };
        Self { text, at }
    }

    fn skip_spaces(&mut self) {
        while self.text.get(self.at).is_some_and(|b| is_space(*b)) {
            self.at += 1;
        }
    }

    /// What ends before the first byte for which `ends` holds.
    fn until(&mut self, ends: impl Fn(u8) -> bool) -> &'t [u8] {
        let rest = self.text.get(self.at..).unwrap_or_default();
        let length = rest.iter().position(|b| ends(*b)).unwrap_or(rest.len());
        self.at += length;
        rest.get(..length).unwrap_or_default()
    }

    fn word_until(&mut self, ends: impl Fn(u8) -> bool) -> Word<'t> {
        self.skip_spaces();
        let at = self.at;
        let mut text = self.until(|b| is_space(b) || ends(b));
        if text.is_empty() && at < self.text.len() {
            self.at += 1;
            text = self.text.get(at..self.at).unwrap_or_default();
        }
        Word { text, at }
    }

    /// The next word; a brace is one by itself.
    pub(super) fn word(&mut self) -> Word<'t> {
        self.word_until(is_brace)
    }

    /// The next word, where a colon is one by itself as well.
    pub(super) fn header_word(&mut self) -> Word<'t> {
        self.word_until(|b| b == b':')
    }

    /// The next word, which is left where it is.
    pub(super) fn peek(&self) -> Word<'t> {
        self.clone().word()
    }

    /// A name: from the next word to the end of its line, or to a brace.
    pub(super) fn name(&mut self) -> Word<'t> {
        self.skip_spaces();
        let at = self.at;
        let line = self.until(|b| is_brace(b) || matches!(b, b'\n' | b'\r'));
        let end = line.iter().rposition(|b| !is_space(*b)).map_or(0, |last| last + 1);
        Word { text: line.get(..end).unwrap_or_default(), at }
    }

    /// A number, not infinite.
    pub(super) fn number(&mut self) -> Result<f64, Fault> {
        let word = self.word();
        number(word).ok_or_else(|| self.unexpected(word, NUMBER))
    }

    /// How many words are left.
    pub(super) fn count_rest(&self) -> u64 {
        let mut rest = self.clone();
        let mut count = 0;
        while !rest.word().text.is_empty() {
            count += 1;
        }
        count
    }

    pub(super) fn unexpected(&self, word: Word<'_>, expected: &'static str) -> Fault {
        self.fault(word.at, ErrorKind::Unexpected { found: word.quoted(), expected })
    }

    /// Something wrong at a byte.
    pub(super) fn fault(&self, at: usize, kind: ErrorKind) -> Fault {
        let before = self.text.get(..at).unwrap_or(self.text);
        let (mut line, mut start) = (1, 0);
        for (idx, byte) in before.iter().enumerate() {
            // A line ends with LF, CR LF, or (very old files) CR.
            if *byte == b'\n' || (*byte == b'\r' && self.text.get(idx + 1) != Some(&b'\n')) {
                (line, start) = (line + 1, idx + 1);
            }
        }
        Fault::new(Place::Line { line, column: before.len() - start + 1 }, kind)
    }
}

/// The number that a word is.
pub(super) fn number(word: Word<'_>) -> Option<f64> {
    let value: f64 = std::str::from_utf8(word.text).ok()?.parse().ok()?;
    (value.abs() <= LARGEST).then_some(value)
}
