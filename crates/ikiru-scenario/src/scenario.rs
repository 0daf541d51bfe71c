//! A scenario: everything that a solve needs, made of one text.

use std::path::Path;

use glam::{DQuat, DVec3};
use ikiru_formats::Loaded;
use ikiru_rig::{JointId, Pose, Rig, unknown_name};
use ikiru_solve::{Method, Problem, Report, Solver, TermReads, Workspace};
use serde_json::{Value as Json, json};

use crate::at::{At, Source};
use crate::axes::Axes;
use crate::document::{Document, RootKey, SCALE, TargetAxes, read_text};
use crate::error::{Error, ErrorKind};
use crate::kind_keys::Aim;
use crate::limits::limited;
use crate::methods::method_named;
use crate::motion::{MotionSettings, warn_of_what_begins_elsewhere};
use crate::objective::{ObjectiveEntry, ScenarioObjective};
use crate::roles::with_roles;
use crate::scene::{Scene, joint_list};
use crate::start::rest;
use crate::values::{name_of, number_that};
use crate::warning::{ScenarioPose, Warning, out_of_hand};

/// What a scenario asks for, ready to solve, as often as wanted and for other targets too.
#[derive(Debug)]
pub struct Scenario {
    /// The file's name, as it was given.
    pub name: String,
    /// What the rig was read from; its rig is [`rig`](Self::rig).
    pub loaded: Loaded,
    /// The rig, with the scenario's roles, limits and root.
    pub rig: Rig,
    /// The joints that may move and the terms.
    pub problem: Problem,
    /// The solver, with the scenario's method and stopping rules.
    pub solver: Solver,
    /// Where a solve starts, inside the limits.
    pub start: Pose,
    /// The joints that may move, parents first.
    pub active: Vec<JointId>,
    /// The joints that the scenario itself gives limits.
    pub limited: Vec<JointId>,
    /// The objectives, in the order of the text and of the problem's terms.
    pub objectives: Vec<ScenarioObjective>,
    /// What is odd without being wrong.
    pub warnings: Vec<Warning>,
    /// What `[motion]` asks for, if it is there: see [`into_motion`](Self::into_motion).
    pub motion: Option<MotionSettings>,
    /// From the axes in which targets are given to the rig's.
    axes: Axes,
    /// One an objective.
    targets: Vec<WrittenTarget>,
}

/// A target as JSON: as the text has it, and as it comes back from the rig's world.
#[derive(Debug)]
struct WrittenTarget {
    written: Json,
    turned: Json,
}

/// Why a target was not changed.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
#[non_exhaustive]
pub enum TargetError {
    /// There are not so many objectives.
    #[error("there is no objective {0}: the scenario has {1}, counted from 0")]
    NoObjective(usize, usize),
    /// An objective of another kind.
    #[error("objective {0} is '{1}', which has no {2} to set")]
    Kind(usize, &'static str, &'static str),
}

const METHODS: [&str; 5] = ["lm", "adam", "ccd", "fabrik", "ipopt"];
/// What messages call a scenario that was made of a document.
const DOCUMENT: &str = "document";

impl Scenario {
    /// Reads a scenario file. Paths inside it are relative to its folder.
    ///
    /// # Errors
    /// When the file or the rig that it names cannot be read, or anything in it is not as expected: file, line and
    /// column of the first thing that is wrong.
    pub fn read(path: impl AsRef<Path>) -> Result<Self, Error> {
        let path = path.as_ref();
        let (name, text) = read_text(path)?;
        Self::parse(&text, &name, path.parent().unwrap_or(Path::new("")))
    }

    /// Reads a scenario from its text; `name` stands in messages, paths inside it are relative to `folder`.
    ///
    /// # Errors
    /// As [`read`](Self::read).
    pub fn parse(text: &str, name: &str, folder: impl AsRef<Path>) -> Result<Self, Error> {
        let document = Document::parse(text, name)?;
        build(&document, Source { name, text: Some(text) }, folder.as_ref())
    }

