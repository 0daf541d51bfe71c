//! `[[objective]]`: what every kind has, as data, and what becomes of it in a problem.

use ikiru_rig::JointId;
use ikiru_solve::{Loss, Problem, TargetPath, TermId, Tolerance, When};
use serde::ser::Error as _;
use serde::{Serialize, Serializer};

use crate::at::At;
use crate::error::{Error, ErrorKind};
use crate::key::{self, Key};
use crate::keys::{TOLERANCE, TOLERANCE_DEG, is_false};
use crate::kinds::Kind;
use crate::scene::Scene;
use crate::table::{Table, Value};
use crate::term::{Adding, ScenarioTerm};
use crate::times::{Times, when};
use crate::values::number_that;

/// The weight of an objective that has none of its own.
pub(crate) const DEFAULT_WEIGHT: f64 = 1.0;

/// The keys of a kind that are read for every kind, since they belong to its term.
const TOLERANCES: [Key; 2] = [TOLERANCE, TOLERANCE_DEG];
const KIND: Key =
    Key::new("kind", "one of the objectives' kinds, such as 'position'", "What it wants: the kinds below.");
const WEIGHT: Key = Key::new(
    "weight",
    "a number of at least 0",
    "What the objective's cost counts for. With 1, a millimetre off costs 1e-6 and a degree 3.0e-4.",
)
.or_as("1; in a motion what meets the target");
const LOSS: Key = Key::new(
    "loss",
    "'squared', 'norm' or { huber = width }",
    "What a residual costs: its square, its length, or a square up to the width and linear beyond.",
)
.or("\"squared\"");
const MANDATORY: Key = Key::new("mandatory", "true or false", "Whether success asks for it.")
    .or_as("true, unless the kind says otherwise");
const HARD: Key =
    Key::new("hard", "true or false", "Whether it is a constraint rather than a wish.").or("false");
const LEVEL: Key = Key::new(
    "level",
    "a whole number of at least 1",
    "Its rank among wishes. Levels beyond 1 are refused for now.",
)
.or("1");
const HUBER: Key = Key::new(
    "huber",
    "the width where the loss turns from square to linear",
    "Where the loss turns from square to linear, above 0.",
);
/// The keys of every objective, whatever its kind.
pub(crate) const COMMON: [Key; 6] = [KIND, WEIGHT, LOSS, MANDATORY, HARD, LEVEL];
/// The level of an objective that has none of its own.
const FIRST_LEVEL: u32 = 1;

/// One `[[objective]]` of a scenario, as the text has it.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct ObjectiveEntry {
    /// What it wants: `kind`, and the keys of that kind.
    #[serde(flatten)]
    pub kind: Kind,
    /// The weight λ, at least 0. Left out it is 1, in a motion as much as meets the objective.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub weight: Option<f64>,
    /// The loss ρ; squared by default.
    #[serde(skip_serializing_if = "is_squared", serialize_with = "loss_keys")]
    pub loss: Loss,
    /// Whether success asks for it; left out, as the kind has it.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub mandatory: Option<bool>,
    /// Whether it is a constraint: it holds at the end within its tolerance, whatever else pulls, or the report names it;
    /// false by default. Weight, loss and `mandatory` then say nothing.
    #[serde(skip_serializing_if = "is_false")]
    pub hard: bool,
    /// Its rank, from 1, the default: what a lower level achieves, a higher one does not spoil. Levels beyond 1 are not yet solved
    /// for.
    #[serde(skip_serializing_if = "is_first_level")]
    pub level: u32,
    /// How near is near enough, metres; 0.001 by default, 0.0001 where it is hard. For kinds with a part in metres.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub tolerance: Option<f64>,
    /// How near is near enough, degrees; 0.5 by default, 0.01 where it is hard. For kinds with a part that is an angle.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub tolerance_deg: Option<f64>,
    /// When it holds, in a scenario with `[motion]`: as long as its path goes on, else at the end, unless it says so.
    #[serde(flatten)]
    pub times: Option<Times>,
}

