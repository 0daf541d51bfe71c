//! Wrong names, answered with the nearest right ones.

/// A name that nothing answers to.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct UnknownName {
    /// What was asked for.
    pub name: String,
    /// The nearest names that exist, best first; at most three.
    pub nearest: Vec<String>,
}

impl UnknownName {
    /// The question that helps: `did you mean 'a', 'b' or 'c'?`; `None` where no name comes near.
    ///
    /// ```
    /// let unknown = ikiru_rig::unknown_name("leftHnad", ["leftHand", "head"]);
    /// assert_eq!(unknown.guess().as_deref(), Some("did you mean 'leftHand'?"));
    /// assert_eq!(ikiru_rig::unknown_name("tail", ["leftHand"]).guess(), None);
    /// ```
    #[must_use]
    pub fn guess(&self) -> Option<String> {
        let (last, others) = self.nearest.split_last()?;
        Some(match others {
            [] => format!("did you mean '{last}'?"),
            _ => format!("did you mean '{}' or '{last}'?", others.join("', '")),
        })
    }
}

impl std::fmt::Display for UnknownName {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        write!(f, "there is no '{}'", self.name)?;
        self.guess().map_or(Ok(()), |guess| write!(f, "; {guess}"))
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
