//! `[[objective]]`: text → terms of a problem.

use glam::DQuat;
use ikiru_rig::{EulerOrder, JointId, Rig};
use ikiru_solve::objectives::{
    Bound, Direction, Distance, Gaze, KnownRotation, LookAt, Orientation, PoleVector, PoseTarget, Position,
    RelativePose, RestPose,
};
use ikiru_solve::{Loss, Objective, Problem, TargetPath, TermId, Timeline, Tolerance, When};

use crate::error::{Error, ErrorKind};
use crate::motion::{path, when};
use crate::table::{Table, Value};
use crate::values::{joint, joint_angles, joint_of_key, name_of};

const KINDS: [&str; 10] = [
    "position",
    "orientation",
    "pose",
    "look_at",
    "direction",
    "relative_pose",
    "distance",
    "pole_vector",
    "known_rotation",
    "rest_pose",
];

/// The weight of an objective that has none of its own.
pub(crate) const DEFAULT_WEIGHT: f64 = 1.0;

/// One `[[objective]]` of a scenario, in the order of the text, which is that of the problem's terms.
#[derive(Clone, Debug)]
pub struct ScenarioObjective {
    /// Its kind, as the scenario has it.
    pub kind: &'static str,
    /// The joint that it is about; `None` where it names several, or takes all.
    pub joint: Option<JointId>,
    /// Its term in the problem.
    pub term: TermHandle,
    /// Line and column of the text where it stands, from 1.
    pub place: (usize, usize),
    /// The weight that the text gives it. Without one it is 1; in a motion as much as meets the objective: see
    /// [`MotionScenario::plan`](crate::MotionScenario::plan).
    pub weight: Option<f64>,
    /// How near is near enough.
    pub tolerance: Tolerance,
    /// When it holds, in a scenario with `[motion]`; the last frame otherwise.
    pub when: When,
    /// What its target follows over time, in a scenario with `[motion]`; `None` for one that stays.
    pub path: Option<TargetPath>,
}

/// The typed id of an objective's term: `scenario.problem[id]` is the objective itself.
#[derive(Clone, Copy, Debug)]
#[non_exhaustive]
pub enum TermHandle {
    /// `position`
    Position(TermId<Position>),
    /// `orientation`
    Orientation(TermId<Orientation>),
    /// `pose`
    Pose(TermId<PoseTarget>),
    /// `look_at`
    LookAt(TermId<LookAt>),
    /// `direction`
    Direction(TermId<Direction>),
    /// `relative_pose`
    RelativePose(TermId<RelativePose>),
    /// `distance`
    Distance(TermId<Distance>),
    /// `pole_vector`
    PoleVector(TermId<PoleVector>),
    /// `known_rotation`
    KnownRotation(TermId<KnownRotation>),
    /// `rest_pose`
    RestPose(TermId<RestPose>),
}

/// What every objective has.
struct Common {
    weight: Option<f64>,
    loss: Loss,
    mandatory: Option<bool>,
    tolerance: Tolerance,
}

/// Reads all objectives of a scenario and adds them to the problem.
pub(crate) fn add_all(
    rig: &Rig,
    active: &[JointId],
    scenario: &Table<'_>,
    timeline: Option<&Timeline>,
    problem: &mut Problem,
) -> Result<Vec<ScenarioObjective>, Error> {
    let list = scenario.require("objective", "at least one [[objective]]")?;
    let entries = list.list("a list of tables, [[objective]]")?;
    if entries.is_empty() {
        let kind = ErrorKind::Length { key: list.key.clone(), found: 0, expected: "at least one" };
        return Err(list.error(kind));
    }
    let mut objectives = Vec::with_capacity(entries.len());
    for (idx, entry) in entries.iter().enumerate() {
        let table = entry.table(format!("objective {}", idx + 1))?;
        let path = path(&table, timeline)?;
        let objective = add(rig, active, &table, path.as_ref(), problem)?;
        let when = when(&table, timeline, path.as_ref())?;
        objectives.push(ScenarioObjective { when, path, ..objective });
    }
    Ok(objectives)
}

/// The keys of a kind, besides those that every objective has.
fn keys(kind: &str) -> &'static [&'static str] {
    match kind {
        "position" => &["joint", "point", "target", "path", "tolerance"],
        "orientation" => &["joint", "target_rotation", "euler_deg", "tolerance_deg"],
        "pose" => &["joint", "point", "target", "target_rotation", "euler_deg", "tolerance", "tolerance_deg"],
        "look_at" => &["joint", "axis", "target", "path", "length", "offset_from_tip", "tolerance_deg"],
        "direction" => &["joint", "axis", "target", "tolerance_deg"],
        "relative_pose" => {
            &["joint", "base", "position", "target_rotation", "euler_deg", "tolerance", "tolerance_deg"]
        }
        "distance" => &["joints", "points", "exactly", "at_least", "at_most", "tolerance"],
        "pole_vector" => &["joints", "target", "tolerance_deg"],
        _ => &["joints", "tolerance_deg"],
    }
}

