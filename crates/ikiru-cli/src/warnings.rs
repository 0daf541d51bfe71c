//! What is odd about the input, as texts: many of a kind are counted, not repeated.

/// So many of a kind are told one by one.
const MOST_ALIKE: usize = 3;

/// Those of a file.
pub(crate) fn of_rig(warnings: &[ikiru_formats::Warning]) -> Vec<String> {
    told(warnings, ikiru_formats::Warning::is_alike, |warning| with_scale(warning, "--scale "))
}

/// Those of a scenario.
pub(crate) fn of_scenario(warnings: &[ikiru_scenario::Warning]) -> Vec<String> {
    told(warnings, ikiru_scenario::Warning::is_alike, |warning| match warning {
        ikiru_scenario::Warning::Rig(warning) => with_scale(warning, "scale = "),
        warning => warning.to_string(),
    })
}

/// A scale that is likely meant, as it is typed.
fn with_scale(warning: &ikiru_formats::Warning, key: &str) -> String {
    match warning {
        ikiru_formats::Warning::Height { likely: Some(likely), .. } => format!("{warning}: {key}{likely}"),
        warning => warning.to_string(),
    }
}

/// In the order in which each kind came first. Of a kind with many, the first and how many more there are.
fn told<W>(warnings: &[W], is_alike: impl Fn(&W, &W) -> bool, text: impl Fn(&W) -> String) -> Vec<String> {
    let mut kinds: Vec<Vec<&W>> = Vec::new();
    for warning in warnings {
        match kinds.iter_mut().find(|kind| is_alike(kind[0], warning)) {
            Some(kind) => kind.push(warning),
            None => kinds.push(vec![warning]),
        }
    }
    let texts = |kind: Vec<&W>| match kind.len() {
        n if n > MOST_ALIKE => vec![format!("{} ({} more like this)", text(kind[0]), n - 1)],
        _ => kind.into_iter().map(&text).collect(),
    };
    kinds.into_iter().flat_map(texts).collect()
}

#[cfg(test)]
mod tests {
    use super::told;

    #[test]
    fn many_of_a_kind_are_one_line_with_a_count() {
        let warnings = ["a1", "b1", "a2", "a3", "a4", "b2"];
        let texts = told(&warnings, |a, b| a.as_bytes()[0] == b.as_bytes()[0], ToString::to_string);
        assert_eq!(texts, ["a1 (3 more like this)", "b1", "b2"]);
    }
}
