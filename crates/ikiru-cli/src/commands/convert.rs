//! `ikiru convert IN OUT`: a rig or motion from one format to another, and onto another character.

use std::path::{Path, PathBuf};

use anyhow::{Context, anyhow};
use ikiru_formats::{
    Format, Loaded, motion_csv, motion_json, motion_rig, name_motion_rig, read_motion, save, write_clip,
    write_pose,
};
use ikiru_rig::humanoid::{Reference, transfer};
use ikiru_rig::{Clip, JointId, JointMotion};

use crate::args::{ConvertArgs, has_ending};
use crate::failure::{Failure, Outcome};
use crate::input::read_rig;
use crate::output;
use crate::warnings;

pub(crate) fn run(args: &ConvertArgs) -> Result<Outcome, Failure> {
    let expected = "expected .glb, .gltf, .vrm, .bvh, .vrma, .json or .csv";
    if Format::of(&args.output).is_none() && !has_ending(&args.output, &["json", "csv"]) {
        let path = args.output.display();
        return Err(Failure::input(anyhow!(
            "{path} does not end in a format that can be written: {expected}"
        )));
    }
    let (loaded, onto) = read_input(args)?;
    for warning in warnings::of_rig(&loaded.warnings) {
        output::note(format!("warning: {warning}"));
    }
    let clip = chosen_clip(&loaded, args)?;
    let (loaded, clip) = match onto {
        None => (loaded, clip),
        Some(onto) => {
            let target = ikiru_formats::read(onto).map_err(Failure::input)?;
            // None of its clips is used.
            let of_rig: Vec<_> = target.warnings.iter().filter(|w| !w.is_about_clips()).cloned().collect();
            for warning in warnings::of_rig(&of_rig) {
                output::note(format!("warning: {}: {warning}", onto.display()));
            }
            let Some(clip) = clip else {
                let path = args.input.display();
                return Err(Failure::input(anyhow!("{path} has no motion to bring onto {}", onto.display())));
            };
            // Characters that rest with their arms down and others that rest in a T meet in the T.
            let moved = transfer(&clip, &target.rig, Reference::TPose)
                .with_context(|| format!("the motion does not fit {}", onto.display()))
                .map_err(Failure::input)?;
            for warning in &moved.warnings {
                output::note(format!("warning: {warning}"));
            }
            (target, Some(moved.clip))
        }
    };
    let clip = match args.rate {
        None => clip,
        Some(hz) => {
            Some(needed(clip.as_ref(), args, "--rate is for one")?.resample(hz).map_err(Failure::input)?)
        }
    };
    let bytes = written(&loaded, clip.as_ref(), args)?;
    save(&args.output, &bytes).map_err(Failure::write)?;
    output::print(&format!("wrote {}\n", output::printable(&args.output.display().to_string())))?;
    Ok(Outcome::Reached)
}

/// What is to be converted, its clips with all that they do, and the character that it then goes onto.
fn read_input(args: &ConvertArgs) -> Result<(Loaded, Option<&Path>), Failure> {
    let onto = args.onto.as_deref();
    if !has_ending(&args.input, &["json"]) {
        let loaded = read_rig(&args.input, args.roles.as_deref(), args.scale)?;
        return Ok((loaded.carrying_clips().map_err(Failure::input)?, onto));
    }
    let name = args.input.display().to_string();
    let bytes = std::fs::read(&args.input)
        .with_context(|| format!("{name} cannot be read"))
        .map_err(Failure::input)?;
    // Without a rig of its own it is one of the rig that it goes onto.
    let said = motion_rig(&bytes);
    let scale = args.scale.or(said.as_ref().map(|rig| rig.scale));
    let (rig, onto) = match (said.map(|rig| rig.name), onto) {
        (Some(rig), onto) => (beside(&args.input, &rig), onto.filter(|onto| *onto != Path::new(&rig))),
        (None, Some(onto)) => (onto.to_owned(), None),
        (None, None) => {
            return Err(Failure::input(anyhow!(
                "{name} does not say which rig its motion is of: expected a member \"rig\", or '--onto RIG' beside it"
            )));
        }
    };
    let loaded = read_rig(&rig, args.roles.as_deref(), scale)?;
    Ok((read_motion(&bytes, &name, loaded).map_err(Failure::input)?, onto))
}

/// A rig that a file names: as it stands there, where it is found so, else beside that file.
fn beside(file: &Path, rig: &str) -> PathBuf {
    let found = Path::new(rig).exists() || rig.starts_with("builtin:");
    let folder = file.parent().filter(|_| !found);
    folder.map_or_else(|| PathBuf::from(rig), |folder| folder.join(rig))
}

/// The motion that was asked for by name, or the first; one without a name is called as its file is.
fn chosen_clip(loaded: &Loaded, args: &ConvertArgs) -> Result<Option<Clip>, Failure> {
    let Some(wanted) = &args.clip else {
        let stem = args.input.file_stem().unwrap_or_default().to_string_lossy();
        let named = |clip: Clip| if clip.name().is_empty() { clip.with_name(stem) } else { clip };
        return Ok(loaded.clips.first().cloned().map(named));
    };
    let found = loaded.clips.iter().find(|clip| clip.name() == wanted);
    found.cloned().map(Some).ok_or_else(|| {
        let unknown = ikiru_rig::unknown_name(wanted, loaded.clips.iter().map(Clip::name));
        Failure::input(anyhow!("{}: of its {} clips, {unknown}", args.input.display(), loaded.clips.len()))
    })
}

/// The motion, where there must be one.
fn needed<'c>(clip: Option<&'c Clip>, args: &ConvertArgs, why: &str) -> Result<&'c Clip, Failure> {
    clip.ok_or_else(|| Failure::input(anyhow!("{} has no motion, and {why}", args.input.display())))
}

fn written(loaded: &Loaded, clip: Option<&Clip>, args: &ConvertArgs) -> Result<Vec<u8>, Failure> {
    let bytes = if has_ending(&args.output, &["csv"]) {
        let clip = needed(clip, args, "a .csv file is one")?;
        motion_csv(clip, &moving(clip))
    } else if let Some(format) = Format::of(&args.output) {
        if format == Format::Vrma {
            needed(clip, args, "a .vrma file is one")?;
        }
        let written = match clip {
            Some(clip) => write_clip(loaded, clip, format),
            None => write_pose(loaded, &loaded.rig.rest_pose(), format),
        };
        written.map(|written| {
            output::warn(&written.warnings);
            written.bytes
        })
    } else {
        let clip = needed(clip, args, "a .json file is one here")?;
        let mut motion = motion_json(clip, &moving(clip));
        name_motion_rig(&mut motion, loaded);
        return Ok(format!("{motion}\n").into_bytes());
    };
    let mut advice = format!("{} cannot be written from {}", args.output.display(), args.input.display());
    // A motion goes onto another body through roles, which robots do not have.
    if clip.is_some() && loaded.rig.joints().iter().any(|joint| joint.role.is_some()) {
        advice += "; '--onto CHARACTER.glb' brings its motion onto a body with a skin";
    }
    bytes.context(advice).map_err(Failure::input)
}

/// The joints that can move, followers included.
fn moving(clip: &Clip) -> Vec<JointId> {
    let rig = clip.rig();
    rig.ids().filter(|id| rig.get(*id).is_some_and(|joint| joint.motion != JointMotion::Fixed)).collect()
}
