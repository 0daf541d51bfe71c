//! `ikiru convert IN OUT`: a rig or motion from one format to another, and onto another character.

use anyhow::{Context, anyhow};
use ikiru_formats::{
    Loaded, motion_csv, motion_json, save, write_animated_glb, write_bvh_clip, write_bvh_pose,
    write_posed_glb, write_vrma,
};
use ikiru_rig::humanoid::{Reference, transfer};
use ikiru_rig::{Clip, JointId, Motion};

use crate::args::{ConvertArgs, has_ending};
use crate::failure::{Failure, Outcome};
use crate::input::read_rig;
use crate::output;
use crate::warnings;

pub(crate) fn run(args: &ConvertArgs) -> Result<Outcome, Failure> {
    let expected = "expected .glb, .bvh, .vrma, .json or .csv";
    if !has_ending(&args.output, &["glb", "bvh", "vrma", "json", "csv"]) {
        let path = args.output.display();
        return Err(Failure::input(anyhow!(
            "{path} does not end in a format that can be written: {expected}"
        )));
    }
    let loaded = read_rig(&args.input, args.roles.as_deref(), args.scale)?;
    for warning in warnings::of_rig(&loaded.warnings) {
        output::note(format!("warning: {warning}"));
    }
    let clip = chosen_clip(&loaded, args)?;
    let (loaded, clip) = match &args.onto {
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
            (target, Some(moved))
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

/// The motion that was asked for by name, or the first.
fn chosen_clip(loaded: &Loaded, args: &ConvertArgs) -> Result<Option<Clip>, Failure> {
    let Some(wanted) = &args.clip else { return Ok(loaded.clips.first().cloned()) };
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
    let rest = loaded.rig.rest_pose();
    let bytes = if has_ending(&args.output, &["bvh"]) {
        clip.map_or_else(|| write_bvh_pose(loaded, &rest), |clip| write_bvh_clip(loaded, clip))
    } else if has_ending(&args.output, &["vrma"]) {
        write_vrma(needed(clip, args, "a .vrma file is one")?)
    } else if has_ending(&args.output, &["csv"]) {
        let clip = needed(clip, args, "a .csv file is one")?;
        motion_csv(clip, &moving(clip))
    } else if has_ending(&args.output, &["json"]) {
        let clip = needed(clip, args, "a .json file is one here")?;
        let mut text = motion_json(clip, &moving(clip)).to_string().into_bytes();
        text.push(b'\n');
        return Ok(text);
    } else {
        clip.map_or_else(|| write_posed_glb(loaded, &rest), |clip| write_animated_glb(loaded, clip))
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
    rig.ids().filter(|id| rig.get(*id).is_some_and(|joint| joint.motion != Motion::Fixed)).collect()
}
