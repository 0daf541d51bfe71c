//! Why not: the forces of a report, as words and as JSON.

use ikiru_rig::{JointId, JointMotion, Pose, Rig};
use ikiru_scenario::{MotionScenario, Scenario, ScenarioObjective};
use ikiru_solve::{Force, ForceBy, Hint, LimitKind, Term};
use serde_json::{Value, json};

use crate::numbers::{self, short};

/// How many limits that are in nobody's way are listed by name.
const MOST_LIMITS: usize = 4;
/// A force that bears more than this bears all.
const ALL: f64 = 0.995;

/// What forces are about.
pub(crate) struct About<'a> {
    rig: &'a Rig,
    objectives: &'a [ScenarioObjective],
    terms: &'a [Term],
    /// For each objective the joint that no active joint moves, if there is one.
    out_of_hand: Vec<Option<&'a str>>,
}

impl<'a> About<'a> {
    pub(crate) fn pose(scenario: &'a Scenario) -> Self {
        let (objectives, terms) = (&scenario.objectives, scenario.problem.terms());
        let out_of_hand = (0..objectives.len()).map(|idx| scenario.out_of_hand(idx)).collect();
        Self { rig: &scenario.rig, objectives, terms, out_of_hand }
    }

    pub(crate) fn motion(motion: &'a MotionScenario) -> Self {
        let (objectives, terms) = (&motion.objectives, motion.motion.terms().terms());
        let out_of_hand = (0..objectives.len()).map(|idx| motion.out_of_hand(idx)).collect();
        Self { rig: &motion.rig, objectives, terms, out_of_hand }
    }

    fn name(&self, joint: JointId) -> &'a str {
        self.rig.get(joint).map_or("", |joint| &joint.name)
    }

    /// An objective in a sentence.
    fn objective(&self, term: usize) -> String {
        let objective = self.objectives.get(term);
        let kind = objective.map_or("", |o| o.kind);
        match objective.and_then(|o| o.joint) {
            Some(joint) => format!("objective {} ({kind} of {})", term + 1, self.name(joint)),
            None => format!("objective {} ({kind})", term + 1),
        }
    }

    fn is_constraint(&self, term: usize) -> bool {
        self.terms.get(term).is_some_and(|term| term.hard)
    }

    /// The lines of a report about forces: a key and what is said. `pose` gives the pose at which a force acts.
    pub(crate) fn lines(
        &self,
        forces: &[Force],
        hint: Option<Hint>,
        success: bool,
        pose: impl Fn(&Force) -> Pose,
    ) -> Vec<(&'static str, String)> {
        let mut lines = Vec::new();
        let idle: Vec<String> = forces
            .iter()
            .filter_map(|force| match (force.on, force.by) {
                (None, ForceBy::Limit { joint, kind }) => {
                    let when = force.secs.map_or_else(String::new, |secs| format!(" at {} s", short(secs)));
                    Some(limit_text(self, joint, kind, &pose(force)) + &when)
                }
                _ => None,
            })
            .collect();
        if !idle.is_empty() {
            let more = idle.len().saturating_sub(MOST_LIMITS);
            let more = if more > 0 { format!(", and {more} more") } else { String::new() };
            lines.push(("at limits", format!("{}{more}", idle[..idle.len().min(MOST_LIMITS)].join(", "))));
        }
        let mut is_told = success;
        for of_term in forces.chunk_by(|a, b| a.on == b.on) {
            let Some(term) = of_term[0].on else { continue };
            let words = match self.out_of_hand.get(term).copied().flatten() {
                Some(joint) => format!("{}: expected a joint above it in 'active'", nothing_moves(joint)),
                None => {
                    let pose = pose(&of_term[0]);
                    of_term.iter().map(|force| self.words(force, &pose)).collect::<Vec<_>>().join("; ")
                }
            };
            lines.push(("in the way", format!("of {}: {words}", self.objective(term))));
            is_told = true;
        }
        if !is_told {
            let words = "nothing that acts at this pose: more iterations or another start may help";
            lines.push(("in the way", words.to_owned()));
        }
        lines.extend(hint.map(|hint| ("hint", self.hint(hint))));
        lines
    }

    /// What a force comes from, and how much it bears.
    fn words(&self, force: &Force, pose: &Pose) -> String {
        let by = match force.by {
            ForceBy::Limit { joint, kind } => format!("the limit of {}", limit_text(self, joint, kind, pose)),
            ForceBy::Term(other) if self.is_constraint(other) => {
                format!("{} forbids it", self.objective(other))
            }
            ForceBy::Term(other) => format!("{} pulls the other way", self.objective(other)),
            ForceBy::Smoothness => "the smoothness of the motion".to_owned(),
            ForceBy::RateLimits => "limits on speed and acceleration".to_owned(),
            ForceBy::Reach { is_proven: true } => {
                format!("its target is {} m out of reach", numbers::length(force.amount))
            }
            ForceBy::Reach { is_proven: false } => "its target is out of reach from here".to_owned(),
            other => format!("{other:?}"),
        };
        if force.share > ALL { by } else { format!("{by} ({:.0} %)", 100.0 * force.share) }
    }

    /// What would help, in words.
    pub(crate) fn hint(&self, hint: Hint) -> String {
        match hint {
            Hint::FreeRoot(root) => format!(
                "the root of the body stays where it is: root = \"free\" lets '{}' float, and the target is in reach",
                self.name(root)
            ),
            Hint::MoveRoot(root) => {
                let name = self.name(root);
                format!("'{name}' floats, but is not in 'active': with it the target is in reach")
            }
            other => format!("{other:?}"),
        }
    }

    /// What is in the way of each objective that is not met, for programs.
    pub(crate) fn json(&self, forces: &[Force]) -> Value {
        let of = |force: &Force| {
            let on = force.on?;
            let (kind, name) = match force.by {
                ForceBy::Limit { joint, .. } => ("limit", Some(self.name(joint).to_owned())),
                ForceBy::Term(other) if self.is_constraint(other) => {
                    ("constraint", Some(self.objective(other)))
                }
                ForceBy::Term(other) => ("objective", Some(self.objective(other))),
                ForceBy::Smoothness => ("objective", Some("smoothness".to_owned())),
                ForceBy::RateLimits => ("limit", Some("speed and acceleration".to_owned())),
                ForceBy::Reach { .. } => {
                    let joint = self.objectives.get(on).and_then(|o| o.joint);
                    ("reach", joint.map(|joint| self.name(joint).to_owned()))
                }
                _ => ("objective", None),
            };
            Some(json!({
                "objective": on,
                "kind": kind,
                "name": name,
                "share": force.share,
                "amount": force.amount,
                "unit": force.unit.symbol(),
            }))
        };
        forces.iter().filter_map(of).collect()
    }
}