    /// Makes a scenario of a document; paths inside it are relative to `folder`.
    ///
    /// # Errors
    /// When the rig cannot be read, a name is unknown, or a number makes no sense: with the keys that lead there, as no text
    /// stands behind it.
    pub fn from_document(document: &Document, folder: impl AsRef<Path>) -> Result<Self, Error> {
        let source = Source { name: DOCUMENT, text: None };
        check_finite(&toml::Value::Table(document.table()), &At::root(source))?;
        build(document, source, folder.as_ref())
    }

    /// Memory for solving it.
    #[must_use]
    pub fn workspace(&self) -> Workspace {
        self.solver.workspace(&self.problem)
    }

    /// Solves from the pose that is given; the best pose found comes back in it.
    pub fn solve<'w>(&self, pose: &mut Pose, workspace: &'w mut Workspace) -> Report<'w> {
        self.solver.solve(&self.problem, pose, workspace)
    }

    /// The method, as the scenario names it.
    #[must_use]
    pub fn method(&self) -> &'static str {
        self.solver.options().method.name()
    }

    /// From the axes in which targets are given (the scenario's `world`) to the rig's world; the identity unless
    /// it says `file` and the file has axes of its own.
    #[must_use]
    pub fn world_from_targets(&self) -> DQuat {
        self.axes.world
    }

    /// Moves a target: the point of a `position`, `pose` or `look_at` (which then looks at a point of the world), the
    /// direction of a `direction`, the point of a `pole_vector`; in the axes that the scenario's `world` says. That it is finite is checked when a solve starts.
    ///
    /// # Errors
    /// When there is no such objective, or it aims at no point.
    pub fn set_target(&mut self, objective: usize, target: DVec3) -> Result<(), TargetError> {
        self.aim(objective, Aim::Point(self.axes.vector(target)))
    }

    /// Changes the rotation that an `orientation` or `pose` aims at, in the axes that the scenario's `world` says.
    ///
    /// # Errors
    /// When there is no such objective, or it aims at no rotation.
    pub fn set_target_rotation(&mut self, objective: usize, rotation: DQuat) -> Result<(), TargetError> {
        self.aim(objective, Aim::Rotation(self.axes.rotation(rotation)))
    }

    fn aim(&mut self, objective: usize, aim: Aim) -> Result<(), TargetError> {
        let n_objectives = self.objectives.len();
        let about =
            self.objectives.get(objective).ok_or(TargetError::NoObjective(objective, n_objectives))?;
        if about.term.aim(&mut self.problem, aim) {
            return Ok(());
        }
        Err(TargetError::Kind(objective, about.kind, aim.word()))
    }

    /// The name of the joint that an objective is about.
    #[must_use]
    pub fn joint_name(&self, objective: usize) -> Option<&str> {
        Some(name_of(&self.rig, self.objectives.get(objective)?.joint?))
    }

    /// The joint of an objective that no active joint moves, if there is one: nothing can then change its residual.
    #[must_use]
    pub fn out_of_hand(&self, objective: usize) -> Option<&str> {
        out_of_hand(&self.warnings, objective)
    }

    /// What an objective aims at, as JSON: a point or direction `[x, y, z]`; the quaternion `[x, y, z, w]` of an
    /// `orientation`; `{"length", "offset_from_tip"}` of a `look_at` beside the bone's tip; `{NAME: value}` of a
    /// `known_rotation`; `[[secs, x, y, z]]` of what follows a path; as the text has it, unless it was changed; null for a `rest_pose` and for a position beyond the last.
    #[must_use]
    pub fn target_json(&self, objective: usize) -> Json {
        let Some(about) = self.objectives.get(objective) else { return Json::Null };
        let now = target_json(about, &self.problem, self.axes.inverse(), &self.rig);
        // There and back again, rounding would show; a target that nobody changed is the one that was written.
        match self.targets.get(objective) {
            Some(target) if target.turned == now => target.written.clone(),
            _ => now,
        }
    }

    /// What an objective aims at, for people, in a few words: `0.3, 1.2, 0.4`, `at least 0.4 m apart`; empty for a
    /// position beyond the last. `number` writes a number.
    #[must_use]
    pub fn target_text(&self, objective: usize, number: impl Fn(f64) -> String) -> String {
        let Some(about) = self.objectives.get(objective) else { return String::new() };
        about.term.target_text(&self.problem, self.axes.inverse(), &number)
    }
}

