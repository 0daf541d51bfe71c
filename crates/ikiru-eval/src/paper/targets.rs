//! Sets of targets: those that ship, and files.

use std::path::Path;

use glam::DVec3;

use crate::error::Error;
use crate::paper::task::Task;

/// Points in metres, in the world of the reference human.
#[derive(Clone, Debug, PartialEq)]
pub struct TargetSet {
    /// The file's name, or that of a built-in set.
    pub name: String,
    /// The points, warm-up first.
    pub points: Vec<DVec3>,
}

const BUILTINS: [(&str, &str); 5] = [
    ("simple_box", include_str!("../../targets/simple_box.json")),
    ("combined_box", include_str!("../../targets/combined_box.json")),
    ("reachable", include_str!("../../targets/reachable.json")),
    ("motion5", include_str!("../../targets/motion5.json")),
    ("motion10", include_str!("../../targets/motion10.json")),
];

impl TargetSet {
    /// The set of a task: 1,010 points of the paper's cube that can be solved.
    ///
    /// # Errors
    /// None, unless the set that ships is damaged.
    pub fn of_task(task: Task) -> Result<Self, Error> {
        Self::builtin(match task {
            Task::Simple => "simple_box",
            Task::Combined => "combined_box",
        })
    }

    /// The set for trajectories of so many points, for either task: targets for which one exists that meets the bar
    /// with both objectives. `motion5` up to 5 points, `motion10` beyond.
    ///
    /// # Errors
    /// None, unless the set that ships is damaged.
    pub fn of_points(points: usize) -> Result<Self, Error> {
        Self::builtin(if points <= 5 { "motion5" } else { "motion10" })
    }

    /// `simple_box`, `combined_box`, `motion5`, `motion10`, or `reachable`: the honest set, forward kinematics of
    /// random poses, nothing filtered.
    ///
    /// # Errors
    /// An unknown name, which is answered with those that exist.
    pub fn builtin(name: &str) -> Result<Self, Error> {
        let text = BUILTINS.iter().find(|(known, _)| *known == name).map(|(_, text)| *text);
        let known = || BUILTINS.map(|(name, _)| name).join(", ");
        let unknown = || Error::Unknown { what: "target set", name: name.to_owned(), known: known() };
        Self::parse(name, text.ok_or_else(unknown)?.as_bytes())
    }

    /// Reads a file: a JSON list of `[x, y, z]`.
    ///
    /// # Errors
    /// A file that cannot be read, is not such a list, or has numbers that are not finite.
    pub fn read(path: &Path) -> Result<Self, Error> {
        let bytes = std::fs::read(path).map_err(|source| Error::Read { path: path.to_owned(), source })?;
        Self::parse(&path.display().to_string(), &bytes)
    }

    fn parse(name: &str, bytes: &[u8]) -> Result<Self, Error> {
        let points: Vec<[f64; 3]> = serde_json::from_slice(bytes)
            .map_err(|source| Error::TargetSyntax { name: name.to_owned(), source })?;
        let points: Vec<DVec3> = points.into_iter().map(DVec3::from).collect();
        match points.iter().position(|p| !p.is_finite()) {
            Some(idx) => Err(Error::Target { name: name.to_owned(), idx }),
            None => Ok(Self { name: name.to_owned(), points }),
        }
    }

    /// The set as a file's text, one point a line.
    #[must_use]
    pub fn to_json(&self) -> String {
        let lines: Vec<String> = self.points.iter().map(|p| format!("[{}, {}, {}]", p.x, p.y, p.z)).collect();
        format!("[{}]\n", lines.join(",\n"))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn built_in_sets_have_as_many_points_as_is_said_of_them() {
        for (name, _) in BUILTINS {
            let n = if name == "reachable" { 2010 } else { 1010 };
            assert_eq!(TargetSet::builtin(name).unwrap().points.len(), n);
        }
    }

    #[test]
    fn what_is_no_set_says_where() {
        for (text, part) in [
            ("{}", "expected a JSON list of points"),
            ("[[1, 2]]", "line 1 column 7"),
            ("[[1, 2, \"x\"]]", "line 1"),
            ("[[1, 2, 1e999]]", "line 1"),
            ("[[0, 0, 0]", "EOF"),
        ] {
            let error = TargetSet::parse("set.json", text.as_bytes()).unwrap_err().to_string();
            assert!(error.contains("set.json") && error.contains(part), "{error}");
        }
        let error = TargetSet::builtin("box").unwrap_err().to_string();
        assert!(error.contains("simple_box, combined_box, reachable, motion5, motion10"), "{error}");
        assert!(TargetSet::read(Path::new("/no/such")).unwrap_err().to_string().contains("/no/such"));
    }

    #[test]
    fn a_set_that_is_written_is_read_again() {
        let set = TargetSet { name: "a".into(), points: vec![DVec3::new(0.1, -2.0, 1e-9), DVec3::ONE] };
        assert_eq!(TargetSet::parse("a", set.to_json().as_bytes()).unwrap(), set);
    }
}