/// One objective of a scenario, in the order of the text, which is that of the problem's terms.
#[derive(Clone, Debug)]
pub struct ScenarioObjective {
    /// Its kind, as the scenario has it.
    pub kind: &'static str,
    /// What reports call it as a constraint, where it is [hard](ikiru_solve::Term::hard): `objective`, but for kinds that
    /// are constraints by nature.
    pub constraint: &'static str,
    /// The joint that it is about; `None` where it names several, or takes all.
    pub joint: Option<JointId>,
    /// Line and column of the text where it stands, from 1; `None` where the scenario was made of a document.
    pub place: Option<(usize, usize)>,
    /// The weight that the scenario gives it. Without one it is 1; in a motion as much as meets the objective: see
    /// [`MotionScenario::plan`](crate::MotionScenario::plan).
    pub weight: Option<f64>,
    /// Its rank among wishes, from 1.
    pub level: u32,
    /// How near is near enough.
    pub tolerance: Tolerance,
    /// When it holds, in a scenario with `[motion]`; the last frame otherwise.
    pub when: When,
    /// What its target follows over time, in a scenario with `[motion]`; `None` for one that stays.
    pub path: Option<TargetPath>,
    pub(crate) term: ScenarioTerm,
}

impl ScenarioObjective {
    /// The id of its term, by which `scenario.problem[id]` is the objective itself; `None` where that is of another type.
    ///
    /// ```
    /// use ikiru_scenario::Scenario;
    /// use ikiru_solve::objectives::{LookAt, Position};
    ///
    /// let mut scenario = Scenario::builtin("paper_simple")?;
    /// let id = scenario.objectives[0].id::<Position>().expect("the paper's reach");
    /// scenario.problem[id].target.x = 0.4;
    /// assert!(scenario.objectives[0].id::<LookAt>().is_none());
    /// # Ok::<(), ikiru_scenario::Error>(())
    /// ```
    #[must_use]
    pub fn id<T: 'static>(&self) -> Option<TermId<T>> {
        self.term.id()
    }
}

impl ObjectiveEntry {
    /// An objective of some kind, with the default of everything else.
    #[must_use]
    pub fn new(kind: impl Into<Kind>) -> Self {
        Self {
            kind: kind.into(),
            weight: None,
            loss: Loss::Squared,
            mandatory: None,
            hard: false,
            level: FIRST_LEVEL,
            tolerance: None,
            tolerance_deg: None,
            times: None,
        }
    }

    pub(crate) fn read(table: &Table<'_>) -> Result<Self, Error> {
        let name = table.require(&KIND)?.word(KIND.name, Kind::NAMES)?;
        let [kind, common @ ..] = COMMON;
        let allowed = [&[kind], Kind::keys_of(name), &common, &Times::KEYS];
        // Which keys there are differs by kind.
        table.only(&allowed.concat()).map_err(|error| error.with_place_suffix(&format!(" ({name})")))?;
        let number = |key: Key| table.get(&key).map(|value| value.number()).transpose();
        let [tolerance, tolerance_deg] = TOLERANCES.map(number);
        Ok(Self {
            kind: Kind::read(name, table)?.ok_or_else(|| table.lacks(&KIND))?,
            weight: number(WEIGHT)?,
            loss: table.get(&LOSS).map_or(Ok(Loss::Squared), |value| read_loss(&value))?,
            mandatory: table.get(&MANDATORY).map(|value| value.truth()).transpose()?,
            hard: table.get(&HARD).map_or(Ok(false), |value| value.truth())?,
            level: table.get(&LEVEL).map_or(Ok(FIRST_LEVEL), |value| value.count())?,
            tolerance: tolerance?,
            tolerance_deg: tolerance_deg?,
            times: Times::read_if_there(table)?,
        })
    }

