//! What fuzzing starts from: samples of the repository, cut down to what a fuzzer can make use of.

use std::fs;
use std::path::Path;

use anyhow::{Context, Result, ensure};

use crate::tidy::Project;

/// The most frames of a motion that are kept.
const MOST_FRAMES: usize = 4;

/// Writes the seeds of a target into its corpus; how many there are. Those of an earlier run are replaced, what
/// fuzzing has found stays.
pub(crate) fn write(root: &Path, target: &str, most_bytes: usize) -> Result<usize> {
    let seeds = of_target(&Project::open(root)?, target, most_bytes)?;
    ensure!(
        !seeds.is_empty(),
        "fuzz target `{target}` has no seeds: xtask/src/fuzz/seeds.rs says which files are"
    );
    let corpus = root.join("fuzz/corpus").join(target);
    fs::create_dir_all(&corpus).with_context(|| corpus.display().to_string())?;
    for (name, bytes) in &seeds {
        let file = corpus.join(name);
        fs::write(&file, bytes).with_context(|| file.display().to_string())?;
    }
    Ok(seeds.len())
}

/// Name and contents of each seed: of the files whose ending the target reads those that are short enough.
fn of_target(project: &Project, target: &str, most_bytes: usize) -> Result<Vec<(String, Vec<u8>)>> {
    let mut seeds = Vec::new();
    for file in project.files() {
        let (folder, name) = file.rsplit_once('/').unwrap_or(("", file));
        let ending = name.rsplit_once('.').map_or("", |(_, ending)| ending);
        let bytes = || project.bytes(file);
        let seed = match (target, ending) {
            // A mesh is of no use here: the document alone says what becomes joints and clips.
            ("gltf", "gltf") => Some(bytes()?),
            ("gltf", "glb" | "vrm" | "vrma") => document(&bytes()?),
            ("glb", "gltf") => Some(container(&bytes()?)),
            ("glb", "glb" | "vrm" | "vrma") => document(&bytes()?).map(|text| container(&text)),
            ("vrma", "gltf") => Some(container(&bytes()?)).filter(|bytes| is_motion(bytes)),
            ("vrma", "vrma") => Some(bytes()?),
            ("bvh", "bvh") => first_frames(&project.text(file)?).map(String::into_bytes),
            ("urdf", "urdf") => Some(bytes()?),
            ("scenario", "toml") if folder.ends_with("scenarios") => Some(bytes()?),
            _ => None,
        };
        // Two files of the same name in different folders are two seeds.
        let name = format!("seed-{}", file.replace('/', "-"));
        seeds.extend(seed.filter(|seed| seed.len() <= most_bytes).map(|seed| (name, seed)));
    }
    Ok(seeds)
}

fn is_motion(bytes: &[u8]) -> bool {
    const EXTENSION: &[u8] = b"VRMC_vrm_animation";
    bytes.windows(EXTENSION.len()).any(|window| window == EXTENSION)
}

/// The JSON text of a binary glTF file: its first chunk.
fn document(bytes: &[u8]) -> Option<Vec<u8>> {
    let length = u32::from_le_bytes(bytes.get(12..16)?.try_into().ok()?);
    Some(bytes.get(20..)?.get(..usize::try_from(length).ok()?)?.to_vec())
}

/// A binary glTF file of a document alone.
fn container(text: &[u8]) -> Vec<u8> {
    let padded = text.len().next_multiple_of(4);
    let mut bytes = b"glTF".to_vec();
    for length in [2, padded + 20, padded] {
        bytes.extend((length as u32).to_le_bytes());
    }
    bytes.extend(b"JSON");
    bytes.extend(text);
    bytes.resize(padded + 20, b' ');
    bytes
}

/// A BVH text with its first frames alone; `None` for what is no such text.
fn first_frames(text: &str) -> Option<String> {
    let head_end = text.find("Frames:")?;
    let time = text.get(head_end..)?.find("Frame Time:")? + head_end;
    let time_end = text.get(time..)?.find('\n')? + time + 1;
    let frames: Vec<&str> = text.get(time_end..)?.lines().take(MOST_FRAMES).collect();
    let (head, time) = (text.get(..head_end)?, text.get(time..time_end)?);
    Some(format!("{head}Frames: {}\n{time}{}\n", frames.len(), frames.join("\n")))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::tidy::Tree;

    #[test]
    fn containers_give_back_their_document() {
        let bytes = container(b"{}\n");
        assert_eq!(bytes.len() % 4, 0);
        assert_eq!(bytes[8..12], (bytes.len() as u32).to_le_bytes());
        assert_eq!(document(&bytes).unwrap(), b"{}\n ");
        assert_eq!(document(b"glTF"), None);
    }

    #[test]
    fn motions_are_cut_to_their_first_frames() {
        let text = "HIERARCHY\nROOT r {…}\nMOTION\nFrames: 9\nFrame Time: 0.1\n1\n2\n3\n4\n5\n6\n7\n8\n9\n";
        let expected = "HIERARCHY\nROOT r {…}\nMOTION\nFrames: 4\nFrame Time: 0.1\n1\n2\n3\n4\n";
        assert_eq!(first_frames(text).unwrap(), expected);
        assert_eq!(first_frames("HIERARCHY"), None);
    }

    #[test]
    fn every_target_takes_the_files_that_it_reads() {
        let motion = r#"{"extensions":{"VRMC_vrm_animation":{}}}"#;
        let tree = Tree::new(&[
            ("a/leg.gltf", "{}"),
            ("a/step.gltf", motion),
            ("a/robot.urdf", "<robot/>"),
            ("b/robot.urdf", "<robot/>"),
            ("b/long.urdf", "<robot>                 </robot>"),
            ("c/scenarios/reach.toml", "version = 1"),
            ("c/Cargo.toml", "[package]"),
            ("fuzz/corpus/urdf/found.urdf", "<"),
        ]);
        let project = tree.open();
        let names = |target| {
            let seeds = of_target(&project, target, 20 + motion.len().next_multiple_of(4)).unwrap();
            seeds.into_iter().map(|(name, _)| name).collect::<Vec<_>>()
        };
        assert_eq!(names("gltf"), ["seed-a-leg.gltf", "seed-a-step.gltf"]);
        assert_eq!(names("glb"), ["seed-a-leg.gltf", "seed-a-step.gltf"]);
        assert_eq!(names("vrma"), ["seed-a-step.gltf"]);
        assert_eq!(of_target(&project, "urdf", 20).unwrap().len(), 2);
        assert_eq!(names("scenario"), ["seed-c-scenarios-reach.toml"]);
        write(tree.root(), "urdf", 20).unwrap();
        assert!(tree.root().join("fuzz/corpus/urdf/seed-b-robot.urdf").exists());
        assert!(write(tree.root(), "bvh", 20).is_err());
    }
}