/// What an objective aims at, in the axes that `from_rig` leads to.
fn target_json(objective: &ScenarioObjective, problem: &Problem, from_rig: Axes, rig: &Rig) -> Json {
    let Some(path) = &objective.path else { return objective.term.target_json(problem, from_rig, rig) };
    let at = |(secs, point): (f64, DVec3)| {
        let point = from_rig.vector(point);
        json!([secs, point.x, point.y, point.z])
    };
    Json::Array(path.points().map(at).collect())
}

/// Texts have finite numbers alone; a program may put anything into a document.
fn check_finite(value: &toml::Value, at: &At<'_>) -> Result<(), Error> {
    match value {
        toml::Value::Float(number) if !number.is_finite() => {
            Err(at.error(ErrorKind::NotFinite { key: at.name().to_owned(), found: number.to_string() }))
        }
        toml::Value::Array(list) => {
            list.iter().enumerate().try_for_each(|(idx, value)| check_finite(value, &at.entry(idx)))
        }
        toml::Value::Table(table) => {
            table.iter().try_for_each(|(key, value)| check_finite(value, &at.key(key)))
        }
        toml::Value::String(_)
        | toml::Value::Integer(_)
        | toml::Value::Float(_)
        | toml::Value::Boolean(_)
        | toml::Value::Datetime(_) => Ok(()),
    }
}

fn build(document: &Document, source: Source<'_>, folder: &Path) -> Result<Scenario, Error> {
    let root = At::root(source);
    if document.version != 1 {
        return Err(root.key("version").error(ErrorKind::Version(document.version.to_string())));
    }
    let solver = Solver::new(document.stop.options(method(document, &root)?, &root.key("stop"))?);
    let loaded = read_rig(document, folder, &root)?;
    let floats = document.root == RootKey::Free;
    let (rig, limited) = limited(
        &with_roles(&loaded.rig, &document.roles, &root.key("roles"))?,
        &document.limits,
        floats,
        &root,
    )?;
    let at_rig = root.key("rig");
    let loaded = if loaded.rig.is_same(&rig) {
        loaded
    } else {
        loaded.with_rig(rig.clone()).map_err(|e| at_rig.error(ErrorKind::Rig(e)))?
    };
    // A scenario uses no clip of the file's.
    let of_rig = loaded.warnings.iter().filter(|warning| !warning.is_about_clips());
    let mut warnings: Vec<Warning> = of_rig.cloned().map(Warning::Rig).collect();
    let mut problem = match &document.active {
        Some(names) => {
            let at = root.key("active");
            Problem::new(&rig, joint_list(&rig, names, &at)?).map_err(|e| at.error(ErrorKind::NoJoint(e)))?
        }
        None => Problem::whole_body(&rig),
    };
    let active: Vec<JointId> = problem.active().collect();
    if active.is_empty() {
        return Err(at_rig.error(ErrorKind::NothingMoves));
    }
    let axes = if document.world == TargetAxes::File { Axes::of_file(&loaded) } else { Axes::RIG };
    let start = match &document.start {
        Some(given) => {
            let (base, at) = (rig.rest_pose(), root.key("start"));
            given.pose(&base, ScenarioPose::Start, folder, axes, &at, &mut warnings)?
        }
        None => rest(&rig, &mut warnings),
    };
    let motion = match &document.motion {
        Some(motion) => {
            let at = root.key("motion");
            Some(motion.settings(&active, &start, folder, axes, &at, &mut warnings)?)
        }
        None => None,
    };
    let timeline = motion.as_ref().map(|m| &m.timeline);
    let scene = Scene { rig: &rig, active: &active, timeline, segments: loaded.segments(), up: axes.up() };
    let mut objectives = add_objectives(scene, &document.objectives, &mut problem, &root.key("objective"))?;
    let mut targets = Vec::with_capacity(objectives.len());
    for objective in &mut objectives {
        let written = target_json(objective, &problem, Axes::RIG, &rig);
        objective.term.turn(&mut problem, axes);
        objective.path = objective.path.take().map(|path| path.turned(axes.world));
        let turned = target_json(objective, &problem, axes.inverse(), &rig);
        targets.push(WrittenTarget { written, turned });
    }
    warn_of_what_nothing_moves(&rig, &problem, &objectives, &mut warnings);
    if let Some(motion) = &motion {
        warn_of_what_begins_elsewhere(motion, &start, &problem, &objectives, &mut warnings);
    }
    let name = source.name.to_owned();
    Ok(Scenario {
        name,
        loaded,
        rig,
        problem,
        solver,
        start,
        active,
        limited,
        objectives,
        warnings,
        motion,
        axes,
        targets,
    })
}

