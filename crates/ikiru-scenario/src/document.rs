//! A scenario as plain data: what a text says, to look at, to change and to write back.

use std::path::Path;

use serde::de::Error as _;
use serde::{Deserialize, Deserializer, Serialize};
use toml::de::DeTable;

use crate::at::{At, Source};
use crate::error::{Error, ErrorKind};
use crate::key::Key;
use crate::keys::{TABLE, as_table};
use crate::limits::LimitKeys;
use crate::motion::MotionKeys;
use crate::objective::ObjectiveEntry;
use crate::start::GivenPose;
use crate::stop::StopKeys;
use crate::table::Table;
use crate::write::written;

/// A scenario as its text has it: names are names, angles are degrees, nothing is looked up or computed.
///
/// A document is read from a text and written as one: comments and the order of keys are lost, meaning is kept, and of every number every
/// bit. Fields are there to be changed; [`Scenario::from_document`](crate::Scenario::from_document) says whether what
/// came out makes sense. It serializes as the text has it too, to JSON for instance, and back.
///
/// ```
/// use ikiru_scenario::kinds::{Kind, PositionKeys};
/// use ikiru_scenario::{Document, ObjectiveEntry, Scenario, TargetKeys};
///
/// let target = TargetKeys::Target([0.35, 1.1, 0.35]);
/// let mut document = Document::new("builtin:human");
/// document.objectives.push(ObjectiveEntry::new(PositionKeys {
///     joint: "leftHand".to_owned(),
///     point: [0.0; 3],
///     target,
/// }));
/// let text = document.to_toml();
/// assert!(text.contains("kind = \"position\"\njoint = \"leftHand\"\ntarget = [0.35, 1.1, 0.35]"));
/// assert_eq!(Document::parse(&text, "reach.toml")?, document);
///
/// document.objectives[0].tolerance = Some(0.002);
/// let scenario = Scenario::from_document(&document, ".")?;
/// assert_eq!(scenario.objectives[0].tolerance.metres, 0.002);
/// # Ok::<(), ikiru_scenario::Error>(())
/// ```
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Document {
    /// The format's version: 1.
    pub version: u32,
    /// A built-in rig, `builtin:NAME`, or the path of a file, from the scenario's folder.
    pub rig: String,
    /// Metres in a unit of the rig's file, for formats that do not say; 1 by default.
    #[serde(skip_serializing_if = "is_one")]
    pub scale: f64,
    /// Whose axes targets are in: the key `world`.
    #[serde(skip_serializing_if = "TargetAxes::is_scene")]
    pub world: TargetAxes,
    /// Whether the body's root floats: `root = "free"`.
    #[serde(rename = "root", skip_serializing_if = "RootKey::is_as_in_file")]
    pub root: RootKey,
    /// `lm`, `adam`, `ccd`, `fabrik` or `ipopt`; `lm` by default.
    #[serde(skip_serializing_if = "is_default_method")]
    pub method: String,
    /// The joints that may move, by name or humanoid role; left out, all that can.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub active: Option<Vec<String>>,
    /// Which joint is which humanoid bone, before what the file, names and structure say: role and joint.
    #[serde(skip_serializing_if = "Vec::is_empty", serialize_with = "as_table")]
    pub roles: Vec<(String, String)>,
    /// How far joints may turn, by name or humanoid role: `[limits.NAME]`.
    #[serde(skip_serializing_if = "Vec::is_empty", serialize_with = "as_table")]
    pub limits: Vec<(String, LimitKeys)>,
    /// Where a solve starts; left out, at rest.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub start: Option<GivenPose>,
    /// What the pose or the motion should achieve: `[[objective]]`. A scenario has at least one.
    #[serde(rename = "objective", skip_serializing_if = "Vec::is_empty")]
    pub objectives: Vec<ObjectiveEntry>,
    /// For planning over time: `[motion]`.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub motion: Option<MotionKeys>,
    /// Stopping rules.
    #[serde(skip_serializing_if = "is_default_stop")]
    pub stop: StopKeys,
}