fn add(
    rig: &Rig,
    active: &[JointId],
    table: &Table<'_>,
    path: Option<&TargetPath>,
    problem: &mut Problem,
) -> Result<ScenarioObjective, Error> {
    const JOINT: &str = "the name of a joint, or a humanoid role";
    const TARGET: &str = "a point of the world in metres, [x, y, z]";
    const AXIS: &str = "a direction in the joint's frame, [x, y, z]";
    let kind =
        table.require("kind", "one of the objectives' kinds, such as 'position'")?.word("kind", &KINDS)?;
    let own = keys(kind);
    let mut allowed = vec!["kind"];
    allowed.extend(own);
    allowed.extend(["weight", "loss", "mandatory", "at", "from", "to"]);
    table.only(&allowed).map_err(|error| named(error, kind))?;
    let common = common(table)?;
    let named_joint = || joint(rig, &table.require("joint", JOINT)?);
    let point = || table.get("point").map_or(Ok(glam::DVec3::ZERO), |v| v.vector());
    let (joint, term) = match kind {
        "position" => {
            let joint = named_joint()?;
            let target = match (table.get("target"), path) {
                (Some(target), None) => target.vector()?,
                // Where it is later is said when there is a motion.
                (None, Some(path)) => path.at(path.span().0),
                (None, None) => table.require("target", TARGET)?.vector()?,
                (Some(_), Some(_)) => {
                    return Err(alternatives(
                        table,
                        &["target", "path"],
                        "either 'target' (a point of the world in metres, [x, y, z]) or 'path' (points at times)",
                    ));
                }
            };
            let id = common.add(problem, Position { joint, point: point()?, target });
            (Some(joint), TermHandle::Position(id))
        }
        "orientation" => {
            let joint = named_joint()?;
            let id = common.add(problem, Orientation { joint, target: rotation(table)? });
            (Some(joint), TermHandle::Orientation(id))
        }
        "pose" => {
            let joint = named_joint()?;
            let position = table.require("target", TARGET)?.vector()?;
            let rotation = rotation(table)?;
            let id = common.add(problem, PoseTarget { joint, point: point()?, position, rotation });
            (Some(joint), TermHandle::Pose(id))
        }
        "look_at" => {
            let joint = named_joint()?;
            let axis = table.require("axis", AXIS)?.direction()?;
            let id = common.add(problem, LookAt { joint, axis, gaze: gaze(table, path)? });
            (Some(joint), TermHandle::LookAt(id))
        }
        "direction" => {
            let joint = named_joint()?;
            let axis = table.require("axis", AXIS)?.direction()?;
            let target = table.require("target", "a direction of the world, [x, y, z]")?.direction()?;
            let id = common.add(problem, Direction { joint, axis, target });
            (Some(joint), TermHandle::Direction(id))
        }
        "relative_pose" => {
            let joint = named_joint()?;
            let base = self::joint(rig, &table.require("base", "the joint that it is seen from")?)?;
            let position = table.get("position").map(|v| v.vector()).transpose()?;
            let turned = table.get("target_rotation").is_some() || table.get("euler_deg").is_some();
            let turn = turned.then(|| rotation(table)).transpose()?;
            if position.is_none() && turn.is_none() {
                let keys = ["position", "target_rotation", "euler_deg"];
                return Err(alternatives(
                    table,
                    &keys,
                    "a 'position' in the base's frame (metres), a rotation, or both",
                ));
            }
            let objective = RelativePose::new(base, joint, position, turn);
            (Some(joint), TermHandle::RelativePose(common.add(problem, objective)))
        }
        "distance" => {
            let joints = these_joints::<2>(rig, table)?;
            let bounds = ["exactly", "at_least", "at_most"].map(|key| table.get(key));
            let metres = |v: &Value<'_>| v.number_that(|n| n >= 0.0, "metres, at least 0");
            let bound = match &bounds {
                [Some(v), None, None] => Bound::Exactly(metres(v)?),
                [None, Some(v), None] => Bound::AtLeast(metres(v)?),
                [None, None, Some(v)] => Bound::AtMost(metres(v)?),
                _ => {
                    let keys = ["exactly", "at_least", "at_most"];
                    return Err(alternatives(
                        table,
                        &keys,
                        "one of 'exactly', 'at_least' or 'at_most' (metres)",
                    ));
                }
            };
            let mut objective = Distance::new(joints, bound);
            if let Some(points) = table.get("points") {
                let list = points.list("two points, each in its joint's frame, [[x, y, z], [x, y, z]]")?;
                let [a, b] = &list[..] else {
                    let kind = ErrorKind::Length {
                        key: points.key.clone(),
                        found: list.len(),
                        expected: "two points",
                    };
                    return Err(points.error(kind));
                };
                objective.points = [a.vector()?, b.vector()?];
            }
            (None, TermHandle::Distance(common.add(problem, objective)))
        }
        "pole_vector" => {
            let joints = these_joints::<3>(rig, table)?;
            let target = table.require("target", TARGET)?.vector()?;
            (Some(joints[1]), TermHandle::PoleVector(common.add(problem, PoleVector { joints, target })))
        }
        "known_rotation" => {
            let given = table.require("joints", "a table of joints, { NAME = { euler_deg = [x, y, z] } }")?;
            let joints = given.table(format!("{}, 'joints',", table.place))?;
            let mut targets = Vec::new();
            for value in joints.entries() {
                let joint = joint_of_key(rig, &value)?;
                once(rig, &targets, joint, &value.key, &value, &joints.place)?;
                targets.push((joint, joint_angles(rig, joint, &value)?));
            }
            if targets.is_empty() {
                let kind =
                    ErrorKind::Length { key: given.key.clone(), found: 0, expected: "at least one joint" };
                return Err(given.error(kind));
            }
            let joint = if let [(only, _)] = targets[..] { Some(only) } else { None };
            (joint, TermHandle::KnownRotation(common.add(problem, KnownRotation::new(&targets))))
        }
        _ => {
            let joints = match table.get("joints") {
                None => active.to_vec(),
                Some(list) => joint_list(rig, &list)?,
            };
            let joint = if let [only] = joints[..] { Some(only) } else { None };
            let objective = RestPose::new(&joints, rig.rest_pose());
            (joint, TermHandle::RestPose(common.add(problem, objective)))
        }
    };
    let (place, weight, tolerance) = (table.place_in_text(), common.weight, common.tolerance);
    Ok(ScenarioObjective { kind, joint, term, place, weight, tolerance, when: When::End, path: None })
}

