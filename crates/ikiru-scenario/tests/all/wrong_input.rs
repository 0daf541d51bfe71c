//! Each wrong input alone: where the error points, and what it says.

use ikiru_scenario::{ErrorKind, Scenario};

const GOOD: &str = r#"version = 1
rig = "builtin:reference"
method = "lm"
active = ["left_shoulder", "left_elbow", "left_wrist"]
# root
[limits.left_elbow]
min_deg = [-45, -180, -10]
max_deg = [90, 5, 10]
[limits.left_wrist]
axis = [1, 0, 0]
swing_deg = [70, 40]
twist_deg = [-30, 30]
[start]
left_elbow = { euler_deg = [0, -30, 0] }
[[objective]]
kind = "position"
joint = "left_wrist"
target = [0.30, 0.20, 0.30]
loss = "norm"
tolerance = 0.001
[[objective]]
kind = "look_at"
joint = "left_wrist"
axis = [0, 1, 0]
length = 0.0915
offset_from_tip = [0, 1, 0]
weight = 0.03
[[objective]]
kind = "known_rotation"
joints = { left_elbow = { euler_deg = [0, 0, 0] } }
[stop]
cost_below = 0.005
max_iterations = 500
max_restarts = 64
max_time_ms = 50
"#;

/// One line of the good scenario replaced: the error must point to `line` and say all of `words`.
#[track_caller]
fn refused(line: usize, replacement: &str, at: (usize, usize), words: &[&str]) -> String {
    let mut lines: Vec<&str> = GOOD.lines().collect();
    lines[line - 1] = replacement;
    refused_text(&lines.join("\n"), at, words)
}

/// A text whose error must point to a line and column, and say all of `words`; the error's kind.
#[track_caller]
pub(crate) fn refused_text(text: &str, at: (usize, usize), words: &[&str]) -> String {
    let error = Scenario::parse(text, "test.toml", ".").map(drop).expect_err("it was accepted");
    let mut message = error.to_string();
    let mut source = std::error::Error::source(&error);
    while let Some(cause) = source {
        message += &format!(": {cause}");
        source = cause.source();
    }
    assert!(message.starts_with(&format!("test.toml:{}:{}: ", at.0, at.1)), "{message}");
    for word in words {
        assert!(message.contains(word), "'{word}' is missing in: {message}");
    }
    assert_eq!((error.line(), error.column(), error.file()), (Some(at.0), Some(at.1), "test.toml"));
    format!("{:?}", error.kind()).split([' ', '(']).next().unwrap_or_default().to_owned()
}

#[test]
fn the_good_one_is_good() {
    let scenario = Scenario::parse(GOOD, "test.toml", ".").unwrap();
    assert_eq!(scenario.warnings, []);
    assert_eq!(scenario.objectives.len(), 3);
    assert_eq!(scenario.method(), "lm");
}

#[test]
fn syntax() {
    assert_eq!(refused(2, "rig = \"builtin:reference", (2, 25), &["not valid TOML"]), "Syntax");
    refused(3, "method = ", (3, 10), &["not valid TOML"]);
    refused(9, "[limits.left_elbow]", (9, 9), &["not valid TOML", "duplicate"]);
}

#[test]
fn version() {
    assert_eq!(refused(1, "version = 2", (1, 11), &["version 2", "expected version = 1"]), "Version");
    assert_eq!(refused(1, "version = 1.0", (1, 11), &["expected version = 1"]), "Version");
    assert_eq!(refused(1, "version = \"1\"", (1, 11), &["a string", "the number 1"]), "Type");
    assert_eq!(refused(1, "", (1, 1), &["the scenario lacks 'version'", "version = 1"]), "MissingKey");
}

#[test]
fn unknown_keys() {
    let kind = refused(3, "metod = \"lm\"", (3, 1), &["no key 'metod'", "did you mean 'method'"]);
    assert_eq!(kind, "UnknownKey");
    refused(7, "min_degs = [-45, -180, -10]", (7, 1), &["[limits.left_elbow]", "did you mean 'min_deg'"]);
    refused(20, "tolerance_deg = 1", (20, 1), &["objective 1 (position)", "'tolerance'"]);
    refused(27, "weigth = 1", (27, 1), &["objective 2 (look_at)", "did you mean 'weight'"]);
    refused(32, "cost = 1", (32, 1), &["[stop]", "cost_below"]);
    refused(14, "left_elbow = { euler = [0, 0, 0] }", (14, 16), &["'euler_deg'"]);
    refused(5, "units = \"cm\"", (5, 1), &["no key 'units'", "'scale'"]);
}