/// Why an objective stays as it is.
pub(crate) fn nothing_moves(joint: &str) -> String {
    format!("no active joint moves '{joint}'")
}

/// The joint, which of its limits, and the value there.
fn limit_text(about: &About<'_>, joint: JointId, kind: LimitKind, pose: &Pose) -> String {
    let name = about.name(joint);
    let motion = about.rig.get(joint).map(|j| j.motion);
    match kind {
        LimitKind::Angle(axis) => {
            let angle = pose.euler(joint).and_then(|a| a.get(axis).copied()).unwrap_or_default();
            format!("{name} angle {} {}", ["x", "y", "z"].get(axis).unwrap_or(&""), numbers::angle(angle))
        }
        LimitKind::Value => {
            let value = pose.value(joint).unwrap_or_default();
            match motion {
                Some(JointMotion::Slider { .. }) => format!("{name} offset {} m", numbers::length(value)),
                Some(
                    JointMotion::Fixed
                    | JointMotion::Hinge { .. }
                    | JointMotion::Euler { .. }
                    | JointMotion::Ball { .. }
                    | JointMotion::Free { .. },
                )
                | None => format!("{name} angle {}", numbers::angle(value)),
            }
        }
        LimitKind::Swing => {
            let swing = swing_and_twist(motion, joint, pose).0;
            format!("{name} swing {}", numbers::angle(swing[0].hypot(swing[1])))
        }
        LimitKind::Twist => {
            format!("{name} twist {}", numbers::angle(swing_and_twist(motion, joint, pose).1))
        }
        other => format!("{name} {other:?}"),
    }
}

/// Swing and twist of a ball in its cone; zeros for a joint without one.
fn swing_and_twist(motion: Option<JointMotion>, joint: JointId, pose: &Pose) -> ([f64; 2], f64) {
    let cone = motion.and_then(|motion| motion.cone().copied()).zip(pose.rotation(joint).ok());
    cone.map(|(cone, own)| cone.decompose(own)).unwrap_or_default()
}
