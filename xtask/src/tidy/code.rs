//! Rust files of crates, parsed: what rules look at that are about code rather than about lines.

use anyhow::{Context, Result};
use syn::{Attribute, File};

use super::Project;

/// A file below `crates/NAME/src`, with its syntax tree.
pub(super) struct Source {
    pub(super) file: String,
    pub(super) tree: File,
}

/// Every Rust file of every crate but its tests. Those whose text has none of `words` are left out, unparsed.
pub(super) fn sources(project: &Project, words: &[String]) -> Result<Vec<Source>> {
    let mut sources = Vec::new();
    for file in project.files() {
        let ["crates", _, "src", ..] = file.split('/').collect::<Vec<_>>()[..] else { continue };
        if !file.ends_with(".rs") {
            continue;
        }
        let text = project.text(file)?;
        if words.iter().any(|word| text.contains(word)) {
            let tree = syn::parse_file(&text).with_context(|| format!("{file}: cannot be parsed"))?;
            sources.push(Source { file: file.clone(), tree });
        }
    }
    Ok(sources)
}

/// Whether an item is there for tests alone: `#[cfg(test)]`, `#[test]`.
pub(super) fn is_for_tests(attributes: &[Attribute]) -> bool {
    attributes.iter().any(|attribute| {
        let cfg_test = || attribute.parse_args::<syn::Ident>().is_ok_and(|word| word == "test");
        attribute.path().is_ident("test") || (attribute.path().is_ident("cfg") && cfg_test())
    })
}
