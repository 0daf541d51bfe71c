//! The term of a scenario's objective: what can be done with it, whatever kind it is of.

use std::any::Any;
use std::fmt;
use std::sync::Arc;

use ikiru_rig::{JointId, Rig};
use ikiru_solve::{MotionError, MotionProblem, Problem, TargetPath, TermId};
use serde_json::Value as Json;

use crate::at::At;
use crate::axes::Axes;
use crate::error::Error;
use crate::kind_keys::{Aim, Built, KindKeys};
use crate::scene::Scene;

/// A term in a problem, and what its kind knows to do with it.
#[derive(Clone)]
pub(crate) struct ScenarioTerm(Arc<dyn AnyTerm>);

/// What an objective has become.
pub(crate) struct AddedTerm {
    pub(crate) term: ScenarioTerm,
    pub(crate) joint: Option<JointId>,
    pub(crate) path: Option<TargetPath>,
}

/// Where an objective's term goes to.
pub(crate) struct Adding<'a> {
    pub(crate) scene: Scene<'a>,
    pub(crate) problem: &'a mut Problem,
}

impl Adding<'_> {
    /// Adds the objective that some keys ask for; how it counts is set afterwards.
    pub(crate) fn term<K: KindKeys + 'static>(self, keys: &K, at: &At<'_>) -> Result<AddedTerm, Error> {
        let Built { objective, joint, path } = keys.build(&self.scene, at)?;
        let id = self.problem.add(1.0, objective);
        Ok(AddedTerm { term: ScenarioTerm(Arc::new(TermOf::<K>(id))), joint, path })
    }
}

impl ScenarioTerm {
    /// The typed id, where the objective is of that type.
    pub(crate) fn id<T: 'static>(&self) -> Option<TermId<T>> {
        self.0.id().downcast_ref().copied()
    }

    /// Takes the target from the axes that it is given in to others.
    pub(crate) fn turn(&self, problem: &mut Problem, axes: Axes) {
        self.0.turn(problem, axes);
    }

    /// Changes the target, in the rig's world; false: there is none of that sort.
    pub(crate) fn aim(&self, problem: &mut Problem, aim: Aim) -> bool {
        self.0.aim(problem, aim)
    }

    /// Has the target move along a path.
    pub(crate) fn follow(&self, motion: &mut MotionProblem, path: &TargetPath) -> Result<(), MotionError> {
        self.0.follow(motion, path)
    }

    /// What it aims at, in the axes that `from_rig` leads to; null where the term is gone.
    pub(crate) fn target_json(&self, problem: &Problem, from_rig: Axes, rig: &Rig) -> Json {
        self.0.target_json(problem, from_rig, rig)
    }

    /// What it aims at, in words for people; empty where the term is gone.
    pub(crate) fn target_text(
        &self,
        problem: &Problem,
        from_rig: Axes,
        number: &dyn Fn(f64) -> String,
    ) -> String {
        self.0.target_text(problem, from_rig, number)
    }
}

impl fmt::Debug for ScenarioTerm {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        self.0.fmt(f)
    }
}

/// A term without its kind.
trait AnyTerm: fmt::Debug + Send + Sync {
    fn id(&self) -> &dyn Any;
    fn turn(&self, problem: &mut Problem, axes: Axes);
    fn aim(&self, problem: &mut Problem, aim: Aim) -> bool;
    fn follow(&self, motion: &mut MotionProblem, path: &TargetPath) -> Result<(), MotionError>;
    fn target_json(&self, problem: &Problem, from_rig: Axes, rig: &Rig) -> Json;
    fn target_text(&self, problem: &Problem, from_rig: Axes, number: &dyn Fn(f64) -> String) -> String;
}

/// The term of a kind.
struct TermOf<K: KindKeys>(TermId<K::Objective>);

impl<K: KindKeys> TermOf<K> {
    /// The objective as the scenario would say it.
    fn in_axes(&self, problem: &Problem, from_rig: Axes) -> Option<K::Objective> {
        let mut objective = problem.get(self.0)?.clone();
        K::turn(&mut objective, from_rig);
        Some(objective)
    }
}

impl<K: KindKeys> fmt::Debug for TermOf<K> {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{} {:?}", K::NAME, self.0)
    }
}

impl<K: KindKeys> AnyTerm for TermOf<K> {
    fn id(&self) -> &dyn Any {
        &self.0
    }

    fn turn(&self, problem: &mut Problem, axes: Axes) {
        if let Some(objective) = problem.get_mut(self.0) {
            K::turn(objective, axes);
        }
    }

    fn aim(&self, problem: &mut Problem, aim: Aim) -> bool {
        problem.get_mut(self.0).is_some_and(|objective| K::aim(objective, aim))
    }

    fn follow(&self, motion: &mut MotionProblem, path: &TargetPath) -> Result<(), MotionError> {
        let Some(still) = motion.terms().get(self.0).cloned() else { return Err(MotionError::Term) };
        motion.set_moving(self.0, |secs| {
            let mut there = still.clone();
            // Kinds that have the key aim at points.
            K::aim(&mut there, Aim::Point(path.at(secs)));
            there
        })
    }

    fn target_json(&self, problem: &Problem, from_rig: Axes, rig: &Rig) -> Json {
        self.in_axes(problem, from_rig).map_or(Json::Null, |objective| K::target_json(&objective, rig))
    }

    fn target_text(&self, problem: &Problem, from_rig: Axes, number: &dyn Fn(f64) -> String) -> String {
        self.in_axes(problem, from_rig).map_or_else(String::new, |o| K::target_text(&o, number))
    }
}