impl Common {
    fn add<T: Objective + Clone>(&self, problem: &mut Problem, objective: T) -> TermId<T> {
        let id = problem.add(self.weight.unwrap_or(DEFAULT_WEIGHT), objective);
        let term = problem.term_mut(id);
        (term.loss, term.tolerance) = (self.loss, self.tolerance);
        term.mandatory = self.mandatory.unwrap_or(term.mandatory);
        id
    }
}

/// An unknown key of an objective names the kind, since keys differ by it.
fn named(error: Error, kind: &str) -> Error {
    error.with_place_suffix(&format!(" ({kind})"))
}

fn common(table: &Table<'_>) -> Result<Common, Error> {
    let at_least_0 = "a number of at least 0";
    let weight = table.get("weight").map(|v| v.number_that(|n| n >= 0.0, at_least_0)).transpose()?;
    let mut tolerance = Tolerance::default();
    if let Some(value) = table.get("tolerance") {
        tolerance.metres = value.number_that(|n| n >= 0.0, "metres, at least 0")?;
    }
    if let Some(value) = table.get("tolerance_deg") {
        tolerance.radians = value.number_that(|n| n >= 0.0, "degrees, at least 0")?.to_radians();
    }
    let mandatory = table.get("mandatory").map(|v| v.truth()).transpose()?;
    let loss = table.get("loss").map_or(Ok(Loss::Squared), |v| loss(&v))?;
    Ok(Common { weight, loss, mandatory, tolerance })
}

fn loss(value: &Value<'_>) -> Result<Loss, Error> {
    if value.is_table() {
        let table = value.table("'loss'".to_owned())?;
        table.only(&["huber"])?;
        let width = table.require("huber", "the width where the loss turns from square to linear")?;
        return Ok(Loss::Huber { width: width.number_that(|n| n > 0.0, "a number above 0")? });
    }
    if value.text("'squared', 'norm' or { huber = width }")? == "huber" {
        let expected = "a table with the width where the loss turns from square to linear, { huber = 0.1 }";
        return Err(value.error(ErrorKind::Type { key: "loss".to_owned(), found: "a string", expected }));
    }
    Ok(if value.word("loss", &["squared", "norm"])? == "norm" { Loss::Norm } else { Loss::Squared })
}

