//! Where the scenarios come from: those that ship, and files.

use std::path::{Path, PathBuf};

use ikiru_scenario::{MotionScenario, Scenario};

use crate::error::Error;

/// A scenario with `[motion]`, as text: it is read several times over.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct MotionSource {
    /// A short name: a file's without folder and ending.
    pub name: String,
    /// The scenario.
    pub text: String,
    /// What messages call it.
    pub file: String,
    /// What paths inside it are relative to.
    pub folder: PathBuf,
}

const BUILTINS: [(&str, &str); 3] = [
    ("reach_palm_down", include_str!("../../scenarios/reach_palm_down.toml")),
    ("three_points", include_str!("../../scenarios/three_points.toml")),
    ("panda_arc", include_str!("../../scenarios/panda_arc.toml")),
];

impl MotionSource {
    /// The scenarios that ship: `reach_palm_down`, `three_points` and `panda_arc`.
    #[must_use]
    pub fn all() -> Vec<Self> {
        BUILTINS.map(|(name, text)| Self::builtin(name, text)).into()
    }

    fn builtin(name: &str, text: &str) -> Self {
        Self {
            name: name.to_owned(),
            text: text.to_owned(),
            file: format!("{name}.toml"),
            folder: PathBuf::new(),
        }
    }

    /// The scenario of that name among those that ship, else the file of that path.
    ///
    /// # Errors
    /// A file that cannot be read; a name without an ending that nothing has is answered with those that exist.
    pub fn find(name_or_path: &Path) -> Result<Self, Error> {
        let shipped = BUILTINS.iter().find(|(name, _)| Path::new(name) == name_or_path);
        match shipped {
            Some((name, text)) => Ok(Self::builtin(name, text)),
            None if name_or_path.extension().is_none() && !name_or_path.exists() => Err(Error::Unknown {
                what: "motion scenario",
                name: name_or_path.display().to_string(),
                known: format!("{}, or the path of a .toml file", BUILTINS.map(|(name, _)| name).join(", ")),
            }),
            None => Self::read(name_or_path),
        }
    }

    /// A scenario file.
    ///
    /// # Errors
    /// A file that cannot be read.
    pub fn read(path: &Path) -> Result<Self, Error> {
        let text =
            std::fs::read_to_string(path).map_err(|source| Error::Read { path: path.to_owned(), source })?;
        let stem = path.file_stem().unwrap_or(path.as_os_str());
        Ok(Self {
            name: stem.to_string_lossy().into_owned(),
            text,
            file: path.display().to_string(),
            folder: path.parent().unwrap_or(Path::new("")).to_owned(),
        })
    }

    /// The scenario.
    pub(crate) fn scenario(&self) -> Result<Scenario, Error> {
        Ok(Scenario::parse(&self.text, &self.file, &self.folder)?)
    }

    /// The scenario as a motion.
    ///
    /// # Errors
    /// Anything in it that is not as expected, and a scenario without `[motion]`.
    pub fn motion(&self) -> Result<MotionScenario, Error> {
        Ok(self.scenario()?.into_motion()?)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn built_in_scenarios_are_those_in_the_scenarios_folder() {
        for (name, text) in BUILTINS {
            let path = format!("{}/../../scenarios/motion/{name}.toml", env!("CARGO_MANIFEST_DIR"));
            assert_eq!(std::fs::read_to_string(path).unwrap(), text, "{name}");
        }
    }

    #[test]
    fn a_name_is_found_and_another_is_answered_with_those_that_exist() {
        assert_eq!(MotionSource::find(Path::new("three_points")).unwrap(), MotionSource::all()[1]);
        let unknown = MotionSource::find(Path::new("two_points")).unwrap_err().to_string();
        assert!(unknown.contains("two_points") && unknown.contains("panda_arc, or the path"), "{unknown}");
        let missing = MotionSource::find(Path::new("none/two_points.toml")).unwrap_err().to_string();
        assert!(missing.contains("none/two_points.toml"), "{missing}");
    }
}
