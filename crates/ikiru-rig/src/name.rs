//! Wrong names, answered with the nearest right ones.

/// A name that nothing answers to.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct UnknownName {
    /// What was asked for.
    pub name: String,
    /// The nearest names that exist, best first; at most three.
    pub nearest: Vec<String>,
}

impl std::fmt::Display for UnknownName {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        write!(f, "there is no '{}'", self.name)?;
        match self.nearest.split_last() {
            None => Ok(()),
            Some((only, [])) => write!(f, "; did you mean '{only}'?"),
            Some((last, others)) => write!(f, "; did you mean '{}' or '{last}'?", others.join("', '")),
        }
    }
}

impl std::error::Error for UnknownName {}

/// The error for `name` among `candidates`.
#[must_use]
pub fn unknown<'a>(name: &str, candidates: impl IntoIterator<Item = &'a str>) -> UnknownName {
    let plain =
        |s: &str| s.chars().filter(|c| c.is_alphanumeric()).flat_map(char::to_lowercase).collect::<String>();
    let wanted = plain(name);
    let mut scored: Vec<(f64, &str)> = candidates
        .into_iter()
        .map(|candidate| (strsim::jaro_winkler(&wanted, &plain(candidate)), candidate))
        .filter(|(score, _)| *score > 0.75)
        .collect();
    scored.sort_by(|a, b| b.0.total_cmp(&a.0).then_with(|| a.1.cmp(b.1)));
    scored.dedup_by_key(|(_, name)| *name);
    UnknownName {
        name: name.to_owned(),
        nearest: scored.into_iter().take(3).map(|(_, n)| n.to_owned()).collect(),
    }
}

#[cfg(test)]
mod tests {
    use super::unknown;

    #[test]
    fn the_nearest_names_come_first() {
        let names = ["left_wrist", "right_wrist", "left_elbow", "head"];
        let error = unknown("leftwrist", names);
        assert_eq!(error.nearest[0], "left_wrist");
        assert!(error.to_string().starts_with("there is no 'leftwrist'; did you mean 'left_wrist'"));
        assert_eq!(unknown("zzz", names).to_string(), "there is no 'zzz'");
    }
}
