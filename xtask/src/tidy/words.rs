//! Rule: no file names a place that only one machine has.

use anyhow::Result;

use super::{Finding, Project};

/// What no file may hold. Written in two parts, so that this file passes its own rule.
const FORBIDDEN: [&str; 3] = [concat!("/wo", "rk/"), concat!("../sha", "red"), concat!(".lib", "rary")];

pub(super) fn check(project: &Project) -> Result<Vec<Finding>> {
    let mut findings = Vec::new();
    for file in project.files() {
        for (idx, line) in project.bytes(file)?.split(|byte| *byte == b'\n').enumerate() {
            for word in FORBIDDEN.iter().filter(|word| contains(line, word.as_bytes())) {
                let what = format!("holds `{word}`");
                findings.push(Finding::new(file, idx + 1, what, "no path of one machine"));
            }
        }
    }
    Ok(findings)
}

/// Bytes, since binary files carry names and paths too.
fn contains(text: &[u8], word: &[u8]) -> bool {
    text.windows(word.len()).any(|window| window == word)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::tidy::Tree;

    #[test]
    fn every_word_is_found_in_any_file() {
        for word in FORBIDDEN {
            let text = format!("first\nsee {word}.txt\n");
            for file in ["README.md", ".ci/run", "rigs/body.glb", "src/lib.rs"] {
                let findings = check(&Tree::new(&[(file, &text)]).open()).unwrap();
                assert_eq!(
                    findings,
                    [Finding::new(file, 2, format!("holds `{word}`"), "no path of one machine")]
                );
            }
        }
    }

    #[test]
    fn bytes_that_are_no_text_are_searched() {
        let tree = Tree::new(&[]);
        std::fs::write(tree.root().join("x.bin"), [&[0xff, 0xfe], FORBIDDEN[0].as_bytes()].concat()).unwrap();
        assert_eq!(check(&tree.open()).unwrap().len(), 1);
    }

    #[test]
    fn near_misses_pass() {
        let text = concat!("work/ home/wo", "rking/ ./sha", "red lib", "rary libraries\n");
        assert_eq!(check(&Tree::new(&[("a.md", text)]).open()).unwrap(), []);
    }
}