/// Whose axes targets are in.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize)]
#[serde(rename_all = "snake_case")]
#[non_exhaustive]
pub enum TargetAxes {
    /// `scene`: y up, facing +z.
    #[default]
    Scene,
    /// `file`: those of the file, where it is a URDF or VRM 0.x.
    File,
}

/// How the root of the body moves.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize)]
#[serde(rename_all = "snake_case")]
#[non_exhaustive]
pub enum RootKey {
    /// As the file has it: the key is left out.
    #[default]
    AsInFile,
    /// `free`: it floats.
    Free,
}

const VERSION_KEY: Key = Key::new("version", "the number 1, as in version = 1", "The format's version.");
const RIG: Key = Key::new(
    "rig",
    "a built-in rig such as 'builtin:human', or the path of a .glb, .gltf, .vrm, .bvh or .urdf file",
    "What is posed; paths are relative to the scenario's folder.",
);
const METHOD: Key = Key::new(
    "method",
    "'lm', 'adam', 'ccd', 'fabrik' or 'ipopt'",
    "How it is solved. All but `lm` are there to compare; `ipopt` only in builds that have it.",
)
.or("\"lm\"");
const ACTIVE: Key =
    Key::new("active", "a list of joints, by name or humanoid role", "The joints that may move.")
        .or_as("all that can");
const ROOT: Key = Key::new(
    "root",
    "'free'",
    "The root of the body floats: what carries everything that moves, a humanoid's hips, a robot's base. What moved above it is fixed.",
)
.or_as("as the file has it");
pub(crate) const SCALE: Key = Key::new(
    "scale",
    "a number above 0",
    "Metres in a unit of the rig's file, for formats that do not say: BVH.",
)
.or("1");
const WORLD: Key = Key::new(
    "world",
    "'scene' or 'file'",
    "Whose axes targets are in: y up and facing +z, or those of a URDF or VRM 0.x file.",
)
.or("\"scene\"");
const ROLES: Key =
    Key::new("roles", TABLE, "Which joint is which humanoid bone: below.").or_as("as the rig has them");
const LIMITS: Key =
    Key::new("limits", TABLE, "How far joints may turn: below.").or_as("as the file has them");
const START: Key = Key::new(
    "start",
    "a table of joints, [start], or the path of a pose's .json file",
    "Where a solve starts: below.",
)
.or_as("the rest pose");
const OBJECTIVE: Key = Key::new(
    "objective",
    "a list of tables, [[objective]]",
    "What the pose or the motion should achieve, at least one: below.",
);
const MOTION: Key = Key::new("motion", TABLE, "Makes a motion of it: below.").or_as("a single pose");
const STOP: Key = Key::new("stop", TABLE, "When a solve ends: below.").or_as("each key's own default");
/// The keys of a scenario.
pub(crate) const KEYS: [Key; 13] =
    [VERSION_KEY, RIG, METHOD, ACTIVE, ROOT, SCALE, WORLD, ROLES, LIMITS, START, OBJECTIVE, MOTION, STOP];
const VERSION: u32 = 1;
const DEFAULT_METHOD: &str = "lm";

impl Document {
    /// A document about a rig, without objectives and with the default of everything else.
    #[must_use]
    pub fn new(rig: impl Into<String>) -> Self {
        Self {
            version: VERSION,
            rig: rig.into(),
            scale: 1.0,
            world: TargetAxes::Scene,
            root: RootKey::AsInFile,
            method: DEFAULT_METHOD.to_owned(),
            active: None,
            roles: Vec::new(),
            limits: Vec::new(),
            start: None,
            objectives: Vec::new(),
            motion: None,
            stop: StopKeys::default(),
        }
    }

    /// Reads a scenario's file as a document.
    ///
    /// # Errors
    /// When the file cannot be read, and as [`parse`](Self::parse).
    pub fn read(path: impl AsRef<Path>) -> Result<Self, Error> {
        let (name, text) = read_text(path.as_ref())?;
        Self::parse(&text, &name)
    }