/// Adds all objectives to the problem. `at` is their list.
fn add_objectives(
    scene: Scene<'_>,
    entries: &[ObjectiveEntry],
    problem: &mut Problem,
    at: &At<'_>,
) -> Result<Vec<ScenarioObjective>, Error> {
    if entries.is_empty() {
        let (place, expected) = ("the scenario".to_owned(), "at least one [[objective]]");
        return Err(at.error(ErrorKind::MissingKey { place, key: "objective", expected }));
    }
    let places = at.positions_of_entries();
    let mut objectives = Vec::with_capacity(entries.len());
    for (idx, entry) in entries.iter().enumerate() {
        let added = entry.add(scene, problem, &at.entry(idx))?;
        objectives.push(ScenarioObjective { place: places.get(idx).copied().flatten(), ..added });
    }
    Ok(objectives)
}

fn method(document: &Document, root: &At<'_>) -> Result<Method, Error> {
    let at = root.key("method");
    match METHODS.into_iter().find(|name| *name == document.method) {
        Some(name) => method_named(name).ok_or_else(|| at.error(ErrorKind::NotAvailable(name))),
        None => {
            let unknown = unknown_name(&document.method, METHODS);
            Err(at.error(ErrorKind::Word { key: "method", unknown, expected: METHODS.to_vec() }))
        }
    }
}

fn read_rig(document: &Document, folder: &Path, root: &At<'_>) -> Result<Loaded, Error> {
    let rig = &document.rig;
    let path = if rig.starts_with("builtin:") { Path::new(rig).to_owned() } else { folder.join(rig) };
    let (scale, at) = (document.scale, root.key("scale"));
    number_that(scale, &at, |n| n > 0.0, SCALE.takes)?;
    if scale != 1.0 && !ikiru_formats::lacks_unit(&path) {
        return Err(at.error(ErrorKind::Scale(scale)));
    }
    ikiru_formats::read_scaled(path, scale).map_err(|e| root.key("rig").error(ErrorKind::Rig(e)))
}

/// An objective about joints that nothing active moves can only be met by chance: where none of them moves, or of those
/// whose motions count each by itself one does not.
fn warn_of_what_nothing_moves(
    rig: &Rig,
    problem: &Problem,
    objectives: &[ScenarioObjective],
    warnings: &mut Vec<Warning>,
) {
    let moves = |joint: JointId| problem.is_active(joint) && rig.get(joint).is_some_and(|j| j.n_dofs() > 0);
    for (idx, objective) in objectives.iter().enumerate() {
        // What does not fit the rig is told by the solve.
        let Ok(TermReads { frames, motions, parts, .. }) = problem.reads(&problem.terms()[idx]) else {
            continue;
        };
        let by_itself = parts.iter().all(|part| part.is_separable);
        let (alone, together) = if by_itself { (motions, Vec::new()) } else { (Vec::new(), motions) };
        let are_still = !frames.iter().any(|joint| rig.ancestors(*joint).any(moves));
        let are_still = are_still && !together.iter().any(|joint| moves(*joint));
        let still = frames.first().or(together.first()).copied().filter(|_| are_still);
        for joint in still.into_iter().chain(alone.into_iter().filter(|joint| !moves(*joint))) {
            warnings.push(Warning::OutOfHand {
                objective: idx + 1,
                kind: objective.kind,
                joint: name_of(rig, joint).to_owned(),
            });
        }
    }
}