/// The rotation of `target_rotation` or `euler_deg`.
fn rotation(table: &Table<'_>) -> Result<DQuat, Error> {
    match (table.get("target_rotation"), table.get("euler_deg")) {
        (Some(quaternion), None) => quaternion.quaternion(),
        (None, Some(angles)) => Ok(EulerOrder::Zyx.quaternion(angles.angles()?)),
        _ => Err(alternatives(
            table,
            &["target_rotation", "euler_deg"],
            "either 'target_rotation' (a quaternion, [x, y, z, w]) or 'euler_deg' (angles x, y, z of Rz·Ry·Rx)",
        )),
    }
}

fn gaze(table: &Table<'_>, path: Option<&TargetPath>) -> Result<Gaze, Error> {
    let tip = ["length", "offset_from_tip"];
    match (table.get("target"), path, tip.map(|key| table.get(key))) {
        (Some(target), None, [None, None]) => Ok(Gaze::Point(target.vector()?)),
        (None, Some(path), [None, None]) => Ok(Gaze::Point(path.at(path.span().0))),
        (None, None, [Some(length), Some(offset)]) => {
            Ok(Gaze::OffsetFromTip { length: length.number()?, offset: offset.vector()? })
        }
        _ => Err(alternatives(
            table,
            &["target", "path", "length", "offset_from_tip"],
            "one of 'target' (a point of the world), 'path' (points at times), or 'length' and 'offset_from_tip' (a point beside the bone's tip)",
        )),
    }
}

fn alternatives(table: &Table<'_>, keys: &[&str], expected: &'static str) -> Error {
    let kind = ErrorKind::Alternatives { place: table.place.clone(), found: table.present(keys), expected };
    table.error(kind)
}

/// The joints of `joints`, of which there must be so many.
fn these_joints<const N: usize>(rig: &Rig, table: &Table<'_>) -> Result<[JointId; N], Error> {
    let expected = if N == 2 { "two joints" } else { "three joints: root, middle and end of the limb" };
    let list = table.require("joints", expected)?;
    let joints = list.list(expected)?.iter().map(|value| joint(rig, value)).collect::<Result<Vec<_>, _>>()?;
    let found = joints.len();
    joints.try_into().map_err(|_| list.error(ErrorKind::Length { key: list.key.clone(), found, expected }))
}

/// A list of joints, each of which can stand there once.
pub(crate) fn joint_list(rig: &Rig, list: &Value<'_>) -> Result<Vec<JointId>, Error> {
    let mut joints: Vec<(JointId, ())> = Vec::new();
    for value in list.list("a list of joints, by name or humanoid role")? {
        let id = joint(rig, &value)?;
        once(rig, &joints, id, value.text("a name")?, &value, &format!("'{}'", list.key))?;
        if rig.get(id).is_none_or(|j| j.n_dofs() == 0) {
            return Err(value.error(immobile(rig, id)));
        }
        joints.push((id, ()));
    }
    if joints.is_empty() {
        let kind = ErrorKind::Length { key: list.key.clone(), found: 0, expected: "at least one joint" };
        return Err(list.error(kind));
    }
    Ok(joints.into_iter().map(|(id, ())| id).collect())
}

/// Why a joint has no degrees of freedom of its own.
fn immobile(rig: &Rig, joint: JointId) -> ErrorKind {
    let name = name_of(rig, joint).to_owned();
    if let Some(mimic) = rig.get(joint).and_then(|j| j.mimic) {
        return ErrorKind::Follower { joint: name, leader: name_of(rig, mimic.leader).to_owned() };
    }
    match rig.floating_root().filter(|root| rig.ancestors(*root).any(|above| above == joint)) {
        Some(root) => {
            let root = name_of(rig, root);
            let reason =
                format!("lies above the free root, '{root}', and stays where it is: expected '{root}'");
            ErrorKind::Unfit { joint: name, reason }
        }
        None => ErrorKind::Immobile(name),
    }
}

fn once<T>(
    rig: &Rig,
    seen: &[(JointId, T)],
    joint: JointId,
    name: &str,
    value: &Value<'_>,
    place: &str,
) -> Result<(), Error> {
    if seen.iter().all(|(other, _)| *other != joint) {
        return Ok(());
    }
    let (first, second) = (name_of(rig, joint).to_owned(), name.to_owned());
    Err(value.key_error(ErrorKind::Twice { place: place.to_owned(), first, second }))
}