#[test]
fn missing_keys() {
    assert_eq!(refused(2, "", (1, 1), &["lacks 'rig'", "builtin:human"]), "MissingKey");
    refused(16, "", (15, 1), &["objective 1 lacks 'kind'"]);
    refused(17, "", (15, 1), &["objective 1 lacks 'joint'"]);
    refused(18, "", (15, 1), &["objective 1 lacks 'target'"]);
    refused(24, "", (21, 1), &["objective 2 lacks 'axis'"]);
    refused(8, "", (6, 1), &["[limits.left_elbow] lacks 'max_deg'"]);
    refused(11, "", (9, 1), &["[limits.left_wrist] lacks 'swing_deg'"]);
    refused(30, "", (28, 1), &["objective 3 lacks 'joints'"]);
    let none = "version = 1\nrig = \"builtin:reference\"\n";
    refused_text(none, (1, 1), &["lacks 'objective'", "[[objective]]"]);
    refused_text(&format!("{none}objective = []\n"), (3, 13), &["at least one"]);
}

#[test]
fn wrong_types() {
    assert_eq!(refused(2, "rig = 3", (2, 7), &["'rig' is a number", ".glb"]), "Type");
    refused(4, "active = \"left_elbow\"", (4, 10), &["'active' is a string", "a list"]);
    refused(4, "active = [1]", (4, 11), &["a number", "name of a joint"]);
    refused(7, "min_deg = -45", (7, 11), &["three angles in degrees"]);
    refused(18, "target = [0.3, \"x\", 0]", (18, 16), &["'target' is a string", "a number"]);
    refused(18, "target = { x = 1 }", (18, 10), &["a table", "[x, y, z]"]);
    refused(19, "loss = true", (19, 8), &["true or false"]);
    refused(19, "loss = \"huber\"", (19, 8), &["{ huber = 0.1 }"]);
    refused(20, "mandatory = 1", (20, 13), &["'mandatory' is a number", "true or false"]);
    refused(33, "max_iterations = 10.5", (33, 18), &["a whole number"]);
    refused(13, "[limit]", (13, 2), &["no key 'limit'", "'limits'"]);
    refused_text(
        "version = 1\nrig = \"builtin:reference\"\nstop = 3\n",
        (3, 8),
        &["'stop' is a number", "a table"],
    );
}

#[test]
fn wrong_lengths() {
    assert_eq!(
        refused(
            18,
            "target = [0.3, 0.2]",
            (18, 10),
            &["2 entries", "a point of the world in metres, [x, y, z]"]
        ),
        "Length"
    );
    refused(11, "swing_deg = [70]", (11, 13), &["1 entries", "two half-widths"]);
    refused(4, "active = []", (4, 10), &["at least one joint"]);
    refused(30, "joints = {}", (30, 10), &["at least one joint"]);
}

#[test]
fn numbers_that_are_not_finite() {
    assert_eq!(refused(18, "target = [0.3, nan, 0]", (18, 16), &["'target' is nan"]), "NotFinite");
    refused(18, "target = [-inf, 0, 0]", (18, 11), &["'target' is -inf", "finite"]);
    refused(18, "target = [1e999, 0, 0]", (18, 11), &["finite"]);
    refused(7, "min_deg = [-45, -inf, -10]", (7, 17), &["finite"]);
    refused(27, "weight = inf", (27, 10), &["finite"]);
    refused(32, "cost_below = nan", (32, 14), &["finite"]);
}

#[test]
fn values_out_of_range() {
    assert_eq!(refused(27, "weight = -1", (27, 10), &["'weight' is -1", "at least 0"]), "OutOfRange");
    refused(20, "tolerance = -0.1", (20, 13), &["at least 0"]);
    refused(11, "swing_deg = [70, 181]", (11, 18), &["is 181", "0 to 180"]);
    refused(12, "twist_deg = [-200, 30]", (12, 14), &["-180 to 180"]);
    assert_eq!(refused(12, "twist_deg = [40, 30]", (12, 13), &["smallest twist is 40"]), "Order");
    assert_eq!(refused(8, "max_deg = [90, 5, -11]", (8, 11), &["angle about z", "-10", "-11"]), "Order");
    assert_eq!(refused(10, "axis = [0, 0, 0]", (10, 8), &["length 0"]), "NoLength");
    refused(24, "axis = [0, 0, 0]", (24, 8), &["length 0"]);
    refused(19, "loss = { huber = 0 }", (19, 18), &["above 0"]);
    refused(32, "cost_below = 0", (32, 14), &["above 0"]);
    refused(33, "max_iterations = 0", (33, 18), &["at least 1"]);
    refused(34, "max_restarts = -1", (34, 16), &["at least 0"]);
    refused(35, "max_time_ms = 0", (35, 15), &["above 0"]);
    refused(14, "left_elbow = { rotation = [0, 0, 0, 0] }", (14, 27), &["length 0", "[x, y, z, w]"]);
    assert_eq!(refused(5, "scale = 0.01", (5, 9), &["0.01", "in metres"]), "Scale");
}