    /// Adds it to a problem as its last term, in the axes that the scenario gives targets in.
    pub(crate) fn add(
        &self,
        scene: Scene<'_>,
        problem: &mut Problem,
        at: &At<'_>,
    ) -> Result<ScenarioObjective, Error> {
        self.check_rank(at)?;
        let (weight, loss, tolerance) = (self.weight(at)?, self.checked_loss(at)?, self.tolerance(at)?);
        let added = self.kind.add(Adding { scene, problem: &mut *problem }, at)?;
        if let Some(term) = problem.terms_mut().last_mut() {
            term.weight = weight.unwrap_or(DEFAULT_WEIGHT);
            (term.loss, term.tolerance) = (loss, tolerance);
            term.mandatory = self.mandatory.unwrap_or(term.mandatory);
            term.hard = self.hard;
        }
        Ok(ScenarioObjective {
            kind: self.kind.name(),
            constraint: self.kind.constraint(),
            joint: added.joint,
            place: None,
            weight,
            level: self.level,
            tolerance,
            when: when(self.times, added.path.as_ref(), scene.timeline, at)?,
            path: added.path,
            term: added.term,
        })
    }

    fn weight(&self, at: &At<'_>) -> Result<Option<f64>, Error> {
        let fits = |weight| number_that(weight, &at.key(WEIGHT.name), |w| w >= 0.0, WEIGHT.takes);
        self.weight.map(fits).transpose()
    }

    /// What the solver cannot do yet is refused, rather than read and left out.
    fn check_rank(&self, at: &At<'_>) -> Result<(), Error> {
        let at_level = at.key("level");
        number_that(f64::from(self.level), &at_level, |level| level >= 1.0, LEVEL.takes)?;
        if self.level > FIRST_LEVEL {
            let (what, expected) = ("levels beyond 1 are", "'level' to be 1, or left out");
            return Err(at_level.error(ErrorKind::NotYet { what, expected }));
        }
        Ok(())
    }

    fn checked_loss(&self, at: &At<'_>) -> Result<Loss, Error> {
        if let Loss::Huber { width } = self.loss {
            number_that(width, &at.key(LOSS.name).key(HUBER.name), |w| w > 0.0, "a number above 0")?;
        }
        Ok(self.loss)
    }

    fn tolerance(&self, at: &At<'_>) -> Result<Tolerance, Error> {
        let expected = key::names(Kind::keys_of(self.kind.name()));
        let given = |found: Option<f64>, key: Key| {
            let Some(found) = found else { return Ok(None) };
            let at_key = at.key(key.name);
            if expected.contains(&key.name) {
                return number_that(found, &at_key, |n| n >= 0.0, key.takes).map(Some);
            }
            let place = format!("{} ({})", at.place(), self.kind.name());
            let unknown = ikiru_rig::unknown_name(key.name, expected.iter().copied());
            Err(at_key.key_error(ErrorKind::UnknownKey { place, unknown, expected: expected.clone() }))
        };
        let [metres, degrees] = TOLERANCES;
        let default = if self.hard { Tolerance::HARD } else { Tolerance::default() };
        Ok(Tolerance {
            metres: given(self.tolerance, metres)?.unwrap_or(default.metres),
            radians: given(self.tolerance_deg, degrees)?.map_or(default.radians, f64::to_radians),
        })
    }
}

fn read_loss(value: &Value<'_>) -> Result<Loss, Error> {
    if value.is_table() {
        let table = value.table()?;
        table.only(&[HUBER])?;
        let width = table.require(&HUBER)?;
        return Ok(Loss::Huber { width: width.number()? });
    }
    if value.text()? == "huber" {
        let expected = "a table with the width where the loss turns from square to linear, { huber = 0.1 }";
        return Err(value.error(ErrorKind::Type { key: "loss".to_owned(), found: "a string", expected }));
    }
    Ok(if value.word("loss", &["squared", "norm"])? == "norm" { Loss::Norm } else { Loss::Squared })
}

fn is_first_level(level: &u32) -> bool {
    *level == FIRST_LEVEL
}

fn is_squared(loss: &Loss) -> bool {
    *loss == Loss::Squared
}

/// A loss as the text has it.
fn loss_keys<S: Serializer>(loss: &Loss, serializer: S) -> Result<S::Ok, S::Error> {
    match loss {
        Loss::Squared => serializer.serialize_str("squared"),
        Loss::Norm => serializer.serialize_str("norm"),
        Loss::Huber { width } => serializer.collect_map([("huber", width)]),
        _ => Err(S::Error::custom(format!("scenarios have no word for the loss {loss:?}"))),
    }
}
