//! The paths that code names, groups of `use` taken apart: what rules about who stands on whom look at.

use anyhow::{Result, anyhow};
use proc_macro2::{Delimiter, TokenStream, TokenTree};

/// A path of at least two words, as the code has it.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(super) struct CodePath {
    /// From 1.
    pub(super) line: usize,
    /// The words, `*` for all there is.
    pub(super) words: Vec<String>,
    /// The name by which a `pub use` shows it to others.
    pub(super) shown_as: Option<String>,
}

/// Every path in the code of a file, in macros too, but for comments and modules of tests.
pub(super) fn paths(text: &str) -> Result<Vec<CodePath>> {
    let tokens: TokenStream = text.parse().map_err(|e| anyhow!("cannot be parsed: {e}"))?;
    let mut found = Vec::new();
    collect(tokens, &mut found);
    Ok(found)
}

fn collect(tokens: TokenStream, found: &mut Vec<CodePath>) {
    let tokens: Vec<TokenTree> = tokens.into_iter().collect();
    let mut at = 0;
    let mut is_shown = false;
    while at < tokens.len() {
        match &tokens[at] {
            TokenTree::Ident(word) if *word == "mod" && is_word(&tokens, at + 1, "tests") => {
                // Its name and its braces.
                at += 2;
            }
            TokenTree::Ident(word) if *word == "pub" => is_shown = true,
            TokenTree::Ident(word) if *word == "use" => {
                let first = found.len();
                at = tree(&tokens, at + 1, &[], found);
                if !is_shown {
                    found[first..].iter_mut().for_each(|path| path.shown_as = None);
                }
                found.retain(|path| path.words.len() > 1);
                is_shown = false;
                continue;
            }
            TokenTree::Ident(_) if is_path(&tokens, at + 1) => {
                let first = found.len();
                at = tree(&tokens, at, &[], found);
                found[first..].iter_mut().for_each(|path| path.shown_as = None);
                is_shown = false;
                continue;
            }
            TokenTree::Group(group) => {
                collect(group.stream(), found);
                // `pub(crate)` is shown, too.
                is_shown &= group.delimiter() == Delimiter::Parenthesis;
            }
            TokenTree::Ident(_) | TokenTree::Punct(_) | TokenTree::Literal(_) => is_shown = false,
        }
        at += 1;
    }
}

/// Reads a path with all that its groups lead to, and says where it ends.
fn tree(tokens: &[TokenTree], start: usize, before: &[String], found: &mut Vec<CodePath>) -> usize {
    let (mut at, mut words) = (start, before.to_vec());
    let mut line = tokens.get(start).map_or(1, |token| token.span().start().line);
    loop {
        match tokens.get(at) {
            Some(TokenTree::Ident(word)) => {
                line = word.span().start().line;
                // `{self}` is what stands before it.
                if words.is_empty() || *word != "self" {
                    words.push(word.to_string());
                }
            }
            Some(TokenTree::Punct(star)) if star.as_char() == '*' && !words.is_empty() => {
                words.push("*".to_owned());
            }
            Some(TokenTree::Group(group)) if group.delimiter() == Delimiter::Brace => {
                let inner: Vec<TokenTree> = group.stream().into_iter().collect();
                let mut next = 0;
                while next < inner.len() {
                    next = tree(&inner, next, &words, found) + 1;
                }
                return at + 1;
            }
            _ => break,
        }
        at += 1;
        if !is_path(tokens, at) {
            break;
        }
        at += 2;
    }
    let mut shown_as = words.last().cloned();
    if is_word(tokens, at, "as") {
        shown_as = tokens.get(at + 1).map(ToString::to_string);
        at += 2;
    }
    if !words.is_empty() {
        found.push(CodePath { line, words, shown_as });
    }
    at.max(start + 1)
}

fn is_word(tokens: &[TokenTree], at: usize, expected: &str) -> bool {
    matches!(tokens.get(at), Some(TokenTree::Ident(word)) if *word == expected)
}

/// Whether `::` stands there, and goes on.
fn is_path(tokens: &[TokenTree], at: usize) -> bool {
    let is_colon = |at: usize| matches!(tokens.get(at), Some(TokenTree::Punct(p)) if p.as_char() == ':');
    is_colon(at)
        && is_colon(at + 1)
        && match tokens.get(at + 2) {
            Some(TokenTree::Ident(_)) => true,
            Some(TokenTree::Group(group)) => group.delimiter() == Delimiter::Brace,
            // `<` begins the arguments of a type.
            Some(TokenTree::Punct(star)) => star.as_char() == '*',
            Some(TokenTree::Literal(_)) | None => false,
        }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn found(text: &str) -> Vec<(usize, String, Option<String>)> {
        let paths = paths(text).unwrap();
        paths.into_iter().map(|path| (path.line, path.words.join("::"), path.shown_as)).collect()
    }

    #[test]
    fn groups_are_taken_apart() {
        let text =
            "use crate::{\n    a::b,\n    c::{self, D as E},\n    f::*,\n};\nuse std::fmt;\nuse serde;\n";
        let private = |line, path: &str| (line, path.to_owned(), None);
        let expected = [
            private(2, "crate::a::b"),
            private(3, "crate::c"),
            private(3, "crate::c::D"),
            private(4, "crate::f::*"),
            private(6, "std::fmt"),
        ];
        assert_eq!(found(text), expected);
    }

    #[test]
    fn what_is_shown_to_others_has_its_name() {
        let shown = |path: &str, name: &str| (1, path.to_owned(), Some(name.to_owned()));
        assert_eq!(found("pub use a::{B, C as D};"), [shown("a::B", "B"), shown("a::C", "D")]);
        assert_eq!(found("pub(crate) use a::B;"), [shown("a::B", "B")]);
        assert_eq!(found("pub fn f() { use a::B; }"), [(1, "a::B".to_owned(), None)]);
    }

    #[test]
    fn paths_in_code_and_macros_count_and_those_of_comments_and_tests_do_not() {
        let text = "/// [`A`](crate::a::A)\nfn f(x: crate::b::B<u8>) {\n    m!(x, crate::c::C { .. });\n    // crate::d\n}\n\
                    #[cfg(test)]\nmod tests {\n    use crate::e;\n}\n";
        let expected = [(2, "crate::b::B".to_owned(), None), (3, "crate::c::C".to_owned(), None)];
        assert_eq!(found(text), expected);
    }
}
