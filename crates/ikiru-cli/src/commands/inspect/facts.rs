//! What there is to know about a rig before a target or a limit is chosen: shared by the text and the JSON.

use glam::{DQuat, DVec3};
use ikiru_formats::Loaded;
use ikiru_rig::{JointId, JointMotion, Range, Rig, Role, humanoid};
use ikiru_scenario::Scenario;

use crate::warnings;

/// Whose word a limit is.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum LimitSource {
    File,
    Scenario,
}

impl LimitSource {
    pub(super) fn name(self) -> &'static str {
        match self {
            Self::File => "file",
            Self::Scenario => "scenario",
        }
    }
}

/// A joint's place at rest, in the world.
#[derive(Clone, Copy, Debug)]
pub(super) struct Rest {
    pub(super) position: DVec3,
    pub(super) rotation: DQuat,
}

/// A rig, and what is computed from it.
pub(super) struct Facts {
    pub(super) loaded: Loaded,
    /// One a joint.
    pub(super) rest: Vec<Rest>,
    /// One a joint; `None` for one without limits.
    pub(super) limits_from: Vec<Option<LimitSource>>,
    /// From the lowest to the highest joint at rest that moves or hangs on one that does, in metres.
    pub(super) height: f64,
    /// The way that roles say it faces: a unit vector of the world.
    pub(super) facing: Option<DVec3>,
    pub(super) warnings: Vec<String>,
}

impl Facts {
    /// Of a file.
    pub(super) fn of_rig(loaded: Loaded) -> Self {
        let warnings = warnings::of_rig(&loaded.warnings);
        Self::new(loaded, &[], warnings)
    }

    /// Of a scenario: its rig as it limits it.
    pub(super) fn of_scenario(scenario: Scenario) -> Self {
        let warnings = warnings::of_scenario(&scenario.warnings);
        Self::new(scenario.loaded, &scenario.limited, warnings)
    }

    fn new(loaded: Loaded, limited: &[JointId], warnings: Vec<String>) -> Self {
        let rig = &loaded.rig;
        let frames = rig.rest_pose().frames();
        let rest: Vec<Rest> =
            frames.iter().map(|f| Rest { position: f.position, rotation: f.rotation }).collect();
        let limits_from = rig
            .ids()
            .zip(rig.joints())
            .map(|(id, joint)| {
                let source = if limited.contains(&id) { LimitSource::Scenario } else { LimitSource::File };
                is_limited(&joint.motion).then_some(source)
            })
            .collect();
        let height = height(rig, &rest);
        let facing = humanoid::facing(rig);
        Self { rest, limits_from, height, facing, warnings, loaded }
    }

    /// Where the bone of a joint goes, in the joint's own frame at rest: to the next joint of the body by roles, else to
    /// its only child.
    pub(super) fn bone(&self, joint: JointId) -> Option<DVec3> {
        let next = next_of_body(&self.loaded.rig, joint).or_else(|| only_child(&self.loaded.rig, joint))?;
        let (from, to) = (self.rest[joint.index()], self.rest[next.index()]);
        Some(from.rotation.inverse() * (to.position - from.position)).filter(|bone| bone.length() > 1e-6)
    }
}

fn is_limited(motion: &JointMotion) -> bool {
    motion.cone().is_some() || motion.ranges().iter().any(|range| !Range::is_unlimited(range))
}

/// Meshes, lights and cameras, which often lie at the origin, are no part of the body.
fn height(rig: &Rig, rest: &[Rest]) -> f64 {
    let moves = |joint: JointId| rig.get(joint).is_some_and(|j| j.motion != JointMotion::Fixed);
    let body = rig.ids().filter(|joint| rig.ancestors(*joint).any(moves));
    let heights = body.map(|joint| rest[joint.index()].position.y);
    let (low, high) = heights.fold((f64::INFINITY, f64::NEG_INFINITY), |(a, b), y| (a.min(y), b.max(y)));
    (high - low).max(0.0)
}

/// The joint whose role comes next: of several, the spine before the legs, the neck before the shoulders, and the
/// middle finger. Nothing comes after a head.
fn next_of_body(rig: &Rig, joint: JointId) -> Option<JointId> {
    let role = rig.get(joint)?.role.filter(|role| *role != Role::Head)?;
    // A role that the rig lacks is passed over.
    let is_next = |next: &Role| {
        next.ancestors().find(|ancestor| rig.role(*ancestor).is_some()) == Some(role)
            && rig.role(*next).is_some()
    };
    let next: Vec<Role> = Role::ALL.into_iter().filter(is_next).collect();
    let first = |wanted: &Role| next.contains(wanted);
    let of_several = [
        Role::Spine,
        Role::Chest,
        Role::UpperChest,
        Role::Neck,
        Role::Head,
        Role::LeftMiddleProximal,
        Role::RightMiddleProximal,
    ];
    let chosen = if let [only] = next[..] { Some(only) } else { of_several.into_iter().find(first) };
    rig.role(chosen?)
}

fn only_child(rig: &Rig, joint: JointId) -> Option<JointId> {
    let mut children = rig.ids().filter(|id| rig.get(*id).is_some_and(|j| j.parent == Some(joint)));
    let only = children.next()?;
    children.next().is_none().then_some(only)
}