#[test]
fn centres_of_cones() {
    let zero = "parent_rotation = [0, 0, 0, 0]";
    assert_eq!(refused(12, zero, (12, 19), &["'parent_rotation'", "length 0", "[x, y, z, w]"]), "NoLength");
    refused(12, "joint_rotation = [0, 0, 0, 0]", (12, 18), &["'joint_rotation'", "length 0"]);
    assert_eq!(refused(12, "joint_rotation = [0, 0, 1]", (12, 18), &["3 entries", "quaternion"]), "Length");
    assert_eq!(refused(12, "parent_rotation = \"x\"", (12, 19), &["a string", "quaternion"]), "Type");
    assert_eq!(refused(12, "parent_rotation = [0, 0, nan, 1]", (12, 26), &["is nan"]), "NotFinite");
    let near = &["[limits.left_wrist]", "did you mean 'parent_rotation'"];
    assert_eq!(refused(12, "parent_rotaton = [0, 0, 0, 1]", (12, 1), near), "UnknownKey");
    // Of a cone, and of nothing else.
    let beside = "max_deg = [90, 5, 10]\njoint_rotation = [0, 0, 0, 1]";
    assert_eq!(refused(8, beside, (6, 1), &["either 'min_deg' and 'max_deg'", "a cone"]), "Alternatives");
    refused_text(
        "version = 1\nrig = \"builtin:reference\"\n[limits.head]\nparent_rotation = [0, 0, 0, 1]\n",
        (3, 1),
        &["[limits.head] lacks 'axis'"],
    );
}

#[test]
fn roles() {
    let kind =
        refused(5, "[roles]\nleftHnad = \"left_wrist\"", (6, 1), &["'leftHnad'", "did you mean 'leftHand'"]);
    assert_eq!(kind, "UnknownRole");
    let far =
        refused(5, "[roles]\ntail = \"left_wrist\"", (6, 1), &["no humanoid role 'tail': expected one"]);
    assert_eq!(far, "UnknownRole");
    let near = &["no joint 'left_wirst'", "did you mean 'left_wrist'", "the leftHand"];
    assert_eq!(refused(5, "[roles]\nleftHand = \"left_wirst\"", (6, 12), near), "RoleOfNone");
    // A role is no joint.
    refused(5, "[roles]\nleftHand = \"rightHand\"", (6, 12), &["no joint 'rightHand'"]);
    let twice = "[roles]\nhead = \"neck\"\nleftHand = \"left_wrist\"\nrightHand = \"left_wrist\"";
    let both = &["'left_wrist' cannot be both leftHand and rightHand"];
    assert_eq!(refused(5, twice, (8, 13), both), "TwoRoles");
    assert_eq!(refused(5, "[roles]\nleftHand = 3", (6, 12), &["a number", "name of a joint"]), "Type");
    assert_eq!(refused(5, "roles = \"all\"", (5, 9), &["'roles' is a string", "a table"]), "Type");
    refused(5, "[roles]\nleftHand = \"left_wrist\"\nleftHand = \"head\"", (7, 1), &["duplicate"]);
    refused(5, "[role]", (5, 2), &["did you mean 'roles'"]);
}

#[test]
fn what_is_not_yet_solved_for() {
    let kind = refused(27, "level = 2", (27, 9), &["levels beyond 1 are not yet", "'level' to be 1"]);
    assert_eq!(kind, "NotYet");
    assert_eq!(refused(27, "level = 0", (27, 9), &["'level' is 0", "at least 1"]), "OutOfRange");
    refused(27, "level = -1", (27, 9), &["at least 1"]);
    refused(27, "level = 1.5", (27, 9), &["'level' is a number", "a whole number"]);
    refused(27, "hard = 1", (27, 8), &["'hard' is a number", "true or false"]);
    let asked = GOOD.replace("weight = 0.03", "weight = 0.03\nhard = true\nlevel = 1");
    assert!(Scenario::parse(&asked, "test.toml", ".").is_ok());
}