    /// Reads a scenario's text; `name` stands in messages.
    ///
    /// # Errors
    /// What no document can hold: invalid TOML, unknown and missing keys, values of another type or length, numbers that are not
    /// finite; with line and column. Whether names and numbers make sense is asked when a scenario is made of it.
    pub fn parse(text: &str, name: &str) -> Result<Self, Error> {
        let root = At::root(Source { name, text: Some(text) });
        let map = DeTable::parse(text).map_err(|error| {
            let byte = error.span().map_or(0, |span| span.start);
            root.error_at(byte, ErrorKind::Syntax(error.message().to_owned()))
        })?;
        Self::read_table(&Table::root(root, map.get_ref()))
    }

    fn read_table(table: &Table<'_>) -> Result<Self, Error> {
        table.require(&VERSION_KEY)?.version()?;
        table.only(&KEYS)?;
        let mut document = Self::new(table.require(&RIG)?.text()?);
        if let Some(scale) = table.get(&SCALE) {
            document.scale = scale.number()?;
        }
        if let Some(world) = table.get(&WORLD) {
            let is_file = world.word("world", &["scene", "file"])? == "file";
            document.world = if is_file { TargetAxes::File } else { TargetAxes::Scene };
        }
        if let Some(root) = table.get(&ROOT) {
            root.word("root", &["free"])?;
            document.root = RootKey::Free;
        }
        if let Some(method) = table.get(&METHOD) {
            document.method = method.text()?.to_owned();
        }
        document.active = table.get(&ACTIVE).map(|list| list.name_list()).transpose()?;
        for value in table.table(&ROLES)?.iter().flat_map(|roles| roles.entries("the name of a joint")) {
            document.roles.push((value.key.clone(), value.name()?));
        }
        for value in table.table(&LIMITS)?.iter().flat_map(|limits| limits.entries(TABLE)) {
            document.limits.push((value.key.clone(), LimitKeys::read(&value.table()?)?));
        }
        document.start = table.get(&START).map(|start| GivenPose::read(&start)).transpose()?;
        document.motion = table.table(&MOTION)?.map(|motion| MotionKeys::read(&motion)).transpose()?;
        document.stop = table.table(&STOP)?.map_or(Ok(StopKeys::default()), |stop| StopKeys::read(&stop))?;
        let list = table.get(&OBJECTIVE).map(|list| list.list(TABLE));
        for entry in list.transpose()?.unwrap_or_default() {
            document.objectives.push(ObjectiveEntry::read(&entry.table()?)?);
        }
        Ok(document)
    }

    /// The document as the text of a scenario file. What has its default is left out.
    #[must_use]
    pub fn to_toml(&self) -> String {
        written(&self.table())
    }

    /// As the text would have it. Numbers that are not finite stay what they are.
    pub(crate) fn table(&self) -> toml::Table {
        // Keys are strings and nothing is null: every document can be written.
        toml::Table::try_from(self).unwrap_or_default()
    }
}

impl<'de> Deserialize<'de> for Document {
    /// From whatever has the keys of the text: what the text refuses is refused here as well.
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        let text = written(&toml::Table::deserialize(deserializer)?);
        Self::parse(&text, "document").map_err(|error| {
            D::Error::custom(format_args!("{}: {}", error.key().unwrap_or("document"), error.kind()))
        })
    }
}

impl TargetAxes {
    fn is_scene(&self) -> bool {
        *self == Self::Scene
    }
}

impl RootKey {
    fn is_as_in_file(&self) -> bool {
        *self == Self::AsInFile
    }
}

fn is_one(scale: &f64) -> bool {
    *scale == 1.0
}

fn is_default_method(method: &str) -> bool {
    method == DEFAULT_METHOD
}

fn is_default_stop(stop: &StopKeys) -> bool {
    *stop == StopKeys::default()
}

/// A file's name for messages, and its text.
pub(crate) fn read_text(path: &Path) -> Result<(String, String), Error> {
    let name = path.display().to_string();
    let bytes = std::fs::read(path).map_err(|e| Error::new(&name, None, ErrorKind::Io(e)))?;
    let text = String::from_utf8(bytes).map_err(|_| Error::new(&name, None, ErrorKind::Utf8))?;
    Ok((name, text))
}
