//! The project's files, as the rules see them.

use std::fs;
use std::path::{Path, PathBuf};

use anyhow::{Context, Result};

/// Folders (and files) of these names hold nothing of the project's own.
const SKIPPED: [&str; 9] =
    [".git", "target", "node_modules", "__pycache__", ".venv", ".env", "corpus", "artifacts", "coverage"];

/// A project's root and the files below it.
pub(crate) struct Project {
    root: PathBuf,
    files: Vec<String>,
}

impl Project {
    /// Lists the files below a root; links are not followed.
    pub(crate) fn open(root: &Path) -> Result<Self> {
        let mut files = Vec::new();
        list(root, "", &mut files)?;
        files.sort();
        Ok(Self { root: root.to_path_buf(), files })
    }

    /// All files, from the root, with forward slashes, sorted.
    pub(crate) fn files(&self) -> &[String] {
        &self.files
    }

    /// Where a file or folder lies.
    pub(crate) fn path(&self, file: &str) -> PathBuf {
        self.root.join(file)
    }

    /// The text of a file.
    pub(crate) fn text(&self, file: &str) -> Result<String> {
        fs::read_to_string(self.path(file)).with_context(|| format!("{file}: cannot be read"))
    }

    /// The bytes of a file.
    pub(crate) fn bytes(&self, file: &str) -> Result<Vec<u8>> {
        fs::read(self.path(file)).with_context(|| format!("{file}: cannot be read"))
    }
}

fn list(folder: &Path, prefix: &str, files: &mut Vec<String>) -> Result<()> {
    let context = || format!("{}: cannot be listed", folder.display());
    for entry in fs::read_dir(folder).with_context(context)? {
        let entry = entry.with_context(context)?;
        let name = entry.file_name().to_string_lossy().into_owned();
        if SKIPPED.contains(&name.as_str()) {
            continue;
        }
        let file_type = entry.file_type().with_context(context)?;
        if file_type.is_dir() {
            list(&entry.path(), &format!("{prefix}{name}/"), files)?;
        } else if file_type.is_file() {
            files.push(format!("{prefix}{name}"));
        }
    }
    Ok(())
}

/// A small project in a temporary folder, for the rules' tests.
#[cfg(test)]
pub(crate) struct Tree(tempfile::TempDir);

#[cfg(test)]
impl Tree {
    /// Writes files with their contents.
    pub(crate) fn new(files: &[(&str, &str)]) -> Self {
        let folder = tempfile::tempdir().unwrap();
        for (file, text) in files {
            let path = folder.path().join(file);
            fs::create_dir_all(path.parent().unwrap()).unwrap();
            fs::write(path, text).unwrap();
        }
        Self(folder)
    }

    pub(crate) fn root(&self) -> &Path {
        self.0.path()
    }

    pub(crate) fn open(&self) -> Project {
        Project::open(self.root()).unwrap()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn lists_what_is_the_projects_own() {
        let tree = Tree::new(&[
            ("b/c.rs", ""),
            ("a.md", ""),
            (".ci/run", ""),
            ("target/x.rs", ""),
            ("fuzz/target/x.rs", ""),
            ("fuzz/corpus/glb/x.rs", ""),
            (".git/HEAD", ""),
            ("docs/node_modules/y.rs", ""),
        ]);
        assert_eq!(tree.open().files(), [".ci/run", "a.md", "b/c.rs"]);
    }
}
