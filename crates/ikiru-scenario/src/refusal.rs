//! What a solver or an objective's keys are refused for, in words.

use ikiru_rig::Rig;
use ikiru_solve::{Invalid, InvalidTerm};

use crate::objective::ScenarioObjective;
use crate::scene::unfit_text;

/// What a solver refused, in words: the objective by its number from 1 and its kind, what is not usable about it, and the
/// joint that this is about.
///
/// ```
/// use glam::DVec3;
/// use ikiru_scenario::{Scenario, refusal};
/// use ikiru_solve::objectives::Position;
///
/// let mut scenario = Scenario::builtin("paper_simple")?;
/// scenario.set_target(0, DVec3::INFINITY)?;
/// let (mut pose, mut workspace) = (scenario.start.clone(), scenario.workspace());
/// let invalid = scenario.solve(&mut pose, &mut workspace).invalid.expect("it is not finite");
/// let said = refusal(&scenario.rig, &scenario.objectives, invalid);
/// assert_eq!(said, "objective 1 (position) has a target that is not finite");
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
#[must_use]
pub fn refusal(rig: &Rig, objectives: &[ScenarioObjective], invalid: Invalid) -> String {
    match invalid {
        Invalid::Term(term, why) => {
            let kind = objectives.get(term).map_or("", |o| o.kind);
            let why = match why {
                InvalidTerm::Unfit(unfit) => unfit_text(rig, unfit),
                other => other.to_string(),
            };
            format!("objective {} ({kind}) {why}", term + 1)
        }
        other => other.to_string(),
    }
}

#[cfg(test)]
mod tests {
    use ikiru_solve::{InvalidPose, Unfit, UnfitReason};

    use super::*;
    use crate::Scenario;

    #[test]
    fn a_refusal_names_the_objective_and_the_joint() {
        let Scenario { rig, objectives, .. } =
            Scenario::builtin("paper_simple").unwrap_or_else(|e| panic!("{e}"));
        let joint = rig.joint("left_elbow").ok();
        let unfit = Unfit { reason: UnfitReason::CouplesFixed, joint };
        let said = |invalid| refusal(&rig, &objectives, invalid);
        assert_eq!(
            said(Invalid::Term(0, unfit.into())),
            "objective 1 (position) couples a joint that does not move: joint 'left_elbow'"
        );
        let foreign = said(Invalid::Pose(InvalidPose::OtherRig));
        assert_eq!(foreign, "a given pose belongs to another rig than the problem");
    }
}