#[test]
fn unknown_names() {
    let kind = refused(17, "joint = \"left_wirst\"", (17, 9), &["'left_wirst'", "did you mean 'left_wrist'"]);
    assert_eq!(kind, "UnknownJoint");
    refused(4, "active = [\"left_elbow\", \"lefd_wrist\"]", (4, 25), &["did you mean 'left_wrist'"]);
    refused(6, "[limits.left_elbo]", (6, 9), &["did you mean 'left_elbow'"]);
    refused(14, "left_elbw = { euler_deg = [0, 0, 0] }", (14, 1), &["did you mean 'left_elbow'"]);
    refused(30, "joints = { elbow_left = { euler_deg = [0, 0, 0] } }", (30, 12), &["'elbow_left'"]);
    assert_eq!(refused(16, "kind = \"postion\"", (16, 8), &["did you mean 'position'"]), "Word");
    refused(19, "loss = \"square\"", (19, 8), &["did you mean 'squared'"]);
    refused(3, "method = \"ml\"", (3, 10), &["'lm'", "'adam'"]);
    refused(5, "root = \"fixed\"", (5, 8), &["expected 'free'"]);
    refused(5, "world = \"files\"", (5, 9), &["'scene' or 'file'"]);
    assert_eq!(refused(2, "rig = \"builtin:humen\"", (2, 7), &["cannot be read", "builtin:human"]), "Rig");
    refused(2, "rig = \"no/such.glb\"", (2, 7), &["cannot be read", "no/such.glb"]);
    refused(2, "rig = \"skeleton.fbx\"", (2, 7), &[".fbx", ".vrm"]);
}

#[test]
#[cfg(not(feature = "ipopt"))]
fn a_method_left_out_says_how_to_get_it() {
    let says = ["feature 'ipopt'", "coinor-libipopt-dev", "use 'lm', 'adam', 'ccd' or 'fabrik'"];
    assert_eq!(refused(3, "method = \"ipopt\"", (3, 10), &says), "NotAvailable");
}

#[test]
fn what_does_not_go_together() {
    let both = "axis = [1, 0, 0]\nmin_deg = [0, 0, 0]";
    assert_eq!(refused(10, both, (9, 1), &["either 'min_deg' and 'max_deg'"]), "Alternatives");
    refused(26, "", (21, 1), &["one of 'target'"]);
    refused(25, "length = 1\ntarget = [1, 0, 0]", (21, 1), &["one of 'target'"]);
    let turn = "[[objective]]\nkind = \"orientation\"\njoint = \"head\"";
    refused(20, turn, (20, 1), &["objective 2 has neither", "either 'target_rotation'"]);
    refused(14, "left_elbow = {}", (14, 14), &["no value", "'euler_deg'"]);
    refused(14, "left_elbow = { euler_deg = [0, 0, 0], angle_deg = 3 }", (14, 14), &["'angle_deg'"]);
    let kind = refused(14, "left_elbow = { angle_deg = 3 }", (14, 16), &["Euler joint", "'euler_deg'"]);
    assert_eq!(kind, "Unfit");
    refused(14, "root_translation = [0, 1, 0]", (14, 1), &["root = \"free\""]);
    let euler_root = "root = \"free\"\n[limits.pelvis]\nmin_deg = [0, 0, 0]\nmax_deg = [0, 0, 0]";
    refused(5, euler_root, (6, 9), &["'pelvis'", "a cone"]);
    assert_eq!(
        refused(4, "active = [\"left_elbow\", \"left_elbow\"]", (4, 25), &["expected it once"]),
        "Twice"
    );
}

#[test]
fn a_role_and_a_name_of_one_joint() {
    let text = |more: &str| {
        format!(
            "version = 1\nrig = \"builtin:human\"\n{more}\n[[objective]]\nkind = \"position\"\njoint = \"leftHand\"\ntarget = [0, 1, 0]\n"
        )
    };
    let limits = "[limits.hand_l]\nmin_deg = [0, 0, 0]\nmax_deg = [0, 0, 0]\n[limits.leftHand]\naxis = [1, 0, 0]\nswing_deg = [1, 1]";
    assert_eq!(refused_text(&text(limits), (6, 9), &["the same joint as 'hand_l'"]), "Twice");
    assert_eq!(
        refused_text(&text("active = [\"Armature\"]"), (3, 11), &["'Armature' does not move", "limits"]),
        "Immobile"
    );
    let start = "[start]\nhand_l = { rotation = [0, 0, 0, 1] }\nleftHand = { rotation = [0, 0, 0, 1] }";
    assert_eq!(refused_text(&text(start), (5, 1), &["the same joint"]), "Twice");
    let fixed = "[start]\nArmature = { euler_deg = [0, 0, 0] }";
    assert_eq!(refused_text(&text(fixed), (4, 14), &["fixed", "does not move"]), "Unfit");
}

#[test]
fn files_that_are_none() {
    let folder = tempfile::tempdir().unwrap();
    let missing = Scenario::read(folder.path().join("none.toml")).unwrap_err();
    assert!(matches!(missing.kind(), ErrorKind::Io(_)) && missing.to_string().contains("none.toml"));
    let path = folder.path().join("latin.toml");
    std::fs::write(&path, b"version = 1 # \xe9").unwrap();
    assert!(matches!(Scenario::read(&path).unwrap_err().kind(), ErrorKind::Utf8));
    assert!(Scenario::builtin("demmo").unwrap_err().to_string().contains("'demo'"));
}
